//! Encoder and beam fail during work: the firmware detects and names the fault, and has the tool out of the row.

use crate::common::{
    Run, ask, bare_ground, is_out_at_the_pin, named, number, pass, run_for_ms, started, status, steady, value,
};
use field::machine::cycle_at;
use field::motion::{Motion, mm_s};
use field::pass::{Pass, Start};
use field::row::{Canopy, Row};
use field::verdict::Verdict;
use field::wiring;
use uno::{CYCLES_PER_SECOND, Pin, PinChange};

/// Position of the fault: the tool is in the row between the second plant and the third, which the beam has just
/// passed.
const FAULT_MM: f64 = 1720.0;

/// Plants every 500 mm, the first at 600 mm.
fn plants() -> Row {
    Row::new((0..8).map(|number| Canopy::plant(600.0 + 500.0 * f64::from(number), 150.0)).collect())
        .expect("the plants stand apart")
}

/// A run at work at 2 km/h whose pins `alter` changes from the fault's cycle on.
fn with_fault(row: Row, length_mm: f64, alter: impl FnOnce(u64, Vec<PinChange>) -> Vec<PinChange>) -> Run {
    let pass = Pass { start: Start::Now, ..pass(row, steady(mm_s(2.0), length_mm)) };
    let time_s = pass.motion.passings(FAULT_MM).next().expect("the machine comes there").time_s;
    Run::begin_altered(pass, &[], |start_cycle, changes| alter(cycle_at(start_cycle, time_s), changes))
}

/// Asserts that the alarm of this name and code was reported once, and that the tool is out.
#[track_caller]
fn assert_alarm(run: &mut Run, alarm: &str) {
    run.roll_to_the_end();
    let events = run.events("alarm");
    assert_eq!(events.len(), 1, "{:#?}", run.lines());
    assert_eq!(named(&events[0]), alarm);
    let status = status(&mut run.uno);
    assert_eq!((value(&status, "state"), value(&status, "tool")), ("alarm", "out"), "{status}");
    assert!(is_out_at_the_pin(&run.uno));
}

fn is_encoder(change: &PinChange) -> bool {
    matches!(change.pin, wiring::ENCODER_A | wiring::ENCODER_B)
}

#[test]
fn an_encoder_that_falls_silent_harms_no_plant_and_is_an_alarm() {
    let mut run = with_fault(plants(), 4500.0, |fault, mut changes| {
        changes.retain(|change| change.cycle < fault || !is_encoder(change));
        changes
    });
    run.roll_to(FAULT_MM);
    assert!(!is_out_at_the_pin(&run.uno));
    // A rolling machine does not stop suddenly: the tool is out before it reaches the third plant.
    run.roll_to(FAULT_MM + 60.0);
    assert!(is_out_at_the_pin(&run.uno));
    assert_eq!(value(&status(&mut run.uno), "for"), "encoder_doubtful");
    assert_alarm(&mut run, "2-1 encoder_silent");
    for plant in run.judgement().plants {
        assert_ne!(plant.verdict, Verdict::Damaged, "{plant:?}");
    }
}

/// Drops the encoder's edges while `is_lost` is true. It gets the time in seconds since the machine passed a position.
fn losing_edges(row: Row, speed_km_h: f64, from_mm: f64, length_mm: f64, is_lost: impl Fn(f64) -> bool) -> Run {
    let pass = Pass { start: Start::Now, ..pass(row, steady(mm_s(speed_km_h), length_mm)) };
    let from_s = pass.motion.passings(from_mm).next().expect("the machine comes there").time_s;
    Run::begin_altered(pass, &[], |start_cycle, mut changes| {
        let from = cycle_at(start_cycle, from_s);
        let since_s = |cycle: u64| (cycle - from) as f64 / CYCLES_PER_SECOND as f64;
        changes.retain(|change| change.cycle < from || !is_encoder(change) || !is_lost(since_s(change.cycle)));
        changes
    })
}

fn damaged(run: &Run) -> usize {
    run.judgement().count(Verdict::Damaged)
}

#[test]
fn an_encoder_with_silences_is_an_alarm_and_costs_no_plant() {
    let mut run = losing_edges(plants(), 1.0, 500.0, 3500.0, |time_s| time_s % 0.1 < 0.025);
    assert_alarm(&mut run, "2-1 encoder_silent");
    assert_eq!(damaged(&run), 0);
}

