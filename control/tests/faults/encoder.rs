//! Encoder faults: silent, dead, a dead channel, jumps. And similar readings without a fault: stops, trembling, leaves.

use crate::{
    common::{ByWidth, LEAST_HOLD_MM, machine},
    drive::{Drive, TICKS_A_METRE, TURN_US},
};
use control::{
    alarm::Alarm,
    measure::reset::Cause,
    memory::Volatile,
    operate::{event::Event, state::State, tool::Reason},
    settings::Setting,
    units::{Position, Ticks},
};
use rig::{Beams, Rig};

/// Silence in seconds, at a speed, after which it counts as sudden: ten ticks and three turns.
fn sudden_s(speed_m_s: f64) -> f64 {
    10.0 / (speed_m_s * TICKS_A_METRE) + 0.004
}

#[test]
fn after_a_silence_the_tool_stays_out_until_newly_seen_ground() {
    for speed_m_s in [0.14, 0.3, 0.7, 1.3] {
        let mut drive = Drive::at_work();
        drive.roll(speed_m_s, 0.5);
        drive.roll(0.0, 5.0 / (speed_m_s * TICKS_A_METRE));
        assert!(drive.tool_is_in(), "{speed_m_s} m/s");
        drive.roll(0.0, sudden_s(speed_m_s));
        assert!(!drive.tool_is_in(), "{speed_m_s} m/s");
        assert_eq!(drive.machine.reason(), Some(Reason::EncoderDoubtful));
        drive.roll(0.0, 10.0);
        assert!(!drive.tool_is_in(), "{speed_m_s} m/s");
        // The distance is unknown: the tool stays out over all ground seen before, and a margin ahead of it.
        for _ in 0..42 {
            drive.roll(0.5, 0.01);
            assert!(!drive.tool_is_in(), "{speed_m_s} m/s");
        }
        drive.roll(0.5, 0.05);
        assert!(drive.tool_is_in(), "{speed_m_s} m/s");
        assert_eq!((drive.alarm(), drive.machine.late()), (None, 0));
    }
}

#[test]
fn a_detection_interrupted_by_a_silence_counts_as_a_plant() {
    let mut drive = Drive::at_work();
    drive.beam(true);
    drive.roll(0.7, 0.1);
    drive.roll(0.0, 0.1);
    drive.roll(0.7, 0.01);
    drive.beam(false);
    drive.machine.events();
    drive.roll(0.7, 0.05);
    let told = drive.machine.events().into_iter().find_map(|event| match event {
        Event::Detection { vote, .. } => Some(vote.class),
        _ => None,
    });
    assert_eq!(told, Some(control::ground::class::Class::Unknown));
    assert_eq!(drive.machine.zones(), 1);
}

#[test]
fn the_third_silence_within_ten_metres_of_the_one_before_is_an_alarm() {
    for (between_m, alarm) in [(0.5, Some(Alarm::EncoderSilent)), (9.0, Some(Alarm::EncoderSilent)), (12.0, None)] {
        let mut drive = Drive::at_work();
        for silence in 1..=3 {
            drive.roll(0.7, between_m);
            drive.roll(0.0, 0.1);
            drive.roll(0.7, 0.05);
            assert_eq!(drive.alarm(), alarm.filter(|_| silence == 3), "silence {silence}, {between_m} m apart");
        }
    }
}

#[test]
fn many_and_hard_stops_are_no_alarm() {
    let mut drive = Drive::at_work();
    for stop in 0..30 {
        drive.roll(0.3 + f64::from(stop) / 30.0, 0.3);
        drive.brake_by(0.3 + f64::from(stop) / 30.0, 8.0);
        drive.roll(0.0, 0.5);
        drive.speed_up(0.7, 2.0);
    }
    assert_eq!(drive.alarm(), None);
}

