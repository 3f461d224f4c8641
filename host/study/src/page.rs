//! A trial's report as a page for a browser: one file with its charts and tables.
//!
//! [`Page`] is its content. The charts are SVG within the page. Its colours follow the reader's choice of light or
//! dark. It has no script and sends no request. It has no clock either, so the same trial gives the same page. The
//! texts and their order are in `templates/page.html`, and the style is in `templates/page.css`.

mod chart;
mod figure;

use crate::evaluation::published::{Coefficients, MACHINES};
use crate::evaluation::{Analysis, Response, ResponseAnalysis};
use crate::experiment::{ControllerKind, Total};
use crate::statistics::{NoModel, mean};
use crate::table::{NOTHING, Table, distinct, fixed, optional, short, significant, visible};
use anyhow::{Context, Result};
use askama::Template;
use chart::{Look, Series};
use field::budget::Part;
use field::counted;
use figure::Figure;

/// A trial's report.
#[derive(Debug, Clone)]
pub struct Page<'a> {
    /// The trial's title.
    pub title: &'a str,
    /// The results in sentences, the most important one first.
    pub summary: Vec<String>,
    /// What differs from the paper's figures, in sentences.
    pub paper: Vec<String>,
    /// The command line that makes the same report again.
    pub command: &'a str,
    /// The other parameters of the trial, by name: the field, its seed, the engine, the version.
    pub parameters: &'a [(String, String)],
    /// The plots and their analysis.
    pub analysis: &'a Analysis,
    /// What the machine's log has of each plot; `None` without a log.
    pub log: Option<Table>,
    /// The totals of each controller, with growing speed; empty for a real trial.
    pub totals: &'a [Total],
    /// The first metres of a row, as SVG by [`uno_run::picture::draw`]; `None` for a real trial.
    pub row: Option<&'a str>,
}

impl Page<'_> {
    /// The page as HTML, a complete file.
    ///
    /// # Errors
    /// If plotters cannot draw.
    pub fn html(&self) -> Result<String> {
        /// Sentences on the first screen.
        const LEAD: usize = 2;
        let analysis = self.analysis;
        let figures = Response::ALL.map(|response| figure::response(analysis, response));
        let chapter = |of| Ok((of, figure::residuals(analysis, of)?));
        let (lead, further) = self.summary.split_at(self.summary.len().min(LEAD));
        let sheet = Sheet {
            page: self,
            lead,
            further,
            controllers: (!self.totals.is_empty()).then(|| Controllers::of(self.totals)).transpose()?,
            figures: figures.into_iter().collect::<Result<_>>()?,
            chapters: analysis.responses.iter().map(chapter).collect::<Result<_>>()?,
        };
        sheet.render().context("the page cannot be put together")
    }

    /// The results with their intervals, and where they are from.
    fn results(&self) -> Table {
        let records = &self.analysis.records;
        let damage = self.analysis.damage();
        let (value, basis) = match damage.of {
            0 => (NOTHING.to_owned(), "counted in no plot".to_owned()),
            of => (format!("{} %", damage.shown()), format!("{damage} %, {}, of {of} plants", damage.kind())),
        };
        let mut rows = vec![vec!["plants damaged".to_owned(), value, basis]];
        let efficiencies = records.iter().filter_map(|plot| plot.performance().weeding_efficiency_percent);
        let efficiencies: Vec<f64> = efficiencies.collect();
        if !efficiencies.is_empty() {
            // Plots of a block or treatment belong together, so the mean of all has no interval by their scatter.
            rows.push(vec![
                "weeds gone, as counted".to_owned(),
                format!("{} %", fixed(mean(&efficiencies), 1)),
                format!("mean of {}", counted(efficiencies.len(), "plot")),
            ]);
        }
        for total in self.totals.iter().filter(|total| total.plots.controller == ControllerKind::Firmware) {
            rows.push(vec![
                format!("row's ground weeded at {} km/h", short(total.speed_km_h())),
                format!("{} %", fixed(100.0 * total.plots.weeded_share, 1)),
                format!("with all margins kept at most {} %", fixed(100.0 * total.plots.weedable_share, 1)),
            ]);
        }
        let areas: Vec<f64> = records.iter().filter_map(|record| record.area_m2).collect();
        if !areas.is_empty() {
            let (area, plots) = (areas.iter().sum(), counted(areas.len(), "plot"));
            rows.push(vec!["ground".to_owned(), format!("{} m²", fixed(area, 0)), format!("in {plots}")]);
        }
        let from = self.parameters.iter().find(|(name, _)| ["field", "plots from"].contains(&name.as_str()));
        if let Some((name, value)) = from {
            let simulated = "simulated; its assumptions are under Repeat it";
            let basis = if self.totals.is_empty() { "counts and measurements" } else { simulated };
            rows.push(vec![name.clone(), value.clone(), basis.to_owned()]);
        }
        Table { rows, is_prose: true, ..Table::new("Result", ["measure", "value", "interval and basis"]) }
    }

    fn parameters(&self) -> Table {
        let rows = self.parameters.iter().map(|(name, value)| vec![name.clone(), value.clone()]).collect();
        Table { rows, is_prose: true, ..Table::new("Parameters of the trial", ["parameter", "value"]) }
    }
}

