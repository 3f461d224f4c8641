//! The monitor on a terminal: keys go in, the screen comes out.

use super::model::{Model, RowModel};
use super::{addressed, view};
use crate::ctrl_c;
use crate::record::Logs;
use anyhow::{Context, Result, ensure};
use link::rows::{Hold, Rows};
use ratatui::DefaultTerminal;
use ratatui::crossterm::event::{
    self, DisableMouseCapture, EnableMouseCapture, Event, KeyCode, KeyEvent, KeyEventKind, KeyModifiers,
};
use ratatui::crossterm::execute;
use ratatui::crossterm::tty::IsTty;
use std::env;
use std::io::{self, IsTerminal, Write};
use std::sync::atomic::{AtomicBool, Ordering};
use std::time::{Duration, Instant};

/// Time between two reads of the keyboard. After each, the screen is drawn again.
const TURN: Duration = Duration::from_millis(20);

/// Longest wait for a key. With 0, the reader would not look for one.
const LOOK: Duration = Duration::from_micros(100);

/// Longest wait at the end for the answers to a HOLD.
const LAST_HOLD: Duration = Duration::from_secs(2);

/// Whether the terminal can show a full screen: its name is known, and not `dumb`.
pub fn has_screen() -> bool {
    !cfg!(unix) || env::var("TERM").is_ok_and(|name| !matches!(name.as_str(), "" | "dumb"))
}

/// Watches until Ctrl-C or Ctrl-D, or a signal to end. Fails if the terminal or a log fails.
pub fn run(rows: &Rows, names: Vec<String>, mut logs: Option<Logs>) -> Result<()> {
    let stop = ctrl_c()?;
    // The terminal of Git Bash is a pipe, which only the standard library knows. Keys would be read from another console.
    let has_keys = !cfg!(windows) || !io::stdin().is_terminal() || io::stdin().is_tty();
    ensure!(
        has_keys,
        "this terminal passes no keys, not even Esc: use PowerShell, `winpty weeder monitor`, or --plain"
    );
    let mut terminal = ratatui::try_init().context("the terminal cannot be drawn on: --plain does without")?;
    // On Windows, a click would begin a selection: the output stops, and the first Esc only ends the selection.
    if cfg!(windows) {
        let _ = execute!(io::stdout(), EnableMouseCapture);
    }
    let result = watch(&mut terminal, rows, Model::new(names), &mut logs, &stop);
    // What has come while the terminal took nothing, until it was gone.
    let ended = Instant::now();
    while let Some(heard) = rows.next(Duration::ZERO)
        && heard.at < ended
        && let Some(logs) = &mut logs
    {
        // The check below fails for it.
        let _ = logs.take(&heard);
    }
    if cfg!(windows) {
        let _ = execute!(io::stdout(), DisableMouseCapture);
    }
    // The terminal may be gone.
    let _ = ratatui::try_restore();
    result.and_then(|()| logs.map_or(Ok(()), |logs| logs.check()))
}

fn watch(
    terminal: &mut DefaultTerminal,
    rows: &Rows,
    mut model: Model,
    logs: &mut Option<Logs>,
    stop: &AtomicBool,
) -> Result<()> {
    let mut stopped_at = None;
    loop {
        let until = Instant::now() + TURN;
        while let Some(heard) = rows.next(until.saturating_duration_since(Instant::now())) {
            if let Some(Err(error)) = logs.as_mut().map(|logs| logs.take(&heard)) {
                // The machine is still watched, and the other rows' logs are still written.
                model.say(format!("-- {:#}", anyhow::Error::from(error)));
            }
            model.take(heard);
        }
        // The process would end before a HOLD is typed that came with Ctrl-C, or reaches a row that is not open yet.
        let has_held = model.hold.as_ref().is_none_or(Hold::is_obeyed);
        if stop.load(Ordering::Relaxed)
            && (has_held || stopped_at.get_or_insert_with(Instant::now).elapsed() > LAST_HOLD)
        {
            return Ok(());
        }
        model.turn(Instant::now());
        terminal.draw(|frame| view::draw(&model, frame))?;
        ring(&mut model, terminal.backend_mut())?;
        while !stop.load(Ordering::Relaxed) && event::poll(LOOK)? {
            let Event::Key(key) = event::read()? else { continue };
            take_key(&mut model, rows, key);
            stop.fetch_or(ends(key), Ordering::Relaxed);
        }
    }
}

