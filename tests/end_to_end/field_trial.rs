//! The paper's experiment with the real firmware on the virtual Uno.

use field::conditions::Conditions;
use study::experiment::{ControllerKind, Engine, Experiment};
use uno_run::firmware;

/// Over all plots, in-row weeding may fall short of the servo's bound by this share of the ground. A single plot may
/// fall short by more: a weed as wide as a plant is kept, and one of them in these 7 m costs 3 %.
const SHORT_OF_BOUND: f64 = 0.05;

#[test]
fn the_firmware_damages_no_plant_and_weeds_nearly_to_the_bound() {
    let mut conditions = Conditions::default();
    conditions.set("plot.rows", 1.0).unwrap();
    conditions.set("plot.row_m", 7.0).unwrap();
    // The usual time of this servo: the bound assumes no more.
    conditions.set("lead_out_ms", 180.0).unwrap();
    let experiment = Experiment {
        replications: 1,
        controllers: vec![ControllerKind::Firmware],
        ..Experiment::as_in_the_paper(conditions, 2)
    };
    let outcomes = experiment.run(&Engine::Uno(firmware::build().unwrap()), |_| ()).unwrap();
    assert_eq!(outcomes.len(), 8);
    for outcome in &outcomes {
        assert!(outcome.effect.plants >= 10, "{outcome:?}");
        assert_eq!((outcome.effect.injured(), outcome.alarms), (0, 0), "{outcome:?}");
    }
    let short: f64 = outcomes.iter().map(|outcome| outcome.weedable_share - outcome.weeded_share).sum();
    assert!(short / (outcomes.len() as f64) < SHORT_OF_BOUND, "{outcomes:?}");
}
