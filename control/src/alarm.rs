//! Alarms and warnings: faults after which the machine no longer knows enough to have its tool in the row, and what it
//! can live with but the operator should know.
//!
//! An alarm puts the tool out, empties the schedule and stays until the operator clears it. Its code has two digits, which
//! the status LED blinks one after the other: the first says where to look, the second which fault it is. Its name is
//! what the console says. A warning is counted and told, and changes nothing else.

/// A latched fault, in the order of the codes.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
#[repr(u8)]
pub enum Alarm {
    /// The beam was broken over more ground than any plant covers: something hangs in it, or it is out of line.
    BeamBlocked,
    /// The beam breaks and clears more often than plants and their leaves can make it: dust, or a loose wire.
    BeamFlickers,
    /// Edges of the beam came faster than they could be taken.
    BeamEdgesLost,
    /// The second beam sees what the first does not: a torn wire, or a dirty lens.
    BeamBlind,
    /// The first beam sees what the second does not.
    SecondBeamBlind,
    /// Plants pass the beam, and the encoder says that the machine stands.
    EncoderSilent,
    /// Edges without progress: only one of the encoder's channels is alive.
    EncoderChannelDead,
    /// Both channels keep changing at once, which a turning wheel does not do.
    EncoderJumps,
    /// The machine works faster than its settings allow.
    TooFast,
    /// The tool was rolled back to ground that has been forgotten.
    RolledBackTooFar,
    /// More plants stand between beam and tool than the schedule can hold.
    ScheduleFull,
    /// Detection after detection was as narrow as a weed, and none was taken for a plant: the examples may not know this crop.
    CropUnknown,
    /// The end switch does not say what the tool was told.
    ToolStuck,
    /// No copy of the settings in the EEPROM is whole and of this firmware: the defaults are in use.
    SettingsLost,
    /// The saved settings cannot be right together.
    SettingsContradict,
    /// The stack has come too near to the variables.
    StackLow,
}

impl Alarm {
    /// Whether beam or encoder shows it.
    pub const fn is_of_a_sensor(self) -> bool {
        (self as u8) < Self::TooFast as u8
    }

    /// The code that the LED blinks, as its two digits. The first: 1 beam, 2 encoder, 3 driving and the row, 4 tool, 5 settings, 6
    /// the controller itself. Wherever an alarm is named, they stand before its name: `3-1 too_fast`.
    #[cfg_attr(target_arch = "avr", inline(never))]
    pub const fn code(self) -> (u8, u8) {
        // The first alarm of each digit. A list of codes would cost SRAM.
        let (digit, first) = match self as u8 {
            place if place < Self::EncoderSilent as u8 => (1, Self::BeamBlocked),
            place if place < Self::TooFast as u8 => (2, Self::EncoderSilent),
            place if place < Self::ToolStuck as u8 => (3, Self::TooFast),
            place if place < Self::SettingsLost as u8 => (4, Self::ToolStuck),
            place if place < Self::StackLow as u8 => (5, Self::SettingsLost),
            _ => (6, Self::StackLow),
        };
        (digit, 1 + self as u8 - first as u8)
    }
}

/// Something that the operator should know of.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
#[repr(u8)]
pub enum Warning {
    /// The tool was told to leave the row later than it needed: the speed jumped, or a plant came up too near.
    LateCommand,
    /// The machine has worked for a long way without the beam being broken: it may be blind, or too high.
    NoPlants,
    /// Too many detections running have not told the slip: the stand is denser than the two beams can tell apart, or they see differently.
    SlipUnknown,
}

#[cfg(test)]
mod tests {
    extern crate std;
    use super::*;
    use std::vec::Vec;

    #[test]
    fn codes_rise_with_the_order_and_have_digits_that_can_be_counted() {
        let codes: Vec<u8> =
            (0..).map_while(Alarm::from_index).map(Alarm::code).map(|(first, second)| 10 * first + second).collect();
        assert_eq!(codes, [11, 12, 13, 14, 15, 21, 22, 23, 31, 32, 33, 34, 41, 51, 52, 61]);
    }
}
