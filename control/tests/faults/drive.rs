//! A machine for tests that control its beam and its encoder.

use crate::common::{Machine, machine, readings};
use control::{
    alarm::Alarm,
    measure::readings::{Edge, Readings},
    operate::{event::Event, state::State},
    settings::Setting,
    units::Position,
    weeder::Orders,
};

/// Ticks a metre of the default wheel.
pub const TICKS_A_METRE: f64 = 1909.86;

/// A turn of the main loop.
pub const TURN_US: u64 = 500;

/// A machine with clock and position.
pub struct Drive {
    pub machine: Machine,
    pub time_us: u64,
    pub place: f64,
    /// The readings apart from time and position.
    pub readings: Readings,
    /// Beam edges since the last turn.
    pub edges: Vec<Edge>,
}

impl Drive {
    /// At work, with the tool in the row, at 1.8 km/h.
    pub fn at_work() -> Self {
        let mut drive = Self::in_hold();
        drive.machine.start(false).unwrap();
        drive.machine.tell_events(true);
        drive.roll(0.5, 1.0);
        assert!(drive.tool_is_in());
        drive.events();
        drive
    }

    /// In HOLD, at rest.
    pub fn in_hold() -> Self {
        let mut machine = machine();
        // A servo that is out after 180 ms allows speeds up to 5 km/h.
        machine.set(Setting::LeadOutMs, 180).unwrap();
        machine.set(Setting::TopSpeedMmS, 1400).unwrap();
        Self { machine, time_us: 0, place: 0.0, readings: readings(0, 0), edges: Vec::new() }
    }

    pub fn tool_is_in(&self) -> bool {
        !self.machine.tool_out()
    }

    /// A turn of the loop, with the encoder at a count.
    pub fn turn_at(&mut self, count: i32) -> Orders {
        self.time_us += TURN_US;
        let now = readings(self.time_us, count);
        let readings = Readings { now: now.now, position: now.position, ..self.readings };
        self.machine.turn(readings, self.edges.drain(..))
    }

    /// Rolls this many metres at a speed, or stands for this many seconds at speed 0.
    pub fn roll(&mut self, speed_m_s: f64, metres_or_seconds: f64) {
        let seconds = if speed_m_s == 0.0 { metres_or_seconds } else { metres_or_seconds / speed_m_s.abs() };
        for _ in 0..(seconds * 1e6) as u64 / TURN_US {
            self.place += speed_m_s * TICKS_A_METRE * TURN_US as f64 / 1e6;
            self.turn_at(self.place.floor() as i32);
        }
    }

    /// Brakes to a standstill with 3 m/s2.
    pub fn brake(&mut self, speed_m_s: f64) {
        self.brake_by(speed_m_s, 3.0);
    }

    pub fn brake_by(&mut self, speed_m_s: f64, braking_m_s2: f64) {
        let mut speed = speed_m_s;
        while speed > 0.0 {
            speed = (speed - braking_m_s2 * TURN_US as f64 / 1e6).max(0.0);
            self.place += speed * TICKS_A_METRE * TURN_US as f64 / 1e6;
            self.turn_at(self.place.floor() as i32);
        }
    }

    /// Accelerates from rest.
    pub fn speed_up(&mut self, speed_m_s: f64, acceleration_m_s2: f64) {
        let mut speed = 0.0;
        while speed < speed_m_s {
            speed += acceleration_m_s2 * TURN_US as f64 / 1e6;
            self.place += speed * TICKS_A_METRE * TURN_US as f64 / 1e6;
            self.turn_at(self.place.floor() as i32);
        }
    }

    pub fn beam(&mut self, broken: bool) {
        self.edges.push(Edge::Seen {
            position: Position::new(self.place.floor() as i32),
            broken,
            second_broken: false,
        });
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

    pub fn events(&mut self) -> Vec<Event> {
        std::iter::from_fn(|| self.machine.next_event()).collect()
    }
}
