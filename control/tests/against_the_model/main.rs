//! The controller against a model that is slow and obvious, over random runs on which anything may happen at any moment: every
//! line that can be typed, alarms of every kind, the work switch, rolling either way, standing and trembling, resets and power
//! cuts at any byte, edges lost, dust, an encoder that falls silent or is disturbed, and counters at their ends.
//!
//! After each turn of the loop this is held:
//! - the tool is not in the row over a canopy that the beam has seen, nor over its margin, whatever happened since; it may be
//!   told to come back before the margin's end by what the lead gives, at any speed of the last second;
//! - what was taken for a weed was seen whole;
//! - each line that is typed is answered by its lines and then by one `ok` or `error: `;
//! - what was answered with `ok` is there after a reset and after a power cut, settings and examples;
//! - at a steady speed the tool leaves the row once for a canopy, whatever the settings;
//! - it is out in every state but at work, and nothing but the operator has the machine work or clears an alarm;
//! - in the end, faults mended, the machine comes back to work.
//!
//! With a second beam each plant is held against where it really stands: the tool is in none that at least one beam has seen, although
//! the wheel slips, the slip changes, stands are denser than the beams, and either beam misses plants or sees dust of its own.
//!
//! A failure is shrunk to a few steps and printed as what a person would type and roll. The runs are the same each time,
//! so that a change is judged by them and not by luck. Runs and model are those of the crate `model_test`, which has the firmware walked as
//! well. For others, for as long as you like:
//!
//! ```sh
//! WEEDER_SEED=7 WEEDER_CASES=1000000 cargo test -p control --release --test against_the_model
//! ```

mod console;
mod decisions;
mod eeprom;
mod what_fell;

use decisions::Decisions;
use model_test::{Extent, drive::Drive, go_all, run};

#[test]
fn whatever_happens_the_tool_keeps_off_every_canopy_that_was_seen_and_the_machine_comes_back_to_work() {
    let extent = Extent { runs: 1500, least_turns: 10_000_000, shrinkings: 5000 };
    go_all(extent, &run::wild(30), Drive::<Decisions>::go);
}

#[test]
fn whatever_either_beam_misses_and_the_wheel_slips_the_tool_keeps_off_every_plant() {
    let extent = Extent { runs: 1500, least_turns: 10_000_000, shrinkings: 3000 };
    go_all(extent, &run::beams(24), Drive::<Decisions>::go);
}

#[test]
fn at_a_steady_speed_the_tool_leaves_the_row_once_for_a_canopy_whatever_the_settings() {
    let extent = Extent { runs: 300, least_turns: 1_000_000, shrinkings: 5000 };
    go_all(extent, &run::calm(8), Drive::<Decisions>::go);
}
