//! A trial's report as a page for a browser: one file with its charts and tables.
//!
//! [`Page`] is its content. The charts are SVG within the page. Its colours follow the reader's choice of light or
//! dark. It has no script and sends no request. It has no clock either, so the same trial gives the same page. The
//! texts and their order are in `templates/page.html`, and the style is in `templates/page.css`.

mod chart;
mod comparison;
mod figure;
mod losses;
mod response;

pub use self::comparison::{Comparison, ControllerCurve, ControllerPoint, Work};

use crate::evaluation::published::{MACHINES, PublishedMachine};
use crate::evaluation::{Analysis, Response};
use crate::table::{Table, fixed, optional, short};
use anyhow::{Context, Result, bail};
use askama::Template;
use figure::Figure;
use losses::Losses;
use response::Chapter;

/// A picture of one row along the ground, by [`trial::picture::draw`].
#[derive(Debug, Clone)]
pub struct RowPicture {
    /// The drawing, as SVG.
    pub drawing: String,
    /// Its content, in a sentence.
    pub caption: String,
}

/// A trial's report.
#[derive(Debug, Clone)]
pub struct Page<'a> {
    /// The trial's title.
    pub title: &'a str,
    /// The results in sentences, the most important one first.
    pub summary: Vec<String>,
    /// The command line that makes the same report again.
    pub command: &'a str,
    /// The other parameters of the trial, by name: the field, its seed, the engine, the version.
    pub parameters: &'a [(String, String)],
    /// The plots and their analysis.
    pub analysis: &'a Analysis,
    /// Controllers side by side; `None` for a real trial.
    pub comparison: Option<&'a Comparison>,
    /// One row of the trial; `None` for a real trial.
    pub row: Option<&'a RowPicture>,
}

impl Page<'_> {
    /// The page as HTML, a complete file.
    ///
    /// # Errors
    /// If a figure of the comparison is not finite, or plotters cannot draw.
    pub fn html(&self) -> Result<String> {
        let comparison = self.comparison.map(Headline::of).transpose()?;
        let analysis = self.analysis;
        let figures = Response::ALL.map(|response| figure::response(analysis, response));
        let sheet = Sheet {
            title: self.title,
            summary: &self.summary,
            command: self.command,
            comparison,
            figures: figures.into_iter().collect::<Result<_>>()?,
            row: self.row.map(|row| (row.drawing.clone(), row.caption.as_str())),
            chapters: analysis.responses.iter().map(|of| Chapter::of(analysis, of)).collect::<Result<_>>()?,
            means: analysis.means(),
            plots: analysis.plots(),
            parameters: parameters(self.parameters),
        };
        sheet.render().context("the page cannot be put together")
    }
}

/// The values for the template.
#[derive(Template)]
#[template(path = "page.html")]
struct Sheet<'a> {
    title: &'a str,
    summary: &'a [String],
    command: &'a str,
    comparison: Option<Headline>,
    figures: Vec<Figure>,
    row: Option<(String, &'a str)>,
    chapters: Vec<Chapter>,
    means: Table,
    plots: Table,
    parameters: Table,
}

/// The controllers side by side, as charts and as tables.
struct Headline {
    figures: [Figure; 3],
    tables: [Table; 3],
    losses: Option<Losses>,
    beside_others: Option<Table>,
}

