//! A crop stand: the plants and weeds of a row, grown from a seed under some conditions.
//!
//! It has two views. The beam sees a [`Row`]: dust, and canopies and weeds that are tall enough for it, as wide as they
//! are at its height ([`crate::sight`]). Those that touch have grown together. The tools meet weeds everywhere, and
//! stems with a protected zone round each ([`crate::tool_path`]). A stem is not exactly in the middle of its canopy. A
//! tool that swings aside far enough may also meet a stem of the next row.
//!
//! Positions are millimetres along the row, and across it from its line, positive to the left. The stand does not
//! depend on the machine or on its work.

use crate::chance::scatter;
use crate::conditions::Conditions;
use crate::ground::union;
use crate::planting::leaves;
use crate::row::{Canopy, Kind, Problem, Row, Stem};
use crate::sight::width_at;
use rand::{Rng, RngExt, SeedableRng};
use rand_chacha::ChaCha8Rng;
use rand_distr::{Distribution, LogNormal, Normal, Poisson};
use std::f64::consts::SQRT_2;
use std::ops::Range;

/// A weed of any height.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct Weed {
    /// Its place along the row.
    pub along_mm: f64,
    /// Its place across the row.
    pub across_mm: f64,
}

/// A stand.
#[derive(Clone, Debug, PartialEq)]
pub struct Stand {
    /// The row as the beam sees it.
    pub row: Row,
    /// The crop plants, in ascending order of place.
    pub stems: Vec<Stem>,
    /// The crop plants of the next row on the side to which the tool swings.
    pub neighbours: Vec<Stem>,
    /// The weeds, including tall ones.
    pub weeds: Vec<Weed>,
    /// The ground, across the whole width, on which weeds are counted: the row's part of the plot's square metres.
    pub counted_mm: Range<f64>,
    /// The row's ground.
    pub span_mm: Range<f64>,
}

/// Distance of a double plant's stem behind the first one's.
const DOUBLE_MM: Range<f64> = 20.0..80.0;

/// Lengths of dust, over which it breaks the beam.
const DUST_MM: Range<f64> = 0.5..4.0;

/// Bare ground before the first plant and behind the last one.
const HEADLAND_MM: f64 = 1000.0;

