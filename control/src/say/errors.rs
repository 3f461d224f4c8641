//! Error lines: what is wrong, and what is allowed.

use super::lines::write_allowed;
use crate::{
    ground::class::Classifier,
    memory::Memory,
    operate::command_error::CommandError,
    say::{command::ParseError, line::Line, texts, words::Word},
    settings::Setting,
    weeder::Controller,
};

pub(super) fn write_parse_error(error: ParseError, line: &mut Line) {
    line.say(texts::ERROR);
    let what = match error {
        ParseError::Usage(word) => {
            line.say(texts::USAGE);
            line.add(word.text());
            word.takes()
        }
        ParseError::Value(setting) => return write_allowed(setting.text(), setting, line),
        ParseError::Line(wrong) => wrong.text(),
    };
    line.add(what);
}

pub(super) fn write_command_error<C: Classifier, M: Memory>(
    error: CommandError,
    setting: Option<Setting>,
    controller: &Controller<C, M>,
    line: &mut Line,
) {
    line.say(texts::ERROR);
    match (error, setting) {
        (CommandError::OutOfRange, Some(setting)) => return write_allowed(setting.text(), setting, line),
        // `servo US` is the only other command with a range.
        (CommandError::OutOfRange, None) => return write_allowed(Word::Servo.text(), Setting::ServoOutUs, line),
        (CommandError::NotInHold, Some(setting)) => {
            line.add(setting.text());
            return line.say(texts::HOLD_TO_SET);
        }
        (CommandError::TakenForPlant | CommandError::TakenForWeed, _) => line.say(texts::TAKEN_FOR),
        (CommandError::WheelDiffers, _) => {
            line.counted(controller.distance().counted());
            line.counted(controller.settings().nominal_ticks_per_m());
        }
        (CommandError::BeamTooNear, _) => line.counted(controller.needed_mm()),
        (CommandError::TestSpeed, _) => line.counted(controller.settings().get(Setting::TopSpeedMmS)),
        _ => {}
    }
    line.add(error.text());
    if error as u8 >= CommandError::WheelDiffers as u8 {
        line.say(texts::LOOK_AGAIN);
    }
}
