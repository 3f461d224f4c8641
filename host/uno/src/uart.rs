//! Corrections of simavr's UART: the time of a byte, and the receiver's capacity.
//!
//! simavr adds a parity bit to every byte, and sets the receiver's flag one byte too late. It requests the interrupt
//! once in a byte's time, and buffers 64 bytes. With the correction a byte has the number of bits that the registers
//! select. It is available when its stop bit ends, and is lost if three bytes wait. The transmitter's second buffer is
//! not simulated.

use simavr_ffi as simavr;

use super::io_register::peripheral;

/// Complete bytes that the receiver holds: two in its buffer and one in the shift register (data sheet, USART0,
/// receiver error flags).
const RECEIVER_BYTES: u16 = 3;

// Registers by their address in the data space (data sheet, register summary).
const UCSR0A: u16 = 0xC0;
const UCSR0B: u16 = 0xC1;
const UCSR0C: u16 = 0xC2;
const UBRR0L: u16 = 0xC4;
const UBRR0H: u16 = 0xC5;
const UDR0: u16 = 0xC6;

/// UCSR0A: a byte waits.
const RXC0: u8 = 1 << 7;
/// UCSR0A: bytes were lost.
const DOR0: u8 = 1 << 3;
/// UCSR0A: double speed.
const U2X0: u8 = 1 << 1;
/// UCSR0B: the receiver is on.
const RXEN0: u8 = 1 << 4;
/// UCSR0C: two stop bits.
const USBS0: u8 = 1 << 3;
/// UCSR0C: parity is on.
const UPM01: u8 = 1 << 5;

/// The UART of a chip.
///
/// # Safety
///
/// `avr` must be an initialised chip.
pub(super) unsafe fn of(avr: *mut simavr::avr_t) -> *mut simavr::avr_uart_t {
    // SAFETY: the caller vouches for `avr`, and UDR0 is the UART's.
    unsafe { peripheral(avr, UDR0) }
}

/// Cycles of a byte on the serial line, from the UART's registers (data sheet, USART0, clock generation and frame
/// formats).
///
/// # Safety
///
/// `avr` must be an initialised chip.
pub(super) unsafe fn cycles_per_byte(avr: *mut simavr::avr_t) -> u64 {
    // SAFETY: the registers are addresses inside `data`, and the caller vouches for `avr`.
    let register = |address: u16| unsafe { *(*avr).data.add(address.into()) };
    let divisor = u64::from(u16::from_le_bytes([register(UBRR0L), register(UBRR0H) & 0x0F])) + 1;
    let cycles_per_bit = match register(UCSR0A) & U2X0 {
        0 => 16 * divisor,
        _ => 8 * divisor,
    };
    let format = register(UCSR0C);
    let data_bits = match (register(UCSR0B) & 0b100) | (format >> 1 & 0b11) {
        size @ 0..=3 => 5 + u64::from(size),
        _ => 9,
    };
    let parity_bits = u64::from(format & UPM01 != 0);
    let stop_bits = 1 + u64::from(format & USBS0 != 0);
    cycles_per_bit * (1 + data_bits + parity_bits + stop_bits)
}

/// Keeps the receiver's interrupt requested while bytes wait in it, as the chip does. simavr requests it once in a
/// byte's time, and so delays a firmware that reads faster.
///
/// # Safety
///
/// `avr` must be an initialised chip.
pub(super) unsafe fn hand_over_received(avr: *mut simavr::avr_t) {
    // SAFETY: the caller vouches for `avr`; UCSR0A is an address inside `data`.
    unsafe {
        let uart = of(avr);
        if (*uart).input.read != (*uart).input.write {
            (*uart).rx_cnt = 0;
            if *(*avr).data.add(UCSR0A.into()) & RXC0 != 0 && (*uart).rxc.pending() == 0 {
                simavr::avr_raise_interrupt(avr, &raw mut (*uart).rxc);
            }
        }
    }
}

/// Gives the receiver a byte whose stop bit has just ended. Returns whether it had room.
///
/// # Safety
///
/// `avr` must be an initialised chip.
pub(super) unsafe fn receive(avr: *mut simavr::avr_t, byte: u8) -> bool {
    // SAFETY: the caller vouches for `avr`; the registers are addresses inside `data`.
    unsafe {
        let uart = of(avr);
        let fifo = &(*uart).input;
        let waiting = fifo.write.wrapping_sub(fifo.read) % fifo.buffer.len() as u16;
        let on = *(*avr).data.add(UCSR0B.into()) & RXEN0 != 0;
        if on && waiting >= RECEIVER_BYTES {
            *(*avr).data.add(UCSR0A.into()) |= DOR0;
            return false;
        }
        // simavr would set the flag a whole byte later; it is due now.
        (*uart).cycles_per_byte = 1;
        flood(avr, byte);
        (*uart).cycles_per_byte = cycles_per_byte(avr);
    }
    true
}

/// Gives the receiver a byte, independent of the line's pace and the receiver's room.
///
/// # Safety
///
/// `avr` must be an initialised chip.
pub(super) unsafe fn flood(avr: *mut simavr::avr_t, byte: u8) {
    // SAFETY: the caller vouches for `avr`; its UART has this line.
    unsafe { simavr::avr_raise_irq((*of(avr)).io.irq.add(simavr::UART_IRQ_INPUT as usize), byte.into()) };
}
