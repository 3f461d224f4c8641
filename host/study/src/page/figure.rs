//! The page's figures: their charts and legends, and texts for readers who cannot see the charts.

use super::chart::{Chart, Look, Series, key, range_of};
use crate::evaluation::{Analysis, Response, ResponseAnalysis};
use crate::table::{distinct, fixed, short};
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

/// Values over speed in km/h, with growing speed.
pub struct Curve {
    /// Its name in the legend.
    pub name: String,
    /// Speeds and values.
    pub points: Vec<(f64, f64)>,
}

/// A measure of several controllers against speed, and its upper limit if it has one.
pub fn curves([title, unit, caption]: [&str; 3], curves: &[Curve], limit: Option<&Curve>) -> Result<Figure> {
    let mut series = Vec::new();
    let mut legend = Vec::new();
    let mut words = format!("{title} in {unit} against speed.");
    let looks = (0..curves.len()).map(Look::of_series);
    for (look, Curve { name, points }) in looks.chain([Look::LIMIT]).zip(curves.iter().chain(limit)) {
        words += &said(name, points);
        legend.push(Key { svg: key(look, true)?, meaning: name.clone() });
        series.push(Series { look, line: points.clone(), cloud: Vec::new() });
    }
    // The first series is drawn last: it stays visible where lines meet. The chart draws the limit itself.
    series.truncate(curves.len());
    series.reverse();
    let points = || curves.iter().chain(limit).flat_map(|curve| &curve.points);
    let chart = Chart {
        x_label: SPEED,
        x: range_of(points().map(|point| point.0), false),
        y: range_of(points().map(|point| point.1), true),
        series: &series,
        limit: limit.map_or(&[], |limit| &limit.points),
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
            of_spacing.filter_map(|treatment| Some((treatment.speed_km_h, response.value(&treatment.mean)?))).collect();
        let plots = analysis.records.iter().zip(&analysis.performances);
        let cloud = plots
            .filter(|(record, _)| record.spacing_cm == spacing_cm)
            .filter_map(|(record, performance)| Some(moved((record.speed_km_h, response.value(performance)?))))
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
        // Its figures 8 to 11 have the measures in their order.
        caption: format!("The paper's Fig. {}.", 8 + response as usize),
    })
}

/// A model's residuals against its fitted values; `None` without a model.
pub fn residuals(analysis: &Analysis, of: &ResponseAnalysis) -> Result<Option<Figure>> {
    let Ok(model) = &of.model else { return Ok(None) };
    let x = range_of(model.fitted.iter().copied(), false);
    let mut series = vec![Series { look: Look::LIMIT, line: vec![(x.start, 0.0), (x.end, 0.0)], cloud: Vec::new() }];
    let mut legend = Vec::new();
    for (index, spacing_cm) in spacings_cm(analysis).into_iter().enumerate() {
        let look = Look::of_series(index);
        let points = model.fitted.iter().copied().zip(model.residuals.iter().copied());
        let of_spacing = points.zip(&of.plots).filter(|(_, plot)| analysis.records[**plot].spacing_cm == spacing_cm);
        legend.push(Key { svg: key(look, false)?, meaning: spacing(spacing_cm) });
        series.push(Series { look, line: Vec::new(), cloud: of_spacing.map(|(point, _)| point).collect() });
    }
    let farthest = model.residuals.iter().fold(0.0, |farthest: f64, residual| farthest.max(residual.abs()));
    let unit = of.response.unit();
    let label = format!("by the model, {unit}");
    let chart = Chart { x_label: &label, x, y: range_of([-farthest, farthest], false), series: &series, limit: &[] };
    Ok(Some(Figure {
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
    }))
}

/// The spacings of a trial, narrow first.
fn spacings_cm(analysis: &Analysis) -> Vec<f64> {
    distinct(analysis.records.iter().map(|record| record.spacing_cm))
}

fn spacing(spacing_cm: f64) -> String {
    format!("{} cm plant spacing", short(spacing_cm))
}

/// A line in words.
fn said(name: &str, line: &[(f64, f64)]) -> String {
    let points: Vec<String> = line.iter().map(|(x, y)| format!("{} at {} km/h", fixed(*y, 1), short(*x))).collect();
    format!(" {name}: {}.", points.join(", "))
}
