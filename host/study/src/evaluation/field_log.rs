//! Joins a table of plots with the log of the machine: speed, time, plants and area of each plot come from the log.
//!
//! The stretches of work in the log are the plots in the order of their numbers, because a plan's plots are weeded in
//! that order. With false starts, or a plot in two parts, the user says which plot each stretch was.

use super::PlotRecord;
use crate::table::{Table, fixed, optional, short};
use anyhow::{Result, anyhow, bail, ensure};
use logbook::worked::Worked;
use serde::Serialize;

/// A measured speed that differs by this share from the planned one may belong to another plot.
const OFF_SPEED: f64 = 0.3;

/// What the log has of a plot.
#[derive(Clone, Debug, PartialEq, Serialize)]
pub struct OfLog {
    /// The plot's number.
    pub plot: u32,
    /// The first line of its first stretch, and the last line of its last one.
    pub lines: (u64, u64),
    /// From start to end of its stretches, in s. A pause counts, if no stretch of another plot lies between, and the log
    /// was not opened again. `None` if the log has a gap there.
    pub time_s: Option<f64>,
    /// Net distance by the wheel, m. `None` if a part of it is unknown.
    pub distance_m: Option<f64>,
    /// Mean speed while the machine rolled, km/h.
    pub speed_km_h: Option<f64>,
    /// The speed in the table, km/h.
    pub planned_km_h: f64,
    /// Plants that the tool passed.
    pub plants: Option<u32>,
    /// Damaged plants in the table, if it has no number of plants.
    #[serde(skip)]
    pub damaged: Option<u32>,
    /// Swings out of the row. `None` if the log has a gap there.
    pub swings: Option<u32>,
}

impl OfLog {
    /// `parts` are the plot's stretches, those without another plot or another session between together.
    fn of(record: &PlotRecord, parts: &[&[(u32, &Worked)]]) -> Self {
        let stretches: Vec<&Worked> = parts.iter().copied().flatten().map(|(_, worked)| *worked).collect();
        let (first, last) = (&stretches[0], &stretches[stretches.len() - 1]);
        let time_ms = |part: &&[(u32, &Worked)]| {
            let (first, last) = (part[0].1, part[part.len() - 1].1);
            (first.gaps.start == last.gaps.end).then(|| last.time_ms.end.saturating_sub(first.time_ms.start))
        };
        let distance_m = stretches.iter().map(|worked| worked.distance_mm).sum::<Option<f64>>().map(|mm| mm / 1000.0);
        let rolled_h = stretches.iter().map(|worked| worked.rolled_ms).sum::<u64>() as f64 / 3.6e6;
        let path_km = stretches.iter().map(|worked| worked.path_mm).sum::<f64>() / 1e6;
        Self {
            plot: record.plot,
            lines: (first.lines.start, last.lines.end - 1),
            time_s: parts.iter().map(time_ms).sum::<Option<u64>>().map(|ms| ms as f64 / 1000.0),
            distance_m,
            speed_km_h: distance_m.filter(|_| rolled_h > 0.0 && path_km > 0.0).map(|_| path_km / rolled_h),
            planned_km_h: record.speed_km_h,
            plants: stretches.iter().map(|worked| worked.plants).sum(),
            damaged: record.damaged.filter(|_| record.plants.is_none()),
            swings: stretches.iter().map(|worked| worked.gaps.is_empty().then_some(worked.swings)).sum(),
        }
    }

    /// Says that the log has a gap there, or that its speed is far from the planned one.
    pub fn warning(&self) -> Option<String> {
        if self.time_s.is_none() {
            return Some(format!("plot {}: the log has a gap there: fill in the empty cells yourself", self.plot));
        }
        let speed_km_h = self.speed_km_h?;
        let is_far = (speed_km_h - self.planned_km_h).abs() > OFF_SPEED * self.planned_km_h;
        is_far.then(|| {
            format!(
                "plot {}: the log has {speed_km_h:.2} km/h, and the table {}: is this stretch another plot? --plots says which",
                self.plot, self.planned_km_h
            )
        })
    }

