//! Tests of the manual: the commands in the README, the pages beside it and docs/ are typed here, and links must lead
//! to a target.
//!
//! In a block marked `sh`, every command of this repository must exist with its options. Those that need neither an Uno
//! nor a minute are run. In a block marked `console`, every line behind `>` is typed into the virtual Uno and must be
//! answered by `ok`. The lines between must come in that order, at least their beginnings. The virtual Uno rolls where
//! the reader would roll the machine.

use crate::common::{Running, assert_has, command, printed, told, typed, weeder};
use field::machine::{Machine, cycle_at};
use field::motion::Motion;
use field::row::{Canopy, Row};
use std::fs;
use std::path::{Path, PathBuf};
use std::process::Command;
use tempfile::TempDir;
use uno::Uno;
use uno_run::console::ask;
use uno_run::firmware;

/// The repository's folder.
const ROOT: &str = concat!(env!("CARGO_MANIFEST_DIR"), "/../..");

/// Detections as `dump` prints them, for the commands that train from them.
const OBJECTS: &str = "\
speed_mm_s,spacing_mm,delay_mm,hold_mm,actuation_mm,answer,votes,label
555,550,350,250,600,plant,3,plant
555,548,350,255,605,plant,3,plant
555,551,350,245,595,plant,3,plant
555,553,350,248,598,plant,3,plant
555,205,350,108,458,weed,3,weed
555,188,350,112,462,weed,3,weed
555,170,350,110,460,weed,3,weed
555,310,350,106,456,weed,3,weed
";

/// Programs outside this repository. Their options are not checked.
const FOREIGN: [&str; 7] = ["avrdude", "cp", "echo", "npm", "scontrol", "squeue", "sudo"];

/// Subcommands that need neither an Uno nor much time.
const CHEAP: [&str; 9] = ["classify", "design", "evaluate", "hex", "merge", "plan", "sweep", "train", "trial"];

struct Page {
    path: PathBuf,
    text: String,
}

/// The README, the two pages beside it, and every page of docs/.
fn pages() -> Vec<Page> {
    let docs = fs::read_dir(Path::new(ROOT).join("docs")).expect("there is a manual");
    let mut paths: Vec<PathBuf> = docs.map(|entry| entry.expect("it can be listed").path()).collect();
    paths.extend(["README.md", "CONTRIBUTING.md", "CHANGELOG.md"].map(|page| Path::new(ROOT).join(page)));
    paths.retain(|path| path.extension().is_some_and(|extension| extension == "md"));
    paths.sort();
    let read = |path: PathBuf| Page { text: fs::read_to_string(&path).expect("a page is text"), path };
    paths.into_iter().map(read).collect()
}

impl Page {
    fn blocks(&self, language: &str) -> Vec<Vec<&str>> {
        let mut blocks = Vec::new();
        let mut lines = self.text.lines();
        while let Some(line) = lines.next() {
            let Some(found) = line.strip_prefix("```") else { continue };
            let block: Vec<&str> = lines.by_ref().take_while(|line| *line != "```").collect();
            if found == language {
                blocks.push(block);
            }
        }
        blocks
    }

    /// The anchors of its headings, as common renderers of Markdown make them.
    fn anchors(&self) -> Vec<String> {
        let headings = self.text.lines().filter(|line| line.starts_with('#'));
        let anchor = |heading: &str| {
            let kept =
                heading.trim_start_matches('#').trim().chars().filter(|c| c.is_alphanumeric() || " -_".contains(*c));
            kept.collect::<String>().to_lowercase().replace(' ', "-")
        };
        headings.map(anchor).collect()
    }
}

/// The words of a command line, up to its comment or redirection.
fn words(line: &str) -> Vec<String> {
    let words = shlex::split(line).unwrap_or_else(|| panic!("unbalanced quotes: {line}"));
    words.into_iter().take_while(|word| word != ">").collect()
}

