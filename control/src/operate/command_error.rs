//! Why the machine may refuse what the operator asks.
//!
//! A refusal is one byte, as the chip has it handed from function to function: the numbers that belong to one are with whoever refuses.

/// A command that the present state does not allow.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
#[repr(u8)]
pub enum CommandError {
    /// An alarm is latched.
    AlarmLatched,
    /// The setting changes where the tool is, or is to be saved, and the machine is at work.
    NotInHold,
    /// Both of the servo's pulses would be the same.
    PulsesEqual,
    /// The beam would stand too near; how far it is to be, [`needed_mm`](crate::operate::configuration::Configuration::needed_mm) says.
    BeamTooNear,
    /// The second beam would stand too near to the first or not ahead of the tool, or X is too long for it.
    SecondBeamAstray,
    /// The wheel gives too few ticks a metre.
    EncoderTooCoarse,
    /// The machine rolls, and the tool is to be moved.
    Rolls,
    /// There is no detection to label yet, or the last one has its label.
    NothingToLabel,
    /// An example was to be taught whose features were not told, all and no more.
    IncompleteExample,
    /// All places for examples are taken.
    ExamplesFull,
    /// No example from the field has this number.
    NoSuchExample,
    /// No settings are saved that could be taken back.
    NothingSaved,
    /// Nobody has said where the stretch begins that was rolled.
    NotBegun,
    /// It is shorter than [`SHORTEST_MM`](crate::operate::calibration::SHORTEST_MM).
    TooShort,
    /// A row is not played at such a speed, but at the settings' top speed at the most.
    TestSpeed,
    /// The wheel would differ by more than 30 % from its diameter; what was counted,
    /// [`counted`](crate::operate::calibration::Distance::counted) says.
    WheelDiffers,
    /// The built-in examples are sure that the detection is a plant, and it was to be labelled a weed.
    TakenForPlant,
    /// The other way round.
    TakenForWeed,
    /// The value lies outside the setting's range.
    OutOfRange,
}
