//! The machine between row and firmware: wheel, encoder, beam, servo, arm and tool.
//!
//! The machine's position `p` is a distance along the row. The beam sees the ground at `p`. The tool works the ground
//! at `p` less the distance from beam to tool. While the machine rolls along a [`Motion`] past a [`Row`], it gives the
//! firmware the levels of encoder and beam as a list of [`PinChange`]s. The motion does not depend on the firmware, so
//! the list is complete before the firmware runs.
//!
//! At an angle `a` of its arm the tool's middle is `arm * sin(a)` beside the row's line. So the tool works the line while
//! that is less than half its width. It is *clear* of the row only when it is fully out. The arm is a pendulum, which
//! lifts the tool by `arm * (1 - cos(a))`, or it trails behind its pivot and carries the tool forward by as much. The
//! tool stays square to the row. It is a rectangle: its length along the row is half ahead of its middle, half behind.
//!
//! The encoder has no jitter. If its disc is dirty, pulses of its channel A are missing.

use crate::conditions::Arm;
use crate::motion::{Motion, marks};
use crate::row::Row;
use crate::servo::Servo;
use crate::sight::half_covered;
use crate::wiring;
use control::measure::quadrature::{Channels, Quadrature, Step};
use rand::rngs::Xoshiro256PlusPlus;
use rand::{RngExt, SeedableRng};
use std::f64::consts::PI;
use std::ops::Range;
use uno::{CYCLES_PER_SECOND, Pin, PinChange};

/// Dimensions of the machine.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct Machine {
    /// Diameter of the ground wheel.
    pub wheel_mm: f64,
    /// Encoder counts (edges of both channels) in a turn of the wheel.
    pub ticks_per_rev: u32,
    /// Distance from the beam back to the tool's middle along the row: the paper's X.
    pub beam_to_tool_mm: f64,
    /// Distance from the beam back to a second one; 0 if there is none.
    pub second_beam_mm: f64,
    /// Time after which the beam's sensor reports a change. A change that lasts less is not reported.
    pub beam_response_ms: f64,
    /// Diameter of the beam; 0 is a line. Its sensor reports it broken while more than half of it is covered.
    pub beam_mm: f64,
    /// The servo.
    pub servo: Servo,
    /// Length of the arm from its pivot to the tool.
    pub arm_mm: f64,
    /// How it hangs.
    pub arm: Arm,
    /// Width of the tool, across the row.
    pub tool_width_mm: f64,
    /// Length of the tool, along the row; 0 is a line across it.
    pub tool_length_mm: f64,
    /// An arm within this angle of fully out is fully out.
    pub clear_within_degrees: f64,
    /// Dirt on the encoder's disc.
    pub dirt: Dirt,
}

/// Dirt that hides random slots of the encoder's disc from channel A. A hidden pulse loses four counts.
#[derive(Clone, Copy, Debug, Default, PartialEq)]
pub struct Dirt {
    /// Share of the pulses that are hidden, from 0 to 1.
    pub share: f64,
    /// Selects the random disc.
    pub seed: u64,
}

/// Counts of a pulse: both edges of both channels.
pub const PULSE_TICKS: i64 = 4;

impl Dirt {
    /// Whether pulse number `pulse` is hidden: always the same pulses for the same seed. The hash is a quick one,
    /// because each pulse of a row calls it.
    pub fn hides(&self, pulse: i64) -> bool {
        self.share > 0.0
            && Xoshiro256PlusPlus::seed_from_u64(self.seed ^ pulse.cast_unsigned())
                .random_bool(self.share.clamp(0.0, 1.0))
    }
}

impl Default for Machine {
    fn default() -> Self {
        Self {
            wheel_mm: 400.0,
            ticks_per_rev: 2400,
            beam_to_tool_mm: 400.0,
            second_beam_mm: 0.0,
            beam_response_ms: 1.0,
            beam_mm: 0.0,
            servo: Servo::default(),
            arm_mm: 350.0,
            arm: Arm::Pendulum,
            tool_width_mm: 55.0,
            tool_length_mm: 0.0,
            // A tenth of a millimetre at the tool's end.
            clear_within_degrees: 0.02,
            dirt: Dirt::default(),
        }
    }
}

impl Machine {
    /// Distance rolled between two encoder counts.
    pub fn tick_mm(&self) -> f64 {
        PI * self.wheel_mm / f64::from(self.ticks_per_rev)
    }

