//! The paper's Eq. 1 to 3 in integers, for each machine that the settings allow.

use control::{
    ground::{keep_out::Plan, reach::Geometry},
    settings::{Setting, Settings},
    units::{Length, Ticks},
};
use proptest::prelude::*;
use std::f64::consts::PI;

/// Settings of any wheel, nominal or calibrated, and X.
fn machines() -> impl Strategy<Value = Settings> {
    let ticks_per_m = prop_oneof![Just(0), 40_u16..=20_000];
    (600_u16..=10_000, 200_u16..=800, ticks_per_m, 100_u16..=2000).prop_map(
        |(ticks_per_rev, wheel_mm, ticks_per_m, beam_to_tool_mm)| {
            let mut settings = Settings::new();
            for (setting, value) in [
                (Setting::TicksPerRev, ticks_per_rev),
                (Setting::WheelMm, wheel_mm),
                (Setting::TicksPerM, ticks_per_m),
                (Setting::BeamToToolMm, beam_to_tool_mm),
            ] {
                settings.set(setting, value).expect("within its range");
            }
            settings
        },
    )
}

fn ticks_a_metre(settings: &Settings) -> f64 {
    let get = |setting| f64::from(settings.get(setting));
    if get(Setting::TicksPerM) != 0.0 {
        return get(Setting::TicksPerM);
    }
    get(Setting::TicksPerRev) / (PI * get(Setting::WheelMm) / 1000.0)
}

proptest! {
    #![proptest_config(ProptestConfig { cases: 20_000, failure_persistence: None, ..ProptestConfig::default() })]

    #[test]
    fn delay_hold_and_actuation_are_within_two_units_of_the_equations(settings in machines(), width in 0_i16..4000) {
        let geometry = Geometry::of(&settings, 0);
        let unit = f64::from(geometry.scale.ticks(Length(1)).0);
        let plan = Plan::new(&geometry, Length(width));
        let scale = ticks_a_metre(&settings);
        let delay = (f64::from(settings.get(Setting::BeamToToolMm)) / 1000.0 - 0.05) * scale;
        let hold = f64::from(width) * unit + 0.1 * scale;
        // Each distance is rounded to a tick, known to 2^-20 mm, and down to a unit if that is coarser.
        let most = if unit > 1.0 { 2.0 * unit } else { 1.0 } + 0.05;
        prop_assert!((f64::from(plan.delay.0) - delay).abs() <= most, "Y is {:?}, not {delay}", plan.delay);
        prop_assert!((f64::from(plan.hold.0) - hold).abs() <= most, "Z is {:?}, not {hold}", plan.hold);
        let actuation = f64::from(plan.actuation().0);
        prop_assert!((actuation - delay - hold).abs() <= 2.0 * most, "R is {actuation}, not {}", delay + hold);
    }

    #[test]
    fn millimetres_become_the_nearest_tick(settings in machines(), millimetres in 0_u16..=4000) {
        let exact = f64::from(millimetres) / 1000.0 * ticks_a_metre(&settings);
        let ticks = f64::from(settings.wheel().ticks(millimetres).0);
        // A tick's length is known to 2^-20 mm, 1 in 50,000 for the finest.
        prop_assert!((ticks - exact).abs() <= 0.51 + exact / 50_000.0, "{ticks} is not {exact}");
    }

    #[test]
    fn ticks_become_millimetres_within_one(settings in machines(), ticks in -40_000_i32..40_000) {
        let exact = (f64::from(ticks) / ticks_a_metre(&settings) * 1000.0).clamp(-32_767.0, 32_767.0);
        let millimetres = f64::from(settings.wheel().millimetres(Ticks(ticks)));
        prop_assert!((millimetres - exact).abs() <= 1.0 + exact.abs() / 3_000.0, "{millimetres} is not {exact}");
    }
}

#[test]
fn the_default_machine_has_the_papers_figures() {
    // (0.4 m - 0.05 m) * 1909.86; 0.1 m * 1909.86 plus the canopy; each within a tick.
    let plan = Plan::new(&Geometry::of(&Settings::new(), 0), Length(286));
    assert_eq!((plan.delay, plan.hold, plan.actuation()), (Ticks(669), Ticks(476), Ticks(1145)));
}
