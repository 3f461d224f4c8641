//! The live virtual Uno at its pseudo terminal, as other programs see it.

use field::machine::Machine;
use field::row::{Canopy, Row};
use field::wiring;
use link::{Link, Status, try_port};
use rand::{Rng, SeedableRng};
use rand_chacha::ChaCha8Rng;
use std::path::Path;
use std::process::Command;
use std::thread::sleep;
use std::time::Duration;
use uno::Uno;
use uno::bootloader::Bootloader;
use uno::pty::Pty;
use uno_run::firmware;
use uno_run::live::rows::{Background, LiveRows};
use uno_run::live::{Course, Setup};

/// Path in Debian's arduino-core-avr, which setup.sh installs.
const OLD_BOOTLOADER: &str = "/usr/share/arduino/hardware/arduino/avr/bootloaders/atmega/ATmegaBOOT_168_atmega328.hex";

fn product() -> Setup {
    Setup { elf: Some(firmware::build().expect("the firmware builds")), ..Setup::default() }
}

#[track_caller]
fn start(setup: Setup) -> Background {
    LiveRows::start(vec![setup]).expect("it starts").run_in_background()
}

/// Stops the Uno, which has run without an error.
#[track_caller]
fn stopped(uno: Background) -> Uno {
    let rows = uno.stop().map_err(|(_, error)| error).expect("it ran to the end");
    rows.into_unos().remove(0)
}

/// Opens the port, and waits until the firmware, which is reset by that, answers.
#[track_caller]
fn open(uno: &Background) -> Link {
    Link::open(uno.path().to_str()).expect("the firmware answers")
}

#[test]
fn opening_the_port_resets_the_chip_and_gets_the_version() {
    let uno = start(product());
    for _ in 0..2 {
        assert!(open(&uno).version().starts_with(env!("CARGO_PKG_VERSION")));
    }
    assert_eq!(stopped(uno).resets().len(), 2);
}

#[test]
fn an_uno_whose_reset_is_cut_runs_on_when_the_port_is_opened() {
    let uno = start(Setup { keeps_running_when_opened: true, ..product() });
    for _ in 0..2 {
        assert!(open(&uno).version().starts_with(env!("CARGO_PKG_VERSION")));
    }
    assert_eq!(stopped(uno).resets(), []);
}

/// Runs avrdude on the flash through the bootloader, with a user's number of retries.
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
        // On a busy PC it may miss the bootloader's time window.
        said = String::from_utf8_lossy(&output.stderr).into_owned();
    }
    panic!("{said}");
}

#[test]
fn the_old_bootloader_writes_the_flash_but_not_itself() {
    let bootloader = Bootloader::read(Path::new(OLD_BOOTLOADER)).expect("setup.sh installs arduino-core-avr");
    let uno = start(Setup { bootloader: Some(bootloader.clone()), ..Setup::default() });
    let mut flash = vec![0; 10_000];
    ChaCha8Rng::seed_from_u64(1).fill_bytes(&mut flash);
    let folder = tempfile::tempdir().unwrap();
    let hex = folder.path().join("noise.hex");
    std::fs::write(&hex, uno::hex::text(&flash)).unwrap();
    // avrdude reads back what it wrote, and compares.
    avrdude(uno.path(), "57600", &format!("flash:w:{}:i", hex.display()));
    assert!(stopped(uno).flash().starts_with(&bootloader.behind(&flash).unwrap()));
}

#[test]
fn the_eeprom_is_kept_in_its_file_over_runs() {
    let folder = tempfile::tempdir().unwrap();
    let setup = || Setup { eeprom: Some(folder.path().join("uno.eeprom")), ..product() };
    let uno = start(setup());
    let mut link = open(&uno);
    link.ask("set k 5").unwrap();
    link.ask("save").unwrap();
    drop((link, uno));

    let uno = start(setup());
    let answer = open(&uno).ask("get k").unwrap();
    assert!(answer[0].starts_with("k=5 "), "{answer:?}");
}

#[test]
fn a_file_of_another_length_is_no_eeprom() {
    let folder = tempfile::tempdir().unwrap();
    let file = folder.path().join("notes.txt");
    std::fs::write(&file, "not an EEPROM").unwrap();
    let error = LiveRows::start(vec![Setup { eeprom: Some(file.clone()), ..product() }]).err().expect("it is refused");
    assert!(error.to_string().contains("has 13 bytes: a file that keeps the EEPROM has 1024"), "{error}");
    assert_eq!(std::fs::read_to_string(&file).unwrap(), "not an EEPROM");
}

#[test]
fn without_firmware_and_bootloader_there_is_nothing_to_run() {
    let error = LiveRows::start(vec![Setup::default()]).err().expect("it is refused");
    assert!(error.to_string().contains("nothing to run"), "{error}");
}

#[test]
fn the_machine_rolls_along_its_row_and_stands_between() {
    let row = Row::new(vec![Canopy::plant(500.0, 150.0)]).unwrap();
    let course = Course::of_rows(vec![row], Machine::default(), 2000.0, 0.0).pop();
    let uno = start(Setup { course, fast: true, ..product() });
    let mut link = open(&uno);
    let mut positions = Vec::new();
    while positions.last().is_none_or(|&position| position < 4000) {
        let answer = link.ask("status").unwrap();
        positions.push(Status::parse(&answer[0]).expect("a status").position);
    }
    assert!(positions.is_sorted(), "{positions:?}");
}

#[test]
fn an_erased_flash_runs_through_to_the_bootloader_again_and_again() {
    let bootloader = Bootloader::read(Path::new(OLD_BOOTLOADER)).expect("setup.sh installs arduino-core-avr");
    let mut uno = Uno::boot_with_bootloader(&bootloader, None, &[]).unwrap();
    uno.run_for_ms(10_000).expect("it does not run past the end of the flash");
    assert!(uno.changes().iter().any(|change| change.pin == wiring::LED), "the bootloader flashes the LED");
}

#[test]
fn a_port_that_another_program_has_claimed_is_busy_until_it_is_done() {
    let mut pty = Pty::open().unwrap();
    let port = pty.path().to_string_lossy().into_owned();
    let claim = serialport::new(&port, 115_200).open().unwrap();
    let error = try_port(&port).unwrap_err().to_string();
    assert!(error.ends_with("close the serial monitor, or the other program that has it open"), "{error}");
    drop(claim);
    assert!(pty.was_opened().unwrap());
    // A program that another test starts has a copy of the claim from its fork to its exec.
    let is_free = (0..100).any(|_| {
        sleep(Duration::from_millis(10));
        try_port(&port).is_ok()
    });
    assert!(is_free);
}
