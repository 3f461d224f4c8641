//! The keep-out zones: ground where the tool must not work, and the paper's Y, Z and R.
//!
//! A zone is a canopy with a margin on both sides. Canopies are stored as stretches of ground, not as timed events. So stopping,
//! rolling back and changing speed need no bookkeeping. Unseen and forgotten ground is closed with a margin ahead of it, for a plant
//! that may end there.
//!
//! Zones are not merged. Two that overlap close the ground between them. The caller asks about a stretch as long as the servo
//! needs. So a gap too short to swing in and out is closed too.

use super::{detection::Detection, reach::Geometry};
use crate::units::{Length, Ticks, WrappedPosition};
use heapless::Vec;

/// Canopies remembered at once, ahead of the tool and behind it. Four plants fit between beam and tool at the longest distance and
/// closest spacing. The others allow rolling back over some six metres.
pub const CAPACITY: usize = 16;

/// Returns the width of the leaves on either side of a single plant under which the tool may work. A canopy of `width` is kept in
/// `zone` around its middle, or in full if `zone` is 0. Where the canopy is narrower than the zone, the result is negative: so far
/// the zone reaches beyond it.
///
/// A stem stands near the middle of its canopy. But two plants that have grown together, or a plant with a weed beside it, look the
/// same to the beam. So at most 11/64 of the zone are cut off either end: no stem stands so near to an end.
pub const fn trim(width: Length, zone: Length) -> Length {
    // The shift rounds down, so a zone is never too short.
    let (half, most) = ((width.0 - zone.0) >> 1, ((zone.0 as u16 * 11) >> 6) as i16);
    Length(if half < most { half } else { most })
}

/// A canopy to keep out of: its full width or the stem zone, whichever is wider. Of a single plant, the stem zone.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub struct Canopy {
    /// Where it begins.
    pub leading: WrappedPosition,
    /// Where it ends.
    pub trailing: WrappedPosition,
    /// Width of the leaves on either side under which the tool may work. Below 0, so far the stem zone reaches beyond either end.
    pub trim: Length,
}

impl Canopy {
    /// No canopy.
    pub(super) const NONE: Self =
        Self { leading: WrappedPosition::new(0), trailing: WrappedPosition::new(0), trim: Length::ZERO };

    /// The canopy of a detection, if it is a plant, and `zone` around its middle. Leaves beside the zone are kept too, unless it
    /// `is_single`. Without its beginning, it has half of the zone behind its end.
    pub(super) fn of(detection: &Detection, zone: Length, is_single: bool) -> Self {
        // If the beginning was not seen, clear ground may count as a part of the plant: the stem may stand at the end. A detection of the
        // second beam behind the last plant counts as such.
        let width = if detection.cut { Length::ZERO } else { detection.width() };
        let mut canopy = Self { leading: detection.leading, trailing: detection.trailing, trim: trim(width, zone) };
        if !is_single {
            canopy.keep_leaves();
        }
        canopy
    }

    /// Keeps all leaves.
    pub(super) fn keep_leaves(&mut self) {
        self.trim = self.trim.min(Length::ZERO);
    }

    /// Where the tool has to be out, without the margin, until the detection is classified: leaves beside the zone count.
    pub(super) fn begin_unclassified(&self) -> WrappedPosition {
        self.leading + self.trim.min(Length::ZERO)
    }

    /// Where the tool has to be out, without the margin.
    fn from(&self) -> WrappedPosition {
        self.leading + self.trim
    }

    /// Where the tool may come back, without the margin.
    fn to(&self) -> WrappedPosition {
        self.trailing - self.trim
    }

    /// Takes a stretch that the second beam sees, all of a detection or one end. Returns whether it lies within `reach` of the
    /// canopy.
    ///
    /// The canopy grows to include the stretch. It never shrinks: the second beam may have missed the tip of a leaf. If both beams
    /// see an end of a single plant within a quarter of `within`, its trim stays. Otherwise it then keeps its full width, because
    /// one beam has not seen all of it.
    #[cfg_attr(target_arch = "avr", inline(never))]
    pub(super) fn widen(&mut self, from: WrappedPosition, to: WrappedPosition, reach: Length, within: Length) -> bool {
        if self.leading - to > reach || from - self.trailing > reach {
            return false;
        }
        let (before, behind) = (self.leading - from, to - self.trailing);
        if before > Length::ZERO {
            self.leading = from;
        }
        if behind > Length::ZERO {
            self.trailing = to;
        }
        if before.max(behind) > Length(within.0 >> 2) {
            self.keep_leaves();
        }
        true
    }
}

