//! A machine for tests that control its beam and its encoder.

use crate::common::{Machine, machine};
use control::{alarm::Alarm, operate::state::State, settings::Setting, weeder::Orders};
use rig::Beams;

/// Ticks a metre of the default wheel.
pub const TICKS_A_METRE: f64 = 1909.86;

/// A turn of the main loop.
pub const TURN_US: u32 = 500;
const TURN_S: f64 = TURN_US as f64 / 1e6;

/// A machine with its place.
pub struct Drive {
    pub machine: Machine,
    pub place: f64,
}

impl Drive {
    /// At work, with the tool in the row, at 1.8 km/h.
    pub fn at_work() -> Self {
        let mut drive = Self::in_hold();
        drive.machine.start(false).unwrap();
        drive.machine.enable_events(true);
        drive.roll(0.5, 1.0);
        assert!(drive.tool_is_in());
        drive.machine.events();
        drive
    }

    /// In HOLD, at rest.
    pub fn in_hold() -> Self {
        let mut machine = machine();
        // A servo that is out after 180 ms allows speeds up to 5 km/h.
        machine.set(Setting::LeadOutMs, 180).unwrap();
        machine.set(Setting::TopSpeedMmS, 1400).unwrap();
        Self { machine, place: 0.0 }
    }

    pub fn tool_is_in(&self) -> bool {
        !self.machine.tool_out()
    }

    /// A turn of the loop, with the encoder at a count.
    pub fn turn_at(&mut self, count: i32) -> Orders {
        self.machine.at(count).turn_after(TURN_US)
    }

    fn roll_by(&mut self, metres: f64) {
        self.place += metres * TICKS_A_METRE;
        self.turn_at(self.place.floor() as i32);
    }

    /// Rolls this many metres at a speed, or stands for this many seconds at speed 0.
    pub fn roll(&mut self, speed_m_s: f64, metres_or_seconds: f64) {
        let seconds = if speed_m_s == 0.0 { metres_or_seconds } else { metres_or_seconds / speed_m_s.abs() };
        for _ in 0..(seconds * 1e6) as u32 / TURN_US {
            self.roll_by(speed_m_s * TURN_S);
        }
    }

    /// Brakes to a standstill with 3 m/s2.
    pub fn brake(&mut self, speed_m_s: f64) {
        self.brake_by(speed_m_s, 3.0);
    }

    pub fn brake_by(&mut self, speed_m_s: f64, braking_m_s2: f64) {
        let mut speed = speed_m_s;
        while speed > 0.0 {
            speed = (speed - braking_m_s2 * TURN_S).max(0.0);
            self.roll_by(speed * TURN_S);
        }
    }

    /// Accelerates from rest.
    pub fn speed_up(&mut self, speed_m_s: f64, acceleration_m_s2: f64) {
        let mut speed = 0.0;
        while speed < speed_m_s {
            speed += acceleration_m_s2 * TURN_S;
            self.roll_by(speed * TURN_S);
        }
    }

    pub fn beam(&mut self, broken: bool) {
        self.machine.at(self.place.floor() as i32).see(Beams::one(broken));
    }

    /// A plant of 150 mm passes the beam.
    pub fn pass_a_plant(&mut self, speed_m_s: f64) {
        self.pass(speed_m_s, 0.15);
    }

    /// A detection of this width, in metres, passes the beam.
    pub fn pass(&mut self, speed_m_s: f64, width_m: f64) {
        self.beam(true);
        self.roll(speed_m_s, width_m);
        self.beam(false);
    }

    /// Stalks of 20 mm, weeds for this machine, pass the beam until an alarm or `most` of them. Returns their number.
    pub fn pass_stalks(&mut self, most: u32) -> u32 {
        (1..=most)
            .find(|_| {
                self.pass(0.5, 0.02);
                self.roll(0.5, 0.2);
                self.alarm().is_some()
            })
            .unwrap_or(most)
    }

    pub fn alarm(&self) -> Option<Alarm> {
        match self.machine.state() {
            State::Alarm(alarm) => {
                assert!(self.machine.tool_out(), "an alarm with the tool in the row");
                Some(alarm)
            }
            _ => None,
        }
    }
}
