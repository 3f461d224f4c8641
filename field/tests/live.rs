//! The virtual Uno at its pseudo terminal, as the programs that open it see it.
//!
//! Waits end when what is waited for has come; how long that takes on a busy host says nothing.

use field::firmware;
use field::hex::Bootloader;
use field::live::{Background, Course, LiveUno, Setup};
use field::machine::Machine;
use field::row::{Row, Thing};
use field::signal::Pin;
use field::uno::Uno;
use rand::{Rng, SeedableRng};
use rand_chacha::ChaCha8Rng;
use serialport::SerialPort;
use std::io::ErrorKind;
use std::path::Path;
use std::process::Command;
use std::time::Duration;

/// Debian's arduino-core-avr has it here; setup.sh installs it.
const OLD_BOOTLOADER: &str = "/usr/share/arduino/hardware/arduino/avr/bootloaders/atmega/ATmegaBOOT_168_atmega328.hex";

/// No answer after so long is none: a hundred times what a busy host takes.
const PATIENCE: Duration = Duration::from_secs(120);

fn product() -> Setup {
    Setup { elf: Some(firmware::build().expect("the firmware builds")), ..Setup::default() }
}

#[track_caller]
fn start(setup: Setup) -> Background {
    LiveUno::start(setup).expect("it starts").run_in_background()
}

#[track_caller]
fn open(path: &Path) -> Box<dyn SerialPort> {
    serialport::new(path.to_string_lossy(), 115_200).timeout(PATIENCE).open().expect("the port opens")
}

/// Reads until this text has come, and returns all of it.
#[track_caller]
fn read_until(port: &mut dyn SerialPort, text: &str) -> String {
    let mut heard = Vec::new();
    let mut byte = [0];
    while !heard.ends_with(text.as_bytes()) {
        match port.read(&mut byte) {
            Ok(count) => heard.extend(&byte[..count]),
            Err(error) if error.kind() == ErrorKind::Interrupted => {}
            Err(error) => panic!("{text:?} has not come ({error}), but {:?}", String::from_utf8_lossy(&heard)),
        }
    }
    String::from_utf8_lossy(&heard).into_owned()
}

/// Opens the port and waits until the firmware, which is reset by that, says that it is there.
#[track_caller]
fn open_and_wait(path: &Path) -> Box<dyn SerialPort> {
    let mut port = open(path);
    read_until(&mut *port, "help lists the commands\r\n");
    port
}

/// Types a command and returns its answer.
#[track_caller]
fn ask(port: &mut dyn SerialPort, command: &str) -> String {
    writeln!(port, "{command}").expect("the port takes it");
    read_until(port, "ok\r\n")
}

#[test]
fn opening_the_port_resets_the_chip_and_the_firmware_says_that_it_is_there() {
    let uno = start(product());
    for _ in 0..2 {
        let mut port = open_and_wait(uno.path());
        let answer = ask(&mut *port, "version");
        assert!(answer.contains("weeder"), "{answer}");
    }
    assert_eq!(uno.stop().expect("it ran to the end").uno().resets().len(), 2);
}

#[test]
fn an_uno_whose_reset_is_cut_runs_on_when_the_port_is_opened() {
    let uno = start(Setup { keeps_running_when_opened: true, ..product() });
    for _ in 0..2 {
        let mut port = open(uno.path());
        port.set_timeout(Duration::from_secs(1)).unwrap();
        // What comes before the firmware listens is lost.
        while port.write_all(b"version\n").is_err() || port.read(&mut [0; 64]).is_err() {}
    }
    assert_eq!(uno.stop().expect("it ran to the end").uno().resets(), []);
}

