//! The monitor without a screen: each line of the input is a command, each line of the output an answer or an event.
//!
//! With several rows a command goes to all, or to the row whose name and colon stand before it. Output lines begin with
//! the row's name. A `hold` to all goes to all rows at the same moment, and its result includes the time of the last
//! row.
//!
//! A script keeps its order, because it may set values and then hold. But if an answer does not come, a `hold` behind it
//! goes first, and the lines between are not sent. At the start, lines wait until each row was tried; a `hold` that is
//! first does not. An output or a log that fails does not end the session before the input: a `hold` may still come.

use super::addressed;
use crate::input::{self, Line};
use crate::ports::Chosen;
use crate::record::Logs;
use anyhow::{Result, ensure};
use frame::{Finding, print_to, tell};
use link::advice;
use link::examples::Heading;
use link::rows::{Heard, Hold, Rows, What};
use link::session::{HOLD, Happening};
use link::settings::other_version;
use std::collections::VecDeque;
use std::io::{self, Write};
use std::sync::mpsc::{Receiver, TryRecvError};
use std::time::{Duration, Instant};

/// Lines that are read ahead. The others wait in the pipe.
const READ_AHEAD: usize = 64;

/// Time between two checks of the input.
const LOOK: Duration = Duration::from_millis(20);

/// Time without a line of an awaited answer after which a `hold` goes first.
const STALLED: Duration = Duration::from_millis(500);

/// The same while rows are not tried yet: an old bootloader may start seconds after the other rows.
const OPENING: Duration = Duration::from_secs(3);

/// Longest wait for the two statuses after the last answer. Another version's status may not be known.
const LONGEST_REPORT: Duration = Duration::from_secs(2);

/// Goes on until the input has ended and its last command has been answered; bad where one was refused. The row
/// `connected` is there, and the others may not be tried yet. Fails if a line was not sent, an Uno goes away with
/// commands unanswered, or output or log fail.
pub fn run(rows: &Rows, connected: usize, chosen: &Chosen, logs: Option<Logs>) -> Result<Finding> {
    Talk::new(rows, connected, chosen, logs).run(&input::typed(), &mut io::stdout().lock())
}

/// How a row stands.
#[derive(Default)]
struct Standing {
    /// `None` before the end of the first try.
    is_there: Option<bool>,
    /// Commands that are not answered. Several holds may have one answer.
    unanswered: Vec<String>,
    /// Statuses since the last answer.
    statuses: usize,
    /// Whether it was lost with commands unanswered.
    has_failed: bool,
    heading: Heading,
}

struct Talk<'a> {
    rows: &'a Rows,
    chosen: &'a Chosen,
    logs: Option<Logs>,
    standing: Vec<Standing>,
    /// Lines that wait for an answer to the one before.
    waiting: VecDeque<Line>,
    /// When the last command was sent, or the last line of an answer came.
    moved_at: Instant,
    /// A pending `hold` to all of several rows.
    hold: Option<Hold>,
    /// The numbers of lines that could not be sent.
    unsent: Vec<String>,
    /// Whether the last line named a row only. A shell may split `left: start`, and `start` is not for all.
    is_split: bool,
    /// Whether all could be printed.
    is_printed: bool,
    finding: Finding,
}

impl<'a> Talk<'a> {
    fn new(rows: &'a Rows, connected: usize, chosen: &'a Chosen, logs: Option<Logs>) -> Self {
        let is_there = |row| (row == connected).then_some(true);
        let standing = |row| Standing { is_there: is_there(row), ..Standing::default() };
        let standing = (0..rows.count()).map(standing).collect();
        Self {
            rows,
            chosen,
            logs,
            standing,
            waiting: VecDeque::new(),
            moved_at: Instant::now(),
            hold: None,
            unsent: Vec::new(),
            is_split: false,
            is_printed: true,
            finding: Finding::Good,
        }
    }

