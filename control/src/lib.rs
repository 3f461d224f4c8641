//! The weeder's decisions, from beam edge to swing, without a register, a clock, a float or a heap.
//!
//! The data's way: a beam edge with its position becomes an object of the [`ground`], the object's [`features`] a class by the
//! [`classifier`], a plant a window on the ground, and that with the present [`speed`] tells whether the tool has to be out
//! of the row. [`controller`] is the front door through which all of that, the operator's [`switch`] and the
//! [`console`] pass; [`reply`] words what comes back.
//!
//! Position and time are arguments everywhere, so that a test can bend both. What this crate does not do: read a pin,
//! wait, or know how its text reaches a terminal.
//!
//! `#[inline(never)]` stands where the firmware is measurably shorter for it: a function of its own has the chip's registers
//! to itself, while one that is copied into a large caller spills them to the stack.

#![no_std]
#![forbid(unsafe_code)]

pub mod alarm;
pub mod bench;
pub mod calibration;
pub mod classifier;
pub mod configuration;
pub mod console;
pub mod controller;
pub mod event;
pub mod examples;
pub mod features;
pub mod ground;
pub mod lamp;
pub mod line;
pub mod memory;
pub mod monitor;
pub mod objects;
pub mod plot;
pub mod quadrature;
pub mod refusal;
pub mod rehearsal;
pub mod reply;
pub mod reset;
mod said;
pub mod saved;
pub mod servo;
pub mod settings;
pub mod speed;
pub mod switch;
pub mod taught;
pub mod text;
pub mod tool;
pub mod units;
mod words;
