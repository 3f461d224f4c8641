//! The settings: one table of name, unit, range, default and help, and the values in use.
//!
//! The console reads this table from flash; a test holds the manual to it. Every value is a whole number in 16 bits whose
//! name carries its unit.

use crate::{
    memory::checksum,
    units::{Ticks, TicksPerSecond, Wheel},
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
    ($($(#[$doc:meta])* $Variant:ident $name:literal $(in $unit:literal)?: $least:literal to $greatest:literal, $default:literal, $hold_only:literal, $help:literal;)*) => {
        /// A setting.
        #[derive(Clone, Copy, Debug, PartialEq, Eq)]
        #[repr(u8)]
        pub enum Setting {
            $($(#[$doc])* $Variant,)*
        }

        impl Setting {
            /// The names, in the table's order.
            pub(crate) const WORDS: &[&str] = &[$($name),*];

            /// How many there are.
            pub const COUNT: u8 = Self::WORDS.len() as u8;

            /// The one at a place in the table.
            pub const fn from_index(index: u8) -> Option<Self> {
                match index {
                    $(index if index == Self::$Variant as u8 => Some(Self::$Variant),)*
                    _ => None,
                }
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

        $(const _: () = assert!($least <= $default && $default <= $greatest, $name);)*

        pub(crate) const UNITS: &[&str] = &[$(concat!($(" ", $unit)?)),*];
        pub(crate) const HELPS: &[&str] = &[$($help),*];
    };
}

settings! {
    /// Encoder counts in a turn of the ground wheel.
    TicksPerRev "ticks_per_rev": 100 to 10000, 2400, true,
        "encoder counts in a turn of the ground wheel";
    /// Diameter of the ground wheel.
    WheelMm "wheel_mm" in "mm": 200 to 800, 400, true,
        "diameter of the ground wheel";
    /// Encoder counts a metre, measured.
    TicksPerM "ticks_per_m": 0 to 20000, 0, true,
        "encoder counts a metre, as calibrated; 0 for what wheel and encoder give";
    /// X: how far the beam stands ahead of the tool.
    BeamToToolMm "beam_to_tool_mm" in "mm": 100 to 2000, 400, true,
        "X, how far the beam stands ahead of the tool";
    /// How far a second beam stands behind the first.
    SecondBeamMm "second_beam_mm" in "mm": 0 to 900, 0, true,
        "how far a second beam on D10 stands behind the first; 0 for none";
    /// Ground kept free of the tool on both sides of a canopy.
    MarginMm "margin_mm" in "mm": 0 to 200, 50, true,
        "ground that the tool leaves alone on both sides of a canopy";
    /// Time from the command to the tool being out.
    LeadOutMs "lead_out_ms" in "ms": 0 to 500, 180, false,
        "from the command until the tool is out, under load; 0 as in the paper";
    /// Shortest time from the command to the tool beginning to come back.
    LeadInMs "lead_in_ms" in "ms": 0 to 500, 40, false,
        "shortest time from the command until the tool begins to come back";
    /// Pulse for the tool in the row.
    ServoInUs "servo_in_us" in "us": 500 to 2500, 1500, true,
        "servo pulse for the tool in the row, 0 degrees";
    /// Pulse for the tool out of the row.
    ServoOutUs "servo_out_us" in "us": 500 to 2500, 2000, true,
        "servo pulse for the tool out of the row, 45 degrees";
    /// Shortest gap between two servo pulses.
    ServoGapMs "servo_gap_ms" in "ms": 0 to 15, 3, false,
        "shortest gap between servo pulses; 0 keeps fixed frames of 20 ms";
    /// Examples that vote.
    K "k": 1 to 15, 3, false,
        "nearest examples that vote on what an object is";
    /// Width below which an object is dust.
    MinWidthMm "min_width_mm" in "mm": 0 to 100, 0, false,
        "what is narrower is dust, and weeded over; 0 for nothing";
    /// Narrow objects in a row, none of them a plant, that are an alarm.
    MisfitAfter "misfit_after": 0 to 100, 5, false,
        "so many narrow objects in a row and no plant raise an alarm; 0 never";
    /// Ground over which the beam may be broken before that is an alarm.
    MaxWidthMm "max_width_mm" in "mm": 20 to 1500, 400, false,
        "a beam broken over more ground than this raises an alarm";
    /// Gaps in a canopy shorter than this belong to it.
    MergeGapMm "merge_gap_mm" in "mm": 0 to 1000, 21, false,
        "clear stretches shorter than this belong to the canopy";
    /// Distance at which the crop is set, so that plants that are not seen can be guarded.
    GuardSpacingMm "guard_spacing_mm" in "mm": 0 to 2000, 0, false,
        "where plants stand evenly, this far apart, unseen ones are kept; 0 off";
    /// How far off its place a guarded plant may stand.
    GuardScatterMm "guard_scatter_mm" in "mm": 0 to 200, 30, false,
        "how far from where it is due an unseen plant may stand";
    /// The sensor's response time.
    BeamResponseMs "beam_response_ms" in "ms": 0 to 50, 1, false,
        "time the beam's sensor takes to answer";
    /// Speed above which the machine must not work.
    TopSpeedMmS "top_speed_mm_s" in "mm/s": 100 to 3000, 1400, false,
        "working faster than this raises an alarm; 1400 is 5 km/h";
    /// Ground without a plant that is worth a warning.
    NoPlantM "no_plant_m" in "m": 0 to 100, 10, false,
        "so many metres without a plant give a warning; 0 never";
    /// Whether an end switch tells that the tool is out.
    EndSwitch "end_switch": 0 to 1, 0, false,
        "whether a switch on D5 closes when the tool is out, and is to be watched";
}

/// Stands for this table wherever values are kept without their names: the CRC-16 of the names in their
/// order, each behind its length.
pub const TABLE_MARK: u16 = {
    let (mut bytes, mut end, mut place) = ([0; 512], 0, 0);
    while place < Setting::WORDS.len() {
        let name = Setting::WORDS[place].as_bytes();
        bytes[end] = name.len() as u8;
        let (_, behind) = bytes.split_at_mut(end + 1);
        behind.split_at_mut(name.len()).0.copy_from_slice(name);
        end += 1 + name.len();
        place += 1;
    }
    checksum(bytes.split_at(end).0)
};

/// The second beam stands no nearer to the first: slip is measured over the way between them, to a tick or two.
pub const SECOND_BEAM_LEAST_MM: u16 = 50;

/// With a second beam, X is no longer: what slip makes of it has to fit into what is remembered.
pub const SLIPPING_BEAM_TO_TOOL_MM: u16 = 1000;

/// Settings that cannot be right together.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub enum Contradiction {
    /// The beam stands so near that a plant could reach the tool's margin before the tool is out of the row.
    BeamTooNear {
        /// The least X for margin, lead and top speed.
        needed_mm: u16,
    },
    /// Both pulses are the same: the tool would not move.
    PulsesEqual,
    /// The second beam stands at the first or not ahead of the tool, or X is too long for it.
    SecondBeamAstray,
}

impl Setting {
    /// All settings, in the table's order.
    pub fn all() -> impl Iterator<Item = Self> {
        (0..).map_while(Self::from_index)
    }

    /// Whether it is switched on and off, as 1 and 0.
    pub fn is_switched(self) -> bool {
        self.description().greatest == 1
    }

    /// Whether another value means another wheel or encoder: one whose `ticks_per_m` nobody has measured.
    pub const fn is_of_the_wheel(self) -> bool {
        matches!(self, Self::WheelMm | Self::TicksPerRev)
    }

    /// The numbers that the table gives for it.
    #[inline(never)]
    pub fn description(self) -> Description {
        DESCRIPTIONS.load_at(self as usize)
    }
}

/// The values in use.
#[derive(Clone, Debug, PartialEq, Eq)]
pub struct Settings {
    values: [u16; Setting::COUNT as usize],
}

/// The value lies outside the setting's range.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub struct OutOfRange;

impl Settings {
    /// No settings: values that are yet to be given.
    pub const NONE: Self = Self { values: [0; Setting::COUNT as usize] };

    /// The defaults.
    pub fn new() -> Self {
        let mut settings = Self::NONE;
        for (value, setting) in settings.values.iter_mut().zip(Setting::all()) {
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

    /// What cannot be right together, if anything.
    ///
    /// At the top speed the machine rolls the lead, an eighth of it for the speed's wavering, and what the sensor takes to
    /// answer, before a plant that the beam has just seen may come to the tool's margin.
    #[inline(never)]
    pub fn contradiction(&self) -> Option<Contradiction> {
        if self.get(Setting::ServoInUs) == self.get(Setting::ServoOutUs) {
            return Some(Contradiction::PulsesEqual);
        }
        let lead_out_ms = self.get(Setting::LeadOutMs);
        let notice_ms = lead_out_ms + lead_out_ms / 8 + self.get(Setting::BeamResponseMs) + 1;
        let rolled = TicksPerSecond(self.get(Setting::TopSpeedMmS).into()).distance_in_ms(notice_ms);
        let needed_mm = self.get(Setting::MarginMm) + rolled.0 as u16 + 1;
        let beam_to_tool_mm = self.get(Setting::BeamToToolMm);
        if beam_to_tool_mm < needed_mm {
            return Some(Contradiction::BeamTooNear { needed_mm });
        }
        let second_beam_mm = self.get(Setting::SecondBeamMm);
        let can_stand = (SECOND_BEAM_LEAST_MM..beam_to_tool_mm).contains(&second_beam_mm);
        let is_astray = second_beam_mm > 0 && (!can_stand || beam_to_tool_mm > SLIPPING_BEAM_TO_TOOL_MM);
        is_astray.then_some(Contradiction::SecondBeamAstray)
    }

    /// The ground wheel with its encoder.
    pub fn wheel(&self) -> Wheel {
        match self.get(Setting::TicksPerM) {
            0 => self.nominal_wheel(),
            ticks_per_m => Wheel::measured(ticks_per_m),
        }
    }

    /// The ground wheel as its diameter and its encoder give it, whatever was measured.
    fn nominal_wheel(&self) -> Wheel {
        Wheel::of_diameter(self.get(Setting::TicksPerRev), self.get(Setting::WheelMm))
    }

    /// Ticks a metre of that wheel.
    #[inline(never)]
    pub fn nominal_ticks_per_m(&self) -> u16 {
        self.nominal_wheel().ticks(1000).0 as u16
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
