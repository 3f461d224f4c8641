//! The conditions of a field trial: plot, crop, weeds, ground, driving, sensors, machine and firmware settings.
//!
//! One table gives each parameter's name, default, range, meaning and source. TOML files, sweeps and the report's list
//! of parameters follow from it. A file lists only values that differ from the default, and so do the presets. No
//! public data of plant positions in a row, in millimetres, was found. So scatter and shares are assumed, and the table
//! says so.
//!
//! [`crate::stand`], [`crate::driving`] and [`crate::pass`] apply the conditions.

mod parameters;

use control::settings::{SECOND_BEAM_LEAST_MM, SLIPPING_BEAM_TO_TOOL_MM, Setting};
use files::toml_entry::{self, Entry};
use files::{FileError, bounded_file, near};
pub use parameters::{
    Arm, Conditions, Crop, Driving, GroundConditions, Mechanism, PARAMETERS, Parameter, Plot, Sensors, Weeds,
};
use std::fmt::Display;
use std::io::ErrorKind;
use std::ops::Range;
use std::path::Path;
use thiserror::Error;

/// The presets: a name, and a file that says what differs from the default.
const PRESETS: &[(&str, &str)] = &[
    ("transplanted", ""),
    ("even-stand", include_str!("../presets/even-stand.toml")),
    ("direct-sown", include_str!("../presets/direct-sown.toml")),
    ("weedy", include_str!("../presets/weedy.toml")),
    ("soft-ground", include_str!("../presets/soft-ground.toml")),
    ("heavy-soil", include_str!("../presets/heavy-soil.toml")),
    ("dusty", include_str!("../presets/dusty.toml")),
    ("hand-steered", include_str!("../presets/hand-steered.toml")),
    ("walked", include_str!("../presets/walked.toml")),
    ("straight", include_str!("../presets/straight.toml")),
    ("quick-tool", include_str!("../presets/quick-tool.toml")),
    ("chilli", include_str!("../presets/chilli.toml")),
    ("broccoli", include_str!("../presets/broccoli.toml")),
    ("maize", include_str!("../presets/maize.toml")),
    ("maize-uneven", include_str!("../presets/maize-uneven.toml")),
    // The same field as the first, named by its machine.
    ("from-the-box", ""),
    ("paper", include_str!("../presets/paper.toml")),
];

/// The preset that every study takes if the user names no other: a machine that a person walks behind.
pub const DEFAULT: &str = "walked";

/// The presets' names.
pub fn presets() -> impl Iterator<Item = &'static str> {
    PRESETS.iter().map(|(preset, _)| *preset)
}

impl Conditions {
    /// The conditions of a preset, or of a file.
    ///
    /// # Errors
    /// If it is neither, or something in the file is wrong: with the line.
    pub fn load(preset_or_file: &str) -> Result<Self, FileError> {
        if let Some(conditions) = Self::preset(preset_or_file) {
            return conditions;
        }
        let path = Path::new(preset_or_file);
        match bounded_file::text(path) {
            // A file that is there has an error of its own.
            Err(FileError::File { source, .. }) if source.kind() == ErrorKind::NotFound => {
                let meant = near(preset_or_file, presets()).map(|near| format!("; did you mean {near}?"));
                let (presets, meant) = (presets().collect::<Vec<_>>().join(", "), meant.unwrap_or_default());
                let problem = format!("is none of the presets ({presets}), and as a file it cannot be read{meant}");
                Err(FileError::unusable(path, problem, source))
            }
            read => {
                let text = read?;
                if text.trim().is_empty() {
                    // Such as the output of a command that failed.
                    return Err(FileError::at_byte(path, &text, 0, "the file is empty: name a preset instead"));
                }
                Self::parse(path, &text)
            }
        }
    }

    /// The conditions of a preset. `None` if there is no preset of this name.
    pub fn preset(name: &str) -> Option<Result<Self, FileError>> {
        let (preset, text) = PRESETS.iter().find(|(preset, _)| *preset == name)?;
        Some(Self::parse(Path::new(preset), text))
    }

    fn parse(path: &Path, text: &str) -> Result<Self, FileError> {
        bounded_file::check_nesting(path, text)?;
        let conditions: Self = toml::from_str(text).map_err(|error| {
            let byte = error.span().map_or(0, |span| span.start);
            FileError::at_byte(path, text, byte, explain(text, byte, &error))
        })?;
        conditions.check().map_err(|wrong| FileError::at_key(path, text, &wrong.name, wrong.to_string()))?;
        Ok(conditions)
    }

