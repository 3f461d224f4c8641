//! The paper's experiment: speeds by plant spacings by replications, in a simulated field, with several controllers on
//! the same ground.
//!
//! The rows of a plot and the motion depend on the seed, the plot and the row only. So the result depends neither on
//! the number of threads or machines, nor on the choice of controllers. The firmware runs as a native run
//! ([`field::native`]), or as the ELF on the virtual Uno ([`uno_run`]). Its baselines ([`field::baselines`]) are
//! models in both cases. A simulated plot has the same record as one counted by hand ([`PlotRecord`]), and the same
//! code evaluates both.

pub mod table;
pub mod total;

use crate::evaluation::PlotRecord;
use crate::shard::{Numbered, Shard};
use anyhow::{Result, anyhow};
use control::ground::features;
use field::baselines;
use field::budget::Budget;
use field::conditions::Conditions;
use field::driving::{DrivenRow, drive};
use field::native::{self, Sensors};
use field::optimum::undamaged_share;
use field::pass::{Pass, Weeded};
use field::row::{MAX_WIDTH_MM, Problem, Row};
use field::stand::Stand;
use field::tool_path::{Effect, effect};
use field::verdict::{Judgement, Verdict, ZoneSettings, judge};
use knn::Example;
use rand::{RngExt, SeedableRng};
use rand_chacha::ChaCha8Rng;
use rayon::prelude::*;
use serde::{Deserialize, Serialize};
use serde_json::Value;
use std::cell::LazyCell;
use std::path::PathBuf;
use std::sync::atomic::{AtomicUsize, Ordering};

pub use table::write_csv;
pub use total::{Total, totals};

/// How the firmware is run.
#[derive(Clone, Debug, PartialEq, Eq)]
pub enum Engine {
    /// Its code, compiled for the host.
    Native,
    /// This ELF, on the virtual Uno.
    Uno(PathBuf),
}

/// A controller of the tool. The experiment compares controllers on the same plots.
#[derive(Clone, Copy, Debug, PartialEq, Eq, Hash, Serialize, Deserialize)]
#[serde(rename_all = "kebab-case")]
pub enum ControllerKind {
    /// The firmware with its leads.
    Firmware,
    /// The firmware with both leads at 0: a queue of keep-out zones, without look-ahead.
    WithoutLookAhead,
    /// The paper's controller: one slot, no look-ahead, a polling loop.
    Paper,
    /// The ideal controller: it knows every stem and allows for the slowest swing. No other one avoids its damage.
    Ideal,
}

impl ControllerKind {
    /// All, the firmware first.
    pub const ALL: [Self; 4] = [Self::Firmware, Self::WithoutLookAhead, Self::Paper, Self::Ideal];

    /// Its name.
    pub fn title(self) -> &'static str {
        match self {
            Self::Firmware => "this firmware",
            Self::WithoutLookAhead => "a queue without look-ahead",
            Self::Paper => "the paper's controller",
            Self::Ideal => "the ideal controller",
        }
    }
}

/// An experiment: the full factorial of speeds and spacings.
#[derive(Clone, Debug, PartialEq, Serialize, Deserialize)]
pub struct Experiment {
    /// Forward speeds, km/h.
    pub speeds_km_h: Vec<f64>,
    /// Plant spacings, cm.
    pub spacings_cm: Vec<f64>,
    /// How often each speed and spacing is tried.
    pub replications: u32,
    /// The controllers.
    pub controllers: Vec<ControllerKind>,
    /// The field and the machine.
    pub conditions: Conditions,
    /// The features and the label of each example that is taught to the firmware.
    pub examples: Vec<([u8; features::COUNT], u8)>,
    /// Selects the random fields.
    pub seed: u64,
    /// So many seeds, from that one on, each with all replications.
    pub seeds: u32,
}

/// One plot, weeded by one controller.
#[derive(Clone, Copy, Debug, PartialEq, Serialize, Deserialize)]
pub struct PlotOutcome {
    /// The controller.
    pub controller: ControllerKind,
    /// The plot's record.
    pub record: PlotRecord,
    /// Plants and weeds, counted.
    pub effect: Effect,
    /// Plants' zones, counted.
    pub zones: Zones,
    /// Share of the rows' ground that the tool weeded, from 0 to 1.
    pub weeded_share: f64,
    /// The largest share that this servo could weed with every margin kept ([`field::verdict::weedable_share`]).
    pub weedable_share: f64,
    /// Share that could be weeded at best without a plant damaged ([`field::optimum::undamaged_share`]).
    pub undamaged_share: f64,
    /// The loss budget ([`field::budget`]).
    pub budget: Budget,
    /// Rows in which an alarm took the tool out.
    pub alarms: u32,
    /// Time that was simulated, run-ups included and turns not, s.
    pub moved_s: f64,
}

