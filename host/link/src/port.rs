//! The serial ports of this computer: finds and opens the Uno's port.
//!
//! A link may also use any other [`Port`](crate::Port). This module is not compiled for a browser, which has no serial
//! port.

use super::error::LinkError;
use nusb::MaybeFuture;
use serialport::{ErrorKind, SerialPort, SerialPortInfo, SerialPortType, UsbPortInfo};
use std::collections::HashSet;
use std::fs::{File, OpenOptions, TryLockError};
use std::io::{self, Read};
use std::path::{Path, PathBuf};
use std::time::Duration;

/// Bits in a second on the firmware's serial line.
const BAUD: u32 = 115_200;

/// Longest wait of a read for a byte, and of a write for room.
const PATIENCE: Duration = Duration::from_millis(20);

/// The name of the Uno, and the USB vendors and products of Uno and Uno Mini (boards.txt of Arduino's AVR core).
const UNO: &str = "Uno";
const UNOS: [(u16, u16); 7] = [
    (0x2341, 0x0001),
    (0x2341, 0x0043),
    (0x2341, 0x0062),
    (0x2341, 0x006A),
    (0x2341, 0x0243),
    (0x2A03, 0x0043),
    (0x2A03, 0x0243),
];

/// Those of the converters on compatible boards, and their names. Other devices have them too, such as satellite receivers.
const CONVERTERS: [((u16, u16), &str); 15] = [
    ((0x1A86, 0x7523), "CH340"),
    ((0x1A86, 0x7522), "CH340K"),
    ((0x1A86, 0x5523), "CH341"),
    ((0x1A86, 0x55D3), "CH343"),
    ((0x1A86, 0x55D4), "CH9102"),
    ((0x0403, 0x6001), "FT232R"),
    ((0x0403, 0x6015), "FT231X"),
    ((0x10C4, 0xEA60), "CP2102"),
    ((0x067B, 0x2303), "PL2303"),
    ((0x067B, 0x23A3), "PL2303GC"),
    ((0x067B, 0x23B3), "PL2303GB"),
    ((0x067B, 0x23C3), "PL2303GT"),
    ((0x067B, 0x23D3), "PL2303GL"),
    ((0x067B, 0x23E3), "PL2303GE"),
    ((0x067B, 0x23F3), "PL2303GS"),
];

/// How a Mac names the two ports of a device: for a program that calls out, and for one that waits for a call.
const CALLS_OUT: &str = "/dev/cu.";
const IS_CALLED: &str = "/dev/tty.";

/// All ports of this computer, each once.
///
/// # Errors
/// If the system has no list of its ports.
pub(super) fn listed() -> Result<Vec<SerialPortInfo>, LinkError> {
    serialport::available_ports().map(merged).map_err(LinkError::NoList)
}

/// Leaves out the second port of each device on a Mac.
fn merged(mut ports: Vec<SerialPortInfo>) -> Vec<SerialPortInfo> {
    let names: HashSet<String> = ports.iter().map(|port| port.port_name.clone()).collect();
    ports.retain(|port| {
        let first = calling_out(&port.port_name);
        first == port.port_name || !names.contains(&first)
    });
    ports
}

/// A Mac's port for a program that calls out, if this is the other port of a device.
pub(super) fn calling_out(port: &str) -> String {
    port.strip_prefix(IS_CALLED).map_or_else(|| port.to_owned(), |device| format!("{CALLS_OUT}{device}"))
}

/// Whether two names lead to the same port.
#[must_use]
pub fn is_same(one: &str, other: &str) -> bool {
    is_name_of(&calling_out(&resolved(one)), &calling_out(&resolved(other)), IGNORES_CASE)
}

/// Whether a name is the port's own, and not a link to it.
pub(super) fn is_own_name(name: &str, port: &SerialPortInfo) -> bool {
    is_name_of(&calling_out(name), &port.port_name, IGNORES_CASE)
}

/// Windows opens COM3 as com3 too.
const IGNORES_CASE: bool = cfg!(windows);

fn is_name_of(one: &str, other: &str, ignores_case: bool) -> bool {
    one == other || ignores_case && one.eq_ignore_ascii_case(other)
}

