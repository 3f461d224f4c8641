//! The registers and SREG flags that an instruction reads and changes.
//!
//! The source is the AVR instruction set manual. The interrupt flag is left out here: [`crate::flow`] follows it.
//! Calls, jumps and returns have no effects of their own. The effects of a call are those of the called function.

use crate::decode::Instruction;
use crate::decode::Operation::*;
use std::fmt;

/// The number of registers; the flags follow them.
const REGISTERS: usize = 32;

bitflags::bitflags! {
    /// A set of registers and flags: registers by their number, then flags by their bit in SREG.
    #[derive(Clone, Copy, Debug, PartialEq, Eq)]
    pub(crate) struct Registers: u64 {
        /// The registers that functions preserve (AVR calling convention): R2 to R17, R28 and R29.
        const PRESERVED = 0x3003_FFFC;
        /// The pair that a multiplication's product is in.
        const PRODUCT = 0b11;
        /// All flags but the interrupts'.
        const FLAGS = 0b0111_1111 << REGISTERS;
        const ZERO_FLAG = Z.bits();
        const CARRY_FLAG = C.bits();
        /// All registers and flags.
        const ALL = Self::FLAGS.bits() | ((1 << REGISTERS) - 1);
    }
}

impl Registers {
    pub(crate) fn one(register: usize) -> Registers {
        Registers::from_bits_retain(1 << register)
    }

    fn pair(lower: usize) -> Registers {
        Registers::from_bits_retain(0b11 << lower)
    }

    pub(crate) fn has(self, register: usize) -> bool {
        self.intersects(Registers::one(register))
    }

    /// Its registers and flags, by their numbers.
    pub(crate) fn numbers(self) -> impl Iterator<Item = usize> {
        (0..REGISTERS + 7).filter(move |&register| self.has(register))
    }

    /// Every register for which that holds.
    pub(crate) fn which(holds: impl Fn(usize) -> bool) -> Registers {
        (0..REGISTERS).filter(|&register| holds(register)).map(Registers::one).collect()
    }
}

/// Names: `r5, r6`, and a flag by its letter.
impl fmt::Display for Registers {
    fn fmt(&self, to: &mut fmt::Formatter) -> fmt::Result {
        let names = self.numbers().map(|register| match register.checked_sub(REGISTERS) {
            None => format!("r{register}"),
            Some(flag) => format!("flag {}", char::from(b"CZNVSHT"[flag])),
        });
        to.write_str(&names.collect::<Vec<_>>().join(", "))
    }
}

/// The flags with these bits in SREG.
const fn flags(bits: u64) -> Registers {
    Registers::from_bits_retain(bits << REGISTERS)
}

// Flags by their bit in SREG, and the flags that each kind of instruction changes.
const C: Registers = flags(1);
const Z: Registers = flags(1 << 1);
const T: Registers = flags(1 << 6);
const SVNZ: Registers = flags(0b01_1110);
const SVNZC: Registers = flags(0b01_1111);
const HSVNZC: Registers = flags(0b11_1111);

/// The effects of an instruction.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub(crate) struct Effects {
    pub(crate) reads: Registers,
    pub(crate) changes: Registers,
}

impl Instruction {
    /// The registers and flags that it reads and changes.
    pub(crate) fn effects(&self) -> Effects {
        use Registers as R;

        let (d, r) = (self.destination, self.source);
        let (to, from) = (R::one(d), R::one(r));
        let flag = flags(1 << self.operand('s')) & R::FLAGS;
        let pointer = self.pointer().map_or(R::empty(), |(pointer, _)| R::pair(pointer));
        let moved = if self.pointer().is_some_and(|(_, by)| by != 0) { pointer } else { R::empty() };
        // A register minus itself, or XOR itself, is 0 or made from the carry. The old value does not matter.
        let is_same = d == r;
        let (reads, changes) = match self.operation {
            Sub | Eor if is_same => (R::empty(), to | if self.operation == Sub { HSVNZC } else { SVNZ }),
            Sbc if is_same => (C | Z, to | HSVNZC),
            Add | Sub => (to | from, to | HSVNZC),
            Adc => (to | from | C, to | HSVNZC),
            Sbc => (to | from | C | Z, to | HSVNZC),
            Subi | Neg => (to, to | HSVNZC),
            Sbci => (to | C | Z, to | HSVNZC),
            And | Or | Eor => (to | from, to | SVNZ),
            Andi | Ori | Inc | Dec => (to, to | SVNZ),
            Com | Asr | Lsr => (to, to | SVNZC),
            Ror => (to | C, to | SVNZC),
            Adiw | Sbiw => (R::pair(d), R::pair(d) | SVNZC),
            Mul | Muls | Mulsu | Fmul | Fmuls | Fmulsu => (to | from, R::PRODUCT | Z | C),
            Cp => (to | from, HSVNZC),
            Cpc => (to | from | C | Z, HSVNZC),
            Cpi => (to, HSVNZC),
            Swap => (to, to),
            Mov => (from, to),
            Movw => (R::pair(r), R::pair(d)),
            Ldi => (R::empty(), to),
            Bst => (to, T),
            Bld => (to | T, to),
            Bset | Bclr => (R::empty(), flag),
            Brbs | Brbc => (flag, R::empty()),
            Cpse => (to | from, R::empty()),
            Sbrc | Sbrs => (from, R::empty()),
            // Functions read SREG for its interrupt flag, handlers to restore it; another analysis follows this.
            In | Lds => (R::empty(), to),
            Out | Sts => (from, R::empty()),
            Ld | Ldd => (pointer, to | moved),
            Lpm | Elpm => (pointer, to | moved),
            St | Std => (pointer | from, moved),
            // Another analysis follows the stack.
            Push => (R::empty(), R::empty()),
            Pop => (R::empty(), to),
            Break | Call | Cbi | Eicall | Eijmp | Icall | Ijmp | Jmp | Nop | Rcall | Ret | Reti | Rjmp | Sbi | Sbic
            | Sbis | Sleep | Spm | Wdr => (R::empty(), R::empty()),
        };
        Effects { reads, changes }
    }
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::concrete::Concrete;
    use rand::{RngExt, SeedableRng};
    use rand_chacha::ChaCha8Rng;

