//! The servo on D9: Timer1 in mode 14, in steps of 0.5 us, with pulses free of jitter.
//!
//! The timer counts up to ICR1 and restarts. It sets the pin at 0 and clears it at OCR1A (data sheet, 16.9.3). No code runs for a
//! pulse. A new OCR1A takes effect at the next 0. For an immediate pulse the loop sets the counter just below ICR1, once the line
//! was low for the servo's gap. A running pulse is never changed.
//!
//! Timer1's 16-bit registers share a temporary byte (16.3). So no interrupt may access them, except one that never returns
//! ([`end_with`]).

use avr_device::{
    atmega328p::{PORTB, TC1},
    interrupt,
};
use control::operate::servo::{self, Action, FRAME, HalfMicros};

/// From here on, 5 us before its end, a frame ends by itself. This is longer than the time from reading the counter to setting it.
/// A width written later could miss the restart, and appear one frame later.
const TOO_LATE: HalfMicros = FRAME - 10;

/// The servo's signal.
pub struct Servo {
    timer: TC1,
    /// The pulse width of the running frame.
    width: HalfMicros,
}

impl Servo {
    /// Starts the signal with pulses of `width`.
    pub fn new(timer: TC1, port: &PORTB, width: HalfMicros) -> Self {
        // The pin before the timer, so that the first pulse is complete.
        port.ddrb.modify(|_, w| w.pb1().set_bit());
        // OCR1A before the mode: in mode 14 a new one takes effect at the next restart.
        timer.ocr1a.write(|w| w.bits(compare(width)));
        // WGM11 and WGM10 of mode 14.
        timer.tccr1a.write(|w| w.com1a().match_clear().wgm1().bits(0b10));
        // WGM13 and WGM12 of mode 14. Only a mode with ICR1 as its top lets it be written (data sheet, 16.6.3).
        timer.tccr1b.write(|w| w.wgm1().bits(0b11));
        timer.icr1.write(|w| w.bits(FRAME - 1));
        timer.tcnt1.write(|w| w.bits(FRAME - 2));
        // The clock last, so that the counter has a top.
        timer.tccr1b.modify(|_, w| w.cs1().prescale_8());
        Self { timer, width }
    }

    /// Commands a pulse width. The loop calls it each turn: during a pulse or its gap the command waits until `gap_ms` allows a new
    /// frame. With a gap of 0 it waits for the running frame's end.
    pub fn command(&mut self, width: HalfMicros, gap_ms: u8) {
        if width == self.width {
            return;
        }
        let since_rise = self.timer.tcnt1.read().bits();
        let action = servo::action(since_rise, self.width, gap_ms);
        if action == Action::Wait {
            return;
        }
        if since_rise < TOO_LATE
            && change(&self.timer, since_rise, TOO_LATE - since_rise, compare(width), action == Action::Restart)
        {
            self.width = width;
        }
    }
}

/// Sets the compare value for the next frame, and ends the running frame now if `restart`. Returns false if `left` has passed since
/// `since_rise` was read: the frame has then ended or is about to, and the command waits for the next pulse.
///
/// No interrupt may come between reading and setting the counter. The encoder waits for that, so its arguments are calculated
/// before. At most 22 cycles run without interrupts.
#[inline(never)]
fn change(timer: &TC1, since_rise: HalfMicros, left: HalfMicros, compare: u16, restart: bool) -> bool {
    interrupt::free(|_| {
        // In a new frame the counter is much smaller, so this difference wraps to a large number.
        if timer.tcnt1.read().bits().wrapping_sub(since_rise) >= left {
            return false;
        }
        timer.ocr1a.write(|w| w.bits(compare));
        if restart {
            timer.tcnt1.write(|w| w.bits(FRAME - 2));
        }
        true
    })
}

/// Sends one or two pulses of `width`, then stops the signal after a complete pulse, within three frames.
///
/// # Safety
///
/// The caller has turned interrupts off, and the loop never continues: it may have been interrupted inside an access to a 16-bit
/// register of Timer1. The timer must run.
pub unsafe fn end_with(width: HalfMicros) {
    // SAFETY: the caller guarantees that no other code uses the timer any more.
    let timer = unsafe { &*TC1::ptr() };
    timer.ocr1a.write(|w| w.bits(compare(width)));
    let since_rise = || timer.tcnt1.read().bits();
    // The running pulse, or the next one, may be the first of this width.
    for _ in 0..2 {
        while since_rise() >= width {}
        while since_rise() < width {}
    }
    // SAFETY: without a clock, timer and pin keep their state.
    timer.tccr1b.write(|w| unsafe { w.bits(0) });
}

/// OCR1A for a pulse of `width`: the pin is high from 0 through the match. No width is 0: the settings begin at 500 us.
const fn compare(width: HalfMicros) -> u16 {
    width - 1
}
