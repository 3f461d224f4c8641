//! The servo on D9: Timer1 in mode 14, pulses without jitter, in steps of 0.5 us.
//!
//! The timer counts to ICR1 and starts anew, sets the pin at the bottom and clears it at OCR1A (data sheet, 16.9.3); no
//! code runs for a pulse. OCR1A takes effect at the next bottom. To bring a command to the servo at once, the counter is
//! put just below the top as soon as the line has been low for the gap that the servo needs.
//!
//! Timer1's 16-bit registers share a byte of temporary storage (16.3): no interrupt may touch them, and none does.

use avr_device::atmega328p::{PORTB, TC1};
use control::servo::{FRAME, HalfMicros, may_restart};
use core::convert::Infallible;
use embedded_hal::pwm::{ErrorType, SetDutyCycle};

/// The servo's signal.
pub struct Servo {
    timer: TC1,
    /// What was last commanded.
    width: HalfMicros,
    /// The longer of this pulse and the last: what the running frame may be showing.
    longest: HalfMicros,
    /// Whether the command waits for a frame of its own.
    pending: bool,
}

impl Servo {
    /// Starts the signal with pulses of `width`.
    pub fn new(timer: TC1, port: &PORTB, width: HalfMicros) -> Self {
        // ICR1 before the mode: the counter never runs without a top.
        timer.icr1().write(|w| w.set(FRAME - 1));
        timer.ocr1a().write(|w| w.set(compare(width)));
        timer.tcnt1().write(|w| w.set(FRAME - 2));
        // SAFETY: WGM11 and WGM10 of mode 14.
        timer
            .tccr1a()
            .write(|w| unsafe { w.com1a().match_clear().wgm1().bits(0b10) });
        // SAFETY: WGM13 and WGM12 of mode 14.
        timer
            .tccr1b()
            .write(|w| unsafe { w.wgm1().bits(0b11).cs1().prescale_8() });
        port.ddrb().modify(|_, w| w.pb1().set_bit());
        Self {
            timer,
            width,
            longest: width,
            pending: false,
        }
    }

    /// Commands a pulse width, to be called each turn of the loop: a command that came during a pulse or its gap gets a
    /// frame of its own as soon as `gap_ms` allow. With a gap of 0 it waits for the running frame's end.
    pub fn command(&mut self, width: HalfMicros, gap_ms: u8) {
        if width != self.width {
            self.timer.ocr1a().write(|w| w.set(compare(width)));
            // Cleared after OCR1A was written: a frame that begins from here on shows the new width.
            self.timer.tifr1().write(|w| w.tov1().set_bit());
            self.longest = self.width.max(width);
            self.width = width;
            self.pending = true;
        }
        if !self.pending {
            return;
        }
        if self.timer.tifr1().read().tov1().bit_is_set() {
            self.pending = false;
        } else if may_restart(self.timer.tcnt1().read().bits(), self.longest, gap_ms) {
            self.timer.tcnt1().write(|w| w.set(FRAME - 2));
            self.pending = false;
        }
    }
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