/// The path of a port that a link may lead to. On Windows no link leads to a port, and the search would open it.
fn resolved(port: &str) -> String {
    if cfg!(windows) {
        return port.to_owned();
    }
    std::fs::canonicalize(port).map_or_else(|_| port.to_owned(), |path| path.display().to_string())
}

/// The only Uno's port among those of this machine. A device at the port `beside` is none.
///
/// # Errors
/// If there is none, or several.
pub fn find_uno(beside: Option<&str>) -> Result<String, LinkError> {
    only_uno(&listed()?, beside, on_the_bus)
}

/// True Unos come before boards with a converter, because other devices have such converters too.
fn only_uno(
    ports: &[SerialPortInfo],
    beside: Option<&str>,
    on_the_bus: impl FnOnce() -> Vec<(u16, u16)>,
) -> Result<String, LinkError> {
    let free = || ports.iter().filter(|port| beside.is_none_or(|beside| !is_same(&port.port_name, beside)));
    let unos: Vec<&SerialPortInfo> = free().filter(|port| name_at(port) == Some(UNO)).collect();
    let found = if unos.is_empty() { free().filter(|port| name_at(port).is_some()).collect() } else { unos };
    match found.as_slice() {
        [only] => Ok(only.port_name.clone()),
        [] => Err(LinkError::NoUno {
            ports: free().map(|port| port.port_name.clone()).collect(),
            without_port: without_port(&on_the_bus(), ports),
        }),
        several => {
            let named = |port: &&SerialPortInfo| format!("{} ({})", port.port_name, name_at(port).unwrap_or_default());
            Err(LinkError::SeveralUnos(several.iter().map(named).collect()))
        }
    }
}

fn number(port: &SerialPortInfo) -> Option<(u16, u16)> {
    match &port.port_type {
        SerialPortType::UsbPort(UsbPortInfo { vid, pid, .. }) => Some((*vid, *pid)),
        _ => None,
    }
}

fn name(number: (u16, u16)) -> Option<&'static str> {
    let converter = || CONVERTERS.iter().find(|(known, _)| *known == number).map(|(_, name)| *name);
    if UNOS.contains(&number) { Some(UNO) } else { converter() }
}

/// The name of the Uno or the converter at a port. `None` if another device is there.
pub(super) fn name_at(port: &SerialPortInfo) -> Option<&'static str> {
    number(port).and_then(name)
}

/// The converter at a port, if it is one that devices other than an Uno have too.
#[must_use]
pub fn converter_at(port: &str) -> Option<&'static str> {
    let ports = listed().ok()?;
    let port = ports.iter().find(|listed| is_same(&listed.port_name, port))?;
    name_at(port).filter(|name| *name != UNO)
}

fn on_the_bus() -> Vec<(u16, u16)> {
    // Without the list, the message does not name devices without a port.
    let devices = nusb::list_devices().wait().into_iter().flatten();
    devices.map(|device| (device.vendor_id(), device.product_id())).collect()
}

/// Names of known devices on the USB bus for which the system has made no port.
fn without_port(on_the_bus: &[(u16, u16)], ports: &[SerialPortInfo]) -> Vec<&'static str> {
    let mut with_port: Vec<(u16, u16)> = ports.iter().filter_map(number).collect();
    let has_none = |number: &&(u16, u16)| {
        let place = with_port.iter().position(|with| with == *number);
        place.map(|place| with_port.swap_remove(place)).is_none()
    };
    on_the_bus.iter().filter(has_none).filter_map(|number| name(*number)).collect()
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
    // avrdude does not keep other programs off the port, and a reset would end its work.
    if let Ok(lock) = open_lock(&lock_of(name), File::options().read(true))
        && matches!(lock.try_lock_shared(), Err(TryLockError::WouldBlock))
    {
        return Err(LinkError::Flashed(name.to_owned()));
    }
    open_at(name, BAUD)
}

