//! The errors of the `weeder` command for wrong input. None of these tests runs the firmware.

use crate::common::{self, assert_has, command, folder_with, told, weeder};
use std::fs;
use std::path::Path;

#[track_caller]
fn assert_refused(words: &str, why: &str) {
    common::assert_refused(Path::new("."), &words.split(' ').collect::<Vec<_>>(), why);
}

#[test]
fn wrong_arguments_are_refused_with_what_would_be_right() {
    const SPEED: &str = "it has to be a number from 0.1 to 10";
    for (words, why) in [
        ("sim --speed 11", SPEED),
        ("sim --speed fast", SPEED),
        ("sim --speed NaN", SPEED),
        ("sim --speed -1", SPEED),
        ("sim --plants -1", "it has to be a whole number from 1 to 1000"),
        ("sim --seed -1", "it has to be a whole number from 0 to 18446744073709551615"),
        ("trial --speeds -1,2", "it has to be a number from 0.1 to 8"),
        ("soak --hours -5", "it has to be a whole number from 0 to 10000"),
        ("soak --hours 0 --uno-minutes 0", "one of them has to be above 0"),
        ("sim --elf no.elf --beam-to-tool 1500", "The simulated machine has one beam."),
        ("sim --spacing 100 --canopy 150", "--spacing has to exceed --canopy"),
        ("sim --plants 2 --weeds 50", "there is no room for 50 tall weeds between the plants"),
        ("sim --row no-such-row.csv", "no-such-row.csv"),
        ("sim --capture no-such.vcd --channel-a A --channel-b B", "no-such.vcd"),
        ("sim --capture some.vcd", "--channel-a"),
        ("flash --port /dev/no-such-port", "/dev/no-such-port"),
    ] {
        assert_refused(words, why);
    }
}

#[test]
fn each_weeding_command_warns_of_straying_into_the_sweeps() {
    let folder = folder_with("field.toml", "[driving]\nsteering_mm = 15\n[plot]\nrow_m = 2\n");
    for command in [
        "sim --elf no.elf",
        "trial --replications 1 --speeds 1 --brief",
        "sweep --x k=3..3:1",
        "sensitivity --replications 1 --speeds 1 crop.canopy_mm=160",
    ] {
        for (field, warns) in [("field.toml", true), ("from-the-box", false)] {
            let words: Vec<&str> = command.split(' ').chain(["--field", field]).collect();
            let message = told(&weeder(folder.path(), &words));
            let warning = "driving.steering_mm is 15, but the sweeps leave 0.0 mm";
            assert_eq!(message.contains(warning), warns, "{command}: {message}");
            assert!(!warns || message.contains("Set machine.sweep_from_mm to 65 or more."), "{command}: {message}");
        }
    }
    // The axis or the change may have the value.
    for command in [
        "sweep --x driving.steering_mm=0..20:20",
        "sensitivity --replications 1 --speeds 1 crop.canopy_mm=160 driving.steering_mm=20",
    ] {
        let words: Vec<&str> = command.split(' ').chain(["--field", "from-the-box"]).collect();
        let message = told(&weeder(folder.path(), &words));
        assert_has(&message, ["driving.steering_mm is 20, but the sweeps leave 0.0 mm"]);
    }
}

#[test]
fn a_distance_other_than_the_setting_gets_a_warning() {
    let field = "[machine]\nbeam_to_tool_mm = 500\n[settings]\nbeam_to_tool_mm = 600\n";
    let folder = folder_with("field.toml", field);
    for (distance, warning) in [("600", ""), ("700", "is 600, but the simulated machine has 700.")] {
        let words = ["sim", "--elf", "no.elf", "--field", "field.toml", "--beam-to-tool", distance];
        let message = told(&weeder(folder.path(), &words));
        assert!(message.contains(warning) && message.contains("Warning") != warning.is_empty(), "{message}");
    }
}

/// `FILE` stands for the file in arguments.
#[cfg(unix)]
const READERS: [&str; 17] = [
    "evaluate FILE",
    "trial --field FILE",
    "sweep --x speed=1..2:1 --field FILE",
    "sim --row FILE",
    "sim --capture FILE --channel-a A --channel-b B",
    "design --machine FILE",
    "settings push FILE --port uno",
    "examples push FILE --port uno",
    "train FILE",
    "classify FILE",
    "replay FILE",
    "map FILE --out map.geojson",
    "merge FILE",
    "figures --check FILE",
    "set-up --state FILE --port uno",
    "hex weeder.hex --elf FILE",
    "virtual-uno --stand --bootloader optiboot --eeprom FILE",
];