/// The aliases in .cargo/config.toml that run `weeder`, with their arguments.
fn aliases() -> Vec<(String, Vec<String>)> {
    let config = fs::read_to_string(Path::new(ROOT).join(".cargo/config.toml")).expect("cargo is configured");
    let alias = |line: &str| {
        let (name, command) = line.split_once(" = \"")?;
        let (_, arguments) = command.split_once("--package weeder-cli -- ")?;
        Some((name.to_owned(), words(arguments.trim_end_matches('"'))))
    };
    config.lines().filter_map(alias).collect()
}

/// The arguments for `weeder` in a command line, if it runs `weeder`.
fn weeder_arguments(words: &[String]) -> Option<Vec<String>> {
    let (program, arguments) = words.split_first()?;
    match (program.as_str(), arguments) {
        ("weeder", arguments) => Some(arguments.to_vec()),
        ("cargo", [run, rest @ ..]) if run == "run" => {
            let start = rest.iter().position(|word| word == "--")?;
            rest[..start].contains(&"weeder-cli".to_owned()).then(|| rest[start + 1..].to_vec())
        }
        ("cargo", [alias, rest @ ..]) => {
            let (_, arguments) = aliases().into_iter().find(|(name, _)| name == alias)?;
            Some([&arguments, rest].concat())
        }
        _ => None,
    }
}

/// Runs `weeder` in a folder. Returns its message if it fails.
fn complaint(folder: &Path, arguments: &[String]) -> Option<String> {
    let output = weeder(folder, &arguments.iter().map(String::as_str).collect::<Vec<_>>());
    // Status 1 is a finding, and no complaint.
    (!matches!(output.status.code(), Some(0 | 1))).then(|| told(&output))
}

/// The shell commands of all pages, as words.
fn shell_lines() -> Vec<(String, Vec<String>)> {
    let of_page = |page: &Page| -> Vec<(String, Vec<String>)> {
        let name = page.path.display();
        let blocks = page.blocks("sh");
        let lines = blocks.iter().flatten();
        lines.map(|line| (format!("{name}: {line}"), words(line))).filter(|(_, words)| !words.is_empty()).collect()
    };
    pages().iter().flat_map(of_page).collect()
}

#[test]
fn every_command_in_the_manual_exists_with_its_options() {
    let of_cargo = Command::new("cargo").current_dir(ROOT).arg("--list").output().expect("cargo is there").stdout;
    let of_cargo = String::from_utf8(of_cargo).expect("cargo lists names");
    let (mut complaints, mut seen) = (Vec::new(), 0);
    for (line, mut words) in shell_lines() {
        // In the folder of a release.
        if words[0] == "./weeder" {
            words[0] = "weeder".to_owned();
        }
        let known = if let Some(arguments) = weeder_arguments(&words) {
            seen += 1;
            // Options are parsed before `--help` ends the command.
            complaint(Path::new(ROOT), &[arguments, vec!["--help".to_owned()]].concat()).is_none()
        } else if words[0] == "cargo" {
            of_cargo.lines().any(|listed| listed.split_whitespace().next() == words.get(1).map(String::as_str))
        } else if words[0].starts_with("./") {
            Path::new(ROOT).join(&words[0]).is_file()
        } else {
            FOREIGN.contains(&words[0].as_str())
        };
        if !known {
            complaints.push(line);
        }
    }
    assert_eq!(complaints, [""; 0], "there are no such commands");
    assert!(seen > 20, "only {seen} commands were found");
}

/// Lines of the README that a newcomer sees first.
const FIRST_SCREEN: usize = 32;

