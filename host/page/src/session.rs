//! Sessions with machines, over wires that the page opens. `page/src/link/session.ts` passes time and bytes.

use link::LinkError;
use link::moment::Moment;
use link::session::{Happening, Session, Turn};
use serde::Deserialize;
use serde_json::{Value, json};
use std::cell::RefCell;
use std::time::Duration;

thread_local! {
    /// The sessions so far, by their numbers; `None` if it was closed.
    static SESSIONS: RefCell<Vec<Option<Session>>> = const { RefCell::new(Vec::new()) };
}

/// A [`Moment`] by the page's clocks, in milliseconds.
#[derive(Clone, Copy, Deserialize)]
#[serde(rename_all = "camelCase")]
pub struct Clocks {
    ticking_ms: f64,
    calendar_ms: f64,
}

/// A request to a session.
#[derive(Deserialize)]
#[serde(rename_all = "camelCase", rename_all_fields = "camelCase")]
pub enum What {
    /// Type a command. Answers its number, or `null` if it is no command or too many wait.
    Command { line: String, deadline: Clocks },
    /// Type `hold` at once. Answers its number.
    Hold,
    /// What has the wire received, with a character for each byte? Answers what happened.
    Listen { received: String },
    /// What is the time? Answers what happened, and what to send.
    Turn { now: Clocks },
    /// The wire is closed, and why. Answers the ends of all commands.
    Close { why: String },
}

/// Begins a session over an open wire. Answers its number.
pub fn open(resets: bool) -> Value {
    SESSIONS.with_borrow_mut(|sessions| {
        // The page needs the events.
        let mut session = Session::default();
        session.keeps_events = true;
        session.open(resets);
        sessions.push(Some(session));
        json!(sessions.len() - 1)
    })
}

/// Does what is requested of the session with this number.
///
/// # Errors
/// If there is no such session.
pub fn take(number: usize, what: What) -> Result<Value, String> {
    SESSIONS.with_borrow_mut(|sessions| {
        let place = sessions.get_mut(number).ok_or("there is no such session")?;
        let session = place.as_mut().ok_or("the session is closed")?;
        Ok(match what {
            What::Command { line, deadline } => json!(session.command(&line, deadline.into())),
            What::Hold => json!(session.hold()),
            What::Listen { received } => {
                let received: Vec<u8> = received.chars().map(|byte| u8::try_from(byte).unwrap_or(b'?')).collect();
                listen(session, &received)
            }
            What::Turn { now } => {
                let turn = session.turn(now.into(), &[]);
                answer(session, turn)
            }
            What::Close { why } => {
                session.close(why);
                let ends = listen(session, &[]);
                *place = None;
                ends
            }
        })
    })
}

fn listen(session: &mut Session, received: &[u8]) -> Value {
    let happened = session.listen(received);
    answer(session, Turn { happened, ..Turn::default() })
}

impl From<Clocks> for Moment {
    fn from(clocks: Clocks) -> Self {
        let time = |ms: f64| Duration::try_from_secs_f64(ms / 1000.0).unwrap_or_default();
        Self { ticking: time(clocks.ticking_ms), calendar: time(clocks.calendar_ms) }
    }
}

/// A turn in the form of `Turn` in `page/src/link/session.ts`.
fn answer(session: &mut Session, turn: Turn) -> Value {
    let send: String = turn.to_send.into_iter().map(char::from).collect();
    let news: Vec<Value> = turn.happened.iter().map(Happening::news).collect();
    let failure = session.take_failure().map(|error| failure(&error));
    json!({ "news": news, "isGivenUp": turn.is_given_up, "send": send, "failure": failure })
}

/// Why no weeder answers, in the form of `Failure` in `page/src/link/session.ts`.
fn failure(error: &LinkError) -> Value {
    let (is, about) = match error {
        LinkError::Noise => ("noText", String::new()),
        LinkError::Unsteady(_) => ("unsteady", String::new()),
        LinkError::Silent { received, .. } if received.is_empty() => ("nothingAnswers", String::new()),
        LinkError::Restarted(command) => ("resetWhileAsked", command.clone()),
        LinkError::Silent { received: answer, .. }
        | LinkError::NotTheWeeder(answer)
        | LinkError::Refused { answer, .. } => ("otherDevice", answer.chars().take(60).collect()),
        error => ("otherDevice", error.to_string()),
    };
    json!({ "is": is, "about": about })
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn a_session_that_is_closed_takes_no_request() {
        let number = usize::try_from(open(false).as_u64().unwrap()).unwrap();
        let request = |what| take(number, what);
        let heard = request(What::Listen { received: "\u{ff}\u{100}\r\n".to_owned() }).unwrap();
        assert_eq!(heard, json!({ "news": [], "isGivenUp": false, "send": "", "failure": null }));
        let turn = request(What::Turn { now: Clocks { ticking_ms: 0.0, calendar_ms: 0.0 } }).unwrap();
        assert!(turn["send"].as_str().unwrap().ends_with("\u{8}\n") && turn["failure"].is_null(), "{turn}");
        let deadline = Clocks { ticking_ms: 9.0, calendar_ms: 9.0 };
        assert_eq!(request(What::Command { line: "two\nlines".to_owned(), deadline }), Ok(Value::Null));
        assert_eq!(request(What::Hold), Ok(json!(1)));
        let closed = request(What::Close { why: "pulled".to_owned() }).unwrap();
        assert_eq!(
            closed["news"][1],
            json!({ "is": "unanswered", "number": 1, "why": "notTyped", "because": "pulled" })
        );
        assert!(request(What::Hold).is_err());
    }
}
