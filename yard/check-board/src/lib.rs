//! Checks a real board by a second one, the tester.
//!
//! [`mod@run`] runs the whole check of two [`boards`], and [`report`] has its figures. [`tester`] talks to the tester, and
//! `link` to the weeder. [`pair`] replaces the boards by two virtual Unos, which [`desk`] connects to ports.

pub mod alarms;
pub mod boards;
pub mod desk;
pub mod drawing;
pub mod pair;
pub mod plan;
pub mod rates;
pub mod report;
pub mod resets;
pub mod row;
pub mod run;
pub mod second;
pub mod servo;
pub mod tester;
pub mod wiring;

pub use self::boards::Boards;

use link::LinkError;
use link::examples::ExamplesError;
use std::io;
use tester_core::message::{PROTOCOL, Refusal};
use thiserror::Error;

/// Why a check could not go on.
#[derive(Debug, Error)]
#[expect(missing_docs, reason = "the messages say what each means")]
pub enum CheckError {
    #[error("the weeder")]
    Weeder(#[from] LinkError),
    #[error("the weeder's answer to `{0}` is not understood: flash the firmware that belongs to this command")]
    Answer(&'static str),
    #[error("the weeder's examples")]
    Examples(#[from] ExamplesError),
    #[error("interrupted: the weeder has its saved settings and examples again")]
    Interrupted,
    #[error("the tester")]
    TesterPort(#[source] LinkError),
    #[error(
        "no {0} answers at an Uno's port (looked at: {1}): connect and flash both boards, or name them by --port and --tester"
    )]
    NotFound(&'static str, String),
    #[error(
        "the tester does not answer: flash it with the tester's firmware, and check that --port and --tester are not swapped"
    )]
    TesterSilent,
    #[error("the tester's port is gone")]
    TesterGone(#[source] io::Error),
    #[error("the tester has version {0} of the protocol, and this command has {PROTOCOL}: flash the tester again")]
    Protocol(u8),
    #[error("the tester refused a command ({0:?}): this is a defect of the check")]
    Refused(Refusal),
    #[error("{0} records of the tester are missing: use a shorter cable, or another USB port")]
    Missing(u32),
    #[error("the plan reached the tester too late: close other programs, or use another USB port")]
    Dry,
    #[error("the servo's pulses have stopped: check the wire from D9 of the weeder to D8 of the tester")]
    NoPulses,
    #[error("the simulated row cannot be made: {0}")]
    Row(String),
}
