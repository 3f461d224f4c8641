//! Flashing: `weeder flash` with the real avrdude and the real bootloaders in `weeder virtual-uno`, and its errors.
//!
//! The tests wait for results, not for fixed times, because a busy PC may be slow.

use crate::common::{Running, assert_fails, assert_has, command, told};
use std::fs;
use std::io::{ErrorKind, Write};
use std::os::unix::fs::PermissionsExt;
use std::path::{Path, PathBuf};
use std::process::{Command, Stdio};
use std::thread;
use std::time::Duration;
use uno::elf::Image;
use uno::pty::Pty;
use uno_run::firmware;

mod interrupted;

/// Path in Debian's arduino-core-avr, which setup.sh installs.
const BOOTLOADERS: &str = "/usr/share/arduino/hardware/arduino/avr/bootloaders";

/// Timeout of an answer: a hundred times the time on a busy PC.
const PATIENCE: Duration = Duration::from_secs(120);

fn old_bootloader() -> PathBuf {
    Path::new(BOOTLOADERS).join("atmega/ATmegaBOOT_168_atmega328.hex")
}

/// `weeder virtual-uno`, once its port is there.
#[track_caller]
fn virtual_uno(arguments: &[&Path]) -> Running {
    Running::with_first_line(command(&["virtual-uno"]).args(arguments)).0
}

/// Reads until one of these texts has come. Returns the whole text.
#[track_caller]
fn read_until(port: &mut dyn serialport::SerialPort, texts: &[&str]) -> String {
    let mut heard = Vec::new();
    let mut byte = [0];
    while !texts.iter().any(|text| heard.ends_with(text.as_bytes())) {
        match port.read(&mut byte) {
            Ok(count) => heard.extend(&byte[..count]),
            Err(error) if error.kind() == ErrorKind::Interrupted => {}
            Err(error) => panic!("{texts:?} has not come ({error}), but {:?}", String::from_utf8_lossy(&heard)),
        }
    }
    String::from_utf8_lossy(&heard).into_owned()
}

/// Optiboot, the Uno's bootloader, compiled from arduino-core-avr. Debian's compiled file is too long.
fn optiboot(folder: &Path) -> PathBuf {
    let (elf, hex) = (folder.join("optiboot.elf"), folder.join("optiboot.hex"));
    let mut compiler = Command::new("avr-gcc");
    compiler
        .args(["-mmcu=atmega328p", "-DF_CPU=16000000L", "-DBAUD_RATE=115200", "-w", "-Os", "-mrelax", "-nostdlib"])
        .args(["-fno-split-wide-types", "-fno-inline-small-functions", "-nostartfiles"])
        .args(["-Wl,--section-start=.text=0x7e00", "-Wl,--section-start=.version=0x7ffe", "-o"])
        .args([&elf, &Path::new(BOOTLOADERS).join("optiboot/optiboot.c")]);
    assert!(compiler.status().expect("avr-gcc is there: setup.sh installs it").success());
    let mut objcopy = Command::new("avr-objcopy");
    objcopy.args(["-O", "ihex", "-j", ".text", "-j", ".version"]).args(["--set-section-flags", ".version=alloc,load"]);
    assert!(objcopy.args([&elf, &hex]).status().expect("avr-objcopy is there: setup.sh installs it").success());
    hex
}

/// Flashes an Uno. On a busy PC avrdude may miss the bootloader's time window: it tries again, as a user would.
#[track_caller]
fn flash(port: &Path, arguments: &[&str]) {
    let flashed = (0..5).any(|_| {
        let status = command(&["flash"]).args(arguments).arg("--port").arg(port).status();
        status.expect("cargo has built it").success()
    });
    assert!(flashed, "avrdude's own words stand above");
}

/// Asserts that the firmware greets the program that opens the port, after the bootloader's wait, and answers. On a
/// busy PC the greeting of the previous run may be read before the Uno is reset. Lines that are typed then are lost,
/// and are typed again after the next greeting, as `weeder` does.
#[track_caller]
fn assert_talks(link: &Path) {
    const GREETING_ENDS: &str = "help lists the commands\r\n";
    let mut port = serialport::new(link.to_string_lossy(), 115_200).timeout(PATIENCE).open().unwrap();
    let mut heard = read_until(&mut *port, &[GREETING_ENDS]);
    assert!(heard.contains("weeder"), "{heard}");
    for _ in 0..2 {
        if heard.ends_with(GREETING_ENDS) {
            port.write_all(b"version\n").unwrap();
            heard = read_until(&mut *port, &["ok\r\n", GREETING_ENDS]);
        }
    }
    assert!(heard.ends_with("ok\r\n") && heard.contains(env!("CARGO_PKG_VERSION")), "{heard}");
    port.write_all(b"status\n").unwrap();
    assert!(read_until(&mut *port, &["ok\r\n"]).contains("tool=out"));
}

