//! Compares the events of a log with those of its replay.

use super::{DETECTION_TICKS, Difference, Replayed, SWING_MS, SWING_TICKS};
use control::say::names;
use link::{EventLine, advice};

/// Longer than any detection's hold: 5 m at the default wheel.
const FAR_TICKS: i32 = 10_000;

/// An event of the log or of its replay.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub(super) struct Heard {
    /// The log's line; 0 for the replay.
    pub(super) line: u64,
    /// Steps of the replay until this event; 0 for the log.
    pub(super) steps: u64,
    pub(super) event: EventLine,
    /// The machine's speed then, in ticks a second.
    pub(super) speed: i32,
    /// Whether its position comes from the log, not from the replay.
    pub(super) is_given: bool,
}

/// The limits of a replayed stretch.
pub(super) struct Bounds {
    /// The first position.
    pub(super) first: i32,
    /// Swings before this position are not compared.
    pub(super) compared_from: i32,
    /// The last position.
    pub(super) end: i32,
    /// Within this distance of it a detection may have begun that the log does not tell. The tool keeps to it.
    pub(super) untold: i32,
}

/// Compares the log's events with those of its replays, each kind in its order. Records the first difference: an event
/// on which no replay agrees with the log. Each replay has another pace. The most likely pace is first.
pub(super) fn compare(logged: &[Heard], replays: &[&[Heard]], bounds: &Bounds, result: &mut Replayed) {
    let kinds: [fn(&EventLine) -> bool; 3] = [
        |event| matches!(event, EventLine::Detection { .. }),
        |event| matches!(event, EventLine::Swing { .. }),
        |event| matches!(event, EventLine::Alarm { .. }),
    ];
    let is_judged = |heard: &&Heard| match heard.event {
        // The replay cuts a detection that was in the beam at the start of the log.
        EventLine::Detection { position, .. } => position.wrapping_sub(bounds.first) >= 0,
        EventLine::Swing { position, .. } => position >= bounds.compared_from,
        _ => !heard.is_given,
    };
    // At the very end an event may be in only one of log and replay: a detection is reported some distance behind it.
    let is_at_end = |heard: &Heard| match heard.event {
        EventLine::Swing { position, .. } => near(position, bounds.end, bounds.untold.max(swing_ticks(heard, heard))),
        EventLine::Detection { position, hold, .. } => {
            (-FAR_TICKS..=DETECTION_TICKS).contains(&bounds.end.wrapping_sub(position.wrapping_add(hold)))
        }
        _ => false,
    };
    // At the very beginning an event may lie within the limit in only one of log and replay.
    let is_at_beginning = |heard: &Heard| match heard.event {
        EventLine::Swing { position, .. } => {
            bounds.compared_from > i32::MIN && near(position, bounds.compared_from, swing_ticks(heard, heard))
        }
        // Both have it, but only one of them within the compared range.
        EventLine::Detection { position, .. } => {
            let is_heard = |heard_there: &[Heard]| heard_there.iter().any(|other| agree(heard, other));
            near(position, bounds.first, DETECTION_TICKS)
                && is_heard(logged)
                && replays.iter().any(|replayed| is_heard(replayed))
        }
        _ => false,
    };
    let mut differences = Vec::new();
    for is_kind in kinds {
        let judged = |heard: &'_ [Heard]| -> Vec<Heard> {
            heard.iter().filter(|heard| is_kind(&heard.event)).filter(is_judged).copied().collect()
        };
        let (logged, replays) = (judged(logged), replays.iter().map(|replayed| judged(replayed)).collect::<Vec<_>>());
        let mut theirs = logged.as_slice();
        let mut ours: Vec<&[Heard]> = replays.iter().map(Vec::as_slice).collect();
        let is_agreed = |logged: &Heard| ours.iter().any(|ours| ours.first().is_some_and(|first| agree(logged, first)));
        if !theirs.first().is_some_and(is_agreed) {
            match theirs {
                [first, rest @ ..] if is_at_beginning(first) => theirs = rest,
                _ => ours
                    .iter_mut()
                    .for_each(|ours| *ours = &ours[usize::from(ours.first().is_some_and(is_at_beginning))..]),
            }
        }
        loop {
            let nexts: Vec<Option<&Heard>> = ours.iter().map(|ours| ours.first()).collect();
            let logged = theirs.first();
            let is_same = |replayed: &&&Heard| logged.is_some_and(|logged| agree(logged, replayed));
            if let (Some(logged), Some(replayed)) = (logged, nexts.iter().flatten().find(is_same)) {
                result.count(logged, replayed);
                theirs = &theirs[1..];
                ours.iter_mut().for_each(|ours| *ours = behind(ours, replayed));
                continue;
            }
            let is_end = match logged {
                None => nexts.iter().any(|next| next.is_none_or(is_at_end)),
                Some(logged) => is_at_end(logged) && nexts.contains(&None),
            };
            if is_end {
                break;
            }
            let by_chance = (0..ours.len()).filter(|&pace| is_by_chance(ours[pace], &ours));
            let Some(pace) = by_chance.min_by_key(|&pace| ours[pace][0].steps) else {
                let (line, logged, replayed) = (logged.map(|logged| logged.line), describe(logged), describe(nexts[0]));
                differences.push(Difference { line, logged, replayed });
                break;
            };
            ours[pace] = &ours[pace][2..];
        }
    }
    if result.difference.is_none() {
        result.difference = differences.into_iter().min_by_key(|difference| difference.line.unwrap_or(u64::MAX));
    }
}

