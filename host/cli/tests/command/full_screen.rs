//! The full-screen monitor on a terminal of 24 lines, with a virtual Uno at its port.

use crate::common::{Running, command};
use std::fs::{self, File};
use std::process::Command;
use std::thread::sleep;
use std::time::Duration;
use tempfile::TempDir;
use uno::pty::Pty;
use uno_run::firmware;
use uno_run::live::Setup;
use uno_run::live::rows::{Background, LiveRows};

const LINES: u16 = 24;
const COLUMNS: u16 = 100;

/// Looks at the screen before a test fails: minutes, as a busy computer may need them.
const LOOKS: usize = 60_000;

/// What a terminal sends for this key.
const PAGE_UP: &str = "\x1b[5~";

/// A terminal, the monitor that runs on it and writes log.csv, and its row.
struct Terminal {
    pty: Pty,
    screen: vt100::Parser,
    monitor: Running,
    _row: Background,
    folder: TempDir,
}

impl Terminal {
    /// Returns when the monitor shows the row.
    fn with_monitor() -> Self {
        let folder = TempDir::new().expect("there is room for a folder");
        let [port, log] = ["row", "log.csv"].map(|name| folder.path().join(name));
        let elf = Some(firmware::build().expect("the firmware builds"));
        let setup = Setup { elf, link: Some(port.clone()), fast: true, ..Setup::default() };
        let row = LiveRows::start(vec![setup]).expect("it starts").run_in_background();
        let pty = Pty::open().expect("there is a pseudo terminal");
        let path = pty.path().to_owned();
        let size = ["rows".to_owned(), LINES.to_string(), "cols".to_owned(), COLUMNS.to_string()];
        assert!(Command::new("stty").arg("-F").arg(&path).args(size).status().expect("there is stty").success());
        let side = || File::options().read(true).write(true).open(&path).expect("it is there");
        let mut monitor = command(&["monitor", "--port"]);
        monitor.arg(port).arg("--log").arg(log);
        let monitor = Running::start(monitor.env("TERM", "xterm").stdin(side()).stdout(side()).stderr(side()));
        let mut terminal = Self { pty, screen: vt100::Parser::new(LINES, COLUMNS, 0), monitor, _row: row, folder };
        terminal.until(|text| text.contains("tool out"));
        terminal
    }

    fn press(&mut self, keys: &str) {
        let mut bytes = keys.as_bytes();
        while !bytes.is_empty() {
            bytes = &bytes[self.pty.write(bytes).expect("the terminal works")..];
        }
    }

    /// Waits until the monitor has ended with success, and the terminal is as before.
    fn until_restored(&mut self) {
        let mut status = None;
        let mut bytes = [0; 4096];
        for _ in 0..LOOKS {
            let count = self.pty.read(&mut bytes).expect("the terminal works");
            self.screen.process(&bytes[..count]);
            if count == 0 && status.is_some() {
                break;
            }
            status = self.monitor.0.try_wait().expect("it is a child");
            sleep(Duration::from_millis(5));
        }
        assert!(status.is_some_and(|status| status.success()), "{status:?}");
        assert!(!self.screen.screen().alternate_screen());
    }

    /// Waits until the screen shows something, and returns the screen.
    ///
    /// # Panics
    /// If the monitor has ended, or never shows it.
    fn until(&mut self, shows: impl Fn(&str) -> bool) -> String {
        let mut bytes = [0; 4096];
        for _ in 0..LOOKS {
            let count = self.pty.read(&mut bytes).expect("the terminal works");
            self.screen.process(&bytes[..count]);
            let text = self.screen.screen().contents();
            if shows(&text) {
                return text;
            }
            assert_eq!(self.monitor.0.try_wait().expect("it is a child"), None, "it ended:\n{text}");
            sleep(Duration::from_millis(5));
        }
        panic!("that is never shown:\n{}", self.screen.screen().contents());
    }
}

#[test]
fn all_of_help_can_be_read_and_the_newest_line_is_shown_again() {
    let mut terminal = Terminal::with_monitor();
    let [first, last] = ["this list", "the firmware"];
    terminal.press("help\r");
    let end = terminal.until(|text| text.contains(last));
    assert!(!end.contains(first) && !end.contains("more below"), "{end}");
    terminal.press(PAGE_UP);
    let page = terminal.until(|text| text.contains("more below"));
    assert!(page.contains("PgDn"), "{page}");
    terminal.press(PAGE_UP);
    let page = terminal.until(|text| text.contains(first));
    assert!(!page.contains(last), "{page}");
    terminal.press("hold\r");
    terminal.until(|text| !text.contains("more below"));
}

#[test]
fn esc_is_hold_with_any_key_behind_it_and_after_a_long_paste() {
    let mut terminal = Terminal::with_monitor();
    // A HOLD that comes before the last one's answer is the same line.
    let holds = |count| move |text: &str| text.matches("> hold").count() == count && text.contains("HOLD 1 of 1");
    terminal.press("\x1b\r");
    terminal.until(holds(1));
    terminal.press(&"x".repeat(3000));
    terminal.until(|text| text.contains("> xxx"));
    terminal.press("\x1b");
    terminal.until(holds(2));
    // Esc and Ctrl-C.
    terminal.press("\x1b\x03");
    terminal.until_restored();
    let log = fs::read_to_string(terminal.folder.path().join("log.csv")).expect("it was written");
    assert_eq!(log.matches(",command,hold\n").count(), 3, "{log}");
}

#[test]
fn a_terminal_without_a_screen_is_shown_the_plain_monitor() {
    for name in ["dumb", ""] {
        let output = command(&["monitor", "--port", "none"]).env("TERM", name).output().expect("it runs");
        let said = String::from_utf8_lossy(&output.stderr).into_owned();
        assert!(!output.status.success() && said.contains("--plain does without"), "{said}");
    }
}

#[test]
fn a_terminated_monitor_restores_the_terminal() {
    let mut terminal = Terminal::with_monitor();
    terminal.monitor.signal("-TERM");
    terminal.until_restored();
}
