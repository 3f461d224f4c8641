//! Error lines: what is wrong, and what is allowed.

use super::status::write_allowed;
use crate::{
    ground::class::Classifier,
    memory::Memory,
    operate::command_error::CommandError,
    say::{
        command::ParseError,
        line::Line,
        texts,
        words::{Argument, Word},
    },
    settings::Setting,
    weeder::Controller,
};

pub(super) fn write_parse_error(error: ParseError, line: &mut Line) {
    line.say(texts::ERROR);
    let what = match error {
        ParseError::Usage(word) => {
            line.say(texts::USAGE);
            line.say(word.text());
            word.takes()
        }
        ParseError::Value(setting) => return write_allowed(setting.text(), setting, line),
        ParseError::Line(wrong) => texts::TOO_LONG.plus(wrong as u8 - 1),
    };
    line.say(what);
}

pub(super) fn write_command_error<C: Classifier, M: Memory>(
    error: CommandError,
    setting: Option<Setting>,
    controller: &Controller<C, M>,
    line: &mut Line,
) {
    line.say(texts::ERROR);
    let what = match (error, setting) {
        (CommandError::OutOfRange, Some(setting)) => return write_allowed(setting.text(), setting, line),
        // `servo US` is the only other command with a range.
        (CommandError::OutOfRange, None) => return write_allowed(Word::Servo.text(), Setting::ServoOutUs, line),
        (CommandError::NotInHold, Some(setting)) => {
            line.say(setting.text());
            texts::HOLD_TO_SET
        }
        (CommandError::WheelDiffers, _) => {
            line.say(texts::WHEEL_DIFFERS);
            line.counted(controller.distance().counted());
            line.counted(controller.settings().nominal_ticks_per_m());
            texts::LOOK_AGAIN
        }
        (CommandError::TakenForPlant | CommandError::TakenForWeed, _) => {
            let taken_for = if error == CommandError::TakenForPlant { Argument::Plant } else { Argument::Weed };
            line.say(texts::TAKEN_FOR);
            line.say(taken_for.text());
            texts::LOOK_AGAIN
        }
        (CommandError::BeamTooNear, _) => {
            line.counted(controller.needed_mm());
            error.text()
        }
        (CommandError::TestSpeed, _) => {
            line.counted(controller.settings().get(Setting::TopSpeedMmS));
            error.text()
        }
        _ => error.text(),
    };
    line.say(what);
}
