//! Lines that say what is wrong, and what would be right.

use super::{names::class_name, shown::write_allowed};
use crate::{
    calibration::Unfit,
    console::{Mistake, Word},
    line::Line,
    refusal::Refusal,
    said,
    settings::{Contradiction, Setting},
};

pub(super) fn write_mistake(mistake: Mistake, line: &mut Line) {
    line.say(said::ERROR);
    let what = match mistake {
        Mistake::TooLong => said::TOO_LONG,
        Mistake::NotText => said::NOT_TEXT,
        Mistake::CharactersLost => said::CHARACTERS_LOST,
        Mistake::UnknownCommand => said::UNKNOWN_COMMAND,
        Mistake::UnknownSetting => said::UNKNOWN_SETTING,
        Mistake::Usage(word) => {
            line.say(said::USAGE);
            word.usage()
        }
        Mistake::Value(setting) => return write_allowed(setting.text(), setting, line),
    };
    line.say(what);
}

pub(super) fn write_refusal(refusal: Refusal, setting: Option<Setting>, line: &mut Line) {
    line.say(said::ERROR);
    let what = match (refusal, setting) {
        (Refusal::OutOfRange, Some(setting)) => return write_allowed(setting.text(), setting, line),
        // Of all commands, this one alone takes a value that is no setting's.
        (Refusal::OutOfRange, None) => return write_allowed(Word::Servo.text(), Setting::ServoOutUs, line),
        (Refusal::NotInHold, Some(setting)) => {
            line.say(setting.text());
            said::HOLD_TO_SET
        }
        (Refusal::NotInHold, _) => said::HOLD_FIRST,
        (Refusal::AlarmLatched, _) => said::ALARM_LATCHED,
        (Refusal::Contradiction(Contradiction::PulsesEqual), _) => said::PULSES_EQUAL,
        (Refusal::Contradiction(Contradiction::BeamTooNear { needed_mm }), _) => {
            line.counted(needed_mm);
            said::BEAM_TOO_NEAR
        }
        (Refusal::NothingToLabel, _) => said::NOTHING_TO_LABEL,
        (Refusal::TakenFor(class), _) => {
            line.say(said::TAKEN_FOR);
            line.say(class_name(class));
            said::LOOK_AGAIN
        }
        (Refusal::NothingSaved, _) => said::NOTHING_SAVED,
        (Refusal::Unfit(Unfit::NotBegun), _) => said::NOT_BEGUN,
        (Refusal::Unfit(Unfit::TooShort), _) => said::TOO_SHORT,
        (Refusal::Unfit(Unfit::Differs { counted, nominal }), _) => {
            line.say(said::WHEEL_DIFFERS);
            line.counted(counted);
            line.counted(nominal);
            said::LOOK_AGAIN
        }
        (Refusal::TestSpeed { fastest }, _) => {
            line.counted(fastest);
            said::TEST_SPEED
        }
        (Refusal::ExamplesFull, _) => said::EXAMPLES_FULL,
        (Refusal::NoSuchExample, _) => said::NO_SUCH_EXAMPLE,
    };
    line.say(what);
}
