//! A machine at work along a row. The test gives what each beam sees; this records where the tool was in the row, and the events.
//!
//! The wheel may slip. The tool is either in or out: it swings in no time.

#![allow(dead_code, reason = "no test uses all of it")]

use crate::common::{Machine, machine};
use control::{operate::event::Event, settings::Setting};
use rig::Beams;

/// Ticks a millimetre of the default wheel without slip.
pub const TICKS_A_MM: f64 = 1.90986;

/// Distances of the tool and the second beam behind the first beam.
pub const BEAM_TO_TOOL_MM: f64 = 400.0;
pub const SECOND_BEAM_MM: f64 = 200.0;

/// Ground kept on each side of a plant.
pub const MARGIN_MM: f64 = 50.0;

/// A turn of the main loop.
const TURN_US: u32 = 500;

/// A machine under way.
pub struct Rolling {
    pub machine: Machine,
    /// The first beam's position.
    pub place_mm: f64,
    /// The wheel's travel for a millimetre of ground.
    pub turns: f64,
    /// Positions at which the tool was in the row.
    pub weeded_mm: Vec<f64>,
    /// Events, and the first beam's position at each.
    pub told: Vec<(Event, f64)>,
    wheel_mm: f64,
    /// The stretches that each beam sees, from and to.
    pub first_mm: Vec<(f64, f64)>,
    second_mm: Vec<(f64, f64)>,
    /// How far the second beam and the tool are behind the first.
    second_beam_mm: f64,
    beam_to_tool_mm: f64,
}

impl Rolling {
    /// At work, with these settings, a beam that responds at once, and unknown ground.
    pub fn along(first_mm: Vec<(f64, f64)>, second_mm: Vec<(f64, f64)>, settings: &[(Setting, u16)]) -> Self {
        Self::with(machine(), first_mm, second_mm, settings)
    }

    /// The same, with a machine that has started in HOLD.
    pub fn with(
        mut machine: Machine,
        first_mm: Vec<(f64, f64)>,
        second_mm: Vec<(f64, f64)>,
        settings: &[(Setting, u16)],
    ) -> Self {
        for &(setting, value) in [(Setting::BeamResponseMs, 0)].iter().chain(settings) {
            machine.set(setting, value).unwrap();
        }
        machine.enable_events(true);
        machine.start(true).unwrap();
        let set_mm = |setting| f64::from(machine.settings().get(setting));
        let (second_beam_mm, beam_to_tool_mm) = (set_mm(Setting::SecondBeamMm), set_mm(Setting::BeamToToolMm));
        Self {
            second_beam_mm,
            beam_to_tool_mm,
            machine,
            place_mm: 0.0,
            turns: 1.0,
            weeded_mm: Vec::new(),
            told: Vec::new(),
            wheel_mm: 0.0,
            first_mm,
            second_mm,
        }
    }

    /// Rolls until the first beam is at a position.
    pub fn roll_to(&mut self, to_mm: f64, speed_mm_s: f64) {
        let step_mm = (to_mm - self.place_mm).signum() * speed_mm_s * f64::from(TURN_US) / 1e6;
        while (to_mm - self.place_mm) * step_mm > 0.0 {
            self.turn(step_mm);
        }
    }

    /// Rolls by this distance in a turn of the loop.
    pub fn turn(&mut self, step_mm: f64) {
        self.place_mm += step_mm;
        self.wheel_mm += step_mm * self.turns;
        let sees = |seen: &[(f64, f64)], place| seen.iter().any(|&(from, to)| (from..to).contains(&place));
        self.machine.at((self.wheel_mm * TICKS_A_MM).floor() as i32).see(Beams {
            broken: sees(&self.first_mm, self.place_mm),
            second_broken: sees(&self.second_mm, self.place_mm - self.second_beam_mm),
        });
        self.machine.turn_after(TURN_US);
        if !self.machine.tool_out() {
            self.weeded_mm.push(self.place_mm - self.beam_to_tool_mm);
        }
        self.told.extend(self.machine.events().into_iter().map(|event| (event, self.place_mm)));
    }

    /// Loses edges of the first beam, which is an alarm.
    pub fn lose_edges(&mut self) {
        let beams = self.machine.beams();
        self.machine.lose_edges(beams);
        self.machine.turn();
    }

    /// The events of a kind.
    pub fn events_of<T>(&self, of: impl Fn(Event) -> Option<T>) -> Vec<T> {
        self.told.iter().filter_map(|&(event, _)| of(event)).collect()
    }
}
