//! Lines that say what is wrong, and what would be right.

use super::status::write_allowed;
use crate::{
    ground::class::Classifier,
    memory::Memory,
    operate::refusal::Refusal,
    say::{
        command::Mistake,
        line::Line,
        texts,
        words::{Argument, Word},
    },
    settings::Setting,
    weeder::Controller,
};

pub(super) fn write_mistake(mistake: Mistake, line: &mut Line) {
    line.say(texts::ERROR);
    let what = match mistake {
        Mistake::TooLong => texts::TOO_LONG,
        Mistake::NotText => texts::NOT_TEXT,
        Mistake::CharactersLost => texts::CHARACTERS_LOST,
        Mistake::UnknownCommand => texts::UNKNOWN_COMMAND,
        Mistake::UnknownSetting => texts::UNKNOWN_SETTING,
        Mistake::Usage(word) => {
            line.say(texts::USAGE);
            word.usage()
        }
        Mistake::Value(setting) => return write_allowed(setting.text(), setting, line),
    };
    line.say(what);
}

pub(super) fn write_refusal<C: Classifier, M: Memory>(
    refusal: Refusal,
    setting: Option<Setting>,
    controller: &Controller<C, M>,
    line: &mut Line,
) {
    line.say(texts::ERROR);
    let what = match (refusal, setting) {
        (Refusal::OutOfRange, Some(setting)) => return write_allowed(setting.text(), setting, line),
        // Of all commands, this one alone takes a value that is no setting's.
        (Refusal::OutOfRange, None) => return write_allowed(Word::Servo.text(), Setting::ServoOutUs, line),
        (Refusal::NotInHold, Some(setting)) => {
            line.say(setting.text());
            texts::HOLD_TO_SET
        }
        (Refusal::WheelDiffers, _) => {
            line.say(texts::WHEEL_DIFFERS);
            line.counted(controller.distance().counted());
            line.counted(controller.settings().nominal_ticks_per_m());
            texts::LOOK_AGAIN
        }
        (Refusal::TakenForPlant | Refusal::TakenForWeed, _) => {
            let taken_for = if refusal == Refusal::TakenForPlant { Argument::Plant } else { Argument::Weed };
            line.say(texts::TAKEN_FOR);
            line.say(taken_for.text());
            texts::LOOK_AGAIN
        }
        (Refusal::BeamTooNear, _) => {
            line.counted(controller.needed_mm());
            refusal.text()
        }
        (Refusal::TestSpeed, _) => {
            line.counted(controller.settings().get(Setting::TopSpeedMmS));
            refusal.text()
        }
        _ => refusal.text(),
    };
    line.say(what);
}
