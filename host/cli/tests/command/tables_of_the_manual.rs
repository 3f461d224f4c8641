//! The parts of the manual that follow from the code: every setting, the advice for every alarm, the
//! simulated field, and the classifier's figures in the output of `weeder figures`.
//!
//! `UPDATE_EXPECT=1 cargo test -p weeder-cli --test command tables` updates them.

use control::alarm::{Alarm, Warning};
use control::settings::Setting;
use expect_test::{ExpectFile, expect_file};
use field::conditions::{Conditions, Parameter};
use field::wiring::{self, WIRES};
use link::settings::{help, name, unit};
use link::{EVENTS, LineDescription, STATUS, ValueDescription, advice};
use std::fmt::Write;
use std::fs;
use std::path::Path;
use study::evaluation::published;
use svg::node::element::tag::Type;
use svg::parser::Event;

/// The page with the part between `<!-- name -->` and `<!-- name end -->` replaced.
#[track_caller]
fn with_part(page: &ExpectFile, name: &str, part: &str) -> String {
    let (begin, end) = (format!("<!-- {name} -->\n"), format!("<!-- {name} end -->"));
    let text = page.data();
    let (before, rest) = text.split_once(&begin).unwrap_or_else(|| panic!("no {begin:?}"));
    let (_, after) = rest.split_once(&end).unwrap_or_else(|| panic!("no {end:?}"));
    [before, &begin, "\n", part, "\n", &end, after].concat()
}

fn events() -> String {
    let mut table = "| event | value | meaning |\n| --- | --- | --- |\n".to_owned();
    for LineDescription { meaning, beginning, values, .. } in EVENTS {
        let names =
            if beginning.is_empty() { "`plant`, `weed`, `unknown`".to_owned() } else { format!("`{beginning}`") };
        writeln!(table, "| {names} | | {meaning} |").expect("a string takes all");
        for value in values.iter().filter(|value| !value.key.is_empty()) {
            writeln!(table, "| | {} | {} |", key(value), value.meaning).expect("a string takes all");
        }
    }
    table
}

/// A value's key, and its words if they are few.
fn key(value: &ValueDescription) -> String {
    let words = match value.kind {
        "place" => "out\\|in",
        "answer" => "yes\\|no",
        "state" => "hold\\|work\\|alarm",
        _ => "",
    };
    format!("`{}={words}`", value.key)
}

fn status() -> String {
    let table = |line: &LineDescription| {
        let rows = line.values.iter().map(|value| format!("| {} | {} |\n", key(value), value.meaning));
        let (first, rest) = line.meaning.split_at(1);
        let heading = first.to_uppercase() + rest;
        format!("{heading}:\n\n| key | meaning |\n| --- | --- |\n{}", rows.collect::<String>())
    };
    STATUS.iter().map(table).collect::<Vec<_>>().join("\n")
}

fn texts(drawing: &str) -> Vec<(f64, f64, String)> {
    let mut texts = Vec::new();
    let mut place = None;
    for event in svg::read(drawing).expect("it is a drawing") {
        match event {
            Event::Tag("text", Type::Start, attributes) => {
                let number = |name: &str| attributes[name].parse().expect("places are numbers");
                place = Some((number("x"), number("y")));
            }
            Event::Text(text) => texts.extend(place.take().map(|(x, y)| (x, y, text.trim().to_owned()))),
            _ => {}
        }
    }
    texts
}

/// The pull-up in the wiring table that is soldered.
const EXTERNAL: &str = "4.7 k to 5 V";

/// The wiring table: contact, the other side, pull-up and note.
fn connections() -> Vec<[String; 4]> {
    let page = expect_file!["../../../../docs/build.md"].data();
    let (_, table) = page.split_once("| Uno | goes to | pull-up | notes |\n").expect("the table is there");
    let row = |row: &str| row.split('|').map(|cell| cell.trim().to_owned()).collect::<Vec<_>>();
    let rows = table.lines().skip(1).take_while(|line| line.starts_with('|')).map(row);
    rows.map(|row| row[1..5].to_vec().try_into().expect("four cells")).collect()
}

#[test]
fn the_wiring_diagram_shows_the_pins_and_pull_ups_of_the_pin_table() {
    /// Contacts are named left of the board's edge. Below is the optocoupler, which has no other contact.
    const BOARD_EDGE_X: f64 = 250.0;
    const BOARD_END_Y: f64 = 616.0;
    let texts = texts(&expect_file!["../../../../docs/wiring.svg"].data());
    let on_board = texts.iter().filter(|(x, y, _)| *x < BOARD_EDGE_X && *y < BOARD_END_Y);
    let is_pin = |text: &&String| text.strip_prefix('D').is_some_and(|number| number.parse::<u8>().is_ok());
    let pins: Vec<&String> = on_board.map(|(_, _, text)| text).filter(is_pin).collect();
    let connections = connections();
    let wired = connections.iter().map(|[contact, ..]| contact).filter(|contact| *contact != "D0, D1");
    assert_eq!(pins, wired.collect::<Vec<_>>());
    let drawn = texts.iter().filter(|(_, y, text)| *y < BOARD_END_Y && text == "4.7 k").count();
    assert_eq!(drawn, connections.iter().filter(|[.., pull_up, _]| pull_up == EXTERNAL).count());
}

