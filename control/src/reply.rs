//! What the console answers, a line at a time.
//!
//! An answer can be longer than the serial line's buffer, and nothing here may wait for it to drain. So an [`Answer`] is
//! a place in a text that writes its next line whenever the firmware has room for one. Every line, the longest numbers
//! included, fits in [`LINE`] bytes.

mod errors;
mod events;
mod shown;

pub use self::{events::write_event, shown::write_plot};

use self::{
    errors::{write_mistake, write_refusal},
    shown::{write_counts, write_example, write_object, write_setting, write_status, write_version},
};
use crate::{
    classifier::Classifier,
    console::{Command, Mistake, Word},
    controller::{Controller, Refusal},
    memory::Memory,
    said,
    say::{explain, say, say_number, write_state},
    settings::Setting,
};
use ufmt::uWrite;

/// Room that a line needs, its end included.
pub const LINE: usize = 127;

/// The part of an answer that has not been written yet.
#[derive(Clone, Copy, Debug, Default, PartialEq, Eq)]
pub enum Answer {
    /// Nothing.
    #[default]
    Done,
    /// The greeting after a reset.
    Greeting,
    /// The commands, from the one at this place on.
    Help(u8),
    /// What a setting is.
    Explain(Setting),
    /// The status: where the machine is.
    Status,
    /// The status: what was counted.
    Counts,
    /// A setting's value.
    Get(Setting),
    /// All settings, from the one at this place on.
    GetAll(u8),
    /// All examples, from the one at this place on.
    Examples(u8),
    /// The heading of the last objects.
    DumpHeading,
    /// The last objects, from the one at this place on.
    Dump(u8),
    /// The firmware's name.
    Version,
    /// `ok`.
    Ok,
    /// What was wrong with the line.
    Wrong(Mistake),
    /// Why the command was refused.
    Refused(Refusal, Option<Setting>),
}

/// Carries a line out and begins its answer.
#[inline(never)]
pub fn answer<C, M>(line: Result<Command, Mistake>, controller: &mut Controller<C, M>) -> Answer
where
    C: Classifier,
    M: Memory,
{
    let command = match line {
        Ok(command) => command,
        Err(mistake) => {
            controller.count_mistake();
            return Answer::Wrong(mistake);
        }
    };
    match command {
        Command::Help => Answer::Help(0),
        Command::Explain(setting) => Answer::Explain(setting),
        Command::Status => Answer::Status,
        Command::GetAll => Answer::GetAll(0),
        Command::Get(setting) => Answer::Get(setting),
        Command::Version => Answer::Version,
        Command::Examples => Answer::Examples(0),
        Command::Dump => Answer::DumpHeading,
        Command::Set(setting, value) => done(controller.set(setting, value), Some(setting)),
        Command::Save => done(controller.save(), None),
        Command::Revert => done(controller.take_saved(), None),
        Command::Defaults => done(controller.take_defaults(), None),
        Command::CalibrateStart => done(controller.calibrate_start(), None),
        Command::Calibrate { distance_mm, force } => match controller.calibrate(distance_mm, force) {
            Ok(()) => Answer::Get(Setting::TicksPerM),
            refused => done(refused, Some(Setting::TicksPerM)),
        },
        Command::CalibrateServo => done(controller.calibrate_servo(), None),
        Command::ServoIn => done(controller.servo_in(), None),
        Command::ServoOut => done(controller.servo_out(), None),
        Command::Servo(pulse_us) => done(controller.servo_by_hand(pulse_us), Some(Setting::ServoOutUs)),
        Command::TestRow { speed_mm_s } => done(controller.test_row(speed_mm_s), None),
        Command::Plot(plot) => {
            controller.set_plot(plot);
            Answer::Ok
        }
        Command::Start { now } => done(controller.start(now), None),
        Command::Label(label) => done(controller.label(label), None),
        Command::Forget(number) => done(controller.forget(number), None),
        Command::ForgetAll => {
            controller.forget_all();
            Answer::Ok
        }
        Command::Hold => {
            controller.hold();
            Answer::Ok
        }
        Command::Clear => {
            controller.clear();
            Answer::Ok
        }
        Command::Events(on) => {
            controller.tell_events(on);
            Answer::Ok
        }
    }
}

/// The answer to a command that may have been refused.
#[inline(never)]
fn done(result: Result<(), Refusal>, setting: Option<Setting>) -> Answer {
    match result {
        Ok(()) => Answer::Ok,
        Err(refusal) => Answer::Refused(refusal, setting),
    }
}

impl Answer {
    /// Whether there is nothing left to write.
    pub fn is_done(&self) -> bool {
        *self == Self::Done
    }

    /// Writes the next line, with its end.
    ///
    /// # Errors
    /// What `out` reports.
    #[inline(never)]
    pub fn write_line<C, M, W>(&mut self, controller: &Controller<C, M>, out: &mut W) -> Result<(), W::Error>
    where
        C: Classifier,
        M: Memory,
        W: uWrite + ?Sized,
    {
        *self = match *self {
            Self::Done => return Ok(()),
            Self::Greeting => {
                write_version(out)?;
                say(out, said::RESET_BY)?;
                say(out, controller.cause().text())?;
                say(out, said::STATE)?;
                write_state(controller.state(), out)?;
                say(out, said::TOOL_OUT)?;
                Self::Done
            }
            Self::Help(place) => {
                if let Some(word) = Word::from_index(place) {
                    explain(out, word.usage(), word.help())?;
                }
                if place + 1 < Word::COUNT { Self::Help(place + 1) } else { Self::Ok }
            }
            Self::Explain(setting) => {
                explain(out, setting.text(), setting.help())?;
                Self::Get(setting)
            }
            Self::Status => {
                write_status(controller, out)?;
                Self::Counts
            }
            Self::Counts => {
                write_counts(controller, out)?;
                Self::Ok
            }
            Self::Get(setting) => {
                write_setting(controller, setting, out)?;
                Self::Ok
            }
            Self::GetAll(place) => {
                if let Some(setting) = Setting::from_index(place) {
                    write_setting(controller, setting, out)?;
                }
                if place + 1 < Setting::COUNT { Self::GetAll(place + 1) } else { Self::Ok }
            }
            Self::Examples(place) => match controller.classifier().listed(place) {
                Some((listed, next)) => {
                    write_example(&listed, out)?;
                    Self::Examples(next)
                }
                None => {
                    say_number(out, said::SPOILED, controller.classifier().spoiled().into())?;
                    Self::Ok
                }
            },
            Self::DumpHeading => {
                say(out, said::DUMP)?;
                if controller.objects().is_empty() { Self::Ok } else { Self::Dump(0) }
            }
            Self::Dump(place) => {
                let place = usize::from(place);
                if let Some(object) = controller.objects().get(place) {
                    write_object(object, out)?;
                }
                if place + 1 < controller.objects().len() { Self::Dump(place as u8 + 1) } else { Self::Ok }
            }
            Self::Version => {
                write_version(out)?;
                Self::Ok
            }
            Self::Ok => {
                say(out, said::OK)?;
                Self::Done
            }
            Self::Wrong(mistake) => {
                write_mistake(mistake, out)?;
                Self::Done
            }
            Self::Refused(refusal, setting) => {
                write_refusal(refusal, setting, out)?;
                Self::Done
            }
        };
        say(out, said::END)
    }
}
