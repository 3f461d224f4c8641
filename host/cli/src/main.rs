//! The `weeder` command: runs the firmware on a simulated field, and flashes and operates an Arduino Uno.
//!
//! `weeder sim` and `weeder classify` exit with 0 if no plant was damaged, or would be, and with 1 otherwise. Commands
//! that compare exit with 1 if something differs. `weeder bounds` exits with 1 if a bound is over its budget. All other
//! errors exit with 2 and print a message that says what would be right.

// Results are printed by one function, which handles a closed pipe and a full disk.
#![deny(clippy::print_stdout, clippy::print_stderr)]

mod bench;
mod bounds;
mod check_board;
mod classify;
mod completions;
mod design;
mod evaluate;
mod examples;
mod figures;
mod flash;
mod hex;
mod input;
mod inside;
mod map;
mod merge;
mod monitor;
mod part;
mod plan;
mod ports;
mod receiver;
mod record;
mod replay;
mod rows;
mod sensitivity;
mod serve;
mod set_up;
mod settings;
mod soak;
mod sweep;
mod train;
mod trial;
mod virtual_uno;

use anyhow::{Context, Result};
use clap::{Parser, Subcommand};
use frame::{Finding, program, row};
use inside::INSIDE;
use signal_hook::consts::{SIGINT, SIGTERM};
use std::process::ExitCode;
use std::sync::Arc;
use std::sync::atomic::{AtomicBool, Ordering};
use uno_run::firmware;

/// Tries the intra-row weeder's firmware on a simulated field, and puts it on an Arduino Uno.
#[derive(Parser)]
#[command(
    name = "weeder",
    version = env!("WEEDER_VERSION"),
    max_term_width = 100,
    after_help = "Each command's --help has examples.\n\
        A report goes into a folder (--out FOLDER), and a single table into a file (--out FILE.csv).\n\
        Existing files are replaced only with --force; a log of `record` or `monitor` is continued.\n\
        - is standard input where a command's help says so.\n\
        Status 0: success.\n\
        Status 1: a plant was damaged, something differs, a bound is over its budget, or the machine refused a command.\n\
        Status 2: an error. The message says what would be right."
)]
struct Arguments {
    #[command(subcommand)]
    command: Command,
}

/// The grammar of the commands. The module of each has its `Arguments`, and `run`. That fails if an argument, a file, the
/// firmware or a machine cannot be used. The error says what would be right.
#[derive(Subcommand)]
enum Command {
    /// Weed a simulated row with the real firmware on a virtual Uno.
    Sim(Box<row::Arguments>),
    /// Build the firmware and flash the Uno at a USB port.
    Flash(Box<flash::Arguments>),
    /// Write the firmware as an Intel HEX file, for the Arduino tools.
    Hex(Box<hex::Arguments>),
    /// Run the firmware or a bootloader on a virtual Uno, in real time, at a serial port.
    VirtualUno(Box<virtual_uno::Arguments>),
    /// Measure the cycles and bytes of the firmware on a virtual Uno.
    BenchUno(Box<bench::Arguments>),
    /// Prove bounds from the ELF: stack, interrupts, and the encoder's rate.
    Bounds(Box<bounds::Arguments>),
    /// Check a real board with a second Uno, the tester.
    CheckBoard(Box<check_board::Arguments>),
    /// Work for a day with random faults.
    Soak(Box<soak::Arguments>),
    /// Run the paper's experiment in a simulated field, with several controllers.
    Trial(Box<trial::Arguments>),
    /// Map a result of the simulated trial against one or two parameters.
    Sweep(Box<sweep::Arguments>),
    /// Show what each assumption of the simulated field costs.
    Sensitivity(Box<sensitivity::Arguments>),
    /// Merge the parts of a trial, sweep or soak from several machines.
    Merge(Box<merge::Arguments>),
    /// Learn a table of examples from labelled detections, and print its error rates.
    Train(Box<train::Arguments>),
    /// Classify recorded detections with the firmware's classifier.
    Classify(Box<classify::Arguments>),
    /// List the Unos and the rows that they control, and name rows.
    Rows(Box<rows::Arguments>),
    /// Watch the machine, and type commands.
    Monitor(Box<monitor::Arguments>),
    /// Serve the page to a phone, with the state of the machines and HOLD.
    Serve(Box<serve::Arguments>),
    /// Record what the machine does.
    Record(Box<record::Arguments>),
    /// Replay a log with the same decisions on this computer, and compare.
    Replay(Box<replay::Arguments>),
    /// Make a map of a record with a satellite receiver, and count plants.
    Map(Box<map::Arguments>),
    /// Save taught examples in a table, teach them, or compare.
    Examples(Box<examples::Arguments>),
    /// Set up the machine step by step: ask, measure, set and save.
    SetUp(Box<set_up::Arguments>),
    /// Save the machine's settings in a file, set them from it, or compare.
    Settings(Box<settings::Arguments>),
    /// Calculate engine, servo, shanks, chain, wheels and handle of a machine.
    Design(Box<design::Arguments>),
    /// Create a randomised plan of a field trial, as a table to fill in.
    Plan(Box<plan::Arguments>),
    /// Evaluate a field trial from the counts of its plots.
    Evaluate(Box<evaluate::Arguments>),
    /// Update or check the manual's figures.
    Figures(Box<figures::Arguments>),
    /// Print the completion script for a shell.
    Completions(Box<completions::Arguments>),
}

