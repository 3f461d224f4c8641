//! Outputs of commands: an output that cannot be written is an error before the work, and never loses a result after
//! it.

use crate::common::{self, SMALL, assert_fails, assert_has, said, told};
use std::fs;
use std::path::Path;
use std::process::Output;

/// Runs `weeder` with these arguments in a folder that has a small field.
fn weeder(folder: &Path, arguments: &[&str]) -> Output {
    fs::write(folder.join("small.toml"), SMALL).unwrap();
    common::weeder(folder, arguments)
}

/// The arguments that name an output, without its name. The tests in `main.rs` have all of them.
const WRITERS: [(&[&str], Kind); 13] = [
    (&["trial", "--field", "small.toml", "--out"], Kind::Folder),
    (&["evaluate", concat!(env!("CARGO_MANIFEST_DIR"), "/../../docs/trial-example.csv"), "--out"], Kind::Folder),
    (&["sim", "--out"], Kind::Folder),
    (&["sim", "--vcd"], Kind::File("row.vcd")),
    (&["sweep", "--field", "small.toml", "--x", "k=1..3:2", "--out"], Kind::File("sweep.csv")),
    (&["plan", "--out"], Kind::File("trial.csv")),
    (&["train", "--synthetic", "--out"], Kind::File("table.rs")),
    (&["train", "--synthetic", "--out"], Kind::File("table.csv")),
    (&["train", "--synthetic", "--picture"], Kind::File("regions.svg")),
    (&["hex"], Kind::File("weeder.hex")),
    (&["record", "--port", "/dev/no-such-port", "--out"], Kind::File("log.csv")),
    (&["examples", "pull", "--port", "/dev/no-such-port"], Kind::File("taught.csv")),
    (&["settings", "pull", "--port", "/dev/no-such-port"], Kind::File("machine.toml")),
];