impl Stand {
    /// Grows a stand with plants `spacing_mm` apart.
    ///
    /// # Errors
    /// If joined canopies exceed the limits of a row, or the row is shorter than the spacing.
    pub fn grow(conditions: &Conditions, spacing_mm: f64, rng: &mut impl Rng) -> Result<Self, Problem> {
        let Conditions { plot, crop, weeds, sensors, machine, .. } = conditions;
        let span_mm = 0.0..plot.row_m * 1000.0;
        // Each has its own random numbers, so that a parameter of one does not change the others.
        let [mut leaf_rng, mut weed_rng, mut dust_rng] = [(); 3].map(|()| ChaCha8Rng::from_rng(rng));
        let of_stream = |stream| {
            let mut rng = leaf_rng.clone();
            rng.set_stream(stream);
            rng
        };
        let [mut height_rng, mut stem_rng, mut size_rng, mut next_rng] = [1, 2, 3, 4].map(of_stream);
        let [mut sown_rng, mut sown_next_rng, mut sway_rng] = [5, 6, 7].map(of_stream);
        // The distance between two plants has the deviation of both positions.
        let sown = |rng: &mut ChaCha8Rng, at_mm: f64| match Normal::new(at_mm, crop.spacing_sd_mm / SQRT_2) {
            Ok(normal) if crop.spacing_sd_mm > 0.0 => normal.sample(rng).clamp(span_mm.start, span_mm.end),
            _ => at_mm,
        };
        let mut stems = Vec::new();
        let mut canopies = Vec::new();
        let mut swayed: [Vec<Range<f64>>; 2] = Default::default();
        let places = (span_mm.end / spacing_mm).floor() as u32;
        for place in 0..places {
            let at_mm = sown(&mut sown_rng, (f64::from(place) + 0.5) * spacing_mm);
            // A row has at least one plant.
            let is_missing = chance(rng, crop.missing_percent) && (place + 1 < places || !stems.is_empty());
            let plants = if is_missing { 0 } else { 1 + usize::from(chance(rng, crop.double_percent)) };
            let mut along_mm = at_mm + scatter(rng, crop.spacing_scatter_mm);
            for _ in 0..plants {
                let width_mm = (crop.canopy_mm + scatter(rng, crop.canopy_scatter_mm)).max(MIN_CANOPY_MM);
                let height_mm = crop.height_mm + scatter(&mut height_rng, crop.height_scatter_mm);
                let seen_mm = width_at(sensors.beam_height_mm, height_mm, width_mm);
                let mut plant = Canopy::plant(along_mm, seen_mm.unwrap_or(width_mm).max(MIN_CANOPY_MM));
                if chance(&mut leaf_rng, crop.ragged_percent) {
                    plant.leaves = leaves(&mut leaf_rng, plant.span_mm());
                }
                let is_seen = !chance(rng, sensors.unseen_percent) && seen_mm.is_some();
                let sway_mm = [(); 2].map(|()| scatter(&mut sway_rng, crop.sway_mm));
                if is_seen {
                    for (leaves_mm, sway_mm) in swayed.iter_mut().zip(sway_mm) {
                        leaves_mm.extend(plant.blocks_mm().iter().map(|leaf| leaf.start + sway_mm..leaf.end + sway_mm));
                    }
                    canopies.push(plant);
                }
                let across_mm = scatter(rng, crop.across_scatter_mm);
                let stem_mm = along_mm + scatter(&mut stem_rng, crop.stem_off_mm);
                stems.push(Stem { along_mm: stem_mm, across_mm, protected_mm: crop.protected_mm / 2.0, is_seen });
                along_mm += rng.random_range(DOUBLE_MM);
            }
        }
        let half_mm = plot.row_spacing_mm / 2.0;
        let area_m2 = plot.row_m * plot.row_spacing_mm / 1000.0;
        let mut grown: Vec<Weed> = (0..count(&mut weed_rng, weeds.short_per_m2 * area_m2))
            .map(|_| Weed {
                along_mm: weed_rng.random_range(span_mm.clone()),
                across_mm: weed_rng.random_range(-half_mm..half_mm),
            })
            .collect();
        // A weed in the row that is tall enough breaks the beam.
        let first_weed = canopies.len();
        for weed in grown.iter().filter(|weed| weed.across_mm.abs() < machine.sweep_from_mm) {
            let height_mm = about(&mut size_rng, weeds.height_mm, weeds.height_factor);
            let widest_mm = about(&mut size_rng, weeds.width_mm, weeds.width_factor);
            canopies.extend(weed_seen(weed.along_mm, sensors.beam_height_mm, height_mm, widest_mm));
        }
        for _ in 0..count(&mut weed_rng, weeds.tall_per_m * plot.row_m) {
            let along_mm = weed_rng.random_range(span_mm.clone());
            grown.push(Weed { along_mm, across_mm: scatter(&mut weed_rng, crop.across_scatter_mm) });
            let height_mm = crop.height_mm + scatter(&mut size_rng, crop.height_scatter_mm);
            let widest_mm = about(&mut size_rng, weeds.width_mm, weeds.width_factor);
            canopies.extend(weed_seen(along_mm, sensors.beam_height_mm, height_mm, widest_mm));
        }
        let air_mm = span_mm.start - HEADLAND_MM..span_mm.end + HEADLAND_MM;
        let dust_mm = (0..count(&mut dust_rng, sensors.dust_per_m * (air_mm.end - air_mm.start) / 1000.0))
            .map(|_| {
                let start_mm = dust_rng.random_range(air_mm.clone());
                start_mm..start_mm + dust_rng.random_range(DUST_MM)
            })
            .collect();
        stems.sort_by(|a, b| a.along_mm.total_cmp(&b.along_mm));
        // Weeds are stiff: only the crop's leaves move.
        for leaves_mm in &mut swayed {
            leaves_mm.extend(canopies[first_weed..].iter().flat_map(Canopy::blocks_mm));
        }
        let mut row = Row::new(grown_together(canopies))?;
        row.dust_mm = dust_mm;
        row.swayed_mm = (crop.sway_mm > 0.0).then_some(swayed);
        row.ground_mm = Some(span_mm.clone());
        // The tools' effect on the stems is counted by itself.
        row.stems = Some(Vec::new());
        // The next row is planted separately: it has the same planting positions, and its own random numbers.
        let next_to = |place: u32| {
            let at_mm = sown(&mut sown_next_rng, (f64::from(place) + 0.5) * spacing_mm)
                + scatter(&mut next_rng, crop.spacing_scatter_mm);
            let across_mm = plot.row_spacing_mm + scatter(&mut next_rng, crop.across_scatter_mm);
            Stem { along_mm: at_mm, across_mm, protected_mm: crop.protected_mm / 2.0, is_seen: true }
        };
        let neighbours = (0..places).map(next_to).collect();
        let counted_m = plot.counted_m2 / f64::from(plot.rows) / (plot.row_spacing_mm / 1000.0);
        let counted_mm = if counted_m <= 0.0 { plot.row_m * 1000.0 } else { counted_m.min(plot.row_m) * 1000.0 };
        let from_mm = size_rng.random_range(0.0..=span_mm.end - counted_mm);
        Ok(Self { row, stems, neighbours, weeds: grown, counted_mm: from_mm..from_mm + counted_mm, span_mm })
    }
}

