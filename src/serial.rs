//! The serial line on D0 and D1: 115200 baud, 8N1, driven by interrupts in both directions.
//!
//! One queue holds received bytes, another the bytes to send. No call waits: a full or empty queue returns `WouldBlock`. If the
//! receive queue is full, bytes are lost, and [`GAP_MARK`] takes the place of the first lost byte. So a line with lost bytes is
//! never taken for a complete one.

use crate::{handler::handler, ring::Ring, shared::Byte};
use avr_device::atmega328p::USART0;
use control::say::command::GAP_MARK;
use core::convert::Infallible;
use embedded_hal_nb::serial::{ErrorType, Read, Write};

/// Divisor for 115200 baud at double speed; 2.1 % off, as on every Uno (data sheet, table 20-6).
const BAUD_DIVISOR: u16 = 16;

/// Received bytes: 5 ms of a full line. The last slot is kept for a mark.
static RECEIVED: Ring<RECEIVED_SLOTS> = Ring::new();
static RECEIVED_BYTES: [Byte; RECEIVED_SLOTS] = [const { Byte::new(0) }; RECEIVED_SLOTS];
const RECEIVED_SLOTS: usize = 64;

/// Bytes to send: 2.8 ms of a full line, several turns of the loop.
static TO_SEND: Ring<TO_SEND_SLOTS> = Ring::new();
static TO_SEND_BYTES: [Byte; TO_SEND_SLOTS] = [const { Byte::new(0) }; TO_SEND_SLOTS];
const TO_SEND_SLOTS: usize = 32;

/// The two values of UCSR0B, always written whole, so that loop and handler cannot overwrite each other's bits. Both have the
/// receive interrupt; the second also has the interrupt for a free transmitter.
///
/// That interrupt is on only while bytes wait. On an empty queue the chip would call the handler again and again. Some simulators
/// clear the request at its first call, and would never call it again. So the handler turns it off with the last byte, and the loop
/// turns it on after each push. In between, the handler could take that byte and turn it off. The loop would then turn it on for an
/// empty queue. So the loop turns it off before the push.
const RECEIVING: u8 = 0b1001_1000; // RXCIE0, RXEN0, TXEN0
const SENDING: u8 = RECEIVING | 1 << 5; // UDRIE0

/// The loop's side of the serial line.
pub struct Serial {
    usart: USART0,
}

impl Serial {
    /// Opens the line.
    pub fn new(usart: USART0) -> Self {
        usart.ubrr0.write(|w| w.bits(BAUD_DIVISOR));
        usart.ucsr0a.write(|w| w.u2x0().set_bit());
        usart.ucsr0c.write(|w| w.ucsz0().chr8());
        let serial = Self { usart };
        serial.control(RECEIVING);
        serial
    }

    fn control(&self, bits: u8) {
        // SAFETY: both values only switch the line and its interrupts, and their handlers are below.
        self.usart.ucsr0b.write(|w| unsafe { w.bits(bits) });
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
        // A byte that was not pushed met a full queue, so bytes wait in any case.
        self.control(SENDING);
        if kept { Ok(()) } else { Err(nb::Error::WouldBlock) }
    }

    fn flush(&mut self) -> nb::Result<(), Infallible> {
        if TO_SEND.is_empty() { Ok(()) } else { Err(nb::Error::WouldBlock) }
    }
}

/// Text, a character at a time. A character without room is an error, because no call waits.
impl ufmt::uWrite for Serial {
    type Error = nb::Error<Infallible>;

    fn write_str(&mut self, text: &str) -> Result<(), Self::Error> {
        text.bytes().try_for_each(|byte| self.write(byte))
    }

    fn write_char(&mut self, character: char) -> Result<(), Self::Error> {
        // The console's text is ASCII.
        self.write(character as u8)
    }
}

handler! {
    /// A byte was received: 46 cycles, 51 if one slot is left and the byte becomes the mark.
    on_received = "__vector_18" {
        "push r30",
        "push r31",
        // The flag of a hardware overrun stands until UDR0 is read. Then bytes before this one are lost, and the mark replaces this
        // byte.
        "lds  r31, 0xc0", // UCSR0A
        "lds  r24, 0xc6", // UDR0
        "sbrc r31, 3",    // DOR0
        "ldi  r24, {mark}",
        "lds  r30, {queue}+{pushed}",
        "lds  r31, {queue}+{taken}",
        "sub  r31, r30", // minus the number waiting
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
        // One slot is left, for a mark, or none: then a mark is already queued.
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
    /// The transmitter is free, and a byte waits: 42 cycles, 44 for the last.
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