    fn run(mut self, commands: &Receiver<Line>, output: &mut impl Write) -> Result<Finding> {
        let mut has_all = false;
        loop {
            while !has_all && self.waiting.len() < READ_AHEAD {
                match commands.try_recv() {
                    Ok(line) => self.waiting.push_back(line),
                    Err(TryRecvError::Disconnected) => has_all = true,
                    Err(TryRecvError::Empty) => break,
                }
            }
            let is_opening = self.standing.iter().any(|row| row.is_there.is_none());
            // A blank line sends nothing.
            let goes_first = |line: &Line| line.text.trim().is_empty() || self.is_hold(line);
            let is_next = self.is_idle() || is_opening && self.waiting.front().is_some_and(goes_first);
            let patience = if is_opening { OPENING } else { STALLED };
            let next = if is_next {
                self.waiting.pop_front()
            } else if self.moved_at.elapsed() > patience {
                self.take_hold()
            } else {
                None
            };
            if let Some(line) = next {
                self.moved_at = Instant::now();
                self.command(&line, output);
            }
            let ended = has_all && self.waiting.is_empty();
            // Two statuses after a command, all its events have come.
            let is_late = self.moved_at.elapsed() > LONGEST_REPORT;
            let has_reported = |row: &Standing| row.is_there == Some(false) || row.statuses >= 2 || is_late;
            if ended && self.is_idle() && self.standing.iter().all(has_reported) {
                return self.end();
            }
            let Some(heard) = self.rows.next(LOOK) else { continue };
            self.take(&heard, ended, output)?;
        }
    }

    fn is_idle(&self) -> bool {
        self.standing.iter().all(|row| row.is_there.is_some() && row.unanswered.is_empty())
    }

    /// The finding of the whole session.
    fn end(&self) -> Result<Finding> {
        let failed = self.chosen.rows.iter().zip(&self.standing).filter(|(_, standing)| standing.has_failed);
        let failed: Vec<&str> = failed.map(|(row, _)| row.name.as_str()).collect();
        ensure!(failed.is_empty(), "not all was answered by {}", failed.join(", "));
        let lines = if self.unsent.len() == 1 { "line" } else { "lines" };
        ensure!(self.unsent.is_empty(), "not sent: {lines} {}", self.unsent.join(", "));
        ensure!(self.is_printed, "not all could be printed");
        self.logs.as_ref().map_or(Ok(()), Logs::check)?;
        Ok(self.finding)
    }

    /// Whether a line is `hold`, to one row or to all.
    fn is_hold(&self, line: &Line) -> bool {
        addressed(&line.text, &self.chosen.names(), None).is_ok_and(|(_, command)| link::is_hold(command))
    }

    /// Refuses the lines before the first waiting `hold`, and returns that.
    fn take_hold(&mut self) -> Option<Line> {
        let place = self.waiting.iter().position(|line| self.is_hold(line))?;
        for line in self.waiting.drain(..place).collect::<Vec<_>>() {
            self.refuse(&line, "hold came first");
        }
        self.waiting.pop_front()
    }

    fn refuse(&mut self, line: &Line, why: &str) {
        tell!("error: line {} was not sent: {why}", line.number);
        self.unsent.push(line.number.to_string());
    }

    /// Prints a line, unless an earlier one has failed.
    fn print(&mut self, line: &str, output: &mut impl Write) {
        if self.is_printed
            && let Err(error) = print_to(output, format_args!("{line}\n"))
        {
            tell!("error: {error:#}");
            self.is_printed = false;
        }
    }

