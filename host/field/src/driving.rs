//! A driver's motion along a row: speed varies, the machine stops, the wheel slips, and the machine strays from the
//! line.
//!
//! The row begins after a run-up, in which the machine accelerates and the tool enters the ground. It ends when the
//! tool has passed it. A turn at the headland takes a distance at working speed, and some extra time. It is a number,
//! not a motion.
//!
//! The deviation across the row's line follows straight lines between random values at positions a metre or two apart.
//! The machine strays as a whole, tool and sweeps together, without an angle to the row. It does not change what the
//! beam sees.

use crate::chance::scatter;
use crate::conditions::Conditions;
use crate::ground::interpolated;
use crate::motion::{Motion, mm_s, run_up_mm};
use rand::{Rng, RngExt};
use std::ops::Range;

/// How fast the machine gains speed, and how fast it brakes.
const ACCELERATION_MM_S2: f64 = 500.0;
const BRAKING_MM_S2: f64 = 1000.0;

/// Distance between two corrections of the steering, and of constant speed and slip, without the distance for changing
/// the speed.
pub const LEG_MM: Range<f64> = 1000.0..2000.0;

/// Distance that the tool rolls on behind the row.
const RUN_OUT_MM: f64 = 300.0;

/// Scatter of a stop's time, as a share of its mean.
const STOP_SCATTER: f64 = 0.5;

/// A row, driven.
#[derive(Clone, Debug)]
pub struct DrivenRow {
    /// The machine's motion: its position is the ground below the beam.
    pub motion: Motion,
    /// How long the tool takes for the row, stops included.
    pub row_s: f64,
    /// How long the turn behind it takes.
    pub turn_s: f64,
    /// The machine's position across the row.
    pub steering: Steering,
}

/// The drive along a row at a mean speed.
pub fn drive(conditions: &Conditions, span_mm: &Range<f64>, speed_km_h: f64, rng: &mut impl Rng) -> DrivenRow {
    let Conditions { ground, driving, machine, .. } = conditions;
    let wander = |rng: &mut _| mm_s(speed_km_h) * (1.0 + scatter(rng, driving.speed_scatter_percent / 100.0));
    let fastest_mm_s = mm_s(speed_km_h) * (1.0 + driving.speed_scatter_percent / 100.0);
    // The distance to reach the highest speed and to stop from it.
    let change_mm = fastest_mm_s.powi(2) * (0.5 / ACCELERATION_MM_S2 + 0.5 / BRAKING_MM_S2);
    let speed_mm_s = wander(rng);
    let run_up_mm = run_up_mm(speed_mm_s, ACCELERATION_MM_S2);
    // The machine does not brake before the tool is out of the row.
    let braking_mm = fastest_mm_s.powi(2) * 0.5 / BRAKING_MM_S2;
    let end_mm = span_mm.end + machine.beam_to_tool_mm + RUN_OUT_MM + braking_mm;
    let mut motion = Motion::starting_at(span_mm.start - run_up_mm).change_speed(speed_mm_s, ACCELERATION_MM_S2);
    loop {
        let leg_mm = change_mm + rng.random_range(LEG_MM);
        let stops = rng.random_bool((driving.stops_per_100_m * leg_mm / 1e5).min(1.0));
        let speed_mm_s = wander(rng);
        let leg_end_mm = motion.end_mm() + leg_mm;
        // The last leg ends where the motion does.
        if leg_end_mm + change_mm > end_mm {
            break;
        }
        motion = if stops {
            let stop_s = driving.stop_s * (1.0 + scatter(rng, STOP_SCATTER));
            motion.stop_at(leg_end_mm, BRAKING_MM_S2).go_on_for(stop_s)
        } else {
            motion.roll_to(leg_end_mm)
        };
        motion = motion.change_speed(speed_mm_s, ACCELERATION_MM_S2);
    }
    let slip = |rng: &mut _| (ground.slip_percent + scatter(rng, ground.slip_scatter_percent)) / 100.0;
    let motion = motion.stop_at(end_mm, BRAKING_MM_S2).with_slip(|| slip(rng));
    let passed_s = |place_mm: f64| {
        let mut passings = motion.passings(place_mm + machine.beam_to_tool_mm);
        passings.next().map_or(0.0, |passing| passing.time_s)
    };
    let row_s = passed_s(span_mm.end) - passed_s(span_mm.start);
    let turn_s = driving.turn_m * 1000.0 / mm_s(speed_km_h) + driving.turn_s * (1.0 + scatter(rng, STOP_SCATTER));
    let strays_mm = span_mm.start - RUN_OUT_MM..end_mm;
    let steering = Steering::within(driving.steering_mm, machine.side_play_mm, strays_mm, rng);
    DrivenRow { motion, row_s, turn_s, steering }
}

/// The machine's position across the row, at each position along it, and its tool's.
#[derive(Clone, Debug, Default, PartialEq)]
pub struct Steering {
    machine: Strays,
    /// The tool's play on the machine.
    tool: Strays,
}

/// A deviation to the left, at each position along the row.
#[derive(Clone, Debug, Default, PartialEq)]
struct Strays {
    /// Positions, and the deviation there. Empty without one.
    knots: Vec<(f64, f64)>,
    /// The largest.
    within_mm: f64,
}

/// The tool's play changes over this distance: about from plant to plant.
const PLAY_MM: Range<f64> = 200.0..600.0;