    unsafe extern "C" {
        /// Runs the next instruction. It stands in sim_core.h, which simavr-ffi leaves out of its bindings.
        fn avr_run_one(avr: *mut simavr_ffi::avr_t) -> simavr_ffi::avr_flashaddr_t;
        static mega328: simavr_ffi::avr_kind_t;
    }

    /// Registers and flags, each with what it holds: a byte, or 0 or 1.
    type Contents = [u8; REGISTERS + 7];

    /// A chip that carries single instructions out.
    struct Chip(*mut simavr_ffi::avr_t);

    impl Chip {
        fn new() -> Chip {
            // SAFETY: the chip is initialised once, and belongs to this value alone.
            unsafe {
                let avr = mega328.make.expect("it has a function")();
                simavr_ffi::avr_init(avr);
                Chip(avr)
            }
        }

        /// Carries an instruction of these two words out and returns what registers and flags hold then.
        fn run(&mut self, words: [u16; 2], before: &Contents) -> Contents {
            /// Its address: no vector lies there.
            const PLACE: usize = 0x100;

            let mut behind = *before;
            // SAFETY: the chip lives as long as this value; its flash has 32 KB, its data space begins with the registers, and
            // SREG has 8 flags of a byte each.
            unsafe {
                let avr = &mut *self.0;
                for (place, byte) in words.iter().flat_map(|word| word.to_le_bytes()).enumerate() {
                    *avr.flash.add(PLACE + place) = byte;
                }
                avr.pc = PLACE as u32;
                avr.state = simavr_ffi::cpu_Running as _;
                std::ptr::copy_nonoverlapping(before.as_ptr(), avr.data, REGISTERS);
                avr.sreg[..7].copy_from_slice(&before[REGISTERS..]);
                avr_run_one(avr);
                std::ptr::copy_nonoverlapping(avr.data, behind.as_mut_ptr(), REGISTERS);
                behind[REGISTERS..].copy_from_slice(&avr.sreg[..7]);
            }
            behind
        }
    }

    /// Random registers and flags. Pointers lead into SRAM, with room for the largest displacement.
    fn any_contents(random: &mut ChaCha8Rng) -> Contents {
        std::array::from_fn(|register| match register {
            27 | 29 | 31 => random.random_range(2..6),
            REGISTERS.. => random.random_range(0..2),
            // Ends of the range are where flags change.
            _ if random.random_bool(0.3) => [0, 1, 0x7F, 0x80, 0xFF][random.random_range(0..5)],
            _ => random.random(),
        })
    }

    #[test]
    fn an_instruction_changes_and_reads_the_same_in_the_simulator() {
        /// An address in SRAM for instructions that have it in their second word, and GPIOR0, which does nothing, for `in`.
        const ADDRESS: u16 = 0x0300;
        const GPIOR0: u16 = 0x3E;

        let chip_of_table = crate::chip::Chip::named("atmega328p").expect("it is in the table");
        let mut chip = Chip::new();
        let mut random = ChaCha8Rng::seed_from_u64(1);
        let (mut seen, mut computed) = (0, 0);
        for word in 0..=u16::MAX {
            let bytes = [word.to_le_bytes(), ADDRESS.to_le_bytes()].concat();
            let Some(instruction) = Instruction::at(&bytes, 0).filter(|found| chip_of_table.has(found.operation))
            else {
                continue;
            };
            let (name, Effects { reads, changes }) = (instruction.operation, instruction.effects());
            let is_store = matches!(instruction.operation, St | Std | Sts);
            let is_harmless_input = instruction.operation != In || instruction.data_address() == Some(GPIOR0);
            // The others act on the stack or the control flow, or on what is no register.
            if changes.is_empty() && !is_store || instruction.operation == Pop || !is_harmless_input {
                continue;
            }
            seen += 1;
            for _ in 0..4 {
                let before = any_contents(&mut random);
                let behind = chip.run([word, ADDRESS], &before);
                for place in (Registers::ALL - changes).numbers() {
                    assert_eq!(behind[place], before[place], "{name:?} changes {}", Registers::one(place));
                }
                let mut concrete = Concrete { registers: [0; 32], status: 0 };
                concrete.registers.copy_from_slice(&before[..REGISTERS]);
                concrete.status = (0..7).fold(0, |status, flag| status | before[REGISTERS + flag] << flag);
                if concrete.carry_out(&instruction) {
                    computed += 1;
                    let flags = (0..7).map(|flag| concrete.status >> flag & 1);
                    let all: Vec<u8> = concrete.registers.into_iter().chain(flags).collect();
                    assert_eq!(all, behind, "{name:?} from {before:?}");
                }
                // Unread registers get other values.
                let other = any_contents(&mut random);
                let other = std::array::from_fn(|place| if reads.has(place) { before[place] } else { other[place] });
                let behind_other = chip.run([word, ADDRESS], &other);
                for place in changes.numbers() {
                    assert_eq!(behind_other[place], behind[place], "{name:?} reads more for {}", Registers::one(place));
                }
            }
        }
        assert!(seen > 40_000 && computed > 100_000, "{seen} instructions, {computed} computed");
    }
}
