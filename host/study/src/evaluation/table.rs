//! The plots of a trial as a CSV table, from a spreadsheet or a simulated trial.
//!
//! The columns are the fields of [`PlotRecord`], in any order. Other columns are ignored, but `plot` numbers the plots.
//! Lines that begin with `#` are comments. Every line is checked before any is used.

use super::plot::{COLUMNS, PlotRecord, whole};
use files::FileError;
use files::csv_table::{CsvTable, Line};
use std::collections::HashSet;
use std::path::Path;

pub(super) const LEAVE_OUT: &str = "to leave a plot out, put # in front of its line";

/// Reads the plots of a trial. A cell of a count or a measurement may be empty: the plot then takes part in what it has.
///
/// # Errors
/// Names the file, the line and the column, and what would be right. The errors are: a missing column, no plot, text in a
/// number, a value out of range, more damaged plants than plants, and a replication of a speed and spacing that occurs
/// twice.
pub fn read_csv(path: &Path) -> Result<Vec<PlotRecord>, FileError> {
    let table = CsvTable::read_with_gaps(path, &COLUMNS.map(|(name, ..)| name))?.with_optional(&["plot"])?;
    let numbers = numbers(&table);
    let mut plots: Vec<(u64, PlotRecord)> = Vec::new();
    for (line, number) in table.lines().zip(numbers) {
        let plot = PlotRecord { plot: number, ..PlotRecord::read(line)? };
        plot.check().map_err(|problem| line.error(format!("{problem}; {LEAVE_OUT}")))?;
        let treatment = |of: &PlotRecord| (of.replication, of.speed_km_h, of.spacing_cm);
        if let Some((first, _)) = plots.iter().find(|(_, other)| treatment(other) == treatment(&plot)) {
            return Err(line.error(format!(
                "replication {} of {} km/h and {} cm is already in line {first}: each plot needs its own replication",
                plot.replication, plot.speed_km_h, plot.spacing_cm
            )));
        }
        plots.push((line.number, plot));
    }
    Ok(plots.into_iter().map(|(_, plot)| plot).collect())
}

/// The number of each line's plot: by the column `plot`, or by the line if that column is empty. A plot that has no
/// number of its own in the column has 0.
fn numbers(table: &CsvTable) -> Vec<u32> {
    let is_numbered = table.lines().any(|line| !line.text("plot").is_empty());
    let mut seen = HashSet::from([0]);
    let mut own = |line: Line| whole(line, "plot").ok().filter(|number| seen.insert(*number)).unwrap_or_default();
    (1..).zip(table.lines()).map(|(number, line)| if is_numbered { own(line) } else { number }).collect()
}

#[cfg(test)]
mod tests {
    use super::*;
    use std::fs;

    const HEADER: &str =
        "replication,speed_km_h,spacing_cm,weeds_before,weeds_after,plants,damaged,area_m2,time_s,width_m,power_hp\n";
    const LINE: &str = "1,1.5,50,200,30,50,1,24,180,0.4,2.5\n";

    fn read(text: &str) -> Result<Vec<PlotRecord>, String> {
        let folder = tempfile::tempdir().unwrap();
        let path = folder.path().join("trial.csv");
        fs::write(&path, text).unwrap();
        read_csv(&path).map_err(|error| error.to_string().replace(&format!("{}/", folder.path().display()), ""))
    }

    #[test]
    fn columns_may_come_in_any_order_with_others_and_comments() {
        let columns: Vec<&str> = HEADER.trim().split(',').rev().collect();
        let values: Vec<&str> = LINE.trim().split(',').rev().collect();
        let text = format!("\u{feff}# a plot\n{},engine\n{},native\n", columns.join(","), values.join(","));
        assert_eq!(read(&text), read(&format!("{HEADER}{LINE}")));
    }

    #[test]
    fn a_plot_without_a_number_of_its_own_has_none() {
        let numbers = |plots: [&str; 4]| {
            let line = |(replication, plot): (u32, &str)| format!("{plot},{replication}{}", &LINE[1..]);
            let lines: String = (1..).zip(plots).map(line).collect();
            read(&format!("plot,{HEADER}{lines}")).unwrap().iter().map(|record| record.plot).collect::<Vec<_>>()
        };
        assert_eq!(numbers(["3", "1", "4", "2.0"]), [3, 1, 4, 2]);
        assert_eq!(numbers(["3", "1", "3", "P7"]), [3, 1, 0, 0]);
        assert_eq!(numbers(["0", "1", "", "2"]), [0, 1, 0, 2]);
        assert_eq!(numbers([""; 4]), [1, 2, 3, 4]);
        let error = read(&format!("Plot no,{HEADER}3,{LINE}")).unwrap_err();
        assert!(error.starts_with("trial.csv, line 1: the column `plot` is missing: did you mean plot by"), "{error}");
    }

    /// The error for a plot with this text in a column.
    #[track_caller]
    fn assert_refused(column: &str, cell: &str, said: &str) {
        let place = HEADER.trim().split(',').position(|name| name == column).unwrap();
        let mut cells: Vec<&str> = LINE.trim().split(',').collect();
        cells[place] = cell;
        let error = read(&format!("# a trial\n{HEADER}{}\n", cells.join(","))).unwrap_err();
        assert_eq!(error, format!("trial.csv, line 3: {column} is {said}"));
    }

    #[test]
    fn each_wrong_value_is_named_by_file_line_and_column() {
        for cell in ["fast", "nan", ""] {
            assert_refused("speed_km_h", cell, &format!("`{cell}`: it has to be a number, like 1.5"));
        }
        let said = "`-2`: it has to be a whole number, 0 or more, or empty if it was not counted";
        assert_refused("weeds_before", "-2", said);
        for (column, cell, right) in [
            ("speed_km_h", "0.05", "it has to be from 0.1 to 15 km/h"),
            ("spacing_cm", "0.5", "it has to be from 5 to 500 cm"),
            ("damaged", "51", "it cannot exceed plants"),
            ("area_m2", "0", "it has to be from 0.01 to 10000000 m2"),
            ("time_s", "0", "it has to be from 0.1 to 1000000000 s"),
            ("width_m", "0", "it has to be from 0.01 to 50 m"),
            ("power_hp", "-1", "it has to be from 0.001 to 1000 hp"),
        ] {
            let how = "to leave a plot out, put # in front of its line";
            assert_refused(column, cell, &format!("{cell}: {right}; {how}"));
        }
    }

    #[test]
    fn a_plan_is_read_before_it_is_filled_in() {
        let blank = read(&format!("# a trial\n{HEADER}1,1.5,50,,,,,24,,0.4,2.5\n")).unwrap();
        assert!(blank.iter().all(PlotRecord::is_blank), "{blank:?}");
    }
}
