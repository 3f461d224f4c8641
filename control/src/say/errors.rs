//! Lines that say what is wrong, and what would be right.

use super::{names::class_name, status::write_allowed};
use crate::{
    operate::{calibration::Unfit, refusal::Refusal},
    say::{
        command::{Mistake, Word},
        line::Line,
        texts,
    },
    settings::{Contradiction, Setting},
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

pub(super) fn write_refusal(refusal: Refusal, setting: Option<Setting>, line: &mut Line) {
    line.say(texts::ERROR);
    let what = match (refusal, setting) {
        (Refusal::OutOfRange, Some(setting)) => return write_allowed(setting.text(), setting, line),
        // Of all commands, this one alone takes a value that is no setting's.
        (Refusal::OutOfRange, None) => return write_allowed(Word::Servo.text(), Setting::ServoOutUs, line),
        (Refusal::NotInHold, Some(setting)) => {
            line.say(setting.text());
            texts::HOLD_TO_SET
        }
        (Refusal::NotInHold, _) => texts::HOLD_FIRST,
        (Refusal::AlarmLatched, _) => texts::ALARM_LATCHED,
        (Refusal::Contradiction(Contradiction::PulsesEqual), _) => texts::PULSES_EQUAL,
        (Refusal::Contradiction(Contradiction::SecondBeamAstray), _) => texts::SECOND_BEAM_ASTRAY,
        (Refusal::Contradiction(Contradiction::BeamTooNear { needed_mm }), _) => {
            line.counted(needed_mm);
            texts::BEAM_TOO_NEAR
        }
        (Refusal::NothingToLabel, _) => texts::NOTHING_TO_LABEL,
        (Refusal::TakenFor(class), _) => {
            line.say(texts::TAKEN_FOR);
            line.say(class_name(class));
            texts::LOOK_AGAIN
        }
        (Refusal::NothingSaved, _) => texts::NOTHING_SAVED,
        (Refusal::Unfit(Unfit::NotBegun), _) => texts::NOT_BEGUN,
        (Refusal::Unfit(Unfit::TooShort), _) => texts::TOO_SHORT,
        (Refusal::Unfit(Unfit::Differs { counted, nominal }), _) => {
            line.say(texts::WHEEL_DIFFERS);
            line.counted(counted);
            line.counted(nominal);
            texts::LOOK_AGAIN
        }
        (Refusal::TestSpeed { fastest }, _) => {
            line.counted(fastest);
            texts::TEST_SPEED
        }
        (Refusal::NotTold, _) => texts::NOT_TOLD,
        (Refusal::ExamplesFull, _) => texts::EXAMPLES_FULL,
        (Refusal::NoSuchExample, _) => texts::NO_SUCH_EXAMPLE,
    };
    line.say(what);
}