#[test]
fn the_readme_starts_with_both_commands_and_the_gate_runs_them() {
    let readme = fs::read_to_string(Path::new(ROOT).join("README.md")).expect("there is a README");
    let screen: Vec<&str> = readme.lines().take(FIRST_SCREEN).collect();
    for command in ["./setup.sh && cargo sim", "./setup.sh && cargo test"] {
        let block = ["<!-- from nothing -->", "```sh", command, "```"];
        assert!(screen.windows(block.len()).any(|lines| lines == block), "{command} is not a block of its own");
    }
    // This step of the gate runs all tests, and no other step does.
    let gate = fs::read_to_string(Path::new(ROOT).join(".ci/run")).expect("there is a gate");
    let steps: Vec<&str> = gate.lines().filter(|line| line.starts_with("step ")).collect();
    assert!(steps.iter().any(|step| step.ends_with("env WEEDER_THOROUGH=1 .ci/from-nothing")), "{steps:?}");
    assert!(!steps.iter().any(|step| step.contains("cargo test")), "{steps:?}");
}

#[test]
fn the_manual_and_setup_name_the_node_js_that_the_page_needs() {
    let read = |name: &str| fs::read_to_string(Path::new(ROOT).join(name)).expect("it is there");
    let package = read("page/package.json");
    let (_, rest) = package.split_once("\"node\": \">=").expect("the page names its Node.js");
    let version = rest.split('"').next().expect("it is a version");
    for name in ["README.md", "docs/page.md", "setup.sh"] {
        assert!(read(name).contains(&format!("Node.js {version} or later")), "{name} does not name Node.js {version}");
    }
}

#[test]
fn commands_in_the_manual_that_need_no_uno_work() {
    let folder = TempDir::new().expect("a folder");
    fs::create_dir_all(folder.path().join("control/src/ground/examples")).expect("a folder in it");
    fs::write(folder.path().join("field.csv"), OBJECTS).expect("a file in it");
    fs::create_dir(folder.path().join("docs")).expect("a folder in it");
    let example = "docs/trial-example.csv";
    fs::copy(Path::new(ROOT).join(example), folder.path().join(example)).expect("the manual has an example");
    // The reader makes it by `design --print-machine > my.toml`.
    fs::write(folder.path().join("my.toml"), "weeder.mass = \"60 kg\"\n").expect("a file in it");
    // A study of many plants, without the many plants.
    fs::write(folder.path().join("long.toml"), "[plot]\nrows = 1\n").expect("a file in it");
    let mut run = Vec::new();
    for (line, words) in shell_lines() {
        let Some(arguments) = weeder_arguments(&words) else { continue };
        // On the virtual Uno a trial takes minutes. A log is a machine's.
        let cheap = arguments.first().is_some_and(|command| CHEAP.contains(&command.as_str()))
            && !arguments.iter().any(|argument| argument == "uno" || argument == "--log");
        if cheap && !run.contains(&arguments) {
            assert_eq!(complaint(folder.path(), &arguments), None, "{line}");
            run.push(arguments);
        }
    }
    for command in CHEAP {
        assert!(run.iter().any(|arguments| arguments[0] == command), "the manual does not tell of {command}");
    }
}

fn files_below(folder: &Path, files: &mut Vec<PathBuf>) {
    for entry in fs::read_dir(folder).expect("it is a folder") {
        let path = entry.expect("it can be read").path();
        if path.is_dir() { files_below(&path, files) } else { files.push(path) }
    }
}

#[test]
fn every_file_that_contributing_and_the_page_of_the_sources_name_is_there() {
    let root = Path::new(ROOT);
    let text =
        ["CONTRIBUTING.md", "docs/sources.md"].map(|page| fs::read_to_string(root.join(page)).expect("it is there"));
    let text = text.join("\n");
    let mut files = Vec::new();
    for folder in ["control", "docs", "host", "knn", "page/src", "src", "tests"] {
        files_below(&root.join(folder), &mut files);
    }
    let ends = [".md", ".rs", ".svg", ".toml", ".ts"];
    let quoted = text.split('`').skip(1).step_by(2).filter(|word| !word.contains([' ', '*']) && !word.contains("NAME"));
    let names: Vec<&str> = quoted.filter(|word| ends.iter().any(|end| word.ends_with(end))).collect();
    assert!(names.len() > 80, "only {} names were found", names.len());
    for name in names {
        // After a full path, the bare name of another file is enough.
        let is_there = root.join(name).is_file() || files.iter().any(|file| file.ends_with(name));
        assert!(is_there, "there is no {name}");
    }
}

