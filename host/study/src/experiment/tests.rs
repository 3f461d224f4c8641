//! The experiment: what its controllers come to in the presets, whatever the threads, the seed and the parameters.

use super::*;
use crate::evaluation::Analysis;
use field::conditions::{PARAMETERS, presets};

fn experiment(speeds_km_h: &[f64], preset: &str) -> Experiment {
    let conditions = Conditions::preset(preset).unwrap().unwrap();
    Experiment { speeds_km_h: speeds_km_h.to_vec(), replications: 1, ..Experiment::as_in_the_paper(conditions, 1) }
}

fn run(experiment: &Experiment) -> Vec<PlotOutcome> {
    experiment.run(&Engine::Twin, |_| ()).unwrap()
}

#[test]
fn the_result_does_not_depend_on_the_number_of_threads() {
    let experiment = experiment(&[2.0], "transplanted");
    let on = |threads: usize| {
        let pool = rayon::ThreadPoolBuilder::new().num_threads(threads).build().unwrap();
        pool.install(|| run(&experiment))
    };
    assert_eq!(on(1), on(3));
}

#[test]
fn a_controller_finds_the_same_field_whoever_else_takes_part() {
    let all = experiment(&[1.5], "transplanted");
    let alone = Experiment { controllers: vec![Treatment::Firmware], ..all.clone() };
    assert_eq!(records(&run(&all), Treatment::Firmware), records(&run(&alone), Treatment::Firmware));
}

#[test]
fn the_firmware_damages_no_plant_and_weeds_up_to_the_bound_where_the_papers_damages_more_the_faster_it_goes() {
    for seed in 1..=3 {
        let experiment = Experiment { seed, ..experiment(&[1.0, 1.5, 2.0, 2.5, 3.0, 3.5], "transplanted") };
        let totals = totals(&run(&experiment));
        let of = |controller| totals.iter().filter(move |total| total.controller == controller);
        for total in of(Treatment::Firmware) {
            assert_eq!((total.effect.damaged, total.canopies.reached, total.alarms), (0, 0, 0), "{total:?}");
            assert!(total.weedable_share - total.weeded_share < 0.05, "{total:?}");
        }
        assert!(of(Treatment::AllKnowing).all(|total| total.effect.damaged == 0));
        let damage: Vec<f64> = of(Treatment::Paper).map(Total::plant_damage_percent).collect();
        // A weed as wide as a plant takes its one slot at any speed; what comes too late grows with it.
        let (slow, fast) = damage.split_at(3);
        assert!(slow.iter().all(|percent| *percent < 1.0) && fast[0] > 1.0, "{damage:?}");
        assert!(fast.is_sorted() && fast[0] < fast[1] && fast[1] < fast[2], "{damage:?}");
    }
}

#[test]
fn whoever_knows_every_plant_damages_none_in_any_field_and_weeds_more_than_the_firmware() {
    for preset in presets() {
        let totals = totals(&run(&experiment(&[1.0, 2.5], preset)));
        for pair in totals.chunks(Treatment::ALL.len()) {
            let (firmware, all_knowing) = (pair[0], pair[3]);
            assert_eq!((firmware.controller, all_knowing.controller), (Treatment::Firmware, Treatment::AllKnowing));
            assert_eq!(all_knowing.effect.damaged, 0, "{preset}");
            assert!(all_knowing.weeded_share > firmware.weeded_share, "{preset}");
        }
    }
}

#[test]
fn whoever_damages_no_plant_weeds_no_more_than_the_bound_in_any_field() {
    for preset in presets() {
        for seed in 1..=3 {
            // Rows of their own: a plot with one damaged plant may weed more than its bound.
            let mut experiment = Experiment { seed, ..experiment(&[1.0, 2.5], preset) };
            experiment.conditions.set("plot.rows", 1.0).unwrap();
            for outcome in run(&experiment).iter().filter(|outcome| outcome.effect.damaged == 0) {
                let (share, bound) = (outcome.weeded_share, outcome.undamaged_share);
                assert!(share <= bound + 1e-3, "{preset}, {:?}: {share} of {bound}", outcome.controller);
            }
        }
    }
}

