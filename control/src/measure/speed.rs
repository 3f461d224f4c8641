//! The machine's speed, from the encoder's position and the time of each reading.
//!
//! The meter stores position and time of a few changes of position, at least `SPACING` apart. The speed is the distance since the
//! oldest one, divided by its time: about 80 ms at walking speed, and six ticks if the machine creeps. After a longer silence than
//! the speed explains, the speed is limited to one tick in that silence; after `STANDSTILL` it is 0. A single tick backwards from
//! vibration changes the speed only by its share.
//!
//! So the measured speed of a machine that accelerates is 40 ms old, and in the middle of a swing the machine is faster again.
//! [`SpeedMeter::expected`] adds what the machine gains in 100 ms. The gain shows in the distance of the averaging time, compared with
//! its mean over another 80 ms.

use crate::units::{Coarse, Speed, WrappedPosition, share};
use core::num::NonZero;

/// The shortest time between two samples. With their number it sets the averaging time. It is long enough that ticks and turns
/// cause less than half a percent of error at 1 km/h. It is short enough to follow a walking person.
pub(crate) const SPACING: u16 = Coarse::steps_in_ms(10);

/// Samples; a power of two keeps the ring's arithmetic short.
const SAMPLES: u8 = 8;

/// Silence after which the machine stands.
const STANDSTILL: u16 = Coarse::steps_in_ms(500);

/// The patience of a meter that has shown a standing machine. It is beyond the patience of any speed.
const STANDING: u16 = STANDSTILL + 1;

/// The fastest speed, 10 m/s, and the greatest gain: their sum fits 16 bits. No weeder is as fast, but noise may look so.
const FASTEST: u16 = 0x5FFF;
const MOST: i16 = 0x1FFF >> 4;

/// The longest averaging time has to fit a coarse moment.
const _: () = assert!(SAMPLES as u32 * (STANDSTILL as u32) < u16::MAX as u32);

/// A position and a time. In the longest averaging time, 4 s, no machine rolls the 13 m of half a counter.
#[derive(Clone, Copy, Debug, Default)]
struct Sample {
    ticks: u16,
    time: Coarse,
}

/// Measures the speed from readings of position and time.
#[derive(Clone, Debug)]
pub struct SpeedMeter {
    /// A ring: `count` samples are valid, and the next one goes to `next`.
    samples: [Sample; SAMPLES as usize],
    count: u8,
    next: u8,
    /// The last reading with a new position.
    last: Sample,
    /// The silence that the present speed explains.
    patience: u16,
    speed: Speed,
    /// Eight times the mean distance of the last averaging times.
    trend: i16,
    /// The last distance above that mean; 0 for a machine that does not become faster.
    gain: i16,
}

impl SpeedMeter {
    /// A meter before its first reading.
    pub const NONE: Self = Self {
        samples: [Sample { ticks: 0, time: Coarse::ZERO }; SAMPLES as usize],
        count: 0,
        next: 0,
        last: Sample { ticks: 0, time: Coarse::ZERO },
        patience: 0,
        speed: Speed(0),
        trend: 0,
        gain: 0,
    };

    /// A meter of a machine that stands at `position`.
    pub const fn new(position: WrappedPosition, now: Coarse) -> Self {
        let mut meter = Self::NONE;
        meter.init(position, now);
        meter
    }

    /// Starts with the machine standing at `position`.
    pub const fn init(&mut self, position: WrappedPosition, now: Coarse) {
        self.last = Sample { ticks: position.count() as u16, time: now };
        self.patience = STANDSTILL;
    }

    /// The speed at the last reading.
    pub fn speed(&self) -> Speed {
        self.speed
    }

    /// The speed in the middle of a swing that starts now, if the machine goes on accelerating. It is at least the measured speed,
    /// because a machine that brakes may stop braking.
    #[cfg_attr(target_arch = "avr", inline(never))]
    #[cfg_attr(not(target_arch = "avr"), inline)]
    pub fn expected(&self) -> Speed {
        // A unit in 80 ms is 12.5 units a second. The machine gained them in 80 ms, and gains 16 in 100 ms.
        Speed(self.speed.0 + (self.gain << 4))
    }

    /// Takes a reading. Returns whether it may have changed the speeds. The caller calls it at least every few milliseconds.
    #[cfg_attr(not(target_arch = "avr"), inline)]
    pub fn read(&mut self, now: Coarse, position: WrappedPosition) -> bool {
        let reading = Sample { ticks: position.count() as u16, time: now };
        if reading.ticks != self.last.ticks {
            self.moved(reading)
        } else {
            self.silent(reading.time.since(self.last.time))
        }
    }

    #[cfg_attr(target_arch = "avr", inline(never))]
    #[cfg_attr(not(target_arch = "avr"), inline)]
    fn moved(&mut self, reading: Sample) -> bool {
        self.last = reading;
        if self.count == 0 {
            self.remember(reading);
            return false;
        }
        let newest = self.samples[usize::from((self.next + SAMPLES - 1) % SAMPLES)];
        if reading.time.since(newest.time) < SPACING {
            return false;
        }
        let oldest = self.samples[usize::from((self.next + SAMPLES - self.count) % SAMPLES)];
        self.remember(reading);
        let Some(time) = NonZero::new(reading.time.since(oldest.time)) else { return false };
        let distance = reading.ticks.wrapping_sub(oldest.ticks).cast_signed();
        let speed = share(distance.unsigned_abs(), Coarse::STEPS_PER_SECOND as u16, time);
        let speed = speed.min(FASTEST.into()) as u16;
        self.speed = Speed(if distance < 0 { -speed.cast_signed() } else { speed.cast_signed() });
        let gain = distance.wrapping_sub(self.trend >> 3);
        self.trend = self.trend.wrapping_add(gain);
        self.gain = if (gain ^ distance) < 0 { 0 } else { gain.clamp(-MOST, MOST) };
        // The time of two ticks, because encoders do not space their edges evenly.
        self.patience = match speed {
            0 => STANDSTILL,
            speed => ((2 * Coarse::STEPS_PER_SECOND) as u16 / speed).clamp(SPACING, STANDSTILL),
        };
        true
    }

    fn remember(&mut self, reading: Sample) {
        self.samples[usize::from(self.next % SAMPLES)] = reading;
        self.next = (self.next + 1) % SAMPLES;
        self.count = (self.count + 1).min(SAMPLES);
    }

    #[cfg_attr(not(target_arch = "avr"), inline)]
    fn silent(&mut self, silence: u16) -> bool {
        if silence < self.patience {
            return false;
        }
        // The samples no longer give the speed. Measurement restarts when the machine moves.
        (self.count, self.trend, self.gain) = (0, 0, 0);
        if silence >= STANDSTILL {
            self.speed = Speed(0);
            return core::mem::replace(&mut self.patience, STANDING) != STANDING;
        }
        let limit = (Coarse::STEPS_PER_SECOND as u16 / silence) as i16;
        self.speed = Speed(self.speed.0.clamp(-limit, limit));
        // The next check comes after an eighth more, so that divisions stay rare.
        self.patience = (silence + silence / 8).min(STANDSTILL);
        true
    }
}
