//! A machine that rolls without an end, past a row that grows ahead of it.
//!
//! [`Machine::pin_changes`] needs a whole motion. Here the motion is decided step by step. [`Rolling::roll_until`]
//! returns the pin changes until a cycle of the Uno's clock, by the same calculation. Between two calls speed, slip,
//! row and faults may change, and the servo receives the Uno's pulses ([`Rolling::hear`]).

use crate::ground::union;
use crate::machine::{Machine, Sensor, channels, cycle_at, time_at_s};
use crate::motion::Motion;
use crate::row::Canopy;
use crate::servo::Stroke;
use crate::sight::half_covered;
use crate::wiring;
use std::ops::Range;
use uno::{Pin, PinChange, Pulse};

/// How fast the machine gains and loses speed.
const ACCELERATION_MM_S2: f64 = 500.0;

/// The faults of the machine.
#[derive(Clone, Copy, Debug, Default, PartialEq, Eq)]
pub struct Faults {
    /// The first beam's wire is torn: its pin stays on the pull-up, as over bare ground.
    pub beam_wire_torn: bool,
    /// The encoder has failed: its pins keep their levels.
    pub encoder_dead: bool,
}

/// A rolling machine: see the module. Its position is the ground at the first beam.
#[derive(Clone, Debug)]
pub struct Rolling {
    /// The machine.
    pub machine: Machine,
    /// The row so far, in ascending order and without overlaps. Canopies may be added at its end.
    pub row: Vec<Canopy>,
    /// Changes of the tool's command so far. The first is not a swing.
    pub commands: usize,
    /// The motion that is decided so far. It ends now.
    motion: Motion,
    /// The cycle at which the motion began.
    start_cycle: u64,
    /// The speed that the machine keeps or changes to, negative backwards.
    pub target_mm_s: f64,
    /// Net counts of a clean encoder since the beginning.
    pub ticks: i64,
    beams: Vec<Sensor>,
    /// The pulses that changed the tool's command.
    pulses: Vec<Pulse>,
    stroke: Stroke,
    /// The faults from now on. [`levels`](Self::levels) returns the changed pins.
    pub faults: Faults,
}

impl Rolling {
    /// A standing machine before or in a row.
    pub fn new(machine: Machine, row: Vec<Canopy>, start_mm: f64, start_cycle: u64) -> Self {
        let leaves_mm = half_covered(union(row.iter().flat_map(Canopy::blocks_mm).collect()), machine.beam_mm);
        Self {
            beams: machine.beams(&[leaves_mm.clone(), leaves_mm], start_mm, start_cycle),
            row,
            commands: 0,
            motion: Motion::starting_at(start_mm),
            start_cycle,
            target_mm_s: 0.0,
            ticks: 0,
            pulses: Vec::new(),
            stroke: machine.servo.stroke(&[], start_cycle),
            faults: Faults::default(),
            machine,
        }
    }

    /// Rolls on until a cycle, not before that of the last call, and returns the pin changes until then.
    pub fn roll_until(&mut self, cycle: u64) -> Vec<PinChange> {
        let during_s = self.now_s()..time_at_s(self.start_cycle, cycle);
        let target_mm_s = self.target_mm_s;
        self.change(|motion| motion.change_speed(target_mm_s, ACCELERATION_MM_S2).until(during_s.end));
        let Self { machine, motion, start_cycle, ticks, faults, .. } = self;
        let mut changes = machine.encoder_changes(ticks, during_s.start, motion, *start_cycle);
        if faults.encoder_dead {
            changes.clear();
        }
        let rolled_mm = motion.stretch_mm(&during_s);
        for beam in &mut self.beams {
            let near_mm =
                rolled_mm.start - beam.behind_mm - machine.beam_mm..rolled_mm.end - beam.behind_mm + machine.beam_mm;
            let leaves_mm = union(within(&self.row, &near_mm).flat_map(Canopy::blocks_mm).collect());
            let leaves_mm = half_covered(leaves_mm, machine.beam_mm);
            let reports = beam.changes(&leaves_mm, motion, during_s.clone(), *start_cycle);
            if !(faults.beam_wire_torn && beam.last.pin == wiring::BEAM) {
                changes.extend(reports);
            }
        }
        self.motion.join();
        changes.sort_by_key(|change| change.cycle);
        changes
    }

