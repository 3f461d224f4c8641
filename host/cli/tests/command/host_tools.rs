//! The host tools at a pseudo terminal, as a user runs them, with the virtual Uno at its other end.

#[cfg(target_os = "linux")]
use crate::common::full_pipe;
use crate::common::{self, Running, assert_has, command, folder_with, printed, typed};
use std::fs;
use std::path::{Path, PathBuf};
use std::process::{Command, Output, Stdio};
use std::thread;
use std::time::Duration;
use uno::pty::Pty;
use uno_run::firmware;
use uno_run::live::Setup;
use uno_run::live::rows::{Background, LiveRows};

fn lines_of(log: &Path, kind: &str) -> usize {
    let text = fs::read_to_string(log).unwrap_or_default();
    text.lines().filter(|line| line.split(',').nth(1) == Some(kind)).count()
}

/// Sends a line to all clients of this receiver, until the log has this number of lines of a kind.
#[track_caller]
fn say_until(receiver: Option<&mut Pty>, log: &Path, kind: &str, count: usize) {
    const GGA: &[u8] = b"$GPGGA,092750.000,5321.6802,N,00630.3372,W,1,8,1.03,61.7,M,55.2,M,,*76\r\n";
    let mut receiver = receiver;
    for _ in 0..2000 {
        if lines_of(log, kind) >= count {
            return;
        }
        if let Some(receiver) = &mut receiver {
            receiver.write(GGA).expect("the terminal works");
        }
        thread::sleep(Duration::from_millis(50));
    }
    panic!("there is no {kind} in the log: {}", fs::read_to_string(log).unwrap_or_default());
}

#[test]
fn a_receiver_plugged_in_again_continues_in_the_record() {
    let uno = uno();
    let folder = tempfile::tempdir().expect("there is room for files");
    let [port, log, map] = ["gps", "field.csv", "field.geojson"].map(|name| folder.path().join(name));
    let plug_in = || {
        let mut receiver = Pty::open().expect("there is a pseudo terminal");
        receiver.link(&port).expect("there is room for a link");
        receiver
    };
    let mut receiver = plug_in();
    let mut record = command(&["record", "--beam-ahead", "500", "--out"]);
    record.args([&log, Path::new("--gps"), &port, Path::new("--port"), uno.path()]);
    let record = Running::start(record.stderr(Stdio::null()));
    say_until(Some(&mut receiver), &log, "gps", 3);
    drop(receiver);
    say_until(None, &log, "gps_lost", 1);
    let statuses = lines_of(&log, "status");
    say_until(None, &log, "status", statuses + 3);
    let mut receiver = plug_in();
    say_until(Some(&mut receiver), &log, "gps_found", 2);
    let sentences = lines_of(&log, "gps");
    say_until(Some(&mut receiver), &log, "gps", sentences + 3);
    record.interrupt();

    let mapped = command(&["map", "--json"]).arg(&log).arg("-o").arg(&map).output();
    let counted: serde_json::Value = serde_json::from_str(&printed(&mapped.expect("it ends"), 0)).expect("it is JSON");
    let count = |name: &str| counted[0]["count"][name].as_u64().expect("a number");
    assert_eq!((counted[0]["record"].as_str(), count("receiver_losses"), count("plants")), (Some("field.csv"), 1, 0));
    assert!(count("fixes") >= 1, "{counted}");
    let map: serde_json::Value =
        serde_json::from_str(&fs::read_to_string(&map).expect("it was written")).expect("JSON");
    assert_eq!((map["type"].as_str(), map["features"].as_array().map(Vec::len)), (Some("FeatureCollection"), Some(0)));
}

/// A virtual Uno at rest that runs at full speed.
fn uno() -> Background {
    uno_with(None)
}

/// The same, with the EEPROM in this file.
fn uno_with(eeprom: Option<PathBuf>) -> Background {
    let elf = Some(firmware::build().expect("the firmware builds"));
    let setup = Setup { elf, eeprom, fast: true, ..Setup::default() };
    LiveRows::start(vec![setup]).expect("there is a pseudo terminal").run_in_background()
}

/// Runs `weeder` with these words, then `--port` and the port, and this input.
fn weeder(words: &[&str], port: &Path, input: impl AsRef<[u8]>) -> Output {
    typed(command(words).arg("--port").arg(port), input)
}