#[test]
fn a_hard_stop_is_no_silence_with_any_encoder() {
    // From 16,000 ticks a metre to 900. A person brakes with 3 m/s2, and the slipping wheel with a tenth more. The progress of an
    // encoder finer than 0.4 mm may be a little shorter.
    let machines =
        [(2400, 400, 3.3), (10_000, 200, 3.3), (5000, 300, 3.3), (4000, 530, 2.6), (1250, 400, 3.3), (2300, 800, 3.3)];
    for (ticks_per_rev, wheel_mm, braking_m_s2) in machines {
        let mut machine = machine();
        machine.set(Setting::WheelMm, wheel_mm).unwrap();
        machine.set(Setting::TicksPerRev, ticks_per_rev).unwrap();
        let a_metre = f64::from(ticks_per_rev) * 1000.0 / (std::f64::consts::PI * f64::from(wheel_mm));
        let mut place_m = 0.0;
        let mut turn = |speed_m_s: f64, place_m: &mut f64| {
            *place_m += speed_m_s * 0.000_25;
            machine.at((*place_m * a_metre).floor() as i32).turn_after(250);
            machine.encoder_is_silent()
        };
        let mut silent = 0;
        for stop in 0..400 {
            let mut speed_m_s = 0.2 + f64::from(stop) * 0.003;
            place_m += 0.000_013;
            // From standstill with 2 m/s2, over some distance, and to a stop.
            let from = (0..(speed_m_s / 0.0005) as u32).any(|step| turn(f64::from(step) * 0.0005, &mut place_m));
            let rolling = (0..1600).any(|_| turn(speed_m_s, &mut place_m));
            let mut braking = false;
            while speed_m_s > 0.0 {
                speed_m_s -= braking_m_s2 * 0.000_25;
                braking |= turn(speed_m_s.max(0.0), &mut place_m);
            }
            let standing = (0..1200).any(|_| turn(0.0, &mut place_m));
            silent += u32::from(from || rolling || braking || standing);
        }
        assert_eq!(silent, 0, "{ticks_per_rev} ticks a turn of {wheel_mm} mm");
    }
}

#[test]
fn a_fine_encoder_that_falls_silent_is_found_as_soon() {
    let mut machine = machine();
    machine.set(Setting::TicksPerM, 20_000).unwrap();
    for speed_m_s in [0.3, 0.7, 1.3] {
        let mut place = 0.0;
        let base = machine.readings.position.count();
        for turn in 1..4000 {
            place += speed_m_s * 20_000.0 * 0.000_25;
            machine.at(base + place as i32).turn_after(250);
            assert!(!machine.encoder_is_silent() || turn < 200);
        }
        for _ in 1..200 {
            machine.turn_after(250);
        }
        assert!(machine.encoder_is_silent(), "{speed_m_s} m/s");
    }
}

#[test]
fn an_encoder_that_dies_anywhere_never_brings_the_tool_back() {
    // All along a plant's approach, its zone and the ground after it.
    for died_after in (0..900).step_by(7) {
        let mut drive = Drive::at_work();
        drive.roll(0.78, 0.5);
        drive.pass_a_plant(0.78);
        drive.roll(0.78, f64::from(died_after) / 1000.0);
        let was_out = !drive.tool_is_in();
        for millisecond in 0..300 {
            drive.roll(0.0, 0.001);
            assert!(!was_out || !drive.tool_is_in(), "back {millisecond} ms after it died, {died_after} mm on");
            assert!(millisecond < 31 || !drive.tool_is_in(), "in the row, {died_after} mm on");
        }
    }
}

#[test]
fn a_machine_that_brakes_keeps_its_tool_in_the_row() {
    for speed_m_s in [0.3, 0.7, 1.3] {
        let mut drive = Drive::at_work();
        drive.roll(speed_m_s, 0.5);
        drive.brake(speed_m_s);
        drive.roll(0.0, 5.0);
        assert!(drive.tool_is_in(), "{speed_m_s} m/s");
    }
}

#[test]
fn an_encoder_that_dies_at_rest_is_an_alarm_at_the_third_plant() {
    let mut drive = Drive::at_work();
    drive.brake(0.5);
    drive.roll(0.0, 0.2);
    assert!(drive.tool_is_in(), "the machine may just stand");
    for plant in 1..=3 {
        drive.beam(true);
        drive.roll(0.0, 0.3);
        assert!(!drive.tool_is_in(), "plant {plant}");
        drive.beam(false);
        drive.roll(0.0, 0.7);
        assert_eq!(drive.alarm(), (plant == 3).then_some(Alarm::EncoderSilent), "plant {plant}");
    }
}

#[test]
fn leaves_moving_at_rest_keep_the_tool_out_until_rolling() {
    let mut drive = Drive::at_work();
    for _ in 0..5 {
        drive.brake(0.5);
        drive.roll(0.0, 0.2);
        drive.beam(true);
        drive.beam(false);
        drive.roll(0.0, 0.1);
        assert_eq!(drive.machine.reason(), Some(Reason::EncoderDoubtful));
        drive.roll(0.5, 0.5);
        assert!(drive.tool_is_in());
    }
    assert_eq!(drive.alarm(), None);
}

#[test]
fn plants_that_pass_a_rolling_machine_raise_no_doubt_in_the_encoder() {
    for speed_m_s in [0.02, 0.5, 1.3] {
        let mut drive = Drive::at_work();
        for _ in 0..6 {
            drive.roll(speed_m_s, 0.35);
            drive.pass_a_plant(speed_m_s);
            assert_ne!(drive.machine.reason(), Some(Reason::EncoderDoubtful), "{speed_m_s} m/s");
        }
        assert_eq!(drive.alarm(), None, "{speed_m_s} m/s");
    }
}

