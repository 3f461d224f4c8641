//! The rows that a command talks to: those at the named ports, the only Uno, or all.
//!
//! A port is a path, such as /dev/ttyACM0, or a board's name from `weeder rows`. The name finds the board at any port.
//! Messages about a named board begin with its name.

use anyhow::{Context, Result, bail, ensure};
use clap::Args;
use etcetera::BaseStrategy;
use frame::Messages;
use link::Link;
use link::connection::Opener;
use link::row_names::{Board, Names, Plugged, Row, plugged, wrong_with};
use std::collections::HashSet;
use std::panic::resume_unwind;
use std::path::{Path, PathBuf};
use std::thread;

/// The file of the rows' names in the user's folder.
const FILE: &str = "weeder/rows.toml";

/// The option for the file of the rows' names.
#[derive(Args)]
pub struct NamesFile {
    /// File with the rows' names. Default: `weeder/rows.toml` in your settings folder.
    #[arg(long, value_name = "FILE.toml")]
    rows_file: Option<PathBuf>,
}

impl NamesFile {
    /// Its path. Fails if the user has no folder.
    pub fn path(&self) -> Result<PathBuf> {
        if let Some(path) = &self.rows_file {
            return Ok(path.clone());
        }
        let strategy = etcetera::choose_base_strategy()
            .context("there is no folder for the user's settings: name a file by --rows-file")?;
        Ok(strategy.config_dir().join(FILE))
    }

    /// The names in it. A file named by the user must exist.
    pub fn read(&self) -> Result<Names> {
        let path = self.path()?;
        ensure!(
            self.rows_file.is_none() || path.exists(),
            "there is no {}: `weeder rows name` makes it",
            path.display()
        );
        Ok(Names::read(&path)?)
    }

    /// The row with this name, or else the one at this port. A path is no name, and needs no file of names.
    fn row(&self, port: &str) -> Result<Row> {
        let at_port = || Row { name: name_at(port), board: Board::Port(port.to_owned()) };
        if port.contains(['/', '\\']) {
            return Ok(at_port());
        }
        Ok(self.read()?.find(port).cloned().unwrap_or_else(at_port))
    }
}

/// The ports of one row or several.
#[derive(Args)]
pub struct Ports {
    /// Serial port of an Uno (/dev/ttyACM0, COM3), a row's name, or NAME=PORT; once for each row. Default: the only
    /// Uno.
    #[arg(long, value_name = "[NAME=]PORT", value_parser = named)]
    port: Vec<Named>,
    /// Take every named row, and every other Uno at a USB port.
    #[arg(long, conflicts_with = "port")]
    all: bool,
    #[command(flatten)]
    names: NamesFile,
}

/// The port of a command that talks to one Uno.
#[derive(Args)]
pub struct Port {
    /// Serial port of the Uno (/dev/ttyACM0, COM3), or a row's name. Default: the only Uno.
    #[arg(long, value_name = "PORT")]
    port: Option<String>,
    #[command(flatten)]
    names: NamesFile,
}

impl Port {
    /// The board there. Fails if the file of the names cannot be read.
    pub fn board(&self) -> Result<Board> {
        match &self.port {
            Some(port) => Ok(self.names.row(port)?.board),
            None => Ok(Board::Only { beside: None }),
        }
    }

    /// The machine there. Fails if there is none, or it is no weeder.
    pub fn open(&self) -> Result<Link> {
        Ok(self.board()?.open()?)
    }
}

#[derive(Clone, Debug, PartialEq, Eq)]
pub struct Named {
    pub name: Option<String>,
    pub port: String,
}

/// Reads `NAME=PORT`, or a port or a row's name alone. Fails in words.
pub fn named(text: &str) -> Result<Named, String> {
    let (name, port) = match text.split_once('=') {
        // A path may contain the sign.
        Some((name, port)) if !name.contains(['/', '\\']) => (Some(name.trim().to_owned()), port),
        _ => (None, text),
    };
    if port.is_empty() || name.as_ref().is_some_and(String::is_empty) {
        return Err("it has to be a port, or a name, = and a port, as left=/dev/ttyACM0".to_owned());
    }
    match name.as_deref().and_then(wrong_with) {
        Some(problem) => Err(format!("{text:?} begins with no row's name: {problem}")),
        None => Ok(Named { name, port: port.to_owned() }),
    }
}

