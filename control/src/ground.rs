//! The ground: what the beam has seen of it, and whether the tool may work there.
//!
//! [`detector`] turns beam edges into detections. [`class`] says plant or weed: [`nearest`] compares a detection's [`features`]
//! with built-in [`examples`] and with [those taught in the field](field_examples). [`keep_out`] remembers the canopies. [`guard`]
//! adds expected plants. [`reach`] calculates the lead that the servo needs.
//!
//! [`Ground`] owns all of them, so they are forgotten together. [`Ground::forget`] closes all ground seen so far, expects no more
//! plants, and marks an open detection as cut.
//!
//! Positions on the ground have 16 bits. [`Ground::roll_to`] drops old ground before that counter wraps.

pub mod class;
mod closed;
pub mod detection;
pub mod detector;
pub mod examples;
pub mod features;
pub mod field_examples;
pub mod guard;
pub mod keep_out;
pub mod nearest;
pub mod reach;
pub mod second_beam;
pub mod slip;
mod two_beams;
mod unclassified;

pub use self::{closed::AtTool, unclassified::Unclassified};
use self::{
    detection::Detection,
    detector::Detector,
    guard::Guard,
    keep_out::{Canopy, KeepOut, ScheduleFull},
    reach::{Geometry, Leads},
    second_beam::SecondBeam,
    unclassified::Known,
};
use crate::{
    settings::Settings,
    units::{Position, Speed, WrappedPosition},
};

/// The known ground around the machine.
#[derive(Clone, Debug)]
pub struct Ground {
    geometry: Geometry,
    leads: Leads,
    /// Whether the speed or a setting has changed since the leads were calculated.
    leads_are_old: bool,
    /// The beam's position.
    beam: WrappedPosition,
    detector: Detector,
    keep_out: KeepOut,
    guard: Guard,
    second_beam: SecondBeam,
    /// The slip that the distances use now, and the last slip that was trusted.
    corrected_by: (i8, i8),
    /// The last plant's leading edge, or where detection began. At most the memory length behind the frontier.
    last_plant: WrappedPosition,
    unclassified: Unclassified,
    /// Whether the tool has just reached ground that was dropped for its distance or for lack of room.
    rolled_back_too_far: bool,
}

impl Ground {
    /// Ground before [`begin`](Self::begin).
    pub const NONE: Self = Self {
        geometry: Geometry::NONE,
        leads: Leads::NONE,
        leads_are_old: false,
        beam: WrappedPosition::new(0),
        detector: Detector::NONE,
        keep_out: KeepOut::NONE,
        guard: Guard::NONE,
        second_beam: SecondBeam::NONE,
        corrected_by: (0, 0),
        last_plant: WrappedPosition::new(0),
        unclassified: Unclassified {
            detection: Detection::NONE,
            canopy: Canopy::NONE,
            of_second: false,
            known: Known::Nothing,
        },
        rolled_back_too_far: false,
    };

    /// Starts detection on unknown ground, with the distances of the last [`follow`](Self::follow). The beam is at `position`;
    /// `broken` is its level.
    pub fn begin(&mut self, position: Position, broken: bool) {
        let has_rolled_back = self.has_rolled_back();
        self.beam = self.geometry.scale.wrap(position);
        self.begin_here(broken);
        self.keep_out.mark_dropped(has_rolled_back);
    }

    /// Recalculates the distances after a change of settings. [`catch_up`](Self::catch_up) then recalculates the leads. A new scale
    /// makes all positions invalid, and a new stem zone all canopies, which are known with the old one. So the ground is then
    /// forgotten.
    pub fn follow(&mut self, settings: &Settings, position: Position) {
        let (scale, stem_zone) = (self.geometry.scale, self.geometry.stem_zone());
        let guard_spacing = self.geometry.guard_spacing();
        let is_doubtful = self.zones() > 0 || self.has_rolled_back();
        self.correct(settings);
        if self.geometry.guard_spacing() != guard_spacing {
            self.guard = Guard::NONE;
        }
        if self.geometry.scale != scale || self.geometry.stem_zone() != stem_zone {
            self.beam = self.geometry.scale.wrap(position);
            self.begin_here(self.detector.is_broken());
            self.keep_out.mark_dropped(is_doubtful);
        }
        self.outdate_leads();
    }

    /// The measured speed has changed, and so have the leads: [`catch_up`](Self::catch_up) recalculates them.
    #[inline(always)]
    pub const fn outdate_leads(&mut self) {
        self.leads_are_old = true;
    }

