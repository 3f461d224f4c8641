//! The supported chips: memories, vectors, and the few registers that the analysis uses.
//!
//! Each chip has one row. Memories, vectors and register addresses come from the device's header in avr-libc
//! (`FLASHEND`, `RAMEND`, `_VECTORS_SIZE`, `EECR`, `GPIOR0`). A test compares them with this table. The cycles of calls
//! and of the interrupt response come from the data sheets: the instruction set summary, and section "Interrupt
//! Response Time". For some chips with return addresses of 2 bytes that section describes 3 bytes, and states five
//! cycles. The 2 bytes are counted here.

use crate::decode::Instruction;
use crate::decode::Operation::{self, *};

/// EECR's bits that start a read and a write, and how long they halt the core (data sheets, EEPROM data memory).
const EERE: u16 = 0;
const EEPE: u16 = 1;
const READ_HALT_CYCLES: u32 = 4;
const WRITE_HALT_CYCLES: u32 = 2;

/// A chip of the AVR family.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub struct Chip {
    /// Its name, as in `avr-gcc -mmcu`.
    pub name: &'static str,
    /// Flash in bytes.
    pub flash_bytes: u32,
    /// The last address of SRAM: the stack pointer's value after a reset.
    pub ram_last: u16,
    /// Interrupt vectors, the reset's included.
    pub vectors: u8,
    /// Bytes of a vector: 4 on chips with `jmp`, else 2.
    pub vector_bytes: u32,
    /// The EEPROM's control register, by its address in the data space.
    pub(crate) eecr: u16,
    /// The general purpose I/O registers, by their addresses in the data space.
    pub(crate) gpior: &'static [u16],
    /// Whether it has `mul` and similar instructions.
    has_mul: bool,
}

/// General purpose I/O registers of the larger chips, and of the ATtiny.
const GPIOR: &[u16] = &[0x3E, 0x4A, 0x4B];
const GPIOR_TINY: &[u16] = &[0x31, 0x32, 0x33];

/// Every chip that is known.
#[rustfmt::skip]
pub const CHIPS: [Chip; 15] = [
    Chip { name: "atmega32", flash_bytes: 0x8000, ram_last: 0x085F, vectors: 21, vector_bytes: 4, eecr: 0x3C, gpior: &[], has_mul: true },
    Chip { name: "atmega48", flash_bytes: 0x1000, ram_last: 0x02FF, vectors: 26, vector_bytes: 2, eecr: 0x3F, gpior: GPIOR, has_mul: true },
    Chip { name: "atmega88", flash_bytes: 0x2000, ram_last: 0x04FF, vectors: 26, vector_bytes: 2, eecr: 0x3F, gpior: GPIOR, has_mul: true },
    Chip { name: "atmega328", flash_bytes: 0x8000, ram_last: 0x08FF, vectors: 26, vector_bytes: 4, eecr: 0x3F, gpior: GPIOR, has_mul: true },
    Chip { name: "atmega644p", flash_bytes: 0x1_0000, ram_last: 0x10FF, vectors: 31, vector_bytes: 4, eecr: 0x3F, gpior: GPIOR, has_mul: true },
    Chip { name: "atmega1280", flash_bytes: 0x2_0000, ram_last: 0x21FF, vectors: 57, vector_bytes: 4, eecr: 0x3F, gpior: GPIOR, has_mul: true },
    Chip { name: "attiny84", flash_bytes: 0x2000, ram_last: 0x025F, vectors: 17, vector_bytes: 2, eecr: 0x3C, gpior: &[0x33, 0x34, 0x35], has_mul: false },
    Chip { name: "atmega8", flash_bytes: 0x2000, ram_last: 0x045F, vectors: 19, vector_bytes: 2, eecr: 0x3C, gpior: &[], has_mul: true },
    Chip { name: "atmega168", flash_bytes: 0x4000, ram_last: 0x04FF, vectors: 26, vector_bytes: 4, eecr: 0x3F, gpior: GPIOR, has_mul: true },
    Chip { name: "atmega328p", flash_bytes: 0x8000, ram_last: 0x08FF, vectors: 26, vector_bytes: 4, eecr: 0x3F, gpior: GPIOR, has_mul: true },
    Chip { name: "atmega32u4", flash_bytes: 0x8000, ram_last: 0x0AFF, vectors: 43, vector_bytes: 4, eecr: 0x3F, gpior: GPIOR, has_mul: true },
    Chip { name: "atmega644", flash_bytes: 0x1_0000, ram_last: 0x10FF, vectors: 28, vector_bytes: 4, eecr: 0x3F, gpior: GPIOR, has_mul: true },
    Chip { name: "atmega1284p", flash_bytes: 0x2_0000, ram_last: 0x40FF, vectors: 35, vector_bytes: 4, eecr: 0x3F, gpior: GPIOR, has_mul: true },
    Chip { name: "atmega2560", flash_bytes: 0x4_0000, ram_last: 0x21FF, vectors: 57, vector_bytes: 4, eecr: 0x3F, gpior: GPIOR, has_mul: true },
    Chip { name: "attiny85", flash_bytes: 0x2000, ram_last: 0x025F, vectors: 15, vector_bytes: 2, eecr: 0x3C, gpior: GPIOR_TINY, has_mul: false },
];

