//! The lines of events.

use super::{
    names::{class_name, place_name, state_name},
    status::write_alarm,
};
use crate::{
    operate::{
        calibration::{Outcome, SwingTimes},
        event::Event,
    },
    say::{line::Line, texts},
};

/// Puts the line of an event together.
#[inline(never)]
pub fn write_event(event: &Event, line: &mut Line) {
    match *event {
        Event::Detection { vote, leading, spacing, plan } => {
            line.say(class_name(vote.class));
            line.say(texts::OBJECT);
            line.number(leading.count());
            line.counted(vote.votes.into());
            line.number(spacing.0);
            line.number(plan.delay.0);
            line.number(plan.hold.0);
            line.number(plan.actuation().0);
        }
        Event::Guarded(place) => {
            line.say(texts::GUARDED);
            line.say(texts::POS);
            line.number(place.count());
        }
        Event::Slip { permille } => {
            line.say(texts::SLIP);
            line.number(permille.into());
        }
        Event::Swing { out, position } => {
            line.say(texts::SWING);
            line.say(place_name(out));
            line.say(texts::POS);
            line.number(position.count());
        }
        Event::State(state) => {
            line.say(texts::STATE_EVENT);
            line.say(state_name(state));
        }
        Event::Warning(warning) => {
            line.say(texts::WARNING);
            line.say(warning.text());
        }
        Event::Calibrated { outcome: Outcome::Measured(SwingTimes { out_ms, in_ms }), fits } => {
            line.say(texts::CALIBRATED);
            line.counted(out_ms);
            line.counted(in_ms);
            line.say(if fits { texts::SET } else { texts::NOT_SET });
        }
        Event::Calibrated { outcome: Outcome::Shown, .. } => line.say(texts::CALIBRATED_BY_EYE),
        Event::Calibrated { outcome: Outcome::Failed, .. } => line.say(texts::NOT_CALIBRATED),
        Event::Alarm { alarm, position } => {
            line.say(texts::IN_ALARM);
            write_alarm(alarm, texts::CODE, line);
            line.say(texts::POS);
            line.number(position.count());
        }
    }
    line.say(texts::END);
}