#[test]
fn crates_import_only_crates_above_them_in_the_table_of_the_tools() {
    let page = fs::read_to_string(Path::new(ROOT).join("host/README.md")).unwrap();
    let (_, table) = page.split_once("| floor | crate | what it does |").expect("it has the table");
    let rows = table.lines().skip(2).take_while(|line| line.starts_with('|'));
    let crates: Vec<&str> = rows
        .flat_map(|row| row.split('|').nth(2).expect("a row has three cells").split('`').skip(1).step_by(2))
        .collect();
    for (place, name) in crates.iter().enumerate() {
        let manifest = fs::read_to_string(Path::new(ROOT).join("host").join(name).join("Cargo.toml")).unwrap();
        let (imports, _) = manifest.split_once("[dev-dependencies]").unwrap_or((&manifest, ""));
        for import in imports.lines().filter_map(|line| line.split(['.', ' ', '=']).next()) {
            assert!(!crates[place..].contains(&import), "{name} imports {import}, which is not above it");
        }
    }
    let mut listed: Vec<String> = crates.iter().map(|name| (*name).to_owned()).collect();
    listed.sort();
    let folders = fs::read_dir(Path::new(ROOT).join("host")).unwrap().map(|entry| entry.unwrap());
    let folders = folders.filter(|entry| entry.path().is_dir()).map(|entry| entry.file_name().into_string().unwrap());
    let mut folders: Vec<String> = folders.collect();
    folders.sort();
    assert_eq!(listed, folders);
}

#[test]
fn the_manual_s_page_of_the_console_names_every_command() {
    let page = fs::read_to_string(Path::new(ROOT).join("docs/console.md")).expect("there is such a page");
    let mut uno = uno_run::boot(&firmware::build().expect("the firmware builds"), &[]).expect("the firmware wakes up");
    let help = ask(&mut uno, "help").expect("it has help");
    assert!(help.len() > 10, "{help:?}");
    for usage in help.iter().filter_map(|line| line.split_once(" - ")).map(|(usage, _)| usage) {
        let word = usage.split(' ').next().unwrap_or(usage);
        assert!(page.contains(&format!("`{word}")), "{usage}");
    }
}

#[test]
fn every_console_line_in_the_manual_gets_ok_and_the_printed_answer() {
    let elf = firmware::build().expect("the firmware builds");
    let mut typed = 0;
    for page in pages() {
        for block in page.blocks("console") {
            let mut uno = uno_run::boot(&elf, &[]).expect("the firmware wakes up");
            let mut said = String::new();
            for line in block {
                let place = format!("{}: {line}", page.path.display());
                let Some(command) = line.strip_prefix("> ") else {
                    expect(&mut uno, &mut said, line, &place);
                    continue;
                };
                match command {
                    "label plant" => roll(&mut uno, 1500.0),
                    _ if command.starts_with("calibrate 1") => roll(&mut uno, 10_000.0),
                    _ => {}
                }
                let answer = ask(&mut uno, command).unwrap_or_else(|error| panic!("{place}: {error}"));
                said = answer.iter().map(|line| format!("{line}\n")).collect();
                typed += 1;
            }
        }
    }
    assert!(typed > 30, "only {typed} lines were found");
}

/// Waits for a line with this beginning. Drops it and the lines before it.
#[track_caller]
fn expect(uno: &mut Uno, said: &mut String, line: &str, place: &str) {
    const PATIENCE_S: u64 = 25;
    for _ in 0..PATIENCE_S * 10 {
        let complete = said.rfind('\n').map_or("", |end| &said[..=end]);
        let mut end = 0;
        for heard in complete.split_inclusive('\n') {
            end += heard.len();
            if heard.starts_with(line) {
                said.drain(..end);
                return;
            }
        }
        uno.run_for_ms(100).expect("the firmware runs");
        *said += &uno.received();
    }
    panic!("{place}: that is not said, but {said:?}");
}

