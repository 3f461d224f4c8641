//! Errors of the operator's commands.
//!
//! An error is one byte, because the chip passes it from function to function. Numbers for its message stay with the module that
//! returns it.

/// A command that the present state does not allow.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
#[repr(u8)]
pub enum CommandError {
    /// An alarm is latched.
    AlarmLatched,
    /// The machine works: the setting changes where the tool is, or settings are to be saved.
    NotInHold,
    /// Both servo pulses would be equal.
    PulsesEqual,
    /// The beam would be too near; [`needed_mm`](crate::operate::configuration::Configuration::needed_mm) has the least distance.
    BeamTooNear,
    /// The second beam would be too near to the first or to the tool, or X is too long for it.
    SecondBeamAstray,
    /// The wheel gives too few ticks a metre.
    EncoderTooCoarse,
    /// The machine rolls, so the tool must not be moved.
    Rolls,
    /// There is no detection to label, or the last one has a label.
    NothingToLabel,
    /// An example does not have exactly five features.
    IncompleteExample,
    /// All places for field examples are taken.
    ExamplesFull,
    /// No field example has this number.
    NoSuchExample,
    /// No saved settings to load.
    NothingSaved,
    /// No stretch has been started.
    NotBegun,
    /// The stretch is shorter than [`SHORTEST_MM`](crate::operate::calibration::SHORTEST_MM).
    TooShort,
    /// A dry run is at most as fast as the settings' top speed.
    TestSpeed,
    /// The ticks a metre differ by more than 30 % from the wheel's diameter;
    /// [`counted`](crate::operate::calibration::Distance::counted) has the count.
    WheelDiffers,
    /// The built-in examples say plant, and the label says weed.
    TakenForPlant,
    /// The built-in examples say weed, and the label says plant.
    TakenForWeed,
    /// The value lies outside the setting's range.
    OutOfRange,
}