#[test]
fn one_silence_of_200_ms_costs_no_plant_wherever_it_comes_and_is_no_alarm() {
    for place in 0..9 {
        let silent_mm = FAULT_MM + f64::from(place) * 500.0 / 9.0;
        let mut run = losing_edges(plants(), 2.5, silent_mm, 3400.0, |time_s| time_s < 0.2);
        run.roll_to(silent_mm + 60.0);
        assert!(is_out_at_the_pin(&run.uno), "{silent_mm} mm");
        // The encoder works again after 139 mm, and the tool does not come back over ground that was seen before.
        let spoken = run.uno.cycle();
        run.roll_to(silent_mm + 139.0 + 420.0);
        assert!(run.commands().iter().all(|command| command.rise_cycle < spoken), "{silent_mm} mm");
        run.roll_to_the_end();
        assert_eq!((damaged(&run), run.events("alarm")), (0, vec![]), "{silent_mm} mm");
    }
}

#[test]
fn an_encoder_that_stutters_at_a_crawl_costs_one_plant_at_most() {
    let mut run = losing_edges(plants(), 0.5, 500.0, 2600.0, |time_s| time_s % 0.05 < 0.01);
    assert_alarm(&mut run, "2-1 encoder_silent");
    assert!(damaged(&run) <= 1);
}

#[test]
fn an_encoder_that_loses_one_edge_in_ten_costs_one_plant_at_most() {
    // A pin keeps its level if an edge is dropped.
    let lost = |time_s: f64| (time_s * CYCLES_PER_SECOND as f64) as u64 % 10 == 3;
    let mut run = losing_edges(plants(), 2.5, 500.0, 3500.0, lost);
    run.roll_to_the_end();
    let alarm = run.events("alarm").pop().expect("an alarm");
    assert!(["encoder_channel_dead", "encoder_silent"].contains(&value(&alarm, "name")), "{alarm}");
    assert!(damaged(&run) <= 1);
}

#[test]
fn spikes_on_both_channels_do_not_count_but_raise_an_alarm() {
    // 17 a second, each for 0.1 ms.
    for (speed_km_h, is_alarm) in [(1.0, true), (4.0, false)] {
        let pass = Pass { start: Start::Now, ..pass(plants(), steady(mm_s(speed_km_h), 3500.0)) };
        let mut run = Run::begin_altered(pass.clone(), &[], |start_cycle, changes| {
            let level_at = |pin: Pin, cycle: u64| {
                changes
                    .iter()
                    .rev()
                    .find(|change| change.pin == pin && change.cycle <= cycle)
                    .is_some_and(|change| change.high)
            };
            let spikes = (5..(pass.motion.duration_s() * 17.0) as u64).flat_map(|number| {
                let cycle = start_cycle + number * CYCLES_PER_SECOND / 17;
                let is_quiet = !changes.iter().any(|c| is_encoder(c) && (cycle..cycle + 3200).contains(&c.cycle));
                let spike = [wiring::ENCODER_A, wiring::ENCODER_B].map(|pin| {
                    let high = level_at(pin, cycle);
                    [PinChange { cycle, pin, high: !high }, PinChange { cycle: cycle + 1600, pin, high }]
                });
                is_quiet.then_some(spike).into_iter().flatten().flatten()
            });
            let mut all: Vec<PinChange> = spikes.chain(changes.iter().copied()).collect();
            all.sort_by_key(|change| change.cycle);
            all
        });
        run.roll_to_the_end();
        let alarms = run.events("alarm");
        assert_eq!(alarms.len(), usize::from(is_alarm), "{speed_km_h} km/h: {alarms:?}");
        assert!(alarms.iter().all(|alarm| value(alarm, "name") == "encoder_jumps"), "{alarms:?}");
        let status = status(&mut run.uno);
        let rolled = pass.machine.ticks(&pass.motion, pass.motion.duration_s());
        assert!(number(&status, "jumps") > 20, "{status}");
        assert!((number(&status, "pos") - rolled).abs() <= 2, "{status}, and {rolled} were rolled");
        assert_eq!(damaged(&run), 0);
    }
}

