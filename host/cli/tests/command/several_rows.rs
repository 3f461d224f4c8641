//! The host tools with several rows, as a user runs them, with virtual Unos at their ports.

use crate::common::{Running, command, printed, typed};
use std::fs;
use std::path::{Path, PathBuf};
use std::process::{Output, Stdio};
use std::thread::sleep;
use std::time::Duration;
use tempfile::TempDir;
use uno_run::firmware;
use uno_run::live::Setup;
use uno_run::live::rows::{Background, LiveRows, Mishap};

/// Standing rows. A folder has links to their ports: `row0` and so on.
fn rows(folder: &TempDir, count: usize) -> Background {
    let elf = firmware::build().expect("the firmware builds");
    let setup =
        |number| Setup { elf: Some(elf.clone()), link: Some(port(folder, number)), fast: true, ..Setup::default() };
    LiveRows::start((0..count).map(setup).collect()).expect("they start").run_in_background()
}

fn port(folder: &TempDir, number: usize) -> PathBuf {
    folder.path().join(format!("row{number}"))
}

/// A file with the names of these rows.
fn named(folder: &TempDir, count: usize) -> String {
    let file = folder.path().join("rows.toml");
    let file = file.to_str().expect("it is text").to_owned();
    for number in 0..count {
        let path = port(folder, number);
        let name = ["left", "middle", "right"][number];
        let said =
            printed(&weeder(&["rows", "name", name, path.to_str().expect("it is text"), "--rows-file", &file], ""), 0);
        assert!(said.starts_with(&format!("{name} is the board at {}", path.display())), "{said}");
    }
    file
}

fn weeder(words: &[&str], input: &str) -> Output {
    typed(&mut command(words), input)
}

#[test]
fn rows_are_named_listed_renamed_and_forgotten() {
    let folder = TempDir::new().expect("there is room for a folder");
    let _rows = rows(&folder, 2);
    let file = named(&folder, 2);
    let list = printed(&weeder(&["rows", "--rows-file", &file], ""), 0);
    assert!(list.contains("left") && list.contains("middle") && list.contains("row1"), "{list}");
    let said = weeder(&["rows", "name", "hedge", port(&folder, 1).to_str().unwrap(), "--rows-file", &file], "");
    assert!(printed(&said, 0).contains("middle is forgotten: it was this board\nhedge is "));
    let json = printed(&weeder(&["rows", "--json", "--rows-file", &file], ""), 0);
    let json: serde_json::Value = serde_json::from_str(&json).expect("it is JSON");
    let names: Vec<&str> = json.as_array().unwrap().iter().filter_map(|row| row["name"].as_str()).collect();
    assert_eq!(names, ["left", "hedge"]);
    printed(&weeder(&["rows", "forget", "left", "--rows-file", &file], ""), 0);
    let error = printed(&weeder(&["rows", "forget", "left", "--rows-file", &file], ""), 2);
    assert!(error.contains("has no row left: it has hedge"), "{error}");
    let error = printed(&weeder(&["rows", "name", "left", "/dev/no-such-port", "--rows-file", &file], ""), 2);
    assert!(error.contains("there is no port /dev/no-such-port: `weeder rows` lists"), "{error}");
    let error = printed(&weeder(&["settings", "pull", "x", "--all", "--rows-file", "no-such.toml"], ""), 2);
    assert!(error.contains("there is no no-such.toml: `weeder rows name` makes it"), "{error}");
}

