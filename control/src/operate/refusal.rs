//! Why the machine may refuse what the operator asks.

use crate::{ground::class::Class, operate::calibration::Unfit, settings::Contradiction};

/// A command that the present state does not allow.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub enum Refusal {
    /// An alarm is latched.
    AlarmLatched,
    /// The setting changes where the tool is, or is to be saved, and the machine is at work.
    NotInHold,
    /// The value lies outside the setting's range.
    OutOfRange,
    /// The settings would contradict each other.
    Contradiction(Contradiction),
    /// There is no object to label yet, or the last one has its label.
    NothingToLabel,
    /// The built-in examples are sure that the object is of this class, which is not the label's.
    TakenFor(Class),
    /// An example was to be taught whose features were not told, all and no more.
    NotTold,
    /// All places for examples are taken.
    ExamplesFull,
    /// No example from the field has this number.
    NoSuchExample,
    /// No settings are saved that could be taken back.
    NothingSaved,
    /// What was rolled tells nothing of the wheel.
    Unfit(Unfit),
    /// A row is not played at such a speed.
    TestSpeed {
        /// The highest speed at which it is, in mm/s.
        fastest: u16,
    },
}
