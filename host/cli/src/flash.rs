//! `weeder flash`: builds the firmware, proves its bounds, and flashes it with avrdude.

mod avrdude;
mod bootloader;

use self::bootloader::{ATMEGA328P, Heard, Signature, heard};
use crate::bounds::Firmware;
use crate::ports::Port;
use anyhow::{Result, ensure};
use clap::Args;
use frame::Results;
use link::Claim;
use link::row_names::Board;
use uno::bootloader::check_room;
use uno::elf::Image;

#[derive(Args)]
#[command(after_help = "\
Examples:
  weeder flash                         the only Uno at a USB port
  weeder flash --port /dev/ttyACM0     this one
  weeder flash --port left             the row with this name, see `weeder rows`
  weeder flash --old-bootloader        a board that does not answer at 115200 baud")]
pub struct Arguments {
    #[command(flatten)]
    port: Port,
    /// Use the bootloader before optiboot, at 57600 baud: the Duemilanove's, and that of many Nano copies.
    #[arg(long)]
    old_bootloader: bool,
    #[command(flatten)]
    firmware: Firmware,
}

/// A bootloader: its rate in bits a second, and the flash that it leaves. It takes the last 512 or 2048 bytes of 32 KiB.
#[derive(Clone, Copy)]
pub struct Bootloader {
    baud: u32,
    pub available: usize,
    /// What the user adds to the command for it.
    option: &'static str,
}

const OPTIBOOT: Bootloader = Bootloader { baud: 115_200, available: 32_256, option: "without --old-bootloader" };
pub const OLD: Bootloader = Bootloader { baud: 57_600, available: 30_720, option: "with --old-bootloader" };

/// Flashes, with each of avrdude's own messages once on the terminal.
pub fn run(arguments: &Arguments) -> Result<()> {
    let (bootloader, other) = if arguments.old_bootloader { (OLD, OPTIBOOT) } else { (OPTIBOOT, OLD) };
    let board = arguments.port.board()?;
    let port = board.port()?;
    // These checks come before the build, and their errors say more than avrdude's.
    link::try_port(&port)?;
    let claim = link::claim(&port)?;
    let converter = link::converter_at(&port);
    if let (Board::Only { .. }, Some(converter)) = (&board, converter) {
        let heard = [bootloader, other].map(|bootloader| heard(&claim, &port, bootloader.baud));
        ensure!(
            heard.iter().any(|heard| matches!(heard, Ok(Heard::Bootloader(_)))),
            "the only candidate is {port}, a {converter} converter, and no bootloader answers there: if it is the Uno's \
             and not another device's, name it: --port {port}"
        );
    }
    let elf = arguments.firmware.elf()?;
    let flash = Image::read(&elf)?.flash;
    check_room(flash.len(), room(bootloader, converter))?;
    arguments.firmware.check(&elf)?;
    writeln!(Results, "Writing {} to the Uno at {port}", elf.display())?;
    writeln!(
        Results,
        "The servo has no signal for {} s, and the tool may fall: keep clear of it.",
        seconds(flash.len(), bootloader.baud)
    )?;
    if arguments.old_bootloader {
        writeln!(
            Results,
            "This bootloader does not start the machine again after a stop by its watchdog. The tool then has no signal \
             until you switch the power off and on. Before work in a field, burn optiboot with the Arduino IDE."
        )?;
    }
    let (succeeded, signature) = avrdude::write(&flash, &port, bootloader.baud)?;
    ensure!(succeeded, "avrdude did not succeed: {}", why(&claim, &port, bootloader, other, signature));
    writeln!(Results, "Done: the Uno runs it. `weeder monitor --port {}` talks to it.", shlex::try_quote(&port)?)
}

/// Bytes of flash for the firmware on a board with this converter. A Nano with optiboot reserves 2048 bytes as for the
/// old bootloader (boards.txt of Arduino's AVR core): after a reset it runs from 0x7800 on. Its USB number does not tell
/// it from an Uno's copy.
fn room(bootloader: Bootloader, converter: Option<&str>) -> usize {
    if converter.is_some() { OLD.available } else { bootloader.available }
}

/// Seconds from the reset to the start: the bytes go both ways, a page takes 5 ms to write, the bootloader waits.
fn seconds(bytes: usize, baud: u32) -> u32 {
    let bytes = bytes as f64;
    (2.0 + 2.0 * bytes * 10.0 / f64::from(baud) + bytes / 128.0 * 0.005).ceil() as u32
}

/// Why avrdude did not succeed, and what to do.
fn why(claim: &Claim, port: &str, bootloader: Bootloader, other: Bootloader, named: Option<Signature>) -> String {
    if let Some(signature) = named.filter(|&signature| signature != ATMEGA328P) {
        return other_chip(signature);
    }
    let mut device = None;
    for answers in [bootloader, other] {
        match heard(claim, port, answers.baud) {
            Err(error) => return error.to_string(),
            Ok(Heard::Bootloader(signature)) if signature != ATMEGA328P => return other_chip(signature),
            Ok(Heard::Bootloader(_)) if answers.baud == bootloader.baud => {
                return "the bootloader answers, so avrdude's own message above says why. If avrdude cannot open a \
                        file: on Windows, avrdude.conf belongs beside avrdude.exe. Otherwise flash it again: half a \
                        firmware does not run. If it fails again, pull D0 and D1 free of other devices, and take \
                        another cable"
                    .to_owned();
            }
            Ok(Heard::Bootloader(_)) => {
                return format!("its bootloader answers at {} baud: flash it {}", answers.baud, answers.option);
            }
            Ok(Heard::Text(text)) => device = device.or(Some(text)),
            Ok(Heard::Nothing) => {}
        }
    }
    match device {
        Some(text) if text.contains("weeder ") => {
            "the weeder's firmware answers, and no bootloader: press the board's \
             reset when the command begins to write. A board without a bootloader needs a programmer"
                .to_owned()
        }
        Some(text) => format!("another device sends {text:?}: name the Uno's port by --port"),
        None => format!(
            "no bootloader answers at {} or {} baud: pull D0 and D1 free of other devices, press the board's reset when \
             the command begins to write, and see that {port} is the Uno's",
            OPTIBOOT.baud, OLD.baud
        ),
    }
}

fn other_chip(signature: Signature) -> String {
    format!(
        "the board has another chip, {}: nothing was written. The firmware is for the Uno's ATmega328P",
        bootloader::chip(signature)
    )
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn the_time_without_a_signal_counts_both_ways_at_either_rate() {
        // 29,400 bytes both ways take 5.1 s at 115200 baud and 10.2 at 57600, and 230 pages 1.2 s.
        assert_eq!([OPTIBOOT, OLD].map(|bootloader| seconds(29_400, bootloader.baud)), [9, 14]);
    }

    #[test]
    fn a_board_that_may_be_a_nano_has_2_kib_less_than_the_chip() {
        assert_eq!([None, Some("CH340")].map(|converter| room(OPTIBOOT, converter)), [32_256, 30_720]);
        assert_eq!([None, Some("FT232R")].map(|converter| room(OLD, converter)), [30_720; 2]);
    }
}
