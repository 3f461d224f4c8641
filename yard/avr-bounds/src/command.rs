//! The command line: its arguments, and its output.

use crate::error::printable;
use crate::{Bounds, BoundsError, Budgets, Frame, FunctionBounds, Held, Longest, Program, order, prove};
use anyhow::{Context, Result, ensure};
use clap::{Args, Parser};
use comfy_table::{Cell, CellAlignment, Table, presets};
use serde_json::json;
use std::collections::{BTreeMap, BTreeSet};
use std::fmt::Write as _;
use std::io::{self, ErrorKind, Write as _};
use std::path::{Path, PathBuf};
use std::process::ExitCode;

/// The exit statuses, for the help.
const AFTER_HELP: &str = "\
Examples:
  avr-bounds blink.elf
  avr-bounds blink.elf --function loop
  avr-bounds blink.elf --budgets budgets.toml --json
  avr-bounds new.elf --diff old.elf

The status is 0 if every bound keeps to its budget, or if there are no budgets; 1 if one does not; and 2 if the program has no bounds,
such as for recursion, calls to addresses that cannot be followed, alloca, and handlers that turn interrupts on.";

/// How a program is to be looked at.
#[derive(Args, Clone, Debug, Default)]
pub struct Options {
    /// Hold the bounds against this file, which also tells how often loops turn and where calls lead.
    #[arg(long, value_name = "FILE.toml")]
    pub budgets: Option<PathBuf>,
    /// The chip, if the ELF does not name it.
    #[arg(long, value_name = "CHIP")]
    pub chip: Option<String>,
    /// Show only this function: its stack, its cycles and its calls.
    #[arg(long, value_name = "NAME")]
    pub function: Option<String>,
    /// Name every loop without a bound, and every target of indirect calls.
    #[arg(long)]
    pub loops: bool,
    /// Print all of it as JSON.
    #[arg(long, conflicts_with_all = ["dot", "diff"])]
    pub json: bool,
    /// Print the graph of calls in the language of Graphviz, with stack and cycles.
    #[arg(long, conflicts_with = "diff")]
    pub dot: bool,
    /// Print the functions as lines of a linker script, in an order in which most calls are short.
    #[arg(long, conflicts_with_all = ["json", "dot", "diff"])]
    pub order: bool,
    /// Show what changed since this program.
    #[arg(long, value_name = "OLD.elf")]
    pub diff: Option<PathBuf>,
}

/// The printed text, and whether every bound keeps to its budget.
#[derive(Clone, Debug, PartialEq, Eq)]
pub struct Report {
    /// The text.
    pub text: String,
    /// Whether every bound keeps to its budget.
    pub keeps: bool,
}

/// Proves how much stack and time an AVR program can need at most, from its ELF.
#[derive(Parser)]
#[command(version, name = "avr-bounds", after_help = AFTER_HELP)]
struct Arguments {
    /// The program.
    #[arg(value_name = "FILE.elf")]
    elf: PathBuf,
    #[command(flatten)]
    options: Options,
}

/// Runs the command with its arguments. Returns its exit status.
pub fn main() -> ExitCode {
    match run(&Arguments::parse()) {
        Ok(true) => ExitCode::SUCCESS,
        Ok(false) => ExitCode::from(1),
        Err(error) => {
            eprintln!("error: {}", printable(&format!("{error:#}")));
            ExitCode::from(2)
        }
    }
}

/// Proves the bounds and prints them. Returns whether every bound keeps to its budget.
fn run(arguments: &Arguments) -> Result<bool> {
    let Report { text, keeps } = report(&arguments.elf, &arguments.options)?;
    let mut output = io::stdout().lock();
    match output.write_all(text.as_bytes()).and_then(|()| output.flush()) {
        // Enough has been read.
        Err(error) if error.kind() == ErrorKind::BrokenPipe => {}
        written => written.context("the result cannot be printed")?,
    }
    Ok(keeps)
}