/// An ELF for the chip with this number of bytes in flash.
fn elf_of(folder: &Path, bytes: usize) -> PathBuf {
    let (source, elf) = (folder.join("filler.S"), folder.join("filler.elf"));
    fs::write(&source, format!(".space {bytes}\n")).unwrap();
    let mut compiler = Command::new("avr-gcc");
    compiler.args(["-mmcu=atmega328p", "-nostdlib", "-o"]).args([&elf, &source]);
    assert!(compiler.status().expect("avr-gcc is there: setup.sh installs it").success());
    elf
}

#[test]
fn an_uno_is_flashed_through_either_bootloader() {
    // Each takes the time that its line takes.
    thread::scope(|scope| {
        scope.spawn(an_empty_uno_is_flashed_through_optiboot_and_answers);
        scope.spawn(flashing_with_the_old_bootloader_reaches_the_last_byte);
    });
}

fn an_empty_uno_is_flashed_through_optiboot_and_answers() {
    let folder = tempfile::tempdir().unwrap();
    let (link, eeprom) = (folder.path().join("uno"), folder.path().join("uno.eeprom"));
    let mut arguments = vec![Path::new("--stand"), Path::new("--bootloader")];
    let bootloader = optiboot(folder.path());
    arguments.extend([&bootloader, Path::new("--link"), &link, Path::new("--eeprom"), &eeprom]);
    let uno = virtual_uno(&arguments);
    let same = command(&["virtual-uno", "--stand", "--eeprom"]).arg(&eeprom).output().unwrap();
    assert_fails(&same, "another virtual Uno keeps its EEPROM in");
    flash(&link, &[]);

    assert_talks(&link);
    uno.interrupt();
    assert!(!link.is_symlink(), "it takes its link with it");
    assert_eq!(fs::metadata(&eeprom).unwrap().len(), 1024);
}

fn flashing_with_the_old_bootloader_reaches_the_last_byte() {
    let folder = tempfile::tempdir().unwrap();
    let link = folder.path().join("uno");
    let arguments = [Path::new("--stand"), Path::new("--bootloader"), &old_bootloader(), Path::new("--link"), &link];
    let _uno = virtual_uno(&arguments);
    let elf = elf_of(folder.path(), 30_720);
    // avrdude reads back what it has written.
    flash(&link, &["--old-bootloader", "--unproved", "--elf", elf.to_str().expect("it is text")]);
}

#[test]
fn a_firmware_that_reaches_into_the_old_bootloader_is_refused() {
    let folder = tempfile::tempdir().unwrap();
    let pty = Pty::open().unwrap();
    let elf = elf_of(folder.path(), 30_722);
    let flash = |arguments: &[&str]| {
        let mut flash = command(&["flash", "--unproved"]);
        flash.args(arguments).arg("--port").arg(pty.path()).arg("--elf").arg(&elf);
        // Without a PATH there is no avrdude.
        flash.env("PATH", folder.path()).output().unwrap()
    };
    assert_fails(&flash(&["--old-bootloader"]), "takes 30722 bytes of flash: the bootloader leaves 30720");
    assert_fails(
        &flash(&[]),
        "avrdude cannot be started: `sudo apt install avrdude`, your system's package avrdude, or ./setup.sh installs it, or",
    );
}

fn avrdude(folder: &Path, script: &str) {
    let avrdude = folder.join("avrdude");
    fs::write(&avrdude, format!("#!/bin/sh\n{script}")).unwrap();
    fs::set_permissions(&avrdude, fs::Permissions::from_mode(0o755)).unwrap();
}

