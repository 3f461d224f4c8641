//! The check of a real board by a second one, the tester.
//!
//! [`tester`] talks to the tester, and `link` to the weeder. [`plan`] turns levels at cycles into a plan. [`wiring`] finds missing and swapped
//! wires. [`servo`] measures pulses and the clocks' ratio, [`row`] has the weeder weed a row, and [`rates`] turns the
//! encoder as fast as it may. [`alarms`] plays faults, and [`resets`] resets the weeder at work and while it saves. [`mod@run`] does all of it, and [`report`] sets
//! measured, simulated and proved side by side. [`drawing`] shows the wires. [`pair`] has two virtual Unos in the place of the boards, wire to wire, and [`desk`] puts them at
//! ports.

pub mod alarms;
pub mod desk;
pub mod drawing;
pub mod error;
pub mod pair;
pub mod plan;
pub mod rates;
pub mod report;
pub mod resets;
pub mod row;
pub mod run;
pub mod servo;
pub mod tester;
pub mod wiring;

pub use self::error::CheckError;
