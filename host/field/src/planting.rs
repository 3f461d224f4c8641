//! Random rows: crop plants at a spacing with scatter, tall weeds between them, and canopies with gaps.
//!
//! A [`Planting`] has the numbers and sizes, and a seed selects the row: the same seed gives the same row on every
//! machine. Scatter is evenly distributed, so that it has limits that a test can check.

use crate::chance::scatter;
use crate::counted;
use crate::row::{Canopy, Kind, Problem, Row};
use rand::seq::SliceRandom;
use rand::{Rng, RngExt, SeedableRng};
use rand_chacha::ChaCha8Rng;
use std::ops::Range;
use thiserror::Error;

/// Why a planting cannot grow, and what would help.
#[derive(Debug, Error, PartialEq)]
#[expect(missing_docs, reason = "the messages say what each means")]
pub enum PlantingError {
    #[error(
        "there is no room for {} between the plants, {WEED_MARGIN_MM} mm from the next canopy: \
         ask for fewer weeds, or for a larger spacing",
        counted(.0, "tall weed")
    )]
    NoRoomForWeeds(usize),
    #[error(
        "a spacing of {} mm leaves no room for canopies of {} mm: \
         spacing less its scatter has to exceed the canopy with its scatter",
        .0.spacing_mm, .0.canopy_mm
    )]
    NoRoomForPlants(Planting),
    #[error(transparent)]
    Row(#[from] Problem),
}

/// Distance of a generated weed from everything else. It makes the weed a detection of its own.
pub const WEED_MARGIN_MM: f64 = 60.0;

/// Widths of generated tall weeds at the beam's height.
pub(crate) const WEED_WIDTHS_MM: Range<f64> = 12.0..20.0;

/// Gaps between the leaves of a ragged canopy, and the leaves between them.
const LEAF_GAPS_MM: Range<f64> = 2.0..8.0;
const LEAF_WIDTHS_MM: Range<f64> = 12.0..40.0;

/// The parameters of a random row. The same planting and seed give the same row on every machine.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct Planting {
    /// Number of crop plants.
    pub plants: usize,
    /// Mean distance from plant to plant, centre to centre.
    pub spacing_mm: f64,
    /// The spacing lies within this of its mean, evenly spread.
    pub spacing_scatter_mm: f64,
    /// Mean canopy width.
    pub canopy_mm: f64,
    /// The canopy width lies within this of its mean, evenly spread.
    pub canopy_scatter_mm: f64,
    /// Number of tall weeds between the plants.
    pub weeds: usize,
    /// Whether the canopies have gaps through which the beam passes.
    pub ragged: bool,
}

impl Default for Planting {
    /// Twenty plants half a metre apart, as in the manual's example, without weeds.
    fn default() -> Self {
        Self {
            plants: 20,
            spacing_mm: 500.0,
            spacing_scatter_mm: 40.0,
            canopy_mm: 150.0,
            canopy_scatter_mm: 25.0,
            weeds: 0,
            ragged: false,
        }
    }
}

impl Planting {
    /// The row that grows from a seed. The first plant's centre is half a spacing from the origin.
    ///
    /// # Errors
    /// If plants or weeds do not fit.
    pub fn grow(&self, seed: u64) -> Result<Row, PlantingError> {
        let tightest_mm = self.spacing_mm - self.spacing_scatter_mm;
        let widest_mm = self.canopy_mm + self.canopy_scatter_mm;
        if tightest_mm <= widest_mm {
            return Err(PlantingError::NoRoomForPlants(*self));
        }
        let mut rng = ChaCha8Rng::seed_from_u64(seed);
        let mut canopies = Vec::with_capacity(self.plants + self.weeds);
        let mut position_mm = self.spacing_mm / 2.0;
        for _ in 0..self.plants {
            let width_mm = self.canopy_mm + scatter(&mut rng, self.canopy_scatter_mm);
            let mut plant = Canopy::plant(position_mm, width_mm);
            if self.ragged {
                plant.leaves = leaves(&mut rng, plant.span_mm());
            }
            canopies.push(plant);
            position_mm += self.spacing_mm + scatter(&mut rng, self.spacing_scatter_mm);
        }
        let weeds = self.weeds_between(&canopies, &mut rng)?;
        canopies.extend(weeds);
        Ok(Row::new(canopies)?)
    }

