//! The second beam: it measures the wheel's slip, and shows when a beam is blind.
//!
//! # How it works
//!
//! The second beam sees each detection after the first beam does. [`SecondBeam`] pairs each detection of the second
//! beam with one of the first: as wide, and near enough for any slip.
//!
//! It compares the wheel's travel between the two detections with the beams' distance. This gives the slip ([`Slip`]),
//! which is known once consecutive pairs agree. A detection that one beam missed, or that may be two plants, ends the
//! run of agreeing pairs.
//!
//! While the slip is known, the second beam expects each detection of the first. Any other detection closes the ground
//! from its edge on. The classifier then treats it like a detection of the first beam.
//!
//! If one beam misses three detections in a row, it is blind.
//!
//! # Limits
//!
//! - The second beam measures no slip on empty ground. It does not see plants between itself and the tool.
//! - If two detections fit, [`SecondBeam`] measures nothing. This happens in a dense stand. With more than five
//!   detections between the beams, it measures nothing until these have passed.
//! - It measures no slip beyond 30 %. It ignores detections so narrow that a beam may miss them.
//! - A stalk that the first beam misses just ahead of a tall weed of its width may take the weed's place.
//! - All tests simulate the beams. No real machine has shown that both see the same width of a canopy, or that
//!   consecutive slips agree.

use super::{
    detection::Detection,
    detector::Detector,
    slip::{Slip, SlipChange},
};
use crate::units::{Length, WrappedPosition};

/// Detections remembered between the beams. With more, nothing is measured until these have passed.
const CAPACITY: usize = 5;

/// Consecutive detections that only one beam saw, until the other counts as blind.
const MISSED: i8 = 3;
const MISSED_BY_FIRST: i8 = -MISSED;

/// The beam that missed too many detections in a row.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub enum Blind {
    /// The first.
    First,
    /// The second.
    Second,
}

/// A detection of the first beam.
#[derive(Clone, Copy, Debug)]
struct Passed {
    leading: WrappedPosition,
    width: Length,
}

/// The second beam. Its positions are those that the first beam had there, with the slip known so far.
#[derive(Clone, Debug)]
pub struct SecondBeam {
    detector: Detector,
    /// Detections of the first beam, newest first, and how many the second beam has yet to reach.
    passed: [Passed; CAPACITY],
    awaited: u8,
    /// One bit for each awaited detection, set once a detection of the second beam fits it.
    claimed: u8,
    /// Whether the first beam has seen more than `CAPACITY` detections.
    is_crowded: bool,
    /// How far the present detection may reach and still be an awaited one.
    expected_to: WrappedPosition,
    /// Consecutive detections that this beam missed; negative: that the first beam missed.
    missed: i8,
    slip: Slip,
}

impl SecondBeam {
    /// A second beam before [`begin`](Self::begin).
    pub const NONE: Self = Self {
        detector: Detector::NONE,
        passed: [Passed { leading: WrappedPosition::new(0), width: Length::ZERO }; CAPACITY],
        awaited: 0,
        claimed: 0,
        is_crowded: false,
        expected_to: WrappedPosition::new(0),
        missed: 0,
        slip: Slip::NONE,
    };

    /// Starts at a position, with the beam's level. Forgets earlier detections, and no longer trusts the slip measured with them.
    #[cfg_attr(target_arch = "avr", inline(never))]
    pub fn begin(&mut self, position: WrappedPosition, broken: bool) {
        self.detector.begin(position, broken);
        (self.awaited, self.missed, self.is_crowded) = (0, 0, false);
        self.expected_to = position;
        self.slip.distrust();
    }

    /// The measured slip.
    pub fn slip(&self) -> &Slip {
        &self.slip
    }

    /// What has changed about the slip since the last call.
    pub fn take_slip_change(&mut self) -> SlipChange {
        self.slip.take_change()
    }

    /// Whether the beam is broken.
    pub fn is_broken(&self) -> bool {
        self.detector.is_broken()
    }

    /// Where the open detection begins.
    #[cfg_attr(not(target_arch = "avr"), inline)]
    pub fn open(&self) -> Option<WrappedPosition> {
        self.detector.open()
    }

    /// As [`open`](Self::open), if the first beam has not seen that detection.
    #[cfg_attr(not(target_arch = "avr"), inline)]
    pub fn open_alone(&self) -> Option<WrappedPosition> {
        self.open().filter(|_| !self.expected_to.is_ahead_of(self.detector.open_to()))
    }

