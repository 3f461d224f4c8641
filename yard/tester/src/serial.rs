//! The serial line on D0 and D1: 115200 baud, 8N1. Received bytes wait in a queue, and bytes to send go straight to the transmitter.
//!
//! A byte is lost if the queue is full. Its frame then has a wrong CRC, and the computer sends it again.

use avr_device::{
    atmega328p::USART0,
    interrupt::{self, Mutex},
};
use core::cell::RefCell;
use heapless::Deque;

/// Divisor for 115200 baud at double speed; off by 2.1 %, as on every Uno (data sheet, table 20-6).
const BAUD_DIVISOR: u16 = 16;

/// UCSR0B: receiver and transmitter on, and the interrupt for a received byte.
const CONTROL: u8 = 0b1001_1000;

/// Received bytes: the longest command, and half of the next.
static RECEIVED: Mutex<RefCell<Deque<u8, 96>>> = Mutex::new(RefCell::new(Deque::new()));

/// The serial line.
pub struct Serial(USART0);

impl Serial {
    /// Opens the line.
    pub fn new(usart: USART0) -> Self {
        usart.ubrr0.write(|w| w.bits(BAUD_DIVISOR));
        usart.ucsr0a.write(|w| w.u2x0().set_bit());
        usart.ucsr0c.write(|w| w.ucsz0().chr8());
        // SAFETY: the bits switch the line and its interrupt, whose handler is below.
        usart.ucsr0b.write(|w| unsafe { w.bits(CONTROL) });
        Self(usart)
    }

    /// The oldest received byte.
    pub fn read(&mut self) -> Option<u8> {
        interrupt::free(|cs| RECEIVED.borrow(cs).borrow_mut().pop_front())
    }

    /// Sends a byte, if the transmitter is free. Returns whether it was sent.
    pub fn write(&mut self, byte: u8) -> bool {
        let is_free = self.0.ucsr0a.read().udre0().bit_is_set();
        if is_free {
            self.0.udr0.write(|w| w.bits(byte));
        }
        is_free
    }
}

// A byte was received.
#[avr_device::interrupt(atmega328p)]
fn USART_RX() {
    // SAFETY: only this handler reads UDR0.
    let byte = unsafe { (*USART0::ptr()).udr0.read().bits() };
    interrupt::free(|cs| {
        let _ = RECEIVED.borrow(cs).borrow_mut().push_back(byte);
    });
}
