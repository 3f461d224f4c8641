//! The full-screen monitor on a terminal of 24 lines, with a virtual Uno at its port.

use std::fs::File;
use std::process::{Child, Command};
use std::thread::sleep;
use std::time::Duration;
use tempfile::TempDir;
use uno::pty::Pty;
use uno_run::firmware;
use uno_run::live::Setup;
use uno_run::live::rows::LiveRows;

const LINES: u16 = 24;
const COLUMNS: u16 = 100;

/// Looks at the screen before a test fails: minutes, as a busy computer may need them.
const LOOKS: usize = 60_000;

/// What a terminal sends for this key.
const PAGE_UP: &str = "\x1b[5~";

/// A terminal, and the monitor that runs on it.
struct Terminal {
    pty: Pty,
    screen: vt100::Parser,
    monitor: Child,
}

impl Terminal {
    fn with_monitor(port: &str) -> Self {
        let pty = Pty::open().expect("there is a pseudo terminal");
        let path = pty.path().to_owned();
        let size = ["rows".to_owned(), LINES.to_string(), "cols".to_owned(), COLUMNS.to_string()];
        assert!(Command::new("stty").arg("-F").arg(&path).args(size).status().expect("there is stty").success());
        let side = || File::options().read(true).write(true).open(&path).expect("it is there");
        let mut monitor = Command::new(env!("CARGO_BIN_EXE_weeder"));
        monitor.args(["monitor", "--port", port]).env("TERM", "xterm").stdin(side()).stdout(side()).stderr(side());
        let monitor = monitor.spawn().expect("cargo has built the command");
        Self { pty, screen: vt100::Parser::new(LINES, COLUMNS, 0), monitor }
    }

    fn press(&mut self, keys: &str) {
        let mut bytes = keys.as_bytes();
        while !bytes.is_empty() {
            bytes = &bytes[self.pty.write(bytes).expect("the terminal works")..];
        }
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
            assert_eq!(self.monitor.try_wait().expect("it is a child"), None, "it ended:\n{text}");
            sleep(Duration::from_millis(5));
        }
        panic!("that is never shown:\n{}", self.screen.screen().contents());
    }
}

impl Drop for Terminal {
    fn drop(&mut self) {
        // It may have ended.
        let _ = self.monitor.kill();
        let _ = self.monitor.wait();
    }
}

#[test]
fn all_of_help_can_be_read_and_the_newest_line_is_shown_again() {
    let folder = TempDir::new().expect("there is room for a folder");
    let port = folder.path().join("row");
    let elf = Some(firmware::build().expect("the firmware builds"));
    let setup = Setup { elf, link: Some(port.clone()), fast: true, ..Setup::default() };
    let _row = LiveRows::start(vec![setup]).expect("it starts").run_in_background();
    let mut terminal = Terminal::with_monitor(port.to_str().expect("it is text"));
    terminal.until(|text| text.contains("tool out"));
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