/// A random size with a log-normal distribution: its median, and the factor of its standard deviation.
fn about(rng: &mut impl Rng, median: f64, factor: f64) -> f64 {
    LogNormal::new(median.ln(), factor.ln()).map_or(median, |sizes| sizes.sample(rng))
}

/// A weed as the beam sees it. `None` if the beam passes above it. A weed wider than the widest canopy becomes several.
fn weed_seen(along_mm: f64, beam_height_mm: f64, height_mm: f64, widest_mm: f64) -> Option<Canopy> {
    let width_mm = width_at(beam_height_mm, height_mm, widest_mm.min(MAX_WEED_MM))?;
    Some(Canopy::weed(along_mm, width_mm.max(MIN_WEED_MM)))
}

/// Widest weed, and narrowest stalk.
const MAX_WEED_MM: f64 = 350.0;
const MIN_WEED_MM: f64 = 1.0;

/// No scatter makes a canopy narrower.
const MIN_CANOPY_MM: f64 = 10.0;

/// True with a probability of `percent`.
fn chance(rng: &mut impl Rng, percent: f64) -> bool {
    rng.random_bool((percent / 100.0).clamp(0.0, 1.0))
}

fn count(rng: &mut impl Rng, mean: f64) -> usize {
    // A mean of 0 has no distribution, but a result.
    Poisson::new(mean).map_or(0, |poisson| poisson.sample(rng) as usize)
}

/// The canopies as the beam sees them. Those that touch are joined, and the result is a plant if any of them is.
fn grown_together(mut canopies: Vec<Canopy>) -> Vec<Canopy> {
    canopies.sort_by(|a, b| a.span_mm().start.total_cmp(&b.span_mm().start));
    let mut together: Vec<Canopy> = Vec::with_capacity(canopies.len());
    for canopy in canopies {
        match together.last_mut() {
            Some(last) if canopy.span_mm().start <= last.span_mm().end => {
                let across_mm = last.across_mm.max(canopy.across_mm);
                let span = last.span_mm().start..last.span_mm().end.max(canopy.span_mm().end);
                let blocks = union(last.blocks_mm().into_iter().chain(canopy.blocks_mm()).collect());
                let kind = if last.kind == Kind::Plant { Kind::Plant } else { canopy.kind };
                *last = Canopy {
                    position_mm: (span.start + span.end) / 2.0,
                    width_mm: span.end - span.start,
                    across_mm,
                    kind,
                    leaves: if blocks.len() > 1 { blocks } else { Vec::new() },
                };
            }
            _ => together.push(canopy),
        }
    }
    together
}