    /// From now on the wheel loses this share of its distance, below 1.
    pub fn slip_by(&mut self, share: f64) {
        self.change(|motion| motion.slipping(share));
    }

    /// The level of each pin that the machine drives. A dead encoder drives none.
    pub fn levels(&self) -> Vec<(Pin, bool)> {
        let (a, b) = channels(self.ticks);
        let encoder = [(wiring::ENCODER_A, a), (wiring::ENCODER_B, b)];
        let torn = |pin: Pin| self.faults.beam_wire_torn && pin == wiring::BEAM;
        let beams = self.beams.iter().map(|beam| (beam.last.pin, beam.last.high || torn(beam.last.pin)));
        encoder.into_iter().filter(|_| !self.faults.encoder_dead).chain(beams).collect()
    }

    /// Passes a pulse to the servo, after its falling edge. Returns whether it asks for another angle than before.
    pub fn hear(&mut self, pulse: Pulse) -> bool {
        let last = self.pulses.last().copied();
        let servo = &self.machine.servo;
        let heard: Vec<Pulse> = last.into_iter().chain([pulse]).collect();
        let is_command = servo.commands(&heard).len() > usize::from(last.is_some());
        if is_command {
            self.pulses.push(pulse);
            self.commands += 1;
            self.stroke = servo.stroke(&servo.commands(&self.pulses), self.start_cycle);
        }
        is_command
    }

    /// Now, as a time of the motion.
    fn now_s(&self) -> f64 {
        self.motion.duration_s()
    }

    /// The ground that the first beam sees now.
    pub fn place_mm(&self) -> f64 {
        self.motion.end_mm()
    }

    /// The ground under the tool now.
    pub fn tool_mm(&self) -> f64 {
        self.machine.tool_mm(self.place_mm())
    }

    /// The speed now, negative backwards.
    pub fn speed_mm_s(&self) -> f64 {
        self.motion.end_speed_mm_s()
    }

    /// The tool's angle now; 0 is in the row.
    pub fn degrees(&self) -> f64 {
        self.stroke.degrees(self.now_s())
    }

    /// Distance of the machine for one count of the encoder, now.
    pub fn ground_mm_a_tick(&self) -> f64 {
        self.machine.tick_mm() * self.motion.ground_mm_a_wheel_mm()
    }

    /// Whether something stands in the first beam now.
    pub fn is_beam_broken(&self) -> bool {
        let place_mm = self.place_mm();
        within(&self.row, &(place_mm..place_mm))
            .any(|canopy| canopy.blocks_mm().iter().any(|leaf| leaf.contains(&place_mm)))
    }

    /// The motion from a time on, the pulses that the servo took as commands, and the cycle at which it begins.
    pub fn since(&self, time_s: f64) -> (Motion, &[Pulse], u64) {
        (self.motion.since(time_s), &self.pulses, cycle_at(self.start_cycle, time_s))
    }

    /// The first time, from a time on, at which the machine passes a position forward.
    pub fn passed_s(&self, place_mm: f64, from_s: f64) -> Option<f64> {
        let mut passings = self.motion.passings(place_mm);
        passings.find(|passing| passing.forward && passing.time_s >= from_s).map(|passing| passing.time_s)
    }

    /// Forgets the motion before a time, and the commands that were completed by then.
    pub fn forget(&mut self, time_s: f64) {
        self.motion.forget(time_s);
        let is_over = |pulse: &Pulse| time_at_s(self.start_cycle, pulse.fall) + self.machine.servo.slowest_s() < time_s;
        // The last of them is kept: it is the tool's current angle.
        let over = self.pulses.partition_point(is_over).saturating_sub(1);
        self.pulses.drain(..over);
    }

    fn change(&mut self, change: impl FnOnce(Motion) -> Motion) {
        self.motion = change(std::mem::replace(&mut self.motion, Motion::starting_at(0.0)));
    }
}