    /// Says that the log has fewer plants than are damaged. The table does not get their number.
    pub fn too_few_plants(&self) -> Option<String> {
        let (plants, damaged) = self.plants.zip(self.damaged).filter(|(plants, damaged)| plants < damaged)?;
        Some(format!("plot {}: plants in the log: {plants}, damaged: {damaged}: count the plants yourself", self.plot))
    }
}

/// Joins the plots with the stretches of work in a log. `plots` has the plot of each stretch, and 0 for none. It may be
/// empty if there are as many stretches as plots. Cells of the table that are filled in stay, but speeds are those of the
/// log.
///
/// # Errors
/// If the numbers do not match, with the stretches; a plot has no number of its own, or is not in the table.
pub fn join(records: &mut [PlotRecord], stretches: &[Worked], plots: &[u32]) -> Result<Vec<OfLog>> {
    if let Some(PlotRecord { replication, speed_km_h, spacing_cm, .. }) = records.iter().find(|of| of.plot == 0) {
        bail!(
            "replication {replication} of {speed_km_h} km/h and {spacing_cm} cm has no number of its own: \
             the column plot has to number each plot once, from 1, or be empty"
        );
    }
    let mut numbers: Vec<u32> = records.iter().map(|record| record.plot).collect();
    numbers.sort_unstable();
    let plots = if plots.is_empty() { &numbers } else { plots };
    ensure!(
        plots.len() == stretches.len(),
        "stretches of work in the log: {}, plots: {}. Say which plot each stretch is, such as `--plots 1,0,2`, \
         with 0 for none and a plot twice if it was weeded in two parts: {}",
        stretches.len(),
        plots.len(),
        list(stretches)
    );
    if let Some(unknown) = plots.iter().find(|&&plot| plot > 0 && !numbers.contains(&plot)) {
        return Err(anyhow!("plot {unknown} is not in the table, which has {} plots", records.len()));
    }
    // A stretch of no plot divides none: between two rows of a plot, the run-up is a part of the turn.
    let stretches: Vec<(u32, &Worked)> = plots.iter().copied().zip(stretches).filter(|(plot, _)| *plot > 0).collect();
    let mut joined = Vec::new();
    for record in records {
        let parts = stretches.chunk_by(|(one, a), (next, b)| one == next && a.session == b.session);
        let parts: Vec<_> = parts.filter(|part| part[0].0 == record.plot).collect();
        if parts.is_empty() {
            continue;
        }
        let of_log = OfLog::of(record, &parts);
        let m2 = |width_m: f64| of_log.distance_m.map(|m| m * width_m).filter(|m2| *m2 > 0.0);
        record.speed_km_h = of_log.speed_km_h.unwrap_or(record.speed_km_h);
        record.time_s = record.time_s.or(of_log.time_s.filter(|time_s| *time_s > 0.0));
        record.plants = record.plants.or(of_log.plants.filter(|_| of_log.too_few_plants().is_none()));
        record.area_m2 = record.area_m2.or_else(|| m2(record.width_m?));
        joined.push(of_log);
    }
    Ok(joined)
}

fn list(stretches: &[Worked]) -> String {
    let line = |(number, worked): (usize, &Worked)| {
        let Worked { lines, time_ms, distance_mm, .. } = worked;
        let seconds = time_ms.end.saturating_sub(time_ms.start) as f64 / 1000.0;
        let metres = optional(distance_mm.map(|mm| mm / 1000.0), |m| fixed(m, 1));
        format!("stretch {number} from line {} of the log, {seconds:.0} s, {metres} m", lines.start)
    };
    (1..).zip(stretches).map(line).collect::<Vec<_>>().join("; ")
}

