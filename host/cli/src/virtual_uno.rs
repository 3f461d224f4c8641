//! `weeder virtual-uno`: an Uno without an Uno, at a pseudo terminal that any serial program opens.

use crate::course::CourseArguments;
use crate::output::{say, tell};
use anyhow::{Context, Result};
use clap::Args;
use field::motion::mm_s;
use std::path::{Path, PathBuf};
use std::sync::Arc;
use std::sync::atomic::{AtomicBool, Ordering};
use trial::firmware;
use trial::live::{Course, LiveUno, Setup};
use uno::hex::{Bootloader, HexError};

/// What the user asks of the virtual Uno.
#[derive(Args)]
#[command(after_help = "\
The firmware runs as on a real Uno, with a machine around it that rolls along the row again and again. Opening the port
resets it, as on a real one. Try, in another terminal:

  weeder virtual-uno --link /tmp/uno --eeprom uno.eeprom
  picocom -b 115200 /tmp/uno        (type `help`, `clear`, `start`, `status`)

An Uno with an empty flash and a bootloader, to be flashed by avrdude:

  weeder virtual-uno --link /tmp/uno --bootloader optiboot
  weeder flash --port /tmp/uno

Or with the old bootloader, as Debian's arduino-core-avr has it:

  weeder virtual-uno --link /tmp/uno --bootloader ATmegaBOOT_168_atmega328.hex
  weeder flash --port /tmp/uno --old-bootloader

What avrdude says of TIOCMGET means that a pseudo terminal has no modem lines; it does no harm.")]
pub struct Arguments {
    #[command(flatten)]
    course: CourseArguments,
    /// Have the machine stand still instead of rolling along the row.
    #[arg(long)]
    stand: bool,
    /// Start this bootloader at every reset, with an empty flash before it unless --elf is given too: a file's, or
    /// `optiboot`, the Uno's own, which is compiled for it.
    #[arg(long, value_name = "optiboot|FILE.hex")]
    bootloader: Option<PathBuf>,
    /// Run this firmware instead of building the one in this repository.
    #[arg(long, value_name = "FILE.elf")]
    elf: Option<PathBuf>,
    /// Keep the EEPROM in this file from one run to the next; it is made where it does not exist.
    #[arg(long, value_name = "FILE")]
    eeprom: Option<PathBuf>,
    /// Make a symbolic link to the port here, and remove it at the end.
    #[arg(long, value_name = "PATH")]
    link: Option<PathBuf>,
    /// Leave the chip alone when a program opens the port, as an Uno whose RESET-EN trace is cut.
    #[arg(long)]
    no_reset: bool,
    /// Run as fast as this computer can, not in real time. A bootloader would not wait for avrdude then.
    #[arg(long, conflicts_with = "bootloader")]
    fast: bool,
}

/// The bootloader of that name, or in that file.
fn bootloader(name: &Path) -> Result<Bootloader, HexError> {
    if name == Path::new("optiboot") { Bootloader::optiboot() } else { Bootloader::read(name) }
}

/// Runs until Ctrl-C, or until it is asked to end by SIGTERM or SIGHUP.
///
/// # Errors
/// Where a file is wrong, no pseudo terminal is to be had, or the firmware crashes.
pub fn run(arguments: &Arguments) -> Result<()> {
    let bootloader = arguments.bootloader.as_deref().map(bootloader).transpose()?;
    let course = Course {
        row: arguments.course.row()?,
        machine: arguments.course.machine(),
        speed_mm_s: mm_s(arguments.course.speed),
    };
    let elf = match (&arguments.elf, &bootloader) {
        (Some(elf), _) => Some(elf.clone()),
        (None, Some(_)) => None,
        (None, None) => Some(firmware::build()?),
    };
    let stop = Arc::new(AtomicBool::new(false));
    let asked_to_stop = Arc::clone(&stop);
    ctrlc::set_handler(move || asked_to_stop.store(true, Ordering::Relaxed)).context("Ctrl-C cannot be caught")?;

    let mut uno = LiveUno::start(Setup {
        elf,
        bootloader,
        eeprom: arguments.eeprom.clone(),
        link: arguments.link.clone(),
        course: (!arguments.stand).then_some(course),
        fast: arguments.fast,
        keeps_running_when_opened: arguments.no_reset,
    })?;
    say!("{}", uno.path().display())?;
    tell!("The virtual Uno's port stands above: open it at 115200 baud. Ctrl-C ends it.");
    Ok(uno.run(&stop)?)
}