    /// Whether every value is in its range, and the sweeps keep off the crop.
    fn check(&self) -> Result<(), WrongValue> {
        self.values().try_for_each(|(parameter, value)| in_range(parameter.name.to_owned(), value))?;
        self.check_sweeps()?;
        self.check_beams()?;
        self.settings.iter().try_for_each(|(key, &value)| in_range(format!("settings.{key}"), value.into()))
    }

    /// Whether the sweeps run between the zones round the stems of this row and of the next.
    fn check_sweeps(&self) -> Result<(), WrongValue> {
        let Range { start: from_mm, end: to_mm } = self.machine.swept_mm();
        let Range { start: zone_mm, end: next_mm } = self.between_zones_mm();
        let why = if self.machine.sweeps_a_side == 0 {
            return Ok(());
        } else if from_mm < zone_mm {
            format!("the zone round a stem reaches {zone_mm:.1} mm from the row's line")
        } else if to_mm > next_mm {
            format!("the sweeps then reach {to_mm:.1} mm, and the next row's plants begin at {next_mm:.1} mm")
        } else {
            return Ok(());
        };
        Err(WrongValue::new("machine.sweep_from_mm", format!("is {from_mm}, but {why}")))
    }

    /// The ground across the row between the zones round the stems of this row and of the next.
    fn between_zones_mm(&self) -> Range<f64> {
        let zone_mm = self.crop.protected_mm / 2.0 + self.crop.across_scatter_mm;
        zone_mm..self.plot.row_spacing_mm - zone_mm
    }

    /// Whether the second beam stands where the firmware takes one.
    fn check_beams(&self) -> Result<(), WrongValue> {
        let Mechanism { beam_to_tool_mm, second_beam_mm, .. } = self.machine;
        let least = f64::from(SECOND_BEAM_LEAST_MM);
        let has_room = (2.0 * least..=f64::from(SLIPPING_BEAM_TO_TOOL_MM)).contains(&beam_to_tool_mm.round());
        let (least, greatest) = if has_room { (least, beam_to_tool_mm.round() - least) } else { (0.0, 0.0) };
        if second_beam_mm == 0.0 || (least..=greatest).contains(&second_beam_mm.round()) {
            return Ok(());
        }
        let meaning = format!(
            "0 for none, so far behind the first beam and ahead of the tool, which may be {SLIPPING_BEAM_TO_TOOL_MM} mm behind the first then"
        );
        Err(WrongValue::out_of_range("machine.second_beam_mm", second_beam_mm, (least, greatest), meaning))
    }

    /// What is likely wrong with these conditions, in sentences.
    pub fn warning(&self) -> Option<String> {
        let warnings: Vec<String> = self.cutting_sweeps().into_iter().chain(self.other_machine()).collect();
        (!warnings.is_empty()).then(|| warnings.join(" "))
    }

