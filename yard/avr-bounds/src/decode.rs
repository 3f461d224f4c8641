//! The AVR instructions: the meaning of a word in flash, and its cycles.
//!
//! The table has a row for every form of every instruction. Its bits are written as in the AVR instruction set manual.
//! Its cycles come from the instruction set summary in the data sheet. This project has its own table because no
//! existing decoder is reliable enough for a proof. The only crate that decodes AVR gives `jmp` and `call` a wrong
//! length, and this analysis depends on both. The text of avr-objdump is made for readers. A test compares the table
//! with avr-objdump over all 65,536 words.

use std::sync::LazyLock;

/// The operation of an instruction. Forms that differ only in addressing have the same name.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
#[rustfmt::skip]
pub(crate) enum Operation {
    Adc, Add, Adiw, And, Andi, Asr, Bclr, Bld, Brbc, Brbs, Break, Bset, Bst, Call, Cbi, Com, Cp, Cpc, Cpi, Cpse, Dec, Eicall, Eijmp, Elpm, Eor, Fmul,
    Fmuls, Fmulsu, Icall, Ijmp, In, Inc, Jmp, Ld, Ldd, Ldi, Lds, Lpm, Lsr, Mov, Movw, Mul, Muls, Mulsu, Neg, Nop, Or, Ori, Out,
    Pop, Push, Rcall, Ret, Reti, Rjmp, Ror, Sbc, Sbci, Sbi, Sbic, Sbis, Sbiw, Sbrc, Sbrs, Sleep, Spm, St, Std, Sts, Sub, Subi,
    Swap, Wdr,
}

use Operation::*;

