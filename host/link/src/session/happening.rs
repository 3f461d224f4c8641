//! What happens in a session.

use crate::settings::{Settings, helps};
use crate::{EventLine, Mode, Status, Values};
use control::alarm::Warning;
use serde_json::{Value, json};

/// Warnings that the answer to `status` does not name. They last until the machine holds.
pub(super) const UNTIL_HOLD: [Warning; 2] = [Warning::LateCommand, Warning::SlipUnknown];

pub(super) fn named_warning(line: &str) -> Option<Warning> {
    Values(line).text("warning").and_then(|name| Warning::find(name.as_bytes()))
}

/// Something that happened in a session.
#[derive(Clone, Debug, PartialEq, Eq)]
pub enum Happening {
    /// The firmware has started. An Uno that starts when its port is opened reports this too.
    Started {
        /// Its greeting, with the cause.
        greeting: String,
        /// The cause, if the machine was at work before: it has not weeded since.
        while_at_work: Option<String>,
    },
    /// The machine is connected, or has restarted.
    Connected {
        /// The firmware's version.
        version: String,
        /// Its settings, as far as this version knows them: see [`other_version`](crate::settings::other_version).
        settings: Settings,
        /// The lines that show them.
        shown: Vec<String>,
        /// Its examples, a line each.
        examples: Vec<String>,
    },
    /// The machine is gone or silent, or has been reset, and why.
    Lost(String),
    /// The machine's status.
    Status(Status, String),
    /// The present warning has changed, or has ended. There is none at a connection.
    Warning(Option<Warning>),
    /// The machine sent an event line.
    Event(EventLine, String),
    /// A command was typed.
    Command(String),
    /// A line of the answer to it. The last one is `ok` or begins with `error:`.
    Answer(String),
    /// That was the last line of the answer.
    Answered {
        /// The command's number.
        number: u64,
        /// The command.
        command: String,
        /// The line that begins with `error:`, if the firmware refused, or if noise on the line has changed the value.
        refusal: Option<String>,
    },
    /// A command will not be answered.
    Unanswered {
        /// The command's number.
        number: u64,
        /// The command.
        command: String,
        /// Why.
        why: Unanswered,
    },
    /// The settings after a command has changed or saved some, and the lines that show them.
    Settings(Settings, Vec<String>),
    /// The examples after a command has changed some, a line each.
    Examples(Vec<String>),
}

impl Happening {
    /// The present warning after this. `warning` is the one before.
    pub(super) fn warning_after(&self, warning: Option<Warning>) -> Option<Warning> {
        match self {
            Self::Event(EventLine::Warning { warning }, _) => Some(*warning),
            Self::Event(EventLine::State { mode: Mode::Hold }, _) => {
                warning.filter(|warning| !UNTIL_HOLD.contains(warning))
            }
            _ => warning,
        }
    }

    /// This in the form of `News` in `page/src/link/session.ts`.
    pub fn news(&self) -> Value {
        match self {
            Self::Started { greeting, while_at_work } => {
                json!({ "is": "restarted", "said": greeting, "wasAtWork": while_at_work.is_some() })
            }
            Self::Connected { version, shown, examples, .. } => {
                json!({ "is": "there", "version": version, "settings": shown, "examples": examples, "help": helps() })
            }
            Self::Lost(why) => json!({ "is": "lost", "why": why }),
            Self::Status(_, line) => json!({ "is": "status", "said": line }),
            Self::Warning(warning) => {
                json!({ "is": "warning", "said": warning.map(|warning| warning.text().to_string()) })
            }
            Self::Event(_, line) => json!({ "is": "event", "said": line }),
            Self::Settings(_, lines) => json!({ "is": "settings", "said": lines }),
            Self::Examples(lines) => json!({ "is": "examples", "said": lines }),
            Self::Command(line) => json!({ "is": "command", "line": line }),
            Self::Answer(line) => json!({ "is": "answer", "line": line }),
            Self::Answered { number, refusal, .. } => {
                json!({ "is": "answered", "number": number, "refusal": refusal })
            }
            Self::Unanswered { number, why, .. } => {
                let (why, because) = match why {
                    Unanswered::Late => ("late", None),
                    Unanswered::Held => ("held", None),
                    Unanswered::NotTyped(because) => ("notTyped", Some(because)),
                    Unanswered::Unknown(because) => ("unknown", Some(because)),
                };
                json!({ "is": "unanswered", "number": number, "why": why, "because": because })
            }
        }
    }
}

/// Why a command will not be answered.
#[derive(Clone, Debug, PartialEq, Eq)]
pub enum Unanswered {
    /// It was not typed: its deadline had passed.
    Late,
    /// It was not typed: a `hold` came first.
    Held,
    /// It was not typed: the machine is lost, and why.
    NotTyped(String),
    /// The machine is lost, and why. It may have obeyed, or may still do so.
    Unknown(String),
}

/// What a turn has led to.
#[derive(Debug, Default)]
pub struct Turn {
    /// What happened.
    pub happened: Vec<Happening>,
    /// The bytes to send now.
    pub to_send: Vec<u8>,
    /// Whether typed lines were given up: what the wire has not sent yet must not be sent any more.
    pub is_given_up: bool,
}
