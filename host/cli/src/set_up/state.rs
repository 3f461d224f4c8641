//! The file of a set-up: its board, completed steps, measurements, and the board's settings as they were last.

use anyhow::{Result, bail};
use frame::Messages;
use link::row_names::Board;
use link::settings::{Setting, name};
use mechanics::machine::{Input, Machine};
use set_up::SetUp;
use std::collections::{BTreeMap, BTreeSet};
use std::path::Path;

/// The completed steps, the measurements, and the user's measures.
#[derive(Default)]
pub(super) struct State {
    /// The board, in words. Empty in a new file.
    board: String,
    pub(super) done: BTreeSet<usize>,
    /// The machine's measures, asked or of a file, in a machine file's units, by section and key.
    pub(super) asked: BTreeMap<String, f64>,
    /// With the board's settings as they were last.
    pub(super) measured: SetUp,
}

/// The first line of its file.
const HEAD: &str = "# What `weeder set-up` has done and measured: it goes on from here.";

/// The beginnings of its other lines. The settings come behind a typed `get`, as in a log.
const BOARD: &str = "board ";
const DONE: &str = "done ";
const ASK: &str = "machine ";
const GET: &str = "> get";

/// A board with its own number begins so, in words.
const NUMBER: &str = "serial number ";

impl State {
    pub(super) fn parse(text: &str) -> Result<Self> {
        let mut lines = text.lines();
        match lines.next() {
            None | Some(HEAD) => {}
            Some(_) => bail!("its first line has to be `{HEAD}`; give another --state"),
        }
        let of = |beginning: &'static str| lines.clone().filter_map(move |line| line.strip_prefix(beginning));
        let asked = of(ASK)
            .filter_map(|line| line.split_once(' '))
            .filter_map(|(key, value)| Some((key.to_owned(), value.parse().ok()?)));
        Ok(Self {
            board: of(BOARD).next().unwrap_or_default().to_owned(),
            done: of(DONE).filter_map(|number| number.parse().ok()).collect(),
            asked: asked.collect(),
            measured: SetUp::of_lines(lines),
        })
    }

    pub(super) fn text(&self) -> String {
        let mut lines = vec![HEAD.to_owned(), format!("{BOARD}{}", self.board)];
        lines.extend(self.done.iter().map(|number| format!("{DONE}{number}")));
        lines.extend(self.asked.iter().map(|(key, value)| format!("{ASK}{key} {value}")));
        lines.extend(self.measured.lines());
        lines.push(GET.to_owned());
        let value = |setting| format!("{}={}", name(setting), self.measured.settings.get(setting));
        lines.extend(Setting::all().map(value));
        lines.push(String::new());
        lines.join("\n")
    }

    /// Keeps a machine file's measures: a later call may come without the file.
    pub(super) fn take_machine(&mut self, machine: &Machine) {
        // Conversions leave a last digit.
        let measure = |input: Input| (format!("{}.{}", input.section, input.key), (input.value * 1e6).round() / 1e6);
        self.asked.extend(machine.inputs().into_iter().map(measure));
    }

    /// Takes the board that is there. Fails if the file belongs to a board with another serial number.
    pub(super) fn take_board(&mut self, board: &Board, path: &Path) -> Result<()> {
        let named = match board {
            Board::SerialNumber(number) => format!("{NUMBER}{number}"),
            Board::Port(port) => format!("port {port}"),
            Board::Only { .. } => String::new(),
        };
        if [&self.board, &named].iter().all(|words| words.starts_with(NUMBER)) && self.board != named {
            let path = path.display();
            bail!(
                "{path} belongs to the board with {}, and this one has {named}: give another --state, or start \
                 {path} again with --again",
                self.board
            );
        }
        if !self.board.is_empty() && self.board != named {
            writeln!(Messages, "{} was made for a board at {}. This one is at {named}.", path.display(), self.board);
        }
        self.board = named;
        Ok(())
    }
}
