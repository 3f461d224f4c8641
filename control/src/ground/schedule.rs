//! The schedule: ground where the tool must not work, and the paper's Y, Z and R.
//!
//! A window is a canopy with a margin on both sides. The schedule remembers canopies as ground seen, not as a list of
//! timed events, so that stopping, rolling back and changing speed need no bookkeeping: whether the tool may be in the
//! row is a question about a stretch of ground. Ground never seen, or forgotten, is closed: what is unknown is a plant.
//! Whatever is forgotten is closed, with a margin ahead of it for the plant that may end there.
//!
//! Windows need not be merged: two that overlap close the ground between them, and a gap too short to swing in and out
//! again is closed by the length of the stretch that the tool asks about.

use super::{object::Object, reach::Geometry};
use crate::units::{Length, Place, Ticks};
use heapless::Vec;

/// Canopies remembered at once, ahead of the tool and behind it: four plants between beam and tool at the longest
/// distance and the closest spacing, and some six metres of row to roll back over.
pub const CAPACITY: usize = 16;

/// What is known of the ground behind the place from which on it is known.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
enum Behind {
    /// It was never seen.
    Unseen,
    /// It was seen, and a fault has made it worth nothing.
    Spoiled,
    /// It was seen, and lies too far behind.
    Left,
}

/// The canopies known, in the order in which the beam saw them.
#[derive(Clone, Debug)]
pub struct Schedule {
    canopies: Vec<Object, CAPACITY, u8>,
    /// Everything behind this place is unknown.
    known_from: Place,
    behind: Behind,
}

/// The schedule holds as many canopies ahead of the tool as it can; one more would have to be forgotten.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub struct ScheduleFull;

impl Schedule {
    /// A schedule of no ground.
    pub const NONE: Self = Self::new(Place::new(0));

    /// An empty schedule that knows the ground from `known_from` on.
    pub const fn new(known_from: Place) -> Self {
        Self { canopies: Vec::new(), known_from, behind: Behind::Unseen }
    }

    /// The place from which on the ground is known.
    pub fn known_from(&self) -> Place {
        self.known_from
    }

    /// Whether a place lies so far behind that the ground there, although it was seen, had to be forgotten.
    #[cfg_attr(not(target_arch = "avr"), inline)]
    pub fn has_left(&self, place: Place) -> bool {
        self.behind == Behind::Left && self.known_from.is_ahead_of(place)
    }

    /// Declares the ground from `place` on known, which lies behind what the beam has seen.
    pub fn trust_from(&mut self, place: Place) {
        (self.known_from, self.behind) = (place, Behind::Unseen);
    }

    /// Forgets everything, as none of it is to be relied on: from `place` on, the ground is seen anew.
    pub fn spoil(&mut self, place: Place) {
        self.canopies.clear();
        (self.known_from, self.behind) = (place, Behind::Spoiled);
    }

    /// Adds a canopy. When all places are taken, the oldest one behind the tool is forgotten, and the ground up to its
    /// end with it.
    ///
    /// # Errors
    /// [`ScheduleFull`] when even the oldest window lies at the tool or ahead of it; the canopy is then not added.
    pub fn push(&mut self, canopy: Object, tool: Place, margin: Length) -> Result<(), ScheduleFull> {
        if self.canopies.is_full() {
            let oldest = self.canopies.first().ok_or(ScheduleFull)?;
            if !tool.is_ahead_of(oldest.trailing + margin) {
                return Err(ScheduleFull);
            }
            let place = oldest.trailing;
            self.leave(place);
        }
        self.canopies.push(canopy).map_err(|_| ScheduleFull)
    }

    /// A canopy that reaches to within a distance of a place goes as far as the place.
    #[cfg_attr(target_arch = "avr", inline(never))]
    pub fn widen(&mut self, place: Place, within: Length) {
        for canopy in &mut self.canopies {
            canopy.widen(place, within);
        }
    }

    /// Forgets what ends at a place or behind it: the machine has left it behind.
    #[cfg_attr(not(target_arch = "avr"), inline)]
    pub fn leave(&mut self, place: Place) {
        if !place.is_ahead_of(self.known_from) {
            return;
        }
        (self.known_from, self.behind) = (place, Behind::Left);
        // They stand in order, so that only the first can lie behind.
        while self.canopies.first().is_some_and(|canopy| !canopy.trailing.is_ahead_of(place)) {
            self.canopies.remove(0);
        }
    }

    /// Whether any of the ground between two places is closed: unknown, or within `margin` of a canopy.
    #[cfg_attr(not(target_arch = "avr"), inline)]
    pub fn is_closed(&self, near: Place, far: Place, margin: Length) -> bool {
        let open_from = if self.behind == Behind::Unseen { self.known_from } else { self.known_from + margin };
        if open_from.is_ahead_of(near) {
            return true;
        }
        // Compared by distance from the near end, the counter's wrapping does no harm.
        let length = (far - near) + margin;
        // Most lie behind the tool, and are told by their end.
        self.canopies.iter().any(|canopy| (canopy.trailing - near) >= -margin && (canopy.leading - near) <= length)
    }

    /// Windows at the tool or ahead of it.
    pub fn ahead(&self, tool: Place, margin: Length) -> u8 {
        self.canopies.iter().filter(|canopy| !tool.is_ahead_of(canopy.trailing + margin)).count() as u8
    }
}

/// The paper's schedule of one canopy, from the place where the beam broke.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub struct Plan {
    /// Y: the tool leaves the row (Eq. 1).
    pub delay: Ticks,
    /// Z: how long it stays out (Eq. 2).
    pub hold: Ticks,
}

