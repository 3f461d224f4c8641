//! The servo that swings the tool: from the pulses on its line to its angle at any time.
//!
//! A servo measures a pulse's width at the pulse's falling edge. Then it waits a dead time (electronics, gears, slack),
//! and turns at a constant rate to the commanded angle. A command during a stroke takes the same dead time. The servo
//! then turns from its current angle. Widths between the two ends command angles between them.
//!
//! A degree is always the same pulse width: a shorter stroke has a shorter pulse, and takes less time in proportion.
//! The soil slows the servo down by its torque-speed line: full speed without load, none at the stall torque.
//!
//! Widths out of range are ignored. There is no overshoot and no acceleration: dead time and travel time stand for
//! them. If dead time and load scatter, each command has its own random values.

use crate::chance::scatter;
use crate::ground::{interpolated, spans_where};
use rand::{RngExt, SeedableRng};
use rand_chacha::ChaCha8Rng;
use std::ops::{Range, RangeInclusive};
use uno::{CYCLES_PER_SECOND, Pulse};

/// A hobby servo and how it is set up.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct Servo {
    /// Pulse width for the tool in the row, at 0 degrees.
    pub in_us: f64,
    /// Pulse width for the tool out of the row: it differs from `in_us` by [`US_A_DEGREE`] for each degree.
    pub out_us: f64,
    /// Time from a pulse's falling edge until the servo moves.
    pub dead_time_ms: f64,
    /// Time in which it then turns by [`OUT_DEGREES`] without load.
    pub travel_ms: f64,
    /// The scatter of dead time and travel.
    pub scatter: Scatter,
}

/// How much the swings of a servo differ from each other.
#[derive(Clone, Copy, Debug, Default, PartialEq)]
pub struct Scatter {
    /// The dead time lies within this of its mean, evenly spread, and is at least 0.
    pub dead_time_ms: f64,
    /// The soil's load, as a share of the stall torque, lies between 0 and this, evenly distributed.
    pub load: f64,
    /// Selects the random sequence of swings.
    pub seed: u64,
}

/// Angle of the tool that is fully out of the row, as the paper has it.
pub const OUT_DEGREES: f64 = 45.0;

/// Pulse width for a degree: 1500 us and 2000 us are the two ends of the paper's stroke.
pub const US_A_DEGREE: f64 = 500.0 / OUT_DEGREES;

/// Under the highest load the servo still turns at a twentieth of its speed.
const GREATEST_LOAD: f64 = 0.95;

/// The factor on the travel time under a load, which is a share of the stall torque.
pub fn slowed(load: f64) -> f64 {
    1.0 / (1.0 - load.clamp(0.0, GREATEST_LOAD))
}

/// Pulse widths that differ by less than this ask for the same angle: the dead band of a digital servo.
const DEAD_BAND_US: f64 = 2.0;

/// Pulse widths that a servo accepts as a command. It ignores all other pulses on its line, and so does this model.
pub const WIDTHS_US: RangeInclusive<f64> = 400.0..=2600.0;

/// A change of the angle asked for.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct Command {
    /// When the first pulse of this width began, in cycles since power-up: the command at the pin.
    pub rise_cycle: u64,
    /// When that pulse ended: the servo knows its width.
    pub fall_cycle: u64,
    /// The angle asked for; 0 is in the row.
    pub degrees: f64,
    /// Whether it asks for the tool to leave the row: by more than half of the stroke.
    pub is_out: bool,
}

impl Default for Servo {
    /// A 60 kg cm hobby servo unloaded: 60 ms of dead time, 120 ms for 45 degrees.
    fn default() -> Self {
        Self { in_us: 1500.0, out_us: 2000.0, dead_time_ms: 60.0, travel_ms: 120.0, scatter: Scatter::default() }
    }
}

impl Servo {
    /// The whole stroke: the angle of a tool that is commanded out of the row.
    pub fn stroke_degrees(&self) -> f64 {
        (self.out_us - self.in_us).abs() / US_A_DEGREE
    }

    /// The longest time of the whole stroke, dead time included.
    pub fn slowest_s(&self) -> f64 {
        let Scatter { dead_time_ms, load, .. } = self.scatter;
        let travel_ms = self.travel_ms * self.stroke_degrees() / OUT_DEGREES * slowed(load);
        (self.dead_time_ms + dead_time_ms + travel_ms) / 1000.0
    }

    /// The angle that a pulse commands. The pulse for out defines the positive direction.
    fn degrees(&self, pulse: Pulse) -> f64 {
        let outwards = if self.out_us < self.in_us { -1.0 } else { 1.0 };
        (pulse.width_us() - self.in_us) * outwards / US_A_DEGREE
    }

