//! Tests of what needs no machine.

use super::*;
use control::ground::{examples::EXAMPLES, nearest::Nearest};
use control::measure::reset::Cause;
use control::memory::Volatile;
use rand::{RngExt, SeedableRng};
use rand_chacha::ChaCha8Rng;
use rig::{Rig, settings};

/// Takes the steps as the firmware does. It refuses a step that causes a contradiction.
#[track_caller]
fn assert_leads(from: &Settings, to: &Settings) {
    let mut now = from.clone();
    for (setting, value) in steps(from, to) {
        let was_right = now.contradiction().is_none();
        // Values of settings are in their ranges.
        let _ = now.change(setting, value);
        assert!(!was_right || now.contradiction().is_none(), "{setting:?} {value} from {from:?} to {to:?}");
    }
    assert_eq!(&now, to);
}

/// The answer to `get` of the firmware that this program knows, with a line changed.
fn lines_with(change: impl Fn(&str) -> Option<String>) -> Vec<String> {
    let mut rig = Rig::wake(Nearest::new(&EXAMPLES[..], Volatile::new()), Volatile::new(), Cause::Unknown);
    rig.ask("get").iter().filter_map(|line| change(line)).collect()
}

#[test]
fn a_second_beam_limits_the_speed_by_its_distance_to_the_tool() {
    let beam = |second_beam_mm| settings(&[(Setting::SecondBeamMm, second_beam_mm)]);
    assert_eq!(working_speed(&beam(0)), None);
    // Within nine eighths of 230 ms, the response and a millisecond.
    assert_eq!(working_speed(&beam(200)), Some((1000.0 * 199.0 / 260.0) as u16));
    assert_eq!(working_speed(&beam(72)), Some((1000.0 * (400.0 - 72.0 - 1.0) / 260.0) as u16));
    let lead = [(Setting::SecondBeamMm, 72), (Setting::MarginMm, 150), (Setting::LeadOutMs, 0)];
    assert_eq!(working_speed(&settings(&lead)), Some(u16::MAX));
}

#[test]
fn settings_of_another_version_are_shown_and_the_newer_side_is_named() {
    let same = lines_with(|line| Some(line.to_owned()));
    assert!(Shown::by(&same).missing.is_empty() && other_version(&format!("{OWN} (abc1234)"), &same).is_none());
    let wider = lines_with(|line| match line.split('=').next() {
        Some("wheel_mm") => Some("wheel_mm=900 mm from 200 to 1200, default 400".to_owned()),
        Some("k") => Some("tilt=on on or off, default off".to_owned()),
        _ => Some(line.to_owned()),
    });
    let shown = Shown::by(&wider);
    assert_eq!(shown.missing, [Setting::WheelMm, Setting::K]);
    let others: Vec<(&str, u16)> = shown.others.iter().map(|other| (&*other.name, other.value)).collect();
    assert_eq!(others, [("wheel_mm", 900), ("tilt", 1)]);
    let newer = other_version("99.0.1 (abc)", &wider).unwrap();
    assert!(newer.starts_with("the firmware 99.0.1 (abc) is newer than this program"), "{newer}");
    assert!(newer.ends_with("; only the firmware knows wheel_mm, tilt; the firmware lacks k"), "{newer}");
    let older = other_version("0.1.9", &same).unwrap();
    assert!(older.contains("is older than this program") && older.contains("`weeder flash`"), "{older}");
}

#[test]
fn pulses_that_change_places_never_meet() {
    for (one, other) in [(500, 2500), (2500, 500), (2499, 2500), (2500, 2499)] {
        let pulses = |in_us, out_us| settings(&[(Setting::ServoInUs, in_us), (Setting::ServoOutUs, out_us)]);
        assert_leads(&pulses(one, other), &pulses(other, one));
    }
}

#[test]
fn settings_that_contradict_each_other_are_mended() {
    let wrong = settings(&[(Setting::BeamToToolMm, 100), (Setting::ServoOutUs, 1500)]);
    assert!(wrong.contradiction().is_some());
    assert_leads(&wrong, &Settings::new());
}

#[test]
fn any_settings_that_can_be_right_are_reached_from_any_others() {
    let mut random = ChaCha8Rng::seed_from_u64(1);
    let mut right = || {
        loop {
            let mut settings = Settings::new();
            for setting in Setting::all() {
                settings.set(setting, random.random_range(setting.least()..=setting.greatest())).unwrap();
            }
            if settings.contradiction().is_none() {
                return settings;
            }
        }
    };
    for _ in 0..200 {
        assert_leads(&right(), &right());
    }
}
