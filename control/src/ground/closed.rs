//! Closed ground: where the tool must be out.
//!
//! Ground is closed if no beam has seen it, or within the margin of a canopy. A detection without an end or a class and an
//! expected plant count as canopies. A detection without an end has the stem zone that it would have if it ended here. The tool must
//! be out while closed ground lies within the leads. It must also be out while the machine is so fast that a plant just behind the
//! beam would reach it first.

use super::{Ground, unclassified::Known};
use crate::units::{Length, Position, WrappedPosition};

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

impl Ground {
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

    /// Whether the machine is so fast that a plant just behind the beam reaches the tool before the tool is out. With a second
    /// beam, a plant that only that beam sees must not reach it either, but its zone may.
    #[cfg_attr(not(target_arch = "avr"), inline)]
    pub fn outruns_the_beam(&self, tool_out: bool) -> bool {
        let out = self.leads.out;
        // Hysteresis: the machine has to slow down by an eighth.
        let lead = if tool_out { out + Length(out.0 / 8) } else { out };
        let zone = self.geometry.margin() + self.geometry.beyond_canopy();
        (self.tool() + lead) - self.detector.frontier() >= -zone.max(self.geometry.second_beam())
    }

    /// Whether any ground between two distances from the tool is closed: unknown, or within the margin of a canopy. An open
    /// detection, an unclassified one and an expected plant count as canopies.
    #[cfg_attr(not(target_arch = "avr"), inline)]
    fn is_closed(&self, one: Length, other: Length) -> bool {
        let margin = self.geometry.margin();
        let (near, far) = (self.tool() + one.min(other), self.tool() + one.max(other));
        let reaches = |leading| far - leading >= -margin;
        self.keep_out.is_closed(near, far, margin)
            // Both: a detection of the second beam lies ahead of a wide one that is open in the first.
            || self.unclassified.known == Known::Canopy && reaches(self.unclassified.canopy.begin_unclassified())
            || self.detector.open().is_some_and(|leading| reaches(self.zone_of_open(leading)))
            || self.guard.awaited(self.detector.frontier(), &self.geometry).is_some_and(reaches)
            || self.second_beam.open_alone().is_some_and(reaches)
    }

    /// Where the zone of the open detection begins: at its leading edge, or ahead of it while it is narrower than the stem zone.
    #[cfg_attr(not(target_arch = "avr"), inline)]
    fn zone_of_open(&self, leading: WrappedPosition) -> WrappedPosition {
        let wider = self.geometry.stem_zone() - (self.detector.open_to() - leading);
        leading - Length(wider.max(Length::ZERO).0 / 2)
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

    /// Whether the beam has rolled back by more than the margin, so that it sees no edge up to the frontier; or the tool is on dropped
    /// ground.
    pub fn has_rolled_back(&self) -> bool {
        self.detector.frontier() - self.beam > self.geometry.margin() || self.has_left()
    }

    /// The operator confirms that no plant stands on the unknown ground at the tool and ahead of it. Does nothing on known ground,
    /// as [`unseen`](Self::unseen) tells it.
    pub fn assume_bare(&mut self) {
        if self.unseen_beyond(Length::ZERO) > Length::ZERO {
            // Unknown ground has a margin ahead of it. The second margin keeps the tool off its border.
            self.keep_out.set_known_from(self.tool() - self.geometry.margin() - self.geometry.margin());
        }
    }

    /// The number of keep-out zones at the tool or ahead of it, with an open detection and an unclassified one.
    pub fn zones(&self) -> u8 {
        let unclassified = self.unclassified.known == Known::Canopy;
        self.keep_out.ahead(self.tool(), self.geometry.margin())
            + u8::from(unclassified)
            + u8::from(self.detector.open().is_some())
    }
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::ground::reach::Leads;
    use crate::ground::tests::ground;
    use crate::settings::Settings;
    use crate::units::Speed;

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
    fn rolling_back_to_forgotten_ground_keeps_the_margin_closed() {
        let (margin, beam_to_tool) = (95, 764);
        for ahead in [0, 1, 40, 100] {
            let (mut ground, _) = ground();
            ground.roll_to(Position::new(1400));
            ground.forget();
            ground.roll_to(Position::new(1400 + margin + ahead + beam_to_tool));
            ground.outdate_leads();
            assert!(ground.catch_up(&Settings::new(), Speed(-1000), Speed(-1000)));
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
}