/// The values for the template.
#[derive(Template)]
#[template(path = "page.html")]
struct Sheet<'a> {
    page: &'a Page<'a>,
    /// The sentences of the first screen, and those below it.
    lead: &'a [String],
    further: &'a [String],
    controllers: Option<Controllers>,
    figures: Vec<Figure>,
    /// The analysis of each measure, and its residuals if it has a model.
    chapters: Vec<(&'a ResponseAnalysis, Option<Figure>)>,
}

/// The controllers side by side, as charts and as tables, and the firmware's machine beside others.
struct Controllers {
    figures: Vec<Figure>,
    tables: Vec<Table>,
    /// A bar a speed; none without the firmware.
    losses: Vec<Bar>,
    losses_table: Table,
    beside_others: Table,
}

/// A measure of the controllers: title, unit and caption of its chart, the caption of its table, and its value.
/// The value is `None` if there is nothing to count.
type Measure = ([&'static str; 3], &'static str, fn(&Total) -> Option<f64>);

const MEASURES: [Measure; 3] = [
    (
        [
            "Plant damage",
            "% of the plants",
            "Share of the plants whose stem zone a tool entered: the tool in the row, a sweep, or a tool or sweep of the next row. Plants that no beam sees are included. Lower is better.",
        ],
        "Plants damaged by each controller, %",
        |total| total.damage().percent(),
    ),
    (
        [
            "In-row weeding",
            "% of the row's ground",
            "Share of the row's ground that the tool worked. Higher is better, but above the line it costs margins or zones.",
        ],
        "Ground of the row weeded by each controller, %",
        |total| Some(100.0 * total.plots.weeded_share),
    ),
    (
        [
            "Zones reached",
            "% of the plants' zones",
            "Share of the zones over which the tool was not fully out. A zone is a plant's protected stretch without the margin. Lower is better.",
        ],
        "Zones reached by each controller, %",
        |total| total.zones_reached().percent(),
    ),
];

/// The name of the line below which a controller cuts no margin.
const BOUND: &str = "most with every zone and margin kept";

impl Controllers {
    fn of(totals: &[Total]) -> Result<Self> {
        let of = |controller| totals.iter().filter(move |total| total.plots.controller == controller);
        let curve = |name: &str, look, controller, value: fn(&Total) -> Option<f64>| Series {
            line: of(controller).filter_map(|total| Some((total.speed_km_h(), value(total)?))).collect(),
            ..Series::of(name, look)
        };
        // The largest share that this servo can weed is that of every controller.
        let first = totals.first().map_or(ControllerKind::Firmware, |total| total.plots.controller);
        let bound = curve(BOUND, Look::LIMIT, first, |total| Some(100.0 * total.plots.weedable_share));
        let present = || ControllerKind::ALL.into_iter().filter(|&controller| of(controller).next().is_some());
        let (mut figures, mut tables) = (Vec::new(), Vec::new());
        for ((chart, table, value), bound) in MEASURES.into_iter().zip([None, Some(bound), None]) {
            let looks = (0..).map(Look::of_series);
            let mut curves: Vec<Series> =
                present().zip(looks).map(|(one, look)| curve(one.title(), look, one, value)).collect();
            figures.push(figure::curves(chart, &curves, bound.as_ref())?);
            curves.extend(bound);
            tables.push(by_speed(table, &curves));
        }
        let firmware: Vec<&Total> = of(ControllerKind::Firmware).collect();
        Ok(Self {
            figures,
            tables,
            losses: firmware.iter().map(|total| Bar::of(total)).collect(),
            losses_table: losses(&firmware),
            beside_others: beside_others(&firmware),
        })
    }
}

/// Curves over speed as a table, a row a speed.
fn by_speed(caption: &str, curves: &[Series]) -> Table {
    let speeds = distinct(curves.iter().flat_map(|curve| &curve.line).map(|point| point.0));
    let names = curves.iter().map(|curve| curve.name.as_str());
    let mut table = Table::new(caption, ["speed"].into_iter().chain(names));
    for speed in speeds {
        let value = |curve: &Series| curve.line.iter().find(|point| point.0 == speed).map(|point| point.1);
        let cells = curves.iter().map(|curve| optional(value(curve), |value| visible(value, 1)));
        table.rows.push([format!("{} km/h", short(speed))].into_iter().chain(cells).collect());
    }
    table
}

/// The simulated machine beside published ones, in their measures.
fn beside_others(firmware: &[&Total]) -> Table {
    let columns = ["machine", "crop", "sees by", "speed, km/h", "weeds gone, %", "plants damaged, %", "source"];
    let mut table = Table { is_prose: true, ..Table::new("This machine, simulated, and machines in fields", columns) };
    for total in firmware {
        let gone = |percent: Option<f64>| optional(percent, |percent| fixed(percent, 1));
        let [in_row, in_plot] =
            [total.plots.effect.in_row, total.plots.effect.in_plot].map(|weeds| gone(weeds.efficiency_percent()));
        table.rows.push(vec![
            "this firmware, SIMULATED".to_owned(),
            "the simulated field's".to_owned(),
            "a light beam".to_owned(),
            short(total.speed_km_h()),
            format!("{in_row} in the row, {in_plot} in the plot"),
            format!("{} ({})", total.damage().shown(), total.damage()),
            "this report".to_owned(),
        ]);
    }
    table.rows.extend(MACHINES.iter().map(|machine| machine.split(" | ").map(str::to_owned).collect()));
    table
}

/// Parts narrower than this, in tenths of a percent, have no room for their figure in a bar.
const LEAST_LABELLED: u32 = 45;

/// The loss budget of one speed, as a stacked bar.
struct Bar {
    /// The speed.
    name: String,
    /// The bar in words.
    words: String,
    /// The key of each part that there is, its share in thousandths, and its label.
    pieces: Vec<(&'static str, u32, String)>,
}

impl Bar {
    fn of(total: &Total) -> Self {
        let name = format!("{} km/h", short(total.speed_km_h()));
        let parts = total.plots.budget.tenths().into_iter().filter(|(_, tenths)| *tenths > 0);
        let words: Vec<String> =
            parts.clone().map(|(part, tenths)| format!("{} {} %", part.title(), percent(tenths))).collect();
        let label = |tenths| if tenths < LEAST_LABELLED { String::new() } else { percent(tenths) };
        Self {
            words: format!("{name}: {}", words.join(", ")),
            name,
            pieces: parts.map(|(part, tenths)| (part.key(), tenths, label(tenths))).collect(),
        }
    }
}

fn losses(firmware: &[&Total]) -> Table {
    let titles = Part::ALL.map(|part| format!("{}, %", part.title()));
    let mut table = Table::new("Where the row's ground went", ["speed".to_owned()].into_iter().chain(titles));
    for total in firmware {
        let shares = total.plots.budget.tenths().map(|(_, tenths)| percent(tenths));
        let speed = format!("{} km/h", short(total.speed_km_h()));
        table.rows.push([speed].into_iter().chain(shares).collect());
    }
    table
}

fn percent(tenths: u32) -> String {
    fixed(f64::from(tenths) / 10.0, 1)
}

impl ResponseAnalysis {
    /// The model as an equation, or why there is none.
    fn equation(&self) -> Result<String, NoModel> {
        let model = self.model.as_ref().map_err(|why| *why)?;
        let estimate = |name| model.term(name).map(|term| term.estimate);
        Ok(self.written(["constant", "speed", "spacing"].map(estimate), significant))
    }

    /// The paper's equation. Empty if it is illegible.
    fn published_equation(&self) -> String {
        let Coefficients { constant, per_km_h, per_cm } = self.published.equation;
        self.written([constant, per_km_h, per_cm], short)
    }

    /// The measure as an equation. Empty if no coefficient is known.
    fn written(&self, coefficients: [Option<f64>; 3], said: fn(f64) -> String) -> String {
        let mut right = String::new();
        for (value, factor) in coefficients.into_iter().zip(["", " × speed", " × spacing"]) {
            let Some(value) = value else { continue };
            let sign = match (value < 0.0, right.is_empty()) {
                (true, true) => "\u{2212}",
                (true, false) => " \u{2212} ",
                (false, true) => "",
                (false, false) => " + ",
            };
            right += &format!("{sign}{}{factor}", said(value.abs()));
        }
        if right.is_empty() { right } else { format!("{} = {right}", self.response.title().to_lowercase()) }
    }
}
