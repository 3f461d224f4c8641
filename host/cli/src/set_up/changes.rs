//! What has changed since the file of a set-up was written: its board, the machine's measures, and the board's settings.

use super::{Guide, yes_or_no};
use anyhow::{Result, ensure};
use frame::Results;
use link::settings::{self, Setting, name};
use set_up::Task;

/// What the file and the call show before the board is asked.
#[derive(Debug, Default)]
pub(super) struct Changes {
    /// The board of the file, in words, if this one is another.
    pub(super) other_board: Option<String>,
    /// The measures of arm, tool and servo that differ from the file's, each in a line.
    pub(super) measures: Vec<String>,
    /// The step that the user wants again.
    pub(super) again: Option<usize>,
}

impl Guide {
    /// Compares board, measures and settings with those of the file. Steps whose values differ are open again, and so is the
    /// timing of the servo if the leads are others.
    pub(super) fn compare(&mut self, changes: &Changes) -> Result<()> {
        let path = self.path.display().to_string();
        if let Some(other) = &changes.other_board {
            writeln!(Results, "{path} was made for the board with {other}. This one has {}.", self.state.board())?;
            let is_same = self.ask_for("Is it the same machine, with arm and servo: yes, no", Some("no"), yes_or_no)?;
            ensure!(is_same, "give another --state, or start {path} again with --again");
        }
        // An alarm's question may set and read a setting.
        let kept = self.state.measured.settings.clone();
        self.clear_alarm()?;
        let on_board = settings::read(&mut self.link)?;
        self.state.measured.settings.clone_from(&on_board);
        if !self.path.exists() {
            return Ok(());
        }
        // The end switch may be the answer to an alarm just now.
        let differs = |&setting: &Setting| setting != Setting::EndSwitch && on_board.get(setting) != kept.get(setting);
        let differing: Vec<Setting> = Setting::all().filter(differs).collect();
        if !differing.is_empty() && !self.state.done.is_empty() {
            writeln!(Results, "The board does not have the settings of {path}:")?;
            for &setting in &differing {
                writeln!(Results, "  {} is {}, and was {}", name(setting), on_board.get(setting), kept.get(setting))?;
            }
            self.go("Go on with the board's settings")?;
        }
        if !changes.measures.is_empty() {
            writeln!(Results, "The machine does not have the measures of {path}:")?;
            changes.measures.iter().try_for_each(|line| writeln!(Results, "  {line}"))?;
        }
        if [Setting::LeadOutMs, Setting::LeadInMs].iter().any(|lead| differing.contains(lead)) {
            // Another servo may have been timed, or safer leads set: the kept times would put the old leads back.
            self.state.measured.forget_timings();
        }
        self.state.open_again(|task| matches!(task, Task::Set(setting, _) if differing.contains(setting)));
        self.keep()
    }

    /// A board without settings may get those of the file. Returns whether it has.
    pub(super) fn restore(&mut self) -> Result<bool> {
        let path = self.path.display().to_string();
        if self.state.done.is_empty()
            || !self.ask_for(&format!("Set the settings of {path} again: yes, no"), Some("yes"), yes_or_no)?
        {
            return Ok(false);
        }
        let kept = &self.state.measured.settings;
        let kept: Vec<(Setting, u16)> = Setting::all().map(|setting| (setting, kept.get(setting))).collect();
        settings::push(&mut self.link, &kept, &[], true)?;
        Ok(true)
    }
}