enum Kind {
    Folder,
    File(&'static str),
}

#[test]
fn an_unwritable_file_is_named_before_the_work_without_a_temporary_name() {
    for (arguments, kind) in WRITERS {
        let folder = tempfile::tempdir().unwrap();
        fs::write(folder.path().join("file"), "mine").unwrap();
        let name = match kind {
            Kind::Folder => "file/report".to_owned(),
            Kind::File(name) => format!("no-such/{name}"),
        };
        let output = weeder(folder.path(), &[arguments, &[&name]].concat());
        let message = String::from_utf8_lossy(&output.stderr);
        assert_eq!((output.status.code(), output.stdout.len()), (Some(2), 0), "{arguments:?}: {message}");
        assert!(message.contains(&format!("{name} cannot be written: ")), "{arguments:?}: {message}");
        assert!(!message.contains(".tmp"), "{message}");
        assert_eq!(fs::read_to_string(folder.path().join("file")).unwrap(), "mine");
    }
}

#[test]
fn a_folder_is_no_file_and_a_file_is_no_folder() {
    for (arguments, kind) in WRITERS {
        let folder = tempfile::tempdir().unwrap();
        let (name, wrong) = match kind {
            Kind::Folder => {
                fs::write(folder.path().join("report"), "mine").unwrap();
                ("report", "report is a file: name a folder")
            }
            // An existing log is continued, and has its own error.
            Kind::File("log.csv") => continue,
            Kind::File(name) => {
                fs::create_dir(folder.path().join(name)).unwrap();
                (name, " is a folder: name a file")
            }
        };
        let output = weeder(folder.path(), &[arguments, &[name]].concat());
        assert_fails(&output, wrong);
    }
    let folder = tempfile::tempdir().unwrap();
    let output = weeder(folder.path(), &["trial", "--field", "small.toml", "--out", "report.html"]);
    assert_has(&told(&output), ["report.html is named like a file"]);
    assert!(!folder.path().join("report.html").exists());
}

#[test]
fn a_name_that_no_output_can_have_is_refused_before_the_work() {
    let folder = tempfile::tempdir().unwrap();
    std::os::unix::fs::symlink("nothing", folder.path().join("dangling")).unwrap();
    for (arguments, kind) in WRITERS {
        let (name, words, long) = match kind {
            Kind::Folder => ("dangling".to_owned(), "dangling cannot be written: ", "n".repeat(300)),
            // A log is opened before the work.
            Kind::File("log.csv") => continue,
            Kind::File(name) => (format!("{name}/"), "/ is a folder: name a file", "n".repeat(300) + name),
        };
        for (name, words) in [(&*name, words), (&*long, " cannot be written: File name too long")] {
            let output = weeder(folder.path(), &[arguments, &[name]].concat());
            let message = String::from_utf8_lossy(&output.stderr);
            assert_eq!((output.status.code(), output.stdout.len()), (Some(2), 0), "{arguments:?}: {message}");
            assert!(message.contains(words), "{arguments:?}: {message}");
        }
    }
}

#[test]
fn an_existing_folder_called_report_does_not_stop_a_command() {
    let folder = tempfile::tempdir().unwrap();
    fs::create_dir(folder.path().join("report")).unwrap();
    for (number, (arguments, kind)) in (0..).zip(&WRITERS[..2]) {
        assert!(matches!(kind, Kind::Folder));
        for out in [format!("new{number}"), format!("./deep{number}/er"), "report".to_owned()] {
            let output = weeder(folder.path(), &[*arguments, &[&out, "--force"]].concat());
            let message = String::from_utf8_lossy(&output.stderr);
            assert!(matches!(output.status.code(), Some(0 | 1)), "{arguments:?} {out}: {message}");
            assert!(folder.path().join(&out).join("report.html").is_file(), "{arguments:?} {out}");
        }
    }
    // An obstacle to a file is reported before the work.
    fs::create_dir_all(folder.path().join("old/trial.csv")).unwrap();
    let output = weeder(folder.path(), &[WRITERS[0].0, &["old"]].concat());
    assert_has(&told(&output), ["old/trial.csv is a folder, and a file would take its place"]);
    fs::create_dir(folder.path().join("linked")).unwrap();
    std::os::unix::fs::symlink("/proc/version", folder.path().join("linked/trial.csv")).unwrap();
    let output = weeder(folder.path(), &[WRITERS[0].0, &["linked"]].concat());
    assert!(output.stdout.is_empty());
    assert_has(&told(&output), ["linked/trial.csv cannot be written: "]);
}

#[test]
fn the_table_is_printed_even_if_the_file_cannot_be_written() {
    let folder = tempfile::tempdir().unwrap();
    let sweep = ["sweep", "--field", "small.toml", "--x", "k=1..3:2", "--out", "/dev/full"];
    let output = weeder(folder.path(), &sweep);
    assert_fails(&output, "/dev/full cannot be written: No space left on device");
    assert!(String::from_utf8_lossy(&output.stdout).contains("damage"));
}

#[test]
fn output_to_a_device_goes_there() {
    let folder = tempfile::tempdir().unwrap();
    let output = weeder(folder.path(), &["sweep", "--field", "small.toml", "--x", "k=1..3:2", "--out", "/dev/null"]);
    assert!(output.status.success());
    let output = weeder(folder.path(), &["plan", "--out", "/dev/null", "--sheets", "/dev/null"]);
    assert!(output.status.success());
    assert!(!Path::new("/dev/null").is_file());
}

#[test]
fn every_out_is_a_folder_or_a_file_by_its_name_in_the_help() {
    for command in ["trial", "evaluate", "plan", "sim", "sweep", "train", "record"] {
        // It is wrapped.
        let help = said(Path::new("."), &[command, "--help"]).split_whitespace().collect::<Vec<_>>().join(" ");
        let is_folder = help.contains("--out <FOLDER>") && help.contains("into this folder, and create it if needed");
        assert!(is_folder || help.contains("--out <FILE."), "{command}: {help}");
    }
}

#[test]
fn a_folder_s_file_is_no_other_file_of_its_command() {
    let folder = tempfile::tempdir().unwrap();
    said(folder.path(), &["sim", "--plants", "2", "--weeds", "0", "--out", "there"]);
    let row = fs::read(folder.path().join("there/row.csv")).unwrap();
    for words in [
        &["sim", "--row", "there/row.csv", "--out", "there", "--force"][..],
        &["sim", "--plants", "2", "--weeds", "0", "--out", "new", "--vcd", "new/row.csv"],
    ] {
        fs::create_dir_all(folder.path().join("new")).unwrap();
        assert_fails(&weeder(folder.path(), words), "row.csv has two uses in this command: name another folder");
    }
    assert_eq!(fs::read(folder.path().join("there/row.csv")).unwrap(), row);
}
