//! Each fault of the decisions: what raises it, what does not, and that the tool is then out of the row.
//!
//! This file has distance, speed, tool and stack; `encoder`, `crop` and `saved_settings` have the others.

#[path = "../common/mod.rs"]
mod common;
mod crop;
mod drive;
mod encoder;
mod saved_settings;

use common::{ByWidth, LEAST_HOLD_MM};
use control::{
    alarm::{Alarm, Warning},
    measure::{readings::Readings, reset::Cause},
    memory::Volatile,
    operate::{event::Event, state::State, tool::Reason},
    settings::Setting,
    units::{Instant, Position},
};
use drive::{Drive, TICKS_A_METRE, TURN_US};
use rig::{Beams, Rig};

#[test]
fn working_faster_than_the_limit_is_an_alarm_in_both_directions() {
    for (speed_m_s, alarm) in [(1.35, None), (1.45, Some(Alarm::TooFast)), (-1.35, None), (-1.45, Some(Alarm::TooFast))]
    {
        let mut drive = Drive::at_work();
        drive.roll(speed_m_s, 0.8);
        assert_eq!(drive.alarm(), alarm, "{speed_m_s} m/s");
    }
    let mut drive = Drive::in_hold();
    drive.roll(5.0, 2.0);
    assert_eq!(drive.alarm(), None, "on the way to the field");
}

#[test]
fn a_jump_in_speed_before_a_zone_counts_as_a_late_command() {
    // The plant's margin is 350 mm behind the beam; the lead is 54 mm at 0.3 m/s, and 234 mm at 1.3 m/s.
    for (jumps, late) in [(false, 0), (true, 1)] {
        let mut drive = Drive::at_work();
        drive.roll(0.3, 0.5);
        drive.pass_a_plant(0.3);
        drive.roll(0.3, 0.1);
        assert!(drive.tool_is_in());
        drive.machine.events();
        drive.roll(if jumps { 1.3 } else { 0.3 }, 0.12);
        assert!(!drive.tool_is_in());
        assert_eq!(drive.machine.late(), late);
        let told = drive.machine.events().contains(&Event::Warning(Warning::LateCommand));
        assert_eq!(told, jumps);
        assert_eq!(drive.machine.state(), State::Work);
    }
}

#[test]
fn a_speed_rise_above_an_eighth_during_a_swing_makes_it_late() {
    for (rises_by, late) in [(1.1, 0), (1.2, 1)] {
        let mut drive = Drive::at_work();
        drive.roll(0.5, 0.5);
        drive.pass_a_plant(0.5);
        while drive.tool_is_in() {
            drive.roll(0.5, 0.001);
        }
        drive.roll(0.5 * rises_by, 0.2);
        assert_eq!(drive.machine.late(), late, "{rises_by}");
    }
}

#[test]
fn in_paper_mode_no_command_is_late() {
    let mut drive = Drive::at_work();
    drive.machine.set(Setting::LeadInMs, 0).unwrap();
    drive.machine.set(Setting::LeadOutMs, 0).unwrap();
    drive.pass_a_plant(0.7);
    drive.roll(0.7, 1.0);
    assert_eq!(drive.machine.late(), 0);
}

#[test]
fn rolling_back_to_forgotten_ground_is_an_alarm() {
    let mut drive = Drive::at_work();
    for _ in 0..20 {
        drive.pass_a_plant(0.5);
        drive.roll(0.5, 0.35);
    }
    // The 16 remembered canopies reach 8 m back; the oldest of them was not the first.
    drive.roll(-0.5, 6.0);
    assert_eq!(drive.alarm(), None);
    drive.roll(-0.5, 3.0);
    assert_eq!(drive.alarm(), Some(Alarm::RolledBackTooFar));
}

#[test]
fn rolling_back_to_ground_never_seen_takes_the_tool_out_and_is_no_alarm() {
    let mut drive = Drive::at_work();
    drive.roll(-0.5, 2.0);
    assert_eq!((drive.alarm(), drive.machine.reason()), (None, Some(Reason::UnseenGround)));
    drive.roll(0.5, 2.0);
    assert!(drive.tool_is_in());
}

#[test]
fn rolling_back_over_the_start_line_to_known_ground_is_no_alarm() {
    let mut drive = Drive::at_work();
    drive.roll(0.5, 4.0);
    drive.machine.hold();
    drive.roll(-0.5, 1.0);
    drive.machine.start(false).unwrap();
    drive.roll(0.5, 2.0);
    assert!(drive.tool_is_in());
    drive.roll(-0.5, 2.0);
    assert_eq!((drive.alarm(), drive.machine.reason()), (None, Some(Reason::UnseenGround)));
}

