//! `weeder flash`: builds the firmware, proves its bounds, and flashes it with avrdude.

use crate::bounds::Firmware;
use crate::output::say;
use crate::ports::Port;
use anyhow::{Context, Result, ensure};
use clap::Args;
use std::collections::HashSet;
use std::io::{self, Read, Write};
use std::path::{self, Path};
use std::process::{Command, Stdio};
use trial::firmware;
use uno::elf::Image;
use uno::hex;

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
    /// Use ravedude (Ravedude.toml) if it is installed and the bootloader is not the old one.
    #[arg(long)]
    ravedude: bool,
    #[command(flatten)]
    firmware: Firmware,
}

/// Baud rates of the bootloader, Optiboot's and its predecessor's.
const BAUD: u32 = 115_200;
const OLD_BAUD: u32 = 57_600;

/// Flash for the firmware, in bytes, with each bootloader: they take the last 512 and the last 2048 of 32 KiB.
const AVAILABLE_BYTES: usize = 32_256;
pub const OLD_AVAILABLE_BYTES: usize = 30_720;

/// Flashes, with each of avrdude's own messages once on the terminal.
///
/// # Errors
/// If there is no Uno, it cannot be opened, or building, proving or writing fails; each says what to do.
pub fn run(arguments: &Arguments) -> Result<()> {
    let (baud, available) =
        if arguments.old_bootloader { (OLD_BAUD, OLD_AVAILABLE_BYTES) } else { (BAUD, AVAILABLE_BYTES) };
    let port = arguments.port.board()?.port()?;
    // This check comes before the build, and its error says more than avrdude's.
    link::try_port(&port)?;
    let elf = arguments.firmware.elf()?;
    let flash = Image::read(&elf)?.flash;
    hex::check_room(flash.len(), available)?;
    arguments.firmware.check(&elf)?;
    if arguments.ravedude && !arguments.old_bootloader && run_ravedude(&elf, &port)? {
        return Ok(());
    }
    say!("Writing {} to the Uno at {port}", elf.display())?;
    // Files beside the ELF belong to the user.
    let folder = tempfile::tempdir().context("there is no room for a temporary file")?;
    let image = folder.path().join("weeder.hex");
    std::fs::write(&image, hex::text(&flash)).context("there is no room for a temporary file")?;
    run_avrdude(&image, &port, baud, arguments.old_bootloader)
}

/// Flashes an ELF with ravedude. Returns whether it is installed.
fn run_ravedude(elf: &Path, port: &str) -> Result<bool> {
    let elf = path::absolute(elf).with_context(|| format!("{} has no absolute path", elf.display()))?;
    // Its settings lie in the workspace.
    let mut command = Command::new("ravedude");
    command.arg(elf).env("RAVEDUDE_PORT", port).current_dir(firmware::workspace_root());
    match command.status() {
        Ok(status) => {
            ensure!(status.success(), "ravedude did not succeed: `weeder flash` does without it");
            Ok(true)
        }
        Err(error) if error.kind() == io::ErrorKind::NotFound => Ok(false),
        Err(error) => Err(error).context("ravedude cannot be started"),
    }
}

/// Writes and verifies an Intel HEX file with avrdude.
fn run_avrdude(image: &Path, port: &str, baud: u32, old_bootloader: bool) -> Result<()> {
    let mut avrdude = Command::new("avrdude")
        // Each page is erased before it is written: a bootloader cannot erase the chip.
        .args(["-c", "arduino", "-p", "atmega328p", "-D", "-b", &baud.to_string(), "-P", port])
        .arg("-U")
        .arg(format!("flash:w:{}:i", image.display()))
        .stderr(Stdio::piped())
        .spawn()
        .context("avrdude cannot be started: ./setup.sh installs it")?;
    if let Some(words) = avrdude.stderr.take() {
        Messages::new(io::stderr()).pass(words);
    }
    let status = avrdude.wait().context("avrdude cannot be waited for")?;
    let other = if old_bootloader { "without" } else { "with" };
    ensure!(
        status.success(),
        "avrdude did not succeed: pull D0 and D1 free of other devices, press reset and try again, or try {other} \
         --old-bootloader"
    );
    say!("Done: the Uno runs it. `weeder monitor --port {port}` talks to it.")?;
    if old_bootloader {
        say!(
            "With this bootloader the machine does not restart after a stop by its watchdog: the tool has no signal until you switch the power off and on. Optiboot, which Arduino's IDE can burn, has no such fault."
        )?;
    }
    Ok(())
}

/// Passes on avrdude's messages, each once over all tries, and its progress at once.
struct Messages<W> {
    to: W,
    line: Vec<u8>,
    /// How much of the line was passed on.
    passed: usize,
    /// The messages that were passed on, without their numbers.
    said: HashSet<Vec<u8>>,
}

/// How avrdude's messages begin.
const MESSAGE: &[u8] = b"avrdude";

impl<W: Write> Messages<W> {
    fn new(to: W) -> Self {
        Self { to, line: Vec::new(), passed: 0, said: HashSet::new() }
    }

    /// Passes on the input until it ends.
    fn pass(&mut self, mut from: impl Read) {
        let mut buffer = [0; 256];
        while let Ok(count @ 1..) = from.read(&mut buffer) {
            buffer[..count].iter().for_each(|&byte| self.take(byte));
            // The output is closed, so no message can be shown. avrdude goes on.
            let _ = self.to.flush();
        }
        self.end_line();
    }

    fn take(&mut self, byte: u8) {
        self.line.push(byte);
        if matches!(byte, b'\n' | b'\r') {
            self.end_line();
        } else if !self.may_be_message() {
            self.pass_line();
        }
    }

    /// Whether the line so far may be a message.
    fn may_be_message(&self) -> bool {
        self.line.starts_with(MESSAGE) || MESSAGE.starts_with(&self.line)
    }

    fn end_line(&mut self) {
        let words = self.line.iter().filter(|byte| !byte.is_ascii_hexdigit()).copied().collect();
        if !self.line.starts_with(MESSAGE) || self.said.insert(words) {
            self.pass_line();
        }
        self.line.clear();
        self.passed = 0;
    }

    fn pass_line(&mut self) {
        // As above.
        let _ = self.to.write_all(&self.line[self.passed..]);
        self.passed = self.line.len();
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn a_repeated_message_is_printed_once_and_progress_at_once() {
        let mut words = String::from("avrdude: ser_open(): no modem lines\n\n");
        for attempt in 1..=10 {
            words += &format!("avrdude: stk500_getsync() attempt {attempt} of 10: not in sync: resp=0x{attempt:02x}\n");
        }
        words += "Writing | #### | 10%\rWriting | ######## | 20%\navrdude done.  Thank you.";
        let mut said = Vec::new();
        Messages::new(&mut said).pass(words.as_bytes());
        let said = String::from_utf8(said).unwrap();
        assert_eq!(said.matches("not in sync").count(), 1, "{said}");
        assert!(said.starts_with("avrdude: ser_open(): no modem lines\n\navrdude: stk500_getsync() attempt 1 of 10"));
        assert!(said.ends_with("Writing | #### | 10%\rWriting | ######## | 20%\navrdude done.  Thank you."), "{said}");
    }
}