/// The known canopies, in the order in which the beam saw them.
#[derive(Clone, Debug)]
pub struct KeepOut {
    canopies: Vec<Canopy, CAPACITY, u8>,
    /// All ground behind this position is unknown.
    known_from: WrappedPosition,
    /// Whether the beam saw that ground, and it was dropped: for distance, for lack of room, or in doubt.
    has_dropped: bool,
}

/// All places hold canopies at the tool or ahead of it.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub struct ScheduleFull;

impl KeepOut {
    /// Keep-out zones before any ground is known.
    pub const NONE: Self = Self::new(WrappedPosition::new(0));

    /// No canopies, with the ground known from `known_from` on.
    pub const fn new(known_from: WrappedPosition) -> Self {
        Self { canopies: Vec::new(), known_from, has_dropped: false }
    }

    /// Where the unknown ground's margin ends. A plant may end where the known ground begins.
    pub fn open_from(&self, margin: Length) -> WrappedPosition {
        self.known_from + margin
    }

    /// Whether the ground at a position was seen, and dropped.
    #[cfg_attr(not(target_arch = "avr"), inline)]
    pub fn has_left(&self, position: WrappedPosition) -> bool {
        self.has_dropped && self.known_from.is_ahead_of(position)
    }

    /// Whether the unknown ground was seen, and dropped. Once the tool has left it behind, it is unknown like any other.
    pub fn mark_dropped(&mut self, has_dropped: bool) {
        self.has_dropped = has_dropped;
    }

    /// Declares the ground known from `position` on.
    pub fn set_known_from(&mut self, position: WrappedPosition) {
        (self.known_from, self.has_dropped) = (position, false);
    }

    /// Forgets all canopies, because they are not reliable. The ground is known from `position` on.
    pub fn invalidate(&mut self, position: WrappedPosition) {
        self.canopies.clear();
        self.set_known_from(position);
    }

    /// Adds a canopy. If all places are taken, drops the oldest canopy behind the tool, and the ground up to its end.
    ///
    /// # Errors
    /// [`ScheduleFull`] if even the oldest zone lies at the tool or ahead of it. The canopy is then not added.
    pub fn push(&mut self, canopy: &Canopy, tool: WrappedPosition, margin: Length) -> Result<(), ScheduleFull> {
        if self.canopies.is_full() {
            let end = self.canopies.first().ok_or(ScheduleFull)?.to();
            if !tool.is_ahead_of(end + margin) {
                return Err(ScheduleFull);
            }
            self.leave(end);
        }
        self.canopies.push(*canopy).map_err(|_| ScheduleFull)
    }

    /// Widens the canopy that the second beam sees between `from` and `to`, see `Canopy::widen`. Returns whether a canopy is within
    /// `within` of that stretch.
    pub fn widen(&mut self, from: WrappedPosition, to: WrappedPosition, within: Length) -> bool {
        // First look for a canopy that contains the whole stretch.
        let mut reach = from - to;
        loop {
            if self.canopies.iter_mut().any(|canopy| canopy.widen(from, to, reach, within)) {
                return true;
            }
            if reach == within {
                return false;
            }
            reach = within;
        }
    }

    /// Drops the canopies that end at a position or behind it.
    #[cfg_attr(not(target_arch = "avr"), inline)]
    pub fn leave(&mut self, position: WrappedPosition) {
        if position.is_ahead_of(self.known_from) {
            (self.known_from, self.has_dropped) = (position, true);
        }
        // They are in order, so only the first can lie behind. If the second does too, the next turn drops it: until then the unknown
        // ground covers it.
        if self.canopies.first().is_some_and(|canopy| !canopy.to().is_ahead_of(self.known_from)) {
            self.canopies.remove(0);
        }
    }

    /// Whether any of the ground between two positions is closed: unknown, or within `margin` of a canopy.
    #[cfg_attr(not(target_arch = "avr"), inline)]
    pub fn is_closed(&self, near: WrappedPosition, far: WrappedPosition, margin: Length) -> bool {
        if self.open_from(margin).is_ahead_of(near) {
            return true;
        }
        // Distances from the near end are compared, so the counter may wrap.
        let length = (far - near) + margin;
        // Most canopies lie behind the tool, and their end shows that.
        self.canopies.iter().any(|canopy| (canopy.to() - near) >= -margin && (canopy.from() - near) <= length)
    }

