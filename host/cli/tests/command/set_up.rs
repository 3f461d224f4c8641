//! The manual's page on setting the machine up: its steps are safe, and lead there.

mod alarms;
mod changes;

use crate::common::{Running, assert_has, command, folder_with, printed, said, typed};
use field::conditions::Conditions;
use link::settings::{Setting, name};
use set_up::{ManualStep, Task, steps};
use std::collections::BTreeMap;
use std::fs::{self, File};
use std::io::{BufReader, Read, Write};
use std::path::Path;
use std::process::{ChildStdin, Stdio};
use study::experiment::{ControllerKind, Engine, Experiment, Total, totals};
use tempfile::TempDir;
use uno::pty::Pty;
use uno_run::by_the_manual::Novice;

const PAGE: &str = concat!(env!("CARGO_MANIFEST_DIR"), "/../../docs/set-up.md");

/// Selects the random fields and measurements.
pub(crate) const SEED: u64 = 1;

/// The machine from the box in the default field.
fn the_box() -> Conditions {
    Conditions::load(field::conditions::DEFAULT).expect("it is right").from_the_box()
}

/// The firmware at 2.5 km/h in the field of a seed.
pub(crate) fn weeded(conditions: &Conditions, replications: u32, seed: u64) -> Total {
    let experiment = Experiment {
        speeds_km_h: vec![2.5],
        replications,
        controllers: vec![ControllerKind::Firmware],
        ..Experiment::as_in_the_paper(conditions.clone(), seed)
    };
    totals(&experiment.run(&Engine::Native, |_| ()).expect("it can be weeded"))[0]
}

/// Every machine after any set of these steps in any order, also with steps left out.
fn follow_all(
    novice: &Novice,
    rest: &[ManualStep],
    done: &mut Vec<usize>,
    found: &mut BTreeMap<String, (Conditions, Vec<usize>)>,
) {
    for (index, step) in rest.iter().enumerate() {
        let mut next = novice.clone();
        next.follow(step).expect("the field knows it");
        done.push(step.number);
        found.entry(format!("{:?}", next.conditions)).or_insert_with(|| (next.conditions.clone(), done.clone()));
        let others: Vec<ManualStep> =
            rest.iter().enumerate().filter(|&(other, _)| other != index).map(|(_, step)| step.clone()).collect();
        // The margin comes last.
        if !step.tasks.contains(&Task::SetMargin) {
            follow_all(&next, &others, done, found);
        }
        done.pop();
    }
}

/// What all machines did that follow the steps.
#[derive(Clone, Copy, Debug, Default)]
struct Followed {
    zones: u32,
    reached: u32,
    /// Plants that a beam can see.
    seen: u32,
    damaged: u32,
}

/// Does the manual's steps in every order, with any left out.
///
/// # Panics
/// If an alarm is raised.
fn after_each_step(seed: u64) -> Followed {
    // A step that the simulated machine already fulfils changes nothing, in any order.
    let box_machine = Novice::new(the_box(), seed);
    let changes = |step: &ManualStep| {
        step.tasks.iter().any(|task| match *task {
            Task::Set(setting, value) => box_machine.settings().get(setting) != value,
            _ => true,
        })
    };
    let steps: Vec<ManualStep> = steps().into_iter().filter(changes).collect();
    assert!(steps.len() >= 5, "{steps:?}");
    let mut found = BTreeMap::new();
    found.insert(String::new(), (box_machine.conditions.clone(), Vec::new()));
    follow_all(&box_machine, &steps, &mut Vec::new(), &mut found);
    // Each set of steps, some in several orders with different settings: the weeded ground depends on the settings
    // only.
    assert!(found.len() > 1 << (steps.len() - 1), "{}", found.len());
    let mut sum = Followed::default();
    for (conditions, done) in found.into_values() {
        let total = weeded(&conditions, 10, seed);
        let what = || format!("steps {done:?}: {:?} {:?}", conditions.settings, conditions.machine);
        assert_eq!(total.plots.alarms, 0, "{}", what());
        assert!(total.plots.effect.plants > 1000);
        let (damaged, seen) = total.plots.effect.injured_of_seen();
        if damaged > 0 {
            println!("{damaged} of {seen} plants damaged, {}", what());
        }
        let Followed { zones, reached, .. } = sum;
        sum = Followed {
            zones: zones + total.plots.zones.all,
            reached: reached + total.plots.zones.reached,
            seen: sum.seen + seen,
            damaged: sum.damaged + damaged,
        };
    }
    sum
}

#[test]
fn set_up_steps_in_any_order_damage_no_plant_and_reach_no_zone() {
    let followed = after_each_step(SEED);
    assert_eq!((followed.damaged, followed.reached), (0, 0), "{followed:?}");
}

