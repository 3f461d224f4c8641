//! The statistics of a trial: they agree with R's, and report in words what the plots do not allow.
//!
//! R 4.2.2 printed the reference values with `options(digits = 15)`. The lines of R are above each test. The responses
//! are invented.

use rand::{RngExt, SeedableRng};
use rand_chacha::ChaCha8Rng;
use study::statistics::{AnalysisOfVariance, Checks, Design, LinearModel, NoModel, Remark, Source};

/// The paper's speeds and spacings with three replications: all plots of a speed together, and of a spacing in them.
///
/// ```r
/// speed <- rep(c(1, 1.5, 2, 2.5), each = 6)
/// spacing <- rep(rep(c(50, 60), each = 3), 4)
/// ```
fn paper_plots() -> Vec<(f64, f64)> {
    let speeds = [1.0, 1.5, 2.0, 2.5];
    speeds.into_iter().flat_map(|speed| [50.0, 50.0, 50.0, 60.0, 60.0, 60.0].map(|spacing| (speed, spacing))).collect()
}

/// ```r
/// y <- c(88.1, 87.3, 89.0, 89.4, 90.2, 88.7, 85.9, 86.8, 84.7, 88.3, 86.1, 87.9,
///        83.2, 84.8, 82.1, 85.0, 86.3, 83.9, 80.4, 79.2, 82.6, 82.2, 80.9, 83.5)
/// ```
const EFFICIENCY: [f64; 24] = [
    88.1, 87.3, 89.0, 89.4, 90.2, 88.7, 85.9, 86.8, 84.7, 88.3, 86.1, 87.9, 83.2, 84.8, 82.1, 85.0, 86.3, 83.9, 80.4,
    79.2, 82.6, 82.2, 80.9, 83.5,
];

const NUMBERS: [u32; 24] = [1, 2, 3, 4, 5, 6, 7, 8, 9, 10, 11, 12, 13, 14, 15, 16, 17, 18, 19, 20, 21, 22, 23, 24];

/// The plots that are left where five were lost, numbered from 0.
///
/// ```r
/// keep <- -c(2, 9, 10, 23, 24)
/// speed <- speed[keep]; spacing <- spacing[keep]; y <- y[keep]
/// ```
fn unbalanced() -> (Vec<(f64, f64)>, Vec<f64>) {
    let lost = [1, 8, 9, 22, 23];
    let kept = paper_plots().into_iter().zip(EFFICIENCY).enumerate().filter(|(plot, _)| !lost.contains(plot));
    kept.map(|(_, plot)| plot).unzip()
}

/// Asserts that a figure is R's to ten digits.
#[track_caller]
fn assert_close(ours: f64, r: f64) {
    assert!((ours - r).abs() <= 1e-10 * r.abs(), "{ours} is not {r}");
}

/// Asserts the estimate, standard error, t and p of each term.
#[track_caller]
fn assert_terms(model: &LinearModel, expected: [(&str, [f64; 4]); 3]) {
    assert_eq!(model.terms.len(), expected.len());
    for (term, (name, [estimate, standard_error, t, p])) in model.terms.iter().zip(expected) {
        assert_eq!(term.name, name);
        assert_close(term.estimate, estimate);
        assert_close(term.standard_error, standard_error);
        assert_close(term.t.unwrap(), t);
        assert_close(term.p.unwrap(), p);
    }
}