impl Headline {
    fn of(comparison: &Comparison) -> Result<Self> {
        comparison.check()?;
        let of_controllers = |value: fn(&ControllerPoint) -> f64| {
            let curve = move |controller: &ControllerCurve| {
                let points = controller.points.iter().map(|point| (point.speed_km_h, value(point)));
                (controller.name.clone(), points.collect())
            };
            comparison.controllers.iter().map(curve).collect::<Vec<(String, Vec<(f64, f64)>)>>()
        };
        let damage = of_controllers(|point| point.plant_damage_percent);
        let zones = of_controllers(|point| point.zones_reached_percent);
        let mut weeding = of_controllers(|point| point.in_row_weeding_percent);
        if !comparison.bound.is_empty() {
            weeding.push((figure::BOUND.to_owned(), comparison.bound.clone()));
        }
        Ok(Self {
            figures: [figure::damage(comparison)?, figure::weeding(comparison)?, figure::zones(comparison)?],
            tables: [
                by_speed("Plants damaged by each controller, %", &damage),
                by_speed("Ground of the row weeded by each controller, %", &weeding),
                by_speed("Zones reached by each controller, %", &zones),
            ],
            losses: Losses::of(&comparison.work),
            beside_others: (!comparison.work.is_empty()).then(|| beside_others(&comparison.work)),
        })
    }
}

impl Comparison {
    /// Checks that every figure is finite. The error names controller and speed.
    fn check(&self) -> Result<()> {
        let of_controllers = self.controllers.iter().flat_map(|controller| {
            controller.points.iter().flat_map(|point| {
                let figures = [point.plant_damage_percent, point.zones_reached_percent, point.in_row_weeding_percent];
                figures.map(|value| (controller.name.as_str(), point.speed_km_h, value))
            })
        });
        let of_bound = self.bound.iter().map(|&(speed_km_h, value)| ("the bound", speed_km_h, value));
        let wrong = of_controllers.chain(of_bound).find(|(_, speed, value)| !(speed + value).is_finite());
        if let Some((what, speed_km_h, value)) = wrong {
            bail!("{what} is {value} at {speed_km_h} km/h: a report shows finite figures only");
        }
        Ok(())
    }
}

/// Curves over speed as a table, a row a speed.
fn by_speed(caption: &str, curves: &[(String, Vec<(f64, f64)>)]) -> Table {
    let mut speeds: Vec<f64> = curves.iter().flat_map(|(_, points)| points).map(|point| point.0).collect();
    speeds.sort_by(f64::total_cmp);
    speeds.dedup();
    let names = curves.iter().map(|(name, _)| name.as_str());
    let mut table = Table::new(caption, ["speed"].into_iter().chain(names));
    for speed in speeds {
        let at_speed = |points: &[(f64, f64)]| points.iter().find(|point| point.0 == speed).map(|point| point.1);
        let cells = curves.iter().map(|(_, points)| optional(at_speed(points), |value| fixed(value, 1)));
        table.rows.push([format!("{} km/h", short(speed))].into_iter().chain(cells).collect());
    }
    table
}

/// The simulated machine beside published ones, in their measures.
fn beside_others(work: &[Work]) -> Table {
    let columns = ["machine", "crop", "sees by", "speed, km/h", "weeds gone, %", "plants damaged, %", "source"];
    let mut table = Table { is_prose: true, ..Table::new("This machine, simulated, and machines in fields", columns) };
    for at in work {
        let gone = |percent: Option<f64>| optional(percent, |percent| fixed(percent, 1));
        table.rows.push(vec![
            "this firmware, SIMULATED".to_owned(),
            "the simulated field's".to_owned(),
            "a light beam".to_owned(),
            short(at.speed_km_h),
            format!("{} in the row, {} in the plot", gone(at.in_row_percent), gone(at.in_plot_percent)),
            format!("{} ({})", fixed(at.damage.percent(), 2), at.damage),
            "this report".to_owned(),
        ]);
    }
    let published = |machine: &PublishedMachine| {
        let PublishedMachine { name, crop, sees_by, speed_km_h, weeds_gone_percent, damaged_percent, source } =
            *machine;
        [name, crop, sees_by, speed_km_h, weeds_gone_percent, damaged_percent, source].map(str::to_owned).to_vec()
    };
    table.rows.extend(MACHINES.iter().map(published));
    table
}

fn parameters(parameters: &[(String, String)]) -> Table {
    let rows = parameters.iter().map(|(name, value)| vec![name.clone(), value.clone()]).collect();
    Table { rows, is_prose: true, ..Table::new("Parameters of the trial", ["parameter", "value"]) }
}
