//! Lines about the machine: status, curves, settings, examples and detections.

use super::names;
use crate::{
    alarm::{Alarm, Warning},
    ground::class::{Classifier, Listed},
    memory::Memory,
    operate::{detections::Classified, plot::Plot, state::State},
    say::{
        line::Line,
        texts::{self, Text},
        words::Argument,
    },
    settings::Setting,
    weeder::Controller,
};

/// The state, and for an alarm its code within the text `between`, and its name.
pub(super) fn write_state(state: State, between: Text, line: &mut Line) {
    line.say(names::state(state));
    if let State::Alarm(alarm) = state {
        write_alarm(alarm, between, line);
    }
}

/// An alarm's code, within a text for its two digits, and its name.
#[inline(never)]
pub(super) fn write_alarm(alarm: Alarm, code: Text, line: &mut Line) {
    line.say(code);
    line.led(alarm);
    line.say(alarm.text());
}

pub(super) fn write_status<C: Classifier, M: Memory>(controller: &Controller<C, M>, line: &mut Line) {
    line.say(texts::STATE_IS);
    write_state(controller.state(), texts::CODE, line);
    line.say(texts::TOOL_IS);
    line.say(names::place(controller.tool_out()));
    if let Some(reason) = controller.reason() {
        line.say(texts::FOR);
        line.say(reason.text());
    }
    line.say(texts::PLACE);
    line.number(controller.readings().position.count());
    line.number(controller.speed_mm_s().into());
    line.counted(controller.zones().into());
    line.number(controller.unseen_mm().into());
    if controller.has_second_beam() {
        line.say(texts::SLIP_IS);
        let slip = controller.slip_permille();
        line.say(if slip.is_some() { texts::NUMBER } else { texts::NONE });
        line.number(slip.unwrap_or(0).into());
    }
}

pub(super) fn write_counts<C: Classifier, M: Memory>(controller: &Controller<C, M>, line: &mut Line) {
    let readings = controller.readings();
    line.say(texts::COUNTS);
    line.counted(readings.lost);
    line.counted(readings.jumps);
    line.counted(controller.late());
    line.counted(controller.events_missed());
    line.counted(controller.mistakes());
    line.counted(controller.dust());
    line.counted(readings.stack_free);
    line.say(controller.cause().text());
    if controller.sees_no_plants() {
        line.say(texts::WARNING_IS);
        line.say(Warning::NoPlants.text());
    }
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
    detection.features().values().iter().for_each(|&value| line.number(value));
    line.say(names::class(detection.vote.class));
    line.say(texts::VOTES);
    line.counted(detection.vote.votes.into());
    if let Some(label) = detection.label {
        line.say(names::label(label));
    }
}
