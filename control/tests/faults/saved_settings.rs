//! Saved settings at start-up, valid or contradicting each other.

use crate::common::{ByWidth, LEAST_HOLD_MM};
use control::{
    alarm::{Alarm, Warning},
    measure::reset::Cause,
    memory::{SIZE, Volatile},
    operate::{command_error::CommandError, event::Event, saved::SavedSettings, state::State},
    settings::{Setting, Settings},
};
use rig::{Beams, Rig};

#[test]
fn saved_settings_are_in_use_after_a_restart() {
    let mut settings = Settings::new();
    settings.set(Setting::K, 7).unwrap();
    let machine = Rig::wake(ByWidth::new(LEAST_HOLD_MM, 0), saved(&settings), Cause::PowerOn);
    assert_eq!((machine.state(), machine.settings()), (State::Hold, &settings));
}

/// A memory with these settings, valid or not.
fn saved(settings: &Settings) -> Volatile {
    let mut saved = SavedSettings::new(Volatile::new());
    saved.save();
    while !saved.carry_on(settings) {}
    saved.into_memory()
}

#[test]
fn a_changed_saved_copy_is_a_warning_until_the_next_save() {
    let mut saved = SavedSettings::new(self::saved(&Settings::new()));
    saved.load();
    let mut settings = Settings::new();
    settings.set(Setting::K, 7).unwrap();
    saved.save();
    while !saved.carry_on(&settings) {}
    let mut memory = saved.into_memory();
    let wake = |memory: &Volatile| Rig::wake(ByWidth::new(LEAST_HOLD_MM, 0), memory.clone(), Cause::PowerOn);
    let mut sound = wake(&memory);
    assert_eq!((sound.events(), sound.present_warning(), sound.settings()), (vec![], None, &settings));
    // The second save overwrote the second copy.
    memory.bytes[SIZE / 2 + 20] ^= 4;
    let mut machine = wake(&memory);
    assert_eq!(machine.settings().get(Setting::K), Settings::new().get(Setting::K), "the older ones are in use");
    assert_eq!(machine.events(), [Event::Warning(Warning::SettingsOlder)], "also while events are off");
    assert!(machine.ask("status")[1].ends_with(" warning=settings_older"));
    machine.save().unwrap();
    assert_eq!(machine.present_warning(), None);
}

#[test]
fn a_dry_run_refused_for_contradicting_settings_keeps_the_open_detection() {
    let mut settings = Settings::new();
    settings.set(Setting::ServoInUs, 2000).unwrap();
    let mut machine = Rig::wake(ByWidth::new(LEAST_HOLD_MM, 0), saved(&settings), Cause::PowerOn);
    machine.clear();
    machine.turn();
    machine.see(Beams::one(true));
    machine.turn_after(1000);
    assert_eq!(machine.zones(), 1);
    assert_eq!(machine.test_row(500), Err(CommandError::PulsesEqual));
    assert_eq!(machine.zones(), 1);
}

#[test]
fn contradictory_saved_settings_are_an_alarm_and_do_not_start() {
    let mut settings = Settings::new();
    settings.set(Setting::ServoInUs, 2000).unwrap();
    settings.set(Setting::BeamToToolMm, 200).unwrap();
    let mut machine = Rig::wake(ByWidth::new(LEAST_HOLD_MM, 0), saved(&settings), Cause::PowerOn);
    assert_eq!(machine.state(), State::Alarm(Alarm::SettingsContradict));
    machine.clear();
    assert_eq!(machine.start(false), Err(CommandError::PulsesEqual));
    assert_eq!(machine.save(), Err(CommandError::PulsesEqual));
    // The switch does not start it either.
    machine.readings.switch_on = true;
    machine.stand(100);
    assert_eq!(machine.state(), State::Alarm(Alarm::SettingsContradict));
    machine.clear();
    // They can be corrected one at a time.
    machine.set(Setting::ServoInUs, 1500).unwrap();
    assert_eq!((machine.start(false), machine.needed_mm()), (Err(CommandError::BeamTooNear), 389));
    machine.set(Setting::BeamToToolMm, 400).unwrap();
    assert_eq!(machine.start(false), Ok(()));
}

#[test]
fn with_both_copies_changed_no_older_settings_are_told() {
    let mut memory = saved(&Settings::new());
    memory.bytes[20] ^= 4;
    memory.bytes[SIZE / 2 + 20] ^= 4;
    let mut machine = Rig::wake(ByWidth::new(LEAST_HOLD_MM, 0), memory, Cause::PowerOn);
    assert_eq!(machine.state(), State::Alarm(Alarm::SettingsLost));
    assert_eq!((machine.present_warning(), machine.events()), (None, vec![]));
}
