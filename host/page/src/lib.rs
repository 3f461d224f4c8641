//! The project's Rust for the page, so that no code is written twice: sessions with machines, the meaning of a console
//! line, the order of changed settings, the machine and plants of "Try it", and the content of a log.
//!
//! [`answer`] takes a question as JSON and returns its answer as JSON. `console`, `session`, `simulation` and `record` define
//! their forms, and `page/src/link/`, `page/src/row/` and `page/src/record/` have their types. In a browser, as WebAssembly,
//! both pass through one buffer (`exports`). The only state between questions are the sessions, the log that is being read,
//! the rolling machine, and the measurements of a set-up.

mod console;
#[cfg(target_arch = "wasm32")]
mod exports;
mod record;
mod session;
mod simulation;

#[cfg(target_arch = "wasm32")]
use exports::progress;
pub use record::take;

use serde::Deserialize;
use serde_json::{Value, json};
use simulation::{Simulation, with};

/// A question, as an object with one key.
#[derive(Deserialize)]
#[serde(rename_all = "camelCase", rename_all_fields = "camelCase")]
enum Question {
    /// What does this line of the console say?
    Read(String),
    /// Begin a session over an open wire. True if opening it has reset the Uno.
    Open(bool),
    /// What does this session answer?
    Session { session: usize, what: session::What },
    /// Which values change these settings to those?
    Steps(console::Change),
    /// What is the next step of setting up this machine?
    SetUp(console::Heard),
    /// Put this machine in front of this row.
    Begin(simulation::Begun),
    /// Change this on the way.
    Change(simulation::Different),
    /// Roll on until this cycle of the Uno's clock. How do the pins change until then?
    Roll(f64),
    /// The Uno has sent its servo a pulse, by the cycles of its edges.
    Hear(f64, f64),
    /// What does the machine do now?
    Look,
    /// What is the result for the plants and tall weeds behind the tool, by the firmware's margin on both sides of a
    /// plant, and its stem zone? The zone is 0 for whole canopies.
    Judge { margin_mm: u32, stem_zone_mm: u32 },
    /// Begin a log. True keeps all its lines.
    Log(bool),
    /// What does the log show?
    Picture,
    /// What would the firmware of these sources have decided?
    Replay,
    /// Add the log to the map.
    Job,
    /// What is the map of the logs, with these texts?
    Map(gps::picture::Words),
    /// Which firmware was this page built with?
    Firmware,
}

/// Ignores the progress: only a browser shows it.
#[cfg(not(target_arch = "wasm32"))]
fn progress(_share: f64) {}

/// Answers a question: `{"answer": ...}`, or `{"error": "..."}` if the question is invalid.
pub fn answer(question: &[u8]) -> String {
    let answer =
        serde_json::from_slice(question).map_err(|error| error.to_string()).and_then(|question| match question {
            Question::Read(line) => Ok(console::read(&line)),
            Question::Open(resets) => Ok(session::open(resets)),
            Question::Session { session, what } => session::take(session, what),
            Question::Steps(change) => Ok(change.steps()),
            Question::SetUp(heard) => Ok(heard.advice()),
            Question::Begin(begun) => Ok(begun.begin()),
            Question::Change(different) => with(|simulation| simulation.change(different)),
            Question::Roll(cycle) => with(|simulation| simulation.roll(cycle)),
            Question::Hear(rise, fall) => with(|simulation| simulation.hear(rise, fall)),
            Question::Look => with(Simulation::look),
            Question::Judge { margin_mm, stem_zone_mm } => {
                with(|simulation| json!(simulation.judge(margin_mm, stem_zone_mm)))
            }
            Question::Log(is_whole) => Ok(record::begin(is_whole)),
            Question::Picture => Ok(record::picture()),
            Question::Replay => Ok(record::replayed(progress)),
            Question::Job => Ok(record::job()),
            Question::Map(words) => Ok(record::map(&words)),
            Question::Firmware => Ok(console::firmware()),
        });
    let answer: Value = match answer {
        Ok(answer) => json!({ "answer": answer }),
        Err(error) => json!({ "error": error }),
    };
    answer.to_string()
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn what_is_no_question_is_an_error() {
        for question in ["", "{}", r#"{"read":1}"#, r#"{"guess":"x"}"#, r#"{"judge":{}}"#, "\u{fffd}"] {
            let said: Value = serde_json::from_str(&answer(question.as_bytes())).unwrap();
            assert!(said["error"].is_string() && said["answer"].is_null(), "{question}: {said}");
        }
    }
}