#[test]
fn settings_are_pulled_changed_compared_and_pushed() {
    let uno = uno();
    let folder = tempfile::tempdir().expect("there is room for a file");
    let file = folder.path().join("machine.toml");
    let name = file.to_str().expect("it is text");

    printed(&weeder(&["settings", "pull", name], uno.path(), ""), 0);
    let text = fs::read_to_string(&file).expect("it was written");
    assert!(text.contains("\n# 200 to 800 mm, default 400\nwheel_mm = 400\n"), "{text}");
    // A machine that has lost its settings has the factory's.
    let lost = printed(&weeder(&["settings", "pull", name, "--force"], uno.path(), ""), 2);
    let words = ["(alarm 5-1)", "machine.toml is not replaced", "Then `clear` in `weeder monitor` ends the alarm"];
    assert_has(&lost, words);
    let same = printed(&weeder(&["settings", "diff", name], uno.path(), ""), 0);
    assert!(same.starts_with("The machine has the settings of "), "{same}");

    fs::write(&file, text.replace("wheel_mm = 400", "wheel_mm = 405 # measured")).expect("it can be written");
    let json = printed(&weeder(&["settings", "diff", name, "--json"], uno.path(), ""), 1);
    let json: serde_json::Value = serde_json::from_str(&json).expect("it is JSON");
    assert_eq!(json, serde_json::json!([{ "setting": "wheel_mm", "file": 405, "machine": 400 }]));
    let pushed = printed(&weeder(&["monitor", "--plain"], uno.path(), "clear\n"), 0);
    assert!(pushed.contains("ok\n"), "{pushed}");
    let pushed = printed(&weeder(&["settings", "push", name, "--save"], uno.path(), ""), 0);
    assert_eq!(pushed, "Set: wheel_mm\nAll settings are saved\n");
    let again = printed(&weeder(&["settings", "push", name, "--json"], uno.path(), ""), 0);
    let again: serde_json::Value = serde_json::from_str(&again).expect("it is JSON");
    assert_eq!(again, serde_json::json!({ "set": [], "saved": true }));
    // Each of these opened the port again, which resets the Uno. The saved settings are still there.
    printed(&weeder(&["settings", "diff", name], uno.path(), ""), 0);
    let json = printed(&weeder(&["settings", "pull", "--json"], uno.path(), ""), 0);
    assert!(json.contains("\"wheel_mm\": 405") && json.contains("\"end_switch\": false"), "{json}");
    let piped = printed(&weeder(&["settings", "pull", "/dev/stdout"], uno.path(), ""), 0);
    assert!(piped.contains("\nwheel_mm = 405\n"), "{piped}");
    // `--force` replaces it, and keeps its comments.
    fs::write(&file, "wheel_mm = 390 # measured\n").expect("it can be written");
    printed(&weeder(&["settings", "pull", name, "--force"], uno.path(), ""), 0);
    let text = fs::read_to_string(&file).expect("it is there");
    assert!(text.contains("wheel_mm = 405 # measured\n"), "{text}");
}