    /// The pulses that commanded another angle than the one before them. The first pulse is the first command. Pulses
    /// outside of [`WIDTHS_US`] are ignored.
    pub fn commands(&self, pulses: &[Pulse]) -> Vec<Command> {
        let mut commands = Vec::new();
        let mut width_us = f64::NEG_INFINITY;
        for &pulse in pulses.iter().filter(|pulse| WIDTHS_US.contains(&pulse.width_us())) {
            if (pulse.width_us() - width_us).abs() >= DEAD_BAND_US {
                width_us = pulse.width_us();
                let degrees = self.degrees(pulse);
                let is_out = degrees > self.stroke_degrees() / 2.0;
                commands.push(Command { rise_cycle: pulse.rise, fall_cycle: pulse.fall, degrees, is_out });
            }
        }
        commands
    }

    /// The servo's movement under these commands. Before the first it rests at the angle of the first command: the
    /// firmware starts with the tool out, and so does the machine.
    ///
    /// `start_cycle` is the cycle at which the movement's time is 0.
    pub fn stroke(&self, commands: &[Command], start_cycle: u64) -> Stroke {
        let Scatter { dead_time_ms, load, seed } = self.scatter;
        let mut rng = ChaCha8Rng::seed_from_u64(seed);
        let rest_degrees = commands.first().map_or_else(|| self.stroke_degrees(), |command| command.degrees);
        let mut corners: Vec<(f64, f64)> = Vec::new();
        for (index, command) in commands.iter().enumerate() {
            let heard_s = (command.fall_cycle as f64 - start_cycle as f64) / CYCLES_PER_SECOND as f64;
            let late_ms = scatter(&mut rng, dead_time_ms);
            let travel_ms = self.travel_ms * slowed(rng.random_range(0.0..=1.0) * load);
            let begin_s = heard_s + (self.dead_time_ms + late_ms).max(0.0) / 1000.0;
            let begin_degrees = interpolated(&corners, begin_s).unwrap_or(rest_degrees);
            // The new command cancels the corners after this time.
            corners.retain(|(time_s, _)| *time_s < begin_s);
            corners.push((begin_s, begin_degrees));
            if index > 0 {
                let travel_s = (command.degrees - begin_degrees).abs() / OUT_DEGREES * travel_ms / 1000.0;
                corners.push((begin_s + travel_s, command.degrees));
            }
        }
        Stroke { corners, rest_degrees }
    }
}

/// The tool's angle over time.
#[derive(Clone, Debug, PartialEq)]
pub struct Stroke {
    /// The times at which the servo begins or ends to turn, and the angles there. It turns at a constant rate between.
    corners: Vec<(f64, f64)>,
    /// The angle of a servo without a command.
    rest_degrees: f64,
}

impl Stroke {
    /// The angle at a time in seconds; 0 is in the row.
    pub fn degrees(&self, time_s: f64) -> f64 {
        interpolated(&self.corners, time_s).unwrap_or(self.rest_degrees)
    }

    /// The times at which the servo begins or ends to turn. Between them the angle is a straight line.
    pub fn turns_s(&self) -> impl Iterator<Item = f64> {
        self.corners.iter().map(|(time_s, _)| *time_s)
    }

