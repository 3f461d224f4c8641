//! Builds lines: events, status, curves, settings, examples and detections.

use super::names;
use crate::{
    alarm::{Alarm, Warning},
    ground::class::{Classifier, Listed},
    line_tables,
    memory::Memory,
    operate::{
        calibration::{Outcome, SwingTimes},
        detections::Classified,
        event::Event,
        plot::Plot,
        state::State,
    },
    say::{
        line::Line,
        packed::Text,
        texts::{self, NamedText},
        words::Argument,
    },
    settings::Setting,
    weeder::Controller,
};

/// Makes the functions that write the tables' lines.
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
        /// Builds the line of an event.
        #[inline(never)]
        pub fn write_event(event: &Event, line: &mut Line) {
            // By reference: a copy of the whole event would take most registers.
            match event {
                $($pattern => {
                    line.say(const { NamedText::of(concat!($beginning, $($part,)* $($tail)?)) });
                    $(kind::$kind(line, $value);)*
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
                        line.say(const { NamedText::of(concat!($($word),*)) });
                        $(kind::$of(line, $state);)*
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

    #[inline(always)]
    pub(super) fn number(line: &mut Line, value: impl Into<i32>) {
        line.number(value.into());
    }

    #[inline(always)]
    pub(super) fn count(line: &mut Line, value: impl Into<u16>) {
        line.counted(value.into());
    }

    pub(super) fn optional(line: &mut Line, value: Option<i16>) {
        match value {
            Some(value) => {
                line.word(texts::NUMBER.text());
                line.number(value.into());
            }
            None => line.word(texts::NONE.text()),
        }
    }

    #[inline(never)]
    pub(super) fn led(line: &mut Line, alarm: Alarm) {
        let (first, second) = alarm.code();
        line.counted(first.into());
        line.counted(second.into());
    }

    pub(super) fn class(line: &mut Line, class: Class) {
        line.word(names::class(class));
    }

    pub(super) fn place(line: &mut Line, tool_out: bool) {
        line.word(names::place(tool_out));
    }

    pub(super) fn state(line: &mut Line, state: State) {
        line.word(names::state(state));
    }

    pub(super) fn alarm(line: &mut Line, alarm: Alarm) {
        line.word(alarm.text());
    }

    pub(super) fn warning(line: &mut Line, warning: Warning) {
        line.word(warning.text());
    }

    pub(super) fn reason(line: &mut Line, reason: Reason) {
        line.word(reason.text());
    }

    pub(super) fn cause(line: &mut Line, cause: Cause) {
        line.word(cause.text());
    }

    pub(super) fn answer(line: &mut Line, yes: bool) {
        line.word(names::answer(yes));
    }
}

/// Adds an alarm's code and name.
pub(super) fn write_alarm(alarm: Alarm, line: &mut Line) {
    line.say(texts::IN_WORDS);
    kind::led(line, alarm);
    line.add(alarm.text());
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
    line.add(setting.text());
    write_value(texts::IS, setting, value, line);
    line.add(setting.unit());
    write_range(setting, line);
    write_value(texts::DEFAULT, setting, setting.default(), line);
    match controller.saved(setting) {
        None => line.say(texts::NOT_SAVED),
        Some(saved) if saved == value => {}
        Some(saved) => write_value(texts::SAVED, setting, saved, line),
    }
}

/// A text, then a setting's value.
#[inline(never)]
fn write_value(text: NamedText, setting: Setting, value: u16, line: &mut Line) {
    line.say(text);
    if !setting.is_switched() {
        line.say(texts::NUMBER);
        return line.counted(value);
    }
    line.add(if value == 0 { Argument::Off } else { Argument::On }.text());
}

fn write_range(setting: Setting, line: &mut Line) {
    if setting.is_switched() {
        return line.say(texts::ON_OR_OFF);
    }
    line.say(texts::RANGE);
    line.counted(setting.least());
    line.counted(setting.greatest());
}

/// The range of a setting, under the setting's name or another.
#[inline(never)]
pub(super) fn write_allowed(name: Text, setting: Setting, line: &mut Line) {
    line.add(name);
    line.say(if setting.is_switched() { texts::TAKES } else { texts::TAKES_A_NUMBER });
    write_range(setting, line);
}

pub(super) fn write_example(listed: &Listed, line: &mut Line) {
    line.say(if listed.from_field { texts::FIELD } else { texts::BUILT_IN });
    line.say(texts::EXAMPLE);
    line.counted(listed.number.into());
    line.add(names::label(listed.example.label));
    line.say(texts::FEATURES);
    listed.example.features.iter().for_each(|&feature| line.counted(feature.into()));
}

pub(super) fn write_detection(detection: &Classified, line: &mut Line) {
    line.say(texts::DUMPED);
    detection.features().values().iter().for_each(|&value| line.number(value.into()));
    line.add(names::class(detection.vote.class));
    line.say(texts::VOTES);
    line.counted(detection.vote.votes.into());
    if let Some(label) = detection.label {
        line.add(names::label(label));
    }
}
