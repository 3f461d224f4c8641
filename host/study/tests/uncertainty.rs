//! Intervals of figures and the binomial model of counts: both agree with R.
//!
//! R 4.2.2 printed the reference values with `options(digits = 15)`. The lines of R are above each test. The counts are
//! invented.

use study::evaluation::{Analysis, PlotRecord};
use study::statistics::{BinomialModel, Design, Mean, NoModel, Remark, Share};

use rand::{RngExt, SeedableRng};
use rand_chacha::ChaCha8Rng;

/// Asserts that a figure is R's to ten digits.
#[track_caller]
fn assert_close(ours: f64, r: f64) {
    assert!((ours - r).abs() <= 1e-10 * r.abs(), "{ours} is not {r}");
}

/// ```r
/// b <- function(x, n) binom.test(x, n)$conf.int[1:2]
/// b(13, 1318); b(1, 20); b(19, 20); b(400, 4000); b(3, 7)
/// ```
#[test]
fn the_interval_of_a_share_is_that_of_r() {
    for (count, of, least, greatest) in [
        (13_u32, 1318_u32, 0.0052620173140942, 0.0168077053828075),
        (1, 20, 0.00126508949794981, 0.24873276277202772),
        (19, 20, 0.751267237227972, 0.99873491050205),
        (400, 4000, 0.0908727477156808, 0.1097161517183867),
        (3, 7, 0.0989882784425079, 0.815948432359917),
    ] {
        let share = Share::of(count, of);
        assert_close(share.least_percent, 100.0 * least);
        assert_close(share.greatest_percent, 100.0 * greatest);
    }
}

/// ```r
/// q <- function(x, n) 100 * c(qbeta(0.025, x, n - x + 1), qbeta(0.975, x + 1, n - x))
/// q(500, 1e6); q(4e4, 1e5); q(5e5, 1e6); q(1e9, 4e9); q(2147483646, 2147483647)
/// ```
#[test]
fn counts_of_thousands_of_millions_have_an_interval_as_well() {
    for (count, of, least, greatest) in [
        (500_u64, 1_000_000_u64, 0.0457138148558, 0.0545796765654),
        (40_000, 100_000, 39.6961573510, 40.3044227659),
        (500_000, 1_000_000, 49.9019519195, 50.0980480805),
        (1_000_000_000, 4_000_000_000, 24.9986581100, 25.0013419262),
        (2_147_483_646, 2_147_483_647, 99.9999997406, 99.9999999988),
    ] {
        let share = Share::of(count, of);
        let tolerance = (greatest - least) / 100.0;
        assert!((share.least_percent - least).abs() < tolerance, "{share:?}");
        assert!((share.greatest_percent - greatest).abs() < tolerance, "{share:?}");
    }
}

/// ```r
/// binom.test(0, 4566, alternative = "less")$conf.int[2]
/// binom.test(5, 5, alternative = "greater")$conf.int[1]
/// ```
#[test]
fn none_of_many_is_below_three_by_their_number_and_all_of_them_above() {
    let none = Share::of(0_u32, 4566_u32);
    assert_close(none.greatest_percent, 100.0 * 0.000655880364682206);
    assert_eq!((none.least_percent, none.to_string()), (0.0, "below 0.07".to_owned()));
    let all = Share::of(5_u32, 5_u32);
    assert_close(all.least_percent, 100.0 * 0.549280271653059);
    assert_eq!((all.greatest_percent, all.to_string()), (100.0, "above 54.9".to_owned()));
    assert_eq!(Share::of(0_u32, 0_u32).to_string(), "none counted");
    assert_eq!((Share::of(0_u32, 0_u32).shown().as_str(), Share::of(0_u32, 0_u32).percent()), ("\u{2013}", None));
}

/// ```r
/// binom.test(13, 1318)$conf.int[1:2]; binom.test(1, 12735)$conf.int[1:2]; binom.test(1, 1e9)$conf.int[1:2]
/// binom.test(0, 91, alternative = "less")$conf.int[2]; binom.test(0, 1e9, alternative = "less")$conf.int[2]
/// binom.test(1e9, 1e9, alternative = "greater")$conf.int[1]
/// binom.test(16, 30000)$conf.int[1:2]; q(600, 1e6); q(93748e3, 1e8); binom.test(9999, 10000)$conf.int[1:2]
/// ```
#[test]
fn an_interval_is_rounded_outward_and_contains_its_share() {
    for (count, of, share, interval) in [
        (13_u64, 1318_u64, "1.0", "0.52 to 1.69"),
        (1, 12_735, "0.0079", "0.00019 to 0.044"),
        (1, 1_000_000_000, "0.00000010", "0.0000000025 to 0.0000006"),
        (0, 91, "0.0", "below 3.3"),
        (0, 1_000_000_000, "0.0", "below 0.00000030"),
        (1_000_000_000, 1_000_000_000, "100.0", "above 99.99999970"),
        (16, 30_000, "0.05", "0.030 to 0.09"),
        (600, 1_000_000, "0.06", "0.055 to 0.065"),
        (93_748_000, 100_000_000, "93.75", "93.743 to 93.753"),
        (9999, 10_000, "99.99", "99.94 to 100.00"),
    ] {
        let of_all = Share::of(count, of);
        assert_eq!((of_all.shown().as_str(), of_all.to_string().as_str()), (share, interval));
    }
}

