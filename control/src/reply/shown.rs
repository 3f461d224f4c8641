//! Lines that show the machine: its status, its curves, its settings, examples and objects.

use crate::{
    alarm::Warning,
    classifier::{self, Classifier},
    console::{Argument, Plot},
    controller::{Controller, Judged, State},
    memory::Memory,
    said,
    say::{class_name, label_name, place_name, say, say_number, say_numbers, state_name},
    settings::Setting,
    text::Text,
};
use ufmt::{uWrite, uwrite};

pub(super) fn write_status<C, M, W>(controller: &Controller<C, M>, out: &mut W) -> Result<(), W::Error>
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

pub(super) fn write_counts<C, M, W>(controller: &Controller<C, M>, out: &mut W) -> Result<(), W::Error>
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

pub(super) fn write_version<W: uWrite + ?Sized>(out: &mut W) -> Result<(), W::Error> {
    say(out, said::WEEDER)
}

#[inline(never)]
pub(super) fn write_setting<C, M, W>(
    controller: &Controller<C, M>,
    setting: Setting,
    out: &mut W,
) -> Result<(), W::Error>
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
pub(super) fn write_value<W: uWrite + ?Sized>(
    text: Text,
    setting: Setting,
    value: u16,
    out: &mut W,
) -> Result<(), W::Error> {
    if !setting.is_switched() {
        return say_number(out, text, value.into());
    }
    say(out, text)?;
    say(out, if value == 0 { Argument::Off } else { Argument::On }.text())
}

pub(super) fn write_range<W: uWrite + ?Sized>(setting: Setting, out: &mut W) -> Result<(), W::Error> {
    if setting.is_switched() {
        return say(out, said::ON_OR_OFF);
    }
    let description = setting.description();
    say_number(out, said::FROM, description.least.into())?;
    say_number(out, said::TO, description.greatest.into())
}

pub(super) fn write_allowed<W: uWrite + ?Sized>(setting: Setting, out: &mut W) -> Result<(), W::Error> {
    say(out, setting.text())?;
    say(out, if setting.is_switched() { said::TAKES } else { said::TAKES_A_NUMBER })?;
    write_range(setting, out)
}

pub(super) fn write_example<W: uWrite + ?Sized>(listed: &classifier::Listed, out: &mut W) -> Result<(), W::Error> {
    say(out, if listed.from_field { said::FIELD } else { said::BUILT_IN })?;
    say_number(out, said::BLANK, listed.number.into())?;
    say(out, said::BLANK)?;
    say(out, label_name(listed.example.label))?;
    listed.example.features.iter().try_for_each(|&feature| say_number(out, said::BLANK, feature.into()))
}

pub(super) fn write_object<W: uWrite + ?Sized>(object: &Judged, out: &mut W) -> Result<(), W::Error> {
    for value in object.features().values() {
        uwrite!(out, "{}", value)?;
        say(out, said::COMMA)?;
    }
    say(out, class_name(object.vote.class))?;
    say_number(out, said::COMMA, object.vote.votes.into())?;
    say(out, said::COMMA)?;
    object.label.map_or(Ok(()), |label| say(out, label_name(label)))
}
