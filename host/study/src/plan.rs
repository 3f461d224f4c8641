//! The plan of a field trial: the speed, spacing and order of the plots, randomised, and the table for the counts.
//!
//! A block has each treatment once, in random order. Neighbouring plots are alike, so the differences between blocks
//! can be separated from the treatments. Blocks are the replications of the table that [`crate::evaluation`] reads.

use crate::evaluation::{COLUMNS, PlotRecord};
use files::in_a_line;
use rand::SeedableRng;
use rand::seq::SliceRandom;
use rand_chacha::ChaCha8Rng;
use std::io;

/// The treatments of a trial.
#[derive(Clone, Debug, PartialEq)]
pub struct Plan {
    /// Forward speeds, km/h.
    pub speeds_km_h: Vec<f64>,
    /// Plant spacings, cm.
    pub spacings_cm: Vec<f64>,
    /// Blocks, each with every treatment once.
    pub blocks: u32,
    /// Working width, m, and power, hp, if they are known: they go into the table.
    pub width_m: Option<f64>,
    /// See `width_m`.
    pub power_hp: Option<f64>,
    /// Selects the random order.
    pub seed: u64,
}

impl Plan {
    /// The plots, numbered in the order in which they are weeded. A block is a replication. Counts and times are missing.
    pub fn plots(&self) -> Vec<PlotRecord> {
        let mut rng = ChaCha8Rng::seed_from_u64(self.seed);
        let of_block = |block: u32| {
            let mut treatments: Vec<(f64, f64)> = self
                .speeds_km_h
                .iter()
                .flat_map(|&speed| self.spacings_cm.iter().map(move |&spacing| (speed, spacing)))
                .collect();
            treatments.shuffle(&mut rng);
            treatments.into_iter().map(move |treatment| (block, treatment)).collect::<Vec<_>>()
        };
        let drawn = (1..=self.blocks).flat_map(of_block).zip(1..);
        let planned = |((replication, (speed_km_h, spacing_cm)), plot)| {
            let Self { width_m, power_hp, .. } = *self;
            PlotRecord { plot, replication, speed_km_h, spacing_cm, width_m, power_hp, ..PlotRecord::default() }
        };
        drawn.map(planned).collect()
    }

    /// Writes the table to be filled in, with `notes` above it, one a line. Unknown values are left empty.
    ///
    /// # Errors
    /// The errors of the writer.
    pub fn write_csv(&self, notes: &[String], mut to: impl io::Write) -> io::Result<()> {
        for note in notes {
            writeln!(to, "# {}", in_a_line(note))?;
        }
        writeln!(to, "plot,{}", COLUMNS.map(|(column, ..)| column).join(","))?;
        for plot in self.plots() {
            writeln!(to, "{},{}", plot.plot, plot.columns().map(|(_, value)| value).collect::<Vec<_>>().join(","))?;
        }
        Ok(())
    }

