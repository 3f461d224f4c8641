//! The screen of one row: its machine, the ground between beam and tool, its detections, and its console. A small
//! screen shows only the state and the ground, in a few lines.

use super::{
    HOLD_KEY, HOLD_STYLE, URGENT, bold, colour, column_of, draw_line, draw_said, draw_top, ground, shown_lines,
};
use crate::monitor::model::{Connection, Model, RowModel, Seen};
use link::names;
use ratatui::Frame;
use ratatui::layout::Constraint::{Length, Min};
use ratatui::layout::{Layout, Rect};
use ratatui::style::Stylize;
use ratatui::text::{Line, Span, Text};
use ratatui::widgets::{Block, Paragraph, Row, Table, Wrap};

/// The least columns and lines for the whole screen.
const COLUMNS: u16 = 70;
const LINES: u16 = 18;

pub fn draw(model: &Model, row: &RowModel, frame: &mut Frame) {
    let area = frame.area();
    if area.width < COLUMNS || area.height < LINES {
        draw_small(model, row, frame)
    } else {
        draw_all(model, row, frame)
    }
}

/// The state, with the tool and the reason for its being out. If it is unknown, the last known state.
fn state(row: &RowModel) -> Line<'static> {
    let Some(status) = &row.status else { return "state unknown, tool unknown".dim().into() };
    let (mode, tool) = (status.mode.name(), if status.tool_out { "out" } else { "in" });
    if row.present().is_none() {
        return format!("state unknown, last heard: {mode}, tool {tool}").dim().into();
    }
    let reason = status.reason.as_deref().map_or_else(String::new, |reason| format!(" for {reason}"));
    let mode = Span::styled(format!("{mode:<8}"), bold(colour(status.mode)));
    Line::from(vec![Span::raw("state "), mode, Span::raw(format!("tool {tool}{reason}"))])
}

fn speed_and_place(row: &RowModel) -> String {
    let Some(status) = &row.status else { return "speed unknown      place unknown".to_owned() };
    let place_m = row.millimetres(status.position) / 1000.0;
    if row.present().is_none() {
        return format!("speed unknown      last place {place_m:8.2} m");
    }
    let km_h = f64::from(status.speed_mm_s) * 0.0036;
    format!("speed {km_h:5.2} km/h   place {place_m:8.2} m")
}

fn draw_small(model: &Model, row: &RowModel, frame: &mut Frame) {
    let area = frame.area();
    // Two lines are enough for every advice, three for why there is no machine.
    let urgent = match &row.connection {
        Connection::Down(why) => Some(why.clone()),
        Connection::Up(_) => row.advice(),
    };
    let wrapped = urgent.as_ref().map_or(0, |text| text.chars().count().div_ceil(usize::from(area.width.max(10)) - 5));
    // The first parts in this list have priority if there is not room for all.
    let mut left = area.height;
    let mut take = |wanted: usize| {
        let got = left.min(wanted as u16);
        left -= got;
        Length(got)
    };
    let (top, advice, line, hint) = (take(1), take(wrapped.min(4)), take(1), take(1));
    let (ground, speed) = (take(2), take(1));
    let [top, advice, ground, speed, said, line, hint] =
        Layout::vertical([top, advice, ground, speed, Length(left), line, hint]).areas(area);
    let state = if row.is_there() { state(row) } else { Line::styled("NO WEEDER", URGENT) };
    draw_top(state, frame, top);
    frame.render_widget(Paragraph::new(urgent.unwrap_or_default()).style(URGENT).wrap(Wrap { trim: true }), advice);
    let columns = usize::from(ground.width);
    let lines = vec![self::ground(row, columns).green().into(), marks(row, columns).into()];
    frame.render_widget(Text::from(lines), ground);
    frame.render_widget(Line::raw(speed_and_place(row)), speed);
    frame.render_widget(shown_lines(model, said), said);
    draw_line(model, "", frame, line, hint);
}

fn draw_all(model: &Model, row: &RowModel, frame: &mut Frame) {
    let [machine, ground, advice, middle, line, hint] =
        Layout::vertical([Length(4), Length(5), Length(1), Min(4), Length(1), Length(1)]).areas(frame.area());
    let [objects, said] = Layout::horizontal([Length(40), Min(10)]).areas(middle);
    draw_machine(row, frame, machine);
    draw_ground(row, frame, ground);
    if let Some(text) = row.advice() {
        frame.render_widget(Line::styled(text, URGENT), advice);
    }
    draw_objects(row, frame, objects);
    draw_said(model, frame, said);
    draw_line(model, "", frame, line, hint);
}

fn draw_machine(row: &RowModel, frame: &mut Frame, area: Rect) {
    let title = match &row.connection {
        Connection::Up(version) => format!(" weeder {version} "),
        Connection::Down(why) => format!(" no weeder: {why} "),
    };
    let second = match row.present() {
        Some(status) => {
            let slip = status.slip_permille;
            let slip = slip.map_or_else(String::new, |slip| format!("   slip {:.1} %", f64::from(slip) / 10.0));
            format!("{}   windows {}   unseen {} mm{slip}", speed_and_place(row), status.zones, status.unseen_mm)
        }
        None => speed_and_place(row),
    };
    let key = Line::styled(format!(" {HOLD_KEY} "), HOLD_STYLE).right_aligned();
    let block = Block::bordered().title(title).title(key);
    frame.render_widget(Paragraph::new(vec![state(row), second.into()]).block(block), area);
}

fn marks(row: &RowModel, columns: usize) -> String {
    let tool_at = column_of(row, columns, 0.0).round() as usize;
    let tool = match row.present().map(|status| status.tool_out) {
        None => "? tool",
        Some(true) => "△ tool out",
        Some(false) => "▲ tool in",
    };
    let tool = format!("{:tool_at$}{tool}", "");
    let mut marks: Vec<char> = tool.chars().take(columns).collect();
    marks.resize(columns, ' ');
    let beam = "beam |";
    let start = columns.saturating_sub(beam.len());
    if start > tool_at + 12 {
        marks.splice(start.., beam.chars());
    }
    marks.into_iter().collect()
}

fn draw_ground(row: &RowModel, frame: &mut Frame, area: Rect) {
    let block = Block::bordered().title(" row ");
    let inner = block.inner(area);
    frame.render_widget(block, area);
    let columns = usize::from(inner.width);
    let text = Text::from(vec![
        Line::raw(ground(row, columns)).green(),
        Line::raw(marks(row, columns)),
        Line::raw("█ canopy  ░ margin  ' weed").dim(),
    ]);
    frame.render_widget(text, inner);
}

fn draw_objects(machine: &RowModel, frame: &mut Frame, area: Rect) {
    let row = |seen: &Seen| {
        Row::new([
            names::class(seen.class).to_string(),
            seen.votes.to_string(),
            format!("{:.0} mm", machine.millimetres(seen.width)),
            format!("{:.0} mm", machine.millimetres(seen.spacing)),
        ])
    };
    let widths = [Length(8), Length(5), Length(9), Length(9)];
    let table = Table::new(machine.objects.iter().map(row), widths)
        .header(Row::new(["class", "votes", "width", "spacing"]).dim())
        .block(Block::bordered().title(" detections, the newest first "));
    frame.render_widget(table, area);
}
