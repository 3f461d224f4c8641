//! Sets the version of `weeder`: the package's version and the commit of the build. Puts a release's files inside.
//!
//! The commit is that of the clone that contains this folder, with a `+` if files of the clone have changed since.
//! Outside of a clone, the version has no commit.
//!
//! The environment variable `WEEDER_INSIDE` names the folder of the files. release.sh sets it; other builds contain none.
//! The other crates do not depend on it, so a release compiles this one only.

use std::path::Path;
use std::process::Command;
use std::{env, fs};

/// The firmware of each chip, its budgets and the bootloader, by the names that `uno_run::firmware` expects.
const FIRMWARE: [&str; 6] = [
    "weeder-firmware.elf",
    "knn-bench.elf",
    "tester-firmware.elf",
    "budgets.toml",
    "yard/tester/budgets.toml",
    "optiboot.hex",
];

/// The page, in the order that `serve::Page` expects.
const PAGE: [&str; 3] = ["page/index.html", "page/page.css", "page/page.js"];

fn main() {
    let version = env::var("CARGO_PKG_VERSION").expect("cargo names the package's version");
    let commit = commit_of_the_clone().map(|commit| format!(" ({commit})")).unwrap_or_default();
    println!("cargo::rustc-env=WEEDER_VERSION={version}{commit}");

    println!("cargo::rerun-if-env-changed=WEEDER_INSIDE");
    let files = env::var("WEEDER_INSIDE").ok().map(|folder| {
        let include = |name: &&str| {
            let path = Path::new(&folder).join(name);
            println!("cargo::rerun-if-changed={}", path.display());
            format!("include_bytes!({path:?})")
        };
        let firmware = FIRMWARE.iter().map(|name| format!("({name:?}, {})", include(name)));
        let page = PAGE.iter().map(include);
        format!(
            "Some(Inside {{ firmware: &[{}], page: [{}] }})",
            firmware.collect::<Vec<_>>().join(", "),
            page.collect::<Vec<_>>().join(", ")
        )
    });
    let out = env::var("OUT_DIR").expect("cargo names it");
    fs::write(Path::new(&out).join("inside.rs"), files.as_deref().unwrap_or("None"))
        .expect("cargo has made the folder");
}

fn commit_of_the_clone() -> Option<String> {
    // The files that git tracks, and the files that change with each commit: Cargo checks their times.
    let root = git(&["rev-parse", "--show-toplevel"])?;
    // Another project's clone may contain these files. The variable is read at run time: two folders that share a
    // target folder share this compiled program.
    let package = env::var("CARGO_MANIFEST_DIR").ok()?;
    let workspace = Path::new(&package).ancestors().nth(2)?;
    if Path::new(&root).canonicalize().ok()? != workspace.canonicalize().ok()? {
        return None;
    }
    println!("cargo::rerun-if-changed={}", git(&["rev-parse", "--git-path", "logs/HEAD"])?);
    for file in git(&["-C", &root, "ls-files"])?.lines() {
        println!("cargo::rerun-if-changed={root}/{file}");
    }
    git(&["describe", "--always", "--exclude=*", "--abbrev=7", "--dirty=+"])
}

/// git's output, if it succeeds.
fn git(arguments: &[&str]) -> Option<String> {
    let output = Command::new("git").args(arguments).output().ok()?;
    let answer = String::from_utf8(output.stdout).ok()?;
    output.status.success().then(|| answer.trim().to_owned())
}