/// A form of an instruction: its bits, from the highest on (a letter is a bit of the operand with that name); its
/// operation; its cycles, without the extra one of a taken branch and those of a skipped instruction.
type Form = (&'static str, Operation, u32);

/// Every form.
const FORMS: [Form; 91] = [
    ("000111rdddddrrrr", Adc, 1),
    ("000011rdddddrrrr", Add, 1),
    ("10010110KKddKKKK", Adiw, 2),
    ("001000rdddddrrrr", And, 1),
    ("0111KKKKddddKKKK", Andi, 1),
    ("1001010ddddd0101", Asr, 1),
    ("100101001sss1000", Bclr, 1),
    ("1111100ddddd0bbb", Bld, 1),
    ("111101kkkkkkksss", Brbc, 1),
    ("111100kkkkkkksss", Brbs, 1),
    ("1001010110011000", Break, 1),
    ("100101000sss1000", Bset, 1),
    ("1111101ddddd0bbb", Bst, 1),
    ("1001010kkkkk111k", Call, 4),
    ("10011000AAAAAbbb", Cbi, 2),
    ("1001010ddddd0000", Com, 1),
    ("000101rdddddrrrr", Cp, 1),
    ("000001rdddddrrrr", Cpc, 1),
    ("0011KKKKddddKKKK", Cpi, 1),
    ("000100rdddddrrrr", Cpse, 1),
    ("1001010ddddd1010", Dec, 1),
    ("1001010100011001", Eicall, 4),
    ("1001010000011001", Eijmp, 2),
    ("1001010111011000", Elpm, 3),
    ("1001000ddddd0110", Elpm, 3),
    ("1001000ddddd0111", Elpm, 3),
    ("001001rdddddrrrr", Eor, 1),
    ("000000110ddd1rrr", Fmul, 2),
    ("000000111ddd0rrr", Fmuls, 2),
    ("000000111ddd1rrr", Fmulsu, 2),
    ("1001010100001001", Icall, 3),
    ("1001010000001001", Ijmp, 2),
    ("10110AAdddddAAAA", In, 1),
    ("1001010ddddd0011", Inc, 1),
    ("1001010kkkkk110k", Jmp, 3),
    ("1001000ddddd1100", Ld, 2),
    ("1001000ddddd1101", Ld, 2),
    ("1001000ddddd1110", Ld, 2),
    ("1001000ddddd1001", Ld, 2),
    ("1001000ddddd1010", Ld, 2),
    ("1001000ddddd0001", Ld, 2),
    ("1001000ddddd0010", Ld, 2),
    ("10q0qq0ddddd1qqq", Ldd, 2),
    ("10q0qq0ddddd0qqq", Ldd, 2),
    ("1110KKKKddddKKKK", Ldi, 1),
    ("1001000ddddd0000", Lds, 2),
    ("1001010111001000", Lpm, 3),
    ("1001000ddddd0100", Lpm, 3),
    ("1001000ddddd0101", Lpm, 3),
    ("1001010ddddd0110", Lsr, 1),
    ("001011rdddddrrrr", Mov, 1),
    ("00000001ddddrrrr", Movw, 1),
    ("100111rdddddrrrr", Mul, 2),
    ("00000010ddddrrrr", Muls, 2),
    ("000000110ddd0rrr", Mulsu, 2),
    ("1001010ddddd0001", Neg, 1),
    ("0000000000000000", Nop, 1),
    ("001010rdddddrrrr", Or, 1),
    ("0110KKKKddddKKKK", Ori, 1),
    ("10111AArrrrrAAAA", Out, 1),
    ("1001000ddddd1111", Pop, 2),
    ("1001001rrrrr1111", Push, 2),
    ("1101kkkkkkkkkkkk", Rcall, 3),
    ("1001010100001000", Ret, 4),
    ("1001010100011000", Reti, 4),
    ("1100kkkkkkkkkkkk", Rjmp, 2),
    ("1001010ddddd0111", Ror, 1),
    ("000010rdddddrrrr", Sbc, 1),
    ("0100KKKKddddKKKK", Sbci, 1),
    ("10011010AAAAAbbb", Sbi, 2),
    ("10011001AAAAAbbb", Sbic, 1),
    ("10011011AAAAAbbb", Sbis, 1),
    ("10010111KKddKKKK", Sbiw, 2),
    ("1111110rrrrr0bbb", Sbrc, 1),
    ("1111111rrrrr0bbb", Sbrs, 1),
    ("1001010110001000", Sleep, 1),
    ("1001010111101000", Spm, 1),
    ("1001001rrrrr1100", St, 2),
    ("1001001rrrrr1101", St, 2),
    ("1001001rrrrr1110", St, 2),
    ("1001001rrrrr1001", St, 2),
    ("1001001rrrrr1010", St, 2),
    ("1001001rrrrr0001", St, 2),
    ("1001001rrrrr0010", St, 2),
    ("10q0qq1rrrrr1qqq", Std, 2),
    ("10q0qq1rrrrr0qqq", Std, 2),
    ("1001001rrrrr0000", Sts, 2),
    ("000110rdddddrrrr", Sub, 1),
    ("0101KKKKddddKKKK", Subi, 1),
    ("1001010ddddd0010", Swap, 1),
    ("1001010110101000", Wdr, 1),
];

/// The lower registers of the pointers.
const X: usize = 26;
const Y: usize = 28;
const Z: usize = 30;

/// Which form each word is of.
static FORM_OF_WORD: LazyLock<Vec<Option<&Form>>> = LazyLock::new(|| {
    let mut forms = vec![None; 1 << 16];
    for form in &FORMS {
        let bits = form.0.bytes().rev().enumerate();
        let (mut fixed, mut value) = (0_usize, 0_usize);
        for (bit, letter) in bits.filter(|(_, letter)| matches!(letter, b'0' | b'1')) {
            fixed |= 1 << bit;
            value |= usize::from(letter == b'1') << bit;
        }
        // Every combination of the free bits.
        let free = !fixed & 0xFFFF;
        let mut operand = 0_usize;
        loop {
            forms[value | operand] = Some(form);
            operand = operand.wrapping_sub(free) & free;
            if operand == 0 {
                break;
            }
        }
    }
    forms
});

/// The 16 bits at an address of some memory.
pub(crate) fn word_at(memory: &[u8], address: u32) -> Option<u16> {
    Some(u16::from_le_bytes(*memory.get(address as usize..)?.first_chunk()?))
}

/// An instruction at its address in flash.
#[derive(Clone, Copy)]
pub(crate) struct Instruction {
    /// Its address, in bytes.
    pub(crate) address: u32,
    /// What it does.
    pub(crate) operation: Operation,
    /// Its cycles, without those of a taken branch, of a skipped instruction, and of the EEPROM.
    pub(crate) cycles: u32,
    /// The register that is written, or read and written: R0 to R31; of a pair the lower one.
    pub(crate) destination: usize,
    /// The register that is only read.
    pub(crate) source: usize,
    /// The constant of an arithmetic instruction, or of `ldi`.
    pub(crate) constant: u8,
    bits: &'static str,
    word: u16,
    /// The second word, if it has one.
    second: u16,
}

impl Instruction {
    /// The instruction at an address, in bytes; `None` without flash or a valid instruction.
    pub(crate) fn at(flash: &[u8], address: u32) -> Option<Instruction> {
        let word = word_at(flash, address)?;
        let &(bits, operation, cycles) = FORM_OF_WORD[usize::from(word)]?;
        let second = if matches!(operation, Call | Jmp | Lds | Sts) { word_at(flash, address + 2)? } else { 0 };
        let (destination, source, constant) = (0, 0, 0);
        let found = Instruction { address, operation, cycles, bits, destination, source, constant, word, second };
        let (d, r) = (usize::from(found.operand('d')), usize::from(found.operand('r')));
        let destination = match (operation, bits.matches('d').count()) {
            (Movw, _) => d * 2,
            (_, 2) => 24 + d * 2,
            (_, 3 | 4) => 16 + d,
            _ => d,
        };
        let source = match operation {
            Movw => r * 2,
            Muls | Mulsu | Fmul | Fmuls | Fmulsu => 16 + r,
            _ => r,
        };
        Some(Instruction { destination, source, constant: found.operand('K') as u8, ..found })
    }

    /// The operand with this letter as a number, from its bits; 0 if the form has none.
    pub(crate) fn operand(&self, letter: char) -> u16 {
        let bits = self.bits.chars().zip((0..16).rev()).filter(|(bit, _)| *bit == letter);
        bits.fold(0, |operand, (_, bit)| operand << 1 | self.word >> bit & 1)
    }

    /// The data address in the instruction itself: of `in`, `out`, `lds`, `sts`, and of those for a register's bit.
    pub(crate) fn data_address(&self) -> Option<u16> {
        /// The address of the registers for `in` and `out` in the data space (data sheet, register summary).
        const IO_START: u16 = 0x20;

        match self.operation {
            Lds | Sts => Some(self.second),
            In | Out | Sbi | Cbi | Sbic | Sbis => Some(IO_START + self.operand('A')),
            _ => None,
        }
    }

    /// Whether it reads the register at this data address, which is in the instruction itself.
    pub(crate) fn reads(&self, address: u16) -> bool {
        matches!(self.operation, In | Lds | Sbic | Sbis) && self.data_address() == Some(address)
    }

    /// The lower register of a load's or store's pointer, and how it moves: after the access, or before if negative.
    pub(crate) fn pointer(&self) -> Option<(usize, i8)> {
        Some(match (self.operation, self.word & 0xF) {
            (Ld | St, 0xC) => (X, 0),
            (Ld | St, 0xD) => (X, 1),
            (Ld | St, 0xE) => (X, -1),
            (Ld | St, 0x9) => (Y, 1),
            (Ld | St, 0xA) => (Y, -1),
            (Ld | St, 0x2) => (Z, -1),
            (Ld | St, 0x1) | (Lpm, 0x5) | (Elpm, 0x7) => (Z, 1),
            (Ldd | Std, 0x8..) => (Y, 0),
            (Ldd | Std | Lpm | Elpm, _) => (Z, 0),
            _ => return None,
        })
    }

    /// The displacement of a load or a store from its pointer.
    pub(crate) fn displacement(&self) -> u8 {
        if matches!(self.operation, Ldd | Std) { self.operand('q') as u8 } else { 0 }
    }

    /// Its length in bytes.
    pub(crate) fn bytes(&self) -> u32 {
        if matches!(self.operation, Call | Jmp | Lds | Sts) { 4 } else { 2 }
    }

    /// The address behind it.
    pub(crate) fn next(&self) -> u32 {
        self.address + self.bytes()
    }

    /// The target of a jump, a call or a branch. Relative targets wrap at the flash's end.
    pub(crate) fn target(&self, flash_bytes: u32) -> Option<u32> {
        // The distance is in words, with its sign in the highest bit.
        let relative = |width: u32| {
            let distance = i32::from((self.operand('k') << (16 - width)) as i16) >> (16 - width);
            (self.next() as i32 + 2 * distance).rem_euclid(flash_bytes as i32) as u32
        };
        match self.operation {
            Jmp | Call => Some((u32::from(self.operand('k')) << 16 | u32::from(self.second)) * 2),
            Rjmp | Rcall => Some(relative(12)),
            Brbs | Brbc => Some(relative(7)),
            _ => None,
        }
    }
}

#[cfg(test)]
mod tests {
    use super::*;
    use std::process::Command;

    /// Instructions of the XMEGA only, and words that are no instruction.
    const LACKING: [&str; 6] = [".word", "des", "xch", "las", "lac", "lat"];
    const SPM_WITH_INCREMENT: u32 = 0x95F8;

    /// An instruction's name, as avr-objdump writes it.
    fn mnemonic(found: &Instruction) -> String {
        let bit = usize::from(found.operand('s'));
        match found.operation {
            Brbs => ["brcs", "breq", "brmi", "brvs", "brlt", "brhs", "brts", "brie"][bit].into(),
            Brbc => ["brcc", "brne", "brpl", "brvc", "brge", "brhc", "brtc", "brid"][bit].into(),
            Bset => ["sec", "sez", "sen", "sev", "ses", "seh", "set", "sei"][bit].into(),
            Bclr => ["clc", "clz", "cln", "clv", "cls", "clh", "clt", "cli"][bit].into(),
            // Without a displacement it has the shorter name.
            Ldd if found.operand('q') == 0 => "ld".into(),
            Std if found.operand('q') == 0 => "st".into(),
            other => format!("{other:?}").to_lowercase(),
        }
    }

    #[test]
    fn every_word_is_decoded_as_by_avr_objdump() {
        let file = tempfile::NamedTempFile::new().expect("there is room for a file");
        // A second word behind each, for those that have one; 0 is `nop`.
        let words: Vec<u8> = (0..=u16::MAX).flat_map(|word| [word.to_le_bytes(), [0, 0]].concat()).collect();
        std::fs::write(file.path(), &words).expect("it can be written");
        let mut objdump = Command::new("avr-objdump");
        let output = objdump.args(["-D", "-z", "-b", "binary", "-m", "avr:6"]).arg(file.path()).output();
        let text = String::from_utf8(output.expect("./setup.sh brings avr-objdump").stdout).expect("it is text");
        // Address, length and name of each instruction; data is called `.word`.
        let line = |line: &str| {
            let mut columns = line.split('\t');
            let address = u32::from_str_radix(columns.next()?.trim().strip_suffix(':')?, 16).ok()?;
            let length = columns.next()?.split_whitespace().count() as u32;
            Some((address, length, columns.next()?.trim().to_owned()))
        };
        let mut seen = 0;
        for (address, length, name) in text.lines().filter_map(line).filter(|(address, ..)| address % 4 == 0) {
            let found = Instruction::at(&words, address).map(|found| (found.bytes(), mnemonic(&found)));
            let word = address / 4;
            let expected = Some((length, name))
                .filter(|(_, name)| !LACKING.contains(&name.as_str()) && word != SPM_WITH_INCREMENT);
            assert_eq!(found, expected, "{word:#06x}");
            seen += 1;
        }
        assert_eq!(seen, 1 << 16);
    }

    #[test]
    fn no_word_is_of_two_forms() {
        let sizes = FORMS.iter().map(|(bits, ..)| 1 << bits.chars().filter(|bit| bit.is_alphabetic()).count());
        let all: usize = sizes.sum();
        // `ld` and `st` without a displacement are in the table once.
        assert_eq!(all, FORM_OF_WORD.iter().flatten().count());
    }
}
