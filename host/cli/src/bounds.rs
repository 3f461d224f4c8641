//! `weeder bounds`: the proved limits of the firmware, beside its budgets. `avr-bounds` makes the proof and the texts.
//! The firmware and its budgets are this repository's. Commands that flash a firmware first check here whether its
//! bounds are proved.

use anyhow::{Result, bail, ensure};
use avr_bounds::command::{Options, Report, report};
use avr_bounds::{Budgets, Held, Program};
use clap::Args;
use frame::{Finding, Messages, Results};
use std::path::{Path, PathBuf};
use uno::elf::Image;
use uno_run::firmware;

#[derive(Args)]
#[command(after_help = "\
Examples:
  weeder bounds
  weeder bounds --loops
  weeder bounds --elf other.elf --budgets other.toml --json

The status is 0 if every bound is within its budget, and 1 if one is not. It is 2 if there is no bound.
Reasons are recursion, calls to unknown addresses, handlers that enable interrupts, functions that
break the calling convention, and loops without a bound where time needs one.")]
pub struct Arguments {
    /// Analyse this ELF instead of this weeder's own firmware. Name its --budgets too if it is another program.
    #[arg(long, value_name = "FILE.elf")]
    elf: Option<PathBuf>,
    #[command(flatten)]
    options: Options,
}

pub fn run(arguments: &Arguments) -> Result<Finding> {
    let mut options = arguments.options.clone();
    if options.budgets.is_none() {
        options.budgets = Some(firmware::budgets(false)?);
    }
    let elf = arguments.elf.clone().map_or_else(firmware::build, Ok)?;
    let Report { text, keeps } = report(&elf, &options)?;
    write!(Results, "{text}")?;
    Ok(Finding::of(keeps))
}

/// The bounds of a firmware, each beside its budget.
fn prove(elf: &Path, budgets: &Path) -> Result<Vec<Held>> {
    let budgets = Budgets::read(budgets)?;
    let program = Program::read(elf, budgets.chip.as_deref())?;
    Ok(budgets.hold(&avr_bounds::prove(&program, &budgets)?)?)
}

/// The firmware to flash, and whether it may have unproved bounds.
#[derive(Args)]
pub struct Firmware {
    /// Take this ELF, or HEX file, instead of this weeder's own firmware.
    #[arg(long, value_name = "FILE")]
    elf: Option<PathBuf>,
    /// Take the firmware of the tester, the second Uno of `weeder check-board`.
    #[arg(long, conflicts_with = "elf")]
    tester: bool,
    /// Write the firmware even if its bounds are not proved. Its stack may overwrite its data. It may miss plants
    /// without an alarm.
    #[arg(long)]
    unproved: bool,
}

const RISK: &str = "its stack may overwrite its data, and plants may be missed, without an alarm";

impl Firmware {
    /// The firmware's ELF, built if none was named.
    pub fn elf(&self) -> Result<PathBuf> {
        Ok(match &self.elf {
            Some(elf) => elf.clone(),
            None if self.tester => firmware::TESTER.elf()?,
            None => firmware::build()?,
        })
    }

    /// Proves an ELF, or a HEX file that has the flash of the ELF that this command would take itself.
    fn prove(&self, file: &Path) -> Result<Vec<Held>> {
        let flash = Image::read(file)?;
        let mut elf = file.to_owned();
        if !flash.has_symbols() {
            elf = Self { elf: None, ..*self }.elf()?;
            ensure!(Image::read(&elf)?.flash == flash.flash, "it is a HEX file of another firmware: name its ELF");
        }
        prove(&elf, &firmware::budgets(self.tester)?)
    }

    /// Proves this firmware's bounds. Fails if one is not proved, or is over its budget; with `--unproved` this only warns.
    pub fn check(&self, elf: &Path) -> Result<()> {
        let why = match self.prove(elf) {
            Ok(held) => match held.into_iter().find(|held| !held.keeps) {
                Some(Held { name, proved, budget, .. }) => format!("{name} is {proved}, and its budget is {budget}"),
                None => return Ok(()),
            },
            Err(error) => format!("{error:#}"),
        };
        if !self.unproved {
            bail!(
                "the bounds of {} are not proved: {why}. Unproved, {RISK}: --unproved writes it all the same",
                elf.display()
            );
        }
        writeln!(
            Messages,
            "Warning: the bounds of {} are not proved: {why}. So {RISK}: keep its tool off the field",
            elf.display()
        );
        Ok(())
    }
}
