//! The manual's page on setting the machine up: its steps are safe, and lead there.

use crate::common::said;
use crate::typed::{printed, typed};
use experiments::experiment::{Engine, Experiment, Total, Treatment, totals};
use field::conditions::Conditions;
use field::planting::Planting;
use link::set_up::{ManualStep, Task, steps};
use link::settings::{Setting, name};
use std::collections::BTreeMap;
use std::fs;
use std::path::Path;
use std::process::Command;
use tempfile::TempDir;
use trial::by_the_manual::Novice;
use trial::firmware;
use trial::live::rows::LiveRows;
use trial::live::{Course, Setup};

/// The page of the manual.
const PAGE: &str = concat!(env!("CARGO_MANIFEST_DIR"), "/../../docs/set-up.md");

/// Selects the random fields and measurements.
const SEED: u64 = 1;

/// The machine from the box in the default field.
fn the_box() -> Conditions {
    Conditions::load(field::conditions::DEFAULT).expect("it is right").from_the_box()
}

/// The firmware at 2.5 km/h in the field of a seed.
fn weeded(conditions: &Conditions, replications: u32, seed: u64) -> Total {
    let experiment = Experiment {
        speeds_km_h: vec![2.5],
        replications,
        controllers: vec![Treatment::Firmware],
        ..Experiment::as_in_the_paper(conditions.clone(), seed)
    };
    totals(&experiment.run(&Engine::Native, |_| ()).expect("it can be weeded"))[0]
}

/// Every machine after any set of these steps in any order. Each step may be the last, so sets that leave steps out are
/// included.
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
fn after_each_step_in_every_order_and_with_any_left_out_no_plant_is_damaged_and_no_zone_reached() {
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
        assert_eq!(
            novice.settings().get(setting),
            of_the_field.unwrap_or(setting.description().default),
            "{setting:?}"
        );
    }
    // Two measurements of the servo differ by some milliseconds.
    for setting in [Setting::LeadOutMs, Setting::LeadInMs] {
        assert!(novice.settings().get(setting).abs_diff(set_up.settings[&name(setting)]) <= 5, "{setting:?}");
    }
    // The page's Try and the manual name the same margin.
    let margin_mm = novice.settings().get(Setting::MarginMm);
    let root = Path::new(env!("CARGO_MANIFEST_DIR")).join("../..");
    for (file, named) in [
        ("host/page/src/trial.rs", format!("const MARGIN_MM: u16 = {margin_mm};")),
        ("docs/set-up.md", format!("{margin_mm} mm on")),
    ] {
        let text = fs::read_to_string(root.join(file)).expect("it is there");
        assert!(text.contains(&named), "{file} does not have {named:?}");
    }
    let [ours, theirs] =
        [&novice.conditions, &set_up].map(|conditions| 100.0 * weeded(conditions, 20, SEED).plots.weeded_share);
    assert!((ours - theirs).abs() < 2.0, "{ours:.1} and {theirs:.1} %: {:?}", novice.conditions.settings);
}

#[test]
fn the_page_and_the_design_give_the_same_numbers() {
    let page = fs::read_to_string(PAGE).expect("it is there");
    let machine = page.split("```toml\n").nth(1).and_then(|rest| rest.split("```").next()).expect("it has a machine");
    let folder = TempDir::new().expect("there is room for a folder");
    fs::write(folder.path().join("my.toml"), machine).expect("there is room for a file");
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
    let folder = TempDir::new().expect("there is room for a folder");
    fs::write(folder.path().join("set-up.txt"), "mine\n").expect("there is room for a file");
    crate::common::assert_refused(
        folder.path(),
        &["set-up", "--port", "/dev/no-such-port"],
        "set-up.txt is no file of",
    );
    assert_eq!(fs::read_to_string(folder.path().join("set-up.txt")).expect("it is there"), "mine\n");
    assert!(!Path::new("set-up.txt").exists());
}

#[test]
fn the_terminal_leads_through_the_steps_is_stopped_and_goes_on() {
    let conditions = Conditions::preset("straight").expect("there is one").expect("it is right");
    let planting = Planting { plants: 7, ..Planting::default() };
    let row = planting.grow(SEED).expect("there is room");
    // Fast, for a test. It stands until the servo is timed: two times twelve swings of 1.5 s, which end where it rolls.
    let course = Course::of_rows(vec![row], conditions.machine(SEED), 1200.0)
        .remove(0)
        .slipping(conditions.ground.slip_percent / 100.0)
        .standing_first(65);
    let rolls_mm = course.rolls_mm().round();
    let setup = Setup {
        elf: Some(firmware::build().expect("the firmware builds")),
        course: Some(course),
        keeps_running_when_opened: true,
        ..Setup::default()
    };
    let uno = LiveRows::start(vec![setup]).expect("there is a pseudo terminal").run_in_background();
    let folder = TempDir::new().expect("there is room for a folder");
    let weeder = |words: &[&str], input: &str| {
        let mut command = Command::new(env!("CARGO_BIN_EXE_weeder"));
        command.current_dir(&folder).args(words).arg("--port").arg(uno.path());
        printed(&typed(&mut command, input), 0)
    };
    weeder(&["monitor", "--plain"], "save\nclear\nset end_switch on\nsave\n");
    // An answer for each question of each step, as on the page: fit the parts, and take the manual's values.
    let mut answers = Vec::new();
    for step in steps() {
        let mut input = "\n".to_owned();
        for task in &step.tasks {
            input += &match task {
                Task::Fit(..) => String::new(),
                Task::Set(..) | Task::SetMargin => "m\n".to_owned(),
                Task::TimeServo => "\n".repeat(2),
                Task::MeasureWheel(_) => format!("\n{rolls_mm}\n").repeat(3),
            };
        }
        answers.push(input);
    }
    let half = answers.len() / 2;
    let first = weeder(&["set-up"], &[answers[..half].concat(), "q\n".to_owned()].concat());
    assert!(first.ends_with("Stopped. The same command continues here.\n"), "{first}");
    let second = weeder(&["set-up"], &answers[half..].concat());
    assert!(second.contains(&format!("Step {half} of {}", answers.len())) && second.contains(": done\n"), "{second}");
    assert!(second.contains("The measurements ask for ") && !second.contains("Warning"), "{second}");
    let json: serde_json::Value =
        serde_json::from_str(&weeder(&["settings", "pull", "--json"], "")).expect("it is JSON");
    let value = |setting: Setting| json[name(setting)].as_u64().expect("it is a number");
    for task in steps().iter().flat_map(|step| &step.tasks) {
        if let Task::Set(setting, wanted) = *task
            && ![Setting::LeadOutMs, Setting::LeadInMs].contains(&setting)
        {
            assert_eq!(value(setting), u64::from(wanted), "{setting:?}");
        }
    }
    // 1909.86 counts a metre, and 5 % of slip: 2010.4. 50 to 80 ms of dead time, and up to 56 ms for the stroke.
    assert!((2005..=2016).contains(&value(Setting::TicksPerM)), "{json:#}");
    assert!((95..=155).contains(&value(Setting::LeadOutMs)), "{json:#}");
    assert!((60..=100).contains(&value(Setting::LeadInMs)), "{json:#}");
    assert!((20..=30).contains(&value(Setting::MarginMm)), "{json:#}");
}
