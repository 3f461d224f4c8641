//! The recipes of CONTRIBUTING.md for a setting, a command, an alarm and an event: followed in a copy of the sources, they make a
//! firmware that fits and knows them.

use crate::common::{ask, elf};
use std::fs;
use std::os::unix::fs::symlink;
use std::path::Path;
use std::process::Command;
use uno::elf::Size;
use uno_run::firmware::workspace_root;

/// Bytes below the Uno's bootloader.
const FLASH_BYTES: u64 = 32_256;

/// Lines to add: the file, the line before them, and the lines.
const ADDED: [(&str, &str, &str); 6] = [
    (
        "settings.rs",
        "        \"switch on D5 closes with the tool out\";\n",
        "    LampPercent \"lamp_percent\" in \"%\": 0 to 100, 50, false, \"brightness of the lamp\";\n",
    ),
    ("say/words.rs", "commands! {\n", "    Where = \"where\", \"\", \"position and state\" { Where: NOTHING, }\n"),
    (
        "say/execute.rs",
        "        Action::Status => return Answer::Status,\n",
        "        Action::Where => return Answer::Status,\n",
    ),
    (
        "alarm.rs",
        "        StackLow = \"stack_low\",\n",
        "        /// The lamp takes no current.\n        LampDark = \"lamp_dark\",\n",
    ),
    ("operate/event.rs", "pub enum Event {\n", "    /// The machine leans, in degrees.\n    Leaning(i16),\n"),
    (
        "say/line_tables.rs",
        "            events {\n",
        "Leaning \"the machine leans\", Event::Leaning(degrees) => \"leaning\" {
            \" degrees=#\" number(*degrees) => degrees: i32, \"how far\";
        }\n",
    ),
];

fn copy(from: &Path, to: &Path) {
    fs::create_dir_all(to).expect("a folder can be made");
    for entry in fs::read_dir(from).expect("the sources can be read") {
        let entry = entry.expect("the sources can be read");
        let to = to.join(entry.file_name());
        if entry.path().is_dir() {
            copy(&entry.path(), &to);
        } else {
            fs::copy(entry.path(), to).expect("a file can be copied");
        }
    }
}

#[test]
fn the_recipes_of_contributing_build_and_work() {
    let sources = workspace_root();
    let folder = elf().ancestors().nth(3).expect("it is in the target folder").join("recipes");
    let _ = fs::remove_dir_all(&folder);
    let copied = folder.join("sources");
    copy(&sources.join("control"), &copied.join("control"));
    // Nothing else changes.
    for entry in fs::read_dir(sources).expect("the sources can be read") {
        let name = entry.expect("the sources can be read").file_name();
        if !["control", "target", ".git"].contains(&&*name.to_string_lossy()) {
            symlink(sources.join(&name), copied.join(&name)).expect("a link can be made");
        }
    }
    for (file, before, lines) in ADDED {
        let path = copied.join("control/src").join(file);
        let text = fs::read_to_string(&path).expect("it is there");
        let (head, tail) = text.split_once(before).unwrap_or_else(|| panic!("{file}: {before}"));
        fs::write(&path, [head, before, lines, tail].concat()).expect("it can be written");
    }

    // A build folder of its own: in a shared one, cargo takes this firmware for that of the sources afterwards. It stays for the
    // next time.
    let mut cargo = Command::new("cargo");
    cargo.args(["firmware", "--quiet", "--target-dir"]).arg(folder.join("target")).current_dir(&copied);
    cargo.env("CARGO_BUILD_BUILD_DIR", folder.with_file_name("recipes-build"));
    for name in ["RUSTFLAGS", "CARGO_ENCODED_RUSTFLAGS", "CARGO_TARGET_DIR", "RUSTC_WORKSPACE_WRAPPER", "WEEDER_COMMIT"]
    {
        cargo.env_remove(name);
    }
    assert!(cargo.status().expect("cargo can be started").success());
    let elf = folder.join("target/avr-none/firmware/weeder-firmware.elf");
    let Size { flash, .. } = Size::read(&elf).expect("the ELF can be read");
    assert!(flash <= FLASH_BYTES, "{flash} bytes of flash");

    let mut uno = uno_run::boot(&elf, &[]).expect("the firmware wakes up");
    assert_eq!(ask(&mut uno, "get lamp_percent"), ["lamp_percent=50 % from 0 to 100, default 50, not saved"]);
    assert_eq!(ask(&mut uno, "set lamp_percent 70"), [""; 0]);
    assert!(ask(&mut uno, "help lamp_percent")[0].ends_with("brightness of the lamp"));
    assert!(ask(&mut uno, "help").contains(&"where - position and state".to_owned()));
    assert!(ask(&mut uno, "where")[0].starts_with("state="));
}
