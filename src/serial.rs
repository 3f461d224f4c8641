//! The serial line on D0 and D1: 115200 baud, 8N1, moved by interrupts in both directions.
//!
//! Received bytes wait in one queue for the loop, bytes to send in another for the line. Nothing here ever waits: what
//! cannot be read or written at once is `WouldBlock`. A byte that comes in while its queue is full is lost, and
//! [`GAP_MARK`] stands where the first such byte would have been, so that a line with a hole in it is never taken for a
//! whole one.

use crate::{ring::Ring, shared::Byte};
use avr_device::atmega328p::{USART0, usart0};
use control::console::GAP_MARK;
use core::convert::Infallible;
use embedded_hal_nb::serial::{ErrorType, Read, Write};

/// Divisor for 115200 baud at double speed; off by 2.1 %, as on every Uno (data sheet, table 20-6).
const BAUD_DIVISOR: u16 = 16;

/// Bytes received and not yet read: 5 ms of a full line. The last slot is kept for a mark.
static RECEIVED: Ring<RECEIVED_SLOTS> = Ring::new();
static RECEIVED_BYTES: [Byte; RECEIVED_SLOTS] = [const { Byte::new(0) }; RECEIVED_SLOTS];
const RECEIVED_SLOTS: usize = 64;

/// Bytes to be sent: 2.8 ms of a full line, in which the loop turns some times.
static TO_SEND: Ring<TO_SEND_SLOTS> = Ring::new();
static TO_SEND_BYTES: [Byte; TO_SEND_SLOTS] = [const { Byte::new(0) }; TO_SEND_SLOTS];
const TO_SEND_SLOTS: usize = 32;

/// The serial line, as the loop sees it.
pub struct Serial {
    usart: USART0,
}

impl Serial {
    /// Opens the line.
    pub fn new(usart: USART0) -> Self {
        usart.ubrr0().write(|w| w.set(BAUD_DIVISOR));
        usart.ucsr0a().write(|w| w.u2x0().set_bit());
        usart.ucsr0c().write(|w| w.ucsz0().chr8());
        usart.ucsr0b().write(|w| w.rxen0().set_bit().txen0().set_bit().rxcie0().set_bit());
        Self { usart }
    }

    /// Bytes that can be written now.
    pub fn room(&self) -> u8 {
        TO_SEND.room()
    }
}

impl ErrorType for Serial {
    type Error = Infallible;
}

impl Read for Serial {
    fn read(&mut self) -> nb::Result<u8, Infallible> {
        RECEIVED.take(|slot| RECEIVED_BYTES[slot].get()).ok_or(nb::Error::WouldBlock)
    }
}

impl Write for Serial {
    fn write(&mut self, byte: u8) -> nb::Result<(), Infallible> {
        if !TO_SEND.push(|slot, _| TO_SEND_BYTES[slot].set(byte)) {
            return Err(nb::Error::WouldBlock);
        }
        // Should the handler come in here and turn itself off, it is called once more and finds the queue empty.
        self.usart.ucsr0b().modify(|_, w| w.udrie0().set_bit());
        Ok(())
    }

    fn flush(&mut self) -> nb::Result<(), Infallible> {
        if TO_SEND.is_empty() { Ok(()) } else { Err(nb::Error::WouldBlock) }
    }
}

/// Text, a character at a time: one for which there is no room is refused, as nothing here waits.
impl ufmt::uWrite for Serial {
    type Error = nb::Error<Infallible>;

    fn write_str(&mut self, text: &str) -> Result<(), Self::Error> {
        text.bytes().try_for_each(|byte| self.write(byte))
    }

    fn write_char(&mut self, character: char) -> Result<(), Self::Error> {
        // The console speaks ASCII.
        self.write(character as u8)
    }
}

/// The handlers' view of the USART.
#[inline(always)]
fn usart() -> &'static usart0::RegisterBlock {
    // SAFETY: the handlers use UDR0, which the loop does not touch, and UDRIE0, which the loop only ever sets.
    unsafe { &*USART0::ptr() }
}

// A byte has come in. At most 90 cycles.
#[avr_device::interrupt(atmega328p)]
fn USART_RX() {
    // An overrun of the hardware's own two bytes shows until UDR0 is read. The byte is then not the next one of its line,
    // and a mark in its place tells so as well as one before it.
    let overrun = usart().ucsr0a().read().dor0().bit_is_set();
    let mut byte = usart().udr0().read().bits();
    // What finds no room is behind a mark already.
    let _ = RECEIVED.push(|slot, room| {
        if overrun || room == 1 {
            byte = GAP_MARK;
        }
        RECEIVED_BYTES[slot].set(byte);
    });
}

// The line can take a byte. At most 70 cycles.
#[avr_device::interrupt(atmega328p)]
fn USART_UDRE() {
    match TO_SEND.take(|slot| TO_SEND_BYTES[slot].get()) {
        Some(byte) => usart().udr0().write(|w| w.set(byte)),
        None => usart().ucsr0b().modify(|_, w| w.udrie0().clear_bit()),
    };
}
