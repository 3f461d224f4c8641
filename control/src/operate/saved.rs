//! The saved settings: two copies in the EEPROM, written in turn.
//!
//! A copy is the table's mark, the number of values, a sequence number, the values, and a CRC-16 of all. A save overwrites the
//! older copy, one byte at a time, so a power loss leaves the newer copy intact. The save first makes the mark's first byte wrong
//! and writes it correctly at the end. So a half-written copy is invalid, even if an old copy with one flipped bit is overwritten.
//! At start-up the newest valid copy is used: right CRC, this firmware's table, all values within their ranges. A copy with the
//! mark of a complete save that is not valid has changed since. The operator is warned, because the other may be older.

use crate::{
    memory::{Memory, SIZE, checksum},
    settings::{Setting, Settings, TABLE_MARK},
};

/// Bytes before the values: the table's mark (2), their number, the sequence number.
const HEADER: usize = 4;

/// Index of the sequence number.
const SEQUENCE: u16 = HEADER as u16 - 1;

/// End of the values.
const END: usize = HEADER + 2 * Setting::COUNT as usize;

/// Bytes of a copy with its CRC.
pub const COPY: usize = END + 2;

/// Each copy has half of the memory, so the table can grow without moving a copy.
const STRIDE: u16 = SIZE as u16 / 2;

const _: () = assert!(COPY <= STRIDE as usize && COPY < u8::MAX as usize);

/// The settings in the EEPROM.
#[derive(Clone, Debug)]
pub struct SavedSettings<M> {
    memory: M,
    /// The older copy, 0 or 1, which the next save overwrites, and the newer copy's sequence number.
    older: u8,
    sequence: u8,
    /// Steps left of the save: make the first byte wrong, write the others, write the first.
    left: u8,
    /// The next byte of that step.
    next: u8,
    /// Whether there is a valid copy.
    exists: bool,
    /// Whether the other copy was saved, and is no longer valid.
    spoiled: bool,
}

impl<M: Memory> SavedSettings<M> {
    /// The settings before [`load`](Self::load).
    pub const fn new(memory: M) -> Self {
        Self { memory, older: 0, sequence: 0, left: 0, next: 0, exists: false, spoiled: false }
    }

    /// Loads the newest valid copy; `None` if there is none.
    pub fn load(&mut self) -> Option<Settings> {
        let mut settings = Settings::NONE;
        self.load_into(&mut settings).then_some(settings)
    }

    /// As [`load`](Self::load), without a second copy on the stack. Returns whether a copy is valid. If not, `settings` has
    /// undefined values.
    pub fn load_into(&mut self, settings: &mut Settings) -> bool {
        let sequence = |copy| self.memory.read(address(copy) + SEQUENCE);
        // If only one copy is valid, the order does not matter.
        let newer = u8::from(sequence(1).wrapping_sub(sequence(0)).cast_signed() > 0);
        // The newer one last. The other too, because the sequence number may have changed.
        for turn in 1..3 {
            let copy = newer ^ (turn & 1);
            if self.read(copy, settings) {
                self.exists = true;
                (self.older, self.sequence) = (copy ^ 1, self.memory.read(address(copy) + SEQUENCE));
            } else {
                self.spoiled |= self.was_saved(copy);
            }
        }
        self.exists && self.values(self.newest(), settings)
    }

    /// Starts to save the settings; [`carry_on`](Self::carry_on) finishes it.
    pub fn save(&mut self) {
        (self.exists, self.spoiled) = (true, false);
        self.older ^= 1;
        self.sequence = self.sequence.wrapping_add(1);
        // A first byte that is already wrong stays: a power loss while it is written can leave any value, also the right one.
        self.left = if self.memory.read(self.newest()) == MARK[0] { 3 } else { 2 };
    }

    /// The settings have changed: a save begins again.
    pub fn change(&mut self) {
        self.next = 0;
        if self.left == 1 {
            self.left = 3;
        }
    }

    /// Writes the next byte of these settings, if the memory is ready. Returns whether all is written.
    ///
    /// Out of line, so that its bytes are not on the loop's stack.
    #[cfg_attr(target_arch = "avr", inline(never))]
    pub fn carry_on(&mut self, settings: &Settings) -> bool {
        if self.left > 0 {
            let mut image = image(settings, self.sequence);
            let (offset, bytes) = match self.left {
                3 => {
                    image[0] = !image[0];
                    (0, &image[..1])
                }
                2 => (1, &image[1..]),
                _ => (0, &image[..1]),
            };
            let address = address(self.older ^ 1) + offset;
            if self.memory.update(address, bytes, &mut self.next) {
                self.left -= 1;
            }
        }
        self.left == 0
    }

    /// The saved value of a setting, if settings are saved. Not valid during a save.
    pub fn value(&self, setting: Setting) -> Option<u16> {
        self.exists.then(|| self.value_at(self.newest(), setting))
    }

