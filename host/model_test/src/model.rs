//! The ground as the beam has seen it, in the simplest form: whole numbers that never wrap, and a memory that never
//! forgets.
//!
//! The ground is counted in the encoder's ticks. For each tick that the beam has reached, the model knows whether the
//! beam was broken there the first time. Only two things open such ground to the tool again: a complete detection that
//! was classified as a weed, and the command `start now`. The command opens only ground that `status` reports as
//! unknown, because it was never seen or was forgotten. An alarm opens nothing.
//!
//! With a stem zone, the tool may work at either end of a wider detection: on half of the excess, but on at most 11/64
//! of the zone's width. A narrower detection is kept in all of the zone. A second beam can only add to a detection.
//!
//! Guarded ground is closed like a canopy from then on, with or without a plant.
//!
//! After an error of the encoder's count, the row is shifted by the lost or added ticks. The model still stores what
//! the beam has seen at each count: the machine cannot know more.

use control::settings::{Setting, Settings};
use std::ops::Range;

/// Ground over which the beam was broken continuously.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub struct Stretch {
    /// The first position at which the beam was broken.
    pub leading: i64,
    /// The last such position.
    pub trailing: i64,
    /// Error of the machine's positions, from the sensor response that it expects.
    blur: i64,
    /// Limit of the margin behind it: `start now` may end it earlier.
    margin_to: i64,
    /// Whether the tool may work here, because of a weed or of `start now`.
    is_free: bool,
}

impl Stretch {
    /// Ground that the tool must avoid, with its whole margin.
    fn closed(leading: i64, trailing: i64, blur: i64) -> Self {
        Self { leading, trailing, blur, margin_to: i64::MAX, is_free: false }
    }
}

/// The greatest blur of some stretches.
fn blur(stretches: &[Stretch]) -> i64 {
    stretches.iter().map(|stretch| stretch.blur).max().unwrap_or(0)
}

/// The ground as the beam has seen it.
#[derive(Debug, Default)]
pub struct Model {
    /// Ground behind this position is unknown.
    known_from: i64,
    /// The first position of the beam.
    begin: i64,
    /// The farthest position of the beam.
    frontier: i64,
    /// Whether the beam is broken now, and whether the last stretch goes on at the frontier.
    broken: bool,
    is_growing: bool,
    /// Whether edges were lost while the beam was broken, anywhere behind the frontier. The machine then expects a plant there.
    may_be_broken_at_frontier: bool,
    /// In the order of their positions.
    stretches: Vec<Stretch>,
    /// Ground of expected but missed plants, in the order of the machine's reports.
    guarded: Vec<Stretch>,
    /// Gaps that belong to a canopy, each with the frontier at which it was set.
    merge_gaps: Vec<(i64, i64)>,
    /// Stem zones, each with the frontier at which it was set.
    stem_zones: Vec<(i64, i64)>,
    /// A detection up to this width may have been classified as a weed without an event.
    narrow: i64,
    /// Error of every position: from the machine's resolution of the ground, and a turn of the loop.
    slack: i64,
    /// The part of it that follows from the present resolution.
    resolution_slack: i64,
    /// Whether the encoder's count has gone wrong.
    pub is_shifted: bool,
    /// Whether the machine came so near to the end of its memory that it may have forgotten the ground.
    may_have_forgotten: bool,
}

impl Model {
    /// A model that knows only the beam's level.
    pub fn new(place: i64, broken: bool) -> Self {
        let mut model = Self { known_from: place, begin: place, frontier: place, broken, ..Self::default() };
        model.touch(0);
        model
    }