#[test]
fn examples_are_pulled_taught_to_another_machine_and_compared() {
    let (uno, other) = (uno(), uno());
    let folder = tempfile::tempdir().expect("there is room for a file");
    let [taught, again] = ["taught.csv", "again.csv"].map(|name| folder.path().join(name));
    let [taught, again] = [&taught, &again].map(|path| path.to_str().expect("it is text"));
    // A stalk, which the built-in examples classify as a weed, and two equal weeds beside it: each votes.
    let heading = "speed_mm_s,spacing_mm,delay_mm,hold_mm,actuation_mm,label\n";
    let table = format!("{heading}278,250,300,120,459,plant\n278,100,300,108,447,weed\n278,100,300,108,447,weed\n");
    fs::write(taught, &table).expect("it can be written");

    let refused = printed(&weeder(&["examples", "push", taught], uno.path(), ""), 2);
    assert!(refused.contains("1 of 3 examples") && refused.contains("--force"), "{refused}");
    let nothing = printed(&weeder(&["examples", "pull", again], uno.path(), ""), 0);
    assert!(nothing.ends_with(": 0 examples\n"), "{nothing}");
    printed(&weeder(&["examples", "diff", again], uno.path(), ""), 0);
    let pushed = printed(&weeder(&["examples", "push", taught, "--force"], uno.path(), ""), 0);
    assert_eq!(pushed, "Taught: 3. Known already: 0.\n");
    let pushed = printed(&weeder(&["examples", "push", taught, "--force", "--json"], uno.path(), ""), 0);
    let pushed: serde_json::Value = serde_json::from_str(&pushed).expect("it is JSON");
    assert_eq!(pushed, serde_json::json!({ "taught": 0, "forgotten": 0 }));

    // Each of these opened the port again, which resets the Uno.
    printed(&weeder(&["examples", "diff", taught], uno.path(), ""), 0);
    printed(&weeder(&["examples", "pull", again, "--force"], uno.path(), ""), 0);
    printed(&weeder(&["examples", "push", again, "--force"], other.path(), ""), 0);
    printed(&weeder(&["examples", "diff", taught], other.path(), ""), 0);

    fs::write(taught, table.replace("278,250", "278,400")).expect("it can be written");
    let differences = printed(&weeder(&["examples", "diff", taught], other.path(), ""), 1);
    assert!(differences.contains("in the file") && differences.contains("on the machine"), "{differences}");
    let pushed = printed(&weeder(&["examples", "push", taught, "--force", "--replace"], other.path(), ""), 0);
    assert_eq!(pushed, "Taught: 1. Known already: 2.\nForgotten: 1.\n");
    printed(&weeder(&["examples", "diff", taught], other.path(), ""), 0);

    let many: String = (0..40).map(|place| format!("278,{},300,108,447,weed\n", 60 + 10 * place)).collect();
    fs::write(taught, format!("{heading}{many}")).expect("it can be written");
    let refused = printed(&weeder(&["examples", "push", taught, "--force"], other.path(), ""), 2);
    assert!(refused.contains("room for 29 of its 32") && refused.contains("nothing was sent"), "{refused}");
    fs::write(taught, format!("{heading}278,250,300,120,459,\n")).expect("it can be written");
    let refused = printed(&weeder(&["examples", "push", taught], other.path(), ""), 2);
    assert!(refused.contains("has no labelled detection"), "{refused}");
    fs::write(taught, heading).expect("it can be written");
    let pushed = printed(&weeder(&["examples", "push", taught, "--replace"], other.path(), ""), 0);
    assert_eq!(pushed, "Taught: 0. Known already: 0.\nForgotten: 3.\n");
}

#[test]
fn invalid_examples_are_told_and_replace_no_table() {
    let folder = tempfile::tempdir().expect("there is room for files");
    let [eeprom, table] = ["uno.eeprom", "table.csv"].map(|name| folder.path().join(name));
    fs::write(&eeprom, [0; 1024]).expect("it can be written");
    let uno = uno_with(Some(eeprom));
    let name = table.to_str().expect("it is text");
    let pulled = printed(&weeder(&["examples", "pull", name], uno.path(), ""), 1);
    assert!(pulled.contains(": 0 examples\n") && pulled.contains("made 32 examples"), "{pulled}");
    printed(&weeder(&["examples", "diff", name], uno.path(), ""), 1);
    let refused = printed(&weeder(&["examples", "pull", name, "--force"], uno.path(), ""), 2);
    assert!(refused.contains("table.csv is not replaced"), "{refused}");
}

#[test]
fn pushed_settings_survive_a_reset_unless_no_save_is_given() {
    let uno = uno();
    let folder = tempfile::tempdir().expect("there is room for a file");
    let file = folder.path().join("machine.toml");
    let name = file.to_str().expect("it is text");
    let push = |text: &str, words: &[&str]| {
        fs::write(&file, text).expect("it can be written");
        printed(&weeder(&[&["settings", "push", name], words].concat(), uno.path(), ""), 0)
    };
    printed(&weeder(&["monitor", "--plain"], uno.path(), "clear\n"), 0);
    assert_eq!(push("wheel_mm = 405\n", &[]), "Set: wheel_mm\nAll settings are saved\n");
    // Opening the port is a reset.
    printed(&weeder(&["settings", "diff", name], uno.path(), ""), 0);
    let not_saved = push("wheel_mm = 410\n", &["--no-save"]);
    assert!(
        not_saved.ends_with("Not saved: the next reset takes them back, and on most Unos opening the port is one\n")
    );
    printed(&weeder(&["settings", "diff", name], uno.path(), ""), 1);
}

