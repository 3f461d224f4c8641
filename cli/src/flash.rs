//! `weeder flash`: builds the firmware and has avrdude put it on the Uno.

use anyhow::{Context, Result, bail, ensure};
use clap::Args;
use field::firmware::{self, Image};
use field::hex;
use serialport::{ErrorKind, SerialPortInfo, SerialPortType, UsbPortInfo};
use std::io;
use std::path::{self, Path, PathBuf};
use std::process::Command;
use std::time::Duration;

/// What the user asks of flashing.
#[derive(Args)]
#[command(after_help = "\
Examples:
  weeder flash                         the only Uno at a USB port
  weeder flash --port /dev/ttyACM0     this one
  weeder flash --old-bootloader        a board that does not answer at 115200 baud")]
pub struct Arguments {
    /// The Uno's serial port, such as /dev/ttyACM0 or COM3; found by itself where there is only one Uno.
    #[arg(long)]
    port: Option<String>,
    /// Speak to the bootloader that came before optiboot, at 57600 baud: the one of the Duemilanove, and of many copies of the
    /// Nano.
    #[arg(long)]
    old_bootloader: bool,
    /// Have ravedude do it where that is installed, as Ravedude.toml says, unless the bootloader is the old one.
    #[arg(long)]
    ravedude: bool,
    /// Flash this firmware instead of building the one in this repository.
    #[arg(long, value_name = "FILE.elf")]
    elf: Option<PathBuf>,
}

/// Baud rates of the bootloader, Optiboot's and its predecessor's.
const BAUD: u32 = 115_200;
const OLD_BAUD: u32 = 57_600;

/// Flash that each leaves to the firmware, in bytes: they take the last 512 and the last 2048 of 32 KiB.
const AVAILABLE_BYTES: usize = 32_256;
const OLD_AVAILABLE_BYTES: usize = 30_720;

/// USB vendors and products of the Uno, and of the converters on boards that are built like it.
const UNOS: [(u16, u16); 10] = [
    (0x2341, 0x0001),
    (0x2341, 0x0043),
    (0x2341, 0x0243),
    (0x2A03, 0x0043),
    (0x2A03, 0x0243),
    (0x1A86, 0x7523), // CH340
    (0x1A86, 0x5523), // CH341
    (0x0403, 0x6001), // FT232R
    (0x0403, 0x6015), // FT231X
    (0x10C4, 0xEA60), // CP2102
];

/// Flashes, with avrdude's own messages on the terminal.
///
/// # Errors
/// Where there is no Uno, it cannot be opened, or building or writing fails; each says what to do.
pub fn run(arguments: &Arguments) -> Result<()> {
    let (baud, available) =
        if arguments.old_bootloader { (OLD_BAUD, OLD_AVAILABLE_BYTES) } else { (BAUD, AVAILABLE_BYTES) };
    let port = match &arguments.port {
        Some(port) => port.clone(),
        None => find_uno(&serialport::available_ports().context("the serial ports cannot be listed")?)?,
    };
    try_port(&port, baud)?;
    let elf = match &arguments.elf {
        Some(elf) => elf.clone(),
        None => firmware::build()?,
    };
    let flash = Image::read(&elf)?.flash;
    hex::check_room(flash.len(), available)?;
    if arguments.ravedude && !arguments.old_bootloader && run_ravedude(&elf, &port)? {
        return Ok(());
    }
    let image = elf.with_extension("hex");
    hex::write(&image, &flash)?;
    run_avrdude(&image, &port, baud, arguments.old_bootloader)
}

/// Has ravedude flash an ELF. Returns whether it is installed.
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

/// Has avrdude write an Intel HEX file and verify it.
fn run_avrdude(image: &Path, port: &str, baud: u32, old_bootloader: bool) -> Result<()> {
    println!("Writing {} to the Uno at {port}", image.display());
    let status = Command::new("avrdude")
        // Each page is erased as it is written; a bootloader cannot erase the chip.
        .args(["-c", "arduino", "-p", "atmega328p", "-D", "-b", &baud.to_string(), "-P", port])
        .arg("-U")
        .arg(format!("flash:w:{}:i", image.display()))
        .status()
        .context("avrdude cannot be started: ./setup.sh installs it")?;
    let other = if old_bootloader { "without" } else { "with" };
    ensure!(
        status.success(),
        "avrdude did not succeed: pull D0 and D1 free of other devices, press reset and try again, or try {other} \
         --old-bootloader"
    );
    println!("Done: the Uno runs it. `weeder monitor --port {port}` talks to it.");
    if old_bootloader {
        println!(
            "Behind this bootloader the machine does not come back by itself where its watchdog has had to stop it: the tool \
             has no signal until power is taken away and given back. Optiboot, which Arduino's IDE can burn, has no such fault."
        );
    }
    Ok(())
}