    /// Applies the present settings, with the beam at a position. The machine may classify a detection up to `narrow_mm`
    /// as a weed without an event. After rolling back by more than eight metres, within five centimetres, the beam sees
    /// the ground again as new.
    pub fn follow(&mut self, place: i64, settings: &Settings, narrow_mm: u16) {
        let metre = i64::from(settings.wheel().ticks(1000).0);
        let [merge_gap, zone] = [Setting::MergeGapMm, Setting::StemZoneMm].map(|set| settings.ticks(set).0.into());
        if self.frontier - place > 8 * metre - metre / 20 {
            self.known_from = self.known_from.min(place);
            self.may_have_forgotten = true;
        }
        // By now the machine has forgotten the ground: at eight metres, within a turn.
        if self.frontier - place > 8 * metre + metre / 64 {
            self.see_again(self.frontier - 8 * metre);
        }
        let resolution = 1 + metre / 2400;
        let slack = 2 + 2 * resolution;
        self.slack += (slack - self.resolution_slack).max(0);
        self.resolution_slack = self.resolution_slack.max(slack);
        if self.merge_gaps.last().is_none_or(|&(_, gap)| gap != merge_gap) {
            self.merge_gaps.push((self.frontier, merge_gap));
        }
        if self.stem_zones.last().is_none_or(|&(_, last)| last != zone) {
            self.stem_zones.push((self.frontier, zone));
        }
        self.narrow = self.narrow.max(settings.wheel().ticks(narrow_mm).0.into());
    }

    /// Whether a stem zone was set.
    pub fn keeps_stems(&self) -> bool {
        self.widest_zone() > 0
    }

    /// The widest stem zone that was set; 0 for none.
    pub fn widest_zone(&self) -> i64 {
        self.stem_zones.iter().map(|&(_, zone)| zone).max().unwrap_or(0)
    }

    /// Whether the machine's reports may be about other ground than the model's. Then they are not checked.
    pub fn is_in_doubt(&self) -> bool {
        self.is_shifted || self.may_have_forgotten
    }

    /// The encoder's count goes wrong. Adds an error, in ticks, to every position of the machine.
    pub fn loosen(&mut self, ticks: i64) {
        self.is_shifted = true;
        self.slack += ticks;
    }

    /// How far the beam, at a position, has rolled back.
    pub fn rolled_back(&self, place: i64) -> i64 {
        self.frontier - place
    }

    /// Doubts the machine's memory, if a distance that decides about it is within a tolerance. Returns whether it is.
    pub fn doubt(&mut self, distance: i64, tolerance: i64) -> bool {
        let is_close = distance.abs() <= self.slack + tolerance;
        self.may_have_forgotten |= is_close;
        is_close
    }

    /// The ground ahead of a position is seen again as new.
    pub fn see_again(&mut self, place: i64) {
        self.known_from = self.known_from.min(place);
        self.begin = self.begin.min(place);
        (self.frontier, self.is_growing, self.may_have_forgotten) = (place, false, false);
        self.may_be_broken_at_frontier = false;
        self.stretches.retain(|stretch| stretch.leading < place);
        self.stretches.iter_mut().for_each(|stretch| stretch.trailing = stretch.trailing.min(place - 1));
        self.guarded.retain(|guarded| guarded.trailing < place);
        self.merge_gaps.clear();
        self.stem_zones.iter_mut().for_each(|(from, _)| *from = place.min(*from));
        // A plant that breaks the beam here is kept from here on.
        self.touch(0);
    }

    /// The machine reports that it guards the ground around a position, where a plant was expected.
    ///
    /// # Errors
    /// If the beam has not seen all of that ground, or saw no plant at the spacing behind it.
    pub fn guard(&mut self, due: i64, spacing: i64, scatter: i64) -> Result<(), String> {
        if due + scatter > self.frontier + self.slack {
            return Err(format!(
                "the machine guards ground around {due}, but the beam has only reached {}",
                self.frontier
            ));
        }
        // From the centre of a plant, which may have gaps, to that of the first, second, or third missed plant behind it.
        let is_from = |first: usize| {
            self.stretches[first..].iter().any(|last| {
                let middle = (self.stretches[first].leading + last.trailing) / 2;
                let off = (1..=3).map(|unseen| (due - middle - unseen * spacing).abs()).min().unwrap_or(i64::MAX);
                off <= 4 * self.slack + 2 * self.stretches[first].blur
            })
        };
        if !(0..self.stretches.len()).any(is_from) {
            return Err(format!(
                "the machine guards ground around {due}, {spacing} behind none of {:?}",
                self.stretches
            ));
        }
        self.guarded.push(Stretch::closed(due - scatter, due + scatter, 0));
        Ok(())
    }

    /// The beam reaches a position. The machine's position may be off by `blur`.
    pub fn roll_to(&mut self, place: i64, blur: i64) {
        if place > self.frontier {
            self.touch(blur);
            self.frontier = place;
            self.touch(blur);
            self.may_be_broken_at_frontier = false;
        }
    }