#[test]
fn an_elf_with_unproved_bounds_is_flashed_only_with_unproved() {
    let folder = tempfile::tempdir().unwrap();
    let pty = Pty::open().unwrap();
    let elf = elf_of(folder.path(), 100);
    // Files beside the ELF belong to the user.
    fs::write(elf.with_extension("hex"), "mine").unwrap();
    avrdude(folder.path(), "echo \"$@\" >\"${0%/*}/called\"");
    let called = folder.path().join("called");
    let run = |words: &[&str]| command(words).arg("--elf").arg(&elf).env("PATH", folder.path()).output().unwrap();
    let port = pty.path().to_str().expect("it is text");
    let out = folder.path().join("out.hex");
    let out_name = out.to_str().expect("it is text");
    for words in [&["flash", "--port", port][..], &["hex", out_name]] {
        let output = run(words);
        assert_fails(&output, "the bounds of ");
        assert_fails(&output, "--unproved writes it all the same");
        assert!(!called.exists() && !out.exists(), "{words:?}");
        assert!(output.stdout.is_empty());
    }
    for (words, written) in
        [(&["flash", "--unproved", "--port", port][..], &called), (&["hex", "--unproved", out_name], &out)]
    {
        let output = run(words);
        assert!(output.status.success() && written.exists(), "{words:?}: {output:?}");
        assert_has(&told(&output), ["Warning: the bounds of ", "its stack may overwrite its data"]);
    }
    assert_eq!(fs::read_to_string(elf.with_extension("hex")).unwrap(), "mine");
}

#[test]
fn released_firmware_comes_from_a_command_that_proves_it() {
    for (file, command) in [("release.sh", "weeder\" hex "), ("page/build.mjs", "\"hex\"")] {
        let text = fs::read_to_string(firmware::workspace_root().join(file)).unwrap();
        let is_made_else = |line: &str| line.contains("objcopy") && line.contains("weeder");
        assert!(text.contains(command) && !text.lines().any(is_made_else), "{file}");
    }
}

#[test]
fn a_release_has_the_packages_of_the_page_s_present_lock() {
    let [release, setup] =
        ["release.sh", "setup.sh"].map(|file| fs::read_to_string(firmware::workspace_root().join(file)).unwrap());
    let installs: Vec<&str> = release.lines().filter(|line| line.contains("npm --prefix page ci")).collect();
    let [install] = installs[..] else { panic!("{installs:?}") };
    assert!(install.contains("[ page/package-lock.json -nt \"$lock\" ]"), "{install}");
    assert!(setup.lines().any(|line| line.trim() == install), "setup.sh installs them in the same case");
}

#[test]
fn a_row_is_flashed_by_its_name() {
    let folder = tempfile::tempdir().unwrap();
    let mut pty = Pty::open().unwrap();
    let link = folder.path().join("the left one");
    pty.link(&link).unwrap();
    let names = folder.path().join("rows.toml");
    fs::write(&names, format!("left = {{ port = \"{}\" }}\n", link.display())).unwrap();
    avrdude(folder.path(), "echo \"$@\" >\"${0%/*}/called\"");
    let elf = elf_of(folder.path(), 100);
    let flash = |port: &str| {
        let mut flash = command(&["flash", "--unproved", "--port", port, "--rows-file"]);
        flash.arg(&names).arg("--elf").arg(&elf).env("PATH", folder.path()).output().unwrap()
    };
    let output = flash("left");
    assert!(output.status.success(), "{}", told(&output));
    let said = String::from_utf8_lossy(&output.stdout);
    assert_has(&said, [&*format!("`weeder monitor --port '{}'`", link.display())]);
    let called = fs::read_to_string(folder.path().join("called")).unwrap();
    let device = link.canonicalize().unwrap();
    assert!(called.contains(&format!("-P {} ", device.display())), "{called}");
    assert_fails(&flash("right"), "there is no port right");
}

#[test]
fn a_firmware_that_reaches_into_optiboot_is_refused() {
    let folder = tempfile::tempdir().unwrap();
    let pty = Pty::open().unwrap();
    let elf = elf_of(folder.path(), 32_258);
    let output = command(&["flash", "--elf"]).arg(elf).arg("--port").arg(pty.path()).output().unwrap();
    assert_fails(&output, "takes 32258 bytes of flash: the bootloader leaves 32256");
}