/// Name, degrees of freedom and sum of squares of a source, and its F and p.
type Expected = (&'static str, usize, f64, Option<(f64, f64)>);

#[track_caller]
fn assert_sources(analysis: &AnalysisOfVariance, expected: &[Expected]) {
    let names: Vec<&str> = analysis.sources.iter().map(|source| source.name).collect();
    assert_eq!(names, expected.iter().map(|(name, ..)| *name).collect::<Vec<_>>());
    for (source, (_, degrees_of_freedom, sum_of_squares, test)) in analysis.sources.iter().zip(expected) {
        let Source { f, p, mean_square, .. } = source;
        assert_eq!(source.degrees_of_freedom, *degrees_of_freedom, "{source:?}");
        assert_close(source.sum_of_squares, *sum_of_squares);
        assert_close(*mean_square, *sum_of_squares / *degrees_of_freedom as f64);
        assert_eq!(f.is_some(), test.is_some(), "{source:?}");
        if let Some((expected_f, expected_p)) = test {
            assert_close(f.unwrap(), *expected_f);
            assert_close(p.unwrap(), *expected_p);
        }
    }
}

/// ```r
/// m <- lm(y ~ speed + spacing); s <- summary(m); s$coefficients
/// c(s$r.squared, s$adj.r.squared, s$sigma); m$df.residual; residuals(m)[1:3]
/// ```
#[test]
fn the_linear_model_of_a_balanced_trial_is_that_of_r() {
    let model = LinearModel::fit(&Design::new(paper_plots()), &EFFICIENCY).unwrap();
    assert_terms(
        &model,
        [
            ("constant", [85.4058333333334, 2.51039868431945, 34.0208246071824, 7.47979655142463e-20]),
            ("speed", [-4.87000000000001, 0.391164994484492, -12.4499893105672, 3.68204457834911e-11]),
            ("spacing", [0.1525, 0.0437335759042827, 3.48702334183164, 2.19859531082751e-3]),
        ],
    );
    assert_close(model.r_squared, 0.888393785782788);
    assert_close(model.adjusted_r_squared, 0.877764622524006);
    assert_close(model.residual_standard_error, 1.0712494559277);
    assert_eq!(model.degrees_of_freedom, 21);
    assert!((model.residuals[1] - -0.8608333333333).abs() < 1e-9, "{:?}", model.residuals);
    assert!((model.fitted[1] - (87.3 + 0.8608333333333)).abs() < 1e-9, "{:?}", model.fitted);
    assert_eq!(model.remarks, []);
}

/// ```r
/// anova(lm(y ~ factor(speed) * factor(spacing)))
/// ```
#[test]
fn the_analysis_of_variance_of_a_balanced_trial_is_that_of_r() {
    let analysis = AnalysisOfVariance::of(&Design::new(paper_plots()), &EFFICIENCY).unwrap();
    assert_sources(
        &analysis,
        &[
            ("speed", 3, 178.39125, Some((40.5895904436863, 1.046241930609e-7))),
            ("spacing", 1, 13.95375, Some((9.52474402730371, 7.08133011193657e-3))),
            ("speed x spacing", 3, 0.14458333333333, Some((0.0328972317026964, 0.991670819398798))),
            ("residual", 16, 23.44, None),
        ],
    );
    assert_eq!(analysis.remarks, []);
}

/// The same lines of R as for the balanced trial, for the plots that are left.
#[test]
fn an_unbalanced_trial_is_analysed_as_r_does_with_speed_first() {
    let (plots, values) = unbalanced();
    let design = Design::new(plots);
    let model = LinearModel::fit(&design, &values).unwrap();
    assert_terms(
        &model,
        [
            ("constant", [87.2868137506412, 2.95518753606483, 29.5368103328134, 2.19080804358767e-15]),
            ("speed", [-4.99055926115956, 0.446541434263699, -11.1760273027933, 5.72548197034553e-9]),
            ("spacing", [0.123114417650078, 0.0489161632813876, 2.51684534091256, 2.28846783592904e-2]),
        ],
    );
    assert_close(model.r_squared, 0.904002889813811);
    assert_close(model.adjusted_r_squared, 0.892003251040538);

    let analysis = AnalysisOfVariance::of(&design, &values).unwrap();
    assert_sources(
        &analysis,
        &[
            ("speed", 3, 156.54248245614, Some((35.7032408670441, 5.7919248270296e-6))),
            ("spacing", 1, 6.45608988764058, Some((4.41739511283722, 5.94189718741978e-2))),
            ("speed x spacing", 3, 0.851076779026191, Some((0.194108326130792, 0.89821958556076))),
            ("residual", 11, 16.0766666666667, None),
        ],
    );
    assert_eq!(analysis.remarks, [Remark::Unbalanced]);
}

/// ```r
/// speed <- rep(c(1, 1.5, 2, 2.5), each = 2); spacing <- rep(c(50, 60), 4)
/// y <- c(0, 0, 1.1, 0, 2.4, 1.3, 3.9, 2.2)
/// anova(lm(y ~ factor(speed) + factor(spacing)))
/// ```
#[test]
fn without_replications_the_interaction_is_part_of_the_residual() {
    let plots = [1.0, 1.5, 2.0, 2.5].into_iter().flat_map(|speed| [(speed, 50.0), (speed, 60.0)]);
    let values = [0.0, 0.0, 1.1, 0.0, 2.4, 1.3, 3.9, 2.2];
    let analysis = AnalysisOfVariance::of(&Design::new(plots), &values).unwrap();
    assert_sources(
        &analysis,
        &[
            ("speed", 3, 11.20375, Some((14.8640132669983, 0.0263536734300019))),
            ("spacing", 1, 1.90125, Some((7.56716417910448, 0.0706919894512404))),
            ("residual", 3, 0.75375, None),
        ],
    );
    assert_eq!(analysis.remarks, [Remark::NoReplication]);
}

/// ```r
/// speed <- c(1, 1, 1, 1, 2, 2, 2, 2, 2.5, 2.5); spacing <- c(50, 50, 60, 60, 50, 50, 60, 60, 50, 50)
/// y <- c(3, 4, 5, 7, 6, 5, 9, 8, 7, 9)
/// anova(lm(y ~ factor(speed) * factor(spacing)))
/// ```
#[test]
fn a_missing_treatment_takes_an_interaction_degree_of_freedom() {
    let treatments = [(1.0, 50.0), (1.0, 60.0), (2.0, 50.0), (2.0, 60.0), (2.5, 50.0)];
    let design = Design::new(treatments.into_iter().flat_map(|treatment| [treatment; 2]));
    let values = [3.0, 4.0, 5.0, 7.0, 6.0, 5.0, 9.0, 8.0, 7.0, 9.0];
    let analysis = AnalysisOfVariance::of(&design, &values).unwrap();
    assert_sources(
        &analysis,
        &[
            ("speed", 2, 17.35, Some((7.88636363636364, 0.0284243938885632))),
            ("spacing", 1, 15.125, Some((13.75, 0.0138822403876832))),
            ("speed x spacing", 1, 0.125, Some((0.113636363636363, 0.749731376894574))),
            ("residual", 5, 5.5, None),
        ],
    );
    assert_eq!(analysis.remarks, [Remark::Unbalanced]);
}

/// The errors of the model and of the analysis of variance.
fn refusals(plots: &[(f64, f64)], values: &[f64]) -> (Option<NoModel>, Option<NoModel>) {
    let design = Design::new(plots.iter().copied());
    (LinearModel::fit(&design, values).err(), AnalysisOfVariance::of(&design, values).err())
}

#[test]
fn a_response_that_is_the_same_everywhere_has_no_model() {
    // Of a tenth, even the mean of many is not exact.
    for value in [0.0, 0.1, 97.3] {
        let (model, variance) = refusals(&paper_plots(), &[value; 24]);
        for refusal in [model, variance] {
            let Some(NoModel::Constant { value: named }) = refusal else { panic!("{refusal:?}") };
            assert!((named - value).abs() < 1e-12, "{named}");
        }
    }
}

#[test]
fn plots_of_one_treatment_carry_no_model() {
    let refusal = Some(NoModel::OneTreatment);
    assert_eq!(refusals(&[(1.0, 50.0); 3], &[1.0, 2.0, 3.0]), (refusal, refusal));
    // They say nothing about speed and spacing, even if all are the same.
    assert_eq!(refusals(&[(1.0, 50.0); 3], &[2.0; 3]), (refusal, refusal));
    assert_eq!(refusals(&[(1.0, 50.0)], &[2.0]), (refusal, refusal));
}

#[test]
fn a_spacing_for_each_speed_is_refused_as_inseparable() {
    let refusal = Some(NoModel::Inseparable);
    let plots = [(1.0, 50.0), (1.0, 50.0), (2.0, 60.0), (2.0, 60.0)];
    assert_eq!(refusals(&plots, &[1.0, 2.0, 3.0, 5.0]), (refusal, refusal));
}

#[test]
fn too_few_plots_for_the_parameters_are_refused() {
    let refused = |plots, parameters, needed| Some(NoModel::TooFewPlots { plots, parameters, needed });
    assert_eq!(refusals(&[(1.0, 50.0), (2.0, 50.0)], &[1.0, 2.0]), (refused(2, 2, 3), refused(2, 2, 5)));
    let three = [(1.0, 50.0), (1.0, 60.0), (2.0, 50.0)];
    assert_eq!(refusals(&three, &[1.0, 2.0, 4.0]), (refused(3, 3, 4), refused(3, 3, 6)));
    let four = [(1.0, 50.0), (1.0, 50.0), (2.0, 50.0), (2.0, 50.0)];
    assert_eq!(refusals(&four, &[1.0, 2.0, 4.0, 5.0]), (None, refused(4, 2, 5)), "2 degrees of freedom are too few");
}

#[test]
fn an_analysis_of_too_many_measured_speeds_is_refused() {
    let plots: Vec<(f64, f64)> = (0..5000).map(|plot| (1.0 + f64::from(plot) / 2500.0, 50.0)).collect();
    let values: Vec<f64> = (0..5000).map(|plot| f64::from(plot % 7)).collect();
    let (model, variance) = refusals(&plots, &values);
    assert_eq!((model, variance), (None, Some(NoModel::TooManyTreatments { treatments: 5000, most: 200 })));
}

#[test]
fn a_constant_factor_is_left_out_with_a_remark() {
    for (factor, remark) in [("spacing", Remark::OneSpeed), ("speed", Remark::OneSpacing)] {
        let plot = |wide: f64| if factor == "spacing" { (1.0, 50.0 + wide) } else { (1.0 + wide, 50.0) };
        let design = Design::new([0.0, 0.0, 0.0, 1.0, 1.0, 1.0].map(plot));
        let values = [1.0, 2.0, 3.0, 3.0, 5.0, 7.0];
        let model = LinearModel::fit(&design, &values).unwrap();
        assert_eq!(model.terms.iter().map(|term| term.name).collect::<Vec<_>>(), ["constant", factor]);
        assert_eq!(model.remarks, [remark]);
        // By hand: the means are 2 and 5, so the factor has 13.5 and the residual 2 + 8.
        let analysis = AnalysisOfVariance::of(&design, &values).unwrap();
        assert_eq!(analysis.remarks, [remark]);
        assert_eq!(analysis.sources.iter().map(|source| source.name).collect::<Vec<_>>(), [factor, "residual"]);
        assert_close(analysis.sources[0].sum_of_squares, 13.5);
        assert_close(analysis.sources[0].f.unwrap(), 5.4);
        assert_close(analysis.sources[1].sum_of_squares, 10.0);
    }
}

#[test]
fn plots_without_scatter_have_estimates_but_no_tests() {
    let plots = paper_plots();
    let values: Vec<f64> = plots.iter().map(|(speed, spacing)| 97.2 - 5.1 * speed + 0.2 * spacing).collect();
    let design = Design::new(plots);
    let model = LinearModel::fit(&design, &values).unwrap();
    assert_close(model.term("speed").unwrap().estimate, -5.1);
    assert!(model.terms.iter().all(|term| term.t.is_none() && term.p.is_none()), "{model:?}");
    assert_eq!(model.remarks, [Remark::NoScatter]);
    let analysis = AnalysisOfVariance::of(&design, &values).unwrap();
    assert!(analysis.sources.iter().all(|source| source.f.is_none() && source.p.is_none()), "{analysis:?}");
    assert_eq!(analysis.remarks, [Remark::NoScatter]);
}

#[test]
fn every_part_of_a_trial_gives_finite_figures() {
    let mut chance = ChaCha8Rng::seed_from_u64(1);
    let (mut modelled, mut analysed) = (0, 0);
    for _ in 0..5000 {
        let plots = chance.random_range(1..12);
        let levels = chance.random_range(1..4);
        let mut level = |of: [f64; 3]| of[chance.random_range(0..levels)];
        let design: Vec<(f64, f64)> = (0..plots).map(|_| (level([1.0, 1.5, 2.5]), level([50.0, 60.0, 75.0]))).collect();
        // Counts of few plants: often the same, as damage is.
        let most = chance.random_range(1..4);
        let values: Vec<f64> = design.iter().map(|_| f64::from(chance.random_range(0..most)) / 0.3).collect();
        let blocks = chance.random_range(1..4);
        let design = in_blocks(design.into_iter().map(|plot| (plot, chance.random_range(0..blocks))));

        if let Ok(model) = LinearModel::fit(&design, &values) {
            modelled += 1;
            let figures = [model.r_squared, model.adjusted_r_squared, model.residual_standard_error];
            let of_terms = model.terms.iter().flat_map(|term| {
                [Some(term.estimate), Some(term.standard_error), term.t, term.p].into_iter().flatten()
            });
            assert!(figures.into_iter().chain(of_terms).all(f64::is_finite), "{design:?} {values:?} {model:?}");
        }
        if let Ok(analysis) = AnalysisOfVariance::of(&design, &values) {
            analysed += 1;
            let sources = &analysis.sources;
            let figures = |source: &Source| [Some(source.mean_square), source.f, source.p].into_iter().flatten();
            assert!(sources.iter().flat_map(figures).all(f64::is_finite), "{design:?} {values:?} {analysis:?}");
            assert!(sources.iter().all(|source| source.degrees_of_freedom > 0), "{design:?} {values:?} {analysis:?}");
            let freedom: usize = sources.iter().map(|source| source.degrees_of_freedom).sum();
            assert_eq!(freedom, values.len() - 1, "{analysis:?}");
            let mean = values.iter().sum::<f64>() / values.len() as f64;
            let all: f64 = values.iter().map(|value| (value - mean).powi(2)).sum();
            let parts: f64 = sources.iter().map(|source| source.sum_of_squares).sum();
            assert!((parts / all - 1.0).abs() < 1e-9, "the parts make the whole: {analysis:?}");
        }
    }
    assert!(modelled > 1000 && analysed > 800, "{modelled} {analysed}");
}

fn in_blocks(plots: impl IntoIterator<Item = ((f64, f64), u32)>) -> Design {
    Design::in_blocks(plots.into_iter().map(|((speed, spacing), block)| (speed, spacing, speed, block)))
}

/// ```r
/// block <- rep(1:3, 8)
/// anova(lm(y ~ factor(block) + factor(speed) * factor(spacing)))
/// ```
#[test]
fn replications_as_blocks_are_taken_out_first_as_r_does() {
    let design = in_blocks(paper_plots().into_iter().zip((1..=3).cycle()));
    let analysis = AnalysisOfVariance::of(&design, &EFFICIENCY).unwrap();
    assert_sources(
        &analysis,
        &[
            ("block", 2, 0.0608333333333428, Some((0.0182142220638061, 0.981973883594621))),
            ("speed", 3, 178.39125000000067, Some((35.608305114953005, 8.35208653870585e-7))),
            ("spacing", 1, 13.953749999999884, Some((8.355836749242512, 1.18592031983224e-2))),
            ("speed x spacing", 3, 0.1445833333333504, Some((0.028859977425299, 0.993089130415473))),
            ("residual", 14, 23.379166666666602, None),
        ],
    );
    assert_eq!(analysis.remarks, []);
}

/// ```r
/// k <- keep
/// anova(lm(y[k] ~ factor(block[k]) + factor(speed[k]) * factor(spacing[k])))
/// ```
#[test]
fn blocks_with_lost_plots_are_taken_out_first_as_r_does() {
    let lost = [1, 8, 9, 22, 23];
    let blocks = (0..24).filter(|plot| !lost.contains(plot)).map(|plot| plot % 3 + 1);
    let (plots, values) = unbalanced();
    let design = in_blocks(plots.into_iter().zip(blocks));
    let analysis = AnalysisOfVariance::of(&design, &values).unwrap();
    assert_sources(
        &analysis,
        &[
            ("block", 2, 2.52441102756897, Some((0.743209828695461, 0.502653534033422))),
            ("speed", 3, 154.62929101064037, Some((30.349523810573668, 4.89000525296584e-5))),
            ("spacing", 1, 6.2924520507516, Some((3.705111536624149, 8.6380333408056e-2))),
            ("speed x spacing", 3, 1.19531321566392, Some((0.234607470957034, 0.870042702458407))),
            ("residual", 9, 15.28484848484852, None),
        ],
    );
}

/// ```r
/// anova(m, lm(y ~ factor(speed):factor(spacing)))[2, 6]
/// pchisq(24 * summary(lm(residuals(m)^2 ~ speed + spacing))$r.squared, 2, lower.tail = FALSE)
/// which.max(abs(rstudent(m))); 24 * 2 * pt(-max(abs(rstudent(m))), 20)
/// ```
#[test]
fn the_checks_of_the_residuals_are_those_of_r() {
    let design = Design::new(paper_plots());
    let checks = Checks::of(&design, &EFFICIENCY, &LinearModel::fit(&design, &EFFICIENCY).unwrap(), &NUMBERS);
    assert_close(checks.lack_of_fit_p.unwrap(), 0.992704948640819);
    assert_close(checks.unequal_scatter_p.unwrap(), 0.0718139330165311);
    // 1.799 by Bonferroni, which is no probability any more.
    assert_eq!(checks.farthest, Some((vec![21], 1.0)));
    let said = checks.sentences("Weeding efficiency");
    assert_eq!(
        said,
        ["The residuals of weeding efficiency are as they should be: straight lines, even scatter and no outlier."]
    );
}

#[test]
fn a_bend_an_outlier_and_uneven_scatter_are_each_described() {
    let said = |value: fn(usize, f64) -> f64| {
        let plots = paper_plots();
        let values: Vec<f64> = (0..24).map(|plot| value(plot, plots[plot].0) + EFFICIENCY[plot % 3] / 20.0).collect();
        let design = Design::new(plots);
        let model = LinearModel::fit(&design, &values).unwrap();
        Checks::of(&design, &values, &model, &NUMBERS).sentences("It").join(" ")
    };
    assert!(said(|_, speed| (speed - 1.75).powi(2)).contains("does not follow straight lines"));
    assert!(
        said(|plot, speed| speed + if plot == 4 { 3.0 } else { 0.0 }).contains("It: plot 5 is farther from the model")
    );
    let fan = said(|plot, speed| [-1.0, 0.0, 1.0][plot % 3] * (speed - 0.9));
    assert!(fan.contains("scatters more at some speeds"), "{fan}");
}

#[test]
fn few_plots_are_not_tested_for_unequal_scatter() {
    for (plots, is_tested) in [(4, false), (8, false), (9, true)] {
        let design = Design::new((0..plots).map(|plot| (1.0 + (plot % 2) as f64, 50.0)));
        let values = &EFFICIENCY[..plots];
        let checks = Checks::of(&design, values, &LinearModel::fit(&design, values).unwrap(), &NUMBERS[..plots]);
        assert_eq!(checks.unequal_scatter_p.is_some(), is_tested, "{plots} plots");
    }
}

/// statsmodels 0.15.0: `OLS(y, X).fit().get_influence().resid_studentized_external` is infinite for the damaged plot, and
/// at most 0.857 for the others, with X of [`paper_plots`] and 5 of 60 plants damaged in one plot.
#[test]
fn the_only_plot_with_damage_is_the_outlier_in_every_place() {
    let design = Design::new(paper_plots());
    for (place, number) in NUMBERS.into_iter().enumerate() {
        let mut values = [0.0; 24];
        values[place] = 100.0 * 5.0 / 60.0;
        let checks = Checks::of(&design, &values, &LinearModel::fit(&design, &values).unwrap(), &NUMBERS);
        assert_eq!(checks.farthest, Some((vec![number], 0.0)));
        let said = checks.sentences("Plant damage");
        let outlier =
            format!("Plant damage: plot {number} is farther from the model than chance explains (p < 0.0001)");
        assert!(said.iter().any(|sentence| sentence.starts_with(&outlier)), "{said:?}");
    }
}