    /// The machine has lost edges of the beam, and now knows its level again.
    pub fn lose_edges(&mut self) {
        self.may_be_broken_at_frontier = self.broken;
    }

    /// The beam breaks or clears at a position.
    pub fn edge(&mut self, place: i64, broken: bool, blur: i64) {
        self.roll_to(place, blur);
        self.broken = broken;
        if place == self.frontier {
            self.touch(blur);
        }
    }

    /// Stores the beam's level at the frontier.
    fn touch(&mut self, blur: i64) {
        if !self.broken {
            self.is_growing = false;
            return;
        }
        let (here, goes_on) = (self.frontier, self.is_growing);
        match self.stretches.last_mut() {
            Some(stretch) if !stretch.is_free && (goes_on || stretch.trailing == here) => {
                stretch.trailing = here;
                stretch.blur = stretch.blur.max(blur);
            }
            _ => self.stretches.push(Stretch::closed(here, here, blur)),
        }
        self.is_growing = true;
    }

    /// The operator opens the ground between two positions that the machine does not know.
    pub fn trust(&mut self, from: i64, to: i64) {
        self.known_from = self.known_from.min(from);
        let parts = |stretch: &Stretch| {
            let part = |leading: i64, trailing: i64, is_free| {
                let (leading, trailing) = (leading.max(stretch.leading), trailing.min(stretch.trailing));
                (leading <= trailing).then_some(Stretch { leading, trailing, is_free, ..*stretch })
            };
            [part(i64::MIN, from - 1, stretch.is_free), part(from, to, true), part(to + 1, i64::MAX, stretch.is_free)]
        };
        self.stretches = self.stretches.iter().flat_map(parts).flatten().collect();
        self.guarded.retain(|guarded| guarded.trailing < from || guarded.leading > to);
        for stretch in self.stretches.iter_mut().chain(&mut self.guarded).filter(|stretch| stretch.trailing < from) {
            stretch.margin_to = stretch.margin_to.min(from - 1);
        }
        // The beam may not have reached all of this ground.
        if to > self.frontier {
            (self.frontier, self.is_growing) = (to, false);
        }
    }

    /// With the beam at a position, the machine has classified a detection of this width as a weed. Opens its ground.
    ///
    /// # Errors
    /// If no whole detection of this width ended here, within `tolerance`.
    pub fn weed(&mut self, place: i64, width: i64, tolerance: i64) -> Result<(), String> {
        let last = self.stretches.partition_point(|stretch| stretch.trailing <= place);
        // The stretch at the frontier has not ended yet.
        let last = if self.is_growing && last == self.stretches.len() { last.saturating_sub(1) } else { last };
        // While the machine classified it, the beam may have been broken again, and be clear by now.
        let broken_again = last.checked_sub(1).map(|next| (next, self.stretches[next].leading));
        for (last, seen_to) in [Some((last, place)), broken_again].into_iter().flatten() {
            if let Some(whole) = self.whole_detection(last, seen_to, width, tolerance) {
                self.stretches[whole].iter_mut().for_each(|stretch| stretch.is_free = true);
                return Ok(());
            }
        }
        if self.stretches[..last].is_empty() && place - width < self.begin {
            return Ok(());
        }
        let shown = &self.stretches[last.saturating_sub(4)..last];
        Err(format!("the machine reports a weed of {width} ticks at {place}, but the beam saw {shown:?}"))
    }

    /// The stretches up to `last`, without it, that are one detection of this width, if the beam has seen the gap behind it up
    /// to `seen_to`.
    fn whole_detection(&self, last: usize, seen_to: i64, width: i64, tolerance: i64) -> Option<Range<usize>> {
        for first in (0..last).rev() {
            let (leading, trailing) = (self.stretches[first].leading, self.stretches[last - 1].trailing);
            let tolerance = tolerance + self.slack + 2 * blur(&self.stretches[first..last]);
            let shortest_since = |place| self.merge_gaps_since(place).min().unwrap_or(0);
            let before = first.checked_sub(1).map(|before| self.stretches[before].trailing);
            // The stretch before it may have ended under another setting.
            let begins = before.is_none_or(|end| leading - end >= shortest_since(end) - tolerance);
            let is_whole = begins && seen_to - trailing >= shortest_since(leading) - tolerance;
            if is_whole && (trailing - leading).abs_diff(width) <= tolerance as u64 {
                return Some(first..last);
            }
            let longest = self.merge_gaps_since(leading).max().unwrap_or(0);
            if before.is_none_or(|end| leading - end > longest + tolerance) {
                break;
            }
        }
        None
    }

