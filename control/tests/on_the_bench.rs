//! What is tried on the bench: the tool by hand, calibration, a row that is only thought of, and settings taken back.

mod common;

use common::{Machine, machine, readings};
use control::{
    alarm::Alarm,
    calibration::{Leads, Outcome, Unfit},
    console::Plot,
    controller::{Orders, Readings, Refusal, State},
    event::Event,
    servo,
    settings::{Setting, Settings},
};

/// Steps the machine, standing at a count, through so many milliseconds; returns the last orders.
fn stand(machine: &mut Machine, from_ms: u64, duration_ms: u64, count: i32) -> Orders {
    let mut orders = machine.orders();
    for now in from_ms..from_ms + duration_ms {
        orders = machine.step(readings(now * 1000, count));
    }
    orders
}

#[test]
fn the_tool_moves_by_hand_in_hold_only_and_is_out_again_when_the_machine_starts() {
    let mut machine = machine();
    machine.servo_in().unwrap();
    assert_eq!(stand(&mut machine, 0, 10, 0).pulse, servo::from_us(1500));
    machine.servo_by_hand(1750).unwrap();
    assert_eq!(stand(&mut machine, 10, 10, 0).pulse, servo::from_us(1750));
    for wrong_us in [0, 499, 2501, u16::MAX] {
        assert_eq!(machine.servo_by_hand(wrong_us), Err(Refusal::OutOfRange));
    }
    machine.servo_out().unwrap();
    assert_eq!(stand(&mut machine, 20, 10, 0).pulse, servo::from_us(2000));

    machine.servo_in().unwrap();
    machine.start(false).unwrap();
    assert_eq!(stand(&mut machine, 30, 10, 0).pulse, servo::from_us(2000), "the ground is not known");
    assert_eq!(machine.servo_in(), Err(Refusal::NotInHold));
    machine.beam_edges_lost(false);
    assert_eq!(machine.servo_in(), Err(Refusal::AlarmLatched));
}

#[test]
fn hold_and_the_switch_going_off_end_what_is_done_by_hand() {
    let out = servo::from_us(2000);
    let mut machine = machine();
    machine.servo_in().unwrap();
    assert_ne!(stand(&mut machine, 0, 10, 0).pulse, out);
    machine.hold();
    assert_eq!(stand(&mut machine, 10, 10, 0).pulse, out);
    machine.calibrate_servo().unwrap();
    assert_ne!(stand(&mut machine, 20, 10, 0).pulse, out);
    machine.hold();
    assert_eq!(stand(&mut machine, 30, 10, 0).pulse, out);

    let with_switch = |machine: &mut Machine, from_ms: u64, switch_on| {
        for now in from_ms..from_ms + 50 {
            machine.step(Readings { switch_on, ..readings(now * 1000, 0) });
        }
    };
    with_switch(&mut machine, 100, true);
    machine.hold();
    machine.servo_in().unwrap();
    with_switch(&mut machine, 150, true);
    assert_ne!(machine.orders().pulse, out);
    with_switch(&mut machine, 200, false);
    assert_eq!(machine.orders().pulse, out);
}

#[test]
fn an_alarm_ends_what_is_done_by_hand() {
    let mut machine = machine();
    machine.servo_in().unwrap();
    machine.beam_edges_lost(false);
    assert_eq!(stand(&mut machine, 0, 1, 0).pulse, servo::from_us(2000));
    assert_eq!(machine.state(), State::Alarm(Alarm::BeamEdgesLost));
}

