//! The monitor without a screen: each line of the input is a command, each line of the output an answer or an event.

use crate::Finding;
use crate::output::tell;
use anyhow::{Result, ensure};
use link::log::LogWriter;
use link::session::{Happening, Session};
use std::io::{self, BufRead, ErrorKind, Write};
use std::sync::mpsc::{self, Receiver, TryRecvError};
use std::thread;
use std::time::Instant;

/// Goes on until the input has ended and its last command has been answered; bad where one was refused.
///
/// # Errors
/// Where a line is no command, the Uno goes away with commands unanswered, or output or log fail.
pub fn run(session: Session, log: Option<LogWriter>) -> Result<Finding> {
    let (sender, commands) = mpsc::channel();
    // Reading waits for as long as nobody types, so it does so by itself; it ends with the process.
    thread::spawn(move || io::stdin().lock().lines().map_while(Result::ok).try_for_each(|line| sender.send(line)));
    match talk(session, log, &commands, &mut io::stdout().lock()) {
        // Whoever read the output has seen enough.
        Err(error) if error.downcast_ref::<io::Error>().is_some_and(|error| error.kind() == ErrorKind::BrokenPipe) => {
            Ok(Finding::Good)
        }
        result => result,
    }
}

fn talk(
    mut session: Session,
    mut log: Option<LogWriter>,
    commands: &Receiver<String>,
    output: &mut impl Write,
) -> Result<Finding> {
    let mut finding = Finding::Good;
    let mut ended = false;
    // What the last command brought about is told before the machine has given its status twice.
    let mut statuses = 0;
    loop {
        // One at a time, so that the commands wait in the pipe.
        if session.is_idle() && !ended {
            match commands.try_recv() {
                Ok(command) => ensure!(
                    session.command(command.trim()),
                    "{command:?} is no command: it has to be one line of at most {} printable ASCII characters",
                    link::COMMAND_LENGTH
                ),
                Err(TryRecvError::Disconnected) => ended = true,
                Err(TryRecvError::Empty) => {}
            }
        }
        if ended && session.is_idle() && statuses >= 2 {
            return Ok(finding);
        }
        let was_idle = session.is_idle();
        for happening in session.turn(Instant::now()) {
            if let Some(log) = &mut log {
                log.write(&happening)?;
            }
            match happening {
                Happening::Connected { .. } | Happening::Settings(_) | Happening::Command(_) => {}
                Happening::Status(..) => statuses += 1,
                Happening::Lost(why) => {
                    ensure!(was_idle && !ended, "{why}");
                    tell!("{why}");
                }
                Happening::Event(_, line) => writeln!(output, "{line}")?,
                Happening::Answer(line) => {
                    statuses = 0;
                    if line.starts_with("error:") {
                        finding = Finding::Bad;
                    }
                    writeln!(output, "{line}")?;
                }
            }
        }
        output.flush()?;
    }
}