    /// Loads the saved settings into `settings`. Returns whether there are any; if not, `settings` keeps its values.
    ///
    /// Out of line, because inlined it would put two more copies on the stack of the command's caller.
    #[inline(never)]
    pub fn restore(&self, settings: &mut Settings) -> bool {
        let mut saved = Settings::NONE;
        let exists = self.exists && self.values(self.newest(), &mut saved);
        if exists {
            *settings = saved;
        }
        exists
    }

    /// Whether a copy was saved, and has changed since. The next save overwrites it.
    pub const fn is_spoiled(&self) -> bool {
        self.exists && self.spoiled
    }

    /// The memory, for a test or another machine.
    pub fn into_memory(self) -> M {
        self.memory
    }

    /// The newest copy's address.
    fn newest(&self) -> u16 {
        address(self.older ^ 1)
    }

    /// A value of the copy at an address.
    fn value_at(&self, copy: u16, setting: Setting) -> u16 {
        let place = copy + HEADER as u16 + 2 * setting as u16;
        u16::from_le_bytes([self.memory.read(place), self.memory.read(place + 1)])
    }

    /// Reads the values of the copy at an address. Returns whether all are within their ranges.
    #[inline(never)]
    fn values(&self, copy: u16, settings: &mut Settings) -> bool {
        Setting::all().all(|setting| settings.set(setting, self.value_at(copy, setting)).is_ok())
    }

    /// Whether a copy's first byte is that of a complete save, or has one other bit. An unfinished save has all other bits.
    fn was_saved(&self, copy: u8) -> bool {
        let changed = self.memory.read(address(copy)) ^ MARK[0];
        changed & changed.wrapping_sub(1) == 0
    }

    /// Reads a copy. Returns whether it is valid.
    fn read(&self, copy: u8, settings: &mut Settings) -> bool {
        let byte = |place| self.memory.read(address(copy) + place);
        self.values(address(copy), settings)
            && (0..).zip(image(settings, byte(SEQUENCE))).all(|(place, right)| byte(place) == right)
    }
}

/// The table's mark, as a copy begins with it. Its first byte differs from an erased one in more than one bit.
const MARK: [u8; 2] = {
    let [low, high] = TABLE_MARK.to_le_bytes();
    [if low.count_ones() < 7 { low } else { !low }, high]
};

/// The bytes of a copy.
#[inline(never)]
fn image(settings: &Settings, sequence: u8) -> [u8; COPY] {
    let mut bytes = [0; COPY];
    let [low, high] = MARK;
    bytes[..HEADER].copy_from_slice(&[low, high, Setting::COUNT, sequence]);
    for (setting, value) in Setting::all().zip(bytes[HEADER..END].chunks_exact_mut(2)) {
        value.copy_from_slice(&settings.get(setting).to_le_bytes());
    }
    let check = checksum(&bytes[..END]).to_le_bytes();
    bytes[END..].copy_from_slice(&check);
    bytes
}

