//! Sets the version of `weeder`: the package's version and the commit of the build.
//!
//! The commit comes from the environment variable `WEEDER_COMMIT`, or else from the clone that contains this folder,
//! with a `+` if files of the clone have changed since. Without both, the version has no commit.

use std::env;
use std::path::Path;
use std::process::Command;

fn main() {
    println!("cargo::rerun-if-env-changed=WEEDER_COMMIT");
    let commit = env::var("WEEDER_COMMIT").ok().or_else(commit_of_the_clone).filter(|commit| !commit.is_empty());
    let version = env::var("CARGO_PKG_VERSION").expect("cargo names the package's version");
    let commit = commit.map(|commit| format!(" ({commit})")).unwrap_or_default();
    println!("cargo::rustc-env=WEEDER_VERSION={version}{commit}");
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
