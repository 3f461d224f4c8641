//! The page's figures: their charts and legends, and texts for readers who cannot see the charts.

use super::chart::{Chart, Look, Series, key, range_of};
use super::comparison::{Comparison, ControllerPoint};
use crate::evaluation::{Analysis, Response, ResponseAnalysis};
use crate::statistics::LinearModel;
use crate::table::{fixed, short};
use anyhow::Result;

/// A chart with its texts.
pub struct Figure {
    /// The title.
    pub title: String,
    /// The unit of the y axis, or the total of its share.
    pub unit: String,
    /// The chart.
    pub svg: String,
    /// The legend of lines and markers.
    pub legend: Vec<Key>,
    /// The chart in words.
    pub words: String,
    /// The caption.
    pub caption: String,
}

/// One entry of a legend.
pub struct Key {
    /// Line and marker.
    pub svg: String,
    /// Their series.
    pub meaning: String,
}

const SPEED: &str = "speed, km/h";

/// The name of the line below which a controller cuts no margin.
pub const BOUND: &str = "most with every zone and margin kept";

/// Plant damage of each controller against speed.
pub fn damage(comparison: &Comparison) -> Result<Figure> {
    let title = ("Plant damage", "% of the plants");
    let caption = "Share of the plants whose stem zone the tool entered. Lower is better.";
    curves(comparison, title, caption, |point| point.plant_damage_percent, &[])
}

/// Weeding in the row of each controller against speed.
pub fn weeding(comparison: &Comparison) -> Result<Figure> {
    let title = ("In-row weeding", "% of the row's ground");
    let caption = "Share of the row's ground that the tool worked. Higher is better, but above the line it costs margins or zones.";
    curves(comparison, title, caption, |point| point.in_row_weeding_percent, &comparison.bound)
}

/// Plants whose zone each controller's tool reached against speed.
pub fn zones(comparison: &Comparison) -> Result<Figure> {
    let title = ("Zones reached", "% of the plants' zones");
    let caption = "Share of the zones over which the tool was not fully out. A zone is a plant's protected stretch without the margin. Lower is better.";
    curves(comparison, title, caption, |point| point.zones_reached_percent, &[])
}

fn curves(
    comparison: &Comparison,
    (title, unit): (&str, &str),
    caption: &str,
    value: fn(&ControllerPoint) -> f64,
    limit: &[(f64, f64)],
) -> Result<Figure> {
    let mut series = Vec::new();
    let mut legend = Vec::new();
    let mut words = format!("{title} in {unit} against speed.");
    for (index, controller) in comparison.controllers.iter().enumerate() {
        let look = Look::of_series(index);
        let line: Vec<_> = controller.points.iter().map(|point| (point.speed_km_h, value(point))).collect();
        words += &said(&controller.name, &line);
        legend.push(Key { svg: key(look, true)?, meaning: controller.name.clone() });
        series.push(Series { look, line, cloud: Vec::new() });
    }
    if !limit.is_empty() {
        words += &said(BOUND, limit);
        legend.push(Key { svg: key(Look::LIMIT, true)?, meaning: BOUND.to_owned() });
    }
    // The first series is drawn last: it stays visible where lines meet.
    series.reverse();
    let points = || series.iter().flat_map(|series| &series.line).chain(limit);
    let chart = Chart {
        x_label: SPEED,
        x: range_of(points().map(|point| point.0), false),
        y: range_of(points().map(|point| point.1), true),
        series: &series,
        limit,
    };
    Ok(Figure { title: title.into(), unit: unit.into(), svg: chart.svg()?, legend, words, caption: caption.into() })
}