/// Proves the bounds of the program at `elf` and returns the report.
///
/// # Errors
/// If the program cannot be read or followed, or the budgets cannot be read.
pub fn report(elf: &Path, options: &Options) -> Result<Report> {
    let budgets = options.budgets.as_deref().map_or(Ok(Budgets::default()), Budgets::read)?;
    let chip = options.chip.as_deref().or(budgets.chip.as_deref());
    if options.order {
        let (text, before, behind) = order(&Program::read(elf, chip)?);
        let text = format!("/* Written by `avr-bounds --order`: {behind} calls are long, {before} were. */\n{text}");
        return Ok(Report { text, keeps: true });
    }
    let bounds_of = |elf: &Path| -> Result<Bounds, BoundsError> { prove(&Program::read(elf, chip)?, &budgets) };
    let bounds = bounds_of(elf)?;
    let held = budgets.hold(&bounds)?;
    let keeps = held.iter().all(|held| held.keeps);
    let text = if let Some(old) = &options.diff {
        let old = bounds_of(old).with_context(|| format!("{}", old.display()))?;
        differences(&old, &bounds)
    } else if let Some(name) = &options.function {
        let named: Vec<_> = bounds.functions.iter().filter(|function| function.function == *name).collect();
        ensure!(
            !named.is_empty(),
            "no function called {name} is reached from the reset or a handler: take a name that `--dot` shows"
        );
        if options.json { format!("{:#}\n", json!(named)) } else { named.into_iter().map(of_function).collect() }
    } else if options.dot {
        graph(&bounds)
    } else if options.json {
        format!("{:#}\n", json!({ "bounds": bounds, "budgets": held, "keeps": keeps }))
    } else {
        in_words(&bounds, &held, options.loops)
    };
    // Names come from the file.
    Ok(Report { text: printable(&text), keeps })
}

/// The bounds in words and tables.
fn in_words(bounds: &Bounds, held: &[Held], all: bool) -> String {
    let mut text = String::new();
    let mut line = |what: String| writeln!(text, "{what}").expect("a string takes everything");
    line("Proved from the ELF, for every input at every moment:\n".to_owned());
    if held.is_empty() {
        line(format!("The deepest stack on the {} has {} bytes.", bounds.chip, bounds.stack_bytes));
    } else {
        let rows = held.iter().map(|Held { name, proved, budget, keeps }| {
            let unit = name.replace('_', " ");
            let limit = if *name == "never_lost_per_s" { "at least" } else { "at most" };
            vec![unit, proved.to_string(), format!("{limit} {budget}"), if *keeps { "" } else { "OVER" }.to_owned()]
        });
        line(table(&["bound", "proved", "budget", ""], rows));
    }
    line("The deepest stack, from the reset on:\n".to_owned());
    let rows = bounds.stack.iter().map(|Frame { function, bytes }| vec![function.clone(), bytes.to_string()]);
    line(table(&["function", "bytes"], rows));

    if !bounds.handlers.is_empty() {
        line(
            "Interrupt handlers, response and return included, and how long a request waits for its handler:\n"
                .to_owned(),
        );
        let rows = bounds.handlers.iter().map(|handler| {
            let returns = handler.longest != Longest::default();
            let cycles = if returns { or_no_bound(handler.longest.cycles) } else { "never returns".to_owned() };
            let (vector, stack) = (handler.vector.to_string(), handler.stack_bytes.to_string());
            vec![vector, handler.function.clone(), cycles, or_no_bound(handler.response_cycles), stack]
        });
        line(table(&["vector", "function", "cycles", "response", "stack bytes"], rows));
    }

    line(format!("The main program blocks interrupts for {}.", most(&bounds.closed)));
    line(format!("The longest stretch with the interrupt flag clear has {}.", most(&bounds.critical_section)));
    if let Some(edges) = &bounds.edges {
        line(format!("An edge of the input waits at most {} cycles for its handler.", edges.wait_cycles));
        line(format!("No edge is lost up to {} a second.", edges.never_lost_per_s));
    }
    if let Some(turn) = &bounds.turn {
        match turn.cycles {
            Some(cycles) => line(format!(
                "A turn of the main loop takes at most {cycles} cycles, without handlers and sleep. No real turn comes near that: the bounds of \
                 nested loops multiply."
            )),
            None => line(format!(
                "The longest turn of the loop is not computed: {} loops without a bound, or with `wdr` only in a called function.",
                turn.without_bound.len()
            )),
        }
    }
    // Only `--loops` prints addresses. So the rest of the report is the same for programs with another layout.
    let named_or_where = if all { ":" } else { ", which --loops names." };
    let loops = &bounds.all_loops_without_bound;
    if !loops.is_empty() {
        line(format!("{} loops that end have no bound{named_or_where}", loops.len()));
        loops.iter().filter(|_| all).for_each(|place| line(format!("  {place}")));
    }
    if !bounds.indirect.is_empty() {
        let targets: usize = bounds.indirect.iter().map(|indirect| indirect.targets.len()).sum();
        let calls = bounds.indirect.len();
        line(format!("{calls} calls or jumps by an address lead to {targets} places{named_or_where}"));
        for indirect in bounds.indirect.iter().filter(|_| all) {
            let found = json!(indirect.found);
            line(format!("  {} ({})", indirect.place, found.as_str().unwrap_or_default()));
            indirect.targets.iter().for_each(|target| line(format!("    {target}")));
        }
    }
    text
}

