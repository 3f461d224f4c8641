//! Place, time and speed as the machine counts them, each a type of its own so that none passes for another.
//!
//! Place is counted in encoder ticks, time in steps of 4 µs (Timer0 behind its prescaler of 64). A point and a distance
//! between two points are different types, and all arithmetic wraps: a counter that runs over its end changes nothing,
//! as long as two points that are compared lie within half the counter's range.
//!
//! There are two counters of the way. The odometer, [`Position`] and [`Ticks`], has 32 bits: what the operator reads, and
//! what is measured over a long stretch. The ground that is remembered around the tool, [`WrappedPosition`] and [`Length`], has 16,
//! which the chip compares in half the time and half the code; [`LengthScale`] leads from the one to the other.

use core::ops::{Add, Neg, Sub};

/// A place on the ground: ticks counted forward since power-up, wrapping.
///
/// Places are ordered by the distance between them, never by their number, so there is no `Ord`.
#[derive(Clone, Copy, Debug, Default, PartialEq, Eq)]
pub struct Position(i32);

impl Position {
    /// The place that the encoder's counter stands for.
    pub const fn new(count: i32) -> Self {
        Self(count)
    }

    /// The encoder's counter at this place.
    pub const fn count(self) -> i32 {
        self.0
    }

    /// Whether this place lies ahead of `other`.
    #[cfg_attr(target_arch = "avr", inline(never))]
    pub fn is_ahead_of(self, other: Self) -> bool {
        (self - other).0 > 0
    }
}

/// A distance that the odometer has counted, in ticks, positive forward.
#[derive(Clone, Copy, Debug, Default, PartialEq, Eq, PartialOrd, Ord)]
pub struct Ticks(pub i32);

impl Ticks {
    /// No distance at all.
    pub const ZERO: Self = Self(0);
}

/// A place on the ground that is remembered, in units of a [`LengthScale`], wrapping.
///
/// Places are ordered by the distance between them, never by their number, so there is no `Ord`.
#[derive(Clone, Copy, Debug, Default, PartialEq, Eq)]
pub struct WrappedPosition(i16);

impl WrappedPosition {
    /// The place that a counter of units stands for.
    pub const fn new(count: i16) -> Self {
        Self(count)
    }

    /// The counter at this place.
    pub const fn count(self) -> i16 {
        self.0
    }

    /// Whether this place lies ahead of `other`.
    #[cfg_attr(target_arch = "avr", inline(never))]
    pub fn is_ahead_of(self, other: Self) -> bool {
        (self - other).0 > 0
    }
}

/// A distance along the ground that is remembered, in units of a [`LengthScale`], positive forward.
#[derive(Clone, Copy, Debug, Default, PartialEq, Eq, PartialOrd, Ord)]
pub struct Length(pub i16);

impl Length {
    /// No distance at all.
    pub const ZERO: Self = Self(0);
}

/// A point and the distance between two: their differences and sums, all of which wrap.
macro_rules! points_and_distances {
    ($($Point:ident $Distance:ident;)*) => {$(
        impl Sub for $Point {
            type Output = $Distance;
            fn sub(self, from: Self) -> $Distance {
                $Distance(self.0.wrapping_sub(from.0))
            }
        }

        impl Add<$Distance> for $Point {
            type Output = Self;
            fn add(self, distance: $Distance) -> Self {
                Self(self.0.wrapping_add(distance.0))
            }
        }

        impl Sub<$Distance> for $Point {
            type Output = Self;
            fn sub(self, distance: $Distance) -> Self {
                Self(self.0.wrapping_sub(distance.0))
            }
        }

        impl Add for $Distance {
            type Output = Self;
            fn add(self, other: Self) -> Self {
                Self(self.0.wrapping_add(other.0))
            }
        }

        impl Sub for $Distance {
            type Output = Self;
            fn sub(self, other: Self) -> Self {
                Self(self.0.wrapping_sub(other.0))
            }
        }

        impl Neg for $Distance {
            type Output = Self;
            fn neg(self) -> Self {
                Self(self.0.wrapping_neg())
            }
        }
    )*};
}

points_and_distances! {
    Position Ticks;
    WrappedPosition Length;
}

/// How many ticks make a unit of the ground that is remembered: a power of two, 1 for any wheel of up to [`LengthScale::FINEST`]
/// ticks a metre.
#[derive(Clone, Copy, Debug, Default, PartialEq, Eq)]
pub struct LengthScale {
    shift: u8,
}

