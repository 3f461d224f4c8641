//! The monitor on a terminal: keys go in, the screen comes out.

use super::model::{Model, RowModel};
use super::view;
use crate::record::Logs;
use anyhow::{Context, Result};
use link::rows::{Hold, Rows, What};
use ratatui::DefaultTerminal;
use ratatui::crossterm::event::{self, Event, KeyCode, KeyEvent, KeyEventKind, KeyModifiers};
use std::time::{Duration, Instant};

/// Time between two looks at the keyboard, after which the screen is drawn anew.
const TURN: Duration = Duration::from_millis(20);

/// Watches until Ctrl-C or Ctrl-D.
///
/// # Errors
/// Where the terminal or a log fails.
pub fn run(rows: &Rows, names: Vec<String>, mut logs: Option<Logs>) -> Result<()> {
    let mut terminal = ratatui::try_init().context("the terminal cannot be drawn on: --plain does without")?;
    let result = watch(&mut terminal, rows, Model::new(names), &mut logs);
    ratatui::restore();
    result.and_then(|()| logs.map_or(Ok(()), |logs| logs.check()))
}

fn watch(terminal: &mut DefaultTerminal, rows: &Rows, mut model: Model, logs: &mut Option<Logs>) -> Result<()> {
    loop {
        let until = Instant::now() + TURN;
        while let Some(heard) = rows.next(until.saturating_duration_since(Instant::now())) {
            if let (Some(logs), What::Happened(happening)) = (&mut *logs, &heard.what)
                && let Err(error) = logs.write(heard.row, happening)
            {
                // The machine is still watched, and the other rows' logs are still written.
                model.say(format!("-- {:#}", anyhow::Error::from(error)));
            }
            model.take(heard);
        }
        terminal.draw(|frame| view::draw(&model, frame))?;
        while event::poll(Duration::ZERO)? {
            let Event::Key(key) = event::read()? else { continue };
            if ends(key) {
                return Ok(());
            }
            take_key(&mut model, rows, key);
        }
    }
}

/// Takes a key: Esc before all others, whatever is being typed.
fn take_key(model: &mut Model, rows: &Rows, key: KeyEvent) {
    match key.code {
        _ if key.kind == KeyEventKind::Release => {}
        KeyCode::Esc => hold_all(model, rows),
        KeyCode::PageUp => model.choose(false),
        KeyCode::PageDown => model.choose(true),
        _ => {
            let Some(command) = model.line.key(key) else { return };
            if command == "hold" && model.target.is_none() {
                hold_all(model, rows);
                return;
            }
            model.sent(&command);
            for row in model.targets() {
                match command.as_str() {
                    "hold" => rows.hold(row),
                    _ => rows.command(row, &command),
                }
            }
        }
    }
}

/// HOLD to all rows, those that are not there included.
fn hold_all(model: &mut Model, rows: &Rows) {
    let since = Instant::now();
    for row in 0..rows.count() {
        rows.hold(row);
    }
    model.held(Hold::new(since, model.rows.iter().map(RowModel::is_there)));
}

fn ends(key: KeyEvent) -> bool {
    key.modifiers.contains(KeyModifiers::CONTROL) && matches!(key.code, KeyCode::Char('c' | 'd'))
}

#[cfg(test)]
mod tests {
    use super::*;
    use link::LinkError;

    fn typed(model: &mut Model, rows: &Rows, text: &str) {
        for character in text.chars() {
            take_key(model, rows, KeyCode::Char(character).into());
        }
    }

    #[test]
    fn one_key_has_all_rows_hold_whatever_is_being_typed_and_whichever_row_is_chosen() {
        let opener = || -> link::rows::Opener { Box::new(|| Err(LinkError::Absent("it".to_owned()))) };
        let (rows, _) = Rows::open(vec![opener(), opener()]);
        let mut model = Model::new(vec!["left".to_owned(), "right".to_owned()]);
        take_key(&mut model, &rows, KeyCode::PageDown.into());
        typed(&mut model, &rows, "set k");
        assert!(model.hold.is_none());
        take_key(&mut model, &rows, KeyCode::Esc.into());
        assert_eq!(
            model.hold.as_ref().map(|hold| hold.summary(&model.names())).as_deref(),
            Some("HOLD 0 of 2; NOT THERE: left, right")
        );
        assert_eq!((model.line.text(), model.target), ("set k", Some(0)));
        // As does the word, typed to all.
        (model.hold, model.target) = (None, None);
        take_key(&mut model, &rows, KeyCode::Enter.into());
        typed(&mut model, &rows, "hold");
        take_key(&mut model, &rows, KeyCode::Enter.into());
        assert!(model.hold.is_some());
    }
}