    /// Types a line to the addressed rows. A line that cannot be sent is reported, and the next one may be `hold`.
    fn command(&mut self, line: &Line, output: &mut impl Write) {
        let names = self.chosen.names();
        let (to, command) = match addressed(&line.text, &names, None) {
            // The machine does not answer a line without a word.
            Ok((_, "")) => return,
            Ok((_, command)) if self.is_split && command == line.text.trim() && command != HOLD => {
                self.refuse(line, "a line before has a row, and no command: name the row");
                return;
            }
            Ok((to, command)) => {
                self.is_split &= command == HOLD;
                (to, command)
            }
            Err(why) => {
                self.is_split |= line.text.trim_end().ends_with(':');
                self.refuse(line, &why);
                return;
            }
        };
        let to = to.map_or(0..self.rows.count(), |row| row..row + 1);
        if self.chosen.are_several && to.len() == self.rows.count() && link::is_hold(command) {
            self.hold = Some(Hold::new(Instant::now(), self.standing.iter().map(|row| row.is_there != Some(false))));
        }
        for row in to {
            let standing = &mut self.standing[row];
            if standing.is_there == Some(false) {
                standing.has_failed = true;
                self.print(&self.chosen.under_name(row, "error: the row is not there"), output);
                if link::is_hold(command) {
                    self.rows.hold(row);
                }
                continue;
            }
            standing.unanswered.push(command.to_owned());
            standing.statuses = 0;
            self.rows.command(row, command);
        }
        self.report_hold(output);
    }

    fn take(&mut self, heard: &Heard, ended: bool, output: &mut impl Write) -> Result<()> {
        let row = heard.row;
        let standing = &mut self.standing[row];
        if let Some(logs) = &mut self.logs {
            let written = logs.take(heard);
            // It prints the error. The session goes on, even without any log.
            let _ = logs.go_on_after(written, row, self.chosen);
        }
        let mut said = None;
        match &heard.what {
            What::Happened(Happening::Connected { version, shown, .. }) => {
                standing.is_there = Some(true);
                if let Some(other) = other_version(version, shown) {
                    tell!("{}", self.chosen.under_name(row, &other));
                }
            }
            What::Happened(Happening::Status(..)) => standing.statuses += 1,
            What::Happened(Happening::Started { while_at_work, .. }) => {
                if let Some(cause) = while_at_work {
                    standing.has_failed = true;
                    said = Some(format!("error: {}", advice::restarted(cause)));
                }
            }
            What::Happened(Happening::Lost(why)) => {
                let was_idle = standing.unanswered.is_empty();
                standing.has_failed |= !was_idle;
                (standing.is_there, standing.unanswered) = (Some(false), Vec::new());
                ensure!(self.chosen.are_several || was_idle && !ended, "{why}");
                tell!("{}", self.chosen.under_name(row, why));
            }
            What::Happened(Happening::Event(_, line)) => said = Some(line.clone()),
            What::Happened(Happening::Answer(line)) => {
                standing.statuses = 0;
                self.moved_at = Instant::now();
                // The lines on standard output are the machine's own.
                if let Some(head) = standing.heading.before(line) {
                    tell!("{}", self.chosen.under_name(row, head));
                }
                said = Some(line.clone());
            }
            What::Happened(Happening::Answered { command, refusal, .. }) => {
                standing.unanswered.retain(|waiting| waiting != command);
                if refusal.is_some() {
                    self.finding = Finding::Bad;
                }
            }
            What::Happened(_) => {}
            What::NotTyped { command, why } => {
                standing.unanswered.retain(|waiting| waiting != command);
                standing.has_failed = true;
                said = Some(format!("error: `{command}` was not typed: {why}"));
            }
        }
        if let Some(line) = said {
            self.print(&self.chosen.under_name(row, &line), output);
        }
        if let Some(hold) = &mut self.hold {
            hold.take(heard);
        }
        self.report_hold(output);
        Ok(())
    }

    /// Prints the result of a `hold` to all rows, once no row is left to answer.
    fn report_hold(&mut self, output: &mut impl Write) {
        if let Some(hold) = self.hold.take_if(|hold| hold.is_over()) {
            self.print(&hold.summary(&self.chosen.names()), output);
        }
    }
}

