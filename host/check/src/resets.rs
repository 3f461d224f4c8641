//! Resets: the time without a pulse, the state afterwards, and settings that are saved while the reset comes.
//!
//! `save` writes the EEPROM byte by byte, for some hundred milliseconds. A reset at any moment of that must leave the old settings or the new
//! ones. Only `max_width_mm` is changed for this, and put back at the end.

use crate::error::CheckError;
use crate::servo::{self, ORIGIN};
use crate::tester::{Tester, ms};
use crate::wiring::{Weeder, reset};
use control::alarm::Alarm;
use link::{ConsoleLine, Mode};
use tester_core::message::Command;
use uno::CYCLES_PER_SECOND;

/// Time for which the reset is pulled, in ms.
const PULLED_MS: u32 = 20;

/// Time in which the firmware starts behind its bootloader, in ms.
const START_MS: u32 = 3000;

/// The same for a virtual Uno, which has none.
const SIMULATED_START_MS: u32 = 300;

/// The resets come within this time of the command, in ms. A byte takes 3.4 ms, and in simulation a changed number is there after 50 ms.
const SAVE_MS: u32 = 120;

/// The longest time that a save of all settings takes, in ms.
const SAVED_MS: u32 = 1000;

/// The setting that is changed.
const SETTING: &str = "max_width_mm";

/// What came of a reset at work.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct AtWork {
    /// From the last pulse's end to the first one's beginning behind the release, in ms by the weeder's clock; infinite if none came.
    pub without_pulse_ms: f64,
    /// Whether the first pulse is for out, and the weeder is not at work.
    pub is_out: bool,
}

/// Pulls the reset at work with the tool in.
///
/// # Errors
/// If a board does not answer.
pub fn at_work(
    weeder: &mut Weeder,
    tester: &mut Tester,
    clock_ratio: f64,
    is_simulated: bool,
) -> Result<AtWork, CheckError> {
    weeder.to_hold()?;
    weeder.ask("start now")?;
    tester.record_for_ms(300)?;
    let pulled = tester.command(&Command::Reset { pulled: true })?.time;
    let mut records = tester.record_for_ms(PULLED_MS)?;
    let released = tester.command(&Command::Reset { pulled: false })?.time;
    records.extend(tester.record_for_ms(if is_simulated { SIMULATED_START_MS } else { START_MS })?);
    weeder.greeting()?;
    let status = weeder.status()?;
    let pulses = servo::pulses(&records, pulled);
    let release = ORIGIN + u64::from(released.wrapping_sub(pulled));
    let last = pulses.iter().rev().find(|measured| measured.pulse.rise < release);
    let first = pulses.iter().find(|measured| measured.pulse.rise >= release);
    let cycles = first.map(|first| first.pulse.rise - last.map_or(ORIGIN, |last| last.pulse.fall));
    let ms = |cycles: u64| cycles as f64 * 1000.0 / CYCLES_PER_SECOND as f64 * clock_ratio;
    let is_wide = first.is_some_and(|first| first.pulse.width_us() * clock_ratio > 1750.0);
    Ok(AtWork {
        without_pulse_ms: cycles.map_or(f64::INFINITY, ms),
        is_out: is_wide && status.mode != Mode::Work && status.tool_out,
    })
}

/// What came of resets while settings were saved.
#[derive(Clone, Copy, Debug, Default, PartialEq, Eq)]
pub struct Saves {
    /// Resets.
    pub resets: u32,
    /// Behind so many of them the settings were neither the old ones nor the new ones.
    pub torn: u32,
    /// Behind so many the new ones were there.
    pub new: u32,
}

/// Saves settings, and pulls the reset at so many moments from the command on until the save has ended.
///
/// # Errors
/// If a board does not answer, or refuses.
pub fn while_saving(moments: u32, weeder: &mut Weeder, tester: &mut Tester) -> Result<Saves, CheckError> {
    reset(weeder, tester)?;
    let kept = value(weeder)?;
    save(weeder, tester, kept)?;
    let (mut saved, mut saves) = (kept, Saves { resets: moments, ..Saves::default() });
    for moment in 0..moments {
        let wanted = if saved == 300 + moment { 299 } else { 300 + moment };
        weeder.ask(&format!("set {SETTING} {wanted}"))?;
        let typed = tester.command(&Command::Clock)?.time;
        weeder.send("save")?;
        let wait = ms(SAVE_MS) / moments * moment;
        while tester.command(&Command::Clock)?.time.wrapping_sub(typed) < wait {}
        reset(weeder, tester)?;
        let found = value(weeder)?;
        let is_lost = weeder.status()?.alarm == Some(Alarm::SettingsLost);
        saves.torn += u32::from(is_lost || (found != saved && found != wanted));
        saves.new += u32::from(found == wanted);
        saved = found;
    }
    save(weeder, tester, kept)?;
    Ok(saves)
}

/// The setting's value.
fn value(weeder: &mut Weeder) -> Result<u32, CheckError> {
    let lines = weeder.ask(&format!("get {SETTING}"))?;
    let value = lines.iter().find_map(|line| match ConsoleLine::parse(line) {
        ConsoleLine::Setting(setting) => Some(setting.value.into()),
        _ => None,
    });
    value.ok_or(CheckError::Answer("get"))
}

/// Saves this value, and waits until it is there.
fn save(weeder: &mut Weeder, tester: &mut Tester, value: u32) -> Result<(), CheckError> {
    weeder.ask(&format!("set {SETTING} {value}"))?;
    weeder.ask("save")?;
    tester.record_for_ms(SAVED_MS)?;
    Ok(())
}
