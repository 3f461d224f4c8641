//! What the console answers, a line at a time, and the wording of everything the machine says.
//!
//! An answer can be longer than the serial line's buffer, and nothing here may wait for it to drain. So an [`Answer`] is
//! a place in a text that writes its next line whenever the firmware has room for one. Every line, the longest numbers
//! included, fits in [`LINE`] bytes.

use crate::{
    alarm::Warning,
    calibration::{Leads, Outcome, Unfit},
    classifier::{self, Class, Classifier, label},
    console::{Argument, Command, Mistake, Plot, Word},
    controller::{Controller, Judged, Refusal, State},
    event::Event,
    memory::Memory,
    settings::{Contradiction, Setting},
    text::{self, List, Listed, Text, list, text},
};
use ufmt::{uWrite, uwrite};

/// Room that a line needs, its end included.
pub const LINE: usize = 127;

/// The one table of what is said about the commands.
macro_rules! commands {
    ($($Word:ident $usage:literal, $help:literal;)*) => {
        impl Word {
            /// The command with the words that it takes.
            fn usage(self) -> Listed {
                Listed(list!($($usage),*), self as u8)
            }

            /// What it does.
            fn help(self) -> Listed {
                Listed(list!($($help),*), self as u8)
            }
        }

        const _: () = {
            let mut place = 0;
            $(
                assert!(Word::$Word as u8 == place, "the commands stand here in the order of their words");
                place += 1;
            )*
            assert!(place == Word::COUNT);
        };
    };
}

commands! {
    Help "help [name]",
        "this list, or what a setting is";
    Status "status",
        "state, position, speed and windows, and what was counted";
    Get "get [name]",
        "one setting, or all";
    Set "set name value",
        "change a setting; save keeps it";
    Save "save",
        "keep the settings for good";
    Revert "revert",
        "take the saved settings back";
    Defaults "defaults",
        "take a new machine's settings back";
    Calibrate "calibrate start|servo|MM [force]",
        "start, roll a measured distance, give it; or time the servo";
    Servo "servo in|out|US",
        "move the tool by hand";
    Test "test row [MM_S]",
        "swing as for a row of plants, without a sensor";
    Start "start [now]",
        "weed; now, at once over ground the beam has not seen";
    Hold "hold",
        "take the tool out of the row";
    Clear "clear",
        "clear an alarm";
    Events "events on|off",
        "tell of plants, swings and alarms as they come";
    Plot "plot on|off|teleplot",
        "curves for the Arduino Serial Plotter, or Teleplot";
    Label "label plant|weed",
        "say what the last object was, and teach it";
    Examples "examples",
        "all examples, with source and class";
    Forget "forget N|all",
        "forget examples from the field";
    Dump "dump",
        "the last 16 objects as CSV";
    Version "version",
        "name the firmware";
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
        Command::CalibrateStart => {
            controller.calibrate_start();
            Answer::Ok
        }
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
                say(out, text!(", reset by "))?;
                say_listed(out, controller.cause().text())?;
                say(out, text!(", state "))?;
                write_state(controller.state(), out)?;
                say(out, text!(", tool out; help lists the commands"))?;
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
                Self::Ok
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
                    say_number(out, text!("spoiled="), controller.classifier().spoiled().into())?;
                    Self::Ok
                }
            },
            Self::DumpHeading => {
                say(out, text!("speed_mm_s,spacing_mm,delay_mm,hold_mm,actuation_mm,answer,votes,label"))?;
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
                say(out, text!("ok"))?;
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
        say(out, text!("\r\n"))
    }
}