fn run(command: Command) -> Result<Finding> {
    match command {
        Command::Sim(arguments) => row::run(&arguments),
        Command::Flash(arguments) => flash::run(&arguments).map(Into::into),
        Command::Hex(arguments) => hex::run(&arguments).map(Into::into),
        Command::VirtualUno(arguments) => virtual_uno::run(&arguments).map(Into::into),
        Command::BenchUno(arguments) => bench::run(&arguments).map(Into::into),
        Command::Bounds(arguments) => bounds::run(&arguments),
        Command::CheckBoard(arguments) => check_board::run(&arguments),
        Command::Soak(arguments) => soak::run(&arguments),
        Command::Trial(arguments) => trial::run(&arguments),
        Command::Sweep(arguments) => sweep::run(&arguments).map(Into::into),
        Command::Sensitivity(arguments) => sensitivity::run(&arguments).map(Into::into),
        Command::Merge(arguments) => merge::run(&arguments),
        Command::Train(arguments) => train::run(&arguments).map(Into::into),
        Command::Classify(arguments) => classify::run(&arguments),
        Command::Rows(arguments) => rows::run(&arguments).map(Into::into),
        Command::Monitor(arguments) => monitor::run(&arguments),
        Command::Serve(arguments) => serve::run(&arguments).map(Into::into),
        Command::Record(arguments) => record::run(&arguments).map(Into::into),
        Command::Replay(arguments) => replay::run(&arguments),
        Command::Map(arguments) => map::run(&arguments).map(Into::into),
        Command::Examples(arguments) => examples::run(&arguments),
        Command::SetUp(arguments) => set_up::run(&arguments).map(Into::into),
        Command::Settings(arguments) => settings::run(&arguments),
        Command::Design(arguments) => design::run(&arguments).map(Into::into),
        Command::Plan(arguments) => plan::run(&arguments).map(Into::into),
        Command::Evaluate(arguments) => evaluate::run(&arguments).map(Into::into),
        Command::Figures(arguments) => figures::run(&arguments),
        Command::Completions(arguments) => completions::run(&arguments).map(Into::into),
    }
}

fn main() -> ExitCode {
    if let Some(inside) = INSIDE {
        firmware::put_inside(inside.firmware);
    }
    program::main(|arguments: Arguments| run(arguments.command))
}

/// A flag that Ctrl-C sets, and SIGTERM and SIGHUP: it asks a command to end.
fn ctrl_c() -> Result<Arc<AtomicBool>> {
    let stop = Arc::new(AtomicBool::new(false));
    let asked_to_stop = Arc::clone(&stop);
    if ctrlc::try_set_handler(move || asked_to_stop.store(true, Ordering::Relaxed)).is_err() {
        // One of the signals is ignored already: `nohup` ignores SIGHUP, and a script SIGINT for what it starts in the background.
        // SIGHUP stays as it was, because nothing tells which one it is.
        for signal in [SIGINT, SIGTERM] {
            signal_hook::flag::register(signal, Arc::clone(&stop)).context("Ctrl-C cannot be caught")?;
        }
    }
    Ok(stop)
}

#[cfg(test)]
mod tests {
    use super::*;
    use clap::{Arg, Command};
    use frame::OutName;
    use frame::program::parse;
    use std::any::TypeId;
    use std::collections::BTreeSet;
    use std::ffi::OsString;
    use std::fs;
    use std::path::{Path, PathBuf};