    /// Recalculates the distances with the measured slip, or the [leads](Leads::at) for these speeds: each takes a large part of a
    /// turn. Returns whether it did.
    #[inline(always)]
    pub fn catch_up(&mut self, settings: &Settings, speed: Speed, expected: Speed) -> bool {
        if self.needs_correction() {
            self.correct(settings);
        } else if core::mem::take(&mut self.leads_are_old) {
            self.leads = Leads::at(speed, expected, settings);
        } else {
            return false;
        }
        true
    }

    /// Takes a beam edge and its position. Returns the detection that was complete before this edge.
    pub fn edge(&mut self, position: Position, broken: bool) -> Option<Detection> {
        let wrapped = self.geometry.scale.wrap(position) - self.leads.response;
        self.detector.edge(wrapped, broken, self.geometry.merge_gap())
    }

    /// Moves the machine to a position. Returns the detection that this completes.
    #[cfg_attr(not(target_arch = "avr"), inline)]
    pub fn roll_to(&mut self, position: Position) -> Option<Detection> {
        let had_left = self.has_left();
        self.beam = self.geometry.scale.wrap(position);
        let memory = self.geometry.memory;
        // After rolling back this far, the beam sees the same ground again.
        let is_beyond_memory = self.detector.frontier() - self.beam > memory;
        if is_beyond_memory {
            self.begin_here(self.detector.is_broken());
            self.keep_out.mark_dropped(true);
        }
        let complete = self.detector.roll_to(self.beam - self.leads.response, self.geometry.merge_gap());
        // Counted from the frontier: the beam is at most the memory behind it. From the tool, the distance could exceed the range
        // of a position.
        let farthest = self.detector.frontier() - memory;
        self.keep_out.leave(farthest - self.geometry.beam_to_tool());
        if farthest.is_ahead_of(self.last_plant) {
            self.last_plant = farthest;
        }
        let has_left = self.has_left();
        self.rolled_back_too_far = is_beyond_memory || (!had_left && has_left);
        if had_left && !has_left {
            self.keep_out.mark_dropped(false);
        }
        complete
    }

    /// Whether the tool is on ground that was dropped.
    #[cfg_attr(target_arch = "avr", inline(never))]
    fn has_left(&self) -> bool {
        self.keep_out.has_left(self.tool())
    }

    /// Forgets everything seen so far. The tool stays out of that ground.
    #[cfg_attr(target_arch = "avr", inline(never))]
    pub fn forget(&mut self) {
        self.detector.forget();
        if self.unclassified.known == Known::Canopy {
            self.unclassified.known = Known::Detection;
        }
        self.guard = Guard::NONE;
        self.distrust_slip();
        let has_left = self.has_left();
        self.keep_out.invalidate(self.detector.frontier() + self.geometry.beyond_canopy());
        self.keep_out.mark_dropped(has_left);
    }

    /// As [`forget`](Self::forget), without an alarm. The operator has not noticed it, and cannot vouch for that ground.
    pub fn doubt(&mut self) {
        self.forget();
        self.keep_out.mark_dropped(true);
    }

    /// Edges of the beams were lost, so this ground is unknown. The beams' levels are now `broken` and `second_broken`.
    pub fn lose_edges(&mut self, broken: bool, second_broken: bool) {
        self.detector.lose_edges(broken);
        self.forget();
        self.begin_second(second_broken);
    }

    /// Forgets everything, and starts detection at the beam's position. `broken` is its level.
    #[cfg_attr(target_arch = "avr", inline(never))]
    fn begin_here(&mut self, broken: bool) {
        self.detector.begin(self.beam, broken);
        self.last_plant = self.beam;
        self.forget();
        self.unclassified.known = Known::Nothing;
    }

    /// Guards the ground of an expected plant once the beam has passed it and seen none. Returns the middle of that ground.
    ///
    /// # Errors
    /// [`ScheduleFull`], as for a plant.
    #[cfg_attr(target_arch = "avr", inline(never))]
    #[cfg_attr(not(target_arch = "avr"), inline)]
    pub fn guard_missed_plant(&mut self) -> Option<Result<WrappedPosition, ScheduleFull>> {
        // A detection in the beam, or one that is being classified, may be the expected plant.
        let seen_to = self.open().unwrap_or(self.detector.frontier());
        let guarded = self.guard.pass(seen_to, &self.geometry)?;
        let pushed = self.keep_out.push(&guarded, self.tool(), self.geometry.margin());
        Some(pushed.map(|()| guarded.leading + self.geometry.guarded))
    }

    /// The distances from the settings, for the present wheel and slip.
    pub fn geometry(&self) -> &Geometry {
        &self.geometry
    }

