//! `weeder figures`: updates or checks the figures in the manual, each by the command above it.
//!
//! A figure is a fenced block directly behind a comment that names its command, such as `<!-- figures: weeder trial
//! --speeds 1,2 -->`. The command runs, and its output becomes the block. The output is the same on every machine: run
//! times go to standard error, which is left out.

use anyhow::{Context, Result, bail, ensure};
use clap::Args;
use files::{bounded_file, whole_file};
use frame::{Finding, Messages, Results};
use std::env;
use std::path::{Path, PathBuf};
use std::process::{Command, Stdio};

/// The figures to update.
#[derive(Args)]
#[command(after_help = "\
Examples:
  weeder figures                      update the manual's figures
  weeder figures --check              check them
The status is 1 if --check finds a difference.")]
pub struct Arguments {
    /// The pages with figures.
    #[arg(default_values = ["docs/calibration.md", "docs/figures.md", "docs/set-up.md", "README.md"], value_name = "PAGE.md")]
    pages: Vec<PathBuf>,
    /// Write nothing, but list the figures that differ from their commands' output.
    #[arg(long)]
    check: bool,
}

/// The text before a figure's command.
const MARK: &str = "<!-- figures: ";

pub fn run(arguments: &Arguments) -> Result<Finding> {
    let mut differ = Vec::new();
    for path in &arguments.pages {
        let page = bounded_file::text(path)?;
        let renewed = renew(&page, path)?;
        // Git for Windows may end the page's lines by CR LF.
        if renewed.lines().eq(page.lines()) {
            continue;
        }
        if arguments.check {
            differ.push(format!("{}\n{}", path.display(), difference(&page, &renewed)));
        } else {
            whole_file::write(path, |to| Ok::<_, anyhow::Error>(to.write_all(renewed.as_bytes())?))
                .with_context(|| format!("{} cannot be written", path.display()))?;
        }
    }
    if differ.is_empty() {
        return Ok(Finding::Good);
    }
    writeln!(Results, "These figures differ from their commands' output; `weeder figures` updates them:")?;
    writeln!(Results, "{}", differ.join("\n"))?;
    Ok(Finding::Bad)
}

/// The page with the figures that its commands print now.
fn renew(page: &str, path: &Path) -> Result<String> {
    let (mut renewed, mut lines) = (String::new(), page.lines().enumerate());
    while let Some((_, line)) = lines.next() {
        renewed += &format!("{line}\n");
        let Some(command) = line.strip_prefix(MARK).and_then(|rest| rest.strip_suffix(" -->")) else { continue };
        let place = |number: usize| format!("{}:{}", path.display(), number + 1);
        let Some((number, fence)) = lines.next() else { bail!("{}: no figure follows its command", path.display()) };
        ensure!(fence == "```text", "{}: a block ```text must follow the figure's command directly", place(number));
        ensure!(lines.by_ref().any(|(_, line)| line == "```"), "{}: the figure's block has no end", place(number));
        let figure = print(command).with_context(|| place(number))?;
        renewed += &format!("{fence}\n{figure}```\n");
    }
    Ok(renewed)
}

/// A command's output, which does not depend on the machine.
fn print(command: &str) -> Result<String> {
    let words = shlex::split(command).with_context(|| format!("unbalanced quotes in `{command}`"))?;
    let [program, arguments @ ..] = words.as_slice() else { bail!("there is no command") };
    ensure!(program == "weeder", "figures come from `weeder`, not from `{program}`");
    writeln!(Messages, "{command}");
    let weeder = env::current_exe().context("the running program cannot be found")?;
    let output = Command::new(weeder).args(arguments).stderr(Stdio::null()).output()?;
    // Status 1 is a finding, such as a damaged plant.
    ensure!(matches!(output.status.code(), Some(0 | 1)), "`{command}` fails: run it to see why");
    let printed = String::from_utf8(output.stdout).with_context(|| format!("`{command}` prints no text"))?;
    let lines: Vec<&str> = printed.lines().map(str::trim_end).collect();
    Ok(format!("{}\n", lines.join("\n").trim_matches('\n')))
}

/// The lines that differ, those of the page first.
fn difference(page: &str, renewed: &str) -> String {
    let (page, renewed): (Vec<&str>, Vec<&str>) = (page.lines().collect(), renewed.lines().collect());
    let only = |sign: char, these: &[&str], others: &[&str]| -> String {
        these.iter().filter(|line| !others.contains(line)).map(|line| format!("{sign} {line}\n")).collect()
    };
    only('-', &page, &renewed) + &only('+', &renewed, &page)
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn a_page_without_figures_stays_as_it_is() {
        let page = "# A page\n\n```text\nno figure\n```\n";
        assert_eq!(renew(page, Path::new("page.md")).expect("nothing is to be run"), page);
    }

    #[test]
    fn a_page_with_other_line_ends_does_not_differ() {
        let page = tempfile::NamedTempFile::new().unwrap();
        std::fs::write(page.path(), "# A page\r\n\r\nwithout a last line end").unwrap();
        let arguments = Arguments { pages: vec![page.path().to_owned()], check: true };
        assert_eq!(run(&arguments).unwrap(), Finding::Good);
    }

    #[test]
    fn a_figure_without_its_block_is_named_with_its_line() {
        for (page, complaint) in [
            ("<!-- figures: weeder hex -->\nno block\n", "page.md:2: a block ```text must follow"),
            ("\n<!-- figures: weeder hex -->\n```text\n", "page.md:3: the figure's block has no end"),
            ("<!-- figures: weeder hex -->\n", "page.md: no figure follows"),
            ("<!-- figures: rm it -->\n```text\n```\n", "page.md:2"),
        ] {
            let error = renew(page, Path::new("page.md")).expect_err("it is wrong");
            assert!(error.to_string().starts_with(complaint), "{error:#}");
        }
    }

    #[test]
    fn differences_are_listed_line_by_line() {
        assert_eq!(difference("same\nold\n", "same\nnew\nmore\n"), "- old\n+ new\n+ more\n");
    }
}