/// Moves the encoder to and fro between two counts, at a rate in edges a second, for two seconds.
fn tremble(drive: &mut Drive, edges_a_second: u32) {
    let count = drive.place.floor() as i32;
    for turn in 0..2_000_000 / TURN_US {
        let edges = turn * TURN_US * edges_a_second / 1_000_000;
        drive.turn_at(count + (edges % 2) as i32);
    }
}

#[test]
fn edges_without_progress_are_an_alarm_at_work() {
    // One channel of two at 1 and at 2.5 km/h.
    for edges_a_second in [265, 663] {
        let mut drive = Drive::at_work();
        tremble(&mut drive, edges_a_second);
        assert_eq!(drive.alarm(), Some(Alarm::EncoderChannelDead), "{edges_a_second}");
        let mut drive = Drive::in_hold();
        tremble(&mut drive, edges_a_second);
        assert_eq!(drive.alarm(), None);
    }
}

#[test]
fn a_wheel_that_trembles_on_an_edge_with_the_engine_is_no_alarm() {
    let mut drive = Drive::at_work();
    tremble(&mut drive, 100);
    assert_eq!(drive.alarm(), None);
}

/// Values on both sides of each scale's limit, and the extremes.
const TICKS_PER_M: [u16; 11] = [900, 1910, 2400, 2401, 4800, 4801, 9600, 9601, 15_000, 19_200, 20_000];

#[test]
fn a_machine_that_reverses_at_work_has_no_dead_channel_with_any_encoder() {
    for ticks_per_m in TICKS_PER_M {
        for (speed_m_s, braking_m_s2, rest_s) in [(0.3, 0.3, 0.0), (0.7, 1.0, 0.0), (0.7, 3.0, 0.2), (1.2, 2.0, 0.05)] {
            let mut machine = machine();
            machine.set(Setting::TicksPerM, ticks_per_m).unwrap();
            machine.start(false).unwrap();
            let (mut place_m, mut speed, mut alarms) = (0.0, 0.0, Vec::new());
            for turned in 0..20 {
                // It reverses at each position within a tick and a progress; after its rest it goes the other way.
                let to = if turned % 2 == 0 { speed_m_s } else { -speed_m_s } + f64::from(turned) * 0.001;
                let step = braking_m_s2 * 0.000_25 * f64::signum(to);
                let rest = (rest_s / 0.000_25) as usize;
                let rolls = (0..(2.0 * speed_m_s / braking_m_s2 / 0.000_25) as usize + 1200).map(|_| step);
                for step in std::iter::repeat_n(0.0, if speed == 0.0 { rest } else { 0 }).chain(rolls) {
                    let before = speed;
                    speed = (speed + step).clamp(-to.abs(), to.abs());
                    let stops = if before * speed < 0.0 { rest } else { 0 };
                    for speed in std::iter::repeat_n(0.0, stops).chain([speed]) {
                        place_m += speed * 0.000_25;
                        machine.at((place_m * f64::from(ticks_per_m)).floor() as i32).turn_after(250);
                    }
                }
                if let State::Alarm(alarm) = machine.state() {
                    alarms.push(alarm);
                    machine.clear();
                    machine.start(false).unwrap();
                }
            }
            assert_eq!(alarms, [], "{ticks_per_m} a metre, {speed_m_s} m/s, {braking_m_s2} m/s2, {rest_s} s");
        }
    }
}

#[test]
fn a_dead_channel_is_an_alarm_with_every_encoder() {
    for ticks_per_m in TICKS_PER_M {
        let mut machine = machine();
        machine.set(Setting::TicksPerM, ticks_per_m).unwrap();
        machine.start(false).unwrap();
        // At 2.5 km/h every other tick comes, to and fro. The loop's turns are not in step with them.
        let (mut place_m, mut dies_at) = (0.0, 0);
        for turn in 0..8000 {
            let turn_us = 250 + turn % 7 * 20;
            place_m += 0.694 * f64::from(turn_us) / 1e6;
            let count = (place_m * f64::from(ticks_per_m)).floor() as i32;
            dies_at = if turn < 2000 { count } else { dies_at };
            machine.at(if turn < 2000 { count } else { dies_at + count / 2 % 2 }).turn_after(turn_us);
        }
        let State::Alarm(alarm) = machine.state() else { panic!("{ticks_per_m} a metre: no alarm") };
        assert!(matches!(alarm, Alarm::EncoderChannelDead | Alarm::EncoderJumps), "{ticks_per_m} a metre: {alarm:?}");
    }
}

