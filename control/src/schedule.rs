//! The schedule: ground where the tool must not work, and the paper's Y, Z and R.
//!
//! A window is a canopy with a margin on both sides. The schedule remembers canopies as ground seen, not as a list of
//! timed events, so that stopping, rolling back and changing speed need no bookkeeping: whether the tool may be in the
//! row is a question about a stretch of ground. Ground never seen, or seen so long ago that it had to be forgotten, is
//! closed: what is unknown is a plant.
//!
//! Windows need not be merged: two that overlap close the ground between them, and a gap too short to swing in and out
//! again is closed by the length of the stretch that the tool asks about.

use crate::{
    object::Object,
    units::{Position, Ticks, Wheel},
};
use heapless::Vec;

/// Canopies remembered at once, ahead of the tool and behind it: four plants between beam and tool at the longest
/// distance and the closest spacing, and some six metres of row to roll back over.
pub const CAPACITY: usize = 16;

/// How far behind the tool ground is remembered: 549 m at the default wheel, and far below half the counter's range,
/// so that what is behind never comes to lie ahead when the counter wraps.
const MEMORY: Ticks = Ticks(1 << 20);

/// The canopies known, in the order in which the beam saw them.
#[derive(Clone, Debug)]
pub struct Schedule {
    canopies: Vec<Object, CAPACITY>,
    /// Everything behind this place is unknown.
    known_from: Position,
    /// Whether ground behind that place was known once: then a plant may end there, whose margin is to be kept.
    has_forgotten: bool,
}

/// The schedule holds as many canopies ahead of the tool as it can; one more would have to be forgotten.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub struct Full;

impl Schedule {
    /// An empty schedule that knows the ground from `known_from` on.
    pub const fn new(known_from: Position) -> Self {
        Self { canopies: Vec::new(), known_from, has_forgotten: false }
    }

    /// The place from which on the ground is known.
    pub fn known_from(&self) -> Position {
        self.known_from
    }

    /// Whether ground behind [`known_from`](Self::known_from) was known once, and had to be forgotten.
    pub fn has_forgotten(&self) -> bool {
        self.has_forgotten
    }

    /// Declares the ground from `place` on known although the beam has not seen all of it.
    pub fn trust_from(&mut self, place: Position) {
        if self.known_from.is_ahead_of(place) {
            self.known_from = place;
            self.has_forgotten = false;
        }
    }

    /// Adds a canopy. When all places are taken, the oldest one behind the tool is forgotten, and the ground up to its
    /// end with it.
    ///
    /// # Errors
    /// [`Full`] when even the oldest window lies at the tool or ahead of it; the canopy is then not added.
    pub fn push(&mut self, canopy: Object, tool: Position, margin: Ticks) -> Result<(), Full> {
        if self.canopies.is_full() {
            let oldest = self.canopies.first().ok_or(Full)?;
            if !tool.is_ahead_of(oldest.trailing + margin) {
                return Err(Full);
            }
            self.forget_up_to(oldest.trailing);
            self.canopies.remove(0);
        }
        self.canopies.push(canopy).map_err(|_| Full)
    }

    /// Forgets what lies farther behind the tool than can be remembered.
    pub fn forget_behind(&mut self, tool: Position) {
        let horizon = tool - MEMORY;
        if horizon.is_ahead_of(self.known_from) {
            self.forget_up_to(horizon);
            // They stand in order, so that only the first can lie behind.
            while self.canopies.first().is_some_and(|canopy| horizon.is_ahead_of(canopy.trailing)) {
                self.canopies.remove(0);
            }
        }
    }

    fn forget_up_to(&mut self, place: Position) {
        self.known_from = place;
        self.has_forgotten = true;
    }

    /// Whether any of the ground between two places is closed: unknown, or within `margin` of a canopy.
    pub fn is_closed(&self, one: Position, other: Position, margin: Ticks) -> bool {
        let (near, far) = if one.is_ahead_of(other) { (other, one) } else { (one, other) };
        let open_from = if self.has_forgotten { self.known_from + margin } else { self.known_from };
        if open_from.is_ahead_of(near) {
            return true;
        }
        // Compared by distance from the near end, the counter's wrapping does no harm.
        let length = (far - near) + margin;
        self.canopies.iter().any(|canopy| (canopy.leading - near) <= length && (canopy.trailing - near) >= -margin)
    }

    /// Windows at the tool or ahead of it.
    pub fn ahead(&self, tool: Position, margin: Ticks) -> u8 {
        self.canopies.iter().filter(|canopy| !tool.is_ahead_of(canopy.trailing + margin)).count() as u8
    }
}

/// The paper's schedule of one canopy, in ticks from the place where the beam broke.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub struct Plan {
    /// Y: the tool leaves the row (Eq. 1).
    pub delay: Ticks,
    /// Z: how long it stays out (Eq. 2).
    pub hold: Ticks,
}

