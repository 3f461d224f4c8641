//! The settings: one table of name, range, unit, default and help, and the values in use.
//!
//! The console reads this table from flash; a test holds the README to it. Every value is a whole number in 16 bits whose
//! name carries its unit.

use crate::{
    text::{Listed, list, words},
    units::{Ticks, Wheel},
};

/// The numbers that the table gives for a setting.
#[derive(Clone, Copy)]
pub struct Description {
    /// Least value.
    pub least: u16,
    /// Greatest value.
    pub greatest: u16,
    /// The value before anything is set.
    pub default: u16,
    /// Whether it changes where the tool is, so that it is not to be set while the machine works.
    pub hold_only: bool,
}

/// The one table from which everything else about the settings is made.
macro_rules! settings {
    ($($(#[$doc:meta])* $Variant:ident $name:literal: $least:literal to $greatest:literal, $default:literal, $hold_only:literal, $help:literal;)*) => {
        words! {
            /// A setting.
            pub enum Setting {
                $($(#[$doc])* $Variant = $name,)*
            }
        }

        avr_progmem::progmem! {
            static progmem DESCRIPTIONS: [Description; Setting::COUNT as usize] = [
                $(Description {
                    least: $least,
                    greatest: $greatest,
                    default: $default,
                    hold_only: $hold_only,
                },)*
            ];
        }

        impl Setting {
            /// What it is, for the operator.
            pub fn help(self) -> Listed {
                Listed(list!($($help),*), self as u8)
            }
        }

        $(const _: () = assert!($least <= $default && $default <= $greatest, $name);)*
    };
}

settings! {
    /// Encoder counts in a turn of the ground wheel.
    TicksPerRev "ticks_per_rev": 100 to 10000, 2400, true,
        "encoder counts in a turn of the ground wheel";
    /// Diameter of the ground wheel.
    WheelMm "wheel_mm": 200 to 800, 400, true,
        "diameter of the ground wheel";
    /// X: how far the beam stands ahead of the tool.
    BeamToToolMm "beam_to_tool_mm": 100 to 2000, 400, true,
        "X, how far the beam stands ahead of the tool";
    /// Ground kept free of the tool on both sides of a canopy.
    MarginMm "margin_mm": 0 to 200, 50, true,
        "ground that the tool leaves alone on both sides of a canopy";
    /// Time from the command to the tool being out.
    LeadOutMs "lead_out_ms": 0 to 500, 180, false,
        "from the command until the tool is out, under load; 0 as in the paper";
    /// Shortest time from the command to the tool beginning to come back.
    LeadInMs "lead_in_ms": 0 to 500, 40, false,
        "shortest time from the command until the tool begins to come back";
    /// Pulse for the tool in the row.
    ServoInUs "servo_in_us": 500 to 2500, 1500, true,
        "servo pulse for the tool in the row, 0 degrees";
    /// Pulse for the tool out of the row.
    ServoOutUs "servo_out_us": 500 to 2500, 2000, true,
        "servo pulse for the tool out of the row, 45 degrees";
    /// Shortest gap between two servo pulses.
    ServoGapMs "servo_gap_ms": 0 to 15, 3, false,
        "shortest gap between servo pulses; 0 keeps fixed frames of 20 ms";
    /// Examples that vote.
    K "k": 1 to 15, 3, false,
        "nearest examples that vote on what an object is";
    /// Width above which an object cannot be a plant.
    MaxWidthMm "max_width_mm": 20 to 1500, 400, false,
        "a beam broken over more ground than this raises an alarm";
    /// Gaps in a canopy shorter than this belong to it.
    MergeGapTicks "merge_gap_ticks": 0 to 2000, 40, false,
        "clear stretches shorter than this, in ticks, belong to the canopy";
    /// The sensor's response time.
    BeamResponseMs "beam_response_ms": 0 to 50, 1, false,
        "time the beam's sensor takes to answer";
}

impl Setting {
    /// The numbers that the table gives for it.
    #[inline(never)]
    pub fn description(self) -> Description {
        DESCRIPTIONS.load_at(self as usize)
    }
}

/// The values in use.
#[derive(Clone, Debug)]
pub struct Settings {
    values: [u16; Setting::COUNT as usize],
}

/// The value lies outside the setting's range.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub struct OutOfRange;

impl Settings {
    /// The defaults.
    pub fn new() -> Self {
        let mut settings = Self { values: [0; Setting::COUNT as usize] };
        for (value, setting) in settings.values.iter_mut().zip((0..).map_while(Setting::from_index)) {
            *value = setting.description().default;
        }
        settings
    }

    /// A setting's value, in the unit that its name carries.
    pub fn get(&self, setting: Setting) -> u16 {
        self.values[setting as usize]
    }

    /// Sets a value.
    ///
    /// # Errors
    /// [`OutOfRange`] when the table does not allow it; the old value then stays.
    pub fn set(&mut self, setting: Setting, value: u16) -> Result<(), OutOfRange> {
        let Description { least, greatest, .. } = setting.description();
        if !(least..=greatest).contains(&value) {
            return Err(OutOfRange);
        }
        self.values[setting as usize] = value;
        Ok(())
    }

    /// The ground wheel with its encoder.
    pub fn wheel(&self) -> Wheel {
        Wheel { ticks_per_rev: self.get(Setting::TicksPerRev), diameter_mm: self.get(Setting::WheelMm) }
    }

    /// A setting in millimetres as ticks of the present wheel.
    pub fn ticks(&self, millimetres: Setting) -> Ticks {
        self.wheel().ticks(self.get(millimetres))
    }
}

impl Default for Settings {
    fn default() -> Self {
        Self::new()
    }
}
