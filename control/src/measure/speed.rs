//! The machine's speed, from the encoder's position and the time at which it was read.
//!
//! The meter remembers the places and times of a few position changes, at least `SPACING` apart, and divides the
//! distance since the oldest by the time it took: a window of about 80 ms at walking speed, and of six ticks when the
//! machine creeps. A wheel that has fallen silent for longer than it should is slower than one tick in that silence; after
//! `STANDSTILL` it stands. A single tick backwards, as vibration gives, moves the answer by its share and no more.

use crate::units::{Coarse, Instant, Position, TicksPerSecond};

/// The shortest time between two remembered places. Together with their number it sets the window: long enough that the
/// grain of a tick and of the main loop stays below half a percent at 1 km/h, short enough to follow a walking person.
pub(crate) const SPACING: u16 = Coarse::steps_in_ms(10);

/// Places remembered; a power of two keeps the ring's arithmetic short.
const SAMPLES: u8 = 8;

/// Silence after which the machine is said to stand.
const STANDSTILL: u16 = Coarse::steps_in_ms(500);

/// The longest window has to fit into a coarse moment.
const _: () = assert!(SAMPLES as u32 * (STANDSTILL as u32) < u16::MAX as u32);

/// A place and a time, of which the lower halves are enough: in the longest window, 4 s, nobody rolls 32,767 ticks.
#[derive(Clone, Copy, Debug, Default)]
struct Sample {
    place: u16,
    time: Coarse,
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
    patience: u16,
    speed: TicksPerSecond,
}

impl SpeedMeter {
    /// A meter that nobody has read.
    pub const NONE: Self = Self {
        samples: [Sample { place: 0, time: Coarse::ZERO }; SAMPLES as usize],
        count: 0,
        next: 0,
        last: Sample { place: 0, time: Coarse::ZERO },
        patience: 0,
        speed: TicksPerSecond(0),
    };

    /// A meter for a machine that stands at `position`.
    pub const fn new(position: Position, now: Instant) -> Self {
        let mut meter = Self::NONE;
        meter.init(position, now);
        meter
    }

    /// The machine wakes up, and stands at `position`.
    pub const fn init(&mut self, position: Position, now: Instant) {
        self.last = Sample { place: position.count() as u16, time: now.coarse() };
        self.patience = STANDSTILL;
    }

    /// The speed as of the last reading.
    pub fn speed(&self) -> TicksPerSecond {
        self.speed
    }

    /// Takes a reading; returns the new speed where it changed.
    ///
    /// To be called at least every few milliseconds.
    #[cfg_attr(not(target_arch = "avr"), inline)]
    pub fn read(&mut self, now: Instant, position: Position) -> Option<TicksPerSecond> {
        let before = self.speed;
        let reading = Sample { place: position.count() as u16, time: now.coarse() };
        if reading.place != self.last.place {
            self.moved(reading);
        } else {
            self.silent(reading.time.since(self.last.time));
        }
        (self.speed != before).then_some(self.speed)
    }

    #[cfg_attr(target_arch = "avr", inline(never))]
    #[cfg_attr(not(target_arch = "avr"), inline)]
    fn moved(&mut self, reading: Sample) {
        self.last = reading;
        if self.count == 0 {
            self.remember(reading);
            return;
        }
        let newest = self.samples[usize::from((self.next + SAMPLES - 1) % SAMPLES)];
        if reading.time.since(newest.time) < SPACING {
            return;
        }
        let oldest = self.samples[usize::from((self.next + SAMPLES - self.count) % SAMPLES)];
        self.remember(reading);
        let distance = reading.place.wrapping_sub(oldest.place).cast_signed();
        let time = reading.time.since(oldest.time);
        let speed = u32::from(distance.unsigned_abs()) * Coarse::STEPS_PER_SECOND / u32::from(time);
        self.speed = TicksPerSecond(if distance < 0 { -speed.cast_signed() } else { speed.cast_signed() });
        // Two ticks' time: encoders do not space their edges evenly.
        self.patience = match speed {
            0 => STANDSTILL,
            speed => ((2 * Coarse::STEPS_PER_SECOND / speed) as u16).clamp(SPACING, STANDSTILL),
        };
    }

    fn remember(&mut self, reading: Sample) {
        self.samples[usize::from(self.next)] = reading;
        self.next = (self.next + 1) % SAMPLES;
        self.count = (self.count + 1).min(SAMPLES);
    }

    #[cfg_attr(not(target_arch = "avr"), inline)]
    fn silent(&mut self, silence: u16) {
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
        let limit = i32::from(Coarse::STEPS_PER_SECOND as u16 / silence);
        self.speed = TicksPerSecond(self.speed.0.clamp(-limit, limit));
        // Look again after an eighth more, so that the division stays rare.
        self.patience = (silence + silence / 8).min(STANDSTILL);
    }
}