    /// As [`Planting::grow`], but leaves out weeds that do not fit.
    ///
    /// # Errors
    /// If the plants do not fit.
    pub fn grow_with_room(&self, seed: u64) -> Result<Row, PlantingError> {
        let fewest = Self { weeds: 0, ..*self }.grow(seed);
        (1..=self.weeds).rev().find_map(|weeds| Self { weeds, ..*self }.grow(seed).ok()).map_or(fewest, Ok)
    }

    /// Distributes the weeds over the gaps between plants. A gap gets a second weed only if each gap has one.
    fn weeds_between(&self, plants: &[Canopy], rng: &mut impl Rng) -> Result<Vec<Canopy>, PlantingError> {
        let mut gaps: Vec<Range<f64>> =
            plants.windows(2).map(|pair| pair[0].span_mm().end..pair[1].span_mm().start).collect();
        gaps.shuffle(rng);
        let mut weeds = Vec::with_capacity(self.weeds);
        while weeds.len() < self.weeds {
            // Each weed halves its gap. The halves go to the end of the queue.
            let room = gaps.iter().position(|gap| gap.end - gap.start > NARROWEST_GAP_MM);
            let gap = room.map(|index| gaps.remove(index)).ok_or(PlantingError::NoRoomForWeeds(self.weeds))?;
            let width_mm = rng.random_range(WEED_WIDTHS_MM);
            let clear_mm = WEED_MARGIN_MM + width_mm / 2.0;
            let position_mm = rng.random_range(gap.start + clear_mm..gap.end - clear_mm);
            let weed = Canopy::weed(position_mm, width_mm);
            gaps.push(gap.start..weed.span_mm().start);
            gaps.push(weed.span_mm().end..gap.end);
            weeds.push(weed);
        }
        Ok(weeds)
    }
}

/// A row without an end, sown ahead of the machine. Its parameters may change as it rolls.
#[derive(Clone, Debug)]
pub struct Sowing {
    /// Spacing, canopies and their scatter. Its numbers of plants and weeds are not used.
    pub planting: Planting,
    /// Share of the gaps between plants in which a tall weed stands.
    pub weed_share: f64,
    first_mm: f64,
    rng: ChaCha8Rng,
}

impl Sowing {
    /// An endless row whose first plant's centre is at `first_mm`. The same seed and changes give the same row.
    pub fn new(planting: Planting, weed_share: f64, first_mm: f64, seed: u64) -> Self {
        Self { planting, weed_share, first_mm, rng: ChaCha8Rng::seed_from_u64(seed) }
    }

    /// Appends plants and weeds to a row, until it reaches a position.
    pub fn sow(&mut self, row: &mut Vec<Canopy>, until_mm: f64) {
        let Self { planting, weed_share, first_mm, rng } = self;
        loop {
            let last = row.last().filter(|last| last.kind == Kind::Plant);
            let (last_mm, gap_from_mm) =
                last.map_or((f64::NEG_INFINITY, f64::NEG_INFINITY), |last| (last.position_mm, last.span_mm().end));
            if last_mm >= until_mm {
                return;
            }
            let spacing_mm = planting.spacing_mm + scatter(rng, planting.spacing_scatter_mm);
            let width_mm = planting.canopy_mm + scatter(rng, planting.canopy_scatter_mm);
            let position_mm = if last.is_some() { last_mm + spacing_mm } else { *first_mm };
            // A canopy that would reach into the one before it is moved directly behind that one.
            let position_mm = position_mm.max(gap_from_mm + 1.0 + width_mm / 2.0);
            let plant = Canopy::plant(position_mm, width_mm);
            let (weed_mm, where_in_room, grows) = (
                rng.random_range(WEED_WIDTHS_MM),
                rng.random_range(0.0..1.0),
                rng.random_bool(weed_share.clamp(0.0, 1.0)),
            );
            let room_mm = plant.span_mm().start - gap_from_mm - 2.0 * WEED_MARGIN_MM - weed_mm;
            if grows && room_mm.is_finite() && room_mm > 0.0 {
                let start_mm = gap_from_mm + WEED_MARGIN_MM + where_in_room * room_mm;
                row.push(Canopy::weed(start_mm + weed_mm / 2.0, weed_mm));
            }
            row.push(plant);
        }
    }
}

