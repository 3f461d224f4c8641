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
    match error {
        ParseError::Usage(word) => {
            line.say(texts::USAGE);
            line.say(word.text());
            line.say(word.takes());
        }
        ParseError::Value(setting) => write_allowed(setting.text(), setting, line),
        ParseError::Line(wrong) => line.say(wrong.text()),
    }
}

pub(super) fn write_command_error<C: Classifier, M: Memory>(
    error: CommandError,
    setting: Option<Setting>,
    controller: &Controller<C, M>,
    line: &mut Line,
) {
    line.say(texts::ERROR);
    match (error, setting) {
        (CommandError::OutOfRange, Some(setting)) => write_allowed(setting.text(), setting, line),
        // `servo US` is the only other command with a range.
        (CommandError::OutOfRange, None) => write_allowed(Word::Servo.text(), Setting::ServoOutUs, line),
        (CommandError::NotInHold, Some(setting)) => {
            line.say(texts::HOLD_TO_SET);
            line.say(setting.text());
        }
        _ => {
            line.say(error.text());
            match error {
                CommandError::WheelDiffers => {
                    line.counted(controller.distance().counted());
                    line.counted(controller.settings().nominal_ticks_per_m());
                }
                CommandError::BeamTooNear => line.counted(controller.needed_mm()),
                CommandError::TestSpeed => line.counted(controller.settings().get(Setting::TopSpeedMmS)),
                _ => {}
            }
        }
    }
}