/// Cycles in a table.
fn or_no_bound(cycles: Option<u64>) -> String {
    cycles.map_or("no bound".to_owned(), |cycles| cycles.to_string())
}

/// A time in words.
fn most(longest: &Longest) -> String {
    match (longest.cycles, longest.without_bound.first()) {
        (Some(cycles), _) => format!("{cycles} cycles at most"),
        (None, Some(place)) => format!("no time that is bounded, because of {place}"),
        (None, None) => "no end".to_owned(),
    }
}

/// One function in words.
fn of_function(function: &FunctionBounds) -> String {
    let FunctionBounds { function: name, address, stack_bytes, longest, calls } = function;
    let mut text = format!("{name}, at {address:#06x}\n  stack: {stack_bytes} bytes at most\n");
    match longest {
        None => text += "  time: it never returns\n",
        Some(longest) => {
            let _ = writeln!(text, "  time: {}", most(longest));
            for place in longest.without_bound.iter().skip(1) {
                let _ = writeln!(text, "    and of {place}");
            }
        }
    }
    for called in calls.values() {
        let _ = writeln!(text, "  calls {called}");
    }
    text
}

/// The graph of calls, for Graphviz.
fn graph(bounds: &Bounds) -> String {
    let mut text = "digraph calls {\n  node [shape=box]\n".to_owned();
    // An address stands for each, because functions may have the same name.
    for FunctionBounds { function, address, stack_bytes, longest, calls } in &bounds.functions {
        let cycles = match longest {
            None => "never returns".to_owned(),
            Some(Longest { cycles: Some(cycles), .. }) => format!("{cycles} cycles"),
            Some(_) => "no bound in time".to_owned(),
        };
        let label = format!("{function}\n{stack_bytes} bytes\n{cycles}");
        let _ = writeln!(text, "  \"{address:#06x}\" [label={label:?}]");
        for called in calls.keys() {
            let _ = writeln!(text, "  \"{address:#06x}\" -> \"{called:#06x}\"");
        }
    }
    text + "}\n"
}

/// The differences of two programs, as a table.
fn differences(old: &Bounds, new: &Bounds) -> String {
    let (old, new) = (figures(old), figures(new));
    let names: BTreeSet<&String> = old.keys().chain(new.keys()).collect();
    let changed = names.into_iter().filter(|name| old.get(*name) != new.get(*name));
    let or_none = |figure: Option<&String>| figure.cloned().unwrap_or("-".to_owned());
    let rows: Vec<_> = changed.map(|name| vec![name.clone(), or_none(old.get(name)), or_none(new.get(name))]).collect();
    if rows.is_empty() { "No bound changed.\n".to_owned() } else { table(&["bound", "old", "new"], rows) }
}

/// Every figure by its name. Functions of the same name have numbers, in the order of their addresses.
fn figures(bounds: &Bounds) -> BTreeMap<String, String> {
    let mut all = BTreeMap::from([
        ("stack, bytes".to_owned(), bounds.stack_bytes.to_string()),
        ("critical section, cycles".to_owned(), or_no_bound(bounds.critical_section.cycles)),
        ("without interrupts, cycles".to_owned(), or_no_bound(bounds.closed.cycles)),
    ]);
    all.extend(bounds.turn.iter().map(|turn| ("turn of the loop, cycles".to_owned(), or_no_bound(turn.cycles))));
    for handler in &bounds.handlers {
        let name = format!("vector {}", handler.vector);
        all.insert(format!("{name}, cycles"), or_no_bound(handler.longest.cycles));
        all.insert(format!("{name}, response"), or_no_bound(handler.response_cycles));
        all.insert(format!("{name}, stack bytes"), handler.stack_bytes.to_string());
    }
    let mut same: BTreeMap<&String, u32> = BTreeMap::new();
    for FunctionBounds { function, stack_bytes, longest, .. } in &bounds.functions {
        let number = same.entry(function).and_modify(|number| *number += 1).or_insert(1);
        let name = if *number == 1 { function.clone() } else { format!("{function} ({number})") };
        all.insert(format!("{name}, stack bytes"), stack_bytes.to_string());
        if let Some(longest) = longest {
            all.insert(format!("{name}, cycles"), or_no_bound(longest.cycles));
        }
    }
    all
}

/// A table. Its first column is text. The others are numbers, if their cells are.
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
