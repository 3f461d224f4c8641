//! Compares the controller with a slow and simple model, in random runs with anything at any moment. The operator uses each console
//! line and the work switch. The machine rolls in both directions, stands and trembles. Faults are alarms of each kind, resets and
//! power cuts at any byte, lost edges, dust, and a silent or disturbed encoder. Counters wrap.
//!
//! After each turn of the loop it checks:
//! - after any event, the tool is never in the row over a seen canopy or its margin; it may be commanded back early by the lead at
//!   any speed of the last second;
//! - each weed was seen whole;
//! - each line of the console is answered by its lines and then one `ok` or `error: `;
//! - settings and examples answered with `ok` survive a reset and a power cut;
//! - at a steady speed the tool leaves the row once for each canopy, with any settings;
//! - the tool is out in each state except WORK, and only the operator starts work or clears an alarm;
//! - in the end, after the faults are repaired, the machine works again.
//!
//! With a second beam, the real plants and the swinging tool count: the tool is clear of each plant that at least one beam has seen.
//! Meanwhile the wheel slips, the slip changes, and stands are too dense for the beams. Either beam misses plants, and sees its own
//! dust.
//!
//! A failure is reduced to a few steps, printed as console lines and motion. Runs are the same each time, so that only a change of
//! the code can change the result. Runs and model come from the crate `model_test`, which also tests the firmware with them. For
//! other runs:
//!
//! ```sh
//! WEEDER_SEED=7 WEEDER_CASES=1000000 cargo test -p control --release --test against_the_model
//! ```

mod what_fell;

use model_test::{Extent, decisions::Decisions, drive::Drive, go_all, run};

#[test]
fn after_any_event_the_tool_keeps_off_every_seen_canopy() {
    let extent = Extent { runs: 1500, least_turns: 10_000_000, shrinkings: 5000 };
    go_all(extent, &run::wild(30), |run| Drive::go(run, Decisions::boot));
}

#[test]
fn with_slip_the_tool_keeps_off_every_plant_that_a_beam_saw() {
    let extent = Extent { runs: 1500, least_turns: 10_000_000, shrinkings: 3000 };
    go_all(extent, &run::beams(24), |run| Drive::go(run, Decisions::boot));
}

#[test]
fn at_a_steady_speed_the_tool_leaves_the_row_once_per_canopy() {
    let extent = Extent { runs: 300, least_turns: 1_000_000, shrinkings: 5000 };
    go_all(extent, &run::calm(8), |run| Drive::go(run, Decisions::boot));
}
