//! The status LED: steady in WORK, a short flash a second in HOLD. An alarm blinks its code: the first digit, a short pause, the
//! second digit, a long pause.

use crate::{operate::state::State, units::Instant};

/// Dark between the two digits of a code, and after the code, in quarters of a second. A flash is one quarter of light and one
/// dark.
const GAP: u16 = 2;
const PAUSE: u16 = 6;

/// Whether the LED is lit.
pub fn is_lit(state: State, now: Instant) -> bool {
    // A shift instead of a division: 2^16 steps of 4 us are 262 ms.
    let quarter = (now.steps() >> 16) as u16;
    match state {
        State::Work => true,
        State::Hold => quarter.is_multiple_of(4) && now.steps() & 0x8000 == 0,
        State::Alarm(alarm) => {
            let (first, second) = alarm.code();
            let (first, second) = (2 * u16::from(first), 2 * u16::from(second));
            let step = quarter % (first + GAP + second + PAUSE);
            let is_flashing = step < first || (first + GAP..first + GAP + second).contains(&step);
            is_flashing && step.is_multiple_of(2)
        }
    }
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::{alarm::Alarm, units::Interval};
    use std::{string::String, vec::Vec};

    #[test]
    fn an_alarm_is_blinked_as_its_codes_two_digits() {
        for alarm in (0..).map_while(Alarm::from_index) {
            let lit = |step: u32| is_lit(State::Alarm(alarm), Instant::default() + Interval::from_steps(step << 16));
            let (first, second) = alarm.code();
            let length = u32::from(2 * u16::from(first + second) + GAP + PAUSE);
            let seen: String = (0..2 * length).map(|step| if lit(step) { '*' } else { ' ' }).collect();
            let flashes = |digit: u8| "* ".repeat(usize::from(digit));
            let code = flashes(first) + "  " + &flashes(second) + "      ";
            assert_eq!(seen, code.repeat(2), "{alarm:?}");
            // Counted as a person does: more than one dark quarter separates digits.
            let counted: Vec<usize> =
                seen.split("  ").map(|digit| digit.matches('*').count()).filter(|&n| n > 0).collect();
            assert_eq!(counted, [first, second, first, second].map(usize::from));
        }
    }

    #[test]
    fn hold_is_a_flash_of_an_eighth_of_a_second_each_second() {
        // An eighth is 2^15 steps here, and a second eight of them.
        let lit = |step: u32| is_lit(State::Hold, Instant::default() + Interval::from_steps(step << 12));
        let seen: String = (0..128).map(|step| if lit(step) { '*' } else { ' ' }).collect();
        let second = "*".repeat(8) + &" ".repeat(56);
        assert_eq!(seen, second.repeat(2));
    }
}
