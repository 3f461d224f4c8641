#![doc = include_str!("../README.md")]
//! # Imports
//!
//! They run one way. The chip: `chip` -> `timer`, `eeprom`, `adc`, `output`, `uart`, with `measuring` beside them -> `recorder`,
//! which owns what simavr calls back with -> `core`, which runs it -> `board`, which has the [`Uno`]. The files: `error` -> `elf`, `recording`, `pty` -> `hex`, `core` -> `board`.
//! `pins` knows none of these and is known to all; `recording` and `pty` know only `pins` and `error`.

#[cfg(feature = "simavr")]
mod adc;
#[cfg(feature = "simavr")]
mod board;
#[cfg(feature = "simavr")]
mod chip;
#[cfg(feature = "simavr")]
mod core;
#[cfg(feature = "simavr")]
mod eeprom;
#[cfg(feature = "simavr")]
pub mod elf;
#[cfg(feature = "simavr")]
mod error;
#[cfg(feature = "simavr")]
pub mod hex;
#[cfg(feature = "simavr")]
mod measuring;
#[cfg(feature = "simavr")]
mod output;
mod pins;
#[cfg(all(feature = "simavr", target_os = "linux"))]
pub mod pty;
#[cfg(feature = "simavr")]
mod recorder;
#[cfg(feature = "simavr")]
pub mod recording;
#[cfg(feature = "simavr")]
mod timer;
#[cfg(feature = "simavr")]
mod uart;

pub use self::pins::{CYCLES_PER_SECOND, Pin, PinChange, Pulse, Wire};
#[cfg(feature = "simavr")]
pub use self::{
    board::{BAUD, SENT_BYTE_CYCLES, Uno},
    error::{FileError, UnoError},
    measuring::{Cycles, InterruptStatistics, Place},
    recorder::{ReceivedByte, Reset, ResetCause},
};