#[test]
fn a_distance_that_was_rolled_sets_the_wheel() {
    let mut machine = machine();
    machine.set(Setting::WheelMm, 410).unwrap();
    stand(&mut machine, 0, 1, 0);
    assert_eq!(machine.calibrate(5000, false), Err(Refusal::Unfit(Unfit::NotBegun)));
    machine.calibrate_start().unwrap();
    stand(&mut machine, 1, 1, 18_500);
    assert_eq!(machine.calibrate(999, false), Err(Refusal::Unfit(Unfit::TooShort)));
    assert!(matches!(machine.calibrate(5000, false), Err(Refusal::Unfit(Unfit::Differs { counted: 3700, .. }))));
    assert_eq!(machine.settings().get(Setting::TicksPerM), 0, "nothing was changed");
    assert_eq!(machine.calibrate(10_000, false), Ok(()));
    assert_eq!(machine.settings().get(Setting::TicksPerM), 1850);
    assert_eq!(machine.settings().ticks(Setting::BeamToToolMm).0, 740);
    // Another wheel has not been measured.
    machine.set(Setting::WheelMm, 400).unwrap();
    assert_eq!(machine.settings().get(Setting::TicksPerM), 0);
    machine.start(false).unwrap();
    assert_eq!(machine.calibrate(10_000, false), Err(Refusal::NotInHold));
}

/// Has the servo timed, with a tool that is out so long after it was told to, and leaves that long after.
fn swings(machine: &mut Machine, out_ms: u64, in_ms: u64) -> Vec<Event> {
    for now in 0..1_000 {
        machine.step(Readings { end_switch_on: true, ..readings(now * 1000, 0) });
    }
    machine.calibrate_servo().unwrap();
    let (mut told_out, mut told_at) = (true, 0);
    for now in 1_000..13_000 {
        let after = if told_out { out_ms } else { in_ms };
        let end_switch_on = told_out == (now - told_at >= after);
        machine.step(Readings { end_switch_on, ..readings(now * 1000, 0) });
        if machine.tool_out() != told_out {
            (told_out, told_at) = (machine.tool_out(), now);
        }
        assert!(now >= 9_990 || machine.lamp_is_lit() == machine.tool_out(), "the LED marks the commands");
    }
    std::iter::from_fn(|| machine.next_event()).collect()
}

#[test]
fn the_end_switch_times_the_servo() {
    let mut machine = machine();
    machine.set(Setting::EndSwitch, 1).unwrap();
    let events = swings(&mut machine, 150, 55);
    let outcome = Outcome::Measured(Leads { out_ms: 161, in_ms: 55 });
    assert_eq!(events, [Event::Calibrated { outcome, fits: true }]);
    assert_eq!([Setting::LeadOutMs, Setting::LeadInMs].map(|lead| machine.settings().get(lead)), [161, 55]);
    assert_eq!((machine.state(), machine.tool_out()), (State::Hold, true));
}

#[test]
fn leads_that_do_not_fit_are_told_and_not_set() {
    let mut machine = machine();
    machine.set(Setting::EndSwitch, 1).unwrap();
    // 400 ms at the top speed of 1.4 m/s are more than the beam's distance.
    let events = swings(&mut machine, 400, 55);
    assert!(matches!(events[..], [Event::Calibrated { outcome: Outcome::Measured(_), fits: false }]), "{events:?}");
    assert_eq!(machine.settings().get(Setting::LeadOutMs), 180);
}

#[test]
fn without_an_end_switch_the_swings_are_shown() {
    let mut machine = machine();
    let events = swings(&mut machine, 0, 0);
    assert_eq!(events, [Event::Calibrated { outcome: Outcome::Shown, fits: false }]);
    assert_eq!(machine.settings(), &Settings::new());
}

#[test]
fn swings_can_be_ended() {
    let mut machine = machine();
    machine.calibrate_servo().unwrap();
    assert_eq!(stand(&mut machine, 0, 100, 0).pulse, servo::from_us(1500));
    machine.servo_out().unwrap();
    assert_eq!(stand(&mut machine, 100, 100, 0).pulse, servo::from_us(2000));
}

