//! A piece of a motion: constant acceleration, in one direction, with one slip of the wheel.

/// A stretch of constant acceleration in which the direction does not change.
#[derive(Clone, Copy, Debug)]
pub(super) struct Piece {
    pub(super) start_s: f64,
    pub(super) end_s: f64,
    pub(super) start_mm: f64,
    pub(super) end_mm: f64,
    pub(super) speed_mm_s: f64,
    pub(super) acceleration_mm_s2: f64,
    /// The position of the wheel's rim at the piece's beginning, and how far it turns for each millimetre of the
    /// machine.
    pub(super) wheel_start_mm: f64,
    pub(super) wheel_mm_a_mm: f64,
}

impl Piece {
    pub(super) fn position_mm(&self, time_s: f64) -> f64 {
        let t = time_s - self.start_s;
        self.start_mm + self.speed_mm_s * t + self.acceleration_mm_s2 * t * t / 2.0
    }

    pub(super) fn speed_at(&self, time_s: f64) -> f64 {
        self.speed_mm_s + self.acceleration_mm_s2 * (time_s - self.start_s)
    }

    /// The piece that follows, with the same slip, at a speed.
    pub(super) fn then_at(&self, speed_mm_s: f64) -> Self {
        Self {
            start_s: self.end_s,
            end_s: f64::INFINITY,
            start_mm: self.end_mm,
            speed_mm_s,
            acceleration_mm_s2: 0.0,
            wheel_start_mm: self.wheel_mm(self.end_mm),
            ..*self
        }
    }

    /// The time at which the piece reaches a position between its ends. This form of the quadratic's root adds two
    /// terms of one sign. So it stays exact for small accelerations and from standstill.
    pub(super) fn time_at(&self, place_mm: f64) -> f64 {
        let distance_mm = place_mm - self.start_mm;
        if distance_mm == 0.0 {
            return self.start_s;
        }
        let squared_speed = self.speed_mm_s.powi(2) + 2.0 * self.acceleration_mm_s2 * distance_mm;
        let speed_there_mm_s = squared_speed.max(0.0).sqrt().copysign(distance_mm);
        let duration_s = 2.0 * distance_mm / (self.speed_mm_s + speed_there_mm_s);
        (self.start_s + duration_s).clamp(self.start_s, self.end_s)
    }

    /// Where the wheel's rim is when the machine is at a place.
    pub(super) fn wheel_mm(&self, place_mm: f64) -> f64 {
        self.wheel_start_mm + (place_mm - self.start_mm) * self.wheel_mm_a_mm
    }

    /// The machine's position when the wheel's rim is at `wheel_mm`.
    pub(super) fn place_at(&self, wheel_mm: f64) -> f64 {
        self.start_mm + (wheel_mm - self.wheel_start_mm) / self.wheel_mm_a_mm
    }
}
