//! The machine's speed, from the encoder's position and the time at which it was read.
//!
//! The meter remembers the places and times of a few position changes, at least `SPACING` apart, and divides the
//! distance since the oldest by the time it took: a window of about 80 ms at walking speed, and of six ticks when the
//! machine creeps. A wheel that has fallen silent for longer than it should is slower than one tick in that silence; after
//! `STANDSTILL` it stands. A single tick backwards, as vibration gives, moves the answer by its share and no more.

use crate::units::{Instant, Interval, Position, TicksPerSecond};

/// The shortest time between two remembered places. Together with their number it sets the window: long enough that the
/// grain of a tick and of the main loop stays below half a percent at 1 km/h, short enough to follow a walking person.
const SPACING: Interval = Interval::from_ms(10);

/// Places remembered; a power of two keeps the ring's arithmetic short.
const SAMPLES: u8 = 8;

/// Silence after which the machine is said to stand.
const STANDSTILL: Interval = Interval::from_ms(500);

#[derive(Clone, Copy, Debug, Default)]
struct Sample {
    position: Position,
    time: Instant,
}

/// Measures the speed from readings of position and time.
#[derive(Clone, Debug)]
pub struct SpeedMeter {
    /// A ring: `count` of them are valid, and the next one goes to `next`.
    samples: [Sample; SAMPLES as usize],
    count: u8,
    next: u8,
    /// The last reading at which the position had changed.
    last: Sample,
    /// Silence that the present speed explains.
    patience: Interval,
    speed: TicksPerSecond,
}

impl SpeedMeter {
    /// A meter for a machine that stands at `position`.
    pub fn new(position: Position, now: Instant) -> Self {
        let last = Sample { position, time: now };
        Self {
            samples: [last; SAMPLES as usize],
            count: 0,
            next: 0,
            last,
            patience: STANDSTILL,
            speed: TicksPerSecond(0),
        }
    }

    /// The speed as of the last reading.
    pub fn speed(&self) -> TicksPerSecond {
        self.speed
    }

    /// Takes a reading; returns the new speed where it changed.
    ///
    /// To be called at least every few milliseconds, and much more often than the clock wraps.
    pub fn read(&mut self, now: Instant, position: Position) -> Option<TicksPerSecond> {
        let before = self.speed;
        if position != self.last.position {
            self.moved(Sample { position, time: now });
        } else {
            self.silent(now - self.last.time);
        }
        (self.speed != before).then_some(self.speed)
    }

    fn moved(&mut self, reading: Sample) {
        self.last = reading;
        if self.count == 0 {
            self.remember(reading);
            return;
        }
        let newest = self.samples[usize::from((self.next + SAMPLES - 1) % SAMPLES)];
        if reading.time - newest.time < SPACING {
            return;
        }
        let oldest = self.samples[usize::from((self.next + SAMPLES - self.count) % SAMPLES)];
        self.remember(reading);
        let distance = (reading.position - oldest.position).0;
        // A window lasts at most SAMPLES silences, so its steps fit; the product does up to 17,179 ticks a window.
        let time = (reading.time - oldest.time).steps();
        let speed = (distance.unsigned_abs().wrapping_mul(Interval::STEPS_PER_SECOND) / time) as i32;
        self.speed = TicksPerSecond(if distance < 0 { -speed } else { speed });
        // Two ticks' time: encoders do not space their edges evenly.
        self.patience = match self.speed.0.unsigned_abs() {
            0 => STANDSTILL,
            speed => Interval::from_steps(2 * Interval::STEPS_PER_SECOND / speed).max(SPACING).min(STANDSTILL),
        };
    }

    fn remember(&mut self, reading: Sample) {
        self.samples[usize::from(self.next)] = reading;
        self.next = (self.next + 1) % SAMPLES;
        self.count = (self.count + 1).min(SAMPLES);
    }

    fn silent(&mut self, silence: Interval) {
        if silence < self.patience {
            return;
        }
        // The window no longer tells how fast the machine is; when it rolls on, measuring starts anew.
        self.count = 0;
        if silence >= STANDSTILL {
            self.speed = TicksPerSecond(0);
            self.patience = STANDSTILL;
            return;
        }
        let limit = (Interval::STEPS_PER_SECOND / silence.steps()) as i32;
        self.speed = TicksPerSecond(self.speed.0.clamp(-limit, limit));
        // Look again after an eighth more, so that the division stays rare.
        self.patience = Interval::from_steps(silence.steps() + silence.steps() / 8).min(STANDSTILL);
    }
}
