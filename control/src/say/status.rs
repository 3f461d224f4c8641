//! Lines about the machine: status, curves, settings, examples and detections.

use super::{line_tables::line, names};
use crate::{
    ground::class::{Classifier, Listed},
    memory::Memory,
    operate::{detections::Classified, plot::Plot, state::State},
    say::{
        line::Line,
        texts::{self, Text},
        words::Argument,
    },
    settings::Setting,
    status_table,
    weeder::Controller,
};

macro_rules! write_status {
    ($machine:ident: $(
        $Line:ident $meaning:literal { $($first:tt)* } $($(if $pattern:pat = $from:expr =>)? { $($values:tt)* })*;
    )*) => {$(
        #[doc = $meaning]
        pub(super) struct $Line;

        impl $Line {
            /// Builds the line.
            pub(super) fn write<C: Classifier, M: Memory>($machine: &Controller<C, M>, line: &mut Line) {
                line!(write(line) "" "" $($first)*);
                $($(if let $pattern = $from)? {
                    line!(write(line) "" " " $($values)*);
                })*
            }
        }
    )*};
}

status_table!(write_status);

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
    line.say(setting.text());
    write_value(texts::IS, setting, value, line);
    line.say(setting.unit());
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
fn write_value(text: Text, setting: Setting, value: u16, line: &mut Line) {
    line.say(text);
    if !setting.is_switched() {
        line.say(texts::NUMBER);
        return line.counted(value);
    }
    line.say(if value == 0 { Argument::Off } else { Argument::On }.text());
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
    line.say(name);
    line.say(if setting.is_switched() { texts::TAKES } else { texts::TAKES_A_NUMBER });
    write_range(setting, line);
}

pub(super) fn write_example(listed: &Listed, line: &mut Line) {
    line.say(if listed.from_field { texts::FIELD } else { texts::BUILT_IN });
    line.say(texts::EXAMPLE);
    line.counted(listed.number.into());
    line.say(names::label(listed.example.label));
    line.say(texts::FEATURES);
    listed.example.features.iter().for_each(|&feature| line.counted(feature.into()));
}

pub(super) fn write_detection(detection: &Classified, line: &mut Line) {
    line.say(texts::DUMPED);
    detection.features().values().iter().for_each(|&value| line.number(value.into()));
    line.say(names::class(detection.vote.class));
    line.say(texts::VOTES);
    line.counted(detection.vote.votes.into());
    if let Some(label) = detection.label {
        line.say(names::label(label));
    }
}
