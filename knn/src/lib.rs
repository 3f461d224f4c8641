//! A k-nearest-neighbour classifier for 8-bit microcontrollers: no heap, no floats, no `unsafe`, no dependencies.

#![no_std]
#![forbid(unsafe_code)]

mod classify;
mod distance;
mod examples;
mod scale;
mod table;

pub use classify::{Answer, ClassifyError, Kind, MAX_K, classify};
pub use distance::{MAX_FEATURES, squared_distance};
pub use examples::{Example, Examples};
pub use scale::{Range, Scale};
pub use table::Table;