#[cfg(test)]
mod tests {
    use super::*;

    fn try_grow(preset: &str, changes: &[(&str, f64)], spacing_mm: f64, seed: u64) -> Result<Stand, Problem> {
        Stand::grow(&Conditions::with(preset, changes), spacing_mm, &mut ChaCha8Rng::seed_from_u64(seed))
    }

    /// A stand with plants half a metre apart. The preset `transplanted` has the default values.
    fn grow(preset: &str, changes: &[(&str, f64)], seed: u64) -> Stand {
        try_grow(preset, changes, 500.0, seed).expect("a row")
    }

    #[test]
    fn the_same_seed_grows_the_same_stand_and_another_seed_another() {
        let default = |seed| grow("transplanted", &[], seed);
        assert_eq!(default(1), default(1));
        assert_ne!(default(1), default(2));
    }

    #[test]
    fn an_even_stand_has_a_plant_in_every_place_and_nothing_else_in_the_beam() {
        let stand = grow("even-stand", &[], 1);
        let places: Vec<f64> = stand.stems.iter().map(|stem| stem.along_mm).collect();
        let expected: Vec<f64> = (0..40).map(|place| 250.0 + 500.0 * f64::from(place)).collect();
        assert_eq!(places, expected);
        assert_eq!(stand.row.blocks_mm().len(), 40);
        assert!(stand.stems.iter().all(|stem| stem.across_mm == 0.0));
    }

    #[test]
    fn missing_and_double_plants_come_as_often_as_asked_for() {
        let stand = grow("direct-sown", &[("plot.row_m", 1000.0)], 3);
        // 2000 planting positions less 12 %; a tenth of them are double. Three standard deviations are about 60.
        let expected = 2000.0 * 0.88 * 1.1;
        assert!((stand.stems.len() as f64 - expected).abs() < 60.0, "{}", stand.stems.len());
    }

    /// The standard deviation of the distances from a plant to the next.
    fn spacing_sd_mm(stand: &Stand) -> f64 {
        let distances: Vec<f64> = stand.stems.windows(2).map(|pair| pair[1].along_mm - pair[0].along_mm).collect();
        let mean = distances.iter().sum::<f64>() / distances.len() as f64;
        let squares: f64 = distances.iter().map(|distance| (distance - mean).powi(2)).sum();
        (squares / (distances.len() - 1) as f64).sqrt()
    }

    #[test]
    fn plants_are_sown_as_unevenly_as_the_deviation_of_their_spacing_says() {
        let even = |sd_mm: f64| ("even-stand", vec![("crop.spacing_sd_mm", sd_mm)], 500.0, sd_mm, 0.05 * sd_mm);
        // As the presets' comments say.
        let of_preset = |preset, spacing_mm, sd_mm| (preset, Vec::new(), spacing_mm, sd_mm, 4.0);
        for (preset, mut changes, spacing_mm, sd_mm, within_mm) in [
            even(0.0),
            even(20.0),
            even(60.0),
            of_preset("maize", 200.0, 73.0),
            of_preset("maize", 250.0, 88.0),
            of_preset("maize-uneven", 200.0, 114.0),
            of_preset("maize-uneven", 250.0, 128.0),
        ] {
            changes.push(("plot.row_m", 1000.0));
            let sown_mm = spacing_sd_mm(&try_grow(preset, &changes, spacing_mm, 5).unwrap());
            assert!((sown_mm - sd_mm).abs() <= within_mm, "{preset} at {spacing_mm} mm: {sown_mm} mm, not {sd_mm}");
        }
    }

    #[test]
    fn weeds_are_as_many_as_their_density_says_and_lie_in_the_plot() {
        let stand = grow("weedy", &[("plot.row_m", 100.0)], 3);
        let expected = 200.0 * 100.0 * 0.4 + 1.2 * 100.0;
        assert!((stand.weeds.len() as f64 - expected).abs() < 3.0 * f64::sqrt(expected), "{}", stand.weeds.len());
        assert!(stand.weeds.iter().all(|weed| stand.span_mm.contains(&weed.along_mm) && weed.across_mm.abs() <= 200.0));
    }