#[test]
fn other_measurements_damage_hardly_a_plant_and_reach_hardly_a_zone() {
    // One servo of these shows none of its quick returns while it is timed.
    for followed in (SEED + 1..=SEED + 3).map(after_each_step) {
        assert!(followed.reached * 2000 < followed.zones, "{followed:?}");
        assert!(followed.damaged * 20_000 < followed.seen, "{followed:?}");
    }
}

#[test]
fn a_lead_that_is_too_short_for_the_stroke_would_be_seen() {
    // An earlier example in the manual had a margin that measurements of the same machine never give.
    let mut conditions = Conditions::default();
    for (setting, value) in [("lead_out_ms", 180.0), ("ticks_per_m", 2010.0), ("margin_mm", 20.0)] {
        conditions.set(setting, value).expect("it is in its range");
    }
    assert!(weeded(&conditions, 2, SEED).plots.zones.reached > 0);
}

#[test]
fn the_steps_in_their_order_end_at_the_machine_that_is_set_up() {
    let set_up = Conditions::preset("walked").expect("there is one").expect("it is right");
    let mut novice = Novice::new(the_box(), SEED);
    for step in steps() {
        novice.follow(&step).expect("the field knows it");
    }
    let mut fitted = novice.conditions.clone();
    fitted.settings.clone_from(&set_up.settings);
    assert_eq!(fitted, set_up, "the parts");
    for setting in [Setting::ServoInUs, Setting::ServoOutUs, Setting::StemZoneMm, Setting::MarginMm] {
        let of_the_field = set_up.settings.get(&name(setting)).copied();
        assert_eq!(novice.settings().get(setting), of_the_field.unwrap_or(setting.default()), "{setting:?}");
    }
    // Two measurements of the servo differ by some milliseconds.
    for setting in [Setting::LeadOutMs, Setting::LeadInMs] {
        let (timed, of_the_field) = (novice.settings().get(setting), set_up.settings[&name(setting)]);
        assert!(timed.abs_diff(of_the_field) <= 5, "{setting:?}: {timed} and {of_the_field}");
    }
    // The page's Try and the manual name the same margin.
    let margin_mm = novice.settings().get(Setting::MarginMm);
    let root = Path::new(env!("CARGO_MANIFEST_DIR")).join("../..");
    for (file, named) in [
        ("host/page/src/simulation.rs", format!("const MARGIN_MM: u16 = {margin_mm};")),
        ("docs/set-up.md", format!("{margin_mm} mm on")),
    ] {
        let text = fs::read_to_string(root.join(file)).expect("it is there");
        assert!(text.contains(&named), "{file} does not have {named:?}");
    }
    let [ours, theirs] =
        [&novice.conditions, &set_up].map(|conditions| 100.0 * weeded(conditions, 20, SEED).plots.weeded_share);
    assert!((ours - theirs).abs() < 2.0, "{ours:.1} and {theirs:.1} %: {:?}", novice.conditions.settings);
}

pub(crate) fn machine_of_the_page() -> String {
    let page = fs::read_to_string(PAGE).expect("it is there");
    page.split("```toml\n").nth(1).and_then(|rest| rest.split("```").next()).expect("it has a machine").to_owned()
}

#[test]
fn the_page_and_the_design_give_the_same_numbers() {
    let folder = folder_with("my.toml", &machine_of_the_page());
    let printed = said(folder.path(), &["design", "--machine", "my.toml"]);
    // Nothing was measured on this machine, so the margin is the default.
    let set_lines: Vec<&str> = printed.lines().filter(|line| line.starts_with("set ")).collect();
    let of_a_step = |step: &ManualStep| -> Vec<String> {
        let lines = step.tasks.iter().filter_map(|task| match *task {
            Task::Set(setting, value) => Some(format!("set {} {value}", name(setting))),
            _ => None,
        });
        lines.collect()
    };
    assert_eq!(set_lines.len(), 5, "{printed}");
    assert!(steps().iter().any(|step| of_a_step(step) == set_lines), "{set_lines:?}");
}

#[test]
fn a_file_that_is_another_s_is_not_written_over() {
    let folder = folder_with("set-up.txt", "mine\n");
    let words = ["set-up", "--port", "/dev/no-such-port", "--state"];
    // Before anything is measured.
    for (file, why) in [("set-up.txt", "is no file of"), ("no/such.txt", "cannot be written")] {
        crate::common::assert_refused(folder.path(), &[&words[..], &[file]].concat(), &format!("{file} {why}"));
    }
    assert_eq!(fs::read_to_string(folder.path().join("set-up.txt")).expect("it is there"), "mine\n");
    assert!(!Path::new("set-up.txt").exists());
}

