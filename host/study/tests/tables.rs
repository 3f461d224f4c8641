//! Tables as people hand them in: spreadsheets' habits, plots that went wrong, speeds as measured. The figures are those
//! of statsmodels 0.15.0 with numpy 2.4.6 and scipy, for the same files.

use rand::SeedableRng;
use rand::seq::SliceRandom;
use rand_chacha::ChaCha8Rng;
use std::path::{Path, PathBuf};
use study::evaluation::{Analysis, PlotRecord, read_csv};
use study::statistics::{BinomialModel, NoModel, Remark};

fn table(name: &str) -> PathBuf {
    Path::new(env!("CARGO_MANIFEST_DIR")).join("tests/tables").join(name)
}

fn plots(name: &str) -> Vec<PlotRecord> {
    read_csv(&table(name)).unwrap()
}

fn example() -> Vec<PlotRecord> {
    read_csv(&table("../../../../docs/trial-example.csv")).unwrap()
}

fn judged(name: &str) -> Analysis {
    Analysis::of(plots(name)).unwrap()
}

/// Asserts that a figure is the other program's to nine digits.
#[track_caller]
fn assert_close(ours: f64, expected: f64) {
    assert!((ours / expected - 1.0).abs() <= 1e-9, "{ours} is not {expected}");
}

#[track_caller]
fn assert_found(analysis: &Analysis, words: &str) {
    let findings = analysis.findings();
    assert!(findings.iter().any(|finding| finding.contains(words)), "{words:?} is not in {findings:#?}");
}

/// `ols` of `y ~ 1`, `C(b)`, `+ C(s)`, `+ C(c)`, `C(b) + C(s)*C(c)`: differences of `ssr`.
#[test]
fn six_blocks_have_the_sums_of_squares_of_statsmodels() {
    let analysis = judged("six-replications.csv");
    let [damage, weeding] = [0, 1].map(|response| analysis.responses[response].variance.as_ref().unwrap());
    for (source, expected) in damage.sources.iter().zip([
        27.654582278025146,
        827.3213448259353,
        65.73474020741284,
        18.141905063252835,
        150.73457948423314,
    ]) {
        assert_close(source.sum_of_squares, expected);
    }
    assert_close(damage.sources[3].f.unwrap(), 1.4041606099642339);
    assert_close(damage.sources[3].p.unwrap(), 0.25789438593179914);
    assert_close(weeding.sources[3].sum_of_squares, 2.5966150284419456);
    assert_close(weeding.sources[4].sum_of_squares, 98.31751311988378);
}

fn odds(analysis: &Analysis, response: usize) -> &BinomialModel {
    analysis.responses[response].binomial.as_ref().unwrap().as_ref().unwrap()
}

/// `GLM(counts, X, family=Binomial()).fit(tol=1e-14)`; `pearson_chi2 / df_resid`; errors times its root; `scipy.stats.t`.
#[test]
fn plots_that_scatter_by_more_than_counting_have_no_chance_finding() {
    let analysis = judged("overdispersed-no-effect.csv");
    let model = odds(&analysis, 0);
    let speed = model.term("speed").unwrap();
    assert_close(model.dispersion, 11.273470889275163);
    assert_close(speed.estimate, 0.5563502173735719);
    assert_close(speed.standard_error, 0.5348103424128385);
    assert_close(speed.statistic, 1.0402757262762619);
    assert_close(speed.p, 0.31004136042043634);
    assert_close(speed.odds_interval.0, 0.5735852097340075);
    assert_close(speed.odds_interval.1, 5.30446654378416);
    assert!(!analysis.findings().iter().any(|finding| finding.contains("the odds that")), "{:#?}", analysis.findings());
}