/// The tool's distance from each plant's zone in the firmware: its canopy, or with `stem_zone_mm` the zone round its
/// stem ([`field::verdict`]). Counted as if the machine kept its line, without play.
#[derive(Clone, Copy, Debug, Default, PartialEq, Eq, Serialize, Deserialize)]
pub struct Zones {
    /// All zones. Joined plants have one.
    pub all: u32,
    /// Zones over which the tool was not fully out.
    pub reached: u32,
    /// Other zones whose margin was cut.
    pub margins_cut: u32,
}

/// A plot's number, and its record before weeding.
type Plot<'a> = (u64, &'a PlotRecord);

/// Rows of a plot that are in memory at once.
const BATCH: u32 = 256;

/// Ground of the row that is drawn.
const DRAWN_MM: f64 = 4500.0;

impl Experiment {
    /// The paper's experiment (its Table 2), by all controllers.
    pub fn as_in_the_paper(conditions: Conditions, seed: u64) -> Self {
        Self {
            speeds_km_h: vec![1.0, 1.5, 2.0, 2.5],
            spacings_cm: vec![50.0, 60.0],
            replications: 3,
            controllers: ControllerKind::ALL.to_vec(),
            conditions,
            examples: Vec::new(),
            seed,
            seeds: 1,
        }
    }

    /// All plots before weeding, by speed, spacing and replication.
    fn plots(&self) -> Vec<PlotRecord> {
        let Conditions { plot: area, machine, .. } = &self.conditions;
        let width_m = area.row_spacing_mm / 1000.0;
        let area_m2 = f64::from(area.rows) * area.row_m * width_m;
        let (area_m2, width_m, power_hp) = (Some(area_m2), Some(width_m), Some(machine.power_hp));
        let before = PlotRecord { area_m2, width_m, power_hp, ..PlotRecord::default() };
        let mut plots = Vec::new();
        for &speed_km_h in &self.speeds_km_h {
            for &spacing_cm in &self.spacings_cm {
                let plot = |replication| PlotRecord { replication, speed_km_h, spacing_cm, ..before };
                plots.extend((1..=self.replications * self.seeds).map(plot));
            }
        }
        plots
    }

    /// Number of plots. All controllers weed each of them.
    pub fn size(&self) -> u64 {
        self.plots().len() as u64
    }

    /// Number of rows that each controller weeds.
    pub fn rows(&self) -> usize {
        self.plots().len() * self.conditions.plot.rows as usize
    }

    /// Approximate number of plants: the number of planting positions.
    pub fn plants(&self) -> f64 {
        let row_cm = 100.0 * self.conditions.plot.row_m;
        let of_rows: f64 = self.plots().iter().map(|plot| row_cm / plot.spacing_cm).sum();
        of_rows * f64::from(self.conditions.plot.rows)
    }

    /// Weeds the field. Returns an outcome for each plot and each controller, by speed, spacing and replication.
    /// `progress` gets the completed share of rows, from 0 to 1.
    ///
    /// # Errors
    /// The first that a row meets.
    pub fn run(&self, engine: &Engine, progress: impl Fn(f64) + Sync) -> Result<Vec<PlotOutcome>> {
        let of_plots = self.run_shard(Shard::WHOLE, engine, progress)?;
        Ok(of_plots.into_iter().flat_map(|plot| plot.outcome).collect())
    }

    /// Weeds a shard's plots: for each an outcome of each controller. All shards together equal [`Experiment::run`].
    ///
    /// # Errors
    /// As [`Experiment::run`].
    pub fn run_shard(
        &self,
        shard: Shard,
        engine: &Engine,
        progress: impl Fn(f64) + Sync,
    ) -> Result<Vec<Numbered<Vec<PlotOutcome>>>> {
        let plots = self.plots();
        let mine: Vec<u64> = shard.numbers(self.size()).collect();
        let (done, all) = (AtomicUsize::new(0), (mine.len() * self.conditions.plot.rows as usize) as f64);
        let row_done = || progress((done.fetch_add(1, Ordering::Relaxed) + 1) as f64 / all);
        let weed = |&number: &u64| {
            let outcome = self.weed_plot((number, &plots[number as usize]), engine, &row_done)?;
            Ok(Numbered { number, outcome })
        };
        mine.par_iter().map(weed).collect()
    }

