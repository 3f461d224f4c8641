//! The overview of several rows. Each row has a line with its name, its state, its alarm or the ground ahead of its
//! tool, and the state of the last command. If there is not room for all, rows that are lost or in alarm come first,
//! and the rest are counted by state.

use super::{URGENT, bold, colour, draw_line, draw_said, draw_top, ground, shown_lines};
use crate::monitor::model::{Answer, Connection, Model, RowModel};
use link::{Mode, advice};
use ratatui::Frame;
use ratatui::layout::Constraint::{Length, Min};
use ratatui::layout::{Layout, Rect};
use ratatui::style::{Style, Stylize};
use ratatui::text::{Line, Span};
use ratatui::widgets::Paragraph;

/// The least lines for a frame round the console and a line of advice for an alarm.
const ROOMY: u16 = 16;

/// Columns of a name on a narrow screen, and the least columns of a wide one.
const NAME: usize = 8;
const WIDE: u16 = 60;

pub fn draw(model: &Model, rows: &[RowModel], frame: &mut Frame) {
    let area = frame.area();
    let is_roomy = area.height >= ROOMY;
    // The top, a line of the console, the input, the line below it; with room, the console's frame and the advice.
    let others = if is_roomy { 3 + 3 + 1 } else { 3 };
    let room = usize::from(area.height.saturating_sub(others)).min(rows.len());
    let [top, list, advice, said, line, hint] =
        Layout::vertical([Length(1), Length(room as u16), Length(u16::from(is_roomy)), Min(0), Length(1), Length(1)])
            .areas(area);
    let counted = [vec![Span::raw(format!("{} rows: ", rows.len()))], counts(rows.iter())].concat();
    draw_top(counted.into(), frame, top);
    draw_list(model, rows, frame, list);
    // Another row's warning hides neither what to do about an alarm nor a restart.
    let urgent = rows.iter().filter(|row| state(row) == ALARM || row.has_restarted());
    if let Some((row, text)) = urgent.chain(rows).find_map(|row| Some((row, row.advice()?))) {
        frame.render_widget(Line::styled(format!("{}: {text}", row.name), URGENT), advice);
    }
    if is_roomy {
        draw_said(model, frame, said);
    } else {
        frame.render_widget(shown_lines(model, said), said);
    }
    let to = model.target.map_or("all", |row| rows[row].name.as_str());
    draw_line(model, to, frame, line, hint);
}

/// The state of a row: its name and its style.
type State = (&'static str, Style);

const LOST: State = ("LOST", URGENT);
/// It is there, and does not tell its state.
const UNKNOWN: State = ("?", URGENT);
const ALARM: State = ("ALARM", URGENT);
const WORK: State = ("work", bold(colour(Mode::Work)));
const HOLD: State = ("hold", bold(colour(Mode::Hold)));

fn state(row: &RowModel) -> State {
    match row.present().map(|status| status.mode) {
        _ if !row.is_there() => LOST,
        None => UNKNOWN,
        Some(Mode::Alarm) => ALARM,
        Some(Mode::Work) => WORK,
        Some(Mode::Hold) => HOLD,
    }
}

/// How many rows are in each state, the worst first.
fn counts<'a>(rows: impl Iterator<Item = &'a RowModel> + Clone) -> Vec<Span<'static>> {
    let count = |of| rows.clone().filter(|row| state(row) == of).count();
    let counts = [LOST, UNKNOWN, ALARM, WORK, HOLD].map(|state| (state, count(state)));
    let counts = counts.into_iter().filter(|&(_, count)| count > 0);
    counts.map(|((name, style), count)| Span::styled(format!("{count} {name} "), style)).collect()
}

fn draw_list(model: &Model, rows: &[RowModel], frame: &mut Frame, area: Rect) {
    let room = usize::from(area.height);
    let mut order: Vec<usize> = (0..rows.len()).collect();
    if room < rows.len() {
        // If all rows fit, they keep their order, so that each is easy to find.
        order.sort_by_key(|&row| (state(&rows[row]).1 != URGENT, model.target != Some(row)));
    }
    let shown = if room < rows.len() { room.saturating_sub(1) } else { room };
    let longest = rows.iter().map(|row| row.name.chars().count()).max().unwrap_or_default();
    let name = if area.width < WIDE { longest.min(NAME) } else { longest };
    let mut lines: Vec<Line> =
        order.iter().take(shown).map(|&row| line(&rows[row], name, area.width, model.target == Some(row))).collect();
    if shown < rows.len() {
        let rest = order[shown..].iter().map(|&row| &rows[row]);
        let more = Span::raw(format!("and {} more: ", order.len() - shown));
        lines.push(Line::from([vec![more], counts(rest)].concat()));
    }
    frame.render_widget(Paragraph::new(lines), area);
}

fn line(row: &RowModel, name: usize, columns: u16, is_target: bool) -> Line<'static> {
    let (state, style) = state(row);
    let mark = match row.answer {
        Answer::None => ' ',
        Answer::Waiting => '?',
        Answer::Done => '+',
        Answer::Refused => '!',
    };
    let shown: String = row.name.chars().take(name).collect();
    let shown = Span::raw(format!("{shown:<name$} "));
    let shown = if is_target { shown.reversed() } else { shown };
    let state = Span::styled(format!("{state:<5} "), style);
    let room = usize::from(columns).saturating_sub(name + 13);
    let (tool, rest) = match (&row.connection, row.present()) {
        (Connection::Down(why), _) => ("   ", Span::styled(why.clone(), style)),
        (Connection::Up(_), None) => ("?  ", Span::styled(row.advice().unwrap_or_default(), URGENT)),
        (Connection::Up(_), Some(status)) => {
            let tool = if status.tool_out { "out" } else { "in " };
            let rest = match (status.alarm, &row.restarted) {
                (Some(alarm), _) => Span::styled(advice::name(alarm), URGENT),
                (None, Some(restarted)) => Span::styled(restarted.clone(), URGENT),
                (None, None) => Span::raw(ground(row, room)).green(),
            };
            (tool, rest)
        }
    };
    Line::from(vec![shown, state, Span::raw(format!("{mark} {tool} ")), rest])
}