#[cfg(unix)]
#[test]
fn a_file_without_end_and_a_folder_are_refused_by_every_reader() {
    let folder = tempfile::tempdir().unwrap();
    for file in ["/dev/zero", "/"] {
        for command in READERS {
            let arguments: Vec<&str> =
                command.split(' ').map(|word| if word == "FILE" { file } else { word }).collect();
            common::assert_refused(folder.path(), &arguments, file);
        }
    }
}

#[cfg(unix)]
#[test]
fn a_file_whose_name_is_no_text_is_read() {
    use std::ffi::OsStr;
    use std::os::unix::ffi::OsStrExt;
    let folder = tempfile::tempdir().unwrap();
    let name = OsStr::from_bytes(b"M\xE4rz.csv");
    let example = Path::new(env!("CARGO_MANIFEST_DIR")).join("../../docs/trial-example.csv");
    fs::copy(example, folder.path().join(name)).unwrap();
    let output = command(&["evaluate"]).current_dir(folder.path()).arg(name).output().unwrap();
    assert!(output.status.success(), "{}", told(&output));
    let output = command(&["trial", "--field"]).arg(name).output().unwrap();
    assert_has(&told(&output), ["is no UTF-8: rename the file"]);
}

#[test]
fn no_cause_is_printed_twice() {
    for words in [
        "virtual-uno --bootloader no-such.hex",
        "virtual-uno --stand --bootloader optiboot --eeprom no-such/uno.eeprom",
        "virtual-uno --stand --bootloader optiboot --link no-such/uno",
        "hex weeder.hex --elf no-such.elf",
        "replay no-such.csv",
        "settings diff no-such.toml",
        "examples push no-such.csv",
        "design --machine no-such.toml",
    ] {
        let message = told(&weeder(Path::new("."), &words.split(' ').collect::<Vec<_>>()));
        assert_eq!(message.matches("No such file or directory").count(), 1, "{words}: {message}");
    }
}

/// The cause is printed after the message. A message that includes its cause would print it twice.
#[test]
fn no_message_in_the_source_repeats_its_cause() {
    let host = Path::new(env!("CARGO_MANIFEST_DIR")).join("..");
    let mut folders = vec![host.join("../control/src")];
    for rooms in [host.clone(), host.join("../yard")] {
        let crates = std::fs::read_dir(rooms).unwrap().map(|entry| entry.unwrap().path().join("src"));
        folders.extend(crates.filter(|sources| sources.is_dir()));
    }
    let mut messages = 0;
    while let Some(folder) = folders.pop() {
        for path in std::fs::read_dir(folder).unwrap().map(|entry| entry.unwrap().path()) {
            if path.is_dir() {
                folders.push(path);
                continue;
            }
            let text = std::fs::read_to_string(&path).unwrap();
            for message in text.split("#[error(").skip(1).filter_map(|rest| rest.split(")]").next()) {
                assert!(!message.contains("{source"), "{}: {message}", path.display());
                messages += 1;
            }
        }
    }
    assert!(messages > 50, "{messages}");
}

#[test]
fn a_file_s_text_cannot_control_the_terminal() {
    let wires = "$timescale 1 us $end\n$var wire 1 ! A\u{1b}[2J $end\n$enddefinitions $end\n#0 0!\n";
    let folder = folder_with("logic.vcd", wires);
    let log = "time_ms,kind,line\n0,connected,0.2.0\n0,setting,k\u{1b}[2J=3\n";
    fs::write(folder.path().join("log.csv"), log).unwrap();
    for (arguments, quoted) in [
        (&["sim", "--capture", "logic.vcd", "--channel-a", "A", "--channel-b", "B"][..], r"`A\u{1b}[2J`"),
        (&["replay", "log.csv"], r"`k\u{1b}[2J=3`"),
    ] {
        common::assert_refused(folder.path(), arguments, quoted);
        let message = weeder(folder.path(), arguments).stderr;
        assert!(!message.contains(&0x1B), "{}", String::from_utf8_lossy(&message));
    }
}
