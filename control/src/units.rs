//! Position, time and speed as the machine counts them. Each has its own type, so the compiler finds a mix-up.
//!
//! Positions are in encoder ticks, times in steps of 4 µs (Timer0 with a prescaler of 64). Points and distances between points are
//! different types. All arithmetic wraps: this is harmless if two compared points lie within half of the counter's range.
//!
//! There are two counters of distance. The odometer ([`Position`], [`Ticks`]) has 32 bits, for the operator and for long distances.
//! Remembered ground ([`WrappedPosition`], [`Length`]) has 16 bits, which the chip compares in half the time and code.
//! [`LengthScale`] converts.

use core::{
    num::NonZero,
    ops::{Add, Neg, Sub},
};

/// A type of points and the type of their distances, with wrapping sums and differences.
macro_rules! points_and_distances {
    ($($(#[$doc:meta])* $Point:ident, $(#[$of_distance:meta])* $Distance:ident: $int:ty $(, $attribute:meta)?;)*) => {$(
        $(#[$doc])*
        ///
        /// No `Ord`: the sign of the distance between two positions gives their order.
        #[derive(Clone, Copy, Debug, Default, PartialEq, Eq)]
        pub struct $Point($int);

        impl $Point {
            /// The position at a count.
            pub const fn new(count: $int) -> Self {
                Self(count)
            }

            /// The count at this position.
            pub const fn count(self) -> $int {
                self.0
            }

            /// Whether this position lies ahead of `other`.
            $(#[$attribute])?
            pub fn is_ahead_of(self, other: Self) -> bool {
                (self - other).0 > 0
            }
        }

        $(#[$of_distance])*
        #[derive(Clone, Copy, Debug, Default, PartialEq, Eq, PartialOrd, Ord)]
        pub struct $Distance(pub $int);

        impl $Distance {
            /// No distance.
            pub const ZERO: Self = Self(0);
        }

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
    /// A position on the ground: ticks forward since power-up, wrapping.
    Position,
    /// A distance of the odometer in ticks, positive forward.
    Ticks: i32;
    /// A position on remembered ground, in units of a [`LengthScale`], wrapping.
    WrappedPosition,
    /// A distance on remembered ground, in units of a [`LengthScale`], positive forward.
    Length: i16, cfg_attr(target_arch = "avr", inline(never));
}

/// Ticks in a unit of remembered ground, a power of two: 1 for a wheel of up to [`LengthScale::FINEST`] ticks a metre.
#[derive(Clone, Copy, Debug, Default, PartialEq, Eq)]
pub struct LengthScale {
    shift: u8,
}

impl LengthScale {
    /// A unit is a tick.
    pub const TICK: Self = Self { shift: 0 };

    /// Most units in a metre, 0.42 mm each: 13 m fit half of 16 bits.
    pub const FINEST: u16 = 2400;

    /// The scale for a wheel with these ticks a metre, at most 65,535.
    pub const fn of(ticks_per_m: Ticks) -> Self {
        let (mut shift, mut units) = (0, ticks_per_m.0 as u16);
        while units > Self::FINEST {
            (shift, units) = (shift + 1, units >> 1);
        }
        Self { shift }
    }

    /// Converts an odometer position.
    #[cfg_attr(target_arch = "avr", inline(never))]
    pub const fn wrap(self, position: Position) -> WrappedPosition {
        WrappedPosition((position.0 >> self.shift) as i16)
    }

    /// Converts a distance to units. It must be less than 13 m.
    #[cfg_attr(target_arch = "avr", inline(never))]
    pub const fn length(self, distance: Ticks) -> Length {
        Length((distance.0 >> self.shift) as i16)
    }

    /// Converts a distance to ticks.
    #[cfg_attr(target_arch = "avr", inline(never))]
    pub const fn ticks(self, length: Length) -> Ticks {
        Ticks((length.0 as i32) << self.shift)
    }
}

/// A moment in steps of 4 µs since power-up, wrapping after 4.77 hours.
#[derive(Clone, Copy, Debug, Default, PartialEq, Eq)]
pub struct Instant(u32);

impl Instant {
    /// Power-up.
    pub const ZERO: Self = Self(0);

    /// The moment at a count of the clock.
    pub const fn new(steps: u32) -> Self {
        Self(steps)
    }

    /// The moment this many milliseconds after power-up.
    #[cfg(test)]
    pub(crate) const fn at_ms(milliseconds: u32) -> Self {
        Self(Interval::from_ms(milliseconds).0)
    }

    /// The clock's count at this moment.
    pub const fn steps(self) -> u32 {
        self.0
    }

    /// The moment in steps of 1.024 ms, wrapping after 67 seconds.
    pub const fn slow(self) -> Slow {
        Slow((self.0 >> 8) as u16)
    }

    /// The moment in coarse steps.
    #[cfg_attr(target_arch = "avr", inline(never))]
    pub const fn coarse(self) -> Coarse {
        Coarse((self.0 >> 4) as u16)
    }
}

/// A moment in steps of 64 µs, wrapping after 4.2 seconds: half the size of an [`Instant`], for checks in each turn.
#[derive(Clone, Copy, Debug, Default, PartialEq, Eq)]
pub struct Coarse(u16);

impl Coarse {
    /// Power-up.
    pub const ZERO: Self = Self(0);

    /// The moment this many milliseconds after power-up.
    #[cfg(test)]
    pub(crate) const fn at_ms(milliseconds: u32) -> Self {
        Instant::at_ms(milliseconds).coarse()
    }

    /// Steps in a second.
    pub const STEPS_PER_SECOND: u32 = Interval::STEPS_PER_SECOND >> 4;

    /// Milliseconds, at most 4193, in steps.
    pub const fn steps_in_ms(milliseconds: u16) -> u16 {
        (milliseconds as u32 * Self::STEPS_PER_SECOND / 1000) as u16
    }

    /// Steps since an earlier moment, which must be less than 4.2 seconds ago.
    pub const fn since(self, earlier: Self) -> u16 {
        self.0.wrapping_sub(earlier.0)
    }
}

/// A moment in steps of 1.024 ms, wrapping after 67 seconds.
#[derive(Clone, Copy, Debug, Default, PartialEq, Eq)]
pub struct Slow(u16);

impl Slow {
    /// Power-up.
    pub const ZERO: Self = Self(0);

    /// Steps since an earlier moment, which must be less than 67 seconds ago.
    pub const fn since(self, earlier: Self) -> u16 {
        self.0.wrapping_sub(earlier.0)
    }

    /// The moment this many steps before.
    pub const fn before(self, steps: u16) -> Self {
        Self(self.0.wrapping_sub(steps))
    }
}

/// A duration in steps of 4 µs.
#[derive(Clone, Copy, Debug, Default, PartialEq, Eq, PartialOrd, Ord)]
pub struct Interval(u32);

impl Interval {
    /// Steps of the clock in a second.
    pub const STEPS_PER_SECOND: u32 = 250_000;

    /// A duration of this many steps of 4 µs.
    pub const fn from_steps(steps: u32) -> Self {
        Self(steps)
    }

    /// A duration in milliseconds, at most 17 million.
    pub const fn from_ms(milliseconds: u32) -> Self {
        Self(milliseconds * (Self::STEPS_PER_SECOND / 1000))
    }

    /// The duration in steps of 4 µs.
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

/// A speed over the ground in units of remembered ground a second, positive forward: at most 13 m/s.
#[derive(Clone, Copy, Debug, Default, PartialEq, Eq, PartialOrd, Ord)]
pub struct Speed(pub i16);

impl Speed {
    /// Whether the machine is faster than `limit`, forward or back.
    #[cfg_attr(target_arch = "avr", inline(never))]
    pub fn is_beyond(self, limit: u16) -> bool {
        self.0.unsigned_abs() > limit
    }

    /// The distance rolled at this speed in this many milliseconds, at most one second.
    #[cfg_attr(target_arch = "avr", inline(never))]
    pub fn distance_in_ms(self, milliseconds: u16) -> Length {
        const SECOND_MS: NonZero<u16> = NonZero::new(1000).unwrap();
        // Divided without its sign, so that the chip needs one division routine only, the shorter.
        let magnitude = share(self.0.unsigned_abs(), milliseconds, SECOND_MS) as i16;
        Length(if self.0 < 0 { -magnitude } else { magnitude })
    }
}

/// The ground wheel and its encoder: converts between ticks and millimetres.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub struct Wheel {
    /// A tick in 2^-20 mm: 52,429 with 20,000 ticks a metre, 26 million with 40.
    tick: u32,
}

impl Wheel {
    /// pi as a fraction with an error of 8.5e-8, far below a tick over any distance here.
    const PI_NUMERATOR: u32 = 355;
    const PI_DENOMINATOR: u32 = 113;

    /// A wheel before the settings are loaded.
    pub const NONE: Self = Self { tick: 0 };

    /// A tick in 2^-20 mm, from the encoder's counts a turn, 100 to 10,000, and the wheel's diameter, 200 to 800 mm.
    pub(crate) const fn tick_of_diameter(ticks_per_rev: u16, diameter_mm: u16) -> u32 {
        let circumference = (((Self::PI_NUMERATOR * diameter_mm as u32) << 12) / Self::PI_DENOMINATOR) << 8;
        circumference / ticks_per_rev as u32
    }

    /// A tick in 2^-20 mm, from the calibrated counts a metre, 1 to 20,000.
    pub(crate) const fn tick_measured(ticks_per_m: u16) -> u32 {
        (1000 << 20) / ticks_per_m as u32
    }

    /// A wheel from its tick in 2^-20 mm.
    pub(crate) const fn of_tick(tick: u32) -> Self {
        Self { tick }
    }

    /// Millimetres in ticks, rounded to the nearest: `mm * ticks_per_rev / (pi * diameter)`, the paper's Eq. 1 and 2, or the
    /// calibrated value. Right to a tick up to 4 m.
    pub const fn ticks(self, millimetres: u16) -> Ticks {
        Self::ticks_of(self.tick, millimetres)
    }

    /// Millimetres in ticks of `tick` 2^-20 mm.
    #[cfg_attr(target_arch = "avr", inline(never))]
    pub(crate) const fn ticks_of(tick: u32, millimetres: u16) -> Ticks {
        Ticks((((millimetres as u32) << 20) + tick / 2).wrapping_div(tick) as i32)
    }

    /// A unit of a scale in 2^-16 mm.
    pub(crate) const fn unit(self, scale: LengthScale) -> u32 {
        (self.tick >> 4) << scale.shift
    }

    /// Ticks in millimetres, rounded toward zero, limited to 16 bits; right to 1 mm and 0.02 %. For the host: the chip converts a
    /// [`Length`] with [`Geometry::millimetres`](crate::ground::reach::Geometry::millimetres).
    pub const fn millimetres(self, distance: Ticks) -> i16 {
        let exact = (distance.0 as i64 * (self.tick >> 4) as i64) / (1 << 16);
        if exact > i16::MAX as i64 {
            i16::MAX
        } else if exact < -i16::MAX as i64 {
            -i16::MAX
        } else {
            exact as i16
        }
    }
}

/// `whole * part / of`, rounded down. A separate function, because the chip's routines need most of its registers.
#[cfg_attr(target_arch = "avr", inline(never))]
pub fn share(whole: u16, part: u16, of: NonZero<u16>) -> u32 {
    u32::from(whole) * u32::from(part) / NonZero::<u32>::from(of)
}

/// Adds one, and stops at 65,535.
#[expect(
    clippy::implicit_saturating_add,
    reason = "the compiler makes twice the code of `saturating_add` on this chip"
)]
pub fn count(number: &mut u16) {
    if *number < u16::MAX {
        *number += 1;
    }
}
