//! The `weeder` command: tries the firmware on a simulated field, and puts it on an Arduino Uno.
//!
//! `weeder sim` and `weeder classify` end with status 0 where no plant was damaged, or would be, and 1 where one was;
//! commands that compare end with 1 where something differs, `weeder bounds` where a bound is over its budget. Whatever else
//! goes wrong ends with status 2 and a message that says what would be right.

// A result is printed in one way, which a closed pipe or a full disk does not bring down.
#![deny(clippy::print_stdout, clippy::print_stderr)]

mod bench;
mod bounds;
mod classify;
mod completions;
mod course;
mod design;
mod destination;
mod evaluate;
mod examples;
mod figures;
mod finding;
mod flash;
mod gps;
mod hex;
mod map;
mod merge;
mod monitor;
mod numbers;
mod output;
mod part;
mod plan;
mod ports;
mod progress;
mod record;
mod replay;
mod rows;
mod serve;
mod settings;
mod sim;
mod soak;
mod source;
mod sweep;
mod train;
mod trial;
mod virtual_uno;

use crate::finding::Finding;
use clap::builder::StyledStr;
use clap::error::{ContextKind, ContextValue, ErrorKind};
use clap::{CommandFactory, FromArgMatches, Parser, Subcommand};
use std::env;
use std::ffi::OsString;
use std::process::ExitCode;

/// Tries the intra-row weeder's firmware on a simulated field, and puts it on an Arduino Uno.
#[derive(Parser)]
#[command(
    name = "weeder",
    version,
    after_help = "Each command's --help has examples. A report goes into a folder (--out FOLDER), a single table to a file (--out \
        FILE.csv); - is standard input wherever a file is read. The status is 0 where all is well; 1 where a plant was damaged, something \
        differs, a bound is over its budget, or the machine refused a command; 2 where something else went wrong, with a message that says what would be right."
)]
struct Arguments {
    #[command(subcommand)]
    command: Command,
}

#[derive(Subcommand)]
enum Command {
    /// Weed a simulated row with the real firmware on a virtual Uno, and say how it went.
    Sim(Box<sim::Arguments>),
    /// Build the firmware and put it on the Uno at a USB port.
    Flash(flash::Arguments),
    /// Write the firmware as an Intel HEX file, for the Arduino tools.
    Hex(hex::Arguments),
    /// Run the firmware, or a bootloader, on a virtual Uno at a pseudo terminal, in real time.
    VirtualUno(Box<virtual_uno::Arguments>),
    /// Count the cycles and bytes of the firmware and its classifier on a virtual Uno.
    BenchUno(bench::Arguments),
    /// Prove from the ELF what the firmware needs at most: stack, interrupts, and how fast the encoder may turn.
    Bounds(bounds::Arguments),
    /// Work for a day with everything going wrong now and then, and say what happened.
    Soak(soak::Arguments),
    /// Run the paper's experiment in a simulated field, and say how the firmware and others did.
    Trial(Box<trial::Arguments>),
    /// Show a result of the simulated trial against one or two of its parameters.
    Sweep(Box<sweep::Arguments>),
    /// Put together the parts of a trial, sweep or soak that several machines have computed.
    Merge(merge::Arguments),
    /// Make an example table of labelled objects, and say how well it tells plants from weeds.
    Train(train::Arguments),
    /// Say what the firmware's classifier takes recorded objects for.
    Classify(classify::Arguments),
    /// Say which Uno is which row's, and name the rows of a machine.
    Rows(rows::Arguments),
    /// Watch the machine, and type into its console.
    Monitor(monitor::Arguments),
    /// Serve the page to a phone: what the machines at this computer do, and HOLD.
    Serve(serve::Arguments),
    /// Write down what the machine does, for as long as it does it.
    Record(record::Arguments),
    /// Replay a log by the same decisions on this computer, and say where the result differs.
    Replay(replay::Arguments),
    /// Make a map of a record with a satellite receiver, and count the stand.
    Map(Box<map::Arguments>),
    /// Keep what the machine was taught in a table, teach it from one, or compare both.
    Examples(examples::Arguments),
    /// Keep the machine's settings in a file, set them from it, or compare both.
    Settings(settings::Arguments),
    /// Calculate what a machine's engine, servo, shanks, chain, wheels and handle have to be like.
    Design(design::Arguments),
    /// Draw the plan of a field trial by lot, as the table to fill in.
    Plan(plan::Arguments),
    /// Judge a field trial by what was counted and measured in its plots.
    Evaluate(evaluate::Arguments),
    /// Write the figures of the manual anew, or say which are no longer true.
    Figures(figures::Arguments),
    /// Print what a shell needs to complete this command's words.
    Completions(completions::Arguments),
}

/// The commands with all their arguments.
fn grammar() -> clap::Command {
    numbers::with_negative_numbers(Arguments::command())
}

/// What these words ask for.
fn parse(words: Vec<OsString>) -> Result<Arguments, clap::Error> {
    let found = grammar().try_get_matches_from(&words);
    found.and_then(|found| Arguments::from_arg_matches(&found)).map_err(|error| with_known_commands(error, &words))
}