    /// The gaps that were set while the beam came from a place on.
    fn merge_gaps_since(&self, place: i64) -> impl Iterator<Item = i64> {
        let first = self.merge_gaps.partition_point(|&(from, _)| from <= place).saturating_sub(1);
        self.merge_gaps[first..].iter().map(|&(_, gap)| gap)
    }

    /// Whether the beam has not seen the ground at `near`, or in the margin ahead of unseen ground.
    pub fn is_unseen(&self, near: i64, margin: i64) -> bool {
        near + self.slack < self.known_from + margin
    }

    /// A canopy that the tool must avoid, with its margin, between `near` and `far`.
    pub fn canopy_between(&self, near: i64, far: i64, margin: i64) -> Option<Stretch> {
        let reach = margin + self.widest_zone() / 2;
        let first = self.stretches.partition_point(|stretch| stretch.trailing + reach < near);
        let mut near_by = self.stretches[first..].iter().take_while(|stretch| stretch.leading - reach <= far);
        let is_closed =
            |stretch: &&Stretch| self.is_met(stretch, near, far, margin) && (self.narrow == 0 || self.is_wide(stretch));
        let guarded = || self.guarded.iter().find(|stretch| self.is_met(stretch, near, far, margin));
        near_by.find(is_closed).or_else(guarded).copied()
    }

    /// Whether the ground around a stretch is certainly closed somewhere between `near` and `far`.
    fn is_met(&self, stretch: &Stretch, near: i64, far: i64, margin: i64) -> bool {
        self.bounds(stretch, margin).is_some_and(|(from, to)| from <= far && to >= near)
    }

    /// Whether any canopy lies within `reach` of a position, weeds included. The ground behind a canopy counts while the
    /// detection may go on, and so does a gap that may belong to it.
    pub fn has_canopy_near(&self, place: i64, reach: i64) -> bool {
        let (before, behind) =
            self.stretches.split_at(self.stretches.partition_point(|stretch| stretch.leading <= place));
        let at_frontier = Stretch::closed(self.frontier, self.frontier, 0);
        let next = behind.first().unwrap_or(&at_frontier);
        if before.last().is_some_and(|before| self.may_be_one(before, next)) {
            return true;
        }
        let is_near = |stretch: &Stretch| {
            let reach = reach + self.slack + 2 * stretch.blur;
            stretch.leading - reach <= place && place <= stretch.trailing + reach
        };
        self.may_be_broken_at_frontier && is_near(&at_frontier)
            || self.stretches.iter().chain(&self.guarded).any(is_near)
    }

    /// The last canopy between `near` and `far`, if canopies and their margins close all of that ground.
    pub fn canopies_all_over(&self, mut near: i64, far: i64, margin: i64) -> Option<Stretch> {
        loop {
            let stretch = self.canopy_between(near, near, margin)?;
            let (_, to) = self.bounds(&stretch, margin)?;
            if to >= far {
                return Some(stretch);
            }
            near = to + 1;
        }
    }

    /// Whether a stretch belongs to a detection that is too wide for a weed, together with the stretches that merge with it.
    pub fn is_wide(&self, stretch: &Stretch) -> bool {
        let is_one = |before: &Stretch, behind: &Stretch| {
            let shortest = self.merge_gaps_since(before.leading).min().unwrap_or(0);
            let least = shortest - self.slack - 2 * before.blur.max(behind.blur);
            behind.leading - before.trailing < least && !before.is_free && !behind.is_free
        };
        let parts = self.detection_of(stretch, is_one);
        let width = parts.last().zip(parts.first()).map_or(0, |(last, first)| last.trailing - first.leading);
        width > self.narrow + self.slack + 2 * blur(parts)
    }

