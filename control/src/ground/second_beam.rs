//! The second beam: it sees each detection a moment after the first, and so tells where the wheel slips, and which of them is blind.
//!
//! How far the wheel turned in between, against how far the beams stand apart, is what a turn of the wheel is worth on this ground
//! ([`Slip`]). A detection of the second beam is paired with the only one of the first that stands near enough for any slip and is as
//! wide. Where two might be it, nothing is measured: so it is in a stand denser than the beams can tell apart. One that is missed, or
//! may be two, breaks the run of those that agree.
//!
//! While the slip is known, what the second beam sees is expected where the first has seen something as wide. All else is closed
//! from its edge on, and classified as if the first had seen it. Where it happens three times running that one of them alone sees something,
//! the other is blind.
//!
//! What it does not do: measure on ground where nothing stands, and see what stands nearer to the tool than itself.

use super::{
    detection::{Detection, End},
    detector::Detector,
    slip::{News, Slip},
};
use crate::units::{Length, WrappedPosition};

/// Detections between the beams that are remembered. Where there are more, nothing is measured until these have passed.
const CAPACITY: usize = 5;

/// Detections running that one beam alone has seen, until the other is taken for blind.
const MISSED: i8 = 3;
const MISSED_BY_FIRST: i8 = -MISSED;

/// One of the beams, which has seen nothing where the other has, once too often.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub enum Blind {
    /// The first.
    First,
    /// The second.
    Second,
}

/// What the first beam has seen.
#[derive(Clone, Copy, Debug)]
struct Passed {
    leading: WrappedPosition,
    width: Length,
}

/// The second beam. Its places are those that the first had when it was there, by the slip known so far.
#[derive(Clone, Debug)]
pub struct SecondBeam {
    detector: Detector,
    /// What the first has seen, the last of it first, and so many of these that this one is yet to come to.
    passed: [Passed; CAPACITY],
    awaited: u8,
    /// A bit for each of them that something seen may have been.
    claimed: u8,
    /// Whether the first has seen more than is remembered.
    is_crowded: bool,
    /// How far what is in this beam may go to be what the first has seen.
    expected_to: WrappedPosition,
    /// Detections running that this one has missed and the first has seen; below 0, that the first has missed.
    missed: i8,
    slip: Slip,
}

impl SecondBeam {
    /// One that has seen nothing.
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

    /// Watches from a place on, and forgets what was seen before, and what was measured with it.
    #[cfg_attr(target_arch = "avr", inline(never))]
    pub fn begin(&mut self, place: WrappedPosition) {
        self.detector.begin(place, false);
        (self.awaited, self.missed, self.is_crowded) = (0, 0, false);
        self.expected_to = place;
        self.slip = Slip::NONE;
    }

    /// The slip that was measured.
    pub fn slip(&self) -> &Slip {
        &self.slip
    }

    /// What has become of that since it was last asked for.
    pub fn take_news(&mut self) -> News {
        self.slip.take_news()
    }

    /// Whether it is broken.
    pub fn is_broken(&self) -> bool {
        self.detector.is_broken()
    }

    /// The end of a detection that an edge at a place is.
    pub fn end(&self, place: WrappedPosition) -> End {
        self.detector.end(place)
    }

    /// Where the detection begins that is in it.
    #[cfg_attr(not(target_arch = "avr"), inline)]
    pub fn open(&self) -> Option<WrappedPosition> {
        self.detector.open()
    }

    /// As [`open`](Self::open), if it is not what is expected there.
    #[cfg_attr(not(target_arch = "avr"), inline)]
    pub fn open_alone(&self) -> Option<WrappedPosition> {
        self.open().filter(|_| !self.expected_to.is_ahead_of(self.detector.open_to()))
    }

    /// The first beam has seen a detection, which is to come to this one; of the narrowest that both see, `least`, and more.
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

