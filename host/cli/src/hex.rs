//! `weeder hex`: the firmware as an Intel HEX file, for flashing from a computer without Rust. The page and the release
//! use this command, so they contain a proved firmware.

use crate::bounds::Firmware;
use anyhow::Result;
use clap::Args;
use frame::{OutName, Replace, Results};
use uno::elf::Image;
use uno::hex;

#[derive(Args)]
#[command(after_help = "\
Example:
  weeder hex weeder.hex

avrdude flashes the file. The Arduino IDE contains it. An older bootloader needs -b 57600.
A board with a CH340 is at /dev/ttyUSB0. If interrupted, half a firmware may run: flash again.

  avrdude -c arduino -p atmega328p -D -b 115200 -P /dev/ttyACM0 -U flash:w:weeder.hex:i")]
pub struct Arguments {
    /// The file to write.
    #[arg(value_name = "OUT.hex")]
    out: OutName,
    #[command(flatten)]
    replace: Replace,
    #[command(flatten)]
    firmware: Firmware,
}

pub fn run(arguments: &Arguments) -> Result<()> {
    let out = arguments.out.file(arguments.replace)?;
    let elf = arguments.firmware.elf()?;
    let flash = Image::read(&elf)?.flash;
    arguments.firmware.check(&elf)?;
    out.write(|to| Ok(to.write_all(hex::text(&flash).as_bytes())?))?;
    writeln!(Results, "Written     {}, {} bytes of flash", out.path().display(), flash.len())
}
