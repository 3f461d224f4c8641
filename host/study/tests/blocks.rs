//! Trials in blocks, whole and with lost plots: their analyses of variance agree with closed forms and with statsmodels.
//! The responses are invented.

use study::statistics::{AnalysisOfVariance, Design, Remark};

/// Asserts that a figure is the reference's to ten digits.
#[track_caller]
fn assert_close(ours: f64, expected: f64) {
    assert!((ours - expected).abs() <= 1e-10 * expected.abs(), "{ours} is not {expected}");
}

/// A design of plots at nominal speeds, each with its block.
fn in_blocks(plots: impl IntoIterator<Item = ((f64, f64), u32)>) -> Design {
    Design::in_blocks(plots.into_iter().map(|((speed, spacing), block)| (speed, spacing, speed, block)))
}

/// A response without a pattern, from whole numbers.
fn value(block: u32, speed: u32, spacing: u32) -> f64 {
    let (b, s, c) = (block, speed, spacing);
    f64::from((b * b * 31 + s * s * s * 17 + c * 53 + b * s * 11 + b * c * c * 7 + s * c * 3) % 101) / 7.0
}

/// A trial with a plot for each block, speed and spacing, numbered from 1, without the plots that were lost. The last
/// argument has the number of a plot from 0, its block, speed and spacing.
fn trial([blocks, speeds, spacings]: [u32; 3], is_lost: fn(usize, u32, u32, u32) -> bool) -> (Design, Vec<f64>) {
    let mut plots = Vec::new();
    for block in 1..=blocks {
        for speed in 1..=speeds {
            plots.extend((1..=spacings).map(|spacing| (block, speed, spacing)));
        }
    }
    let kept = plots.into_iter().enumerate().filter(|(plot, (b, s, c))| !is_lost(*plot, *b, *s, *c));
    let plots: Vec<(u32, u32, u32)> = kept.map(|(_, plot)| plot).collect();
    let values = plots.iter().map(|&(b, s, c)| value(b, s, c)).collect();
    let plots = plots.into_iter().map(|(block, speed, spacing)| ((speed.into(), spacing.into()), block));
    (in_blocks(plots), values)
}

/// The sum of squares of the means of each group around the mean of all, a value a plot.
fn between<K: PartialEq>(keys: &[K], values: &[f64]) -> f64 {
    let mean = |values: &[f64]| values.iter().sum::<f64>() / values.len() as f64;
    let of_group = |key: &K| {
        let group: Vec<f64> =
            keys.iter().zip(values).filter(|(other, _)| *other == key).map(|(_, value)| *value).collect();
        (mean(&group) - mean(values)).powi(2)
    };
    keys.iter().map(of_group).sum()
}

#[test]
fn every_balanced_trial_is_analysed_by_the_closed_form() {
    let mut analysed = 0;
    for (blocks, speeds, spacings) in (2..=12)
        .flat_map(|blocks| (2..=5).flat_map(move |speeds| (1..=4).map(move |spacings| (blocks, speeds, spacings))))
    {
        let (design, values) = trial([blocks, speeds, spacings], |_, _, _, _| false);
        let plots: Vec<[u32; 3]> =
            (1..=blocks).flat_map(|b| (1..=speeds).flat_map(move |s| (1..=spacings).map(move |c| [b, s, c]))).collect();
        let by = |factors: &[usize]| {
            let keys: Vec<Vec<u32>> = plots.iter().map(|plot| factors.iter().map(|&of| plot[of]).collect()).collect();
            between(&keys, &values)
        };
        let (block, speed, spacing, treatment) = (by(&[0]), by(&[1]), by(&[2]), by(&[1, 2]));
        let left = (blocks - 1) * (speeds * spacings - 1);
        let analysis = AnalysisOfVariance::of(&design, &values);
        if left < 3 {
            assert!(analysis.is_err() || analysis.unwrap().remarks.contains(&Remark::NoBlocks));
            continue;
        }
        let mut expected = vec![("block", blocks - 1, block), ("speed", speeds - 1, speed)];
        if spacings > 1 {
            expected.push(("spacing", spacings - 1, spacing));
            expected.push(("speed x spacing", (speeds - 1) * (spacings - 1), treatment - speed - spacing));
        }
        expected.push(("residual", left, by(&[0, 1, 2]) - block - treatment));
        let sources = analysis.unwrap().sources;
        assert_eq!(sources.len(), expected.len());
        for (source, (name, freedom, sum)) in sources.iter().zip(expected) {
            assert_eq!((source.name, source.degrees_of_freedom), (name, freedom as usize));
            let all = by(&[0, 1, 2]);
            assert!((source.sum_of_squares - sum).abs() < 1e-10 * all, "{blocks} {speeds} {spacings} {name}");
        }
        analysed += 1;
    }
    assert!(analysed > 170, "{analysed}");
}

