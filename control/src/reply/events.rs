//! The lines of events.

use crate::{
    calibration::{Leads, Outcome},
    event::Event,
    said,
    say::{class_name, place_name, say, say_number, say_numbers, state_name},
};
use ufmt::uWrite;

/// Writes the line of an event, with its end.
///
/// # Errors
/// What `out` reports.
#[inline(never)]
pub fn write_event<W: uWrite + ?Sized>(event: &Event, out: &mut W) -> Result<(), W::Error> {
    match *event {
        Event::Object { vote, leading, spacing, plan } => {
            say(out, class_name(vote.class))?;
            let numbers =
                [leading.count(), vote.votes.into(), spacing.0, plan.delay.0, plan.hold.0, plan.actuation().0];
            say_numbers(out, said::OBJECT, &numbers)?;
        }
        Event::Swing { out: leaves, position } => {
            say(out, said::SWING)?;
            say(out, place_name(leaves))?;
            say_number(out, said::POS, position.count())?;
        }
        Event::State(state) => {
            say(out, said::STATE_EVENT)?;
            say(out, state_name(state))?;
        }
        Event::Warning(warning) => {
            say(out, said::WARNING)?;
            say(out, warning.text())?;
        }
        Event::Calibrated { outcome: Outcome::Measured(Leads { out_ms, in_ms }), fits } => {
            say_numbers(out, said::CALIBRATED, &[out_ms.into(), in_ms.into()])?;
            say(out, if fits { said::SET } else { said::NOT_SET })?;
        }
        Event::Calibrated { outcome: Outcome::Shown, .. } => {
            say(out, said::CALIBRATED_BY_EYE)?;
        }
        Event::Calibrated { outcome: Outcome::Failed, .. } => {
            say(out, said::NOT_CALIBRATED)?;
        }
        Event::Alarm { alarm, position } => {
            say(out, said::ALARM)?;
            say(out, alarm.text())?;
            say_number(out, said::CODE, alarm.code().into())?;
            say_number(out, said::POS, position.count())?;
        }
    }
    say(out, said::END)
}
