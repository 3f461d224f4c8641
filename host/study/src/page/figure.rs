//! The page's figures: their charts and legends, and texts for readers who cannot see the charts.

use super::chart::{Chart, Look, Series, key, range_of};
use crate::evaluation::{Analysis, Response, ResponseAnalysis};
use crate::table::{distinct, short, visible};
use anyhow::Result;

/// A chart with its texts.
pub struct Figure {
    /// The title.
    pub title: String,
    /// The unit of the y axis, or the total of its share.
    pub unit: String,
    /// The chart.
    pub svg: String,
    /// The mark and the name of each series.
    pub legend: Vec<(String, String)>,
    /// The chart in words.
    pub words: String,
    /// The caption.
    pub caption: String,
}

impl Figure {
    /// A chart whose legend has these series.
    fn of<'a>(
        [title, unit, caption]: [&str; 3],
        words: String,
        chart: &Chart,
        legend: impl IntoIterator<Item = &'a Series>,
    ) -> Result<Self> {
        let entry = |series: &Series| Ok((key(series.look, !series.line.is_empty())?, series.name.clone()));
        let legend = legend.into_iter().map(entry).collect::<Result<_>>()?;
        Ok(Self { title: title.into(), unit: unit.into(), svg: chart.svg()?, legend, words, caption: caption.into() })
    }
}

const SPEED: &str = "speed, km/h";

/// A measure of several controllers against speed, and its upper limit if it has one.
pub fn curves(texts: [&str; 3], curves: &[Series], limit: Option<&Series>) -> Result<Figure> {
    let all = || curves.iter().chain(limit);
    let points = || all().flat_map(|curve| &curve.line);
    let chart = Chart {
        x_label: SPEED,
        x: range_of(points().map(|point| point.0), false),
        y: range_of(points().map(|point| point.1), true),
        // The first series is drawn last: it stays visible where lines meet.
        series: curves.iter().rev().collect(),
        limit,
    };
    Figure::of(texts, against_speed(texts[0], texts[1], all().map(said)), &chart, all())
}

/// One measure of a trial against speed, a line a spacing through the means, with the plots around them.
pub fn response(analysis: &Analysis, response: Response) -> Result<Figure> {
    let treatments = analysis.treatments();
    let spacings = spacings_cm(analysis);
    let speeds = analysis.records.iter().map(|record| record.speed_km_h);
    let x = range_of(speeds.chain(analysis.levels_km_h.iter().copied()), false);
    // An offset, so that equal values of different spacings stay visible.
    let step = (x.end - x.start) * 0.02;
    let aside = |index: usize| (index as f64 - (spacings.len() - 1) as f64 / 2.0) * step;
    let of_spacing = |(index, &spacing_cm): (usize, &f64)| {
        let moved = |(speed_km_h, value): (f64, f64)| (speed_km_h + aside(index), value);
        let treatments = treatments.iter().filter(|treatment| treatment.spacing_cm == spacing_cm);
        let means = treatments.filter_map(|of| Some((of.speed_km_h, response.value(&of.mean)?)));
        let plots = analysis.records.iter().filter(|record| record.spacing_cm == spacing_cm);
        let cloud = plots.filter_map(|plot| Some(moved((plot.speed_km_h, response.value(&plot.performance())?))));
        let means = Series { line: means.collect(), cloud: cloud.collect(), ..Series::of_spacing(index, spacing_cm) };
        let words = said(&means);
        (words, Series { line: means.line.into_iter().map(moved).collect(), ..means })
    };
    let (words, series): (Vec<String>, Vec<Series>) = spacings.iter().enumerate().map(of_spacing).unzip();
    let values = series.iter().flat_map(|series| &series.cloud).map(|point| point.1);
    let y = range_of(values, response == Response::PlantDamage);
    let chart = Chart { x_label: SPEED, x, y, series: series.iter().collect(), limit: None };
    let (title, unit) = (response.title(), response.unit());
    // Its figures 8 to 11 have the measures in their order.
    let caption = format!("The paper's Fig. {}.", 8 + response as usize);
    Figure::of([title, unit, &caption], against_speed(title, unit, words), &chart, &series)
}

/// A model's residuals against its fitted values; `None` without a model.
pub fn residuals(analysis: &Analysis, of: &ResponseAnalysis) -> Result<Option<Figure>> {
    let Ok(model) = &of.model else { return Ok(None) };
    let x = range_of(model.fitted.iter().copied(), false);
    let zero = Series { line: vec![(x.start, 0.0), (x.end, 0.0)], ..Series::of("", Look::LIMIT) };
    let of_spacing = |(index, spacing_cm): (usize, f64)| {
        let points = model.fitted.iter().copied().zip(model.residuals.iter().copied());
        let of_spacing = points.zip(&of.plots).filter(|(_, plot)| analysis.records[**plot].spacing_cm == spacing_cm);
        Series { cloud: of_spacing.map(|(point, _)| point).collect(), ..Series::of_spacing(index, spacing_cm) }
    };
    let series: Vec<Series> = spacings_cm(analysis).into_iter().enumerate().map(of_spacing).collect();
    let farthest = model.residuals.iter().fold(0.0, |farthest: f64, residual| farthest.max(residual.abs()));
    let unit = of.response.unit();
    let chart = Chart {
        x_label: &format!("by the model, {unit}"),
        x,
        y: range_of([-farthest, farthest], false),
        series: [&zero].into_iter().chain(&series).collect(),
        limit: None,
    };
    let words = format!(
        "Residuals of the {} plots against the model's values; the largest is {} {unit}.",
        model.residuals.len(),
        visible(farthest, 2),
    );
    let caption = "The residual of each plot. A curve or a funnel shows that a straight line is wrong.";
    Figure::of(["Residuals", unit, caption], words, &chart, &series).map(Some)
}

impl Series {
    /// The series of a plant spacing, without points.
    fn of_spacing(index: usize, spacing_cm: f64) -> Self {
        Self::of(&format!("{} cm plant spacing", short(spacing_cm)), Look::of_series(index))
    }
}

/// The spacings of a trial, narrow first.
fn spacings_cm(analysis: &Analysis) -> Vec<f64> {
    distinct(analysis.records.iter().map(|record| record.spacing_cm))
}

/// A chart of lines in words.
fn against_speed(title: &str, unit: &str, lines: impl IntoIterator<Item = String>) -> String {
    format!("{title} in {unit} against speed.{}", lines.into_iter().collect::<String>())
}

fn said(Series { name, line, .. }: &Series) -> String {
    let points: Vec<String> = line.iter().map(|(x, y)| format!("{} at {} km/h", visible(*y, 1), short(*x))).collect();
    format!(" {name}: {}.", points.join(", "))
}