/// `weeder` in a folder, with a keyboard.
fn typing(folder: &Path, words: &[&str]) -> std::process::Command {
    let mut command = command(words);
    command.current_dir(folder).stdin(Stdio::piped()).stdout(Stdio::piped());
    command
}

/// Starts a virtual Uno, and waits for its port.
pub(crate) fn uno(folder: &Path, words: &[&str]) -> (Running, ChildStdin) {
    let (mut uno, _) = Running::with_first_line(&mut typing(folder, &[&["virtual-uno"], words].concat()));
    let keyboard = uno.0.stdin.take().expect("it is piped");
    (uno, keyboard)
}

/// A folder with a standing virtual Uno at `uno`.
pub(crate) fn folder_with_uno(words: &[&str]) -> (TempDir, Running) {
    let folder = TempDir::new().expect("there is room for a folder");
    let (uno, _) = uno(folder.path(), &[&["--stand", "--link", "uno"], words].concat());
    (folder, uno)
}

/// Runs `weeder set-up` to its end. `act` gets each line and each question, and the user's keyboard. Returns the output.
pub(crate) fn lead(folder: &Path, words: &[&str], mut act: impl FnMut(&str, &mut ChildStdin)) -> String {
    let mut guide = Running::start(&mut typing(folder, &[&["set-up"], words].concat()));
    let mut keyboard = guide.0.stdin.take().expect("it is piped");
    let (mut said, mut line) = (String::new(), Vec::new());
    for byte in BufReader::new(guide.0.stdout.take().expect("it is piped")).bytes() {
        line.push(byte.expect("it can be read"));
        if line.ends_with(b"\n") || line.ends_with(b"]: ") {
            let text = String::from_utf8(std::mem::take(&mut line)).expect("it prints text");
            said += &text;
            act(&text, &mut keyboard);
        }
    }
    assert!(guide.0.wait().expect("it ends").success(), "{said}");
    said
}

pub(crate) fn type_to(keyboard: &mut ChildStdin, line: impl std::fmt::Display) {
    writeln!(keyboard, "{line}").expect("it reads");
}

#[test]
fn without_a_machine_file_set_up_asks_for_its_measures() {
    let (folder, _uno) = folder_with_uno(&[]);
    // Step 2 with a beam that is too near at first, and with an encoder of 500 lines.
    let mut input = vec!["", "s", "", "300", "", "", "400", "2000", "1300", "90", "s"];
    // Step 5 by a person's own measures, one of them out of range at first.
    input.extend([
        "maybe", "", "", "300", "20", "25", "2.5", "0.3", "40", "0.2", "800", "900", "80", "20", "15", "", "", "", "",
        "", "s", "s", "s",
    ]);
    let printed = answered(folder.path(), &input);
    let machine = "[intra_row]\nwidth = \"90 mm\"\nshank_length = \"300 mm\"\nshank_diameter = \"20 mm\"\n\
        blade_base = \"25 mm\"\nblade_height = \"2.5 mm\"\nblade_mass = \"0.3 kg\"\nservo_torque = \"40 kg cm\"\n[swing]\nservo_time_60 = \"0.2 s\"\npulse_for_90 = 800\nprotected = \"80 mm\"\n\
        stem_off = \"20 mm\"\nroom = \"15 mm\"\n";
    fs::write(folder.path().join("my.toml"), machine).expect("there is room for a file");
    let design = said(folder.path(), &["design", "--machine", "my.toml"]);
    let lines: Vec<(&str, &str)> =
        design.lines().filter_map(|line| line.strip_prefix("set ")?.split_once(' ')).collect();
    assert_eq!(lines.len(), 5, "{design}");
    for (setting, value) in lines {
        let (name, offer) = (format!("{setting} in "), format!("[{value}]: "));
        let is_offered = printed.lines().any(|line| line.contains(&name) && line.contains(&offer));
        assert!(is_offered, "{setting} {value} is not offered in\n{printed}");
    }
    let parts = [
        "it has to be a number from 0 to 200 mm",
        "need a beam_to_tool_mm of 389 or more",
        "error: type yes or no",
        "four times the encoder's lines",
        "  ticks_per_rev [2400]: ",
        "    ticks_per_rev 2000",
        "Open: step 4, Fit a second beam: second_beam_mm is 0",
        "Open: step 8, Lower the margin: ",
        "% of the row's ground weeded",
        "a tool of 90 mm",
    ];
    assert_has(&printed, parts);
}

/// Runs `weeder set-up` on the virtual Uno with these lines. Returns its output.
fn answered(folder: &Path, lines: &[&str]) -> String {
    led_by(folder, &[], lines)
}

/// The same, with further arguments.
fn led_by(folder: &Path, words: &[&str], lines: &[&str]) -> String {
    let words = [&["set-up", "--port", "./uno"], words].concat();
    printed(&typed(command(&words).current_dir(folder), lines.join("\n") + "\n"), 0)
}