#[test]
fn the_settings_of_a_simulated_machine_are_not_pushed_to_a_real_one() {
    assert_not_sent(
        Path::new("."),
        "settings push paper",
        "paper is a simulated machine, and its settings hold for no other",
    );
}

/// Asserts that a command is refused, and opens no port.
#[track_caller]
fn assert_not_sent(folder: &Path, words: &str, why: &str) {
    let words: Vec<&str> = words.split(' ').chain(["--port", "/dev/no-such-port"]).collect();
    common::assert_refused(folder, &words, why);
}

#[test]
fn an_empty_or_wrong_file_is_refused_before_the_port_is_opened() {
    let folder = folder_with("empty.toml", "");
    for words in ["settings diff empty.toml", "settings push empty.toml"] {
        assert_not_sent(folder.path(), words, "names no setting: `weeder settings pull` writes them all");
    }
    let folder = folder_with("machine.toml", "k = 3\nwheel_mm = 400.5\n");
    let wrong = "line 2: wheel_mm is `400.5`: it has to be a whole number, 200 to 800 mm";
    assert_not_sent(folder.path(), "settings push machine.toml", wrong);
}

#[test]
fn a_second_virtual_uno_leaves_the_link_of_a_living_one_alone() {
    let folder = tempfile::tempdir().expect("there is room for a link");
    let link = folder.path().join("uno");
    let words = ["virtual-uno", "--stand", "--bootloader", "optiboot", "--link"];
    let (first, _) = Running::with_first_line(command(&words).arg(&link));
    let leads_to = fs::read_link(&link).expect("it is a link");
    let second = command(&words).arg(&link).output().expect("it ends");
    common::assert_fails(&second, &format!("which process {} (weeder) has", first.0.id()));
    assert_eq!(fs::read_link(&link).expect("it is a link"), leads_to);
}

#[test]
fn a_virtual_uno_prints_the_next_command() {
    let folder = tempfile::tempdir().expect("there is room for a link");
    let elf = firmware::build().expect("the firmware builds");
    let elf = elf.to_str().expect("it is text");
    let old = "/usr/share/arduino/hardware/arduino/avr/bootloaders/atmega/ATmegaBOOT_168_atmega328.hex";
    for (words, next) in [
        (&["--link", "my uno", "--elf", elf][..], "weeder monitor --port './my uno'\n"),
        (&["--link", "row", "--rows", "2", "--elf", elf], "weeder monitor --port ./row1 --port ./row2\n"),
        (&["--link", "uno", "--bootloader", "optiboot"], "weeder flash --port ./uno\n"),
        (&["--link", "uno", "--bootloader", old], "weeder flash --old-bootloader --port ./uno\n"),
    ] {
        let output = common::weeder(folder.path(), &[&["virtual-uno", "--stand", "--for", "1"], words].concat());
        assert_has(&printed(&output, 0), [&*format!("in another terminal: {next}")]);
    }
}

#[test]
fn each_row_of_a_virtual_uno_has_the_plants_of_standard_input() {
    let elf = firmware::build().expect("the firmware builds");
    let mut uno = command(&["virtual-uno", "--rows", "2", "--fast", "--for", "1", "--row", "-", "--elf"]);
    printed(&typed(uno.arg(elf), "position_mm,width_mm,kind\n500,150,plant\n"), 0);
}

#[test]
fn the_plain_monitor_answers_line_by_line_and_its_status_shows_errors() {
    let uno = uno();
    let answers = printed(&weeder(&["monitor", "--plain"], uno.path(), "version\nget k\n"), 0);
    assert!(answers.starts_with("weeder 0.2.0\nok\nk=3 "), "{answers}");
    let refused = printed(&weeder(&["monitor", "--plain"], uno.path(), "hepl\n"), 1);
    assert_eq!(refused, "error: no such command, help lists them all\n");
    let examples = weeder(&["monitor", "--plain"], uno.path(), "examples\nstatus\n");
    assert!(String::from_utf8_lossy(&examples.stdout).starts_with("built_in 0 "), "{examples:?}");
    let beside = String::from_utf8_lossy(&examples.stderr);
    assert_eq!(beside.matches("source number class, and five features").count(), 1, "{beside}");
    let wrong = weeder(&["monitor", "--plain"], uno.path(), "h\u{e4}lt\n");
    common::assert_fails(&wrong, "is no command: it has to be one line of at most 80 printable ASCII characters");
}