/// Rings the terminal's bell: the operator watches the row, not the screen.
fn ring(model: &mut Model, mut terminal: impl Write) -> io::Result<()> {
    if model.take_ring() {
        terminal.write_all(b"\x07")?;
        terminal.flush()?;
    }
    Ok(())
}

/// Handles a key. Esc comes before all others, even while a command is being typed. It also clears the half-typed line,
/// which would otherwise stand before the next command. Esc and a key that comes at once behind it look like Alt and
/// that key: ssh and tmux join them.
fn take_key(model: &mut Model, rows: &Rows, mut key: KeyEvent) {
    if key.kind == KeyEventKind::Release {
        return;
    }
    // Windows sends Esc as a key, and AltGr as Ctrl and Alt.
    let is_alt_gr = cfg!(windows) && key.modifiers.contains(KeyModifiers::CONTROL);
    if key.code == KeyCode::Esc || key.modifiers.contains(KeyModifiers::ALT) && !is_alt_gr {
        model.line.clear();
        hold_all(model, rows);
        key.modifiers.remove(KeyModifiers::ALT);
    }
    match key.code {
        KeyCode::PageUp if model.are_several() => model.choose(false),
        KeyCode::PageDown if model.are_several() => model.choose(true),
        KeyCode::PageUp => model.pager.back(model.lines.len()),
        KeyCode::PageDown => model.pager.forward(model.lines.len()),
        KeyCode::Up if key.modifiers == KeyModifiers::CONTROL => model.pager.back(model.lines.len()),
        KeyCode::Down if key.modifiers == KeyModifiers::CONTROL => model.pager.forward(model.lines.len()),
        _ => {
            let Some(line) = model.line.key(key) else { return };
            model.pager.follow();
            match addressed(&line, &model.names(), model.target) {
                Err(why) => model.say(format!("-- {why}; nothing was sent")),
                Ok((_, "")) => {}
                Ok((None, command)) if link::is_hold(command) => hold_all(model, rows),
                Ok((to, command)) => {
                    model.sent(to, command);
                    model.targets(to).into_iter().for_each(|row| rows.command(row, command));
                }
            }
        }
    }
}

