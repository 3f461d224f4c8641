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
use toml_edit::{DocumentMut, InlineTable, Item, Value};

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

/// The port of the board with this serial number.
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

/// Why a word cannot be a row's name, and what would be right. The name becomes part of a file name, and stands before
/// a colon.
pub fn wrong_with(name: &str) -> Option<String> {
    let length = name.chars().count();
    if length == 0 || length > NAME_LENGTH {
        return Some(format!("it has to have 1 to {NAME_LENGTH} characters"));
    }
    if name.trim() != name || name.starts_with('.') || name.ends_with('.') {
        return Some("it has to begin and end with neither a blank nor a dot".to_owned());
    }
    if name.chars().any(|character| character.is_control() || r#"/\:*?"<>|="#.contains(character)) {
        return Some(
            r#"it becomes a file's name, and may have no control character and none of / \ : * ? " < > | ="#.into(),
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
        for row in self.rows.iter().filter(|row| row.board == board && row.name != name) {
            self.document.remove(&row.name);
        }
        self.rows.retain(|row| row.board != board || row.name == name);
        let line = InlineTable::from_iter([(key, Value::from(known))]);
        self.document[name] = Item::Value(Value::InlineTable(line));
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
        self.document.remove(&name);
        self.rows.retain(|row| row.name != name);
        Ok(())
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
mod tests {
    use super::*;
    use crate::port::tests::usb;

    const UNO: (u16, u16) = (0x2341, 0x0043);

    fn number(text: &str) -> Board {
        Board::SerialNumber(text.to_owned())
    }

    #[test]
    fn a_board_with_a_number_is_found_at_whichever_port_it_comes_back() {
        let before = [usb("/dev/ttyACM0", UNO, Some("A1")), usb("/dev/ttyACM1", UNO, Some("B2"))];
        let after = [usb("/dev/ttyACM1", UNO, Some("A1")), usb("/dev/ttyACM4", UNO, Some("B2"))];
        assert_eq!(of(&before[0], &before, Path::new("/no-such")), number("A1"));
        assert_eq!([&before, &after].map(|ports| numbered("A1", ports).unwrap()), ["/dev/ttyACM0", "/dev/ttyACM1"]);
        let error = numbered("C3", &after).unwrap_err().to_string();
        assert!(error.starts_with("the board with the serial number C3 is not plugged in"), "{error}");
    }

    #[test]
    fn a_number_that_windows_makes_up_is_no_board_s_own() {
        for (number, elsewhere, on_windows) in [("5", Some("5"), None), ("1A", Some("1A"), None), (" ", None, None)] {
            assert_eq!([own(number, false), own(number, true)], [elsewhere, on_windows]);
        }
        assert_eq!([false, true].map(|on_windows| own(" 85735 ", on_windows)), [Some("85735"); 2]);
    }

    #[cfg(unix)]
    #[test]
    fn boards_without_a_number_of_their_own_are_known_by_the_place_where_they_are_plugged_in() {
        let folder = tempfile::tempdir().unwrap();
        let folder = fs::canonicalize(folder.path()).unwrap();
        let [first, second] = ["ttyUSB0", "ttyUSB1"].map(|name| {
            fs::write(folder.join(name), "").unwrap();
            folder.join(name).display().to_string()
        });
        let places = folder.join("by-path");
        fs::create_dir(&places).unwrap();
        std::os::unix::fs::symlink(&first, places.join("usb-0:2:1.0")).unwrap();
        std::os::unix::fs::symlink(&first, places.join("usbv2-0:2:1.0")).unwrap();
        let by_place = Board::Port(places.join("usb-0:2:1.0").display().to_string());
        for number in [None, Some("0001"), Some(" ")] {
            let ports = [usb(&first, UNO, number), usb(&second, UNO, number)];
            assert_eq!(of(&ports[0], &ports, &places), by_place);
            assert_eq!(of(&ports[1], &ports, &places), Board::Port(second.clone()), "it has no link for a socket");
        }
        let twins = [usb(&first, UNO, Some("0001")), usb(&second, UNO, Some("0001"))];
        let error = numbered("0001", &twins).unwrap_err().to_string();
        assert!(error.contains("are both of the serial number 0001") && error.contains("weeder rows name"), "{error}");
    }

    #[test]
    fn names_are_kept_in_their_order_with_the_user_s_comments() {
        let folder = tempfile::tempdir().unwrap();
        let path = folder.path().join("new/rows.toml");
        let mut names = Names::read(&path).unwrap();
        assert!(names.rows().is_empty());
        names.name("left", number("A1")).unwrap();
        names.name("right", Board::Port("/dev/pts/7".to_owned())).unwrap();
        names.write().unwrap();
        let text = fs::read_to_string(&path).unwrap();
        assert!(text.ends_with("left = { serial_number = \"A1\" }\nright = { port = \"/dev/pts/7\" }\n"), "{text}");
        fs::write(&path, text.replace("right =", "# by the hedge\nright =")).unwrap();

        let mut names = Names::read(&path).unwrap();
        names.name("left", number("C3")).unwrap();
        names.name("middle", Board::Port("/dev/pts/7".to_owned())).unwrap();
        let rows: Vec<(&str, &Board)> = names.rows().iter().map(|row| (row.name.as_str(), &row.board)).collect();
        assert_eq!(rows, [("left", &number("C3")), ("middle", &Board::Port("/dev/pts/7".to_owned()))]);
        names.write().unwrap();
        assert_eq!(Names::read(&path).unwrap().rows(), names.rows());
        names.forget("Middle").unwrap();
        let error = names.forget("middle").unwrap_err().to_string();
        assert!(error.ends_with("has no row middle: it has left"), "{error}");
    }

    #[test]
    fn a_name_that_could_be_no_file_s_or_another_row_s_is_refused_with_what_would_be_right() {
        let folder = tempfile::tempdir().unwrap();
        let mut names = Names::read(&folder.path().join("rows.toml")).unwrap();
        names.name("Left", number("A1")).unwrap();
        for (name, problem) in [
            ("", "1 to 24 characters"),
            ("a row with a very long name", "1 to 24 characters"),
            ("a/b", "none of /"),
            ("1: x", "none of /"),
            (".hidden", "neither a blank nor a dot"),
            (" 1", "neither a blank nor a dot"),
            ("row.", "neither a blank nor a dot"),
            ("Con", "Windows keeps con for a device"),
            ("com1.left", "Windows keeps com1 for a device: add a word, as in row-com1"),
            ("All", "`all` means every row"),
            ("left", "there is a row Left already"),
        ] {
            let error = names.name(name, number("B2")).unwrap_err().to_string();
            assert!(error.contains(problem), "{name:?}: {error}");
        }
        assert_eq!(names.rows().len(), 1);
    }

    #[test]
    fn an_error_in_a_file_has_its_line() {
        let path = Path::new("rows.toml");
        for (text, problem) in [
            ("\nleft = 3\n", "rows.toml, line 2: left is `3`: it has to be { serial_number"),
            ("left = { port = \"\" }\n", "line 1: left is"),
            ("left = { port = \"a\", serial_number = \"b\" }\n", "line 1: left is"),
            ("a = { port = \"x\" }\nb = { port = \"x\" }\n", "line 2: b has the board of a"),
            ("a = { port = \"x\" }\nA = { port = \"y\" }\n", "line 2: there is a row a already"),
            ("\"a/b\" = { port = \"x\" }\n", "line 1: \"a/b\" cannot be a row's name"),
            ("left = \n", "line 1: "),
        ] {
            let error = parse(path, text).unwrap_err().to_string();
            assert!(error.contains(problem), "{error}");
        }
    }
}