    /// Ground under the tool's middle when the machine is at `position_mm`.
    pub fn tool_mm(&self, position_mm: f64) -> f64 {
        position_mm - self.beam_to_tool_mm
    }

    /// The stretch of ground that the tool's middle rolls over during a time.
    pub fn worked_mm(&self, motion: &Motion, times_s: &Range<f64>) -> Range<f64> {
        let stretch = motion.stretch_mm(times_s);
        self.tool_mm(stretch.start)..self.tool_mm(stretch.end)
    }

    /// Net counts of a clean encoder, from the beginning of a motion to a time.
    pub fn ticks(&self, motion: &Motion, time_s: f64) -> i64 {
        marks(motion.wheel_mm(time_s) - motion.start_mm(), self.tick_mm())
    }

    /// The pulse in which a clean encoder is at a count.
    pub fn pulse(&self, clean_ticks: i64) -> i64 {
        clean_ticks.div_euclid(PULSE_TICKS)
    }

    /// Missing counts within the hidden pulse at this count of a clean encoder. While A is hidden, B alone counts one
    /// back and then one forward.
    pub fn hidden_in_pulse(&self, clean_ticks: i64) -> i64 {
        [0, 1, 3, 4][clean_ticks.rem_euclid(PULSE_TICKS) as usize]
    }

    /// Distance of the tool's middle from the row's line at an angle.
    pub fn across_mm(&self, degrees: f64) -> f64 {
        self.arm_mm * degrees.to_radians().sin()
    }

    /// How far the arm has carried the tool forward at an angle.
    pub fn forward_mm(&self, degrees: f64) -> f64 {
        match self.arm {
            Arm::Pendulum => 0.0,
            Arm::Trailing => self.arm_mm * (1.0 - degrees.to_radians().cos()),
        }
    }

    /// The angle beyond which the tool no longer works the row's line.
    pub fn line_degrees(&self) -> f64 {
        (self.tool_width_mm / 2.0 / self.arm_mm).min(1.0).asin().to_degrees()
    }

    /// Half of the tool's length: how far it reaches ahead of its middle, and behind it.
    pub fn half_length_mm(&self) -> f64 {
        self.tool_length_mm / 2.0
    }

    /// How far from the row's line the tool's nearer edge is when it is fully out.
    pub fn room_mm(&self) -> f64 {
        self.across_mm(self.servo.stroke_degrees()) - self.tool_width_mm / 2.0
    }

    /// The angle from which on the tool is fully out.
    pub fn clear_degrees(&self) -> f64 {
        self.servo.stroke_degrees() - self.clear_within_degrees
    }

    /// The angle from which on the tool's nearer edge is this far from the row's line, or the tool is fully out.
    pub fn degrees_beside(&self, aside_mm: f64) -> f64 {
        let degrees = ((aside_mm + self.tool_width_mm / 2.0) / self.arm_mm).clamp(0.0, 1.0).asin().to_degrees();
        degrees.min(self.clear_degrees())
    }

    /// The level of each beam's line at power-up, before the motion; of the second one's only if there is one.
    pub fn beams_before(&self, row: &Row, motion: &Motion) -> Vec<PinChange> {
        self.beams(&self.leaves_mm(row), motion.start_mm(), 0).iter().map(|beam| beam.last).collect()
    }

    /// The stretches over which each beam's sensor reports it as broken.
    fn leaves_mm(&self, row: &Row) -> [Vec<Range<f64>>; 2] {
        [0, 1].map(|beam| half_covered(row.blocks_of_beam_mm(beam), self.beam_mm))
    }

    /// The sensors of the beams of a machine at `start_mm`, each over its leaves.
    pub(crate) fn beams(&self, leaves_mm: &[Vec<Range<f64>>; 2], start_mm: f64, start_cycle: u64) -> Vec<Sensor> {
        let second = self.has_second_beam().then_some((wiring::SECOND_BEAM, self.second_beam_mm));
        let beam = |((pin, behind_mm), leaves_mm): ((Pin, f64), &Vec<Range<f64>>)| {
            let is_broken = leaves_mm.iter().any(|leaf| leaf.contains(&(start_mm - behind_mm)));
            let last = PinChange { cycle: start_cycle, pin, high: !is_broken };
            Sensor { last, behind_mm, response_s: self.beam_response_ms / 1000.0, changed_s: None }
        };
        [(wiring::BEAM, 0.0)].into_iter().chain(second).zip(leaves_mm).map(beam).collect()
    }

