//! Labelled detections from simulated rows, made by the firmware's own code.
//!
//! The machine rolls past rows of a [`Crop`] at its speeds and two spacings. The firmware's decisions calculate all
//! features from the levels of encoder and beam. These vary: speed within a tenth of its class, spacing, canopy, missing
//! plants, tall weeds on bare ground, closed and ragged canopies, and the wheel's slip. The firmware starts on bare
//! ground while the machine already rolls. So weeds stand at every distance from the start of counting.
//!
//! The classifier here records features. It answers with each detection's true class, in the order of the row, so that
//! spacing is counted from plants.

use super::Labelled;
use anyhow::{Result, ensure};
use control::ground::class::{Class, Classifier, Vote};
use control::ground::features::{Features, SPEED_CLASSES_MM_S};
use control::measure::readings::Readings;
use control::measure::reset::Cause;
use control::memory::Volatile;
use control::units::{Instant, Interval, Position};
use field::machine::Machine;
use field::motion::Motion;
use field::native::{Sensors, TURN_S, beams_before};
use field::pass::Pass;
use field::planting::Planting;
use field::row::{Canopy, Kind, Row};
use field::verdict::ZoneSettings;
use rand::{Rng, RngExt, SeedableRng};
use rand_chacha::ChaCha8Rng;
use rig::Rig;
use std::cell::RefCell;
use std::ops::RangeInclusive;

/// A crop's stand, and the weeds that reach the beam.
#[derive(Clone, Debug, PartialEq)]
pub struct Crop {
    /// Its name.
    pub name: &'static str,
    /// The speed classes of weeding, in mm/s.
    pub speeds_mm_s: &'static [i16],
    /// Its plant spacings.
    pub spacings_mm: [f64; 2],
    /// A spacing is within this of its mean.
    pub spacing_scatter_mm: f64,
    /// Mean width of a canopy at the beam's height.
    pub canopy_mm: f64,
    /// A canopy's width is within this of its mean.
    pub canopy_scatter_mm: f64,
    /// Whether some canopies have gaps for the beam.
    pub is_ragged: bool,
    /// Bare ground from the firmware's start to the first plant's position, used in turn. Before the first plant, spacing is
    /// counted from the start.
    pub headlands_mm: &'static [f64],
    /// Passes over a row at each speed and spacing.
    pub passes: usize,
    /// Widths of tall weeds.
    pub weed_widths_mm: RangeInclusive<f64>,
}

const CHILLI: Crop = Crop {
    name: "chilli",
    speeds_mm_s: &SPEED_CLASSES_MM_S,
    spacings_mm: [500.0, 600.0],
    spacing_scatter_mm: 50.0,
    canopy_mm: 140.0,
    canopy_scatter_mm: 40.0,
    is_ragged: true,
    headlands_mm: &[300.0],
    passes: 12,
    weed_widths_mm: 12.0..=20.0,
};

/// The crops, the paper's first. Only the paper's spacings are measured; all else is assumed.
pub const CROPS: [Crop; 3] = [
    CHILLI,
    // Heads some weeks after transplanting.
    Crop {
        name: "broccoli",
        spacings_mm: [400.0, 500.0],
        spacing_scatter_mm: 40.0,
        canopy_mm: 220.0,
        canopy_scatter_mm: 60.0,
        weed_widths_mm: 12.0..=30.0,
        ..CHILLI
    },
    // Stalks below their leaves, and narrower grasses. Above 1.25 km/h these examples no longer count.
    Crop {
        name: "maize",
        speeds_mm_s: &[SPEED_CLASSES_MM_S[0]],
        spacings_mm: [200.0, 250.0],
        spacing_scatter_mm: 60.0,
        canopy_mm: 20.0,
        canopy_scatter_mm: 7.0,
        is_ragged: false,
        headlands_mm: &[300.0, 450.0, 600.0, 750.0, 900.0],
        passes: 60,
        weed_widths_mm: 4.0..=10.0,
    },
];

/// Plants in a row, including missing ones.
const PLANTS: usize = 20;

/// Share of the plants that did not come up; never two neighbours.
const MISSING: f64 = 0.05;

/// Tall weeds on a metre of bare ground, and their least distance from everything else: the beam then sees each as its
/// own detection.
const WEEDS_PER_METRE: f64 = 3.0;
const WEED_MARGIN_MM: f64 = 25.0;

/// Ground after the last plant or weed, so that its detection ends.
const RUN_OUT_MM: f64 = 100.0;

/// The speed of a pass, as a share of its class.
const PACE: RangeInclusive<f64> = 0.9..=1.1;

/// Relative error of the distance that the wheel rolls in a turn; negative if it drags.
const SLIP: RangeInclusive<f64> = -0.03..=0.03;

/// The machine rolls from the beginning: it reaches its speed within a fraction of a millisecond.
const ACCELERATION_MM_S2: f64 = 1e6;