#[test]
fn a_busy_port_is_named_and_a_file_is_no_port() {
    let (pty, file) = (Pty::open().unwrap(), tempfile::NamedTempFile::new().unwrap());
    let _claim = serialport::new(pty.path().to_string_lossy(), 115_200).open().unwrap();
    for (path, why) in
        [(pty.path(), "is in use: close the serial monitor"), (file.path(), "cannot be opened as a serial port")]
    {
        assert_fails(&command(&["flash", "--port"]).arg(path).output().unwrap(), why);
    }
}

/// Flashes an ELF of 100 bytes with this script in avrdude's place.
fn flash_with(folder: &Path, port: &Path, script: &str) -> Command {
    avrdude(folder, script);
    let mut flash = command(&["flash", "--unproved", "--elf"]);
    // The script takes its own commands from the system's folders.
    flash.arg(elf_of(folder, 100)).arg("--port").arg(port).env("PATH", format!("{}:/usr/bin:/bin", folder.display()));
    flash
}

#[test]
fn the_advice_comes_after_each_of_avrdude_s_words_once() {
    let folder = tempfile::tempdir().unwrap();
    let pty = Pty::open().unwrap();
    let script = "for n in 1 2 3 4 5 6 7 8 9 10; do\n\
         echo \"avrdude: stk500_getsync() attempt $n of 10: not in sync: resp=0x0$n\" >&2\ndone\nexit 1\n";
    let output = flash_with(folder.path(), pty.path(), script).output().unwrap();
    // No bootloader answers at the other rate, so the other option is no help.
    assert_fails(&output, "no bootloader answers at 115200 or 57600 baud: pull D0 and D1 free");
    let message = told(&output);
    assert_eq!(message.matches("not in sync").count(), 1);
    assert!(!message.contains("--old-bootloader"), "{message}");
    let said = String::from_utf8_lossy(&output.stdout);
    assert!(said.contains("The servo has no signal for 3 s, and the tool may fall"), "{said}");
}

#[test]
fn another_chip_is_named_by_its_signature() {
    let folder = tempfile::tempdir().unwrap();
    let pty = Pty::open().unwrap();
    for (signature, chip) in [("0x1e9516 (probably m328pb)", "ATmega328PB"), ("1E 95 14 (ATmega328)", "ATmega328")] {
        let script = format!("echo 'avrdude: device signature = {signature}' >&2\nexit 1\n");
        let output = flash_with(folder.path(), pty.path(), &script).output().unwrap();
        assert_fails(&output, &format!("the board has another chip, {chip}: nothing was written"));
    }
}

/// A bootloader with a chip of this signature, on its own thread. It answers at any rate, as a terminal has none.
fn answering(
    signature: [u8; 3],
    mut is_over: impl FnMut() -> bool + Send + 'static,
) -> (PathBuf, thread::JoinHandle<()>) {
    let mut pty = Pty::open().unwrap();
    let path = pty.path().to_owned();
    let bootloader = thread::spawn(move || {
        let (mut asked, mut bytes) = (Vec::new(), [0; 64]);
        while !is_over() {
            let count = pty.read(&mut bytes).unwrap();
            asked.extend_from_slice(&bytes[..count]);
            if asked.ends_with(&[0x30, 0x20]) {
                pty.write(&[0x14, 0x10]).unwrap();
                asked.clear();
            } else if asked.ends_with(&[0x75, 0x20]) {
                pty.write(&[&[0x14], &signature[..], &[0x10]].concat()).unwrap();
                asked.clear();
            }
            thread::sleep(Duration::from_millis(5));
        }
    });
    (path, bootloader)
}

#[test]
fn after_a_failure_the_bootloader_is_asked_what_is_wrong() {
    for (signature, words) in [
        ([0x1E, 0x98, 0x01], "the board has another chip, ATmega2560 (Mega): nothing was written"),
        ([0x1E, 0x95, 0x0F], "the bootloader answers, so avrdude's own message above says why"),
    ] {
        let folder = tempfile::tempdir().unwrap();
        let over = folder.path().join("over");
        let (port, bootloader) = answering(signature, {
            let over = over.clone();
            move || over.exists()
        });
        let output = flash_with(folder.path(), &port, "exit 1\n").output().unwrap();
        fs::write(over, "").unwrap();
        bootloader.join().unwrap();
        assert_fails(&output, words);
    }
}