/// A table of what the log has.
pub fn of_log_table(joined: &[OfLog]) -> Table {
    let header = ["plot", "lines of the log", "time, s", "distance, m", "speed, km/h", "plants", "swings"];
    let rows = joined.iter().map(|of_log| {
        let OfLog { plot, lines: (first, last), time_s, distance_m, speed_km_h, plants, swings, .. } = of_log;
        vec![
            plot.to_string(),
            format!("{first} to {last}"),
            optional(*time_s, |s| fixed(s, 1)),
            optional(*distance_m, |m| fixed(m, 2)),
            optional(*speed_km_h, |km_h| fixed(km_h, 2)),
            optional(plants.map(f64::from), short),
            optional(swings.map(f64::from), short),
        ]
    });
    Table { rows: rows.collect(), ..Table::new("What the log has of each plot", header) }
}

#[cfg(test)]
mod tests {
    use super::*;

    fn stretch(start_s: u64, seconds: u64, metres: f64) -> Worked {
        Worked {
            lines: start_s..start_s + seconds,
            session: 0,
            gaps: 0..0,
            time_ms: 1000 * start_s..1000 * (start_s + seconds),
            rolled_ms: 1000 * seconds,
            path_mm: 1000.0 * metres,
            distance_mm: Some(1000.0 * metres),
            plants: Some(metres as u32 * 2),
            swings: metres as u32,
        }
    }

    fn plot(plot: u32, speed_km_h: f64) -> PlotRecord {
        PlotRecord { plot, replication: 1, speed_km_h, spacing_cm: 50.0, width_m: Some(0.4), ..PlotRecord::default() }
    }

    #[test]
    fn stretches_follow_plot_numbers_and_keep_filled_cells() {
        // The table was sorted by speed.
        let mut records = [PlotRecord { plants: Some(61), ..plot(2, 1.0) }, plot(1, 1.8)];
        let joined = join(&mut records, &[stretch(0, 60, 30.0), stretch(100, 108, 30.0)], &[]).expect("they match");
        assert_eq!(joined.iter().map(|of| (of.plot, of.swings)).collect::<Vec<_>>(), [(2, Some(30)), (1, Some(30))]);
        // 30 m in 60 s are 1.8 km/h, and in 108 s are 1.
        let [second, first] = records;
        assert!((first.speed_km_h - 1.8).abs() < 1e-9 && (second.speed_km_h - 1.0).abs() < 1e-9, "{records:?}");
        assert_eq!((first.plants, second.plants), (Some(60), Some(61)));
        assert_eq!((first.time_s, first.area_m2.map(|m2| m2.round())), (Some(60.0), Some(12.0)));
        assert!(joined.iter().all(|of| of.warning().is_none()), "{joined:?}");
    }