impl Plan {
    /// The schedule of a canopy of `width`, each within two units of the grain of its equation.
    pub fn new(geometry: &Geometry, width: Length) -> Self {
        let Geometry { grain, beam_to_tool, margin, .. } = *geometry;
        let delay = (beam_to_tool - margin).max(Length::ZERO);
        Self { delay: grain.ticks(delay), hold: grain.ticks(width + margin + margin) }
    }

    /// R: the tool is back in the row (Eq. 3).
    pub fn actuation(&self) -> Ticks {
        self.delay + self.hold
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    const MARGIN: Length = Length(95);

    fn canopy(leading: i16, trailing: i16) -> Object {
        Object { leading: Place::new(leading), trailing: Place::new(trailing), cut: false }
    }

    fn closed(schedule: &Schedule, from: i16, to: i16) -> bool {
        schedule.is_closed(Place::new(from), Place::new(to), MARGIN)
    }

    #[test]
    fn a_window_reaches_from_margin_to_margin() {
        let mut schedule = Schedule::new(Place::new(0));
        schedule.push(canopy(1000, 1300), Place::new(0), MARGIN).unwrap();
        assert!(!closed(&schedule, 904, 904));
        assert!(closed(&schedule, 905, 905));
        assert!(closed(&schedule, 1395, 1395));
        assert!(!closed(&schedule, 1396, 1396));
        assert!(closed(&schedule, 800, 905), "a stretch that ends in the window");
        assert!(closed(&schedule, 0, 5000), "a stretch across the window");
        assert!(!closed(&schedule, 0, 904));
    }

    #[test]
    fn ground_never_seen_is_closed() {
        let schedule = Schedule::new(Place::new(0));
        assert!(closed(&schedule, -1, -1));
        assert!(closed(&schedule, -1, 5));
        assert!(!closed(&schedule, 0, 5));
    }

    #[test]
    fn a_full_schedule_forgets_only_what_lies_behind_the_tool() {
        let mut schedule = Schedule::new(Place::new(0));
        for plant in 0..CAPACITY as i16 {
            schedule.push(canopy(plant * 1000, plant * 1000 + 200), Place::new(0), MARGIN).unwrap();
        }
        assert_eq!(schedule.push(canopy(20_000, 20_200), Place::new(295), MARGIN), Err(ScheduleFull));
        assert_eq!(schedule.push(canopy(20_000, 20_200), Place::new(296), MARGIN), Ok(()));
        assert!(schedule.has_left(Place::new(199)) && !schedule.has_left(Place::new(200)));
        assert!(closed(&schedule, 294, 294), "what was forgotten is unknown");
        assert!(!closed(&schedule, 295, 295));
        let (place, wider) = (Place::new(299), Length(100));
        assert!(schedule.is_closed(place, place, wider), "its margin is kept, even one that was set later");
        assert!(closed(&schedule, 20_000, 20_000));
    }

    #[test]
    fn windows_ahead_are_counted_until_the_tool_has_passed_them() {
        let mut schedule = Schedule::new(Place::new(0));
        schedule.push(canopy(1000, 1300), Place::new(0), MARGIN).unwrap();
        schedule.push(canopy(2000, 2300), Place::new(0), MARGIN).unwrap();
        assert_eq!(schedule.ahead(Place::new(0), MARGIN), 2);
        assert_eq!(schedule.ahead(Place::new(1395), MARGIN), 2);
        assert_eq!(schedule.ahead(Place::new(1396), MARGIN), 1);
        assert_eq!(schedule.ahead(Place::new(2396), MARGIN), 0);
    }

    #[test]
    fn what_lies_far_behind_is_left_before_the_counter_can_wrap_around_it() {
        let mut schedule = Schedule::new(Place::new(0));
        schedule.push(canopy(1000, 1300), Place::new(0), MARGIN).unwrap();
        for step in 1..5000 {
            let tool = Place::new(i16::wrapping_mul(step, 1 << 8));
            schedule.leave(tool - Length(8000));
            assert!(step < 10 || !schedule.is_closed(tool, tool, MARGIN), "{step}");
            assert_eq!(schedule.ahead(tool, MARGIN), u8::from(step < 6));
            assert!(!schedule.has_left(tool));
        }
        assert!(schedule.has_left(Place::new(i16::wrapping_mul(4999, 1 << 8)) - Length(8001)));
    }

    #[test]
    fn what_is_spoiled_is_closed_with_a_margin_behind_it() {
        let mut schedule = Schedule::new(Place::new(0));
        schedule.push(canopy(1000, 1300), Place::new(0), MARGIN).unwrap();
        schedule.spoil(Place::new(1310));
        assert!(closed(&schedule, 0, 0) && closed(&schedule, 1310, 1310));
        assert!(closed(&schedule, 1404, 1404));
        assert!(!closed(&schedule, 1405, 1405));
        assert!(!schedule.has_left(Place::new(1000)), "nobody left it");
    }

    #[test]
    fn windows_close_the_same_ground_where_the_counter_wraps() {
        let base = i16::MAX - 1100;
        let at = |offset: i16| Place::new(base.wrapping_add(offset));
        let mut schedule = Schedule::new(at(0));
        let canopy = Object { leading: at(1000), trailing: at(1300), cut: false };
        schedule.push(canopy, at(0), MARGIN).unwrap();
        for (offset, closed) in [(904, false), (905, true), (1150, true), (1395, true), (1396, false)] {
            assert_eq!(schedule.is_closed(at(offset), at(offset), MARGIN), closed, "{offset}");
        }
    }
}
