//! The firmware's output for each plant, compared with the paper's Eq. 1 to 3 for the plants' true positions.

use crate::common::{Run, assert_all_kept, assert_commands_in_place, number};
use field::machine::Machine;
use field::motion::mm_s;
use field::pass::Pass;
use field::planting::Planting;
use field::verdict::ZoneSettings;

/// Beam edges and counter each have a grain of a tick.
const GRAIN_TICKS: f64 = 2.0;

#[track_caller]
fn assert_near(line: &str, key: &str, true_ticks: f64) {
    let said = number(line, key) as f64;
    assert!((said - true_ticks).abs() <= GRAIN_TICKS, "{key} is {true_ticks:.1} in truth: {line}");
}

#[track_caller]
fn assert_schedules_as_the_equations_say(machine: Machine) {
    let row = Planting { plants: 5, ..Planting::default() }.grow(3).expect("the plants have room");
    let pass = Pass::at_speed(row.clone(), machine, ZoneSettings::default(), mm_s(2.0));
    let start_mm = pass.motion.start_mm();
    let mut run = Run::begin(pass, &[]);
    run.roll_to_the_end();
    let judgement = run.judgement();
    assert_all_kept(&judgement);
    assert_commands_in_place(&judgement);

    let ticks = |length_mm: f64| length_mm / machine.tick_mm();
    let mut events = run.events("plant");
    events.extend(run.events("unknown"));
    events.sort_by_key(|line| number(line, "pos"));
    assert_eq!(events.len(), row.plants().count());
    let mut last_mm = start_mm;
    for (event, plant) in events.iter().zip(row.plants()) {
        let leading_mm = plant.span_mm().start;
        let (delay, hold) = (ticks(machine.beam_to_tool_mm - 50.0), ticks(plant.width_mm + 100.0));
        assert_near(event, "pos", ticks(leading_mm - start_mm));
        assert_near(event, "spacing", ticks(leading_mm - last_mm));
        assert_near(event, "delay", delay);
        assert_near(event, "hold", hold);
        assert_near(event, "actuation", delay + hold);
        last_mm = leading_mm;
    }
}

#[test]
fn delay_hold_and_actuation_are_those_of_the_equations() {
    assert_schedules_as_the_equations_say(Machine::default());
}

#[test]
fn they_are_so_with_another_wheel_and_encoder() {
    let machine = Machine { wheel_mm: 620.0, ticks_per_rev: 4096, beam_to_tool_mm: 550.0, ..Machine::default() };
    assert_schedules_as_the_equations_say(machine);
}