/// Writes the line of an event, with its end.
///
/// # Errors
/// What `out` reports.
pub fn write_event<W: uWrite + ?Sized>(event: &Event, out: &mut W) -> Result<(), W::Error> {
    match *event {
        Event::Object { vote, leading, spacing, plan } => {
            say(out, class_name(vote.class))?;
            let numbers =
                [leading.count(), vote.votes.into(), spacing.0, plan.delay.0, plan.hold.0, plan.actuation().0];
            say_numbers(out, text!(" pos=# votes=# spacing=# delay=# hold=# actuation=#"), &numbers)?;
        }
        Event::Swing { out: leaves, position } => {
            say(out, text!("swing tool="))?;
            say(out, place_name(leaves))?;
            say_number(out, text!(" pos="), position.count())?;
        }
        Event::State(state) => {
            say(out, text!("state is="))?;
            say(out, state_name(state))?;
        }
        Event::Warning(warning) => {
            say(out, text!("warning name="))?;
            say_listed(out, warning.text())?;
        }
        Event::Calibrated { outcome: Outcome::Measured(Leads { out_ms, in_ms }), fits } => {
            say_numbers(out, text!("calibrated lead_out_ms=# lead_in_ms=#"), &[out_ms.into(), in_ms.into()])?;
            say(out, if fits { text!(" set=yes") } else { text!(" set=no") })?;
        }
        Event::Calibrated { outcome: Outcome::Shown, .. } => {
            say(out, text!("calibrated by=eye, set lead_out_ms and lead_in_ms to what you saw"))?;
        }
        Event::Calibrated { outcome: Outcome::Failed, .. } => {
            say(out, text!("calibrated by=nobody, the end switch did not follow"))?;
        }
        Event::Alarm { alarm, position } => {
            say(out, text!("alarm name="))?;
            say_listed(out, alarm.text())?;
            say_number(out, text!(" code="), alarm.code().into())?;
            say_number(out, text!(" pos="), position.count())?;
        }
    }
    say(out, text!("\r\n"))
}

/// Writes the next points of a plotter's curves, each `label:value`, with the line's end.
///
/// # Errors
/// What `out` reports.
pub fn write_plot<C, M, W>(controller: &Controller<C, M>, plot: Plot, out: &mut W) -> Result<(), W::Error>
where
    C: Classifier,
    M: Memory,
    W: uWrite + ?Sized,
{
    let curves = list!("speed_mm_s", "tool_deg", "beam_broken", "windows");
    let points = [
        controller.speed_mm_s(),
        if controller.tool_out() { 45 } else { 0 },
        i16::from(controller.beam_is_broken()),
        i16::from(controller.windows()),
    ];
    for (place, point) in (0..).zip(points) {
        match (plot, place) {
            (Plot::Teleplot, 0) => say(out, text!(">"))?,
            (Plot::Teleplot, _) => say(out, text!("\r\n>"))?,
            (_, 0) => {}
            _ => say(out, text!(","))?,
        }
        say_listed(out, Listed(curves, place))?;
        say_number(out, text!(":"), point.into())?;
    }
    say(out, text!("\r\n"))
}

fn write_status<C, M, W>(controller: &Controller<C, M>, out: &mut W) -> Result<(), W::Error>
where
    C: Classifier,
    M: Memory,
    W: uWrite + ?Sized,
{
    let readings = controller.readings();
    say(out, text!("state="))?;
    say(out, state_name(controller.state()))?;
    if let State::Alarm(alarm) = controller.state() {
        say(out, text!(" alarm="))?;
        say_listed(out, alarm.text())?;
    }
    say(out, text!(" tool="))?;
    say(out, place_name(controller.tool_out()))?;
    if let Some(reason) = controller.reason() {
        say(out, text!(" for="))?;
        say_listed(out, reason.text())?;
    }
    let numbers = [
        readings.position.count(),
        controller.speed_mm_s().into(),
        controller.windows().into(),
        controller.unseen_mm().into(),
    ];
    say_numbers(out, text!(" pos=# speed_mm_s=# windows=# unseen_mm=#"), &numbers)
}

fn write_counts<C, M, W>(controller: &Controller<C, M>, out: &mut W) -> Result<(), W::Error>
where
    C: Classifier,
    M: Memory,
    W: uWrite + ?Sized,
{
    let readings = controller.readings();
    let numbers = [
        readings.lost,
        readings.jumps,
        controller.late(),
        controller.events_missed(),
        controller.mistakes(),
        readings.stack_free,
    ];
    let template = text!("lost=# jumps=# late=# missed=# mistakes=# stack_free=# reset=");
    say_numbers(out, template, &numbers.map(i32::from))?;
    say_listed(out, controller.cause().text())?;
    if controller.sees_no_plants() {
        say(out, text!(" warning="))?;
        say_listed(out, Warning::NoPlants.text())?;
    }
    Ok(())
}

