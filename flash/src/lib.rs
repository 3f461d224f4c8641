//! Reads a byte of a table in flash.
//!
//! [`avr_progmem`] reads values of any size with a loop that copies to the stack: 50 cycles for a byte. The chip's instruction
//! takes 3. Code that reads many single bytes, such as the console's texts, uses [`byte`]. On the host the table is in ordinary
//! memory.

#![no_std]

use avr_progmem::{raw::read_byte, wrapper::ProgMem};

/// The byte at an index of a table, from 0 to `LENGTH` - 1.
///
/// # Panics
/// If `place` is beyond the table.
#[inline(always)]
pub fn byte<const LENGTH: usize>(table: &ProgMem<[u8; LENGTH]>, place: usize) -> u8 {
    assert!(place < LENGTH);
    // SAFETY: the maker of a `ProgMem` guarantees that it points to a table in flash, and `place` is within it.
    unsafe { read_byte(table.as_ptr().cast::<u8>().add(place)) }
}

#[cfg(test)]
mod tests {
    avr_progmem::progmem! {
        static progmem TABLE: [u8; 4] = *b"beam";
    }

    #[test]
    fn each_byte_is_read_by_its_index() {
        let read: [u8; 4] = core::array::from_fn(|place| super::byte(&TABLE, place));
        assert_eq!(&read, b"beam");
    }

    #[test]
    #[should_panic(expected = "place < LENGTH")]
    fn a_place_beyond_the_end_panics() {
        super::byte(&TABLE, 4);
    }
}
