//! The plots of a trial as a CSV table, from a spreadsheet or a simulated trial.
//!
//! The columns are the fields of [`PlotRecord`], in any order. Other columns are ignored. Lines that begin with `#` are
//! comments. Every line is checked before any is used.

use super::plot::{COLUMNS, PlotRecord};
use files::FileError;
use files::csv_table::{CsvTable, Line};
use std::path::Path;

/// Reads the plots of a trial.
///
/// # Errors
/// Names the file, the line and the column, and what would be right. The errors are: a missing column, empty plots,
/// text in a number, a value out of range, more weeds after than before, more damaged plants than plants, and a
/// replication of a speed and spacing that occurs twice.
pub fn read_csv(path: &Path) -> Result<Vec<PlotRecord>, FileError> {
    let table = CsvTable::read(path, COLUMNS)?;
    let empty = |line: Line| COLUMNS.iter().find(|column| line.text(column).is_empty());
    let mut unfilled = table.lines().filter_map(|line| Some((line, empty(line)?)));
    if let Some((line, column)) = unfilled.next() {
        let (count, all) = (1 + unfilled.count(), table.lines().count());
        let verb = if count == 1 { "is" } else { "are" };
        return Err(line.error(format!("{count} of {all} plots {verb} not filled in: here {column} is empty")));
    }
    let mut plots: Vec<(u64, PlotRecord)> = Vec::new();
    for line in table.lines() {
        let plot = PlotRecord::read(line)?;
        plot.check().map_err(|problem| line.error(problem.to_string()))?;
        let same = |other: &PlotRecord| {
            (other.replication, other.speed_km_h, other.spacing_cm)
                == (plot.replication, plot.speed_km_h, plot.spacing_cm)
        };
        if let Some((first, _)) = plots.iter().find(|(_, other)| same(other)) {
            return Err(line.error(format!(
                "replication {} of {} km/h and {} cm is already in line {first}: each plot needs its own replication",
                plot.replication, plot.speed_km_h, plot.spacing_cm
            )));
        }
        plots.push((line.number(), plot));
    }
    Ok(plots.into_iter().map(|(_, plot)| plot).collect())
}

#[cfg(test)]
mod tests {
    use super::*;
    use std::fs;

    const HEADER: &str =
        "replication,speed_km_h,spacing_cm,weeds_before,weeds_after,plants,damaged,area_m2,time_s,width_m,power_hp\n";
    const LINE: &str = "1,1.5,50,200,30,50,1,24,180,0.4,2.5\n";

    /// The plots of a table with this text, or the error.
    fn read(text: &str) -> Result<Vec<PlotRecord>, String> {
        let folder = tempfile::tempdir().unwrap();
        let path = folder.path().join("trial.csv");
        fs::write(&path, text).unwrap();
        read_csv(&path).map_err(|error| error.to_string().replace(&format!("{}/", folder.path().display()), ""))
    }

    #[test]
    fn columns_may_come_in_any_order_with_others_comments_and_a_byte_order_mark() {
        let columns: Vec<&str> = HEADER.trim().split(',').rev().collect();
        let values: Vec<&str> = LINE.trim().split(',').rev().collect();
        let text = format!("\u{feff}# a plot\n{},engine\n{},native\n", columns.join(","), values.join(","));
        assert_eq!(read(&text), read(&format!("{HEADER}{LINE}")));
    }

    #[test]
    fn each_wrong_value_is_named_by_file_line_and_column() {
        for (wrong, said) in [
            ("1,fast,50,200,30,50,1,24,180,0.4,2.5", "speed_km_h is `fast`: it has to be a number, like 1.5"),
            ("1,nan,50,200,30,50,1,24,180,0.4,2.5", "speed_km_h is `nan`: it has to be a number, like 1.5"),
            ("1,,50,200,30,50,1,24,180,0.4,2.5", "1 of 1 plots is not filled in: here speed_km_h is empty"),
            ("1,0.05,50,200,30,50,1,24,180,0.4,2.5", "speed_km_h is 0.05: it has to be from 0.1 to 15 km/h"),
            ("1,1.5,0.5,200,30,50,1,24,180,0.4,2.5", "spacing_cm is 0.5: it has to be from 5 to 500 cm"),
            ("1,1.5,50,200,201,50,1,24,180,0.4,2.5", "weeds_after is 201: it cannot exceed weeds_before"),
            ("1,1.5,50,-2,30,50,1,24,180,0.4,2.5", "weeds_before is `-2`: it has to be a whole number, 1 or more"),
            (
                "1,1.5,50,0,0,50,1,24,180,0.4,2.5",
                "weeds_before is 0: without a weed before weeding there is no weeding efficiency",
            ),
            ("1,1.5,50,200,30,0,0,24,180,0.4,2.5", "plants is 0: without a plant there is no plant damage in percent"),
            ("1,1.5,50,200,30,50,51,24,180,0.4,2.5", "damaged is 51: it cannot exceed plants"),
            ("1,1.5,50,200,30,50,1,0,180,0.4,2.5", "area_m2 is 0: it has to be from 0.01 to 1000000 m2"),
            ("1,1.5,50,200,30,50,1,24,0,0.4,2.5", "time_s is 0: it has to be from 0.1 to 1000000 s"),
            ("1,1.5,50,200,30,50,1,24,180,0,2.5", "width_m is 0: it has to be from 0.01 to 50 m"),
            ("1,1.5,50,200,30,50,1,24,180,0.4,-1", "power_hp is -1: it has to be from 0.001 to 1000 hp"),
        ] {
            assert_eq!(read(&format!("# a trial\n{HEADER}{wrong}\n")), Err(format!("trial.csv, line 3: {said}")));
        }
    }
}
