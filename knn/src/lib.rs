//! An exact k-nearest-neighbour classifier for 8-bit microcontrollers: integers only, no heap, no `unsafe`, no
//! dependencies.
//!
//! # How it works
//!
//! A [`Scale`] turns measured integers into a byte a feature, so that no feature outweighs another. Labelled [`Example`]s are in
//! flash, EEPROM or SRAM behind the trait [`Examples`], and several stores are searched as one. A [`Table`] in SRAM takes new
//! examples at run time. [`classify`] finds the k nearest and counts their votes. The answer says whether it is [`Kind::Known`], a
//! [`Kind::Tie`] or a [`Kind::Stranger`]. If k does not fit the examples, it is an error, never a class.
//! [`classify`] has the rules of the vote.
//!
//! ```
//! use knn::{Answer, Example, Kind, Range, Scale, Table, classify};
//!
//! // Leaf length and width in mm, and what the plant was: 0 beet, 1 chickweed.
//! const SCALE: Scale<2> = Scale::new([Range { lowest: 0, highest: 90 }, Range { lowest: 0, highest: 50 }]);
//! const fn example(length_mm: i16, width_mm: i16, label: u8) -> Example<2> {
//!     Example::new(SCALE.quantise(&[length_mm, width_mm]), label)
//! }
//! let built_in = [example(48, 27, 0), example(55, 30, 0), example(12, 8, 1), example(15, 10, 1)];
//! let mut from_the_field: Table<2, 32> = Table::new();
//! from_the_field.add_example(example(61, 33, 0)).expect("the table has room");
//!
//! let plant = SCALE.quantise(&[58, 31]);
//! let answer: Answer<2> = classify(&(&built_in, &from_the_field), &plant, 3, 1_000)?;
//! assert_eq!((answer.label, answer.kind), (0, Kind::Known));
//! # Ok::<(), knn::ClassifyError>(())
//! ```
//!
//! # Costs
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
//!
//! # What it does not do
//!
//! It does not learn a scale at run time, or weight votes by distance. The host thins out examples, and chooses k and the radius.

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

/// The README's example, compiled and run as a test.
#[cfg(doctest)]
#[doc = include_str!("../README.md")]
struct Readme;