#[test]
fn the_wokwi_project_has_the_pins_and_pull_ups_of_the_pin_table() {
    let file = concat!(env!("CARGO_MANIFEST_DIR"), "/../../wokwi/diagram.json");
    let text = std::fs::read_to_string(file).expect("it is there");
    let diagram: serde_json::Value = serde_json::from_str(&text).expect("it is JSON");
    let ends = |connection: &serde_json::Value| [0, 1].map(|end| connection[end].as_str().expect("a text").to_owned());
    let wires: Vec<[String; 2]> = diagram["connections"].as_array().expect("a list").iter().map(ends).collect();
    let has = |one: &str, other: &str| {
        wires.iter().any(|[a, b]| (a.as_str(), b.as_str()) == (one, other) || (b.as_str(), a.as_str()) == (one, other))
    };
    let (mut drawn, connections) = (Vec::new(), connections());
    for (pin, part) in [
        (wiring::ENCODER_A, "encoder:CLK"),
        (wiring::ENCODER_B, "encoder:DT"),
        (wiring::WORK_SWITCH, "work:2"),
        (wiring::END_SWITCH, "end:1.l"),
        (wiring::BEAM, "beam:1.l"),
        (wiring::SERVO, "servo:PWM"),
        (wiring::SECOND_BEAM, "second-beam:1.l"),
    ] {
        let contact = format!("uno:{}", pin.number());
        assert!(has(&contact, part), "{contact} does not go to {part}");
        drawn.push(contact);
        // The knob drives both of its lines.
        let [.., pull_up, _] = connections.iter().find(|[of, ..]| *of == pin.to_string()).expect("it is one");
        if pull_up == EXTERNAL && !part.starts_with("encoder") {
            let resistor = part.replace(":1.l", "-pull-up");
            assert!(has(drawn.last().expect("it is there"), &format!("{resistor}:1")), "{resistor}");
            assert!(has("uno:5V", &format!("{resistor}:2")), "{resistor}");
            let parts = diagram["parts"].as_array().expect("a list");
            let part = parts.iter().find(|part| part["id"] == resistor.as_str()).expect("it is a part");
            assert_eq!(part["attrs"]["value"], "4700");
        }
    }
    // No other pin of the Uno is connected.
    let is_pin = |end: &&String| end.strip_prefix("uno:").is_some_and(|pin| pin.parse::<u8>().is_ok());
    assert!(wires.iter().flatten().filter(is_pin).all(|end| drawn.contains(end)), "{wires:?}");
}

#[test]
fn the_drawing_of_the_arm_has_the_measures_of_the_simulated_machine() {
    let machine = Conditions::preset("walked").expect("there is one").expect("it is right").machine(0);
    let degrees = machine.servo.stroke_degrees();
    let (sin, cos) = degrees.to_radians().sin_cos();
    let texts: Vec<String> =
        texts(&expect_file!["../../../../docs/arm.svg"].data()).into_iter().map(|(.., text)| text).collect();
    for measure in [
        format!("arm {} mm", machine.arm_mm),
        format!("{degrees}° = {} us", machine.servo.out_us - machine.servo.in_us),
        format!("{:.0} mm aside", machine.arm_mm * sin),
        format!("{:.0} mm higher", machine.arm_mm * (1.0 - cos)),
        format!("tool {} mm", machine.tool_width_mm),
        format!("beam to tool {} mm", machine.beam_to_tool_mm),
        format!("{} mm", machine.second_beam_mm),
    ] {
        assert!(texts.contains(&measure), "{measure} is not in {texts:?}");
    }
}

#[test]
fn the_wiring_table_has_the_wires_of_the_simulated_machine() {
    let wires = WIRES.map(|wire| wire.pin.to_string());
    let contacts: Vec<String> = connections().into_iter().map(|[contact, ..]| contact).collect();
    assert_eq!(contacts, [&wires[..], &["D0, D1".to_owned()]].concat());
}

