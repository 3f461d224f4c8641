//! `weeder monitor`: the machine's state, live, with its console below; for several rows, an overview of all.
//!
//! [`link::rows::Rows`] talk to the machine, [`model`] stores its state, [`view`] draws that, and [`terminal`]
//! adds the keyboard. [`plain`] works without a screen: lines in, lines out.

mod command_line;
mod model;
mod pager;
mod plain;
mod terminal;
mod view;

use crate::ports::{Ports, find};
use crate::record::{self, Logs};
use anyhow::{Result, ensure};
use clap::Args;
use frame::Finding;
use link::row_names::ALL;
use link::session::HOLD;
use std::path::PathBuf;

#[derive(Args)]
#[command(after_help = "\
Keys:\n  \
    Esc                  HOLD to every row; drops the line that you are typing\n  \
    Page Up, Page Down   earlier lines, later lines; with several rows Ctrl-Up, Ctrl-Down\n  \
    Page Up, Page Down   with several rows: select the row for commands, or all\n  \
    Shift-fn-Up, -Down   Page Up and Page Down in the Terminal of a Mac\n  \
    Tab, Up, Down        complete, recall earlier lines\n  \
    Ctrl-U, Ctrl-C       clear the line, end\n\
HOLD is no emergency stop: that one cuts the power.\n\nExamples:\n  \
    weeder monitor                                       watch the only Uno, and type commands\n  \
    weeder monitor --log row.csv                         also keep a log, for `weeder replay`\n  \
    weeder monitor --all                                 every row of a machine at a glance\n  \
    echo status | weeder monitor --plain                 from a script; status 1 if refused, 2 if not sent\n  \
    echo \"left: status\" | weeder monitor --plain --all   to one row; without a name, to all")]
pub struct Arguments {
    #[command(flatten)]
    ports: Ports,
    /// Read and write lines, for pipes; end after the input's last answer.
    #[arg(long)]
    plain: bool,
    /// Write a log to this file; with several rows, to a folder with a log for each row.
    #[arg(long, value_name = "FILE.csv|FOLDER")]
    log: Option<PathBuf>,
}

/// Parses a typed line: the row before a colon, or `all`, and the command. Without a row it goes to `chosen`. `None` is
/// all rows. Fails if there is no such row, or the rest is missing or no command; in words.
fn addressed<'a>(line: &'a str, names: &[String], chosen: Option<usize>) -> Result<(Option<usize>, &'a str), String> {
    // A colon behind `hold` is punctuation, not the end of a row's name.
    if link::is_hold(line) {
        return Ok((chosen, HOLD));
    }
    let row = |name: &str| if name.eq_ignore_ascii_case(ALL) { Ok(None) } else { find(name, names).map(Some) };
    let (to, command) = match line.split_once(':').map(|(name, command)| (row(name.trim()), command.trim())) {
        Some((Ok(_), "")) => {
            let name = line.trim();
            return Err(format!("{name:?} has no command: write both in one line, as in \"{name} status\""));
        }
        Some((Ok(to), command)) => (to, command),
        Some((Err(why), _)) if names.len() > 1 => return Err(why),
        _ => (chosen, line.trim()),
    };
    match link::is_command(command) {
        true => Ok((to, if link::is_hold(command) { HOLD } else { command })),
        false => Err(format!(
            "{command:?} is no command: it has to be one line of at most {} printable ASCII characters",
            link::COMMAND_LENGTH
        )),
    }
}

pub fn run(arguments: &Arguments) -> Result<Finding> {
    // Before a port is opened, which resets its Uno.
    ensure!(
        arguments.plain || terminal::has_screen(),
        "this terminal shows no full screen (TERM is `dumb` or not set): --plain does without"
    );
    let chosen = arguments.ports.choose(None)?;
    let logs = arguments.log.as_deref().map(|out| Logs::open(out, &chosen)).transpose()?;
    let (rows, connected) = record::open(&chosen)?;
    match arguments.plain {
        true => plain::run(&rows, connected, &chosen, logs),
        false => terminal::run(&rows, chosen.names(), logs).map(|()| Finding::Good),
    }
}
