//! Resets: the time without a pulse, the state afterwards, and resets during a save.
//!
//! `save` writes the EEPROM byte by byte, for some hundred milliseconds. A reset at any moment of that must leave the
//! old or the new settings. Only `max_width_mm` is changed for this, and restored at the end.

use crate::plan::Plan;
use crate::servo::{self, ORIGIN};
use crate::tester::ms;
use crate::{Boards, CheckError};
use control::alarm::Alarm;
use control::ground::examples::EXAMPLES;
use control::settings::Setting;
use link::examples::{self, Taught};
use link::{Mode, settings};
use tester_core::message::Command;

/// The rate when the weeder is reset at work: 1.9 km/h with the factory settings' wheel, for as many counts as fit.
const ROLL_COUNTS_PER_S: f64 = 1000.0;
const ROLL_COUNTS: i32 = 8000;

const PULLED_MS: u32 = 20;

/// Time limit of the firmware's start after its bootloader, in ms.
const START_MS: u32 = 3000;

/// The same for a virtual Uno, which has no bootloader: the heartbeat's 200 ms are the longest part of it.
const SIMULATED_START_MS: u32 = 500;

/// At the end of this time, pulses must have come for this long, in ms: five frames.
const AGAIN_MS: u32 = 100;

/// The resets come within this time of the command, in ms. A byte takes 3.4 ms, a changed number in simulation 50 ms.
const SAVE_MS: u32 = 120;

/// The longest time of a save of all settings, in ms.
const SAVED_MS: u32 = 1000;

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
    /// From the last pulse's end to the first one after the reset, in ms by the weeder's clock; infinite without one.
    pub without_pulse_ms: f64,
    /// Whether all pulses after it are for out, and the weeder is not at work.
    pub is_out: bool,
}

/// Data that a reset must not change: the saved settings and the taught examples, as the console shows them.
#[derive(Clone, Debug, PartialEq, Eq)]
pub struct Kept {
    settings: Vec<(Setting, u16)>,
    examples: Vec<(u16, Taught)>,
}

impl Kept {
    /// The weeder's data after a reset.
    ///
    /// # Errors
    /// If a board does not answer, or the weeder was built with other examples than this program.
    pub fn read(boards: &mut Boards) -> Result<Self, CheckError> {
        boards.reset()?;
        Ok(Self {
            settings: boards.weeder.ask("get")?.iter().filter_map(|line| settings::shown(line)).collect(),
            examples: examples::read(&mut boards.weeder)?.taught,
        })
    }

    /// How many of them are missing or changed in `later`.
    pub fn lost(&self, later: &Self) -> usize {
        let settings = self.settings.iter().filter(|setting| !later.settings.contains(setting));
        let examples = self.examples.iter().filter(|example| !later.examples.contains(example));
        settings.count() + examples.count()
    }
}

/// The results of resets during a save.
#[derive(Clone, Copy, Debug, Default, PartialEq, Eq)]
pub struct Saves {
    /// Resets after which the settings were neither the old nor the new ones.
    pub torn: u32,
    /// Resets after which the new settings were there.
    pub new: u32,
}

