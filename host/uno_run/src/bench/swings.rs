//! The timing error of swing commands at the servo's pin, over many random rows.
//!
//! Each row is a separate pass, from power-up. The real ELF weeds it. [`field::verdict`] compares each rising edge of
//! a new width with the position where the swing was due. Rows run in parallel.

use crate::run::run;
use anyhow::Result;
use field::machine::Machine;
use field::motion::mm_s;
use field::pass::Pass;
use field::planting::{Planting, WEED_MARGIN_MM};
use field::verdict::{Judgement, Verdict, ZoneSettings};
use rand::{RngExt, SeedableRng};
use rand_chacha::ChaCha8Rng;
use rayon::prelude::*;
use std::ops::Range;
use std::path::Path;
use std::sync::atomic::{AtomicUsize, Ordering};

/// Rows, and how they are passed.
#[derive(Clone, Debug, PartialEq)]
pub struct Rows {
    /// Their seeds; each is a row of its own.
    pub seeds: Range<u64>,
    /// The machine.
    pub machine: Machine,
    /// Its speed.
    pub speed_km_h: f64,
    /// Mean spacings of the rows, evenly spread.
    pub spacing_mm: Range<f64>,
    /// Most tall weeds in a row. A swing for a misclassified weed and the plant behind it is early for the plant.
    pub weeds: usize,
}

impl Rows {
    /// Rows as the machine is made for: walking at the paper's fastest, plants 400 to 650 mm apart.
    pub fn at_walking_speed(seeds: Range<u64>) -> Self {
        Self { seeds, machine: Machine::default(), speed_km_h: 2.5, spacing_mm: 400.0..650.0, weeds: 2 }
    }
}

/// The swings of all rows.
#[derive(Clone, Debug, PartialEq)]
pub struct Lateness {
    /// Each swing's error against its ideal position in ticks, positive if late, in the order of rows.
    pub errors_ticks: Vec<f64>,
    /// Encoder counts in a second at the rows' speed.
    pub ticks_per_s: f64,
    /// Plants passed.
    pub plants: usize,
    /// Plants to which the tool did not keep the margin.
    pub not_kept: usize,
    /// Plants whose keep-out zone was reached.
    pub reached: usize,
    /// Rows at whose end the firmware's position was wrong.
    pub wrong_positions: usize,
}

impl Lateness {
    /// The least and the greatest error. The least is negative if a swing was early.
    pub fn span_ticks(&self) -> (f64, f64) {
        let span = (f64::INFINITY, f64::NEG_INFINITY);
        self.errors_ticks.iter().fold(span, |span, &error| (span.0.min(error), span.1.max(error)))
    }

    /// The greatest distance, early or late.
    pub fn worst_ticks(&self) -> f64 {
        let (earliest, latest) = self.span_ticks();
        latest.max(-earliest)
    }

    /// The mean distance, early or late.
    pub fn mean_ticks(&self) -> f64 {
        self.errors_ticks.iter().map(|error| error.abs()).sum::<f64>() / self.errors_ticks.len() as f64
    }
}

/// A short row for each seed: three or four plants, with tall weeds between them if there is room.
fn planting(seed: u64, rows: &Rows) -> Planting {
    let mut rng = ChaCha8Rng::seed_from_u64(seed);
    let spacing_mm = rng.random_range(rows.spacing_mm.clone());
    let mut planting = Planting {
        plants: rng.random_range(3..=4),
        spacing_mm,
        spacing_scatter_mm: rng.random_range(0.0..spacing_mm / 8.0),
        canopy_mm: rng.random_range(80.0..180.0),
        canopy_scatter_mm: rng.random_range(0.0..30.0),
        weeds: rng.random_range(0..=rows.weeds),
        ragged: rng.random(),
    };
    let Planting { spacing_scatter_mm, canopy_mm, canopy_scatter_mm, .. } = planting;
    let tightest_mm = spacing_mm - spacing_scatter_mm - canopy_mm - canopy_scatter_mm;
    if tightest_mm < ROOM_FOR_WEED_MM {
        planting.weeds = 0;
    }
    planting
}

/// Bare ground that a tall weed of any width and its margins need.
const ROOM_FOR_WEED_MM: f64 = 2.0 * WEED_MARGIN_MM + 30.0;

/// Weeds the rows with the firmware at `elf`. `progress` gets the share of the rows done, from 0 to 1.
///
/// # Errors
/// If the ELF cannot be run.
pub fn lateness(elf: &Path, rows: &Rows, progress: impl Fn(f64) + Sync) -> Result<Lateness> {
    let count = rows.seeds.end.saturating_sub(rows.seeds.start) as f64;
    let done = AtomicUsize::new(0);
    let outcomes: Vec<_> = rows
        .seeds
        .clone()
        .into_par_iter()
        .map(|seed| {
            let row = planting(seed, rows).grow(seed)?;
            let pass = Pass::at_speed(row, rows.machine, ZoneSettings::default(), mm_s(rows.speed_km_h));
            let outcome = run(&pass, elf, |_| ())?;
            progress((done.fetch_add(1, Ordering::Relaxed) + 1) as f64 / count);
            Ok(outcome)
        })
        .collect::<Result<_>>()?;

    let judgements = || outcomes.iter().map(|outcome| &outcome.judgement);
    let plants: usize = judgements().map(|judgement| judgement.plants.len()).sum();
    Ok(Lateness {
        errors_ticks: judgements().flat_map(|judgement| judgement.swing_errors_ticks()).collect(),
        ticks_per_s: mm_s(rows.speed_km_h) / rows.machine.tick_mm(),
        plants,
        not_kept: plants - judgements().map(|judgement| judgement.count(Verdict::Kept)).sum::<usize>(),
        reached: judgements().map(Judgement::reached).sum(),
        wrong_positions: outcomes
            .iter()
            .filter(|outcome| outcome.status.position_ticks != outcome.true_ticks || outcome.status.lost_ticks != 0)
            .count(),
    })
}