/// Whether a pace goes into the row next and out again, while the tool of another pace stays out: the gap between the
/// zones is near the shortest one. The firmware may have stayed out there, though it agrees with this pace elsewhere.
fn is_by_chance(ours: &[Heard], paces: &[&[Heard]]) -> bool {
    let is_swing = |heard: &Heard, into: bool| matches!(heard.event, EventLine::Swing { out, .. } if out != into);
    let [into, back, ..] = ours else { return false };
    let reach = u64::from(swing_ticks(into, into).unsigned_abs());
    let stays_out = |pace: &&[Heard]| {
        let next = pace.iter().find(|heard| heard.steps + reach >= into.steps);
        next.is_none_or(|next| next.steps > back.steps + reach && is_swing(next, true))
    };
    is_swing(into, true) && is_swing(back, false) && paces.iter().any(stays_out)
}

/// The events after this one in a replay. If the replay lacks it, another pace may have it.
fn behind<'a>(heard: &'a [Heard], this: &Heard) -> &'a [Heard] {
    let reach = u64::from(swing_ticks(this, this).unsigned_abs());
    let near = heard.iter().take_while(|heard| heard.steps <= this.steps + reach);
    let is_the_same = |heard: &Heard| match (heard.event, this.event) {
        (EventLine::Swing { out, .. }, EventLine::Swing { out: this_out, .. }) => out == this_out,
        _ => true,
    };
    let apart = |heard: &Heard| heard.steps.abs_diff(this.steps);
    let same = near.clone().enumerate().filter(|(_, heard)| is_the_same(heard) && apart(heard) <= reach);
    let behind = match same.min_by_key(|(_, heard)| apart(heard)) {
        Some((place, _)) => place + 1,
        None => near.take_while(|heard| heard.steps < this.steps).count(),
    };
    &heard[behind..]
}

impl Replayed {
    /// Counts an event on which both agree.
    fn count(&mut self, logged: &Heard, replayed: &Heard) {
        match (logged.event, replayed.event) {
            (EventLine::Detection { .. }, _) => self.objects += 1,
            (EventLine::Alarm { .. }, _) => self.alarms += 1,
            (EventLine::Swing { position, .. }, EventLine::Swing { position: ours, .. }) => {
                self.swings += 1;
                if !logged.is_given {
                    self.farthest_swing = self.farthest_swing.max(position.wrapping_sub(ours).saturating_abs());
                }
            }
            _ => {}
        }
    }
}

