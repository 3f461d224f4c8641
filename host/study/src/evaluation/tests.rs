//! Tests of the evaluation: the equations, impossible values, and means of treatments.

use super::*;
use crate::sweep::SPEEDS_KM_H;
use field::conditions::PARAMETERS;

/// A plot whose measures are round numbers.
pub const PLOT: PlotRecord = PlotRecord {
    plot: 0,
    replication: 1,
    speed_km_h: 1.5,
    spacing_cm: 50.0,
    weeds_before: Some(200),
    weeds_after: Some(30),
    plants: Some(50),
    damaged: Some(1),
    area_m2: Some(24.0),
    time_s: Some(180.0),
    width_m: Some(0.4),
    power_hp: Some(2.5),
};

#[test]
fn a_plot_is_evaluated_by_the_paper_s_equations() {
    let plot = PLOT.performance();
    let close = |value: Option<f64>, expected: f64| {
        assert!((value.unwrap() - expected).abs() < 1e-9, "{value:?} is not {expected}")
    };
    close(plot.plant_damage_percent, 2.0);
    close(plot.weeding_efficiency_percent, 85.0);
    close(plot.theoretical_capacity_ha_h, 0.06);
    close(plot.effective_capacity_ha_h, 0.048);
    close(plot.field_efficiency_percent, 80.0);
    // 0.048 ha/h * 98 % * 85 % / 2.5 hp
    close(plot.performance_index, 159.936);
}

#[test]
fn a_plot_that_cannot_be_is_named_with_its_place_and_column() {
    let wrong = |change: fn(&mut PlotRecord)| {
        let mut plot = PLOT;
        change(&mut plot);
        Analysis::of(vec![PLOT, plot]).err().map(|error| error.to_string()).unwrap_or_default()
    };
    assert_eq!(wrong(|plot| plot.damaged = Some(51)), "plot 2: damaged is 51: it cannot exceed plants");
    let nan = "plot 2: time_s is NaN: it has to be from 0.1 to 1000000000 s";
    assert_eq!(wrong(|plot| plot.time_s = Some(f64::NAN)), nan);
    assert_eq!(Analysis::of(Vec::new()).unwrap_err().to_string(), "a trial has at least one plot");
    let blank =
        |time_s| PlotRecord { weeds_before: None, weeds_after: None, plants: None, damaged: None, time_s, ..PLOT };
    let error = Analysis::of(vec![blank(None)]).unwrap_err().to_string();
    assert_eq!(error, "1 of 1 plots are not filled in: enter what was counted");
    assert!(Analysis::of(vec![blank(Some(180.0))]).is_ok(), "a log fills in the time");
}

#[test]
fn the_largest_and_slowest_simulated_plot_is_in_the_ranges() {
    let greatest = |name: &str| PARAMETERS.iter().find(|parameter| parameter.name == name).unwrap().greatest;
    let (rows, row_m) = (greatest("plot.rows"), greatest("plot.row_m"));
    let slowest_m_s = SPEEDS_KM_H.0 / 3.6 * (1.0 - greatest("driving.speed_scatter_percent") / 100.0);
    let turns_s = rows * (greatest("driving.turn_m") / slowest_m_s + greatest("driving.turn_s"));
    let stops_s = rows * row_m / 100.0 * greatest("driving.stops_per_100_m") * greatest("driving.stop_s");
    let area_m2 = Some(rows * row_m * greatest("plot.row_spacing_mm") / 1000.0);
    let time_s = Some(rows * row_m / slowest_m_s + turns_s + stops_s);
    PlotRecord { area_m2, time_s, ..PLOT }.check().unwrap();
}

#[test]
fn rounding_alone_is_not_more_ground_than_speed_and_width_allow() {
    // In this time, 30 square metres are a field efficiency of 100 %.
    let is_told = |area_m2| {
        let plot = PlotRecord { area_m2: Some(area_m2), ..PLOT };
        Analysis::of(vec![plot]).unwrap().findings().iter().any(|said| said.contains("more ground was covered"))
    };
    assert_eq!([30.0, 30.01, 31.0].map(is_told), [false, false, true]);
}

#[test]
fn a_treatment_has_the_means_of_its_plots() {
    let second = PlotRecord { replication: 2, damaged: Some(3), ..PLOT };
    let slow = PlotRecord { speed_km_h: 1.0, ..PLOT };
    let treatments = Analysis::of(vec![PLOT, second, slow]).unwrap().treatments();
    let found: Vec<_> = treatments.iter().map(|treatment| (treatment.speed_km_h, treatment.plots)).collect();
    assert_eq!(found, [(1.0, 1), (1.5, 2)]);
    assert!((treatments[1].mean.plant_damage_percent.unwrap() - 4.0).abs() < 1e-12);
}

