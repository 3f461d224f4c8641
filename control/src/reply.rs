//! What the console answers, a line at a time.
//!
//! An answer can be longer than the serial line's buffer, and nothing here may wait for it to drain. So an [`Answer`] is
//! a place in a text that puts its next [`Line`] together whenever the one before it has gone out. [`Console`] has all of it
//! happen in turns of the main loop, each of which does little: it reads or writes a few characters, or puts one line
//! together, or carries one command out. Whatever is typed, the loop turns on.

mod errors;
mod events;
mod names;
mod shown;

pub use self::{events::write_event, shown::write_plot};

use self::{
    errors::{write_mistake, write_refusal},
    shown::{write_counts, write_example, write_object, write_setting, write_state, write_status},
};
use crate::{
    classifier::Classifier,
    console::{Command, Mistake, Word},
    controller::Controller,
    line::Line,
    memory::Memory,
    refusal::Refusal,
    said,
    settings::Setting,
    text::Text,
};

/// Characters that a line has at most, its end included.
pub const LINE: usize = 127;

/// The console's answers: what answers the line that was typed last, and the line that is being written.
#[derive(Clone, Debug, Default)]
pub struct Console {
    answer: Answer,
    line: Line,
}

impl Console {
    /// A console that greets after a reset.
    pub const fn new() -> Self {
        Self { answer: Answer::Greeting, line: Line::new() }
    }

    /// Whether a line can be taken: one is read only when the one before it has been answered in full; until then the bytes wait.
    pub fn listens(&self) -> bool {
        self.answer.is_done() && self.line.is_done()
    }

    /// Takes what a line said, to carry it out in a later turn.
    pub fn take(&mut self, said: Result<Command, Mistake>) {
        self.answer = Answer::Said(said);
    }

    /// The next byte of the line that is being written.
    pub fn next_byte(&mut self) -> Option<u8> {
        self.line.next()
    }

    /// Does the next thing for which a turn of the loop is long enough: has a byte kept for good, carries out what was typed, or
    /// puts the next line together. An answer comes in one piece, then what there is to tell, then the curves.
    #[inline(never)]
    pub fn carry_on<C: Classifier, M: Memory>(&mut self, controller: &mut Controller<C, M>) {
        // An answer waits for what its command wrote to the EEPROM: `ok` means that it is there.
        if !self.line.is_done() || !controller.carry_on() {
            return;
        }
        if let Answer::Said(said) = self.answer {
            self.answer = answer(said, controller);
        } else if !self.answer.is_done() {
            self.answer.write_line(controller, &mut self.line);
        } else if let Some(event) = controller.next_event() {
            write_event(&event, &mut self.line);
        } else if let Some(plot) = controller.next_plot() {
            write_plot(controller, plot, &mut self.line);
        }
    }
}

/// The part of an answer that has not been written yet.
#[derive(Clone, Copy, Debug, Default, PartialEq, Eq)]
// The greeting is 0, as the memory is before anybody has woken up.
#[repr(u8)]
pub enum Answer {
    /// The greeting after a reset.
    Greeting,
    /// Nothing.
    #[default]
    Done,
    /// Whatever answers this, which has not been carried out yet.
    Said(Result<Command, Mistake>),
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
        Command::Servo(pulse_us) => done(controller.servo_by_hand(pulse_us), None),
        Command::TestRow { speed_mm_s } => done(controller.test_row(speed_mm_s), None),
        Command::Plot(plot) => {
            controller.set_plot(plot);
            Answer::Ok
        }
        Command::Start { now } => done(controller.start(now), None),
        Command::Label { label, force } => done(controller.label(label, force), None),
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

    /// Puts the next line together, with its end.
    #[inline(never)]
    pub fn write_line<C: Classifier, M: Memory>(&mut self, controller: &Controller<C, M>, line: &mut Line) {
        *self = match *self {
            Self::Done | Self::Said(_) => return,
            Self::Greeting => {
                line.say(said::WEEDER);
                line.say(said::RESET_BY);
                line.say(controller.cause().text());
                line.say(said::STATE);
                write_state(controller.state(), said::BLANK, line);
                line.say(said::TOOL_OUT);
                Self::Done
            }
            Self::Help(place) => {
                if let Some(word) = Word::from_index(place) {
                    explain(word.usage(), word.help(), line);
                }
                if place + 1 < Word::COUNT { Self::Help(place + 1) } else { Self::Ok }
            }
            Self::Explain(setting) => {
                explain(setting.text(), setting.help(), line);
                Self::Get(setting)
            }
            Self::Status => {
                write_status(controller, line);
                Self::Counts
            }
            Self::Counts => {
                write_counts(controller, line);
                Self::Ok
            }
            Self::Get(setting) => {
                write_setting(controller, setting, line);
                Self::Ok
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
                    line.say(said::SPOILED);
                    line.counted(controller.classifier().spoiled().into());
                    Self::Ok
                }
            },
            Self::DumpHeading => {
                line.say(said::DUMP);
                if controller.objects().is_empty() { Self::Ok } else { Self::Dump(0) }
            }
            Self::Dump(place) => {
                let place = usize::from(place);
                if let Some(object) = controller.objects().get(place) {
                    write_object(object, line);
                }
                if place + 1 < controller.objects().len() { Self::Dump(place as u8 + 1) } else { Self::Ok }
            }
            Self::Version => {
                line.say(said::WEEDER);
                Self::Ok
            }
            Self::Ok => {
                line.say(said::OK);
                Self::Done
            }
            Self::Wrong(mistake) => {
                write_mistake(mistake, line);
                Self::Done
            }
            Self::Refused(refusal, setting) => {
                write_refusal(refusal, setting, line);
                Self::Done
            }
        };
        line.say(said::END);
    }
}

/// A name and what it stands for.
fn explain(name: Text, explanation: Text, line: &mut Line) {
    line.say(name);
    line.say(said::DASH);
    line.say(explanation);
}