    /// A command line without quotes. `DIR` is this folder.
    fn parsed(words: &str, folder: &Path) -> Result<Arguments, clap::Error> {
        let words = format!("weeder {words}").replace("DIR", folder.to_str().expect("it is text"));
        parse(words.split(' ').map(OsString::from).collect())
    }

    #[test]
    fn the_arguments_are_well_formed() {
        program::grammar::<Arguments>().debug_assert();
    }

    /// All commands and their subcommands, each with its name in full, without `weeder`.
    fn commands() -> Vec<(String, Command)> {
        fn below(command: &Command, name: &str) -> Vec<(String, Command)> {
            let of_one = |command: &Command| {
                let name = format!("{name} {}", command.get_name()).trim_start().to_owned();
                [vec![(name.clone(), command.clone())], below(command, &name)].concat()
            };
            command.get_subcommands().flat_map(of_one).collect()
        }
        below(&program::grammar::<Arguments>(), "")
    }

    #[test]
    fn every_number_s_range_is_in_its_help_and_in_its_error() {
        let mut ranges = 0;
        for (name, command) in commands() {
            for option in command.get_arguments().filter(|option| option.get_action().takes_values()) {
                let Some(long) = option.get_long() else { continue };
                let Err(error) = parsed(&format!("{name} --{long} -1"), Path::new("")) else { continue };
                let said = error.to_string();
                assert!(!said.contains("unexpected argument"), "{name} --{long}: {said}");
                let Some((_, rest)) = said.split_once("number from ") else { continue };
                let range = rest.lines().next().unwrap_or_default();
                let help = option.get_help().map(ToString::to_string).unwrap_or_default();
                assert!(help.contains(range), "{name} --{long}: {range} is not in {help:?}");
                ranges += 1;
            }
        }
        assert!(ranges > 20, "{ranges}");
    }

    /// Arguments of files that are only read.
    const READ: &str = "bounds:budgets bounds:diff bounds:elf check-board:second_simulator classify:file design:machine \
        evaluate:file evaluate:log examples.diff:file examples.push:file flash:elf hex:elf map:logs merge:parts replay:log serve:page set-up:machine \
        settings.diff:file settings.push:file sensitivity:field sim:capture sim:elf sim:field sim:row soak:elf sweep:field train:files trial:elf \
        trial:examples trial:field virtual-uno:bootloader virtual-uno:elf virtual-uno:field virtual-uno:row";

    /// Arguments whose files are continued: logs, an EEPROM, and the state of a set-up. A file of another kind is
    /// refused.
    const CONTINUED: &str = "monitor:log record:out set-up:state virtual-uno:eeprom";

    /// Arguments whose files are edited: the command changes its own lines and keeps the others. These are the rows'
    /// names, and figures of the manual. Links to a virtual Uno's port are also here, because they replace no file.
    const EDITED: &str =
        "figures:pages rows:rows_file rows.name:rows_file rows.forget:rows_file virtual-uno:gps_link virtual-uno:link";

    /// Arguments with words that name no file.
    const NO_FILE: &str = "bounds:chip bounds:function check-board:board check-board:port check-board:tester examples.diff:port examples.pull:port examples.push:port flash:port rows.forget:name rows.name:name \
        rows.name:port set-up:port sim:channel_a sim:channel_b sim:channel_beam";