    /// The stretches of the detection to which a stretch belongs. `is_one` tells whether two neighbours merge.
    fn detection_of(&self, stretch: &Stretch, is_one: impl Fn(&Stretch, &Stretch) -> bool) -> &[Stretch] {
        // Guarded ground is not in the list, so a neighbour stands for it.
        let Some(end) = self.stretches.len().checked_sub(1) else { return &[] };
        let place = self.stretches.partition_point(|other| other.leading < stretch.leading).min(end);
        let (mut first, mut last) = (place, place);
        while first > 0 && is_one(&self.stretches[first - 1], &self.stretches[first]) {
            first -= 1;
        }
        while last < end && is_one(&self.stretches[last], &self.stretches[last + 1]) {
            last += 1;
        }
        &self.stretches[first..=last]
    }

    /// The certainly closed ground around a stretch. None if the tool may work there, or the machine may have missed it.
    fn bounds(&self, stretch: &Stretch, margin: i64) -> Option<(i64, i64)> {
        let slack = self.slack + 2 * stretch.blur;
        let is_canopy = !stretch.is_free && stretch.trailing - stretch.leading > slack;
        // Half of the stem zone is in guarded ground already.
        let is_guarded = self.guarded.iter().any(|guarded| guarded.leading == stretch.leading);
        let least = if is_guarded { 0 } else { i64::MIN };
        let less = slack + self.given_up(stretch).max(least) - margin;
        is_canopy.then_some((stretch.leading + less, (stretch.trailing - less).min(stretch.margin_to)))
    }

    /// The greatest part of a stretch's end that the machine may open as leaves beside the stem zone. It is negative where the zone
    /// reaches beyond a narrow stretch.
    fn given_up(&self, stretch: &Stretch) -> i64 {
        let first = self.stem_zones.partition_point(|&(from, _)| from <= stretch.trailing).saturating_sub(1);
        let beside = |&(_, zone): &(i64, i64)| match zone {
            0 => 0,
            zone => ((self.widest(stretch) - zone) / 2).min(zone * 11 / 64) + 1,
        };
        self.stem_zones[first..].iter().map(beside).max().unwrap_or(0)
    }

    /// Whether the machine may merge two neighbours.
    fn may_be_one(&self, before: &Stretch, behind: &Stretch) -> bool {
        let longest = self.merge_gaps_since(before.leading).max().unwrap_or(0);
        behind.leading - before.trailing <= longest + self.slack + 2 * before.blur.max(behind.blur)
    }

    /// The greatest width of the detection to which a stretch belongs.
    fn widest(&self, stretch: &Stretch) -> i64 {
        let parts = self.detection_of(stretch, |before, behind| self.may_be_one(before, behind));
        let (Some(first), Some(last)) = (parts.first(), parts.last()) else { return 0 };
        last.trailing - first.leading + 1 + self.slack + 2 * first.blur.max(last.blur)
    }

    /// The canopy of the next keep-out zone for a tool that rolls on from a position.
    pub fn next_canopy(&self, place: i64, forward: bool, margin: i64) -> Option<Stretch> {
        let is_closed = |stretch: &&Stretch| !stretch.is_free;
        let found = if forward {
            let first = self.stretches.partition_point(|stretch| stretch.trailing + margin < place);
            self.stretches[first..].iter().find(is_closed)
        } else {
            let end = self.stretches.partition_point(|stretch| stretch.leading - margin <= place);
            self.stretches[..end].iter().rfind(is_closed)
        };
        found.copied()
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn a_plant_in_the_beam_is_kept_where_ground_is_seen_again_as_new() {
        let mut model = Model::new(0, false);
        model.edge(900, true, 0);
        model.roll_to(1000, 0);
        model.see_again(950);
        assert!(model.has_canopy_near(950, 0) && model.canopy_between(955, 960, 0).is_none(), "it has no width yet");
        model.roll_to(1000, 0);
        assert!(model.canopy_between(960, 960, 0).is_some());
    }

    #[test]
    fn a_weed_classified_after_a_new_edge_behind_it_is_accepted() {
        let mut model = Model::new(0, false);
        model.follow(0, &Settings::new(), 0);
        // The gap that ends a detection is 41 ticks.
        for (place, broken) in [(896, true), (925, false), (968, true), (968, false)] {
            model.edge(place, broken, 2);
        }
        model.roll_to(984, 0);
        assert!(model.weed(984, 60, 3).is_err(), "the beam saw no such detection");
        assert_eq!(model.weed(984, 29, 3), Ok(()));
    }
}
