//! The serial line on D0 and D1: 115200 baud, 8N1, moved by interrupts in both directions.
//!
//! Received bytes wait in one queue for the loop, bytes to send in another for the line. Nothing here ever waits: what
//! cannot be read or written at once is `WouldBlock`. A byte that comes in while its queue is full is lost, and
//! [`GAP_MARK`] stands where the first such byte would have been, so that a line with a hole in it is never taken for a
//! whole one.

use crate::{handler::handler, ring::Ring, shared::Byte};
use avr_device::atmega328p::USART0;
use control::say::command::GAP_MARK;
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

/// The two values of UCSR0B, each of which is written whole, so that loop and handler never spoil each other's: both
/// directions on, with the interrupt for what is received alone, and with the one for a free transmitter as well.
///
/// That one is on only while a byte waits to be sent. The chip would call its handler again and again for an empty queue;
/// simulators that take the request back when the handler is entered would never call it again. So the handler turns it
/// off with the last byte that it takes, and the loop turns it on behind a byte that it has pushed. In between the
/// handler could come in, take that byte and leave; the loop would then turn it on for nothing. So the loop turns it
/// off before.
const RECEIVING: u8 = 0b1001_1000; // RXCIE0, RXEN0, TXEN0
const SENDING: u8 = RECEIVING | 1 << 5; // UDRIE0

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
        let serial = Self { usart };
        serial.control(RECEIVING);
        serial
    }

    fn control(&self, bits: u8) {
        // SAFETY: the two values switch the line and its interrupts alone, whose handlers are below.
        self.usart.ucsr0b().write(|w| unsafe { w.bits(bits) });
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
        self.control(RECEIVING);
        let kept = TO_SEND.push(|slot| TO_SEND_BYTES[slot].set(byte));
        // One that was not kept met a full queue.
        self.control(SENDING);
        if kept { Ok(()) } else { Err(nb::Error::WouldBlock) }
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

handler! {
    /// A byte has come in: 46 cycles, 51 where it finds one slot left and becomes the mark.
    on_received = "__vector_18" {
        "push r30",
        "push r31",
        // An overrun of the hardware's own two bytes shows until UDR0 is read. The byte is then not the next one of its
        // line, and a mark in its place tells so as well as one before it.
        "lds  r31, 0xc0", // UCSR0A
        "lds  r24, 0xc6", // UDR0
        "sbrc r31, 3",    // DOR0
        "ldi  r24, {mark}",
        "lds  r30, {queue}+{pushed}",
        "lds  r31, {queue}+{taken}",
        "sub  r31, r30", // less as many as wait
        "cpi  r31, 2-{slots}",
        "brlt 3f",
        "1:",
        "inc  r30",
        "sts  {queue}+{pushed}, r30",
        "andi r30, {mask}",
        "ldi  r31, 0",
        "subi r30, lo8(-({bytes}))",
        "sbci r31, hi8(-({bytes}))",
        "st   Z, r24",
        "2:",
        "pop  r31",
        "pop  r30",
    }
    aside {
        // One slot is left, for a mark, or none: what finds none is behind a mark already.
        "3:",
        "ldi  r24, {mark}",
        "cpi  r31, 1-{slots}",
        "brge 1b",
        "rjmp 2b",
    }
    queue = sym RECEIVED,
    pushed = const Ring::<RECEIVED_SLOTS>::PUSHED,
    taken = const Ring::<RECEIVED_SLOTS>::TAKEN,
    mask = const Ring::<RECEIVED_SLOTS>::MASK,
    slots = const RECEIVED_SLOTS,
    bytes = sym RECEIVED_BYTES,
    mark = const GAP_MARK,
}

handler! {
    /// The line can take a byte, and one waits: 42 cycles, 44 for the last.
    on_free_to_send = "__vector_19" {
        "push r30",
        "push r31",
        "lds  r30, {queue}+{taken}",
        "inc  r30",
        "sts  {queue}+{taken}, r30",
        "lds  r24, {queue}+{pushed}",
        "cp   r24, r30",
        "brne 1f",
        "ldi  r24, {receiving}",
        "sts  0xc1, r24", // UCSR0B
        "1:",
        "andi r30, {mask}",
        "ldi  r31, 0",
        "subi r30, lo8(-({bytes}))",
        "sbci r31, hi8(-({bytes}))",
        "ld   r24, Z",
        "sts  0xc6, r24", // UDR0
        "pop  r31",
        "pop  r30",
    }
    aside {}
    queue = sym TO_SEND,
    pushed = const Ring::<TO_SEND_SLOTS>::PUSHED,
    taken = const Ring::<TO_SEND_SLOTS>::TAKEN,
    mask = const Ring::<TO_SEND_SLOTS>::MASK,
    bytes = sym TO_SEND_BYTES,
    receiving = const RECEIVING,
}