impl LengthScale {
    /// A tick is a unit.
    pub const TICK: Self = Self { shift: 0 };

    /// Units that a metre has at the most, 0.42 mm each: 13 m are within half of 16 bits.
    pub const FINEST: i32 = 2400;

    /// The scale for a wheel of so many ticks a metre.
    pub const fn of(ticks_per_m: Ticks) -> Self {
        let (mut shift, mut units) = (0, ticks_per_m.0);
        while units > Self::FINEST {
            (shift, units) = (shift + 1, units >> 1);
        }
        Self { shift }
    }

    /// The place at which the odometer has counted so far.
    #[cfg_attr(target_arch = "avr", inline(never))]
    pub const fn place(self, position: Position) -> WrappedPosition {
        WrappedPosition((position.0 >> self.shift) as i16)
    }

    /// A distance in units, which is to be less than 13 m.
    #[cfg_attr(target_arch = "avr", inline(never))]
    pub const fn length(self, distance: Ticks) -> Length {
        Length((distance.0 >> self.shift) as i16)
    }

    /// A distance in ticks.
    #[cfg_attr(target_arch = "avr", inline(never))]
    pub const fn ticks(self, length: Length) -> Ticks {
        Ticks((length.0 as i32) << self.shift)
    }
}

/// A moment: steps of 4 µs since power-up, wrapping after 4.77 hours.
#[derive(Clone, Copy, Debug, Default, PartialEq, Eq)]
pub struct Instant(u32);

impl Instant {
    /// The first moment of all.
    pub const ZERO: Self = Self(0);

    /// The moment that the clock's counter stands for.
    pub const fn new(steps: u32) -> Self {
        Self(steps)
    }

    /// The clock's counter at this moment.
    pub const fn steps(self) -> u32 {
        self.0
    }

    /// The moment in coarse steps.
    #[cfg_attr(target_arch = "avr", inline(never))]
    pub const fn coarse(self) -> Coarse {
        Coarse((self.0 >> 4) as u16)
    }
}

/// A moment in steps of 64 µs, wrapping after 4.2 seconds: half an [`Instant`], for what is looked at much more often.
#[derive(Clone, Copy, Debug, Default, PartialEq, Eq)]
pub struct Coarse(u16);

impl Coarse {
    /// The first moment of all.
    pub const ZERO: Self = Self(0);

    /// Steps in a second.
    pub const STEPS_PER_SECOND: u32 = Interval::STEPS_PER_SECOND >> 4;

    /// So many milliseconds, at most 4193 of them, in steps.
    pub const fn steps_in_ms(milliseconds: u16) -> u16 {
        (milliseconds as u32 * Self::STEPS_PER_SECOND / 1000) as u16
    }

    /// Steps since an earlier moment, less than 4.2 seconds ago.
    pub const fn since(self, earlier: Self) -> u16 {
        self.0.wrapping_sub(earlier.0)
    }
}

/// A stretch of time in steps of 4 µs.
#[derive(Clone, Copy, Debug, Default, PartialEq, Eq, PartialOrd, Ord)]
pub struct Interval(u32);

impl Interval {
    /// Steps of the clock in a second.
    pub const STEPS_PER_SECOND: u32 = 250_000;

    /// An interval of so many steps of 4 µs.
    pub const fn from_steps(steps: u32) -> Self {
        Self(steps)
    }

    /// An interval of so many milliseconds, at most 17 million of them.
    pub const fn from_ms(milliseconds: u32) -> Self {
        Self(milliseconds * (Self::STEPS_PER_SECOND / 1000))
    }

    /// The interval in steps of 4 µs.
    pub const fn steps(self) -> u32 {
        self.0
    }
}

impl Sub for Instant {
    type Output = Interval;
    fn sub(self, earlier: Self) -> Interval {
        Interval(self.0.wrapping_sub(earlier.0))
    }
}

impl Add<Interval> for Instant {
    type Output = Self;
    fn add(self, later: Interval) -> Self {
        Self(self.0.wrapping_add(later.0))
    }
}

/// A speed over the ground in ticks a second, positive forward.
#[derive(Clone, Copy, Debug, Default, PartialEq, Eq, PartialOrd, Ord)]
pub struct TicksPerSecond(pub i32);

