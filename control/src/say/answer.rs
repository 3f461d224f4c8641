//! Answers, a line at a time.

use super::{
    command::{ParseError, Wrong},
    errors::write_command_error,
    line::Line,
    lines::{Counts, Status, write_alarm, write_allowed, write_detection, write_example, write_setting},
    names,
    packed::Text,
    texts,
    words::Word,
};
use crate::{
    ground::class::Classifier,
    memory::Memory,
    operate::{command_error::CommandError, state::State},
    settings::Setting,
    weeder::Controller,
};

/// The part of an answer that is not yet written. Two bytes, which the chip returns in registers.
#[derive(Clone, Copy, Debug, Default, PartialEq, Eq)]
// `Greeting` is 0, like memory before start-up.
#[repr(u8)]
pub enum Answer {
    /// The greeting after a reset.
    Greeting,
    /// Nothing.
    #[default]
    Done,
    /// The answer to the console's command, which has not been run yet.
    Typed,
    /// The commands from this index on.
    Help(u8),
    /// What a setting means.
    Explain(Setting),
    /// First status line: the machine.
    Status,
    /// Second status line: counters.
    Counts,
    /// A setting's value.
    Get(Setting),
    /// How far the calibrated wheel is from its diameter; then its setting.
    Calibrated,
    /// The settings from this index on.
    GetAll(u8),
    /// The examples from this index on.
    Examples(u8),
    /// The heading of the detections.
    DumpHeading,
    /// The detections from this index on.
    Dump(u8),
    /// The firmware's name.
    Version,
    /// `ok`.
    Ok,
    /// The line says nothing that is known.
    Wrong(Wrong),
    /// The command takes other arguments.
    Usage(Word),
    /// The setting takes a value within its range.
    OutOfRange(Setting),
    /// The setting can be changed in HOLD only.
    HoldToSet(Setting),
    /// A command error.
    Refused(CommandError),
}

impl Answer {
    /// Whether the answer is complete.
    pub fn is_done(&self) -> bool {
        *self == Self::Done
    }

    /// Builds the next line and its end.
    #[inline(never)]
    pub fn write_line<C: Classifier, M: Memory>(&mut self, controller: &Controller<C, M>, line: &mut Line) {
        *self = match *self {
            Self::Done | Self::Typed => return,
            Self::Greeting => {
                line.add(names::WEEDER);
                line.say(texts::RESET_BY);
                line.add(controller.cause().text());
                if controller.was_working() {
                    line.say(texts::WAS_WORK);
                }
                line.say(texts::STATE);
                line.add(names::state(controller.state()));
                if let State::Alarm(alarm) = controller.state() {
                    write_alarm(alarm, line);
                }
                line.say(texts::TOOL_OUT);
                Self::Done
            }
            Self::Help(place) => {
                if let Some(word) = Word::from_index(place) {
                    line.add(word.text());
                    explain(word.takes(), word.help(), line);
                }
                if place + 1 < Word::COUNT { Self::Help(place + 1) } else { Self::Ok }
            }
            Self::Explain(setting) => {
                explain(setting.text(), setting.help(), line);
                Self::Get(setting)
            }
            Self::Status => {
                Status::write(controller, line);
                Self::Counts
            }
            Self::Counts => {
                Counts::write(controller, line);
                Self::Ok
            }
            Self::Get(setting) => {
                write_setting(controller, setting, line);
                Self::Ok
            }
            Self::Calibrated => {
                line.say(texts::OFF_THE_DIAMETER);
                line.counted(controller.distance().off_permille());
                Self::Get(Setting::TicksPerM)
            }
            Self::GetAll(place) => {
                if let Some(setting) = Setting::from_index(place) {
                    write_setting(controller, setting, line);
                }
                if place + 1 < Setting::COUNT { Self::GetAll(place + 1) } else { Self::Ok }
            }
            Self::Examples(place) => match controller.classifier().listed(place) {
                Some((listed, next)) => {
                    write_example(&listed, line);
                    Self::Examples(next)
                }
                None => {
                    line.say(texts::SPOILED);
                    line.counted(controller.classifier().spoiled().into());
                    Self::Ok
                }
            },
            Self::DumpHeading => {
                line.say(texts::DUMP);
                if controller.detections().is_empty() { Self::Ok } else { Self::Dump(0) }
            }
            Self::Dump(place) => {
                if let Some(detection) = controller.detections().get(place) {
                    write_detection(detection, line);
                }
                if place + 1 < controller.detections().len() { Self::Dump(place + 1) } else { Self::Ok }
            }
            Self::Version => {
                line.add(names::WEEDER);
                Self::Ok
            }
            Self::Ok => {
                line.say(texts::OK);
                Self::Done
            }
            Self::Wrong(_) | Self::Usage(_) | Self::OutOfRange(_) | Self::HoldToSet(_) | Self::Refused(_) => {
                self.write_error(controller, line);
                Self::Done
            }
        };
        line.say(texts::END);
    }

    /// Builds the line of an answer that is an error.
    fn write_error<C: Classifier, M: Memory>(self, controller: &Controller<C, M>, line: &mut Line) {
        line.say(texts::ERROR);
        match self {
            Self::Wrong(wrong) => line.add(wrong.text()),
            Self::Usage(word) => {
                line.say(texts::USAGE);
                line.add(word.text());
                line.add(word.takes());
            }
            Self::OutOfRange(setting) => write_allowed(setting.text(), setting, line),
            Self::HoldToSet(setting) => {
                line.add(setting.text());
                line.say(texts::HOLD_TO_SET);
            }
            Self::Refused(error) => write_command_error(error, controller, line),
            _ => {}
        }
    }
}

impl From<ParseError> for Answer {
    fn from(error: ParseError) -> Self {
        match error {
            ParseError::Line(wrong) => Self::Wrong(wrong),
            ParseError::Usage(word) => Self::Usage(word),
            ParseError::Value(setting) => Self::OutOfRange(setting),
        }
    }
}

/// The rest of a name, and its explanation.
fn explain(name: Text, explanation: Text, line: &mut Line) {
    line.add(name);
    line.say(texts::DASH);
    line.add(explanation);
}
