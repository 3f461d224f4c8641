//! Alarms while a machine is set up: each is shown with its advice, and cleared only after a question.

use super::{answered, folder_with_uno, lead, type_to, uno};
use crate::common::{command, typed};
use std::path::Path;
use tempfile::TempDir;

/// Types these lines in `weeder monitor`. Returns its output.
fn monitored(folder: &Path, lines: &str) -> String {
    let mut monitor = command(&["monitor", "--plain", "--port", "./uno"]);
    String::from_utf8_lossy(&typed(monitor.current_dir(folder), lines).stdout).into_owned()
}

#[test]
fn no_alarm_is_cleared_without_a_question() {
    let (folder, _uno) = folder_with_uno(&["--no-reset"]);
    let stopped = answered(folder.path(), &["q"]);
    assert!(stopped.contains("alarm 5-1 settings_lost. If a file has them, type q."), "{stopped}");
    // The switch is open, and the tool is out: a stuck tool.
    let said = monitored(folder.path(), "status\nsave\nclear\nset end_switch on\nset lead_out_ms 10\n");
    assert!(said.contains("code=5-1"), "the alarm has stayed");
    let stopped = answered(folder.path(), &["q"]);
    assert!(stopped.contains("alarm 4-1 tool_stuck: stop;"), "{stopped}");
    assert!(monitored(folder.path(), "status\n").contains("code=4-1"), "the alarm has stayed");
}

#[test]
fn an_end_switch_that_is_not_there_is_set_off_when_its_alarm_comes() {
    let (folder, _uno) = folder_with_uno(&[]);
    let mut questions = 0;
    let said = lead(folder.path(), &["--port", "./uno"], |text, keyboard| {
        if text.contains("and clear the alarm [go on]") {
            type_to(keyboard, "\ns\ns\ns\ns\ns\non");
        } else if text.contains("and use the end switch: on, off [on]") {
            type_to(keyboard, "off");
        } else if text.contains("Keep clear of the tool [go on]") {
            questions += 1;
            // The alarm comes while the first question waits.
            if questions == 2 {
                type_to(keyboard, "q");
            }
        }
    });
    assert!(said.contains("alarm 4-1 tool_stuck: stop; look for a stone"), "{said}");
    assert_eq!(said.matches("  end_switch is set and saved").count(), 2, "{said}");
    assert!(monitored(folder.path(), "get\n").contains("end_switch=off"), "it is saved");
}

#[test]
fn the_beam_step_continues_after_an_alarm_is_cleared() {
    let folder = TempDir::new().expect("there is room for a folder");
    let (_uno, mut machine) = uno(folder.path(), &["--roll", "--link", "uno", "--speed", "5"]);
    // Narrower than its plants.
    monitored(folder.path(), "set max_width_mm 100\nsave\n");
    let mut questions = 0;
    let said = lead(folder.path(), &["--port", "./uno"], |text, keyboard| {
        if text.contains("The lines come here") {
            questions += 1;
            match questions {
                1 => type_to(&mut machine, ""),
                _ => type_to(keyboard, "q"),
            }
        } else if questions < 2 && text.contains("Clear the alarm [go on]") {
            type_to(keyboard, "");
        }
    });
    assert!(said.contains("alarm 1-1 beam_blocked: clear, clean and align the beam"), "{said}");
    assert!(questions == 2 && !said.contains("Step 2 of 8"), "{said}");
}
