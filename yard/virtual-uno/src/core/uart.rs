//! Corrections of simavr's UART: the time of a byte, and the receiver's capacity.
//!
//! simavr adds a parity bit to every byte, and sets the receiver's flag one byte too late. It requests the interrupt
//! once in a byte's time, and buffers 64 bytes. With the correction a byte has the number of bits that the registers
//! select. It is available when its stop bit ends, and is lost if three bytes wait. The transmitter's second buffer is
//! not simulated.

use super::chip::Chip;
use simavr_ffi as simavr;

/// Bytes that the receiver holds: two in its buffer, one in the shift register (data sheet, receiver error flags).
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

/// Cycles of a byte, from the UART's registers (data sheet, USART0, clock generation and frame formats).
pub(super) fn cycles_per_byte(chip: Chip) -> u64 {
    let divisor = u64::from(u16::from_le_bytes([chip.read(UBRR0L), chip.read(UBRR0H) & 0x0F])) + 1;
    let cycles_per_bit = match chip.read(UCSR0A) & U2X0 {
        0 => 16 * divisor,
        _ => 8 * divisor,
    };
    let format = chip.read(UCSR0C);
    let data_bits = match (chip.read(UCSR0B) & 0b100) | (format >> 1 & 0b11) {
        size @ 0..=3 => 5 + u64::from(size),
        _ => 9,
    };
    let parity_bits = u64::from(format & UPM01 != 0);
    let stop_bits = 1 + u64::from(format & USBS0 != 0);
    cycles_per_bit * (1 + data_bits + parity_bits + stop_bits)
}

/// The chip's UART.
pub(super) fn of(chip: Chip) -> *mut simavr::avr_uart_t {
    chip.peripheral(UDR0)
}

/// Keeps the receiver's interrupt requested while bytes wait in it, as the chip does. simavr requests it once in a
/// byte's time, and so delays a firmware that reads faster.
pub(super) fn hand_over_received(chip: Chip) {
    let uart = of(chip);
    // SAFETY: `uart` is a part of the chip, and no reference to it is alive.
    unsafe {
        if (*uart).input.read != (*uart).input.write {
            (*uart).rx_cnt = 0;
            if chip.read(UCSR0A) & RXC0 != 0 && (*uart).rxc.pending() == 0 {
                simavr::avr_raise_interrupt(chip.avr(), &raw mut (*uart).rxc);
            }
        }
    }
}

/// Gives the receiver a byte whose stop bit has just ended. Returns whether it had room.
pub(super) fn receive(chip: Chip, byte: u8) -> bool {
    let uart = of(chip);
    // SAFETY: as in `hand_over_received`; the UART has the line of its input.
    unsafe {
        let waiting = (*uart).input.write.wrapping_sub((*uart).input.read) % (*uart).input.buffer.len() as u16;
        if chip.read(UCSR0B) & RXEN0 != 0 && waiting >= RECEIVER_BYTES {
            chip.set(UCSR0A, chip.read(UCSR0A) | DOR0);
            return false;
        }
        // simavr would set the flag a whole byte later; it is due now.
        (*uart).cycles_per_byte = 1;
        simavr::avr_raise_irq((*uart).io.irq.add(simavr::UART_IRQ_INPUT as usize), byte.into());
        (*uart).cycles_per_byte = cycles_per_byte(chip);
    }
    true
}
