//! The serial line on D0 and D1: 115200 baud, 8N1, moved by interrupts in both directions.
//!
//! Received bytes wait in one queue for the loop, bytes to send in another for the line. Nothing here ever waits: what
//! cannot be read or written at once is `WouldBlock`. A byte that comes in while its queue is full is lost, and
//! [`GAP_MARK`] stands where it would have been, so that a line with a hole in it is never taken for a whole one.

use avr_device::{
    atmega328p::{USART0, usart0},
    interrupt::{self, CriticalSection, Mutex},
};
use control::console::GAP_MARK;
use core::{
    cell::{Cell, RefCell},
    convert::Infallible,
};
use embedded_hal_nb::serial::{ErrorType, Read, Write};
use heapless::spsc::Queue;

/// Divisor for 115200 baud at double speed; off by 2.1 %, as on every Uno (data sheet, table 20-6).
const BAUD_DIVISOR: u16 = 16;

/// Bytes received and not yet read: 5 ms of a full line. The queues are used as they are, not split into their ends: an end
/// does not know at compile time that its length is a power of two, and divides.
static RECEIVED: Mutex<RefCell<Queue<u8, 64>>> = Mutex::new(RefCell::new(Queue::new()));

/// Bytes to be sent: the longest line.
static TO_SEND: Mutex<RefCell<Queue<u8, { control::reply::LINE + 1 }>>> = Mutex::new(RefCell::new(Queue::new()));

/// Whether the last byte received found no room.
static GAP: Mutex<Cell<bool>> = Mutex::new(Cell::new(false));

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
    pub fn room(&self) -> usize {
        interrupt::free(|cs| {
            let queue = TO_SEND.borrow(cs).borrow();
            queue.capacity() - queue.len()
        })
    }
}

impl ErrorType for Serial {
    type Error = Infallible;
}

impl Read for Serial {
    fn read(&mut self) -> nb::Result<u8, Infallible> {
        interrupt::free(|cs| RECEIVED.borrow(cs).borrow_mut().dequeue()).ok_or(nb::Error::WouldBlock)
    }
}

impl Write for Serial {
    fn write(&mut self, byte: u8) -> nb::Result<(), Infallible> {
        interrupt::free(|cs| {
            TO_SEND.borrow(cs).borrow_mut().enqueue(byte).map_err(|_| nb::Error::WouldBlock)?;
            self.usart.ucsr0b().modify(|_, w| w.udrie0().set_bit());
            Ok(())
        })
    }

    fn flush(&mut self) -> nb::Result<(), Infallible> {
        let sent = interrupt::free(|cs| TO_SEND.borrow(cs).borrow().is_empty());
        if sent { Ok(()) } else { Err(nb::Error::WouldBlock) }
    }
}

/// Text for a line whose room was asked for; what does not fit is dropped rather than waited for.
impl ufmt::uWrite for Serial {
    type Error = Infallible;

    fn write_char(&mut self, character: char) -> Result<(), Infallible> {
        // The console speaks ASCII.
        let _ = self.write(character as u8);
        Ok(())
    }

    fn write_str(&mut self, text: &str) -> Result<(), Infallible> {
        for byte in text.bytes() {
            let _ = self.write(byte);
        }
        Ok(())
    }
}

/// The handlers' view of the USART.
fn usart() -> &'static usart0::RegisterBlock {
    // SAFETY: the handlers use UDR0, which the loop does not touch, and UDRIE0, which it sets with interrupts off.
    unsafe { &*USART0::ptr() }
}

// A byte has come in.
#[avr_device::interrupt(atmega328p)]
fn USART_RX() {
    // SAFETY: the chip turns interrupts off while a handler runs, and this one does not turn them on.
    let cs = unsafe { CriticalSection::new() };
    // An overrun of the hardware's own two bytes shows until UDR0 is read.
    let overrun = usart().ucsr0a().read().dor0().bit_is_set();
    let byte = usart().udr0().read().bits();
    let mut queue = RECEIVED.borrow(cs).borrow_mut();
    let gap = (overrun || GAP.borrow(cs).get()) && queue.enqueue(GAP_MARK).is_err();
    GAP.borrow(cs).set(gap || queue.enqueue(byte).is_err());
}

// The line can take a byte.
#[avr_device::interrupt(atmega328p)]
fn USART_UDRE() {
    // SAFETY: the chip turns interrupts off while a handler runs, and this one does not turn them on.
    let cs = unsafe { CriticalSection::new() };
    match TO_SEND.borrow(cs).borrow_mut().dequeue() {
        Some(byte) => usart().udr0().write(|w| w.set(byte)),
        None => usart().ucsr0b().modify(|_, w| w.udrie0().clear_bit()),
    };
}
