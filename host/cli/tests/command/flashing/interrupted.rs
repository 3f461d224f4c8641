//! Flashing that is interrupted: half a firmware does not run.

use super::*;
use crate::common::typed;
use std::process::Child;
use uno::{Pin, Uno};

#[test]
fn half_a_firmware_does_not_run_and_flashing_again_mends_it() {
    let folder = tempfile::tempdir().unwrap();
    let link = folder.path().join("uno");
    let (elf, bootloader) = (firmware::build().expect("the firmware builds"), optiboot(folder.path()));
    let mut arguments = vec![Path::new("--stand"), Path::new("--bootloader"), &bootloader];
    arguments.extend([Path::new("--elf"), &elf, Path::new("--link"), &link]);
    let _uno = virtual_uno(&arguments);
    // The real avrdude writes half of the pages. Then it cannot read the file with the first page.
    let half = "sed -i '900,$d' rest.hex\necho :00000001FF >>rest.hex\ncp standstill.hex rest.hex \"${0%/*}\"\n\
         echo torn >first.hex\nexec /usr/bin/avrdude \"$@\"\n";
    avrdude(folder.path(), half);
    // On a busy PC avrdude may miss the bootloader's time window.
    let answers = (0..5).any(|_| {
        let mut flash = command(&["flash", "--unproved", "--elf"]);
        flash.arg(&elf).arg("--port").arg(&link).env("PATH", format!("{}:/usr/bin:/bin", folder.path().display()));
        let told = told(&flash.output().unwrap());
        told.contains("first.hex") && told.contains("half a firmware does not run")
    });
    assert!(answers, "avrdude came as far as the file with the first page");
    let monitor = typed(command(&["monitor", "--plain", "--port"]).arg(&link), "version\n");
    assert_fails(&monitor, "nothing answers at this port");

    // The same flash, and the servo's pin.
    let [standstill, rest] = ["standstill.hex", "rest.hex"].map(|file| fs::read_to_string(folder.path().join(file)));
    let half = folder.path().join("half.hex");
    fs::write(&half, standstill.unwrap().replace(":00000001FF\n", "") + &rest.unwrap()).unwrap();
    let mut uno = Uno::boot(&half).unwrap();
    uno.run_for_ms(1000).unwrap();
    assert_eq!((uno.output(Pin::D9), uno.changes().len()), (None, 0));

    flash(&link, &["--unproved"]);
    assert_talks(&link);
}

/// Flashes with an avrdude that prints its progress for ever, as if the port were there. Waits until it has begun.
fn endless(folder: &Path, port: &Path) -> Child {
    let script = "touch \"${0%/*}/began\"\nwhile true; do printf '#' >&2; sleep 0.1; done\n";
    let writing = flash_with(folder, port, script).stdout(Stdio::piped()).stderr(Stdio::piped()).spawn().unwrap();
    while !folder.join("began").exists() {
        thread::sleep(Duration::from_millis(20));
    }
    writing
}

#[test]
fn ctrl_c_ends_avrdude_and_the_message_says_what_runs() {
    let folder = tempfile::tempdir().unwrap();
    let pty = Pty::open().unwrap();
    let writing = endless(folder.path(), pty.path());
    assert!(Command::new("kill").args(["-INT", &writing.id().to_string()]).status().unwrap().success());
    assert_fails(&writing.wait_with_output().unwrap(), "interrupted: flash it again. Half a firmware does not run");
}

#[test]
fn a_port_that_vanishes_while_it_is_written_ends_avrdude() {
    let folder = tempfile::tempdir().unwrap();
    // The system gives the lowest free number: another test's terminal must not take this one's place.
    let mut ptys: Vec<Pty> = (0..40).map(|_| Pty::open().unwrap()).collect();
    let mut pty = ptys.pop().unwrap();
    drop(ptys);
    let link = folder.path().join("uno");
    pty.link(&link).unwrap();
    let writing = endless(folder.path(), &link);
    // The link stays, as after a pulled cable.
    let device = fs::canonicalize(&link).unwrap();
    drop(pty);
    std::os::unix::fs::symlink(device, &link).unwrap();
    assert_fails(&writing.wait_with_output().unwrap(), "is gone while the Uno was written: plug it in, and flash it");
}