    /// The names of parameters that differ from their defaults, and that a pass of one row at a steady speed does not use.
    pub fn unused_by_a_row(&self) -> Vec<&'static str> {
        const USED: [&str; 6] = [
            "plot.row_spacing_mm",
            "crop.protected_mm",
            "ground.slip_percent",
            "sensors.beam_mm",
            "sensors.beam_response_ms",
            "sensors.lost_pulses_percent",
        ];
        let default = Self::default();
        let changed = self.values().zip(default.values()).filter(|((_, value), (_, default))| value != default);
        let names = changed.map(|((parameter, _), _)| parameter.name);
        let is_used = |name: &str| match name {
            "machine.side_play_mm" | "machine.power_hp" => false,
            _ => name.starts_with("machine.") || USED.contains(&name),
        };
        names.filter(|name| !is_used(name)).collect()
    }

    /// Whether the machine strays farther than its sweeps allow, in sentences.
    fn cutting_sweeps(&self) -> Option<String> {
        let (between, swept) = (self.between_zones_mm(), self.machine.swept_mm());
        let (inner_mm, outer_mm) = (swept.start - between.start, between.end - swept.end);
        let room_mm = inner_mm.min(outer_mm);
        let strays_mm = self.driving.steering_mm;
        let strays_too_far = self.machine.sweeps_a_side > 0 && strays_mm > room_mm;
        strays_too_far.then(|| {
            let advice = if strays_mm > inner_mm {
                format!("Set machine.sweep_from_mm to {:.0} or more.", (between.start + strays_mm).ceil())
            } else {
                let end_mm = (between.end - strays_mm).floor();
                format!("Set machine.sweep_width_mm so that the sweeps end at {end_mm:.0} mm or less.")
            };
            format!(
                "driving.steering_mm is {strays_mm}, but the sweeps leave {room_mm:.1} mm: they cut plants. {advice}"
            )
        })
    }

    /// The same field and machine before anything is fitted, set or measured.
    pub fn from_the_box(&self) -> Self {
        let Mechanism { tool_width_mm, second_beam_mm, .. } = Mechanism::default();
        let machine = Mechanism { tool_width_mm, second_beam_mm, ..self.machine.clone() };
        Self { machine, settings: Default::default(), ..self.clone() }
    }

    /// Changes a parameter, named `table.key`, or a setting of the firmware, by the firmware's name.
    ///
    /// # Errors
    /// If the name is unknown, or the value is out of range.
    pub fn set(&mut self, parameter: &str, value: f64) -> Result<(), WrongValue> {
        let is_setting = Setting::find(parameter.as_bytes()).is_some();
        // A conversion would change a value that is out of range.
        in_range(if is_setting { format!("settings.{parameter}") } else { parameter.to_owned() }, value)?;
        let is_whole = value.fract() == 0.0;
        let whole = || is_whole.then_some(value as i64).ok_or_else(|| WrongValue::not_whole(parameter, value));
        let mut changed = self.clone();
        if is_setting {
            changed.settings.insert(parameter.to_owned(), whole()? as u16);
        } else {
            let unknown = || WrongValue::unknown(parameter);
            let mut tables = toml::Table::try_from(&*self).map_err(|_| unknown())?;
            let known = PARAMETERS.iter().find(|known| known.name == parameter).ok_or_else(unknown)?;
            let entry = parameter
                .split_once('.')
                .and_then(|(table, key)| tables.get_mut(table)?.as_table_mut()?.get_mut(key))
                .ok_or_else(unknown)?;
            *entry = match entry {
                toml::Value::Integer(_) => toml::Value::Integer(whole()?),
                toml::Value::String(_) => toml::Value::String(known.written(whole()? as f64)),
                _ => toml::Value::Float(value),
            };
            changed = tables.try_into().map_err(|_| WrongValue::not_whole(parameter, value))?;
        }
        changed.check()?;
        *self = changed;
        Ok(())
    }
}

impl Mechanism {
    /// The ground on each side of the row's line that the sweeps work.
    pub(crate) fn swept_mm(&self) -> Range<f64> {
        self.sweep_from_mm..self.sweep_from_mm + f64::from(self.sweeps_a_side) * self.sweep_width_mm
    }
}

/// A value that a parameter or setting cannot have.
#[derive(Clone, Debug, Error, PartialEq)]
#[error("{name} {problem}")]
pub struct WrongValue {
    /// The parameter, or `settings` and a setting.
    name: String,
    problem: String,
}

impl WrongValue {
    fn new(name: impl Into<String>, problem: impl Into<String>) -> Self {
        Self { name: name.into(), problem: problem.into() }
    }

    fn out_of_range(name: impl Into<String>, value: f64, range: (f64, f64), meaning: impl Display) -> Self {
        let (least, greatest) = range;
        Self::new(name, format!("is {value}, but has to be {least} to {greatest}: {meaning}"))
    }

    fn not_whole(name: &str, value: f64) -> Self {
        Self::new(name, format!("is {value}, but has to be a whole number"))
    }

    fn unknown(name: &str) -> Self {
        let parameters = PARAMETERS.iter().map(|parameter| parameter.name.to_owned());
        let known: Vec<String> = parameters.chain(Setting::all().map(|setting| setting.text().to_string())).collect();
        // A file has settings behind their table.
        let bare = name.strip_prefix("settings.").unwrap_or(name);
        let right = match near(bare, known.iter().map(String::as_str)) {
            Some(near) => format!("did you mean {near}?"),
            None => format!("there are {}", known.join(", ")),
        };
        Self::new(name, format!("is neither a parameter of the field nor a setting of the firmware; {right}"))
    }
}

