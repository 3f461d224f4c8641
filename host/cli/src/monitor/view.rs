//! The monitor's screen: draws the model, and does nothing else.
//!
//! State, alarm and the key for HOLD are at the top, so they are visible on a small terminal too. [`one`] draws one
//! row. [`several`] draws all rows of a machine. Here are the parts of both: the line with the key for HOLD, the ground
//! ahead of a tool, the console's output, and its input.

mod one;
mod several;

use super::model::{Model, RowModel};
use link::settings::Setting;
use link::{Class, Mode};
use ratatui::Frame;
use ratatui::layout::{Constraint, Layout, Position, Rect};
use ratatui::style::{Color, Modifier, Style, Stylize};
use ratatui::text::Line;
use ratatui::widgets::{Block, Paragraph};

pub fn draw(model: &Model, frame: &mut Frame) {
    match model.rows.as_slice() {
        [row] => one::draw(model, row, frame),
        rows => several::draw(model, rows, frame),
    }
}

/// The label of the key that holds all rows.
const HOLD_KEY: &str = "Esc HOLD";

/// A line with the key for HOLD at its end. The key is visible on the narrowest screen too.
fn draw_top(left: Line, frame: &mut Frame, area: Rect) {
    let width = HOLD_KEY.len() as u16;
    let [left_area, key] = Layout::horizontal([Constraint::Min(0), Constraint::Length(width)]).areas(area);
    frame.render_widget(left, left_area);
    frame.render_widget(Line::raw(HOLD_KEY).style(HOLD_STYLE), key);
}

const HOLD_STYLE: Style = bold(Color::White).bg(Color::Red);

/// The style of an alarm, or of a machine that is not there.
const URGENT: Style = bold(Color::Red);

const fn bold(colour: Color) -> Style {
    Style::new().fg(colour).add_modifier(Modifier::BOLD)
}

const fn colour(mode: Mode) -> Color {
    match mode {
        Mode::Hold => Color::Yellow,
        Mode::Work => Color::Green,
        Mode::Alarm => Color::Red,
    }
}

/// The content of a column. A later variant has priority.
#[derive(Clone, Copy, PartialEq, Eq, PartialOrd, Ord)]
enum Ground {
    Bare,
    Weed,
    Margin,
    Canopy,
}

/// The column, out of `columns`, of a position ahead of the tool. A fifth of them is behind the tool.
fn column_of(row: &RowModel, columns: usize, ahead_of_tool_mm: f64) -> f64 {
    let beam_to_tool = f64::from(row.settings.get(Setting::BeamToToolMm));
    let mm_per_column = 1.25 * beam_to_tool / columns.max(1) as f64;
    (ahead_of_tool_mm + 0.25 * beam_to_tool) / mm_per_column
}

/// The ground from a little behind the tool to the beam. The machine rolls to the right.
fn ground(row: &RowModel, columns: usize) -> String {
    let beam_to_tool = f64::from(row.settings.get(Setting::BeamToToolMm));
    let mut ground = vec![Ground::Bare; columns];
    let margin = f64::from(row.settings.get(Setting::MarginMm));
    // Zones move with the machine.
    let position = row.status.as_ref().map(|status| status.position);
    for (seen, position) in row.zones.iter().filter_map(|seen| Some((seen, position?))) {
        let from = row.millimetres(seen.leading.wrapping_sub(position)) + beam_to_tool;
        let to = from + row.millimetres(seen.width);
        let mut paint = |from: f64, to: f64, what: Ground| {
            let (from, to) = (column_of(row, columns, from).round(), column_of(row, columns, to).round());
            // Draws also what is narrower than a column, and cuts off what is beyond the left edge.
            let to = to.max(from + 1.0).max(0.0) as usize;
            for place in ground.iter_mut().take(to).skip(from.max(0.0) as usize) {
                *place = what.max(*place);
            }
        };
        if seen.class == Class::Weed {
            paint(from, to, Ground::Weed);
        } else {
            paint(from - margin, to + margin, Ground::Margin);
            paint(from, to, Ground::Canopy);
        }
    }
    let symbol = |ground| match ground {
        Ground::Bare => '_',
        Ground::Weed => '\'',
        Ground::Margin => '░',
        Ground::Canopy => '█',
    };
    ground.into_iter().map(symbol).collect()
}

/// The part of the console's output that is shown, as many lines as there is room for.
fn shown_lines<'a>(model: &'a Model, area: Rect) -> Paragraph<'a> {
    let lines: Vec<&str> = model.lines.iter().map(String::as_str).collect();
    let rows = model.pager.rows(&lines, area.width, area.height);
    Paragraph::new(rows.into_iter().map(Line::raw).collect::<Vec<_>>())
}

/// The same, in a frame.
fn draw_said(model: &Model, frame: &mut Frame, area: Rect) {
    let title = match model.pager.below(model.lines.len()) {
        0 => " console ".to_owned(),
        below => format!(" console, {below} more below: {} ", if model.are_several() { "Ctrl-Down" } else { "PgDn" }),
    };
    let block = Block::bordered().title(title);
    frame.render_widget(shown_lines(model, block.inner(area)).block(block), area);
}

/// The line that is being typed and its addressee. Below it: the result of HOLD, the completions, or the keys.
fn draw_line(model: &Model, to: &str, frame: &mut Frame, area: Rect, hint: Rect) {
    let prompt = format!("{to}> ");
    let before = Line::raw(format!("{prompt}{}", &model.line.text[..model.line.cursor]));
    // A line has at most 80 characters.
    let column = (area.x + before.width() as u16).min(area.right().saturating_sub(1));
    frame.render_widget(Line::from(vec![prompt.bold(), model.line.text.as_str().into()]), area);
    frame.set_cursor_position(Position::new(column, area.y));
    let candidates = &model.line.candidates;
    let text = if !candidates.is_empty() {
        let last = |line: &String| line.rsplit(' ').next().unwrap_or_default().to_owned();
        Line::raw(candidates.iter().map(last).collect::<Vec<_>>().join("  ")).dim()
    } else if let Some(hold) = &model.hold {
        let colour = if hold.is_obeyed() { Color::Green } else { Color::Red };
        Line::raw(hold.summary(&model.names())).style(bold(colour))
    } else if model.are_several() {
        Line::raw("PgUp, PgDn: to whom; Ctrl-Up: earlier lines; Tab completes, Up and Down recall, Ctrl-C ends").dim()
    } else {
        Line::raw("PgUp: earlier lines; Tab completes, Up and Down recall, Ctrl-C ends").dim()
    };
    frame.render_widget(text, hint);
}

#[cfg(test)]
mod tests;