#[test]
fn settings_of_several_rows_are_pulled_pushed_and_compared() {
    let folder = TempDir::new().expect("there is room for a folder");
    let machine = rows(&folder, 3);
    let file = named(&folder, 3);
    let all = ["--all", "--rows-file", &file];
    let kept = folder.path().join("kept");
    let kept = kept.to_str().expect("it is text");
    let with = |words: &[&str]| weeder(&[words, &all].concat(), "");
    printed(&weeder(&[&["monitor", "--plain"], &all[..]].concat(), "clear\n"), 0);

    let pulled = printed(&with(&["settings", "pull", kept]), 0);
    assert!(pulled.contains("left: The machine's settings are in ") && pulled.contains("right.toml"), "{pulled}");
    let right = Path::new(kept).join("right.toml");
    let text = fs::read_to_string(&right).expect("each has a file");
    fs::write(&right, text.replace("wheel_mm = 400", "wheel_mm = 405")).expect("it can be written");
    let differs = printed(&with(&["settings", "diff", kept]), 1);
    assert!(
        differs.contains("left: The machine has the settings of ") && differs.contains("right: not as in"),
        "{differs}"
    );
    let pushed = printed(&with(&["settings", "push", kept]), 0);
    assert!(
        pushed.contains("middle: The machine has these settings already\nmiddle: All settings are saved\n"),
        "{pushed}"
    );
    assert!(pushed.contains("right: Set: wheel_mm\n"), "{pushed}");
    let one = |port: &str| weeder(&["settings", "push", kept, "--port", port, "--rows-file", &file], "");
    assert!(printed(&one("right"), 0).starts_with("The machine has these settings already\n"));
    let error = printed(&one(&format!("hedge={}", port(&folder, 2).display())), 2);
    assert!(error.contains("kept is a folder: name a file"), "{error}");
    let json = printed(&with(&["settings", "pull", "--json"]), 0);
    let json: serde_json::Value = serde_json::from_str(&json).expect("it is JSON");
    assert_eq!([&json["left"]["wheel_mm"], &json["right"]["wheel_mm"]], [400, 405]);

    // One row is unplugged. The others succeed, and the output names it.
    machine.happen(1, Mishap::Unplugged);
    while port(&folder, 1).exists() {
        sleep(Duration::from_millis(10));
    }
    let one = folder.path().join("one.toml");
    fs::write(&one, "k = 5\n").expect("it can be written");
    let pushed = printed(&with(&["settings", "push", one.to_str().unwrap()]), 2);
    assert!(pushed.contains("left: Set: k\n") && pushed.contains("right: Set: k\n"), "{pushed}");
    assert!(
        pushed.contains("error: middle: there is no port ") && pushed.contains("1 of 3 rows failed: middle"),
        "{pushed}"
    );
    let differs = printed(&with(&["settings", "diff", one.to_str().unwrap()]), 2);
    assert!(differs.contains("left: The machine has the settings of "), "{differs}");
}

#[test]
fn examples_take_a_row_s_name() {
    let folder = TempDir::new().expect("there is room for a folder");
    let _rows = rows(&folder, 1);
    let file = named(&folder, 1);
    let with = |words: &[&str], port: &str| weeder(&[words, &["--port", port, "--rows-file", &file]].concat(), "");
    assert_eq!(printed(&with(&["examples", "pull", "--json"], "left"), 0), "[]\n");
    let error = printed(&with(&["examples", "pull", "--json"], "right"), 2);
    assert!(error.contains("there is no port right"), "{error}");
}

#[test]
fn of_several_rows_the_one_that_is_named_has_the_receiver_in_its_record() {
    let folder = TempDir::new().expect("there is room for a folder");
    let _rows = rows(&folder, 2);
    let file = named(&folder, 2);
    let sentences = folder.path().join("gps.nmea");
    fs::write(&sentences, "$GPGGA,092750.000,5321.6802,N,00630.3372,W,1,8,1.03,61.7,M,55.2,M,,*76\n").unwrap();
    let (logs, sentences) = (folder.path().join("field"), sentences.display().to_string());
    let record = |gps: &str| {
        let mut record = command(&["record", "--all", "--rows-file", &file, "--gps", gps, "--out"]);
        record.arg(&logs);
        record
    };
    for (gps, right) in [
        (sentences.clone(), "with several rows, name the row that records the receiver, as in `--gps left|middle="),
        (format!("right={sentences}"), "there is no row right: there are left, middle"),
    ] {
        let error = printed(&record(&gps).output().expect("it ends"), 2);
        assert!(error.contains(right) && !logs.exists(), "{error}");
    }
    let mut recording = Running::start(record(&format!("middle={sentences}")).stderr(Stdio::null()));
    let text = |name: &str| fs::read_to_string(logs.join(format!("{name}.csv"))).unwrap_or_default();
    let ends = || text("middle").matches("the file ends here").count();
    let is_written = || text("middle").contains(",gps,") && ends() > 0 && text("left").contains(",status,");
    while !is_written() {
        assert_eq!(recording.0.try_wait().expect("it is a child"), None, "it goes on");
        sleep(Duration::from_millis(50));
    }
    recording.interrupt();
    assert!(text("middle").contains(",antenna,") && !text("left").contains("gps"), "{}", text("left"));
    assert_eq!(ends(), 1, "{}", text("middle"));
}

