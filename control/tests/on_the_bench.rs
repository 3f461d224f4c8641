//! Manual tests: the servo driven directly, calibration, the swings of a row, and reloading settings.

mod common;

use common::{Machine, machine};
use control::{
    alarm::Alarm,
    operate::{
        calibration::{Outcome, SwingTimes},
        command_error::CommandError,
        event::Event,
        plot::Plot,
        servo,
        state::State,
    },
    settings::{Setting, Settings},
};
use rig::Beams;

#[test]
fn the_servo_is_driven_directly_only_in_hold() {
    let mut machine = machine();
    machine.servo_in().unwrap();
    assert_eq!(machine.stand(10).pulse, servo::from_us(1500));
    machine.servo_by_hand(1750).unwrap();
    assert_eq!(machine.stand(10).pulse, servo::from_us(1750));
    for wrong_us in [0, 499, 2501, u16::MAX] {
        assert_eq!(machine.servo_by_hand(wrong_us), Err(CommandError::OutOfRange));
    }
    machine.servo_out().unwrap();
    assert_eq!(machine.stand(10).pulse, servo::from_us(2000));

    machine.servo_in().unwrap();
    machine.start(false).unwrap();
    assert_eq!(machine.stand(10).pulse, servo::from_us(2000), "the ground is not known");
    assert_eq!(machine.servo_in(), Err(CommandError::NotInHold));
    machine.lose_edges(Beams::default());
    machine.turn_after(1000);
    assert_eq!(machine.servo_in(), Err(CommandError::AlarmLatched));
}

#[test]
fn lamp_and_status_show_a_tool_that_is_driven_directly() {
    let mut machine = machine();
    let lit_ms = |machine: &mut Machine| {
        let lit = (0..2000).filter(|_| {
            machine.stand(1);
            machine.lamp_is_lit()
        });
        lit.count()
    };
    assert!((200..300).contains(&lit_ms(&mut machine)), "a short flash a second");
    assert!(machine.tool_out());
    machine.servo_in().unwrap();
    assert_eq!(lit_ms(&mut machine), 2000, "the tool may be in the row");
    assert!(!machine.tool_out());
    machine.servo_out().unwrap();
    assert!(machine.tool_out());
}

#[test]
fn hold_and_the_switch_going_off_end_a_manual_test() {
    let out = servo::from_us(2000);
    let mut machine = machine();
    machine.servo_in().unwrap();
    assert_ne!(machine.stand(10).pulse, out);
    machine.hold();
    assert_eq!(machine.stand(10).pulse, out);
    machine.calibrate_servo().unwrap();
    // After the first swing, which is out.
    assert_ne!(machine.stand(1600).pulse, out);
    machine.hold();
    assert_eq!(machine.stand(10).pulse, out);

    machine.readings.switch_on = true;
    machine.stand(50);
    machine.hold();
    machine.servo_in().unwrap();
    assert_ne!(machine.stand(50).pulse, out);
    machine.readings.switch_on = false;
    assert_eq!(machine.stand(50).pulse, out);
}

#[test]
fn manual_tests_need_a_standing_machine_and_end_when_it_rolls() {
    type Command = fn(&mut Machine) -> Result<(), CommandError>;
    let moves: [Command; 4] = [
        |machine| machine.servo_in(),
        |machine| machine.servo_by_hand(1700),
        |machine| machine.calibrate_servo(),
        |machine| machine.test_row(500),
    ];
    let out = servo::from_us(2000);
    // 2.5 km/h forward, and 0.5 km/h back.
    for ticks_a_second in [1326, -265] {
        for (number, moves) in moves.iter().enumerate() {
            let mut machine = machine();
            let roll = |machine: &mut Machine, duration_ms: i32| {
                let from = machine.readings.position.count();
                for ms in 1..=duration_ms {
                    machine.at(from + ticks_a_second * ms / 1000).turn_after(1000);
                }
            };
            roll(&mut machine, 500);
            assert_eq!(moves(&mut machine), Err(CommandError::Rolls), "{number}");
            assert_eq!(machine.servo_out(), Ok(()), "out is safe");
            assert_eq!(machine.stand(200).pulse, out);
            assert_eq!(moves(&mut machine), Ok(()), "{number}");
            // The first swing of `calibrate_servo` is out.
            assert_ne!(machine.stand(if number == 2 { 1600 } else { 200 }).pulse, out, "{number}");
            // Within 4 mm of the ground.
            roll(&mut machine, if ticks_a_second > 0 { 6 } else { 25 });
            assert_eq!(machine.stand(1).pulse, out, "{number}");
            assert_eq!(machine.stand(3000).pulse, out, "{number}: it does not come back by itself");
            assert_eq!(moves(&mut machine), Ok(()), "{number}");
        }
    }
}

#[test]
fn an_alarm_ends_a_manual_test() {
    let mut machine = machine();
    machine.servo_in().unwrap();
    machine.lose_edges(Beams::default());
    assert_eq!(machine.stand(1).pulse, servo::from_us(2000));
    assert_eq!(machine.state(), State::Alarm(Alarm::BeamEdgesLost));
}

