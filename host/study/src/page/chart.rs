//! The page's charts: lines with markers over speed, and scatter plots, as SVG within a page.
//!
//! Series differ in colour, marker and dashes. The colours in this file are for light paper, and also serve as names:
//! the page's style sheet replaces them for dark paper, and dashes the lines. Charts are drawn at twice their usual
//! size on the page, because plotters works in whole pixels. Legends and titles are part of the page.

use crate::table::short;
use anyhow::{Context, Result};
use plotters::coord::Shift;
use plotters::element::{DynElement, IntoDynElement};
use plotters::prelude::*;
use std::io;
use std::ops::Range;

/// Size of a chart, and of a series' mark in a legend, in pixels.
const CHART_SIZE: (u32, u32) = (840, 572);
const KEY_SIZE: (u32, u32) = (88, 36);

/// Ink for words, for axes, for the mesh, and for limits.
const INK: RGBColor = RGBColor(0x33, 0x31, 0x2C);
const AXIS: RGBColor = RGBColor(0x8A, 0x85, 0x7A);
const MESH: RGBColor = RGBColor(0xE6, 0xE2, 0xD6);
const LIMIT: RGBColor = RGBColor(0x5F, 0x5B, 0x52);

/// Colours after Okabe and Ito, darkened where they would be pale on white, and markers. Colour-blind readers can also
/// distinguish them.
const LOOKS: [Look; 4] = [
    Look { colour: RGBColor(0x00, 0x72, 0xB2), marker: Some(Marker::Circle) },
    Look { colour: RGBColor(0xD5, 0x5E, 0x00), marker: Some(Marker::Triangle) },
    Look { colour: RGBColor(0x00, 0x8F, 0x68), marker: Some(Marker::Cross) },
    Look { colour: RGBColor(0xB5, 0x56, 0x8A), marker: Some(Marker::UpturnedTriangle) },
];

/// Colour and marker of a series.
#[derive(Clone, Copy)]
pub struct Look {
    colour: RGBColor,
    marker: Option<Marker>,
}

#[derive(Clone, Copy)]
enum Marker {
    Circle,
    Triangle,
    Cross,
    UpturnedTriangle,
}

impl Look {
    /// A limit, which is not measured and so has no markers.
    pub const LIMIT: Self = Self { colour: LIMIT, marker: None };

    /// The look of a series by its index. Looks repeat after four.
    pub fn of_series(index: usize) -> Self {
        LOOKS[index % LOOKS.len()]
    }

    fn stroke(self) -> ShapeStyle {
        self.colour.stroke_width(5)
    }
}

/// Points with one look.
pub struct Series {
    /// Its name in the legend.
    pub name: String,
    /// Their look.
    pub look: Look,
    /// Joined by a line, with large markers.
    pub line: Vec<(f64, f64)>,
    /// Small pale markers of their own.
    pub cloud: Vec<(f64, f64)>,
}

impl Series {
    /// A series without points.
    pub fn of(name: &str, look: Look) -> Self {
        Self { name: name.to_owned(), look, line: Vec::new(), cloud: Vec::new() }
    }
}

/// A chart: its content, and the visible range.
pub struct Chart<'a> {
    /// The label of the x axis, with its unit.
    pub x_label: &'a str,
    /// The range of the x axis.
    pub x: Range<f64>,
    /// The range of the y axis.
    pub y: Range<f64>,
    /// The series, the last one on top.
    pub series: Vec<&'a Series>,
    /// A limit, shaded from the line upwards.
    pub limit: Option<&'a Series>,
}

