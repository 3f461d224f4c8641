//! Faults of beam or crop: too many weeds, no plant over a long distance, a flickering beam; and dust, which is neither.

use crate::drive::Drive;
use control::{
    alarm::{Alarm, Warning},
    operate::{event::Event, state::State},
    settings::Setting,
};
use rig::Beams;

#[test]
fn a_row_of_stalks_classified_as_weeds_is_an_alarm_at_the_fifth() {
    let mut drive = Drive::at_work();
    assert_eq!((drive.pass_stalks(20), drive.alarm()), (5, Some(Alarm::CropUnknown)));
    drive.machine.clear();
    drive.machine.start(false).unwrap();
    assert_eq!((drive.pass_stalks(20), drive.alarm()), (5, Some(Alarm::CropUnknown)), "the count restarts");
}

#[test]
fn as_many_stalks_as_set_are_an_alarm_and_0_turns_it_off() {
    for (misfit_after, stalks) in [(1, 1), (2, 2), (100, 100), (0, 300)] {
        let mut drive = Drive::at_work();
        drive.machine.set(Setting::MisfitAfter, misfit_after).unwrap();
        assert_eq!(drive.pass_stalks(300), stalks);
        assert_eq!(drive.alarm().is_some(), misfit_after != 0);
    }
}

#[test]
fn weeds_in_hold_or_with_plants_between_them_raise_no_alarm() {
    let mut drive = Drive::at_work();
    for _ in 0..10 {
        assert_eq!((drive.pass_stalks(4), drive.alarm()), (4, None));
        drive.pass_a_plant(0.5);
        drive.roll(0.5, 0.2);
    }
    drive.machine.hold();
    assert_eq!((drive.pass_stalks(20), drive.alarm()), (20, None));
    drive.machine.start(false).unwrap();
    assert_eq!(drive.pass_stalks(20), 5, "what was seen in hold does not count");
}

#[test]
fn a_detection_below_the_least_width_counts_only_as_dust() {
    let mut drive = Drive::at_work();
    for (setting, value) in [(Setting::MinWidthMm, 25), (Setting::NoPlantM, 2)] {
        drive.machine.set(setting, value).unwrap();
    }
    assert_eq!((drive.pass_stalks(10), drive.alarm()), (10, None));
    assert_eq!((drive.machine.dust(), drive.machine.detections().len()), (10, 0));
    assert_eq!(drive.machine.events(), [Event::Warning(Warning::NoPlants)], "there was no plant");
    drive.pass(0.5, 0.03);
    drive.roll(0.5, 0.1);
    assert_eq!((drive.machine.dust(), drive.machine.detections().len()), (10, 1));
    drive.pass(0.5, 0.0252);
    drive.roll(0.5, 0.1);
    assert_eq!((drive.machine.dust(), drive.machine.detections().len()), (10, 2), "the least width is no dust");
}

#[test]
fn the_narrow_rest_of_a_detection_is_no_dust() {
    let mut drive = Drive::in_hold();
    drive.machine.set(Setting::MinWidthMm, 100).unwrap();
    drive.machine.lose_edges(Beams::one(true));
    drive.roll(0.5, 0.02);
    drive.beam(false);
    drive.roll(0.5, 0.1);
    assert_eq!((drive.machine.dust(), drive.machine.detections().len()), (0, 1));
}

#[test]
fn a_beam_that_flickers_is_an_alarm_and_a_ragged_canopy_is_none() {
    let mut drive = Drive::at_work();
    for _ in 0..60 {
        drive.beam(true);
        drive.roll(0.5, 0.0005);
        drive.beam(false);
        drive.roll(0.5, 0.0005);
    }
    assert_eq!(drive.alarm(), Some(Alarm::BeamFlickers));
    // At 4.6 km/h, a clear stretch every 14 ms.
    let mut drive = Drive::at_work();
    drive.roll(1.28, 0.3);
    for _ in 0..10 {
        drive.beam(true);
        drive.roll(1.28, 0.008);
        drive.beam(false);
        drive.roll(1.28, 0.006);
    }
    assert_eq!(drive.alarm(), None);
}

