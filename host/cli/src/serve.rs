//! `weeder serve`: the page, from the computer that has the serial port to a phone.

use crate::numbers::whole_within;
use crate::output::{say, tell};
use anyhow::{Context, Result, bail};
use clap::Args;
use link::Link;
use serve::page::Page;
use serve::{Opener, Server, Setup};
use std::collections::HashSet;
use std::env;
use std::net::Ipv4Addr;
use std::path::{Path, PathBuf};
use std::sync::Arc;
use std::sync::atomic::{AtomicBool, Ordering};
use trial::firmware;

/// The TCP port, unless another is given.
const HTTP_PORT: u16 = 8866;

/// Characters that a machine's name has at the most: it stands above its panel on a phone.
const NAME_LENGTH: usize = 24;

/// What the user asks of the server.
#[derive(Args)]
#[command(after_help = "\
At this computer alone the page may do whatever `weeder monitor` may. Over the network, by --lan, it is shown to nobody without the \
code that is printed; with the code it shows the machine and has it hold, and nothing else that moves the tool or changes the machine. \
The manual's docs/serve.md has the whole table. http is not encrypted: use a network whose members you know. Opening a port resets \
most Unos: begin before you work. A port that is not there is waited for. Ctrl-C ends it.

Examples:
  weeder serve                                       the only Uno, at http://127.0.0.1:8866/
  weeder serve --lan                                 and for a phone in this computer's network
  weeder serve --lan 192.168.4.1 --allow-start       which may start the machine
  weeder serve --port left=/dev/ttyACM0 --port right=/dev/ttyACM1
  weeder serve --port uno --page weeder-release/page --http-port 8080")]
pub struct Arguments {
    /// An Uno's serial port, such as /dev/ttyACM0 or COM3, or a name for it to be shown by and the port; once for each machine.
    /// Found by itself where there is only one Uno.
    #[arg(long, value_name = "[NAME=]PORT", value_parser = named)]
    port: Vec<Named>,
    /// Serve it in the network too, at this address of this computer, or at the only one that it has.
    #[arg(long, value_name = "ADDRESS", num_args = 0..=1)]
    lan: Option<Option<Ipv4Addr>>,
    /// Let paired phones `start` the machine and `clear` its alarms: somebody has to see the machine then.
    #[arg(long, requires = "lan")]
    allow_start: bool,
    /// The page's folder; found by itself beside the command, as `page`, or where the repository's build has put it.
    #[arg(long, value_name = "FOLDER")]
    page: Option<PathBuf>,
    /// The TCP port, a whole number from 0 to 65535; 0 takes one that is free.
    #[arg(long, value_name = "NUMBER", default_value_t = HTTP_PORT, value_parser = whole_within(0..=u16::MAX))]
    http_port: u16,
}

/// A machine's port, and the name by which it is shown.
#[derive(Clone)]
struct Named {
    name: String,
    port: String,
}

/// Reads `NAME=PORT` or a port alone, which is shown by the end of its path.
fn named(text: &str) -> Result<Named, String> {
    let (name, port) = match text.split_once('=') {
        // A path may have the sign in it.
        Some((name, port)) if !name.contains(['/', '\\']) => (name.trim().to_owned(), port),
        _ => (Path::new(text).file_name().unwrap_or_default().to_string_lossy().into_owned(), text),
    };
    let is_good = !name.is_empty() && name.chars().count() <= NAME_LENGTH && !name.chars().any(char::is_control);
    match (is_good, port.is_empty()) {
        (_, true) => Err("it has to be a port, or a name, = and a port, as left=/dev/ttyACM0".to_owned()),
        (false, _) => {
            Err(format!("its name has to have 1 to {NAME_LENGTH} characters: put one before it, as left={port}"))
        }
        (true, false) => Ok(Named { name, port: port.to_owned() }),
    }
}

