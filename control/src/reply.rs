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
    said,
    settings::{Contradiction, Setting},
    text::Text,
};
use ufmt::{uWrite, uwrite};

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

/// Writes the line of an event, with its end.
///
/// # Errors
/// What `out` reports.
#[inline(never)]
pub fn write_event<W: uWrite + ?Sized>(event: &Event, out: &mut W) -> Result<(), W::Error> {
    match *event {
        Event::Object { vote, leading, spacing, plan } => {
            say(out, class_name(vote.class))?;
            let numbers =
                [leading.count(), vote.votes.into(), spacing.0, plan.delay.0, plan.hold.0, plan.actuation().0];
            say_numbers(out, said::OBJECT, &numbers)?;
        }
        Event::Swing { out: leaves, position } => {
            say(out, said::SWING)?;
            say(out, place_name(leaves))?;
            say_number(out, said::POS, position.count())?;
        }
        Event::State(state) => {
            say(out, said::STATE_EVENT)?;
            say(out, state_name(state))?;
        }
        Event::Warning(warning) => {
            say(out, said::WARNING)?;
            say(out, warning.text())?;
        }
        Event::Calibrated { outcome: Outcome::Measured(Leads { out_ms, in_ms }), fits } => {
            say_numbers(out, said::CALIBRATED, &[out_ms.into(), in_ms.into()])?;
            say(out, if fits { said::SET } else { said::NOT_SET })?;
        }
        Event::Calibrated { outcome: Outcome::Shown, .. } => {
            say(out, said::CALIBRATED_BY_EYE)?;
        }
        Event::Calibrated { outcome: Outcome::Failed, .. } => {
            say(out, said::NOT_CALIBRATED)?;
        }
        Event::Alarm { alarm, position } => {
            say(out, said::ALARM)?;
            say(out, alarm.text())?;
            say_number(out, said::CODE, alarm.code().into())?;
            say_number(out, said::POS, position.count())?;
        }
    }
    say(out, said::END)
}

/// Writes the next points of a plotter's curves, each `label:value`, with the line's end.
///
/// # Errors
/// What `out` reports.
#[inline(never)]
pub fn write_plot<C, M, W>(controller: &Controller<C, M>, plot: Plot, out: &mut W) -> Result<(), W::Error>
where
    C: Classifier,
    M: Memory,
    W: uWrite + ?Sized,
{
    let points = [
        controller.speed_mm_s(),
        if controller.tool_out() { 45 } else { 0 },
        i16::from(controller.beam_is_broken()),
        i16::from(controller.windows()),
    ];
    let curves = if plot == Plot::Teleplot { said::TELEPLOT } else { said::SERIAL_PLOTTER };
    say_numbers(out, curves, &points.map(i32::from))?;
    say(out, said::END)
}

