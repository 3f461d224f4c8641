//! `weeder completions`: scripts that let a shell complete the command's words.
//!
//! clap_complete makes them from the arguments themselves. They include presets and the axes of sweeps, but neither
//! ports nor values of settings.

use anyhow::Result;
use clap::Args;
use clap_complete::Shell;
use frame::{Results, program};

#[derive(Args)]
#[command(after_help = "\
Examples:
  eval \"$(weeder completions bash)\"    as a line of ~/.bashrc
  weeder completions zsh > ~/.zfunc/_weeder    if ~/.zfunc is in fpath before compinit
  weeder completions fish > ~/.config/fish/completions/weeder.fish
  weeder completions powershell | Out-String | Invoke-Expression    as a line of $PROFILE")]
pub struct Arguments {
    /// The shell.
    shell: Shell,
}

pub fn run(arguments: &Arguments) -> Result<()> {
    let mut command = program::grammar::<crate::Arguments>();
    let mut script = Vec::new();
    clap_complete::generate(arguments.shell, &mut command, "weeder", &mut script);
    write!(Results, "{}", String::from_utf8_lossy(&script))
}
