//! The tester: a second Uno that drives the weeder's inputs and measures its outputs.
//!
//! This crate holds the decisions of its firmware, and the protocol of its serial line. Registers are in the firmware
//! (`yard/tester/src/`), so a computer can test all of this.

#![no_std]
#![forbid(unsafe_code)]

pub mod frame;
pub mod message;
pub mod pins;
pub mod player;
pub mod station;
