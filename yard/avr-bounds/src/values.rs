//! Known values of registers and stack at a place, and how an instruction changes them.
//!
//! Only values that decide the control flow are followed: bytes of a stack pointer, a saved status register, constants,
//! values from the caller, and the source of a function pointer. All other values are unknown. A value is also unknown
//! where two paths meet with different values. The module `flow` follows the paths.

use crate::chip::Chip;
use crate::concrete::Concrete;
use crate::decode::Instruction;
use crate::decode::Operation::*;
use crate::effects::Registers;
use crate::error::Problem;

/// More than any SRAM: a stack this deep grows without an end.
pub(crate) const DEEPEST: usize = 0x4000;

// Registers by their address in the data space (data sheets, register summary).
const EIND: u16 = 0x5C;
const SPL: u16 = 0x5D;
const SPH: u16 = 0x5E;
const SREG: u16 = 0x5F;

/// SREG's bit of the interrupts.
pub(crate) const INTERRUPT_FLAG: u16 = 7;

/// The index of the flags in a set of registers and flags.
const FLAGS: usize = 32;

/// Whether an interrupt can be served before an instruction.
#[derive(Clone, Copy, Debug, PartialEq, Eq, PartialOrd, Ord, Hash)]
pub(crate) enum Interrupts {
    /// The flag is clear.
    Off,
    /// The flag has just been set: the instruction that follows is still carried out (data sheet, section 7.7).
    Soon,
    /// The flag is set.
    On,
}

/// The known content of a register.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub(crate) enum Value {
    Unknown,
    Constant(u8),
    /// The value of this register at the routine's entry.
    AtEntry(usize),
    /// The lower byte of the stack pointer at the entry, less this number, modulo 256.
    StackLow(u8),
    /// The upper byte of the stack pointer at the entry, less this number.
    StackHigh(i32),
    /// The status register, with interrupts on or off, and whether all other flags are as at the entry.
    Status(bool, bool),
    /// From memory, at this displacement from a pointer (`None`: a fixed address), and whether the pointer did so too.
    Loaded(Option<u8>, bool),
    /// Of a pointer that was loaded, and that a load or a store has moved by this number of bytes.
    Moved(u8),
    /// An unknown value, less a constant.
    Less(u8),
}

impl Value {
    /// The value where two paths meet.
    fn meet(self, other: Value) -> Value {
        match (self, other) {
            (Value::Status(on, is_of_entry), Value::Status(other_on, other_is)) if on == other_on => {
                Value::Status(on, is_of_entry && other_is)
            }
            _ if self == other => self,
            _ => Value::Unknown,
        }
    }
}

/// The known facts at a place.
#[derive(Clone, Debug, PartialEq)]
pub(crate) struct Known {
    pub(crate) registers: [Value; 32],
    /// Known flags and their values.
    flags: (u8, u8),
    /// The flags that still have their values from the entry.
    pub(crate) unchanged: Registers,
    /// Whether R1 is zero at the entry, as the calling convention requires for functions.
    is_zero_at_entry: bool,
    /// The general purpose I/O registers, which some handlers keep the status register in.
    pub(crate) kept: [Value; 3],
    /// The stack's content, from the entry on.
    pub(crate) stack: Vec<Value>,
    /// A constant was just subtracted from the lower byte of a stack pointer, or added: the byte before, and the
    /// constant. The carry is still that of this operation.
    borrow: Option<(u8, u8, bool)>,
    /// The stack pointer's upper byte was written, and the lower one not yet.
    pub(crate) upper_half: Option<Value>,
    /// The register that the zero flag is about.
    counted: Option<usize>,
    /// Whether every path here has started the program again.
    pub(crate) restarts: bool,
    pub(crate) interrupts: Interrupts,
}

/// The registers with known constants.
pub(crate) type Constants = [Option<u8>; 32];

