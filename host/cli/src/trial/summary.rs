//! The result of a trial in sentences.

use super::{Study, of};
use field::tool_path::{Effect, unweeded_strip_mm};
use std::cmp::Ordering::Equal;
use study::evaluation::{Analysis, published};
use study::experiment::{self, ControllerKind, Experiment, PlotOutcome, Total};
use study::statistics::Share;

pub(super) fn summary(experiment: &Experiment, totals: &[Total]) -> Vec<String> {
    let mut sentences: Vec<String> =
        experiment.controllers.iter().map(|&controller| damage(totals, controller)).collect();
    if experiment.controllers.contains(&ControllerKind::Paper) {
        let (lowest, highest) = published::DAMAGED_PERCENT;
        sentences.push(format!(
            "The paper's controller is the paper's program on this machine. On its own machine the paper measured {lowest} to {highest} %. \
             `weeder trial --field paper` simulates that machine."
        ));
    }
    let alarms: u32 = of(totals, ControllerKind::Firmware).map(|total| total.plots.alarms).sum();
    if alarms > 0 {
        sentences.push(format!(
            "In {alarms} of {} rows an alarm took the firmware's tool out for the rest of the row. `alarms` counts them for each plot: exclude those plots.",
            experiment.rows()
        ));
    }
    let short_of_bound = of(totals, ControllerKind::Firmware)
        .map(|total| (total.plots.weedable_share - total.plots.weeded_share, total.speed_km_h()));
    let (most, km_h) = short_of_bound.max_by(|(one, _), (other, _)| one.total_cmp(other)).unwrap_or_default();
    let zone = match experiment.conditions.timing().stem_zone_mm {
        0 => "canopy".to_owned(),
        zone_mm => format!("zone of {zone_mm} mm round the stem"),
    };
    sentences.push(format!(
        "With each plant's {zone} and its margin kept, this servo could weed at most {:.1} points more of the row's ground than the \
         firmware did, at {km_h} km/h.",
        100.0 * most.max(0.0)
    ));
    let mut weeds = Effect::default();
    of(totals, ControllerKind::Firmware).for_each(|total| weeds += total.plots.effect);
    let Effect { damaged, unseen, swept, neighbours, .. } = weeds;
    if damaged + swept + neighbours > 0 {
        sentences.push(format!(
            "Of the plants that the firmware's machine damaged, the tool hit {damaged}. Sweeps cut {swept}, where the machine strays. The \
             beam cannot see {unseen} of these. Tool and sweeps cut {neighbours} in the next rows."
        ));
    }
    let strip_mm = unweeded_strip_mm(&experiment.conditions.machine(0), &experiment.conditions.machine);
    if strip_mm > 0.0 {
        sentences.push(format!(
            "Between tool and sweeps a strip of {strip_mm:.1} mm on either side of the row is not weeded: a tool of {:.0} mm would fill it.",
            2.0 * experiment.conditions.machine.sweep_from_mm
        ));
    }
    if let (Some(in_row), Some(in_plot)) = (weeds.in_row.efficiency_percent(), weeds.in_plot.efficiency_percent()) {
        sentences.push(format!(
            "Of the weeds in the row the firmware removed {in_row:.0} %; of all weeds of the plot, as the paper counts them, \
             {in_plot:.0} % were gone."
        ));
    }
    sentences
}

/// The field, its seeds and its rows, for the tables. Their lines have the speeds.
pub(super) fn about(study: &Study) -> String {
    let Study { experiment: Experiment { seed, seeds, conditions, spacings_cm, .. }, field, .. } = study;
    let seeds = if *seeds > 1 {
        format!("seeds {seed} to {}", seed.wrapping_add((seeds - 1).into()))
    } else {
        format!("seed {seed}")
    };
    let spacings: Vec<String> = spacings_cm.iter().map(f64::to_string).collect();
    let rows = study.experiment.rows();
    format!(
        "Field {field}, {seeds}: {rows} rows of {} m for each controller, plants {} cm apart.",
        conditions.plot.row_m,
        spacings.join(" and ")
    )
}

/// How many plants a controller damaged, and of several speeds the one with the highest share.
fn damage(totals: &[Total], controller: ControllerKind) -> String {
    let name = controller.title();
    let (damaged, plants) = of(totals, controller).fold((0, 0), |(damaged, plants), total| {
        (damaged + total.plots.effect.injured(), plants + total.plots.effect.plants)
    });
    if plants == 0 {
        return format!("Plants damaged by {name}: unknown, because no plant stands in the rows.");
    }
    let share = Share::of(damaged, plants);
    let count = if damaged == 0 { "none".to_owned() } else { damaged.to_string() };
    let mut said = format!("Plants damaged by {name}: {count} of {plants} ({share} %, {}).", share.kind());
    let percent = |total: &&Total| total.damage().percent();
    let worst = of(totals, controller).max_by(|a, b| percent(a).partial_cmp(&percent(b)).unwrap_or(Equal));
    if let Some(worst) = worst.filter(|_| damaged > 0 && of(totals, controller).count() > 1) {
        said += &format!(" The share is highest at {} km/h: {} %.", worst.speed_km_h(), worst.damage().shown());
    }
    said
}

/// The differences between the paper's controller here and in the paper, at the paper's speeds, and their reason.
pub(super) fn against_the_paper(outcomes: &[PlotOutcome]) -> Vec<String> {
    let (slowest, fastest) = published::SPEEDS_KM_H;
    let mut records = experiment::records(outcomes, ControllerKind::Paper);
    records.retain(|record| (slowest..=fastest).contains(&record.speed_km_h));
    let said = Analysis::of(records).map(|analysis| analysis.against_the_paper()).unwrap_or_default();
    if said.is_empty() {
        return said;
    }
    let reason = format!(
        "This is the paper's program at {slowest} to {fastest} km/h, on this report's machine and field. The paper prints no servo \
         times, canopies or straying, so these are assumed. Its own slopes contradict each other too."
    );
    [said, vec![reason]].concat()
}
