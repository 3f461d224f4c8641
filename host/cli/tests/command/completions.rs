//! `weeder completions` in real shells.

use std::fs;
use std::process::Command;

/// The output of `weeder completions` for a shell.
fn completions(shell: &str) -> String {
    let output = Command::new(env!("CARGO_BIN_EXE_weeder")).args(["completions", shell]).output();
    let output = output.expect("cargo has built the command");
    assert!(output.status.success(), "{}", String::from_utf8_lossy(&output.stderr));
    String::from_utf8(output.stdout).expect("it is text")
}

/// The words that Tab offers in bash after these words. The last word is incomplete.
fn offered_by_bash(words: &[&str]) -> Vec<String> {
    let folder = tempfile::tempdir().expect("there is room for a file");
    let file = folder.path().join("weeder");
    fs::write(&file, completions("bash")).expect("it can be written");
    // The call of bash itself: the command, the incomplete word, and the word before it.
    let script = r#"source "$1"; shift
        COMP_WORDS=("$@") COMP_CWORD=$(($# - 1))
        _weeder "$1" "${@: -1}" "${@: -2:1}"
        printf '%s\n' "${COMPREPLY[@]}""#;
    let mut bash = Command::new("bash");
    let output = bash.args(["--norc", "-c", script, "bash"]).arg(&file).args(words).output().expect("bash is there");
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
        let script = completions(shell);
        for command in ["virtual-uno", "monitor", "old-bootloader"] {
            assert!(script.contains(command), "{shell} is not told of {command}");
        }
    }
}

#[test]
fn the_help_has_a_line_for_each_shell_that_the_manual_names() {
    let output = Command::new(env!("CARGO_BIN_EXE_weeder")).args(["completions", "--help"]).output();
    let help = String::from_utf8(output.expect("cargo has built the command").stdout).expect("it is text");
    for shell in ["bash", "zsh", "fish", "powershell"] {
        assert!(help.contains(&format!("weeder completions {shell}")), "{shell} is not in {help}");
    }
}

#[test]
fn a_shell_that_is_not_known_is_refused_with_those_that_are() {
    let output = Command::new(env!("CARGO_BIN_EXE_weeder")).args(["completions", "tcsh"]).output();
    let output = output.expect("cargo has built the command");
    assert_eq!(output.status.code(), Some(2));
    let message = String::from_utf8_lossy(&output.stderr);
    assert!(message.contains("[possible values: bash, elvish, fish, powershell, zsh]"), "{message}");
}