    /// The odometer's position at a wrapped position, if `position` is the beam's.
    pub fn position_of(&self, wrapped: WrappedPosition, position: Position) -> Position {
        position + self.geometry.scale.ticks(wrapped - self.beam)
    }

    /// Whether the beam has been broken for longer than the widest canopy.
    #[cfg_attr(not(target_arch = "avr"), inline)]
    pub fn is_blocked(&self) -> bool {
        let too_wide = |leading| self.detector.frontier() - leading > self.geometry.max_width();
        self.detector.is_broken() && self.detector.open().is_some_and(too_wide)
    }

    /// Whether the tool has just reached dropped ground.
    #[cfg_attr(not(target_arch = "avr"), inline)]
    pub fn rolled_back_too_far(&self) -> bool {
        self.rolled_back_too_far
    }

    /// The tool's position.
    fn tool(&self) -> WrappedPosition {
        self.beam - self.geometry.beam_to_tool()
    }
}

#[cfg(test)]
mod tests {
    use super::class::Class;
    use super::*;
    use crate::{settings::Setting, units::Length};

    const SPEED: Speed = Speed(1000);

    /// Classifies a detection as a plant.
    pub(super) fn keep(ground: &mut Ground, canopy: Detection) {
        ground.await_class(canopy, false);
        ground.classified(Class::Plant).expect("there is room");
    }

    /// Rolls past a canopy and the gap behind it.
    pub(super) fn pass(ground: &mut Ground, leading: i32, trailing: i32) -> Detection {
        ground.edge(Position::new(leading), true);
        ground.edge(Position::new(trailing), false);
        ground.roll_to(Position::new(trailing + 100)).expect("the gap has been seen")
    }

    /// Ground seen from 0 to 1400, with a canopy from 1000 to 1300, without leads.
    pub(super) fn ground() -> (Ground, Settings) {
        let leads = [Setting::LeadOutMs, Setting::LeadInMs, Setting::BeamResponseMs];
        let settings = Settings::with(&leads.map(|lead| (lead, 0)));
        let mut ground = Ground::NONE;
        ground.follow(&settings, Position::new(0));
        ground.begin(Position::new(0), false);
        assert!(ground.catch_up(&settings, SPEED, SPEED));
        let canopy = pass(&mut ground, 1000, 1300);
        assert_eq!((ground.spacing(&canopy), canopy.width()), (Length(1000), Length(300)));
        keep(&mut ground, canopy);
        (ground, settings)
    }

    #[test]
    fn ground_is_seen_again_as_new_after_rolling_back_farther_than_the_memory() {
        let (mut ground, _) = ground();
        for position in (-40_000..1400).rev().step_by(100) {
            assert_eq!(ground.roll_to(Position::new(position)), None);
            assert!(ground.is_closed_at_tool() || position > -400, "{position}");
        }
        let mut seen = 0;
        for position in -40_000..2000 {
            if position == 1000 || position == 1300 {
                ground.edge(Position::new(position), position == 1000);
            }
            seen += u8::from(ground.roll_to(Position::new(position)).is_some());
        }
        assert_eq!(seen, 1);
    }

    #[test]
    fn the_spacing_counts_from_where_detection_began_again() {
        for begin in [500, 2500, 4000] {
            let (mut ground, _) = ground();
            ground.roll_to(Position::new(3000));
            ground.begin(Position::new(begin), false);
            let canopy = pass(&mut ground, begin + 400, begin + 700);
            assert_eq!(ground.spacing(&canopy), Length(400), "{begin}");
        }
    }

    #[test]
    fn a_wheel_of_another_length_scale_forgets_and_closes_the_ground() {
        let (mut ground, mut settings) = ground();
        settings.set(Setting::TicksPerM, 15_000).expect("within its range");
        ground.follow(&settings, Position::new(1400));
        assert_eq!((ground.zones(), ground.is_unseen()), (0, true));
        let (beam_to_tool, margin) = (6000, 750);
        let scale = ground.geometry.scale.ticks(Length(1)).0;
        assert_eq!(scale, 8);
        let open_from = (1400 + beam_to_tool + margin..20_000).find(|&position| {
            ground.roll_to(Position::new(position));
            !ground.is_closed_at_tool()
        });
        assert!(
            open_from.is_some_and(|position| position - 1400 - beam_to_tool - margin <= 3 * scale),
            "{open_from:?}"
        );
    }

