//! Resets: the time without a pulse, the state afterwards, and resets during a save.
//!
//! `save` writes the EEPROM byte by byte, for some hundred milliseconds. A reset at any moment of that must leave the
//! old or the new settings. Only `max_width_mm` is changed for this, and restored at the end.

use crate::error::CheckError;
use crate::plan::Plan;
use crate::servo::{self, ORIGIN};
use crate::tester::{Tester, ms};
use crate::wiring::{self, Weeder, reset};
use control::alarm::Alarm;
use control::ground::examples::EXAMPLES;
use link::examples::{self, Taught};
use link::{ConsoleLine, Mode};
use tester_core::message::Command;
use uno::{CYCLES_PER_SECOND, Pulse};

/// The weeder's rate when it is reset at work: 1.9 km/h with the factory settings' wheel, for as many counts as fit
/// into the tester.
const ROLL_COUNTS_PER_S: f64 = 1000.0;
const ROLL_COUNTS: i32 = 8000;

/// Time for which the reset is pulled, in ms.
const PULLED_MS: u32 = 20;

/// Time limit of the firmware's start after its bootloader, in ms.
const START_MS: u32 = 3000;

/// The same for a virtual Uno, which has no bootloader: the heartbeat's 200 ms are the longest part of it.
const SIMULATED_START_MS: u32 = 500;

/// At the end of this time, pulses must have come for this long, in ms: five frames.
const AGAIN_MS: u32 = 100;

/// The resets come within this time of the command, in ms. A byte takes 3.4 ms, and in simulation a changed number is
/// there after 50 ms.
const SAVE_MS: u32 = 120;

/// The longest time of a save of all settings, in ms.
const SAVED_MS: u32 = 1000;

/// The setting that is changed.
const SETTING: &str = "max_width_mm";

/// How the weeder is reset.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub enum ResetBy {
    /// The tester pulls the reset.
    Pin,
    /// The computer opens the port, which resets the weeder through the modem line DTR.
    Port,
    /// `test watchdog` ends the main loop's heartbeat, in hold.
    Watchdog,
}

/// The result of a reset.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct Restart {
    /// From the last pulse's end to the beginning of the first one after the reset, in ms by the weeder's clock;
    /// infinite without one.
    pub without_pulse_ms: f64,
    /// Whether all pulses after it are for out, and the weeder is not at work.
    pub is_out: bool,
}

/// Resets the weeder, if possible at work, while it rolls with the tool in.
///
/// # Errors
/// If a board does not answer.
pub fn restart(
    reset_by: ResetBy,
    weeder: &mut Weeder,
    tester: &mut Tester,
    clock_ratio: f64,
    is_simulated: bool,
) -> Result<Restart, CheckError> {
    weeder.to_hold()?;
    if reset_by != ResetBy::Watchdog {
        weeder.ask("start now")?;
        let mut plan = Plan::new();
        plan.roll(ROLL_COUNTS, ROLL_COUNTS_PER_S);
        tester.begin(&plan.finish())?;
    }
    let mut records = tester.record_for_ms(300)?;
    let reset = tester.command(&Command::Clock)?.time;
    match reset_by {
        ResetBy::Pin => {
            tester.command(&Command::Reset { pulled: true })?;
            records.extend(tester.record_for_ms(PULLED_MS)?);
            tester.command(&Command::Reset { pulled: false })?;
        }
        ResetBy::Port => weeder.open_again()?,
        ResetBy::Watchdog => weeder.send("test watchdog")?,
    }
    records.extend(tester.record_for_ms(if is_simulated { SIMULATED_START_MS } else { START_MS })?);
    let ended = tester.command(&Command::Clock)?.time;
    if reset_by != ResetBy::Port && !weeder.greeting()? {
        // If the weeder does not restart, the check still goes on.
        wiring::reset(weeder, tester)?;
    }
    tester.command(&Command::Stop)?;
    let status = weeder.status()?;
    let pulses = servo::pulses(&records, reset);
    // During the reset, pulses are missing. A running machine has one every 20 ms.
    let gap = |number: &usize| pulses[number + 1].rise - pulses[*number].fall;
    let longest = (0..pulses.len().saturating_sub(1)).max_by_key(gap);
    let again = ORIGIN + u64::from(ended.wrapping_sub(reset).saturating_sub(ms(AGAIN_MS)));
    let longest = longest.filter(|_| pulses.last().is_some_and(|last| last.rise > again));
    let in_ms = |cycles: u64| cycles as f64 * 1000.0 / CYCLES_PER_SECOND as f64 * clock_ratio;
    let is_wide = |pulse: &Pulse| pulse.width_us() * clock_ratio > 1750.0;
    let stays_out = longest.is_some_and(|number| pulses[number + 1..].iter().all(is_wide));
    Ok(Restart {
        without_pulse_ms: longest.map_or(f64::INFINITY, |number| in_ms(gap(&number))),
        is_out: stays_out && status.mode != Mode::Work && status.tool_out,
    })
}