#[inline(never)]
fn write_setting<C, M, W>(controller: &Controller<C, M>, setting: Setting, out: &mut W) -> Result<(), W::Error>
where
    C: Classifier,
    M: Memory,
    W: uWrite + ?Sized,
{
    say_listed(out, setting.text())?;
    write_value(text!("="), setting, controller.settings().get(setting), out)?;
    write_range(setting, out)?;
    write_value(text!(", default "), setting, setting.description().default, out)?;
    match controller.saved(setting) {
        None => say(out, text!(", not saved")),
        Some(saved) if saved == controller.settings().get(setting) => Ok(()),
        Some(saved) => write_value(text!(", saved "), setting, saved, out),
    }
}

/// A text and a setting's value after it.
fn write_value<W: uWrite + ?Sized>(text: Text, setting: Setting, value: u16, out: &mut W) -> Result<(), W::Error> {
    if !setting.is_switched() {
        return say_number(out, text, value.into());
    }
    say(out, text)?;
    say_listed(out, if value == 0 { Argument::Off } else { Argument::On }.text())
}

fn write_range<W: uWrite + ?Sized>(setting: Setting, out: &mut W) -> Result<(), W::Error> {
    if setting.is_switched() {
        return say(out, text!(" on or off"));
    }
    let description = setting.description();
    say_number(out, text!(" from "), description.least.into())?;
    say_number(out, text!(" to "), description.greatest.into())
}

fn write_example<W: uWrite + ?Sized>(listed: &classifier::Listed, out: &mut W) -> Result<(), W::Error> {
    say(out, if listed.from_field { text!("field") } else { text!("built_in") })?;
    say_number(out, text!(" "), listed.number.into())?;
    say(out, text!(" "))?;
    say(out, label_name(listed.example.label))?;
    listed.example.features.iter().try_for_each(|&feature| say_number(out, text!(" "), feature.into()))
}

fn write_object<W: uWrite + ?Sized>(object: &Judged, out: &mut W) -> Result<(), W::Error> {
    for value in object.features().values() {
        uwrite!(out, "{}", value)?;
        say(out, text!(","))?;
    }
    say(out, class_name(object.vote.class))?;
    say_number(out, text!(","), object.vote.votes.into())?;
    say(out, text!(","))?;
    object.label.map_or(Ok(()), |label| say(out, label_name(label)))
}

fn write_mistake<W: uWrite + ?Sized>(mistake: Mistake, out: &mut W) -> Result<(), W::Error> {
    say(out, text!("error: "))?;
    let what = match mistake {
        Mistake::TooLong => text!("the line is longer than 80 characters, send a shorter one"),
        Mistake::NotText => text!("the line is not plain text, send letters, digits and blanks only"),
        Mistake::CharactersLost => text!("characters of this line were lost, send it again"),
        Mistake::UnknownCommand => text!("no such command, help lists them all"),
        Mistake::UnknownSetting => text!("no such setting, get lists them all"),
        Mistake::Usage(word) => {
            say(out, text!("the words do not fit, the command is "))?;
            return say_listed(out, word.usage());
        }
        Mistake::Value(setting) => return write_allowed(setting, out),
    };
    say(out, what)
}

fn write_refusal<W>(refusal: Refusal, setting: Option<Setting>, out: &mut W) -> Result<(), W::Error>
where
    W: uWrite + ?Sized,
{
    say(out, text!("error: "))?;
    match (refusal, setting) {
        (Refusal::OutOfRange, Some(setting)) => write_allowed(setting, out),
        (Refusal::NotInHold, Some(setting)) if setting.description().hold_only => {
            say_listed(out, setting.text())?;
            say(out, text!(" changes where the tool is, hold first"))
        }
        (Refusal::NotInHold, _) => say(out, text!("the machine is at work, hold first")),
        (Refusal::Contradiction(Contradiction::PulsesEqual), _) => {
            say(out, text!("servo_in_us and servo_out_us would be equal, and the tool would not move"))
        }
        (Refusal::Contradiction(Contradiction::BeamTooNear { needed_mm }), _) => {
            say_number(out, text!("margin, leads and top speed would need beam_to_tool_mm "), needed_mm.into())?;
            say(out, text!(" or more, change one of them first"))
        }
        (Refusal::NothingToLabel, _) => {
            say(out, text!("there is no object without a label, let the beam see one first"))
        }
        (Refusal::NothingSaved, _) => say(out, text!("no settings are saved, save does it")),
        (Refusal::Unfit(Unfit::NotBegun), _) => say(out, text!("calibrate start first, then roll")),
        (Refusal::Unfit(Unfit::TooShort), _) => say(out, text!("roll 1000 mm at least, 10000 are better")),
        (Refusal::Unfit(Unfit::Differs { counted, nominal }), _) => {
            say_number(out, text!("that would be ticks_per_m "), counted.into())?;
            say_number(out, text!(", the wheel has "), nominal.into())?;
            say(out, text!(", look again, or add force"))
        }
        (Refusal::TestSpeed { fastest }, _) => {
            say_number(out, text!("test row takes a speed in mm/s from 100 to "), fastest.into())
        }
        (Refusal::ExamplesFull, _) => say(out, text!("all 32 places are taken, forget one first")),
        (Refusal::NoSuchExample, _) => say(out, text!("no field example has this number, examples lists them")),
        _ => say(out, text!("an alarm is latched, see status, then clear it")),
    }
}

