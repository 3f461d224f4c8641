//! `weeder serve`: the page, from the computer that has the serial port to a phone.

use crate::ctrl_c;
use crate::inside::INSIDE;
use crate::ports::Ports;
use anyhow::Result;
use clap::Args;
use frame::{Results, teller, whole_within};
use serve::page::Page;
use serve::{Server, Setup, Tell};
use std::env;
use std::net::Ipv4Addr;
use std::path::PathBuf;
use std::process::{Command, Stdio};
use std::sync::Arc;
use uno_run::firmware;

const HTTP_PORT: u16 = 8866;

#[derive(Args)]
#[command(after_help = "\
At this computer, the page may do the same as `weeder monitor`. In the network (--lan), it needs the
printed code. With the code, it shows the machine and sends HOLD, and nothing else that moves the tool.
docs/serve.md has the complete table. http is not encrypted: use a network whose members you know.
Opening a port resets most Unos: start before you work. It waits for missing ports. Ctrl-C ends it.

Examples:
  weeder serve                                       the only Uno, at http://127.0.0.1:8866/
  weeder serve --open                                also opens it in the browser; it needs no Uno
  weeder serve --lan                                 also for a phone in this computer's network
  weeder serve --lan 192.168.4.1 --allow-start       a phone may start the machine
  weeder serve --port left=/dev/ttyACM0 --port right=/dev/ttyACM1
  weeder serve --all                                 every named row, and every other Uno
  weeder serve --page weeder-release/page --http-port 8080")]
pub struct Arguments {
    #[command(flatten)]
    ports: Ports,
    /// Also serve it in the network, at this address of the computer, or at its only one.
    #[arg(long, value_name = "ADDRESS", num_args = 0..=1)]
    lan: Option<Option<Ipv4Addr>>,
    /// Allow paired phones to `start` the machine and `clear` its alarms. The operator has to see the machine.
    #[arg(long, requires = "lan")]
    allow_start: bool,
    /// Open the page in this computer's browser.
    #[arg(long)]
    open: bool,
    /// The page's folder. Default: the page inside a release's command, or the repository's build.
    #[arg(long, value_name = "FOLDER")]
    page: Option<PathBuf>,
    /// The TCP port, a whole number from 0 to 65535; 0 takes a free one.
    #[arg(long, value_name = "NUMBER", default_value_t = HTTP_PORT, value_parser = whole_within(0..=u16::MAX))]
    http_port: u16,
}

pub fn run(arguments: &Arguments) -> Result<()> {
    let page = match (&arguments.page, INSIDE) {
        (Some(folder), _) => Page::read(folder)?,
        (None, Some(inside)) => Page::of(inside.page),
        (None, None) => Page::read(&firmware::workspace_root().join("page/dist"))?,
    };
    let lan = arguments.lan.map(|address| address.map_or_else(serve::find_lan, Ok)).transpose()?;
    let chosen = arguments.ports.choose(None)?;
    // A stopped terminal delays no HOLD.
    let tell: Tell = Arc::new(teller());
    let server = Server::open(Setup {
        machines: chosen.names().into_iter().zip(chosen.openers()).collect(),
        page,
        port: arguments.http_port,
        lan,
        may_start: arguments.allow_start,
        tell: Arc::clone(&tell),
    })?;
    let stop = ctrl_c()?;
    writeln!(Results, "http://{}/ is the page, for this computer alone.", server.here())?;
    if let Some((address, code)) = server.lan() {
        writeln!(Results, "http://{address}/#{} is the page for a phone in the network.", code.text())?;
        writeln!(Results, "The code, where it is asked for: {}", code.spelled())?;
    }
    if arguments.open {
        open_in_browser(&format!("http://{}/", server.here()), &tell);
    }
    server.run(&stop);
    Ok(())
}

fn open_in_browser(address: &str, tell: &Tell) {
    let mut words = match env::consts::OS {
        "macos" => vec!["open"],
        "windows" => vec!["cmd", "/C", "start"],
        _ => vec!["xdg-open"],
    };
    words.push(address);
    // The program may run until the browser ends.
    let opened = Command::new(words[0]).args(&words[1..]).stdin(Stdio::null()).stdout(Stdio::null()).spawn();
    if let Err(error) = opened {
        tell(&format!("No browser can be opened from here ({}: {error}): open the address by hand.", words[0]));
    }
}
