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

use self::{
    class::Class,
    detection::Detection,
    detector::Detector,
    guard::Guard,
    keep_out::{Canopy, KeepOut, Plan, ScheduleFull},
    reach::{Geometry, Leads},
    second_beam::{Blind, SecondBeam},
    slip::SlipChange,
};
use crate::{
    settings::Settings,
    units::{Length, Position, Speed, Ticks, Wheel, WrappedPosition},
};

/// The known ground around the machine.
#[derive(Clone, Debug)]
pub struct Ground {
    geometry: Geometry,
    leads: Leads,
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

/// Why the tool may or may not work at its position. Only experiments read the reason; the machine needs yes or no.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub enum AtTool {
    /// No keep-out zone is here.
    Open,
    /// The ground is unknown.
    Unknown,
    /// The tool is in a keep-out zone or its margin.
    Kept {
        /// The odometer's position when the beam was where the tool is now.
        tool: Position,
        /// Where the zone begins, without its margin.
        begin: Position,
        /// Where the zone ends, without its margin.
        end: Position,
    },
}

/// The complete detection that is being classified, if any.
#[derive(Clone, Copy, Debug)]
pub struct Unclassified {
    /// The detection.
    pub detection: Detection,
    /// What both beams have seen of it so far.
    canopy: Canopy,
    /// Whether the second beam reports it. The first beam may have reported it already.
    pub of_second: bool,
    known: Known,
}

/// What is known of a detection without a class. `Nothing` is 0, so [`Ground::NONE`] is all zeros and needs no copy in flash.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
enum Known {
    /// There is no detection.
    Nothing,
    /// Its ground is forgotten.
    Detection,
    /// Its ground is known.
    Canopy,
}

impl Ground {
    /// Ground before [`begin`](Self::begin).
    pub const NONE: Self = Self {
        geometry: Geometry::NONE,
        leads: Leads::NONE,
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
        self.beam = self.geometry.scale.wrap(position);
        self.begin_here(broken);
    }

    /// Recalculates the distances after a change of settings. The caller then calls [`lead`](Self::lead). A new scale makes all
    /// positions invalid, so the ground is then forgotten.
    pub fn follow(&mut self, settings: &Settings, position: Position) {
        let scale = self.geometry.scale;
        let guard_spacing = self.geometry.guard_spacing();
        self.correct(settings);
        if self.geometry.guard_spacing() != guard_spacing {
            self.guard = Guard::NONE;
        }
        if self.geometry.scale != scale {
            self.beam = self.geometry.scale.wrap(position);
            self.begin_here(self.detector.is_broken());
        }
    }

    /// Whether the measured slip differs from the slip that the distances use.
    #[cfg_attr(not(target_arch = "avr"), inline)]
    pub fn needs_correction(&self) -> bool {
        self.corrected_by != self.second_beam.slip().present_and_last()
    }

    /// Recalculates the distances with the measured slip.
    pub fn correct(&mut self, settings: &Settings) {
        self.corrected_by = self.second_beam.slip().present_and_last();
        let (excess, last) = self.corrected_by;
        self.geometry.follow(settings, excess);
        // A slip that is no longer trusted may still be right. The margin grows so that the zones hold for both values.
        if self.has_second_beam() {
            let doubted = u32::from(self.geometry.beam_to_tool().0 as u16) * u32::from(excess.abs_diff(last));
            self.geometry.widen_margin(Length((doubted >> 8) as i16));
        }
    }

    /// No longer trusts the second beam's measurements: the wheel or the beams' distance may have changed. The second beam ignores
    /// earlier detections of the first. Its level stays, because only its edges are reported, and none may come.
    pub fn distrust_slip(&mut self) {
        self.begin_second(self.second_is_broken());
    }

    /// The second beam starts with a level, where the first beam is.
    #[cfg_attr(target_arch = "avr", inline(never))]
    fn begin_second(&mut self, broken: bool) {
        // A beam that is not there any more would stay broken.
        self.second_beam.begin(self.detector.frontier(), broken && self.has_second_beam());
    }