impl Known {
    /// The known facts at a routine's entry.
    pub(crate) fn at_entry(is_function: bool, interrupts: Interrupts) -> Known {
        Known {
            registers: std::array::from_fn(Value::AtEntry),
            flags: (0, 0),
            unchanged: Registers::FLAGS,
            is_zero_at_entry: is_function,
            kept: [Value::Unknown; 3],
            stack: Vec::new(),
            borrow: None,
            upper_half: None,
            counted: None,
            restarts: false,
            interrupts,
        }
    }

    /// Sets the interrupt flag, or clears it.
    pub(crate) fn turn_interrupts(&mut self, on: bool) {
        self.interrupts = match (on, self.interrupts) {
            (false, _) => Interrupts::Off,
            (true, Interrupts::Off) => Interrupts::Soon,
            (true, already) => already,
        };
    }

    /// Takes the branch on which the last result was zero.
    pub(crate) fn is_zero(&mut self) {
        if let Some(register) = self.counted {
            self.registers[register] = Value::Constant(0);
        }
    }

    /// The content of a register, if it is a known constant.
    pub(crate) fn constant(&self, register: usize) -> Option<u8> {
        match self.registers[register] {
            Value::Constant(constant) => Some(constant),
            Value::AtEntry(1) if self.is_zero_at_entry => Some(0),
            _ => None,
        }
    }

    /// All registers with known constants.
    pub(crate) fn constants(&self) -> Constants {
        std::array::from_fn(|register| self.constant(register))
    }

    /// The number in a pair of registers, by the lower one.
    pub(crate) fn pair(&self, lower: usize) -> Option<u16> {
        Some(u16::from_le_bytes([self.constant(lower)?, self.constant(lower + 1)?]))
    }

    /// Keeps the facts that both have. Returns whether this has removed any.
    pub(crate) fn meet(&mut self, other: &Known) -> bool {
        let before = self.clone();
        let is_zero = self.constant(1) == Some(0) && other.constant(1) == Some(0);
        let pairs = (self.registers.iter_mut().zip(&other.registers))
            .chain(self.kept.iter_mut().zip(&other.kept))
            .chain(self.stack.iter_mut().zip(&other.stack));
        pairs.for_each(|(mine, theirs)| *mine = mine.meet(*theirs));
        // The caller's value in R1 and a constant can both be zero.
        if is_zero && self.registers[1] == Value::Unknown {
            self.registers[1] = Value::Constant(0);
        }
        let (mask, bits) = self.flags;
        let mask = mask & other.flags.0 & !(bits ^ other.flags.1);
        self.flags = (mask, bits & mask);
        self.unchanged &= other.unchanged;
        if self.borrow != other.borrow {
            self.borrow = None;
        }
        if self.counted != other.counted {
            self.counted = None;
        }
        self.restarts &= other.restarts;
        if self.upper_half != other.upper_half {
            self.upper_half = Some(Value::Unknown);
        }
        *self != before
    }

    /// The effect of a routine: registers and flags that it does not preserve are unknown.
    pub(crate) fn after(&mut self, keeps: Registers) {
        for register in (Registers::ALL - Registers::FLAGS - keeps).numbers() {
            self.registers[register] = Value::Unknown;
        }
        self.flags = (0, 0);
        self.unchanged &= keeps;
        self.borrow = None;
        self.counted = None;
    }

    /// The distance of a pair's address below the stack pointer at the entry, if it is known.
    fn below(&self, lower: usize) -> Option<i32> {
        match (self.registers[lower], self.registers[lower + 1]) {
            (Value::StackLow(low), Value::StackHigh(high)) if low == high as u8 => Some(high),
            _ => None,
        }
    }

    fn point_below(&mut self, lower: usize, below: i32) {
        self.registers[lower] = Value::StackLow(below as u8);
        self.registers[lower + 1] = Value::StackHigh(below);
    }

    /// The bytes that a pointer from memory has moved; `None` if it is no such pointer.
    fn moved(&self, pointer: usize) -> Option<u8> {
        match (self.registers[pointer], self.registers[pointer + 1]) {
            (Value::Loaded(..), Value::Loaded(..)) => Some(0),
            (Value::Moved(low), Value::Moved(high)) if low == high => Some(low),
            _ => None,
        }
    }

