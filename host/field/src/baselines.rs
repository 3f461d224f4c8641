//! Baselines for the same field: the paper's controller, and an ideal controller.
//!
//! The paper's sketch was never published. [`as_in_the_paper`] follows its text, in the most favourable reading. One
//! slot holds the position to swing out and the position to come back (Eq. 1 to 3). A loop polls beam and encoder, and
//! nothing leads. The Arduino's servo library shows a new pulse in the next frame. The controller measures the next
//! canopy while the slot is still in use. It closes the gaps in a canopy as the firmware does, and takes no weed for a
//! plant.
//!
//! If the distance from beam to tool is shorter than a canopy, it is late for a further reason, which its authors did
//! not know.
//!
//! [`ideal`] knows every stem and the servo's slowest swing. It has the tool out over the zones round the stems, timed
//! for that swing, and in the row everywhere else. No controller can save a plant that it damages. It is no upper
//! bound: it allows for the slowest swing each time, and keeps the whole length of a round zone. The upper bound is
//! [`crate::optimum`]. Both baselines use the machine and the servo of the [`Pass`].

use crate::budget::{Part, Reason, Reasons, part_of};
use crate::ground::union;
use crate::native::{Sensors, ServoLine, Turn, beams_before, turns};
use crate::pass::{Pass, Weeded};
use crate::row::Stem;
use crate::servo::Servo;
use control::operate::servo;
use std::ops::Range;
use uno::Pulse;

/// A turn of the paper's loop, in seconds: `Arduino_KNN` takes 92,309 cycles for 32 examples, measured on the Uno.
const PAPER_TURN_S: f64 = 92_309.0 / 16e6;

/// The paper's margin on both sides of a canopy.
const PAPER_MARGIN_MM: f64 = 50.0;

/// Clear stretches shorter than this belong to the canopy: the firmware's default.
const GAP_MM: f64 = 21.0;

/// Narrower detections are no plants: half way between the built-in examples' widest weed and narrowest plant.
const NARROWEST_PLANT_MM: f64 = 60.0;

/// A turn of the ideal controller's loop, in seconds.
const TURN_S: f64 = 0.001;

/// Shortest gap between two servo pulses, the firmware's default; 0 for fixed frames.
const SERVO_GAP_MS: u8 = 3;

/// The paper's controller weeds the pass's row.
pub fn as_in_the_paper(pass: &Pass) -> Weeded {
    let Pass { machine, motion, row, .. } = pass;
    let tick_mm = pass.machine.tick_mm();
    let ticks = |mm: f64| (mm / tick_mm).round() as i64;
    let (delay, hold) = (ticks(machine.beam_to_tool_mm - PAPER_MARGIN_MM), ticks(2.0 * PAPER_MARGIN_MM));
    let margin = hold / 2;
    let sensors = Sensors::new(pass, PAPER_TURN_S);
    let mut turns = sensors.turns();
    let mut broken = beams_before(pass).broken;
    let mut canopy: Option<Range<i64>> = None;
    let mut slot: Option<(Range<i64>, Part)> = None;
    let mut reasons = Reasons::default();
    let pulses = swing(pass, PAPER_TURN_S, 0, |time_s| {
        let Some(Turn { position, edges, .. }) = turns.next() else { return false };
        if let Some(last) = edges.last() {
            broken = last.beams.broken;
        }
        match &mut canopy {
            None if broken => canopy = Some(position..position),
            Some(canopy) if broken => canopy.end = position,
            Some(Range { start, end }) if position - *end >= ticks(GAP_MM) => {
                let (start, width) = (*start, *end - *start);
                if width >= ticks(NARROWEST_PLANT_MM) {
                    let out = start + delay;
                    let place_mm = |place: i64| motion.position_mm(time_s) + (place - position) as f64 * tick_mm;
                    let kept_for = part_of(&(place_mm(start)..place_mm(start + width)), row);
                    slot = Some((out..out + width + hold, kept_for));
                }
                canopy = None;
            }
            _ => {}
        }
        let kept = slot.as_ref().filter(|(slot, _)| slot.contains(&position));
        let part = kept.map_or(Part::Swings, |(slot, kept_for)| {
            let is_in_margin = position < slot.start + margin || position >= slot.end - margin;
            if is_in_margin && *kept_for == Part::Plants { Part::Margins } else { *kept_for }
        });
        reasons.turn_to(part, time_s);
        kept.is_some()
    });
    Weeded { pulses, start_cycle: 0, alarm: false, reasons: reasons.until(motion.duration_s()) }
}

