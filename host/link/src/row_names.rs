//! The names of a machine's rows, and the board of each row: a small TOML file with one line a row.
//!
//! A board is known by its USB serial number, at any port. Some boards have no serial number, or share one. They are
//! known by their port: on Linux by udev's link for the USB socket, if there is one. A virtual Uno is known by its
//! path. Changes preserve the file's comments and its order. The order of lines is the order of rows.
//!
//! Only [`Board::open`] opens a port. Only [`Names::write`] changes the file.

use super::port::{is_own_name, is_same, listed, name_at};
use super::settings_file::no_toml;
use super::{Link, LinkError, Wire, find_uno};
use files::{FileError, bounded_file, whole_file};
use serialport::{SerialPortInfo, SerialPortType};
use std::fs;
use std::path::{Path, PathBuf};
use thiserror::Error;
use toml_edit::{DocumentMut, InlineTable, Item, Key, RawString, Value};

/// Longest name of a row, in characters. A phone shows it before the machine.
pub const NAME_LENGTH: usize = 24;

/// The name that addresses all rows. No row may have it.
pub const ALL: &str = "all";

/// Linux keeps links to ports here, by USB socket.
const BY_PLACE: &str = "/dev/serial/by-path";

const SERIAL_NUMBER: &str = "serial_number";
const PORT: &str = "port";

const HEAD: &str = "\
# The rows of a machine, in their order: `weeder rows` lists and names them.
# A row is known by its board's USB serial number, or by the port at which the board is.
";

/// Which board a row has.
#[derive(Clone, Debug, PartialEq, Eq)]
pub enum Board {
    /// The only Uno at this computer. A device at the port `beside`, such as a receiver, is none.
    Only {
        /// That port.
        beside: Option<String>,
    },
    /// The board with this USB serial number.
    SerialNumber(String),
    /// The board at this port.
    Port(String),
}

/// A row.
#[derive(Clone, Debug, PartialEq, Eq)]
pub struct Row {
    /// The operator's name for it.
    pub name: String,
    /// Its board.
    pub board: Board,
}

impl Row {
    /// Whether this is its name, in small or capital letters. Some file systems ignore case.
    fn is_called(&self, name: &str) -> bool {
        self.name.to_lowercase() == name.to_lowercase()
    }
}

/// An Uno that is plugged in.
#[derive(Clone, Debug, PartialEq, Eq)]
pub struct Plugged {
    /// Its present port.
    pub port: String,
    /// How it is known.
    pub board: Board,
}