/// Opens a port at this rate, also while it is claimed.
fn open_at(name: &str, baud: u32) -> Result<(Box<dyn SerialPort>, bool), LinkError> {
    let mut port =
        serialport::new(name, baud).timeout(PATIENCE).open().map_err(|error| explain(name, error, listed))?;
    // This modem line resets an Uno. A pseudo terminal has none.
    let resets = port.write_data_terminal_ready(true).is_ok();
    Ok((port, resets))
}

/// A port that other programs of this project leave alone, until it is dropped.
#[derive(Debug)]
pub struct Claim {
    _lock: File,
}

/// Claims a port for a program that writes to its Uno's flash.
///
/// # Errors
/// If another program has claimed it.
pub fn claim(name: &str) -> Result<Claim, LinkError> {
    let path = lock_of(name);
    // Another user's file can be locked, but not written. Windows locks no file that is only appended to.
    let lock = open_lock(&path, File::options().read(true).create(true).append(true))
        .or_else(|error| open_lock(&path, File::options().read(true)).map_err(|_| error));
    let not_locked = |source| LinkError::NotClaimed { path: path.clone(), source };
    let lock = lock.map_err(not_locked)?;
    // Other users lock it too, so the mode does not follow the umask. Setting it fails if the file is another user's.
    #[cfg(unix)]
    let _ = lock.set_permissions(std::os::unix::fs::PermissionsExt::from_mode(0o644));
    match lock.try_lock() {
        Ok(()) => Ok(Claim { _lock: lock }),
        Err(TryLockError::WouldBlock) => Err(LinkError::Flashed(name.to_owned())),
        Err(TryLockError::Error(source)) => Err(not_locked(source)),
    }
}

/// The file that is locked while a port is claimed. It stays, because another program may be about to lock it. On Unix,
/// `TMPDIR` would give each user another one: the folder is the same for all.
fn lock_of(name: &str) -> PathBuf {
    let port = resolved(name).replace(|part: char| !part.is_ascii_alphanumeric(), "-");
    let folder = if cfg!(unix) { PathBuf::from("/tmp") } else { std::env::temp_dir() };
    folder.join(format!("weeder{port}.lock"))
}

/// Opens such a file. Fails if it is no regular file. Any user may put a link there, or a pipe, at which a program would
/// wait for a writer.
fn open_lock(path: &Path, options: &mut OpenOptions) -> io::Result<File> {
    #[cfg(unix)]
    std::os::unix::fs::OpenOptionsExt::custom_flags(options, libc::O_NOFOLLOW | libc::O_NONBLOCK);
    let lock = options.open(path)?;
    if lock.metadata()?.is_file() { Ok(lock) } else { Err(io::Error::other("it is no regular file: remove it")) }
}

/// Opens a claimed port at `baud` bits a second and resets the Uno.
///
/// # Errors
/// As [`try_port`].
pub fn open_to_flash(_: &Claim, name: &str, baud: u32) -> Result<Box<dyn crate::Port>, LinkError> {
    let (mut port, resets) = open_at(name, baud)?;
    if resets {
        // Opening a port whose line was high is no reset.
        let _ = port.write_data_terminal_ready(false);
        std::thread::sleep(Duration::from_millis(100));
        let _ = port.write_data_terminal_ready(true);
    }
    Ok(Box::new(port))
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
    Ok(Box::new(port.map_err(|error| explain(name, error, listed))?))
}

