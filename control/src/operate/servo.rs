//! The servo's signal: pulse widths, and when a new width may start.
//!
//! With fixed frames of 20 ms a swing would wait for up to 20 ms. A servo needs only a short gap between two pulses. So a new
//! command may end the frame once the line has been low for that gap. A pulse that has begun is never changed.

/// A pulse width or a time in the frame, in steps of 0.5 us (Timer1 with a prescaler of 8).
pub type HalfMicros = u16;

/// The frame's length: 20 ms, the usual 50 Hz.
pub const FRAME: HalfMicros = 40_000;

/// From here on, 10 us before its end, a frame ends by itself.
const END: HalfMicros = FRAME - 20;

/// A pulse width given in microseconds.
pub const fn from_us(microseconds: u16) -> HalfMicros {
    microseconds * 2
}

/// What to do with a new pulse width.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub enum Action {
    /// Nothing yet: the last pulse or its gap is still on the line.
    Wait,
    /// Set the width for the next frame, which begins by itself.
    Change,
    /// Set the width and start a new frame now.
    Restart,
}

/// What to do with a new pulse width. `since_rise` is the time since the last pulse of `width` began, and `gap_ms` the servo's
/// shortest gap between pulses; 0 for fixed frames.
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
    fn a_pulse_step_is_half_a_microsecond_and_a_frame_is_20_ms() {
        assert_eq!((from_us(1500), from_us(20_000)), (3000, FRAME));
    }

    #[test]
    fn a_frame_is_cut_short_only_after_the_gap_and_a_fixed_frame_never() {
        let (width, wider) = (from_us(1500), from_us(2000));
        for (since_rise, width, gap_ms, expected) in [
            (0, width, 3, Action::Wait),
            (width + from_us(3000) - 1, width, 3, Action::Wait),
            (width + from_us(3000), width, 3, Action::Restart),
            (width - 1, width, 0, Action::Wait),
            // A frame about to end is left to end.
            (FRAME - 21, wider, 15, Action::Restart),
            (FRAME - 20, wider, 15, Action::Change),
        ] {
            assert_eq!(action(since_rise, width, gap_ms), expected, "{since_rise} of {width}");
        }
        for since_rise in width..FRAME {
            assert_eq!(action(since_rise, width, 0), Action::Change);
        }
    }
}
