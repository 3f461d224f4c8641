//! The EEPROM's write time: a byte takes 3.4 ms to write, and a power failure meanwhile leaves it undefined.
//!
//! simavr stores a byte at once. Its writer of EECR is replaced by one that lets simavr store the byte, and then keeps
//! EEPE set for as long as the chip does (data sheet, 8.4.2). Until then EECR accepts no other command. The pending
//! write goes on over a reset (8.4.3). [`Eeprom::tear`] has the result of a power failure.
//!
//! Only writes that erase first are timed (EEPM 00). The core is not halted for the few cycles after a command.

use super::chip::{Chip, Writer};
use crate::memory::EEPROM_BYTES;
use crate::pins::CYCLES_PER_SECOND;
use simavr_ffi as simavr;
use std::ffi::c_void;

/// Cycles of a write (data sheet, table 8-1): the first half erases the byte, the second writes it.
pub(super) const WRITE_CYCLES: u64 = CYCLES_PER_SECOND * 34 / 10_000;

// Registers by their address in the data space (data sheet, register summary).
pub(super) const EECR: u16 = 0x3F;
const EEARL: u16 = 0x41;
const EEARH: u16 = 0x42;

/// EECR: read, write, and allow the next write.
const EERE: u8 = 1 << 0;
const EEPE: u8 = 1 << 1;
const EEMPE: u8 = 1 << 2;

/// Bits that stay erased after a power failure in the second half of a write. The data sheet does not define them.
/// Important is that the byte is neither the old nor the new value.
const STILL_ERASED: u8 = 0b0101_0101;

/// The EEPROM's writer, and its pending write.
pub(super) struct Eeprom {
    writer: Writer,
    write: Option<Write>,
}

#[derive(Clone, Copy)]
struct Write {
    address: usize,
    begun: u64,
}

impl Eeprom {
    /// A chip's EEPROM. The chip's writers must not have been replaced.
    pub(super) fn of(chip: Chip) -> Eeprom {
        Eeprom { writer: chip.writer(EECR), write: None }
    }

    /// Leaves the byte of `content` that is being written as a power failure at `cycle` does.
    pub(super) fn tear(&self, content: &mut [u8], cycle: u64) {
        if let Some(Write { address, begun }) = self.write {
            content[address] |= if cycle - begun < WRITE_CYCLES / 2 { 0xFF } else { STILL_ERASED };
        }
    }

    /// Ends the pending write, as a power failure does.
    pub(super) fn stop(&mut self) {
        self.write = None;
    }
}

/// Lets the pending write go on after a reset: simavr's reset has cleared EEPE and the time of its end.
///
/// # Safety
/// `eeprom` must be the chip's, and neither may be borrowed.
pub(super) unsafe fn go_on(chip: Chip, eeprom: *mut Eeprom) {
    // SAFETY: the caller vouches for `eeprom`, which lives as long as the chip.
    unsafe {
        if let Some(Write { begun, .. }) = (*eeprom).write {
            chip.set(EECR, EEPE);
            let rest = (begun + WRITE_CYCLES).saturating_sub(chip.cycle());
            simavr::avr_cycle_timer_register(chip.avr(), rest, Some(on_written), eeprom.cast());
        }
    }
}

/// simavr's callback for a write of EECR. `parameter` is the chip's EEPROM.
pub(super) unsafe extern "C" fn on_control_write(
    avr: *mut simavr::avr_t,
    register: u16,
    value: u8,
    parameter: *mut c_void,
) {
    // SAFETY: `parameter` is the one that `Core::new` registered, alive and not borrowed, and `avr` its chip.
    unsafe {
        let (chip, eeprom) = (Chip::of(avr), parameter.cast::<Eeprom>());
        if (*eeprom).write.is_some() {
            chip.set(register, value & !(EERE | EEMPE) | EEPE);
            return;
        }
        let writes = chip.read(register) & EEMPE != 0 && value & EEPE != 0;
        let writer = (*eeprom).writer;
        writer.write(chip, register, value);
        if writes {
            let address = usize::from(u16::from_le_bytes([chip.read(EEARL), chip.read(EEARH)])) % EEPROM_BYTES;
            (*eeprom).write = Some(Write { address, begun: chip.cycle() });
            chip.set(register, chip.read(register) | EEPE);
            simavr::avr_cycle_timer_register(avr, WRITE_CYCLES, Some(on_written), parameter);
        }
    }
}

/// simavr's callback at the end of a write.
unsafe extern "C" fn on_written(avr: *mut simavr::avr_t, _: u64, parameter: *mut c_void) -> u64 {
    // SAFETY: as in `on_control_write`.
    unsafe {
        let chip = Chip::of(avr);
        (*parameter.cast::<Eeprom>()).write = None;
        chip.set(EECR, chip.read(EECR) & !EEPE);
    }
    // No second time.
    0
}
