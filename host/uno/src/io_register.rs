//! simavr's function for a write to an I/O register, and its replacement.
//!
//! simavr stores a function and its parameter for each register, and calls it with the written byte. A correction
//! stores simavr's own writer and puts its own function in its place. That function calls simavr's for the parts that
//! are right.

use std::ffi::c_void;

use simavr_ffi as simavr;

/// Address of the first I/O register in the data space. simavr counts registers from here.
const FIRST_IO: u16 = 0x20;

/// The peripheral that a register belongs to: the parameter of simavr's writer.
///
/// # Safety
///
/// As [`Writer::of`]. The writer must not have been replaced, and `T` must be simavr's type of the peripheral.
pub(super) unsafe fn peripheral<T>(avr: *mut simavr::avr_t, register: u16) -> *mut T {
    // SAFETY: the caller vouches for all.
    unsafe { Writer::of(avr, register) }.parameter.cast()
}

/// simavr's function for writes of a register, and its parameter.
#[derive(Clone, Copy)]
pub(super) struct Writer {
    function: simavr::avr_io_write_t,
    parameter: *mut c_void,
}

impl Writer {
    /// The writer of a register, by its address in the data space.
    ///
    /// # Safety
    ///
    /// `avr` must be an initialised chip, and `register` an I/O register.
    pub(super) unsafe fn of(avr: *mut simavr::avr_t, register: u16) -> Writer {
        // SAFETY: the caller vouches for both.
        let write = unsafe { &(*avr).io[usize::from(register - FIRST_IO)].w };
        Writer { function: write.c, parameter: write.param }
    }

    /// Replaces a register's writer by `function`, which is called with `parameter`.
    ///
    /// # Safety
    ///
    /// As [`Writer::of`], and `function` must be sound with `parameter` at every write that the chip makes.
    pub(super) unsafe fn replace(
        avr: *mut simavr::avr_t,
        register: u16,
        function: unsafe extern "C" fn(*mut simavr::avr_t, u16, u8, *mut c_void),
        parameter: *mut c_void,
    ) {
        // SAFETY: the caller vouches for both.
        let write = unsafe { &mut (*avr).io[usize::from(register - FIRST_IO)].w };
        write.c = Some(function);
        write.param = parameter;
    }

    /// Has the register written.
    ///
    /// # Safety
    ///
    /// `avr` must be the chip that this writer is of.
    pub(super) unsafe fn write(self, avr: *mut simavr::avr_t, register: u16, value: u8) {
        if let Some(function) = self.function {
            // SAFETY: the caller vouches for `avr`; function and parameter are simavr's own pair.
            unsafe { function(avr, register, value, self.parameter) };
        }
    }
}
