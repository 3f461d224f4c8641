//! The weeder's decisions, from beam edge to swing, without a register, a clock, a float or a heap.
//!
//! The data flow: [`measure`] takes clock, encoder, beam and switches. [`ground`] turns beam edges into detections, a detection's
//! features into a class, and a plant into a keep-out zone. With the present speed, the zone decides whether the tool must be out.
//! [`operate`] holds the operator's and the servo's part. [`weeder`] joins them, one turn of the loop at a time. [`say`] is the
//! console. Imports run one way: `ground` and `measure` do not import each other or the three behind them. All import [`units`],
//! [`settings`], [`memory`] and [`alarm`].
//!
//! Position and time are arguments, so a test controls both. What this crate does not do: read a pin, wait, or know how its text
//! reaches a terminal.
//!
//! `inline(never)` is used where it makes the firmware measurably shorter. A separate function has all of the chip's registers;
//! inlined into a large caller it spills them to the stack. Functions that every turn calls have it on the chip only, because it
//! makes them slower elsewhere.

#![no_std]
#![forbid(unsafe_code)]

#[cfg(test)]
extern crate std;

pub mod alarm;
pub mod ground;
pub mod measure;
pub mod memory;
mod named;
pub mod operate;
pub mod say;
pub mod settings;
pub mod units;
pub mod weeder;
