//! The lines of events.

use super::names::{class_name, place_name, state_name};
use crate::{
    calibration::{Leads, Outcome},
    event::Event,
    line::Line,
    said,
};

/// Puts the line of an event together.
#[inline(never)]
pub fn write_event(event: &Event, line: &mut Line) {
    match *event {
        Event::Object { vote, leading, spacing, plan } => {
            line.say(class_name(vote.class));
            line.say(said::OBJECT);
            line.number(leading.count());
            line.counted(vote.votes.into());
            line.number(spacing.0);
            line.number(plan.delay.0);
            line.number(plan.hold.0);
            line.number(plan.actuation().0);
        }
        Event::Swing { out, position } => {
            line.say(said::SWING);
            line.say(place_name(out));
            line.say(said::POS);
            line.number(position.count());
        }
        Event::State(state) => {
            line.say(said::STATE_EVENT);
            line.say(state_name(state));
        }
        Event::Warning(warning) => {
            line.say(said::WARNING);
            line.say(warning.text());
        }
        Event::Calibrated { outcome: Outcome::Measured(Leads { out_ms, in_ms }), fits } => {
            line.say(said::CALIBRATED);
            line.counted(out_ms);
            line.counted(in_ms);
            line.say(if fits { said::SET } else { said::NOT_SET });
        }
        Event::Calibrated { outcome: Outcome::Shown, .. } => line.say(said::CALIBRATED_BY_EYE),
        Event::Calibrated { outcome: Outcome::Failed, .. } => line.say(said::NOT_CALIBRATED),
        Event::Alarm { alarm, position } => {
            line.say(said::ALARM);
            line.say(alarm.text());
            line.say(said::CODE);
            line.counted(alarm.code().into());
            line.say(said::POS);
            line.number(position.count());
        }
    }
    line.say(said::END);
}
