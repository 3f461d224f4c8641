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
    text::Text,
};
use avr_progmem::progmem_display as flash;
use ufmt::{uWrite, uwrite};

/// Room that a line needs, its end included.
pub const LINE: usize = 127;

avr_progmem::progmem! {
    /// What each command does, in the order of [`Word`].
    static progmem HELP: [Text<72>; Word::COUNT as usize] = [
        Text::new("help [name]        this list, or what a setting is"),
        Text::new("status             state, position, speed and windows in one line"),
        Text::new("get [name]         one setting, or all"),
        Text::new("set name value     change a setting, until the next reset"),
        Text::new("start [now]        weed; now: at once, over ground the beam has not seen"),
        Text::new("hold               take the tool out of the row"),
        Text::new("clear              clear an alarm"),
        Text::new("events on|off      tell of plants, swings and alarms as they come"),
        Text::new("version            name the firmware"),
    ];
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
                uwrite!(out, "{}{}", flash!("weeder "), Version)?;
                uwrite!(out, "{}", flash!(" in hold, tool out; help lists the commands"))?;
                Self::Done
            }
            Self::Help(place) => {
                uwrite!(out, "{}", HELP.load_at(usize::from(place)))?;
                if place + 1 < Word::COUNT {
                    Self::Help(place + 1)
                } else {
                    Self::Ok
                }
            }
            Self::Explain(setting) => {
                uwrite!(out, "{} {}", setting.text(), setting.description().help)?;
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
                uwrite!(out, "{}{}", flash!("weeder "), Version)?;
                Self::Ok
            }
            Self::Ok => {
                uwrite!(out, "{}", flash!("ok"))?;
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
                Class::Plant => uwrite!(out, "{}", flash!("plant"))?,
                Class::Weed => uwrite!(out, "{}", flash!("weed"))?,
                Class::Unknown => uwrite!(out, "{}", flash!("unknown"))?,
            }
            uwrite!(out, "{}{}", flash!(" pos="), leading.count())?;
            uwrite!(
                out,
                "{}{}{}{}",
                flash!(" votes="),
                vote.votes,
                flash!(" spacing="),
                spacing.0
            )?;
            uwrite!(
                out,
                "{}{}{}{}",
                flash!(" delay="),
                plan.delay.0,
                flash!(" hold="),
                plan.hold.0
            )?;
            uwrite!(out, "{}{}", flash!(" actuation="), plan.actuation().0)?;
        }
        Event::Swing { out: leaves, position } => {
            uwrite!(out, "{}", flash!("swing tool="))?;
            write_place(leaves, out)?;
            uwrite!(out, "{}{}", flash!(" pos="), position.count())?;
        }
        Event::State(state) => {
            uwrite!(out, "{}", flash!("state is="))?;
            write_state(state, out)?;
        }
        Event::Alarm { alarm, position } => {
            uwrite!(
                out,
                "{}{}{}{}",
                flash!("alarm name="),
                alarm.text(),
                flash!(" code="),
                alarm.code()
            )?;
            uwrite!(out, "{}{}", flash!(" pos="), position.count())?;
        }
    }
    end_line(out)
}

fn write_state<W: uWrite + ?Sized>(state: State, out: &mut W) -> Result<(), W::Error> {
    match state {
        State::Hold => uwrite!(out, "{}", flash!("hold")),
        State::Work => uwrite!(out, "{}", flash!("work")),
        State::Alarm(_) => uwrite!(out, "{}", flash!("alarm")),
    }
}

fn write_place<W: uWrite + ?Sized>(tool_out: bool, out: &mut W) -> Result<(), W::Error> {
    if tool_out {
        uwrite!(out, "{}", flash!("out"))
    } else {
        uwrite!(out, "{}", flash!("in"))
    }
}

fn write_status<C, W>(controller: &Controller<C>, out: &mut W) -> Result<(), W::Error>
where
    C: Classifier,
    W: uWrite + ?Sized,
{
    let readings = controller.readings();
    uwrite!(out, "{}", flash!("state="))?;
    write_state(controller.state(), out)?;
    if let State::Alarm(alarm) = controller.state() {
        uwrite!(out, "{}{}", flash!(" alarm="), alarm.text())?;
    }
    uwrite!(out, "{}", flash!(" tool="))?;
    write_place(controller.tool_out(), out)?;
    uwrite!(out, "{}{}", flash!(" pos="), readings.position.count())?;
    uwrite!(out, "{}{}", flash!(" speed_mm_s="), controller.speed_mm_s())?;
    uwrite!(
        out,
        "{}{}{}{}",
        flash!(" windows="),
        controller.windows(),
        flash!(" lost="),
        readings.lost
    )?;
    uwrite!(out, "{}{}", flash!(" unseen_mm="), controller.unseen_mm())?;
    uwrite!(out, "{}{}", flash!(" missed="), controller.events_missed())
}

