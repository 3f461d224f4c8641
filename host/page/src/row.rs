//! What became of a row that the page's virtual Uno was rolled past: [`field::verdict`], told how the machine rolled and what
//! the servo heard.

use field::motion::Motion;
use field::row::{Row, Thing};
use field::servo::Servo;
use field::verdict::{Timing, Verdict, judge};
use field::{Kind, Machine};
use serde::Deserialize;
use serde_json::{Value, json};
use signal::Pulse;

/// A row, the machine, and how it passed. Lengths are millimetres on the ground, times seconds.
#[derive(Deserialize)]
#[serde(rename_all = "camelCase")]
pub struct Passed {
    things: Vec<Standing>,
    machine: Dimensions,
    servo: ServoKind,
    /// Ground kept free on both sides of a canopy.
    margin_mm: u32,
    /// Where the beam was at first.
    start_mm: f64,
    /// The Uno's cycle at which it was there.
    start_cycle: u64,
    /// How the machine rolled from there on.
    pieces: Vec<Piece>,
    /// The pulses that the servo took for commands, by their edges in cycles. At the first one the tool rests where that tells it.
    pulses: Vec<(u64, u64)>,
}

#[derive(Deserialize)]
#[serde(rename_all = "camelCase")]
struct Standing {
    kind: Kind,
    place_mm: f64,
    width_mm: f64,
}

#[derive(Deserialize)]
#[serde(rename_all = "camelCase")]
struct Dimensions {
    beam_to_tool_mm: f64,
    arm_mm: f64,
    tool_width_mm: f64,
    clear_within_degrees: f64,
}

#[derive(Deserialize)]
#[serde(rename_all = "camelCase")]
struct ServoKind {
    in_us: f64,
    out_us: f64,
    dead_time_ms: f64,
    travel_ms: f64,
}

/// A stretch of constant acceleration, in which the direction does not change.
#[derive(Deserialize)]
#[serde(rename_all = "camelCase")]
struct Piece {
    duration_s: f64,
    speed_mm_s: f64,
    acceleration_mm_s2: f64,
}

impl Passed {
    /// How each plant fared, and whether each weed was cut, in the order in which they were given.
    pub fn judge(self) -> Result<Value, String> {
        let things = self.things.iter().map(|thing| Thing::new(thing.place_mm, thing.width_mm, thing.kind));
        let row = Row::new(things.collect()).map_err(|problem| problem.to_string())?;
        let ServoKind { in_us, out_us, dead_time_ms, travel_ms } = self.servo;
        let machine = Machine {
            beam_to_tool_mm: self.machine.beam_to_tool_mm,
            arm_mm: self.machine.arm_mm,
            tool_width_mm: self.machine.tool_width_mm,
            clear_within_degrees: self.machine.clear_within_degrees,
            servo: Servo { in_us, out_us, dead_time_ms, travel_ms, ..Servo::default() },
            ..Machine::default()
        };
        let rolled = |motion: Motion, piece: &Piece| {
            motion.roll_for(piece.duration_s, piece.speed_mm_s, piece.acceleration_mm_s2)
        };
        let motion = self.pieces.iter().fold(Motion::starting_at(self.start_mm), rolled);
        let timing = Timing { margin_mm: self.margin_mm, ..Timing::default() };
        let pulses: Vec<Pulse> = self.pulses.iter().map(|&(rise, fall)| Pulse { rise, fall }).collect();
        if pulses.iter().any(|pulse| pulse.fall < pulse.rise) {
            return Err("a pulse ends before it begins".to_owned());
        }
        let judgement = judge(&row, &machine, &motion, timing, &pulses, self.start_cycle);
        let plants: Vec<&str> = judgement.plants.iter().map(|plant| word(plant.verdict)).collect();
        let weeds: Vec<bool> = judgement.weeds.iter().map(|weed| weed.cut).collect();
        Ok(json!({ "plants": plants, "weeds": weeds }))
    }
}

fn word(verdict: Verdict) -> &'static str {
    match verdict {
        Verdict::Kept => "kept",
        Verdict::MarginCut => "margin cut",
        Verdict::Damaged => "damaged",
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    /// The verdicts where the tool goes in and out at these places of the beam, at half a metre a second, with a plant at 1000 and
    /// a weed at 1400 mm.
    fn judged(swings_mm: &[f64]) -> Value {
        let cycle = |place_mm: f64| 1_000_000 + (place_mm / 500.0 * 16e6) as u64;
        let pulse = |(index, &place_mm): (usize, &f64)| {
            let width_us = if index % 2 == 0 { 2000 } else { 1500 };
            (cycle(place_mm), cycle(place_mm) + width_us * 16)
        };
        let pulses: Vec<(u64, u64)> = std::iter::once(&0.0).chain(swings_mm).enumerate().map(pulse).collect();
        let passed = json!({
            "things": [
                { "kind": "plant", "placeMm": 1000, "widthMm": 150 },
                { "kind": "weed", "placeMm": 1400.5, "widthMm": 15 },
            ],
            "machine": { "beamToToolMm": 400, "armMm": 350, "toolWidthMm": 55, "clearWithinDegrees": 0.09 },
            "servo": { "inUs": 1500, "outUs": 2000, "deadTimeMs": 60, "travelMs": 120 },
            "marginMm": 50,
            "startMm": 0,
            "startCycle": 1_000_000,
            "pieces": [
                { "durationS": 2, "speedMmS": 500, "accelerationMmS2": 0 },
                { "durationS": 2.5, "speedMmS": 500.0, "accelerationMmS2": 0.0 },
            ],
            "pulses": pulses,
        });
        serde_json::from_value::<Passed>(passed).unwrap().judge().unwrap()
    }

    #[test]
    fn a_plant_is_kept_cut_or_damaged_by_where_the_tool_went_out() {
        for (out_mm, verdict) in [(1185.0, "kept"), (1215.0, "margin cut"), (1300.0, "damaged")] {
            assert_eq!(judged(&[600.0, out_mm, 1520.0]), json!({ "plants": [verdict], "weeds": [true] }), "{out_mm}");
        }
        assert_eq!(judged(&[]), json!({ "plants": ["kept"], "weeds": [false] }));
    }
}
