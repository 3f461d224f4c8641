//! Tests that the manual's wires are those of both firmwares, and that the reports have the check's form.

use check_board::plan::line;
use check_board::report::Report;
use expect_test::expect_file;
use field::wiring;
use tester_core::pins::{Line, WIRES};
use uno::Pin;

#[test]
fn the_page_s_table_has_every_wire() {
    let page = include_str!("../../../../docs/check-board.md");
    let (_, behind) = page.split_once("<!-- tester wires -->\n\n").expect("there is a table");
    let (table, _) = behind.split_once("\n\n<!-- tester wires end -->").expect("it ends");
    let row = |wire: &tester_core::pins::Wire| format!("| {} | {} | {} |", wire.name, wire.tester, wire.weeder);
    let rows: Vec<String> = WIRES.iter().map(row).collect();
    let found: Vec<&str> = table.lines().skip(2).collect();
    assert_eq!(found, rows);
}

#[test]
fn every_wire_leads_to_the_pin_that_the_weeder_has_it_at() {
    let pins = [
        ("encoder A", wiring::ENCODER_A),
        ("encoder B", wiring::ENCODER_B),
        ("beam", wiring::BEAM),
        ("second beam", wiring::SECOND_BEAM),
        ("end switch", wiring::END_SWITCH),
        ("work switch", wiring::WORK_SWITCH),
        ("LED", wiring::LED),
        ("servo", wiring::SERVO),
    ];
    for (name, pin) in pins {
        let wire = WIRES.iter().find(|wire| wire.name == name).expect("it is wired");
        assert_eq!(wire.weeder, pin.to_string(), "{name}");
    }
    // The lines of port C, in the order of its bits.
    for (number, driven) in Line::ALL.into_iter().enumerate() {
        let (wire, pin) = (WIRES[number], Pin::ALL[14 + number]);
        let weeder = Pin::ALL.into_iter().find(|pin| pin.to_string() == wire.weeder).expect("it is a pin");
        assert_eq!((driven.bit(), wire.tester, line(weeder)), (1 << number, pin.to_string().as_str(), Some(driven)));
    }
}

#[test]
fn every_report_of_a_board_has_the_report_s_form() {
    let folder = concat!(env!("CARGO_MANIFEST_DIR"), "/../../reports");
    for entry in std::fs::read_dir(folder).expect("there is a folder") {
        let path = entry.expect("it is listed").path();
        if path.ends_with("README.md") {
            continue;
        }
        let json = std::fs::read_to_string(&path).expect("it is text");
        let report = Report::parse(&json).unwrap_or_else(|error| panic!("{}: {error}", path.display()));
        assert!(report.checked == "boards" && !report.board.is_empty(), "{}: which board?", path.display());
    }
}

#[test]
fn the_drawing_has_every_wire() {
    expect_file!["../../../../docs/check-board.svg"].assert_eq(&(check_board::drawing::wires().to_string() + "\n"));
}