/// The number of the row with this name, in small or capital letters. Fails with the names that there are, in words.
pub fn find(name: &str, names: &[String]) -> Result<usize, String> {
    let found = names.iter().position(|known| known.to_lowercase() == name.to_lowercase());
    found.ok_or_else(|| format!("there is no row {name}: there are {}", names.join(", ")))
}

/// The rows that a command talks to.
pub struct Chosen {
    /// The rows, at least one.
    pub rows: Vec<Row>,
    /// Whether there may be several rows. Messages then begin with the row's name.
    pub are_several: bool,
}

impl Ports {
    /// The chosen rows. A device at the port `beside`, such as a receiver, is none. Fails if there is no row, two have
    /// a name, or the file of the names cannot be read.
    pub fn choose(&self, beside: Option<&str>) -> Result<Chosen> {
        let rows = if self.all {
            every_row(&self.names.read()?, beside)?
        } else if self.port.is_empty() {
            vec![Row { name: "Uno".to_owned(), board: Board::Only { beside: beside.map(str::to_owned) } }]
        } else {
            self.port.iter().map(|machine| row(machine, &self.names)).collect::<Result<_>>()?
        };
        let mut seen = HashSet::new();
        if let Some(row) = rows.iter().find(|row| !seen.insert(row.name.to_lowercase())) {
            bail!(
                "two machines are called {}: name them, as in `--port left=/dev/ttyACM0 --port right=/dev/ttyACM1`",
                row.name
            );
        }
        Ok(Chosen { are_several: self.all || rows.len() > 1, rows })
    }
}

/// The row of a `--port`.
fn row(machine: &Named, names: &NamesFile) -> Result<Row> {
    let Row { name, board } = names.row(&machine.port)?;
    let name = machine.name.clone().unwrap_or(name);
    if let Some(problem) = wrong_with(&name) {
        bail!("{name:?} cannot be a row's name: {problem}: put one before it, as left={}", machine.port);
    }
    Ok(Row { name, board })
}

/// The name of the row at a port, if the user gave none: the port's end, such as ttyACM0. Windows keeps COM3.csv for
/// the port, so that row is Uno-COM3.
fn name_at(port: &str) -> String {
    let end = Path::new(port).file_name().unwrap_or_default().to_string_lossy().into_owned();
    let longer = format!("Uno-{end}");
    if wrong_with(&end).is_some() && wrong_with(&longer).is_none() { longer } else { end }
}

/// The Unos that control no row with a name.
pub fn unnamed<'a>(names: &'a Names, unos: &'a [Plugged]) -> impl Iterator<Item = &'a Plugged> {
    unos.iter().filter(|uno| !names.rows().iter().any(|row| row.board.is(uno)))
}

/// Every row with a name, and every other Uno.
fn every_row(names: &Names, beside: Option<&str>) -> Result<Vec<Row>> {
    let (mut rows, mut unos) = (names.rows().to_vec(), plugged()?);
    unos.retain(|uno| beside.is_none_or(|beside| !link::is_same(&uno.port, beside)));
    rows.extend(unnamed(names, &unos).map(|uno| Row { name: name_at(&uno.port), board: uno.board.clone() }));
    ensure!(
        !rows.is_empty(),
        "there is no Uno at any USB port, and {} names no row: plug them in, or name their ports by --port",
        names.path().display()
    );
    Ok(rows)
}

impl Chosen {
    pub fn names(&self) -> Vec<String> {
        self.rows.iter().map(|row| row.name.clone()).collect()
    }

    /// A function for each row that opens its wire.
    pub fn openers(&self) -> Vec<Opener> {
        let opener = |row: &Row| -> Opener {
            let board = row.board.clone();
            Box::new(move || board.wire())
        };
        self.rows.iter().map(opener).collect()
    }

    /// Runs `work` on all rows at the same time. Returns the results in the order of rows.
    pub fn each<T: Send>(&self, work: impl Fn(&Row, &mut Link) -> Result<T> + Sync) -> Vec<Result<T>> {
        let of_row = |row: &Row| -> Result<T> { work(row, &mut row.board.open()?) };
        thread::scope(|scope| {
            let threads: Vec<_> = self.rows.iter().map(|row| scope.spawn(|| of_row(row))).collect();
            threads.into_iter().map(|thread| thread.join().unwrap_or_else(|panic| resume_unwind(panic))).collect()
        })
    }

