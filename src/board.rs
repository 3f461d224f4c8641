//! The pins that the loop reads and sets: work switch (D4), end switch (D5) and status LED (D13).
//!
//! Encoder (D2, D3) and beams (D8, D10) belong to their interrupts. D9 is the servo timer's, D0 and D1 the USART's. Encoder and
//! beams have external pull-ups; only the switches use internal ones.

use avr_device::{
    asm,
    atmega328p::{PORTB, PORTD, portb},
};
use core::convert::Infallible;
use embedded_hal::digital::{ErrorType, InputPin, OutputPin};

/// 10 ms, in which the pull-ups charge the cables, and the capacitors of debounced contacts, before the first reading. An open work
/// switch would else be read as closed, and opening it clears an alarm.
const PULL_UP_CYCLES: u32 = 160_000;

/// The status LED on D13 (PB5), lit when high.
pub struct Lamp<'a>(&'a portb::RegisterBlock);

/// A switch that connects its pin of port D to ground when closed. The bit is part of the type, so it takes no room in the loop's
/// stack frame.
pub struct Switch<'a, const BIT: u8>(&'a PORTD);

/// The pins after setup.
pub struct Pins<'a> {
    /// The status LED, dark.
    pub lamp: Lamp<'a>,
    /// The work switch on D4 (PD4), low = work.
    pub work_switch: Switch<'a, 4>,
    /// The end switch on D5 (PD5), low = the tool is out.
    pub end_switch: Switch<'a, 5>,
}

/// Sets the pins up.
pub fn pins<'a>(port_b: &'a PORTB, port_d: &'a PORTD) -> Pins<'a> {
    port_b.ddrb.modify(|_, w| w.pb5().set_bit());
    port_d.portd.modify(|_, w| w.pd4().set_bit().pd5().set_bit());
    asm::delay_cycles(PULL_UP_CYCLES);
    Pins { lamp: Lamp(port_b), work_switch: Switch(port_d), end_switch: Switch(port_d) }
}

impl ErrorType for Lamp<'_> {
    type Error = Infallible;
}

impl OutputPin for Lamp<'_> {
    fn set_low(&mut self) -> Result<(), Infallible> {
        self.0.portb.modify(|_, w| w.pb5().clear_bit());
        Ok(())
    }

    fn set_high(&mut self) -> Result<(), Infallible> {
        self.0.portb.modify(|_, w| w.pb5().set_bit());
        Ok(())
    }
}

impl<const BIT: u8> ErrorType for Switch<'_, BIT> {
    type Error = Infallible;
}

impl<const BIT: u8> InputPin for Switch<'_, BIT> {
    fn is_high(&mut self) -> Result<bool, Infallible> {
        self.is_low().map(|low| !low)
    }

    fn is_low(&mut self) -> Result<bool, Infallible> {
        Ok(self.0.pind.read().bits() & (1 << BIT) == 0)
    }
}
