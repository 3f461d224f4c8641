//! The two boards of a check. A port that is not named is found among those of all Unos.

use crate::CheckError;
use crate::plan::Plan;
use crate::tester::{Played, Tester};
use crate::wiring::Weeder;
use link::Link;
use tester_core::message::Command;
use uno::{CYCLES_PER_SECOND, Pulse};

/// A width between the factory settings' in (1500 us) and out (2000 us).
const MIDDLE_US: f64 = 1750.0;

/// Both boards, wired to each other. Every method fails if a board does not answer.
pub struct Boards {
    /// The board to check.
    pub weeder: Weeder,
    /// The board that checks it.
    pub tester: Tester,
    /// The weeder's clock over the tester's; 1 until it is measured.
    pub clock_ratio: f64,
}

impl Boards {
    /// Opens both boards. An unnamed port is one of `unos`: the tester by its protocol, the weeder by its console.
    ///
    /// # Errors
    /// If a named port cannot be opened or does not answer, or no other port has such a board.
    pub fn open(weeder: Option<&str>, tester: Option<&str>, unos: &[String]) -> Result<Self, CheckError> {
        let (tester_port, tester) = opened("tester", tester, weeder, unos, |port| {
            Tester::over(link::open_other(port).map_err(CheckError::TesterPort)?)
        })?;
        let (_, weeder) = opened("weeder", weeder, Some(&tester_port), unos, |port| {
            let port = port.to_owned();
            Weeder::over(move || Link::open(Some(&port)))
        })?;
        Ok(Self { weeder, tester, clock_ratio: 1.0 })
    }

    /// Pulls the weeder's reset for a moment. Returns whether the weeder starts then.
    pub fn reset(&mut self) -> Result<bool, CheckError> {
        self.weeder.drain()?;
        self.tester.command(&Command::Reset { pulled: true })?;
        self.tester.record_for_ms(20)?;
        self.tester.command(&Command::Reset { pulled: false })?;
        Ok(self.weeder.greeting()?)
    }

    /// Plays a plan to its end, and drops the weeder's lines meanwhile.
    pub(crate) fn play(&mut self, plan: Plan) -> Result<Played, CheckError> {
        self.tester.play(&plan.finish(), || self.weeder.drain())
    }

    pub(crate) fn weeder_ms(&self, cycles: u64) -> f64 {
        cycles as f64 * 1000.0 / CYCLES_PER_SECOND as f64 * self.clock_ratio
    }

    pub(crate) fn is_out(&self, pulse: &Pulse) -> bool {
        pulse.width_us() * self.clock_ratio > MIDDLE_US
    }
}

/// The board at the named port, or at the first other port where it answers. The port `taken` is skipped.
fn opened<T>(
    board: &'static str,
    named: Option<&str>,
    taken: Option<&str>,
    unos: &[String],
    open: impl Fn(&str) -> Result<T, CheckError>,
) -> Result<(String, T), CheckError> {
    if let Some(port) = named {
        return Ok((port.to_owned(), open(port)?));
    }
    let mut others = unos.iter().filter(|uno| Some(uno.as_str()) != taken);
    let found = others.find_map(|port| open(port).ok().map(|board| (port.clone(), board)));
    found.ok_or_else(|| CheckError::NotFound(board, unos.join(", ")))
}
