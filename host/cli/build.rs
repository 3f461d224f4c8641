//! Gives `weeder` its version: the package's, and the commit that it is built from.
//!
//! The commit is that of the environment variable `WEEDER_COMMIT`, or else of the clone that this folder stands in, with a `+` if
//! something in the clone has been changed since. Where there is neither, the version has no commit.

use std::env;
use std::path::Path;
use std::process::Command;

/// Length of a commit's name.
const DIGITS: &str = "--short=7";

fn main() {
    println!("cargo::rerun-if-env-changed=WEEDER_COMMIT");
    let commit = env::var("WEEDER_COMMIT").ok().or_else(commit_of_the_clone).filter(|commit| !commit.is_empty());
    let version = env::var("CARGO_PKG_VERSION").expect("cargo names the package's version");
    let commit = commit.map(|commit| format!(" ({commit})")).unwrap_or_default();
    println!("cargo::rustc-env=WEEDER_VERSION={version}{commit}");
}

fn commit_of_the_clone() -> Option<String> {
    // What git tracks, and where it notes that a commit is another one: Cargo looks at their times.
    let root = git(&["rev-parse", "--show-toplevel"])?;
    // Another project's clone may have this one's files in it.
    // It is asked now: two folders that share their target folder share what this file is compiled to.
    let package = env::var("CARGO_MANIFEST_DIR").ok()?;
    let workspace = Path::new(&package).ancestors().nth(2)?;
    if Path::new(&root).canonicalize().ok()? != workspace.canonicalize().ok()? {
        return None;
    }
    println!("cargo::rerun-if-changed={}", git(&["rev-parse", "--git-path", "logs/HEAD"])?);
    for file in git(&["-C", &root, "ls-files"])?.lines() {
        println!("cargo::rerun-if-changed={root}/{file}");
    }
    let commit = git(&["rev-parse", DIGITS, "HEAD"])?;
    let changed = git(&["status", "--porcelain", "--untracked-files=no"])?;
    Some(if changed.is_empty() { commit } else { commit + "+" })
}

/// What git answers, if it knows.
fn git(arguments: &[&str]) -> Option<String> {
    let output = Command::new("git").args(arguments).output().ok()?;
    let answer = String::from_utf8(output.stdout).ok()?;
    output.status.success().then(|| answer.trim().to_owned())
}
