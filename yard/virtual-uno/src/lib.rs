#![doc = include_str!("../README.md")]
//! # Imports
//!
//! They run one way: `memory`, `file_error` -> `hex` -> `elf`, `error` -> `bootloader`, `core` -> `board` -> `pty`. Inside `core`: `chip` -> `timer`, `eeprom`,
//! `adc`, `uart`, with `measuring` beside them -> `recorder`, which owns what simavr calls back with -> `core`
//! itself, which runs it. `pins` knows none of these and is known to all; `recording` knows only `pins` and `file_error`.

#[cfg(feature = "simavr")]
mod board;
#[cfg(feature = "simavr")]
pub mod bootloader;
#[cfg(feature = "simavr")]
mod core;
#[cfg(feature = "simavr")]
pub mod elf;
#[cfg(feature = "simavr")]
mod error;
#[cfg(feature = "simavr")]
mod file_error;
#[cfg(feature = "simavr")]
pub mod hex;
#[cfg(feature = "simavr")]
pub mod memory;
mod pins;
#[cfg(feature = "simavr")]
#[cfg_attr(not(target_os = "linux"), path = "pty/none.rs")]
pub mod pty;
#[cfg(feature = "simavr")]
pub mod recording;

pub use self::pins::{CYCLES_PER_SECOND, Pin, PinChange, Pulse, Wire};
#[cfg(feature = "simavr")]
pub use self::{
    board::{BAUD, SENT_BYTE_CYCLES, Uno},
    core::measuring::{Cycles, InterruptStatistics, Place},
    core::recorder::{ReceivedByte, Reset, ResetCause},
    error::UnoError,
    file_error::FileError,
};