    /// Adds a detection of the first beam, if it is at least `least` wide: both beams see those for certain.
    #[cfg_attr(target_arch = "avr", inline(never))]
    pub fn await_detection(&mut self, detection: Detection, least: Length) {
        if detection.width() < least {
            return;
        }
        if usize::from(self.awaited) == CAPACITY {
            self.is_crowded = true;
            return;
        }
        self.passed.copy_within(..CAPACITY - 1, 1);
        self.passed[0] = Passed { leading: detection.leading, width: detection.width() };
        self.awaited += 1;
        self.claimed <<= 1;
    }

    /// Takes the beam's level at a position. `apart` is the beams' distance, `gap` the merging gap, and `least` the width that both
    /// beams see for certain. Returns a complete detection that the first beam has not seen.
    #[cfg_attr(target_arch = "avr", inline(never))]
    pub fn take_level(
        &mut self,
        position: WrappedPosition,
        broken: bool,
        apart: Length,
        gap: Length,
        least: Length,
    ) -> Option<Detection> {
        let detection = self.detector.edge(position, broken, gap).unwrap_or(Detection::cut_at(position));
        // An open detection has no width yet.
        let is_over = detection.width() >= least;
        let is_expected = !detection.trailing.is_ahead_of(self.expected_to);
        let begins = self.detector.open() == Some(position);
        if begins {
            self.expected_to = position;
        } else if !is_over {
            self.miss(apart, gap);
            return None;
        }
        // Greatest difference between the widths of a pair.
        let same = least + Length(4);
        let near = apart.0 >> 3;
        let (mut bit, mut fitting, mut travel, mut is_near) = (1_u8, 0_u8, Length::ZERO, false);
        for first in self.passed.iter().take(self.awaited.into()) {
            let (off, wider) = (detection.leading - first.leading, detection.width() - first.width);
            // At the expected position, with a tolerance for a change of slip. Each detection of the first beam is
            // expected once: another one there may be a plant that the first beam has missed.
            let is_free = self.claimed & bit == 0;
            if !is_over && is_free && self.slip.is_known() && (-near..=near).contains(&off.0) {
                self.expected_to = position + first.width + same;
            }
            // From 25 % less to 50 % more: slip of 30 % in either direction.
            if (-2 * near..=4 * near).contains(&off.0) {
                is_near = true;
                if wider <= same && wider >= -same {
                    fitting |= bit;
                    // Between the middles: a leaf at either end moves the middle by half of its length.
                    travel = apart + off + Length(wider.0 >> 1);
                }
            }
            bit <<= 1;
        }
        if !is_over {
            return None;
        }
        self.claimed |= fitting;
        // Exactly one bit is set only in a power of two.
        if self.is_crowded || fitting & fitting.wrapping_sub(1) != 0 {
            travel = Length::ZERO;
        }
        self.slip.measure(apart, travel);
        if is_near {
            self.missed = 0;
        } else if !self.is_crowded {
            self.missed = self.missed.min(0) - 1;
        }
        (!is_expected).then_some(detection)
    }

    /// The beam that is blind, if one is.
    #[cfg_attr(not(target_arch = "avr"), inline)]
    pub fn blind(&self) -> Option<Blind> {
        match self.missed {
            ..=MISSED_BY_FIRST => Some(Blind::First),
            MISSED.. => Some(Blind::Second),
            _ => None,
        }
    }

    /// Drops the oldest awaited detection once it must have passed. Counts it as missed if no detection claimed it.
    fn miss(&mut self, apart: Length, gap: Length) {
        let awaited = self.awaited.wrapping_sub(1);
        let Some(oldest) = self.passed.get(usize::from(awaited)) else { return };
        if self.detector.frontier() - oldest.leading <= oldest.width + gap + Length(apart.0 >> 1) {
            return;
        }
        self.awaited = awaited;
        self.is_crowded &= awaited > 0;
        if self.claimed >> awaited & 1 == 0 {
            self.slip.break_run();
            self.missed = self.missed.max(0) + 1;
        }
    }
}

#[cfg(test)]
mod tests {
    use super::*;
    use proptest::prelude::*;
    use std::vec::Vec;

    const APART: Length = Length(400);
    const GAP: Length = Length(40);
    const LEAST: Length = Length(16);

    /// What the second beam reports.
    #[derive(Clone, Copy, Debug, PartialEq, Eq)]
    enum Report {
        /// A measured slip.
        Slip,
        /// The slip is unknown again.
        Lost,
        /// A detection to classify.
        Alone(Detection),
        Blind(Blind),
    }

    /// Where the first beam and the second see something, from and to, in ticks of the wheel.
    type Stretches = (Option<(i16, i16)>, Option<(i16, i16)>);

