//! The quadrature decoder: from two channels to steps of one tick, four a cycle.
//!
//! Forward is the sequence AB = 00, 10, 11, 01, 00. A change of both channels at once means that an edge was missed: a
//! jump of two. It is taken to go on in the direction of the last step, which is right as long as the wheel did not turn
//! round within those two edges; with no step before it, its direction is unknown and it is counted as lost.
//!
//! The firmware's interrupt looks its steps up in a table that the compiler makes of this decoder.

/// Both channels' levels: A in bit 1, B in bit 0; values 0 to 3.
pub type Channels = u8;

/// The decoder's memory: where in the cycle the channels stood, and which way they last turned.
#[derive(Clone, Copy, Debug, Default)]
pub struct Quadrature {
    phase: u8,
    /// The last step, +1 or -1; 0 before the first.
    direction: i8,
}

/// What a look at the channels told.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub enum Step {
    /// The wheel turned by so many ticks, -2 to 2; 0 is no change.
    Ticks(i8),
    /// Both channels changed and nothing tells which way: two ticks are lost.
    Lost,
}

impl Quadrature {
    /// A decoder whose channels now stand at `channels`.
    pub const fn new(channels: Channels) -> Self {
        Self { phase: phase(channels), direction: 0 }
    }

    /// A decoder whose channels stand at `channels` and whose last step was `direction`: 1, -1, or 0 for none.
    pub const fn moving(channels: Channels, direction: i8) -> Self {
        Self { phase: phase(channels), direction }
    }

    /// The last step: 1, -1, or 0 before the first.
    pub const fn direction(&self) -> i8 {
        self.direction
    }

    /// Takes the channels' levels and tells how far the wheel turned since the last look.
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

/// The place of both channels' levels in the forward sequence, 0 to 3.
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
    fn every_pair_of_levels_is_decoded_as_the_sequence_says() {
        for from in 0..4 {
            for jump in 0..4 {
                for direction in [-1, 0, 1] {
                    let mut decoder = Quadrature { phase: from as u8, direction };
                    let expected = match (jump, direction) {
                        (0, _) => Step::Ticks(0),
                        (1, _) => Step::Ticks(1),
                        (3, _) => Step::Ticks(-1),
                        (_, 0) => Step::Lost,
                        (_, direction) => Step::Ticks(2 * direction),
                    };
                    assert_eq!(decoder.step(FORWARD[(from + jump) % 4]), expected, "{from} {jump} {direction}");
                    assert_eq!(decoder.phase as usize, (from + jump) % 4);
                }
            }
        }
    }

    #[test]
    fn a_jump_goes_on_in_the_direction_of_the_step_before_it() {
        let mut decoder = Quadrature::new(0b00);
        assert_eq!(decoder.step(0b11), Step::Lost);
        assert_eq!(decoder.step(0b10), Step::Ticks(-1));
        assert_eq!(decoder.step(0b01), Step::Ticks(-2));
        assert_eq!(decoder.step(0b00), Step::Ticks(1));
        assert_eq!(decoder.step(0b11), Step::Ticks(2));
    }
}
