//! The second beam: what it sees some way behind the first, and the wheel's slip that follows from it.
//!
//! Each object passes both beams. How far the wheel turned in between, against how far the beams stand apart, is what a turn of the
//! wheel is worth on this ground ([`Slip`]): the median of the last three, so that one that was half seen counts for nothing, and
//! two have to agree before any is believed. Objects are paired in their order, by where the first had them; two that are not
//! as wide as each other may be two, and measure nothing.
//!
//! What only the second sees is to be judged as if the first had seen it, and is closed from its edge on until then, unless the
//! first has seen something that is yet to come. Where it happens three times running that one of them alone sees something, the other
//! is blind.
//!
//! What it does not do: measure on ground where nothing stands, and see what stands nearer to the tool than itself.

use super::{object::Object, watch::Watch};
use crate::units::{Length, Place};

/// Objects between the beams that are remembered. Of more, the first is forgotten.
const CAPACITY: usize = 4;

/// What is narrower may be an insect or a clod in one beam, and is not asked for in the other: 6.7 to 13 mm with an encoder finer than
/// 0.8 mm, and sixteen ticks with any other.
const SEEN_BY_BOTH: Length = Length(16);

/// By how much the widths may differ of what is taken for the same object.
const SAME_WIDTH: u16 = 20;

/// Objects running that one beam alone has seen, until the other is taken for blind.
const MISSED: i8 = 3;

/// Plants whose median is the slip.
const PLANTS: usize = 3;

/// What slip makes of the wheel's way: how much more it turns than the ground that is rolled over, in 256ths of that; less is
/// negative.
#[derive(Clone, Debug, PartialEq, Eq)]
pub struct Slip {
    /// By the last plants.
    by_plant: [i8; PLANTS],
    /// A bit for each of them that was measured.
    measured: u8,
    /// Their median.
    excess: i8,
}

impl Slip {
    /// Nobody has measured any.
    pub const NONE: Self = Self { by_plant: [0; PLANTS], measured: 0, excess: 0 };

    /// What a 256th is a part of.
    pub const WHOLE: i16 = 256;

    /// Slip of 30 % either way: what is beyond was no plant.
    const LEAST: i16 = -59;
    const GREATEST: i16 = 110;

    /// How much more the wheel turns, in 256ths of the ground.
    pub fn excess(&self) -> i8 {
        self.excess
    }

    /// Slip in thousandths of the wheel's way, above 0 where it turns farther than the machine rolls; none where too few plants have
    /// told it.
    #[cfg_attr(target_arch = "avr", inline(never))]
    pub fn permille(&self) -> Option<i16> {
        let turned = (Self::WHOLE + i16::from(self.excess)) as u16;
        let rolled_permille = (256_000 / u32::from(turned)) as i16;
        (self.measured > 1).then_some(1000 - rolled_permille)
    }

    /// A plant passed both beams, which stand `apart` by the slip known so far, in another way; whether slip can be told by it.
    fn measure(&mut self, apart: Length, way: Length) -> bool {
        let turned = (Self::WHOLE + i16::from(self.excess)) as u16;
        let turned = u32::from(turned) * u32::from(way.0 as u16) / u32::from((apart.0 as u16).max(1));
        let excess = turned as i16 - Self::WHOLE;
        if !(Self::LEAST..=Self::GREATEST).contains(&excess) {
            return false;
        }
        let [_, one, two] = self.by_plant;
        let three = excess as i8;
        self.by_plant = [one, two, three];
        self.excess = one.min(two).max(one.max(two).min(three));
        self.measured = self.measured << 1 | 1;
        true
    }
}

/// What comes of it that the second beam has seen an object in full, or should have.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub enum Compared {
    /// The slip was measured.
    Slip,
    /// Only the second beam has seen this, which stands here by the first.
    Alone(Object),
    /// As before, and once too often.
    FirstIsBlind,
    /// Only the first beam has seen something, once too often.
    SecondIsBlind,
}

/// Where something begins and ends.
#[derive(Clone, Copy, Debug)]
struct Passed {
    leading: Place,
    trailing: Place,
}

/// The second beam. Its places are those that the first had when it was there, by the slip known so far.
#[derive(Clone, Debug)]
pub struct SecondBeam {
    watch: Watch,
    /// What the first has seen, the last of it first, and so many of these that this one is yet to come to.
    passed: [Passed; CAPACITY],
    awaited: u8,
    /// Objects running that this one has missed and the first has seen; below 0, that the first has missed.
    missed: i8,
    slip: Slip,
}

impl SecondBeam {
    /// One that has seen nothing.
    pub const NONE: Self = Self {
        watch: Watch::NONE,
        passed: [Passed { leading: Place::new(0), trailing: Place::new(0) }; CAPACITY],
        awaited: 0,
        missed: 0,
        slip: Slip::NONE,
    };

