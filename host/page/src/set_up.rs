//! Setting up a machine, for the page: the steps of the manual, the next measurement, and the margin.

use crate::console::settings;
use link::set_up::{SetUp, Step, Task, steps};
use link::settings::{Settings, name, unit};
use serde::Deserialize;
use serde_json::{Value, json};
use std::collections::BTreeMap;

/// The typed lines and the output of a session, and the present settings by name.
#[derive(Deserialize)]
pub struct Heard {
    lines: Vec<String>,
    settings: BTreeMap<String, u16>,
}

impl Heard {
    /// The steps, and the results of the session, in the form of `page/src/panel/set_up.ts`.
    pub fn advice(&self) -> Value {
        let set_up = SetUp::of_lines(self.lines.iter().map(String::as_str));
        let (settings, _) = settings(Settings::new(), &self.settings);
        let manual = steps().into_iter().map(|step| {
            let tasks: Vec<String> = step.tasks.iter().map(task).collect();
            json!({ "title": step.title, "how": step.how, "tasks": tasks })
        });
        let margin = set_up.margin(&settings);
        let missing = margin.as_ref().err().map_or(&[][..], Vec::as_slice);
        json!({
            "steps": manual.collect::<Vec<_>>(),
            "next": set_up.next(&settings).map(|step| step.to_string()),
            "missing": missing.iter().map(Step::to_string).collect::<Vec<_>>(),
            "marginMm": margin.as_ref().ok().map(|margin| margin.least_mm()),
            "warning": set_up.warning(&settings),
        })
    }
}

/// The simulated machine's value for a task; empty for a measurement.
fn task(task: &Task) -> String {
    match task {
        Task::Fit(part, value) => format!("{part} = {value}"),
        Task::Set(setting, value) => format!("{} = {value} {}", name(*setting), unit(*setting)),
        Task::TimeServo => "calibrate servo".to_owned(),
        Task::MeasureWheel(length_mm) => format!("calibrate {length_mm}"),
        Task::SetMargin => "margin_mm".to_owned(),
    }
}
