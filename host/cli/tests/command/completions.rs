//! `weeder completions` in real shells.

use crate::common::{assert_has, assert_refused, folder_with, said};
use std::path::Path;
use std::process::Command;

fn completions(word: &str) -> String {
    said(Path::new("."), &["completions", word])
}

/// The words that Tab offers in bash after these words. The last word is incomplete.
fn offered_by_bash(words: &[&str]) -> Vec<String> {
    let folder = folder_with("weeder", &completions("bash"));
    // The call of bash itself: the command, the incomplete word, and the word before it.
    let script = r#"source "$1"; shift
        COMP_WORDS=("$@") COMP_CWORD=$(($# - 1))
        _weeder "$1" "${@: -1}" "${@: -2:1}"
        printf '%s\n' "${COMPREPLY[@]}""#;
    let mut bash = Command::new("bash");
    let output = bash
        .args(["--norc", "-c", script, "bash"])
        .arg(folder.path().join("weeder"))
        .args(words)
        .output()
        .expect("bash is there");
    assert!(output.stderr.is_empty(), "{}", String::from_utf8_lossy(&output.stderr));
    String::from_utf8(output.stdout).expect("it is text").lines().map(str::to_owned).collect()
}

#[test]
fn bash_completes_commands_and_their_options() {
    assert_eq!(offered_by_bash(&["weeder", "mon"]), ["monitor"]);
    assert_eq!(offered_by_bash(&["weeder", "settings", "pu"]), ["pull", "push"]);
    assert_eq!(offered_by_bash(&["weeder", "flash", "--old"]), ["--old-bootloader"]);
    assert_eq!(offered_by_bash(&["weeder", "completions", "z"]), ["zsh"]);
}

#[test]
fn bash_completes_presets_crops_and_axes() {
    assert_eq!(offered_by_bash(&["weeder", "trial", "--field", "so"]), ["soft-ground"]);
    assert_eq!(offered_by_bash(&["weeder", "sweep", "--field", "dire"]), ["direct-sown"]);
    assert_eq!(offered_by_bash(&["weeder", "sweep", "--x", "lead_"]), ["lead_out_ms=", "lead_in_ms="]);
    assert_eq!(offered_by_bash(&["weeder", "sweep", "--y", "ground.slip_p"]), ["ground.slip_percent="]);
    assert_eq!(offered_by_bash(&["weeder", "train", "--crop", "m"]), ["maize"]);
    // If no name matches, bash offers files.
    assert_eq!(offered_by_bash(&["weeder", "trial", "--field", "my-f"]), [""]);
}

#[test]
fn other_shells_complete_every_command() {
    for shell in ["elvish", "fish", "powershell", "zsh"] {
        assert_has(&completions(shell), ["virtual-uno", "monitor", "old-bootloader"]);
    }
}

#[test]
fn the_help_has_a_line_for_each_shell_that_the_manual_names() {
    let help = completions("--help");
    for shell in ["bash", "zsh", "fish", "powershell"] {
        assert_has(&help, [&*format!("weeder completions {shell}")]);
    }
}

#[test]
fn a_shell_that_is_not_known_is_refused_with_those_that_are() {
    let known = "[possible values: bash, elvish, fish, powershell, zsh]";
    assert_refused(Path::new("."), &["completions", "tcsh"], known);
}
