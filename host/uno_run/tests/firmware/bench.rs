//! Tests of the benchmark: the classifier's cycles and memory, and invalid measurements. The same sources give the same
//! figures on every machine.

use knn_bench::Task;
use uno_run::bench::encoder::{Direction, Load, Turning, turn};
use uno_run::{bench, firmware};

#[test]
fn a_classification_among_32_examples_in_flash_takes_at_most_3900_cycles() {
    let elf = firmware::BENCH.elf().expect("the bench builds");
    let costs = bench::classifier(&elf, |_| ()).expect("the bench runs, and every answer is the plain search's");
    let (_, cycles) = costs.tasks.iter().find(|(task, _)| *task == Task::Classify(32)).expect("it is measured");
    assert!(cycles.mean <= 3900.0, "{cycles:?}");
    assert!(cycles.most <= 4800, "{cycles:?}");
    assert!(costs.stack < 200, "{} bytes of stack", costs.stack);
}

#[test]
fn another_program_is_not_taken_for_the_bench() {
    let elf = firmware::build().expect("the firmware builds");
    let error = bench::classifier(&elf, |_| ()).expect_err("the firmware measures nothing");
    assert!(error.to_string().contains("run the ELF that `cargo bench-firmware` makes"), "{error}");
}

#[test]
fn a_rate_that_no_uno_can_follow_is_not_passed() {
    let elf = firmware::build().expect("the firmware builds");
    for load in [Load::Idle, Load::Telemetry] {
        let turning = Turning { load, direction: Direction::Forward, jitter: 0.0 };
        let slow = turn(&elf, turning, 10_000.0).expect("the firmware runs");
        assert!(slow.is_passed(), "{slow:?}");
        // 20 cycles a count.
        let fast = turn(&elf, turning, 800_000.0).expect("the firmware runs");
        assert!(!fast.is_passed(), "{fast:?}");
    }
}