    /// The stack position that a load or a store accesses, by a pointer with a known target.
    fn on_stack(&self, instruction: &Instruction) -> Option<usize> {
        let (pointer, by) = instruction.pointer()?;
        let offset = if by < 0 { by.into() } else { i32::from(instruction.displacement()) };
        usize::try_from(self.below(pointer)? - offset).ok().filter(|place| *place < self.stack.len())
    }

    /// Applies arithmetic on the bytes of a stack pointer. Returns whether it was that.
    fn moves_stack_pointer(&mut self, instruction: &Instruction) -> bool {
        use Value::{StackHigh, StackLow, Unknown};

        let (d, r) = (instruction.destination, instruction.source);
        let constant = match instruction.operation {
            Adiw | Sbiw | Subi | Sbci => Some(instruction.constant),
            Add | Adc | Sub | Sbc => self.constant(r),
            _ => return false,
        };
        let is_sum = matches!(instruction.operation, Adiw | Add | Adc);
        let by = |constant: i32| if is_sum { -constant } else { constant };
        match (instruction.operation, self.registers[d], constant) {
            (Adiw | Sbiw, _, Some(constant)) => {
                let Some(below) = self.below(d) else { return false };
                self.point_below(d, below + by(constant.into()));
                self.borrow = None;
                true
            }
            (Subi | Add | Sub, StackLow(low), Some(constant)) => {
                self.registers[d] = StackLow((i32::from(low) + by(constant.into())) as u8);
                self.borrow = Some((low, constant, is_sum));
                true
            }
            (Sbci | Adc | Sbc, StackHigh(high), Some(constant)) => {
                self.registers[d] = match self.borrow.take() {
                    Some((low, lower, was_sum)) if low == high as u8 && was_sum == is_sum => {
                        StackHigh(high + by(u16::from_be_bytes([constant, lower]).cast_signed().into()))
                    }
                    _ => Unknown,
                };
                true
            }
            _ => false,
        }
    }

    /// Applies arithmetic on constants. Returns whether it was that.
    fn computes(&mut self, instruction: &Instruction) -> bool {
        let effects = instruction.effects();
        let known = |place: usize| match place.checked_sub(FLAGS) {
            Some(flag) => self.flags.0 >> flag & 1 == 1,
            None => self.constant(place).is_some(),
        };
        if !effects.reads.numbers().all(known) {
            return false;
        }
        let registers = std::array::from_fn(|register| self.constant(register).unwrap_or_default());
        let mut concrete = Concrete { registers, status: self.flags.1 };
        if !concrete.carry_out(instruction) {
            return false;
        }
        for place in effects.changes.numbers() {
            match place.checked_sub(FLAGS) {
                None => self.registers[place] = Value::Constant(concrete.registers[place]),
                Some(flag) => {
                    let bit = 1 << flag;
                    self.flags = (self.flags.0 | bit, self.flags.1 & !bit | concrete.status & bit);
                }
            }
        }
        true
    }

    /// The address that a load or a store accesses, if its pointer is a constant.
    fn pointed_at(&self, instruction: &Instruction) -> Option<u16> {
        let (pointer, by) = instruction.pointer()?;
        let address = self.pair(pointer)?.wrapping_add(instruction.displacement().into());
        Some(if by < 0 { address.wrapping_add_signed(by.into()) } else { address })
    }

    /// The address in the data space that an instruction writes to, if it is known.
    pub(crate) fn written(&self, instruction: &Instruction) -> Option<u16> {
        match instruction.operation {
            Out | Sts | Sbi | Cbi => instruction.data_address(),
            St | Std => self.pointed_at(instruction),
            _ => None,
        }
    }

