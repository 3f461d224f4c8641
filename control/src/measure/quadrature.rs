//! The quadrature decoder: turns the levels of two channels into steps of one tick, four a cycle.
//!
//! Forward is the sequence AB = 00, 10, 11, 01, 00. If both channels change at once, an edge was missed: a jump of two ticks. The
//! decoder continues in the direction of the last step. This is right unless the wheel reversed within those two edges. Without an
//! earlier step the direction is unknown, and the jump counts as lost.
//!
//! The firmware's interrupt looks up its steps in a table that the compiler makes from this decoder.
//!
//! At walking speed no edge is missed, and a jump is noise on both wires: the decoder adds two ticks at its start and two at its
//! end. The interrupt has no time, so it cannot tell the two apart. The [`Odometer`] removes these ticks when it reads the count.

use crate::units::{Position, Ticks};

/// Both channels' levels: A in bit 1, B in bit 0; values 0 to 3.
pub type Channels = u8;

/// The decoder's state: the phase of the cycle, and the last direction.
#[derive(Clone, Copy, Debug, Default)]
pub struct Quadrature {
    phase: u8,
    /// The last step, +1 or -1; 0 before the first.
    direction: i8,
}

/// The result of a step.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub enum Step {
    /// The wheel turned by this number of ticks, -2 to 2; 0 is no change.
    Ticks(i8),
    /// Both channels changed, and the direction is unknown: two ticks are lost.
    Lost,
}

impl Quadrature {
    /// A decoder that starts with these levels.
    pub const fn new(channels: Channels) -> Self {
        Self { phase: phase(channels), direction: 0 }
    }

    /// A decoder with these levels, whose last step was `direction`: 1, -1, or 0 for none.
    pub const fn moving(channels: Channels, direction: i8) -> Self {
        Self { phase: phase(channels), direction }
    }

    /// The last step: 1, -1, or 0 before the first.
    pub const fn direction(&self) -> i8 {
        self.direction
    }

    /// Takes the channels' levels. Returns how far the wheel turned since the last call.
    pub const fn step(&mut self, channels: Channels) -> Step {
        let now = phase(channels);
        let turned = now.wrapping_sub(self.phase) & 3;
        self.phase = now;
        match turned {
            0 => Step::Ticks(0),
            1 => {
                self.direction = 1;
                Step::Ticks(1)
            }
            3 => {
                self.direction = -1;
                Step::Ticks(-1)
            }
            _ if self.direction == 0 => Step::Lost,
            _ => Step::Ticks(2 * self.direction),
        }
    }
}

/// With more ticks than this in a turn, two noise spikes included, an edge may have been missed. A turn takes at least 0.2 ms, so
/// the ticks are then 12 us apart. The interrupt samples again within 8 us.
const CAN_BE_MISSED: u16 = 16;

/// At a speed of more than this distance a second an edge may be missed, so jumps count: edges are less than 50 us apart. No weeder
/// with an encoder of 0.2 mm or more is as fast.
pub const FAST: Ticks = Ticks(20_000);

/// Most ticks reported as doubted: more change nothing.
const MOST_DOUBTED: u16 = 32;

/// The machine's position: the encoder's count without the ticks that noise added.
#[derive(Clone, Debug)]
pub struct Odometer {
    /// The lower half of the count at the last reading, and the jumps until then.
    counted: u16,
    jumps: u16,
    /// Ticks added by noise.
    surplus: Ticks,
}

impl Odometer {
    /// An odometer before its first reading.
    pub const NONE: Self = Self { counted: 0, jumps: 0, surplus: Ticks::ZERO };

    /// An odometer that takes `counted` as correct.
    pub const fn new(counted: Position, jumps: u16) -> Self {
        let mut odometer = Self::NONE;
        odometer.init(counted, jumps);
        odometer
    }

    /// Starts, and takes `counted` as correct.
    pub const fn init(&mut self, counted: Position, jumps: u16) {
        (self.counted, self.jumps) = (counted.count() as u16, jumps);
    }