    /// The times within `during_s` at which the angle is below `degrees`.
    pub fn times_below_s(&self, degrees: f64, during_s: &Range<f64>) -> Vec<Range<f64>> {
        let crossings = self.corners.windows(2).filter_map(|pair| {
            let ((from_s, from), (to_s, to)) = (pair[0], pair[1]);
            let share = (degrees - from) / (to - from);
            ((from < degrees) != (to < degrees)).then_some(from_s + (to_s - from_s) * share)
        });
        let times = crossings.filter(|time_s| during_s.contains(time_s)).chain([during_s.start, during_s.end]);
        spans_where(times.collect(), |time_s| self.degrees(time_s) < degrees)
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    /// Frames of 20 ms whose width changes at the given frames.
    fn frames(widths_us: &[(u64, u64)]) -> Vec<Pulse> {
        let cycles_per_us = CYCLES_PER_SECOND / 1_000_000;
        widths_us
            .iter()
            .flat_map(|&(count, width_us)| (0..count).map(move |_| width_us))
            .enumerate()
            .map(|(frame, width_us)| {
                let rise = frame as u64 * 20_000 * cycles_per_us;
                Pulse { rise, fall: rise + width_us * cycles_per_us }
            })
            .collect()
    }

    fn stroke(widths_us: &[(u64, u64)]) -> Stroke {
        let servo = Servo::default();
        servo.stroke(&servo.commands(&frames(widths_us)), 0)
    }

    #[track_caller]
    fn assert_degrees(stroke: &Stroke, time_s: f64, degrees: f64) {
        let is = stroke.degrees(time_s);
        assert!((is - degrees).abs() < 1e-6, "{is} degrees at {time_s} s");
    }

    #[test]
    fn the_servo_waits_its_dead_time_and_then_turns_evenly() {
        // The tenth frame, at 0.2 s, is the first that asks for the row; its pulse lasts 1.5 ms.
        let stroke = stroke(&[(10, 2000), (40, 1500)]);
        assert_degrees(&stroke, -1.0, 45.0);
        assert_degrees(&stroke, 0.2615, 45.0);
        assert_degrees(&stroke, 0.3215, 22.5);
        assert_degrees(&stroke, 0.3815, 0.0);
        assert_degrees(&stroke, 9.0, 0.0);
    }

    #[test]
    fn no_servo_moves_before_its_pulse_has_ended() {
        for seed in 0..20 {
            let scatter = Scatter { dead_time_ms: 200.0, load: 0.0, seed };
            let servo = Servo { dead_time_ms: 5.0, scatter, ..Servo::default() };
            let stroke = servo.stroke(&servo.commands(&frames(&[(10, 2000), (40, 1500)])), 0);
            assert_degrees(&stroke, 0.2015, 45.0);
        }
    }

    #[test]
    fn a_command_during_a_stroke_turns_it_round_where_it_is() {
        // In at 0.2 s (begins at 0.2615), out again at 0.26 s (begins at 0.322 s, when 22.3 degrees are left).
        let stroke = stroke(&[(10, 2000), (3, 1500), (20, 2000)]);
        let turn_degrees = 45.0 - (0.322 - 0.2615) * 375.0;
        assert_degrees(&stroke, 0.322, turn_degrees);
        assert_degrees(&stroke, 0.332, turn_degrees + 3.75);
        assert_degrees(&stroke, 0.322 + (45.0 - turn_degrees) / 375.0, 45.0);
    }

    #[test]
    fn only_a_changed_width_of_a_servo_is_a_command() {
        let frames = frames(&[(5, 2000), (1, 3), (1, 19_900), (5, 1500), (5, 2000)]);
        let commands = Servo::default().commands(&frames);
        let degrees: Vec<f64> = commands.iter().map(|command| command.degrees).collect();
        assert_eq!(degrees, [45.0, 0.0, 45.0]);
        assert_eq!(commands[1].rise_cycle, 7 * 320_000);
    }

    #[test]
    fn a_width_between_the_ends_asks_for_an_angle_between_them() {
        assert_degrees(&stroke(&[(5, 1500), (20, 1750)]), 1.0, 22.5);
    }

    #[test]
    fn a_shorter_stroke_is_a_shorter_pulse_and_a_shorter_travel() {
        let servo = Servo { out_us: 1750.0, ..Servo::default() };
        assert_eq!(servo.stroke_degrees(), 22.5);
        let commands = servo.commands(&frames(&[(10, 1500), (20, 1750)]));
        assert!(!commands[0].is_out && commands[1].is_out);
        let stroke = servo.stroke(&commands, 0);
        // The tenth frame's pulse ends at 201.75 ms; behind 60 ms of dead time 60 ms of travel, not 120.
        assert_degrees(&stroke, 0.2917, 11.25 - 0.05 * 0.375);
        assert_degrees(&stroke, 0.3218, 22.5);
        let mirrored = Servo { in_us: 1500.0, out_us: 1000.0, ..Servo::default() };
        assert_eq!(mirrored.commands(&frames(&[(5, 1000)]))[0].degrees, 45.0);
    }

    #[test]
    fn the_soil_slows_the_servo_down_by_its_torque_speed_line() {
        // The paper's 39.4 of 60 kg cm leave a third of the speed.
        assert!((slowed(39.4 / 60.0) - 2.913).abs() < 0.001);
        assert_eq!((slowed(0.0), slowed(2.0).round()), (1.0, 20.0));
        let loaded = Servo { scatter: Scatter { load: 0.5, ..Scatter::default() }, ..Servo::default() };
        assert!((loaded.slowest_s() - 0.3).abs() < 1e-9);
    }

    #[test]
    fn the_times_below_an_angle_begin_and_end_where_it_is_crossed() {
        let stroke = stroke(&[(10, 2000), (20, 1500), (20, 2000)]);
        let times = stroke.times_below_s(22.5, &(0.0..2.0));
        assert_eq!(times.len(), 1);
        assert_degrees(&stroke, times[0].start, 22.5);
        assert_degrees(&stroke, times[0].end, 22.5);
        assert!(times[0].start < times[0].end);
    }

    #[test]
    fn a_tool_that_is_never_commanded_stays_out() {
        let stroke = Servo::default().stroke(&[], 0);
        assert_degrees(&stroke, 1.0, 45.0);
        assert!(stroke.times_below_s(44.0, &(0.0..5.0)).is_empty());
    }
}
