//! Includes the firmware in the program, if `WEEDER_FIRMWARE` names a folder with it. release.sh sets it. Other builds
//! contain no firmware, and build it with cargo.

use std::path::Path;
use std::{env, fs};

/// The files, by the names that `firmware.rs` expects.
const FILES: [&str; 6] = [
    "weeder-firmware.elf",
    "knn-bench.elf",
    "tester-firmware.elf",
    "budgets.toml",
    "yard/tester/budgets.toml",
    "optiboot.hex",
];

fn main() {
    println!("cargo:rerun-if-env-changed=WEEDER_FIRMWARE");
    let inside = env::var("WEEDER_FIRMWARE").ok().map(|folder| {
        FILES.map(|name| {
            let path = Path::new(&folder).join(name);
            println!("cargo:rerun-if-changed={}", path.display());
            format!("({name:?}, include_bytes!({path:?}))")
        })
    });
    let code = inside.map_or_else(|| "None".to_owned(), |files| format!("Some(&[{}])", files.join(", ")));
    let out = env::var("OUT_DIR").expect("cargo names it");
    fs::write(Path::new(&out).join("inside.rs"), code).expect("cargo has made the folder");
}
