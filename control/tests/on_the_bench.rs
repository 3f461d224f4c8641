//! Manual tests: the servo driven directly, calibration, the swings of a row, and reloading settings.

mod common;

use common::{Machine, machine, readings};
use control::{
    alarm::Alarm,
    measure::readings::{Edge, Readings},
    operate::{
        calibration::{Outcome, SwingTimes},
        command_error::CommandError,
        event::Event,
        plot::Plot,
        servo,
        state::State,
    },
    settings::{Setting, Settings},
    units::Position,
    weeder::Orders,
};

/// Runs the machine at a standstill for this time. Returns the last orders.
fn stand(machine: &mut Machine, from_ms: u64, duration_ms: u64, count: i32) -> Orders {
    let mut orders = machine.orders();
    for now in from_ms..from_ms + duration_ms {
        orders = machine.turn(readings(now * 1000, count), []);
    }
    orders
}

#[test]
fn the_servo_is_driven_directly_in_hold_only_and_the_tool_is_out_again_at_work() {
    let mut machine = machine();
    machine.servo_in().unwrap();
    assert_eq!(stand(&mut machine, 0, 10, 0).pulse, servo::from_us(1500));
    machine.servo_by_hand(1750).unwrap();
    assert_eq!(stand(&mut machine, 10, 10, 0).pulse, servo::from_us(1750));
    for wrong_us in [0, 499, 2501, u16::MAX] {
        assert_eq!(machine.servo_by_hand(wrong_us), Err(CommandError::OutOfRange));
    }
    machine.servo_out().unwrap();
    assert_eq!(stand(&mut machine, 20, 10, 0).pulse, servo::from_us(2000));

    machine.servo_in().unwrap();
    machine.start(false).unwrap();
    assert_eq!(stand(&mut machine, 30, 10, 0).pulse, servo::from_us(2000), "the ground is unknown");
    assert_eq!(machine.servo_in(), Err(CommandError::NotInHold));
    machine.turn(readings(40_000, 0), [Edge::Lost { broken: false }]);
    assert_eq!(machine.servo_in(), Err(CommandError::AlarmLatched));
}

#[test]
fn the_lamp_shows_hold_while_the_tool_does_not_swing() {
    let mut machine = machine();
    let lit_ms = |machine: &mut Machine, from_ms: u64| {
        (from_ms..from_ms + 2000)
            .filter(|&now| {
                stand(machine, now, 1, 0);
                machine.lamp_is_lit()
            })
            .count()
    };
    assert!((200..300).contains(&lit_ms(&mut machine, 0)), "a short flash a second");
    machine.servo_by_hand(2000).unwrap();
    assert!((200..300).contains(&lit_ms(&mut machine, 2000)), "also while the servo is driven directly");
}