impl Chart<'_> {
    /// Draws it.
    ///
    /// # Errors
    /// If plotters cannot draw it, as for a range without extent.
    pub fn svg(&self) -> Result<String> {
        svg(CHART_SIZE, |area| {
            let mut chart = ChartBuilder::on(area)
                .margin(6)
                .margin_top(14)
                .margin_right(22)
                .x_label_area_size(96)
                .y_label_area_size(84)
                .build_cartesian_2d(self.x.clone(), self.y.clone())?;
            let words = ("sans-serif", 34).into_font().color(&INK);
            chart
                .configure_mesh()
                .disable_x_mesh()
                .max_light_lines(0)
                .bold_line_style(MESH.stroke_width(2))
                .axis_style(AXIS.stroke_width(2))
                .x_labels(6)
                .y_labels(6)
                .x_label_formatter(&|value| short(*value))
                .y_label_formatter(&|value| short(*value))
                .label_style(words.clone())
                .x_desc(self.x_label)
                .axis_desc_style(words)
                .set_all_tick_mark_size(10)
                .draw()?;
            if let Some(Series { line, look, .. }) = self.limit {
                chart.draw_series(AreaSeries::new(line.iter().copied(), self.y.end, LIMIT.mix(0.12)))?;
                chart.draw_series(LineSeries::new(line.iter().copied(), look.stroke()))?;
            }
            for series in &self.series {
                let colour = series.look.colour;
                chart.draw_series(LineSeries::new(series.line.iter().copied(), series.look.stroke()))?;
                if let Some(marker) = series.look.marker {
                    chart.draw_series(series.cloud.iter().map(|&point| marker.at(point, 8, colour.mix(0.6))))?;
                    chart.draw_series(series.line.iter().map(|&point| marker.at(point, 12, colour.to_rgba())))?;
                }
            }
            Ok(())
        })
    }
}

/// Draws the mark of a series in a legend, on a piece of its line where it has one.
///
/// # Errors
/// If plotters cannot draw it.
pub fn key(look: Look, has_line: bool) -> Result<String> {
    let (width, height) = (KEY_SIZE.0 as i32, KEY_SIZE.1 as i32);
    svg(KEY_SIZE, |area| {
        if has_line {
            area.draw(&PathElement::new([(0, height / 2), (width, height / 2)], look.stroke()))?;
        }
        if let Some(marker) = look.marker {
            area.draw(&marker.at((width / 2, height / 2), 12, look.colour.to_rgba()))?;
        }
        Ok(())
    })
}

/// A range that contains all values with a margin. `from_zero` makes it begin at zero. It is never empty, even without
/// values or with equal values.
pub fn range_of(values: impl IntoIterator<Item = f64>, from_zero: bool) -> Range<f64> {
    const AIR: f64 = 0.08;
    let start = if from_zero { 0.0 } else { f64::INFINITY };
    let (low, high) =
        values.into_iter().fold((start, f64::NEG_INFINITY), |(low, high), value| (low.min(value), high.max(value)));
    if low > high {
        return 0.0..1.0;
    }
    let extent = if high > low { high - low } else { high.abs().max(1.0) };
    let air = extent * AIR;
    if from_zero && low == 0.0 { 0.0..high.max(extent) + air } else { low - air..high + air }
}

impl Marker {
    /// The marker at a point; its size is half its width in pixels.
    fn at<DB, Point>(self, point: Point, size: i32, colour: RGBAColor) -> DynElement<'static, DB, Point>
    where
        DB: DrawingBackend,
        Point: Clone + 'static,
    {
        let tip = size + size / 4;
        match self {
            Self::Circle => Circle::new(point, size, colour.filled()).into_dyn(),
            Self::Triangle => TriangleMarker::new(point, tip, colour.filled()).into_dyn(),
            Self::Cross => Cross::new(point, size - size / 6, colour.stroke_width(5)).into_dyn(),
            // It stands on its tip.
            Self::UpturnedTriangle => TriangleMarker::new(point, -tip, colour.filled()).into_dyn(),
        }
    }
}

/// An SVG of this size with the drawing.
fn svg(
    size: (u32, u32),
    draw: impl FnOnce(&DrawingArea<SVGBackend, Shift>) -> Result<(), DrawingAreaErrorKind<io::Error>>,
) -> Result<String> {
    let mut svg = String::new();
    {
        let area = SVGBackend::with_string(&mut svg, size).into_drawing_area();
        draw(&area).and_then(|()| area.present()).context("a chart cannot be drawn")?;
    }
    Ok(svg)
}
