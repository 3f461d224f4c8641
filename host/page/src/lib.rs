//! What the page asks of this project's Rust, so that nothing of it is written twice: what a line of the console means, in
//! which order settings can be sent, how the machine of "Try it" rolls and what becomes of its plants, and what a log shows.
//!
//! [`answer`] takes a question as JSON and gives its answer as JSON: `console`, `trial` and `record` say what they look like,
//! and `page/src/link/`, `page/src/row/` and `page/src/record/` have their types. In a browser, where this is WebAssembly, both pass
//! through one buffer (`exports`). Nothing is remembered from one question to the next, but for the log that is read and the machine
//! that rolls.

mod console;
#[cfg(target_arch = "wasm32")]
mod exports;
mod record;
mod set_up;
mod trial;

#[cfg(target_arch = "wasm32")]
use exports::progress;
pub use record::{table, take};
pub use trial::{hear, roll, table as trial_table};

use serde::Deserialize;
use serde_json::{Value, json};

/// What can be asked, as an object with one key.
#[derive(Deserialize)]
#[serde(rename_all = "camelCase")]
enum Question {
    /// What does this line of the console say?
    Read(String),
    /// Which values lead from these settings to those?
    Steps(console::Change),
    /// What is to be done next to set this machine up?
    SetUp(set_up::Heard),
    /// Put this machine in front of this row.
    Begin(trial::Begun),
    /// Have this become different on the way.
    Change(trial::Different),
    /// What has become of the plants and tall weeds that the tool has left behind?
    Judge(trial::Kept),
    /// Begin a log: are all of its lines to be held?
    Log(bool),
    /// What does the log show?
    Picture,
    /// What would the firmware of these sources have made of the log?
    Replay,
    /// Put the log on the map.
    Job,
    /// What is the map of the logs, in these words?
    Map(gps::picture::Words),
    /// Which firmware is it that this page was built with?
    Firmware,
}

/// Takes how far a long answer is, from 0 to 1: outside of a browser nothing shows it.
#[cfg(not(target_arch = "wasm32"))]
fn progress(_share: f64) {}

/// Answers a question: `{"answer": ...}`, or `{"error": "..."}` where the question is none.
pub fn answer(question: &[u8]) -> String {
    let answer =
        serde_json::from_slice(question).map_err(|error| error.to_string()).and_then(|question| match question {
            Question::Read(line) => Ok(console::read(&line)),
            Question::Steps(change) => Ok(change.steps()),
            Question::SetUp(heard) => Ok(heard.advice()),
            Question::Begin(begun) => begun.begin(),
            Question::Change(different) => different.take(),
            Question::Judge(kept) => kept.judge(),
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
