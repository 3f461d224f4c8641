//! Sweeps: a result of the experiment as a function of one or two of its parameters.
//!
//! An axis is a speed, a plant spacing, a parameter of the conditions or a setting of the firmware, with its values
//! ([`Axis`]). At each point the firmware's native run weeds a plot. The ground is always the same for the same
//! conditions.

use crate::experiment::{ControllerKind, Engine, Experiment, PlotOutcome};
use crate::shard::{Numbered, Shard};
use crate::statistics::Share;
use anyhow::{Context, Error, Result, ensure};
use field::conditions::Conditions;
use rayon::prelude::*;
use serde::{Deserialize, Serialize};
use std::str::FromStr;
use std::sync::atomic::{AtomicUsize, Ordering};

/// Valid forward speeds, least and greatest, in km/h.
pub const SPEEDS_KM_H: (f64, f64) = (0.1, 8.0);

/// Valid plant spacings, least and greatest, in cm.
pub const SPACINGS_CM: (f64, f64) = (5.0, 500.0);

const MOST_VALUES: usize = 1000;

/// Smaller steps would give equal values, because values have three decimals.
const LEAST_STEP: f64 = 1e-3;

/// A parameter and its values.
#[derive(Clone, Debug, PartialEq, Serialize, Deserialize)]
pub struct Axis {
    /// `speed` in km/h, `spacing` in cm, or a name that [`Conditions::set`] takes.
    pub parameter: String,
    /// The values, in order.
    pub values: Vec<f64>,
}

impl FromStr for Axis {
    type Err = Error;

    fn from_str(text: &str) -> Result<Self> {
        let parts = || {
            let (parameter, range) = text.split_once('=')?;
            let (from, rest) = range.split_once("..")?;
            let (to, step) = rest.split_once(':')?;
            let number = |text: &str| text.trim().parse::<f64>().ok().filter(|number| number.is_finite());
            Some((parameter.trim().to_owned(), number(from)?, number(to)?, number(step)?))
        };
        let (parameter, from, to, step) =
            parts().with_context(|| format!("`{text}` has to be NAME=FROM..TO:STEP, as lead_out_ms=0..300:20"))?;
        // A step more or less by rounding does not lose the last value.
        let steps = (to - from) / step + 1e-9;
        ensure!(
            step >= LEAST_STEP && (0.0..MOST_VALUES as f64).contains(&steps),
            "`{text}` has to go up, in steps of {LEAST_STEP} or more, with at most {MOST_VALUES} values"
        );
        // Three decimals are kept, so that 0.1 + 0.2 is 0.3.
        let values = (0..=steps as u32).map(|index| ((from + f64::from(index) * step) * 1e3).round() / 1e3).collect();
        Ok(Self { parameter, values })
    }
}

/// The names of a point's results: plants damaged (Eq. 23), weeds gone from the whole plot (Eq. 22), ground of the row
/// that was weeded, the largest share that the servo allows with every canopy and margin kept, field efficiency
/// (Eq. 24), performance index in ha %2/(h hp) (Eq. 27), rows in which an alarm took the tool out, and plants' zones that
/// the tool reached. All but the index are in percent.
pub const RESULTS: [&str; 8] = [
    "plant_damage",
    "weeding_efficiency",
    "in_row_weeding",
    "in_row_bound",
    "field_efficiency",
    "performance_index",
    "alarms",
    "zones_reached",
];

fn results(outcome: &PlotOutcome, rows: u32) -> [f64; RESULTS.len()] {
    // From all weeds: the scatter of a square metre would hide the effect.
    let performance = outcome.record.performance_with(outcome.effect.in_plot.efficiency_percent());
    // A plot without a plant or a weed has no such figure.
    let known = |measure: Option<f64>| measure.unwrap_or(f64::NAN);
    [
        known(performance.plant_damage_percent),
        known(performance.weeding_efficiency_percent),
        100.0 * outcome.weeded_share,
        100.0 * outcome.weedable_share,
        known(performance.field_efficiency_percent),
        known(performance.performance_index),
        100.0 * f64::from(outcome.alarms) / f64::from(rows),
        known(Share::of(outcome.zones.reached, outcome.zones.all).percent()),
    ]
}

/// A sweep.
#[derive(Clone, Debug, PartialEq, Serialize, Deserialize)]
pub struct Sweep {
    /// The first axis.
    pub x: Axis,
    /// The second axis, if there is one.
    pub y: Option<Axis>,
    /// The controller.
    pub controller: ControllerKind,
    /// The fixed conditions.
    pub conditions: Conditions,
    /// Their name.
    pub field: String,
    /// Speed if no axis has it, km/h.
    pub speed_km_h: f64,
    /// Plant spacing if no axis has it, cm.
    pub spacing_cm: f64,
    /// Selects the random fields.
    pub seed: u64,
}