impl Boards {
    /// Resets the weeder, if possible at work, while it rolls with the tool in.
    pub fn restart(&mut self, reset_by: ResetBy, is_simulated: bool) -> Result<Restart, CheckError> {
        self.weeder.to_hold()?;
        if reset_by != ResetBy::Watchdog {
            self.weeder.ask("start now")?;
            let mut plan = Plan::default();
            plan.roll(ROLL_COUNTS, ROLL_COUNTS_PER_S);
            self.tester.begin(&plan.finish())?;
        }
        let mut records = self.tester.record_for_ms(300)?;
        let reset = self.tester.command(&Command::Clock)?.time;
        match reset_by {
            ResetBy::Pin => {
                self.tester.command(&Command::Reset { pulled: true })?;
                records.extend(self.tester.record_for_ms(PULLED_MS)?);
                self.tester.command(&Command::Reset { pulled: false })?;
            }
            ResetBy::Port => self.weeder.open_again()?,
            ResetBy::Watchdog => self.weeder.send("test watchdog")?,
        }
        records.extend(self.tester.record_for_ms(if is_simulated { SIMULATED_START_MS } else { START_MS })?);
        let ended = self.tester.command(&Command::Clock)?.time;
        if reset_by != ResetBy::Port && !self.weeder.greeting()? {
            // If the weeder does not restart, the check still goes on.
            self.reset()?;
        }
        self.tester.command(&Command::Stop)?;
        let status = self.weeder.status()?;
        let pulses = servo::pulses(&records, reset);
        // During the reset, pulses are missing. A running machine has one every 20 ms.
        let gap = |number: &usize| pulses[number + 1].rise - pulses[*number].fall;
        let longest = (0..pulses.len().saturating_sub(1)).max_by_key(gap);
        let again = ORIGIN + u64::from(ended.wrapping_sub(reset).saturating_sub(ms(AGAIN_MS)));
        let longest = longest.filter(|_| pulses.last().is_some_and(|last| last.rise > again));
        let stays_out = longest.is_some_and(|number| pulses[number + 1..].iter().all(|pulse| self.is_out(pulse)));
        Ok(Restart {
            without_pulse_ms: longest.map_or(f64::INFINITY, |number| self.weeder_ms(gap(&number))),
            is_out: stays_out && status.mode != Mode::Work && status.tool_out,
        })
    }

    /// Tries something while the weeder has a taught example to lose. If it has none, one is taught and then forgotten.
    ///
    /// # Errors
    /// The errors of the pass, or if the weeder refuses the example or does not forget it.
    pub fn with_an_example<T>(
        &mut self,
        try_it: impl FnOnce(&mut Self) -> Result<T, CheckError>,
    ) -> Result<T, CheckError> {
        self.weeder.to_hold()?;
        let is_taught = examples::read(&mut self.weeder)?.taught.is_empty();
        if is_taught {
            examples::push(&mut self.weeder, &EXAMPLES[..1], false)?;
        }
        let tried = try_it(self);
        if is_taught {
            self.weeder.to_hold()?;
            self.weeder.ask("forget all")?;
        }
        tried
    }

    /// Saves settings, and pulls the reset at this number of moments, from the command until the save has ended.
    pub fn reset_while_saving(&mut self, moments: u32) -> Result<Saves, CheckError> {
        self.reset()?;
        let kept = self.setting()?;
        self.save(kept)?;
        // The old value is restored, also after an error.
        let saves = self.saves(moments, kept);
        self.save(kept)?;
        saves
    }

    fn saves(&mut self, moments: u32, kept: u32) -> Result<Saves, CheckError> {
        let (mut saved, mut saves) = (kept, Saves::default());
        for moment in 0..moments {
            let wanted = if saved == 300 + moment { 299 } else { 300 + moment };
            self.weeder.ask(&format!("set {SETTING} {wanted}"))?;
            let typed = self.tester.command(&Command::Clock)?.time;
            self.weeder.send("save")?;
            let wait = ms(SAVE_MS) / moments * moment;
            while self.tester.command(&Command::Clock)?.time.wrapping_sub(typed) < wait {}
            self.reset()?;
            let found = self.setting()?;
            let is_lost = self.weeder.status()?.alarm == Some(Alarm::SettingsLost);
            saves.torn += u32::from(is_lost || (found != saved && found != wanted));
            saves.new += u32::from(found == wanted);
            saved = found;
        }
        Ok(saves)
    }

    fn setting(&mut self) -> Result<u32, CheckError> {
        let lines = self.weeder.ask(&format!("get {SETTING}"))?;
        let (_, value) = lines.iter().find_map(|line| settings::shown(line)).ok_or(CheckError::Answer("get"))?;
        Ok(value.into())
    }

    /// Saves this value of the setting, and waits until it is stored.
    fn save(&mut self, value: u32) -> Result<(), CheckError> {
        self.weeder.ask(&format!("set {SETTING} {value}"))?;
        self.weeder.ask("save")?;
        self.tester.record_for_ms(SAVED_MS)?;
        Ok(())
    }
}