/// A copy's address.
const fn address(copy: u8) -> u16 {
    copy as u16 * STRIDE
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::memory::{ERASED, Volatile};
    use std::{format, vec::Vec};

    fn with_k(k: u16) -> Settings {
        Settings::with(&[(Setting::K, k)])
    }

    fn save(memory: Volatile, settings: &Settings) -> Volatile {
        let mut saved = SavedSettings::new(memory);
        saved.load();
        saved.save();
        while !saved.carry_on(settings) {}
        saved.into_memory()
    }

    /// The memory after a save whose power failed after this many bytes.
    fn save_cut(memory: &Volatile, settings: &Settings, power: usize) -> Volatile {
        let mut failing = memory.clone();
        failing.lose_power_after(power);
        save(failing, settings).with_power()
    }

    fn load(memory: &Volatile) -> Option<Settings> {
        SavedSettings::new(memory.clone()).load()
    }

    #[test]
    fn a_copy_is_mark_count_sequence_values_and_checksum() {
        let values = Setting::all().flat_map(|setting| with_k(9).get(setting).to_le_bytes());
        let mut bytes: Vec<u8> = MARK.into_iter().chain([Setting::COUNT, 77]).chain(values).collect();
        bytes.extend(checksum(&bytes).to_le_bytes());
        for copy in 0..2 {
            let mut memory = Volatile::new();
            memory.bytes[usize::from(address(copy))..][..bytes.len()].copy_from_slice(&bytes);
            assert_eq!(load(&memory), Some(with_k(9)), "copy {copy}");
        }
    }

    #[test]
    fn the_last_save_counts_after_the_sequence_wraps() {
        let mut memory = Volatile::new();
        for time in 0..600 {
            memory = save(memory, &with_k(1 + time % 15));
            assert_eq!(load(&memory), Some(with_k(1 + time % 15)), "{time}");
        }
    }

    /// Whether a start with this memory finds a copy that has changed since it was saved.
    fn is_spoiled(memory: &Volatile) -> bool {
        let mut saved = SavedSettings::new(memory.clone());
        saved.load();
        saved.is_spoiled()
    }

    #[test]
    fn each_changed_bit_is_reported_until_the_next_save() {
        let memory = save(save(Volatile::new(), &with_k(5)), &with_k(7));
        assert!(
            !is_spoiled(&Volatile::new()) && !is_spoiled(&save(Volatile::new(), &with_k(5))) && !is_spoiled(&memory)
        );
        for bit in 0..8 * COPY {
            for copy in 0..2 {
                let mut changed = memory.clone();
                changed.bytes[usize::from(address(copy)) + bit / 8] ^= 1 << (bit % 8);
                assert!(is_spoiled(&changed), "copy {copy}, bit {bit}");
                assert!(!is_spoiled(&save(changed, &with_k(9))), "copy {copy}, bit {bit}");
            }
        }
        for power in 0..=COPY + 1 {
            assert!(!is_spoiled(&save_cut(&memory, &with_k(9), power)), "{power}");
        }
    }

    #[test]
    fn power_lost_at_any_byte_of_a_save_leaves_the_old_settings_or_the_new() {
        for before in 1..4 {
            let mut memory = Volatile::new();
            for k in 0..before {
                memory = save(memory, &with_k(k + 1));
            }
            for power in 0..=COPY + 1 {
                let after = load(&save_cut(&memory, &with_k(9), power));
                assert!(after == Some(with_k(before)) || after == Some(with_k(9)), "{power}: {after:?}");
                assert!(power <= COPY || after == Some(with_k(9)), "complete save");
            }
        }
    }

    #[test]
    fn an_invalid_copy_is_replaced_by_the_other() {
        let memory = save(save(Volatile::new(), &with_k(5)), &with_k(7));
        for (copy, left) in [(0, 7), (1, 5)] {
            for place in 0..COPY {
                for bit in 0..8 {
                    let mut corrupted = memory.clone();
                    corrupted.bytes[usize::from(address(copy)) + place] ^= 1 << bit;
                    assert_eq!(load(&corrupted), Some(with_k(left)), "byte {place}, bit {bit}");
                    // A save never overwrites the remaining copy, and never makes the invalid copy valid again. At the power loss,
                    // the byte being written may take any value.
                    let saved = save(corrupted.clone(), &with_k(9)).bytes;
                    for power in 0..=COPY + 1 {
                        let [before, after] = [power, power + 1].map(|power| save_cut(&corrupted, &with_k(9), power));
                        let torn = (0..SIZE).find(|&address| before.bytes[address] != after.bytes[address]);
                        let address = torn.unwrap_or(0);
                        let values = [before.bytes[address], after.bytes[address], memory.bytes[address], 0, ERASED];
                        for value in torn.map_or(&values[..1], |_| &values) {
                            let mut found = before.clone();
                            found.bytes[address] = *value;
                            let expected = with_k(if found.bytes == saved { 9 } else { left });
                            let what = format!("byte {place}, bit {bit}, {power} writes, then {value:#04x}");
                            assert_eq!(load(&found), Some(expected), "{what}");
                        }
                    }
                }
            }
        }
    }

    /// A memory whose only copy has this change, and a right CRC.
    fn changed(change: impl FnOnce(&mut [u8; COPY])) -> Volatile {
        let mut copy = image(&with_k(5), 1);
        change(&mut copy);
        let check = checksum(&copy[..END]).to_le_bytes();
        copy[END..].copy_from_slice(&check);
        let mut memory = Volatile::new();
        memory.bytes[..COPY].copy_from_slice(&copy);
        memory
    }

    #[test]
    fn a_memory_without_a_valid_copy_holds_no_settings() {
        let erased = [Volatile::new(), Volatile::holding([0; SIZE])];
        let mut two_invalid = save(save(Volatile::new(), &with_k(5)), &with_k(7));
        two_invalid.bytes[10] ^= 1;
        two_invalid.bytes[usize::from(STRIDE) + 20] ^= 0x80;
        let of_another_table_or_length = (0..HEADER - 1).map(|place| changed(|copy| copy[place] ^= 1));
        let out_of_range = changed(|copy| copy[HEADER..HEADER + 2].copy_from_slice(&u16::MAX.to_le_bytes()));
        let invalid = erased.into_iter().chain([two_invalid, out_of_range]).chain(of_another_table_or_length);
        for (number, memory) in invalid.enumerate() {
            assert_eq!(load(&memory), None, "{number}");
        }
        assert_eq!(load(&changed(|_| {})), Some(with_k(5)));
    }

    #[test]
    fn correct_bytes_are_not_written_again() {
        let memory = save(save(Volatile::new(), &with_k(5)), &with_k(5));
        // The first byte twice, the sequence number and the CRC.
        assert_eq!(save_cut(&memory, &with_k(5), 5).bytes, save(memory, &with_k(5)).bytes);
        assert_eq!(Volatile::new().bytes[0], ERASED);
    }
}