    /// The stack's depth if this instruction sets the stack pointer to a constant, in a program that has started again.
    pub(crate) fn starts_again(&self, instruction: &Instruction, chip: &Chip) -> Option<usize> {
        let sets = self.restarts && self.written(instruction) == Some(SPL);
        let Some(Value::Constant(high)) = self.upper_half.filter(|_| sets) else { return None };
        let address = u16::from_be_bytes([high, self.constant(instruction.source)?]);
        chip.ram_last.checked_sub(address).map(usize::from)
    }

    /// Writes a register to the data space. Only start-up code may set the stack pointer to a constant.
    fn write(&mut self, address: u16, register: usize, chip: &Chip, is_start_up: bool) -> Result<(), Problem> {
        use Value::{Constant, StackHigh, StackLow, Status, Unknown};

        let value = self.constant(register).map_or(self.registers[register], Constant);
        match address {
            SREG => {
                self.flags = (0, 0);
                self.unchanged = Registers::empty();
                self.counted = None;
                match value {
                    Status(on, is_of_entry) => {
                        self.turn_interrupts(on);
                        if is_of_entry {
                            self.unchanged = Registers::FLAGS;
                        }
                    }
                    Constant(status) => self.turn_interrupts(status >> INTERRUPT_FLAG & 1 == 1),
                    _ => return Err(Problem::UnknownStatus),
                }
            }
            EIND if chip.return_address_bytes() > 2 => {
                if value != Constant(0) {
                    return Err(Problem::LongIndirect);
                }
            }
            SPH => self.upper_half = Some(value),
            SPL => {
                let upper = self.upper_half.take();
                let depth = match (upper, value) {
                    (Some(StackHigh(high)), StackLow(low)) if low == high as u8 => usize::try_from(high).ok(),
                    // The start-up code repeats the reset's value.
                    (Some(Constant(high)), Constant(low)) if is_start_up => {
                        chip.ram_last.checked_sub(u16::from_be_bytes([high, low])).map(usize::from)
                    }
                    _ => None,
                };
                let depth = depth.ok_or(Problem::UnknownStack)?;
                self.stack.resize(depth.min(DEEPEST + 1), Unknown);
            }
            _ => {
                if let Some(kept) = chip.gpior.iter().position(|gpior| *gpior == address) {
                    self.kept[kept] = value;
                }
            }
        }
        Ok(())
    }