    /// Rolls past stretches, in this order. Returns the reports.
    fn compare(second: &mut SecondBeam, stretches: &[Stretches]) -> Vec<Report> {
        let mut reports = Vec::new();
        let end = stretches.iter().flat_map(|(first, second)| [first, second]).flatten().map(|&(_, to)| to).max();
        for position in 0..end.unwrap_or(0) + 2 * APART.0 {
            // The first beam's detection is complete after the gap behind it.
            let over = stretches.iter().filter_map(|&(first, _)| first).find(|&(_, to)| to + GAP.0 == position);
            if let Some((from, to)) = over {
                second.await_detection(Detection::whole(from, to), LEAST);
            }
            let broken =
                stretches.iter().filter_map(|&(_, second)| second).any(|(from, to)| (from..to).contains(&position));
            // The machine's distances follow the slip.
            let apart = Length((i32::from(APART.0) * (256 + i32::from(second.slip().excess())) / 256) as i16);
            let seen = second.take_level(WrappedPosition::new(position) - apart, broken, apart, GAP, LEAST);
            if let Some(blind) = second.blind() {
                reports.push(Report::Blind(blind));
                second.missed = 0;
                continue;
            }
            reports.extend(seen.map(Report::Alone));
            match second.take_slip_change() {
                SlipChange::None => {}
                SlipChange::Measured => reports.push(Report::Slip),
                SlipChange::Lost => reports.push(Report::Lost),
            }
        }
        reports
    }

    /// The reports without detections to classify: the ground knows which of those it has already.
    fn news(second: &mut SecondBeam, stretches: &[Stretches]) -> Vec<Report> {
        compare(second, stretches).into_iter().filter(|report| !matches!(report, Report::Alone(_))).collect()
    }

    fn begun() -> SecondBeam {
        let mut second = SecondBeam::NONE;
        second.begin(WrappedPosition::new(-1000), false);
        second
    }

    /// A plant that the second beam sees `travel` ticks after the first.
    fn plant(from: i16, travel: i16) -> Stretches {
        (Some((from, from + 300)), Some((from + travel, from + travel + 300)))
    }

    #[test]
    fn a_plant_in_the_second_beam_is_seen_though_the_ground_is_forgotten() {
        let at = WrappedPosition::new;
        let mut second = SecondBeam::NONE;
        second.begin(at(0), false);
        second.take_level(at(10), true, APART, GAP, LEAST);
        // The first beam is ahead.
        second.begin(at(100), second.is_broken());
        let seen: Vec<Detection> = (11..300)
            .filter_map(|position| {
                let broken = second.is_broken() && position < 200;
                second.take_level(at(position), broken, APART, GAP, LEAST)
            })
            .collect();
        assert_eq!(seen, [Detection { cut: true, ..Detection::whole(100, 200) }]);
    }

    #[test]
    fn slip_needs_two_agreeing_plants_or_three_if_it_is_large() {
        for (travel, excess, plants) in [(400, 0_i32, 2), (444, 28, 2), (540, 89, 3), (330, -45, 3)] {
            let mut second = begun();
            let rows: Vec<_> = (0..plants).map(|number| plant(100 + 2000 * number, travel)).collect();
            let (last, before) = rows.split_last().unwrap();
            assert_eq!(news(&mut second, before), []);
            assert_eq!((second.slip().excess(), second.slip().permille()), (0, None), "{travel}");
            // The second beam sees only the rear part of the next plant.
            let half = (Some((8000, 8300)), Some((8100 + travel, 8300 + travel)));
            let mut broken = begun();
            assert_eq!(news(&mut broken, &[before, &[half], &[plant(10_000, travel)]].concat()), [], "{travel}");
            assert_eq!(news(&mut begun(), &[before, &[*last]].concat()), [Report::Slip]);
            second = begun();
            news(&mut second, &rows);
            assert_eq!(i32::from(second.slip().excess()), excess, "{travel}");
            let permille = 1000 - 256_000 / (256 + excess);
            assert_eq!(second.slip().permille().map(i32::from), Some(permille));
        }
    }

    #[test]
    fn slip_beyond_thirty_percent_is_not_measured() {
        for travel in [300, 580] {
            let mut second = begun();
            let plants: Vec<_> = (0..4).map(|number| plant(100 + 2000 * number, travel)).collect();
            assert_eq!(news(&mut second, &plants), []);
            assert_eq!(second.slip().permille(), None);
        }
    }