    /// Whether there is a second beam.
    pub fn has_second_beam(&self) -> bool {
        self.second_beam_mm > 0.0
    }

    /// The pin changes of encoder and beam while the machine rolls past the row, in order of time.
    ///
    /// The motion begins at `start_cycle`, with the encoder at rest and the beams as [`Machine::beams_before`] says.
    pub fn pin_changes(&self, row: &Row, motion: &Motion, start_cycle: u64) -> Vec<PinChange> {
        let mut changes = self.encoder_changes(&mut 0, 0.0, motion, start_cycle);
        changes.extend(self.beam_changes(row, motion, start_cycle));
        changes.sort_by_key(|change| change.cycle);
        changes
    }

    /// Quadrature: forward is AB = 00, 10, 11, 01, 00, a count an edge. The changes in the pieces of the motion that
    /// begin at a time or later. `ticks` is the count of a clean encoder before them, and is updated to the count after
    /// them.
    pub(crate) fn encoder_changes(
        &self,
        ticks: &mut i64,
        from_s: f64,
        motion: &Motion,
        start_cycle: u64,
    ) -> Vec<PinChange> {
        motion
            .mark_passings(self.tick_mm(), from_s)
            .into_iter()
            .filter_map(|passing| {
                let before = *ticks;
                *ticks += if passing.forward { 1 } else { -1 };
                let edge = encoder_edge(cycle_at(start_cycle, passing.time_s), before, *ticks);
                let hidden = self.dirt.hides(before.min(*ticks).div_euclid(PULSE_TICKS));
                (edge.pin == wiring::ENCODER_B || !hidden).then_some(edge)
            })
            .collect()
    }

    /// The beams' lines, low while a beam is broken, later than the leaves by the sensor's response: first all changes
    /// of the first beam, then those of the second.
    pub fn beam_changes(&self, row: &Row, motion: &Motion, start_cycle: u64) -> Vec<PinChange> {
        let leaves_mm = self.leaves_mm(row);
        let changes = |(mut beam, leaves_mm): (Sensor, &Vec<Range<f64>>)| {
            beam.changes(leaves_mm, motion, 0.0..f64::INFINITY, start_cycle)
        };
        self.beams(&leaves_mm, motion.start_mm(), 0).into_iter().zip(&leaves_mm).flat_map(changes).collect()
    }
}

/// The sensor of a beam: it reports each change with a delay, its response.
#[derive(Clone, Debug)]
pub(crate) struct Sensor {
    /// Its pin, with the level that it has reported last.
    pub last: PinChange,
    /// How far it stands behind the first.
    pub behind_mm: f64,
    response_s: f64,
    /// Time of a change that is not reported yet.
    changed_s: Option<f64>,
}

impl Sensor {
    /// The reported changes during a time, while the pieces of the motion that begin in this time roll past these
    /// leaves.
    pub(crate) fn changes(
        &mut self,
        leaves_mm: &[Range<f64>],
        motion: &Motion,
        during_s: Range<f64>,
        start_cycle: u64,
    ) -> Vec<PinChange> {
        // Each end of a leaf that is passed changes the beam, forward or back.
        let mut changes_s: Vec<f64> = leaves_mm
            .iter()
            .flat_map(|leaf| [leaf.start, leaf.end])
            .flat_map(|end_mm| motion.passings_since(end_mm + self.behind_mm, during_s.start))
            .map(|passing| passing.time_s)
            .collect();
        changes_s.sort_by(f64::total_cmp);
        let mut reports = Vec::with_capacity(changes_s.len() + 1);
        let mut report = |last: &mut PinChange, time_s: f64| {
            *last = PinChange { cycle: cycle_at(start_cycle, time_s), pin: last.pin, high: !last.high };
            reports.push(*last);
        };
        for time_s in changes_s {
            match self.changed_s.take() {
                // This change cancels one that was not reported yet.
                Some(changed_s) if time_s - changed_s < self.response_s => continue,
                Some(changed_s) => report(&mut self.last, changed_s + self.response_s),
                None => {}
            }
            self.changed_s = Some(time_s);
        }
        let due_s = self.changed_s.map(|changed_s| changed_s + self.response_s);
        if let Some(due_s) = due_s.filter(|&due_s| due_s <= during_s.end) {
            self.changed_s = None;
            report(&mut self.last, due_s);
        }
        reports
    }
}