#[cfg(test)]
mod tests {
    use super::*;
    use link::connection::Opener;
    use link::row_names::{Board, Row};
    use link::{LinkError, Wire};
    use rig::ScriptedBoard;
    use std::io::{ErrorKind, Read};
    use std::sync::atomic::{AtomicBool, Ordering};
    use std::sync::{Arc, mpsc};
    use std::thread;

    /// A board whose status has a word that this program does not know, while the flag is set.
    struct Newer<P>(P, Arc<AtomicBool>);

    impl<P: Read> Read for Newer<P> {
        fn read(&mut self, buffer: &mut [u8]) -> io::Result<usize> {
            let count = self.0.read(buffer)?;
            if self.1.load(Ordering::Relaxed) {
                let text = String::from_utf8_lossy(&buffer[..count]).replace("state=hold", "state=park");
                buffer[..count].copy_from_slice(text.as_bytes());
            }
            Ok(count)
        }
    }

    impl<P: Write> Write for Newer<P> {
        fn write(&mut self, bytes: &[u8]) -> io::Result<usize> {
            self.0.write(bytes)
        }

        fn flush(&mut self) -> io::Result<()> {
            self.0.flush()
        }
    }

    /// The only row, whose port is at this board.
    fn only_row(open: Opener) -> (Rows, Chosen) {
        let (rows, first_tries) = Rows::open(vec![open]);
        assert!(first_tries.recv().unwrap().1.is_none());
        let row = Row { name: "Uno".to_owned(), board: Board::Only { beside: None } };
        (rows, Chosen { rows: vec![row], are_several: false })
    }

    #[test]
    fn a_session_ends_without_a_status_that_it_knows() {
        let (ended, end) = mpsc::channel();
        thread::spawn(move || {
            let port = ScriptedBoard::plugged_in();
            let is_parked = Arc::new(AtomicBool::new(false));
            let flag = Arc::clone(&is_parked);
            let (rows, chosen) = only_row(Box::new(move || {
                let port = port.open().ok_or(LinkError::Absent("it".to_owned()))?;
                Ok(Wire::over(Newer(port, Arc::clone(&flag)), false))
            }));
            is_parked.store(true, Ordering::Relaxed);
            let (sender, commands) = mpsc::sync_channel(1);
            sender.send(Line { number: 1, text: "status".to_owned() }).unwrap();
            drop(sender);
            let mut output = Vec::new();
            let finding = Talk::new(&rows, 0, &chosen, None).run(&commands, &mut output).unwrap();
            ended.send((finding, String::from_utf8(output).unwrap())).unwrap();
        });
        let (finding, output) = end.recv_timeout(Duration::from_secs(30)).expect("it ends");
        assert_eq!(finding, Finding::Good);
        assert!(output.contains("state=park"), "{output}");
    }

    /// An output that fails this way.
    struct Failing(ErrorKind);

    impl Write for Failing {
        fn write(&mut self, _: &[u8]) -> io::Result<usize> {
            Err(self.0.into())
        }

        fn flush(&mut self) -> io::Result<()> {
            Ok(())
        }
    }

    /// Opens the port of this board.
    fn opener(board: &ScriptedBoard) -> Opener {
        let port = board.clone();
        Box::new(move || Ok(Wire::over(port.open().ok_or(LinkError::Absent("it".to_owned()))?, false)))
    }

    /// A session with this board and this input.
    fn talk(board: &ScriptedBoard, input: &[&str], output: &mut impl Write) -> Result<Finding> {
        let (rows, chosen) = only_row(opener(board));
        let (sender, commands) = mpsc::sync_channel(9);
        for (number, text) in (1..).zip(input) {
            sender.send(Line { number, text: (*text).to_owned() }).unwrap();
        }
        drop(sender);
        Talk::new(&rows, 0, &chosen, None).run(&commands, output)
    }