    #[test]
    fn a_plot_in_two_parts_and_a_false_start_are_joined_as_the_user_says() {
        let stretches = [stretch(0, 2, 0.5), stretch(10, 30, 15.0), stretch(50, 30, 15.0), stretch(200, 60, 30.0)];
        let mut records = [plot(1, 1.8), plot(2, 1.8)];
        let error = join(&mut records, &stretches, &[]).expect_err("there are four").to_string();
        assert!(error.starts_with("stretches of work in the log: 4, plots: 2."), "{error}");
        assert!(error.ends_with("; stretch 4 from line 200 of the log, 60 s, 30.0 m"), "{error}");
        let joined = join(&mut records, &stretches, &[0, 1, 1, 2]).expect("they match");
        // With the pause between the two parts.
        assert_eq!((joined[0].time_s, joined[0].distance_m), (Some(70.0), Some(30.0)));
        assert!((records[0].speed_km_h - 1.8).abs() < 1e-9);
        // Pushed back 5 m, and rolled on: 40 m in 80 s.
        let mut pushed_back = [plot(1, 1.8)];
        let stretches_back = [Worked { path_mm: 40_000.0, ..stretch(0, 80, 30.0) }];
        join(&mut pushed_back, &stretches_back, &[]).expect("they match");
        assert!((pushed_back[0].speed_km_h - 1.8).abs() < 1e-9 && pushed_back[0].area_m2 == Some(12.0));
        let joined = join(&mut records, &stretches, &[1, 2, 1, 0]).expect("they match");
        assert_eq!((joined[0].time_s, joined[0].distance_m), (Some(32.0), Some(15.5)), "without the other plot");
        let joined = join(&mut records, &stretches, &[1, 0, 1, 2]).expect("they match");
        assert_eq!((joined[0].time_s, joined[0].distance_m), (Some(80.0), Some(15.5)), "with a run-up between");
        // The clock began again, so the pause is unknown.
        let again = [stretch(10, 30, 15.0), Worked { session: 1, ..stretch(60, 40, 20.0) }];
        let joined = join(&mut records, &again, &[1, 1]).expect("they match");
        assert_eq!((joined[0].time_s, joined[0].distance_m), (Some(70.0), Some(35.0)));
        let error = join(&mut records, &stretches, &[0, 1, 3, 2]).expect_err("there is no plot 3").to_string();
        assert_eq!(error, "plot 3 is not in the table, which has 2 plots");
        let error = join(&mut [plot(1, 1.8), plot(0, 2.5)], &stretches[..2], &[]).expect_err("one has no number");
        assert!(
            error.to_string().starts_with("replication 1 of 2.5 km/h and 50 cm has no number of its own:"),
            "{error}"
        );
    }

    #[test]
    fn a_gap_in_the_log_is_reported_and_leaves_the_time_empty() {
        let lost = Worked { gaps: 0..1, distance_mm: None, plants: None, ..stretch(0, 60, 30.0) };
        let behind = Worked { gaps: 1..1, ..stretch(50, 30, 15.0) };
        for (stretches, distance_m, swings) in
            [(vec![lost], None, None), (vec![stretch(0, 30, 15.0), behind], Some(30.0), Some(30))]
        {
            let mut records = [plot(1, 1.8)];
            let joined = join(&mut records, &stretches, &vec![1; stretches.len()]).expect("they match");
            let of = &joined[0];
            assert_eq!((of.time_s, of.distance_m, of.swings, records[0].time_s), (None, distance_m, swings, None));
            assert!(of.warning().is_some_and(|said| said.starts_with("plot 1: the log has a gap there:")));
        }
    }

    #[test]
    fn fewer_plants_in_the_log_than_damaged_ones_are_told_and_not_taken() {
        // The log has 60 plants.
        for (damaged, counted, taken, is_told) in
            [(61, None, None, true), (60, None, Some(60), false), (61, Some(65), Some(65), false)]
        {
            let mut records = [PlotRecord { damaged: Some(damaged), plants: counted, ..plot(1, 1.8) }];
            let joined = join(&mut records, &[stretch(0, 60, 30.0)], &[]).expect("they match");
            assert_eq!((records[0].plants, joined[0].too_few_plants().is_some()), (taken, is_told));
        }
    }

    #[test]
    fn a_speed_far_from_the_plan_is_reported() {
        let mut records = [plot(1, 3.0)];
        let joined = join(&mut records, &[stretch(0, 60, 30.0)], &[]).expect("they match");
        assert!(joined[0].warning().is_some_and(|said| said.contains("the log has 1.80 km/h, and the table 3:")));
        let mut records = [plot(1, 3.0)];
        let unknown = Worked { distance_mm: None, plants: None, ..stretch(0, 60, 30.0) };
        let joined = join(&mut records, &[unknown], &[]).expect("they match");
        assert_eq!((joined[0].speed_km_h, joined[0].warning()), (None, None));
        assert_eq!((records[0].speed_km_h, records[0].plants, records[0].area_m2), (3.0, None, None));
    }
}
