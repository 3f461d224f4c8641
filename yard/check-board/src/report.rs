//! The report: measured figures, beside simulated and proved ones.
//!
//! A [`Figure`] fails if it is outside its limits. It differs if it is within them, but farther from
//! the simulated figure than its tolerance. The simulated figures are in `simulated.json`, written by the same check of
//! two virtual Unos.

use serde::{Deserialize, Serialize};
use std::collections::BTreeMap;
use std::fmt::Write;
use std::ops::{Bound, RangeBounds};

/// The version of the report's form.
pub const FORM: u32 = 1;

/// The simulated figures, by the lines' ids.
const SIMULATED: &str = include_str!("simulated.json");

/// The verdict on a line.
#[derive(Clone, Copy, Debug, PartialEq, Eq, Serialize, Deserialize, strum::Display)]
#[serde(rename_all = "lowercase")]
#[strum(serialize_all = "lowercase")]
pub enum Verdict {
    /// Within its limits, and as simulated.
    Pass,
    /// Within its limits, and not as simulated.
    Differs,
    /// Outside its limits.
    #[strum(to_string = "FAIL")]
    Fail,
}

/// A figure.
#[derive(Clone, Debug, PartialEq, Serialize, Deserialize)]
pub struct Figure {
    /// Its name in files, which never changes.
    pub id: String,
    /// Its name.
    pub what: String,
    /// Its unit; empty for a count.
    pub unit: String,
    /// The measured value. `None` if the event never came, such as a pulse after a fault.
    pub measured: Option<f64>,
    /// The simulated value. `None` if none is recorded.
    pub simulated: Option<f64>,
    /// The proved value. `None` if there is no proof.
    pub proved: Option<f64>,
    /// The lowest valid value. `None` if there is no limit.
    pub lowest: Option<f64>,
    /// The highest.
    pub highest: Option<f64>,
    /// The tolerance against the simulated value.
    pub tolerance: f64,
    /// The result.
    pub verdict: Verdict,
}

impl Figure {
    /// A figure without limits, not yet judged. If `measured` is not finite, the event never came.
    pub fn new(id: impl Into<String>, what: impl Into<String>, unit: &str, measured: f64, tolerance: f64) -> Self {
        Self {
            id: id.into(),
            what: what.into(),
            unit: unit.to_owned(),
            // JSON has no other numbers.
            measured: measured.is_finite().then_some(measured),
            simulated: None,
            proved: None,
            lowest: None,
            highest: None,
            tolerance,
            verdict: Verdict::Pass,
        }
    }

    /// A figure without a unit or a tolerance.
    pub fn count(id: impl Into<String>, what: impl Into<String>, measured: f64) -> Self {
        Self::new(id, what, "", measured, 0.0)
    }

    /// The same, right within these limits.
    #[must_use]
    pub fn within(mut self, limits: impl RangeBounds<f64>) -> Self {
        let limit = |bound| match bound {
            Bound::Included(&value) | Bound::Excluded(&value) => Some(value),
            Bound::Unbounded => None,
        };
        (self.lowest, self.highest) = (limit(limits.start_bound()), limit(limits.end_bound()));
        self
    }

    /// The same, with its proved value.
    #[must_use]
    pub fn proved(mut self, proved: f64) -> Self {
        self.proved = Some(proved);
        self
    }

    fn verdict(&self, simulated: Option<f64>) -> Verdict {
        let is_within = |measured: &f64| {
            self.lowest.is_none_or(|lowest| *measured >= lowest)
                && self.highest.is_none_or(|highest| *measured <= highest)
        };
        match (self.measured.filter(is_within), simulated) {
            (None, _) => Verdict::Fail,
            (Some(measured), Some(simulated)) if (measured - simulated).abs() > self.tolerance => Verdict::Differs,
            (Some(_), _) => Verdict::Pass,
        }
    }
}

/// All measurements of a board.
#[derive(Clone, Debug, PartialEq, Serialize, Deserialize)]
pub struct Report {
    /// The version of this form.
    pub form: u32,
    /// The weeder's board, as named by the user; empty without a name.
    pub board: String,
    /// The weeder's firmware.
    pub firmware: String,
    /// The kind of check: `boards` or `simulated`.
    pub checked: String,
    /// Whether it was the brief check.
    pub brief: bool,
    /// The errors of the wires. If there are any, nothing else was measured.
    pub wires: Vec<String>,
    /// The figures.
    pub lines: Vec<Figure>,
}

impl Report {
    /// A report of these figures.
    pub fn new(firmware: &str, checked: &str, brief: bool, figures: Vec<Figure>) -> Self {
        let simulated = simulated(brief);
        let judge = |figure: Figure| {
            let simulated = simulated.get(&figure.id).copied();
            Figure { simulated, verdict: figure.verdict(simulated), ..figure }
        };
        Self {
            form: FORM,
            board: String::new(),
            firmware: firmware.to_owned(),
            checked: checked.to_owned(),
            brief,
            wires: Vec::new(),
            lines: figures.into_iter().map(judge).collect(),
        }
    }

    /// Reads a report, and checks its form. Files in `reports/` must have this form.
    ///
    /// # Errors
    /// If it is no report, has another form, or has verdicts that do not follow from its figures.
    pub fn parse(json: &str) -> Result<Self, String> {
        let report: Self = serde_json::from_str(json).map_err(|error| error.to_string())?;
        if report.form != FORM {
            return Err(format!("the form is {}, and {FORM} is known", report.form));
        }
        for line in &report.lines {
            if line.verdict(line.simulated) != line.verdict {
                return Err(format!("{}: the verdict does not follow from the figures", line.id));
            }
        }
        Ok(report)
    }

