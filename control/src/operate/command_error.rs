//! Errors of the operator's commands.
//!
//! An error is one byte, because the chip passes it from function to function. Numbers for its message stay with the module that
//! returns it.

/// A command that the present state does not allow.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
#[repr(u8)]
#[expect(missing_docs, reason = "the messages say what each means")]
pub enum CommandError {
    AlarmLatched,
    /// The machine works: the setting changes where the tool is, or settings are to be saved.
    NotInHold,
    PulsesEqual,
    /// The beam would be too near; [`needed_mm`](crate::operate::configuration::Configuration::needed_mm) has the least distance.
    BeamTooNear,
    SecondBeamAstray,
    EncoderTooCoarse,
    Rolls,
    NothingToLabel,
    IncompleteExample,
    ExamplesFull,
    NoSuchExample,
    NothingSaved,
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
