//! The paper's Eq. 1 to 3 in integers, over every machine that the settings allow.

use control::{
    schedule::Plan,
    units::{Ticks, Wheel},
};
use proptest::prelude::*;
use std::f64::consts::PI;

fn wheels() -> impl Strategy<Value = Wheel> {
    let ticks_per_m = prop_oneof![Just(0), 40_u16..=20_000];
    (100_u16..=10_000, 200_u16..=800, ticks_per_m).prop_map(|(ticks_per_rev, diameter_mm, ticks_per_m)| Wheel {
        ticks_per_rev,
        diameter_mm,
        ticks_per_m,
    })
}

fn ticks_a_metre(wheel: Wheel) -> f64 {
    if wheel.ticks_per_m != 0 {
        return f64::from(wheel.ticks_per_m);
    }
    f64::from(wheel.ticks_per_rev) / (PI * f64::from(wheel.diameter_mm) / 1000.0)
}

proptest! {
    #![proptest_config(ProptestConfig { cases: 20_000, failure_persistence: None, ..ProptestConfig::default() })]

    #[test]
    fn delay_hold_and_actuation_are_within_a_tick_of_the_equations(
        wheel in wheels(),
        distance_mm in 100_u16..=2000,
        width in 0_i32..20_000,
    ) {
        const MARGIN_MM: u16 = 50;
        let plan = Plan::new(wheel, distance_mm, MARGIN_MM, Ticks(width));
        let scale = ticks_a_metre(wheel);
        let delay = (f64::from(distance_mm) / 1000.0 - 0.05) * scale;
        let hold = f64::from(width) + 0.1 * scale;
        prop_assert!((f64::from(plan.delay.0) - delay).abs() <= 1.0, "Y is {:?}, not {delay}", plan.delay);
        prop_assert!((f64::from(plan.hold.0) - hold).abs() <= 1.0, "Z is {:?}, not {hold}", plan.hold);
        let actuation = f64::from(plan.actuation().0);
        prop_assert!((actuation - delay - hold).abs() <= 1.001, "R is {actuation}, not {}", delay + hold);
    }

    #[test]
    fn millimetres_become_the_nearest_tick(wheel in wheels(), millimetres in 0_u16..=3700) {
        let exact = f64::from(millimetres) / 1000.0 * ticks_a_metre(wheel);
        let ticks = f64::from(wheel.ticks(millimetres).0);
        prop_assert!((ticks - exact).abs() <= 0.51, "{ticks} is not {exact}");
    }

    #[test]
    fn ticks_become_millimetres_within_one(wheel in wheels(), ticks in -40_000_i32..40_000) {
        let exact = (f64::from(ticks) / ticks_a_metre(wheel) * 1000.0).clamp(-32_767.0, 32_767.0);
        let millimetres = f64::from(wheel.millimetres(Ticks(ticks)));
        prop_assert!((millimetres - exact).abs() <= 1.0 + exact.abs() / 5_000.0, "{millimetres} is not {exact}");
    }
}

#[test]
fn the_default_machine_has_the_papers_figures() {
    let wheel = Wheel { ticks_per_rev: 2400, diameter_mm: 400, ticks_per_m: 0 };
    // (0.4 m - 0.05 m) * 1909.86; 0.1 m * 1909.86 on top of the canopy.
    let plan = Plan::new(wheel, 400, 50, Ticks(286));
    assert_eq!((plan.delay, plan.hold, plan.actuation()), (Ticks(668), Ticks(477), Ticks(1145)));
}
