//! The monitor on a terminal: keys go in, the screen comes out.

use super::model::Model;
use super::view;
use anyhow::{Context, Result};
use link::log::LogWriter;
use link::session::Session;
use ratatui::DefaultTerminal;
use ratatui::crossterm::event::{self, Event, KeyCode, KeyEvent, KeyModifiers};
use std::time::{Duration, Instant};

/// Watches until Ctrl-C or Ctrl-D.
///
/// # Errors
/// Where the terminal or the log fails.
pub fn run(mut session: Session, mut log: Option<LogWriter>) -> Result<()> {
    let mut terminal = ratatui::try_init().context("the terminal cannot be drawn on: --plain does without")?;
    let result = watch(&mut terminal, &mut session, &mut log);
    ratatui::restore();
    result
}

fn watch(terminal: &mut DefaultTerminal, session: &mut Session, log: &mut Option<LogWriter>) -> Result<()> {
    let mut model = Model::new();
    loop {
        for happening in session.turn(Instant::now()) {
            if let Some(log) = log {
                log.write(&happening)?;
            }
            model.update(happening);
        }
        terminal.draw(|frame| view::draw(&model, frame))?;
        while event::poll(Duration::ZERO)? {
            let Event::Key(key) = event::read()? else { continue };
            if ends(key) {
                return Ok(());
            }
            if let Some(command) = model.line.key(key)
                && !session.command(&command)
            {
                model.say(format!("-- `{command}` was not sent: too many commands wait"));
            }
        }
    }
}

fn ends(key: KeyEvent) -> bool {
    key.modifiers.contains(KeyModifiers::CONTROL) && matches!(key.code, KeyCode::Char('c' | 'd'))
}