/// One measure of a trial against speed, a line a spacing through the means, with the plots around them.
pub fn response(analysis: &Analysis, response: Response) -> Result<Figure> {
    let treatments = analysis.treatments();
    let spacings = spacings_cm(analysis);
    let x = range_of(analysis.records.iter().map(|record| record.speed_km_h), false);
    // An offset, so that equal values of different spacings stay visible.
    let step = (x.end - x.start) * 0.02;
    let aside = |index: usize| (index as f64 - (spacings.len() - 1) as f64 / 2.0) * step;
    let mut series = Vec::new();
    let mut legend = Vec::new();
    let mut words = format!("{} in {} against speed.", response.title(), response.unit());
    for (index, &spacing_cm) in spacings.iter().enumerate() {
        let look = Look::of_series(index);
        let moved = |(speed_km_h, value): (f64, f64)| (speed_km_h + aside(index), value);
        let of_spacing = treatments.iter().filter(|treatment| treatment.spacing_cm == spacing_cm);
        let line: Vec<_> =
            of_spacing.map(|treatment| (treatment.speed_km_h, response.value(&treatment.mean))).collect();
        let plots = analysis.records.iter().zip(&analysis.performances);
        let cloud = plots
            .filter(|(record, _)| record.spacing_cm == spacing_cm)
            .map(|(record, performance)| moved((record.speed_km_h, response.value(performance))))
            .collect();
        let meaning = spacing(spacing_cm);
        words += &said(&meaning, &line);
        legend.push(Key { svg: key(look, true)?, meaning });
        series.push(Series { look, line: line.into_iter().map(moved).collect(), cloud });
    }
    let points = || series.iter().flat_map(|series| &series.cloud);
    let chart = Chart {
        x_label: SPEED,
        x,
        y: range_of(points().map(|point| point.1), response == Response::PlantDamage),
        series: &series,
        limit: &[],
    };
    Ok(Figure {
        title: response.title().into(),
        unit: response.unit().into(),
        svg: chart.svg()?,
        legend,
        words,
        caption: format!("The paper's Fig. {}.", paper_figure(response)),
    })
}

/// A model's residuals against its fitted values.
pub fn residuals(analysis: &Analysis, of: &ResponseAnalysis, model: &LinearModel) -> Result<Figure> {
    let x = range_of(model.fitted.iter().copied(), false);
    let mut series = vec![Series { look: Look::LIMIT, line: vec![(x.start, 0.0), (x.end, 0.0)], cloud: Vec::new() }];
    let mut legend = Vec::new();
    for (index, spacing_cm) in spacings_cm(analysis).into_iter().enumerate() {
        let look = Look::of_series(index);
        let points = model.fitted.iter().copied().zip(model.residuals.iter().copied());
        let of_spacing = points.zip(&analysis.records).filter(|(_, record)| record.spacing_cm == spacing_cm);
        legend.push(Key { svg: key(look, false)?, meaning: spacing(spacing_cm) });
        series.push(Series { look, line: Vec::new(), cloud: of_spacing.map(|(point, _)| point).collect() });
    }
    let farthest = model.residuals.iter().fold(0.0, |farthest: f64, residual| farthest.max(residual.abs()));
    let unit = of.response.unit();
    let label = format!("by the model, {unit}");
    let chart = Chart { x_label: &label, x, y: range_of([-farthest, farthest], false), series: &series, limit: &[] };
    Ok(Figure {
        title: "Residuals".into(),
        unit: unit.into(),
        svg: chart.svg()?,
        legend,
        words: format!(
            "Residuals of the {} plots against the model's values; the largest is {} {unit}.",
            model.residuals.len(),
            fixed(farthest, 2),
        ),
        caption: "The residual of each plot. A curve or a funnel shows that a straight line is wrong.".into(),
    })
}

/// The spacings of a trial, narrow first.
fn spacings_cm(analysis: &Analysis) -> Vec<f64> {
    let mut spacings: Vec<f64> = analysis.records.iter().map(|record| record.spacing_cm).collect();
    spacings.sort_by(f64::total_cmp);
    spacings.dedup();
    spacings
}

fn spacing(spacing_cm: f64) -> String {
    format!("{} cm plant spacing", short(spacing_cm))
}

/// A line in words.
fn said(name: &str, line: &[(f64, f64)]) -> String {
    let points: Vec<String> = line.iter().map(|(x, y)| format!("{} at {} km/h", fixed(*y, 1), short(*x))).collect();
    format!(" {name}: {}.", points.join(", "))
}

fn paper_figure(response: Response) -> u32 {
    match response {
        Response::PlantDamage => 8,
        Response::WeedingEfficiency => 9,
        Response::PerformanceIndex => 10,
        Response::FieldEfficiency => 11,
    }
}