/// ```r
/// t.test(c(43.7, 44.1, 42.9))$conf.int[1:2]
/// ```
#[test]
fn the_interval_of_a_mean_is_that_of_r_and_without_scatter_there_is_none() {
    let mean = Mean::of(&[43.7, 44.1, 42.9]);
    assert_close(mean.mean - mean.within.unwrap(), 42.048833453228);
    assert_close(mean.mean + mean.within.unwrap(), 45.0844998801054);
    assert_eq!(Mean::of(&[43.7]), Mean { mean: 43.7, within: None, of: 1 });
    assert_eq!(Mean::of(&[100.0; 3]), Mean { mean: 100.0, within: None, of: 3 });
}

#[test]
fn a_mean_of_any_number_of_replications_has_an_interval_that_shrinks() {
    let within = |count: u32| {
        let values: Vec<f64> = (0..count).map(|replication| f64::from(replication % 2)).collect();
        Mean::of(&values).within.expect("more than one value")
    };
    let within: Vec<f64> = (1..=500).map(|pairs| within(2 * pairs)).collect();
    assert!(within.is_sorted_by(|more, fewer| more > fewer), "{within:?}");
}

/// A plot: its speed and spacing, and how many plants of how many were damaged.
type Plot = ((f64, f64), (u32, u32));

/// The paper's speeds and spacings with three replications, plants in each, and those damaged.
///
/// ```r
/// speed <- rep(c(1, 1.5, 2, 2.5), each = 6)
/// spacing <- rep(rep(c(50, 60), each = 3), 4)
/// damaged <- c(0, 1, 0, 0, 0, 1, 1, 0, 2, 1, 0, 1, 2, 1, 3, 1, 2, 2, 4, 3, 6, 3, 2, 4)
/// plants <- rep(c(60, 50), each = 3, times = 4)
/// ```
fn paper_plots() -> Vec<Plot> {
    let damaged = [0, 1, 0, 0, 0, 1, 1, 0, 2, 1, 0, 1, 2, 1, 3, 1, 2, 2, 4, 3, 6, 3, 2, 4];
    let plot = |(plot, damaged): (usize, u32)| {
        let is_narrow = plot % 6 < 3;
        let speed_km_h = 1.0 + 0.5 * (plot / 6) as f64;
        ((speed_km_h, if is_narrow { 50.0 } else { 60.0 }), (damaged, if is_narrow { 60 } else { 50 }))
    };
    damaged.into_iter().enumerate().map(plot).collect()
}

fn model(plots: &[Plot]) -> Result<BinomialModel, NoModel> {
    let (places, counts): (Vec<_>, Vec<_>) = plots.iter().copied().unzip();
    BinomialModel::fit(&Design::new(places), &counts)
}

#[track_caller]
fn assert_terms(model: &BinomialModel, expected: [(&str, [f64; 4]); 3]) {
    assert_eq!(model.terms.len(), expected.len());
    for (term, (name, [estimate, standard_error, z, p])) in model.terms.iter().zip(expected) {
        assert_eq!(term.name, name);
        assert_close(term.estimate, estimate);
        assert_close(term.standard_error, standard_error);
        assert_close(term.statistic, z);
        assert_close(term.p, p);
    }
}

/// ```r
/// control <- glm.control(epsilon = 1e-300, maxit = 30)  # it goes on until nothing changes any more
/// g <- glm(cbind(damaged, plants - damaged) ~ speed + spacing, family = binomial, control = control)
/// summary(g)$coefficients; c(g$deviance, g$null.deviance, g$df.residual); fitted(g)[1]
/// sum(residuals(g, "pearson")^2) / g$df.residual
/// ```
#[test]
fn the_binomial_model_of_a_balanced_trial_is_that_of_r() {
    let model = model(&paper_plots()).unwrap();
    assert_terms(
        &model,
        [
            ("constant", [-5.880566731418705, 1.944317072576305, -3.02448958267218, 2.49053048529399e-3]),
            ("speed", [1.577554690328789, 0.359326979353975, 4.390304043311853, 1.13192280098677e-5]),
            ("spacing", [-0.0126023622971889, 0.032776998889023, -0.384487986220404, 0.700616798514229]),
        ],
    );
    assert_close(model.deviance, 12.439061794826);
    assert_close(model.null_deviance, 36.6877273204175);
    assert_close(model.fitted[0], 0.00715239330550687);
    assert_close(model.dispersion, 0.492949263879289);
    assert_eq!((model.degrees_of_freedom, model.remarks.as_slice()), (21, [].as_slice()));
}

