//! `weeder map` with small records.

use crate::common::{assert_has, printed, said, weeder};
use std::fs;

#[test]
fn records_with_the_same_file_name_have_their_paths_on_the_map() {
    let folder = tempfile::tempdir().unwrap();
    let logs = ["monday/left.csv", "tuesday/left.csv", "tuesday/right.csv"];
    for log in logs {
        let log = folder.path().join(log);
        fs::create_dir_all(log.parent().unwrap()).unwrap();
        fs::write(log, "time_ms,kind,line\n0,connected,0.2.0\n").unwrap();
    }
    let counted = said(folder.path(), &[&["map", "-o", "map.geojson", "--json"], &logs[..]].concat());
    let counted: serde_json::Value = serde_json::from_str(&counted).expect("it is JSON");
    let names: Vec<&str> = counted.as_array().unwrap().iter().filter_map(|record| record["record"].as_str()).collect();
    assert_eq!(names, ["monday/left.csv", "tuesday/left.csv", "right.csv"]);
}

#[test]
fn advice_differs_for_no_fix_and_for_no_receiver() {
    let folder = tempfile::tempdir().unwrap();
    for (lines, advice) in [
        ("0,lost,gone\n", "`weeder record --gps PORT` records a receiver"),
        ("0,gps_found,/dev/ttyUSB0\n5,gps_damaged,$GPGGA\n", "see the lines `gps_mark` and `gps_damaged`"),
    ] {
        fs::write(folder.path().join("log.csv"), format!("time_ms,kind,line\n{lines}")).unwrap();
        let output = weeder(folder.path(), &["map", "log.csv", "-o", "map.geojson", "--force"]);
        assert_has(&printed(&output, 0), [advice]);
    }
}

#[test]
fn a_record_that_was_sorted_or_named_twice_is_refused() {
    let folder = tempfile::tempdir().unwrap();
    let lines =
        ["0,connected,0.2.0", "0,setting,ticks_per_m=2000", "100,status,state=work pos=0", "150,event,state is=hold"];
    let save = |name: &str, lines: &[&str]| {
        fs::write(folder.path().join(name), format!("time_ms,kind,line\n{}\n", lines.join("\n"))).unwrap();
    };
    save("log.csv", &lines);
    fs::copy(folder.path().join("log.csv"), folder.path().join("log (1).csv")).unwrap();
    // As a table that a spreadsheet has sorted by its second column.
    save("sorted.csv", &[lines[0], lines[3], lines[1], lines[2]]);
    // A record that was continued, by a hold before the machine had answered.
    save("two days.csv", &[&lines[..], &["0,command,hold"], &lines[..]].concat());
    for (logs, refusal) in [
        (&["log.csv", "two days.csv"][..], None),
        (&["sorted.csv"], Some("sorted.csv, line 4: time_ms goes back from 150 to 0")),
        (&["log.csv", "log (1).csv"], Some("log.csv and log (1).csv have the same lines")),
    ] {
        let output = weeder(folder.path(), &[&["map", "-o", "map.geojson", "--force"], logs].concat());
        let said = String::from_utf8_lossy(&output.stderr).into_owned();
        assert_eq!(output.status.success(), refusal.is_none(), "{said}");
        assert!(said.contains(refusal.unwrap_or_default()), "{said}");
    }
}

#[test]
fn without_the_machine_s_settings_nothing_is_counted() {
    let folder = tempfile::tempdir().unwrap();
    let status = |ms: u32| format!("{ms},status,state=work tool=in pos={} speed_mm_s=0 windows=0 unseen_mm=0", ms);
    let log: String = (1..20).map(|second| status(100 * second) + "\n").collect();
    fs::write(folder.path().join("log.csv"), format!("time_ms,kind,line\n0,connected,0.2.0\n{log}")).unwrap();
    let output = weeder(folder.path(), &["map", "log.csv", "-o", "map.geojson", "--json"]);
    let said = String::from_utf8_lossy(&output.stderr).into_owned();
    let counted: serde_json::Value = serde_json::from_slice(&output.stdout).expect("it is JSON");
    assert_eq!(counted[0]["count"]["worked_m"], 0.0);
    assert!(said.contains("the log lacks the settings"), "{said}");
}

#[test]
fn damaged_lines_are_counted_and_left_out() {
    let folder = tempfile::tempdir().unwrap();
    let lines = [
        "0,connected,0.2.0",
        "0,setting,ticks_per_m=2000",
        "0,antenna,beam_ahead_mm=50000000 beam_right_mm=0 delay_ms=0",
        "100,status,state=work tool=in pos=0 speed_mm_s=0 windows=0 unseen_mm=0",
        "200,status,state=work tool=in pos=10",
        "250,event,plant pos=1010 votes=-3 spacing=1000 delay=600 hold=400 actuation=1000",
        "260,event,plant pos=110100 votes=3 spacing=1000 delay=600 hold=400 actuation=1000",
        "300,status,state=work tool=in pos=1010 speed_mm_s=0 windows=0 unseen_mm=0",
    ];
    fs::write(folder.path().join("log.csv"), format!("time_ms,kind,line\n{}\n", lines.join("\n"))).unwrap();
    let output = weeder(folder.path(), &["map", "log.csv", "-o", "map.geojson", "--json"]);
    let said = String::from_utf8_lossy(&output.stderr).into_owned();
    let counted: serde_json::Value = serde_json::from_slice(&output.stdout).expect("it is JSON");
    assert_eq!(counted[0]["count"]["plants"], 0);
    assert!(said.contains("log.csv: 4 lines left out"), "{said}");
}
