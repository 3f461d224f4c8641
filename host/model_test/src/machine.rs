//! The machine under test: it has a beam, an encoder, two switches, a console and a tool.
//!
//! A test can inspect the decisions at any moment. The firmware in an Uno shows only its pins, and its answers on the
//! console. So each implementation of the trait returns the facts that are visible, and the drive checks those.

use control::{
    ground::class::Listed,
    measure::reset::Cause,
    operate::{state::State, tool::Reason},
    settings::{Setting, Settings},
};
use proptest::test_runner::TestCaseError;

/// The result of a check.
pub type Checked = Result<(), TestCaseError>;

/// The levels and counts of a machine's sensors.
#[derive(Clone, Copy, Debug, Default, PartialEq, Eq)]
pub struct World {
    /// Time since the run began.
    pub time_us: u64,
    /// The encoder's count, without its wrapping.
    pub count: i64,
    /// Simultaneous changes of both encoder channels, modulo 65,536.
    pub jumps: u16,
    /// Whether the first beam is broken.
    pub broken: bool,
    /// Whether the second beam is broken; false without one.
    pub second_broken: bool,
    /// Whether the work switch is on.
    pub switch_on: bool,
    /// Whether the end switch reports that the tool is out.
    pub end_switch_on: bool,
    /// Whether nearly all of the stack was used.
    pub stack_is_low: bool,
}

/// The console's work in a turn.
#[derive(Debug, Default)]
pub struct Attended {
    /// The line that the machine may execute from now on.
    pub begun: Option<String>,
    /// The lines that the machine wrote, without their ends.
    pub written: Vec<String>,
}

/// A machine, see the module's documentation. The methods with a body are right for a machine that shows only its pins and its
/// answers.
pub trait Machine: Sized {
    /// Whether the state is visible at any moment, and the turn of each effect is known.
    const IS_OPEN: bool;

    /// The machine does not report weeds up to this width, in millimetres.
    const NARROW_MM: u16;

    /// Longest time from the decision to leave the row until that is visible.
    const LATENESS_US: u64;

    /// The encoder counts a tick, `up` or down.
    fn count(&mut self, up: bool);

    /// Disturbs both channels of the encoder, which adds `ticks` to the count. Returns the possible error of the machine's
    /// position.
    fn spike(&mut self, world: &mut World, ticks: i32) -> i64;

    /// A beam has changed to the world's level.
    fn beam_edge(&mut self, world: &World);

    /// Edges of the beam were lost. The beam now has the world's level.
    ///
    /// # Errors
    /// If the machine does not notice.
    fn lose_edges(&mut self, _world: &World) -> Checked {
        Ok(())
    }

    /// The machine's position at a count, without noise that it filters.
    fn place(&self, count: i64) -> i64 {
        count
    }

    /// The machine's own counter at a count. The counter may restart at 0 when the machine starts.
    fn own_count(&self, count: i64) -> i32;

    /// Runs a turn of the loop, from one world to another. Returns the position that the machine read.
    ///
    /// # Errors
    /// If the machine stops working.
    fn turn(&mut self, before: &World, now: &World) -> Result<i64, TestCaseError>;

    /// Checks the servo's pulse: out in every state but WORK, except during a test on the bench.
    ///
    /// # Errors
    /// If the pulse is wrong.
    fn check_pulse(&self, is_tried: bool) -> Checked;

    /// Takes the width of the detection that was just classified as a weed, in millimetres.
    fn take_weed(&mut self) -> Option<i16> {
        None
    }

    /// The settings in use.
    fn settings(&self) -> &Settings;

    /// A length among the settings in use, in ticks.
    fn ticks(&self, setting: Setting) -> i64 {
        self.settings().ticks(setting).0.into()
    }

    /// Whether the settings in use may differ from [`settings`](Self::settings), until `get` is typed.
    fn settings_are_in_doubt(&self) -> bool;

    /// The last known state.
    fn state(&self) -> State;

    /// Whether the loop resets the watchdog.
    fn has_heartbeat(&self) -> bool {
        true
    }

    /// Why the tool is out, if that is visible.
    fn reason(&self) -> Option<Reason> {
        None
    }

    /// The last known distance to roll until seen ground reaches the tool, in millimetres.
    fn unseen_mm(&self) -> i16;

    /// Whether the tool was ordered out of the row.
    fn tool_out(&self) -> bool;

    /// Whether the servo has the pulse for out.
    fn is_sent_out(&self) -> bool;

    /// Sends complete lines to the console. `lines` are those that must be answered.
    fn put(&mut self, text: &str, lines: &[String]);

    /// Runs the console's part of a turn.
    ///
    /// # Errors
    /// If the console breaks its grammar.
    fn attend(&mut self) -> Result<Attended, TestCaseError>;

    /// Whether every typed line was answered.
    fn is_done(&self) -> bool;

    /// The stored examples from the field.
    fn examples(&self) -> Vec<Listed>;

    /// Changes a byte of the EEPROM. The caller then resets the machine.
    ///
    /// # Errors
    /// If the machine cannot be started with it.
    fn spoil(&mut self, address: usize, byte: u8) -> Checked;

    /// Resets the machine. If the power fails, a byte that is being written to the EEPROM becomes `torn`.
    ///
    /// # Errors
    /// If it does not start with the tool out, in HOLD or with the alarm about lost settings.
    fn reset(&mut self, cause: Cause, torn: Option<u8>, world: &World) -> Checked;
}
