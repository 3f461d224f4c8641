//! `weeder design`: the required engine, servo, shanks, chain, wheels and handle of a machine, and its tool's swing as
//! settings for the firmware.

use anyhow::Result;
use clap::Args;
use frame::{Results, source};
use mechanics::design::Design;
use mechanics::machine::Machine;
use mechanics::swing::Swing;
use mechanics::{file, paper, report};
use serde_json::json;
use std::path::PathBuf;

#[derive(Args)]
#[command(after_help = "\
Examples:
  weeder design                              the paper's machine
  weeder design --print-machine > my.toml    a commented file to start from
  weeder design --machine my.toml --json     your machine, for a program")]
pub struct Arguments {
    /// The machine; omitted values are those of the paper's machine; - for standard input.
    #[arg(long, value_name = "FILE.toml", value_parser = source::file())]
    machine: Option<PathBuf>,
    /// Compare with the paper's printed figures.
    #[arg(long)]
    against_paper: bool,
    /// Print JSON instead of a table.
    #[arg(long)]
    json: bool,
    /// Print the machine as a commented file to start from.
    #[arg(long, conflicts_with_all = ["against_paper", "json"])]
    print_machine: bool,
}

pub fn run(arguments: &Arguments) -> Result<()> {
    let own = arguments.machine.as_deref().map(file::read).transpose()?;
    let machine = own.unwrap_or_default();
    if arguments.print_machine {
        write!(Results, "{}", machine.to_toml())?;
    } else if arguments.against_paper {
        against_paper(own.as_ref(), arguments.json)?;
    } else {
        design(&machine, arguments.json)?;
    }
    Ok(())
}

fn design(machine: &Machine, json: bool) -> Result<()> {
    let design = Design::of(machine)?;
    let figures = design.figures(machine);
    let swing = Swing::of(machine, design.servo_torque);
    if json {
        let set = swing.as_ref().ok().map(Swing::set_lines);
        let (inputs, no_swing) = (machine.inputs(), swing.as_ref().err());
        return writeln!(
            Results,
            "{:#}",
            json!({ "inputs": inputs, "figures": figures, "swing": swing.as_ref().ok(), "no_swing": no_swing, "set": set })
        );
    }
    let (inputs, paper) = (machine.inputs(), Machine::default().inputs());
    let differing = inputs.iter().zip(&paper).filter(|(input, paper)| input.value != paper.value).count();
    writeln!(Results, "{differing} of the machine's {} values differ from the paper's machine.", inputs.len())?;
    writeln!(Results, "{}\n", report::design_table(&figures))?;
    let concerns = figures.iter().filter(|figure| figure.concern).count();
    writeln!(Results, "{concerns} of {} figures ask for a change (!).\n", figures.len())?;
    match swing {
        Ok(swing) => {
            let said = swing.sentences(machine, design.servo_torque).join("\n");
            writeln!(
                Results,
                "{said}\nFor the firmware's console, until the servo has been timed:\n{}",
                swing.set_lines().join("\n")
            )
        }
        Err(problem) => writeln!(Results, "The tool cannot swing as it has to: {problem}."),
    }
}

fn against_paper(own: Option<&Machine>, json: bool) -> Result<()> {
    let comparisons = paper::compare(own)?;
    if json {
        return writeln!(Results, "{:#}", json!({ "comparisons": comparisons }));
    }
    writeln!(Results, "{}\n\n{}\n", report::comparison_table(&comparisons), report::remark_table(&comparisons))?;
    let count = |verdict| comparisons.iter().filter(|comparison| comparison.verdict == verdict).count();
    writeln!(
        Results,
        "Of {} printed figures {} are right, {} follow from an error before them, and {} are wrong.",
        comparisons.len(),
        count(paper::Verdict::Right),
        count(paper::Verdict::Follows),
        count(paper::Verdict::Wrong)
    )
}