#[test]
fn a_shorter_stroke_that_the_firmware_is_told_weeds_more_and_reaches_no_canopy() {
    let mut shorter = experiment(&[2.5], "transplanted");
    let paper = totals(&run(&shorter))[0];
    for (setting, value) in [("servo_out_us", 1750.0), ("lead_out_ms", 150.0)] {
        shorter.conditions.set(setting, value).unwrap();
    }
    let shorter = totals(&run(&shorter))[0];
    assert_eq!((shorter.effect.damaged, shorter.canopies.reached), (0, 0), "{shorter:?}");
    assert!(shorter.weeded_share > paper.weeded_share + 0.05, "{shorter:?}, {paper:?}");
    // Too short for the canopies, and said to be.
    let mut stub = experiment(&[1.0], "transplanted");
    stub.conditions.set("servo_out_us", 1620.0).unwrap();
    let stub = totals(&run(&stub))[0];
    assert!(stub.canopies.reached > stub.canopies.all / 2, "{stub:?}");
}

#[test]
fn field_efficiency_falls_with_speed_as_the_paper_s_equation_has_it() {
    let outcomes = run(&Experiment { replications: 6, ..experiment(&[1.0, 1.5, 2.0, 2.5], "transplanted") });
    let analysis = Analysis::of(records(&outcomes, Treatment::Firmware)).unwrap();
    let slope = analysis.responses[3].model.as_ref().unwrap().term("speed").unwrap().clone();
    assert!((slope.estimate - -2.06).abs() < 3.0 * slope.standard_error + 0.5, "{slope:?}");
    for treatment in analysis.treatments() {
        let percent = treatment.mean.field_efficiency_percent;
        assert!((77.0..91.0).contains(&percent), "{percent} % at {} km/h", treatment.speed_km_h);
    }
}

#[test]
fn a_firmware_that_is_told_wrong_leads_damages_what_could_have_been_kept() {
    let mut experiment = experiment(&[3.5], "transplanted");
    for lead in ["lead_out_ms", "lead_in_ms"] {
        experiment.conditions.set(lead, 0.0).unwrap();
    }
    let totals = totals(&run(&experiment));
    assert!(totals[0].effect.damaged > 0 && totals[3].effect.damaged == 0, "{totals:?}");
}

#[test]
fn a_machine_that_outruns_its_beam_ends_in_alarms_and_not_in_a_clean_result() {
    let totals = totals(&run(&experiment(&[7.0], "transplanted")));
    assert!(totals[0].alarms > 0, "{totals:?}");
}

#[test]
fn no_parameter_at_an_end_of_its_range_upsets_a_trial() {
    for parameter in PARAMETERS.iter().filter(|parameter| !["plot.rows", "plot.row_m"].contains(&parameter.name)) {
        for end in [parameter.least, parameter.greatest] {
            let mut experiment = experiment(&[1.0, 4.0], "transplanted");
            let small = [("plot.rows", 1.0), ("plot.row_m", 4.0), ("machine.sweeps_a_side", 0.0)];
            for (name, value) in small.into_iter().chain([(parameter.name, end)]) {
                // Sweeps so wide would run through the next row, and are refused.
                let _ = experiment.conditions.set(name, value);
            }
            match experiment.run(&Engine::Twin, |_| ()) {
                Ok(outcomes) => assert!(
                    outcomes
                        .iter()
                        .all(|outcome| { outcome.record.check().is_ok() && outcome.weeded_share.is_finite() })
                ),
                Err(error) => {
                    let place = format!("{} = {end}", parameter.name);
                    let is_told = matches!(error, ExperimentError::TooClose { .. } | ExperimentError::TooShort { .. });
                    assert!(is_told, "{place}: {error}");
                }
            }
        }
    }
}

#[test]
fn every_plot_can_be_judged_like_a_real_one() {
    let outcomes = run(&experiment(&[1.0, 2.5], "weedy"));
    let analysis = Analysis::of(records(&outcomes, Treatment::Firmware)).unwrap();
    assert_eq!(analysis.records.len(), 4);
    assert!(analysis.performances.iter().all(|plot| plot.field_efficiency_percent < 100.0));
}
