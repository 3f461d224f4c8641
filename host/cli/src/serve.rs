//! `weeder serve`: the page, from the computer that has the serial port to a phone.

use crate::numbers::whole_within;
use crate::output::{say, tell};
use crate::ports::Ports;
use anyhow::{Context, Result};
use clap::Args;
use serve::page::Page;
use serve::{Server, Setup};
use std::env;
use std::net::Ipv4Addr;
use std::path::{Path, PathBuf};
use std::sync::Arc;
use std::sync::atomic::{AtomicBool, Ordering};
use trial::firmware;

/// The TCP port, unless another is given.
const HTTP_PORT: u16 = 8866;

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
  weeder serve --all                                 every row that `weeder rows` has named, and every other Uno
  weeder serve --port uno --page weeder-release/page --http-port 8080")]
pub struct Arguments {
    #[command(flatten)]
    ports: Ports,
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
    let chosen = arguments.ports.choose()?;
    let server = Server::open(Setup {
        machines: chosen.names().into_iter().zip(chosen.openers()).collect(),
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

/// Where the page is: as it was said, beside this command, as in a release, or where the repository's build puts it.
fn page_folder(named: Option<&Path>) -> PathBuf {
    if let Some(named) = named {
        return named.to_owned();
    }
    let beside = env::current_exe().ok().and_then(|command| Some(command.parent()?.join("page")));
    match beside {
        Some(beside) if beside.join("index.html").is_file() => beside,
        _ => firmware::workspace_root().join("page/dist"),
    }
}