#[test]
fn a_row_is_played_through_the_decisions_without_a_sensor() {
    let mut machine = machine();
    stand(&mut machine, 0, 100, 77);
    machine.test_row(500).unwrap();
    machine.tell_events(true);
    let (mut plants, mut swings) = (0, 0);
    for now in 100..20_000 {
        // Nothing is wired: the beam flickers faster than anybody can count, and the encoder's contacts pick up hum.
        machine.beam_edge(readings(0, 77).position, now % 2 == 0);
        if now % 5 == 0 {
            machine.beam_edges_lost(now % 2 == 0);
        }
        machine.step(Readings { jumps: now as u16, ..readings(now * 1000, 77) });
        while let Some(event) = machine.next_event() {
            plants += u32::from(matches!(event, Event::Object { .. }));
            swings += u32::from(matches!(event, Event::Swing { .. }));
        }
        if machine.state() == State::Hold {
            break;
        }
    }
    assert_eq!((plants, swings), (6, 14), "into the row, out and in for each plant, and out at the end");
    // The machine is where it was, and knows no ground.
    for now in 20_000..20_010 {
        machine.step(Readings { jumps: 20_000, ..readings(now * 1000, 77) });
    }
    assert_eq!((machine.state(), machine.readings().position.count(), machine.unseen_mm()), (State::Hold, 77, 400));
    assert_eq!(machine.windows(), 0);
}

#[test]
fn what_comes_to_stand_in_the_beam_while_a_row_is_played_is_known_afterwards() {
    for lost in [false, true] {
        let mut machine = machine();
        machine.test_row(1000).unwrap();
        stand(&mut machine, 0, 500, 0);
        if lost {
            machine.beam_edges_lost(true);
        } else {
            machine.beam_edge(readings(0, 0).position, true);
        }
        machine.hold();
        stand(&mut machine, 500, 10, 0);
        assert_eq!(machine.windows(), 1);
    }
}

#[test]
fn a_row_that_is_played_can_be_ended_and_leaves_nothing_behind() {
    for lost in [false, true] {
        let mut machine = machine();
        machine.test_row(1000).unwrap();
        stand(&mut machine, 0, 2500, 0);
        if lost {
            machine.beam_edges_lost(false);
        }
        assert_eq!(machine.state(), State::Work);
        machine.hold();
        let orders = stand(&mut machine, 2500, 10, 0);
        assert_eq!(orders.pulse, orders.pulse_out);
        machine.start(false).unwrap();
        stand(&mut machine, 2600, 10, 0);
        assert!(machine.tool_out() && machine.unseen_mm() >= 399);
    }
}

#[test]
fn a_row_is_played_at_working_speeds_and_in_hold_only() {
    let mut machine = machine();
    for wrong_mm_s in [0, 99, 1401, u16::MAX] {
        assert_eq!(machine.test_row(wrong_mm_s), Err(Refusal::TestSpeed { fastest: 1400 }));
    }
    machine.start(false).unwrap();
    assert_eq!(machine.test_row(500), Err(Refusal::NotInHold));
}

#[test]
fn settings_are_taken_back_from_the_memory_or_from_the_table() {
    let mut machine = machine();
    assert_eq!(machine.take_saved(), Err(Refusal::NothingSaved));
    assert_eq!(machine.saved(Setting::K), None);
    machine.set(Setting::K, 5).unwrap();
    machine.save().unwrap();
    while !machine.carry_on() {}
    machine.set(Setting::K, 9).unwrap();
    assert_eq!((machine.settings().get(Setting::K), machine.saved(Setting::K)), (9, Some(5)));
    machine.take_saved().unwrap();
    assert_eq!(machine.settings().get(Setting::K), 5);
    machine.take_defaults().unwrap();
    assert_eq!((machine.settings(), machine.saved(Setting::K)), (&Settings::new(), Some(5)));
    machine.start(false).unwrap();
    assert_eq!((machine.take_saved(), machine.take_defaults()), (Err(Refusal::NotInHold), Err(Refusal::NotInHold)));
}

#[test]
fn a_plotter_gets_twenty_points_a_second() {
    let mut machine = machine();
    machine.set_plot(Plot::Teleplot);
    let mut points = 0;
    for now in 0..2000 {
        machine.step(readings(now * 1000, 0));
        points += u32::from(machine.next_plot() == Some(Plot::Teleplot));
    }
    assert_eq!(points, 39);
    machine.set_plot(Plot::Off);
    stand(&mut machine, 2000, 100, 0);
    assert_eq!(machine.next_plot(), None);
}