    /// Watches from a place on, and forgets what was seen before, and what was measured with it.
    #[cfg_attr(target_arch = "avr", inline(never))]
    pub fn begin(&mut self, place: Place) {
        self.watch = Watch::start(place, false);
        (self.awaited, self.missed) = (0, 0);
        self.slip = Slip::NONE;
    }

    /// The slip that was measured.
    pub fn slip(&self) -> &Slip {
        &self.slip
    }

    /// Whether it is broken.
    pub fn is_broken(&self) -> bool {
        self.watch.is_broken()
    }

    /// Where the object begins that is in it.
    #[cfg_attr(not(target_arch = "avr"), inline)]
    pub fn open(&self) -> Option<Place> {
        self.watch.open()
    }

    /// As [`open`](Self::open), if nothing is awaited that it could be.
    #[cfg_attr(not(target_arch = "avr"), inline)]
    pub fn open_alone(&self) -> Option<Place> {
        self.open().filter(|_| self.awaited == 0)
    }

    /// The first beam has seen an object, which is to come to this one.
    #[cfg_attr(target_arch = "avr", inline(never))]
    pub fn await_object(&mut self, object: Object) {
        if object.width() < SEEN_BY_BOTH {
            return;
        }
        self.passed.copy_within(..CAPACITY - 1, 1);
        self.passed[0] = Passed { leading: object.leading, trailing: object.trailing };
        self.awaited += u8::from(usize::from(self.awaited) < CAPACITY);
    }

    /// It is at a place, broken or not, with the beams so far apart, and with so long a gap behind what is over.
    pub fn look(&mut self, place: Place, broken: bool, apart: Length, gap: Length) -> Option<Compared> {
        let Some(seen) = self.watch.edge(place, broken, gap) else { return self.miss(apart, gap) };
        // Objects come in their order, and may stand off by this whatever the wheel slips.
        let near = apart.0 as u16 / 2;
        let mut awaited = self.awaited;
        while let Some(first) = self.passed.get(usize::from(awaited).wrapping_sub(1)) {
            awaited -= 1;
            let leading = seen.leading - first.leading;
            if leading.0.unsigned_abs() < near {
                // What came before it has passed as well.
                (self.awaited, self.missed) = (awaited, 0);
                let trailing = seen.trailing - first.trailing;
                let is_same = (leading - trailing).0.unsigned_abs() <= SAME_WIDTH;
                // By the middle, which a leaf at either end moves by half.
                let way = apart + Length((leading + trailing).0 >> 1);
                return (is_same && self.slip.measure(apart, way)).then_some(Compared::Slip);
            }
        }
        if seen.width() < SEEN_BY_BOTH {
            return None;
        }
        self.missed = self.missed.min(0) - 1;
        Some(if self.missed > -MISSED { Compared::Alone(seen) } else { Compared::FirstIsBlind })
    }

    /// Whether the first object that is awaited has passed unseen, and too many before it.
    fn miss(&mut self, apart: Length, gap: Length) -> Option<Compared> {
        let awaited = self.awaited.wrapping_sub(1);
        let oldest = self.passed.get(usize::from(awaited))?;
        if self.watch.frontier() - oldest.trailing <= gap + Length(apart.0 >> 1) {
            return None;
        }
        self.awaited = awaited;
        self.missed = self.missed.max(0) + 1;
        (self.missed >= MISSED).then_some(Compared::SecondIsBlind)
    }
}

#[cfg(test)]
mod tests {
    extern crate std;
    use super::*;
    use proptest::prelude::*;
    use std::{vec, vec::Vec};

    const APART: Length = Length(400);
    const GAP: Length = Length(40);

    /// From where to where the first beam sees something, and the second, by the wheel.
    type Thing = (Option<(i16, i16)>, Option<(i16, i16)>);

    /// Rolls past things, in this order; what is told of each.
    fn compare(second: &mut SecondBeam, things: &[Thing]) -> Vec<Compared> {
        let mut told = Vec::new();
        let end = things.iter().flat_map(|(first, second)| [first, second]).flatten().map(|&(_, to)| to).max();
        for place in 0..end.unwrap_or(0) + 2 * APART.0 {
            // By the first, an object is over where the gap behind it has been seen.
            let over = things.iter().filter_map(|&(first, _)| first).find(|&(_, to)| to + GAP.0 == place);
            if let Some((from, to)) = over {
                second.await_object(Object { leading: Place::new(from), trailing: Place::new(to), cut: false });
            }
            let broken = things.iter().filter_map(|&(_, second)| second).any(|(from, to)| (from..to).contains(&place));
            // The machine's distances follow the slip.
            let apart = Length((i32::from(APART.0) * (256 + i32::from(second.slip().excess())) / 256) as i16);
            told.extend(second.look(Place::new(place) - apart, broken, apart, GAP));
        }
        told
    }

    fn begun() -> SecondBeam {
        let mut second = SecondBeam::NONE;
        second.begin(Place::new(-1000));
        second
    }

    /// A plant that the second beam sees so much farther on than the first.
    fn plant(from: i16, way: i16) -> Thing {
        (Some((from, from + 300)), Some((from + way, from + way + 300)))
    }

