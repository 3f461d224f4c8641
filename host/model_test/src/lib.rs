//! Model-based tests: random runs of a weeder on a row, checked by a slow and simple model of the ground.
//!
//! [`run`] defines the steps of a run. [`drive`] executes them on a [`Machine`](machine::Machine) and checks it after
//! each turn. `model` stores what the beam has seen, and judges orders. [`stand`] has the real plants, and judges the
//! swinging tool. [`go_all`] executes many runs. It shrinks a failing run to a few steps, and prints them as lines to
//! type and distances to roll.
//!
//! The machine is the [`decisions`] alone (`control/tests/against_the_model/`, and `weeder soak` for hours) or the
//! firmware in the virtual Uno (`tests/end_to_end/random_walks.rs`). Both have the same checks, as far as they are
//! visible from outside.
//!
//! The runs are the same each time, so that a result depends on the change and not on luck. `WEEDER_SEED` gives other
//! runs, and `WEEDER_CASES` sets their number. [`is_thorough`] and [`cases`] are for every slow test.

pub mod decisions;
pub mod drive;
pub mod machine;
mod model;
pub mod run;
mod speeds;
pub mod stand;

use machine::Checked;
use proptest::{
    strategy::{BoxedStrategy, Strategy, ValueTree},
    test_runner::{Config, RngSeed, TestError, TestRunner},
};
use rayon::prelude::*;
use run::Run;
use std::env;
use std::sync::atomic::{AtomicU64, Ordering};

/// The number of runs, and of attempts to shrink one.
#[derive(Clone, Copy, Debug)]
pub struct Extent {
    /// Number of runs, before [`cases`]. `WEEDER_CASES` replaces it.
    pub runs: u32,
    /// Least number of checked turns in all runs: fewer would mean that the runs have become idle.
    pub least_turns: u64,
    /// Most attempts to shrink a failing run.
    pub shrinkings: u32,
}

/// Executes runs in parallel, each by `go`, which returns the number of checked turns.
///
/// # Panics
/// If a run fails, with the run shrunk; if too few turns were checked; or if an environment variable is not a number.
pub fn go_all(extent: Extent, runs: &BoxedStrategy<Run>, go: impl Fn(&Run) -> Result<u64, Failure> + Sync) {
    let asked = number("WEEDER_CASES");
    let number_of_runs = asked.unwrap_or(cases(extent.runs.into()));
    let seed = RngSeed::Fixed(number("WEEDER_SEED").unwrap_or(1));
    let config =
        Config { failure_persistence: None, max_shrink_iters: extent.shrinkings, rng_seed: seed, ..Config::default() };
    let mut runner = TestRunner::new(config);
    let turns = AtomicU64::new(0);
    let check = |run: &Run| -> Checked {
        turns.fetch_add(go(run)?, Ordering::Relaxed);
        Ok(())
    };
    let mut left = number_of_runs;
    while left > 0 {
        // The value tree that shrinks a run cannot leave this thread.
        let trees: Vec<_> = (0..left.min(BATCH))
            .map(|_| runs.new_tree(&mut runner).unwrap_or_else(|reason| panic!("no run can be drawn: {reason}")))
            .collect();
        left -= trees.len() as u64;
        let drawn: Vec<Run> = trees.iter().map(ValueTree::current).collect();
        let failed = drawn.par_iter().enumerate().find_map_first(|(place, run)| Some((place, check(run).err()?)));
        let Some((place, reason)) = failed else { continue };
        let Some(tree) = trees.into_iter().nth(place) else { continue };
        println!("{reason}\n{:?}Shrinking the run.", drawn[place]);
        match runner.run_one(tree, |run| check(&run)) {
            Err(TestError::Fail(reason, run)) => panic!("{reason}\n{run:?}"),
            Err(TestError::Abort(reason)) => panic!("{reason}"),
            Ok(_) => panic!("a run failed, but not when it was repeated:\n{:?}", drawn[place]),
        }
    }
    let turns = turns.into_inner();
    println!("{number_of_runs} runs, {turns} turns");
    assert!(asked.is_some() || turns >= cases(extent.least_turns), "{turns} turns");
}

/// Whether slow tests run all their cases: `WEEDER_THOROUGH` is set, as in the gate.
pub fn is_thorough() -> bool {
    env::var_os("WEEDER_THOROUGH").is_some()
}

/// The number of cases of a slow test: all of them, or a fifth unless [`is_thorough`].
pub fn cases(all: u64) -> u64 {
    if is_thorough() { all } else { all.div_ceil(5) }
}

/// Runs that are drawn before they are executed.
const BATCH: u64 = 64;

pub use proptest::test_runner::TestCaseError as Failure;

/// The number in an environment variable, if it is set.
fn number(name: &str) -> Option<u64> {
    let text = env::var(name).ok()?;
    Some(text.parse().unwrap_or_else(|_| panic!("{name}={text} is not a whole number")))
}