/// Levels of the channels A and B at a count, in the four phases of forward motion.
pub fn channels(ticks: i64) -> (bool, bool) {
    let phase = ticks.rem_euclid(PULSE_TICKS);
    (matches!(phase, 1 | 2), matches!(phase, 2 | 3))
}

/// The edge of a clean encoder from one count to the next, or to the one before.
pub fn encoder_edge(cycle: u64, from_ticks: i64, to_ticks: i64) -> PinChange {
    let ((before, _), (a, b)) = (channels(from_ticks), channels(to_ticks));
    let (pin, high) = if a == before { (wiring::ENCODER_B, b) } else { (wiring::ENCODER_A, a) };
    PinChange { cycle, pin, high }
}

/// The firmware's count before the first of these pin changes, which is 0, and after each. `first_levels` are the levels
/// before.
pub fn counts(first_levels: &[PinChange], changes: &[PinChange]) -> Vec<i64> {
    let after = |levels: Channels, change: &PinChange| {
        let bit = match change.pin {
            wiring::ENCODER_A => 0b10,
            wiring::ENCODER_B => 0b01,
            _ => 0,
        };
        if change.high { levels | bit } else { levels & !bit }
    };
    let mut levels = first_levels.iter().fold(0, after);
    let (mut decoder, mut count) = (Quadrature::new(levels), 0);
    let counted = changes.iter().map(|change| {
        levels = after(levels, change);
        count += if let Step::Ticks(ticks) = decoder.step(levels) { i64::from(ticks) } else { 0 };
        count
    });
    [0].into_iter().chain(counted).collect()
}

/// The cycle of the Uno's clock at a motion's time.
pub fn cycle_at(start_cycle: u64, time_s: f64) -> u64 {
    start_cycle.saturating_add_signed((time_s * CYCLES_PER_SECOND as f64).round() as i64)
}

/// A motion's time at a cycle of the Uno's clock.
pub fn time_at_s(start_cycle: u64, cycle: u64) -> f64 {
    (cycle as f64 - start_cycle as f64) / CYCLES_PER_SECOND as f64
}

#[cfg(test)]
pub(crate) mod tests {
    use super::*;
    use crate::motion::mm_s;
    use crate::row::Canopy;

    const START_CYCLE: u64 = 1_000_000;

    /// The count of an encoder with dirt on its disc, calculated from the start of the motion.
    pub(crate) fn count_at(machine: &Machine, motion: &Motion, time_s: f64) -> i64 {
        let ticks = machine.ticks(motion, time_s);
        let pulse = machine.pulse(ticks);
        let hidden = |pulses: Range<i64>| pulses.filter(|&pulse| machine.dirt.hides(pulse)).count() as i64;
        let in_pulse = if machine.dirt.hides(pulse) { machine.hidden_in_pulse(ticks) } else { 0 };
        ticks - PULSE_TICKS * (hidden(0..pulse) - hidden(pulse..0)) - in_pulse
    }

    /// Counts of a decoder that takes each pair of levels as they come.
    fn decode(changes: &[PinChange]) -> i64 {
        const FORWARD: [(bool, bool); 4] = [(false, false), (true, false), (true, true), (false, true)];
        let phase = |levels| FORWARD.iter().position(|&pair| pair == levels).unwrap();
        let (mut levels, mut count) = ((false, false), 0);
        for change in changes {
            let before = phase(levels);
            match change.pin {
                wiring::ENCODER_A => levels.0 = change.high,
                wiring::ENCODER_B => levels.1 = change.high,
                _ => continue,
            }
            count += match (phase(levels) + 4 - before) % 4 {
                0 => 0,
                1 => 1,
                3 => -1,
                _ => panic!("both channels changed at once"),
            };
        }
        count
    }

    fn of_pin(changes: &[PinChange], pin: Pin) -> Vec<PinChange> {
        changes.iter().copied().filter(|change| change.pin == pin).collect()
    }

    fn row() -> Row {
        Row::new(vec![Canopy::plant(500.0, 150.0), Canopy::weed(800.0, 15.0)]).unwrap()
    }