    /// Writes a page to print, with a sheet for each plot: where it is, what to do, and a box for each count.
    ///
    /// # Errors
    /// The errors of the writer.
    pub fn write_sheets(&self, mut to: impl io::Write) -> io::Result<()> {
        /// Columns that the plan fills in.
        const PLANNED: usize = 3;
        const HEAD: &str = "<!DOCTYPE html>\n<html lang=\"en\">\n<meta charset=\"utf-8\">\n\
            <title>Field trial, a sheet for each plot</title>\n\
            <style>body { font: 14pt sans-serif; margin: 2em } section { break-after: page; margin-bottom: 3em } \
            th { text-align: left; padding-right: 2em } \
            td { border: 1px solid; width: 12em; height: 1.8em; padding: 0 0.5em }</style>";
        writeln!(to, "{HEAD}")?;
        let plots = self.plots();
        for plot in &plots {
            let PlotRecord { plot: number, replication, speed_km_h, spacing_cm, .. } = plot;
            writeln!(
                to,
                "<section>\n<h1>Plot {number} of {}</h1>\n\
                 <p>Block {replication}. Weed it at <b>{speed_km_h} km/h</b>. Plants stand {spacing_cm} cm apart.</p>\n\
                 <p>Count weeds on the same marked ground before and after. Leave a box empty if you did not count.</p>\n\
                 <table>",
                plots.len()
            )?;
            for ((_, heading, ..), (column, value)) in COLUMNS.iter().zip(plot.columns()).skip(PLANNED) {
                writeln!(to, "<tr><th>{heading} <small>({column})</small></th><td>{value}</td></tr>")?;
            }
            writeln!(to, "<tr><th>remarks, who counted, when</th><td></td></tr>\n</table>\n</section>")?;
        }
        writeln!(to, "</html>")
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    fn plan(seed: u64) -> Plan {
        Plan {
            speeds_km_h: vec![1.0, 1.5, 2.0, 2.5],
            spacings_cm: vec![50.0, 60.0],
            blocks: 3,
            width_m: Some(0.4),
            power_hp: None,
            seed,
        }
    }

    #[test]
    fn each_block_has_every_treatment_once_in_an_order_of_its_own() {
        let plots = plan(1).plots();
        assert_eq!(plots.iter().map(|plot| plot.plot).collect::<Vec<_>>(), (1..=24).collect::<Vec<_>>());
        let orders: Vec<Vec<(f64, f64)>> = plots
            .chunks(8)
            .map(|block| block.iter().map(|plot| (plot.speed_km_h, plot.spacing_cm)).collect())
            .collect();
        let all = [1.0, 1.5, 2.0, 2.5].map(|speed| [50.0, 60.0].map(|spacing| (speed, spacing))).concat();
        assert!(orders.iter().all(|order| order.len() == 8 && all.iter().all(|treatment| order.contains(treatment))));
        assert!(orders[0] != orders[1] && orders[1] != orders[2]);
        assert!(plots.chunks(8).zip(1..).all(|(plots, block)| plots.iter().all(|plot| plot.replication == block)));
    }

    #[test]
    fn each_treatment_comes_first_as_often_as_any_other() {
        let first = |seed| plan(seed).plots()[0];
        let slow = (0..800).filter(|&seed| (first(seed).speed_km_h, first(seed).spacing_cm) == (1.0, 50.0)).count();
        // One of eight, within four standard deviations.
        assert!((62..=138).contains(&slow), "{slow} of 800");
    }

    #[test]
    fn a_note_stays_in_its_line() {
        let mut table = Vec::new();
        plan(1).write_csv(&["weeder plan --out 'a\nb.csv'".to_owned()], &mut table).unwrap();
        let table = String::from_utf8(table).unwrap();
        assert!(table.starts_with("# weeder plan --out 'a\\nb.csv'\nplot,replication,"), "{table}");
    }

    #[test]
    fn each_plot_has_a_sheet_with_a_box_for_each_count() {
        let mut page = Vec::new();
        plan(1).write_sheets(&mut page).unwrap();
        let page = String::from_utf8(page).unwrap();
        let sheets: Vec<&str> = page.split("<section>").skip(1).collect();
        assert_eq!(sheets.len(), 24);
        for (sheet, plot) in sheets.iter().zip(plan(1).plots()) {
            let speed = format!(
                "<h1>Plot {} of 24</h1>\n<p>Block {}. Weed it at <b>{} km/h</b>",
                plot.plot, plot.replication, plot.speed_km_h
            );
            assert!(sheet.contains(&speed), "{sheet}");
            assert_eq!(sheet.matches("<td></td>").count(), 8, "six counts and times, the power, and remarks: {sheet}");
            assert!(COLUMNS[3..].iter().all(|(column, ..)| sheet.contains(&format!("({column})"))), "{sheet}");
            assert!(sheet.contains("(width_m)</small></th><td>0.4</td>"), "{sheet}");
        }
    }
}