/// The ideal controller weeds the pass's row.
pub fn ideal(pass: &Pass, stems: &[Stem]) -> Weeded {
    let Pass { machine, motion, .. } = pass;
    let Servo { dead_time_ms, scatter, out_us, .. } = machine.servo;
    // A command may wait for a pulse and the gap behind it, and the loop for its turn.
    let wait_s = (out_us / 1000.0 + f64::from(SERVO_GAP_MS)) / 1000.0 + 2.0 * TURN_S;
    let slowest_s = machine.servo.slowest_s() + wait_s;
    let quickest_s = ((dead_time_ms - scatter.dead_time_ms) / 1000.0).max(0.0);
    let passed_s = |place_mm: f64| Some(motion.passings(place_mm + machine.beam_to_tool_mm).next()?.time_s);
    let zones =
        union(stems.iter().map(|stem| stem.along_mm - stem.protected_mm..stem.along_mm + stem.protected_mm).collect());
    // Ground that is neither a zone nor weeded is lost to swings.
    let mut reasons = vec![Reason { times_s: 0.0..motion.duration_s(), part: Part::Swings }];
    reasons.extend(
        zones.iter().filter_map(|zone| {
            Some(Reason { times_s: passed_s(zone.start)?..passed_s(zone.end)?, part: Part::Plants })
        }),
    );
    let half_mm = machine.half_length_mm();
    let windows: Vec<Range<f64>> = zones
        .into_iter()
        .filter_map(|zone| {
            Some(passed_s(zone.start - half_mm)? - slowest_s..passed_s(zone.end + half_mm)? - quickest_s)
        })
        .collect();
    // If there is no time to swing in and out again, the tool stays out.
    let swings_s = union(windows.into_iter().map(|window| window.start..window.end + slowest_s).collect());
    let mut out_s = swings_s.into_iter().map(|swing| swing.start..swing.end - slowest_s).peekable();
    let pulses = swing(pass, TURN_S, SERVO_GAP_MS, |time_s| {
        while out_s.next_if(|out| out.end <= time_s).is_some() {}
        out_s.peek().is_some_and(|out| out.start <= time_s)
    });
    Weeded { pulses, start_cycle: 0, alarm: false, reasons }
}

/// A loop that has the tool out while `is_out` says so at the time of a turn. The tool begins in the row.
fn swing(pass: &Pass, turn_s: f64, gap_ms: u8, mut is_out: impl FnMut(f64) -> bool) -> Vec<Pulse> {
    let Servo { in_us, out_us, .. } = pass.machine.servo;
    let [in_row, out] = [in_us, out_us].map(|microseconds| servo::from_us(microseconds.round() as u16));
    let mut line = ServoLine::new(in_row, gap_ms);
    for turn in 0..=turns(pass, turn_s) {
        let time_s = f64::from(turn) * turn_s;
        line.command(if is_out(time_s) { out } else { in_row }, time_s);
    }
    line.into_pulses()
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::machine::Machine;
    use crate::motion::mm_s;
    use crate::row::{Canopy, Row};
    use crate::verdict::{ZoneSettings, judge};

    const PLACES: [f64; 8] = [500.0, 1000.0, 1500.0, 2000.0, 2500.0, 3000.0, 3500.0, 4000.0];

    /// Plants over whose canopy the tool was not fully out.
    fn reached_by(controller: impl Fn(&Pass) -> Weeded, speed_km_h: f64) -> usize {
        let row = Row::new(PLACES.map(|place_mm| Canopy::plant(place_mm, 150.0)).to_vec()).unwrap();
        let pass = Pass::at_speed(row, Machine::default(), ZoneSettings::default(), mm_s(speed_km_h));
        let Weeded { pulses, .. } = controller(&pass);
        let judgement = judge(&pass.row, &pass.machine, &pass.motion, pass.timing, &pulses, 0);
        assert!(judgement.weeded_share > 0.1);
        judgement.reached()
    }

    #[test]
    fn the_ideal_controller_has_the_tool_out_over_every_zone() {
        for speed_km_h in [1.0, 1.5, 2.0, 2.5, 3.0] {
            let reached = |protected_mm: f64| {
                let stems = PLACES.map(|along_mm| Stem { along_mm, across_mm: 0.0, protected_mm, is_seen: true });
                reached_by(|pass| ideal(pass, &stems), speed_km_h)
            };
            // Stroke as wide as the canopy, and narrower.
            assert_eq!(reached(75.0), 0, "at {speed_km_h} km/h");
            assert_eq!(reached(40.0), PLACES.len(), "at {speed_km_h} km/h");
        }
    }

    #[test]
    fn the_papers_controller_is_too_late_for_every_plant_at_speed() {
        assert_eq!(reached_by(as_in_the_paper, 0.5), 0);
        assert_eq!(reached_by(as_in_the_paper, 2.5), 8);
    }
}