    #[test]
    fn hidden_pulses_are_missing_from_the_pins_and_from_the_count() {
        let machine = Machine { dirt: Dirt { share: 0.05, seed: 3 }, ..Machine::default() };
        let motion = Motion::steady(0.0, 1000.0, 500.0, 1000.0).change_speed(0.0, 1000.0);
        let changes = machine.encoder_changes(&mut 0, 0.0, &motion, START_CYCLE);
        let end_s = motion.duration_s();
        let missing = machine.ticks(&motion, end_s) - count_at(&machine, &motion, end_s);
        assert!((60..160).contains(&missing), "{missing}");
        assert_eq!(decode(&changes), count_at(&machine, &motion, end_s));
        // Also half way, at any phase of a pulse.
        for passing in motion.mark_passings(machine.tick_mm(), 0.0).iter().skip(600).take(200) {
            let so_far = changes.iter().filter(|change| change.cycle <= cycle_at(START_CYCLE, passing.time_s));
            let count = count_at(&machine, &motion, passing.time_s + 1e-7);
            assert_eq!(decode(&so_far.copied().collect::<Vec<_>>()), count);
        }
    }

    #[test]
    fn a_metre_is_1910_counts_and_rolling_back_counts_down() {
        let there = Motion::steady(0.0, 1000.0, mm_s(2.5), 1000.0);
        let back = Motion::steady(0.0, 1000.0, 500.0, 600.0)
            .stop_at(800.0, 1000.0)
            .change_speed(-500.0, 1000.0)
            .roll_to(-1000.0);
        let machine = Machine::default();
        for (motion, counts) in [(there, 1910), (back, -1910)] {
            assert_eq!(decode(&machine.pin_changes(&row(), &motion, START_CYCLE)), counts);
            assert_eq!(machine.ticks(&motion, motion.duration_s()), counts);
        }
    }

    #[test]
    fn each_beam_reports_each_plant_and_weed_at_its_edges_a_millisecond_late() {
        let machine = Machine { second_beam_mm: 220.0, ..Machine::default() };
        let motion = Motion::steady(0.0, 1000.0, mm_s(2.0), 1300.0).with_slip(|| 0.2);
        assert!(machine.beams_before(&row(), &motion)[1].high);
        let changes = machine.pin_changes(&row(), &motion, START_CYCLE);
        for (pin, behind_mm) in [(wiring::BEAM, 0.0), (wiring::SECOND_BEAM, 220.0)] {
            let beam = of_pin(&changes, pin);
            assert_eq!(beam.iter().map(|change| change.high).collect::<Vec<_>>(), [false, true, false, true]);
            for (change, place_mm) in beam.iter().zip([425.0, 575.0, 792.5, 807.5]) {
                let time_s = time_at_s(START_CYCLE, change.cycle) - 0.001;
                let seen_mm = motion.position_mm(time_s) - behind_mm;
                assert!((seen_mm - place_mm).abs() < 0.001, "{pin:?} at {place_mm} mm");
            }
        }
        assert_eq!(Machine::default().beams_before(&row(), &motion).len(), 1);
    }

    #[test]
    fn a_beam_that_is_broken_at_the_start_is_low_from_power_up_on() {
        let motion = Motion::steady(500.0, 1000.0, mm_s(2.0), 700.0);
        let machine = Machine::default();
        let beam = of_pin(&machine.pin_changes(&row(), &motion, START_CYCLE), wiring::BEAM);
        assert!(!machine.beams_before(&row(), &motion)[0].high);
        assert!(beam.len() == 1 && beam[0].high);
    }

    #[test]
    fn a_gap_shorter_than_the_sensors_response_is_not_seen() {
        let mut plant = Canopy::plant(500.0, 150.0);
        // At 1 km/h a millisecond is 0.28 mm.
        plant.leaves = vec![425.0..470.0, 470.2..520.0, 521.0..575.0];
        let row = Row::new(vec![plant]).unwrap();
        let motion = Motion::steady(0.0, 1000.0, mm_s(1.0), 1000.0);
        let beam = of_pin(&Machine::default().pin_changes(&row, &motion, START_CYCLE), wiring::BEAM);
        assert_eq!(beam.len(), 4, "the plant and one gap of two");
    }

    #[test]
    fn the_tool_leaves_the_row_s_line_early_in_its_stroke() {
        assert!((Machine::default().line_degrees() - 4.506).abs() < 0.001);
    }
}
