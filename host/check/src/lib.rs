//! Checks a real board by a second one, the tester.
//!
//! [`mod@run`] runs the whole check of two [`boards`]. [`wiring`] finds missing and swapped wires. [`servo`] measures
//! pulses and the clocks' ratio. [`rates`] turns the encoder at its highest rates. [`alarms`] plays faults. [`resets`]
//! resets the weeder at work and during a save. [`row`] lets it weed a row. [`report`] lists measured, simulated and
//! proved figures side by side.
//!
//! [`tester`] talks to the tester, and `link` to the weeder. [`plan`] turns levels at
//! cycles into a plan. [`pair`] replaces the boards by two virtual Unos, wired to each other. [`second`] replaces one
//! of them by another simulator's, [`desk`] connects them to ports, and [`drawing`] draws the wires.

pub mod alarms;
pub mod boards;
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
pub mod second;
pub mod servo;
pub mod tester;
pub mod wiring;

pub use self::boards::Boards;
pub use self::error::CheckError;
