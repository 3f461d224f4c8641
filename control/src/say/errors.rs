//! Command errors: what is wrong, and what is allowed.

use super::lines::write_allowed;
use crate::{
    ground::class::Classifier,
    memory::Memory,
    operate::command_error::CommandError,
    say::{line::Line, texts, words::Word},
    settings::Setting,
    weeder::Controller,
};

pub(super) fn write_command_error<C: Classifier, M: Memory>(
    error: CommandError,
    controller: &Controller<C, M>,
    line: &mut Line,
) {
    match error {
        // `servo US` is the only command with a range that names no setting.
        CommandError::OutOfRange => return write_allowed(Word::Servo.text(), Setting::ServoOutUs, line),
        CommandError::TakenForPlant | CommandError::TakenForWeed => line.say(texts::TAKEN_FOR),
        CommandError::WheelDiffers => {
            line.counted(controller.distance().counted());
            line.counted(controller.settings().nominal_ticks_per_m());
        }
        CommandError::BeamTooNear => line.counted(controller.needed_mm()),
        CommandError::TestSpeed => line.counted(controller.settings().get(Setting::TopSpeedMmS)),
        _ => {}
    }
    line.add(error.text());
    if error as u8 >= CommandError::WheelDiffers as u8 {
        line.say(texts::LOOK_AGAIN);
    }
}