/// Has avrdude do something with the flash through the bootloader, as often as a user would try it.
#[track_caller]
fn avrdude(port: &Path, baud: &str, operation: &str) {
    let mut said = String::new();
    for _ in 0..5 {
        let output = Command::new("avrdude")
            .args(["-c", "arduino", "-p", "atmega328p", "-D", "-b", baud, "-U", operation, "-P"])
            .arg(port)
            .output()
            .expect("avrdude is there: setup.sh installs it");
        if output.status.success() {
            return;
        }
        // On a busy host it may come too late for the bootloader's window.
        said = String::from_utf8_lossy(&output.stderr).into_owned();
    }
    panic!("{said}");
}

#[test]
fn avrdude_writes_the_flash_through_the_old_bootloader_and_leaves_that_alone() {
    let bootloader = Bootloader::read(Path::new(OLD_BOOTLOADER)).expect("setup.sh installs arduino-core-avr");
    let uno = start(Setup { bootloader: Some(bootloader.clone()), ..Setup::default() });
    let mut flash = vec![0; 10_000];
    ChaCha8Rng::seed_from_u64(1).fill_bytes(&mut flash);
    let folder = tempfile::tempdir().unwrap();
    let hex = folder.path().join("noise.hex");
    field::hex::write(&hex, &flash).unwrap();
    // It reads back what it wrote, and compares.
    avrdude(uno.path(), "57600", &format!("flash:w:{}:i", hex.display()));
    let uno = uno.stop().expect("it ran to the end");
    assert!(uno.uno().flash().starts_with(&bootloader.behind(&flash).unwrap()));
}

#[test]
fn the_eeprom_is_kept_in_its_file_over_runs() {
    let folder = tempfile::tempdir().unwrap();
    let setup = Setup { eeprom: Some(folder.path().join("uno.eeprom")), ..product() };
    let uno = start(setup.clone());
    let mut port = open_and_wait(uno.path());
    ask(&mut *port, "set k 5");
    ask(&mut *port, "save");
    drop((port, uno));

    let uno = start(setup);
    let mut port = open_and_wait(uno.path());
    let answer = ask(&mut *port, "get k");
    assert!(answer.contains('5'), "{answer}");
}

#[test]
fn a_file_of_another_length_is_no_eeprom() {
    let folder = tempfile::tempdir().unwrap();
    let file = folder.path().join("notes.txt");
    std::fs::write(&file, "not an EEPROM").unwrap();
    let error = LiveUno::start(Setup { eeprom: Some(file.clone()), ..product() }).err().expect("it is refused");
    assert!(error.to_string().contains("has 13 bytes: a file that keeps the EEPROM has 1024"), "{error}");
    assert_eq!(std::fs::read_to_string(&file).unwrap(), "not an EEPROM");
}

#[test]
fn without_firmware_and_bootloader_there_is_nothing_to_run() {
    let error = LiveUno::start(Setup::default()).err().expect("it is refused");
    assert!(error.to_string().contains("nothing to run"), "{error}");
}

#[test]
fn the_machine_rolls_along_its_row_and_stands_between() {
    let row = Row::new(vec![Thing::plant(500.0, 150.0)]).unwrap();
    let course = Course { row, machine: Machine::default(), speed_mm_s: 2000.0 };
    let uno = start(Setup { course: Some(course), fast: true, ..product() });
    let mut port = open_and_wait(uno.path());
    let mut positions = Vec::new();
    while positions.last().is_none_or(|&position: &i64| position < 4000) {
        let status = ask(&mut *port, "status");
        let position = status.split_whitespace().find_map(|word| word.strip_prefix("pos="));
        positions.push(position.expect("a position").parse().unwrap());
    }
    assert!(positions.is_sorted(), "{positions:?}");
}

#[test]
fn an_erased_flash_runs_through_to_the_bootloader_again_and_again() {
    let bootloader = Bootloader::read(Path::new(OLD_BOOTLOADER)).expect("setup.sh installs arduino-core-avr");
    let mut uno = Uno::boot_with_bootloader(&bootloader, None, &[]).unwrap();
    uno.run_for_ms(10_000).expect("it does not run past the end of the flash");
    assert!(uno.changes().iter().any(|change| change.pin == Pin::Led), "the bootloader flashes the LED");
}