    /// The report as JSON.
    pub fn json(&self) -> String {
        // Numbers and texts are always JSON.
        serde_json::to_string_pretty(self).unwrap_or_default() + "\n"
    }

    /// Whether the wires are right, and no line failed.
    pub fn is_good(&self) -> bool {
        self.wires.is_empty() && self.lines.iter().all(|line| line.verdict != Verdict::Fail)
    }

    /// The page: one file of HTML, without external parts.
    pub fn page(&self) -> String {
        let mut page = String::from(HEAD);
        let mode = if self.brief { "brief check" } else { "whole check" };
        let _ = write!(
            page,
            "<p>{} Firmware {}, {}, {mode}.</p>",
            escaped(&self.board),
            escaped(&self.firmware),
            escaped(&self.checked)
        );
        for wrong in &self.wires {
            let _ = write!(page, "<p class=fail>{}</p>", escaped(wrong));
        }
        page.push_str("<table><tr><th>figure<th>simulated<th>proved<th>measured<th>right<th>unit<th>result</tr>\n");
        for line in &self.lines {
            let _ = writeln!(
                page,
                "<tr class={:?}><td>{}<td>{}<td>{}<td>{}<td>{}<td>{}<td>{}</tr>",
                line.verdict.to_string().to_lowercase(),
                escaped(&line.what),
                number(line.simulated),
                number(line.proved),
                measured(line),
                limits(line),
                escaped(&line.unit),
                line.verdict
            );
        }
        page.push_str("</table>\n");
        page
    }

    /// The report as text, a line for each figure.
    pub fn text(&self) -> String {
        let mut text = String::new();
        for wrong in &self.wires {
            let _ = writeln!(text, "WIRE  {wrong}");
        }
        for line in &self.lines {
            let _ = writeln!(
                text,
                "{:8} {:<58} {:>10} {:<7} simulated {:>9}  proved {:>7}  right {}",
                line.verdict,
                line.what,
                measured(line),
                line.unit,
                number(line.simulated),
                number(line.proved),
                limits(line)
            );
        }
        text
    }
}

/// The simulation's figures by their ids, of the brief check or the whole.
fn simulated(brief: bool) -> BTreeMap<String, f64> {
    let both: BTreeMap<String, BTreeMap<String, f64>> = serde_json::from_str(SIMULATED).unwrap_or_default();
    both.get(if brief { "brief" } else { "whole" }).cloned().unwrap_or_default()
}

fn measured(line: &Figure) -> String {
    line.measured.map_or_else(|| "none".to_owned(), |measured| number(Some(measured)))
}

fn limits(line: &Figure) -> String {
    match (line.lowest, line.highest) {
        (Some(lowest), Some(highest)) => format!("{} to {}", number(Some(lowest)), number(Some(highest))),
        (Some(lowest), None) => format!("{} or more", number(Some(lowest))),
        (None, Some(highest)) => format!("{} or less", number(Some(highest))),
        (None, None) => String::new(),
    }
}

fn number(value: Option<f64>) -> String {
    let Some(value) = value else { return String::new() };
    let text = format!("{value:.4}");
    text.trim_end_matches('0').trim_end_matches('.').to_owned()
}

fn escaped(text: &str) -> String {
    text.replace('&', "&amp;").replace('<', "&lt;").replace('>', "&gt;")
}

const HEAD: &str = "<!doctype html>\n<html lang=en><meta charset=utf-8><meta name=viewport content='width=device-width'>\n\
    <title>Check of a board</title>\n<style>body{font-family:sans-serif;margin:2em;max-width:70em}\
    table{border-collapse:collapse}td,th{border:1px solid #999;padding:.3em .6em;text-align:left}\
    .fail{background:#fcc}.differs{background:#ffd}</style>\n<h1>Check of a board</h1>\n";

#[cfg(test)]
mod tests {
    use super::*;

    fn figure(measured: f64) -> Figure {
        Figure::new("width", "pulse < width", "us", measured, 1.0).within(1499.0..=1505.0)
    }

    #[test]
    fn a_figure_passes_differs_or_fails() {
        assert_eq!(figure(1500.0).verdict(Some(1500.5)), Verdict::Pass);
        assert_eq!(figure(1500.0).verdict(None), Verdict::Pass);
        assert_eq!(figure(1503.0).verdict(Some(1500.0)), Verdict::Differs);
        assert_eq!(figure(1540.0).verdict(Some(1540.0)), Verdict::Fail);
        assert_eq!(figure(f64::NAN).verdict(None), Verdict::Fail);
        assert_eq!(figure(f64::INFINITY).verdict(Some(1500.0)), Verdict::Fail);
    }

    #[test]
    fn a_report_is_read_as_it_was_written_and_a_changed_one_is_refused() {
        let report = Report::new("0.2.0", "boards", true, vec![figure(1500.0), figure(1540.0), figure(f64::INFINITY)]);
        let json = report.json();
        assert_eq!(Report::parse(&json).unwrap(), report);
        assert!(!report.is_good());
        assert!(Report::parse(&json.replace("\"fail\"", "\"pass\"")).is_err());
        assert!(Report::parse(&json.replace("\"form\": 1", "\"form\": 9")).is_err());
        assert!(report.page().contains("pulse &lt; width") && report.text().contains("FAIL"));
    }
}
