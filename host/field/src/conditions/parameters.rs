//! The table of a field's parameters: name, default, range, meaning, and source of the number.
//!
//! [`Conditions`] and its tables, their TOML form and [`PARAMETERS`] are made from it. Checks of combined values are
//! elsewhere.

use serde::{Deserialize, Serialize};
use std::collections::BTreeMap;
use strum::VariantNames;

/// A parameter in the table.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct Parameter {
    /// Table and key, joined by a point.
    pub name: &'static str,
    /// Its meaning. Its name carries its unit.
    pub meaning: &'static str,
    /// The source of its default.
    pub source: &'static str,
    /// Least value.
    pub least: f64,
    /// Greatest value.
    pub greatest: f64,
    /// The words for its values, if they are not numbers: the first is 0.
    pub words: &'static [&'static str],
}

impl Parameter {
    /// A value as it is written in a file.
    pub fn written(&self, value: f64) -> String {
        self.words.get(value as usize).map_or_else(|| value.to_string(), |&word| word.to_owned())
    }

    /// Its values.
    pub fn range(&self) -> String {
        if self.words.is_empty() { format!("{} to {}", self.least, self.greatest) } else { self.words.join(" or ") }
    }
}

/// How the arm hangs.
#[derive(Clone, Copy, Debug, Default, PartialEq, Eq, Serialize, Deserialize, VariantNames)]
#[serde(rename_all = "lowercase")]
#[strum(serialize_all = "lowercase")]
pub enum Arm {
    /// It hangs from the servo's shaft, which lies along the row. A stroke lifts the tool.
    #[default]
    Pendulum,
    /// It lies along the row behind an upright shaft. A stroke carries the tool forward.
    Trailing,
}

impl From<Arm> for f64 {
    fn from(arm: Arm) -> Self {
        Self::from(arm as u8)
    }
}

trait Words {
    const WORDS: &'static [&'static str] = &[];
}

impl Words for f64 {}
impl Words for u32 {}
impl Words for Arm {
    const WORDS: &'static [&'static str] = Arm::VARIANTS;
}

