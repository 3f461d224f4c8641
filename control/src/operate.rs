//! The operator's and the servo's part of the machine.
//!
//! - [`state`], [`lamp`]: HOLD, WORK or alarm, and the LED that shows it.
//! - [`configuration`], [`saved`], [`limits`]: the settings, their EEPROM copies, and limits calculated from them.
//! - [`manual_test`], [`calibration`], [`dry_run`], [`example_entry`]: manual tests, and entering examples.
//! - [`tool`], [`servo`]: the tool's commands, and the servo's pulse.
//! - [`plant_timeout`], [`unknown_run`]: signs that the machine has left its crop.
//! - [`event`], [`plot`], [`detections`]: output that waits for the console.
//!
//! Each module keeps its own data; [`weeder`](crate::weeder) connects them.

pub mod calibration;
pub mod command_error;
pub mod configuration;
pub mod detections;
pub mod dry_run;
pub mod event;
pub mod example_entry;
pub mod lamp;
pub mod limits;
pub mod manual_test;
pub mod plant_timeout;
pub mod plot;
pub mod saved;
pub mod servo;
pub mod state;
pub mod tool;
pub mod unknown_run;
