//! The serial line on D0 and D1: 115200 baud, 8N1, moved by interrupts in both directions.
//!
//! Received bytes wait in one queue for the loop, bytes to send in another for the line. Nothing here ever waits: what
//! cannot be read or written at once is `WouldBlock`. A byte that comes in while its queue is full is lost, and
//! [`GAP_MARK`] stands where it would have been, so that a line with a hole in it is never taken for a whole one.

use crate::handover::Handover;
use avr_device::{
    atmega328p::{USART0, usart0},
    interrupt,
};
use control::console::GAP_MARK;
use core::{
    convert::Infallible,
    sync::atomic::{AtomicBool, Ordering},
};
use embedded_hal_nb::serial::{ErrorType, Read, Write};
use heapless::spsc::{Consumer, Producer, Queue};

/// Bytes received and not yet read: 5 ms of a full line.
pub type ReceiveQueue = Queue<u8, 64>;

/// Bytes to be sent: the longest line.
pub type SendQueue = Queue<u8, { control::reply::LINE + 1 }>;

/// Divisor for 115200 baud at double speed; off by 2.1 %, as on every Uno (data sheet, table 20-6).
const BAUD_DIVISOR: u16 = 16;

static RECEIVING: Handover<Producer<'static, u8>> = Handover::new();
static SENDING: Handover<Consumer<'static, u8>> = Handover::new();
/// Whether the last byte received found no room; the handler alone uses it.
static GAP: AtomicBool = AtomicBool::new(false);

/// The serial line, as the loop sees it.
pub struct Serial {
    usart: USART0,
    received: Consumer<'static, u8>,
    to_send: Producer<'static, u8>,
}

impl Serial {
    /// Opens the line.
    pub fn new(usart: USART0, received: &'static mut ReceiveQueue, to_send: &'static mut SendQueue) -> Self {
        let (receiving, received) = received.split();
        let (to_send, sending) = to_send.split();
        interrupt::free(|cs| {
            RECEIVING.give(cs, receiving);
            SENDING.give(cs, sending);
        });
        usart.ubrr0().write(|w| w.set(BAUD_DIVISOR));
        usart.ucsr0a().write(|w| w.u2x0().set_bit());
        usart.ucsr0c().write(|w| w.ucsz0().chr8());
        usart.ucsr0b().write(|w| w.rxen0().set_bit().txen0().set_bit().rxcie0().set_bit());
        Self { usart, received, to_send }
    }

    /// Bytes that can be written now.
    pub fn room(&self) -> usize {
        self.to_send.capacity() - self.to_send.len()
    }
}

impl ErrorType for Serial {
    type Error = Infallible;
}

impl Read for Serial {
    fn read(&mut self) -> nb::Result<u8, Infallible> {
        self.received.dequeue().ok_or(nb::Error::WouldBlock)
    }
}

impl Write for Serial {
    fn write(&mut self, byte: u8) -> nb::Result<(), Infallible> {
        self.to_send.enqueue(byte).map_err(|_| nb::Error::WouldBlock)?;
        // Not atomic, and need not be: the one bit that the handler changes is the one that is set here.
        self.usart.ucsr0b().modify(|_, w| w.udrie0().set_bit());
        Ok(())
    }

    fn flush(&mut self) -> nb::Result<(), Infallible> {
        if self.to_send.is_empty() { Ok(()) } else { Err(nb::Error::WouldBlock) }
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
    // SAFETY: the handlers use UDR0, which the loop does not touch, and UDRIE0, which may be set and cleared in any order.
    unsafe { &*USART0::ptr() }
}

/// A byte has come in.
///
/// # Safety
/// To be called by the handler of USART_RX alone.
pub unsafe fn on_received() {
    // An overrun of the hardware's own two bytes shows until UDR0 is read.
    let overrun = usart().ucsr0a().read().dor0().bit_is_set();
    let byte = usart().udr0().read().bits();
    // SAFETY: the caller is the handler that owns the receiving end.
    unsafe {
        RECEIVING.with(|queue| {
            let gap = (overrun || GAP.load(Ordering::Relaxed)) && queue.enqueue(GAP_MARK).is_err();
            GAP.store(gap || queue.enqueue(byte).is_err(), Ordering::Relaxed);
        });
    }
}

/// The line can take a byte.
///
/// # Safety
/// To be called by the handler of USART_UDRE alone.
pub unsafe fn on_ready_to_send() {
    // SAFETY: the caller is the handler that owns the sending end.
    unsafe {
        SENDING.with(|queue| {
            match queue.dequeue() {
                Some(byte) => usart().udr0().write(|w| w.set(byte)),
                None => usart().ucsr0b().modify(|_, w| w.udrie0().clear_bit()),
            };
        });
    }
}
