//! The servo on D9: Timer1 in mode 14, pulses without jitter, in steps of 0.5 us.
//!
//! The timer counts to ICR1 and starts anew, sets the pin at the bottom and clears it at OCR1A (data sheet, 16.9.3); no
//! code runs for a pulse. OCR1A takes effect at the next bottom. To bring a command to the servo at once, the counter is
//! put just below the top as soon as the line has been low for the gap that the servo needs. A running pulse is left alone.
//!
//! Timer1's 16-bit registers share a byte of temporary storage (16.3): no interrupt may touch them, but one that never
//! returns ([`end_with`]).

use avr_device::{
    atmega328p::{PORTB, TC1},
    interrupt,
};
use control::operate::servo::{self, Action, FRAME, HalfMicros};
use core::convert::Infallible;
use embedded_hal::pwm::{ErrorType, SetDutyCycle};

/// So close to its end a frame ends by itself: 5 us, more than setting the counter takes from reading it. A width that is written then
/// may come behind the bottom, and would not be on the line before the next.
const TOO_LATE: HalfMicros = FRAME - 10;

/// The servo's signal.
pub struct Servo {
    timer: TC1,
    /// The width that the running frame shows.
    width: HalfMicros,
}

impl Servo {
    /// Starts the signal with pulses of `width`.
    pub fn new(timer: TC1, port: &PORTB, width: HalfMicros) -> Self {
        // The pin before the timer: the first pulse is whole then.
        port.ddrb().modify(|_, w| w.pb1().set_bit());
        // ICR1 before the mode: the counter never runs without a top.
        timer.icr1().write(|w| w.set(FRAME - 1));
        timer.ocr1a().write(|w| w.set(compare(width)));
        timer.tcnt1().write(|w| w.set(FRAME - 2));
        // SAFETY: WGM11 and WGM10 of mode 14.
        timer.tccr1a().write(|w| unsafe { w.com1a().match_clear().wgm1().bits(0b10) });
        // SAFETY: WGM13 and WGM12 of mode 14.
        timer.tccr1b().write(|w| unsafe { w.wgm1().bits(0b11).cs1().prescale_8() });
        Self { timer, width }
    }

    /// Commands a pulse width, to be called each turn of the loop: a command that comes during a pulse or its gap waits
    /// until `gap_ms` allow it a frame of its own; with a gap of 0, until the running frame's end.
    pub fn command(&mut self, width: HalfMicros, gap_ms: u8) {
        if width == self.width {
            return;
        }
        let since_rise = self.timer.tcnt1().read().bits();
        let action = servo::action(since_rise, self.width, gap_ms);
        if action == Action::Wait {
            return;
        }
        let left = TOO_LATE.saturating_sub(since_rise);
        if change(&self.timer, since_rise, left, compare(width), action == Action::Restart) {
            self.width = width;
        }
    }
}

/// Has the timer compare with another value from the frame's end on, and has the frame end at once where it is to start anew.
/// Returns whether it did: not where `left` has passed since `since_rise` was read. The frame has ended then, or is about to, and
/// the command waits for the next pulse.
///
/// No interrupt may come between reading the counter and setting it. The encoder waits for that, so it is a function of its own:
/// what it is given was worked out before. At most 22 cycles are without interrupts.
#[inline(never)]
fn change(timer: &TC1, since_rise: HalfMicros, left: HalfMicros, compare: u16, restart: bool) -> bool {
    interrupt::free(|_| {
        // A new frame counts from 0: less than the last one had by far.
        if timer.tcnt1().read().bits().wrapping_sub(since_rise) >= left {
            return false;
        }
        timer.ocr1a().write(|w| w.set(compare));
        if restart {
            timer.tcnt1().write(|w| w.set(FRAME - 2));
        }
        true
    })
}

/// Shows a pulse or two of `width` and then no more: the signal ends with a whole pulse, within three frames.
///
/// # Safety
///
/// To be called with interrupts off, where the loop never goes on: it may stand between two halves of a register of Timer1.
/// The timer must run.
pub unsafe fn end_with(width: HalfMicros) {
    // SAFETY: the caller vouches that nobody else uses the timer any more.
    let timer = unsafe { &*TC1::ptr() };
    timer.ocr1a().write(|w| w.set(compare(width)));
    let since_rise = || timer.tcnt1().read().bits();
    // The pulse that is on the line, or else the next one, may be the first of this width.
    for _ in 0..2 {
        while since_rise() >= width {}
        while since_rise() < width {}
    }
    // SAFETY: without a clock, the timer and the pin stay as they are.
    timer.tccr1b().write(|w| unsafe { w.bits(0) });
}

/// OCR1A for a pulse of `width`: the pin is high from 0 up to and with the match.
const fn compare(width: HalfMicros) -> u16 {
    width.saturating_sub(1)
}

impl ErrorType for Servo {
    type Error = Infallible;
}

impl SetDutyCycle for Servo {
    /// A frame in steps of 0.5 us.
    fn max_duty_cycle(&self) -> u16 {
        FRAME
    }

    /// Commands a pulse width that waits for the running frame's end.
    fn set_duty_cycle(&mut self, duty: u16) -> Result<(), Infallible> {
        self.command(duty, 0);
        Ok(())
    }
}