/// The one table of parameters, from which all other code is made.
macro_rules! parameters {
    ($($(#[doc = $about:literal])* $table:ident: $Table:ident {
        $($key:ident: $kind:ty = $default:expr, $least:literal to $greatest:literal, $meaning:literal, $source:literal;)*
    })*) => {
        $($(#[doc = $about])*
        #[derive(Clone, Debug, PartialEq, Serialize, Deserialize)]
        #[serde(deny_unknown_fields, default)]
        pub struct $Table {
            $(#[doc = $meaning] pub $key: $kind,)*
        }

        impl Default for $Table {
            fn default() -> Self {
                Self { $($key: $default,)* }
            }
        })*

        /// The conditions of a field trial.
        #[derive(Clone, Debug, Default, PartialEq, Serialize, Deserialize)]
        #[serde(deny_unknown_fields, default)]
        pub struct Conditions {
            $($(#[doc = $about])* pub $table: $Table,)*
            /// Settings of the firmware, by name, that replace those calculated from the machine.
            pub settings: BTreeMap<String, u16>,
        }

        /// Every parameter, in the table's order.
        pub const PARAMETERS: &[Parameter] = &[$($(Parameter {
            name: concat!(stringify!($table), ".", stringify!($key)),
            meaning: $meaning,
            source: $source,
            least: $least as f64,
            greatest: $greatest as f64,
            words: <$kind as Words>::WORDS,
        },)*)*];

        impl Conditions {
            /// Every parameter with its value.
            pub fn values(&self) -> impl Iterator<Item = (&'static Parameter, f64)> {
                PARAMETERS.iter().zip([$($(f64::from(self.$table.$key),)*)*])
            }
        }
    };
}

parameters! {
    /// The plot.
    plot: Plot {
        rows: u32 = 3, 1 to 1000, "rows of a plot", "assumed";
        row_m: f64 = 20.0, 2 to 1000, "length of a row", "assumed";
        row_spacing_mm: f64 = 400.0, 200 to 2000, "distance between rows, which is the working width", "the machine's width, the paper's Table 1";
        counted_m2: f64 = 1.0, 0 to 1000, "ground of the plot, over its whole width, on which weeds are counted; 0 for all of it", "the paper counts them in 1 m2";
    }
    /// The crop.
    crop: Crop {
        spacing_scatter_mm: f64 = 30.0, 0 to 200, "a plant stands within this of its position along the row, evenly spread", "assumed";
        spacing_sd_mm: f64 = 0.0, 0 to 300, "standard deviation of the distance from a plant's place to the next, normally spread, beside that scatter", "none: transplanted by hand or machine";
        across_scatter_mm: f64 = 5.0, 0 to 50, "a plant stands within this of the row's line, evenly spread", "assumed";
        canopy_mm: f64 = 150.0, 20 to 350, "mean width of a canopy where it is widest, half way up", "assumed, for chilli some weeks after transplanting";
        canopy_scatter_mm: f64 = 40.0, 0 to 150, "a canopy's width is within this of its mean, evenly spread", "assumed";
        height_mm: f64 = 300.0, 20 to 2000, "mean height of a plant", "assumed, for chilli some weeks after transplanting";
        height_scatter_mm: f64 = 50.0, 0 to 500, "a plant's height is within this of its mean, evenly spread", "assumed";
        stem_off_mm: f64 = 10.0, 0 to 150, "a stem stands within this of its canopy's middle, along the row, evenly spread", "assumed";
        sway_mm: f64 = 0.0, 0 to 50, "the wind moves a canopy within this of its plant while it passes a beam, along the row, evenly spread", "none: a still day";
        protected_mm: f64 = 90.0, 2 to 350, "diameter of the zone round a stem that no tool may enter", "assumed; with it the paper's controller damages about what the paper found, up to 3.9 %";
        missing_percent: f64 = 3.0, 0 to 90, "share of the places without a plant", "assumed";
        double_percent: f64 = 2.0, 0 to 90, "share of the places with a second plant beside the first", "assumed";
        ragged_percent: f64 = 30.0, 0 to 100, "share of the canopies with gaps through which the beam passes", "assumed";
    }
    /// The weeds.
    weeds: Weeds {
        short_per_m2: f64 = 60.0, 1 to 2000, "weeds of the height below, everywhere; those in the row that outgrow the beam break it", "assumed";
        tall_per_m: f64 = 0.3, 0 to 5, "weeds in the row as tall as the crop, beside those", "assumed";
        height_mm: f64 = 50.0, 1 to 1000, "height of weeds: half of them are taller", "assumed: the paper has them shorter than the crop";
        height_factor: f64 = 1.5, 1 to 5, "two thirds of the weeds are within this factor of that height", "assumed";
        width_mm: f64 = 16.0, 1 to 200, "width of weeds where they are widest: half of them are wider", "assumed";
        width_factor: f64 = 1.6, 1 to 5, "two thirds of the weeds are within this factor of that width: some are as wide as plants", "assumed";
    }
    /// The ground.
    ground: GroundConditions {
        slip_percent: f64 = 5.0, -30 to 30, "mean slip of the wheel that the encoder counts: above 0 where it drives, below where it is dragged", "assumed, for a driving wheel on tilled soil, not calibrated";
        slip_scatter_percent: f64 = 3.0, 0 to 10, "slip is within this of its mean, evenly spread, and changes every metre or two", "assumed";
    }
    /// The driving.
    driving: Driving {
        speed_scatter_percent: f64 = 8.0, 0 to 50, "speed wanders within this of its mean, evenly spread", "assumed, for a person who walks behind";
        stops_per_100_m: f64 = 1.0, 0 to 50, "stops in the row", "assumed";
        stop_s: f64 = 5.0, 0 to 600, "mean length of a stop", "assumed";
        turn_m: f64 = 2.8, 0 to 100, "distance of a turn at a row's end, at the working speed", "fitted: with this, turn_s and the stops the field efficiency is the paper's Eq. 31";
        turn_s: f64 = 1.0, 0 to 600, "mean time that a turn takes beside its way", "fitted, as turn_m";
        steering_mm: f64 = 0.0, 0 to 150, "the machine strays within this of the row's line, evenly spread, gradually over a metre or two", "none: guided. Hoes guided by GPS had standard deviations of 9 to 28 mm (Griepentrog and others 2007)";
    }
    /// Disturbances of the sensors.
    sensors: Sensors {
        unseen_percent: f64 = 0.0, 0 to 100, "share of the plants that the beam does not see though they are as high as the others: bent, eaten, planted late", "none: no controller can spare them. A light beam with an encoder found 98 % of tomato transplants (Martínez-Guanter and others 2017, Sensors 17(5) 1096)";
        beam_height_mm: f64 = 150.0, 5 to 1000, "height of the beam above the ground", "assumed: half way up the mean plant, three times as high as most weeds";
        beam_mm: f64 = 2.0, 0 to 30, "diameter of the beam, which is broken while more than half of it is covered", "assumed, for a laser";
        beam_response_ms: f64 = 1.0, 0 to 50, "time after which the sensor reports a change; shorter ones it does not", "through-beam switches: 0.5 to 2 ms";
        dust_per_m: f64 = 0.02, 0 to 10, "breaks of the beam by clods and insects", "assumed";
        lost_pulses_percent: f64 = 0.01, 0 to 20, "share of the encoder's pulses that are missing", "assumed";
    }
    /// The machine.
    machine: Mechanism {
        beam_to_tool_mm: f64 = 400.0, 100 to 2000, "X, from the beam back to the tool's middle along the row", "assumed: the paper does not say it";
        second_beam_mm: f64 = 0.0, 0 to 900, "from the beam back to a second one; 0 for none", "none: the paper's machine has one";
        arm: Arm = Arm::Pendulum, 0 to 1, "a pendulum hangs across the row, a trailing arm lies along it (in a sweep 0 or 1)", "the paper: soil force times shank length is the servo's torque";
        arm_mm: f64 = 350.0, 100 to 1000, "length of the arm that swings the tool aside", "the paper's Table 1";
        tool_width_mm: f64 = 55.0, 10 to 200, "width of the tool in the row", "the paper's Table 1";
        tool_length_mm: f64 = 0.0, 0 to 200, "length of the tool in the row along the row; X is to its middle", "none: a thin blade across the row. The paper's has 45";
        side_play_mm: f64 = 0.0, 0 to 20, "the tool strays within this across the row, by the backlash of servo and shank, evenly spread, from plant to plant", "none. Half a degree to one degree on the arm of 350 mm is 3 to 6 mm";
        sweeps_a_side: u32 = 2, 0 to 6, "sweeps between the rows, on each side of the row", "the paper's Eq. 7";
        sweep_width_mm: f64 = 80.0, 10 to 400, "width of a sweep", "the paper's Table 1";
        sweep_from_mm: f64 = 50.0, 10 to 400, "from the row's line to the nearest sweep's edge: so wide is the row on either side", "assumed: the sweeps then keep off the zones round the stems and fill the machine's width";
        dead_time_ms: f64 = 65.0, 0 to 500, "mean time from a pulse until the servo moves", "hobby servos under load: 57 to 117 ms";
        dead_time_scatter_ms: f64 = 15.0, 0 to 200, "dead time is within this of its mean, evenly spread", "assumed";
        travel_ms: f64 = 120.0, 10 to 2000, "time for 45 degrees without load", "60 kg cm servos: 98 to 120 ms";
        load_kg_cm: f64 = 10.0, 0 to 200, "the soil loads the servo by up to this torque, evenly spread", "assumed: a quarter of the paper's 39.4, its greatest";
        stall_kg_cm: f64 = 60.0, 1 to 500, "torque at which the servo stalls: its speed falls to nothing by then, in a straight line", "the paper's servo";
        power_hp: f64 = 2.5, 0.1 to 50, "the engine's power, for the performance index", "the paper's Table 1";
    }
}
