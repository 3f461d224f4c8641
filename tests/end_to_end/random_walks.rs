//! The firmware against the model of the ground, over random runs on which anything may happen at any moment, as the decisions are
//! walked in `control/tests/against_the_model/`: what is typed, every fault, the switch, rolling either way, resets and power cuts.
//!
//! Held at the pins after each turn: the servo's pulse never has the tool in the row over a canopy or a margin that the beam has
//! seen; each line is answered once; what was acknowledged is there after a reset; at a steady speed the tool leaves the row once
//! for a canopy; in HOLD and in an alarm the pulse has it out; in the end the machine comes back to work. For more of it:
//!
//! ```sh
//! WEEDER_SEED=7 WEEDER_CASES=3000 cargo test --test end_to_end random_walks
//! ```

mod board;

use board::Board;
use model_test::{Extent, drive::Drive, go_all, run};

#[test]
fn whatever_happens_to_the_firmware_the_tool_keeps_off_every_canopy_that_was_seen() {
    let extent = Extent { runs: 60, least_turns: 200_000, shrinkings: 300 };
    go_all(extent, &run::wild(14), Drive::<Board>::go);
}

#[test]
fn whatever_either_beam_misses_and_the_wheel_slips_the_firmware_keeps_off_every_plant() {
    let extent = Extent { runs: 24, least_turns: 150_000, shrinkings: 300 };
    go_all(extent, &run::beams(10), Drive::<Board>::go);
}

#[test]
fn at_a_steady_speed_the_firmware_has_the_tool_leave_the_row_once_for_a_canopy() {
    let extent = Extent { runs: 12, least_turns: 50_000, shrinkings: 300 };
    go_all(extent, &run::calm(4), Drive::<Board>::go);
}