/// The same error; one of an unknown command says which there are.
fn with_known_commands(mut error: clap::Error, words: &[OsString]) -> clap::Error {
    if error.kind() == ErrorKind::InvalidSubcommand {
        let mut command = grammar();
        let mut words = words.iter().skip(1);
        while let Some(inner) = words.next().and_then(|word| command.find_subcommand(word)) {
            command = inner.clone();
        }
        let known: Vec<&str> = command.get_subcommands().map(clap::Command::get_name).collect();
        let tip = StyledStr::from(format!("the commands are {}", known.join(", ")));
        error.insert(ContextKind::Suggested, ContextValue::StyledStrs(vec![tip]));
    }
    error
}

fn main() -> ExitCode {
    let arguments = match parse(env::args_os().collect()) {
        Ok(arguments) => arguments,
        Err(error) => error.exit(),
    };
    let result = match arguments.command {
        Command::Sim(arguments) => sim::run(&arguments),
        Command::Flash(arguments) => flash::run(&arguments).map(|()| Finding::Good),
        Command::Hex(arguments) => hex::run(&arguments).map(|()| Finding::Good),
        Command::VirtualUno(arguments) => virtual_uno::run(&arguments).map(|()| Finding::Good),
        Command::BenchUno(arguments) => bench::run(&arguments).map(|()| Finding::Good),
        Command::Bounds(arguments) => bounds::run(&arguments),
        Command::Soak(arguments) => soak::run(&arguments),
        Command::Trial(arguments) => trial::run(&arguments),
        Command::Sweep(arguments) => sweep::run(&arguments).map(|()| Finding::Good),
        Command::Merge(arguments) => merge::run(&arguments),
        Command::Train(arguments) => train::run(&arguments),
        Command::Classify(arguments) => classify::run(&arguments),
        Command::Monitor(arguments) => monitor::run(&arguments),
        Command::Serve(arguments) => serve::run(&arguments).map(|()| Finding::Good),
        Command::Rows(arguments) => rows::run(&arguments).map(|()| Finding::Good),
        Command::Record(arguments) => record::run(&arguments).map(|()| Finding::Good),
        Command::Replay(arguments) => replay::run(&arguments),
        Command::Map(arguments) => map::run(&arguments).map(|()| Finding::Good),
        Command::Examples(arguments) => examples::run(&arguments),
        Command::Settings(arguments) => settings::run(&arguments),
        Command::Design(arguments) => design::run(&arguments).map(|()| Finding::Good),
        Command::Plan(arguments) => plan::run(&arguments).map(|()| Finding::Good),
        Command::Evaluate(arguments) => evaluate::run(&arguments).map(|()| Finding::Good),
        Command::Figures(arguments) => figures::run(&arguments),
        Command::Completions(arguments) => completions::run(&arguments, grammar()).map(|()| Finding::Good),
    };
    match result {
        Ok(Finding::Good) => ExitCode::SUCCESS,
        Ok(Finding::Bad) => ExitCode::from(1),
        Err(error) => {
            output::tell!("error: {error:#}");
            ExitCode::from(2)
        }
    }
}

#[cfg(test)]
mod tests {
    use super::*;
    use clap::Command;

    #[test]
    fn the_arguments_are_well_formed() {
        grammar().debug_assert();
    }

    /// A command's subcommands and theirs, each with its name in full.
    fn subcommands(command: &Command, name: &str) -> Vec<(String, Command)> {
        let of_one = |command: &Command| {
            let name = format!("{name} {}", command.get_name());
            [vec![(name.clone(), command.clone())], subcommands(command, &name)].concat()
        };
        command.get_subcommands().flat_map(of_one).collect()
    }

    #[test]
    fn every_number_s_range_is_in_its_help_and_in_what_is_said_of_a_number_below_it() {
        let mut ranges = 0;
        for (name, command) in subcommands(&grammar(), "weeder") {
            for option in command.get_arguments().filter(|option| option.get_action().takes_values()) {
                let Some(long) = option.get_long() else { continue };
                let words = name.split(' ').map(OsString::from).chain([format!("--{long}").into(), "-1".into()]);
                let Err(error) = parse(words.collect()) else { continue };
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

    #[test]
    fn every_command_s_help_has_examples_that_are_well_formed() {
        for (name, command) in subcommands(&grammar(), "weeder") {
            let help = command.get_after_help().map(ToString::to_string).unwrap_or_default();
            let lines = help.lines().map(|line| line.trim_start().trim_start_matches("Example: "));
            // What stands behind a pipe, `&&` or some blanks is not the command's.
            let examples = lines.filter(|line| line.starts_with(&name)).map(|line| {
                let end = ["  ", " |", " >", " &&"].into_iter().filter_map(|end| line.find(end)).min();
                &line[..end.unwrap_or(line.len())]
            });
            let mut seen = 0;
            for example in examples {
                let words = shlex::split(example).expect("its quotes are balanced");
                if let Err(error) = parse(words.into_iter().map(OsString::from).collect()) {
                    panic!("{example}: {error}");
                }
                seen += 1;
            }
            assert!(seen > 0, "the help of `{name}` has no example");
        }
    }
}