/// Serves until Ctrl-C.
///
/// # Errors
/// Where there is no page, two machines have a name, or an address cannot be had.
pub fn run(arguments: &Arguments) -> Result<()> {
    let page = Page::read(&page_folder(arguments.page.as_deref()))?;
    let lan = match arguments.lan {
        Some(Some(address)) => Some(address),
        Some(None) => Some(serve::find_lan()?),
        None => None,
    };
    let server = Server::open(Setup {
        machines: machines(&arguments.port)?,
        page,
        port: arguments.http_port,
        lan,
        may_start: arguments.allow_start,
        tell: Arc::new(|line| tell!("{line}")),
    })?;
    let stop = Arc::new(AtomicBool::new(false));
    let asked_to_stop = Arc::clone(&stop);
    ctrlc::set_handler(move || asked_to_stop.store(true, Ordering::Relaxed)).context("Ctrl-C cannot be caught")?;
    say!("http://{}/ is the page, for this computer alone.", server.here())?;
    if let Some((address, code)) = server.lan() {
        say!("http://{address}/#{} is the page for a phone in the network.", code.text())?;
        say!("The code, where it is asked for: {}", code.spelled())?;
    }
    server.run(&stop);
    Ok(())
}

/// The machines, each by a name of its own.
fn machines(ports: &[Named]) -> Result<Vec<(String, Opener)>> {
    let mut names = HashSet::new();
    if let Some(Named { name, .. }) = ports.iter().find(|machine| !names.insert(&machine.name)) {
        bail!("two machines are called {name}: name them, as in `--port left=/dev/ttyACM0 --port right=/dev/ttyACM1`");
    }
    if ports.is_empty() {
        return Ok(vec![("Uno".to_owned(), Box::new(|| Link::open(None)))]);
    }
    let machine = |Named { name, port }: &Named| -> (String, Opener) {
        let port = port.clone();
        (name.clone(), Box::new(move || Link::open(Some(&port))))
    };
    Ok(ports.iter().map(machine).collect())
}

/// Where the page is: as it was said, beside this command, as in a release, or where the repository's build puts it.
fn page_folder(said: Option<&Path>) -> PathBuf {
    if let Some(said) = said {
        return said.to_owned();
    }
    let beside = env::current_exe().ok().and_then(|command| Some(command.parent()?.join("page")));
    match beside {
        Some(beside) if beside.join("index.html").is_file() => beside,
        _ => firmware::workspace_root().join("page/dist"),
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    fn read(text: &str) -> Result<(String, String), String> {
        named(text).map(|Named { name, port }| (name, port))
    }

    #[test]
    fn a_machine_has_the_name_that_is_given_or_the_end_of_its_port_s() {
        for (text, name, port) in [
            ("/dev/ttyACM0", "ttyACM0", "/dev/ttyACM0"),
            ("uno", "uno", "uno"),
            ("left=/dev/ttyACM0", "left", "/dev/ttyACM0"),
            ("row 3 = left=COM3", "row 3", " left=COM3"),
            ("/dev/serial/by-id/a=b", "a=b", "/dev/serial/by-id/a=b"),
        ] {
            assert_eq!(read(text), Ok((name.to_owned(), port.to_owned())), "{text}");
        }
    }

    #[test]
    fn a_machine_without_a_name_or_a_port_is_refused_with_what_would_be_right() {
        for text in ["", "=", "left="] {
            assert!(read(text).unwrap_err().contains("as left=/dev/ttyACM0"), "{text}");
        }
        assert!(
            read("/dev/serial/by-id/usb-Arduino__www.arduino.cc__0043-if00").unwrap_err().contains("put one before it")
        );
    }

    #[test]
    fn two_machines_of_one_name_have_to_be_told_apart() {
        let machine = |text| named(text).unwrap();
        let error = machines(&[machine("a/uno"), machine("b/uno")]).err().unwrap().to_string();
        assert!(error.starts_with("two machines are called uno: name them"), "{error}");
    }
}
