//! What the page asks of this project's Rust, so that nothing of it is written twice: what a line of the console means, in
//! which order settings can be sent, and what became of the plants of a row.
//!
//! [`answer`] takes a question as JSON and gives its answer as JSON: `console` and `row` say what they look like, and
//! `page/src/link/` and `page/src/try/` have their types. In a browser, where this is WebAssembly, both pass through one buffer
//! (`exports`). Nothing is remembered from one question to the next.

mod console;
#[cfg(target_arch = "wasm32")]
mod exports;
mod row;

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
    /// What became of this row's plants and tall weeds?
    Judge(row::Passed),
}

/// Answers a question: `{"answer": ...}`, or `{"error": "..."}` where the question is none.
pub fn answer(question: &[u8]) -> String {
    let answer =
        serde_json::from_slice(question).map_err(|error| error.to_string()).and_then(|question| match question {
            Question::Read(line) => Ok(console::read(&line)),
            Question::Steps(change) => Ok(change.steps()),
            Question::Judge(passed) => passed.judge(),
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
