//! Properties of every machine within the ranges.

use approx::relative_eq;
use mechanics::design::Design;
use mechanics::equations as eq;
use mechanics::machine::{Input, Machine};
use mechanics::unit::{DEGREE, KG, KM_H, M, MM, MPA, NEWTON_METRE};
use proptest::prelude::*;
use std::fmt::Write;

/// A machine file. Each value is at this share of its range.
fn file(inputs: &[Input], shares: &[f64]) -> String {
    let mut file = String::new();
    for (input, share) in inputs.iter().zip(shares) {
        let value = input.least + share * (input.most - input.least);
        // Plain numbers may be counts.
        let value = if input.unit.is_empty() { value.round() } else { value };
        writeln!(file, "{}.{} = {}", input.section, input.key, Input { value, ..*input }.written()).unwrap();
    }
    file
}

/// Any machine without contradictions. Some values within the ranges contradict each other.
fn any_machine() -> impl Strategy<Value = Machine> {
    let inputs = Machine::default().inputs();
    prop::collection::vec(0.0..=1.0, inputs.len())
        .prop_map(move |shares| toml::from_str::<Machine>(&file(&inputs, &shares)).unwrap())
        .prop_filter("does not go together", |machine| machine.check().is_ok())
}

proptest! {
    #[test]
    fn values_within_their_ranges_are_never_called_out_of_them(share in 0.0..=1.0) {
        let inputs = Machine::default().inputs();
        let machine: Machine = toml::from_str(&file(&inputs, &vec![share; inputs.len()])).unwrap();
        let is_out_of_range = machine.check().is_err_and(|error| error.problem.contains("it has to be from"));
        prop_assert!(!is_out_of_range, "{:?}", machine.check());
    }

    #[test]
    fn every_figure_is_a_number_that_is_not_negative(machine in any_machine()) {
        for figure in Design::of(&machine).unwrap().figures(&machine) {
            prop_assert!(figure.value.is_finite() && figure.value >= 0.0, "{figure:?}");
            prop_assert!(!figure.sense.is_empty() && !figure.sense.contains("NaN"), "{figure:?}");
        }
    }

    #[test]
    fn a_heavier_machine_asks_more_of_engine_wheels_and_shanks(machine in any_machine(), more in 1.01..10.0_f64) {
        let mut heavier = machine;
        heavier.weeder.mass = KG.of(f64::min(KG.value(machine.weeder.mass) * more, 5000.0));
        prop_assume!(heavier.weeder.mass > machine.weeder.mass);
        let (light, heavy) = (Design::of(&machine).unwrap(), Design::of(&heavier).unwrap());
        prop_assert!(heavy.tractive_force > light.tractive_force);
        prop_assert!(heavy.engine_power > light.engine_power);
        prop_assert!(heavy.shear_stress > light.shear_stress);
        prop_assert!(heavy.inter_row_shank_diameter > light.inter_row_shank_diameter);
    }

    #[test]
    fn a_printed_machine_is_read_back_with_the_same_values(machine in any_machine()) {
        let read: Machine = toml::from_str(&machine.to_toml()).unwrap();
        for (read, printed) in read.inputs().iter().zip(machine.inputs()) {
            prop_assert!(relative_eq!(read.value, printed.value, max_relative = 1e-6), "{printed:?}");
        }
    }

    #[test]
    fn a_shank_of_the_least_diameter_bears_just_the_allowed_stress(moment in 0.1..1e5, stress in 1.0..2000.0) {
        let (moment, stress) = (NEWTON_METRE.of(moment), MPA.of(stress));
        let found = eq::bending_stress(moment, eq::rod_diameter(moment, stress));
        prop_assert!(relative_eq!(MPA.value(found), MPA.value(stress), max_relative = 1e-9));
    }

    #[test]
    fn a_wheel_of_the_least_thickness_bears_just_its_shear_strength(machine in any_machine()) {
        let design = Design::of(&machine).unwrap();
        let (diameter, strength) = (machine.wheel.diameter, machine.wheel.shear_strength);
        // Below, the difference of the diameters drowns in their rounding; at a half, the wheel is a disc.
        prop_assume!((1e-6..0.5).contains(&f64::from(design.least_rim_thickness / diameter)));
        let found = eq::shear_stress(design.wheel_torque, diameter, design.least_rim_thickness);
        prop_assert!(relative_eq!(MPA.value(found), MPA.value(strength), max_relative = 1e-6));
    }

    #[test]
    fn a_wheel_rolls_as_fast_as_it_is_turned_for(speed in 0.1..15.0, diameter in 0.05..3.0) {
        let found = eq::ground_speed(eq::wheel_speed(KM_H.of(speed), M.of(diameter)), M.of(diameter));
        prop_assert!(relative_eq!(KM_H.value(found), speed, max_relative = 1e-9));
    }

    #[test]
    fn apex_angle_and_friction_are_each_others_inverse(friction in 5.0..85.0) {
        let found = eq::weed_friction_for(eq::apex_angle(DEGREE.of(friction)));
        prop_assert!(relative_eq!(DEGREE.value(found), friction, max_relative = 1e-9));
    }

    #[test]
    fn a_chain_is_even_and_less_than_two_links_longer_than_it_has_to_be(links in 1.0..5000.0) {
        let even = eq::even_links(links);
        prop_assert!(even.is_multiple_of(2) && f64::from(even) >= links && f64::from(even) - links < 2.0);
    }

    #[test]
    fn deeper_weeding_asks_for_narrower_sweeps(depth in 1.0..200.0, more in 1.0..100.0, friction in 1.0..60.0) {
        let width = |depth| eq::sweep_width(M.of(1.0), MM.of(depth), DEGREE.of(friction));
        prop_assert!(width(depth + more) < width(depth));
    }
}
