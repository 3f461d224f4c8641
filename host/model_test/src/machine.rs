//! The machine under test: it has a beam, an encoder, two switches, a console and a tool.
//!
//! A test can inspect the decisions at any moment. The firmware in an Uno shows only its pins, and its answers on the
//! console. So each implementation of the trait returns the facts that it can see, and the drive checks those.

use crate::run::Beginning;
use control::{
    ground::class::Listed,
    measure::reset::Cause,
    operate::{state::State, tool::Reason},
    settings::Settings,
};
use proptest::test_runner::TestCaseError;

/// What a test asserts is what its caller reports.
pub type Checked = Result<(), TestCaseError>;

/// What a machine's sensors show.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub struct World {
    /// Time since the run began, in which the machine was awake.
    pub time_us: u64,
    /// The encoder's count, without its wrapping.
    pub count: i64,
    /// Times that both of the encoder's channels have changed at once, modulo 65,536.
    pub jumps: u16,
    /// Whether the beam is broken.
    pub broken: bool,
    /// Whether the second beam is, if there is one.
    pub second_broken: bool,
    /// Whether the work switch is on.
    pub switch_on: bool,
    /// Whether the end switch says that the tool is out.
    pub end_switch_on: bool,
    /// Whether nearly all of the stack has been used.
    pub stack_is_low: bool,
}

/// What the console did in a turn.
#[derive(Debug, Default)]
pub struct Attended {
    /// The line that the machine may carry out from now on.
    pub begun: Option<String>,
    /// The lines that it has written, without their ends.
    pub written: Vec<String>,
}

/// A machine, see the module's words.
pub trait Machine: Sized {
    /// Whether its state can be seen at any moment, and it does what it does in a turn that is known.
    const IS_OPEN: bool;

    /// Nothing is said of a weed that is no wider than this, in millimetres.
    const NARROW_MM: u16;

    /// So long the tool may be seen in the row after it was decided that it leaves it.
    const LATENESS_US: u64;

    /// A new board that has woken up.
    ///
    /// # Errors
    /// Where it does not wake up.
    fn new(beginning: &Beginning, world: &World) -> Result<Self, TestCaseError>;

    /// The encoder has counted, `up` or down by one.
    fn count(&mut self, up: bool);

    /// Both channels of the encoder are disturbed, which spoils the count by `ticks`; by how many ticks the machine's place may be off
    /// for it.
    fn spike(&mut self, world: &mut World, ticks: i32) -> i64;

    /// The beam, or the second one, has changed to what the world shows.
    fn beam_edge(&mut self, world: &World);

    /// Edges of the beam got lost; it is now as the world shows it.
    ///
    /// # Errors
    /// Where that is not noticed.
    fn lose_edges(&mut self, world: &World) -> Checked;

    /// The place that the machine takes itself to be at by a count: without the noise that it does not believe.
    fn place(&self, count: i64) -> i64;

    /// The machine's own counter at a count. The counter may restart at 0 when the machine starts.
    fn own_count(&self, count: i64) -> i32;

    /// A turn of the loop, from one world to another; the place of what was read in it.
    ///
    /// # Errors
    /// Where the machine stops working.
    fn turn(&mut self, before: &World, now: &World) -> Result<i64, TestCaseError>;

    /// The servo has the pulse that is due: out in every state but at work, or where it is tried by hand.
    ///
    /// # Errors
    /// Where it has not.
    fn check_pulse(&self, is_tried: bool) -> Checked;

    /// The width in millimetres of what has just been taken for a weed.
    fn take_weed(&mut self) -> Option<i16>;

    /// The settings in use.
    fn settings(&self) -> &Settings;

    /// Whether the settings in use may be others than [`settings`](Self::settings): until what asks for them is typed.
    fn settings_are_in_doubt(&self) -> bool;

    /// The state, as far as it is known.
    fn state(&self) -> State;

    /// Whether the loop shows that it turns.
    fn has_heartbeat(&self) -> bool;

    /// Why the tool is out, if that can be seen.
    fn reason(&self) -> Option<Reason>;

    /// How far the machine has to roll until ground that the beam has seen reaches the tool, in millimetres, as far as it is known.
    fn unseen_mm(&self) -> i16;

    /// Whether the tool is out of the row, or on its way.
    fn tool_out(&self) -> bool;

    /// Whether the servo has the pulse that has the tool out.
    fn is_sent_out(&self) -> bool;

    /// Sends bytes over the wire. They are complete lines, and `lines` are those that must be answered.
    fn put(&mut self, text: &str, lines: &[String]);

    /// The console's part of a turn.
    ///
    /// # Errors
    /// Where it writes what it must not.
    fn attend(&mut self) -> Result<Attended, TestCaseError>;

    /// Whether everything that was typed has been answered.
    fn is_done(&self) -> bool;

    /// The examples that were taught, as they are kept.
    fn examples(&self) -> Vec<Listed>;

    /// Resets the machine and has it wake up. A byte that is being written to the EEPROM becomes `torn`, if the power goes away.
    ///
    /// # Errors
    /// Where it wakes up otherwise than in HOLD, or with an alarm as its settings are lost, and with the tool out.
    fn reset(&mut self, cause: Cause, torn: Option<u8>, world: &World) -> Checked;
}
