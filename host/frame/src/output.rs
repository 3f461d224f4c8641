//! Printing of all commands: results go to standard output, other messages to standard error.
//!
//! A reader that closes a pipe early has read enough. The command then drops the rest of its output and ends with its
//! usual status. Any other failure to print a result, such as a full disk, is the command's error. Messages beside the
//! result are for an operator who watches, so a failure to print them is ignored. Messages quote files and machines,
//! which may contain control characters. These are removed before they reach a terminal.
//!
//! A stopped terminal takes no output: Ctrl-S stops it, and so does a text selection on Windows, or an ssh whose network
//! stalls. A pipe whose reader pauses does the same. Printing then waits. A command that may have to send a HOLD prints by
//! [`teller`] or [`printing_aside`], in a thread of its own.

use anyhow::{Context, Result, ensure};
use files::in_a_line;
use std::env;
use std::fmt::Arguments;
use std::io::{self, ErrorKind, IsTerminal, Write};
use std::sync::Arc;
use std::sync::atomic::{AtomicUsize, Ordering};
use std::sync::mpsc::{self, Receiver, Sender};
use std::thread;

/// Most messages of a [`teller`] that wait to be printed.
const WAITING: usize = 64;

/// Standard output, for a command's result: `writeln!(Results, "...")?`.
#[derive(Clone, Copy, Debug)]
pub struct Results;

impl Results {
    /// Prints a part of the result, unchanged: for `write!` and `writeln!`.
    ///
    /// # Errors
    /// Any error of standard output, except a pipe that its reader has closed.
    pub fn write_fmt(self, text: Arguments) -> Result<()> {
        print_to(&mut io::stdout().lock(), text)
    }
}

/// Standard error, for messages beside the result: `writeln!(Messages, "...")`.
#[derive(Clone, Copy, Debug)]
pub struct Messages;

impl Messages {
    /// Prints a line: for `writeln!`.
    pub fn write_fmt(self, line: Arguments) {
        let line = line.to_string();
        // Standard error is closed: there is no other place for the message.
        let _ = writeln!(io::stderr(), "{}", in_a_line(line.trim_end_matches('\n')));
    }
}

/// As [`Results`], to this output.
fn print_to(output: &mut impl Write, text: Arguments) -> Result<()> {
    match output.write_fmt(text).and_then(|()| output.flush()) {
        Err(error) if error.kind() == ErrorKind::BrokenPipe => Ok(()),
        written => written.context("the result cannot be printed"),
    }
}

/// A function that prints messages as [`Messages`] does, in a thread of its own: it never waits. Messages that find 64
/// others waiting are dropped. Their number is printed once the output takes messages again.
pub fn teller() -> impl Fn(&str) + Send + Sync + 'static {
    teller_by(|line| writeln!(Messages, "{line}"))
}

/// The same, with a function that prints.
fn teller_by(print: impl Fn(&str) + Send + 'static) -> impl Fn(&str) + Send + Sync + 'static {
    let (lines, waiting) = mpsc::sync_channel::<String>(WAITING);
    let dropped = Arc::new(AtomicUsize::new(0));
    let to_report = Arc::clone(&dropped);
    thread::spawn(move || {
        for line in waiting {
            print(&line);
            let count = to_report.swap(0, Ordering::Relaxed);
            if count > 0 {
                print(&format!("Messages dropped while this output was stopped: {count}"));
            }
        }
    });
    move |line: &str| {
        if lines.try_send(line.to_owned()).is_err() {
            dropped.fetch_add(1, Ordering::Relaxed);
        }
    }
}

/// What [`printing_aside`] prints, without the line's end.
#[derive(Debug)]
pub enum Printed {
    /// A line of the result.
    Result(String),
    /// A message, as by [`Messages`].
    Message(String),
    /// The bell of the operator's terminal.
    Bell,
}

/// Does work whose lines are printed in a thread of its own: the work never waits for the output. All lines are
/// printed, in their order, before this returns.
///
/// # Errors
/// The work's error. If a line of the result cannot be printed, as by [`Results`]: this error is printed at once, and the
/// rest of the result is dropped.
pub fn printing_aside<T>(
    output: &mut (impl Write + Send),
    work: impl FnOnce(Sender<Printed>) -> Result<T>,
) -> Result<T> {
    let (lines, waiting) = mpsc::channel();
    thread::scope(|scope| {
        let printing = scope.spawn(move || print_all(waiting, output));
        let done = work(lines)?;
        // A thread that panicked has printed why.
        ensure!(printing.join().unwrap_or(false), "not all could be printed");
        Ok(done)
    })
}

/// Returns whether all could be printed.
fn print_all(waiting: Receiver<Printed>, output: &mut impl Write) -> bool {
    let mut is_printed = true;
    for line in waiting {
        match line {
            Printed::Message(line) => writeln!(Messages, "{line}"),
            Printed::Bell => {
                let mut errors = io::stderr();
                if errors.is_terminal() {
                    // As for a message.
                    let _ = errors.write_all(b"\x07");
                }
            }
            Printed::Result(line) if is_printed => {
                if let Err(error) = print_to(output, format_args!("{line}\n")) {
                    writeln!(Messages, "error: {error:#}");
                    is_printed = false;
                }
            }
            Printed::Result(_) => {}
        }
    }
    is_printed
}

/// The command as typed, for a report that says how to repeat it. Fails if a word cannot be quoted for a shell.
pub fn command_line() -> Result<String> {
    let words: Vec<_> = env::args_os().skip(1).collect();
    let words = words.iter().map(|word| word.to_string_lossy());
    let words: Vec<_> = ["weeder".into()].into_iter().chain(words).collect();
    Ok(shlex::try_join(words.iter().map(AsRef::as_ref))?)
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn messages_never_wait_for_an_output_and_drops_are_counted() {
        const SENT: usize = 100;
        let (stopped, until) = mpsc::channel::<()>();
        let (taken, is_taken) = mpsc::channel();
        let (printed, seen) = mpsc::channel();
        let tell = teller_by(move |line| {
            let _ = taken.send(());
            // An error too: the output takes messages again.
            let _ = until.recv();
            let _ = printed.send(line.to_owned());
        });
        // It would never return here, if a message waited for the output.
        tell("0");
        is_taken.recv().expect("the thread has taken it");
        (1..SENT).for_each(|number| tell(&number.to_string()));
        drop((stopped, tell));
        let seen: Vec<String> = seen.iter().collect();
        let (reports, shown): (Vec<_>, Vec<_>) =
            seen.into_iter().partition(|line| line.starts_with("Messages dropped"));
        assert_eq!(shown.len(), 1 + WAITING, "{shown:?}");
        assert!(shown.iter().enumerate().all(|(number, line)| *line == number.to_string()), "{shown:?}");
        let report = format!("Messages dropped while this output was stopped: {}", SENT - shown.len());
        assert_eq!(reports, [report]);
    }
}
