//! The paper's printed figures, the results of its equations, and the verdict on each: a test for every row.

use approx::assert_relative_eq;
use mechanics::equations as eq;
use mechanics::paper::{Comparison, Verdict, compare};
use mechanics::unit::{DEGREE, HECTARE_PER_HOUR, KM_H, KPA, M, MM, MPA, NEWTON, NEWTON_METRE};

/// The only comparison of this name and unit.
#[track_caller]
fn comparison(name: &str, unit: &str) -> Comparison {
    let mut found = compare(None).unwrap();
    found.retain(|comparison| comparison.name == name && comparison.unit == unit);
    assert_eq!(found.len(), 1, "{name} in {unit}");
    found.remove(0)
}

/// Asserts a row: the printed value, the result from printed inputs, the result from the machine alone, and the
/// verdict. Numbers are compared to half of their last digit.
#[track_caller]
fn assert_row((name, unit): (&str, &str), printed: f64, from_printed_inputs: &str, calculated: &str, verdict: Verdict) {
    let row = comparison(name, unit);
    assert_eq!(row.printed, printed);
    for (value, expected) in [(row.from_printed_inputs, from_printed_inputs), (row.calculated, calculated)] {
        let decimals = expected.split_once('.').map_or(0, |(_, decimals)| decimals.len());
        assert_eq!(format!("{value:.decimals$}"), expected, "{name}");
    }
    assert_eq!(row.verdict, verdict, "{name}");
}

#[test]
fn the_rolling_resistance_coefficient_slipped_by_a_decimal_point() {
    assert_row(("rolling resistance coefficient", ""), 0.95, "0.0947", "0.0947", Verdict::Wrong);
}

#[test]
fn the_rolling_resistance_follows_from_its_coefficient() {
    assert_row(("rolling resistance", "N"), 605.77, "605.77", "60.36", Verdict::Follows);
}

#[test]
fn the_draft_is_right() {
    assert_row(("draft", "N"), 453.7, "453.71", "453.71", Verdict::Right);
}

#[test]
fn the_acceleration_force_is_right() {
    assert_row(("acceleration force", "N"), 23.0, "22.57", "22.57", Verdict::Right);
}

#[test]
fn the_tractive_force_is_twice_the_right_value() {
    assert_row(("tractive force", "N"), 1082.4, "1082.5", "536.6", Verdict::Follows);
}

#[test]
fn power_and_engine_follow_from_the_tractive_force() {
    assert_row(("power", "W"), 1503.3, "1503.3", "745.3", Verdict::Follows);
    assert_row(("engine", "hp"), 2.24, "2.24", "1.11", Verdict::Follows);
    assert!(comparison("engine", "hp").remark.ends_with("2.3 times too large"));
}

#[test]
fn soil_force_and_servo_torque_are_right() {
    assert_row(("soil force on the tool", "N"), 11.04, "11.036", "11.036", Verdict::Right);
    assert_row(("servo torque", "N m"), 3.86, "3.863", "3.863", Verdict::Right);
    assert_row(("servo torque", "kg cm"), 39.4, "39.39", "39.39", Verdict::Right);
}

#[test]
fn the_failure_zone_is_twice_as_wide_and_no_zone_gives_the_sweep() {
    assert_row(("soil failure zone", "cm"), 10.0, "20", "20", Verdict::Wrong);
    assert_row(("sweep width", "cm"), 8.0, "7.11", "17.11", Verdict::Wrong);
}

#[test]
fn the_apex_angle_belongs_to_another_friction_angle() {
    assert_row(("apex angle", "degrees"), 120.0, "80", "80", Verdict::Wrong);
    assert_relative_eq!(DEGREE.value(eq::weed_friction_for(DEGREE.of(120.0))), 30.0, epsilon = 1e-9);
    assert!(comparison("apex angle", "degrees").remark.contains("30 degrees"));
}

#[test]
fn as_many_tools_fit_as_are_printed() {
    assert_row(("number of tools", ""), 5.0, "5", "5", Verdict::Right);
}

#[test]
fn the_draft_of_one_tool_follows_from_the_tractive_force() {
    assert_row(("draft of one tool", "N"), 216.48, "216.48", "107.3", Verdict::Follows);
}

#[test]
fn the_shanks_are_less_than_half_as_thick_as_they_have_to_be() {
    assert_row(("bending moment, between rows", "N m"), 345.6, "345.6", "171.7", Verdict::Follows);
    assert_row(("bending moment, in the row", "N m"), 302.4, "302.4", "150.3", Verdict::Follows);
    assert_row(("shank diameter, between rows", "cm"), 1.6, "3.98", "3.15", Verdict::Wrong);
    assert_row(("shank diameter, in the row", "cm"), 1.4, "3.80", "3.01", Verdict::Wrong);
    for (moment, diameter_mm, stress) in [(345.6, 16.0, 859.4), (302.4, 14.0, 1122.5)] {
        let found = MPA.value(eq::bending_stress(NEWTON_METRE.of(moment), MM.of(diameter_mm)));
        assert_relative_eq!(found, stress, epsilon = 0.05);
    }
}

#[test]
fn wheel_speed_reduction_and_sprocket_are_right() {
    assert_row(("wheel speed", "rpm"), 33.17, "33.16", "33.16", Verdict::Right);
    assert_row(("reduction by the chain", ""), 2.72, "2.727", "2.714", Verdict::Right);
    assert_row(("driven sprocket", ""), 38.0, "38.2", "38.0", Verdict::Right);
}

#[test]
fn chain_links_and_length_are_right() {
    let links = eq::chain_links(14, 38, MM.of(379.0), MM.of(12.7));
    assert_relative_eq!(links, 86.17, epsilon = 0.005);
    assert_row(("chain links", ""), 88.0, "88", "88", Verdict::Right);
    assert_row(("chain length", "mm"), 1118.0, "1117.6", "1117.6", Verdict::Right);
}

#[test]
fn the_wheel_thickness_was_not_halved() {
    assert_row(("wheel thickness", "mm"), 3.0, "1.5", "1.5", Verdict::Wrong);
}

#[test]
fn the_shear_stress_is_right_for_the_printed_force_and_three_millimetres() {
    assert_row(("shear stress in the wheel", "kPa"), 293.5, "293.5", "145.6", Verdict::Follows);
    let torque = eq::wheel_torque(NEWTON.of(1082.0), M.of(0.4));
    for (thickness_mm, stress_kpa) in [(3.0, 293.5), (1.5, 580.5)] {
        let stress = eq::shear_stress(torque, M.of(0.4), MM.of(thickness_mm));
        assert_relative_eq!(KPA.value(stress), stress_kpa, epsilon = 0.05);
    }
}

#[test]
fn the_handle_is_right() {
    assert_row(("slope of the handle", "degrees"), 63.43, "63.43", "63.43", Verdict::Right);
    assert_row(("length of the handle", "cm"), 89.44, "89.44", "89.44", Verdict::Right);
}

#[test]
fn the_field_capacity_is_less_than_half_of_speed_times_width() {
    let theoretical = HECTARE_PER_HOUR.value(KM_H.of(2.5) * M.of(0.4));
    assert_relative_eq!(theoretical, 0.1, epsilon = 1e-9);
    assert_row(("field capacity at 86.25 %", "ha/h"), 0.041, "0.08625", "0.08625", Verdict::Wrong);
}
