//! The servo's signal: pulse widths, and when a frame may begin anew.
//!
//! A frame of 20 ms would hold a swing back by up to that. A servo needs no more than a short gap between two pulses, so a
//! new command may cut the frame short as soon as the line has been low for that gap.

/// A pulse width or a place in the frame, in steps of 0.5 us (Timer1 behind its prescaler of 8).
pub type HalfMicros = u16;

/// The frame's length: 20 ms, the customary 50 Hz.
pub const FRAME: HalfMicros = 40_000;

/// A pulse width given in microseconds.
pub const fn from_us(microseconds: u16) -> HalfMicros {
    microseconds * 2
}

/// Whether a new frame may begin `since_rise` after the last pulse of `width` began, to a servo that needs `gap_ms`
/// between pulses. A gap of 0 asks for fixed frames: no frame is ever cut short.
pub const fn may_restart(since_rise: HalfMicros, width: HalfMicros, gap_ms: u8) -> bool {
    gap_ms != 0 && since_rise >= width.saturating_add(from_us(1000).saturating_mul(gap_ms as u16))
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn a_frame_is_cut_short_only_after_the_gap() {
        let width = from_us(1500);
        assert!(!may_restart(width + from_us(3000) - 1, width, 3));
        assert!(may_restart(width + from_us(3000), width, 3));
        assert!(!may_restart(FRAME - 1, width, 0), "fixed frames");
    }
}