/// All detections in the crop's field of a seed, in the order of the row.
///
/// # Errors
/// If a row cannot be made, or the firmware's detections do not match it.
pub fn objects(crop: &Crop, seed: u64) -> Result<Vec<Labelled>> {
    let mut rng = ChaCha8Rng::seed_from_u64(seed);
    let mut objects = Vec::new();
    for pass in 0..crop.passes {
        for &class_mm_s in crop.speeds_mm_s {
            for spacing_mm in crop.spacings_mm {
                let headland_mm = crop.headlands_mm[pass % crop.headlands_mm.len()];
                let row = grow(crop, spacing_mm, headland_mm, crop.is_ragged && pass % 2 == 1, &mut rng)?;
                let speed_mm_s = f64::from(class_mm_s) * rng.random_range(PACE);
                let slip = rng.random_range(SLIP);
                objects.extend(roll_past(&row, headland_mm, speed_mm_s, slip)?);
            }
        }
    }
    Ok(objects)
}

/// A row with missing plants, and weeds on its bare ground.
fn grow(crop: &Crop, spacing_mm: f64, headland_mm: f64, ragged: bool, rng: &mut impl Rng) -> Result<Row> {
    let planting = Planting {
        plants: PLANTS,
        spacing_mm,
        spacing_scatter_mm: crop.spacing_scatter_mm,
        canopy_mm: crop.canopy_mm,
        canopy_scatter_mm: crop.canopy_scatter_mm,
        weeds: 0,
        ragged,
    };
    let mut came_up = true;
    let mut canopies = planting.grow(rng.random())?.canopies().to_vec();
    canopies.retain(|_| {
        came_up = !came_up || !rng.random_bool(MISSING);
        came_up
    });

    let mut bare_from_mm = -headland_mm;
    let mut weeds = Vec::new();
    for plant in &canopies {
        let bare_mm = bare_from_mm..plant.span_mm().start;
        let attempts = ((bare_mm.end - bare_mm.start) / 1000.0 * WEEDS_PER_METRE).round() as usize;
        let mut taken = Vec::<Canopy>::new();
        for _ in 0..attempts {
            let weed = Canopy::weed(rng.random_range(bare_mm.clone()), rng.random_range(crop.weed_widths_mm.clone()));
            let ground = weed.span_mm().start - WEED_MARGIN_MM..weed.span_mm().end + WEED_MARGIN_MM;
            let is_free = |other: &Canopy| other.span_mm().end < ground.start || ground.end < other.span_mm().start;
            if bare_mm.start <= ground.start && ground.end <= bare_mm.end && taken.iter().all(is_free) {
                taken.push(weed);
            }
        }
        weeds.extend(taken);
        bare_from_mm = plant.span_mm().end;
    }
    canopies.extend(weeds);
    Ok(Row::new(canopies)?)
}

/// Records the features that the controller asks about, and answers with the true class. It can be taught nothing.
struct Recorder<'a> {
    row: &'a Row,
    seen: RefCell<Vec<Labelled>>,
}

impl Classifier for &Recorder<'_> {
    fn classify(&self, features: &Features, _k: u8) -> Vote {
        let mut seen = self.seen.borrow_mut();
        // Surplus detections are an error at the end.
        let kind = self.row.canopies().get(seen.len()).map_or(Kind::Plant, |canopy| canopy.kind);
        seen.push(Labelled { features: *features, kind });
        let class = match kind {
            Kind::Plant => Class::Plant,
            Kind::Weed => Class::Weed,
        };
        Vote { class, votes: 0 }
    }
}

fn roll_past(row: &Row, headland_mm: f64, speed_mm_s: f64, slip: f64) -> Result<Vec<Labelled>> {
    let standard = Machine::default();
    // The firmware knows only the wheel's size. A slipping wheel is a wheel of another size.
    let machine = Machine { wheel_mm: standard.wheel_mm * (1.0 + slip), ..standard };
    let motion = Motion::steady(-headland_mm, ACCELERATION_MM_S2, speed_mm_s, row.span_mm().end + RUN_OUT_MM);
    let pass = Pass { motion, ..Pass::at_speed(row.clone(), machine, ZoneSettings::default(), speed_mm_s) };
    let recorder = Recorder { row, seen: RefCell::new(Vec::new()) };
    let readings = |turn: u32, position: i64| {
        Readings::new(Instant::default() + Interval::from_ms(turn), Position::new(position as i32))
    };
    let mut rig = Rig::wake_at(&recorder, Volatile::new(), readings(0, 0), beams_before(&pass), Cause::PowerOn);
    for (turn, now) in (0..).zip(Sensors::new(&pass, TURN_S).turns()).skip(1) {
        now.edges.iter().for_each(|seen| rig.edge(Position::new(seen.position as i32), seen.beams));
        rig.turn_with(readings(turn, now.position));
    }
    drop(rig);

    let seen = recorder.seen.into_inner();
    let planted = row.canopies().len();
    ensure!(
        seen.len() == planted,
        "the beam saw {} canopies on a row of {planted}: it has to see each as one",
        seen.len()
    );
    Ok(seen)
}