    #[test]
    fn an_edge_position_allows_for_the_beam_response_time() {
        let (mut ground, mut settings) = ground();
        settings.set(Setting::BeamResponseMs, 10).expect("within its range");
        ground.outdate_leads();
        assert!(ground.catch_up(&settings, SPEED, SPEED));
        ground.edge(Position::new(2000), true);
        ground.edge(Position::new(2300), false);
        assert!(!ground.is_unseen());
        let merge_gap = 40;
        assert_eq!(ground.roll_to(Position::new(2300 + merge_gap - 1)), None);
        let here = Position::new(2300 + merge_gap);
        let canopy = ground.roll_to(here).expect("the gap has been seen");
        assert_eq!(ground.position_of(canopy.leading, here), Position::new(1990));
        assert_eq!(ground.position_of(canopy.trailing, here), Position::new(2290));
    }

    #[test]
    fn a_beam_is_blocked_that_is_broken_over_more_than_the_widest_canopy() {
        let (mut ground, _) = ground();
        let max_width = i32::from(ground.geometry.max_width().0);
        ground.edge(Position::new(1500), true);
        ground.roll_to(Position::new(1500 + max_width));
        assert!(!ground.is_blocked());
        ground.roll_to(Position::new(1500 + max_width + 1));
        assert!(ground.is_blocked());
        ground.edge(Position::new(1500 + max_width + 2), false);
        assert!(!ground.is_blocked());
    }

    #[test]
    fn the_end_of_remembered_ground_is_reported_once() {
        let (mut ground, _) = ground();
        let [memory, margin] = [ground.geometry.memory, ground.geometry.margin()].map(|length| i32::from(length.0));
        for position in (1400..=40_000).step_by(100) {
            ground.roll_to(Position::new(position));
            assert!(!ground.rolled_back_too_far());
        }
        for back in 0..=memory {
            ground.roll_to(Position::new(40_000 - back));
            assert!(!ground.rolled_back_too_far(), "{back}");
            assert_eq!(ground.is_unseen(), back >= memory - margin, "{back}");
        }
        ground.roll_to(Position::new(40_000 - memory - 1));
        assert!(ground.rolled_back_too_far());
        ground.roll_to(Position::new(40_000 - memory - 2));
        assert!(!ground.rolled_back_too_far());
    }

    #[test]
    fn rolling_back_to_dropped_ground_is_reported_once() {
        let mut ground = Ground::NONE;
        ground.follow(&Settings::new(), Position::new(0));
        ground.begin(Position::new(0), false);
        let plants = 20;
        for leading in (0..plants).map(|plant| 1000 + 400 * plant) {
            let canopy = pass(&mut ground, leading, leading + 100);
            keep(&mut ground, canopy);
        }
        let end = 1000 + 400 * plants;
        let told = (0..end).rev().filter(|&position| {
            ground.roll_to(Position::new(position));
            ground.rolled_back_too_far()
        });
        assert_eq!(told.count(), 1);
    }

    #[test]
    fn plants_that_were_forgotten_without_an_alarm_are_no_bare_ground() {
        let scale = (Setting::TicksPerM, 2402);
        for change in [None, Some(scale), Some((Setting::StemZoneMm, 100))] {
            for is_known in [true, false] {
                let (mut ground, mut settings) = ground();
                settings.set(Setting::TicksPerM, 2399).expect("within its range");
                ground.follow(&settings, Position::new(1400));
                ground.begin(Position::new(1400), false);
                if is_known {
                    let canopy = pass(&mut ground, 2000, 2300);
                    keep(&mut ground, canopy);
                }
                ground.roll_to(Position::new(2500));
                match change {
                    None => ground.doubt(),
                    Some((setting, value)) => {
                        settings.set(setting, value).expect("within its range");
                        ground.follow(&settings, Position::new(2500));
                    }
                }
                assert_eq!(ground.zones(), 0, "{change:?}");
                assert_eq!(ground.has_rolled_back(), is_known || change.is_none(), "{change:?}");
                // The tool has passed that ground.
                ground.roll_to(Position::new(4000));
                assert!(!ground.has_rolled_back(), "{change:?}");
            }
        }
    }

    #[test]
    fn only_a_changed_spacing_cancels_the_expected_plant() {
        for (setting, value, is_due) in [(Setting::MarginMm, 60, true), (Setting::GuardSpacingMm, 510, false)] {
            let (mut ground, mut settings) = ground();
            settings.set(Setting::GuardSpacingMm, 500).expect("within its range");
            ground.follow(&settings, Position::new(1400));
            let canopy = pass(&mut ground, 2000, 2300);
            keep(&mut ground, canopy);
            settings.set(setting, value).expect("within its range");
            ground.follow(&settings, Position::new(2400));
            assert_eq!(ground.roll_to(Position::new(3300)), None);
            assert_eq!(ground.guard_missed_plant().is_some(), is_due, "{setting:?}");
        }
    }
}