/// Data that a reset must not change: the saved settings and the taught examples, as the console shows them.
#[derive(Clone, Debug, PartialEq, Eq)]
pub struct Kept {
    settings: Vec<(String, u16)>,
    examples: Vec<(u16, Taught)>,
}

impl Kept {
    /// The weeder's data after a reset.
    ///
    /// # Errors
    /// If a board does not answer, or the weeder was built with other examples than this program.
    pub fn read(weeder: &mut Weeder, tester: &mut Tester) -> Result<Self, CheckError> {
        reset(weeder, tester)?;
        let setting = |line: &String| match ConsoleLine::parse(line) {
            ConsoleLine::Setting { name, value, .. } => Some((name, value)),
            _ => None,
        };
        Ok(Self {
            settings: weeder.ask("get")?.iter().filter_map(setting).collect(),
            examples: examples::read(weeder)?,
        })
    }

    /// How many of them are missing or changed in `later`.
    pub fn lost(&self, later: &Self) -> usize {
        let settings = self.settings.iter().filter(|setting| !later.settings.contains(setting));
        let examples = self.examples.iter().filter(|example| !later.examples.contains(example));
        settings.count() + examples.count()
    }
}

/// Runs a trial while the weeder has at least one taught example, so that one can be lost. If it has none, one is
/// taught and then forgotten.
///
/// # Errors
/// The errors of the trial, or if the weeder refuses the example or does not forget it.
pub fn with_an_example<T>(
    weeder: &mut Weeder,
    tester: &mut Tester,
    try_it: impl FnOnce(&mut Weeder, &mut Tester) -> Result<T, CheckError>,
) -> Result<T, CheckError> {
    weeder.to_hold()?;
    let is_taught = examples::read(weeder)?.is_empty();
    if is_taught {
        examples::push(weeder, &EXAMPLES[..1], false)?;
    }
    let tried = try_it(weeder, tester);
    if is_taught {
        weeder.to_hold()?;
        weeder.ask("forget all")?;
    }
    tried
}

/// The results of resets during a save.
#[derive(Clone, Copy, Debug, Default, PartialEq, Eq)]
pub struct Saves {
    /// Resets after which the settings were neither the old nor the new ones.
    pub torn: u32,
    /// Resets after which the new settings were there.
    pub new: u32,
}

/// Saves settings, and pulls the reset at this number of moments, from the command until the save has ended.
///
/// # Errors
/// If a board does not answer, or refuses.
pub fn while_saving(moments: u32, weeder: &mut Weeder, tester: &mut Tester) -> Result<Saves, CheckError> {
    reset(weeder, tester)?;
    let kept = value(weeder)?;
    save(weeder, tester, kept)?;
    // The old value is restored, also after an error.
    let saves = saves(moments, kept, weeder, tester);
    save(weeder, tester, kept)?;
    saves
}

fn saves(moments: u32, kept: u32, weeder: &mut Weeder, tester: &mut Tester) -> Result<Saves, CheckError> {
    let (mut saved, mut saves) = (kept, Saves::default());
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
    Ok(saves)
}

/// The setting's value.
fn value(weeder: &mut Weeder) -> Result<u32, CheckError> {
    let lines = weeder.ask(&format!("get {SETTING}"))?;
    let value = lines.iter().find_map(|line| match ConsoleLine::parse(line) {
        ConsoleLine::Setting { value, .. } => Some(value.into()),
        _ => None,
    });
    value.ok_or(CheckError::Answer("get"))
}

/// Saves this value, and waits until it is stored.
fn save(weeder: &mut Weeder, tester: &mut Tester, value: u32) -> Result<(), CheckError> {
    weeder.ask(&format!("set {SETTING} {value}"))?;
    weeder.ask("save")?;
    tester.record_for_ms(SAVED_MS)?;
    Ok(())
}