/// The TOML reader's error at a byte, in one line. For a value of a parameter or setting: the valid values.
fn explain(text: &str, byte: usize, error: &toml::de::Error) -> String {
    let entry = toml_entry::around(text, byte).filter(|entry| entry.value.contains(&byte));
    let wrong = entry.and_then(|Entry { name, value, .. }| {
        let (least, greatest, meaning) = range(&name)?;
        let written = &text[value];
        if let Some(known) = PARAMETERS.iter().find(|known| known.name == name && !known.words.is_empty()) {
            let words: Vec<String> = known.words.iter().map(|word| format!("\"{word}\"")).collect();
            return Some(format!("{name} is {written}, but has to be {}: {meaning}", words.join(" or ")));
        }
        // The reader expects u16 or u32 for a whole number.
        let right = match error.message().contains(", expected u") {
            // A switched setting.
            true if greatest <= 1.0 => "0 for off, or 1 for on".to_owned(),
            true => format!("a whole number from {least} to {greatest}, without a point"),
            false => format!("a number from {least} to {greatest}"),
        };
        Some(format!("{name} is {written}, but has to be {right}: {meaning}"))
    });
    wrong.unwrap_or_else(|| error.message().trim().replace('\n', ", "))
}

/// The range of a parameter, or of a setting behind `settings.`, and its meaning. `None` if there is none of this name.
fn range(name: &str) -> Option<(f64, f64, String)> {
    if let Some(key) = name.strip_prefix("settings.") {
        let setting = Setting::find(key.as_bytes())?;
        return Some((setting.least().into(), setting.greatest().into(), setting.help().to_string()));
    }
    let parameter = PARAMETERS.iter().find(|known| known.name == name)?;
    Some((parameter.least, parameter.greatest, parameter.meaning.to_owned()))
}

/// Whether a value of a parameter, or of a setting behind `settings.`, is in its range.
fn in_range(name: String, value: f64) -> Result<(), WrongValue> {
    match range(&name) {
        None => Err(WrongValue::unknown(&name)),
        // A number that is none is in no range.
        Some((least, greatest, _)) if (least..=greatest).contains(&value) => Ok(()),
        Some((least, greatest, meaning)) => Err(WrongValue::out_of_range(name, value, (least, greatest), meaning)),
    }
}

#[cfg(test)]
impl Conditions {
    /// The conditions of a preset, with other values of some parameters.
    pub(crate) fn with(preset: &str, changes: &[(&str, f64)]) -> Self {
        let mut conditions = Self::preset(preset).expect("it is a preset").expect("it can be read");
        changes.iter().for_each(|(parameter, value)| conditions.set(parameter, *value).expect("it is a value"));
        conditions
    }
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::row::{Canopy, Row};
    use crate::tool_path::share_from_row_to_row;

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
    fn a_row_uses_what_changes_its_pass_or_its_totals() {
        let shown = |conditions: &Conditions| {
            let row = Row::new(vec![Canopy::plant(500.0, 150.0)]).unwrap();
            let share = share_from_row_to_row(conditions, 0.5);
            // The slip is that of the motion, which the caller makes.
            format!("{:?} {} {share}", conditions.pass_at_speed(row, 500.0, 1), conditions.ground.slip_percent)
        };
        let default = Conditions::default();
        for (parameter, value) in default.values() {
            let values = [parameter.least, parameter.greatest, value - 1.0, value + 1.0, value + 0.1, 100.0];
            let changed = values.into_iter().filter_map(|value| {
                let mut changed = default.clone();
                changed.set(parameter.name, value).is_ok().then_some(changed)
            });
            let changed: Vec<Conditions> = changed.filter(|changed| *changed != default).collect();
            assert!(!changed.is_empty(), "{} has another value", parameter.name);
            let is_used = changed.iter().any(|changed| shown(changed) != shown(&default));
            let is_unused = |changed: &Conditions| changed.unused_by_a_row() == [parameter.name];
            assert_eq!(changed.iter().all(is_unused), !is_used, "{}", parameter.name);
        }
    }