/// A beam that breaks for these milliseconds, this many times a second, until there is an alarm.
fn flicker(speed_m_s: f64, breaks_ms: impl IntoIterator<Item = u32>, a_second: u32) -> Option<Alarm> {
    let mut drive = Drive::at_work();
    if speed_m_s == 0.0 {
        drive.brake(0.5);
        drive.roll(0.0, 1.0);
    }
    let pass = |drive: &mut Drive, ms: u32| {
        let seconds = f64::from(ms) / 1000.0;
        drive.roll(speed_m_s, if speed_m_s > 0.0 { speed_m_s * seconds } else { seconds });
    };
    breaks_ms.into_iter().take(60).find_map(|ms| {
        drive.beam(true);
        pass(&mut drive, ms);
        drive.beam(false);
        pass(&mut drive, 1000 / a_second - ms);
        drive.alarm()
    })
}

#[test]
fn short_breaks_at_any_speed_are_the_beam_s_fault_whatever_they_look_like() {
    for a_second in [1, 2, 5, 10, 20] {
        for speed_m_s in [0.0, 0.28, 0.7] {
            let mixed = [17, 3, 28, 9, 1, 22, 12, 30, 6].into_iter().cycle();
            assert_eq!(flicker(speed_m_s, mixed, a_second), Some(Alarm::BeamFlickers), "{speed_m_s} {a_second}");
        }
        for ms in 1..=30 {
            let alarm = flicker(0.0, std::iter::repeat_n(ms, 60), a_second);
            assert_eq!(alarm, Some(Alarm::BeamFlickers), "{ms} ms standing");
        }
    }
}

#[test]
fn plants_and_stalks_are_no_flicker() {
    // Plants that pass while the encoder is dead, and leaves in the wind.
    for ms in [33, 60, 216] {
        assert_eq!(flicker(0.0, std::iter::repeat_n(ms, 60), 2), Some(Alarm::EncoderSilent), "{ms} ms");
    }
    // Stalks of 15 to 20 mm at 2.5 km/h.
    let stalks = [22, 28, 25, 29, 23, 26, 27].into_iter().cycle();
    assert_eq!(flicker(0.7, stalks, 3), Some(Alarm::CropUnknown));
    // Weeds as short, then an object that stays in the beam.
    let mut drive = Drive::at_work();
    for _ in 0..4 {
        drive.pass(0.7, 0.004);
        drive.roll(0.7, 0.2);
    }
    drive.beam(true);
    drive.roll(0.7, 0.5);
    assert_eq!(drive.alarm(), Some(Alarm::BeamBlocked));
}

#[test]
fn a_long_distance_without_a_plant_is_one_warning() {
    let mut drive = Drive::at_work();
    drive.machine.set(Setting::NoPlantM, 3).unwrap();
    let warned = |drive: &mut Drive| {
        let events = drive.machine.events();
        events.iter().filter(|event| **event == Event::Warning(Warning::NoPlants)).count()
    };
    drive.roll(0.5, 1.9);
    assert!(!drive.machine.sees_no_plants());
    drive.roll(0.5, 0.2);
    assert!(drive.machine.sees_no_plants());
    assert_eq!(warned(&mut drive), 1);
    drive.roll(0.5, 5.0);
    assert_eq!((warned(&mut drive), drive.machine.state()), (0, State::Work), "once is enough");
    drive.pass_a_plant(0.5);
    drive.roll(0.5, 0.2);
    assert!(!drive.machine.sees_no_plants(), "a plant ends it");
    drive.roll(0.5, 3.0);
    assert_eq!(warned(&mut drive), 1);

    let mut never = Drive::at_work();
    never.machine.set(Setting::NoPlantM, 0).unwrap();
    never.roll(1.3, 150.0);
    assert!(!never.machine.sees_no_plants());
}

#[test]
fn start_ends_the_warning_and_counts_the_distance_anew() {
    let mut drive = Drive::at_work();
    drive.machine.set(Setting::NoPlantM, 2).unwrap();
    drive.roll(0.5, 3.0);
    assert!(drive.machine.sees_no_plants());
    drive.machine.hold();
    drive.machine.start(false).unwrap();
    assert!(!drive.machine.sees_no_plants());
    drive.roll(0.5, 1.9);
    assert!(!drive.machine.sees_no_plants());
    drive.roll(0.5, 0.2);
    assert!(drive.machine.sees_no_plants());
}
