//! The monitor's screen: from what is known to what is drawn, and nothing else.

use super::model::{Connection, Model, Seen};
use link::settings::Setting;
use link::{Class, Mode};
use ratatui::Frame;
use ratatui::layout::{Constraint, Layout, Position, Rect};
use ratatui::style::{Color, Style, Stylize};
use ratatui::text::{Line, Span, Text};
use ratatui::widgets::{Block, Paragraph, Row, Table};

/// Draws all of it.
pub fn draw(model: &Model, frame: &mut Frame) {
    let [machine, row, advice, middle, line, hint] = Layout::vertical([
        Constraint::Length(4),
        Constraint::Length(5),
        Constraint::Length(1),
        Constraint::Min(4),
        Constraint::Length(1),
        Constraint::Length(1),
    ])
    .areas(frame.area());
    let [objects, said] = Layout::horizontal([Constraint::Length(40), Constraint::Min(10)]).areas(middle);
    draw_machine(model, frame, machine);
    draw_row(model, frame, row);
    if let Some(text) = &model.advice {
        frame.render_widget(Line::styled(text.as_str(), Style::new().fg(Color::Red).bold()), advice);
    }
    draw_objects(model, frame, objects);
    draw_said(model, frame, said);
    draw_line(model, frame, line, hint);
}

fn draw_machine(model: &Model, frame: &mut Frame, area: Rect) {
    let title = match &model.connection {
        Connection::Up(version) => format!(" weeder {version} "),
        Connection::Down(why) => format!(" no weeder: {why} "),
    };
    let status = &model.status;
    let colour = match status.mode {
        Mode::Hold => Color::Yellow,
        Mode::Work => Color::Green,
        Mode::Alarm => Color::Red,
    };
    let reason = status.reason.as_deref().map_or_else(String::new, |reason| format!(" for {reason}"));
    let first = Line::from(vec![
        Span::raw("state "),
        Span::styled(format!("{:<8}", status.mode.name()), Style::new().fg(colour).bold()),
        Span::raw(format!("tool {}{reason}", if status.tool_out { "out" } else { "in" })),
    ]);
    let km_h = f64::from(status.speed_mm_s) * 0.0036;
    let slip = status.slip_permille.map_or_else(String::new, |slip| format!("   slip {:.1} %", f64::from(slip) / 10.0));
    let second = format!(
        "speed {km_h:5.2} km/h   place {:8.2} m   windows {}   unseen {} mm{slip}",
        model.millimetres(status.position) / 1000.0,
        status.windows,
        status.unseen_mm
    );
    frame.render_widget(Paragraph::new(vec![first, second.into()]).block(Block::bordered().title(title)), area);
}

/// What stands at a place of the row: what is drawn farther down here wins.
#[derive(Clone, Copy, PartialEq, Eq, PartialOrd, Ord)]
enum Ground {
    Bare,
    Weed,
    Margin,
    Canopy,
}

/// The row from a little behind the tool to the beam, as the machine rolls to the right.
fn draw_row(model: &Model, frame: &mut Frame, area: Rect) {
    let block = Block::bordered().title(" row ");
    let inner = block.inner(area);
    frame.render_widget(block, area);
    let columns = usize::from(inner.width);
    let beam_to_tool = f64::from(model.settings.get(Setting::BeamToToolMm));
    // A quarter of the way again behind the tool.
    let mm_per_column = 1.25 * beam_to_tool / columns.max(1) as f64;
    let column_of = |ahead_of_tool_mm: f64| (ahead_of_tool_mm + 0.25 * beam_to_tool) / mm_per_column;
    let mut ground = vec![Ground::Bare; columns];
    let margin = f64::from(model.settings.get(Setting::MarginMm));
    for seen in &model.windows {
        let from = model.millimetres(seen.leading.wrapping_sub(model.status.position)) + beam_to_tool;
        let to = from + model.millimetres(seen.width);
        let mut paint = |from: f64, to: f64, what: Ground| {
            let (from, to) = (column_of(from).round(), column_of(to).round());
            // What is narrower than a column is still drawn, and what lies behind the left edge is not.
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
    let ground: String = ground.iter().map(symbol).collect();
    let tool_at = column_of(0.0).round() as usize;
    let tool = format!("{:tool_at$}{}", "", if model.status.tool_out { "△ tool out" } else { "▲ tool in" });
    let mut marks: Vec<char> = tool.chars().take(columns).collect();
    marks.resize(columns, ' ');
    let beam = "beam |";
    let start = columns.saturating_sub(beam.len());
    if start > tool_at + 12 {
        marks.splice(start.., beam.chars());
    }
    let legend = "█ canopy  ░ margin  ' weed";
    let text = Text::from(vec![
        Line::raw(ground).green(),
        Line::raw(marks.into_iter().collect::<String>()),
        Line::raw(legend).dim(),
    ]);
    frame.render_widget(text, inner);
}

fn symbol(ground: &Ground) -> char {
    match ground {
        Ground::Bare => '_',
        Ground::Weed => '\'',
        Ground::Margin => '░',
        Ground::Canopy => '█',
    }
}

fn draw_objects(model: &Model, frame: &mut Frame, area: Rect) {
    let row = |seen: &Seen| {
        let class = match seen.class {
            Class::Plant => "plant",
            Class::Weed => "weed",
            Class::Unknown => "unknown",
        };
        Row::new([
            class.to_owned(),
            seen.votes.to_string(),
            format!("{:.0} mm", model.millimetres(seen.width)),
            format!("{:.0} mm", model.millimetres(seen.spacing)),
        ])
    };
    let widths = [Constraint::Length(8), Constraint::Length(5), Constraint::Length(9), Constraint::Length(9)];
    let table = Table::new(model.objects.iter().map(row), widths)
        .header(Row::new(["class", "votes", "width", "spacing"]).dim())
        .block(Block::bordered().title(" objects, the newest first "));
    frame.render_widget(table, area);
}

fn draw_said(model: &Model, frame: &mut Frame, area: Rect) {
    let block = Block::bordered().title(" console ");
    let room = usize::from(block.inner(area).height);
    let lines = model.lines.iter().skip(model.lines.len().saturating_sub(room));
    frame.render_widget(
        Paragraph::new(lines.map(|line| Line::raw(line.as_str())).collect::<Vec<_>>()).block(block),
        area,
    );
}

fn draw_line(model: &Model, frame: &mut Frame, area: Rect, hint: Rect) {
    frame.render_widget(Line::from(vec!["> ".bold(), model.line.text().into()]), area);
    // A line has at most 80 characters.
    let column = (area.x + 2 + model.line.cursor() as u16).min(area.right().saturating_sub(1));
    frame.set_cursor_position(Position::new(column, area.y));
    let candidates = model.line.candidates();
    let text = if candidates.is_empty() {
        "Tab completes, Up and Down go through the history, Ctrl-C ends".to_owned()
    } else {
        let last = |line: &String| line.rsplit(' ').next().unwrap_or_default().to_owned();
        candidates.iter().map(last).collect::<Vec<_>>().join("  ")
    };
    frame.render_widget(Line::raw(text).dim(), hint);
}

#[cfg(test)]
mod tests;
