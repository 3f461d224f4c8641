//! The file of a set-up: its board, completed steps, measurements, and the board's settings as they were last.

use anyhow::{Result, bail};
use link::row_names::Board;
use link::settings::{Setting, name};
use mechanics::machine::{Input, Machine};
use set_up::{SetUp, Task, steps};
use std::collections::{BTreeMap, BTreeSet};

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

/// The tool's width, as a machine file names it.
pub(super) const TOOL_WIDTH: &str = "intra_row.width";

/// The sections of a machine file on which the stroke depends, and the beginnings of those measures that change the servo's times.
const SWUNG: [&str; 2] = ["intra_row", "swing"];
const TIMED: [&str; 7] = [
    "intra_row.blade",
    "intra_row.servo",
    "intra_row.shank",
    "swing.arm",
    "swing.least_dead",
    "swing.most_dead",
    "swing.servo",
];

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

    /// Keeps a machine file's measures: a later call may come without the file. Returns those of arm, tool and servo that were
    /// others, each in a line.
    pub(super) fn take_machine(&mut self, machine: &Machine) -> Vec<String> {
        let mut others = Vec::new();
        for Input { section, key, value, unit, .. } in machine.inputs() {
            // Conversions leave a last digit.
            let (name, value) = (format!("{section}.{key}"), (value * 1e6).round() / 1e6);
            let before = self.take_measure(&name, value);
            if let Some(before) = before.filter(|_| SWUNG.contains(&section)) {
                others.push(format!("{name} is {value} {unit}, and was {before}"));
            }
        }
        others
    }

    /// Keeps a measure of the machine. Another one than before opens the steps that follow from it. Returns that one.
    pub(super) fn take_measure(&mut self, name: &str, value: f64) -> Option<f64> {
        let before = self.asked.insert(name.to_owned(), value).filter(|&before| before != value)?;
        if SWUNG.iter().any(|section| name.starts_with(section)) {
            self.open_again(|task| match task {
                Task::Set(Setting::StemZoneMm, _) => true,
                Task::Fit(..) => name == TOOL_WIDTH,
                _ => false,
            });
        }
        if TIMED.iter().any(|beginning| name.starts_with(beginning)) {
            self.measured.forget_timings();
        }
        Some(before)
    }

    /// Opens the steps with such a task again.
    pub(super) fn open_again(&mut self, is_other: impl Fn(&Task) -> bool) {
        for step in steps().iter().filter(|step| step.tasks.iter().any(&is_other)) {
            self.done.remove(&step.number);
        }
    }

    /// Takes the board that is there. Returns the file's board, in words, if that is another.
    pub(super) fn take_board(&mut self, board: &Board) -> Option<String> {
        let named = match board {
            Board::SerialNumber(number) => format!("serial number {number}"),
            Board::Port(port) => format!("port {port}"),
            Board::Only { .. } => String::new(),
        };
        let before = std::mem::replace(&mut self.board, named);
        (!before.is_empty() && before != self.board).then_some(before)
    }

    /// The board, in words.
    pub(super) fn board(&self) -> &str {
        if self.board.is_empty() { "no number" } else { &self.board }
    }
}
