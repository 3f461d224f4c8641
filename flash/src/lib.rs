//! A byte of a table that lies in flash.
//!
//! [`avr_progmem`] reads values of any size, by a loop that copies them to the stack: 50 cycles for a single byte, where the chip's
//! instruction takes 3. Who reads byte after byte, as the console does its texts, reads them by [`byte`]. Off the chip a table
//! lies where everything does.

#![no_std]

use avr_progmem::{raw::read_byte, wrapper::ProgMem};

/// The byte at a place of a table, from 0 to `LENGTH` - 1.
///
/// # Panics
/// Behind the table's end.
#[inline(always)]
pub fn byte<const LENGTH: usize>(table: &ProgMem<[u8; LENGTH]>, place: usize) -> u8 {
    assert!(place < LENGTH);
    // SAFETY: a `ProgMem` points to a table that lies in flash, as whoever makes one vouches for, and the place is within it.
    unsafe { read_byte(table.as_ptr().cast::<u8>().add(place)) }
}

#[cfg(test)]
mod tests {
    avr_progmem::progmem! {
        static progmem TABLE: [u8; 4] = *b"beam";
    }

    #[test]
    fn each_byte_is_read_from_its_place() {
        let read: [u8; 4] = core::array::from_fn(|place| super::byte(&TABLE, place));
        assert_eq!(&read, b"beam");
    }

    #[test]
    #[should_panic(expected = "place < LENGTH")]
    fn there_is_nothing_behind_the_end() {
        super::byte(&TABLE, 4);
    }
}
