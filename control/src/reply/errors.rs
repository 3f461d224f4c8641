//! Lines that say what is wrong, and what would be right.

use super::shown::write_allowed;
use crate::{
    calibration::Unfit,
    console::Mistake,
    controller::Refusal,
    said,
    say::{say, say_number},
    settings::{Contradiction, Setting},
};
use ufmt::uWrite;

pub(super) fn write_mistake<W: uWrite + ?Sized>(mistake: Mistake, out: &mut W) -> Result<(), W::Error> {
    say(out, said::ERROR)?;
    let what = match mistake {
        Mistake::TooLong => said::TOO_LONG,
        Mistake::NotText => said::NOT_TEXT,
        Mistake::CharactersLost => said::CHARACTERS_LOST,
        Mistake::UnknownCommand => said::UNKNOWN_COMMAND,
        Mistake::UnknownSetting => said::UNKNOWN_SETTING,
        Mistake::Usage(word) => {
            say(out, said::USAGE)?;
            return say(out, word.usage());
        }
        Mistake::Value(setting) => return write_allowed(setting, out),
    };
    say(out, what)
}

pub(super) fn write_refusal<W>(refusal: Refusal, setting: Option<Setting>, out: &mut W) -> Result<(), W::Error>
where
    W: uWrite + ?Sized,
{
    say(out, said::ERROR)?;
    match (refusal, setting) {
        (Refusal::OutOfRange, Some(setting)) => write_allowed(setting, out),
        (Refusal::NotInHold, Some(setting)) if setting.description().hold_only => {
            say(out, setting.text())?;
            say(out, said::HOLD_TO_SET)
        }
        (Refusal::NotInHold, _) => say(out, said::HOLD_FIRST),
        (Refusal::Contradiction(Contradiction::PulsesEqual), _) => say(out, said::PULSES_EQUAL),
        (Refusal::Contradiction(Contradiction::BeamTooNear { needed_mm }), _) => {
            say_number(out, said::BEAM_TOO_NEAR, needed_mm.into())?;
            say(out, said::BEAM_FARTHER)
        }
        (Refusal::NothingToLabel, _) => say(out, said::NOTHING_TO_LABEL),
        (Refusal::NothingSaved, _) => say(out, said::NOTHING_SAVED),
        (Refusal::Unfit(Unfit::NotBegun), _) => say(out, said::NOT_BEGUN),
        (Refusal::Unfit(Unfit::TooShort), _) => say(out, said::TOO_SHORT),
        (Refusal::Unfit(Unfit::Differs { counted, nominal }), _) => {
            say_number(out, said::WHEEL_DIFFERS, counted.into())?;
            say_number(out, said::WHEEL_HAS, nominal.into())?;
            say(out, said::LOOK_AGAIN)
        }
        (Refusal::TestSpeed { fastest }, _) => say_number(out, said::TEST_SPEED, fastest.into()),
        (Refusal::ExamplesFull, _) => say(out, said::EXAMPLES_FULL),
        (Refusal::NoSuchExample, _) => say(out, said::NO_SUCH_EXAMPLE),
        _ => say(out, said::ALARM_LATCHED),
    }
}