    /// Each argument that names an output, a command line that has it, and its files. One of these files is enough to
    /// stop the command. `DIR` is a folder with the required inputs.
    const WRITERS: [(&str, &str, &[&str]); 22] = [
        ("check-board:page", "check-board --simulated --page DIR/new", &["new"]),
        ("evaluate:out", "evaluate DIR/filled.csv --out DIR/reports", &["reports/report.html"]),
        ("examples.pull:file", "examples pull --port /dev/no-such-port DIR/new", &["new"]),
        ("hex:out", "hex DIR/new", &["new"]),
        ("map:out", "map DIR/log.csv --out DIR/new", &["new"]),
        ("map:svg", "map DIR/log.csv --out DIR/map --svg DIR/new", &["new"]),
        ("map:table", "map DIR/log.csv --out DIR/map --table DIR/new", &["new"]),
        ("merge:out", "merge DIR/trial.part --out DIR/reports", &TRIAL),
        ("merge:out", "merge DIR/sweep.part --out DIR/new", &["new"]),
        ("plan:out", "plan --out DIR/new", &["new"]),
        ("plan:sheets", "plan --out DIR/table --sheets DIR/new", &["new"]),
        ("settings.pull:file", "settings pull --port /dev/no-such-port DIR/new", &["new"]),
        (
            "settings.pull:file",
            "settings pull --port a=/dev/no-a --port b=/dev/no-b DIR/reports",
            &["reports/a.toml", "reports/b.toml"],
        ),
        (
            "sim:out",
            "sim --out DIR/reports",
            &["reports/row.svg", "reports/weeding.svg", "reports/row.csv", "reports/plants.csv", "reports/weeds.csv"],
        ),
        ("sim:vcd", "sim --vcd DIR/new", &["new"]),
        ("soak:out", "soak --shard 1/2 --out DIR/new", &["new"]),
        ("sweep:out", "sweep --x k=1..3:1 --out DIR/new", &["new"]),
        ("train:out", "train --synthetic --out DIR/new.rs", &["new.rs"]),
        ("train:out", "train --synthetic --out DIR/new.csv", &["new.csv"]),
        ("train:picture", "train --synthetic --picture DIR/new", &["new"]),
        ("trial:out", "trial --out DIR/reports", &TRIAL),
        ("trial:out", "trial --shard 1/2 --out DIR/new.part", &["new.part"]),
    ];

    const TRIAL: [&str; 3] = ["reports/report.html", "reports/trial.csv", "reports/controllers.csv"];

    /// Whether it takes free text or a path, without its own parser or list of values.
    fn is_free(argument: &Arg) -> bool {
        let parser = argument.get_value_parser();
        let found = parser.type_id();
        let has_words_alone = !argument.is_hide_possible_values_set() && parser.possible_values().is_some();
        let names = [TypeId::of::<String>(), TypeId::of::<PathBuf>()].iter().any(|kind| found == *kind);
        writes(argument) || names && !has_words_alone
    }

    /// Whether it names an output.
    fn writes(argument: &Arg) -> bool {
        argument.get_value_parser().type_id() == TypeId::of::<OutName>()
    }

    #[test]
    fn every_argument_that_could_name_a_file_has_a_rule_for_an_existing_one() {
        let kept: BTreeSet<String> = [READ, CONTINUED, EDITED, NO_FILE]
            .iter()
            .flat_map(|list| list.split_whitespace())
            .map(str::to_owned)
            .collect();
        let replaced: BTreeSet<String> = WRITERS.iter().map(|(argument, ..)| (*argument).to_owned()).collect();
        let mut known = BTreeSet::new();
        for (command_name, command) in commands() {
            let takes_words = |argument: &&Arg| argument.get_action().takes_values() && is_free(argument);
            for argument in command.get_arguments().filter(takes_words) {
                let name = format!("{}:{}", command_name.replace(' ', "."), argument.get_id());
                assert_eq!(
                    writes(argument),
                    replaced.contains(&name),
                    "{name}: is what is there replaced? See WRITERS"
                );
                // Only the commands in EDITED write the file with the rows' names.
                let is_kept = kept.contains(&name) || name.ends_with(":rows_file");
                assert_ne!(writes(argument), is_kept, "{name}: what happens to a file that is there?");
                known.insert(name);
            }
        }
        let gone: Vec<&String> = kept.union(&replaced).filter(|name| !known.contains(*name)).collect();
        assert!(gone.is_empty(), "{gone:?} are no arguments");
    }

    #[test]
    fn a_command_that_writes_has_force_and_no_other_has_it_for_that() {
        let writers: BTreeSet<&str> = WRITERS.iter().filter_map(|(argument, ..)| argument.split(':').next()).collect();
        for (name, command) in commands() {
            let name = name.replace(' ', ".");
            let mut options = command.get_arguments().filter(|argument| argument.get_long() == Some("force"));
            let force = options.next().and_then(Arg::get_help).map(ToString::to_string).unwrap_or_default();
            assert_eq!(force.starts_with("Replace existing files"), writers.contains(name.as_str()), "{name}");
        }
    }