#[test]
fn a_tool_that_does_not_follow_is_an_alarm_with_an_end_switch() {
    // The switch never closes, although the tool is commanded out.
    let mut drive = Drive::in_hold();
    drive.roll(0.0, 1.0);
    assert_eq!(drive.alarm(), None, "without a switch it is unknown");
    drive.machine.set(Setting::EndSwitch, 1).unwrap();
    drive.roll(0.0, 0.1);
    assert_eq!(drive.alarm(), Some(Alarm::ToolStuck));

    // The switch stays closed, although the tool is commanded in.
    let mut drive = Drive::at_work();
    drive.machine.set(Setting::EndSwitch, 1).unwrap();
    drive.roll(0.5, 1.0);
    assert_eq!(drive.alarm(), None, "open, and the tool is in the row");
    drive.pass_a_plant(0.5);
    drive.roll(0.5, 0.4);
    assert_eq!(drive.alarm(), Some(Alarm::ToolStuck), "it should have closed");

    let mut drive = Drive::at_work();
    drive.machine.set(Setting::EndSwitch, 1).unwrap();
    drive.machine.readings.end_switch_on = true;
    drive.roll(0.5, 0.05);
    assert_eq!(drive.alarm(), Some(Alarm::ToolStuck), "closed, and the tool is commanded in");
}

#[test]
fn a_tool_that_follows_within_its_time_is_no_alarm() {
    let mut drive = Drive::at_work();
    drive.machine.set(Setting::EndSwitch, 1).unwrap();
    let mut is_out = [drive.machine.tool_out(); 360];
    for turn in 0..40_000 {
        drive.beam((500..1_000).contains(&(turn % 2_000)));
        // 180 ms behind the command, and the contacts bounce.
        let place = turn % is_out.len();
        drive.machine.readings.end_switch_on = is_out[place] ^ (turn % 50 == 0);
        drive.roll(0.5, 0.5 * TURN_US as f64 / 1e6);
        is_out[place] = drive.machine.tool_out();
    }
    assert_eq!(drive.alarm(), None);
}

#[test]
fn a_tool_that_dies_is_an_alarm_even_if_each_swing_is_short() {
    for (dies_behind, alarm_behind) in [(u32::MAX, None), (5, Some(8))] {
        let mut drive = Drive::at_work();
        drive.machine.set(Setting::EndSwitch, 1).unwrap();
        let (mut is_out, mut swings) = ([false; 360], 0);
        let begin = drive.place;
        for turn in 0..20_000 {
            drive.beam((drive.place - begin) % (0.5 * TICKS_A_METRE) < 0.06 * TICKS_A_METRE);
            // The servo is out 180 ms behind the command.
            let (place, was_out) = (turn % is_out.len(), drive.machine.tool_out());
            drive.machine.readings.end_switch_on = is_out[place] && swings < dies_behind;
            drive.roll(1.3, 1.3 * TURN_US as f64 / 1e6);
            is_out[place] = drive.machine.tool_out();
            swings += u32::from(was_out && !is_out[place]);
            if drive.alarm().is_some() {
                break;
            }
        }
        let alarm = drive.alarm().map(|alarm| (alarm, swings));
        assert_eq!(alarm, alarm_behind.map(|swings| (Alarm::ToolStuck, swings)));
        assert!(swings > 7, "{swings} swings");
        if alarm.is_some() {
            // The switch is repaired: the swings before count no more.
            drive.machine.readings.end_switch_on = true;
            drive.machine.clear();
            drive.roll(0.0, 0.1);
            assert_eq!(drive.alarm(), None);
        }
    }
}

#[test]
fn a_stack_that_is_nearly_used_up_is_an_alarm() {
    let mut drive = Drive::at_work();
    drive.machine.readings.stack_free = 48;
    drive.roll(0.5, 0.1);
    assert_eq!(drive.alarm(), None);
    drive.machine.readings.stack_free = 47;
    drive.roll(0.5, 0.1);
    assert_eq!(drive.alarm(), Some(Alarm::StackLow));
}

#[test]
fn nothing_happens_when_time_and_position_wrap() {
    // Both counters pass their end in the middle of a row.
    let swings = |first_steps: u32, first_count: i32| {
        let readings = Readings::new(Instant::new(first_steps), Position::new(first_count));
        let (classifier, memory) = (ByWidth::new(LEAST_HOLD_MM, 0), Volatile::new());
        let mut machine = Rig::wake_at(classifier, memory, readings, Beams::default(), Cause::PowerOn);
        machine.clear();
        machine.start(false).unwrap();
        let (mut swings, mut was_out) = (Vec::new(), true);
        for turn in 0..24_000 {
            let count = (f64::from(turn) * 0.53) as i32;
            machine.at(first_count.wrapping_add(count)).see(Beams::one(count % 1000 >= 700 && count > 1000));
            machine.turn_after(TURN_US);
            if machine.tool_out() != was_out {
                was_out = !was_out;
                swings.push((turn, was_out));
            }
        }
        assert_eq!(machine.state(), State::Work);
        swings
    };
    let plain = swings(0, 0);
    assert!(plain.len() > 15, "{plain:?}");
    assert_eq!(swings(0_u32.wrapping_sub(1_000_000), i32::MAX - 3000), plain);
}