#[test]
fn a_rolled_distance_calibrates_the_wheel() {
    let mut machine = machine();
    machine.set(Setting::WheelMm, 410).unwrap();
    machine.stand(1);
    assert_eq!(machine.calibrate(5000, false), Err(CommandError::NotBegun));
    machine.calibrate_start().unwrap();
    machine.at(18_500).stand(1);
    assert_eq!(machine.calibrate(10_000, false), Err(CommandError::Rolls));
    machine.stand(200);
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

/// Times the servo with a tool that is out this time after the command, and leaves that time after it.
fn swings(machine: &mut Machine, out_ms: u32, in_ms: u32) -> Vec<Event> {
    machine.readings.end_switch_on = true;
    machine.stand(1_000);
    machine.calibrate_servo().unwrap();
    let (mut told_out, mut told_at) = (true, 0);
    for now in 1_000..22_000 {
        let after = if told_out { out_ms } else { in_ms };
        machine.readings.end_switch_on = told_out == (now - told_at >= after);
        machine.stand(1);
        if machine.tool_out() != told_out {
            (told_out, told_at) = (machine.tool_out(), now);
        }
        assert!(now >= 20_490 || machine.lamp_is_lit() == machine.tool_out(), "the LED shows the commands");
    }
    machine.events()
}

#[test]
fn the_end_switch_times_the_servo() {
    let mut machine = machine();
    machine.set(Setting::EndSwitch, 1).unwrap();
    let events = swings(&mut machine, 150, 55);
    // The switch may be read a millisecond late.
    let outcome = Outcome::Measured(SwingTimes { out_ms: 161, in_ms: 54 });
    assert_eq!(events, [Event::Calibrated { outcome, fits: true }]);
    assert_eq!([Setting::LeadOutMs, Setting::LeadInMs].map(|lead| machine.settings().get(lead)), [161, 54]);
    assert_eq!((machine.state(), machine.tool_out()), (State::Hold, true));
}

#[test]
fn leads_that_do_not_fit_are_reported_and_not_set() {
    let mut machine = machine();
    machine.set(Setting::EndSwitch, 1).unwrap();
    // 400 ms at the top speed of 1.3 m/s exceed the beam's distance.
    let events = swings(&mut machine, 400, 55);
    assert!(matches!(events[..], [Event::Calibrated { outcome: Outcome::Measured(_), fits: false }]), "{events:?}");
    let mut before = Settings::new();
    before.set(Setting::EndSwitch, 1).unwrap();
    assert_eq!(machine.settings(), &before, "both leads are set, or none");
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
    assert_eq!(machine.stand(1600).pulse, servo::from_us(1500));
    machine.servo_out().unwrap();
    assert_eq!(machine.stand(100).pulse, servo::from_us(2000));
}

#[test]
fn a_dry_run_ignores_the_sensors() {
    let mut machine = machine();
    machine.at(77).stand(300);
    machine.test_row(500).unwrap();
    machine.enable_events(true);
    let mut swings = Vec::new();
    for now in 300..10_000 {
        // Nothing is wired: the beam flickers faster than the loop can count, and the encoder's contacts pick up hum.
        let beams = Beams::one(now % 2 == 0);
        machine.see(beams);
        if now % 5 == 0 {
            machine.lose_edges(beams);
        }
        machine.readings.jumps = now;
        machine.stand(1);
        assert_eq!(machine.state(), State::Hold);
        swings.extend(machine.events());
        if swings.len() == 14 {
            break;
        }
        assert_eq!(machine.lamp_is_lit(), machine.tool_out(), "the LED shows the commands");
    }
    let position = machine.readings.position;
    let expected: Vec<_> = (0..14).map(|swing| Event::Swing { out: swing % 2 == 1, position }).collect();
    assert_eq!(swings, expected, "into the row, out and in for each plant, and out at the end");
}

#[test]
fn a_dry_run_does_not_change_the_known_ground() {
    // A canopy is known, another is in the beam, and a dry run starts.
    let row = |played: bool| {
        let mut machine = machine();
        for count in 0..2000 {
            machine.at(count).see(Beams::one((1000..1300).contains(&count) || count >= 1900));
            machine.stand(1);
        }
        machine.stand(200);
        if played {
            machine.test_row(1000).unwrap();
        }
        machine.stand(8800);
        let played_on = format!("{:?} {:?} {}", machine.zones(), machine.unseen_mm(), machine.detections().len());
        machine.start(false).unwrap();
        // The tool's command over both canopies, each millisecond.
        let mut tool = Vec::new();
        for count in 2000..4500 {
            machine.at(count).see(Beams::one(count < 2200));
            machine.stand(1);
            tool.push(machine.tool_out());
        }
        (played_on, tool)
    };
    assert_eq!(row(true), row(false));
}

#[test]
fn a_command_at_the_end_of_a_dry_run_costs_no_plant_its_zone() {
    type Command = fn(&mut Machine) -> Result<(), CommandError>;
    let commands: [Command; 7] = [
        |_| Ok(()),
        |machine| machine.servo_in(),
        |machine| machine.servo_out(),
        |machine| machine.calibrate_servo(),
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
            machine.stand(at_ms);
            command(&mut machine).unwrap();
            machine.stand(20);
            machine.hold();
            machine.start(false).unwrap();
            for count in 0..3000 {
                machine.at(count).see(Beams::one((1000..1300).contains(&count)));
                machine.stand(1);
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
    machine.stand(100);
    assert!(!machine.tool_out());
    machine.hold();
    let orders = machine.stand(10);
    assert_eq!(orders.pulse, orders.pulse_out);
    machine.stand(5000);
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
    for _ in 1..2000 {
        machine.stand(1);
        points += u32::from(machine.next_plot() == Some(Plot::Teleplot));
    }
    assert_eq!(points, 39);
    machine.set_plot(Plot::Off);
    machine.stand(100);
    assert_eq!(machine.next_plot(), None);
}
