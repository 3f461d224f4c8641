//! The paper's printed figures, the results of its equations, and the verdict on each.

use approx::assert_relative_eq;
use mechanics::equations as eq;
use mechanics::paper::Verdict::{self, Follows, Right, Wrong};
use mechanics::paper::compare;
use mechanics::unit::{DEGREE, HECTARE_PER_HOUR, KM_H, KPA, M, MM, MPA, NEWTON, NEWTON_METRE};

/// Name and unit, the printed value, the result from printed inputs, the result from the machine alone, and the verdict.
type Row = (&'static str, &'static str, f64, &'static str, &'static str, Verdict);

const ROWS: [Row; 29] = [
    ("rolling resistance coefficient", "", 0.95, "0.0947", "0.0947", Wrong),
    ("rolling resistance", "N", 605.77, "605.77", "60.36", Follows),
    ("draft", "N", 453.7, "453.71", "453.71", Right),
    ("acceleration force", "N", 23.0, "22.57", "22.57", Right),
    ("tractive force", "N", 1082.4, "1082.5", "536.6", Follows),
    ("power", "W", 1503.3, "1503.3", "745.3", Follows),
    ("engine", "hp", 2.24, "2.24", "1.11", Follows),
    ("soil force on the tool", "N", 11.04, "11.036", "11.036", Right),
    ("servo torque", "N m", 3.86, "3.863", "3.863", Right),
    ("servo torque", "kg cm", 39.4, "39.39", "39.39", Right),
    ("soil failure zone", "cm", 10.0, "20", "20", Wrong),
    ("sweep width", "cm", 8.0, "7.11", "17.11", Wrong),
    ("apex angle", "degrees", 120.0, "80", "80", Wrong),
    ("number of tools", "", 5.0, "5", "5", Right),
    ("draft of one tool", "N", 216.48, "216.48", "107.3", Follows),
    ("bending moment, between rows", "N m", 345.6, "345.6", "171.7", Follows),
    ("bending moment, in the row", "N m", 302.4, "302.4", "150.3", Follows),
    ("shank diameter, between rows", "cm", 1.6, "3.98", "3.15", Wrong),
    ("shank diameter, in the row", "cm", 1.4, "3.80", "3.01", Wrong),
    ("wheel speed", "rpm", 33.17, "33.16", "33.16", Right),
    ("reduction by the chain", "", 2.72, "2.727", "2.714", Right),
    ("driven sprocket", "", 38.0, "38.2", "38.0", Right),
    ("chain links", "", 88.0, "88", "88", Right),
    ("chain length", "mm", 1118.0, "1117.6", "1117.6", Right),
    ("wheel thickness", "mm", 3.0, "1.5", "1.5", Wrong),
    ("shear stress in the wheel", "kPa", 293.5, "293.5", "145.6", Follows),
    ("slope of the handle", "degrees", 63.43, "63.43", "63.43", Right),
    ("length of the handle", "cm", 89.44, "89.44", "89.44", Right),
    ("field capacity at 86.25 %", "ha/h", 0.041, "0.08625", "0.08625", Wrong),
];

/// Results are compared to half of their last digit.
#[test]
fn every_printed_figure_has_its_results_and_its_verdict() {
    let found = compare(None).unwrap();
    assert_eq!(found.len(), ROWS.len());
    for (row, (name, unit, printed, from_printed_inputs, calculated, verdict)) in found.iter().zip(ROWS) {
        assert_eq!((row.name, row.unit, row.printed, row.verdict), (name, unit, printed, verdict));
        for (value, expected) in [(row.from_printed_inputs, from_printed_inputs), (row.calculated, calculated)] {
            let decimals = expected.split_once('.').map_or(0, |(_, decimals)| decimals.len());
            assert_eq!(format!("{value:.decimals$}"), expected, "{name}");
        }
    }
    let remark = |name: &str| found.iter().find(|row| row.name == name).unwrap().remark.as_str();
    assert!(remark("engine").ends_with("2.3 times too large"));
    assert!(remark("apex angle").contains("30 degrees"));
}

#[test]
fn the_equations_give_the_values_that_the_remarks_name() {
    assert_relative_eq!(DEGREE.value(eq::weed_friction_for(DEGREE.of(120.0))), 30.0, epsilon = 1e-9);
    for (moment, diameter_mm, stress) in [(345.6, 16.0, 859.4), (302.4, 14.0, 1122.5)] {
        let found = MPA.value(eq::bending_stress(NEWTON_METRE.of(moment), MM.of(diameter_mm)));
        assert_relative_eq!(found, stress, epsilon = 0.05);
    }
    assert_relative_eq!(eq::chain_links(14, 38, MM.of(379.0), MM.of(12.7)), 86.17, epsilon = 0.005);
    let torque = eq::wheel_torque(NEWTON.of(1082.0), M.of(0.4));
    for (thickness_mm, stress_kpa) in [(3.0, 293.5), (1.5, 580.5)] {
        let stress = eq::shear_stress(torque, M.of(0.4), MM.of(thickness_mm));
        assert_relative_eq!(KPA.value(stress), stress_kpa, epsilon = 0.05);
    }
    assert_relative_eq!(HECTARE_PER_HOUR.value(KM_H.of(2.5) * M.of(0.4)), 0.1, epsilon = 1e-9);
}