impl TicksPerSecond {
    /// Whether the machine rolls faster than that many ticks a second, forward or back.
    #[cfg_attr(target_arch = "avr", inline(never))]
    pub fn is_beyond(self, limit: u16) -> bool {
        self.0.unsigned_abs() > limit.into()
    }

    /// How far the machine rolls at this speed, in so many milliseconds.
    ///
    /// Right while speed times milliseconds stays below 2^31: up to 2.1 million ticks a second over a whole second.
    #[cfg_attr(target_arch = "avr", inline(never))]
    pub fn distance_in_ms(self, milliseconds: u16) -> Ticks {
        // Divided without its sign: the chip has one division routine then, the shorter.
        let magnitude = (self.0.unsigned_abs().wrapping_mul(u32::from(milliseconds)) / 1000) as i32;
        Ticks(if self.0 < 0 { -magnitude } else { magnitude })
    }
}

/// The ground wheel with its encoder: what a tick is in millimetres.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub struct Wheel {
    /// A tick in 2^-20 mm: 52,429 with 20,000 ticks a metre, 26 million with 40.
    tick: u32,
    /// Ticks from which on 16 bits do not hold the millimetres: worked out once, as a division takes long.
    too_far: u32,
}

impl Wheel {
    /// pi as a fraction that is right to 8.5e-8, far below a tick over any distance the machine knows.
    const PI_NUMERATOR: u32 = 355;
    const PI_DENOMINATOR: u32 = 113;

    /// A wheel that is yet to be measured, and that measures nothing.
    pub const NONE: Self = Self { tick: 0, too_far: 0 };

    /// A wheel by its encoder's counts a turn, 100 to 10,000, and its diameter, 200 to 800 mm.
    pub const fn of_diameter(ticks_per_rev: u16, diameter_mm: u16) -> Self {
        Self::of_tick(Self::tick_of_diameter(ticks_per_rev, diameter_mm))
    }

    /// A tick of such a wheel in 2^-20 mm.
    pub(crate) const fn tick_of_diameter(ticks_per_rev: u16, diameter_mm: u16) -> u32 {
        let circumference = (((Self::PI_NUMERATOR * diameter_mm as u32) << 12) / Self::PI_DENOMINATOR) << 8;
        circumference / ticks_per_rev as u32
    }

    /// A wheel by its counts a metre, as measured, 1 to 20,000.
    pub const fn measured(ticks_per_m: u16) -> Self {
        Self::of_tick(Self::tick_measured(ticks_per_m))
    }

    /// A tick of such a wheel in 2^-20 mm.
    pub(crate) const fn tick_measured(ticks_per_m: u16) -> u32 {
        (1000 << 20) / ticks_per_m as u32
    }

    /// A wheel by its tick in 2^-20 mm.
    pub(crate) const fn of_tick(tick: u32) -> Self {
        Self { tick, too_far: ((i16::MAX as u32) << 16) / (tick >> 4) }
    }

    /// A distance in ticks, rounded to the nearest: `mm * ticks_per_rev / (pi * diameter)`, the paper's Eq. 1 and 2, or by
    /// what was measured. Right to a tick up to 4 m.
    pub const fn ticks(self, millimetres: u16) -> Ticks {
        Self::ticks_of(self.tick, millimetres)
    }

    /// A distance in ticks of so many 2^-20 mm.
    #[cfg_attr(target_arch = "avr", inline(never))]
    pub(crate) const fn ticks_of(tick: u32, millimetres: u16) -> Ticks {
        Ticks((((millimetres as u32) << 20) + tick / 2).wrapping_div(tick) as i32)
    }

    /// A distance in millimetres, rounded toward zero and limited to what 16 bits hold; right to 1 mm and 0.02 %.
    #[cfg_attr(target_arch = "avr", inline(never))]
    pub const fn millimetres(self, distance: Ticks) -> i16 {
        let magnitude = distance.0.unsigned_abs();
        // What is not too far keeps the product in 32 bits.
        let millimetres =
            if magnitude >= self.too_far { i16::MAX } else { ((magnitude * (self.tick >> 4)) >> 16) as i16 };
        if distance.0 < 0 { -millimetres } else { millimetres }
    }
}

/// Counts one more, as far as 16 bits go.
#[expect(
    clippy::implicit_saturating_add,
    reason = "the compiler makes twice the code of `saturating_add` on this chip"
)]
pub fn count(number: &mut u16) {
    if *number < u16::MAX {
        *number += 1;
    }
}