fn write_allowed<W: uWrite + ?Sized>(setting: Setting, out: &mut W) -> Result<(), W::Error> {
    say_listed(out, setting.text())?;
    say(out, if setting.is_switched() { text!(" takes") } else { text!(" takes a whole number") })?;
    write_range(setting, out)
}

fn write_version<W: uWrite + ?Sized>(out: &mut W) -> Result<(), W::Error> {
    say(out, text!("weeder "))?;
    say(out, text!(env!("CARGO_PKG_VERSION")))
}

/// A name and what it stands for.
fn explain<W: uWrite + ?Sized>(out: &mut W, name: Listed, explanation: Listed) -> Result<(), W::Error> {
    say_listed(out, name)?;
    say(out, text!(" - "))?;
    say_listed(out, explanation)
}

/// A text and a number after it: in one place, and in one width, which costs the least flash.
#[inline(never)]
fn say_number<W: uWrite + ?Sized>(out: &mut W, text: Text, number: i32) -> Result<(), W::Error> {
    say(out, text)?;
    uwrite!(out, "{}", number)
}

/// A text.
#[inline(never)]
fn say<W: uWrite + ?Sized>(out: &mut W, text: Text) -> Result<(), W::Error> {
    say_numbers(out, text, &[])
}

/// A text in which each `#` stands for the next of the numbers.
#[inline(never)]
fn say_numbers<W: uWrite + ?Sized>(out: &mut W, text: Text, numbers: &[i32]) -> Result<(), W::Error> {
    let mut numbers = numbers.iter();
    for byte in text.packed_bytes() {
        match numbers.as_slice() {
            [number, ..] if byte == b'#' => {
                numbers.next();
                uwrite!(out, "{}", *number)?;
            }
            _ => say_byte(out, byte)?,
        }
    }
    Ok(())
}

/// A text of a list.
#[inline(always)]
fn say_listed<W: uWrite + ?Sized>(out: &mut W, Listed(list, place): Listed) -> Result<(), W::Error> {
    say_at(out, list, place)
}

/// The text at a place in a list, both of which find room in registers.
#[inline(never)]
fn say_at<W: uWrite + ?Sized>(out: &mut W, list: List, place: u8) -> Result<(), W::Error> {
    list.packed_bytes(place).try_for_each(|byte| say_byte(out, byte))
}

/// What a packed byte stands for.
#[inline(never)]
fn say_byte<W: uWrite + ?Sized>(out: &mut W, byte: u8) -> Result<(), W::Error> {
    match text::fragment(byte) {
        None => out.write_char(char::from(byte)),
        Some(Listed(list, place)) => say_at(out, list, place),
    }
}

/// The state, and which alarm.
fn write_state<W: uWrite + ?Sized>(state: State, out: &mut W) -> Result<(), W::Error> {
    say(out, state_name(state))?;
    if let State::Alarm(alarm) = state {
        say(out, text!(" "))?;
        say_listed(out, alarm.text())?;
    }
    Ok(())
}

fn state_name(state: State) -> Text {
    match state {
        State::Hold => text!("hold"),
        State::Work => text!("work"),
        State::Alarm(_) => text!("alarm"),
    }
}

fn place_name(tool_out: bool) -> Text {
    if tool_out { text!("out") } else { text!("in") }
}

fn label_name(label: u8) -> Text {
    if label == label::PLANT { text!("plant") } else { text!("weed") }
}

fn class_name(class: Class) -> Text {
    match class {
        Class::Plant => text!("plant"),
        Class::Weed => text!("weed"),
        Class::Unknown => text!("unknown"),
    }
}
