//! A chip in simavr: its I/O registers, the peripherals behind them, and simavr's functions for writes to them.
//!
//! simavr stores a function and its parameter for each register, and calls it with the written byte. A correction puts
//! its own function in place of simavr's, and calls simavr's for the parts that are right.

use simavr_ffi as simavr;
use std::ffi::c_void;

/// Addresses of the I/O registers in the data space (data sheet, figure 8-3). simavr counts registers from the first.
const IO: std::ops::Range<u16> = 0x20..0x100;

/// An initialised chip. [`super::Core`] owns it, and passes it only to code that ends before the chip does.
#[derive(Clone, Copy)]
pub(super) struct Chip(*mut simavr::avr_t);

impl Chip {
    /// # Safety
    /// `avr` must be an initialised chip for as long as the result is used. No reference into its I/O registers or into
    /// their writers may be alive when a method is called.
    pub(super) unsafe fn of(avr: *mut simavr::avr_t) -> Chip {
        Chip(avr)
    }

    /// The chip for functions of simavr.
    pub(super) fn avr(self) -> *mut simavr::avr_t {
        self.0
    }

    /// Cycles since the first power-up.
    pub(super) fn cycle(self) -> u64 {
        // SAFETY: the chip is initialised.
        unsafe { (*self.0).cycle }
    }

    /// The content of an I/O register.
    pub(super) fn read(self, register: u16) -> u8 {
        assert!(IO.contains(&register));
        // SAFETY: the chip is initialised, and I/O registers are inside `data`.
        unsafe { *(*self.0).data.add(register.into()) }
    }

    /// Sets the content of an I/O register, without any effect on its peripheral.
    pub(super) fn set(self, register: u16, value: u8) {
        assert!(IO.contains(&register));
        // SAFETY: as in `read`.
        unsafe { *(*self.0).data.add(register.into()) = value };
    }

    /// The peripheral of an I/O register: the parameter of simavr's writer, which must not have been replaced.
    pub(super) fn peripheral<T>(self, register: u16) -> *mut T {
        self.writer(register).parameter.cast()
    }

    /// The writer of an I/O register.
    pub(super) fn writer(self, register: u16) -> Writer {
        // SAFETY: the chip is initialised.
        let write = unsafe { &(*self.0).io[usize::from(register - IO.start)].w };
        Writer { function: write.c, parameter: write.param }
    }

    /// Replaces the writer of an I/O register by `function`, which is called with `parameter`.
    ///
    /// # Safety
    /// `function` must be sound with `parameter` at every write that the chip makes.
    pub(super) unsafe fn replace_writer(
        self,
        register: u16,
        function: unsafe extern "C" fn(*mut simavr::avr_t, u16, u8, *mut c_void),
        parameter: *mut c_void,
    ) {
        // SAFETY: the chip is initialised.
        let write = unsafe { &mut (*self.0).io[usize::from(register - IO.start)].w };
        write.c = Some(function);
        write.param = parameter;
    }
}

/// simavr's function for writes of a register, and its parameter.
#[derive(Clone, Copy)]
pub(super) struct Writer {
    function: simavr::avr_io_write_t,
    parameter: *mut c_void,
}

impl Writer {
    /// Has the register written.
    ///
    /// # Safety
    /// `chip` must be the chip that this writer is of.
    pub(super) unsafe fn write(self, chip: Chip, register: u16, value: u8) {
        if let Some(function) = self.function {
            // SAFETY: the caller vouches for `chip`; function and parameter are simavr's own pair.
            unsafe { function(chip.avr(), register, value, self.parameter) };
        }
    }
}
