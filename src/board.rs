//! The pins that are read and set by the loop: work switch (D4) and status LED (D13).
//!
//! Encoder (D2, D3) and beam (D8) belong to their interrupts, D9 to the servo's timer, D0 and D1 to the USART. The
//! encoder's and the beam's pull-ups stand outside, on the board; only the switch uses the one inside the chip.

use avr_device::atmega328p::{PORTB, PORTD, portb, portd};
use core::convert::Infallible;
use embedded_hal::digital::{ErrorType, InputPin, OutputPin, PinState};

/// The status LED on D13 (PB5), lit when high.
pub struct Lamp<'a>(&'a portb::RegisterBlock);

/// The work switch on D4 (PD4), low = work.
pub struct WorkSwitch<'a>(&'a portd::RegisterBlock);

/// Sets the pins up: the LED dark, the switch pulled up.
pub fn pins<'a>(port_b: &'a PORTB, port_d: &'a PORTD) -> (Lamp<'a>, WorkSwitch<'a>) {
    port_b.ddrb().modify(|_, w| w.pb5().set_bit());
    port_d.portd().modify(|_, w| w.pd4().set_bit());
    (Lamp(port_b), WorkSwitch(port_d))
}

impl ErrorType for Lamp<'_> {
    type Error = Infallible;
}

impl OutputPin for Lamp<'_> {
    fn set_low(&mut self) -> Result<(), Infallible> {
        self.0.portb().modify(|_, w| w.pb5().clear_bit());
        Ok(())
    }

    fn set_high(&mut self) -> Result<(), Infallible> {
        self.0.portb().modify(|_, w| w.pb5().set_bit());
        Ok(())
    }

    fn set_state(&mut self, state: PinState) -> Result<(), Infallible> {
        match state {
            PinState::Low => self.set_low(),
            PinState::High => self.set_high(),
        }
    }
}

impl ErrorType for WorkSwitch<'_> {
    type Error = Infallible;
}

impl InputPin for WorkSwitch<'_> {
    fn is_high(&mut self) -> Result<bool, Infallible> {
        Ok(self.0.pind().read().pd4().bit_is_set())
    }

    fn is_low(&mut self) -> Result<bool, Infallible> {
        Ok(self.0.pind().read().pd4().bit_is_clear())
    }
}
