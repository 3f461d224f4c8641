//! `weeder sensitivity`: what each assumption of a field costs. Each line changes one assumption, or several that belong
//! together. All others stay as they are, and so does the seed.

use anyhow::{Context, Result};
use clap::Args;
use comfy_table::CellAlignment;
use field::conditions::{self, Conditions, PARAMETERS};
use field::tool_path::Effect;
use frame::{Messages, Results, number_within, source, whole_within, with_bar};
use link::settings::Setting;
use std::collections::HashSet;
use std::str::FromStr;
use study::experiment::{ControllerKind, Engine, Experiment, totals};
use study::statistics::Share;
use study::sweep::{SPACINGS_CM, SPEEDS_KM_H};
use study::table::{NOTHING, distinct, optional, visible};
use uno_run::report::number_table;

/// The default changes. The guard is for the default spacing.
const CHANGES: [&str; 14] = [
    "crop.canopy_mm=250",
    "sensors.beam_height_mm=250",
    "sensors.unseen_percent=2",
    "sensors.unseen_percent=2,guard_spacing_mm=500,guard_scatter_mm=40",
    "sensors.dust_per_m=1",
    "crop.sway_mm=15",
    "crop.stem_off_mm=25",
    "crop.double_percent=10",
    "driving.steering_mm=25",
    "ground.slip_scatter_percent=6",
    "machine.side_play_mm=6",
    "machine.dead_time_scatter_ms=30",
    "machine.arm=trailing",
    "margin_mm=20",
];

#[derive(Args)]
#[command(after_help = "\
Examples:
  weeder sensitivity
  weeder sensitivity --field straight driving.steering_mm=5 driving.steering_mm=10
  weeder sensitivity sensors.unseen_percent=2,guard_spacing_mm=500,guard_scatter_mm=40    two settings belong together
`weeder sweep --help` lists the names. Speed and spacing are options here.")]
pub struct Arguments {
    /// The changes, each tried by itself. The guard of 500 mm is for plants 50 cm apart.
    #[arg(value_name = "NAME=VALUE[,NAME=VALUE]", default_values = CHANGES)]
    changes: Vec<Change>,
    /// The field: a preset or a TOML file, as for `weeder trial`.
    #[arg(long, value_name = "PRESET|FILE.toml", value_parser = source::preset_or_file(), hide_possible_values = true, default_value = conditions::DEFAULT)]
    field: String,
    /// Forward speeds in km/h, each 0.1 to 8.
    #[arg(long, value_delimiter = ',', default_value = "1,2.5,4", value_parser = number_within(SPEEDS_KM_H.0..=SPEEDS_KM_H.1))]
    speeds: Vec<f64>,
    /// Plant spacing in cm, 5 to 500.
    #[arg(long, default_value = "50", value_parser = number_within(SPACINGS_CM.0..=SPACINGS_CM.1))]
    spacing: f64,
    /// Plots at each speed, 1 to 1000.
    #[arg(long, default_value = "30", value_parser = whole_within(1..=1000_u32))]
    replications: u32,
    /// Random seed, 0 to 18446744073709551615.
    #[arg(long, default_value = "1", value_parser = whole_within(0..=u64::MAX))]
    seed: u64,
}

/// Values of parameters or settings that replace the field's.
#[derive(Clone, Debug, Default, PartialEq)]
struct Change(Vec<(String, f64)>);

impl FromStr for Change {
    type Err = String;

    fn from_str(text: &str) -> Result<Self, String> {
        let one = |part: &str| {
            let (name, value) = part.split_once('=')?;
            let known = PARAMETERS.iter().find(|known| known.name == name);
            let word = known.and_then(|known| known.words.iter().position(|&word| word == value));
            let value = word.map(|number| number as f64).or_else(|| value.parse().ok())?;
            Some((name.to_owned(), value))
        };
        let values: Option<Vec<(String, f64)>> = text.split(',').map(one).collect();
        let values = values.ok_or_else(|| "it has to be NAME=VALUE, as crop.canopy_mm=250".to_owned())?;
        let names = values.iter().map(|(name, _)| name).collect::<HashSet<_>>().len();
        if names < values.len() { Err("a name is in it twice".to_owned()) } else { Ok(Self(values)) }
    }
}

