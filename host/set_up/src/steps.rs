//! The steps of setting up a machine, read from the manual.
//!
//! `docs/set-up.md` is the only list of parts and settings. The terminal, the page and the tests read its steps here.

use link::settings::{Setting, name};

const PAGE: &str = include_str!("../../../docs/set-up.md");

/// The page's steps are between these marks.
const BEGIN: usize = position(PAGE, "<!-- steps -->");
const END: usize = position(PAGE, "<!-- steps end -->");

/// The steps alone: no program contains the rest of the page.
static STEPS: [u8; END - BEGIN] = {
    let (mut steps, mut at) = ([0; END - BEGIN], 0);
    while at < steps.len() {
        steps[at] = PAGE.as_bytes()[BEGIN + at];
        at += 1;
    }
    steps
};

/// The position of a mark that is in the text.
const fn position(text: &str, mark: &str) -> usize {
    let (text, mark, mut at) = (text.as_bytes(), mark.as_bytes(), 0);
    loop {
        let mut same = 0;
        while same < mark.len() && text[at + same] == mark[same] {
            same += 1;
        }
        if same == mark.len() {
            return at;
        }
        at += 1;
    }
}

/// A step of the page.
#[derive(Clone, Debug, PartialEq)]
pub struct ManualStep {
    /// Its number, from 1.
    pub number: usize,
    /// Its name.
    pub title: &'static str,
    /// The parts to fit and the values to set or measure. Empty if there is nothing to type.
    pub tasks: Vec<Task>,
    /// How it is done.
    pub how: &'static str,
}

/// A task of a step.
#[derive(Clone, Copy, Debug, PartialEq)]
pub enum Task {
    /// Fit a part: its name and value in the simulated field.
    Fit(&'static str, f64),
    /// Set a value. The page has the simulated machine's value.
    Set(Setting, u16),
    /// Time the servo.
    TimeServo,
    /// Measure the wheel over this length in millimetres.
    MeasureWheel(u16),
    /// Set the margin that was calculated.
    SetMargin,
}

impl Task {
    /// Parses the text between the code marks of a step.
    fn parse(code: &'static str) -> Option<Self> {
        let words: Vec<&str> = code.split(' ').collect();
        match words[..] {
            ["calibrate", "servo"] => Some(Self::TimeServo),
            ["calibrate", length_mm] => length_mm.parse().ok().map(Self::MeasureWheel),
            [setting] => (setting == name(Setting::MarginMm)).then_some(Self::SetMargin),
            [part, "=", value] if part.contains('.') => value.parse().ok().map(|value| Self::Fit(part, value)),
            [setting, "=", value] => Some(Self::Set(Setting::find(setting.as_bytes())?, value.parse().ok()?)),
            _ => None,
        }
    }
}

impl ManualStep {
    /// Whether settings or measurements show that it is done. Otherwise only the user knows.
    pub fn is_shown(&self) -> bool {
        let is_shown = |task: &Task| match task {
            Task::Set(setting, _) => matches!(setting, Setting::SecondBeamMm | Setting::StemZoneMm),
            Task::Fit(..) => false,
            Task::TimeServo | Task::MeasureWheel(_) | Task::SetMargin => true,
        };
        self.tasks.iter().any(is_shown)
    }
}

/// The steps, in the page's order.
pub fn steps() -> Vec<ManualStep> {
    sections().filter_map(step).collect()
}

/// The sections that are steps, each from its number on.
fn sections() -> impl Iterator<Item = &'static str> {
    // The marks are whole characters of a text.
    str::from_utf8(&STEPS).unwrap_or_default().split("\n### ").skip(1)
}

/// Parses a section: its number and title, a line of instruction, and the lines to type, if there are any.
fn step(section: &'static str) -> Option<ManualStep> {
    let mut lines = section.lines().filter(|line| !line.is_empty());
    let (number, title) = lines.next()?.split_once(". ")?;
    let (how, codes) = (lines.next()?, lines.next().unwrap_or_default());
    let tasks: Option<Vec<Task>> = codes.split('`').skip(1).step_by(2).map(Task::parse).collect();
    let step = ManualStep { number: number.parse().ok()?, title, tasks: tasks?, how };
    lines.next().is_none().then_some(step)
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn every_section_of_the_page_is_a_step_and_the_margin_is_the_last() {
        let steps = steps();
        assert_eq!(steps.len(), sections().count(), "a section is not understood");
        assert!((5..=12).contains(&steps.len()), "{}", steps.len());
        assert!(steps.iter().map(|step| step.number).eq(1..=steps.len()));
        for step in &steps {
            assert_eq!(step.tasks.contains(&Task::SetMargin), step.number == steps.len(), "{step:?}");
            for task in &step.tasks {
                if let Task::Set(setting, value) = *task {
                    assert!(setting.allows(value), "{step:?}");
                    assert_ne!(setting, Setting::MarginMm, "the margin follows from what was measured");
                }
            }
        }
    }

    #[test]
    fn a_step_that_swings_the_tool_at_a_standstill_says_where_to_stand() {
        let swings = |step: &ManualStep| step.tasks.contains(&Task::TimeServo);
        let hows: Vec<&str> = steps().iter().filter(|step| swings(step)).map(|step| step.how).collect();
        assert!(
            !hows.is_empty() && hows.iter().all(|how| how.contains("no plant is within the tool's reach")),
            "{hows:?}"
        );
    }

    #[test]
    fn text_that_is_no_task_is_not_a_task() {
        for code in ["calibrate", "calibrate much", "servo_out_us", "no_such_setting = 3", "servo_out_us = 99999", ""] {
            assert_eq!(Task::parse(code), None, "{code}");
        }
        assert_eq!(Task::parse("machine.tool_width_mm = 100"), Some(Task::Fit("machine.tool_width_mm", 100.0)));
    }
}
