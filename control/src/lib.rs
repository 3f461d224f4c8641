//! control
#![no_std]
#![forbid(unsafe_code)]
use ufmt::uWrite;
use avr_progmem::progmem_display as F;
avr_progmem::progmem! {
    /// A table
    pub static progmem NAMES: [u16; 40] = [7; 40];
}
/// hello
pub fn hello<W: uWrite>(w: &mut W, n: u8) -> Result<(), W::Error> {
    ufmt::uwrite!(w, "{}{}", F!("hello world this is a long text in flash"), NAMES.load_at(n as usize))
}