#[test]
fn hold_and_the_switch_going_off_end_a_manual_test() {
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
            machine.turn(Readings { switch_on, ..readings(now * 1000, 0) }, []);
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
fn manual_tests_need_a_standing_machine_and_end_when_it_rolls() {
    type Command = fn(&mut Machine) -> Result<(), CommandError>;
    let moves: [Command; 4] = [
        Machine::servo_in,
        |machine| machine.servo_by_hand(1700),
        Machine::calibrate_servo,
        |machine| machine.test_row(500),
    ];
    let out = servo::from_us(2000);
    // 2.5 km/h forward, and 0.5 km/h back.
    for ticks_a_second in [1326, -265] {
        for (number, moves) in moves.iter().enumerate() {
            let mut machine = machine();
            let roll = |machine: &mut Machine, from_ms: u64, duration_ms: u64, from: i32| {
                for ms in 0..duration_ms {
                    let count = from + ticks_a_second * ms as i32 / 1000;
                    machine.turn(readings((from_ms + ms) * 1000, count), []);
                }
                from + ticks_a_second * duration_ms as i32 / 1000
            };
            let count = roll(&mut machine, 0, 500, 0);
            assert_eq!(moves(&mut machine), Err(CommandError::Rolls), "{number}");
            assert_eq!(machine.servo_out(), Ok(()), "out is always allowed");
            assert_eq!(stand(&mut machine, 500, 200, count).pulse, out);
            assert_eq!(moves(&mut machine), Ok(()), "{number}");
            assert_ne!(stand(&mut machine, 700, 200, count).pulse, out, "{number}");
            // Within 4 mm of the ground.
            let count = roll(&mut machine, 900, if ticks_a_second > 0 { 6 } else { 25 }, count);
            assert_eq!(stand(&mut machine, 930, 1, count).pulse, out, "{number}");
            assert_eq!(stand(&mut machine, 931, 3000, count).pulse, out, "{number}: it does not come back by itself");
            assert_eq!(moves(&mut machine), Ok(()), "{number}");
        }
    }
}

#[test]
fn an_alarm_ends_a_manual_test() {
    let mut machine = machine();
    machine.servo_in().unwrap();
    machine.turn(readings(0, 0), [Edge::Lost { broken: false }]);
    assert_eq!(stand(&mut machine, 0, 1, 0).pulse, servo::from_us(2000));
    assert_eq!(machine.state(), State::Alarm(Alarm::BeamEdgesLost));
}

#[test]
fn a_rolled_distance_calibrates_the_wheel() {
    let mut machine = machine();
    machine.set(Setting::WheelMm, 410).unwrap();
    stand(&mut machine, 0, 1, 0);
    assert_eq!(machine.calibrate(5000, false), Err(CommandError::NotBegun));
    machine.calibrate_start().unwrap();
    stand(&mut machine, 1, 1, 18_500);
    assert_eq!(machine.calibrate(999, false), Err(CommandError::TooShort));
    assert_eq!((machine.calibrate(5000, false), machine.distance().counted()), (Err(CommandError::WheelDiffers), 3700));
    assert_eq!(machine.settings().get(Setting::TicksPerM), 0, "not changed");
    assert_eq!(machine.calibrate(10_000, false), Ok(()));
    assert_eq!(machine.settings().get(Setting::TicksPerM), 1850);
    assert_eq!(machine.settings().ticks(Setting::BeamToToolMm).0, 740);
    // Another wheel has no calibration.
    machine.set(Setting::WheelMm, 400).unwrap();
    assert_eq!(machine.settings().get(Setting::TicksPerM), 0);
    machine.start(false).unwrap();
    assert_eq!(machine.calibrate(10_000, false), Err(CommandError::NotInHold));
}

/// Times the servo, with a tool that is out this long after its command, and leaves this long after it.
fn swings(machine: &mut Machine, out_ms: u64, in_ms: u64) -> Vec<Event> {
    for now in 0..1_000 {
        machine.turn(Readings { end_switch_on: true, ..readings(now * 1000, 0) }, []);
    }
    machine.calibrate_servo().unwrap();
    let (mut told_out, mut told_at) = (true, 0);
    for now in 1_000..13_000 {
        let after = if told_out { out_ms } else { in_ms };
        let end_switch_on = told_out == (now - told_at >= after);
        machine.turn(Readings { end_switch_on, ..readings(now * 1000, 0) }, []);
        if machine.tool_out() != told_out {
            (told_out, told_at) = (machine.tool_out(), now);
        }
        assert!(now >= 9_990 || machine.lamp_is_lit() == machine.tool_out(), "the LED shows the commands");
    }
    std::iter::from_fn(|| machine.next_event()).collect()
}

#[test]
fn the_end_switch_times_the_servo() {
    let mut machine = machine();
    machine.set(Setting::EndSwitch, 1).unwrap();
    let events = swings(&mut machine, 150, 55);
    let outcome = Outcome::Measured(SwingTimes { out_ms: 161, in_ms: 55 });
    assert_eq!(events, [Event::Calibrated { outcome, fits: true }]);
    assert_eq!([Setting::LeadOutMs, Setting::LeadInMs].map(|lead| machine.settings().get(lead)), [161, 55]);
    assert_eq!((machine.state(), machine.tool_out()), (State::Hold, true));
}

#[test]
fn leads_that_do_not_fit_are_reported_and_not_set() {
    let mut machine = machine();
    machine.set(Setting::EndSwitch, 1).unwrap();
    // 400 ms at the top speed of 1.3 m/s exceed the beam's distance.
    let events = swings(&mut machine, 400, 55);
    assert!(matches!(events[..], [Event::Calibrated { outcome: Outcome::Measured(_), fits: false }]), "{events:?}");
    assert_eq!(machine.settings().get(Setting::LeadOutMs), Setting::LeadOutMs.description().default);
}

#[test]
fn without_an_end_switch_the_swings_are_shown() {
    let mut machine = machine();
    let events = swings(&mut machine, 0, 0);
    assert_eq!(events, [Event::Calibrated { outcome: Outcome::Shown, fits: false }]);
    assert_eq!(machine.settings(), &Settings::new());
}

#[test]
fn timed_swings_can_be_ended() {
    let mut machine = machine();
    machine.calibrate_servo().unwrap();
    assert_eq!(stand(&mut machine, 0, 100, 0).pulse, servo::from_us(1500));
    machine.servo_out().unwrap();
    assert_eq!(stand(&mut machine, 100, 100, 0).pulse, servo::from_us(2000));
}

#[test]
fn a_dry_run_ignores_the_sensors() {
    let mut machine = machine();
    stand(&mut machine, 0, 300, 77);
    machine.test_row(500).unwrap();
    machine.tell_events(true);
    let mut swings = Vec::new();
    for now in 300..10_000 {
        // Nothing is wired: the open beam flickers very fast, and the encoder's contacts pick up hum.
        let broken = now % 2 == 0;
        let seen = Edge::Seen { position: Position::new(77), broken, second_broken: false };
        let lost = (now % 5 == 0).then_some(Edge::Lost { broken });
        machine.turn(Readings { jumps: now as u16, ..readings(now * 1000, 77) }, [seen].into_iter().chain(lost));
        assert_eq!(machine.state(), State::Hold);
        swings.extend(std::iter::from_fn(|| machine.next_event()));
        if swings.len() == 14 {
            break;
        }
        assert_eq!(machine.lamp_is_lit(), machine.tool_out(), "the LED shows the commands");
    }
    let position = readings(0, 77).position;
    let expected: Vec<_> = (0..14).map(|swing| Event::Swing { out: swing % 2 == 1, position }).collect();
    assert_eq!(swings, expected, "into the row, out and in for each plant, and out at the end");
}

#[test]
fn a_dry_run_does_not_change_the_known_ground() {
    // A canopy is known, another is in the beam, and a dry run starts.
    let row = |played: bool| {
        let mut machine = machine();
        let mut milliseconds = 0;
        for count in 0..2000 {
            milliseconds += 1;
            let edge = matches!(count, 1000 | 1300 | 1900).then(|| Edge::Seen {
                position: Position::new(count),
                broken: count != 1300,
                second_broken: false,
            });
            machine.turn(readings(milliseconds * 1000, count), edge);
        }
        stand(&mut machine, milliseconds, 200, 1999);
        if played {
            machine.test_row(1000).unwrap();
        }
        stand(&mut machine, milliseconds + 200, 8800, 1999);
        let played_on = format!("{:?} {:?} {}", machine.zones(), machine.unseen_mm(), machine.detections().len());
        machine.start(false).unwrap();
        // The tool's command over both canopies, each millisecond.
        let mut tool = Vec::new();
        for count in 2000..4500 {
            milliseconds += 1;
            let edge = (count == 2200).then(|| Edge::Seen {
                position: Position::new(count),
                broken: false,
                second_broken: false,
            });
            machine.turn(readings((milliseconds + 9000) * 1000, count), edge);
            tool.push(machine.tool_out());
        }
        (played_on, tool)
    };
    assert_eq!(row(true), row(false));
}

#[test]
fn any_command_in_the_last_turn_of_a_dry_run_leaves_the_next_real_plant_its_zone() {
    type Command = fn(&mut Machine) -> Result<(), CommandError>;
    let commands: [Command; 7] = [
        |_| Ok(()),
        Machine::servo_in,
        Machine::servo_out,
        Machine::calibrate_servo,
        |machine| machine.test_row(1000),
        |machine| machine.start(false),
        |machine| {
            machine.hold();
            Ok(())
        },
    ];
    for (number, command) in commands.iter().enumerate() {
        for at_ms in (3_400..3_600).step_by(1) {
            let mut machine = machine();
            machine.test_row(1000).unwrap();
            stand(&mut machine, 0, at_ms, 0);
            command(&mut machine).unwrap();
            stand(&mut machine, at_ms, 20, 0);
            machine.hold();
            machine.start(false).unwrap();
            let mut milliseconds = at_ms + 20;
            for count in 0..3000 {
                milliseconds += 1;
                let plant = (1000..1300).contains(&count);
                let edge = matches!(count, 1000 | 1300).then(|| Edge::Seen {
                    position: Position::new(count),
                    broken: plant,
                    second_broken: false,
                });
                machine.turn(readings(milliseconds * 1000, count), edge);
                let window = (1010..2150).contains(&count);
                assert!(!window || machine.zones() == 1, "command {number}, {count}");
                // The lead of the command to come in.
                let tool = count - 764 + 42;
                let over = (1000 - 95 + 42..=1300 + 95).contains(&tool) || tool < 0;
                assert!(machine.tool_out() || !over, "command {number} at {at_ms} ms: in at {tool}");
            }
            assert!(!machine.tool_out());
        }
    }
}

#[test]
fn a_dry_run_can_be_ended() {
    let mut machine = machine();
    machine.test_row(1000).unwrap();
    stand(&mut machine, 0, 100, 0);
    assert!(!machine.tool_out());
    machine.hold();
    let orders = stand(&mut machine, 100, 10, 0);
    assert_eq!(orders.pulse, orders.pulse_out);
    stand(&mut machine, 110, 5000, 0);
    assert!(machine.tool_out());
}

#[test]
fn a_dry_run_needs_a_working_speed_and_hold() {
    let mut machine = machine();
    for wrong_mm_s in [0, 99, 1401, u16::MAX] {
        assert_eq!(machine.test_row(wrong_mm_s), Err(CommandError::TestSpeed));
    }
    machine.start(false).unwrap();
    assert_eq!(machine.test_row(500), Err(CommandError::NotInHold));
}

#[test]
fn settings_are_reloaded_from_the_memory_or_from_the_table() {
    let mut machine = machine();
    assert_eq!(machine.take_saved(), Err(CommandError::NothingSaved));
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
    assert_eq!(
        (machine.take_saved(), machine.take_defaults()),
        (Err(CommandError::NotInHold), Err(CommandError::NotInHold))
    );
}

#[test]
fn a_plotter_gets_twenty_points_a_second() {
    let mut machine = machine();
    machine.set_plot(Plot::Teleplot);
    let mut points = 0;
    for now in 0..2000 {
        machine.turn(readings(now * 1000, 0), []);
        points += u32::from(machine.next_plot() == Some(Plot::Teleplot));
    }
    assert_eq!(points, 39);
    machine.set_plot(Plot::Off);
    stand(&mut machine, 2000, 100, 0);
    assert_eq!(machine.next_plot(), None);
}