impl Chip {
    /// The chip of this name.
    pub fn named(name: &str) -> Option<Chip> {
        CHIPS.into_iter().find(|chip| chip.name == name.to_ascii_lowercase())
    }

    /// Bytes of a return address on the stack: 3 if the program counter does not fit into 2.
    pub fn return_address_bytes(&self) -> usize {
        if self.flash_bytes > 0x2_0000 { 3 } else { 2 }
    }

    /// The number of its core, as in avr-gcc's `__AVR_ARCH__` and in the flags of an ELF.
    pub(crate) fn core(&self) -> u32 {
        match (self.vector_bytes, self.flash_bytes) {
            (2, _) if self.has_mul => 4,
            (2, _) => 25,
            (_, ..=0x1_0000) => 5,
            (_, ..=0x2_0000) => 51,
            _ => 6,
        }
    }

    /// Cycles from an instruction's end to the vector's first one. Each byte of the return address takes one.
    pub(crate) fn response_cycles(&self) -> u64 {
        2 + self.return_address_bytes() as u64
    }

    /// Additional cycles of a response that ends a sleep, without the oscillator's start: as many again.
    pub(crate) fn wake_up_cycles(&self) -> u64 {
        self.response_cycles()
    }

    /// Additional cycles of calls and returns, compared with a return address of two bytes.
    pub(crate) fn more_cycles(&self, operation: Operation) -> u32 {
        let is_of_stack = matches!(operation, Call | Rcall | Icall | Ret | Reti);
        if is_of_stack { self.return_address_bytes() as u32 - 2 } else { 0 }
    }

    /// Cycles that the EEPROM halts the core after a write to this address of the data space, if it is known. A write
    /// of the whole register may start either, so the longer one counts.
    pub(crate) fn halt_cycles(&self, instruction: &Instruction, written: Option<u16>) -> u32 {
        match (instruction.operation, instruction.operand('b')) {
            _ if written != Some(self.eecr) => 0,
            (Sbi, EERE) => READ_HALT_CYCLES,
            (Sbi, EEPE) => WRITE_HALT_CYCLES,
            (Sbi | Cbi, _) => 0,
            _ => READ_HALT_CYCLES,
        }
    }

    /// Whether the chip carries this instruction out.
    pub(crate) fn has(&self, operation: Operation) -> bool {
        match operation {
            Mul | Muls | Mulsu | Fmul | Fmuls | Fmulsu => self.has_mul,
            Jmp | Call => self.flash_bytes > 0x2000,
            Elpm => self.flash_bytes >= 0x2_0000,
            Eicall | Eijmp => self.flash_bytes > 0x2_0000,
            Break => self.name != "atmega8",
            _ => true,
        }
    }
}

#[cfg(test)]
mod tests {
    use super::*;
    use std::process::Command;

    #[test]
    fn the_table_agrees_with_avr_libc_s_headers() {
        for chip in CHIPS {
            let gpior =
                if chip.gpior.is_empty() { "" } else { "(unsigned)&GPIOR0, (unsigned)&GPIOR1, (unsigned)&GPIOR2," };
            let source = format!(
                "#include <avr/io.h>\nunsigned t[] = {{ FLASHEND & 0xFFFFUL, FLASHEND >> 15 >> 1, RAMEND, _VECTORS_SIZE, \
                 (unsigned)&EECR, {gpior} __AVR_ARCH__ }};"
            );
            let file = tempfile::Builder::new().suffix(".c").tempfile().expect("there is room for a file");
            std::fs::write(file.path(), source).expect("it can be written");
            let mut gcc = Command::new("avr-gcc");
            gcc.args(["-S", "-o", "-", &format!("-mmcu={}", chip.name)]).arg(file.path());
            let output = gcc.output().expect("./setup.sh brings avr-gcc");
            let text = String::from_utf8(output.stdout).expect("it is text");
            let said: Vec<u32> = (text.lines())
                .filter_map(|line| line.trim().strip_prefix(".word"))
                .map(|number| number.trim().parse::<i32>().expect("a number") as u32 & 0xFFFF)
                .collect();
            let last = chip.flash_bytes - 1;
            let table = [
                last & 0xFFFF,
                last >> 16,
                chip.ram_last.into(),
                u32::from(chip.vectors) * chip.vector_bytes,
                chip.eecr.into(),
            ];
            let gpior = chip.gpior.iter().map(|&address| u32::from(address));
            let table: Vec<u32> = table.into_iter().chain(gpior).chain([chip.core()]).collect();
            assert_eq!(said, table, "{}", chip.name);
        }
    }
}