/// The greatest difference of these swings' positions, in ticks.
fn swing_ticks(logged: &Heard, replayed: &Heard) -> i32 {
    SWING_TICKS + logged.speed.abs().max(replayed.speed.abs()) * SWING_MS / 1000
}

fn near(one: i32, other: i32, ticks: i32) -> bool {
    one.wrapping_sub(other).saturating_abs() <= ticks
}

/// Whether log and replay have the same event.
fn agree(logged: &Heard, replayed: &Heard) -> bool {
    match (logged.event, replayed.event) {
        (
            EventLine::Detection { class, position, votes, hold, .. },
            EventLine::Detection { class: our_class, position: our_position, votes: our_votes, hold: our_hold, .. },
        ) => {
            (class, votes) == (our_class, our_votes)
                && near(position, our_position, DETECTION_TICKS)
                && near(hold, our_hold, DETECTION_TICKS)
        }
        (EventLine::Swing { out, position }, EventLine::Swing { out: ours, position: our_position }) => {
            out == ours && (logged.is_given || near(position, our_position, swing_ticks(logged, replayed)))
        }
        (EventLine::Alarm { alarm, .. }, EventLine::Alarm { alarm: ours, .. }) => alarm == ours,
        _ => false,
    }
}

fn describe(heard: Option<&Heard>) -> String {
    let Some(heard) = heard else { return "none".to_owned() };
    match heard.event {
        EventLine::Detection { class, position, votes, hold, .. } => {
            format!("`{} pos={position} votes={votes} hold={hold}`", names::class(class))
        }
        EventLine::Swing { out, position } => format!("`swing tool={} pos={position}`", names::place(out)),
        EventLine::Alarm { alarm, position } => format!("`alarm {} pos={position}`", advice::name(alarm)),
        _ => "something else".to_owned(),
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    /// The swings into these gaps, and out again.
    fn swings(gaps: &[(u16, u16)]) -> Vec<Heard> {
        let swings = gaps.iter().flat_map(|&(into, back)| [(false, into), (true, back)]);
        let heard = |(out, at): (bool, u16)| {
            let event = EventLine::Swing { out, position: at.into() };
            Heard { line: at.into(), steps: at.into(), event, speed: 1000, is_given: false }
        };
        swings.map(heard).collect()
    }

    fn line_that_differs(logged: &[(u16, u16)], paces: &[&[(u16, u16)]]) -> Option<Option<u64>> {
        let paces: Vec<Vec<Heard>> = paces.iter().map(|gaps| swings(gaps)).collect();
        let paces: Vec<&[Heard]> = paces.iter().map(Vec::as_slice).collect();
        let bounds = Bounds { first: 0, compared_from: i32::MIN, end: 9000, untold: 0 };
        let mut result = Replayed::default();
        compare(&swings(logged), &paces, &bounds, &mut result);
        result.difference.map(|difference| difference.line)
    }

    #[test]
    fn a_log_may_take_one_gap_near_the_shortest_and_refuse_another() {
        // All paces take the first and the last gap, and one refuses the two between.
        let all = [(1000, 1300), (2000, 2280), (3000, 3280), (4000, 4300)];
        let refused = [all[0], all[3]];
        let paces = [&all[..], &all, &refused];
        for logged in [&all[..], &refused, &[all[0], all[1], all[3]], &[all[0], all[2], all[3]]] {
            assert_eq!(line_that_differs(logged, &paces), None, "{logged:?}");
        }
        // Each of two paces takes another gap, and the log neither.
        assert_eq!(line_that_differs(&[], &[&all[1..2], &all[2..3]]), None);
        // All paces take what the log refuses, or none takes what it has.
        assert_eq!(line_that_differs(&all[1..], &paces), Some(Some(2000)));
        assert_eq!(line_that_differs(&all[..3], &paces), Some(None));
        let more = [all[0], (1500, 1800), all[3]];
        assert_eq!(line_that_differs(&more, &paces), Some(Some(1500)));
    }
}
