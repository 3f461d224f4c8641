//! `weeder bounds`: what the firmware can need at most, proved from its ELF, beside what it may need.

use crate::finding::Finding;
use crate::output::{print, say};
use anyhow::Result;
use clap::Args;
use comfy_table::{Cell, CellAlignment, Table, presets};
use serde_json::json;
use std::fmt::Write as _;
use std::path::PathBuf;
use trial::firmware;
use uno::bounds::{self, Bounds, Budgets, Frame, Held, Lasting};

/// What the user asks of the bounds.
#[derive(Args)]
#[command(after_help = "\
Examples:
  weeder bounds
  weeder bounds --loops
  weeder bounds --elf other.elf --budgets other.toml --json

The status is 0 where every bound keeps to its budget, 1 where one does not, and 2 where the program has no bounds: for recursion,
calls to addresses that are worked out, handlers that turn interrupts on, values in registers that a call spoils, and loops without
a bound where time must have one.")]
pub struct Arguments {
    /// Follow this firmware instead of building the one in this repository.
    #[arg(long, value_name = "FILE.elf")]
    elf: Option<PathBuf>,
    /// Hold the bounds against this file instead of the repository's budgets.toml.
    #[arg(long, value_name = "FILE.toml")]
    budgets: Option<PathBuf>,
    /// Name each loop of the main loop's turn that has no bound.
    #[arg(long)]
    loops: bool,
    /// Print all of it as JSON.
    #[arg(long)]
    json: bool,
}

/// Proves and prints.
///
/// # Errors
/// Where the firmware cannot be built, read or followed, or the budgets not be read.
pub fn run(arguments: &Arguments) -> Result<Finding> {
    let file = arguments.budgets.clone().unwrap_or_else(|| firmware::workspace_root().join("budgets.toml"));
    let budgets = Budgets::read(&file)?;
    let elf = arguments.elf.clone().map_or_else(firmware::build, Ok)?;
    let bounds = bounds::prove(&elf, Some(&budgets.input), &budgets.loops)?;
    let held = budgets.hold(&bounds);
    let keeps = held.iter().all(|held| held.keeps);
    if arguments.json {
        say!("{:#}", json!({ "bounds": bounds, "budgets": held, "keeps": keeps }))?;
    } else {
        print(format_args!("{}", report(&bounds, &held, arguments.loops)))?;
    }
    Ok(if keeps { Finding::Good } else { Finding::Bad })
}

/// The bounds in words and tables.
fn report(bounds: &Bounds, held: &[Held], every_loop: bool) -> String {
    let mut text = "Proved from the ELF, for whatever comes in at whatever moment:\n\n".to_owned();
    let rows = held.iter().map(|Held { name, proved, budget, keeps }| {
        let unit = name.replace('_', " ");
        let limit = if *name == "never_lost_per_s" { "at least" } else { "at most" };
        vec![unit, proved.to_string(), format!("{limit} {budget}"), if *keeps { "" } else { "OVER" }.to_owned()]
    });
    text += &table(&["bound", "proved", "budget", ""], rows);

    text += "\nThe deepest stack, from the reset on:\n\n";
    let rows = bounds.stack.iter().map(|Frame { function, bytes }| vec![function.clone(), bytes.to_string()]);
    text += &table(&["function", "bytes"], rows);

    text += "\nInterrupt handlers, response and return included:\n\n";
    let rows = bounds.handlers.iter().map(|handler| {
        let cycles = handler.cycles.map_or("never returns".to_owned(), |cycles| cycles.to_string());
        vec![handler.vector.to_string(), handler.function.clone(), cycles, handler.stack_bytes.to_string()]
    });
    text += &table(&["vector", "function", "cycles", "stack bytes"], rows);

    let mut line = |what: String| writeln!(text, "{what}").expect("a string takes everything");
    line(String::new());
    line(format!("The main program lets no interrupt in for {} cycles at most.", bounds.closed_cycles));
    if let Some(edges) = &bounds.edges {
        line(format!("An edge of the encoder waits {} cycles at most until a handler looks.", edges.wait_cycles));
        line(format!("No count is lost up to {} a second.", edges.never_lost_per_s));
    }
    let Lasting { calls, bytes } = bounds.lasting;
    line(format!(
        "Over {calls} calls, {bytes} bytes last in registers, and none is spoilt; handlers put all registers and flags back."
    ));
    match &bounds.turn {
        Some(turn) => match turn.cycles {
            Some(cycles) => line(format!(
                "A turn of the main loop takes at most {cycles} cycles, without handlers. No turn comes near that: loops within loops \
                 multiply what is said of each."
            )),
            None => {
                let loops = turn.without_bound.len();
                line(format!("The longest turn of the loop is not computed: {loops} loops without a bound."));
                for (address, function) in turn.without_bound.iter().filter(|_| every_loop) {
                    line(format!("  {address:#06x} {function}"));
                }
            }
        },
        None => line("The longest turn of the loop is not computed: no loop feeds the watchdog.".to_owned()),
    }
    text
}

/// A table whose first column is text, and whose others are numbers as far as they are.
fn table(head: &[&str], rows: impl IntoIterator<Item = Vec<String>>) -> String {
    let mut table = Table::new();
    table.load_style(presets::UTF8_BORDERS_ONLY).set_header(head);
    for row in rows {
        table.add_row(row.into_iter().map(|text| {
            let is_number = text.bytes().all(|byte| byte.is_ascii_digit());
            Cell::new(text).set_alignment(if is_number { CellAlignment::Right } else { CellAlignment::Left })
        }));
    }
    format!("{table}\n")
}