    #[test]
    fn a_parameter_of_one_leaves_the_others_as_they_are() {
        let closed = grow("transplanted", &[], 1);
        let ragged = grow("transplanted", &[("crop.ragged_percent", 100.0), ("sensors.dust_per_m", 1.0)], 1);
        assert_eq!((&closed.stems, &closed.weeds), (&ragged.stems, &ragged.weeds));
        assert_ne!(closed.row, ragged.row);
    }

    #[test]
    fn a_row_shorter_than_its_spacing_is_none() {
        let changes = [("plot.row_m", 2.0), ("weeds.tall_per_m", 0.0)];
        assert_eq!(try_grow("transplanted", &changes, 2500.0, 1), Err(Problem::Empty));
    }

    #[test]
    fn plants_lower_than_the_beam_are_not_in_the_row_and_their_stems_are() {
        let single = [("plot.row_m", 500.0), ("weeds.tall_per_m", 0.0), ("crop.double_percent", 0.0)];
        // Plants of 250 to 350 mm: a beam at 275 mm passes above a quarter of them.
        let stand = grow("transplanted", &[&single[..], &[("sensors.beam_height_mm", 275.0)]].concat(), 2);
        let seen = stand.row.plants().count() as f64 / stand.stems.len() as f64;
        assert!((seen - 0.75).abs() < 0.05, "{seen}");
        let widest_mm = stand.row.plants().map(|plant| plant.width_mm).fold(0.0, f64::max);
        assert!(widest_mm < 190.0 * 0.85, "near its top a canopy is narrow: {widest_mm} mm");
    }

    #[test]
    fn weeds_that_outgrow_the_beam_break_it_and_some_are_as_wide_as_plants() {
        let low = grow("even-stand", &[("plot.row_m", 500.0)], 2);
        assert_eq!(low.row.weeds().count(), 0);
        let tall = [("weeds.height_mm", 150.0), ("weeds.height_factor", 1.5), ("weeds.width_factor", 2.5)];
        let high = grow("even-stand", &[&[("plot.row_m", 500.0)], &tall[..]].concat(), 2);
        let seen = high.row.weeds().count();
        // Half of the weeds in the row's 100 mm: 60 a square metre on 50 m2, without those hidden by canopies.
        assert!((800..1500).contains(&seen), "{seen}");
        assert!(high.row.weeds().filter(|weed| weed.width_mm > 60.0).count() > 20);
        assert_eq!(low.weeds, high.weeds);
    }

    #[test]
    fn stems_stand_off_the_middle_of_their_canopies_by_the_given_distance() {
        let stand = grow("even-stand", &[("crop.stem_off_mm", 20.0)], 4);
        let off = || stand.stems.iter().zip(stand.row.plants()).map(|(stem, plant)| stem.along_mm - plant.position_mm);
        assert!(off().all(|mm| mm.abs() <= 20.0) && off().any(|mm| mm > 10.0) && off().any(|mm| mm < -10.0));
    }

    #[test]
    fn the_counted_ground_is_a_square_metre_a_plot_and_lies_in_the_row() {
        let stand = grow("transplanted", &[], 1);
        // Three rows of 0.4 m share it.
        assert!((stand.counted_mm.end - stand.counted_mm.start - 1000.0 / 1.2).abs() < 1e-6);
        assert!(stand.counted_mm.start >= 0.0 && stand.counted_mm.end <= 20_000.0);
    }

    #[test]
    fn touching_canopies_are_one_and_a_plant_if_any_of_them_is() {
        let canopies = vec![Canopy::weed(100.0, 20.0), Canopy::plant(150.0, 100.0), Canopy::weed(300.0, 20.0)];
        let together = grown_together(canopies);
        assert_eq!(together, [Canopy { across_mm: 100.0, ..Canopy::plant(145.0, 110.0) }, Canopy::weed(300.0, 20.0)]);
    }
}