#[test]
fn an_encoder_with_one_dead_channel_is_an_alarm() {
    for dead in [wiring::ENCODER_A, wiring::ENCODER_B] {
        let mut run = with_fault(bare_ground(), 2400.0, |fault, mut changes| {
            changes.retain(|change| change.cycle < fault || change.pin != dead);
            changes
        });
        assert_alarm(&mut run, "2-2 encoder_channel_dead");
        // Within a quarter of a second.
        let command = run.commands().pop().expect("a command");
        let place_mm = run.place_mm(command.rise_cycle);
        assert!(command.is_out && place_mm < FAULT_MM + 150.0, "{place_mm} mm");
    }
}

#[test]
fn an_encoder_whose_channels_change_at_once_is_an_alarm() {
    let mut run = with_fault(bare_ground(), 2400.0, |fault, mut changes| {
        // Both wires pick up the same noise: 40 times in 0.2 s.
        let noise = (0..80_u64).flat_map(|edge| {
            let cycle = fault + edge * CYCLES_PER_SECOND / 400;
            [wiring::ENCODER_A, wiring::ENCODER_B].map(|pin| PinChange { cycle, pin, high: edge % 2 == 0 })
        });
        changes.retain(|change| change.cycle < fault || !is_encoder(change));
        changes.extend(noise);
        changes
    });
    assert_alarm(&mut run, "2-3 encoder_jumps");
    assert!(number(&status(&mut run.uno), "jumps") > 20);
}

#[test]
fn a_machine_that_is_pushed_faster_than_its_limit_is_an_alarm() {
    let motion = Motion::steady(0.0, 3000.0, mm_s(2.0), 1000.0).change_speed(mm_s(4.0), 3000.0).roll_to(2500.0);
    let pass = Pass { start: Start::Now, ..pass(bare_ground(), motion) };
    let mut run = Run::begin(pass, &["set top_speed_mm_s 900"]);
    run.roll_to(1000.0);
    assert!(!is_out_at_the_pin(&run.uno));
    assert_alarm(&mut run, "3-1 too_fast");
}

#[test]
fn a_beam_that_flickers_in_dust_is_an_alarm() {
    let mut run = with_fault(bare_ground(), 2500.0, |fault, mut changes| {
        // 600 edges a second: the firmware can follow each of them.
        changes.extend((0..300_u64).map(|edge| PinChange {
            cycle: fault + edge * CYCLES_PER_SECOND / 600,
            pin: wiring::BEAM,
            high: edge % 2 == 1,
        }));
        changes
    });
    assert_alarm(&mut run, "1-2 beam_flickers");
}

#[test]
fn a_beam_that_is_never_broken_is_a_warning_until_a_plant_comes() {
    let row = Row::new(vec![Canopy::plant(2500.0, 150.0)]).expect("a plant is a row");
    let mut run = Run::begin(Pass { start: Start::Now, ..pass(row, steady(mm_s(2.5), 3000.0)) }, &["set no_plant_m 1"]);
    run.roll_to(950.0);
    assert_eq!(run.events("warning"), [""; 0]);
    run.roll_to(1100.0);
    assert_eq!(run.events("warning"), ["warning name=no_plants"]);
    let said = status(&mut run.uno);
    assert_eq!((value(&said, "state"), value(&said, "warning")), ("work", "no_plants"), "{said}");
    run.roll_to_the_end();
    assert_eq!(run.events("warning").len(), 1);
    assert!(!status(&mut run.uno).contains("warning="));
}

#[test]
fn a_speed_jump_before_a_zone_reports_one_late_command() {
    // The tool's zone begins at 1075 - 50 mm. The machine is fast from 60 mm before that on.
    let row = Row::new(vec![Canopy::plant(1150.0, 150.0)]).expect("a plant is a row");
    let jump_mm = 1150.0 - 75.0 - 50.0 + 400.0 - 60.0;
    let motion = Motion::starting_at(0.0)
        .change_speed(mm_s(0.8), 3000.0)
        .roll_to(jump_mm)
        .change_speed(mm_s(4.0), 100_000.0)
        .roll_to(jump_mm + 500.0);
    let mut run = Run::begin(Pass { start: Start::Now, ..pass(row, motion) }, &[]);
    run.roll_to(jump_mm);
    assert!(!is_out_at_the_pin(&run.uno));
    run.roll_to_the_end();
    assert_eq!(run.events("warning"), ["warning name=late_command"], "{:#?}", run.lines());
    let said = status(&mut run.uno);
    assert_eq!((value(&said, "state"), number(&said, "late")), ("work", 1), "{said}");
    let command = run.first_command_after(run.cycles().start);
    assert!(command.is_out);
    // At once: within the speed meter's window and a pulse.
    let late_ms = (run.place_mm(command.rise_cycle) - jump_mm) / mm_s(4.0) * 1000.0;
    assert!((0.0..60.0).contains(&late_ms), "{late_ms} ms");
}

