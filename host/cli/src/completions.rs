//! `weeder completions`: what a shell has to be told so that Tab completes the command's words.
//!
//! The words are those of the arguments themselves, by clap_complete. Presets and what an axis can be are among them,
//! ports and values of settings are not.

use crate::output;
use anyhow::Result;
use clap::Args;
use clap_complete::Shell;

/// What the user asks of the completions.
#[derive(Args)]
#[command(after_help = "\
Examples:
  source <(weeder completions bash)    as a line of ~/.bashrc
  weeder completions zsh > ~/.zfunc/_weeder    if ~/.zfunc is in fpath before compinit
  weeder completions fish > ~/.config/fish/completions/weeder.fish")]
pub struct Arguments {
    /// The shell.
    shell: Shell,
}

/// Prints the script that the shell reads.
///
/// # Errors
/// If it cannot be printed.
pub fn run(arguments: &Arguments, mut command: clap::Command) -> Result<()> {
    let mut script = Vec::new();
    clap_complete::generate(arguments.shell, &mut command, "weeder", &mut script);
    output::print(format_args!("{}", String::from_utf8_lossy(&script)))
}
