//! `weeder rows`: lists the Unos and the rows that they control, and finds them again at other ports.

use crate::ports::{NamesFile, unnamed};
use anyhow::{Result, anyhow};
use clap::{Args, Subcommand};
use comfy_table::{Table, presets};
use frame::Results;
use link::LinkError;
use link::row_names::{Board, Names, Plugged, plugged};
use serde_json::{Value, json};

#[derive(Args)]
#[command(
    args_conflicts_with_subcommands = true,
    after_help = "\
A row is recognised by its board's USB serial number, at any port, or else by its USB socket.\n\
`weeder monitor`, `record`, `serve` and `settings` take its name as --port, and all rows with --all.\n\n\
Examples:\n  \
    weeder rows                                  the named rows, and the other connected Unos\n  \
    weeder rows name left /dev/ttyACM0           name the row of the board at this port\n  \
    weeder rows forget left                      remove the name"
)]
pub struct Arguments {
    #[command(subcommand)]
    action: Option<Action>,
    /// Print them as JSON.
    #[arg(long)]
    json: bool,
    #[command(flatten)]
    file: NamesFile,
}

#[derive(Subcommand)]
enum Action {
    /// Name the row of the board at a port. Rows are listed in the order of naming.
    #[command(after_help = "Example: weeder rows name left /dev/ttyACM0")]
    Name {
        /// The row's name: 1 to 24 characters, valid as a file name.
        #[arg(value_name = "NAME")]
        name: String,
        /// The board's present port.
        #[arg(value_name = "PORT")]
        port: String,
        #[command(flatten)]
        file: NamesFile,
    },
    /// Forget a row's name.
    #[command(after_help = "Example: weeder rows forget left")]
    Forget {
        /// The row's name.
        #[arg(value_name = "NAME")]
        name: String,
        #[command(flatten)]
        file: NamesFile,
    },
}

pub fn run(arguments: &Arguments) -> Result<()> {
    match &arguments.action {
        None => list(&arguments.file.read()?, arguments.json),
        Some(Action::Name { name, port, file }) => {
            let board = Board::at(port).map_err(|error| match error {
                LinkError::Absent(port) => anyhow!("there is no port {port}: `weeder rows` lists the connected Unos"),
                other => other.into(),
            })?;
            let mut names = Names::read(&file.path()?)?;
            let before = names.rows().iter().find(|row| row.board == board && row.name != *name).cloned();
            names.name(name, board.clone())?;
            names.write()?;
            if let Some(before) = before {
                writeln!(Results, "{} is forgotten: it was this board", before.name)?;
            }
            writeln!(Results, "{name} is {}, in {}", described(&board), names.path().display())
        }
        Some(Action::Forget { name, file }) => {
            let mut names = file.read()?;
            names.forget(name)?;
            names.write()?;
            writeln!(Results, "{name} is forgotten, in {}", names.path().display())
        }
    }
}

/// A row or an Uno, for the list.
struct Line {
    name: Option<String>,
    board: Board,
    port: Option<String>,
}

fn list(names: &Names, json: bool) -> Result<()> {
    let unos = plugged()?;
    let lines = lines(names, &unos, |port| std::fs::exists(port).unwrap_or(false));
    if json {
        let value = |line: &Line| {
            let (serial_number, known_port) = match &line.board {
                Board::SerialNumber(number) => (Some(number), None),
                Board::Port(port) => (None, Some(port)),
                Board::Only { .. } => (None, None),
            };
            json!({ "name": line.name, "serial_number": serial_number, "known_port": known_port, "port": line.port })
        };
        return writeln!(Results, "{:#}", Value::from_iter(lines.iter().map(value)));
    }
    if lines.is_empty() {
        return writeln!(Results, "There is no Uno at any USB port, and {} names no row", names.path().display());
    }
    let mut table = Table::new();
    table.load_style(presets::UTF8_BORDERS_ONLY).set_header(["row", "port now", "known by"]);
    for line in &lines {
        let name = line.name.as_deref().unwrap_or("without a name");
        table.add_row([name, line.port.as_deref().unwrap_or("not there"), &described(&line.board)]);
    }
    writeln!(Results, "{table}")?;
    writeln!(Results, "The names are in {}", names.path().display())
}

/// The rows, then the Unos without a row.
fn lines(names: &Names, unos: &[Plugged], exists: impl Fn(&str) -> bool) -> Vec<Line> {
    let now = |board: &Board| match board {
        Board::Port(port) if exists(port) => Some(port.clone()),
        board => unos.iter().find(|uno| board.is(uno)).map(|uno| uno.port.clone()),
    };
    let rows = names.rows().iter();
    let rows = rows.map(|row| Line { name: Some(row.name.clone()), port: now(&row.board), board: row.board.clone() });
    rows.chain(unnamed(names, unos).map(|uno| Line {
        name: None,
        port: Some(uno.port.clone()),
        board: uno.board.clone(),
    }))
    .collect()
}

fn described(board: &Board) -> String {
    match board {
        Board::Only { .. } => "the only Uno".to_owned(),
        Board::SerialNumber(number) => format!("the board with the serial number {number}"),
        Board::Port(port) => format!("the board at {port}"),
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn rows_are_listed_in_their_order_and_unos_without_a_name_behind_them() {
        let folder = tempfile::tempdir().unwrap();
        let mut names = Names::read(&folder.path().join("rows.toml")).unwrap();
        let number = |text: &str| Board::SerialNumber(text.to_owned());
        let port = |text: &str| Board::Port(text.to_owned());
        for (name, board) in [("right", number("B2")), ("left", number("A1")), ("third", port("/tmp/uno"))] {
            names.name(name, board).unwrap();
        }
        let uno = |port: &str, board| Plugged { port: port.to_owned(), board };
        let unos = [uno("ttyACM3", number("A1")), uno("ttyACM4", number("C3")), uno("ttyUSB0", port("ttyUSB0"))];
        let lines = lines(&names, &unos, |port| port == "/tmp/uno");
        let listed: Vec<_> = lines.iter().map(|line| (line.name.as_deref(), line.port.as_deref())).collect();
        let [right, left, third] = ["right", "left", "third"].map(Some);
        let [first, other, usb] = ["ttyACM3", "ttyACM4", "ttyUSB0"].map(Some);
        assert_eq!(listed, [(right, None), (left, first), (third, Some("/tmp/uno")), (None, other), (None, usb)]);
    }
}
