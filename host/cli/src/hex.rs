//! `weeder hex`: the firmware as an Intel HEX file, which a computer without Rust can put on an Uno.

use crate::destination::FileName;
use crate::output::say;
use anyhow::Result;
use clap::Args;
use std::path::PathBuf;
use trial::firmware;
use uno::elf::Image;
use uno::hex;

/// What the user asks of the file.
#[derive(Args)]
#[command(after_help = "\
Example:
  weeder hex weeder.hex

Any computer with avrdude, which the Arduino IDE brings along, can put the file on an Uno:

  avrdude -c arduino -p atmega328p -D -b 115200 -P /dev/ttyACM0 -U flash:w:weeder.hex:i")]
pub struct Arguments {
    /// The file to write.
    #[arg(value_name = "OUT.hex")]
    out: FileName,
    /// Write this firmware instead of building the one in this repository.
    #[arg(long, value_name = "FILE.elf")]
    elf: Option<PathBuf>,
}

/// Writes it.
///
/// # Errors
/// Where the firmware cannot be built or read, or the file not be written.
pub fn run(arguments: &Arguments) -> Result<()> {
    let out = arguments.out.check()?;
    let elf = match &arguments.elf {
        Some(elf) => elf.clone(),
        None => firmware::build()?,
    };
    let flash = Image::read(&elf)?.flash;
    out.write(|to| to.write_all(hex::text(&flash).as_bytes()))?;
    say!("Written     {}, {} bytes of flash", out.path().display(), flash.len())
}