/// ```r
/// keep <- -c(2, 9, 10, 23, 24)
/// g <- glm(cbind(damaged, plants - damaged) ~ speed + spacing, family = binomial, subset = keep, control = control)
/// summary(g)$coefficients; c(g$deviance, g$null.deviance)
/// ```
#[test]
fn the_binomial_model_of_an_unbalanced_trial_is_that_of_r() {
    let lost = [1, 8, 9, 22, 23];
    let kept = paper_plots().into_iter().enumerate().filter(|(plot, _)| !lost.contains(plot));
    let model = model(&kept.map(|(_, plot)| plot).collect::<Vec<_>>()).unwrap();
    assert_terms(
        &model,
        [
            ("constant", [-7.610289939223746, 2.643875450536922, -2.8784600793801527, 3.99621855368618e-3]),
            ("speed", [1.9471522752898405, 0.479255822285473, 4.062866187006911, 4.84738200886509e-5]),
            ("spacing", [0.00382853736711591, 0.040867501796335, 0.0936817079300711, 0.925362001322127]),
        ],
    );
    assert_close(model.deviance, 9.32286404675317);
    assert_close(model.null_deviance, 32.83169701206344);
}

#[test]
fn counts_that_carry_no_binomial_model_are_refused_with_a_reason() {
    let with = |count: fn(f64, u32) -> u32| -> Vec<Plot> {
        paper_plots()
            .into_iter()
            .map(|((speed, spacing), (_, of))| ((speed, spacing), (count(speed, of), of)))
            .collect()
    };
    assert_eq!(model(&with(|_, _| 0)), Err(NoModel::NothingCounted));
    assert_eq!(model(&with(|_, of| of)), Err(NoModel::Constant { value: 100.0 }));
    // All plants at the highest speed, and none at any other: the steeper the slope, the better the fit.
    assert_eq!(model(&with(|speed, of| if speed > 2.0 { of } else { 0 })), Err(NoModel::OneSided));
    let one_speed: Vec<_> = paper_plots().into_iter().filter(|((speed, _), _)| *speed == 2.5).collect();
    assert_eq!(model(&one_speed).unwrap().remarks, [Remark::OneSpeed]);
    assert_eq!(model(&one_speed[..2]), Err(NoModel::OneTreatment));
    // One damaged plant at the lower speeds bounds the slope.
    let nearly = with(|speed, of| if speed > 2.0 { of } else { u32::from(speed < 1.2 && of == 50) });
    assert!(model(&nearly).is_err() || model(&nearly).unwrap().terms.iter().all(|term| term.estimate.is_finite()));
}

#[test]
fn overdispersed_plots_get_a_remark() {
    let clumped = paper_plots().into_iter().enumerate().map(|(plot, (place, (_, of)))| {
        let damaged = if plot % 2 == 0 { of / 2 } else { 0 };
        (place, (damaged, of))
    });
    let model = model(&clumped.collect::<Vec<_>>()).unwrap();
    assert!(model.dispersion > 10.0, "{model:?}");
    assert!(model.is_quasi && matches!(model.remarks.as_slice(), [Remark::Overdispersed { .. }]), "{model:?}");
}

fn binomial(chance: &mut ChaCha8Rng, of: u32, share: f64) -> u32 {
    (0..of).map(|_| u32::from(chance.random_bool(share))).sum()
}

/// 200 trials without an effect of speed or spacing. In half of them, plots scatter by more than counting does.
#[test]
fn trials_without_an_effect_seldom_have_a_finding() {
    let mut chance = ChaCha8Rng::seed_from_u64(39);
    let (mut of_even, mut of_clumped) = (0, 0);
    for trial in 0..200 {
        let is_clumped = trial % 2 == 0;
        let records = paper_plots().into_iter().zip(0..).map(|(((speed_km_h, spacing_cm), _), plot)| {
            // The shares of a clumped trial are spread over 0.01 to 0.4, most of them low.
            let spread = chance.random_range(0.1_f64..0.65).powi(2);
            let share = if is_clumped { spread } else { 0.1 };
            PlotRecord {
                replication: plot % 3,
                speed_km_h,
                spacing_cm,
                plants: Some(60),
                damaged: Some(binomial(&mut chance, 60, share)),
                ..PlotRecord::default()
            }
        });
        let findings = Analysis::of(records.collect()).unwrap().findings();
        let found = findings.iter().any(|finding| finding.contains("the odds that a plant is damaged are"));
        if is_clumped {
            of_clumped += u32::from(found);
        } else {
            of_even += u32::from(found);
        }
    }
    assert!(of_even + of_clumped <= 16, "{of_even} of 100 even trials and {of_clumped} of 100 clumped trials");
    assert!(of_even + of_clumped > 0, "a test at 5 % finds some");
}
