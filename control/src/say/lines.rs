//! Builds lines: events, status, curves, settings, examples and detections.

use super::names;
use crate::{
    alarm::{Alarm, Warning},
    ground::class::{Classifier, Listed},
    line_tables,
    memory::Memory,
    operate::{
        calibration::{Outcome, SwingTimes},
        command_error::CommandError,
        detections::Classified,
        event::Event,
        plot::Plot,
        state::State,
    },
    say::{
        line::Line,
        texts::{self, Text},
        words::Argument,
    },
    settings::Setting,
    weeder::Controller,
};

/// Makes the texts of the tables' lines, and the functions that write the lines.
macro_rules! write_lines {
    (
        events {$(
            $Event:ident $meaning:literal, $pattern:pat => $beginning:literal {
                $($part:literal $kind:ident($value:expr) $(=> $field:ident: $Type:ty)?, $about:literal;)*
            } $($tail:literal)?
        )*}
        status $machine:ident {$(
            $Line:ident $says:literal $($(if $condition:pat = $from:expr =>)? {
                $($word:literal $of:ident($state:expr) $(=> $to:ident: $Of:ty)?, $tells:literal;)*
            })*;
        )*}
    ) => {
        /// The lines of the tables. A line of the status has a text for each group.
        pub(super) const LINES: &[&str] =
            &[$(concat!($beginning, $($part,)* $($tail)?),)* $($(concat!($($word),*),)*)*];

        /// Builds the line of an event.
        #[inline(never)]
        pub fn write_event(event: &Event, line: &mut Line) {
            match *event {
                $($pattern => {
                    line.say(const { Text::of(concat!($beginning, $($part,)* $($tail)?)) });
                    $(kind::$kind($value, line);)*
                })*
            }
            line.say(texts::END);
        }

        $(
            #[doc = $says]
            pub(super) struct $Line;

            impl $Line {
                /// Builds the line.
                pub(super) fn write<C: Classifier, M: Memory>($machine: &Controller<C, M>, line: &mut Line) {
                    $($(if let $condition = $from)? {
                        line.say(const { Text::of(concat!($($word),*)) });
                        $(kind::$of($state, line);)*
                    })*
                }
            }
        )*
    };
}

line_tables!(write_lines);

/// How each kind of value of the tables is written.
mod kind {
    use super::{Alarm, Line, Warning, names, texts};
    use crate::{
        ground::class::Class,
        measure::reset::Cause,
        operate::{state::State, tool::Reason},
    };

    pub(super) fn number(value: impl Into<i32>, line: &mut Line) {
        line.number(value.into());
    }

    pub(super) fn count(value: impl Into<u16>, line: &mut Line) {
        line.counted(value.into());
    }

    pub(super) fn optional(value: Option<i16>, line: &mut Line) {
        line.say(if value.is_some() { texts::NUMBER } else { texts::NONE });
        line.number(value.unwrap_or(0).into());
    }

    #[inline(never)]
    pub(super) fn led(alarm: Alarm, line: &mut Line) {
        let (first, second) = alarm.code();
        line.counted(first.into());
        line.counted(second.into());
    }

    pub(super) fn class(class: Class, line: &mut Line) {
        line.say(names::class(class));
    }

    pub(super) fn place(tool_out: bool, line: &mut Line) {
        line.say(names::place(tool_out));
    }

    pub(super) fn state(state: State, line: &mut Line) {
        line.say(names::state(state));
    }

    pub(super) fn alarm(alarm: Alarm, line: &mut Line) {
        line.say(alarm.text());
    }

    pub(super) fn warning(warning: Warning, line: &mut Line) {
        line.say(warning.text());
    }

    pub(super) fn reason(reason: Reason, line: &mut Line) {
        line.say(reason.text());
    }

    pub(super) fn cause(cause: Cause, line: &mut Line) {
        line.say(cause.text());
    }

    pub(super) fn answer(yes: bool, line: &mut Line) {
        line.say(names::answer(yes));
    }
}

/// Adds an alarm's code and name.
pub(super) fn write_alarm(alarm: Alarm, line: &mut Line) {
    line.say(texts::IN_WORDS);
    kind::led(alarm, line);
    kind::alarm(alarm, line);
}

/// Builds the next points of a plotter's curves, each `label:value`.
#[inline(never)]
pub fn write_plot<C: Classifier, M: Memory>(controller: &Controller<C, M>, plot: Plot, line: &mut Line) {
    line.say(if plot == Plot::Teleplot { texts::TELEPLOT } else { texts::SERIAL_PLOTTER });
    line.number(controller.speed_mm_s().into());
    line.number(if controller.tool_out() { 45 } else { 0 });
    line.counted(controller.beam_is_broken().into());
    line.counted(controller.zones().into());
    line.say(texts::END);
}

#[inline(never)]
pub(super) fn write_setting<C: Classifier, M: Memory>(
    controller: &Controller<C, M>,
    setting: Setting,
    line: &mut Line,
) {
    let value = controller.settings().get(setting);
    line.say(texts::IS);
    line.say(setting.text());
    write_value(setting, value, line);
    line.say(setting.unit());
    if setting.is_switched() {
        line.say(texts::ON_OR_OFF);
    } else {
        line.say(texts::RANGE);
        write_range(setting, line);
    }
    line.say(texts::DEFAULT);
    write_value(setting, setting.default(), line);
    match controller.saved(setting) {
        None => line.say(texts::NOT_SAVED),
        Some(saved) if saved == value => {}
        Some(saved) => {
            line.say(texts::SAVED);
            write_value(setting, saved, line);
        }
    }
}

/// A setting's value, in a word.
#[inline(never)]
fn write_value(setting: Setting, value: u16, line: &mut Line) {
    if setting.is_switched() {
        return line.say(if value == 0 { Argument::Off } else { Argument::On }.text());
    }
    line.say(texts::NUMBER);
    line.counted(value);
}

#[inline(never)]
fn write_range(setting: Setting, line: &mut Line) {
    line.counted(setting.least());
    line.counted(setting.greatest());
}

/// What a setting takes, under the setting's name or another.
#[inline(never)]
pub(super) fn write_allowed(name: Text, setting: Setting, line: &mut Line) {
    line.say(CommandError::OutOfRange.text());
    line.say(name);
    line.say(if setting.is_switched() { texts::ON_OR_OFF } else { texts::WHOLE_NUMBER });
    write_range(setting, line);
}

pub(super) fn write_example(listed: &Listed, line: &mut Line) {
    line.say(if listed.from_field { texts::FIELD } else { texts::BUILT_IN });
    line.counted(listed.number.into());
    line.say(names::label(listed.example.label));
    listed.example.features.iter().for_each(|&feature| line.counted(feature.into()));
}

pub(super) fn write_detection(detection: &Classified, line: &mut Line) {
    line.say(texts::DUMPED);
    detection.features().values().iter().for_each(|&value| line.number(value.into()));
    line.say(names::class(detection.vote.class));
    line.counted(detection.vote.votes.into());
    if let Some(label) = detection.label {
        line.say(names::label(label));
    }
}
