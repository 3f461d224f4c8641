//! The second beam's part of the [`Ground`]: it corrects the distances by the slip, and the canopies by what it sees of them.

use super::{Ground, detection::Detection, second_beam::Blind, slip::SlipChange, unclassified::Known};
use crate::{
    settings::Settings,
    units::{Length, Position, WrappedPosition},
};

impl Ground {
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

    /// Whether the measured slip differs from the slip that the distances use.
    #[cfg_attr(not(target_arch = "avr"), inline)]
    pub(super) fn needs_correction(&self) -> bool {
        self.corrected_by != self.second_beam.slip().present_and_last()
    }

    /// Recalculates the distances with the measured slip.
    pub(super) fn correct(&mut self, settings: &Settings) {
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
    pub(super) fn begin_second(&mut self, broken: bool) {
        // A beam that is not there any more would stay broken.
        self.second_beam.begin(self.detector.frontier(), broken && self.has_second_beam());
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

    /// Widens a canopy to the stretch that the second beam sees. Returns whether a canopy is there.
    pub(super) fn widen(&mut self, from: WrappedPosition, to: WrappedPosition) -> bool {
        let within = Length(self.geometry.second_beam().0 >> 2);
        if self.unclassified.known == Known::Canopy {
            self.unclassified.canopy.widen(from, to, within, within);
        }
        self.keep_out.widen(from, to, within)
    }
}