    /// Prints the failures of the rows' results, with their names. Fails if a row failed: the only row's own error, or
    /// the names of the failed rows.
    pub fn check<T>(&self, mut done: Vec<Result<T>>) -> Result<()> {
        if let (false, [_]) = (self.are_several, done.as_slice()) {
            return done.remove(0).map(drop);
        }
        let mut failed = Vec::new();
        for (row, done) in self.rows.iter().zip(&done) {
            if let Err(error) = done {
                writeln!(Messages, "error: {}: {error:#}", row.name);
                failed.push(row.name.as_str());
            }
        }
        ensure!(failed.is_empty(), "{} of {} rows failed: {}", failed.len(), self.rows.len(), failed.join(", "));
        Ok(())
    }

    /// The path of a row's own file, if there may be several rows: in a folder, by the row's name.
    pub fn file_in(folder: &Path, row: &Row, ending: &str) -> PathBuf {
        folder.join(format!("{}.{ending}", row.name))
    }

    /// A message about a row, with its name if there may be several.
    pub fn under_name(&self, row: usize, text: &str) -> String {
        match self.rows.get(row) {
            Some(row) if self.are_several => format!("{}: {text}", row.name),
            _ => text.to_owned(),
        }
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    /// The rows at these ports, with the names in a file.
    fn choose(ports: &[&str], file: &Path) -> Result<Chosen> {
        let port = ports.iter().map(|text| named(text).unwrap()).collect();
        Ports { port, all: false, names: NamesFile { rows_file: Some(file.to_owned()) } }.choose(None)
    }

    fn at(port: &str) -> Board {
        Board::Port(port.to_owned())
    }

    #[test]
    fn a_row_has_the_name_that_is_given_or_the_end_of_its_port_s() {
        let file = tempfile::NamedTempFile::new().unwrap();
        for (text, name, port) in [
            ("/dev/ttyACM0", "ttyACM0", "/dev/ttyACM0"),
            ("uno", "uno", "uno"),
            ("COM3", "Uno-COM3", "COM3"),
            ("COM12", "COM12", "COM12"),
            ("left=/dev/ttyACM0", "left", "/dev/ttyACM0"),
            ("row 3 = left=COM3", "row 3", " left=COM3"),
        ] {
            let row = choose(&[text], file.path()).unwrap().rows.remove(0);
            assert_eq!((row.name.as_str(), row.board), (name, at(port)), "{text}");
        }
        assert_eq!(named("/dev/serial/by-id/a=b").unwrap().port, "/dev/serial/by-id/a=b");
    }

    #[test]
    fn a_row_without_a_name_or_a_port_is_refused_with_what_would_be_right() {
        for text in ["", "=", "left="] {
            assert!(named(text).unwrap_err().contains("as left=/dev/ttyACM0"), "{text}");
        }
        assert!(named("all=COM3").unwrap_err().contains("`all` means every row"));
        let long = "/dev/serial/by-id/usb-Arduino__www.arduino.cc__0043-if00";
        let error = choose(&[long], Path::new("no-such.toml")).err().unwrap().to_string();
        assert!(error.contains("put one before it, as left=/dev/"), "{error}");
    }

    #[test]
    fn a_name_of_the_file_is_its_board_and_a_path_stays_a_path() {
        let folder = tempfile::tempdir().unwrap();
        let file = folder.path().join("rows.toml");
        let mut names = Names::read(&file).unwrap();
        let left = Board::SerialNumber("A1".to_owned());
        names.name("left", left.clone()).unwrap();
        names.write().unwrap();
        let chosen = choose(&["Left", "./left2", "hedge=right"], &file).unwrap();
        let boards: Vec<(&str, &Board)> = chosen.rows.iter().map(|row| (row.name.as_str(), &row.board)).collect();
        assert_eq!(boards, [("left", &left), ("left2", &at("./left2")), ("hedge", &at("right"))]);
        assert_eq!(chosen.under_name(0, "lost"), "left: lost");
        let one = choose(&["./left"], &file).unwrap();
        assert_eq!((&one.rows[0].board, one.under_name(0, "lost").as_str()), (&at("./left"), "lost"));
    }
}
