//! Beams far ahead of the tool, with several plants between them, and a beam that is too near for the speed.

use crate::common::{Run, assert_a_swing_each, assert_all_kept, assert_commands_in_place, number};
use field::machine::Machine;
use field::motion::mm_s;
use field::pass::Pass;
use field::planting::Planting;
use field::verdict::ZoneSettings;

/// Rolls along plants every 500 mm, and asks for the status meanwhile.
fn run_with_beam_at(beam_to_tool_mm: f64, speed_km_h: f64) -> Run {
    let planting = Planting { plants: 8, spacing_scatter_mm: 20.0, ..Planting::default() };
    let row = planting.grow(1).expect("the plants have room");
    let machine = Machine { beam_to_tool_mm, ..Machine::default() };
    let mut run = Run::begin(Pass::at_speed(row, machine, ZoneSettings::default(), mm_s(speed_km_h)), &[]);
    run.roll_on_asking("status", 100);
    run.roll_to_the_end();
    run
}

/// The most windows that the status spoke of.
fn most_windows(run: &mut Run) -> i64 {
    let lines = run.lines();
    lines.iter().filter(|line| line.starts_with("state=")).map(|line| number(line, "windows")).max().unwrap_or(0)
}

#[track_caller]
fn assert_weeds_with_beam_at(beam_to_tool_mm: f64, windows: i64) {
    let mut run = run_with_beam_at(beam_to_tool_mm, 2.0);
    let judgement = run.judgement();
    assert_all_kept(&judgement);
    assert_a_swing_each(&judgement, &run.commands());
    assert_commands_in_place(&judgement);
    assert!(most_windows(&mut run) >= windows);
}

#[test]
fn with_the_beam_900_mm_ahead_two_plants_wait_in_the_schedule() {
    assert_weeds_with_beam_at(900.0, 2);
}

#[test]
fn with_the_beam_1500_mm_ahead_three_plants_wait_in_the_schedule() {
    assert_weeds_with_beam_at(1500.0, 3);
}

#[test]
fn with_the_beam_2000_mm_ahead_four_plants_wait_in_the_schedule() {
    assert_weeds_with_beam_at(2000.0, 4);
}

#[test]
fn a_beam_too_near_for_the_speed_keeps_the_tool_out() {
    // 180 ms are 125 mm at 2.5 km/h: the tool could not swing out in time for a plant directly behind the beam.
    let mut run = run_with_beam_at(120.0, 2.5);
    assert_all_kept(&run.judgement());
    assert!(run.events("alarm")[0].starts_with("alarm code=3-1 name=too_fast "), "{:?}", run.lines());
    let cycles = run.cycles();
    let swings = run.commands().into_iter().filter(|command| cycles.contains(&command.rise_cycle));
    assert_eq!(swings.collect::<Vec<_>>(), []);
}
