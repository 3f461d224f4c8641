//! The memory that the firmware may take on an ATmega328P.

use crate::common::elf;
use field::firmware::Size;

/// 20 KiB of the 32 KiB of flash.
const FLASH_BYTES: u64 = 20 * 1024;

/// 1 KiB of the 2 KiB of SRAM; the rest is for the stack.
const SRAM_BYTES: u64 = 1024;

#[test]
fn the_firmware_stays_within_its_memory_budget() {
    let Size { flash, sram } = Size::read(&elf()).expect("the ELF can be read");
    println!("flash {flash} of {FLASH_BYTES} bytes, static SRAM {sram} of {SRAM_BYTES} bytes");
    assert!(flash <= FLASH_BYTES, "{flash} bytes of flash");
    assert!(sram <= SRAM_BYTES, "{sram} bytes of static SRAM");
}