impl Steering {
    /// A machine that strays by up to `within_mm` on this ground. Its tool has up to `play_mm` of play to either side.
    pub(crate) fn within(within_mm: f64, play_mm: f64, ground_mm: Range<f64>, rng: &mut impl Rng) -> Self {
        let machine = Strays::within(within_mm, &ground_mm, LEG_MM, rng);
        Self { machine, tool: Strays::within(play_mm, &ground_mm, PLAY_MM, rng) }
    }

    /// Deviation of the machine's middle from the row's line, when its tool works this ground.
    pub fn across_mm(&self, place_mm: f64) -> f64 {
        self.machine.at_mm(place_mm)
    }

    /// Deviation of the tool from its position on a machine that keeps the row's line.
    pub(crate) fn tool_across_mm(&self, place_mm: f64) -> f64 {
        self.machine.at_mm(place_mm) + self.tool.at_mm(place_mm)
    }

    pub(crate) fn tool_within_mm(&self) -> f64 {
        self.machine.within_mm + self.tool.within_mm
    }
}

impl Strays {
    fn within(within_mm: f64, ground_mm: &Range<f64>, leg_mm: Range<f64>, rng: &mut impl Rng) -> Self {
        if within_mm <= 0.0 {
            return Self::default();
        }
        let mut knots = vec![(ground_mm.start, scatter(rng, within_mm))];
        let mut place_mm = ground_mm.start;
        while place_mm < ground_mm.end {
            place_mm += rng.random_range(leg_mm.clone());
            knots.push((place_mm, scatter(rng, within_mm)));
        }
        Self { knots, within_mm }
    }

    fn at_mm(&self, place_mm: f64) -> f64 {
        interpolated(&self.knots, place_mm).unwrap_or(0.0)
    }
}

#[cfg(test)]
mod tests {
    use super::*;
    use rand::SeedableRng;
    use rand_chacha::ChaCha8Rng;

    fn driven(conditions: &Conditions, speed_km_h: f64) -> DrivenRow {
        drive(conditions, &(0.0..20_000.0), speed_km_h, &mut ChaCha8Rng::seed_from_u64(5))
    }

    #[test]
    fn without_scatter_and_stops_a_row_takes_its_length_over_its_speed() {
        let drive = driven(&Conditions::with("even-stand", &[]), 2.0);
        assert!((drive.row_s - 36.0).abs() < 1e-9, "{} s", drive.row_s);
        // 2.8 m at 2 km/h, and 1 s more or less by half.
        assert!((5.54..6.54).contains(&drive.turn_s), "{} s", drive.turn_s);
        let fast = driven(&Conditions::with("even-stand", &[]), 8.0);
        assert!((fast.row_s - 9.0).abs() < 1e-9, "{} s", fast.row_s);
    }

    #[test]
    fn speed_wanders_within_its_scatter_and_stops_take_time() {
        let drive = driven(&Conditions::with("transplanted", &[("driving.stops_per_100_m", 50.0)]), 2.0);
        assert!(drive.motion.top_speed_mm_s() <= mm_s(2.0) * 1.08);
        assert!(drive.row_s > 36.0 / 1.08 + 10.0, "{} s", drive.row_s);
    }

    /// How far the wheel turns for each millimetre of the machine.
    fn turned_a_mm(conditions: &Conditions) -> f64 {
        let motion = driven(conditions, 1.0).motion;
        let turned_mm = motion.wheel_mm(motion.duration_s()) - motion.start_mm();
        turned_mm / (motion.end_mm() - motion.start_mm())
    }

    #[test]
    fn a_wheel_turns_farther_with_slip_and_less_with_skid() {
        // The mean of some ten legs within 3 % of it.
        let slip_percent = 100.0 * (1.0 - 1.0 / turned_a_mm(&Conditions::default()));
        assert!((slip_percent - 5.0).abs() < 2.0, "{slip_percent} %");
        for slip_percent in [-30.0, -10.0, 30.0] {
            let changes = [("ground.slip_percent", slip_percent), ("ground.slip_scatter_percent", 0.0)];
            let turned_a_mm = turned_a_mm(&Conditions::with("transplanted", &changes));
            let expected = 1.0 / (1.0 - slip_percent / 100.0);
            assert!((turned_a_mm - expected).abs() < 1e-9, "{turned_a_mm} at {slip_percent} %");
        }
    }

    #[test]
    fn even_the_fastest_row_and_the_shortest_can_be_driven() {
        let changes = [("driving.stops_per_100_m", 50.0), ("driving.speed_scatter_percent", 50.0)];
        let conditions = Conditions::with("transplanted", &changes);
        for seed in 0..200 {
            let mut rng = ChaCha8Rng::seed_from_u64(seed);
            let drive = drive(&conditions, &(0.0..2000.0), 5.0, &mut rng);
            let least_s = 2.0 / (mm_s(5.0) * 1.5 / 1000.0);
            assert!(drive.row_s >= least_s, "{} s", drive.row_s);
        }
    }

    #[test]
    fn the_machine_strays_within_its_limits_and_gradually() {
        let steering = Steering::within(15.0, 0.0, 0.0..20_000.0, &mut ChaCha8Rng::seed_from_u64(1));
        let places: Vec<f64> = (-100..2100).map(|place| steering.across_mm(f64::from(place) * 10.0)).collect();
        assert!(places.iter().all(|across| across.abs() <= 15.0));
        // From one limit to the other takes a metre at least: 0.3 mm in 10.
        assert!(places.windows(2).all(|pair| (pair[1] - pair[0]).abs() <= 0.3 + 1e-9));
        assert!(places.iter().any(|across| across.abs() > 8.0));
        assert_eq!(Steering::default().across_mm(5.0), 0.0);
    }
}