#[test]
fn hold_is_sent_although_a_line_before_it_is_refused() {
    let uno = uno();
    let too_long = format!("frobnicate\n{}\nhold\n", "x".repeat(100));
    let utf16: Vec<u8> = "\u{feff}version\r\nHOLD\r\n".encode_utf16().flat_map(u16::to_le_bytes).collect();
    let cases: [(&[u8], i32, usize, &str); 6] = [
        (b"status\nset margin_mm 60 # caf\xe9\nhold\nget margin_mm\n", 2, 3, "not sent: line 2"),
        (b"\xef\xbb\xbfstatus\r\nhold\r\n", 0, 2, ""),
        (b"version\rhold\r", 0, 2, ""),
        (too_long.as_bytes(), 2, 1, "not sent: line 2"),
        (b"nowhere: hold\nhold.\n\x00\xff\n", 2, 1, "not sent: line 3"),
        (&utf16, 0, 2, ""),
    ];
    for (input, status, done, words) in cases {
        let log = tempfile::tempdir().expect("there is room for a file");
        let log = log.path().join("log.csv");
        let output = weeder(&["monitor", "--plain", "--log", log.to_str().expect("it is text")], uno.path(), input);
        let printed = printed(&output, status);
        let sent = fs::read_to_string(&log).expect("it was written");
        assert!(sent.contains(",command,hold\n"), "{sent}{printed}");
        assert_eq!(printed.lines().filter(|line| *line == "ok").count(), done, "{printed}");
        assert!(printed.contains(words), "{printed}");
    }
}

#[test]
fn a_log_that_the_disk_does_not_take_keeps_no_hold_from_being_typed() {
    let uno = uno();
    let folder = tempfile::tempdir().expect("there is room for a file");
    let full_disk = "trap '' XFSZ; ulimit -f 1; exec \"$0\" \"$@\"";
    let mut monitor = Command::new("sh");
    monitor.args(["-c", full_disk, env!("CARGO_BIN_EXE_weeder"), "monitor", "--plain", "--port"]).arg(uno.path());
    let said = printed(&typed(monitor.arg("--log").arg(folder.path().join("log.csv")), "get k\nhold\n"), 2);
    assert!(said.contains("log.csv is not whole: it could not be written"), "{said}");
    assert_eq!(said.lines().filter(|line| *line == "ok").count(), 2, "{said}");
}

#[test]
fn a_session_is_logged_and_replayed() {
    let uno = uno();
    let folder = tempfile::tempdir().expect("there is room for a file");
    let log = folder.path().join("log.csv");
    let log = log.to_str().expect("it is text");
    printed(&weeder(&["monitor", "--plain", "--log", log], uno.path(), "clear\nstart now\nstatus\nhold\n"), 0);
    let text = fs::read_to_string(log).expect("it was written");
    assert!(text.starts_with("time_ms,kind,line\n") && text.contains(",event,state is=work\n"), "{text}");
    assert!(text.contains(",event,swing tool=out pos=0\n"), "{text}");
    assert_has(&common::said(folder.path(), &["replay", log]), ["0 detections, 0 alarms and 2 swings"]);
    // An existing log is continued.
    printed(&weeder(&["monitor", "--plain", "--log", log], uno.path(), ""), 0);
    assert_eq!(fs::read_to_string(log).expect("it is there").matches(",connected,").count(), 2);
}

#[test]
fn ports_logs_and_recordings_that_do_not_exist_are_named() {
    for words in [&["monitor"][..], &["monitor", "--plain"], &["settings", "pull", "x.toml"]] {
        let output = weeder(words, Path::new("/dev/no-such-port"), "");
        common::assert_fails(&output, "there is no port /dev/no-such-port: plug the Uno in");
    }
    common::assert_refused(Path::new("."), &["replay", "no-such.csv"], "no-such.csv cannot be read");
}

