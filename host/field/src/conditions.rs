//! The conditions of a field trial: plot, crop, weeds, ground, driving, sensors, machine and firmware settings.
//!
//! One table gives each parameter's name, default, range, meaning and where its number comes from; TOML files, sweeps and the
//! report's list of parameters follow from it. A file names what differs from the default, and so do the presets. No public
//! data of places of crop plants in a row, in millimetres, was found: scatter and shares are assumed, and say so.
//!
//! What the conditions do is not here: [`crate::stand`] grows plants and weeds, [`crate::driving`] rolls.

use crate::machine::{Dirt, Machine};
use crate::servo::{Scatter, Servo};
use crate::verdict::Timing;
use control::settings::Setting;
use serde::{Deserialize, Serialize};
use std::collections::BTreeMap;
use std::io;
use std::path::{Path, PathBuf};
use thiserror::Error;
use toml::de::DeTable;

/// A parameter, as the table has it.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct Parameter {
    /// Table and key, joined by a point.
    pub name: &'static str,
    /// What it is, in the unit that its name carries.
    pub meaning: &'static str,
    /// Where its default comes from.
    pub source: &'static str,
    /// Least value.
    pub least: f64,
    /// Greatest value.
    pub greatest: f64,
}

/// The one table from which everything else about the parameters is made.
macro_rules! parameters {
    ($($(#[doc = $about:literal])* $table:ident: $Table:ident {
        $($key:ident: $kind:ty = $default:literal, $least:literal to $greatest:literal, $meaning:literal, $source:literal;)*
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

        /// What a field trial takes place in, and with.
        #[derive(Clone, Debug, Default, PartialEq, Serialize, Deserialize)]
        #[serde(deny_unknown_fields, default)]
        pub struct Conditions {
            $($(#[doc = $about])* pub $table: $Table,)*
            /// Settings that the firmware is told instead of those that follow from the machine, by their names.
            pub settings: BTreeMap<String, u16>,
        }

        /// Every parameter, in the table's order.
        pub const PARAMETERS: &[Parameter] = &[$($(Parameter {
            name: concat!(stringify!($table), ".", stringify!($key)),
            meaning: $meaning,
            source: $source,
            least: $least as f64,
            greatest: $greatest as f64,
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
    }
    /// The crop.
    crop: Crop {
        spacing_scatter_mm: f64 = 30.0, 0 to 200, "a plant stands within this of its place along the row, evenly spread", "assumed";
        across_scatter_mm: f64 = 5.0, 0 to 50, "a plant stands within this of the row's line, evenly spread", "assumed";
        canopy_mm: f64 = 150.0, 20 to 350, "mean width of a canopy", "assumed, for chilli some weeks after transplanting";
        canopy_scatter_mm: f64 = 40.0, 0 to 150, "a canopy's width is within this of its mean, evenly spread", "assumed";
        protected_mm: f64 = 90.0, 2 to 350, "diameter of the zone round a stem that no tool may enter", "assumed; with it the paper's controller damages about what the paper found, up to 3.9 %";
        missing_percent: f64 = 3.0, 0 to 90, "share of the places without a plant", "assumed";
        double_percent: f64 = 2.0, 0 to 90, "share of the places with a second plant beside the first", "assumed";
        ragged_percent: f64 = 30.0, 0 to 100, "share of the canopies with gaps through which the beam passes", "assumed";
    }
    /// The weeds.
    weeds: Weeds {
        short_per_m2: f64 = 60.0, 1 to 2000, "weeds too short for the beam, everywhere", "assumed";
        tall_per_m: f64 = 0.3, 0 to 5, "weeds in the row tall enough to break the beam", "assumed";
    }
    /// The ground.
    ground: Ground {
        slip_percent: f64 = 5.0, -30 to 30, "mean slip of the wheel that the encoder counts: above 0 where it drives, below where it is dragged", "assumed, for a driving wheel on tilled soil that nobody calibrated";
        slip_scatter_percent: f64 = 3.0, 0 to 10, "slip is within this of its mean, evenly spread, and changes every metre or two", "assumed";
    }
    /// The driving.
    driving: Driving {
        speed_scatter_percent: f64 = 8.0, 0 to 50, "speed wanders within this of its mean, evenly spread", "assumed, for a person who walks behind";
        stops_per_100_m: f64 = 1.0, 0 to 50, "stops on the way", "assumed";
        stop_s: f64 = 5.0, 0 to 600, "mean length of a stop", "assumed";
        turn_s: f64 = 6.0, 0 to 600, "mean time for a turn at a row's end", "assumed: the paper's field efficiency of 81 to 86 % asks for about this";
    }
    /// What the sensors suffer.
    sensors: Sensors {
        unseen_percent: f64 = 0.0, 0 to 100, "share of the plants that the beam does not see, for they are too short", "none: no controller can spare them";
        dust_per_m: f64 = 0.02, 0 to 10, "breaks of the beam by clods and insects", "assumed";
        lost_pulses_percent: f64 = 0.01, 0 to 20, "share of the encoder's pulses that are missing", "assumed";
    }
    /// The machine.
    machine: Mechanism {
        beam_to_tool_mm: f64 = 400.0, 100 to 2000, "X, from the beam back to the tool", "assumed: the paper does not say it";
        arm_mm: f64 = 350.0, 100 to 1000, "length of the arm that swings the tool aside", "the paper's Table 1";
        tool_width_mm: f64 = 55.0, 10 to 200, "width of the tool in the row", "the paper's Table 1";
        sweeps_a_side: u32 = 2, 0 to 6, "sweeps between the rows, on each side of the row", "the paper's Eq. 7";
        sweep_width_mm: f64 = 80.0, 10 to 400, "width of a sweep", "the paper's Table 1";
        sweep_from_mm: f64 = 50.0, 10 to 400, "from the row's line to the nearest sweep's edge: so wide is the row on either side", "assumed: the sweeps then keep off the zones round the stems and fill the machine's width";
        dead_time_ms: f64 = 65.0, 0 to 500, "mean time from a pulse until the servo moves", "hobby servos under load: 57 to 117 ms";
        dead_time_scatter_ms: f64 = 15.0, 0 to 200, "dead time is within this of its mean, evenly spread", "assumed";
        travel_ms: f64 = 120.0, 10 to 2000, "time for 45 degrees without load", "60 kg cm servos: 98 to 120 ms";
        load_percent: f64 = 20.0, 0 to 200, "the soil makes the travel longer by up to this, evenly spread", "up to 100 in the worst case";
        power_hp: f64 = 2.5, 0.1 to 50, "the engine's power, for the performance index", "the paper's Table 1";
    }
}

/// The presets: a name, and a file that says what differs from the default.
const PRESETS: &[(&str, &str)] = &[
    ("transplanted", ""),
    ("even-stand", include_str!("../presets/even-stand.toml")),
    ("direct-sown", include_str!("../presets/direct-sown.toml")),
    ("weedy", include_str!("../presets/weedy.toml")),
    ("soft-ground", include_str!("../presets/soft-ground.toml")),
    ("heavy-soil", include_str!("../presets/heavy-soil.toml")),
    ("dusty", include_str!("../presets/dusty.toml")),
];

/// What is wrong with conditions, and what would be right.
#[derive(Debug, Error)]
pub enum ConditionsError {
    /// Neither a preset nor a file that can be read.
    #[error("{} is none of the presets ({presets}), and as a file it cannot be read", path.display(), presets = presets().collect::<Vec<_>>().join(", "))]
    Unreadable {
        /// The name or path.
        path: PathBuf,
        /// What the system says.
        source: io::Error,
    },
    /// The file is no TOML, or has keys or kinds of values that are not known.
    #[error("{}, line {line}: {problem}", path.display())]
    NotUnderstood {
        /// The file.
        path: PathBuf,
        /// The line, from 1.
        line: usize,
        /// What is wrong, and what would be right where that is known.
        problem: String,
    },
    /// A value in a file is out of its range.
    #[error("{}, line {line}: {problem}", path.display())]
    AtLine {
        /// The file.
        path: PathBuf,
        /// The line, from 1.
        line: usize,
        /// What is wrong.
        problem: WrongValue,
    },
    /// A value is wrong.
    #[error(transparent)]
    Wrong(#[from] WrongValue),
}

/// A value that a parameter or setting cannot have.
#[derive(Clone, Debug, Error, PartialEq)]
pub enum WrongValue {
    /// The value is out of its range.
    #[error("{name} is {value}, but has to be {least} to {greatest}: {meaning}")]
    OutOfRange {
        /// The parameter.
        name: String,
        /// Its value.
        value: f64,
        /// The least value.
        least: f64,
        /// The greatest value.
        greatest: f64,
        /// What it is.
        meaning: String,
    },
    /// Sweeps would run through what is to be kept.
    #[error("machine.sweep_from_mm is {from_mm}, but {why}")]
    Sweeps {
        /// Where they begin.
        from_mm: f64,
        /// What would be right.
        why: String,
    },
    /// A count is no whole number.
    #[error("{name} is {value}, but has to be a whole number")]
    NotWhole {
        /// The parameter.
        name: String,
        /// Its value.
        value: f64,
    },
    /// Nobody knows the name.
    #[error("{0} is neither a parameter of the field nor a setting of the firmware; there are {known}", known = names().collect::<Vec<_>>().join(", "))]
    Unknown(String),
}

/// The presets' names.
pub fn presets() -> impl Iterator<Item = &'static str> {
    PRESETS.iter().map(|(preset, _)| *preset)
}

/// All names that [`Conditions::set`] takes.
fn names() -> impl Iterator<Item = String> {
    PARAMETERS
        .iter()
        .map(|parameter| parameter.name.to_owned())
        .chain(Setting::all().map(|setting| setting.text().to_string()))
}

impl Conditions {
    /// Those of a preset, or of a file, whose text `read` gives.
    ///
    /// # Errors
    /// Where it is neither, or something in the file is wrong: with the line.
    pub fn load(preset_or_file: &str, read: impl FnOnce(&Path) -> io::Result<String>) -> Result<Self, ConditionsError> {
        let path = Path::new(preset_or_file);
        match Self::preset(preset_or_file) {
            Some(conditions) => conditions,
            None => {
                let text =
                    read(path).map_err(|source| ConditionsError::Unreadable { path: path.to_owned(), source })?;
                Self::parse(path, &text)
            }
        }
    }

    /// Those of a preset; none where it has another name.
    pub fn preset(name: &str) -> Option<Result<Self, ConditionsError>> {
        let (preset, text) = PRESETS.iter().find(|(preset, _)| *preset == name)?;
        Some(Self::parse(Path::new(preset), text))
    }

    fn parse(path: &Path, text: &str) -> Result<Self, ConditionsError> {
        let not_understood = |error: toml::de::Error| ConditionsError::NotUnderstood {
            path: path.to_owned(),
            line: line_at(text, error.span().map_or(0, |span| span.start)),
            problem: explain(text, &error),
        };
        let conditions: Self = toml::from_str(text).map_err(not_understood)?;
        conditions.check().map_err(|problem| match line(text, problem.name()) {
            Some(line) => ConditionsError::AtLine { path: path.to_owned(), line, problem },
            None => problem.into(),
        })?;
        Ok(conditions)
    }

    /// Whether every value is in its range, and the sweeps keep off the crop.
    fn check(&self) -> Result<(), WrongValue> {
        let parameters = self.values().map(|(parameter, value)| {
            let &Parameter { name, meaning, least, greatest, .. } = parameter;
            (name.to_owned(), value, least, greatest, meaning.to_owned())
        });
        for (name, value, least, greatest, meaning) in parameters {
            // A number that is none is in no range.
            if !(least..=greatest).contains(&value) {
                return Err(WrongValue::OutOfRange { name, value, least, greatest, meaning });
            }
        }
        self.check_sweeps()?;
        for (key, &value) in &self.settings {
            let setting =
                Setting::find(key.as_bytes()).ok_or_else(|| WrongValue::Unknown(format!("settings.{key}")))?;
            let range = setting.description();
            if !(range.least..=range.greatest).contains(&value) {
                return Err(WrongValue::OutOfRange {
                    name: format!("settings.{key}"),
                    value: value.into(),
                    least: range.least.into(),
                    greatest: range.greatest.into(),
                    meaning: setting.help().to_string(),
                });
            }
        }
        Ok(())
    }

    /// Whether the sweeps run between the zones round the stems of this row and of the next.
    fn check_sweeps(&self) -> Result<(), WrongValue> {
        let Mechanism { sweeps_a_side, sweep_width_mm, sweep_from_mm: from_mm, .. } = self.machine;
        let zone_mm = self.crop.protected_mm / 2.0 + self.crop.across_scatter_mm;
        let to_mm = from_mm + f64::from(sweeps_a_side) * sweep_width_mm;
        let next_mm = self.plot.row_spacing_mm - zone_mm;
        let why = if sweeps_a_side == 0 {
            return Ok(());
        } else if from_mm < zone_mm {
            format!("the zone round a stem reaches {zone_mm:.1} mm from the row's line")
        } else if to_mm > next_mm {
            format!("the sweeps then reach {to_mm:.1} mm, and the next row's plants begin at {next_mm:.1} mm")
        } else {
            return Ok(());
        };
        Err(WrongValue::Sweeps { from_mm, why })
    }

    /// Changes a parameter, named `table.key`, or a setting of the firmware, named as the firmware does.
    ///
    /// # Errors
    /// Where there is no such name, or the value is out of its range.
    pub fn set(&mut self, parameter: &str, value: f64) -> Result<(), WrongValue> {
        let whole = || {
            let not_whole = || WrongValue::NotWhole { name: parameter.to_owned(), value };
            if value.fract() == 0.0 && value.abs() < f64::from(u32::MAX) { Ok(value as i64) } else { Err(not_whole()) }
        };
        let mut changed = self.clone();
        if Setting::find(parameter.as_bytes()).is_some() {
            changed.settings.insert(parameter.to_owned(), u16::try_from(whole()?).unwrap_or(u16::MAX));
        } else {
            let unknown = || WrongValue::Unknown(parameter.to_owned());
            let mut tables = toml::Table::try_from(&*self).map_err(|_| unknown())?;
            let entry = parameter
                .split_once('.')
                .and_then(|(table, key)| tables.get_mut(table)?.as_table_mut()?.get_mut(key))
                .filter(|_| PARAMETERS.iter().any(|known| known.name == parameter))
                .ok_or_else(unknown)?;
            *entry = if entry.is_integer() { toml::Value::Integer(whole()?) } else { toml::Value::Float(value) };
            changed = tables.try_into().map_err(|_| WrongValue::NotWhole { name: parameter.to_owned(), value })?;
        }
        changed.check()?;
        *self = changed;
        Ok(())
    }

    /// The machine, whose servo and encoder are the `seed`'s of all the possible ones.
    pub fn machine(&self, seed: u64) -> Machine {
        let Mechanism { beam_to_tool_mm, arm_mm, tool_width_mm, .. } = self.machine;
        let scatter =
            Scatter { dead_time_ms: self.machine.dead_time_scatter_ms, load: self.machine.load_percent / 100.0, seed };
        let (dead_time_ms, travel_ms) = (self.machine.dead_time_ms, self.machine.travel_ms);
        Machine {
            beam_to_tool_mm,
            arm_mm,
            tool_width_mm,
            servo: Servo { dead_time_ms, travel_ms, scatter, ..Servo::default() },
            dirt: Dirt { share: self.sensors.lost_pulses_percent / 100.0, seed },
            ..Machine::default()
        }
    }

    /// Margin and leads that the firmware is told.
    pub fn timing(&self) -> Timing {
        let default = Timing::default();
        let told = |setting: Setting, otherwise| {
            self.settings.get(&setting.text().to_string()).map_or(otherwise, |&value| value.into())
        };
        Timing {
            margin_mm: told(Setting::MarginMm, default.margin_mm),
            lead_out_ms: told(Setting::LeadOutMs, default.lead_out_ms),
            lead_in_ms: told(Setting::LeadInMs, default.lead_in_ms),
        }
    }

    /// The firmware's settings that are told beside those of machine and timing.
    pub fn told(&self) -> Vec<(Setting, u16)> {
        let timing = [Setting::MarginMm, Setting::LeadOutMs, Setting::LeadInMs];
        self.settings
            .iter()
            .filter_map(|(key, &value)| Some((Setting::find(key.as_bytes())?, value)))
            .filter(|(setting, _)| !timing.contains(setting))
            .collect()
    }
}

impl WrongValue {
    fn name(&self) -> &str {
        match self {
            Self::OutOfRange { name, .. } | Self::NotWhole { name, .. } | Self::Unknown(name) => name,
            Self::Sweeps { .. } => "machine.sweep_from_mm",
        }
    }
}

/// The line, from 1, in which `table.key` stands.
fn line(text: &str, name: &str) -> Option<usize> {
    let (table, key) = name.split_once('.')?;
    let root = DeTable::parse(text).ok()?;
    let (key, _) = root.get_ref().get(table)?.get_ref().as_table()?.get_key_value(key)?;
    Some(line_at(text, key.span().start))
}

/// The line, from 1, in which this byte stands.
fn line_at(text: &str, byte: usize) -> usize {
    text.bytes().take(byte).filter(|&byte| byte == b'\n').count() + 1
}

/// What the TOML reader found wrong, in a line; where it is the value of a parameter or setting, what that has to be.
fn explain(text: &str, error: &toml::de::Error) -> String {
    let at = error.span().map_or(0, |span| span.start);
    let root = DeTable::parse(text).ok();
    let entries = root.iter().flat_map(|root| root.get_ref()).flat_map(|(table, entries)| {
        let entries = entries.get_ref().as_table().into_iter().flatten();
        entries.map(|(key, value)| (table.get_ref().as_ref(), key.get_ref().as_ref(), value.span()))
    });
    let wrong = entries.into_iter().find_map(|(table, key, value): (&str, &str, _)| {
        let is_here = value.contains(&at);
        let (least, greatest, meaning) = range(table, key).filter(|_| is_here)?;
        let written = &text[value];
        Some(format!("{table}.{key} is {written}, but has to be a number from {least} to {greatest}: {meaning}"))
    });
    wrong.unwrap_or_else(|| error.message().trim().replace('\n', ", "))
}

/// The range of a parameter or setting, and what it is.
fn range(table: &str, key: &str) -> Option<(f64, f64, String)> {
    if table == "settings" {
        let setting = Setting::find(key.as_bytes())?;
        let range = setting.description();
        return Some((range.least.into(), range.greatest.into(), setting.help().to_string()));
    }
    let parameter = PARAMETERS.iter().find(|known| known.name.split_once('.') == Some((table, key)))?;
    Some((parameter.least, parameter.greatest, parameter.meaning.to_owned()))
}

#[cfg(test)]
mod tests {
    use super::*;

    fn parse(text: &str) -> Result<Conditions, String> {
        Conditions::parse(Path::new("field.toml"), text).map_err(|error| error.to_string())
    }

    #[test]
    fn every_default_and_every_preset_is_within_the_ranges() {
        for preset in presets() {
            assert!(Conditions::preset(preset).is_some_and(|parsed| parsed.is_ok()), "{preset}");
        }
    }

    #[test]
    fn a_file_says_what_differs_from_the_default() {
        let conditions = parse("[crop]\nspacing_scatter_mm = 12.5\n[plot]\nrows = 2\n[settings]\nk = 5\n").unwrap();
        let mut expected = Conditions::default();
        expected.set("crop.spacing_scatter_mm", 12.5).unwrap();
        expected.set("plot.rows", 2.0).unwrap();
        expected.set("k", 5.0).unwrap();
        assert_eq!(conditions, expected);
        assert_eq!(conditions.told(), [(Setting::K, 5)]);
    }

    #[test]
    fn margin_and_leads_are_told_once_as_the_timing() {
        let conditions = parse("[settings]\nlead_out_ms = 200\nmargin_mm = 40\n").unwrap();
        assert_eq!(conditions.timing(), Timing { lead_out_ms: 200, margin_mm: 40, ..Timing::default() });
        assert!(conditions.told().is_empty());
    }

    #[test]
    fn a_bad_file_is_named_with_its_line_and_what_would_be_right() {
        for (text, error) in [
            (
                "[ground]\n\nslip_percent = 40\n",
                "field.toml, line 3: ground.slip_percent is 40, but has to be -30 to 30: mean slip",
            ),
            (
                "[settings]\nlead_out_ms = 900\n",
                "field.toml, line 2: settings.lead_out_ms is 900, but has to be 0 to 500",
            ),
            ("[settings]\nlead = 9\n", "field.toml, line 2: settings.lead is neither a parameter of the field"),
            ("[ground]\nslip = 4\n", "field.toml, line 2: unknown field `slip`, expected `slip_percent`"),
            (
                "[ground]\nslip_percent = \"much\"\n",
                "field.toml, line 2: ground.slip_percent is \"much\", but has to be a number from -30 to 30: mean slip",
            ),
            ("[ground]\nslip_percent = nan\n", "field.toml, line 2: ground.slip_percent is NaN"),
        ] {
            let said = parse(text).unwrap_err();
            assert!(said.starts_with(error), "{said}");
        }
        let said = Conditions::load("no-such-field", |_| Err(io::ErrorKind::NotFound.into())).unwrap_err().to_string();
        assert!(said.starts_with("no-such-field is none of the presets (transplanted, even-stand"), "{said}");
    }

    #[test]
    fn every_parameter_can_be_set_to_the_ends_of_its_range_and_not_beyond() {
        for parameter in PARAMETERS {
            let mut conditions = Conditions::default();
            // Without sweeps, which are in the way of many an extreme.
            conditions.set("machine.sweeps_a_side", 0.0).unwrap();
            for end in [parameter.least, parameter.greatest] {
                if parameter.name == "machine.sweeps_a_side" && end > 0.0 {
                    continue;
                }
                conditions.set(parameter.name, end).unwrap_or_else(|error| panic!("{error}"));
                let (_, value) = conditions.values().find(|(known, _)| *known == parameter).unwrap();
                assert_eq!(value, end, "{}", parameter.name);
            }
            let before = conditions.clone();
            assert!(conditions.set(parameter.name, parameter.greatest + 1.0).is_err(), "{}", parameter.name);
            assert_eq!(conditions, before);
        }
    }
}