fn within<'a>(row: &'a [Canopy], ground_mm: &Range<f64>) -> impl Iterator<Item = &'a Canopy> {
    let first = row.partition_point(|canopy| canopy.span_mm().end < ground_mm.start);
    let behind = row.partition_point(|canopy| canopy.span_mm().start <= ground_mm.end);
    row.get(first..behind).unwrap_or_default().iter()
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::row::Row;
    use proptest::prelude::*;

    const START_CYCLE: u64 = 1_000_000;

    /// The changes during the motion: from a time on, a speed and a slip.
    fn way() -> impl Strategy<Value = Vec<(f64, f64, f64)>> {
        prop::collection::vec((0.05..1.5, -500.0..1200.0, -0.05..0.2), 1..6)
    }

    proptest! {
        #[test]
        fn rolling_piece_by_piece_equals_the_whole_motion(way in way(), slice_cycles in 1_000_u64..400_000) {
            let row = vec![Canopy::plant(300.0, 150.0), Canopy::weed(500.0, 14.0), Canopy::plant(800.0, 120.0)];
            let machine = Machine { second_beam_mm: 220.0, beam_mm: 6.0, ..Machine::default() };
            let mut rolling = Rolling::new(machine, row.clone(), 0.0, START_CYCLE);
            let mut changes = Vec::new();
            let mut motion = Motion::starting_at(0.0);
            let (mut cycle, mut from_s) = (START_CYCLE, 0.0);
            for (for_s, speed_mm_s, slip) in way {
                rolling.target_mm_s = speed_mm_s;
                rolling.slip_by(slip);
                let end = cycle_at(START_CYCLE, from_s + for_s);
                from_s = time_at_s(START_CYCLE, end);
                motion = motion.slipping(slip).change_speed(speed_mm_s, ACCELERATION_MM_S2).until(from_s);
                while cycle < end {
                    cycle = end.min(cycle + slice_cycles);
                    changes.extend(rolling.roll_until(cycle));
                }
            }
            // The sensor reports its pending changes later.
            let whole = machine.pin_changes(&Row::new(row).unwrap(), &motion, START_CYCLE);
            let whole: Vec<PinChange> = whole.into_iter().filter(|change| change.cycle <= cycle).collect();
            prop_assert_eq!(changes.len(), whole.len());
            for (change, expected) in changes.iter().zip(&whole) {
                prop_assert_eq!((change.pin, change.high), (expected.pin, expected.high));
                prop_assert!(change.cycle.abs_diff(expected.cycle) <= 1, "{change:?}, not {expected:?}");
            }
            prop_assert!((rolling.place_mm() - motion.end_mm()).abs() < 1e-6);
        }
    }

    #[test]
    fn a_fault_shows_at_the_pins_until_it_is_mended() {
        let mut rolling = Rolling::new(Machine::default(), vec![Canopy::plant(300.0, 150.0)], 0.0, 0);
        rolling.target_mm_s = 500.0;
        rolling.roll_until(16_000_000);
        assert!(rolling.is_beam_broken() && rolling.levels().contains(&(wiring::BEAM, false)));
        rolling.faults = Faults { beam_wire_torn: true, encoder_dead: true };
        assert_eq!(rolling.levels(), [(wiring::BEAM, true)]);
        assert_eq!(rolling.roll_until(32_000_000), []);
        rolling.faults = Faults::default();
        assert_eq!(rolling.levels().len(), 3);
        assert!(!rolling.is_beam_broken() && rolling.levels().contains(&(wiring::BEAM, true)));
        assert!(!rolling.roll_until(33_000_000).is_empty());
    }

    #[test]
    fn the_servo_takes_changes_and_past_motion_is_dropped() {
        let mut rolling = Rolling::new(Machine::default(), Vec::new(), 0.0, 0);
        rolling.target_mm_s = 500.0;
        for frame in 0..200_u64 {
            let (rise, width_us) = (frame * 320_000, if frame / 50 % 2 == 0 { 2000 } else { 1500 });
            rolling.roll_until(rise);
            let is_command = rolling.hear(Pulse { rise, fall: rise + width_us * 16 });
            assert_eq!(is_command, frame % 50 == 0, "frame {frame}");
        }
        assert_eq!((rolling.commands, rolling.degrees()), (4, 0.0));
        let time_s = rolling.passed_s(1500.0, 0.0).unwrap();
        rolling.forget(time_s);
        let (motion, pulses, _) = rolling.since(time_s);
        assert_eq!(pulses.len(), 1);
        assert!((motion.start_mm() - 1500.0).abs() < 1e-9 && (motion.end_mm() - rolling.place_mm()).abs() < 1e-9);
    }
}