    /// It is at a place, broken or not, with the beams so far apart, with so long a gap behind what is over, and with what both of them
    /// see at least; returns what it has seen in full that was not expected.
    #[cfg_attr(target_arch = "avr", inline(never))]
    pub fn look(
        &mut self,
        place: WrappedPosition,
        broken: bool,
        apart: Length,
        gap: Length,
        least: Length,
    ) -> Option<Detection> {
        let detection = self.detector.edge(place, broken, gap).unwrap_or(Detection::cut_at(place));
        // What is not over has no width.
        let is_over = detection.width() >= least;
        let is_expected = !detection.trailing.is_ahead_of(self.expected_to);
        let begins = self.detector.open() == Some(place);
        if begins {
            self.expected_to = place;
        } else if !is_over {
            self.miss(apart, gap);
            return None;
        }
        // By how much the widths may differ of what is taken for the same detection.
        let same = least + Length(4);
        let near = apart.0 as u16 / 8;
        let (mut bit, mut fitting, mut way, mut is_near) = (1_u8, 0_u8, Length::ZERO, false);
        for first in self.passed.iter().take(self.awaited.into()) {
            let (off, wider) = (detection.leading - first.leading, detection.width() - first.width);
            // Where the slip has it, give or take what it may have changed by.
            if !is_over && self.slip.is_known() && off.0.unsigned_abs() <= near {
                self.expected_to = place + first.width + same;
            }
            // From 25 % less to 50 % more: slip of 30 % either way.
            if (off.0 as u16).wrapping_add(2 * near) <= 6 * near {
                is_near = true;
                if wider <= same && wider >= -same {
                    fitting |= bit;
                    // By the middle, which a leaf at either end moves by half.
                    way = apart + off + Length(wider.0 >> 1);
                }
            }
            bit <<= 1;
        }
        if !is_over {
            return None;
        }
        self.claimed |= fitting;
        // One alone is a power of two.
        if self.is_crowded || fitting & fitting.wrapping_sub(1) != 0 {
            way = Length::ZERO;
        }
        self.slip.measure(apart, way);
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

    /// The first detection that is awaited may have passed unseen.
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
    extern crate std;
    use super::*;
    use proptest::prelude::*;
    use std::vec::Vec;

    const APART: Length = Length(400);
    const GAP: Length = Length(40);
    const LEAST: Length = Length(16);

    /// What is told of the things that are rolled past.
    #[derive(Clone, Copy, Debug, PartialEq, Eq)]
    enum Told {
        /// The slip.
        Slip,
        /// One too many told none.
        Lost,
        /// Something is to be classified.
        Alone(Detection),
        Blind(Blind),
    }

    /// From where to where the first beam sees something, and the second, by the wheel.
    type Thing = (Option<(i16, i16)>, Option<(i16, i16)>);

    /// Rolls past things, in this order; what is told of each.
    fn compare(second: &mut SecondBeam, things: &[Thing]) -> Vec<Told> {
        let mut told = Vec::new();
        let end = things.iter().flat_map(|(first, second)| [first, second]).flatten().map(|&(_, to)| to).max();
        for place in 0..end.unwrap_or(0) + 2 * APART.0 {
            // By the first, a detection is over where the gap behind it has been seen.
            let over = things.iter().filter_map(|&(first, _)| first).find(|&(_, to)| to + GAP.0 == place);
            if let Some((from, to)) = over {
                let detection = Detection {
                    leading: WrappedPosition::new(from),
                    trailing: WrappedPosition::new(to),
                    ..Detection::NONE
                };
                second.await_detection(detection, LEAST);
            }
            let broken = things.iter().filter_map(|&(_, second)| second).any(|(from, to)| (from..to).contains(&place));
            // The machine's distances follow the slip.
            let apart = Length((i32::from(APART.0) * (256 + i32::from(second.slip().excess())) / 256) as i16);
            let seen = second.look(WrappedPosition::new(place) - apart, broken, apart, GAP, LEAST);
            if let Some(blind) = second.blind() {
                told.push(Told::Blind(blind));
                second.missed = 0;
                continue;
            }
            told.extend(seen.map(Told::Alone));
            match second.take_news() {
                News::None => {}
                News::Told => told.push(Told::Slip),
                News::Lost => told.push(Told::Lost),
            }
        }
        told
    }

    /// What is told, but for what is to be classified: the ground knows whether it is kept already.
    fn news(second: &mut SecondBeam, things: &[Thing]) -> Vec<Told> {
        compare(second, things).into_iter().filter(|told| !matches!(told, Told::Alone(_))).collect()
    }

    fn begun() -> SecondBeam {
        let mut second = SecondBeam::NONE;
        second.begin(WrappedPosition::new(-1000));
        second
    }

    /// A plant that the second beam sees so much farther on than the first.
    fn plant(from: i16, way: i16) -> Thing {
        (Some((from, from + 300)), Some((from + way, from + way + 300)))
    }

    #[test]
    fn two_plants_running_tell_the_slip_three_a_great_one_and_one_that_was_half_seen_breaks_their_run() {
        for (way, excess, plants) in [(400, 0_i32, 2), (444, 28, 2), (540, 89, 3), (330, -45, 3)] {
            let mut second = begun();
            let rows: Vec<_> = (0..plants).map(|number| plant(100 + 2000 * number, way)).collect();
            let (last, before) = rows.split_last().unwrap();
            assert_eq!(news(&mut second, before), []);
            assert_eq!((second.slip().excess(), second.slip().permille()), (0, None), "{way}");
            // Of the next the second beam sees the hind part alone.
            let half = (Some((8000, 8300)), Some((8100 + way, 8300 + way)));
            let mut broken = begun();
            assert_eq!(news(&mut broken, &[before, &[half], &[plant(10_000, way)]].concat()), [], "{way}");
            assert_eq!(news(&mut begun(), &[before, &[*last]].concat()), [Told::Slip]);
            second = begun();
            news(&mut second, &rows);
            assert_eq!(i32::from(second.slip().excess()), excess, "{way}");
            let permille = 1000 - 256_000 / (256 + excess);
            assert_eq!(second.slip().permille().map(i32::from), Some(permille));
        }
    }

    #[test]
    fn what_is_beyond_thirty_percent_is_no_plant() {
        for way in [300, 580] {
            let mut second = begun();
            let plants: Vec<_> = (0..4).map(|number| plant(100 + 2000 * number, way)).collect();
            assert_eq!(news(&mut second, &plants), []);
            assert_eq!(second.slip().permille(), None);
        }
    }

    #[test]
    fn three_running_that_one_beam_alone_sees_have_the_other_blind() {
        let only_first = |from: i16| (Some((from, from + 300)), None);
        let only_second = |from: i16| (None, Some((from + 400, from + 700)));
        let at = |leading: i16| {
            Told::Alone(Detection {
                leading: WrappedPosition::new(leading),
                trailing: WrappedPosition::new(leading + 300),
                ..Detection::NONE
            })
        };
        let unseen = [only_first(0), only_first(1500), only_first(3000)];
        assert_eq!(compare(&mut begun(), &unseen), [Told::Blind(Blind::Second)]);
        let alone = [only_second(0), only_second(1500), only_second(3000)];
        assert_eq!(compare(&mut begun(), &alone), [at(0), at(1500), Told::Blind(Blind::First)]);
        let mixed = [only_first(0), only_first(1500), plant(3000, 400), only_first(4500), only_first(6000)];
        assert_eq!(compare(&mut begun(), &mixed), [at(3000)], "both see between them, and it is not expected yet");
        let either = [only_first(0), only_first(1500), only_second(3000), only_first(4500), only_first(6000)];
        assert_eq!(compare(&mut begun(), &either), [at(3000)], "neither is blind");
    }

    #[test]
    fn what_is_narrower_than_two_beams_agree_on_is_asked_for_by_none() {
        let narrow = |from: i16| [(Some((from, from + 15)), None), (None, Some((from + 600, from + 615)))];
        let insects: Vec<_> = (0..8).flat_map(|insect| narrow(1500 * insect)).collect();
        assert_eq!(compare(&mut begun(), &insects), []);
    }

    #[test]
    fn where_two_might_be_it_or_more_than_are_remembered_nothing_is_measured_and_that_is_told_once() {
        for spacing in [80, 120, 160] {
            let stand: Vec<_> = (0..40).map(|number| (100 + spacing * number, 130 + spacing * number)).collect();
            let things: Vec<Thing> =
                stand.iter().map(|&(from, to)| (Some((from, to)), Some((from + 400, to + 400)))).collect();
            let mut second = begun();
            assert_eq!(news(&mut second, &things), [Told::Lost], "{spacing}");
            assert_eq!(second.slip().permille(), None);
        }
    }

    #[test]
    fn what_is_not_expected_is_open_from_its_edge_on_and_what_is_as_far_as_the_first_has_seen_it() {
        let mut second = begun();
        let look = |second: &mut SecondBeam, place, broken| {
            second.look(WrappedPosition::new(place), broken, APART, GAP, LEAST);
            second.open_alone()
        };
        assert_eq!(look(&mut second, 100, true), Some(WrappedPosition::new(100)));
        assert_eq!(look(&mut second, 200, false), Some(WrappedPosition::new(100)));
        assert_eq!(look(&mut second, 241, false), None);
        // The slip is known, and the first has seen it.
        second.slip.be_known();
        let detection =
            Detection { leading: WrappedPosition::new(950), trailing: WrappedPosition::new(1050), ..Detection::NONE };
        second.await_detection(detection, LEAST);
        assert_eq!(look(&mut second, 880, true), Some(WrappedPosition::new(880)), "too early for that");
        look(&mut second, 900, false);
        look(&mut second, 945, false);
        assert_eq!(look(&mut second, 950, true), None);
        let mut ends = second.clone();
        assert_eq!(look(&mut ends, 1060, false), None);
        assert_eq!(look(&mut ends, 1090, false), None, "clear ground behind it is none of it");
        assert_eq!(look(&mut second, 1069, true), None);
        assert_eq!(look(&mut second, 1070, true), Some(WrappedPosition::new(950)), "wider than that");
    }

    proptest! {
        /// Against a model that knows which edges belong together.
        #[test]
        fn the_slip_is_the_mean_of_the_last_two_plants_whatever_stands_between_them(
            plants in prop::collection::vec((900_i16..1400, 60_i16..300, -8_i16..8, any::<bool>()), 2..12),
            mean in -40_i16..45,
        ) {
            let mut second = begun();
            let (mut place, mut things, mut ways) = (0, Vec::new(), Vec::new());
            for &(gap, width, more, has_insect) in &plants {
                place += gap;
                let way = APART.0 + mean + more;
                things.push((Some((place, place + width)), Some((place + way, place + way + width))));
                ways.push(way);
                if has_insect {
                    things.push((Some((place - 400, place - 385)), Some((place - 400 + APART.0, place - 385 + APART.0))));
                }
                place += width;
            }
            things.sort_by_key(|(first, _)| *first);
            let told = news(&mut second, &things);
            prop_assert_eq!(told, ways[1..].iter().map(|_| Told::Slip).collect::<Vec<_>>());
            let last = &ways[ways.len() - 2..];
            let expected: i32 = last.iter().map(|&way| 128 * i32::from(way) / i32::from(APART.0)).sum::<i32>() - 256;
            let excess = i32::from(second.slip().excess());
            prop_assert!((excess - expected).abs() <= 3, "{} of {:?}", excess, last);
        }
    }
}