#[test]
fn a_small_share_of_damaged_plants_does_not_read_as_0() {
    let plot = PlotRecord { plants: Some(25_000), ..PLOT };
    let findings = Analysis::of(vec![plot]).unwrap().findings();
    let said =
        "1 of 25000 plants were damaged: 0.0040 %, two-sided 95 % interval 0.00010 to 0.023 %. At most 0.0040 % in";
    assert!(findings[1].starts_with(said), "{findings:?}");
}

#[test]
fn a_small_effect_does_not_read_as_0() {
    let plots = (0..8).map(|number| PlotRecord {
        plot: 1 + number,
        speed_km_h: f64::from(1 + number % 4),
        replication: 1 + number / 4,
        plants: Some(3_660_000),
        damaged: Some(1 + 2 * (number % 4) + number / 6),
        ..PLOT
    });
    let mut analysis = Analysis::of(plots.collect()).unwrap();
    let finding = &analysis.findings()[2];
    assert!(finding.starts_with("Plant damage rises by 0.000060 points for each km/h (p < 0.0001)"), "{finding}");
    let damage = &mut analysis.responses[0];
    assert_eq!(damage.fit().rows[4][1], "0.000027 to 0.00022");
    let sum_of_squares = &damage.variance.as_ref().unwrap().table().rows[1][2];
    assert!(sum_of_squares.starts_with("0.00000"), "{sum_of_squares}");
    assert!(sum_of_squares.bytes().any(|digit| digit > b'0'), "{sum_of_squares}");
    damage.published.text.per_km_h = Some(0.01);
    let against = &analysis.against_the_paper()[0];
    assert!(against.starts_with("Plant damage changes by +0.000060 ± 0.0000"), "{against}");
    let [plots, means] = [analysis.plots(), analysis.means()].map(|table| table.to_string());
    assert!(plots.contains(" 0.000027 ") && means.contains("0.000027"), "{plots}\n{means}");
}

#[test]
fn the_plots_without_a_measure_are_not_said_to_have_its_speed() {
    let fast = PlotRecord { speed_km_h: 2.0, plants: Some(0), damaged: Some(0), ..PLOT };
    let second = PlotRecord { replication: 2, damaged: Some(3), ..PLOT };
    let findings = Analysis::of(vec![PLOT, second, fast]).unwrap().findings();
    let said = "Plant damage has no model: all plots with this measure have the same speed and spacing:";
    assert!(findings.iter().any(|finding| finding.starts_with(said)), "{findings:?}");
}

#[test]
fn a_factor_of_the_odds_does_not_read_as_0() {
    let shown = [1e-9, 0.000_002_17, 0.004, 4.488, 1e7].map(|odds| report::times(odds, 2));
    assert_eq!(shown, ["< 0.000001", "0.0000022", "0.0040", "4.49", "> 1000000"]);
}

#[test]
fn only_slopes_by_speed_that_the_trial_has_are_compared_with_the_paper_s() {
    // Damage and weeding scatter around the paper's slopes, at these speeds.
    let trial = |speeds_km_h: &[f64], damaged: &[u32]| {
        let plots = speeds_km_h.iter().zip(damaged).zip(0..).map(|((&speed_km_h, &damaged), number)| PlotRecord {
            speed_km_h,
            replication: 1 + number,
            plants: Some(1000),
            damaged: Some(damaged),
            weeds_after: Some(30 + 10 * speed_km_h as u32 + number % 3),
            area_m2: None,
            ..PLOT
        });
        Analysis::of(plots.collect()).unwrap().against_the_paper()
    };
    let speeds = [1.0, 2.0, 3.0, 4.0, 1.0, 2.0, 3.0, 4.0];
    assert_eq!(trial(&[2.0; 8], &[3, 5, 4, 6, 2, 7, 3, 5]), [""; 0]);
    let none = "No slope by speed is shown to differ from the paper's: each 95 % interval contains the paper's slope. Compared: ";
    let without = "Not compared, because this trial has no such slope: ";
    let said = trial(&speeds, &[10, 23, 34, 48, 12, 22, 37, 47]);
    let without_area = format!("{without}performance index and field efficiency.");
    assert_eq!(said, [format!("{none}plant damage and weeding efficiency."), without_area]);
    let said = trial(&speeds, &[0; 8]);
    let without_damage = format!("{without}plant damage, performance index and field efficiency.");
    assert_eq!(said, [format!("{none}weeding efficiency."), without_damage]);
}