#[test]
fn two_timings_by_eye_set_the_safest_times() {
    let (folder, _uno) = folder_with_uno(&["--fast"]);
    let to_step_6 = ["s", "s", "s", "s", "s", "off", ""];
    let first = answered(folder.path(), &[&[""][..], &to_step_6, &["190", "50", "", "", "s", "s"]].concat());
    assert_has(&first, ["Open: step 6, Time the servo: time the servo: `calibrate servo` (1 of 2 done)"]);
    let second = answered(folder.path(), &[&to_step_6[..], &["140", "800", "80", "", "s"]].concat());
    assert!(!second.contains("Open: step 6"), "{second}");
    assert_has(&second, ["    lead_out_ms 190 ms\n", "    lead_in_ms 50 ms\n"]);
}

#[test]
fn a_lead_that_contradicts_other_settings_is_asked_again() {
    let (folder, _uno) = folder_with_uno(&["--fast"]);
    let said = answered(folder.path(), &["", "s", "s", "s", "s", "s", "off", "", "450", "40", "", "550", "q"]);
    assert_has(&said, ["together need a beam_to_tool_mm of ", "time the servo: `calibrate servo` (1 of 2 done)"]);
}

#[test]
fn a_near_beam_is_offered_with_a_lower_top_speed() {
    let (folder, _uno) = folder_with_uno(&[]);
    let said = answered(folder.path(), &["", "s", "", "300", "", "", "", "", "", "s", "s", "s", "s", "s", "s"]);
    let parts = [
        "beam_to_tool_mm in mm, now 400 [300]: ",
        "top_speed_mm_s in mm/s, now 1300 [950]: ",
        "    beam_to_tool_mm 300 mm\n",
        "    top_speed_mm_s 950 mm/s\n",
        "  Next, do the open steps: the same command asks for them.\n",
    ];
    assert_has(&said, parts);
}

#[test]
fn a_call_without_the_machine_s_file_knows_the_machine_of_the_call_before() {
    let (folder, _uno) = folder_with_uno(&[]);
    fs::write(folder.path().join("my.toml"), "[intra_row]\nblade_base = \"60 mm\"\n[swing]\narm_trails = 1\n")
        .expect("there is room for a file");
    led_by(folder.path(), &["--machine", "my.toml"], &["", "s", "s", "", "q"]);
    answered(folder.path(), &["q"]);
    let kept = fs::read_to_string(folder.path().join("set-up.txt")).expect("it is there");
    assert_has(&kept, ["machine intra_row.blade_base 60\n", "machine swing.arm_trails 1\n"]);
}

#[test]
fn a_line_typed_before_a_question_does_not_answer_it() {
    let (folder, _uno) = folder_with_uno(&[]);
    let mut terminal = Pty::open().expect("there is a pseudo terminal");
    let keyboard = File::open(terminal.path()).expect("it is there");
    terminal.write(b"\n\n\n\n").expect("it has room");
    let mut guide = command(&["set-up", "--port", "./uno"]);
    let mut guide = Running::start(guide.current_dir(&folder).stdin(keyboard).stdout(Stdio::piped()));
    let (output, mut said) = (guide.0.stdout.take().expect("it is piped"), String::new());
    for byte in BufReader::new(output).bytes() {
        said.push(char::from(byte.expect("it can be read")));
        if said.ends_with("]: ") {
            terminal.write(b"q\n").expect("it has room");
        }
    }
    assert_eq!(said.matches("]: ").count(), 1, "{said}");
    assert!(said.ends_with("Stopped. The same command continues here.\n"), "{said}");
}

#[test]
fn a_lead_that_is_too_long_for_the_beam_is_offered_with_a_lower_top_speed() {
    let (folder, _uno) = folder_with_uno(&[]);
    fs::write(folder.path().join("my.toml"), "weeder.mass = \"60 kg\"\n").expect("there is room for a file");
    // Step 5 with the paper's blade: all six offers are taken.
    let lines = ["", "s", "s", "s", "s", "", "", "", "", "", "", "s", "s"];
    let printed = led_by(folder.path(), &["--machine", "my.toml"], &lines);
    assert_has(&printed, ["top_speed_mm_s in mm/s, now 1300 [", "    lead_out_ms 304 ms\n"]);
    assert!(!printed.contains("error"), "{printed}");
}

#[test]
fn a_wheel_that_does_not_turn_is_named_and_the_wait_for_it_can_be_ended() {
    let (folder, _uno) = folder_with_uno(&[]);
    let ended = answered(folder.path(), &["", "s", "s", "s", "s", "s", "s", "", "", "q"]);
    assert_has(
        &ended,
        ["The machine has to roll farther: pos=0 speed_mm_s=0.", "Stopped. The same command continues here."],
    );
}