    #[test]
    fn two_plants_tell_the_slip_and_one_that_was_half_seen_does_not() {
        for (way, excess) in [(400, 0_i32), (444, 28), (540, 89), (330, -45)] {
            let mut second = begun();
            assert_eq!(compare(&mut second, &[plant(100, way)]), [Compared::Slip]);
            assert_eq!((second.slip().excess(), second.slip().permille()), (0, None), "{way}");
            // Of the next the second beam sees the hind part alone.
            let half = (Some((3100, 3400)), Some((3150 + way, 3400 + way)));
            assert_eq!(compare(&mut second, &[half, plant(5000, way)]), [Compared::Slip]);
            assert_eq!(i32::from(second.slip().excess()), excess, "{way}");
            let permille = 1000 - 256_000 / (256 + excess);
            assert_eq!(second.slip().permille().map(i32::from), Some(permille));
        }
    }

    #[test]
    fn what_is_beyond_thirty_percent_is_no_plant() {
        for way in [300, 580] {
            let mut second = begun();
            assert_eq!(compare(&mut second, &[plant(100, way), plant(3000, way)]), []);
            assert_eq!(second.slip().permille(), None);
        }
    }

    #[test]
    fn three_running_that_one_beam_alone_sees_have_the_other_blind() {
        let only_first = |from: i16| (Some((from, from + 300)), None);
        let only_second = |from: i16| (None, Some((from + 400, from + 700)));
        let at =
            |leading: i16| Object { leading: Place::new(leading), trailing: Place::new(leading + 300), cut: false };
        let unseen = [only_first(0), only_first(1500), only_first(3000)];
        assert_eq!(compare(&mut begun(), &unseen), [Compared::SecondIsBlind]);
        let alone = [only_second(0), only_second(1500), only_second(3000)];
        let told = [Compared::Alone(at(0)), Compared::Alone(at(1500)), Compared::FirstIsBlind];
        assert_eq!(compare(&mut begun(), &alone), told);
        let mixed = [only_first(0), only_first(1500), plant(3000, 400), only_first(4500), only_first(6000)];
        assert_eq!(compare(&mut begun(), &mixed), [Compared::Slip], "both see between them");
        let either = [only_first(0), only_first(1500), only_second(3000), only_first(4500), only_first(6000)];
        assert_eq!(compare(&mut begun(), &either), [Compared::Alone(at(3000))], "neither is blind");
    }

    #[test]
    fn what_is_narrower_than_two_beams_agree_on_is_asked_for_by_none() {
        let narrow = |from: i16| [(Some((from, from + 15)), None), (None, Some((from + 600, from + 615)))];
        let insects: Vec<_> = (0..8).flat_map(|insect| narrow(1500 * insect)).collect();
        assert_eq!(compare(&mut begun(), &insects), []);
    }

    #[test]
    fn what_only_the_second_sees_is_open_from_its_edge_on() {
        let mut second = begun();
        let look = |second: &mut SecondBeam, place, broken| {
            second.look(Place::new(place), broken, APART, GAP);
            second.open_alone()
        };
        assert_eq!(look(&mut second, 100, true), Some(Place::new(100)));
        assert_eq!(look(&mut second, 200, false), Some(Place::new(100)));
        assert_eq!(look(&mut second, 241, false), None);
        // The first has seen it.
        second.await_object(Object { leading: Place::new(950), trailing: Place::new(1050), cut: false });
        assert_eq!(look(&mut second, 1000, true), None);
        assert_eq!(look(&mut second, 1100, false), None);
    }

    proptest! {
        /// Against a model that knows which edges belong together, and sorts.
        #[test]
        fn the_slip_is_the_median_of_the_last_three_plants_whatever_stands_between_them(
            plants in prop::collection::vec((900_i16..1400, 60_i16..300, -50_i16..100, any::<bool>()), 1..12),
        ) {
            let mut second = begun();
            let (mut place, mut things, mut ways) = (0, Vec::new(), Vec::new());
            for &(gap, width, more, has_weed) in &plants {
                place += gap;
                let way = APART.0 + more;
                things.push((Some((place, place + width)), Some((place + way, place + way + width))));
                ways.push(way);
                if has_weed {
                    things.push((Some((place - 400, place - 385)), Some((place - 400 + APART.0, place - 385 + APART.0))));
                }
            }
            things.sort_by_key(|(first, _)| *first);
            let told = compare(&mut second, &things);
            prop_assert_eq!(told, ways.iter().map(|_| Compared::Slip).collect::<Vec<_>>());
            let mut last: Vec<i32> = vec![0; 3];
            last.extend(ways.iter().map(|&way| 256 * i32::from(way) / i32::from(APART.0) - 256));
            let mut last = last.split_off(last.len() - 3);
            last.sort_unstable();
            let excess = i32::from(second.slip().excess());
            prop_assert!((excess - last[1]).abs() <= 2, "{} of {:?}", excess, last);
        }
    }
}