    /// Recalculates the leads for another speed, see [`Leads::at`].
    pub fn lead(&mut self, settings: &Settings, speed: Speed, expected: Speed) {
        self.leads = Leads::at(speed, expected, settings);
    }

    /// Takes a beam edge and its position. Returns the detection that was complete before this edge.
    pub fn edge(&mut self, position: Position, broken: bool) -> Option<Detection> {
        let wrapped = self.geometry.scale.wrap(position) - self.leads.response;
        self.detector.edge(wrapped, broken, self.geometry.merge_gap())
    }

    /// Takes the second beam's level at a position of the machine. Returns its detection, unless a known canopy explains it.
    pub fn match_second_beam(&mut self, position: Position, broken: bool) -> Option<Detection> {
        let (scale, apart, merge_gap) = (self.geometry.scale, self.geometry.second_beam(), self.geometry.merge_gap());
        let least = self.geometry.least_seen();
        let wrapped = scale.wrap(position) - self.leads.response - apart;
        if broken != self.second_beam.is_broken() {
            self.widen(wrapped, wrapped);
        }
        let mut detection = self.second_beam.take_level(wrapped, broken, apart, merge_gap, least)?;
        // A detection behind the last plant has no spacing, so it cannot be classified.
        detection.cut |= !detection.leading.is_ahead_of(self.last_plant);
        if self.widen(detection.leading, detection.trailing) {
            return None;
        }
        // Only one beam saw this, so it is not certain to be a single plant.
        self.detector.doubt();
        Some(detection)
    }

    /// The beam that is blind, if any.
    #[cfg_attr(not(target_arch = "avr"), inline)]
    pub fn blind(&self) -> Option<Blind> {
        self.second_beam.blind()
    }

    /// Announces a detection of the first beam to the second.
    pub fn await_detection(&mut self, detection: Detection) {
        self.second_beam.await_detection(detection, self.geometry.least_seen());
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
        }
        let complete = self.detector.roll_to(self.beam - self.leads.response, self.geometry.merge_gap());
        // Counted from the frontier: the beam is at most the memory behind it. From the tool, the distance could exceed the range
        // of a position.
        let farthest = self.detector.frontier() - memory;
        self.keep_out.leave(farthest - self.geometry.beam_to_tool());
        if farthest.is_ahead_of(self.last_plant) {
            self.last_plant = farthest;
        }
        self.rolled_back_too_far = is_beyond_memory || (!had_left && self.has_left());
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
        self.keep_out.invalidate(self.detector.frontier());
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

    /// The operator confirms that no plant stands on the unknown ground at the tool and ahead of it. Does nothing on known ground,
    /// as [`unseen`](Self::unseen) tells it.
    pub fn assume_bare(&mut self) {
        if self.unseen_beyond(Length::ZERO) > Length::ZERO {
            // Unknown ground has a margin ahead of it. The second margin keeps the tool off its border.
            self.keep_out.set_known_from(self.tool() - self.geometry.margin() - self.geometry.margin());
        }
    }

    /// Closes the ground from the start of a detection until it is classified.
    pub fn await_class(&mut self, detection: Detection, of_second: bool) {
        let zone = if self.detector.take_parted() { Length::ZERO } else { self.geometry.stem_zone() };
        self.unclassified =
            Unclassified { detection, canopy: Canopy::of(&detection, zone), of_second, known: Known::Canopy };
        // A wide detection reaches the second beam before the first has seen its end.
        if let Some(begin) = self.second_beam.open() {
            self.widen(begin, begin);
        }
    }

    /// The detection that is being classified.
    #[cfg_attr(not(target_arch = "avr"), inline)]
    pub fn unclassified(&self) -> Option<&Unclassified> {
        Some(&self.unclassified).filter(|unclassified| unclassified.known != Known::Nothing)
    }