/// Name, degrees of freedom, sum of squares, F and p of a source.
type Expected = (&'static str, usize, f64, f64, f64);

/// Asserts each source of an analysis, and the degrees of freedom and sum of squares of its residual.
#[track_caller]
fn assert_sources(analysis: &AnalysisOfVariance, expected: &[Expected], residual: (usize, f64)) {
    let (last, sources) = analysis.sources.split_last().unwrap();
    assert_eq!(last.degrees_of_freedom, residual.0);
    assert_close(last.sum_of_squares, residual.1);
    assert_eq!(sources.len(), expected.len(), "{sources:?}");
    for (source, (name, freedom, sum, f, p)) in sources.iter().zip(expected) {
        assert_eq!((source.name, source.degrees_of_freedom), (*name, *freedom));
        assert_close(source.sum_of_squares, *sum);
        assert_close(source.f.unwrap(), *f);
        assert_close(source.p.unwrap(), *p);
    }
}

/// statsmodels 0.15.0 with numpy 2.4.6: the `ssr` and `df_resid` of `ols(f, d).fit()` for each `f` of `y ~ 1`, `y ~ C(b)`,
/// `+ C(s)`, `+ C(c)`, and `y ~ C(b) + C(s)*C(c)`; their differences, and `scipy.stats.f.sf`. Without blocks, the same
/// without `C(b)`.
#[test]
fn trials_with_lost_plots_are_analysed_as_statsmodels_does() {
    type Case = ([u32; 3], fn(usize, u32, u32, u32) -> bool, &'static [Expected], (usize, f64), &'static [Remark]);
    let cases: [Case; 7] = [
        (
            [6, 4, 2],
            |plot, _, _, _| plot == 17,
            &[
                ("block", 5, 13.942350040320207, 0.16611850595312688, 0.9733149093613027),
                ("speed", 3, 20.69030487652924, 0.41086360666889843, 0.746222277288269),
                ("spacing", 1, 5.569336574035901, 0.33178404937239053, 0.5684039738333799),
                ("speed x spacing", 3, 86.31749654749126, 1.7140742082714824, 0.18254600799676163),
            ],
            (34, 570.7249757045676),
            &[Remark::Unbalanced],
        ),
        (
            [5, 3, 3],
            |_, _, speed, spacing| speed == 2 && spacing == 3,
            &[
                ("block", 4, 75.01224489795925, 1.0654795428192818, 0.39202261417632056),
                ("speed", 2, 24.498639455782495, 0.6959610181657607, 0.507014781767851),
                ("spacing", 2, 17.070408163265256, 0.4849387112804358, 0.6208107550486204),
                ("speed x spacing", 3, 94.95136054421766, 1.7982616457769673, 0.17041227622831115),
            ],
            (28, 492.8163265306123),
            &[Remark::Unbalanced],
        ),
        (
            [7, 4, 3],
            |plot, block, speed, _| plot % 5 == 2 || (block == 3 && speed == 4),
            &[
                ("block", 6, 42.89723436993859, 0.3207713707220942, 0.9227978290293649),
                ("speed", 3, 42.20317314245676, 0.6311628195413246, 0.5986498396265254),
                ("spacing", 2, 76.98916126580525, 1.7270986686696326, 0.1891287302373309),
                ("speed x spacing", 6, 114.64457889289133, 0.8572743501408777, 0.5332087193692383),
            ],
            (46, 1025.2747809003367),
            &[Remark::Unbalanced],
        ),
        // Two plots of each treatment, and each lacks one in another block. With spacing first it has 4.741.
        (
            [3, 4, 2],
            |plot, _, _, _| plot / 8 == plot % 8 % 3,
            &[
                ("block", 2, 15.798299319727903, 0.21645107816442435, 0.8113960954722377),
                ("speed", 3, 50.84359879290059, 0.4644023829721229, 0.7175922291186498),
                ("spacing", 1, 3.955119458878926, 0.10837747200730752, 0.7531870554355764),
                ("speed x spacing", 3, 42.475139862894935, 0.38796538084862986, 0.7661146776304583),
            ],
            (6, 218.96355685131198),
            &[Remark::Unbalanced],
        ),
        // All treatments once, and one again.
        (
            [2, 4, 2],
            |plot, _, _, _| plot > 8,
            &[
                ("speed", 3, 81.09977324263038, 1.3952790475568848, 0.3663189637434633),
                ("spacing", 1, 4.15384615384616, 0.21439423096400462, 0.6674150368177306),
            ],
            (4, 77.49921507064364),
            &[Remark::NoBlocks, Remark::NoReplication, Remark::Unbalanced],
        ),
        // The replications are numbered on from speed to speed.
        (
            [12, 4, 2],
            |_, block, speed, _| (block - 1) / 3 + 1 != speed,
            &[
                ("speed", 3, 33.159863945578195, 0.5091326883657771, 0.6815973870097146),
                ("spacing", 1, 3.061224489796018, 0.141005052681059, 0.7122155633203378),
                ("speed x spacing", 3, 211.20408163265296, 3.2428028671027365, 0.04983127758013918),
            ],
            (16, 347.36054421768705),
            &[Remark::InseparableBlocks],
        ),
        // The slow speeds on days 1 and 3, the fast ones on days 2 and 4.
        (
            [4, 4, 2],
            |_, block, speed, _| (block % 2 == 1) != (speed <= 2),
            &[
                ("speed", 3, 66.02551020408168, 1.4395683853384516, 0.3016985777359037),
                ("spacing", 1, 11.755102040816297, 0.7688970465543115, 0.4061188243245836),
                ("speed x spacing", 3, 63.50000000000003, 1.3845041437232333, 0.3159880209635325),
            ],
            (8, 122.30612244897958),
            &[Remark::InseparableBlocks],
        ),
    ];
    for (size, is_lost, expected, residual, remarks) in cases {
        let (design, values) = trial(size, is_lost);
        let analysis = AnalysisOfVariance::of(&design, &values).unwrap();
        assert_sources(&analysis, expected, residual);
        assert_eq!(analysis.remarks, remarks);
    }
}

/// `ols('y ~ C(s)')`, as above.
#[test]
fn replications_that_are_the_speeds_are_no_blocks() {
    let design = in_blocks((0..8).map(|plot| ((1.0 + f64::from(plot / 4), 50.0), plot / 4)));
    let values = [84.0, 84.0, 89.0, 80.0, 80.0, 87.5, 83.5, 88.0];
    let analysis = AnalysisOfVariance::of(&design, &values).unwrap();
    assert_sources(&analysis, &[("speed", 1, 0.5, 0.03614457831325301, 0.8554863124110161)], (6, 83.0));
    assert_eq!(analysis.remarks, [Remark::OneSpacing, Remark::InseparableBlocks]);
}
