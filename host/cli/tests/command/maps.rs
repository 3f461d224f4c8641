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
