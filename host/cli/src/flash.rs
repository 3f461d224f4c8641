//! `weeder flash`: builds the firmware, proves its bounds, and flashes it with avrdude.

use crate::bounds::Firmware;
use crate::output::say;
use crate::ports::Port;
use anyhow::{Context, Result, ensure};
use clap::Args;
use std::collections::HashSet;
use std::io::{self, BufRead, BufReader, Write};
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
        pass_on(BufReader::new(words), io::stderr());
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

/// How avrdude's messages begin.
const MESSAGE: &[u8] = b"avrdude";

/// Passes on avrdude's messages, each once over all tries, and its progress at once, until the input ends.
fn pass_on(from: impl BufRead, mut to: impl Write) {
    // The messages that were passed on, without their numbers.
    let mut said = HashSet::new();
    let (mut line, mut passed) = (Vec::new(), 0);
    for byte in from.bytes().map_while(Result::ok).map(Some).chain([None]) {
        line.extend(byte);
        let ends = matches!(byte, None | Some(b'\n' | b'\r'));
        let is_shown = match line.starts_with(MESSAGE) {
            true => {
                ends && said.insert(line.iter().filter(|byte| !byte.is_ascii_hexdigit()).copied().collect::<Vec<_>>())
            }
            // It may become a message.
            false => ends || !MESSAGE.starts_with(&line),
        };
        if is_shown {
            // If the output is closed, no message can be shown. avrdude goes on.
            let _ = to.write_all(&line[passed..]).and_then(|()| to.flush());
            passed = line.len();
        }
        if ends {
            line.clear();
            passed = 0;
        }
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
        pass_on(words.as_bytes(), &mut said);
        let said = String::from_utf8(said).unwrap();
        assert_eq!(said.matches("not in sync").count(), 1, "{said}");
        assert!(said.starts_with("avrdude: ser_open(): no modem lines\n\navrdude: stk500_getsync() attempt 1 of 10"));
        assert!(said.ends_with("Writing | #### | 10%\rWriting | ######## | 20%\navrdude done.  Thank you."), "{said}");
    }
}
