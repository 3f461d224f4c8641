//! The results of arithmetic instructions on known registers and flags, from the AVR instruction set manual.
//!
//! A test compares each instruction with the simulator.

use crate::decode::Instruction;
use crate::decode::Operation::*;

// Flags by their bit in SREG.
const C: u8 = 1;
const Z: u8 = 1 << 1;
const N: u8 = 1 << 2;
const V: u8 = 1 << 3;
const S: u8 = 1 << 4;
const H: u8 = 1 << 5;
const T: u8 = 1 << 6;

/// Registers and flags.
#[derive(Clone, Debug, PartialEq, Eq)]
pub(crate) struct Concrete {
    pub(crate) registers: [u8; 32],
    pub(crate) status: u8,
}

impl Concrete {
    fn flag(&mut self, flag: u8, on: bool) {
        self.status = if on { self.status | flag } else { self.status & !flag };
    }

    /// Sets N, and Z, V and S that follow from a result.
    fn result(&mut self, zero: bool, negative: bool, overflow: bool) {
        self.flag(Z, zero);
        self.flag(N, negative);
        self.flag(V, overflow);
        self.flag(S, negative != overflow);
    }

    fn add(&mut self, one: u8, other: u8, carry: u8) -> u8 {
        let sum = one.wrapping_add(other).wrapping_add(carry);
        self.flag(C, u16::from(one) + u16::from(other) + u16::from(carry) > 0xFF);
        self.flag(H, (one & 0xF) + (other & 0xF) + carry > 0xF);
        self.result(sum == 0, sum >> 7 == 1, (one ^ sum) & (other ^ sum) & 0x80 != 0);
        sum
    }

    /// Subtracts. With a carry, Z can only be cleared, not set.
    fn subtract(&mut self, from: u8, what: u8, carry: Option<u8>) -> u8 {
        let borrowed = carry.unwrap_or_default();
        let difference = from.wrapping_sub(what).wrapping_sub(borrowed);
        let was_zero = carry.is_none() || self.status & Z != 0;
        self.flag(C, u16::from(from) < u16::from(what) + u16::from(borrowed));
        self.flag(H, (from & 0xF) < (what & 0xF) + borrowed);
        self.result(difference == 0 && was_zero, difference >> 7 == 1, (from ^ what) & (from ^ difference) & 0x80 != 0);
        difference
    }

    fn logic(&mut self, value: u8) -> u8 {
        self.result(value == 0, value >> 7 == 1, false);
        value
    }

    fn shifted(&mut self, value: u8, out: bool) -> u8 {
        self.flag(C, out);
        let negative = value >> 7 == 1;
        self.result(value == 0, negative, negative != out);
        value
    }

    /// Executes an instruction. Returns `false` for one that does more than arithmetic, or accesses memory.
    pub(crate) fn carry_out(&mut self, instruction: &Instruction) -> bool {
        let (d, r) = (instruction.destination, instruction.source);
        let (to, from, constant) = (self.registers[d], self.registers[r], instruction.constant);
        let carry = self.status & C;
        let value = match instruction.operation {
            Add => self.add(to, from, 0),
            Adc => self.add(to, from, carry),
            Sub | Cp => self.subtract(to, from, None),
            Sbc | Cpc => self.subtract(to, from, Some(carry)),
            Subi | Cpi => self.subtract(to, constant, None),
            Sbci => self.subtract(to, constant, Some(carry)),
            Adiw | Sbiw => {
                let before = u16::from_le_bytes([to, self.registers[d + 1]]);
                let constant = u16::from(constant);
                let is_sum = instruction.operation == Adiw;
                let after = if is_sum { before.wrapping_add(constant) } else { before.wrapping_sub(constant) };
                let (was_high, is_high) = (before >> 15 == 1, after >> 15 == 1);
                let (rises, falls) = (!was_high && is_high, was_high && !is_high);
                self.flag(C, if is_sum { falls } else { rises });
                self.result(after == 0, is_high, if is_sum { rises } else { falls });
                self.registers[d + 1] = (after >> 8) as u8;
                after as u8
            }
            Inc => {
                self.result(to == 0xFF, to.wrapping_add(1) >> 7 == 1, to == 0x7F);
                to.wrapping_add(1)
            }
            Dec => {
                self.result(to == 1, to.wrapping_sub(1) >> 7 == 1, to == 0x80);
                to.wrapping_sub(1)
            }
            Com => {
                self.flag(C, true);
                self.logic(!to)
            }
            Neg => self.subtract(0, to, None),
            And => self.logic(to & from),
            Andi => self.logic(to & constant),
            Or => self.logic(to | from),
            Ori => self.logic(to | constant),
            Eor => self.logic(to ^ from),
            Lsr => self.shifted(to >> 1, to & 1 == 1),
            Ror => self.shifted(to >> 1 | carry << 7, to & 1 == 1),
            Asr => self.shifted(to >> 1 | to & 0x80, to & 1 == 1),
            Swap => to.rotate_left(4),
            Mov => from,
            Movw => {
                self.registers[d + 1] = self.registers[r + 1];
                from
            }
            Ldi => constant,
            Bst => {
                self.flag(T, to >> instruction.operand('b') & 1 == 1);
                return true;
            }
            Bld => {
                let bit = 1 << instruction.operand('b');
                if self.status & T != 0 { to | bit } else { to & !bit }
            }
            Bset | Bclr if instruction.operand('s') < 7 => {
                self.flag(1 << instruction.operand('s'), instruction.operation == Bset);
                return true;
            }
            Nop => return true,
            _ => return false,
        };
        if !matches!(instruction.operation, Cp | Cpc | Cpi) {
            self.registers[d] = value;
        }
        true
    }
}