#[test]
fn the_manual_and_the_page_name_no_pin_without_a_wire() {
    let wired = WIRES.map(|wire| wire.pin.to_string());
    let is_free = |pin: &&str| !["D0", "D1"].contains(pin) && !wired.iter().any(|wired| wired == pin);
    let is_pin = |word: &&str| word.strip_prefix('D').is_some_and(|number| number.parse::<u8>().is_ok());
    for folder in ["docs", "page/src/words"] {
        let folder = Path::new(env!("CARGO_MANIFEST_DIR")).join("../..").join(folder);
        for path in fs::read_dir(folder).expect("it is there").map(|entry| entry.expect("it is listed").path()) {
            // The tester has pins of its own.
            let is_text = path.extension().is_some_and(|end| end == "md" || end == "json" || end == "ts");
            if is_text && !path.ends_with("check-board.md") {
                let text = fs::read_to_string(&path).expect("it is text");
                let mut words = text.split(|c: char| !c.is_alphanumeric());
                assert_eq!(words.find(|word| is_pin(word) && is_free(word)), None, "{}", path.display());
            }
        }
    }
    let drawn = texts(&expect_file!["../../../../docs/wiring.svg"].data());
    assert!(!drawn.iter().any(|(.., text)| is_pin(&text.as_str()) && is_free(&text.as_str())), "{drawn:?}");
}

#[test]
fn the_settings_page_is_the_settings_table() {
    let page = expect_file!["../../../../docs/settings.md"];
    page.assert_eq(&with_part(&page, "settings", &settings()));
}

#[test]
fn the_events_page_is_the_table_of_events() {
    let page = expect_file!["../../../../docs/events.md"];
    page.assert_eq(&with_part(&page, "events", &events()));
}

#[test]
fn the_status_in_the_console_s_page_is_its_table() {
    let page = expect_file!["../../../../docs/console.md"];
    page.assert_eq(&with_part(&page, "status", &status()));
}

#[test]
fn the_simulated_field_s_page_is_the_table_of_its_parameters() {
    let page = expect_file!["../../../../docs/field.md"];
    page.assert_eq(&with_part(&page, "parameters", &parameters()));
}

#[test]
fn the_settings_to_set_first_have_the_defaults_that_the_manual_gives() {
    let page = expect_file!["../../../../docs/settings.md"].data();
    let (_, rest) = page.split_once("## Set these first\n").expect("there is such a part");
    let (first, _) = rest.split_once("\n## ").expect("another follows");
    let mut found = 0;
    for line in first.lines() {
        let mut cells = line.trim_matches('|').split('|').map(str::trim);
        let (Some(names), Some(defaults)) = (cells.next(), cells.next()) else { continue };
        for (cell, default) in names.split(", ").zip(defaults.split(", ")) {
            let setting = Setting::all().find(|&setting| cell == format!("`{}`", name(setting)));
            let Some(setting) = setting else { continue };
            assert_eq!(default, setting.default().to_string(), "{line}");
            found += 1;
        }
    }
    assert_eq!(found, 5, "the five to set first");
}

#[test]
fn the_faults_page_has_the_monitor_s_advice() {
    let page = expect_file!["../../../../docs/faults.md"].data();
    let alarms = (0..)
        .map_while(Alarm::from_index)
        .map(|alarm| (format!("| `{}` |", advice::name(alarm)), advice::alarm(alarm)));
    let warnings = (0..).map_while(Warning::from_index).map(|warning| {
        let name = warning.text().bytes().map(char::from).collect::<String>();
        (format!("| `{name}` (warning) |"), advice::warning(warning))
    });
    for (begin, advice) in alarms.chain(warnings) {
        let row = page.lines().find(|line| line.starts_with(&begin)).unwrap_or_else(|| panic!("no row {begin}"));
        assert!(row.ends_with(&format!(" | {advice} |")), "{row}: {advice}");
    }
}

#[test]
fn the_classifier_s_page_has_the_figures_of_the_bench() {
    let page = expect_file!["../../../../knn/README.md"];
    let table = cycles(&expect_file!["../../../../docs/figures.md"].data());
    assert_eq!(table.lines().count(), 2 + 5, "{table}");
    page.assert_eq(&with_part(&page, "cycles", &table));
}

/// The classifier's searches among random examples, from the page of figures, as a table in Markdown.
fn cycles(figures: &str) -> String {
    let mut table = "| examples | fewest | mean | most |\n| --- | --- | --- | --- |\n".to_owned();
    for line in figures.lines() {
        let words: Vec<&str> = line.trim_matches('│').split_whitespace().collect();
        if let [examples, "random", "examples,", "k", "=", "3", fewest, mean, most] = words.as_slice() {
            writeln!(table, "| {examples} | {fewest} | {mean} | {most} |").expect("a string takes everything");
        }
    }
    table
}