    #[test]
    fn no_command_replaces_an_existing_file_without_force() {
        let folder = tempfile::tempdir().expect("there is room for a folder");
        let path = |name: &str| folder.path().join(name);
        fs::write(path("small.toml"), "[plot]\nrows = 1\nrow_m = 6\n").unwrap();
        fs::write(path("log.csv"), "time_ms,kind,line\n0,connected,0.2.0\n").unwrap();
        let filled = concat!(env!("CARGO_MANIFEST_DIR"), "/../../docs/trial-example.csv");
        fs::copy(filled, path("filled.csv")).unwrap();
        let run = |words: &str| run(parsed(words, folder.path()).unwrap_or_else(|error| panic!("{error}")).command);
        let small = "--field DIR/small.toml --shard 1/1 --out";
        run(&format!("trial --speeds 2 --spacings 50 {small} DIR/trial.part")).expect("it computes a part");
        run(&format!("sweep --x k=1..1:1 {small} DIR/sweep.part")).expect("it computes a part");
        fs::create_dir(path("reports")).unwrap();
        for (_, words, names) in WRITERS {
            for there in names.iter().map(|name| path(name)) {
                fs::write(&there, "mine").unwrap();
                let error = run(words).expect_err(words).to_string();
                let right =
                    format!("{} is there already: choose another name, or have --force replace it", there.display());
                assert_eq!(error, right, "{words}");
                assert_eq!(fs::read_to_string(&there).unwrap(), "mine", "{words}");
                fs::remove_file(there).unwrap();
            }
        }
        // With `--force` it does, and an empty file holds no work.
        let table = path("plan.csv");
        fs::write(&table, "mine").unwrap();
        run("plan --force --out DIR/plan.csv").expect("it is told to");
        assert!(fs::read_to_string(&table).unwrap().contains("plot,replication"));
        fs::write(&table, "").unwrap();
        run("plan --out DIR/plan.csv").expect("nothing is lost");
        let report = path("reports/report.html");
        fs::write(&report, "mine").unwrap();
        run("merge DIR/trial.part --brief --force --out DIR/reports").expect("it is told to");
        assert!(fs::read_to_string(&report).unwrap().contains("<svg"));
    }

    #[test]
    fn an_output_is_no_other_file_of_its_command() {
        let folder = tempfile::tempdir().expect("there is room for a folder");
        let refusal =
            |words: &str| parsed(words, folder.path()).err().map(|error| error.to_string()).unwrap_or_default();
        for words in [
            "plan --out DIR/new --sheets DIR/./new",
            "train --synthetic --out DIR/new.csv --picture DIR/new.csv",
            "map DIR/log.csv --out DIR/new --table DIR/log.csv --force",
            "merge DIR/1.part DIR/2.part --out DIR/1.part --force",
            "sim --field DIR/field.toml --vcd DIR/field.toml --force",
            "settings pull DIR/rows.toml --rows-file DIR/rows.toml --force",
        ] {
            let said = refusal(words);
            assert!(said.contains(" has two uses in this command: name another output"), "{words}: {said}");
        }
        // Words that end in a blank have an empty name, as of a shell's variable that is not set.
        for words in [
            "merge -",
            "hex -",
            "hex DIR/new --elf -",
            "record --out -",
            "plan --out DIR/new --sheets -",
            "hex ",
            "evaluate ",
            "sim --field ",
            "trial --out ",
        ] {
            let said = refusal(words);
            assert!(said.contains("\" is no file here: name one"), "{words}: {said}");
        }
        for words in ["plan --out DIR/new --sheets DIR/page", "sweep --x k=1..2:1 --field walked --out walked"] {
            assert_eq!(refusal(words), "", "{words}");
        }
    }

    #[test]
    fn every_command_s_help_has_examples_that_are_well_formed() {
        for (name, command) in commands() {
            let help = command.get_after_help().map(ToString::to_string).unwrap_or_default();
            let lines = help.lines().map(|line| line.trim_start().trim_start_matches("Example: "));
            // Text behind a pipe, `&&` or some blanks is not part of the command.
            let examples = lines.filter(|line| line.starts_with(&format!("weeder {name}"))).map(|line| {
                let end = ["  ", " |", " >", " &&"].into_iter().filter_map(|end| line.find(end)).min();
                &line[..end.unwrap_or(line.len())]
            });
            let mut seen = 0;
            for example in examples {
                let words = shlex::split(example).expect("its quotes are balanced");
                if let Err(error) = parse::<Arguments>(words.into_iter().map(OsString::from).collect()) {
                    panic!("{example}: {error}");
                }
                seen += 1;
            }
            assert!(seen > 0, "the help of `weeder {name}` has no example");
        }
    }
}
