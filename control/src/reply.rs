//! What the console answers, a line at a time, and the wording of everything the machine says.
//!
//! An answer can be longer than the serial line's buffer, and nothing here may wait for it to drain. So an [`Answer`] is
//! a place in a text that writes its next line whenever the firmware has room for one. Every line, the longest numbers
//! included, fits in [`LINE`] bytes.

use crate::{
    alarm::Alarm,
    classifier::{Class, Classifier},
    console::{Command, Mistake, Word},
    controller::{Controller, Refusal, State},
    event::Event,
    settings::Setting,
    text::{Text, text},
};
use ufmt::{uWrite, uwrite};

/// Room that a line needs, its end included.
pub const LINE: usize = 127;

/// A command with its words, and what it does.
#[inline(never)]
fn help(word: Word) -> (Text, Text) {
    match word {
        Word::Help => (text!("help [name]"), text!("this list, or what a setting is")),
        Word::Status => (text!("status"), text!("state, position, speed and windows in one line")),
        Word::Get => (text!("get [name]"), text!("one setting, or all")),
        Word::Set => (text!("set name value"), text!("change a setting, until the next reset")),
        Word::Start => (text!("start [now]"), text!("weed; now, at once over ground the beam has not seen")),
        Word::Hold => (text!("hold"), text!("take the tool out of the row")),
        Word::Clear => (text!("clear"), text!("clear an alarm")),
        Word::Events => (text!("events on|off"), text!("tell of plants, swings and alarms as they come")),
        Word::Version => (text!("version"), text!("name the firmware")),
    }
}

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
    /// The status line.
    Status,
    /// A setting's value.
    Get(Setting),
    /// All settings, from the one at this place on.
    GetAll(u8),
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
pub fn answer<C: Classifier>(line: Result<Command, Mistake>, controller: &mut Controller<C>) -> Answer {
    let command = match line {
        Ok(command) => command,
        Err(mistake) => return Answer::Wrong(mistake),
    };
    match command {
        Command::Help => Answer::Help(0),
        Command::Explain(setting) => Answer::Explain(setting),
        Command::Status => Answer::Status,
        Command::GetAll => Answer::GetAll(0),
        Command::Get(setting) => Answer::Get(setting),
        Command::Version => Answer::Version,
        Command::Set(setting, value) => match controller.set(setting, value) {
            Ok(()) => Answer::Ok,
            Err(refusal) => Answer::Refused(refusal, Some(setting)),
        },
        Command::Start { now } => match controller.start(now) {
            Ok(()) => Answer::Ok,
            Err(refusal) => Answer::Refused(refusal, None),
        },
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

impl Answer {
    /// Whether there is nothing left to write.
    pub fn is_done(&self) -> bool {
        *self == Self::Done
    }

    /// Writes the next line, with its end.
    ///
    /// # Errors
    /// What `out` reports.
    pub fn write_line<C, W>(&mut self, controller: &Controller<C>, out: &mut W) -> Result<(), W::Error>
    where
        C: Classifier,
        W: uWrite + ?Sized,
    {
        *self = match *self {
            Self::Done => return Ok(()),
            Self::Greeting => {
                uwrite!(out, "{}{}", text!("weeder "), Version)?;
                uwrite!(out, "{}", text!(" in hold, tool out; help lists the commands"))?;
                Self::Done
            }
            Self::Help(place) => {
                if let Some(word) = Word::from_index(place) {
                    let (usage, explanation) = help(word);
                    uwrite!(out, "{}{}{}", usage, text!(" - "), explanation)?;
                }
                if place + 1 < Word::COUNT {
                    Self::Help(place + 1)
                } else {
                    Self::Ok
                }
            }
            Self::Explain(setting) => {
                uwrite!(out, "{}{}{}", setting.text(), text!(" - "), setting.help())?;
                Self::Ok
            }
            Self::Status => {
                write_status(controller, out)?;
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
                if place + 1 < Setting::COUNT {
                    Self::GetAll(place + 1)
                } else {
                    Self::Ok
                }
            }
            Self::Version => {
                uwrite!(out, "{}{}", text!("weeder "), Version)?;
                Self::Ok
            }
            Self::Ok => {
                uwrite!(out, "{}", text!("ok"))?;
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
        end_line(out)
    }
}

/// Writes the line of an event, with its end.
///
/// # Errors
/// What `out` reports.
pub fn write_event<W: uWrite + ?Sized>(event: &Event, out: &mut W) -> Result<(), W::Error> {
    match *event {
        Event::Object {
            vote,
            leading,
            spacing,
            plan,
        } => {
            match vote.class {
                Class::Plant => uwrite!(out, "{}", text!("plant"))?,
                Class::Weed => uwrite!(out, "{}", text!("weed"))?,
                Class::Unknown => uwrite!(out, "{}", text!("unknown"))?,
            }
            uwrite!(out, "{}{}", text!(" pos="), leading.count())?;
            uwrite!(
                out,
                "{}{}{}{}",
                text!(" votes="),
                vote.votes,
                text!(" spacing="),
                spacing.0
            )?;
            uwrite!(
                out,
                "{}{}{}{}",
                text!(" delay="),
                plan.delay.0,
                text!(" hold="),
                plan.hold.0
            )?;
            uwrite!(out, "{}{}", text!(" actuation="), plan.actuation().0)?;
        }
        Event::Swing { out: leaves, position } => {
            uwrite!(out, "{}", text!("swing tool="))?;
            write_place(leaves, out)?;
            uwrite!(out, "{}{}", text!(" pos="), position.count())?;
        }
        Event::State(state) => {
            uwrite!(out, "{}", text!("state is="))?;
            write_state(state, out)?;
        }
        Event::Alarm { alarm, position } => {
            uwrite!(
                out,
                "{}{}{}{}",
                text!("alarm name="),
                alarm.text(),
                text!(" code="),
                alarm.code()
            )?;
            uwrite!(out, "{}{}", text!(" pos="), position.count())?;
        }
    }
    end_line(out)
}

fn write_state<W: uWrite + ?Sized>(state: State, out: &mut W) -> Result<(), W::Error> {
    match state {
        State::Hold => uwrite!(out, "{}", text!("hold")),
        State::Work => uwrite!(out, "{}", text!("work")),
        State::Alarm(_) => uwrite!(out, "{}", text!("alarm")),
    }
}

fn write_place<W: uWrite + ?Sized>(tool_out: bool, out: &mut W) -> Result<(), W::Error> {
    if tool_out {
        uwrite!(out, "{}", text!("out"))
    } else {
        uwrite!(out, "{}", text!("in"))
    }
}

fn write_status<C, W>(controller: &Controller<C>, out: &mut W) -> Result<(), W::Error>
where
    C: Classifier,
    W: uWrite + ?Sized,
{
    let readings = controller.readings();
    uwrite!(out, "{}", text!("state="))?;
    write_state(controller.state(), out)?;
    if let State::Alarm(alarm) = controller.state() {
        uwrite!(out, "{}{}", text!(" alarm="), alarm.text())?;
    }
    uwrite!(out, "{}", text!(" tool="))?;
    write_place(controller.tool_out(), out)?;
    uwrite!(out, "{}{}", text!(" pos="), readings.position.count())?;
    uwrite!(out, "{}{}", text!(" speed_mm_s="), controller.speed_mm_s())?;
    uwrite!(
        out,
        "{}{}{}{}",
        text!(" windows="),
        controller.windows(),
        text!(" lost="),
        readings.lost
    )?;
    uwrite!(out, "{}{}", text!(" unseen_mm="), controller.unseen_mm())?;
    uwrite!(out, "{}{}", text!(" missed="), controller.events_missed())
}

fn write_setting<C, W>(controller: &Controller<C>, setting: Setting, out: &mut W) -> Result<(), W::Error>
where
    C: Classifier,
    W: uWrite + ?Sized,
{
    let description = setting.description();
    uwrite!(out, "{}={}", setting.text(), controller.settings().get(setting))?;
    write_range(description.least, description.greatest, out)?;
    uwrite!(out, "{}{}", text!(", default "), description.default)
}

fn write_range<W: uWrite + ?Sized>(least: u16, greatest: u16, out: &mut W) -> Result<(), W::Error> {
    uwrite!(out, "{}{}{}{}", text!(" from "), least, text!(" to "), greatest)
}

fn write_mistake<W: uWrite + ?Sized>(mistake: Mistake, out: &mut W) -> Result<(), W::Error> {
    uwrite!(out, "{}", text!("error: "))?;
    match mistake {
        Mistake::TooLong => uwrite!(
            out,
            "{}",
            text!("the line is longer than 80 characters, send a shorter one")
        ),
        Mistake::NotText => uwrite!(
            out,
            "{}",
            text!("the line is not plain text, send letters, digits and blanks only")
        ),
        Mistake::CharactersLost => uwrite!(out, "{}", text!("characters of this line were lost, send it again")),
        Mistake::UnknownCommand => uwrite!(out, "{}", text!("no such command, help lists them all")),
        Mistake::UnknownSetting => uwrite!(out, "{}", text!("no such setting, get lists them all")),
        Mistake::Usage(word) => {
            let (usage, _) = help(word);
            uwrite!(out, "{}{}", text!("the words do not fit, the command is "), usage)
        }
        Mistake::Value(setting) => write_allowed(setting, out),
    }
}

fn write_refusal<W>(refusal: Refusal, setting: Option<Setting>, out: &mut W) -> Result<(), W::Error>
where
    W: uWrite + ?Sized,
{
    uwrite!(out, "{}", text!("error: "))?;
    match (refusal, setting) {
        (Refusal::OutOfRange, Some(setting)) => write_allowed(setting, out),
        (Refusal::NotInHold, Some(setting)) => {
            uwrite!(
                out,
                "{}{}",
                setting.text(),
                text!(" moves the machine's geometry, hold first")
            )
        }
        _ => uwrite!(out, "{}", text!("an alarm is latched, see status, then clear it")),
    }
}

fn write_allowed<W: uWrite + ?Sized>(setting: Setting, out: &mut W) -> Result<(), W::Error> {
    let description = setting.description();
    uwrite!(out, "{}{}", setting.text(), text!(" takes a whole number"))?;
    write_range(description.least, description.greatest, out)
}

fn end_line<W: uWrite + ?Sized>(out: &mut W) -> Result<(), W::Error> {
    uwrite!(out, "{}", text!("\r\n"))
}

/// The package's version.
struct Version;

impl ufmt::uDisplay for Version {
    fn fmt<W: uWrite + ?Sized>(&self, f: &mut ufmt::Formatter<'_, W>) -> Result<(), W::Error> {
        uwrite!(f, "{}", text!(env!("CARGO_PKG_VERSION")))
    }
}

const _: () = assert!(
    Alarm::COUNT < 10,
    "a code of more flashes could not be counted in the field"
);