impl Change {
    /// The names, the values here, and those of the field, each in a cell with a line for each name.
    fn cells(&self, field: &Conditions) -> [String; 3] {
        let lines = |text: &dyn Fn(&str, f64) -> String| {
            self.0.iter().map(|(name, value)| text(name, *value)).collect::<Vec<_>>().join("\n")
        };
        let written = |name: &str, value: f64| {
            let known = PARAMETERS.iter().find(|known| known.name == name);
            known.map_or_else(|| value.to_string(), |known| known.written(value))
        };
        let of_field = |name: &str| {
            let parameter = field.values().find(|(known, _)| known.name == name).map(|(_, value)| value);
            let value = parameter.or_else(|| setting(field, name));
            value.map_or_else(|| NOTHING.to_owned(), |value| written(name, value))
        };
        [
            lines(&|name, _| name.to_owned()),
            lines(&|name, value| written(name, value)),
            lines(&|name, _| of_field(name)),
        ]
    }
}

/// The firmware's setting in a field: its own, the machine's, or the default. `None` if it follows from the speed.
fn setting(field: &Conditions, name: &str) -> Option<f64> {
    let own = field.settings.get(name).map(|&value| f64::from(value));
    own.or(match Setting::find(name.as_bytes())? {
        Setting::BeamToToolMm => Some(field.machine.beam_to_tool_mm.round()),
        Setting::SecondBeamMm => Some(field.machine.second_beam_mm.round()),
        Setting::TopSpeedMmS => None,
        other => Some(other.default().into()),
    })
}

/// What is likely wrong with the changed fields, each once, and not with the field itself.
fn warnings(field: &Conditions, changed: &[Experiment]) -> Vec<String> {
    let mut known: Vec<String> = field.warning().into_iter().collect();
    let of_field = known.len();
    for warning in changed.iter().filter_map(|experiment| experiment.conditions.warning()) {
        if !known.contains(&warning) {
            known.push(warning);
        }
    }
    known.split_off(of_field)
}

/// The rows of each line. Changes may change their number or their length.
fn rows(changed: &[Experiment]) -> String {
    let of = |experiment: &Experiment| (experiment.rows(), experiment.conditions.plot.row_m);
    let Some((count, row_m)) = changed.first().map(of) else { return String::new() };
    let lines = if changed.iter().all(|other| of(other) == (count, row_m)) { "a line" } else { "in the first line" };
    format!("{count} rows of {row_m} m {lines}")
}