/// A point of a sweep.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct Point {
    /// Its value on the first axis.
    pub x: f64,
    /// Its value on the second axis.
    pub y: Option<f64>,
    /// The results, in the order of [`RESULTS`].
    pub results: [f64; RESULTS.len()],
    /// Whether an alarm took the tool out in one of its rows: the other results are then invalid.
    pub has_alarm: bool,
}

/// A point's values, and its conditions.
type Place = (f64, Option<f64>, Experiment);

impl Sweep {
    /// Weeds a plot at each point. The first axis varies fastest. `progress` gets the completed share, from 0 to 1.
    ///
    /// # Errors
    /// If an axis has an invalid value, before anything is weeded; else the first error of a plot.
    pub fn run(&self, progress: impl Fn(f64) + Sync) -> Result<Vec<Point>> {
        let outcomes = self.run_shard(Shard::WHOLE, progress)?;
        self.points(&outcomes.into_iter().map(|point| point.outcome).collect::<Vec<_>>())
    }

    /// Number of points.
    pub fn size(&self) -> u64 {
        (self.x.values.len() * self.y.as_ref().map_or(1, |y| y.values.len())) as u64
    }

    /// What is likely wrong with the conditions of the first point that has such a problem, in sentences.
    ///
    /// # Errors
    /// If an axis has an invalid value.
    pub fn warning(&self) -> Result<Option<String>> {
        Ok(self.places()?.iter().find_map(|(_, _, experiment)| experiment.conditions.warning()))
    }

    /// Weeds a plot at each of a shard's points.
    ///
    /// # Errors
    /// As [`Sweep::run`].
    pub fn run_shard(&self, shard: Shard, progress: impl Fn(f64) + Sync) -> Result<Vec<Numbered<PlotOutcome>>> {
        let places = self.places()?;
        let mine: Vec<u64> = shard.numbers(self.size()).collect();
        let done = AtomicUsize::new(0);
        let weed = |&number: &u64| {
            let (x, y, experiment) = &places[number as usize];
            let outcomes = experiment.run(&Engine::Native, |_| ());
            let outcomes = outcomes.with_context(|| format!("at {}", self.describe(*x, *y)))?;
            progress((done.fetch_add(1, Ordering::Relaxed) + 1) as f64 / mine.len() as f64);
            // One speed, one spacing, one replication and one controller: one plot.
            Ok(outcomes.into_iter().map(move |outcome| Numbered { number, outcome }).collect::<Vec<_>>())
        };
        mine.par_iter().map(weed).collect::<Result<Vec<_>>>().map(|outcomes| outcomes.concat())
    }

    /// The points, from the outcomes of all their plots.
    ///
    /// # Errors
    /// If an axis has an invalid value.
    pub fn points(&self, outcomes: &[PlotOutcome]) -> Result<Vec<Point>> {
        let point = |((x, y, experiment), outcome): (Place, &PlotOutcome)| {
            let results = results(outcome, experiment.conditions.plot.rows);
            Point { x, y, results, has_alarm: outcome.alarms > 0 }
        };
        Ok(self.places()?.into_iter().zip(outcomes).map(point).collect())
    }

    /// All points. The first axis varies fastest.
    fn places(&self) -> Result<Vec<Place>> {
        let x = &self.x.parameter;
        ensure!(
            self.y.as_ref().is_none_or(|y| y.parameter != *x),
            "both axes are `{x}`: the second one needs a parameter of its own"
        );
        let ys: Vec<Option<f64>> =
            self.y.as_ref().map_or(vec![None], |y| y.values.iter().map(|&value| Some(value)).collect());
        let places = ys.iter().flat_map(|&y| self.x.values.iter().map(move |&x| (x, y)));
        places.map(|(x, y)| Ok((x, y, self.at(x, y)?))).collect()
    }

    fn describe(&self, x: f64, y: Option<f64>) -> String {
        let second = self.y.as_ref().zip(y).map(|(axis, y)| format!(", {} = {y}", axis.parameter));
        format!("{} = {x}{}", self.x.parameter, second.unwrap_or_default())
    }