fn write_setting<C, W>(controller: &Controller<C>, setting: Setting, out: &mut W) -> Result<(), W::Error>
where
    C: Classifier,
    W: uWrite + ?Sized,
{
    let description = setting.description();
    uwrite!(out, "{}={}", setting.text(), controller.settings().get(setting))?;
    write_range(description.least, description.greatest, out)?;
    uwrite!(out, "{}{}", flash!(", default "), description.default)
}

fn write_range<W: uWrite + ?Sized>(least: u16, greatest: u16, out: &mut W) -> Result<(), W::Error> {
    uwrite!(out, "{}{}{}{}", flash!(" from "), least, flash!(" to "), greatest)
}

fn write_mistake<W: uWrite + ?Sized>(mistake: Mistake, out: &mut W) -> Result<(), W::Error> {
    uwrite!(out, "{}", flash!("error: "))?;
    match mistake {
        Mistake::TooLong => uwrite!(
            out,
            "{}",
            flash!("the line is longer than 80 characters, send a shorter one")
        ),
        Mistake::NotText => uwrite!(
            out,
            "{}",
            flash!("the line is not plain text, send letters, digits and blanks only")
        ),
        Mistake::CharactersLost => uwrite!(out, "{}", flash!("characters of this line were lost, send it again")),
        Mistake::UnknownCommand => uwrite!(out, "{}", flash!("no such command, help lists them all")),
        Mistake::UnknownSetting => uwrite!(out, "{}", flash!("no such setting, get lists them all")),
        Mistake::Usage(word) => {
            uwrite!(out, "{}", flash!("the words do not fit, the command is "))?;
            write_usage(word, out)
        }
        Mistake::Value(setting) => write_allowed(setting, out),
    }
}

fn write_refusal<W>(refusal: Refusal, setting: Option<Setting>, out: &mut W) -> Result<(), W::Error>
where
    W: uWrite + ?Sized,
{
    uwrite!(out, "{}", flash!("error: "))?;
    match (refusal, setting) {
        (Refusal::OutOfRange, Some(setting)) => write_allowed(setting, out),
        (Refusal::NotInHold, Some(setting)) => {
            uwrite!(
                out,
                "{}{}",
                setting.text(),
                flash!(" moves the machine's geometry, hold first")
            )
        }
        _ => uwrite!(out, "{}", flash!("an alarm is latched, see status, then clear it")),
    }
}

fn write_allowed<W: uWrite + ?Sized>(setting: Setting, out: &mut W) -> Result<(), W::Error> {
    let description = setting.description();
    uwrite!(out, "{}{}", setting.text(), flash!(" takes a whole number"))?;
    write_range(description.least, description.greatest, out)
}

/// A command with its words: the help line up to the two blanks before its explanation.
fn write_usage<W: uWrite + ?Sized>(word: Word, out: &mut W) -> Result<(), W::Error> {
    let help = HELP.load_at(word as usize);
    let mut blank = false;
    for byte in help.bytes() {
        if blank && byte == b' ' {
            break;
        }
        if blank {
            out.write_char(' ')?;
        }
        blank = byte == b' ';
        if !blank {
            out.write_char(char::from(byte))?;
        }
    }
    Ok(())
}

fn end_line<W: uWrite + ?Sized>(out: &mut W) -> Result<(), W::Error> {
    uwrite!(out, "{}", flash!("\r\n"))
}

/// The package's version.
struct Version;

impl ufmt::uDisplay for Version {
    fn fmt<W: uWrite + ?Sized>(&self, f: &mut ufmt::Formatter<'_, W>) -> Result<(), W::Error> {
        uwrite!(f, "{}", flash!(env!("CARGO_PKG_VERSION")))
    }
}

const _: () = assert!(
    Alarm::COUNT < 10,
    "a code of more flashes could not be counted in the field"
);
