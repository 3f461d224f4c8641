//! The monitor without a screen: each line of the input is a command, each line of the output an answer or an event.
//!
//! With several rows a command goes to all, or to the row whose name and colon stand before it. Output lines begin with
//! the row's name. A `hold` to all goes to all rows at the same moment, and its result includes the time of the last
//! row.
//!
//! A script keeps its order, because it may set values and then hold. But if an answer does not come, a `hold` behind it
//! goes first, and the lines between are not sent. At the start, lines wait until each row was tried; a `hold` that is
//! first does not. An output or a log that fails does not end the session before the input: a `hold` may still come. An
//! output that takes nothing, such as a stopped terminal, delays no `hold`: a thread of its own prints.

use super::addressed;
use crate::input::{self, Line};
use crate::ports::Chosen;
use crate::record::Logs;
use anyhow::{Error, Result, ensure};
use frame::{Finding, Printed, printing_aside};
use link::advice;
use link::examples::Heading;
use link::rows::{Heard, Hold, Rows, What};
use link::session::{HOLD, Happening};
use link::settings::other_version;
use std::collections::VecDeque;
use std::io;
use std::sync::mpsc::{Receiver, Sender, TryRecvError};
use std::time::{Duration, Instant};

/// Lines that are read ahead. The others wait in the pipe.
const READ_AHEAD: usize = 64;

const LOOK: Duration = Duration::from_millis(20);

/// Longest look that counts as a wait for an answer: in a longer one this computer stood still.
const LONGEST_LOOK: Duration = Duration::from_millis(200);

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
    printing_aside(&mut io::stdout(), |lines| Talk::new(rows, connected, chosen, logs, lines).run(&input::typed()))
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
    /// Time in looks since the last command was sent, or the last line of an answer came. What came while this computer
    /// stood still is read first.
    silent: Duration,
    /// A pending `hold` to all of several rows.
    hold: Option<Hold>,
    /// The numbers of lines that could not be sent.
    unsent: Vec<String>,
    /// Whether the last line named a row only. A shell may split `left: start`, and `start` is not for all.
    is_split: bool,
    lines: Sender<Printed>,
    finding: Finding,
}

impl<'a> Talk<'a> {
    fn new(rows: &'a Rows, connected: usize, chosen: &'a Chosen, logs: Option<Logs>, lines: Sender<Printed>) -> Self {
        let is_there = |row| (row == connected).then_some(true);
        let standing = |row| Standing { is_there: is_there(row), ..Standing::default() };
        let standing = (0..rows.count()).map(standing).collect();
        Self {
            rows,
            chosen,
            logs,
            standing,
            waiting: VecDeque::new(),
            silent: Duration::ZERO,
            hold: None,
            unsent: Vec::new(),
            is_split: false,
            lines,
            finding: Finding::Good,
        }
    }

    fn run(mut self, commands: &Receiver<Line>) -> Result<Finding> {
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
            } else if self.silent > patience {
                self.take_hold()
            } else {
                None
            };
            if let Some(line) = next {
                self.silent = Duration::ZERO;
                self.command(&line);
            }
            let ended = has_all && self.waiting.is_empty();
            // Three statuses after a command, all its events have come, and both answers about changed settings.
            let is_late = self.silent > LONGEST_REPORT;
            let has_reported = |row: &Standing| row.is_there == Some(false) || row.statuses >= 3 || is_late;
            if ended && self.is_idle() && self.standing.iter().all(has_reported) {
                return self.end();
            }
            let began = Instant::now();
            let heard = self.rows.next(LOOK);
            self.silent += began.elapsed().min(LONGEST_LOOK);
            if let Some(heard) = heard {
                self.take(&heard, ended)?;
            }
        }
    }

    fn is_idle(&self) -> bool {
        self.standing.iter().all(|row| row.is_there.is_some() && row.unanswered.is_empty())
    }

    fn end(&self) -> Result<Finding> {
        let failed = self.chosen.rows.iter().zip(&self.standing).filter(|(_, standing)| standing.has_failed);
        let failed: Vec<&str> = failed.map(|(row, _)| row.name.as_str()).collect();
        ensure!(failed.is_empty(), "not all was answered by {}", failed.join(", "));
        let lines = if self.unsent.len() == 1 { "line" } else { "lines" };
        ensure!(self.unsent.is_empty(), "not sent: {lines} {}", self.unsent.join(", "));
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
        self.tell(format!("error: line {} was not sent: {why}", line.number));
        self.unsent.push(line.number.to_string());
    }

    fn print(&self, line: String) {
        // The thread that prints is gone only after a panic, which the end reports.
        let _ = self.lines.send(Printed::Result(line));
    }

    /// Has a message printed beside the result.
    fn tell(&self, message: String) {
        // As above.
        let _ = self.lines.send(Printed::Message(message));
    }

    /// Types a line to the addressed rows. A line that cannot be sent is reported, and the next one may be `hold`.
    fn command(&mut self, line: &Line) {
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
                self.print(self.chosen.under_name(row, "error: the row is not there"));
                if link::is_hold(command) {
                    self.rows.hold(row);
                }
                continue;
            }
            standing.unanswered.push(command.to_owned());
            standing.statuses = 0;
            self.rows.command(row, command);
        }
        self.report_hold();
    }

    fn take(&mut self, heard: &Heard, ended: bool) -> Result<()> {
        let row = heard.row;
        // The session goes on, even without any log.
        if let Some(Err(error)) = self.logs.as_mut().map(|logs| logs.take(heard)) {
            self.tell(format!("error: {}", self.chosen.under_name(row, &format!("{:#}", Error::from(error)))));
        }
        let standing = &mut self.standing[row];
        let mut said = None;
        match &heard.what {
            What::Happened(Happening::Connected { version, shown, .. }) => {
                standing.is_there = Some(true);
                if let Some(other) = other_version(version, shown) {
                    self.tell(self.chosen.under_name(row, &other));
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
                self.tell(self.chosen.under_name(row, why));
            }
            What::Happened(Happening::Event(_, line)) => said = Some(line.clone()),
            What::Happened(Happening::Answer(line)) => {
                standing.statuses = 0;
                self.silent = Duration::ZERO;
                // The lines on standard output are the machine's own.
                if let Some(head) = standing.heading.before(line) {
                    self.tell(self.chosen.under_name(row, head));
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
            self.print(self.chosen.under_name(row, &line));
        }
        if let Some(hold) = &mut self.hold {
            hold.take(heard);
        }
        self.report_hold();
        Ok(())
    }

    /// Prints the result of a `hold` to all rows, once no row is left to answer.
    fn report_hold(&mut self) {
        if let Some(hold) = self.hold.take_if(|hold| hold.is_over()) {
            self.print(hold.summary(&self.chosen.names()));
        }
    }
}

#[cfg(test)]
mod tests;