    #[test]
    fn a_beam_that_misses_three_plants_in_a_row_is_blind() {
        let only_first = |from: i16| (Some((from, from + 300)), None);
        let only_second = |from: i16| (None, Some((from + 400, from + 700)));
        let at = |leading: i16| Report::Alone(Detection::whole(leading, leading + 300));
        let unseen = [only_first(0), only_first(1500), only_first(3000)];
        assert_eq!(compare(&mut begun(), &unseen), [Report::Blind(Blind::Second)]);
        let alone = [only_second(0), only_second(1500), only_second(3000)];
        assert_eq!(compare(&mut begun(), &alone), [at(0), at(1500), Report::Blind(Blind::First)]);
        let mixed = [only_first(0), only_first(1500), plant(3000, 400), only_first(4500), only_first(6000)];
        assert_eq!(
            compare(&mut begun(), &mixed),
            [at(3000)],
            "both beams see one in between, but the slip is not known yet"
        );
        let either = [only_first(0), only_first(1500), only_second(3000), only_first(4500), only_first(6000)];
        assert_eq!(compare(&mut begun(), &either), [at(3000)], "neither is blind");
    }

    #[test]
    fn detections_too_narrow_for_both_beams_make_no_beam_blind() {
        let narrow = |from: i16| [(Some((from, from + 15)), None), (None, Some((from + 600, from + 615)))];
        let insects: Vec<_> = (0..8).flat_map(|insect| narrow(1500 * insect)).collect();
        assert_eq!(compare(&mut begun(), &insects), []);
    }

    #[test]
    fn ambiguous_or_too_many_detections_give_no_slip_and_report_it_once() {
        for spacing in [80, 120, 160] {
            let stand: Vec<_> = (0..40).map(|number| (100 + spacing * number, 130 + spacing * number)).collect();
            let stretches: Vec<Stretches> =
                stand.iter().map(|&(from, to)| (Some((from, to)), Some((from + 400, to + 400)))).collect();
            let mut second = begun();
            assert_eq!(news(&mut second, &stretches), [Report::Lost], "{spacing}");
            assert_eq!(second.slip().permille(), None);
        }
    }

    #[test]
    fn a_detection_is_open_unless_the_first_beam_has_seen_it() {
        let mut second = begun();
        let take = |second: &mut SecondBeam, position, broken| {
            second.take_level(WrappedPosition::new(position), broken, APART, GAP, LEAST);
            second.open_alone()
        };
        assert_eq!(take(&mut second, 100, true), Some(WrappedPosition::new(100)));
        assert_eq!(take(&mut second, 200, false), Some(WrappedPosition::new(100)));
        assert_eq!(take(&mut second, 241, false), None);
        // The slip is known, and the first beam has seen the detection.
        for _ in 0..2 {
            second.slip.measure(APART, APART);
        }
        second.await_detection(Detection::whole(950, 1050), LEAST);
        assert_eq!(take(&mut second, 880, true), Some(WrappedPosition::new(880)), "too early for the expected one");
        take(&mut second, 900, false);
        take(&mut second, 945, false);
        assert_eq!(take(&mut second, 950, true), None);
        let mut ends = second.clone();
        assert_eq!(take(&mut ends, 1060, false), None);
        assert_eq!(take(&mut ends, 1090, false), None, "clear ground behind it does not belong to it");
        assert_eq!(take(&mut second, 1069, true), None);
        assert_eq!(take(&mut second, 1070, true), Some(WrappedPosition::new(950)), "wider than the first beam saw");
    }

    proptest! {
        /// Compared with a model that knows which edges belong together.
        #[test]
        fn the_slip_is_the_mean_of_the_last_two_plants_with_insects_between_them(
            plants in prop::collection::vec((900_i16..1400, 60_i16..300, -8_i16..8, any::<bool>()), 2..12),
            mean in -40_i16..45,
        ) {
            let mut second = begun();
            let (mut position, mut stretches, mut travels) = (0, Vec::new(), Vec::new());
            for &(gap, width, more, has_insect) in &plants {
                position += gap;
                let travel = APART.0 + mean + more;
                stretches.push((Some((position, position + width)), Some((position + travel, position + travel + width))));
                travels.push(travel);
                if has_insect {
                    stretches.push((Some((position - 400, position - 385)), Some((position - 400 + APART.0, position - 385 + APART.0))));
                }
                position += width;
            }
            stretches.sort_by_key(|(first, _)| *first);
            let reports = news(&mut second, &stretches);
            prop_assert_eq!(reports, travels[1..].iter().map(|_| Report::Slip).collect::<Vec<_>>());
            let last = &travels[travels.len() - 2..];
            let expected: i32 = last.iter().map(|&travel| 128 * i32::from(travel) / i32::from(APART.0)).sum::<i32>() - 256;
            let excess = i32::from(second.slip().excess());
            prop_assert!((excess - expected).abs() <= 3, "{} of {:?}", excess, last);
        }
    }
}
