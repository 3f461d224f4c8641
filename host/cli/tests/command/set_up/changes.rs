//! A set-up that goes on with another part, board or lead than its file has.

use super::folder_with_uno;
use crate::common::{Running, assert_fails, assert_has, command, printed, said, typed};
use std::fs;
use std::path::Path;
use tempfile::TempDir;

/// A file of a machine whose servo is timed, with its tool on the other side than the default's.
const KEPT: &str = "# What `weeder set-up` has done and measured: it goes on from here.
board
done 1
done 2
done 3
done 6
machine intra_row.width 130
servo_in_us=1480
servo_out_us=1250
calibrated lead_out_ms=220 lead_in_ms=45 set=yes
servo_out_us=1250
calibrated lead_out_ms=230 lead_in_ms=50 set=yes
> get
servo_in_us=1480
servo_out_us=1250
lead_out_ms=230
lead_in_ms=45
";

/// Answers `weeder set-up` with these words and lines. Returns its output.
fn answered(folder: &Path, words: &[&str], lines: &str) -> String {
    printed(&typed(command(&["set-up", "--port", "./uno"]).current_dir(folder).args(words), lines), 0)
}

/// A virtual Uno with the settings of [`KEPT`], and its folder.
fn set_up_before() -> (TempDir, Running) {
    let (folder, uno) = folder_with_uno(&["--fast"]);
    fs::write(folder.path().join("set-up.txt"), KEPT).expect("there is room for a file");
    let restored = answered(folder.path(), &[], "\ns\ns\nq\n");
    let parts = ["Set the settings of set-up.txt again: yes, no [yes]: ", "Step 6 of 8, Time the servo: done"];
    assert_has(&restored, parts);
    assert!(!restored.contains("does not have"), "{restored}");
    (folder, uno)
}

fn typed_on_the_console(folder: &Path, lines: &str) {
    let mut monitor = command(&["monitor", "--plain", "--port", "./uno"]);
    printed(&typed(monitor.current_dir(folder), lines), 0);
}

#[test]
fn a_lead_that_was_timed_meanwhile_is_not_replaced_by_the_kept_one() {
    let (folder, _uno) = set_up_before();
    typed_on_the_console(folder.path(), "set lead_out_ms 234\nsave\n");
    let asked = answered(folder.path(), &[], "\ns\ns\noff\nq\n");
    assert_has(&asked, ["lead_out_ms is 234, and was 230", "Next, time the servo: `calibrate servo` (0 of 2 done)"]);
    let settings = said(folder.path(), &["settings", "pull", "--port", "./uno", "--json"]);
    assert_has(&settings, ["\"lead_out_ms\": 234"]);
}

#[test]
fn another_tool_in_the_machine_s_file_opens_its_steps_again() {
    let (folder, _uno) = set_up_before();
    fs::write(folder.path().join("wide.toml"), "[intra_row]\nwidth = \"200 mm\"\n").expect("there is room for a file");
    let said = answered(folder.path(), &["--machine", "wide.toml"], "s\ns\ns\ns\ns\ns\n");
    assert_has(&said, ["intra_row.width is 200 mm, and was 130", "Open: step 3, ", "Open: step 5, "]);
    assert_has(&said, ["Warning: that damages too many plants."]);
}

#[test]
fn a_slower_servo_or_wider_tool_that_is_typed_opens_its_steps() {
    let (folder, _uno) = set_up_before();
    // Step 5 by typed measures: all as they are offered, and then again with another servo.
    let measures = |servo_s: &str| format!("\n\n\n300\n20\n25\n2.5\n0.3\n40\n{servo_s}\n800\n80\n20\n15\n");
    let first = answered(folder.path(), &[], &format!("s{}\n\n\n\n\noff\n\n190\n50\n\nq\n", measures("0.16")));
    assert!(first.contains("(1 of 2 done)"), "{first}");
    let kept = fs::read_to_string(folder.path().join("set-up.txt")).expect("it is there");
    assert!(kept.contains("machine swing.servo_time_60 0.16\n"), "{kept}");
    let second = answered(folder.path(), &["--step", "5"], &format!("s{}\n\n\n\n\n\noff\nq\n", measures("0.3")));
    assert!(second.contains("(0 of 2 done)"), "{second}");
    let third = answered(folder.path(), &["--step", "3"], "200\ns\ns\ns\ns\ns\n");
    assert!(third.contains("Open: step 5, Keep the stem"), "{third}");
}

#[test]
fn a_step_can_be_done_again_and_only_that() {
    let (folder, _uno) = set_up_before();
    let said = answered(folder.path(), &["--step", "6"], "s\ns\noff\nq\n");
    assert_has(&said, ["Step 3 of 8, Fit a wider tool: done", "(0 of 2 done)"]);
}

#[test]
fn a_file_of_another_board_is_used_only_if_the_user_says_so() {
    let (folder, _uno) = set_up_before();
    let path = folder.path().join("set-up.txt");
    let kept = fs::read_to_string(&path).expect("it is there");
    let (before, after) = kept.split_once("board ").expect("it names its board");
    let (_, after) = after.split_once('\n').expect("it has more lines");
    fs::write(&path, format!("{before}board serial number 42\n{after}")).expect("there is room for a file");
    let refused = typed(command(&["set-up", "--port", "./uno"]).current_dir(&folder), "\n");
    assert_fails(&refused, "give another --state");
    let said = answered(folder.path(), &[], "yes\ns\ns\nq\n");
    assert_has(&said, ["was made for the board with serial number 42. This one has port "]);
    assert_has(&said, ["Step 6 of 8, Time the servo: done"]);
}