/// As above, without the dispersion, which is below 1. The errors are the roots of the diagonal of the inverse of X'WX at the
/// estimates, by numpy: statsmodels takes them a step before.
#[test]
fn the_order_of_the_rows_changes_no_figure() {
    let mut rows = example();
    let mut chance = ChaCha8Rng::seed_from_u64(39);
    for _ in 0..200 {
        rows.shuffle(&mut chance);
        let analysis = Analysis::of(rows.clone()).unwrap();
        let model = odds(&analysis, 1);
        for (term, (estimate, error)) in model.terms.iter().zip([
            (1.8238366131096013, 0.4633487678364513),
            (-0.3237390128734988, 0.07462444930803461),
            (0.008523633560180337, 0.008178068547206005),
        ]) {
            assert_close(term.estimate, estimate);
            assert_close(term.standard_error, error);
        }
        assert_close(model.deviance, 3.043355186309799);
        let sources = &analysis.responses[1].variance.as_ref().unwrap().sources;
        assert_close(sources[3].f.unwrap(), 2.223898965515338);
        assert_close(odds(&analysis, 0).terms[1].estimate, 1.500865810502619);
    }
}

#[test]
fn measured_speeds_get_no_analysis_but_advice_that_works() {
    let plots = plots("speeds-as-measured.csv");
    let analysis = Analysis::of(plots.clone()).unwrap();
    for response in &analysis.responses[1..] {
        assert!(matches!(response.variance, Err(NoModel::TooFewPlots { .. })), "{:?}", response.variance);
    }
    assert_found(&analysis, "If they were measured at 1, 1.5, 2 and 2.5 km/h, add --speeds 1,1.5,2,2.5:");
    let nominal = Analysis::at_speeds(plots.clone(), &[1.0, 1.5, 2.0, 2.5]).unwrap();
    let sources = &nominal.responses[1].variance.as_ref().unwrap().sources;
    assert_close(sources[1].sum_of_squares, 130.11734889390425);
    assert_close(sources[4].sum_of_squares, 6.959020821510857);
    assert_eq!(nominal.treatments().len(), 8);
    let slopes = [&analysis, &nominal].map(|of| of.responses[1].model.as_ref().unwrap().terms[1].estimate);
    assert_eq!(slopes[0], slopes[1], "the model keeps the measured speeds");
    assert!(!nominal.findings().iter().any(|finding| finding.contains("--speeds")), "{:#?}", nominal.findings());
    let error = Analysis::at_speeds(plots, &[1.0]).unwrap_err().to_string();
    assert!(error.starts_with("plot 3: its speed, 1.54 km/h, is far from 1 km/h"), "{error}");
    // A trial that repeats no treatment has set speeds, so nothing is offered.
    let once: Vec<PlotRecord> = example().into_iter().filter(|plot| plot.replication == 1).collect();
    assert!(!Analysis::of(once).unwrap().findings().iter().any(|finding| finding.contains("--speeds")));
}

/// `ols('y ~ spacing')`, and `GLM` with the dispersion, as above.
#[test]
fn plots_measured_at_one_nominal_speed_have_no_slope_by_speed() {
    let plots = plots("one-speed-as-measured.csv");
    let analysis = Analysis::at_speeds(plots.clone(), &[2.0]).unwrap();
    let weeding = analysis.responses[1].model.as_ref().unwrap();
    assert_eq!(weeding.remarks, [Remark::OneSpeed]);
    for (term, (name, estimate, error)) in
        weeding.terms.iter().zip([("constant", 87.0, 19.18088240931579), ("spacing", -0.025, 0.347311099736245)])
    {
        assert_eq!(term.name, name);
        assert_close(term.estimate, estimate);
        assert_close(term.standard_error, error);
    }
    let damage = odds(&analysis, 0);
    assert_close(damage.dispersion, 2.4775919732441394);
    assert_close(damage.terms[1].estimate, -0.05280674302004962);
    assert_close(damage.terms[1].standard_error, 0.11679480568628686);
    // Without the nominal speed, the odds for each km/h have a hundred digits.
    let analysis = Analysis::of(plots).unwrap();
    assert!(odds(&analysis, 0).terms.iter().all(|term| term.odds_interval.1.is_finite()));
    let text = analysis.to_string();
    assert!(text.contains("> 1000000 (") && !text.contains(&"0".repeat(20)), "{text}");
}

