//! The effect of each step of the manual in the simulated field.

use anyhow::Result;
use comfy_table::{CellAlignment, Table};
use experiments::experiment::{Engine, Experiment, Treatment, totals};
use field::conditions::{self, Conditions};
use link::set_up::steps;
use trial::by_the_manual::Novice;
use trial::report::number_table;

/// Plots of each spacing.
const REPLICATIONS: u32 = 10;

/// Selects the random fields and measurements.
const SEED: u64 = 1;

const SPEED_KM_H: f64 = 2.5;

/// The field, seed and speed.
pub fn about() -> String {
    format!(
        "Field {}, seed {SEED}, {SPEED_KM_H} km/h, {REPLICATIONS} replications at 50 and 60 cm.",
        conditions::DEFAULT
    )
}

/// A line for the machine from the box, and one after each step. The steps add up.
pub fn table() -> Result<Table> {
    let header = ["step", "", "ground of the\nrow weeded, %", "seen plants\ndamaged, %", "zones\nreached, %"];
    let mut table = number_table(header, 0);
    table.column_iter_mut().skip(1).take(1).for_each(|column| column.set_cell_alignment(CellAlignment::Left));
    let field = Conditions::load(conditions::DEFAULT)?;
    let mut novice = Novice::new(field.from_the_box(), SEED);
    let mut line = |number: String, title: &str, conditions: &Conditions| {
        let experiment = Experiment {
            speeds_km_h: vec![SPEED_KM_H],
            replications: REPLICATIONS,
            controllers: vec![Treatment::Firmware],
            ..Experiment::as_in_the_paper(conditions.clone(), SEED)
        };
        for total in totals(&experiment.run(&Engine::Native, |_| ())?) {
            table.add_row([
                number.clone(),
                title.to_owned(),
                format!("{:.1}", 100.0 * total.plots.weeded_share),
                format!("{:.1}", total.damage_of_seen().percent()),
                format!("{:.1}", total.zones_reached_percent()),
            ]);
        }
        anyhow::Ok(())
    };
    line(String::new(), "straight from the box", &novice.conditions)?;
    for step in steps() {
        novice.follow(&step)?;
        line(step.number.to_string(), step.title, &novice.conditions)?;
    }
    Ok(table)
}
