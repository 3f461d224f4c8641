//! `weeder check-board`: a second Uno, the tester, drives the weeder's inputs and measures its outputs.

use crate::ctrl_c;
use anyhow::Result;
use check_board::Boards;
use check_board::desk::Desk;
use check_board::run::{Extent, run as check_run};
use clap::Args;
use frame::{Finding, Messages, OutName, Replace, Results, with_bar, write_if_asked};
use link::row_names::plugged;
use std::cell::Cell;
use std::path::{Path, PathBuf};
use uno_run::firmware;

#[derive(Args)]
#[command(after_help = "\
The tester is an Uno with the tester's firmware, wired to the weeder's Uno: docs/check-board.md has the wires.
Remove the machine's own wires from the weeder's Uno before. Settings are not changed for good,
also where Ctrl-C ends the check.

  weeder flash --tester --port /dev/ttyACM1
  weeder check-board --page check.html
  weeder check-board --port /dev/ttyACM0 --tester /dev/ttyACM1 --json --board \"Uno R3\" > uno-r3.json
  weeder check-board --simulated --brief

Status 1: a wire is wrong, or a figure is outside its limits.")]
pub struct Arguments {
    /// The weeder's port. Default: the Uno that answers as a weeder.
    #[arg(long)]
    port: Option<String>,
    /// The tester's port. Default: the Uno that answers as a tester.
    #[arg(long)]
    tester: Option<String>,
    /// The board's name, for the report.
    #[arg(long, value_name = "NAME", default_value = "", hide_default_value = true)]
    board: String,
    /// Check two virtual Unos, wire to wire, each at a pseudo terminal. Their clocks differ by 0.3 %.
    #[arg(long, conflicts_with_all = ["port", "tester"])]
    simulated: bool,
    /// With --simulated: run the weeder on the page's simulator. `./setup.sh page` makes its program,
    /// page/build/lockstep.mjs.
    #[arg(long, value_name = "FILE.mjs", requires = "simulated")]
    second_simulator: Option<PathBuf>,
    /// Check less of everything, in a tenth of the time.
    #[arg(long)]
    brief: bool,
    /// Print JSON instead of text: the report to send in.
    #[arg(long)]
    json: bool,
    /// Write a page as well.
    #[arg(long, value_name = "FILE.html")]
    page: Option<OutName>,
    #[command(flatten)]
    replace: Replace,
}

pub fn run(arguments: &Arguments) -> Result<Finding> {
    let page = arguments.page.as_ref().map(|page| page.file(arguments.replace)).transpose()?;
    let second = arguments.second_simulator.as_deref();
    let start = || Desk::start(&firmware::TESTER.elf()?, &firmware::build()?, second);
    let desk = arguments.simulated.then(start).transpose()?;
    let name = |path: &Path| Some(path.to_string_lossy().into_owned());
    let (port, tester) = match &desk {
        Some(desk) => (name(desk.weeder()), name(desk.tester())),
        None => (arguments.port.clone(), arguments.tester.clone()),
    };
    let unos =
        if port.is_some() && tester.is_some() { vec![] } else { plugged()?.into_iter().map(|uno| uno.port).collect() };
    let mut boards = Boards::open(port.as_deref(), tester.as_deref(), &unos)?;
    boards.tester.interrupted_by(ctrl_c()?);
    let extent = Extent { brief: arguments.brief, simulated: arguments.simulated };
    let last = Cell::new("");
    let result = with_bar("checking", |show| {
        check_run(&mut boards, extent, |what, share| {
            if last.replace(what) != what {
                writeln!(Messages, "Next: {what}");
            }
            show(share);
        })
    });
    drop(boards);
    if let Some(desk) = desk {
        desk.stop()?;
    }
    let mut report = result?;
    report.board.clone_from(&arguments.board);
    let printed = write!(Results, "{}", if arguments.json { report.json() } else { report.text() });
    write_if_asked(page.as_ref(), "Written", arguments.json, |to| Ok(to.write_all(report.page().as_bytes())?))?;
    printed?;
    Ok(Finding::of(report.is_good()))
}