fn write_status<C, M, W>(controller: &Controller<C, M>, out: &mut W) -> Result<(), W::Error>
where
    C: Classifier,
    M: Memory,
    W: uWrite + ?Sized,
{
    let readings = controller.readings();
    say(out, said::STATE_IS)?;
    say(out, state_name(controller.state()))?;
    if let State::Alarm(alarm) = controller.state() {
        say(out, said::ALARM_IS)?;
        say(out, alarm.text())?;
    }
    say(out, said::TOOL_IS)?;
    say(out, place_name(controller.tool_out()))?;
    if let Some(reason) = controller.reason() {
        say(out, said::FOR)?;
        say(out, reason.text())?;
    }
    let numbers = [
        readings.position.count(),
        controller.speed_mm_s().into(),
        controller.windows().into(),
        controller.unseen_mm().into(),
    ];
    say_numbers(out, said::PLACE, &numbers)
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
    let template = said::COUNTS;
    say_numbers(out, template, &numbers.map(i32::from))?;
    say(out, controller.cause().text())?;
    if controller.sees_no_plants() {
        say(out, said::WARNING_IS)?;
        say(out, Warning::NoPlants.text())?;
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
    say(out, setting.text())?;
    write_value(said::IS, setting, controller.settings().get(setting), out)?;
    say(out, setting.unit())?;
    write_range(setting, out)?;
    write_value(said::DEFAULT, setting, setting.description().default, out)?;
    match controller.saved(setting) {
        None => say(out, said::NOT_SAVED),
        Some(saved) if saved == controller.settings().get(setting) => Ok(()),
        Some(saved) => write_value(said::SAVED, setting, saved, out),
    }
}

/// A text and a setting's value after it.
fn write_value<W: uWrite + ?Sized>(text: Text, setting: Setting, value: u16, out: &mut W) -> Result<(), W::Error> {
    if !setting.is_switched() {
        return say_number(out, text, value.into());
    }
    say(out, text)?;
    say(out, if value == 0 { Argument::Off } else { Argument::On }.text())
}

fn write_range<W: uWrite + ?Sized>(setting: Setting, out: &mut W) -> Result<(), W::Error> {
    if setting.is_switched() {
        return say(out, said::ON_OR_OFF);
    }
    let description = setting.description();
    say_number(out, said::FROM, description.least.into())?;
    say_number(out, said::TO, description.greatest.into())
}

fn write_example<W: uWrite + ?Sized>(listed: &classifier::Listed, out: &mut W) -> Result<(), W::Error> {
    say(out, if listed.from_field { said::FIELD } else { said::BUILT_IN })?;
    say_number(out, said::BLANK, listed.number.into())?;
    say(out, said::BLANK)?;
    say(out, label_name(listed.example.label))?;
    listed.example.features.iter().try_for_each(|&feature| say_number(out, said::BLANK, feature.into()))
}

fn write_object<W: uWrite + ?Sized>(object: &Judged, out: &mut W) -> Result<(), W::Error> {
    for value in object.features().values() {
        uwrite!(out, "{}", value)?;
        say(out, said::COMMA)?;
    }
    say(out, class_name(object.vote.class))?;
    say_number(out, said::COMMA, object.vote.votes.into())?;
    say(out, said::COMMA)?;
    object.label.map_or(Ok(()), |label| say(out, label_name(label)))
}

fn write_mistake<W: uWrite + ?Sized>(mistake: Mistake, out: &mut W) -> Result<(), W::Error> {
    say(out, said::ERROR)?;
    let what = match mistake {
        Mistake::TooLong => said::TOO_LONG,
        Mistake::NotText => said::NOT_TEXT,
        Mistake::CharactersLost => said::CHARACTERS_LOST,
        Mistake::UnknownCommand => said::UNKNOWN_COMMAND,
        Mistake::UnknownSetting => said::UNKNOWN_SETTING,
        Mistake::Usage(word) => {
            say(out, said::USAGE)?;
            return say(out, word.usage());
        }
        Mistake::Value(setting) => return write_allowed(setting, out),
    };
    say(out, what)
}

fn write_refusal<W>(refusal: Refusal, setting: Option<Setting>, out: &mut W) -> Result<(), W::Error>
where
    W: uWrite + ?Sized,
{
    say(out, said::ERROR)?;
    match (refusal, setting) {
        (Refusal::OutOfRange, Some(setting)) => write_allowed(setting, out),
        (Refusal::NotInHold, Some(setting)) if setting.description().hold_only => {
            say(out, setting.text())?;
            say(out, said::HOLD_TO_SET)
        }
        (Refusal::NotInHold, _) => say(out, said::HOLD_FIRST),
        (Refusal::Contradiction(Contradiction::PulsesEqual), _) => say(out, said::PULSES_EQUAL),
        (Refusal::Contradiction(Contradiction::BeamTooNear { needed_mm }), _) => {
            say_number(out, said::BEAM_TOO_NEAR, needed_mm.into())?;
            say(out, said::BEAM_FARTHER)
        }
        (Refusal::NothingToLabel, _) => say(out, said::NOTHING_TO_LABEL),
        (Refusal::NothingSaved, _) => say(out, said::NOTHING_SAVED),
        (Refusal::Unfit(Unfit::NotBegun), _) => say(out, said::NOT_BEGUN),
        (Refusal::Unfit(Unfit::TooShort), _) => say(out, said::TOO_SHORT),
        (Refusal::Unfit(Unfit::Differs { counted, nominal }), _) => {
            say_number(out, said::WHEEL_DIFFERS, counted.into())?;
            say_number(out, said::WHEEL_HAS, nominal.into())?;
            say(out, said::LOOK_AGAIN)
        }
        (Refusal::TestSpeed { fastest }, _) => say_number(out, said::TEST_SPEED, fastest.into()),
        (Refusal::ExamplesFull, _) => say(out, said::EXAMPLES_FULL),
        (Refusal::NoSuchExample, _) => say(out, said::NO_SUCH_EXAMPLE),
        _ => say(out, said::ALARM_LATCHED),
    }
}

fn write_allowed<W: uWrite + ?Sized>(setting: Setting, out: &mut W) -> Result<(), W::Error> {
    say(out, setting.text())?;
    say(out, if setting.is_switched() { said::TAKES } else { said::TAKES_A_NUMBER })?;
    write_range(setting, out)
}

fn write_version<W: uWrite + ?Sized>(out: &mut W) -> Result<(), W::Error> {
    say(out, said::WEEDER)
}

/// A name and what it stands for.
fn explain<W: uWrite + ?Sized>(out: &mut W, name: Text, explanation: Text) -> Result<(), W::Error> {
    say(out, name)?;
    say(out, said::DASH)?;
    say(out, explanation)
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
    for character in text.bytes() {
        match numbers.as_slice() {
            [number, ..] if character == b'#' => {
                numbers.next();
                uwrite!(out, "{}", *number)?;
            }
            _ => out.write_char(char::from(character))?,
        }
    }
    Ok(())
}

/// The state, and which alarm.
fn write_state<W: uWrite + ?Sized>(state: State, out: &mut W) -> Result<(), W::Error> {
    say(out, state_name(state))?;
    if let State::Alarm(alarm) = state {
        say(out, said::BLANK)?;
        say(out, alarm.text())?;
    }
    Ok(())
}

fn state_name(state: State) -> Text {
    match state {
        State::Hold => Word::Hold.text(),
        State::Work => said::WORK,
        State::Alarm(_) => said::IN_ALARM,
    }
}

fn place_name(tool_out: bool) -> Text {
    if tool_out { Argument::Out.text() } else { Argument::In.text() }
}

fn label_name(label: u8) -> Text {
    if label == label::PLANT { Argument::Plant.text() } else { Argument::Weed.text() }
}

fn class_name(class: Class) -> Text {
    match class {
        Class::Plant => Argument::Plant.text(),
        Class::Weed => Argument::Weed.text(),
        Class::Unknown => said::UNKNOWN,
    }
}
