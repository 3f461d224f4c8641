//! The settings: one table of name, unit, range, default and help, and the values in use.
//!
//! The console reads the table from flash. A test compares the manual with it. Each value is a whole number of 16 bits, and its
//! name carries the unit.

use crate::{
    memory::checksum,
    named::named,
    units::{Speed, Ticks, Wheel},
};

/// The one table. Everything else about the settings comes from it.
macro_rules! settings {
    ($($(#[$doc:meta])* $Variant:ident $name:literal $(in $unit:literal)?: $least:literal to $greatest:literal, $default:literal, $hold_only:literal, $help:literal;)*) => {
        named! {
            /// A setting.
            #[expect(missing_docs, reason = "the help texts say what each is")]
            Setting {
                $($(#[$doc])* $Variant = $name,)*
            }
        }

        /// Least and greatest value and default of each setting.
        const ROWS: [[u16; 3]; Setting::COUNT as usize] =
            [$([$least, if $hold_only { $greatest | HOLD_ONLY } else { $greatest }, $default]),*];

        $(const _: () = assert!($least <= $default && $default <= $greatest && $greatest < HOLD_ONLY, $name);)*

        pub(crate) const UNITS: &[&str] = &[$(concat!($(" ", $unit)?)),*];
        pub(crate) const HELPS: &[&str] = &[$($help),*];
    };
}

settings! {
    TicksPerRev "ticks_per_rev": 600 to 10000, 2400, true,
        "encoder counts a wheel turn";
    WheelMm "wheel_mm" in "mm": 200 to 800, 400, true,
        "wheel diameter";
    TicksPerM "ticks_per_m": 0 to 20000, 0, true,
        "encoder counts a metre, calibrated; 0 not yet";
    BeamToToolMm "beam_to_tool_mm" in "mm": 100 to 2000, 400, true,
        "X, from the tool to the beam";
    /// Distance from the first beam to a second one behind it; 0 for none.
    SecondBeamMm "second_beam_mm" in "mm": 0 to 900, 0, true,
        "from the beam to a second beam; 0 none";
    MarginMm "margin_mm" in "mm": 0 to 200, 50, true,
        "kept on both sides of a canopy";
    /// Width kept around the middle of a single plant's canopy; 0 for the whole canopy.
    StemZoneMm "stem_zone_mm" in "mm": 0 to 300, 0, true,
        "kept round a stem; 0 the canopy";
    MaxWidthMm "max_width_mm" in "mm": 20 to 1500, 400, false,
        "alarm where a detection is wider";
    MergeGapMm "merge_gap_mm" in "mm": 0 to 1000, 21, false,
        "shorter gaps belong to the canopy";
    GuardSpacingMm "guard_spacing_mm" in "mm": 0 to 2000, 0, false,
        "planting distance, keeps unseen plants; 0 off";
    GuardScatterMm "guard_scatter_mm" in "mm": 0 to 200, 30, false,
        "how far off it an unseen plant may stand";
    /// Longest time from the command until the tool is out. The default is the default servo's slowest swing over the default
    /// stroke. It has 80 ms dead time, 144 ms for 45 degrees against the soil, and 6 ms for the running pulse.
    LeadOutMs "lead_out_ms" in "ms": 0 to 500, 230, false,
        "longest time until the tool is out";
    LeadInMs "lead_in_ms" in "ms": 0 to 500, 40, false,
        "shortest time until the tool starts back";
    ServoInUs "servo_in_us" in "us": 500 to 2500, 1500, true,
        "servo pulse, tool in the row";
    ServoOutUs "servo_out_us" in "us": 500 to 2500, 2000, true,
        "servo pulse, tool out of the row";
    ServoGapMs "servo_gap_ms" in "ms": 0 to 15, 3, false,
        "shortest gap between servo pulses; 0 is 50 Hz";
    K "k": 1 to 15, 3, false,
        "nearest examples that vote";
    MinWidthMm "min_width_mm" in "mm": 0 to 100, 0, false,
        "narrower detections are dust; 0 none";
    /// Consecutive narrow detections without a plant that raise an alarm; 0 for never.
    MisfitAfter "misfit_after": 0 to 100, 5, false,
        "alarm at so many narrow detections in a row; 0 never";
    BeamResponseMs "beam_response_ms" in "ms": 0 to 50, 1, true,
        "time the beam takes to answer";
    /// Highest speed for work. With the default lead and margin, the default beam allows 1330 mm/s.
    TopSpeedMmS "top_speed_mm_s" in "mm/s": 100 to 3000, 1300, false,
        "alarm where work is faster";
    NoPlantM "no_plant_m" in "m": 0 to 100, 10, false,
        "warning after so far without a plant; 0 never";
    EndSwitch "end_switch": 0 to 1, 0, false,
        "switch on D5 closes with the tool out";
}

/// Identifies this table where values are stored without names: a CRC-16 of the names in order, each preceded by its length.
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

/// Least distance of the second beam from the first, and from the tool. From the first: it is 64 ticks with the coarsest encoder,
/// so a tick is a 64th of the slip. From the tool: at an expected weed, the ground is closed only after a detection of that width.
pub const SECOND_BEAM_LEAST_MM: u16 = 72;
const _: () = assert!(SECOND_BEAM_LEAST_MM as u32 * TICKS_PER_M_LEAST as u32 >= 64 * 1000);

/// Largest X with a second beam: with slip, X still has to fit the range of a [`Length`](crate::units::Length).
pub const SLIPPING_BEAM_TO_TOOL_MM: u16 = 1000;

/// The coarsest wheel with which an encoder fault is found in time, from 0.5 km/h on. Then four ticks come within 32 ms, see
/// [`monitor`](crate::measure::monitor). The largest unnoticed loss, 48 ticks, is about the usual margin.
pub const TICKS_PER_M_LEAST: u16 = 900;

/// Settings that contradict each other.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub enum Contradiction {
    /// The beam is so near that a plant could reach the tool's margin before the tool is out.
    BeamTooNear {
        /// The least X for margin, lead and top speed.
        needed_mm: u16,
    },
    /// Both pulses are equal: the tool would not move.
    PulsesEqual,
    /// The second beam is too near to the first or to the tool, or X is too long.
    SecondBeamAstray,
    /// The wheel, nominal or calibrated, counts fewer than [`TICKS_PER_M_LEAST`].
    EncoderTooCoarse,
}

impl Setting {
    /// All settings, in the table's order.
    pub fn all() -> impl Iterator<Item = Self> {
        (0..).map_while(Self::from_index)
    }

    /// Whether it is a switch: 0 is off, 1 is on.
    pub fn is_switched(self) -> bool {
        self.greatest() == 1
    }

    /// Whether it describes wheel or encoder. A new value needs a new calibration of `ticks_per_m`.
    pub const fn is_of_the_wheel(self) -> bool {
        matches!(self, Self::WheelMm | Self::TicksPerRev)
    }

    /// Its least value.
    pub fn least(self) -> u16 {
        self.number(0)
    }

    /// Its greatest value.
    pub fn greatest(self) -> u16 {
        self.number(1) & !HOLD_ONLY
    }

    /// Whether a value is within its range.
    #[cfg_attr(target_arch = "avr", inline(never))]
    pub fn allows(self, value: u16) -> bool {
        self.least() <= value && value <= self.greatest()
    }

    /// Its factory setting.
    pub fn default(self) -> u16 {
        self.number(2)
    }

    /// Whether it changes where the tool is. Then it can be set in HOLD only.
    pub fn is_hold_only(self) -> bool {
        self.number(1) & HOLD_ONLY != 0
    }

    /// One of its numbers, from flash.
    #[inline(never)]
    fn number(self, which: u8) -> u16 {
        let place = 6 * usize::from(self as u8) + 2 * usize::from(which);
        u16::from_le_bytes([flash::byte(&NUMBERS, place), flash::byte(&NUMBERS, place + 1)])
    }
}

/// Marks a setting for HOLD only, in its greatest value: a structure with a flag would take a stack frame in each reader.
const HOLD_ONLY: u16 = 1 << 15;

avr_progmem::progmem! {
    static progmem NUMBERS: [u8; 6 * Setting::COUNT as usize] = numbers();
}

/// The rows, little-endian.
const fn numbers() -> [u8; 6 * Setting::COUNT as usize] {
    let (mut bytes, mut place) = ([0; 6 * Setting::COUNT as usize], 0);
    while place < bytes.len() {
        bytes[place] = ROWS[place / 6][place % 6 / 2].to_le_bytes()[place % 2];
        place += 1;
    }
    bytes
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
    /// Zeros, before the values are loaded.
    pub const NONE: Self = Self { values: [0; Setting::COUNT as usize] };

    /// The factory settings.
    pub fn new() -> Self {
        let mut settings = Self::NONE;
        settings.take_defaults();
        settings
    }

    /// The factory settings with these changes, each within its range.
    #[cfg(test)]
    pub(crate) fn with(changes: &[(Setting, u16)]) -> Self {
        let mut settings = Self::new();
        for &(setting, value) in changes {
            settings.set(setting, value).expect("within its range");
        }
        settings
    }

    /// Restores factory settings.
    #[cfg_attr(target_arch = "avr", inline(never))]
    pub fn take_defaults(&mut self) {
        for (value, setting) in self.values.iter_mut().zip(Setting::all()) {
            *value = setting.default();
        }
    }

    /// A setting's value, in its name's unit.
    pub fn get(&self, setting: Setting) -> u16 {
        self.values[setting as usize]
    }

    /// Sets a value.
    ///
    /// # Errors
    /// [`OutOfRange`] if the value is outside the table's range. The old value stays.
    pub fn set(&mut self, setting: Setting, value: u16) -> Result<(), OutOfRange> {
        if !setting.allows(value) {
            return Err(OutOfRange);
        }
        self.values[setting as usize] = value;
        Ok(())
    }

    /// Sets a value as the console does: another wheel needs a new calibration.
    ///
    /// # Errors
    /// As [`set`](Self::set).
    pub fn change(&mut self, setting: Setting, value: u16) -> Result<(), OutOfRange> {
        let before = self.get(setting);
        self.set(setting, value)?;
        if setting.is_of_the_wheel() && value != before {
            self.set(Setting::TicksPerM, 0)?;
        }
        Ok(())
    }

    /// The first contradiction between settings, if any.
    ///
    /// At top speed, the zone of a plant just behind the beam must not reach the tool before the tool is out. The zone is the margin
    /// and, round a narrow plant, half of the stem zone. The tool takes the lead, an eighth more for variation of the speed, and the
    /// sensor's response.
    #[inline(never)]
    pub fn contradiction(&self) -> Option<Contradiction> {
        if self.get(Setting::ServoInUs) == self.get(Setting::ServoOutUs) {
            return Some(Contradiction::PulsesEqual);
        }
        // Both, because a change of the nominal wheel clears the calibration.
        let measured = self.get(Setting::TicksPerM);
        if self.nominal_ticks_per_m() < TICKS_PER_M_LEAST || (1..TICKS_PER_M_LEAST).contains(&measured) {
            return Some(Contradiction::EncoderTooCoarse);
        }
        let lead_out_ms = self.get(Setting::LeadOutMs);
        let notice_ms = lead_out_ms + lead_out_ms / 8 + self.get(Setting::BeamResponseMs) + 1;
        let rolled = Speed(self.get(Setting::TopSpeedMmS) as i16).distance_in_ms(notice_ms);
        let needed_mm = self.get(Setting::MarginMm) + self.get(Setting::StemZoneMm) / 2 + rolled.0 as u16 + 1;
        let beam_to_tool_mm = self.get(Setting::BeamToToolMm);
        if beam_to_tool_mm < needed_mm {
            return Some(Contradiction::BeamTooNear { needed_mm });
        }
        let second_beam_mm = self.get(Setting::SecondBeamMm);
        let can_stand = (SECOND_BEAM_LEAST_MM..=beam_to_tool_mm - SECOND_BEAM_LEAST_MM).contains(&second_beam_mm);
        let is_astray = second_beam_mm > 0 && (!can_stand || beam_to_tool_mm > SLIPPING_BEAM_TO_TOOL_MM);
        is_astray.then_some(Contradiction::SecondBeamAstray)
    }

    /// The ground wheel and its encoder.
    pub fn wheel(&self) -> Wheel {
        Wheel::of_tick(match self.get(Setting::TicksPerM) {
            0 => self.nominal_tick(),
            ticks_per_m => Wheel::tick_measured(ticks_per_m),
        })
    }

    /// A tick of the wheel from its diameter and encoder counts, without calibration.
    fn nominal_tick(&self) -> u32 {
        Wheel::tick_of_diameter(self.get(Setting::TicksPerRev), self.get(Setting::WheelMm))
    }

    /// Ticks a metre of the wheel without calibration.
    #[inline(never)]
    pub fn nominal_ticks_per_m(&self) -> u16 {
        Wheel::ticks_of(self.nominal_tick(), 1000).0 as u16
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
