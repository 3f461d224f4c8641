//! The tester: a second Uno that drives the weeder's inputs and measures its outputs.
//!
//! This crate is what its firmware decides, and what passes over its serial line. [`frame`] makes frames of messages and back, and finds a
//! damaged one. [`message`] lists the messages. [`piece`] and [`player`] play a plan: levels on the lines at cycles. [`station`] obeys
//! commands and sends records. [`pins`] has the wires. Registers are in the firmware (`tester/src/`), and all is tested on a computer.

#![no_std]
#![forbid(unsafe_code)]

pub mod frame;
pub mod message;
pub mod piece;
pub mod pins;
pub mod player;
pub mod station;
