//! Detections from simulated rows, seen by the firmware's own code.
//!
//! The machine rolls past rows of a [`Crop`] at its speeds and two spacings, and the levels that its encoder and its
//! beam give go through the firmware's decoder and its decisions; no feature is made up. What varies: speed within
//! a tenth of its class, spacing and canopy, plants that are missing, tall weeds wherever there is ground, closed and
//! ragged canopies, and the slip of the wheel.
//!
//! Each pass begins with the firmware's start on bare ground while the machine already rolls. So weeds are met at every
//! distance from the start of counting.
//!
//! The classifier here only records. It gets the true class of each detection, in their order, so that the next spacing
//! is counted from a plant.

use super::labelled::Labelled;
use anyhow::{Result, ensure};
use control::ground::class::{Class, Classifier, ExamplesFull, Listed, Vote};
use control::ground::features::{self, Features, SPEED_CLASSES_MM_S};
use control::measure::quadrature::{Quadrature, Step};
use control::measure::readings::Readings;
use control::measure::reset::Cause;
use control::memory::Volatile;
use control::units::{Instant, Position, Ticks};
use field::machine::Machine;
use field::motion::Motion;
use field::native::{Levels, Sensors, TURN_S};
use field::planting::Planting;
use field::row::{Kind, Row, Thing};
use field::trial::Trial;
use field::verdict::Timing;
use knn::Example;
use rand::{Rng, RngExt, SeedableRng};
use rand_chacha::ChaCha8Rng;
use rig::{Beams, Rig};
use std::cell::RefCell;
use std::ops::RangeInclusive;

/// A crop, and the weeds that outgrow the beam.
#[derive(Clone, Debug, PartialEq)]
pub struct Crop {
    /// What it is called.
    pub name: &'static str,
    /// The speed classes for it, in mm/s.
    pub speeds_mm_s: &'static [i16],
    /// Its plant spacings.
    pub spacings_mm: [f64; 2],
    /// A spacing is within this of its mean.
    pub spacing_scatter_mm: f64,
    /// Mean width of a canopy at the beam's height.
    pub canopy_mm: f64,
    /// A canopy's width is within this of its mean.
    pub canopy_scatter_mm: f64,
    /// Whether there are canopies through which the beam passes.
    pub is_ragged: bool,
    /// Bare ground between the firmware's start and the first planting position, used in turn. Without an earlier
    /// plant, spacing is counted from the start.
    pub headlands_mm: &'static [f64],
    /// Passes over a row at each speed and spacing.
    pub passes: usize,
    /// Widths of tall weeds.
    pub weed_widths_mm: RangeInclusive<f64>,
}