    /// The canopy or stem zone whose margin covers a position, from its beginning to its end; the nearest one if there are several.
    pub fn zone_at(&self, position: WrappedPosition, margin: Length) -> Option<(WrappedPosition, WrappedPosition)> {
        let zones = self.canopies.iter().map(|canopy| (canopy.from(), canopy.to()));
        let off = |&(begin, end): &(WrappedPosition, WrappedPosition)| {
            (begin - position).max(position - end).max(Length::ZERO)
        };
        zones.min_by_key(off).filter(|zone| off(zone) <= margin)
    }

    /// Zones at the tool or ahead of it.
    pub fn ahead(&self, tool: WrappedPosition, margin: Length) -> u8 {
        self.canopies.iter().map(|canopy| u8::from(!(tool - margin).is_ahead_of(canopy.to()))).sum()
    }
}

/// The paper's schedule of one canopy, from its leading edge.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub struct Plan {
    /// Y: the tool leaves the row (Eq. 1).
    pub delay: Ticks,
    /// Z: how long it stays out (Eq. 2).
    pub hold: Ticks,
}

impl Plan {
    /// The schedule of a canopy of `width`. Each value is within two units of the scale of its equation.
    pub fn new(geometry: &Geometry, width: Length) -> Self {
        let (scale, beam_to_tool, margin) = (geometry.scale, geometry.beam_to_tool(), geometry.margin());
        let delay = (beam_to_tool - margin).max(Length::ZERO);
        Self { delay: scale.ticks(delay), hold: scale.ticks(width + margin + margin) }
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

    /// Keep-out zones of these canopies, with the ground known from 0 on.
    fn with(canopies: &[(i16, i16)]) -> KeepOut {
        let mut keep_out = KeepOut::NONE;
        for &(leading, trailing) in canopies {
            keep_out.push(&canopy(leading, trailing), at(0), MARGIN).expect("there is room");
        }
        keep_out
    }

    fn at(position: i16) -> WrappedPosition {
        WrappedPosition::new(position)
    }

    fn canopy(leading: i16, trailing: i16) -> Canopy {
        Canopy { leading: at(leading), trailing: at(trailing), trim: Length::ZERO }
    }

    fn closed(keep_out: &KeepOut, from: i16, to: i16) -> bool {
        keep_out.is_closed(at(from), at(to), MARGIN)
    }

    #[test]
    fn a_zone_reaches_from_margin_to_margin_also_where_the_counter_wraps() {
        for base in [0, i16::MAX - 1100] {
            let at = |offset: i16| at(base.wrapping_add(offset));
            let mut keep_out = KeepOut::new(at(-1000));
            keep_out
                .push(&Canopy { leading: at(1000), trailing: at(1300), trim: Length::ZERO }, at(0), MARGIN)
                .unwrap();
            for (from, to, closed) in [
                (904, 904, false),
                (905, 905, true),
                (1150, 1150, true),
                (1395, 1395, true),
                (1396, 1396, false),
                (800, 905, true),
                (0, 5000, true),
                (0, 904, false),
            ] {
                assert_eq!(keep_out.is_closed(at(from), at(to), MARGIN), closed, "{from} to {to}");
            }
        }
    }

    #[test]
    fn a_single_plant_is_closed_in_its_stem_zone_and_margins() {
        let zone = Length(160);
        for (width, trim) in [(160, 0), (170, 5), (213, 26), (214, 27), (215, 27), (300, 27)] {
            assert_eq!(Canopy::of(&Detection::whole(1000, 1000 + width), zone, true).trim, Length(trim), "{width}");
        }
        let plant = Detection::whole(1000, 1300);
        for (zone, is_single) in [(Length::ZERO, true), (zone, false)] {
            assert_eq!(Canopy::of(&plant, zone, is_single), canopy(1000, 1300));
        }
        let mut keep_out = KeepOut::NONE;
        keep_out.push(&Canopy::of(&plant, zone, true), at(0), MARGIN).unwrap();
        assert!(!closed(&keep_out, 931, 931) && closed(&keep_out, 932, 932));
        assert!(closed(&keep_out, 1368, 1368) && !closed(&keep_out, 1369, 1369));
    }

    #[test]
    fn a_canopy_narrower_than_the_stem_zone_closes_the_whole_zone() {
        for (width, from, to) in [(0, 920, 1080), (60, 950, 1110), (99, 969, 1130), (159, 999, 1160), (160, 1000, 1160)]
        {
            for is_single in [true, false] {
                let plant = Canopy::of(&Detection::whole(1000, 1000 + width), Length(160), is_single);
                assert_eq!((plant.from(), plant.to()), (at(from), at(to)), "{width}");
                assert_eq!(plant.begin_unclassified(), at(from), "{width}");
            }
        }
    }

    #[test]
    fn the_second_beam_widens_a_narrow_canopy_by_what_the_first_has_missed() {
        let mut plant = Canopy::of(&Detection::whole(1000, 1060), Length(160), true);
        assert!(plant.widen(at(970), at(1060), Length(100), Length(100)));
        assert_eq!((plant.from(), plant.to()), (at(920), at(1110)));
    }

    #[test]
    fn unknown_ground_is_closed_with_a_margin_ahead_of_it() {
        let mut keep_out = with(&[(1000, 1300)]);
        for (from, to, expected) in [(-1, -1, true), (94, 94, true), (94, 100, true), (95, 100, false)] {
            assert_eq!(closed(&keep_out, from, to), expected, "{from} to {to}");
        }
        keep_out.invalidate(at(1310));
        for (position, expected) in [(0, true), (1310, true), (1404, true), (1405, false)] {
            assert_eq!(closed(&keep_out, position, position), expected, "{position}");
        }
        assert!(!keep_out.has_left(at(1000)), "invalid, not dropped");
    }

    #[test]
    fn a_full_schedule_forgets_only_ground_behind_the_tool() {
        let canopies: [_; CAPACITY] = core::array::from_fn(|plant| (1000 * plant as i16, 1000 * plant as i16 + 200));
        let mut keep_out = with(&canopies);
        assert_eq!(keep_out.push(&canopy(20_000, 20_200), at(295), MARGIN), Err(ScheduleFull));
        assert_eq!(keep_out.push(&canopy(20_000, 20_200), at(296), MARGIN), Ok(()));
        assert!(keep_out.has_left(at(199)) && !keep_out.has_left(at(200)));
        assert!(closed(&keep_out, 294, 294), "forgotten ground is unknown");
        assert!(!closed(&keep_out, 295, 295));
        assert!(keep_out.is_closed(at(299), at(299), Length(100)), "its margin is kept, even one that was set later");
        assert!(closed(&keep_out, 20_000, 20_000));
    }

    #[test]
    fn zones_ahead_are_counted_until_the_tool_has_passed_them() {
        let keep_out = with(&[(1000, 1300), (2000, 2300)]);
        for (tool, ahead) in [(0, 2), (1395, 2), (1396, 1), (2396, 0)] {
            assert_eq!(keep_out.ahead(at(tool), MARGIN), ahead, "{tool}");
        }
    }

    #[test]
    fn canopies_that_end_in_one_turn_make_room_for_as_many() {
        let mut keep_out = KeepOut::NONE;
        let mut plants = (0..).map(|plant| canopy(500 * plant, 500 * plant + 50));
        plants.by_ref().take(CAPACITY).for_each(|plant| keep_out.push(&plant, at(0), MARGIN).expect("there is room"));
        keep_out.leave(at(1200));
        for plant in plants.by_ref().take(3) {
            keep_out.push(&plant, at(1350), MARGIN).expect("three are behind");
            assert!(closed(&keep_out, 0, 1294) && !closed(&keep_out, 1295, 1404) && closed(&keep_out, 1405, 1405));
        }
        assert_eq!(keep_out.push(&plants.next().expect("more"), at(1350), MARGIN), Err(ScheduleFull));
    }

    #[test]
    fn far_ground_is_dropped_before_the_counter_wraps() {
        let mut keep_out = with(&[(1000, 1300)]);
        for step in 1..5000 {
            let tool = at(i16::wrapping_mul(step, 1 << 8));
            keep_out.leave(tool - Length(8000));
            assert!(step < 10 || !keep_out.is_closed(tool, tool, MARGIN), "{step}");
            assert_eq!(keep_out.ahead(tool, MARGIN), u8::from(step < 6));
            assert!(!keep_out.has_left(tool));
        }
        assert!(keep_out.has_left(at(i16::wrapping_mul(4999, 1 << 8)) - Length(8001)));
    }
}