#[test]
fn one_plot_says_nothing_about_speed_and_spacing() {
    let analysis = Analysis::of(example()[..1].to_vec()).unwrap();
    assert_eq!(analysis.records[0].damaged, Some(0));
    for of in &analysis.responses {
        assert_eq!(of.model.as_ref().err(), Some(&NoModel::OneTreatment));
        assert_eq!(of.variance.as_ref().err(), Some(&NoModel::OneTreatment));
        assert!(of.binomial.as_ref().is_none_or(|model| *model == Err(NoModel::OneTreatment)));
    }
}

#[test]
fn a_replication_occurs_once_at_a_nominal_speed() {
    let plot = |(replication, speed_km_h)| PlotRecord { plot: 0, replication, speed_km_h, ..example()[0] };
    let plots: Vec<PlotRecord> = [(1, 1.02), (2, 1.01), (1, 2.02), (1, 0.99)].map(plot).into_iter().collect();
    assert!(Analysis::of(plots.clone()).is_ok());
    let error = Analysis::at_speeds(plots, &[1.0, 2.0]).unwrap_err().to_string();
    let expected = "plots 1 and 4 are both replication 1 of 1 km/h and 50 cm: each plot needs its own replication";
    assert_eq!(error, expected);
}

/// `100 * scipy.stats.beta.ppf([0.025, 0.975], [1, 2], [1206, 1205])`.
#[test]
fn the_damage_of_a_treatment_is_of_all_its_plants_and_in_its_interval() {
    let plot = |(replication, plants, damaged)| PlotRecord {
        replication,
        plants: Some(plants),
        damaged: Some(damaged),
        ..example()[0]
    };
    let analysis = Analysis::of([(1, 6, 1), (2, 600, 0), (3, 600, 0)].map(plot).to_vec()).unwrap();
    let damaged = analysis.treatments()[0].damaged;
    assert_eq!((damaged.count, damaged.of), (1, 1206));
    assert_eq!(analysis.treatments()[0].mean.plant_damage_percent, damaged.percent(), "the chart shows it");
    assert_close(damaged.least_percent, 0.0020992986927988416);
    assert_close(damaged.greatest_percent, 0.4611189473301202);
    let text = analysis.to_string();
    assert!(text.contains(&format!(" {} ({damaged})", damaged.shown())), "{text}");
    let uncounted = Analysis::of(vec![PlotRecord { damaged: None, ..example()[0] }]).unwrap().to_string();
    assert!(uncounted.contains(" \u{2013} (none counted)"), "{uncounted}");
}

/// `ols('y ~ speed + spacing')` with `y = 100 * (1 - after / before)`: one is -15 %.
#[test]
fn more_weeds_after_than_before_are_a_negative_efficiency() {
    let analysis = judged("more-weeds-after.csv");
    assert_close(analysis.records[4].performance().weeding_efficiency_percent.unwrap(), -15.0);
    let more =
        |plot: PlotRecord| PlotRecord { weeds_after: plot.weeds_before.map(|before| before + plot.plot), ..plot };
    let none_gone = Analysis::of(example().into_iter().map(more).collect()).unwrap();
    assert_eq!(none_gone.responses[1].binomial, Some(Err(NoModel::NothingCounted)));
    let model = analysis.responses[1].model.as_ref().unwrap();
    for (term, (estimate, p)) in model.terms.iter().zip([
        (43.89226839599138, 0.37055806637367183),
        (-7.362098571781809, 0.33583673754383614),
        (0.9030750721002754, 0.2920869755725763),
    ]) {
        assert_close(term.estimate, estimate);
        assert_close(term.p.unwrap(), p);
    }
    assert_found(
        &analysis,
        "Plot 5: more weeds were counted after weeding than before. The weeding efficiency is negative",
    );
}