/// Why the rows' names cannot be read or changed.
#[derive(Debug, Error)]
#[expect(missing_docs, reason = "the messages say what each means")]
pub enum NamesError {
    #[error(transparent)]
    File(#[from] FileError),
    #[error("{name:?} cannot be a row's name: {problem}")]
    Name { name: String, problem: String },
    #[error("{path} has no row {name}: it has {known}")]
    NoRow { path: PathBuf, name: String, known: String },
    #[error(transparent)]
    Port(#[from] LinkError),
}

impl Board {
    /// Whether this is the board of that Uno, by its number or by a port that leads to it.
    #[must_use]
    pub fn is(&self, uno: &Plugged) -> bool {
        *self == uno.board || matches!(self, Self::Port(port) if is_same(port, &uno.port))
    }

    /// The board at a port. The system's list shows whether it has its own serial number.
    ///
    /// # Errors
    /// If there is no such port.
    pub fn at(port: &str) -> Result<Self, LinkError> {
        let path = Path::new(port);
        let ports = listed()?;
        // The list of ports has the link's present target.
        match ports.iter().find(|listed| is_same(&listed.port_name, port)) {
            // A user's own link may lead to another port some day.
            Some(listed) if serial_number(listed).is_some() || is_own_name(port, listed) => {
                Ok(of(listed, &ports, Path::new(BY_PLACE)))
            }
            None if !path.exists() => Err(LinkError::Absent(port.to_owned())),
            // An absolute path is valid in any folder.
            _ => Ok(Self::Port(std::path::absolute(path).map_or(port.to_owned(), |path| path.display().to_string()))),
        }
    }

    /// Opens a wire to it, at whichever port it is now.
    ///
    /// # Errors
    /// If it is not plugged in, or as [`Wire::open`].
    pub fn wire(&self) -> Result<Wire, LinkError> {
        Wire::open(Some(&self.port()?))
    }

    /// Opens a link to it, at whichever port it is now.
    ///
    /// # Errors
    /// If it is not plugged in, or as [`Link::open`].
    pub fn open(&self) -> Result<Link, LinkError> {
        Link::over(self.wire()?)
    }

    /// Its present port.
    ///
    /// # Errors
    /// If it is not plugged in, or matches several boards.
    pub fn port(&self) -> Result<String, LinkError> {
        match self {
            Self::Only { beside } => find_uno(beside.as_deref()),
            Self::Port(port) => Ok(port.clone()),
            Self::SerialNumber(number) => numbered(number, &listed()?),
        }
    }
}

fn numbered(number: &str, ports: &[SerialPortInfo]) -> Result<String, LinkError> {
    let has_it = |port: &&SerialPortInfo| serial_number(port).is_some_and(|found| found == number);
    let found: Vec<String> = ports.iter().filter(has_it).map(|port| port.port_name.clone()).collect();
    match found.as_slice() {
        [only] => Ok(only.clone()),
        [] => Err(LinkError::Unplugged(number.to_owned())),
        _ => Err(LinkError::Twins { number: number.to_owned(), ports: found }),
    }
}

fn serial_number(port: &SerialPortInfo) -> Option<&str> {
    match &port.port_type {
        SerialPortType::UsbPort(usb) => usb.serial_number.as_deref().and_then(|number| own(number, cfg!(windows))),
        _ => None,
    }
}

/// The serial number, if it is the board's own. Windows makes one up for a board without: a digit or two in serialport
/// (its issue 203), which other boards have too.
fn own(number: &str, on_windows: bool) -> Option<&str> {
    Some(number.trim()).filter(|number| number.len() > if on_windows { 2 } else { 0 })
}

/// How to identify the board at a port. `by_place` is the folder with links by socket.
fn of(port: &SerialPortInfo, ports: &[SerialPortInfo], by_place: &Path) -> Board {
    if let Some(number) = serial_number(port)
        && numbered(number, ports).is_ok()
    {
        return Board::SerialNumber(number.to_owned());
    }
    let links = fs::read_dir(by_place).into_iter().flatten().flatten().map(|entry| entry.path());
    let leads_there =
        |link: &PathBuf| fs::canonicalize(link).is_ok_and(|path| path.to_str() == Some(port.port_name.as_str()));
    // udev makes two links for a socket. The shorter one is the older form.
    let place = links.filter(leads_there).min_by_key(|link| link.as_os_str().len());
    Board::Port(place.map_or_else(|| port.port_name.clone(), |link| link.display().to_string()))
}

/// The Unos at this computer's USB ports.
///
/// # Errors
/// If the system has no list of its ports.
pub fn plugged() -> Result<Vec<Plugged>, LinkError> {
    let ports = listed()?;
    let board = |port: &SerialPortInfo| of(port, &ports, Path::new(BY_PLACE));
    let unos = ports.iter().filter(|port| name_at(port).is_some());
    Ok(unos.map(|port| Plugged { port: port.port_name.clone(), board: board(port) }).collect())
}

/// Why a word cannot be a row's name, and what would be right. Names are parts of file names, and stand before a colon.
pub fn wrong_with(name: &str) -> Option<String> {
    let length = name.chars().count();
    if length == 0 || length > NAME_LENGTH {
        return Some(format!("it has to have 1 to {NAME_LENGTH} characters"));
    }
    if name.trim() != name || name.starts_with('.') || name.ends_with('.') {
        return Some("it has to begin and end with neither a blank nor a dot".to_owned());
    }
    if name.chars().any(|character| character.is_control() || r#"/\:*?"<>|=�"#.contains(character)) {
        return Some(
            r#"it becomes a file's name, and may have no control character and none of / \ : * ? " < > | = �"#.into(),
        );
    }
    let begin = name.split('.').next().unwrap_or_default().trim_end().to_ascii_lowercase();
    let number = begin.strip_prefix("com").or(begin.strip_prefix("lpt"));
    let is_numbered =
        number.is_some_and(|number| number.chars().count() == 1 && "123456789\u{b9}\u{b2}\u{b3}".contains(number));
    if is_numbered || ["con", "nul", "aux", "prn"].contains(&&*begin) {
        return Some(format!(
            "it becomes a file's name, and Windows keeps {begin} for a device: add a word, as in row-{begin}"
        ));
    }
    name.eq_ignore_ascii_case(ALL).then(|| format!("`{ALL}` means every row"))
}

/// The rows' names, in the order of their file.
#[derive(Clone, Debug)]
pub struct Names {
    path: PathBuf,
    /// The head of a new file.
    head: &'static str,
    document: DocumentMut,
    rows: Vec<Row>,
}

impl Names {
    /// Reads a file. If there is none, no row has a name yet.
    ///
    /// # Errors
    /// Names the file, the line, and what would be right.
    pub fn read(path: &Path) -> Result<Self, NamesError> {
        let (head, text) = match bounded_file::text(path) {
            Err(error) if error.is_absence() => (HEAD, String::new()),
            text => ("", text?),
        };
        let (document, rows) = parse(path, &text)?;
        Ok(Self { path: path.into(), head, document, rows })
    }

    /// The file.
    pub fn path(&self) -> &Path {
        &self.path
    }

    /// The rows, in the file's order.
    pub fn rows(&self) -> &[Row] {
        &self.rows
    }

    /// The row of this name, in small or capital letters.
    pub fn find(&self, name: &str) -> Option<&Row> {
        self.rows.iter().find(|row| row.is_called(name))
    }

    /// Names a board. Drops its previous name, and the board that had this name. The row keeps its number.
    ///
    /// # Errors
    /// If it cannot be a row's name.
    pub fn name(&mut self, name: &str, board: Board) -> Result<(), NamesError> {
        let refused = |problem| NamesError::Name { name: name.to_owned(), problem };
        if let Some(problem) = wrong_with(name) {
            return Err(refused(problem));
        }
        if let Some(twin) = self.find(name).filter(|row| row.name != name) {
            return Err(refused(format!("there is a row {} already", twin.name)));
        }
        let (key, known) = match &board {
            Board::SerialNumber(number) => (SERIAL_NUMBER, number.clone()),
            Board::Port(port) => (PORT, port.clone()),
            Board::Only { .. } => {
                return Err(refused("a row is a board's that is known by more than being alone".to_owned()));
            }
        };
        let before = self.rows.iter().find(|row| row.board == board && row.name != name).map(|row| row.name.clone());
        if let Some(before) = before {
            let is_new = self.find(name).is_none();
            self.rename(&before, is_new.then_some(name));
        }
        let mut line = Value::InlineTable(InlineTable::from_iter([(key, Value::from(known))]));
        if let Some(old) = self.document.get(name).and_then(Item::as_value) {
            line.decor_mut().clone_from(old.decor());
        }
        self.document[name] = Item::Value(line);
        match self.rows.iter_mut().find(|row| row.name == name) {
            Some(row) => row.board = board,
            None => self.rows.push(Row { name: name.to_owned(), board }),
        }
        Ok(())
    }

    /// Forgets a row.
    ///
    /// # Errors
    /// If no row has this name.
    pub fn forget(&mut self, name: &str) -> Result<(), NamesError> {
        let Some(name) = self.find(name).map(|row| row.name.clone()) else {
            let known: Vec<&str> = self.rows.iter().map(|row| row.name.as_str()).collect();
            let known = if known.is_empty() { "none".to_owned() } else { known.join(", ") };
            return Err(NamesError::NoRow { path: self.path.clone(), name: name.to_owned(), known });
        };
        self.rename(&name, None);
        Ok(())
    }

    /// Gives a row a new name, or removes it. The comments above a removed row stay, above the next one.
    fn rename(&mut self, old: &str, new: Option<&str>) {
        let text = |raw: Option<&RawString>| raw.and_then(RawString::as_str).unwrap_or_default().to_owned();
        let mut carried = String::new();
        // Each row goes to the end in turn, so the order stays.
        for mut row in std::mem::take(&mut self.rows) {
            let Some((mut key, item)) = self.document.remove_entry(&row.name) else { continue };
            let mut decor = key.leaf_decor().clone();
            let prefix = std::mem::take(&mut carried) + &text(decor.prefix());
            if row.name == old {
                let Some(new) = new else {
                    carried = prefix;
                    continue;
                };
                key = Key::new(new);
                new.clone_into(&mut row.name);
            }
            decor.set_prefix(prefix);
            self.document.insert_formatted(&key.with_leaf_decor(decor), item);
            self.rows.push(row);
        }
        let trailing = carried + &text(Some(self.document.trailing()));
        self.document.set_trailing(trailing);
    }

    /// Writes the file, and makes its folder if necessary.
    ///
    /// # Errors
    /// If it cannot be written.
    pub fn write(&self) -> Result<(), NamesError> {
        let text = format!("{}{}", self.head, self.document);
        let folder = self.path.parent().filter(|folder| !folder.as_os_str().is_empty());
        let written = folder
            .map_or(Ok(()), fs::create_dir_all)
            .and_then(|()| whole_file::write(&self.path, |to| to.write_all(text.as_bytes())));
        written.map_err(|source| FileError::unwritten(&self.path, source).into())
    }
}

fn parse(path: &Path, text: &str) -> Result<(DocumentMut, Vec<Row>), FileError> {
    bounded_file::check_nesting(path, text)?;
    let document: DocumentMut = text.parse().map_err(|error| no_toml(path, text, &error))?;
    let mut rows: Vec<Row> = Vec::new();
    for (name, item) in document.iter() {
        let wrong = |problem| FileError::at_key(path, text, name, problem);
        if let Some(problem) = wrong_with(name) {
            return Err(wrong(format!("{name:?} cannot be a row's name: {problem}")));
        }
        let text_of =
            |key: &str| item.get(key).and_then(Item::as_str).map(str::to_owned).filter(|text| !text.is_empty());
        let keys = item.as_table_like().map_or(0, |table| table.len());
        let board = match (keys, text_of(SERIAL_NUMBER), text_of(PORT)) {
            (1, Some(number), None) => Board::SerialNumber(number),
            (1, None, Some(port)) => Board::Port(port),
            _ => {
                let right = format!("{{ {SERIAL_NUMBER} = \"...\" }} or {{ {PORT} = \"...\" }}");
                return Err(wrong(format!("{name} is `{}`: it has to be {right}", item.to_string().trim())));
            }
        };
        if let Some(other) = rows.iter().find(|row| row.board == board) {
            return Err(wrong(format!("{name} has the board of {}: each row has one of its own", other.name)));
        }
        if let Some(twin) = rows.iter().find(|row| row.is_called(name)) {
            return Err(wrong(format!("there is a row {} already", twin.name)));
        }
        rows.push(Row { name: name.to_owned(), board });
    }
    Ok((document, rows))
}

#[cfg(test)]
mod tests;