#[test]
fn two_flashes_of_one_port_are_kept_apart() {
    let [first, second] = [(); 2].map(|()| tempfile::tempdir().unwrap());
    let mut pty = Pty::open().unwrap();
    let link = first.path().join("uno");
    pty.link(&link).unwrap();
    let script = "touch \"${0%/*}/began\"\nwhile test ! -e \"${0%/*}/end\"; do sleep 0.1; done\n";
    let mut writing = flash_with(first.path(), &link, script).stdout(Stdio::null()).spawn().unwrap();
    while !first.path().join("began").exists() && writing.try_wait().unwrap().is_none() {
        thread::sleep(Duration::from_millis(20));
    }
    let port = fs::canonicalize(&link).unwrap();
    let refused = flash_with(second.path(), &port, "touch \"${0%/*}/began\"\n").output().unwrap();
    let monitor = command(&["monitor", "--plain", "--port"]).arg(&port).output().unwrap();
    fs::write(first.path().join("end"), "").unwrap();
    assert!(writing.wait().unwrap().success());
    assert_fails(&refused, "is being flashed by another program: wait until that has ended");
    assert_fails(&monitor, "is being flashed by another program");
    assert!(!second.path().join("began").exists());
}

#[test]
fn an_elf_for_another_chip_is_refused_also_unproved() {
    let folder = tempfile::tempdir().unwrap();
    let pty = Pty::open().unwrap();
    let (source, elf) = (folder.path().join("main.c"), folder.path().join("other.elf"));
    fs::write(&source, "int main(void) { for (;;); }\n").unwrap();
    for chip in ["atmega2560", "atmega168"] {
        let mut compiler = Command::new("avr-gcc");
        compiler.arg(format!("-mmcu={chip}")).arg("-o").args([&elf, &source]);
        assert!(compiler.status().expect("avr-gcc is there: setup.sh installs it").success());
        let mut flash = command(&["flash", "--unproved", "--elf"]);
        let output = flash.arg(&elf).arg("--port").arg(pty.path()).env("PATH", folder.path()).output().unwrap();
        assert_fails(&output, &format!("is for the {chip}: the Uno has an atmega328p"));
    }
}

#[test]
fn bootloaders_that_are_none_are_refused() {
    let virtual_uno = |file: &Path| command(&["virtual-uno", "--bootloader"]).arg(file).output().unwrap();
    assert_fails(&virtual_uno(Path::new("no-such.hex")), "no-such.hex cannot be read: No such file");
    let optiboot = Path::new(BOOTLOADERS).join("optiboot/optiboot_atmega328.hex");
    // Debian's is longer than its boot section.
    assert_fails(&virtual_uno(&optiboot), "it fills flash from 0x7e00 to 0x8014");
    let folder = tempfile::tempdir().unwrap();
    let text = folder.path().join("notes.hex");
    fs::write(&text, "notes\n").unwrap();
    assert_fails(&virtual_uno(&text), "is no Intel HEX file");
}

#[test]
fn a_link_does_not_take_a_file_s_place() {
    let folder = tempfile::tempdir().unwrap();
    let file = folder.path().join("mine");
    fs::write(&file, "mine").unwrap();
    let mut uno = command(&["virtual-uno", "--bootloader"]);
    uno.arg(old_bootloader()).arg("--link").arg(&file);
    assert_fails(&uno.output().unwrap(), "exists already and is no link to a pseudo terminal");
    assert_eq!(fs::read_to_string(&file).unwrap(), "mine");
}

#[test]
fn the_hex_file_has_the_content_of_the_elf() {
    let folder = tempfile::tempdir().unwrap();
    let elf = firmware::build().expect("the firmware builds");
    let out = folder.path().join("weeder.hex");
    let output = command(&["hex"]).arg(&out).arg("--elf").arg(&elf).output().unwrap();
    assert!(output.status.success(), "{}", told(&output));
    // Converted by binutils, an independent program.
    let binary = folder.path().join("weeder.bin");
    let mut objcopy = Command::new("avr-objcopy");
    objcopy.args(["-I", "ihex", "-O", "binary"]).args([&out, &binary]);
    assert!(objcopy.status().expect("avr-objcopy is there: setup.sh installs it").success());
    assert_eq!(fs::read(&binary).unwrap(), Image::read(&elf).unwrap().flash);

    let nowhere = folder.path().join("no-such/weeder.hex");
    assert_fails(&command(&["hex"]).arg(&nowhere).arg("--elf").arg(&elf).output().unwrap(), "No such file");
}