/// The same, and `GLM`, without the plot; damage with all plots.
#[test]
fn a_plot_without_a_count_takes_part_in_what_it_has() {
    let analysis = judged("one-plot-not-counted.csv");
    let [damage, weeding, index, capacity] = &analysis.responses[..] else { panic!() };
    assert_eq!([damage, weeding, index, capacity].map(|of| of.plots.len()), [24, 23, 23, 24]);
    assert_close(weeding.model.as_ref().unwrap().terms[1].estimate, -4.084233439398616);
    assert_close(weeding.model.as_ref().unwrap().r_squared, 0.8946086027910255);
    assert_close(odds(&analysis, 1).terms[1].standard_error, 0.07505525068397702);
    assert_close(damage.model.as_ref().unwrap().terms[1].estimate, 1.291713747645951);
    let sources = &weeding.variance.as_ref().unwrap().sources;
    assert_close(sources[3].p.unwrap(), 0.2200052848203948);
    assert_close(sources[4].sum_of_squares, 6.321832002096015);
    assert_found(
        &analysis,
        "Plot 5 (no weeds_before and no weeds_after) takes no part in weeding efficiency and performance index.",
    );
    assert!(analysis.to_string().contains(" (2 plots) "), "{analysis}");
}

#[test]
fn a_plot_without_weeds_or_plants_takes_part_in_the_rest() {
    let mut plots = example();
    (plots[2].weeds_before, plots[2].weeds_after) = (Some(0), Some(5));
    (plots[6].plants, plots[6].damaged) = (Some(0), Some(0));
    let analysis = Analysis::of(plots).unwrap();
    assert_eq!(analysis.responses.iter().map(|of| of.plots.len()).collect::<Vec<_>>(), [23, 23, 22, 24]);
    assert_found(
        &analysis,
        "Plot 3 (no weed before weeding) takes no part in weeding efficiency and performance index.",
    );
    assert_found(&analysis, "Plot 7 (no plant) takes no part in plant damage and performance index.");
    assert!(!analysis.findings().iter().any(|finding| finding.contains("more weeds")), "{:#?}", analysis.findings());
    let none = example().into_iter().map(|plot| PlotRecord { weeds_after: None, ..plot });
    let analysis = Analysis::of(none.collect()).unwrap();
    assert_eq!(analysis.responses[1].model, Err(NoModel::NotMeasured));
    assert!(analysis.responses[0].model.is_ok());
}

#[test]
fn of_two_equally_bad_plots_both_are_named() {
    let mut plots = example();
    plots.iter_mut().for_each(|plot| plot.damaged = Some(0));
    for plot in [3, 8] {
        (plots[plot].damaged, plots[plot].plants) = (Some(5), Some(50));
    }
    let analysis = Analysis::of(plots).unwrap();
    assert_found(
        &analysis,
        "At most 10.00 % in each of these plots: replication 1, 1.5 km/h, 60 cm; replication 2, 1 km/h, 50 cm.",
    );
    // In a symmetrical trial two plots are equally far from the model.
    let mirrored = (0..20).map(|plot| PlotRecord {
        replication: plot / 2,
        speed_km_h: 1.0 + f64::from(plot % 2),
        spacing_cm: 50.0,
        plants: Some(100),
        damaged: Some(match plot {
            2 => 70,
            3 => 30,
            even if even % 2 == 0 => 50 + even / 2 % 3,
            odd => 50 - odd / 2 % 3,
        }),
        ..PlotRecord::default()
    });
    let analysis = Analysis::of(mirrored.collect()).unwrap();
    assert_found(&analysis, "Plant damage: plots 3 and 4 are equally far from the model");
}

#[test]
fn what_a_spreadsheet_adds_changes_nothing() {
    for name in [
        "rows-of-commas",
        "padding-stops-after-16",
        "sep-line",
        "quoted-note",
        "whole-numbers-with-point",
        "semicolons-and-decimal-commas",
        "tabs",
    ] {
        assert_eq!(plots(&format!("{name}.csv")), example(), "{name}");
    }
    let error = read_csv(&table("cp1252-in-line-7.csv")).unwrap_err().to_string();
    assert!(error.contains("line 7: the byte 0xDF is not UTF-8"), "{error}");
}
