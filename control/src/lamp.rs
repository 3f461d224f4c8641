//! The status LED: steady at work, a short flash a second in hold, and an alarm's code in flashes with a pause.

use crate::{controller::State, units::Instant};

/// Steps of about a quarter of a second in a code: a flash is one on and one off.
const PAUSE: u16 = 4;

/// Whether the LED shines.
pub fn is_lit(state: State, now: Instant) -> bool {
    // Shifts stand for divisions: 2^16 steps of 4 us are 262 ms.
    let quarter = (now.steps() >> 16) as u16;
    match state {
        State::Work => true,
        State::Hold => quarter.is_multiple_of(4) && now.steps() & 0x8000 == 0,
        State::Alarm(alarm) => {
            let flashes = 2 * u16::from(alarm.code());
            let step = quarter % (flashes + PAUSE);
            step < flashes && step.is_multiple_of(2)
        }
    }
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::{alarm::Alarm, units::Interval};

    #[test]
    fn an_alarm_is_blinked_as_its_code() {
        for index in 0..Alarm::COUNT {
            let alarm = Alarm::from_index(index).expect("an alarm");
            let length = u32::from(2 * u16::from(alarm.code()) + PAUSE);
            let lit = |step: u32| is_lit(State::Alarm(alarm), Instant::default() + Interval::from_steps(step << 16));
            let flashes = (0..length).filter(|&step| lit(step) && !lit(step + 1)).count();
            assert_eq!(flashes, usize::from(alarm.code()));
        }
    }
}