    /// Executes an instruction that continues at the next one. Start-up code may set the stack pointer.
    pub(crate) fn carry_out(
        &mut self,
        instruction: &Instruction,
        chip: &Chip,
        is_start_up: bool,
    ) -> Result<(), Problem> {
        use Value::{Constant, Less, Loaded, Moved, StackHigh, StackLow, Status, Unknown};

        let (d, r) = (instruction.destination, instruction.source);
        let gpior =
            instruction.data_address().and_then(|address| chip.gpior.iter().position(|gpior| *gpior == address));
        let changes = instruction.effects().changes;
        let tells = |counted: &usize| (changes & (Registers::ZERO_FLAG | Registers::one(*counted))).is_empty();
        // With a carry from before, the flag is about all bytes of a number.
        let is_of_one = matches!(
            instruction.operation,
            Add | Adc | Sub | Subi | And | Andi | Or | Ori | Eor | Com | Neg | Inc | Dec | Lsr | Ror | Asr
        );
        self.counted = if is_of_one { Some(d) } else { self.counted.filter(tells) };
        self.unchanged -= changes;
        let moves = self.moves_stack_pointer(instruction);
        if !moves && !(changes & Registers::CARRY_FLAG).is_empty() {
            self.borrow = None;
        }
        if !moves && self.computes(instruction) {
            // Registers that are only moved may hold more than constants.
            return Ok(());
        }
        let changed_flags = (0..8).filter(|&flag| changes.has(FLAGS + flag)).fold(0, |all, flag| all | 1 << flag);
        self.flags = (self.flags.0 & !changed_flags, self.flags.1 & !changed_flags);
        if moves {
            return Ok(());
        }
        match instruction.operation {
            Bset if instruction.operand('s') == INTERRUPT_FLAG => self.turn_interrupts(true),
            Bclr if instruction.operand('s') == INTERRUPT_FLAG => self.turn_interrupts(false),
            Push => self.stack.push(self.registers[r]),
            Pop => self.registers[d] = self.stack.pop().ok_or(Problem::TakesTooMuch)?,
            Mov => self.registers[d] = self.registers[r],
            Movw => {
                self.registers[d + 1] = self.registers[r + 1];
                self.registers[d] = self.registers[r];
            }
            Subi | Sbci => self.registers[d] = Less(instruction.constant),
            In | Lds => {
                let depth = self.stack.len() as i32;
                self.registers[d] = match instruction.data_address() {
                    Some(SPL) => StackLow(depth as u8),
                    Some(SPH) => StackHigh(depth),
                    Some(SREG) => Status(self.interrupts != Interrupts::Off, self.unchanged == Registers::FLAGS),
                    _ if instruction.operation == Lds && gpior.is_none() => Loaded(None, false),
                    _ => gpior.map_or(Unknown, |gpior| self.kept[gpior]),
                };
            }
            Out | Sts => {
                let address = instruction.data_address().unwrap_or_default();
                if address < 0x20 {
                    return Err(Problem::RegisterInMemory);
                }
                self.write(address, r, chip, is_start_up)?;
            }
            Sbi | Cbi => gpior.into_iter().for_each(|gpior| self.kept[gpior] = Unknown),
            Mul | Muls | Mulsu | Fmul | Fmuls | Fmulsu => self.registers[..2].fill(Unknown),
            Ld | Ldd | Lpm | Elpm | St | Std => {
                let (pointer, by) = instruction.pointer().unwrap_or_default();
                let place = self.on_stack(instruction);
                let moved = self.moved(pointer);
                if let Some(address) = self.written(instruction) {
                    self.write(address, r, chip, is_start_up)?;
                }
                match instruction.operation {
                    Lpm | Elpm => self.registers[d] = Unknown,
                    St | Std => {
                        if let Some(place) = place {
                            self.stack[place] = lasting(self.registers[r]);
                        }
                    }
                    _ => {
                        let at =
                            |moved: u8| moved.checked_add(instruction.displacement())?.checked_add_signed(by.min(0));
                        let loaded = match moved.map(at) {
                            None => Loaded(Some(0), false),
                            Some(at) => at.map_or(Unknown, |at| Loaded(Some(at), true)),
                        };
                        let value = place.map_or(loaded, |place| lasting(self.stack[place]));
                        // If a pointer loads over itself, the second byte uses the pointer's old value.
                        self.registers[d] = value;
                    }
                }
                // The pointer moves, and so does the address that its content came from.
                if by != 0 && !(pointer..pointer + 2).contains(&d) {
                    match (self.below(pointer), self.pair(pointer)) {
                        (Some(below), _) => self.point_below(pointer, below - i32::from(by)),
                        (_, Some(address)) => {
                            let [low, high] = address.wrapping_add_signed(by.into()).to_le_bytes();
                            (self.registers[pointer], self.registers[pointer + 1]) = (Constant(low), Constant(high));
                        }
                        _ => {
                            let moved = moved.and_then(|moved| moved.checked_add_signed(by));
                            self.registers[pointer..pointer + 2].fill(moved.map_or(Unknown, Moved));
                        }
                    }
                }
            }
            Cp | Cpc | Cpi | Bst | Nop | Wdr | Bset | Bclr | Sleep | Spm | Break => {}
            // Compilers ask so whether a pair is zero.
            Adiw | Sbiw if instruction.constant == 0 => {}
            Adiw | Sbiw => self.registers[d..d + 2].fill(Unknown),
            _ => self.registers[d] = Unknown,
        }
        Ok(())
    }
}

/// The value of a byte in a frame, if compilers save such values. Others can be changed through pointers.
fn lasting(value: Value) -> Value {
    match value {
        Value::AtEntry(register) if Registers::PRESERVED.has(register) => value,
        Value::Status(..) | Value::StackLow(_) | Value::StackHigh(_) => value,
        _ => Value::Unknown,
    }
}
