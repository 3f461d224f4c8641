//! What the beam has seen keeps the tool out, whatever comes between beam and tool: an alarm with a plant half seen, an alarm just
//! behind one, and a row that was only played.

use crate::common::{Run, ask, assert_all_kept, run_for_ms, trial, woken_up};
use field::motion::{Motion, mm_s};
use field::row::{Row, Thing};
use field::verdict::{Judgement, Verdict};
use signal::CYCLES_PER_SECOND;

/// Above this the machine is too fast.
const TOP_SPEED: &str = "set top_speed_mm_s 600";

/// Plants of 150 mm, from 300 to 450 and from 800 to 950 mm.
fn plants() -> Row {
    Row::new(vec![Thing::plant(375.0, 150.0), Thing::plant(875.0, 150.0)]).expect("the plants stand apart")
}

/// The motion is interrupted by an alarm, which is cleared at a time in seconds while the machine stands; then it goes on.
fn roll(motion: Motion, clear_at_s: f64) -> Run {
    let mut run = Run::begin(trial(plants(), motion), &[TOP_SPEED]);
    run.roll_for(clear_at_s);
    assert_eq!(run.events("alarm").len(), 1, "{:#?}", run.lines());
    assert!(run.events("alarm")[0].contains("too_fast"), "{:#?}", run.lines());
    ask(&mut run.uno, "clear");
    ask(&mut run.uno, "start");
    run.roll_to_the_end();
    run
}

#[track_caller]
fn assert_none_damaged(judgement: &Judgement) {
    for plant in &judgement.plants {
        assert_ne!(plant.verdict, Verdict::Damaged, "{plant:?}");
    }
}

#[test]
fn the_rest_of_a_half_seen_plant_is_no_weed_after_an_alarm() {
    for seen_mm in [20.0, 80.0, 120.0, 132.0, 140.0] {
        let motion = Motion::starting_at(0.0)
            .change_speed(mm_s(2.0), 3000.0)
            .stop_at(800.0 + seen_mm, 3000.0)
            .go_on_for(0.2)
            .change_speed(-mm_s(0.8), 1000.0)
            .roll_to(740.0)
            .change_speed(-mm_s(2.5), 3000.0)
            .roll_to(500.0)
            .change_speed(0.0, 3000.0)
            .go_on_for(0.5);
        let clear_at_s = motion.duration_s() - 0.25;
        let mut run = roll(motion.change_speed(mm_s(2.0), 1000.0).roll_to(1900.0), clear_at_s);
        assert_eq!(run.events("weed"), [""; 0], "{seen_mm} mm: {:#?}", run.lines());
        assert_none_damaged(&run.judgement());
        let behind = |cycle| run.place_mm(cycle) > 1300.0;
        let commands = run.commands();
        assert!(commands.iter().any(|command| !command.is_out() && behind(command.rise_cycle)), "{commands:?}");
    }
}

#[test]
fn the_margin_behind_a_canopy_is_kept_over_an_alarm() {
    for behind_mm in [5.0, 25.0, 45.0] {
        let motion = Motion::starting_at(0.0)
            .change_speed(mm_s(2.0), 3000.0)
            .roll_to(450.0 + behind_mm)
            .change_speed(mm_s(2.5), 3000.0)
            .change_speed(0.0, 3000.0)
            .go_on_for(0.5);
        let clear_at_s = motion.duration_s() - 0.25;
        let run = roll(motion.change_speed(mm_s(2.0), 1000.0).roll_to(1900.0), clear_at_s);
        assert_all_kept(&run.judgement());
    }
}

#[test]
fn a_command_in_the_turn_in_which_a_played_row_ends_leaves_the_real_plants_alone() {
    // The row ends 3.5 m on, half a turn more or less.
    let ends_us = 3_500_000_000 / 1400;
    for (command, off_us) in
        [("servo in", -600), ("servo in", -200), ("servo in", 0), ("servo in", 300), ("calibrate servo", 0)]
    {
        let mut uno = woken_up();
        ask(&mut uno, "hold");
        let typed = "test row 1400\n";
        uno.send(typed.as_bytes());
        // A byte takes ten bits' time; the row begins with the last of them, and the other line ends with its last, too.
        let bytes_us = |text: &str| text.len() as i64 * 1_000_000 * 10 / 115_200;
        let wait_us = bytes_us(typed) + ends_us + off_us - bytes_us(command) - bytes_us("\n");
        let cycle = uno.cycle() + wait_us as u64 * (CYCLES_PER_SECOND / 1_000_000);
        uno.run_until(cycle).expect("the firmware runs");
        uno.send(format!("{command}\n").as_bytes());
        run_for_ms(&mut uno, 100);
        ask(&mut uno, "hold");
        let row = Row::new((0..4).map(|plant| Thing::plant(700.0 + 600.0 * f64::from(plant), 150.0)).collect());
        let motion = Motion::starting_at(0.0).change_speed(mm_s(2.0), 3000.0).roll_to(3100.0);
        let mut run = Run::set_off(uno, trial(row.expect("the plants stand apart"), motion), &[], |_, changes| changes);
        run.roll_to_the_end();
        let seen = run.events("plant").len() + run.events("unknown").len();
        assert_eq!(seen, 4, "{command}: {:#?}", run.lines());
        assert_all_kept(&run.judgement());
    }
}
