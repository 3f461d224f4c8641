//! The check of two virtual Unos, wire to wire.

mod common;
mod faults;
mod manual;

use check_board::desk::Desk;
use check_board::pair::Wiring;
use check_board::report::{Report, Verdict};
use check_board::resets::Kept;
use check_board::run::{Extent, run};
use check_board::{Boards, CheckError};
use common::{boards, boards_and_pair};
use std::collections::BTreeMap;
use std::path::Path;
use std::sync::Arc;
use std::sync::atomic::{AtomicBool, Ordering};
use uno_run::firmware;

/// The most SRAM of the tester, static and stack, of 2048 bytes.
const SRAM_USED: usize = 1750;

/// The longest time of a whole check, and of a bootloader's wait, in seconds.
const LONGEST_S: f64 = 600.0;
const BOOTLOADER_S: f64 = 2.0;

fn checked(boards: &mut Boards, brief: bool) -> Report {
    run(boards, Extent { brief, simulated: true }, |_, _| {}).expect("the check ends")
}

/// The whole check, which takes two real boards ten minutes at most.
fn whole_check() -> Report {
    let (pair, mut boards) = boards_and_pair(Wiring::right());
    let report = checked(&mut boards, false);
    let duration_s = pair.borrow().duration_s(BOOTLOADER_S);
    println!("The whole check takes two boards {duration_s:.0} s.");
    assert!(duration_s <= LONGEST_S, "{duration_s} s");
    report
}

fn figures(report: &Report) -> BTreeMap<String, f64> {
    report.lines.iter().map(|line| (line.id.clone(), line.measured.expect("it was measured"))).collect()
}

/// Whether this variable is set: one runs the whole check, another records its figures.
fn is_set(variable: &str) -> bool {
    std::env::var_os(variable).is_some()
}

#[test]
fn the_shipped_firmware_passes_and_is_as_recorded() {
    let (pair, mut boards) = boards_and_pair(Wiring::right());
    let brief = checked(&mut boards, true);
    assert!(brief.is_good(), "{}", brief.text());
    let pair = pair.borrow();
    let tester = pair.tester();
    let used = tester.size().sram as usize + tester.deepest_stack();
    assert!(used <= SRAM_USED, "the tester needs {used} bytes of SRAM");
    if is_set("UPDATE_EXPECT") {
        let recorded = concat!(env!("CARGO_MANIFEST_DIR"), "/src/simulated.json");
        let both = BTreeMap::from([("brief", figures(&brief)), ("whole", figures(&whole_check()))]);
        std::fs::write(recorded, serde_json::to_string_pretty(&both).unwrap() + "\n").unwrap();
        return;
    }
    assert_as_recorded(&brief);
}

#[test]
fn a_whole_check_is_as_recorded() {
    if is_set("WEEDER_THOROUGH") && !is_set("UPDATE_EXPECT") {
        assert_as_recorded(&whole_check());
    }
}

#[track_caller]
fn assert_as_recorded(report: &Report) {
    assert!(report.lines.iter().all(|line| line.verdict == Verdict::Pass), "{}", report.text());
    assert!(report.lines.iter().all(|line| line.simulated.is_some()), "{}", report.text());
}

#[test]
fn a_measured_row_agrees_with_the_simulation() {
    let mut boards = boards(Wiring::right());
    let pass = check_board::row::pass(8, 2, 2.5).expect("the row grows");
    let measured = boards.weed(&pass).expect("the row is weeded").judgement;
    let elf = firmware::build().expect("the weeder's firmware is built");
    let simulated = uno_run::run(&pass, &elf, |_| {}).expect("it is simulated").judgement;
    for (measured, simulated) in measured.plants.iter().zip(&simulated.plants) {
        assert_eq!(measured.verdict, simulated.verdict);
        let errors = [measured, simulated].map(|plant| [plant.out_error_ticks, plant.in_error_ticks]);
        for (measured, simulated) in errors[0].into_iter().zip(errors[1]) {
            let difference = measured.zip(simulated).map_or(0.0, |(measured, simulated)| measured - simulated);
            // The effect of the loop's turn and the servo's frame at this speed.
            assert!(measured.is_some() == simulated.is_some() && difference.abs() < 10.0, "{measured:?} {simulated:?}");
        }
    }
}

#[test]
fn the_boards_are_found_at_two_terminals() {
    let (tester, weeder) = (firmware::TESTER.elf().expect("it is built"), firmware::build().expect("it is built"));
    let desk = Desk::start(&tester, &weeder, None).expect("it starts");
    // The weeder's port is first, and no port is named.
    let unos = [desk.weeder(), desk.tester()].map(|path: &Path| path.to_str().expect("it is text").to_owned());
    let mut boards = Boards::open(None, None, &unos).expect("both are found");
    assert_eq!(boards.wire_errors().expect("both answer"), Vec::<String>::new());
    drop(boards);
    let error = Boards::open(Some(&unos[0]), None, &unos[..1]).map(drop).expect_err("there is no tester");
    assert!(error.to_string().starts_with("no tester answers at an Uno's port"), "{error}");
    desk.stop().expect("neither has stopped");
}

#[test]
fn an_interrupted_check_restores_the_saved_settings() {
    let mut boards = boards(Wiring::right());
    let before = Kept::read(&mut boards).expect("both answer");
    let interrupt = Arc::new(AtomicBool::new(false));
    boards.tester.interrupted_by(Arc::clone(&interrupt));
    let tried = boards.with_an_example(|boards| {
        interrupt.store(true, Ordering::Relaxed);
        boards.reset_while_saving(3)
    });
    assert!(matches!(tried, Err(CheckError::Interrupted)), "{tried:?}");
    let after = Kept::read(&mut boards).expect("both answer");
    assert_eq!(before, after);
}
