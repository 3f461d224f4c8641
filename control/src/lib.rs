//! The weeder's decisions, from beam edge to swing, without a register, a clock, a float or a heap.
//!
//! The data's way: [`measure`] takes clock, encoder, beam and switches; a beam edge with its position becomes a detection of the
//! [`ground`], the detection's features a class, a plant a window on the ground, and that with the present speed tells whether the
//! tool has to be out of the row. [`operate`] holds what the operator and the servo have to do with that. [`weeder`] joins them,
//! a turn of the loop at a time, and [`say`] is its console. Imports run that way and no other: `ground` and `measure` know
//! neither each other nor the three behind them, and all of them know [`units`], [`settings`], [`memory`] and [`alarm`].
//!
//! Position and time are arguments everywhere, so that a test can bend both. What this crate does not do: read a pin,
//! wait, or know how its text reaches a terminal.
//!
//! `inline(never)` stands where the firmware is measurably shorter for it: a function of its own has the chip's registers
//! to itself, while one that is copied into a large caller spills them to the stack. Where every turn calls it, that is said of the
//! chip alone: elsewhere such a function takes longer.

#![no_std]
#![forbid(unsafe_code)]

pub mod alarm;
pub mod ground;
pub mod measure;
pub mod memory;
pub mod operate;
pub mod say;
pub mod settings;
pub mod units;
pub mod weeder;
