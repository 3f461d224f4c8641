//! Other controllers for the same field, to hold the firmware against: the paper's, and one that knows everything.
//!
//! The paper's sketch was never published. [`as_in_the_paper`] is what its text describes, in the kindest reading: one slot holds
//! the place at which to swing out and the place at which to come back (Eq. 1 to 3), a loop polls beam and encoder, nothing is
//! led, and the Arduino's servo library shows a new pulse in the next frame. It measures the next canopy while the slot is
//! still in use, closes the gaps in a canopy as the firmware does, and takes no weed for a plant.
//!
//! [`all_knowing`] commands each swing where the firmware's leads say, but for where the plants really stand: what it
//! damages, slip and scatter of the servo make unavoidable. Both have the machine of the [`Trial`], with the same servo.

use crate::machine::Machine;
use crate::servo::Servo;
use crate::signal::Pulse;
use crate::trial::Trial;
use crate::twin::{Sensors, ServoLine};
use control::servo;
use std::ops::Range;

/// A turn of the paper's loop: `Arduino_KNN` takes 92,309 cycles for 32 examples, measured on the Uno.
const PAPER_TURN_S: f64 = 92_309.0 / 16e6;

/// Ground that the paper leaves alone on both sides of a canopy.
const PAPER_MARGIN_MM: f64 = 50.0;

/// Clear stretches shorter than this belong to the canopy: the firmware's default.
const GAP_MM: f64 = 21.0;

/// Objects narrower than this are no plants: half way between the built-in examples' widest weed and narrowest plant.
const NARROWEST_PLANT_MM: f64 = 60.0;

/// A turn of the loop that knows everything.
const TURN_S: f64 = 0.001;

/// Shortest gap between two servo pulses, the firmware's default; 0 for fixed frames.
const SERVO_GAP_MS: u8 = 3;

/// The paper's controller weeds the trial's row: the first of the servo's pulses of each width.
pub fn as_in_the_paper(trial: &Trial) -> Vec<Pulse> {
    let Machine { beam_to_tool_mm, servo, .. } = trial.machine;
    let tick_mm = trial.machine.tick_mm();
    let ticks = |mm: f64| (mm / tick_mm).round() as i64;
    let (delay, hold) = (ticks(beam_to_tool_mm - PAPER_MARGIN_MM), ticks(2.0 * PAPER_MARGIN_MM));
    let mut sensors = Sensors::new(trial);
    let mut broken = !trial.machine.beam_before(&trial.row, &trial.motion).high;
    let mut canopy: Option<Range<i64>> = None;
    let mut slot: Option<Range<i64>> = None;
    swing(trial, servo, PAPER_TURN_S, 0, |time_s| {
        while let Some((_, is_broken)) = sensors.next_edge(time_s) {
            broken = is_broken;
        }
        let position = sensors.position(time_s);
        match &mut canopy {
            None if broken => canopy = Some(position..position),
            Some(canopy) if broken => canopy.end = position,
            Some(Range { start, end }) if position - *end >= ticks(GAP_MM) => {
                let (start, width) = (*start, *end - *start);
                if width >= ticks(NARROWEST_PLANT_MM) {
                    let out = start + delay;
                    slot = Some(out..out + width + hold);
                }
                canopy = None;
            }
            _ => {}
        }
        slot.as_ref().is_some_and(|slot| slot.contains(&position))
    })
}

/// Whoever knows where each plant stands weeds the trial's row: the first of the servo's pulses of each width.
pub fn all_knowing(trial: &Trial) -> Vec<Pulse> {
    let Trial { row, machine, motion, timing, .. } = trial;
    let margin_mm = f64::from(timing.margin_mm);
    // When the tool passes a place, less the way that the machine rolls in the lead.
    let led_s = |place_mm: f64, lead_ms: u32| {
        let passed_s = |place_mm: f64| motion.passings(place_mm + machine.beam_to_tool_mm).first().map(|p| p.time_s);
        let speed_mm_s = motion.speed_mm_s(passed_s(place_mm)?);
        passed_s(place_mm - speed_mm_s * f64::from(lead_ms) / 1000.0)
    };
    let windows: Vec<Range<f64>> = row
        .plants()
        .filter_map(|plant| {
            let span = plant.span_mm();
            let out_s = led_s(span.start - margin_mm, timing.lead_out_ms)?;
            Some(out_s..led_s(span.end + margin_mm, timing.lead_in_ms)?)
        })
        .collect();
    let mut next = 0;
    swing(trial, machine.servo, TURN_S, SERVO_GAP_MS, |time_s| {
        while windows.get(next).is_some_and(|window| window.end <= time_s) {
            next += 1;
        }
        windows.get(next).is_some_and(|window| window.contains(&time_s))
    })
}

/// A loop that has the tool out whenever `is_out` at the time of a turn says so. It begins in the row.
fn swing(trial: &Trial, servo: Servo, turn_s: f64, gap_ms: u8, mut is_out: impl FnMut(f64) -> bool) -> Vec<Pulse> {
    let width = |microseconds: f64| servo::from_us(microseconds.round() as u16);
    let mut line = ServoLine::new(width(servo.in_us), gap_ms);
    let turns = (trial.motion.duration_s() / turn_s).ceil() as u64;
    for turn in 0..=turns {
        let time_s = turn as f64 * turn_s;
        line.command(width(if is_out(time_s) { servo.out_us } else { servo.in_us }), time_s);
    }
    line.into_pulses()
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::motion::mm_s;
    use crate::row::{Row, Thing};
    use crate::verdict::{Timing, Verdict, judge};

    fn damaged_by(controller: fn(&Trial) -> Vec<Pulse>, speed_km_h: f64) -> usize {
        let row = Row::new((1..9).map(|place| Thing::plant(500.0 * f64::from(place), 150.0)).collect()).unwrap();
        let trial = Trial::at_speed(row, Machine::default(), Timing::default(), mm_s(speed_km_h));
        let pulses = controller(&trial);
        let judgement = judge(&trial.row, &trial.machine, &trial.motion, trial.timing, &pulses, 0);
        assert!(judgement.weeded_share > 0.1);
        judgement.count(Verdict::Damaged)
    }

    #[test]
    fn who_knows_everything_damages_nothing_at_any_of_the_papers_speeds() {
        for speed_km_h in [1.0, 1.5, 2.0, 2.5] {
            assert_eq!(damaged_by(all_knowing, speed_km_h), 0, "at {speed_km_h} km/h");
        }
    }

    #[test]
    fn the_papers_controller_serves_every_plant_and_is_too_late_for_all_of_them_at_speed() {
        assert_eq!(damaged_by(as_in_the_paper, 0.5), 0);
        assert_eq!(damaged_by(as_in_the_paper, 2.5), 8);
    }
}