/// The crops, the paper's first. Everything except its spacings is assumed.
pub const CROPS: [Crop; 3] = [
    Crop {
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
    },
    // Heads some weeks after transplanting.
    Crop {
        name: "broccoli",
        speeds_mm_s: &SPEED_CLASSES_MM_S,
        spacings_mm: [400.0, 500.0],
        spacing_scatter_mm: 40.0,
        canopy_mm: 220.0,
        canopy_scatter_mm: 60.0,
        is_ragged: true,
        headlands_mm: &[300.0],
        passes: 12,
        weed_widths_mm: 12.0..=30.0,
    },
    // Stalks below their leaves, and grasses, which are narrower. Above 1.25 km/h this narrow spacing leaves the tool
    // no time.
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

/// Plants in a row before some are removed.
const PLANTS: usize = 20;

/// Share of the plants that did not come up; never two neighbours.
const MISSING: f64 = 0.05;

/// Tall weeds: their number on a metre of bare ground, and their distance from everything else. The distance makes each
/// weed a detection of its own.
const WEEDS_PER_METRE: f64 = 3.0;
const WEED_MARGIN_MM: f64 = 25.0;

/// Ground behind the last plant or weed, over which the beam stays clear.
const RUN_OUT_MM: f64 = 100.0;

/// The speed of a pass, as a share of its class.
const PACE: RangeInclusive<f64> = 0.9..=1.1;

/// Slip: the additional distance of the wheel in a turn, as a share of its circumference; negative if it drags.
const SLIP: RangeInclusive<f64> = -0.03..=0.03;

/// The machine rolls from the start: it reaches its speed within a fraction of a millisecond.
const ACCELERATION_MM_S2: f64 = 1e6;

/// How often the firmware's main loop takes its readings here; on the chip it is more often.
const LOOP_US: u32 = 1000;
const LOOP_CYCLES: u64 = CYCLES_PER_SECOND / 1000;

/// Why there is no field.
#[derive(Debug, Error, PartialEq)]
pub enum SyntheticError {
    /// The plants do not fit.
    #[error(transparent)]
    Planting(#[from] PlantingError),
    /// The row is not one.
    #[error(transparent)]
    Row(#[from] Problem),
    /// The beam did not see the row as it was planted, so that nothing can be labelled.
    #[error("the beam saw {seen} objects on a row of {planted}: it has to see each as one")]
    Miscounted {
        /// Objects that the controller classified.
        seen: usize,
        /// Plants and weeds in the row.
        planted: usize,
    },
}

/// All objects of the crop's field that grows from a seed, in the order in which the machine meets them.
///
/// # Errors
/// Where rows cannot grow or be seen as they should.
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
    let mut things = planting.grow(rng.random())?.things().to_vec();
    things.retain(|_| {
        came_up = !came_up || !rng.random_bool(MISSING);
        came_up
    });

    let mut bare_from_mm = -headland_mm;
    let mut weeds = Vec::new();
    for plant in &things {
        let bare_mm = bare_from_mm..plant.span_mm().start;
        let attempts = ((bare_mm.end - bare_mm.start) / 1000.0 * WEEDS_PER_METRE).round() as usize;
        let mut taken = Vec::<Thing>::new();
        for _ in 0..attempts {
            let weed = Thing::weed(rng.random_range(bare_mm.clone()), rng.random_range(crop.weed_widths_mm.clone()));
            let ground = weed.span_mm().start - WEED_MARGIN_MM..weed.span_mm().end + WEED_MARGIN_MM;
            let is_free = |other: &Thing| other.span_mm().end < ground.start || ground.end < other.span_mm().start;
            if bare_mm.start <= ground.start && ground.end <= bare_mm.end && taken.iter().all(is_free) {
                taken.push(weed);
            }
        }
        weeds.extend(taken);
        bare_from_mm = plant.span_mm().end;
    }
    things.extend(weeds);
    Ok(Row::new(things)?)
}

/// Records the controller's requests, and answers with the true class.
struct Recorder<'a> {
    row: &'a Row,
    seen: RefCell<Vec<Labelled>>,
}

impl Classifier for &Recorder<'_> {
    fn init(&mut self) {}

    fn classify(&self, features: &Features, _k: u8) -> Vote {
        let mut seen = self.seen.borrow_mut();
        // Too many detections are an error at the end.
        let kind = self.row.things().get(seen.len()).map_or(Kind::Plant, |thing| thing.kind);
        seen.push(Labelled { features: *features, kind });
        let class = match kind {
            Kind::Plant => Class::Plant,
            Kind::Weed => Class::Weed,
        };
        Vote { class, votes: 0 }
    }

    // It already knows the true classes: it cannot be taught, and cannot forget.

    fn built_in_class(&mut self, _: &Features) -> Class {
        Class::Unknown
    }

    fn teach(&mut self, _features: &Features, _label: u8) -> Result<(), ExamplesFull> {
        Err(ExamplesFull)
    }

    fn keep(&mut self, _: Example<{ features::COUNT }>) -> Result<(), ExamplesFull> {
        Err(ExamplesFull)
    }

    fn forget(&mut self, _number: u8) -> bool {
        false
    }

    fn listed(&self, _place: u8) -> Option<(Listed, u8)> {
        None
    }

    fn spoiled(&self) -> u8 {
        0
    }

    fn carry_on(&mut self) -> bool {
        true
    }
}

/// What the controller sees of a row.
fn roll_past(row: &Row, headland_mm: f64, speed_mm_s: f64, slip: f64) -> Result<Vec<Labelled>> {
    let standard = Machine::default();
    // The firmware has the nominal wheel; a slipping wheel goes farther in a turn.
    let machine = Machine { wheel_mm: standard.wheel_mm * (1.0 + slip), ..standard };
    let motion = Motion::steady(-headland_mm, ACCELERATION_MM_S2, speed_mm_s, row.span_mm().end + RUN_OUT_MM);
    let trial = Trial { motion, ..Trial::at_speed(row.clone(), machine, Timing::default(), speed_mm_s) };
    let recorder = Recorder { row, seen: RefCell::new(Vec::new()) };
    let beams = Beams::one(!machine.beam_before(row, &motion).high);
    let readings = Readings::new(Instant::ZERO, Position::default());
    let mut rig = Rig::wake_at(&recorder, Volatile::new(), readings, beams, Cause::PowerOn);

    let mut wheel = Encoder::default();
    let mut next_loop = LOOP_CYCLES;
    for change in machine.pin_changes(row, &motion, 0) {
        while next_loop <= change.cycle {
            rig.turn_after(LOOP_US);
            next_loop += LOOP_CYCLES;
        }
        match change.pin {
            wiring::BEAM => rig.see(Beams::one(!change.high)),
            _ => rig.readings.position = wheel.turn(change),
        }
    }
    rig.turn_after(LOOP_US);
    drop(rig);

    let seen = recorder.seen.into_inner();
    let planted = row.things().len();
    if seen.len() == planted { Ok(seen) } else { Err(SyntheticError::Miscounted { seen: seen.len(), planted }) }
}

/// The encoder's two channels, and the position that the firmware's decoder makes of them.
#[derive(Default)]
struct Encoder {
    channels: u8,
    decoder: Quadrature,
    position: Position,
}

impl Encoder {
    fn turn(&mut self, change: PinChange) -> Position {
        let bit = if change.pin == wiring::ENCODER_A { 0b10 } else { 0b01 };
        self.channels = if change.high { self.channels | bit } else { self.channels & !bit };
        if let Step::Ticks(ticks) = self.decoder.step(self.channels) {
            self.position = self.position + Ticks(i32::from(ticks));
        }
        self.position
    }
}