#[test]
fn a_wheel_that_trembles_after_a_slow_stop_is_no_alarm() {
    for speed_m_s in [0.05, 0.1, 0.15, 0.2] {
        let mut drive = Drive::at_work();
        for _ in 0..10 {
            drive.roll(speed_m_s, 0.2);
            drive.brake_by(speed_m_s, 1.0);
            tremble(&mut drive, 100);
        }
        assert_eq!(drive.alarm(), None, "{speed_m_s} m/s");
    }
}

#[test]
fn an_alarm_that_a_beam_edge_raises_reports_the_odometers_position() {
    let mut drive = Drive::at_work();
    // Jumps bring ticks that are noise: the odometer leaves them out, so its position differs from the count.
    for _ in 0..3 {
        drive.machine.readings.jumps += 1;
        drive.place += 2.0;
        drive.roll(0.7, 0.3);
    }
    let position = drive.machine.position();
    assert_ne!(position, drive.machine.readings.position, "the odometer leaves noise out");
    drive.machine.events();
    drive.machine.lose_edges(Beams::default());
    assert_eq!(drive.machine.events()[0], Event::Alarm { alarm: Alarm::BeamEdgesLost, position });
}

#[test]
fn jumps_are_an_alarm_by_the_distance_between_them() {
    // Across the count's wrap. Each jump brings two ticks that are noise.
    for (metres_between, alarm) in [(0.02, Some(Alarm::EncoderJumps)), (0.05, None)] {
        for speed_m_s in [0.3, 1.2] {
            let mut readings = machine().readings;
            readings.jumps = u16::MAX - 10;
            let (classifier, memory) = (ByWidth::new(LEAST_HOLD_MM, 0), Volatile::new());
            let mut machine = Rig::wake_at(classifier, memory, readings, Beams::default(), Cause::PowerOn);
            machine.clear();
            let mut drive = Drive { machine, place: 0.0 };
            for _ in 0..200 {
                drive.machine.readings.jumps = drive.machine.readings.jumps.wrapping_add(1);
                drive.place += 2.0;
                drive.roll(speed_m_s, metres_between);
            }
            assert_eq!(drive.alarm(), alarm, "a jump every {metres_between} m at {speed_m_s} m/s");
        }
    }
}

#[test]
fn jumps_at_rest_move_nothing_and_many_are_an_alarm() {
    for (every_ms, alarm) in [(4, Some(Alarm::EncoderJumps)), (40, None)] {
        let mut drive = Drive::in_hold();
        for jump in 1..=200 {
            drive.machine.readings.jumps += 1;
            drive.place += 2.0;
            drive.roll(0.0, f64::from(every_ms) / 1000.0);
            assert_eq!(drive.machine.position().count(), 0, "jump {jump}");
        }
        assert_eq!(drive.alarm(), alarm, "a jump every {every_ms} ms");
    }
}

#[test]
fn jumps_count_for_a_wheel_so_fast_that_an_edge_can_be_missed() {
    for (speed_m_s, believed) in [(7.0, false), (15.0, true)] {
        let mut drive = Drive::in_hold();
        drive.roll(speed_m_s, 3.0);
        let before = drive.machine.position();
        let (place, jumps) = (drive.place, 5);
        for _ in 0..jumps {
            drive.machine.readings.jumps += 1;
            drive.roll(speed_m_s, 0.1);
        }
        let counted = drive.place.floor() as i32 - place.floor() as i32;
        let doubted = if believed { 0 } else { 2 * jumps };
        assert_eq!(drive.machine.position() - before, Ticks(counted - doubted), "{speed_m_s} m/s");
    }
}

#[test]
fn spikes_at_a_plant_in_the_beam_of_a_machine_that_stands_are_no_breaks() {
    for (changes, alarm) in [(false, None), (true, Some(Alarm::EncoderSilent))] {
        let mut drive = Drive::at_work();
        drive.beam(true);
        drive.roll(0.5, 0.02);
        drive.brake(0.5);
        drive.roll(0.0, 1.0);
        for _ in 0..5 {
            // An interrupt each, and a spike is over when the level is read.
            if changes {
                drive.beam(false);
                drive.roll(0.0, 0.2);
            }
            drive.machine.edge(Position::new(drive.place.floor() as i32), Beams::one(true));
            drive.roll(0.0, 0.2);
        }
        assert_eq!(drive.alarm(), alarm);
    }
}

#[test]
fn hands_in_the_beam_of_a_machine_that_stands_in_hold_are_no_alarm() {
    for broken_s in [0.02, 0.3] {
        let mut drive = Drive::in_hold();
        drive.roll(0.0, 0.2);
        for _ in 0..6 {
            drive.beam(true);
            drive.roll(0.0, broken_s);
            drive.beam(false);
            drive.roll(0.0, 0.5);
        }
        assert_eq!(drive.machine.state(), State::Hold, "{broken_s} s");
    }
}