#[cfg(target_os = "linux")]
#[test]
fn a_terminated_virtual_uno_removes_its_link() {
    let folder = tempfile::tempdir().expect("there is room for a link");
    let link = folder.path().join("uno");
    // As after `nohup`, a signal that was ignored at the start stays ignored.
    for (signal, started, ignored) in [
        ("-INT", "--default-signal", 0),
        ("-TERM", "--default-signal", 0),
        ("-HUP", "--default-signal", 0),
        ("-INT", "--ignore-signal=HUP", 1),
        ("-TERM", "--ignore-signal=HUP", 1),
    ] {
        let mut uno = Command::new("env");
        uno.args(["--default-signal", started, env!("CARGO_BIN_EXE_weeder")]);
        uno.args(["virtual-uno", "--stand", "--bootloader", "optiboot", "--link"]).arg(&link);
        let (mut uno, line) = Running::with_first_line(&mut uno);
        assert!(link.is_symlink(), "{line}");
        let status = fs::read_to_string(format!("/proc/{}/status", uno.0.id())).expect("it runs");
        let mask = status.lines().find_map(|line| line.strip_prefix("SigIgn:\t")).expect("Linux lists them");
        assert_eq!(u64::from_str_radix(mask, 16).expect("it is a number") & 1, ignored, "SIGHUP");
        uno.signal(signal);
        assert!(uno.0.wait().expect("it ends").success(), "{signal}");
        assert!(!link.is_symlink(), "{signal} has left it behind");
    }
}

#[cfg(target_os = "linux")]
#[test]
fn a_recording_goes_on_where_its_terminal_takes_nothing() {
    let uno = uno();
    let folder = tempfile::tempdir().expect("there is room for a file");
    let log = folder.path().join("log.csv");
    let (unread, full) = full_pipe();
    let mut record = command(&["record", "--out"]);
    let recording = Running::start(record.arg(&log).arg("--port").arg(uno.path()).stderr(full));
    for _ in 0..1200 {
        if lines_of(&log, "status") >= 20 {
            break;
        }
        thread::sleep(Duration::from_millis(50));
    }
    assert!(lines_of(&log, "status") >= 20, "{:?}", fs::read_to_string(&log));
    drop(unread);
    recording.interrupt();
}

#[cfg(unix)]
#[test]
fn a_recording_survives_an_uno_that_is_unplugged_and_ends_by_ctrl_c() {
    use std::os::unix::fs::symlink;

    let folder = tempfile::tempdir().expect("there is room for a file");
    let (log, port) = (folder.path().join("log.csv"), folder.path().join("uno"));
    let first = uno();
    symlink(first.path(), &port).expect("there is room for a link");
    let record = |told: Stdio| {
        let mut record = command(&["record", "--out"]);
        Running::start(record.arg(&log).arg("--port").arg(&port).stderr(told))
    };
    let weeder = record(Stdio::null());
    // Waits for lines in the log. The test runner has the time limit.
    let wait_for = |what: &str, count: usize| {
        for _ in 0..1200 {
            if fs::read_to_string(&log).is_ok_and(|text| text.matches(what).count() >= count) {
                return;
            }
            thread::sleep(Duration::from_millis(50));
        }
        panic!("the log does not show {what} {count} times: {:?}", fs::read_to_string(&log));
    };
    wait_for(",status,", 3);
    drop(first);
    wait_for(",lost,", 1);
    let second = uno();
    fs::remove_file(&port).expect("it is there");
    symlink(second.path(), &port).expect("there is room for a link");
    wait_for(",connected,", 2);
    weeder.interrupt();
    let text = fs::read_to_string(&log).expect("it is there");
    assert!(text.ends_with('\n'));
    // A continued log counts the new lines and all lines.
    let mut weeder = record(Stdio::piped());
    wait_for(",connected,", 3);
    weeder.signal("-INT");
    let told = std::io::read_to_string(weeder.0.stderr.take().expect("it is piped")).expect("it is text");
    let (all, before) = (fs::read_to_string(&log).expect("it is there").lines().count() - 1, text.lines().count() - 1);
    let counted = format!("{} lines were added: {} has {all} now", all - before, log.display());
    assert_has(&told, [&*counted]);
}
