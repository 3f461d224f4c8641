//! The serial ports of this computer: finds and opens the Uno's port.
//!
//! A link may also use any other [`Port`](crate::Port). This module is not compiled for a browser, which has no serial
//! port.

use super::error::LinkError;
use serialport::{ErrorKind, SerialPort, SerialPortInfo, SerialPortType, UsbPortInfo};
use std::io::{self, Read};
use std::time::Duration;

/// Bits in a second on the firmware's serial line.
const BAUD: u32 = 115_200;

/// Longest wait of a read for a byte, and of a write for room.
const PATIENCE: Duration = Duration::from_millis(20);

/// USB vendors and products of the Uno, and of the converters on compatible boards.
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

/// The only Uno's port among those of this machine.
///
/// # Errors
/// If there is none, or several.
pub fn find_uno() -> Result<String, LinkError> {
    only_uno(&serialport::available_ports().map_err(LinkError::NoList)?)
}

fn only_uno(ports: &[SerialPortInfo]) -> Result<String, LinkError> {
    let unos: Vec<String> = ports.iter().filter(|port| is_uno(port)).map(|port| port.port_name.clone()).collect();
    match unos.as_slice() {
        [only] => Ok(only.clone()),
        [] => Err(LinkError::NoUno(ports.iter().map(|port| port.port_name.clone()).collect())),
        _ => Err(LinkError::SeveralUnos(unos)),
    }
}

/// Whether the port belongs to an Uno or a compatible board, by its USB vendor and product.
pub(super) fn is_uno(port: &SerialPortInfo) -> bool {
    match &port.port_type {
        SerialPortType::UsbPort(UsbPortInfo { vid, pid, .. }) => UNOS.contains(&(*vid, *pid)),
        _ => false,
    }
}

/// Opens a port by its name and closes it again.
///
/// # Errors
/// If it is absent, in use, forbidden, or no serial port; each says what to do.
pub fn try_port(name: &str) -> Result<(), LinkError> {
    open(name).map(drop)
}

/// Opens a port by its name. Also returns whether this has reset the Uno.
pub(super) fn open(name: &str) -> Result<(Box<dyn SerialPort>, bool), LinkError> {
    let mut port = serialport::new(name, BAUD).timeout(PATIENCE).open().map_err(|error| explain(name, error))?;
    // This modem line resets an Uno. A pseudo terminal has none.
    let resets = port.write_data_terminal_ready(true).is_ok();
    Ok((port, resets))
}

/// Opens the port of an Uno with other firmware than the weeder's, such as the tester's.
///
/// # Errors
/// As [`try_port`].
pub fn open_other(name: &str) -> Result<Box<dyn crate::Port>, LinkError> {
    open(name).map(|(port, _)| Box::new(port) as Box<dyn crate::Port>)
}

/// Opens the port of a device that only sends, such as a satellite receiver, at `baud` bits a second.
///
/// # Errors
/// If it is absent, in use, forbidden, or no serial port.
pub fn listen(name: &str, baud: u32) -> Result<Box<dyn Read + Send>, LinkError> {
    let port = serialport::new(name, baud).timeout(Duration::from_millis(1)).open();
    Ok(Box::new(port.map_err(|error| explain(name, error))?))
}

/// Why a port does not open.
fn explain(name: &str, error: serialport::Error) -> LinkError {
    let name = name.to_owned();
    match error.kind() {
        ErrorKind::Io(io::ErrorKind::PermissionDenied) => LinkError::Forbidden(name),
        ErrorKind::Io(io::ErrorKind::ResourceBusy) => LinkError::Busy(name),
        ErrorKind::Io(io::ErrorKind::NotFound) => LinkError::Absent(name),
        // The port exists but is no device: another program has locked it.
        ErrorKind::NoDevice if std::fs::exists(&name).unwrap_or(false) => LinkError::Busy(name),
        ErrorKind::NoDevice => LinkError::Absent(name),
        _ => LinkError::NotOpened { port: name, source: error },
    }
}

#[cfg(test)]
pub(super) mod tests {
    use super::*;

    /// A board's port, by its USB vendor and product, and its serial number if it has one.
    pub(crate) fn usb(name: &str, (vid, pid): (u16, u16), serial_number: Option<&str>) -> SerialPortInfo {
        let serial_number = serial_number.map(str::to_owned);
        let usb = UsbPortInfo { vid, pid, serial_number, manufacturer: None, product: None };
        SerialPortInfo { port_name: name.to_owned(), port_type: SerialPortType::UsbPort(usb) }
    }

    #[test]
    fn the_only_uno_is_found_among_other_ports_and_none_or_two_are_an_error() {
        let other = SerialPortInfo { port_name: "ttyS0".to_owned(), port_type: SerialPortType::Unknown };
        let (one, two) = (usb("ttyACM0", UNOS[1], None), usb("ttyUSB0", UNOS[5], None));
        assert_eq!(only_uno(&[other.clone(), one.clone()]).unwrap(), "ttyACM0");
        for (ports, words) in [
            (vec![one, two], "choose one by --port, of ttyACM0, ttyUSB0"),
            (vec![other], "(there is ttyS0): plug it in"),
            (vec![], "there is no Uno at any USB port: plug it in"),
        ] {
            let error = only_uno(&ports).unwrap_err().to_string();
            assert!(error.contains(words), "{error}");
        }
    }

    #[test]
    fn an_absent_port_and_a_file_that_is_no_port_have_different_errors() {
        let error = try_port("/dev/no-such-port").unwrap_err().to_string();
        assert!(error.starts_with("there is no port /dev/no-such-port: plug the Uno in"), "{error}");
        let file = tempfile::NamedTempFile::new().unwrap();
        let error = try_port(file.path().to_str().unwrap()).unwrap_err().to_string();
        assert!(error.ends_with("cannot be opened as a serial port"), "{error}");
    }

    #[test]
    fn a_forbidden_port_is_an_error_with_its_group() {
        let denied = serialport::Error::new(ErrorKind::Io(io::ErrorKind::PermissionDenied), "Permission denied");
        let error = explain("/dev/ttyACM0", denied).to_string();
        assert!(error.contains("`sudo usermod -aG dialout $USER`) and log in again"), "{error}");
    }
}