    /// Takes the count, and the number of jumps in it, modulo 65,536. Returns how many ticks came from jumps that are noise, at
    /// most 32; 0 for a wheel that `is_fast`.
    #[cfg_attr(target_arch = "avr", inline(never))]
    #[cfg_attr(not(target_arch = "avr"), inline)]
    pub fn read(&mut self, counted: Position, jumps: u16, is_fast: bool) -> u8 {
        let counted = counted.count() as u16;
        let moved = counted.wrapping_sub(self.counted).cast_signed();
        let jumped = jumps.wrapping_sub(self.jumps).wrapping_mul(2);
        (self.counted, self.jumps) = (counted, jumps);
        if jumped == 0 || is_fast || moved.unsigned_abs() > CAN_BE_MISSED {
            return 0;
        }
        let jumped = jumped.min(MOST_DOUBTED) as u8;
        // At most the distance moved: a trembling wheel may have stepped back in between.
        let added = Ticks((moved.unsigned_abs() as u8).min(jumped).into());
        self.surplus = if moved < 0 { self.surplus - added } else { self.surplus + added };
        jumped
    }

    /// The position for a count.
    #[cfg_attr(target_arch = "avr", inline(never))]
    #[cfg_attr(not(target_arch = "avr"), inline)]
    pub fn place(&self, counted: Position) -> Position {
        counted - self.surplus
    }
}

/// The phase of both channels' levels in the forward sequence, 0 to 3.
const fn phase(channels: Channels) -> u8 {
    let a = channels >> 1 & 1;
    let b = channels & 1;
    // Gray code to binary, with B the upper digit: 00, 10, 11, 01 become 0, 1, 2, 3.
    b << 1 | (a ^ b)
}

#[cfg(test)]
mod tests {
    use super::*;

    const FORWARD: [Channels; 4] = [0b00, 0b10, 0b11, 0b01];

    #[test]
    fn every_pair_of_levels_decodes_to_the_correct_step() {
        assert_eq!(Quadrature::new(0b00).direction(), 0);
        for from in 0..4 {
            for jump in 0..4 {
                for before in [-1, 0, 1] {
                    let (step, direction) = match (jump, before) {
                        (0, _) => (Step::Ticks(0), before),
                        (1, _) => (Step::Ticks(1), 1),
                        (3, _) => (Step::Ticks(-1), -1),
                        (_, 0) => (Step::Lost, 0),
                        (_, before) => (Step::Ticks(2 * before), before),
                    };
                    let mut decoder = Quadrature::moving(FORWARD[from], before);
                    assert_eq!(decoder.step(FORWARD[(from + jump) % 4]), step, "{from} {jump} {before}");
                    assert_eq!((decoder.phase as usize, decoder.direction()), ((from + jump) % 4, direction));
                }
            }
        }
    }

    /// The odometer's position after these counts and jumps, and the ticks that it removed.
    fn read(readings: &[(i32, u16)]) -> (i32, u8) {
        let mut odometer = Odometer::new(Position::new(readings[0].0), readings[0].1);
        let doubted = readings.iter().map(|&(count, jumps)| odometer.read(Position::new(count), jumps, false)).sum();
        (readings.last().map_or(0, |&(count, _)| odometer.place(Position::new(count)).count()), doubted)
    }

    #[test]
    fn at_walking_speed_a_jump_is_noise_in_both_directions() {
        assert_eq!(read(&[(100, 7), (101, 7), (106, 9), (107, 9)]), (103, 4));
        assert_eq!(read(&[(100, 7), (99, 7), (94, 9), (93, 9)]), (97, 4));
        assert_eq!(read(&[(0, u16::MAX), (-2, 0), (-4, 1)]), (0, 4), "at rest");
        assert_eq!(read(&[(32_767, 0), (32_770, 1), (32_772, 2)]), (32_768, 4), "across a wrap of the lower half");
    }

    #[test]
    fn a_jump_counts_if_an_edge_can_be_missed() {
        assert_eq!(read(&[(0, 0), (17, 1)]), (17, 0));
        assert_eq!(read(&[(0, 0), (-17, 1)]), (-17, 0));
        assert_eq!(read(&[(0, 0), (16, 1)]), (14, 2), "sixteen ticks in a turn are too few");
        let mut fast = Odometer::new(Position::new(0), 0);
        assert_eq!(fast.read(Position::new(6), 1, true), 0);
        assert_eq!(fast.place(Position::new(6)), Position::new(6));
    }

    #[test]
    fn a_jump_without_a_direction_adds_nothing() {
        assert_eq!(read(&[(0, 0), (0, 1), (-1, 1)]), (-1, 2));
        assert_eq!(read(&[(0, 0), (1, 1)]), (0, 2));
    }
}
