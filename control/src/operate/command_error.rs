//! Errors of the operator's commands.
//!
//! An error is one byte, because the chip passes it from function to function. Numbers for its message stay with the module that
//! returns it.

use crate::named::named;

named! {
    /// A command that the present state does not allow. `say::errors` adds numbers and words to some messages.
    #[expect(missing_docs, reason = "the messages say what each means")]
    CommandError {
        AlarmLatched = "an alarm is latched, see status, then clear it",
        /// The machine works: the setting changes where the tool is, or settings are to be saved.
        NotInHold = "the machine is at work, hold first",
        PulsesEqual = "servo_in_us and servo_out_us would be equal, and the tool would not move",
        /// The beam would be too near; [`needed_mm`](crate::operate::configuration::Configuration::needed_mm) has the least distance.
        BeamTooNear = "margin, leads and top speed would need beam_to_tool_mm # or more, change one of them first",
        SecondBeamAstray = "second_beam_mm is to be 0, or 72 or more from beam and tool, and beam_to_tool_mm 1000 at most",
        EncoderTooCoarse = "a wheel gives 900 ticks a metre or more, take a finer encoder",
        Rolls = "the machine rolls, stop first",
        NothingToLabel = "there is no detection without a label, let the beam see one first",
        IncompleteExample = "tell its 5 features first, as examples lists them",
        ExamplesFull = "all 32 places are taken, forget one first",
        NoSuchExample = "no field example has this number, examples lists them",
        NothingSaved = "no settings are saved, save does it",
        NotBegun = "calibrate start first, then roll",
        /// The stretch is shorter than [`SHORTEST_MM`](crate::operate::calibration::SHORTEST_MM).
        TooShort = "roll 1000 mm at least, 10000 are better",
        /// A dry run is at most as fast as the settings' top speed.
        TestSpeed = "test row takes a speed in mm/s from 100 to #",
        /// The ticks a metre differ by more than 30 % from the wheel's diameter;
        /// [`counted`](crate::operate::calibration::Distance::counted) has the count.
        WheelDiffers = "that would be ticks_per_m #, the wheel has #",
        /// The built-in examples say plant, and the label says weed.
        TakenForPlant = "plant",
        /// The built-in examples say weed, and the label says plant.
        TakenForWeed = "weed",
        /// The value lies outside the setting's range. The message has the range.
        OutOfRange = "",
    }
}
