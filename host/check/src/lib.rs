//! The check of a real board by a second one, the tester.
//!
//! [`mod@run`] does all of it: [`wiring`] finds missing and swapped wires, [`servo`] measures pulses and the clocks' ratio, [`rates`] turns the
//! encoder as fast as it may, [`alarms`] plays faults, [`resets`] resets the weeder at work and while it saves, and [`row`] has it weed a row.
//! [`report`] sets measured, simulated and proved side by side.
//!
//! [`ports`] finds both boards. [`tester`] talks to the tester, and `link` to the weeder. [`plan`] turns levels at cycles into a plan.
//! [`pair`] has two virtual Unos in the place of the boards, wire to wire, [`second`] has another simulator's for one of them, [`desk`] puts
//! them at ports, and [`drawing`] shows the wires.

pub mod alarms;
pub mod desk;
pub mod drawing;
pub mod error;
pub mod pair;
pub mod plan;
pub mod ports;
pub mod rates;
pub mod report;
pub mod resets;
pub mod row;
pub mod run;
pub mod second;
pub mod servo;
pub mod tester;
pub mod wiring;

pub use self::error::CheckError;
