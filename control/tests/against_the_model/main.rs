//! The controller against a model that is slow and obvious, over random walks on which anything may happen at any moment: every
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
//! A failure is shrunk to a few happenings and printed as what a person would type and roll. The walks are the same each time,
//! so that a change is judged by them and not by luck. For others, for as long as you like:
//!
//! ```sh
//! WEEDER_SEED=7 WEEDER_CASES=1000000 cargo test -p control --release --test against_the_model
//! ```

mod drive;
mod eeprom;
mod model;
mod walk;
mod what_fell;

use drive::{Checked, Drive};
use proptest::{
    strategy::BoxedStrategy,
    test_runner::{Config, RngSeed, TestRunner},
};
use std::cell::Cell;
use walk::Walk;

/// Goes a walk, and back to work; counts the steps.
fn go(walk: &Walk, steps: &Cell<u64>) -> Checked {
    let mut drive = Drive::new(walk)?;
    let gone = walk.happenings.iter().try_for_each(|happening| drive.happen(happening));
    let gone = gone.and_then(|()| drive.come_back_to_work());
    steps.set(steps.get() + drive.steps);
    gone
}

/// What an environment variable says, if it is there.
fn number(name: &str) -> Option<u64> {
    let text = std::env::var(name).ok()?;
    Some(text.parse().unwrap_or_else(|_| panic!("{name}={text} is not a whole number")))
}

/// Goes so many walks, or as many as the environment asks for, from a seed that it may give too; at least so many steps.
fn go_all(cases: u32, walks: BoxedStrategy<Walk>, least_steps: u64) {
    let asked = number("WEEDER_CASES");
    let config = Config {
        cases: asked.map_or(cases, |cases| cases as u32),
        failure_persistence: None,
        max_shrink_iters: 5000,
        rng_seed: RngSeed::Fixed(number("WEEDER_SEED").unwrap_or(1)),
        ..Config::default()
    };
    let steps = Cell::new(0);
    let gone = TestRunner::new(config).run(&walks, |walk| go(&walk, &steps));
    println!("{} steps", steps.get());
    if let Err(failure) = gone {
        panic!("{failure}");
    }
    assert!(asked.is_some() || steps.get() >= least_steps, "{} steps", steps.get());
}

#[test]
fn whatever_happens_the_tool_keeps_off_every_canopy_that_was_seen_and_the_machine_comes_back_to_work() {
    go_all(1500, walk::wild(), 10_000_000);
}

#[test]
fn at_a_steady_speed_the_tool_leaves_the_row_once_for_a_canopy_whatever_the_settings() {
    go_all(300, walk::calm(), 1_000_000);
}
