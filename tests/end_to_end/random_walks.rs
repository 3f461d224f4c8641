//! Model-based tests of the firmware against the model of the ground: random runs with anything at any moment, like
//! those of the decisions in `control/tests/against_the_model/`. They include commands, every fault, the switch,
//! rolling both ways, resets and power failures.
//!
//! Each turn checks the pins. The servo's pulse never has the tool in the row over a canopy or a margin that the beam
//! has seen. Each line is answered once. Acknowledged data is there after a reset. At a steady speed the tool leaves
//! the row once for a canopy. In HOLD and in an alarm the pulse has the tool out. At the end the machine can work
//! again. To run more:
//!
//! ```sh
//! WEEDER_SEED=7 WEEDER_CASES=3000 cargo test --test end_to_end random_walks
//! ```

use crate::common::elf;
use model_test::{Extent, Failure, drive::Drive, go_all, run, run::Run};
use soak::Board;
use std::path::PathBuf;
use std::sync::LazyLock;

static ELF: LazyLock<PathBuf> = LazyLock::new(elf);

fn go(run: &Run) -> Result<u64, Failure> {
    Drive::go(run, |beginning, world| Board::boot(&ELF, beginning, world))
}

#[test]
fn in_random_runs_the_tool_keeps_off_every_seen_canopy() {
    let extent = Extent { runs: 60, least_turns: 200_000, shrinkings: 300 };
    go_all(extent, &run::wild(14), go);
}

#[test]
fn with_slip_and_missed_plants_the_tool_keeps_off_every_plant() {
    let extent = Extent { runs: 24, least_turns: 150_000, shrinkings: 300 };
    go_all(extent, &run::beams(10), go);
}

#[test]
fn at_a_steady_speed_the_tool_leaves_the_row_once_per_canopy() {
    let extent = Extent { runs: 12, least_turns: 50_000, shrinkings: 300 };
    go_all(extent, &run::calm(4), go);
}
