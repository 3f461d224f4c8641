//! Alarms and warnings. An alarm is a fault after which the tool must not enter the row. After a warning the machine continues, and
//! the operator should look.
//!
//! An alarm puts the tool out, forgets the ground, and stays until the operator clears it. The status LED blinks its code, one
//! digit after the other: the first says where to look, the second which fault it is. The console shows its name. A warning is
//! counted and reported, and has no other effect.

use crate::named::named;

named! {
    /// A latched alarm, in the order of the codes.
    Alarm {
        /// The beam was broken over more ground than any plant covers: an object hangs in it, or it is out of line.
        BeamBlocked = "beam_blocked",
        /// The beam changes more often than plants and leaves can cause, or for too short a time: dust, sun, or a loose wire.
        BeamFlickers = "beam_flickers",
        /// Edges of the beam came faster than the loop could take them.
        BeamEdgesLost = "beam_edges_lost",
        /// The first beam misses what the second sees: a torn wire, or a dirty lens.
        BeamBlind = "beam_blind",
        /// The second beam misses what the first sees.
        SecondBeamBlind = "second_beam_blind",
        /// Plants pass the beam while the encoder stands still.
        EncoderSilent = "encoder_silent",
        /// Edges without progress: only one of the encoder's channels works.
        EncoderChannelDead = "encoder_channel_dead",
        /// Both channels often change at once, which a turning wheel does not cause.
        EncoderJumps = "encoder_jumps",
        /// The machine is faster than `top_speed_mm_s`.
        TooFast = "too_fast",
        /// The tool was rolled back to ground that has been dropped.
        RolledBackTooFar = "rolled_back_too_far",
        /// More canopies stand between beam and tool than can be remembered.
        ScheduleFull = "schedule_full",
        /// Too many consecutive detections were as narrow as a weed, and none was a plant: the examples may not know this crop.
        CropUnknown = "crop_unknown",
        /// The end switch contradicts the tool's command.
        ToolStuck = "tool_stuck",
        /// No valid copy of the settings in the EEPROM: the defaults are in use.
        SettingsLost = "settings_lost",
        /// The saved settings contradict each other.
        SettingsContradict = "settings_contradict",
        /// Too little stack is free.
        StackLow = "stack_low",
    }
}

impl Alarm {
    /// Whether it comes from the beam or the encoder.
    pub const fn is_of_a_sensor(self) -> bool {
        (self as u8) < Self::TooFast as u8
    }

    /// The two digits that the LED blinks. The first: 1 beam, 2 encoder, 3 driving and the row, 4 tool, 5 settings, 6 the
    /// controller. Texts show them before the name: `3-1 too_fast`.
    #[cfg_attr(target_arch = "avr", inline(never))]
    pub const fn code(self) -> (u8, u8) {
        // The first alarm of each digit. A list of codes would cost SRAM.
        let (digit, first) = match self as u8 {
            number if number < Self::EncoderSilent as u8 => (1, Self::BeamBlocked),
            number if number < Self::TooFast as u8 => (2, Self::EncoderSilent),
            number if number < Self::ToolStuck as u8 => (3, Self::TooFast),
            number if number < Self::SettingsLost as u8 => (4, Self::ToolStuck),
            number if number < Self::StackLow as u8 => (5, Self::SettingsLost),
            _ => (6, Self::StackLow),
        };
        (digit, 1 + self as u8 - first as u8)
    }
}

named! {
    /// A warning.
    Warning {
        /// The tool was commanded out too late: the speed jumped, or a plant came up too near.
        LateCommand = "late_command",
        /// The machine has worked over a long distance without a plant: the beam may be blind, or too high.
        NoPlants = "no_plants",
        /// Too many consecutive detections gave no slip: the stand is too dense for two beams, or the beams see differently.
        SlipUnknown = "slip_unknown",
        /// A copy of the settings in the EEPROM has changed since it was saved: the other one is in use, and may be older.
        SettingsOlder = "settings_older",
    }
}