#[test]
fn the_page_of_the_blinking_led_has_every_code_with_advice() {
    let page = expect_file!["../../../../docs/blinking-led.md"].data();
    let rows: Vec<&str> =
        page.lines().filter(|line| line.starts_with("| ") && line[2..].starts_with(char::is_numeric)).collect();
    let alarms: Vec<Alarm> = (0..).map_while(Alarm::from_index).collect();
    assert_eq!(rows.len(), alarms.len());
    for alarm in alarms {
        let ((first, second), advice) = (alarm.code(), advice::alarm(alarm));
        let row = rows.iter().find(|row| row.starts_with(&format!("| {first}-{second} |")));
        assert!(row.is_some_and(|row| row.ends_with(&format!(" | {advice} |"))), "{first}-{second}: {row:?}, {advice}");
    }
}

#[test]
fn the_result_in_the_readme_is_that_of_the_figures() {
    let figures = expect_file!["../../../../docs/figures.md"].data();
    let command = "weeder trial --speeds 1,1.5,2,2.5,3,4 --replications 60";
    let (_, trial) =
        figures.split_once(&format!("<!-- figures: {command} -->")).expect("a trial of the set-up machine");
    // The first line of this speed and controller is of plants, the second of ground.
    let cells = |controller: &str, table: usize| -> Vec<&str> {
        let lines = trial.lines().map(|line| line.trim_matches(['│', ' ']));
        let line = lines.filter(|line| line.starts_with("2.5 ") && line.contains(controller)).nth(table);
        let line = line.unwrap_or_else(|| panic!("no line of {controller}"));
        line.split("  ").map(str::trim).filter(|cell| !cell.is_empty()).skip(2).collect()
    };
    // The first share with an interval is that of the plants that a beam sees.
    let of = |controller: &str| {
        let damaged = cells(controller, 0).into_iter().find(|cell| cell.contains(" (")).expect("a share of the plants");
        (damaged, cells(controller, 1)[0].split_whitespace().next().unwrap_or_default())
    };
    let ((damaged, weeded), (damaged_there, weeded_there)) = (of("this firmware"), of("paper's controller"));
    let split = |damaged: &str| -> (String, String) {
        let (share, interval) = damaged.trim_end_matches(')').split_once(" (").expect("an interval");
        (share.to_owned(), interval.to_owned())
    };
    let ((damaged, interval), (damaged_there, _)) = (split(damaged), split(damaged_there));
    let (lowest, highest) = published::DAMAGED_PERCENT;
    let kind = if interval.contains(" to ") { "two-sided 95 % interval" } else { "one-sided 95 % bound" };
    let sentence = format!(
        "In simulated rows at 2.5 km/h, this firmware weeded {weeded} % of the row's ground. Of the plants that its beam sees, it \
         damaged {damaged} %\n({interval} %, a {kind}). The paper's program on the same machine weeded {weeded_there} % and \
         damaged {damaged_there} %. On its own machine\nthe paper measured {lowest} to {highest} %. `{command}` prints these figures.\n"
    );
    let page = expect_file!["../../../../README.md"];
    page.assert_eq(&with_part(&page, "result", &sentence));
}

/// Every parameter of the simulated field as a list in Markdown.
fn parameters() -> String {
    let mut list = String::new();
    for (parameter, default) in Conditions::default().values() {
        let Parameter { name, meaning, source, .. } = parameter;
        let quoted = |words: String| match parameter.words {
            [] => words,
            _ => words.split(" or ").map(|word| format!("\"{word}\"")).collect::<Vec<_>>().join(" or "),
        };
        let (default, range) = (quoted(parameter.written(default)), quoted(parameter.range()));
        writeln!(list, "- `{name}` = {default} ({range}): {meaning}. Source: {source}.")
            .expect("a string takes everything");
    }
    list
}

/// Every setting in two tables in Markdown: its meaning, and its values.
fn settings() -> String {
    let mut meanings = "| name | what it is |\n| --- | --- |\n".to_owned();
    let mut values =
        "| name | unit | from | to | default | set in |\n| --- | --- | --- | --- | --- | --- |\n".to_owned();
    for setting in Setting::all() {
        let shown = |value: u16| match (setting.is_switched(), value) {
            (true, 0) => "off".to_owned(),
            (true, _) => "on".to_owned(),
            (false, _) => value.to_string(),
        };
        let (name, unit, help) = (name(setting), unit(setting), help(setting));
        let (least, greatest, default) = (shown(setting.least()), shown(setting.greatest()), shown(setting.default()));
        let set_in = if setting.is_hold_only() { "hold" } else { "any state" };
        writeln!(meanings, "| `{name}` | {help} |").expect("a string takes everything");
        writeln!(values, "| `{name}` | {unit} | {least} | {greatest} | {default} | {set_in} |")
            .expect("a string takes everything");
    }
    format!("{meanings}\n{values}")
}