/// HOLD to all rows, also to those that are lost.
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
    use crate::monitor::model::Answer;
    use link::connection::Opener;
    use link::rows::What;
    use link::session::Happening;
    use link::settings::Settings;
    use link::{EventLine, LinkError};

    fn absent<const COUNT: usize>(names: [&str; COUNT]) -> (Rows, Model) {
        let opener = |_| -> Opener { Box::new(|| Err(LinkError::Absent("it".to_owned()))) };
        let (rows, _) = Rows::open(names.map(opener).into());
        (rows, Model::new(names.map(str::to_owned).into()))
    }

    /// Presses the keys of a text, in which `\n` is Enter.
    fn typed(model: &mut Model, rows: &Rows, text: &str) {
        for character in text.chars() {
            let code = if character == '\n' { KeyCode::Enter } else { KeyCode::Char(character) };
            take_key(model, rows, code.into());
        }
    }

    #[test]
    fn one_key_holds_all_rows_during_typing_and_for_every_chosen_row() {
        let (rows, mut model) = absent(["left", "right"]);
        take_key(&mut model, &rows, KeyCode::PageDown.into());
        typed(&mut model, &rows, "set k");
        assert!(model.hold.is_none());
        take_key(&mut model, &rows, KeyCode::Esc.into());
        let summary = model.hold.as_ref().map(|hold| hold.summary(&model.names()));
        assert_eq!(summary.as_deref(), Some("HOLD 0 of 2; NOT THERE: left, right"));
        assert_eq!((&*model.line.text, model.target), ("", Some(0)), "it does not stand before the next command");
        for (code, modifiers, line) in [
            (KeyCode::Enter, KeyModifiers::ALT, ""),
            (KeyCode::Char('h'), KeyModifiers::ALT, "h"),
            (KeyCode::Esc, KeyModifiers::ALT, ""),
            #[cfg(unix)]
            (KeyCode::Char('c'), KeyModifiers::ALT | KeyModifiers::CONTROL, ""),
        ] {
            model.hold = None;
            typed(&mut model, &rows, "k");
            take_key(&mut model, &rows, KeyEvent::new(code, modifiers));
            assert_eq!((&*model.line.text, model.hold.is_some()), (line, true), "{code:?} comes with Esc");
        }
        // The word `hold`, typed to all rows, does the same.
        for line in ["hold\n", "hold:\n"] {
            (model.hold, model.target) = (None, None);
            typed(&mut model, &rows, line);
            assert!(model.hold.is_some(), "{line}");
        }
    }

    #[test]
    fn the_bell_rings_once_for_each_alarm_and_each_row_that_is_lost() {
        let mut model = Model::new(vec!["row".to_owned()]);
        let mut rung = |happening: Happening| {
            model.update(0, happening);
            let mut written = Vec::new();
            for _ in 0..2 {
                ring(&mut model, &mut written).expect("a vector takes all");
            }
            String::from_utf8(written).expect("a bell is ASCII")
        };
        let event = |line: &str| Happening::Event(EventLine::parse(line).expect("it is one"), line.to_owned());
        let (version, settings, shown, examples) = ("1".to_owned(), Settings::new(), Vec::new(), Vec::new());
        assert_eq!(rung(Happening::Lost("it is not there".to_owned())), "", "it never was there");
        assert_eq!(rung(Happening::Connected { version, settings, shown, examples }), "");
        assert_eq!(rung(event("state is=work")), "");
        assert_eq!(rung(event("alarm code=2-1 name=encoder_silent pos=1")), "\x07");
        assert_eq!(rung(event("warning name=no_plants")), "");
        assert_eq!(rung(Happening::Lost("the port is gone".to_owned())), "\x07");
    }

    #[test]
    fn a_row_s_name_before_a_colon_has_the_command_go_to_that_row_alone() {
        let (rows, mut model) = absent(["row1", "row2", "row3"]);
        let mut enter = |text: &str| {
            typed(&mut model, &rows, &format!("{text}\n"));
            let waiting = model.rows.iter().filter(|row| row.answer == Answer::Waiting);
            let waiting: Vec<&str> = waiting.map(|row| row.name.as_str()).collect();
            let last = model.lines.back().cloned().unwrap_or_default();
            let said = (waiting.join(" "), last, model.hold.is_some());
            model.rows.iter_mut().for_each(|row| row.answer = Answer::None);
            model.hold = None;
            said
        };
        let said = |waiting: &str, line: &str, holds| (waiting.to_owned(), line.to_owned(), holds);
        assert_eq!(enter("row3: set k 5"), said("row3", "> row3: set k 5", false));
        assert_eq!(enter("row2:hold"), said("row2", "> row2: hold", false));
        assert_eq!(enter("set k 5"), said("row1 row2 row3", "> all: set k 5", false));
        assert_eq!(enter("all: hold"), said("row1 row2 row3", "> all: hold", true));
        let unknown = "-- there is no row row4: there are row1, row2, row3; nothing was sent";
        assert_eq!(enter("row4: start"), said("", unknown, false));
        let split = "-- \"row3:\" has no command: write both in one line, as in \"row3: status\"; nothing was sent";
        assert_eq!(enter("row3:"), said("", split, false));
        // No row is connected, so each command is reported as not typed. The line for the unknown row4 was not sent.
        let mut not_typed = Vec::new();
        while not_typed.len() < 4 {
            let heard = rows.next(Duration::from_secs(20)).expect("each is told");
            if let What::NotTyped { command, .. } = heard.what {
                not_typed.push((heard.row, command));
            }
        }
        not_typed.sort();
        let k = || "set k 5".to_owned();
        assert_eq!(not_typed, [(0, k()), (1, k()), (2, k()), (2, k())]);
    }
}
