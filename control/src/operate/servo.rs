//! The servo's signal: pulse widths, and when a new one may be shown.
//!
//! A frame of 20 ms would hold a swing back by up to that. A servo needs no more than a short gap between two pulses, so a
//! new command may cut the frame short as soon as the line has been low for that gap. A pulse that has begun is never
//! changed.

/// A pulse width or a place in the frame, in steps of 0.5 us (Timer1 behind its prescaler of 8).
pub type HalfMicros = u16;

/// The frame's length: 20 ms, the customary 50 Hz.
pub const FRAME: HalfMicros = 40_000;

/// So close to its end that a frame is left to end by itself: 10 us.
const END: HalfMicros = FRAME - 20;

/// A pulse width given in microseconds.
pub const fn from_us(microseconds: u16) -> HalfMicros {
    microseconds * 2
}

/// What to do about a new pulse width.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub enum Action {
    /// Nothing yet: the last pulse, or the gap behind it, is still on the line.
    Wait,
    /// Give the new width to the next frame, which begins by itself.
    Change,
    /// Give the new width to a frame that begins now.
    Restart,
}

/// What to do about a new pulse width, `since_rise` after the last pulse of `width` began, with a servo that needs
/// `gap_ms` between pulses. A gap of 0 asks for fixed frames: none is cut short.
pub const fn action(since_rise: HalfMicros, width: HalfMicros, gap_ms: u8) -> Action {
    if since_rise >= END {
        Action::Change
    } else if since_rise < width || (since_rise - width) / from_us(1000) < gap_ms as u16 {
        Action::Wait
    } else if gap_ms == 0 {
        Action::Change
    } else {
        Action::Restart
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn a_pulse_has_two_steps_a_microsecond_and_a_frame_lasts_twenty_milliseconds() {
        assert_eq!((from_us(1500), from_us(20_000)), (3000, FRAME));
    }

    #[test]
    fn a_frame_is_cut_short_only_after_the_gap() {
        let width = from_us(1500);
        assert_eq!(action(0, width, 3), Action::Wait);
        assert_eq!(action(width + from_us(3000) - 1, width, 3), Action::Wait);
        assert_eq!(action(width + from_us(3000), width, 3), Action::Restart);
    }

    #[test]
    fn fixed_frames_are_never_cut_short() {
        let width = from_us(1500);
        assert_eq!(action(width - 1, width, 0), Action::Wait);
        for since_rise in width..FRAME {
            assert_eq!(action(since_rise, width, 0), Action::Change);
        }
    }

    #[test]
    fn a_frame_about_to_end_is_left_to_end() {
        assert_eq!(action(FRAME - 21, from_us(2000), 15), Action::Restart);
        assert_eq!(action(FRAME - 20, from_us(2000), 15), Action::Change);
    }
}