    fn at(&self, x: f64, y: Option<f64>) -> Result<Experiment> {
        let mut experiment = Experiment {
            speeds_km_h: vec![self.speed_km_h],
            spacings_cm: vec![self.spacing_cm],
            replications: 1,
            controllers: vec![self.controller],
            ..Experiment::as_in_the_paper(self.conditions.clone(), self.seed)
        };
        for (axis, value) in [(Some(&self.x), Some(x)), (self.y.as_ref(), y)] {
            let (Some(axis), Some(value)) = (axis, value) else { continue };
            match axis.parameter.as_str() {
                "speed" => experiment.speeds_km_h = vec![value],
                "spacing" => experiment.spacings_cm = vec![value],
                name => experiment.conditions.set(name, value)?,
            }
        }
        let treatment = [
            ("speed", experiment.speeds_km_h[0], SPEEDS_KM_H, "km/h"),
            ("spacing", experiment.spacings_cm[0], SPACINGS_CM, "cm"),
        ];
        for (name, value, (least, greatest), unit) in treatment {
            let can_be = (least..=greatest).contains(&value);
            ensure!(can_be, "{name} is {value}, but has to be {least} to {greatest} {unit}");
        }
        Ok(experiment)
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    fn sweep(x: &str, y: Option<&str>) -> Sweep {
        let mut conditions = Conditions::default();
        conditions.set("plot.rows", 1.0).unwrap();
        Sweep {
            x: x.parse().unwrap(),
            y: y.map(|y| y.parse().unwrap()),
            controller: ControllerKind::Firmware,
            conditions,
            field: "transplanted".to_owned(),
            speed_km_h: 2.5,
            spacing_cm: 50.0,
            seed: 1,
        }
    }

    #[test]
    fn the_index_follows_from_the_other_results_of_its_point() {
        for point in sweep("lead_out_ms=0..300:150", Some("plot.counted_m2=0..2:1")).run(|_| ()).unwrap() {
            let [damage, weeding, .., field_efficiency, index, _, _] = point.results;
            // Eq. 24, 25 and 27, for 2.5 km/h on 0.4 m with 2.5 hp.
            let capacity = field_efficiency / 100.0 * 2.5 * 0.4 / 10.0;
            let expected = capacity * (100.0 - damage) * weeding / 2.5;
            assert!((index - expected).abs() < 1e-6 * expected, "{index}, not {expected}");
        }
    }

    #[test]
    fn an_axis_has_both_its_ends() {
        let axis: Axis = "lead_out_ms=0..300:20".parse().unwrap();
        assert_eq!((axis.parameter.as_str(), axis.values.len()), ("lead_out_ms", 16));
        let axis: Axis = "speed=1..4:0.1".parse().unwrap();
        assert_eq!((axis.values.len(), axis.values[3], axis.values[30]), (31, 1.3, 4.0));
        assert_eq!("k=3..3:1".parse::<Axis>().unwrap().values, [3.0]);
    }

    #[test]
    fn an_invalid_axis_is_refused_with_what_would_be_right() {
        let error = |text: &str| text.parse::<Axis>().unwrap_err().to_string();
        for text in ["lead_out_ms", "lead_out_ms=0..300", "=", "speed=a..b:c", "speed=0..inf:1"] {
            assert!(error(text).contains("has to be NAME=FROM..TO:STEP"), "{text}");
        }
        for text in ["speed=4..1:1", "speed=1..4:0", "speed=1..4:-1", "speed=0..1000000:1", "speed=1..1.002:0.0005"] {
            assert!(error(text).contains("has to go up"), "{text}");
        }
    }

    #[test]
    fn a_lead_that_is_too_short_damages_plants_and_a_longer_one_does_not() {
        let points = sweep("lead_out_ms=0..180:90", Some("speed=1..4:3")).run(|_| ()).unwrap();
        assert_eq!(points.len(), 6);
        let damage = |x: f64, y: f64| {
            let point = points.iter().find(|point| point.x == x && point.y == Some(y)).unwrap();
            point.results[0]
        };
        assert!(damage(0.0, 4.0) > 20.0, "{points:?}");
        assert_eq!((damage(0.0, 1.0), damage(180.0, 4.0)), (0.0, 0.0), "{points:?}");
    }

    #[test]
    fn a_value_that_cannot_be_is_refused_before_anything_is_weeded() {
        let run = |x: &str| sweep(x, None).run(|_| panic!("nothing is weeded")).unwrap_err().to_string();
        assert!(run("lead_out_ms=400..600:200").contains("settings.lead_out_ms is 600, but has to be 0 to 500"));
        assert!(run("ground.slip_percent=20..40:10").contains("ground.slip_percent is 40, but has to be -30 to 30"));
        assert!(run("speed=1..40:13").contains("speed is 14, but has to be 0.1 to 8 km/h"));
        assert!(run("plot.rows=1..2:0.5").contains("plot.rows is 1.5, but has to be a whole number"));
        assert!(run("slip=1..2:1").contains("slip is neither a parameter of the field nor a setting"));
    }
}