    /// The first metres of one row, the first plot's at the highest speed, with the firmware's result, for a picture.
    ///
    /// # Errors
    /// As [`Experiment::run`].
    pub fn example(&self, engine: &Engine) -> Result<Option<(Row, Judgement)>> {
        let plots = (0..).zip(self.plots());
        let fastest = plots.reduce(|a, b| if b.1.speed_km_h > a.1.speed_km_h { b } else { a });
        let Some((number, plot)) = fastest else { return Ok(None) };
        let (stand, _, mut pass) = self.grow((number, &plot), 0)?;
        pass.row.stems = Some(stand.stems.clone());
        let weeded = weed(&pass, &sensors(&pass), &stand, ControllerKind::Firmware, engine)?;
        let Pass { row, machine, motion, timing, .. } = &pass;
        let judgement = judge(row, machine, motion, *timing, &weeded.pulses, weeded.start_cycle);
        Ok(row.beginning(DRAWN_MM).map(|beginning| (beginning, judgement)))
    }

    fn weed_plot(&self, plot: Plot, engine: &Engine, row_done: &(impl Fn() + Sync)) -> Result<Vec<PlotOutcome>> {
        let rows = self.conditions.plot.rows;
        let mut outcomes: Vec<PlotOutcome> = Vec::new();
        for first in (0..rows).step_by(BATCH as usize) {
            let batch = first..rows.min(first + BATCH);
            let weeded: Vec<Vec<PlotOutcome>> = batch
                .into_par_iter()
                .map(|row| self.weed_row(plot, row, engine).inspect(|_| row_done()))
                .collect::<Result<_>>()?;
            for row in weeded {
                if outcomes.is_empty() {
                    outcomes = row;
                } else {
                    outcomes.iter_mut().zip(&row).for_each(|(outcome, row)| outcome.add(row));
                }
            }
        }
        outcomes.iter_mut().for_each(PlotOutcome::record_counts);
        Ok(outcomes)
    }

    /// A row's part of its plot, by each controller, with the same inputs. Its record has no counts yet.
    fn weed_row(&self, plot: Plot, row: u32, engine: &Engine) -> Result<Vec<PlotOutcome>> {
        let (stand, drive, pass) = self.grow(plot, row)?;
        let sensors = sensors(&pass);
        let undamaged_share = undamaged_share(&stand, &pass.machine, &drive.motion, &drive.steering);
        let Conditions { plot: area, machine: mechanism, .. } = &self.conditions;
        let rows = f64::from(area.rows);
        let record = PlotRecord { time_s: Some(drive.row_s + drive.turn_s), ..*plot.1 };
        let outcome = |&controller: &ControllerKind| {
            let weeded = weed(&pass, &sensors, &stand, controller, engine)?;
            let Pass { row, machine, motion, timing, .. } = &pass;
            let (pulses, start_cycle) = (&weeded.pulses, weeded.start_cycle);
            let judgement = judge(row, machine, motion, *timing, pulses, start_cycle);
            let budget = Budget::of(&row.span_mm(), &judgement.weeded_mm, &weeded.reasons, machine, motion);
            Ok(PlotOutcome {
                controller,
                record,
                effect: effect(&stand, machine, mechanism, (motion, &drive.steering), pulses, start_cycle),
                zones: Zones {
                    all: judgement.plants.len() as u32,
                    reached: judgement.reached() as u32,
                    margins_cut: judgement.count(Verdict::MarginCut) as u32,
                },
                weeded_share: judgement.weeded_share / rows,
                weedable_share: judgement.weedable_share / rows,
                undamaged_share: undamaged_share / rows,
                budget: budget / rows,
                alarms: u32::from(weeded.alarm),
                moved_s: motion.duration_s(),
            })
        };
        self.controllers.iter().map(outcome).collect()
    }

    /// A row that has grown, how it is driven, and both as a pass for the firmware.
    fn grow(&self, (number, plot): Plot, row: u32) -> Result<(Stand, DrivenRow, Pass)> {
        // Stand, driving and machine each have their own random numbers.
        let chance = |of: u64| {
            let nth_seed = (plot.replication - 1) / self.replications;
            let mut rng = ChaCha8Rng::seed_from_u64(self.seed.wrapping_add(nth_seed.into()));
            rng.set_stream(number << 34 | u64::from(row) << 2 | of);
            rng
        };
        let spacing_cm = plot.spacing_cm;
        let stand =
            Stand::grow(&self.conditions, spacing_cm * 10.0, &mut chance(0)).map_err(|problem| match problem {
                Problem::Empty => anyhow!(
                    "the beam would see nothing in a row of {} m with plants {spacing_cm} cm apart: \
                     ask for a longer row, a smaller spacing, or a beam lower than {} mm",
                    self.conditions.plot.row_m,
                    self.conditions.sensors.beam_height_mm
                ),
                _ => anyhow!(
                    "plants {spacing_cm} cm apart grow together to more than {MAX_WIDTH_MM} mm: \
                     ask for a larger spacing or narrower canopies"
                ),
            })?;
        let drive = drive(&self.conditions, &stand.span_mm, plot.speed_km_h, &mut chance(1));
        let pass = self.conditions.pass(stand.row.clone(), drive.motion.clone(), chance(2).random());
        let examples = self.examples.iter().map(|&(features, label)| Example::new(features, label)).collect();
        Ok((stand, drive, Pass { examples, ..pass }))
    }
}