#[test]
fn rolling_back_farther_than_ground_is_remembered_is_an_alarm() {
    let motion = Motion::starting_at(0.0)
        .change_speed(mm_s(2.5), 1000.0)
        .stop_at(9000.0, 1000.0)
        .change_speed(-mm_s(2.5), 1000.0)
        .stop_at(200.0, 1000.0);
    let mut run = Run::begin(Pass { start: Start::Now, ..pass(bare_ground(), motion) }, &["set no_plant_m 0"]);
    run.roll_to(8900.0);
    assert_eq!(run.events("alarm"), [""; 0]);
    assert_alarm(&mut run, "3-2 rolled_back_too_far");
}

#[test]
fn an_end_switch_that_does_not_follow_is_an_alarm() {
    // In HOLD the tool is out, so the switch must be closed.
    let mut run = Run::begin(pass(bare_ground(), steady(mm_s(1.0), 100.0)), &["hold"]);
    run.uno.set(wiring::END_SWITCH, false);
    run_for_ms(&mut run.uno, 50);
    ask(&mut run.uno, "set end_switch on");
    run_for_ms(&mut run.uno, 500);
    assert_eq!(run.events("alarm"), [""; 0]);
    run.uno.set(wiring::END_SWITCH, true);
    run_for_ms(&mut run.uno, 10);
    run.uno.set(wiring::END_SWITCH, false);
    run_for_ms(&mut run.uno, 500);
    assert_eq!(run.events("alarm"), [""; 0], "contacts bounce");
    run.uno.set(wiring::END_SWITCH, true);
    run_for_ms(&mut run.uno, 100);
    assert_alarm(&mut run, "4-1 tool_stuck");
}

#[test]
fn a_servo_that_dies_is_an_alarm_even_if_each_swing_is_short() {
    let row = Row::new((0..12).map(|number| Canopy::plant(1200.0 + 500.0 * f64::from(number), 60.0)).collect());
    let pass = pass(row.expect("the plants stand apart"), steady(1250.0, 8000.0));
    let mut run = Run::begin(Pass { start: Start::Now, ..pass }, &["events on"]);
    run.uno.set(wiring::END_SWITCH, false);
    run_for_ms(&mut run.uno, 50);
    ask(&mut run.uno, "set end_switch on");
    let mut place_mm = 400.0;
    while is_out_at_the_pin(&run.uno) {
        run.roll_to(place_mm);
        place_mm += 5.0;
    }
    // It stays where it is from here on.
    run.uno.set(wiring::END_SWITCH, true);
    assert!(run.events("alarm").is_empty());
    let before = run.events("swing").len();
    assert_alarm(&mut run, "4-1 tool_stuck");
    let swings = &run.events("swing")[before..];
    let [out, into] = ["out", "in"].map(|tool| swings.iter().filter(|swing| value(swing, "tool") == tool).count());
    // The alarm takes it out of the third swing in.
    assert_eq!((out, into), (4, 3), "{swings:#?}");
}

#[test]
fn after_fast_chatter_the_last_level_of_the_beam_counts() {
    let mut uno = started();
    ask(&mut uno, "plot on");
    // More edges than can wait, 10 us apart, ending with the beam broken or clear.
    for edges in 18..=90_u64 {
        let begin = uno.cycle() + 16 * 7 * edges;
        uno.drive((0..edges).map(|edge| PinChange {
            cycle: begin + 160 * edge,
            pin: wiring::BEAM,
            high: edge % 2 == 1,
        }));
        run_for_ms(&mut uno, 10);
        uno.received();
        run_for_ms(&mut uno, 120);
        let said = uno.received();
        let broken = format!("beam_broken:{}", edges % 2);
        let last = said.lines().rfind(|line| line.contains("windows:"));
        assert!(last.is_some_and(|line| line.contains(&broken)), "{edges} edges: {said:?}");
        uno.set(wiring::BEAM, true);
        run_for_ms(&mut uno, 10);
    }
}