/// The only Uno among the ports.
fn find_uno(ports: &[SerialPortInfo]) -> Result<String> {
    let is_uno = |port: &&SerialPortInfo| match &port.port_type {
        SerialPortType::UsbPort(UsbPortInfo { vid, pid, .. }) => UNOS.contains(&(*vid, *pid)),
        _ => false,
    };
    let unos: Vec<&str> = ports.iter().filter(is_uno).map(|port| port.port_name.as_str()).collect();
    match unos.as_slice() {
        [only] => Ok((*only).to_owned()),
        [] if ports.is_empty() => {
            bail!("there is no Uno at any USB port: plug it in with a cable that carries data, and wait a moment")
        }
        [] => {
            let names: Vec<&str> = ports.iter().map(|port| port.port_name.as_str()).collect();
            bail!(
                "no serial port looks like an Uno: plug it in, or name its port by --port; there is {}",
                names.join(", ")
            )
        }
        several => bail!("there are several Unos: choose one by --port, of {}", several.join(", ")),
    }
}

/// Opens and closes the port, for an error that says more than avrdude's.
fn try_port(port: &str, baud: u32) -> Result<()> {
    let Err(error) = serialport::new(port, baud).timeout(Duration::from_millis(100)).open() else {
        return Ok(());
    };
    match error.kind() {
        ErrorKind::Io(io::ErrorKind::PermissionDenied) => bail!(
            "{port} may not be opened: add yourself to the port's group (on Debian and Ubuntu \
             `sudo usermod -aG dialout $USER`) and log in anew"
        ),
        ErrorKind::Io(io::ErrorKind::ResourceBusy) => bail!("{port} {BUSY}"),
        // The port's library gives the same kind to a port that is not there and one that is claimed.
        ErrorKind::NoDevice if Path::new(port).exists() => bail!("{port} {BUSY}"),
        ErrorKind::NoDevice | ErrorKind::Io(io::ErrorKind::NotFound) => {
            bail!("there is no port {port}: plug the Uno in, or leave --port out to have it found")
        }
        _ => Err(error).with_context(|| format!("{port} cannot be opened as a serial port")),
    }
}

const BUSY: &str = "is in use: close the serial monitor or whatever else has it open";

#[cfg(test)]
mod tests {
    use super::*;
    use field::pty::Pty;

    fn port(name: &str, ids: Option<(u16, u16)>) -> SerialPortInfo {
        SerialPortInfo {
            port_name: name.to_owned(),
            port_type: match ids {
                None => SerialPortType::Unknown,
                Some((vid, pid)) => SerialPortType::UsbPort(UsbPortInfo {
                    vid,
                    pid,
                    serial_number: None,
                    manufacturer: None,
                    product: None,
                }),
            },
        }
    }

    #[test]
    fn the_only_uno_is_found_among_other_ports() {
        let ports = [port("ttyS0", None), port("ttyACM0", Some((0x2341, 0x0043)))];
        assert_eq!(find_uno(&ports).unwrap(), "ttyACM0");
    }

    #[test]
    fn two_unos_have_to_be_told_apart() {
        let ports = [port("ttyACM0", Some((0x2341, 0x0043))), port("ttyUSB0", Some((0x1A86, 0x7523)))];
        let error = find_uno(&ports).unwrap_err().to_string();
        assert!(error.ends_with("choose one by --port, of ttyACM0, ttyUSB0"), "{error}");
    }

    #[test]
    fn no_uno_is_said_with_what_there_is_instead() {
        let error = find_uno(&[port("ttyS0", None)]).unwrap_err().to_string();
        assert!(error.ends_with("there is ttyS0"), "{error}");
        let error = find_uno(&[]).unwrap_err().to_string();
        assert!(error.starts_with("there is no Uno at any USB port: plug it in"), "{error}");
    }

    #[test]
    fn a_port_that_another_program_has_claimed_is_busy() {
        let mut pty = Pty::open().unwrap();
        let port = pty.path().to_string_lossy().into_owned();
        let claim = serialport::new(&port, BAUD).open().unwrap();
        let error = try_port(&port, BAUD).unwrap_err().to_string();
        assert!(error.ends_with("close the serial monitor or whatever else has it open"), "{error}");
        drop(claim);
        assert!(pty.was_opened().unwrap());
        try_port(&port, BAUD).unwrap();
    }

    #[test]
    fn a_file_is_no_serial_port() {
        let file = tempfile::NamedTempFile::new().unwrap();
        let error = try_port(&file.path().to_string_lossy(), BAUD).unwrap_err();
        assert!(error.to_string().ends_with("cannot be opened as a serial port"), "{error:#}");
    }

    #[test]
    fn a_port_that_does_not_exist_is_named() {
        let error = try_port("/dev/no-such-port", BAUD).unwrap_err().to_string();
        assert!(error.contains("/dev/no-such-port"), "{error}");
    }
}
