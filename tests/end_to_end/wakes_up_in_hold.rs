//! Start-up: in HOLD with the tool out, for every level of the switch. The tool enters the row only over ground that
//! the beam has seen.

use crate::common::{
    Run, SWING_TOLERANCE_TICKS, assert_all_kept, bare_ground, elf, is_out_at_the_pin, number, pass, run_for_ms,
    started, status, steady, throw_switch, value,
};
use field::machine::Machine;
use field::motion::mm_s;
use field::pass::Start;
use field::row::{Canopy, Row};
use field::verdict::ZoneSettings;
use field::wiring;
use uno::Uno;
use uno::{CYCLES_PER_SECOND, PinChange};
use uno_run::boot;

/// Time in which the servo shows a decision: a frame and the loop's turn.
const FRAME_MS: u64 = 25;

#[track_caller]
fn assert_in_hold_with_tool_out(uno: &mut Uno) {
    let status = status(uno);
    assert_eq!((value(&status, "state"), value(&status, "tool")), ("hold", "out"), "{status}");
    assert!(is_out_at_the_pin(uno));
}

/// Rolls the machine over bare ground without other inputs.
fn roll(uno: &mut Uno, length_mm: f64) {
    let motion = steady(mm_s(2.0), length_mm);
    uno.drive(Machine::default().pin_changes(&bare_ground(), &motion, uno.cycle()));
    run_for_ms(uno, (motion.duration_s() * 1000.0) as u64 + 10);
}

#[test]
fn a_switch_that_is_on_at_power_up_starts_nothing_until_it_has_been_off() {
    let mut uno = boot(&elf(), &[PinChange { cycle: 0, pin: wiring::WORK_SWITCH, high: false }]).expect("it wakes up");
    run_for_ms(&mut uno, 200);
    assert_in_hold_with_tool_out(&mut uno);
    // Farther than from the beam to the tool and a margin, so that the tool could go into the row.
    roll(&mut uno, 600.0);
    assert_in_hold_with_tool_out(&mut uno);
    throw_switch(&mut uno, false);
    assert_in_hold_with_tool_out(&mut uno);
    assert!(uno.pulses(wiring::SERVO).iter().all(|pulse| (pulse.width_us() - 2000.0).abs() < 0.1));

    throw_switch(&mut uno, true);
    roll(&mut uno, 600.0);
    let status = status(&mut uno);
    assert_eq!((value(&status, "state"), value(&status, "tool")), ("work", "in"), "{status}");
    assert!(!is_out_at_the_pin(&uno));
}

#[test]
fn the_servo_has_its_signal_from_the_first_frame_on() {
    let uno = started();
    let first = uno.pulses(wiring::SERVO)[0];
    assert!((first.width_us() - 2000.0).abs() < 0.1, "{first:?}");
    assert!(first.rise < CYCLES_PER_SECOND / 10, "{first:?}");
}

#[test]
fn the_tool_enters_the_row_a_margin_behind_the_start_of_the_seen_ground() {
    let ZoneSettings { margin_mm, lead_in_ms, .. } = ZoneSettings::default();
    for start in [Start::Command, Start::Switch] {
        let (machine, speed_mm_s) = (Machine::default(), mm_s(2.0));
        let mut run = Run::begin(field::pass::Pass { start, ..pass(bare_ground(), steady(speed_mm_s, 700.0)) }, &[]);
        let begin = run.cycles().start;
        run.roll_to_the_end();
        let command = run.first_command_after(begin);
        assert!(!command.is_out);
        // A plant may end where the beam stood. Led by the time that the servo takes at least.
        let ideal_mm = machine.beam_to_tool_mm + f64::from(margin_mm) - speed_mm_s * f64::from(lead_in_ms) / 1000.0;
        let error_ticks = (run.place_mm(command.rise_cycle) - ideal_mm) / machine.tick_mm();
        assert!(error_ticks.abs() <= SWING_TOLERANCE_TICKS, "{error_ticks} ticks after {start:?}");
    }
}

#[test]
fn the_status_says_how_far_seen_ground_still_is() {
    let mut run = Run::begin(pass(bare_ground(), steady(mm_s(1.0), 1000.0)), &[]);
    let mut uno_says = |place_mm: f64| {
        run.roll_to(place_mm);
        number(&status(&mut run.uno), "unseen_mm")
    };
    // The margin ahead of that ground counts. The answer is for a moment some milliseconds later, and the beam's response is a millisecond.
    for (place_mm, unseen_mm) in [(50.0, 400), (300.0, 150), (390.0, 60), (440.0, 10)] {
        let said = uno_says(place_mm);
        assert!((unseen_mm - 3..=unseen_mm + 1).contains(&said), "{said} mm at {place_mm} mm");
    }
    assert_eq!(uno_says(500.0), 0);
}

#[test]
fn with_start_now_the_tool_enters_the_row_over_unseen_ground() {
    let mut uno = started();
    uno.send(b"start now\n");
    run_for_ms(&mut uno, FRAME_MS);
    assert!(!is_out_at_the_pin(&uno));
    assert_eq!(number(&status(&mut uno), "pos"), 0);
}

#[test]
fn a_plant_in_the_beam_at_power_up_is_kept() {
    // Half of the canopy is left, or no more than a weed's width.
    for centre_mm in [0.0, -55.0, -60.0, -65.0] {
        let plants = vec![Canopy::plant(centre_mm, 150.0), Canopy::plant(700.0, 150.0)];
        let row = Row::new(plants).expect("the plants stand apart");
        let mut run = Run::begin(pass(row, steady(mm_s(2.0), 1300.0)), &[]);
        run.roll_to_the_end();
        assert_all_kept(&run.judgement());
        assert!(run.commands().len() > 2, "the tool was in the row at all");
        assert_eq!(run.events("unknown").len(), 1, "{:#?}", run.lines());
    }
}

#[test]
fn nothing_that_was_scheduled_survives_a_reset() {
    for restart in [Uno::reset, Uno::power_cycle] {
        let row = Row::new(vec![Canopy::plant(300.0, 150.0)]).expect("a plant is a row");
        let mut run = Run::begin(pass(row, steady(mm_s(2.0), 500.0)), &["set margin_mm 60", "save"]);
        run.roll_to_the_end();
        let before = status(&mut run.uno);
        assert_eq!((value(&before, "state"), number(&before, "windows")), ("work", 1), "{before}");

        let cycle = run.uno.cycle();
        restart(&mut run.uno);
        run.uno.run_until_serial("\n", 3 * CYCLES_PER_SECOND).expect("the firmware wakes up");
        run_for_ms(&mut run.uno, FRAME_MS);
        assert_in_hold_with_tool_out(&mut run.uno);
        let after = status(&mut run.uno);
        assert_eq!((number(&after, "pos"), number(&after, "windows")), (0, 0), "{after}");
        // From beam to tool, and the saved margin.
        assert!((460..=461).contains(&number(&after, "unseen_mm")), "{after}");
        let pulses = run.uno.pulses(wiring::SERVO);
        let since: Vec<_> = pulses.iter().filter(|pulse| pulse.rise > cycle).collect();
        assert!(!since.is_empty() && since.iter().all(|pulse| (pulse.width_us() - 2000.0).abs() < 0.1));
    }
}
