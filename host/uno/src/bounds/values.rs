//! What is known of the registers and the stack at a place of the program, and what an instruction makes of it.
//!
//! Only what decides where a program goes is followed: bytes of a stack pointer, a saved status register, constants, and what the caller
//! left. All else is unknown, and so is what two paths that meet disagree on. Where it goes from there is worked out in `flow`.

use super::decode::Instruction;
use super::decode::Operation::*;

/// The last address of SRAM, where the stack pointer stands after a reset (data sheet, stack pointer).
const SRAM_LAST: u16 = 0x08FF;

/// More than there is SRAM for: a stack so deep grows without an end.
pub(super) const DEEPEST: usize = 2048;

// Registers by their address in the data space (data sheet, register summary).
const GPIOR: [u16; 3] = [0x3E, 0x4A, 0x4B];
const SPL: u16 = 0x5D;
const SPH: u16 = 0x5E;
const SREG: u16 = 0x5F;

/// SREG's bit of the interrupts.
pub(super) const INTERRUPT_FLAG: u16 = 7;

/// Whether an interrupt can come in before an instruction.
#[derive(Clone, Copy, Debug, PartialEq, Eq, PartialOrd, Ord, Hash)]
pub(super) enum Interrupts {
    /// The flag is clear.
    Off,
    /// The flag has just been set: the instruction that follows is still carried out (data sheet, section 7.7).
    Soon,
    /// The flag is set.
    On,
}

/// What a register holds.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub(super) enum Value {
    Unknown,
    Constant(u8),
    /// What this register held at the routine's entry.
    AtEntry(usize),
    /// The lower byte of the stack pointer at the entry less so many, modulo 256.
    StackLow(u8),
    /// The upper byte of the stack pointer at the entry less so many.
    StackHigh(i32),
    /// The status register, with interrupts on or off.
    Status(bool),
}

/// What is known at a place.
#[derive(Clone, Debug, PartialEq)]
pub(super) struct Known {
    pub(super) registers: [Value; 32],
    /// The general purpose I/O registers, which some handlers keep the status register in.
    pub(super) kept: [Value; 3],
    /// What lies on the stack, from the entry on.
    pub(super) stack: Vec<Value>,
    /// A constant has just been subtracted from the lower byte of a stack pointer that had so many subtracted already, and the carry
    /// is still that subtraction's.
    pub(super) borrow: Option<(u8, u8)>,
    /// The stack pointer's upper byte has been written, and the lower one not yet.
    pub(super) upper_half: Option<Value>,
}

impl Known {
    /// What is known at a routine's entry.
    pub(super) fn at_entry() -> Known {
        Known {
            registers: std::array::from_fn(Value::AtEntry),
            kept: [Value::Unknown; 3],
            stack: Vec::new(),
            borrow: None,
            upper_half: None,
        }
    }

    /// The number in R21 and R20, a function's third argument where each has 16 bits.
    pub(super) fn length(&self) -> Option<u16> {
        match (self.registers[20], self.registers[21]) {
            (Value::Constant(low), Value::Constant(high)) => Some(u16::from_le_bytes([low, high])),
            _ => None,
        }
    }

    /// Leaves what both know; whether that is less than before.
    pub(super) fn meet(&mut self, other: &Known) -> bool {
        let before = self.clone();
        let pairs = (self.registers.iter_mut().zip(&other.registers))
            .chain(self.kept.iter_mut().zip(&other.kept))
            .chain(self.stack.iter_mut().zip(&other.stack));
        for (mine, _) in pairs.filter(|(mine, theirs)| mine != theirs) {
            *mine = Value::Unknown;
        }
        if self.borrow != other.borrow {
            self.borrow = None;
        }
        if self.upper_half != other.upper_half {
            self.upper_half = Some(Value::Unknown);
        }
        *self != before
    }