    #[test]
    fn a_hold_is_typed_though_nothing_can_be_printed() {
        // A reader that has closed the pipe has read enough.
        for (kind, finding) in [(ErrorKind::BrokenPipe, Some(Finding::Good)), (ErrorKind::StorageFull, None)] {
            let board = ScriptedBoard::plugged_in();
            let ended = talk(&board, &["get k", "hold"], &mut Failing(kind));
            assert_eq!(ended.ok(), finding, "{kind}");
            assert_eq!(board.typed()[..3], ["events on", "get k", "hold"]);
        }
    }

    #[test]
    fn a_command_that_a_shell_splits_from_its_row_is_not_sent() {
        let board = ScriptedBoard::plugged_in();
        let ended = talk(&board, &["Uno:", "", "test", "start", "Uno: clear", "Uno:", "hold"], &mut Vec::new());
        assert_eq!(ended.unwrap_err().to_string(), "not sent: lines 1, 3, 4, 6");
        assert_eq!(board.typed()[..3], ["events on", "clear", "hold"]);
    }

    #[test]
    fn one_answer_ends_every_hold_before_it() {
        let (rows, chosen) = only_row(opener(&ScriptedBoard::plugged_in()));
        let mut talk = Talk::new(&rows, 0, &chosen, None);
        for (number, text) in [(1, "hold"), (2, "Hold!")] {
            talk.command(&Line { number, text: text.to_owned() }, &mut Vec::new());
        }
        assert!(!talk.is_idle());
        let what = What::Happened(Happening::Answered { number: 1, command: "hold".to_owned(), refusal: None });
        talk.take(&Heard { row: 0, at: Instant::now(), what }, false, &mut Vec::new()).unwrap();
        assert!(talk.is_idle());
    }

    #[test]
    fn a_hold_reaches_the_rows_that_are_there_while_another_is_not_open_yet() {
        let (gate, closed) = mpsc::channel::<()>();
        let absent: Opener = Box::new(move || {
            // An error too: the gate is open.
            let _ = closed.recv();
            Err(LinkError::Absent("it".to_owned()))
        });
        let board = ScriptedBoard::plugged_in();
        let (rows, first_tries) = Rows::open(vec![opener(&board), absent]);
        assert_eq!(first_tries.recv().unwrap().0, 0);
        let row = |name: &str| Row { name: name.to_owned(), board: Board::Only { beside: None } };
        let chosen = Chosen { rows: vec![row("left"), row("s\u{fc}d")], are_several: true };
        let (sender, commands) = mpsc::sync_channel(2);
        for (number, text) in [(1, "hold"), (2, "left: clear")] {
            sender.send(Line { number, text: text.to_owned() }).unwrap();
        }
        drop(sender);
        let talk = thread::spawn(move || {
            let mut output = Vec::new();
            let ended = Talk::new(&rows, 0, &chosen, None).run(&commands, &mut output);
            (ended.unwrap_err().to_string(), String::from_utf8(output).unwrap())
        });
        let has_held = (0..30_000).any(|_| {
            thread::sleep(Duration::from_millis(1));
            board.typed().contains(&"hold".to_owned())
        });
        assert!(has_held && !board.typed().contains(&"clear".to_owned()), "{:?}", board.typed());
        drop(gate);
        let (error, output) = talk.join().unwrap();
        assert_eq!(error, "not all was answered by s\u{fc}d");
        assert!(output.contains("HOLD 1 of 2 in ") && output.contains("NOT THERE: s\u{fc}d"), "{output}");
        assert!(board.typed().contains(&"clear".to_owned()), "{:?}", board.typed());
    }

    #[test]
    fn a_hold_goes_before_an_answer_that_does_not_come() {
        let board = ScriptedBoard::plugged_in();
        assert!(talk(&board, &["clear", "silence", "clear", "Hold!"], &mut Vec::new()).is_err());
        assert_eq!(board.typed()[..4], ["events on", "clear", "silence", "hold"]);
        assert!(!board.typed()[4..].contains(&"clear".to_owned()));
    }
}