pub fn run(arguments: &Arguments) -> Result<()> {
    let Arguments { changes, field, speeds, spacing, replications, seed } = arguments;
    // In the order of `totals`.
    let speeds = distinct(speeds.iter().copied());
    let conditions = source::field(field)?;
    let experiment = Experiment {
        speeds_km_h: speeds.clone(),
        spacings_cm: vec![*spacing],
        replications: *replications,
        controllers: vec![ControllerKind::Firmware],
        ..Experiment::as_in_the_paper(conditions.clone(), *seed)
    };
    let changes: Vec<Change> = [Change::default()].into_iter().chain(changes.iter().cloned()).collect();
    // All changes are checked before anything is weeded.
    let changed = changes.iter().map(|change| {
        let mut conditions = conditions.clone();
        change.0.iter().try_for_each(|(name, value)| conditions.set(name, *value))?;
        Ok(Experiment { conditions, ..experiment.clone() })
    });
    let changed = changed.collect::<Result<Vec<Experiment>>>()?;
    warnings(&conditions, &changed).iter().for_each(|warning| writeln!(Messages, "Warning: {warning}"));
    let header = ["assumption", "here", "in the\nfield"].map(str::to_owned).into_iter();
    let weeded = speeds.iter().map(|speed| format!("weeded\nat {speed}\nkm/h\nin %"));
    let damaged =
        ["seen\nplants\ndamaged\nin %", "unseen\nplants\ndamaged\nin %", "rows\nwith\nan\nalarm"].map(str::to_owned);
    let mut table = number_table(header.chain(weeded).chain(damaged), 0);
    table.column_iter_mut().take(1).for_each(|column| column.set_cell_alignment(CellAlignment::Left));
    let count = changed.len() as f64;
    with_bar("weeding", |show| {
        for (number, (change, experiment)) in changes.iter().zip(&changed).enumerate() {
            let outcomes = experiment.run(&Engine::Native, |share| show((number as f64 + share) / count));
            let outcomes = outcomes.with_context(|| format!("with {}", change.cells(&conditions)[0]))?;
            let totals = totals(&outcomes);
            let (mut effect, mut alarms) = (Effect::default(), 0);
            for total in &totals {
                effect += total.plots.effect;
                alarms += total.plots.alarms;
            }
            let (damaged, seen) = effect.injured_of_seen();
            let percent = |share: Share, decimals| optional(share.percent(), |percent| visible(percent, decimals));
            let damage = percent(Share::of(damaged, seen), 2);
            let unseen = percent(Share::of(effect.unseen, effect.all_unseen), 1);
            let weeded = totals.iter().map(|total| format!("{:.1}", 100.0 * total.plots.weeded_share));
            let results = [damage, unseen, alarms.to_string()];
            let cells = if change.0.is_empty() {
                ["as in the field".to_owned(), String::new(), String::new()]
            } else {
                change.cells(&conditions)
            };
            table.add_row(cells.into_iter().chain(weeded).chain(results));
        }
        anyhow::Ok(())
    })?;
    writeln!(Results, "{table}\nField {field}, seed {seed}: {}, plants {spacing} cm apart.", rows(&changed))
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn every_default_change_differs_from_the_default_field() {
        let field = Conditions::load(conditions::DEFAULT).expect("it is a preset");
        for text in CHANGES {
            let change: Change = text.parse().expect("it is a change");
            let mut changed = field.clone();
            for (name, value) in &change.0 {
                changed.set(name, *value).expect("it is in its range");
            }
            assert_ne!(changed, field, "{text}");
        }
    }

    #[test]
    fn a_setting_that_follows_from_the_machine_has_its_value_in_the_field() {
        let mut field = Conditions::default();
        for (name, value) in [("machine.beam_to_tool_mm", 600.0), ("machine.second_beam_mm", 200.0), ("k", 5.0)] {
            field.set(name, value).expect("it is in its range");
        }
        let text = "beam_to_tool_mm=500,second_beam_mm=0,top_speed_mm_s=900,k=3,merge_gap_mm=1,machine.arm=trailing";
        let change: Change = text.parse().expect("it is a change");
        let [_, here, of_field] = change.cells(&field);
        assert_eq!(here, "500\n0\n900\n3\n1\ntrailing");
        assert_eq!(of_field, "600\n200\n\u{2013}\n5\n21\npendulum");
    }

    #[test]
    fn a_changed_field_has_its_own_warning_and_number_of_rows() {
        let field = Conditions::default();
        let with = |name, value| {
            let mut conditions = field.clone();
            conditions.set(name, value).expect("it is in its range");
            Experiment::as_in_the_paper(conditions, 1)
        };
        let [unchanged, wide] = [("crop.canopy_mm", 150.0), ("crop.canopy_mm", 160.0)].map(|(name, mm)| with(name, mm));
        assert_eq!(warnings(&field, &[unchanged.clone(), wide.clone()]), [""; 0]);
        let other = with("beam_to_tool_mm", 500.0);
        let told = warnings(&field, &[unchanged.clone(), other.clone(), other.clone()]);
        let said = "settings.beam_to_tool_mm is 500, but the simulated machine has 400.";
        assert!(told.len() == 1 && told[0].starts_with(said), "{told:?}");
        assert_eq!(warnings(&other.conditions, std::slice::from_ref(&other)), [""; 0]);
        let (count, row_m) = (unchanged.rows(), field.plot.row_m);
        assert_eq!(rows(&[unchanged.clone(), wide]), format!("{count} rows of {row_m} m a line"));
        for size in [with("plot.rows", 2.0), with("plot.row_m", 7.0)] {
            assert_eq!(rows(&[unchanged.clone(), size]), format!("{count} rows of {row_m} m in the first line"));
        }
    }

    #[test]
    fn text_that_is_no_change_is_refused() {
        for text in ["", "crop.canopy_mm", "crop.canopy_mm=wide", "a=1,", "machine.arm=hanging", "a=1,b=1,a=2"] {
            assert!(text.parse::<Change>().is_err(), "{text}");
        }
        assert_eq!("machine.arm=trailing".parse(), Ok(Change(vec![("machine.arm".to_owned(), 1.0)])));
    }
}