impl Plan {
    /// The schedule of a canopy of `width`, with the beam `distance_mm` ahead of the tool: each within a tick of its
    /// equation, as each is rounded once.
    pub fn new(wheel: Wheel, distance_mm: u16, margin_mm: u16, width: Ticks) -> Self {
        Self { delay: wheel.ticks(distance_mm.saturating_sub(margin_mm)), hold: width + wheel.ticks(2 * margin_mm) }
    }

    /// R: the tool is back in the row (Eq. 3).
    pub fn actuation(&self) -> Ticks {
        self.delay + self.hold
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    const MARGIN: Ticks = Ticks(95);

    fn canopy(leading: i32, trailing: i32) -> Object {
        Object { leading: Position::new(leading), trailing: Position::new(trailing), cut: false }
    }

    fn closed(schedule: &Schedule, from: i32, to: i32) -> bool {
        schedule.is_closed(Position::new(from), Position::new(to), MARGIN)
    }

    #[test]
    fn a_window_reaches_from_margin_to_margin() {
        let mut schedule = Schedule::new(Position::new(0));
        schedule.push(canopy(1000, 1300), Position::new(0), MARGIN).unwrap();
        assert!(!closed(&schedule, 904, 904));
        assert!(closed(&schedule, 905, 905));
        assert!(closed(&schedule, 1395, 1395));
        assert!(!closed(&schedule, 1396, 1396));
        assert!(closed(&schedule, 800, 905), "a stretch that ends in the window");
        assert!(closed(&schedule, 905, 800), "and the same rolling backwards");
        assert!(closed(&schedule, 0, 5000), "a stretch across the window");
        assert!(!closed(&schedule, 0, 904));
    }

    #[test]
    fn ground_never_seen_is_closed() {
        let schedule = Schedule::new(Position::new(0));
        assert!(closed(&schedule, -1, -1));
        assert!(closed(&schedule, -1, 5));
        assert!(!closed(&schedule, 0, 5));
    }

    #[test]
    fn a_full_schedule_forgets_only_what_lies_behind_the_tool() {
        let mut schedule = Schedule::new(Position::new(0));
        for plant in 0..CAPACITY as i32 {
            schedule.push(canopy(plant * 1000, plant * 1000 + 200), Position::new(0), MARGIN).unwrap();
        }
        assert_eq!(schedule.push(canopy(20_000, 20_200), Position::new(295), MARGIN), Err(Full));
        assert_eq!(schedule.push(canopy(20_000, 20_200), Position::new(296), MARGIN), Ok(()));
        assert!(schedule.has_forgotten());
        assert!(closed(&schedule, 294, 294), "what was forgotten is unknown");
        assert!(!closed(&schedule, 295, 295));
        let (place, wider) = (Position::new(299), Ticks(100));
        assert!(schedule.is_closed(place, place, wider), "its margin is kept, even one that was set later");
        assert!(closed(&schedule, 20_000, 20_000));
    }

    #[test]
    fn windows_ahead_are_counted_until_the_tool_has_passed_them() {
        let mut schedule = Schedule::new(Position::new(0));
        schedule.push(canopy(1000, 1300), Position::new(0), MARGIN).unwrap();
        schedule.push(canopy(2000, 2300), Position::new(0), MARGIN).unwrap();
        assert_eq!(schedule.ahead(Position::new(0), MARGIN), 2);
        assert_eq!(schedule.ahead(Position::new(1395), MARGIN), 2);
        assert_eq!(schedule.ahead(Position::new(1396), MARGIN), 1);
        assert_eq!(schedule.ahead(Position::new(2396), MARGIN), 0);
    }

    #[test]
    fn what_lies_far_behind_is_forgotten_before_the_counter_can_wrap_around_it() {
        let mut schedule = Schedule::new(Position::new(0));
        schedule.push(canopy(1000, 1300), Position::new(0), MARGIN).unwrap();
        for step in 1..5000 {
            let tool = Position::new(i32::wrapping_mul(step, 1 << 20));
            schedule.forget_behind(tool);
            assert!(!schedule.is_closed(tool, tool, MARGIN), "{step}");
            assert_eq!(schedule.ahead(tool, MARGIN), 0);
        }
    }

    #[test]
    fn windows_close_the_same_ground_where_the_counter_wraps() {
        let base = i32::MAX - 1100;
        let at = |offset: i32| Position::new(base.wrapping_add(offset));
        let mut schedule = Schedule::new(at(0));
        let canopy = Object { leading: at(1000), trailing: at(1300), cut: false };
        schedule.push(canopy, at(0), MARGIN).unwrap();
        for (offset, closed) in [(904, false), (905, true), (1150, true), (1395, true), (1396, false)] {
            assert_eq!(schedule.is_closed(at(offset), at(offset), MARGIN), closed, "{offset}");
        }
    }
}