/// Rolls on by a distance at walking pace, past a plant in the middle, with a slightly worn wheel.
fn roll(uno: &mut Uno, distance_mm: f64) {
    const SPEED_MM_S: f64 = 1000.0;
    const ACCELERATION_MM_S2: f64 = 2000.0;
    let machine = Machine { wheel_mm: 396.0, ..Machine::default() };
    let row = Row::new(vec![Canopy::plant(distance_mm / 2.0, 150.0)]).expect("a plant is a row");
    let motion =
        Motion::starting_at(0.0).change_speed(SPEED_MM_S, ACCELERATION_MM_S2).stop_at(distance_mm, ACCELERATION_MM_S2);
    let start_cycle = uno.cycle();
    uno.drive(machine.pin_changes(&row, &motion, start_cycle));
    uno.run_until(cycle_at(start_cycle, motion.duration_s() + 0.3)).expect("the firmware runs");
}

#[test]
fn the_start_without_an_uno_works_to_its_end() {
    firmware::build().expect("the firmware builds");
    let folder = TempDir::new().expect("a folder");
    let link = folder.path().join("uno");
    let with_port = |(line, words): (String, Vec<String>)| {
        let port = link.to_str().expect("a name in plain text");
        let words: Vec<String> = words.iter().map(|word| word.replace("/tmp/uno", port)).collect();
        (line.contains("first-flash.md") && words.iter().any(|word| word == port))
            .then(|| weeder_arguments(&words))
            .flatten()
    };
    let lines: Vec<Vec<String>> = shell_lines().into_iter().filter_map(with_port).collect();
    let [virtual_uno, monitor] = lines.as_slice() else { panic!("first the Uno, then the monitor, not {lines:?}") };

    let (_uno, _) = Running::with_first_line(command(&[]).current_dir(folder.path()).args(virtual_uno));
    // A script has no screen.
    let mut monitor_alone = command(&[]);
    monitor_alone.current_dir(folder.path()).args(monitor).arg("--plain");
    let said = printed(&typed(&mut monitor_alone, "clear\nhold\nsave\nstatus\n"), 0);
    assert_has(&said, ["state=hold tool=out"]);
}

#[test]
fn every_link_in_the_manual_has_a_target() {
    for page in pages() {
        let folder = page.path.parent().expect("a page has a folder");
        for link in page.text.split("](").skip(1).filter_map(|rest| rest.split_once(')')).map(|(link, _)| link) {
            if link.starts_with("https://") {
                continue;
            }
            let place = format!("{}: {link}", page.path.display());
            let (file, anchor) = link.split_once('#').map_or((link, None), |(file, anchor)| (file, Some(anchor)));
            let target = if file.is_empty() { page.path.clone() } else { folder.join(file) };
            assert!(target.exists(), "{place}");
            if let Some(anchor) = anchor {
                let target = Page { text: fs::read_to_string(&target).expect("a page is text"), path: target };
                assert!(target.anchors().iter().any(|known| known == anchor), "{place}: {:?}", target.anchors());
            }
        }
    }
}

#[test]
fn one_version_stands_in_every_file_that_names_it() {
    let version = env!("CARGO_PKG_VERSION");
    let line = |file: &str, line: &str| {
        let text = fs::read_to_string(Path::new(ROOT).join(file)).unwrap();
        assert!(text.lines().any(|found| found == line), "{file} has no line `{line}`");
    };
    line("Cargo.toml", &format!("version = \"{version}\""));
    line("CITATION.cff", &format!("version: {version}"));
    line("CHANGELOG.md", &format!("## {version}"));
    for file in ["page/package.json", "page/package-lock.json"] {
        line(file, &format!("    \"version\": \"{version}\","));
    }
    line("page/package-lock.json", &format!("            \"version\": \"{version}\","));
}