    /// Carries an instruction out that leads to the one behind it. Only start-up code may set the stack pointer to a constant.
    pub(super) fn carry_out(
        &mut self,
        instruction: &Instruction,
        interrupts_before: Interrupts,
        interrupts: &mut Interrupts,
        is_start_up: bool,
    ) -> Result<(), Doubt> {
        use Value::{Constant, StackHigh, StackLow, Status, Unknown};

        let (d, r) = (instruction.destination(), instruction.source());
        match instruction.operation {
            Bset if instruction.operand('s') == INTERRUPT_FLAG => turn(interrupts, true),
            Bclr if instruction.operand('s') == INTERRUPT_FLAG => turn(interrupts, false),
            Push => self.stack.push(self.registers[r]),
            Pop => {
                self.registers[d] = self.stack.pop().ok_or(Doubt::TakesTooMuch)?;
            }
            Mov => self.registers[d] = self.registers[r],
            Movw => {
                self.registers[d] = self.registers[r];
                self.registers[d + 1] = self.registers[r + 1];
            }
            Ldi => self.registers[d] = Constant(instruction.constant()),
            Eor | Sub if d == r => self.registers[d] = Constant(0),
            Adiw | Sbiw => {
                let constant = i32::from(instruction.constant());
                let constant = if instruction.operation == Sbiw { constant } else { -constant };
                let (low, high) = match (self.registers[d], self.registers[d + 1]) {
                    (StackLow(low), StackHigh(high)) if low == high as u8 => {
                        (StackLow((high + constant) as u8), StackHigh(high + constant))
                    }
                    _ => (Unknown, Unknown),
                };
                (self.registers[d], self.registers[d + 1]) = (low, high);
            }
            Subi => {
                let constant = instruction.constant();
                (self.registers[d], self.borrow) = match self.registers[d] {
                    StackLow(low) => (StackLow(low.wrapping_add(constant)), Some((low, constant))),
                    _ => (Unknown, None),
                };
            }
            Sbci => {
                self.registers[d] = match (self.registers[d], self.borrow.take()) {
                    (StackHigh(high), Some((low, subtracted))) if low == high as u8 => {
                        let constant = u16::from_be_bytes([instruction.constant(), subtracted]) as i16;
                        StackHigh(high + i32::from(constant))
                    }
                    _ => Unknown,
                };
            }
            In | Lds => {
                let depth = self.stack.len() as i32;
                self.registers[d] = match instruction.data_address() {
                    Some(SPL) => StackLow(depth as u8),
                    Some(SPH) => StackHigh(depth),
                    Some(SREG) => Status(interrupts_before != Interrupts::Off),
                    from => GPIOR.iter().position(|gpior| Some(*gpior) == from).map_or(Unknown, |kept| self.kept[kept]),
                };
            }
            Out | Sts => {
                let value = self.registers[r];
                match instruction.data_address() {
                    Some(SREG) => match value {
                        Status(on) => turn(interrupts, on),
                        Constant(status) => turn(interrupts, status >> INTERRUPT_FLAG & 1 == 1),
                        _ => return Err(Doubt::Status),
                    },
                    Some(SPH) => self.upper_half = Some(value),
                    Some(SPL) => {
                        let depth = match (self.upper_half.take(), value) {
                            (Some(StackHigh(high)), StackLow(low)) if low == high as u8 => usize::try_from(high).ok(),
                            // The start-up code says what the reset has done already.
                            (Some(Constant(high)), Constant(low)) if is_start_up => {
                                SRAM_LAST.checked_sub(u16::from_be_bytes([high, low])).map(usize::from)
                            }
                            _ => None,
                        };
                        let depth = depth.ok_or(Doubt::Stack)?;
                        self.stack.resize(depth.min(DEEPEST + 1), Unknown);
                    }
                    to => {
                        if let Some(kept) = GPIOR.iter().position(|gpior| Some(*gpior) == to) {
                            self.kept[kept] = value;
                        }
                    }
                }
            }
            Sbi | Cbi => {
                let to = instruction.data_address();
                if let Some(kept) = GPIOR.iter().position(|gpior| Some(*gpior) == to) {
                    self.kept[kept] = Unknown;
                }
            }
            Mul | Muls | Mulsu | Fmul | Fmuls | Fmulsu => self.registers[..2].fill(Unknown),
            Ld | Ldd | Lpm | St | Std => {
                if matches!(instruction.operation, Ld | Ldd | Lpm) {
                    self.registers[d] = Unknown;
                }
                // The pointer goes on, or back: whichever of them it is.
                if let Some(pointer) = instruction.moved_pointer() {
                    self.registers[pointer..pointer + 2].fill(Unknown);
                }
            }
            Cp | Cpc | Cpi | Bst | Nop | Wdr | Bset | Bclr => {}
            _ => self.registers[d] = Unknown,
        }
        Ok(())
    }
}

/// What was to be known of an instruction's operands, and is not.
#[derive(Clone, Copy, Debug)]
pub(super) enum Doubt {
    /// It takes more from the stack than the routine has put there.
    TakesTooMuch,
    /// It sets the stack pointer to what is not known.
    Stack,
    /// It sets the status register to what is not known.
    Status,
}

/// Sets the interrupt flag, or clears it.
fn turn(interrupts: &mut Interrupts, on: bool) {
    *interrupts = match (on, *interrupts) {
        (false, _) => Interrupts::Off,
        (true, Interrupts::Off) => Interrupts::Soon,
        (true, already) => already,
    };
}