fn explain(
    name: &str,
    error: serialport::Error,
    listed: impl FnOnce() -> Result<Vec<SerialPortInfo>, LinkError>,
) -> LinkError {
    let name = name.to_owned();
    // The list also has ports in use. It comes first: on Windows, a look for the file would open the port.
    let exists = || {
        listed().is_ok_and(|ports| ports.iter().any(|port| is_same(&port.port_name, &name)))
            || std::fs::exists(&name).unwrap_or(false)
    };
    match error.kind() {
        ErrorKind::Io(io::ErrorKind::PermissionDenied) => LinkError::Forbidden(name),
        ErrorKind::Io(io::ErrorKind::ResourceBusy) => LinkError::Busy(name),
        ErrorKind::Io(io::ErrorKind::NotFound) => LinkError::Absent(name),
        // The port exists but is no device: another program has locked it.
        ErrorKind::NoDevice if exists() => LinkError::Busy(name),
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

    const NANO: (u16, u16) = CONVERTERS[0].0;
    const RECEIVER: (u16, u16) = (0x10C4, 0xEA60);

    /// The only Uno beside a receiver's port, on a computer without other USB devices.
    fn only(ports: &[SerialPortInfo], beside: Option<&str>) -> Result<String, String> {
        let on_the_bus = || ports.iter().filter_map(number).collect();
        only_uno(ports, beside, on_the_bus).map_err(|error| error.to_string())
    }

    #[test]
    fn the_only_uno_is_found_among_other_ports_and_none_or_two_are_an_error() {
        let other = SerialPortInfo { port_name: "ttyS0".to_owned(), port_type: SerialPortType::Unknown };
        let (one, two) = (usb("ttyACM0", UNOS[1], None), usb("ttyACM1", UNOS[3], None));
        let (nano, receiver) = (usb("ttyUSB0", NANO, None), usb("ttyUSB1", RECEIVER, None));
        // Another Uno of boards.txt, and the Uno Mini.
        let newer = [(0x2341, 0x006A), (0x2341, 0x0062)].map(|number| usb("ttyACM0", number, None));
        for uno in [&one, &newer[0], &newer[1]] {
            for ports in [vec![other.clone(), uno.clone()], vec![nano.clone(), uno.clone(), receiver.clone()]] {
                assert_eq!(only(&ports, None).unwrap(), "ttyACM0");
            }
        }
        assert_eq!(only(&[nano.clone(), receiver.clone()], Some("ttyUSB1")).unwrap(), "ttyUSB0");
        for (ports, beside, words) in [
            (vec![one, two], None, "choose one by --port, of ttyACM0 (Uno), ttyACM1 (Uno)"),
            (vec![nano, receiver.clone()], None, "of ttyUSB0 (CH340), ttyUSB1 (CP2102)"),
            (vec![receiver], Some("ttyUSB1"), "there is no Uno at any USB port: plug it in"),
            (vec![other], None, "(there is ttyS0): plug it in"),
            (vec![], None, "there is no Uno at any USB port: plug it in"),
        ] {
            let error = only(&ports, beside).unwrap_err();
            assert!(error.contains(words), "{error}");
        }
    }

    #[cfg(unix)]
    #[test]
    fn a_receiver_that_a_link_names_is_no_uno() {
        let folder = tempfile::tempdir().unwrap();
        let [port, link] = ["ttyUSB0", "gps"].map(|name| folder.path().join(name).display().to_string());
        std::fs::write(&port, "").unwrap();
        std::os::unix::fs::symlink(&port, &link).unwrap();
        let ports = [usb(&port, RECEIVER, None), usb("ttyUSB1", NANO, None)];
        assert_eq!(only(&ports, Some(&link)).unwrap(), "ttyUSB1");
    }

    #[test]
    fn a_board_with_two_ports_on_a_mac_is_one_board() {
        let board = |name: &str| usb(name, UNOS[1], Some("A1"));
        let names =
            ["/dev/cu.usbmodem1", "/dev/tty.usbmodem1", "/dev/tty.odd", "/dev/cu.usbmodem2", "/dev/tty.usbmodem2"];
        let listed: Vec<String> = merged(names.map(board).into()).into_iter().map(|port| port.port_name).collect();
        assert_eq!(listed, ["/dev/cu.usbmodem1", "/dev/tty.odd", "/dev/cu.usbmodem2"]);
        assert_eq!(only(&merged(names[..2].iter().map(|name| board(name)).collect()), None).unwrap(), names[0]);
        assert!(is_same(names[0], names[1]) && !is_same(names[0], names[3]));
    }

    #[test]
    fn a_known_device_on_the_bus_without_a_port_is_named() {
        let receiver = [usb("ttyUSB1", RECEIVER, None)];
        let bus = || vec![(0x1D6B, 0x0002), NANO, RECEIVER];
        let error = only_uno(&receiver, Some("ttyUSB1"), bus).unwrap_err().to_string();
        assert!(error.contains("CH340 is on the USB bus and has no port") && !error.contains("CP2102"), "{error}");
        let twice = without_port(&[RECEIVER, RECEIVER, UNOS[0]], &receiver);
        assert_eq!(twice, ["CP2102", "Uno"]);
    }

    #[test]
    fn a_claimed_port_is_left_alone_until_the_claim_ends() {
        let folder = tempfile::tempdir().unwrap();
        let port = folder.path().join("port");
        std::fs::write(&port, "").unwrap();
        let port = port.to_str().unwrap();
        let claimed = claim(port).unwrap();
        assert_eq!((&claimed._lock).read(&mut [0]).unwrap(), 0, "Windows locks no file that is only appended to");
        for error in [claim(port).unwrap_err(), try_port(port).unwrap_err()] {
            assert!(error.to_string().contains("is being flashed"), "{error}");
        }
        drop(claimed);
        drop(claim(port).unwrap());
        #[cfg(unix)]
        {
            use std::os::unix::fs::PermissionsExt;
            std::fs::set_permissions(lock_of(port), PermissionsExt::from_mode(0o600)).unwrap();
            drop(claim(port).unwrap());
            let mode = std::fs::metadata(lock_of(port)).unwrap().permissions().mode();
            assert_eq!(mode & 0o777, 0o644, "another user can lock it");
        }
        std::fs::remove_file(lock_of(port)).unwrap();
    }

    #[cfg(unix)]
    #[test]
    fn a_pipe_or_link_in_place_of_the_lock_is_refused() {
        use std::os::unix::fs::PermissionsExt;
        let folder = tempfile::tempdir().unwrap();
        let [port, private] = ["port", "private"].map(|name| folder.path().join(name));
        for path in [&port, &private] {
            std::fs::write(path, "").unwrap();
            std::fs::set_permissions(path, PermissionsExt::from_mode(0o600)).unwrap();
        }
        let port = port.to_str().unwrap();
        let lock = lock_of(port);
        assert_eq!(lock.parent(), Some(Path::new("/tmp")), "it is the same for all users");
        let is_not_claimed = || matches!(claim(port), Err(LinkError::NotClaimed { .. }));

        assert!(std::process::Command::new("mkfifo").arg(&lock).status().unwrap().success());
        // With a wait for a writer, these would never return.
        let tried = try_port(port).unwrap_err().to_string();
        let pipe_is_refused = is_not_claimed();
        std::fs::remove_file(&lock).unwrap();

        std::os::unix::fs::symlink(&private, &lock).unwrap();
        let link_is_refused = is_not_claimed();
        std::fs::remove_file(&lock).unwrap();
        assert!(pipe_is_refused && link_is_refused && tried.ends_with("cannot be opened as a serial port"), "{tried}");
        assert_eq!(std::fs::metadata(&private).unwrap().permissions().mode() & 0o777, 0o600);
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
    fn a_port_that_only_the_list_has_is_in_use_and_another_one_is_absent() {
        // As Windows says of both.
        let error = || serialport::Error::new(ErrorKind::NoDevice, "Access is denied.");
        let ports = || Ok(vec![usb("COM3", UNOS[1], None)]);
        assert!(matches!(explain("COM3", error(), ports), LinkError::Busy(port) if port == "COM3"));
        assert!(matches!(explain("COM4", error(), ports), LinkError::Absent(port) if port == "COM4"));
    }

    #[test]
    fn case_makes_another_port_except_on_windows() {
        assert!(is_name_of("com3", "COM3", true) && !is_name_of("com3", "COM30", true));
        assert!(!is_name_of("/dev/ttyacm0", "/dev/ttyACM0", false));
        assert_eq!(is_same("com3", "COM3"), cfg!(windows));
    }

    #[test]
    fn a_forbidden_port_is_an_error_with_its_group() {
        let denied = serialport::Error::new(ErrorKind::Io(io::ErrorKind::PermissionDenied), "Permission denied");
        let error = explain("/dev/ttyACM0", denied, || Ok(Vec::new())).to_string();
        assert!(error.contains("`sudo usermod -aG dialout $USER`) and log in again"), "{error}");
    }
}
