#![doc = include_str!("../README.md")]
//!
//! # Costs in bytes and steps
//!
//! With F features, C classes, n examples and `usize` of 2 bytes:
//!
//! | what | bytes of SRAM | work |
//! |---|---|---|
//! | `[Example<F>; n]` | n (F + 1) | |
//! | [`Table<F, N>`](Table) | N (F + 1) + 2 | `add_example` O(1), `remove` O(n) |
//! | [`Scale<F>`](Scale) | 5 F | `quantise`: F subtractions, shifts and multiplications |
//! | [`Nearest`] for k, which may be kept | 4 k + 1 | |
//! | [`classify`] | about 100 + 2 C of stack | n F multiplications of 8 x 8 bits; up to k comparisons an example; k to vote |
//!
//! The README has a table of cycles on an ATmega328P, for F = 5, C = 2 and k = 3. An example that joins the nearest takes about five
//! times the cycles of one that is left early (see [`Examples::join`]). In random order, k (1 + ln(n / k)) of n join. If each one is
//! a little nearer than the one before, all join. [`Scale::quantise`] takes 1,400 cycles. `cargo bench-uno` in the weeder's workspace
//! measures all of this in the simulator simavr.

#![no_std]
#![forbid(unsafe_code)]

mod answer;
mod classify;
mod distance;
mod examples;
mod nearest;
mod neighbour;
mod scale;
mod table;

pub use answer::{Answer, ClassifyError, Kind, MAX_K};
pub use classify::classify;
pub use distance::{MAX_FEATURES, squared_distance};
pub use examples::{Example, Examples};
pub use nearest::Nearest;
pub use neighbour::Neighbour;
pub use scale::{Range, Scale};
pub use table::Table;