#[test]
fn the_plain_monitor_types_to_one_row_or_all_and_prints_each_answer() {
    let folder = TempDir::new().expect("there is room for a folder");
    let _rows = rows(&folder, 2);
    let [left, right] = [0, 1].map(|number| port(&folder, number).display().to_string());
    let ports = ["--port", &format!("left={left}"), "--port", &format!("right={right}")].map(str::to_owned);
    let words: Vec<&str> = ["monitor", "--plain"].into_iter().chain(ports.iter().map(String::as_str)).collect();
    // By itself: behind lines whose answers a busy computer delays, it goes first.
    let held = printed(&weeder(&words, "hold\n"), 0);
    assert!(held.contains("HOLD 2 of 2 in ") && held.contains(" last\n"), "{held}");
    let said = printed(&weeder(&words, "Left: set k 5\nALL: get k\nversion\n"), 0);
    assert!(said.contains("left: ok\n") && said.contains("right: weeder "), "{said}");
    assert!(said.contains("left: k=5 ") && said.contains("right: k=3 "), "{said}");
    let refused = printed(&weeder(&words, "right: launch\n"), 1);
    assert!(refused.contains("right: error:") && !refused.contains("left: error:"), "{refused}");
    let unknown = printed(&weeder(&words, "hedge: hold\n"), 2);
    assert!(unknown.contains("there is no row hedge: there are left, right"), "{unknown}");
    let twice = printed(&weeder(&["monitor", "--plain", "--port", &left, "--port", &left], ""), 2);
    assert!(twice.contains("two machines are called row0: name them"), "{twice}");
    let none = printed(&weeder(&["monitor", "--plain", "--port", "/no/a", "--port", "/no/b"], ""), 2);
    assert!(none.contains("a: there is no port /no/a") && none.contains("none of the 2 rows is there"), "{none}");
}

#[test]
fn each_row_has_its_own_log_and_a_replugged_row_is_only_in_its_own() {
    let folder = TempDir::new().expect("there is room for a folder");
    let machine = rows(&folder, 3);
    let file = named(&folder, 3);
    let logs = folder.path().join("field");
    let out = logs.to_str().expect("it is text");
    machine.happen(2, Mishap::Unplugged);
    while port(&folder, 2).exists() {
        sleep(Duration::from_millis(10));
    }
    let mut weeder = command(&["record", "--out", out, "--all", "--rows-file", &file]);
    let mut weeder = Running::start(weeder.stderr(Stdio::piped()));
    let text = |name: &str| fs::read_to_string(logs.join(format!("{name}.csv"))).unwrap_or_default();
    // Waits for lines in a log. The test runner has the time limit.
    let wait_for = |name: &str, what: &str, count: usize| {
        for _ in 0..2400 {
            if text(name).matches(what).count() >= count {
                return;
            }
            sleep(Duration::from_millis(50));
        }
        panic!("the log of {name} does not show {what} {count} times: {:?}", text(name));
    };
    for name in ["left", "middle"] {
        wait_for(name, ",status,", 3);
    }
    wait_for("right", ",lost,\"there is no port ", 1);
    machine.happen(2, Mishap::PluggedIn);
    wait_for("right", ",status,", 3);
    machine.happen(0, Mishap::Unplugged);
    wait_for("left", ",lost,the port is gone", 1);
    machine.happen(0, Mishap::PluggedIn);
    wait_for("left", ",connected,", 2);
    weeder.signal("-INT");
    let told = std::io::read_to_string(weeder.0.stderr.take().expect("it is piped")).expect("it is text");
    assert_eq!(weeder.0.wait().expect("it ends").code(), Some(0), "{told}");
    assert!(told.contains("left: the port is gone") && !told.contains("middle: the port"), "{told}");
    assert!(!text("middle").contains(",lost,") && text("middle").matches(",connected,").count() == 1);
    for name in ["left", "middle", "right"] {
        assert!(told.contains(&format!("{name}.csv has ")), "{told}");
        let log = logs.join(format!("{name}.csv"));
        let replayed = command(&["replay"]).arg(&log).output().expect("it ends");
        assert!(matches!(replayed.status.code(), Some(0 | 1)), "{replayed:?}");
    }
}