    /// Takes the class of that detection, and remembers a plant or an unknown.
    ///
    /// # Errors
    /// [`ScheduleFull`] if more canopies stand between beam and tool than can be remembered.
    pub fn classified(&mut self, class: Class) -> Result<(), ScheduleFull> {
        let Unclassified { detection, canopy, known, .. } = &mut self.unclassified;
        let was_known = core::mem::replace(known, Known::Nothing);
        if class == Class::Weed || was_known == Known::Nothing {
            return Ok(());
        }
        if detection.leading.is_ahead_of(self.last_plant) {
            self.last_plant = detection.leading;
        }
        if was_known != Known::Canopy {
            return Ok(());
        }
        // An unknown detection may be several plants: it keeps its full width.
        if class != Class::Plant {
            canopy.trim = 0;
        }
        self.guard.see(detection, &self.geometry);
        self.keep_out.push(&self.unclassified.canopy, self.tool(), self.geometry.margin())
    }

    /// Widens a canopy to the stretch that the second beam sees. Returns whether a canopy is there.
    fn widen(&mut self, from: WrappedPosition, to: WrappedPosition) -> bool {
        let within = Length(self.geometry.second_beam().0 >> 2);
        if self.unclassified.known == Known::Canopy {
            self.unclassified.canopy.widen(from, to, within, within);
        }
        self.keep_out.widen(from, to, within)
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

    /// From the last plant's leading edge, or from where detection began, to the detection's. At most the memory length.
    pub fn spacing(&self, detection: &Detection) -> Length {
        detection.leading - self.last_plant
    }

    /// The paper's schedule for a detection.
    pub fn plan(&self, detection: &Detection) -> Plan {
        Plan::new(&self.geometry, detection.width())
    }

    /// The ground wheel from the settings.
    pub fn wheel(&self) -> Wheel {
        self.geometry.wheel
    }

    /// A length in millimetres.
    pub fn millimetres(&self, length: Length) -> i16 {
        self.geometry.millimetres(length)
    }

    /// Ticks in a unit of remembered ground.
    pub fn scale(&self) -> crate::units::LengthScale {
        self.geometry.scale
    }

    /// A position of the machine on remembered ground.
    pub fn wrap(&self, position: Position) -> WrappedPosition {
        self.geometry.scale.wrap(position)
    }

    /// A length in ticks.
    pub fn ticks(&self, length: Length) -> Ticks {
        self.geometry.scale.ticks(length)
    }

    /// The odometer's position at a wrapped position, if `position` is the beam's.
    pub fn position_of(&self, wrapped: WrappedPosition, position: Position) -> Position {
        position + self.ticks(wrapped - self.beam)
    }

    /// Whether there is a second beam.
    #[cfg_attr(not(target_arch = "avr"), inline)]
    pub fn has_second_beam(&self) -> bool {
        self.geometry.second_beam() > Length::ZERO
    }

    /// The second beam's last known level.
    #[cfg_attr(not(target_arch = "avr"), inline)]
    pub fn second_is_broken(&self) -> bool {
        self.second_beam.is_broken()
    }

    /// What has changed about the slip since the last call.
    pub fn take_slip_change(&mut self) -> SlipChange {
        self.second_beam.take_slip_change()
    }

    /// The wheel's slip in thousandths; `None` if it is unknown.
    pub fn slip_permille(&self) -> Option<i16> {
        self.second_beam.slip().permille()
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

    /// Whether unseen ground, or the margin ahead of it, keeps the tool out. It may lie behind a tool that rolls back.
    pub fn is_unseen(&self) -> bool {
        let (from, to) = self.leads.stretch(true);
        self.unseen_beyond(from.min(to)) > Length::ZERO
    }

    /// The distance until the tool has left unseen ground and its margin; 0 if it has.
    pub fn unseen(&self) -> Length {
        self.unseen_beyond(Length::ZERO).max(Length::ZERO)
    }

    /// How far unseen ground and its margin reach ahead of a place at this distance from the tool.
    fn unseen_beyond(&self, distance: Length) -> Length {
        self.keep_out.open_from(self.geometry.margin()) - (self.tool() + distance)
    }

    /// The number of keep-out zones at the tool or ahead of it, with an open detection and an unclassified one.
    pub fn zones(&self) -> u8 {
        let unclassified = self.unclassified.known == Known::Canopy;
        self.keep_out.ahead(self.tool(), self.geometry.margin())
            + u8::from(unclassified)
            + u8::from(self.detector.open().is_some())
    }

    /// Whether the tool must be out: closed ground comes within the leads, or the machine is too fast.
    #[cfg_attr(not(target_arch = "avr"), inline)]
    pub fn must_be_out(&self, tool_out: bool) -> bool {
        let (from, to) = self.leads.stretch(tool_out);
        self.is_closed(from, to) || self.outruns_the_beam(tool_out)
    }

    /// Whether the tool is at closed ground.
    #[cfg_attr(not(target_arch = "avr"), inline)]
    pub fn is_closed_at_tool(&self) -> bool {
        self.is_closed(Length::ZERO, Length::ZERO)
    }

    /// Why the tool is in or out at its position, if the odometer shows `position`.
    pub fn at_tool(&self, position: Position) -> AtTool {
        let of = |wrapped| self.position_of(wrapped, position);
        match self.keep_out.zone_at(self.tool(), self.geometry.margin()) {
            Some((begin, end)) => AtTool::Kept { tool: of(self.tool()), begin: of(begin), end: of(end) },
            None if self.is_closed_at_tool() => AtTool::Unknown,
            None => AtTool::Open,
        }
    }

    /// Whether the machine is so fast that a plant just behind the beam reaches the tool before the tool is out. With a second
    /// beam, a plant that only that beam sees must not reach it either, but may reach its margin.
    #[cfg_attr(not(target_arch = "avr"), inline)]
    pub fn outruns_the_beam(&self, tool_out: bool) -> bool {
        let out = self.leads.out;
        // Hysteresis: the machine has to slow down by an eighth.
        let lead = if tool_out { out + Length(out.0 / 8) } else { out };
        (self.tool() + lead) - self.detector.frontier() >= -self.geometry.margin().max(self.geometry.second_beam())
    }

    /// Whether any ground between two distances from the tool is closed: unknown, or within the margin of a canopy. An open
    /// detection, an unclassified one and an expected plant count as canopies.
    #[cfg_attr(not(target_arch = "avr"), inline)]
    fn is_closed(&self, one: Length, other: Length) -> bool {
        let margin = self.geometry.margin();
        let (near, far) = (self.tool() + one.min(other), self.tool() + one.max(other));
        let reaches = |leading| far - leading >= -margin;
        self.keep_out.is_closed(near, far, margin)
            || self.open().is_some_and(reaches)
            || self.guard.awaited(self.detector.frontier(), &self.geometry).is_some_and(reaches)
            || self.second_beam.open_alone().is_some_and(reaches)
    }

    /// Where the first detection begins that has no end yet, or no class.
    #[cfg_attr(not(target_arch = "avr"), inline)]
    fn open(&self) -> Option<WrappedPosition> {
        let Unclassified { canopy, known, .. } = &self.unclassified;
        if *known == Known::Canopy { Some(canopy.leading) } else { self.detector.open() }
    }

    /// The tool's position.
    fn tool(&self) -> WrappedPosition {
        self.beam - self.geometry.beam_to_tool()
    }
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::settings::Setting;

    const SPEED: Speed = Speed(1000);

    /// Classifies a detection as a plant.
    fn keep(ground: &mut Ground, canopy: Detection) {
        ground.await_class(canopy, false);
        ground.classified(Class::Plant).expect("there is room");
    }

    /// Rolls past a canopy and the gap behind it.
    fn pass(ground: &mut Ground, leading: i32, trailing: i32) -> Detection {
        ground.edge(Position::new(leading), true);
        ground.edge(Position::new(trailing), false);
        ground.roll_to(Position::new(trailing + 100)).expect("the gap has been seen")
    }

    /// Ground seen from 0 to 1400, with a canopy from 1000 to 1300, without leads.
    fn ground() -> (Ground, Settings) {
        let leads = [Setting::LeadOutMs, Setting::LeadInMs, Setting::BeamResponseMs];
        let settings = Settings::with(&leads.map(|lead| (lead, 0)));
        let mut ground = Ground::NONE;
        ground.follow(&settings, Position::new(0));
        ground.begin(Position::new(0), false);
        ground.lead(&settings, SPEED, SPEED);
        let canopy = pass(&mut ground, 1000, 1300);
        assert_eq!((ground.spacing(&canopy), canopy.width()), (Length(1000), Length(300)));
        keep(&mut ground, canopy);
        (ground, settings)
    }

    /// The first tool position from `from` on where the ground is open.
    fn opens(ground: &mut Ground, from: i32) -> i32 {
        let beam_to_tool = i32::from(ground.geometry.beam_to_tool().0);
        (from..from + 5000)
            .find(|&tool| {
                ground.roll_to(Position::new(tool + beam_to_tool));
                !ground.is_closed_at_tool()
            })
            .expect("somewhere the ground is open")
    }

    #[test]
    fn forgotten_ground_is_closed_up_to_a_margin_ahead_of_the_frontier() {
        let margin = 95;
        let (mut known, _) = ground();
        assert_eq!(opens(&mut known, 1000), 1300 + margin + 1);
        for frontier in 1400..1420 {
            let (mut forgetful, _) = ground();
            forgetful.roll_to(Position::new(frontier));
            forgetful.forget();
            assert_eq!(forgetful.zones(), 0, "no plant is known any more");
            assert_eq!(opens(&mut forgetful, 1000), frontier + margin);
        }
    }

    #[test]
    fn a_tool_that_rolls_back_to_forgotten_ground_keeps_its_margin_whatever_the_operator_vouches_for() {
        let (margin, beam_to_tool) = (95, 764);
        for ahead in [0, 1, 40, 100] {
            let (mut ground, _) = ground();
            ground.roll_to(Position::new(1400));
            ground.forget();
            ground.roll_to(Position::new(1400 + margin + ahead + beam_to_tool));
            ground.lead(&Settings::new(), Speed(-1000), Speed(-1000));
            assert_eq!((ground.is_unseen(), ground.unseen()), (true, Length::ZERO), "it lies behind the tool");
            ground.assume_bare();
            ground.roll_to(Position::new(1400 + margin - 1 + beam_to_tool));
            assert!(ground.is_closed_at_tool());
            assert_eq!(ground.unseen(), Length(1));
            ground.assume_bare();
            assert!(!ground.is_closed_at_tool(), "the operator vouches for what status shows");
        }
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
    fn a_wheel_of_another_length_scale_forgets_and_closes_the_ground() {
        let (mut ground, mut settings) = ground();
        settings.set(Setting::TicksPerM, 15_000).expect("within its range");
        ground.follow(&settings, Position::new(1400));
        assert_eq!((ground.zones(), ground.is_unseen()), (0, true));
        let (beam_to_tool, margin) = (6000, 750);
        let scale = ground.ticks(Length(1)).0;
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
    fn an_edge_lies_where_the_ground_was_when_the_beam_s_sensor_began_to_answer() {
        let (mut ground, mut settings) = ground();
        settings.set(Setting::BeamResponseMs, 10).expect("within its range");
        ground.lead(&settings, SPEED, SPEED);
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
    fn a_plant_stays_expected_after_every_setting_except_another_spacing() {
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

    #[test]
    fn the_beam_is_outrun_if_the_lead_reaches_the_margin_of_unseen_ground() {
        let (mut ground, _) = ground();
        let reach = ground.geometry.beam_to_tool() - ground.geometry.margin();
        let outruns = |ground: &mut Ground, out, tool_out| {
            ground.leads = Leads { out, ..Leads::NONE };
            ground.outruns_the_beam(tool_out)
        };
        assert!(!outruns(&mut ground, reach - Length(1), false));
        assert!(outruns(&mut ground, reach, false));
        let trusted = (0..reach.0).rfind(|&out| !outruns(&mut ground, Length(out), true));
        assert_eq!(trusted.map(|out| out + out / 8), Some(reach.0 - 1), "an eighth slower");
    }

    #[test]
    fn the_spacing_is_at_most_the_remembered_length() {
        let (mut ground, _) = ground();
        for position in (1400..200_000).step_by(50) {
            ground.roll_to(Position::new(position));
        }
        let canopy = pass(&mut ground, 200_000, 200_300);
        assert!((14_800..15_280).contains(&ground.spacing(&canopy).0), "{:?}", ground.spacing(&canopy));
    }
}