    #[test]
    fn a_file_has_only_differences_from_the_default() {
        let conditions = parse("[crop]\nspacing_scatter_mm = 12.5\n[plot]\nrows = 2\n[settings]\nk = 5\n").unwrap();
        let changes = [("crop.spacing_scatter_mm", 12.5), ("plot.rows", 2.0), ("k", 5.0)];
        assert_eq!(conditions, Conditions::with("transplanted", &changes));
        assert_eq!(conditions.firmware_settings(), [(Setting::K, 5)]);
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
            (
                "[machine]\nsecond_beam_mm = 400\n",
                "field.toml, line 2: machine.second_beam_mm is 400, but has to be 72 to 328",
            ),
            (
                "[machine]\nbeam_to_tool_mm = 1001\nsecond_beam_mm = 200\n",
                "field.toml, line 3: machine.second_beam_mm is 200, but has to be 0 to 0",
            ),
            (
                "[machine]\nbeam_to_tool_mm = 143\nsecond_beam_mm = 72\n",
                "field.toml, line 3: machine.second_beam_mm is 72, but has to be 0 to 0",
            ),
            ("[settings]\nlead = 9\n", "field.toml, line 2: settings.lead is neither a parameter of the field"),
            (
                "[settings]\nmargin = 9\n",
                "field.toml, line 2: settings.margin is neither a parameter of the field nor a setting of the firmware; \
                 did you mean margin_mm?",
            ),
            ("[ground]\nslip = 4\n", "field.toml, line 2: unknown field `slip`, expected `slip_percent`"),
            (
                "[ground]\nslip_percent = \"much\"\n",
                "field.toml, line 2: ground.slip_percent is \"much\", but has to be a number from -30 to 30: mean slip",
            ),
            (
                "[plot]\nrows = 3.0\n",
                "field.toml, line 2: plot.rows is 3.0, but has to be a whole number from 1 to 1000, without a point: ",
            ),
            (
                "[settings]\nk = 5.0\n",
                "field.toml, line 2: settings.k is 5.0, but has to be a whole number from 1 to 15, without a point: ",
            ),
            (
                "[settings]\nend_switch = true\n",
                "field.toml, line 2: settings.end_switch is true, but has to be 0 for off, or 1 for on: ",
            ),
            ("[ground]\nslip_percent = nan\n", "field.toml, line 2: ground.slip_percent is NaN"),
        ] {
            let said = parse(text).unwrap_err();
            assert!(said.starts_with(error), "{said}");
        }
        let said = Conditions::load("no-such-field").unwrap_err().to_string();
        assert!(said.starts_with("no-such-field is none of the presets (transplanted, even-stand"), "{said}");
        let said = Conditions::load("walkd").unwrap_err().to_string();
        assert!(said.contains("did you mean walked?"), "{said}");
    }

    #[test]
    fn a_value_that_cannot_be_set_is_named_as_it_was_given() {
        let mut conditions = Conditions::default();
        for (name, value, error) in [
            ("margin_mm", -5.0, "settings.margin_mm is -5, but has to be 0 to 200"),
            ("margin_mm", 65_636.0, "settings.margin_mm is 65636, but has to be 0 to 200"),
            ("margin_mm", 4_294_967_396.0, "settings.margin_mm is 4294967396, but has to be 0 to 200"),
            ("margin_mm", 1.5, "margin_mm is 1.5, but has to be a whole number"),
            ("plot.rows", -1.0, "plot.rows is -1, but has to be 1 to 1000"),
            ("machine.arm", 2.0, "machine.arm is 2, but has to be 0 to 1"),
        ] {
            let said = conditions.set(name, value).unwrap_err().to_string();
            assert!(said.starts_with(error), "{said}");
        }
    }

    #[test]
    fn straying_that_takes_sweeps_to_the_plants_gets_a_warning() {
        let of = |changes: &[(&str, f64)]| Conditions::with("walked", changes).warning().unwrap_or_default();
        assert_eq!(of(&[]), "");
        let said = of(&[("driving.steering_mm", 16.0)]);
        assert!(said.ends_with("leave 15.0 mm: they cut plants. Set machine.sweep_from_mm to 66 or more."), "{said}");
        for change in [("plot.row_spacing_mm", 275.0), ("machine.sweep_width_mm", 142.5)] {
            let said = of(&[change]);
            assert!(said.starts_with("driving.steering_mm is 15, but the sweeps leave 0.0 mm: they cut"), "{said}");
            assert!(said.contains("Set machine.sweep_width_mm so that the sweeps end at "), "{said}");
            assert_eq!(of(&[change, ("machine.sweeps_a_side", 0.0)]), "");
        }
    }

    #[test]
    fn every_parameter_can_be_set_to_the_ends_of_its_range_and_not_beyond() {
        for parameter in PARAMETERS {
            // Sweeps contradict many extreme values. The distance is the longest that a second beam allows.
            let changes =
                [("machine.sweeps_a_side", 0.0), ("machine.beam_to_tool_mm", f64::from(SLIPPING_BEAM_TO_TOOL_MM))];
            let mut conditions = Conditions::with("transplanted", &changes);
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