/// The narrowest gap between two canopies that takes a weed of any width and its margins.
const NARROWEST_GAP_MM: f64 = 2.0 * WEED_MARGIN_MM + WEED_WIDTHS_MM.end;

/// Leaves and gaps over a canopy's span; leaves reach to both ends.
pub(crate) fn leaves(rng: &mut impl Rng, canopy_mm: Range<f64>) -> Vec<Range<f64>> {
    let mut leaves = Vec::new();
    let mut start_mm = canopy_mm.start;
    loop {
        let end_mm = start_mm + rng.random_range(LEAF_WIDTHS_MM);
        if end_mm + LEAF_GAPS_MM.end + LEAF_WIDTHS_MM.start > canopy_mm.end {
            leaves.push(start_mm..canopy_mm.end);
            return leaves;
        }
        leaves.push(start_mm..end_mm);
        start_mm = end_mm + rng.random_range(LEAF_GAPS_MM);
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn the_same_seed_grows_the_same_row_and_another_seed_another() {
        let planting = Planting { weeds: 6, ragged: true, ..Planting::default() };
        assert_eq!(planting.grow(7), planting.grow(7));
        assert_ne!(planting.grow(7), planting.grow(8));
    }

    #[test]
    fn plants_and_weeds_keep_their_spacing_widths_and_margins() {
        let planting = Planting { plants: 200, weeds: 150, ..Planting::default() };
        let row = planting.grow(3).unwrap();
        assert_eq!((row.plants().count(), row.weeds().count()), (200, 150));
        let places: Vec<f64> = row.plants().map(|plant| plant.position_mm).collect();
        assert!(places.windows(2).all(|pair| (460.0..=540.0).contains(&(pair[1] - pair[0]))));
        assert!(row.plants().all(|plant| (125.0..=175.0).contains(&plant.width_mm)));
        assert!(row.weeds().all(|weed| (12.0..20.0).contains(&weed.width_mm)));
        for pair in row.canopies().windows(2) {
            if pair.iter().any(|canopy| canopy.kind == Kind::Weed) {
                let gap_mm = pair[1].span_mm().start - pair[0].span_mm().end;
                assert!(gap_mm >= WEED_MARGIN_MM - 1e-9, "{gap_mm} mm");
            }
        }
    }

    #[test]
    fn an_endless_row_is_sown_in_order_and_without_overlaps() {
        let tight = Planting {
            spacing_mm: 150.0,
            spacing_scatter_mm: 80.0,
            canopy_mm: 200.0,
            canopy_scatter_mm: 100.0,
            ..Planting::default()
        };
        for planting in [Planting::default(), tight] {
            let sown = |step_mm: f64| {
                let mut sowing = Sowing::new(planting, 1.0, 500.0, 5);
                let mut row = Vec::new();
                (1..)
                    .map(|step| f64::from(step) * step_mm)
                    .take_while(|&until_mm| until_mm <= 20_000.0)
                    .for_each(|until_mm| sowing.sow(&mut row, until_mm));
                row
            };
            let row = sown(1000.0);
            assert_eq!(row, sown(20_000.0));
            assert!(row.len() > 30 && row[row.len() - 1].position_mm >= 20_000.0);
            assert_eq!(Row::new(row.clone()).map(|row| row.canopies().to_vec()), Ok(row));
        }
    }

    #[test]
    fn weeds_that_find_no_room_are_refused() {
        let planting = Planting { plants: 3, weeds: 40, ..Planting::default() };
        assert_eq!(planting.grow(1), Err(PlantingError::NoRoomForWeeds(40)));
    }

    #[test]
    fn a_ragged_canopy_has_gaps_and_keeps_its_ends() {
        let row = Planting { ragged: true, ..Planting::default() }.grow(1).unwrap();
        for plant in row.plants() {
            let span = plant.span_mm();
            let leaves = plant.blocks_mm();
            assert!(leaves.len() > 1);
            assert_eq!((leaves[0].start, leaves[leaves.len() - 1].end), (span.start, span.end));
            for pair in leaves.windows(2) {
                assert!(LEAF_GAPS_MM.contains(&(pair[1].start - pair[0].end)));
            }
        }
    }
}