/// The sensors of a pass for native runs. They do not depend on the settings. They are calculated at first use.
fn sensors(pass: &Pass) -> LazyCell<Sensors, impl FnOnce() -> Sensors> {
    LazyCell::new(|| Sensors::new(pass, native::TURN_S))
}

fn weed(
    pass: &Pass,
    sensors: &LazyCell<Sensors, impl FnOnce() -> Sensors>,
    stand: &Stand,
    controller: ControllerKind,
    engine: &Engine,
) -> Result<Weeded> {
    let firmware = |pass: &Pass| {
        // The ELF does not report why it swings. Its native run makes the same decisions, within a servo's frame.
        let weeded = native::weed(pass, sensors)?;
        match engine {
            Engine::Native => Ok(weeded),
            Engine::Uno(elf) => {
                let outcome = uno_run::run(pass, elf, |_| ())?;
                let alarm = outcome.status.state != "work";
                Ok(Weeded { pulses: outcome.pulses, start_cycle: outcome.start_cycle, alarm, ..weeded })
            }
        }
    };
    match controller {
        ControllerKind::Firmware => firmware(pass),
        ControllerKind::WithoutLookAhead => {
            let timing = ZoneSettings { lead_out_ms: 0, lead_in_ms: 0, ..pass.timing };
            firmware(&Pass { timing, ..pass.clone() })
        }
        ControllerKind::Paper => Ok(baselines::as_in_the_paper(pass)),
        ControllerKind::Ideal => Ok(baselines::ideal(pass, &stand.stems)),
    }
}

impl PlotOutcome {
    /// Adds another row of the plot, or another plot. The caller weights the shares.
    fn add(&mut self, other: &Self) {
        self.effect += other.effect;
        self.zones.all += other.zones.all;
        self.zones.reached += other.zones.reached;
        self.zones.margins_cut += other.zones.margins_cut;
        self.weeded_share += other.weeded_share;
        self.weedable_share += other.weedable_share;
        self.undamaged_share += other.undamaged_share;
        self.budget += other.budget;
        self.alarms += other.alarms;
        self.moved_s += other.moved_s;
        self.record.time_s = self.record.time_s.zip(other.record.time_s).map(|(time_s, other_s)| time_s + other_s);
    }

    /// What only a simulated field can tell of a plot, by its column's name. Shares are in percent.
    pub fn figures(&self) -> [(&'static str, Value); 15] {
        let Self { zones, effect, .. } = self;
        [
            ("zones", zones.all.into()),
            ("zones_reached", zones.reached.into()),
            ("margins_cut", zones.margins_cut.into()),
            ("in_row_weeds_before", effect.in_row.before.into()),
            ("in_row_weeds_after", effect.in_row.after.into()),
            ("plot_weeds_before", effect.in_plot.before.into()),
            ("plot_weeds_after", effect.in_plot.after.into()),
            ("in_row_weeded_percent", (100.0 * self.weeded_share).into()),
            ("in_row_bound_percent", (100.0 * self.weedable_share).into()),
            ("undamaged_bound_percent", (100.0 * self.undamaged_share).into()),
            ("damaged_by_tool", effect.damaged.into()),
            ("unseen", effect.all_unseen.into()),
            ("damaged_unseen", effect.unseen.into()),
            ("damaged_by_sweeps", effect.swept.into()),
            ("damaged_in_next_row", effect.neighbours.into()),
        ]
    }

    /// Puts the counts of all rows into the record. Weeds are those on the counted ground.
    fn record_counts(&mut self) {
        let Effect { plants, counted, .. } = self.effect;
        // A plot's record has `u32` counts.
        let in_a_plot = |weeds: u64| u32::try_from(weeds).unwrap_or(u32::MAX);
        self.record = PlotRecord {
            weeds_before: Some(in_a_plot(counted.before)),
            weeds_after: Some(in_a_plot(counted.after)),
            plants: Some(plants),
            damaged: Some(self.effect.injured()),
            ..self.record
        };
    }
}

/// The records of one controller.
pub fn records(outcomes: &[PlotOutcome], controller: ControllerKind) -> Vec<PlotRecord> {
    outcomes.iter().filter(|outcome| outcome.controller == controller).map(|outcome| outcome.record).collect()
}

#[cfg(test)]
mod tests;
