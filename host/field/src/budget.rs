//! The loss budget: how a row's ground divides into weeded ground and losses. Its parts add up to the whole row.
//!
//! A controller records its reason for keeping the tool out, over the time of the pass ([`Reason`]). The tool's path
//! shows which ground was weeded ([`Budget::of`]). Weeded ground is [`Part::Weeded`], for any reason of the controller.
//! Other ground belongs to the reason that held when the tool passed it. If the controller had the ground open and the
//! tool did not weed it, the ground is [`Part::Swings`]: dead time, travel, and the lead that waits for both.
//!
//! A zone is the controller's own keep-out zone: a stem zone if it uses stem zones, else a whole canopy. The row tells
//! whether a plant stands in it ([`part_of`]). A zone round a weed, dust or an unknown detection is [`Part::Weeds`],
//! with its margins. Ground that was passed several times belongs to the first part, in the order of [`Part::ALL`].

use crate::ground::{share_of, union};
use crate::machine::Machine;
use crate::motion::Motion;
use crate::row::{Kind, Row};
use serde::{Deserialize, Serialize};
use std::ops::{AddAssign, Div, Index, Range};
use strum::IntoStaticStr;

/// The parts of a row's ground.
#[derive(Clone, Copy, Debug, PartialEq, Eq, IntoStaticStr)]
#[strum(serialize_all = "lowercase")]
pub enum Part {
    /// The tool worked the row's line.
    Weeded,
    /// The zone of a crop plant, without margins: its stem's, or its canopy.
    Plants,
    /// The margins of these zones.
    Margins,
    /// The zone round a detection that is no crop plant, with its margins.
    Weeds,
    /// Ground that was guarded because a plant was expected, with its margins.
    Guarded,
    /// Open ground that the tool did not weed: it swung, or was about to.
    Swings,
    /// Ground that the beam had not seen, or that was lost to a hold, an alarm, an encoder in doubt, or a machine that is
    /// too fast for its beam.
    Closed,
}

impl Part {
    /// All of them, in the order in which they claim ground.
    pub const ALL: [Self; 7] =
        [Self::Weeded, Self::Plants, Self::Margins, Self::Weeds, Self::Guarded, Self::Swings, Self::Closed];

    /// A name for programs.
    pub fn key(self) -> &'static str {
        self.into()
    }

    /// Its name.
    pub fn title(self) -> &'static str {
        match self {
            Self::Plants => "stem zones and canopies",
            Self::Weeds => "tall weeds and unknowns kept",
            Self::Guarded => "guarded ground",
            Self::Closed => "unseen, too fast, holds, alarms",
            Self::Weeded | Self::Margins | Self::Swings => self.into(),
        }
    }
}

/// Shares of a row, from 0 to 1, or their sum over several rows.
#[derive(Clone, Copy, Debug, Default, PartialEq, Serialize, Deserialize)]
pub struct Budget([f64; Part::ALL.len()]);

/// A controller's reason, for some time.
#[derive(Clone, Debug, PartialEq)]
pub struct Reason {
    /// The time.
    pub times_s: Range<f64>,
    /// The part that gets the ground which the tool passed in this time without weeding it.
    pub part: Part,
}

impl Budget {
    /// A row's budget. `weeded_mm` is a union of the ground that the tool worked. The reasons cover the whole motion.
    pub fn of(
        span_mm: &Range<f64>,
        weeded_mm: &[Range<f64>],
        reasons: &[Reason],
        machine: &Machine,
        motion: &Motion,
    ) -> Self {
        let ground = |part: Part| {
            let reasons = reasons.iter().filter(move |reason| reason.part == part);
            reasons.map(|reason| machine.worked_mm(motion, &reason.times_s)).collect::<Vec<_>>()
        };
        let (mut taken, mut share) = (Vec::new(), 0.0);
        Self(Part::ALL.map(|part| {
            taken.extend(if part == Part::Weeded { weeded_mm.to_vec() } else { ground(part) });
            taken = union(std::mem::take(&mut taken));
            let before = std::mem::replace(&mut share, share_of(span_mm, &taken));
            share - before
        }))
    }

    /// Each part with its share.
    pub fn shares(&self) -> impl Iterator<Item = (Part, f64)> {
        Part::ALL.into_iter().zip(self.0)
    }

    /// Each part in tenths of a percent, rounded so that they add up to 1000. Weeded ground is rounded to the nearest.
    /// Of the other parts those with the largest remainders are rounded up.
    pub fn tenths(&self) -> [(Part, u32); Part::ALL.len()] {
        let exact = self.0.map(|share| (1000.0 * share).max(0.0));
        let mut tenths = exact.map(|tenths| tenths as u32);
        tenths[0] = exact[0].round() as u32;
        let mut by_remainder: Vec<usize> = (1..exact.len()).collect();
        by_remainder.sort_by(|&a, &b| exact[b].fract().total_cmp(&exact[a].fract()));
        let missing = 1000_u32.saturating_sub(tenths.iter().sum()) as usize;
        by_remainder.into_iter().take(missing).for_each(|index| tenths[index] += 1);
        Part::ALL.map(|part| (part, tenths[part as usize]))
    }

    /// The largest part except weeded ground, with its share.
    pub fn largest_loss(&self) -> (Part, f64) {
        let losses = self.shares().filter(|(part, _)| *part != Part::Weeded);
        losses.fold((Part::Closed, 0.0), |most, loss| if loss.1 > most.1 { loss } else { most })
    }
}

impl Index<Part> for Budget {
    type Output = f64;

    fn index(&self, part: Part) -> &f64 {
        &self.0[part as usize]
    }
}

impl AddAssign for Budget {
    fn add_assign(&mut self, other: Self) {
        self.0.iter_mut().zip(other.0).for_each(|(share, other)| *share += other);
    }
}

impl Div<f64> for Budget {
    type Output = Self;

    fn div(self, rows: f64) -> Self {
        Self(self.0.map(|share| share / rows))
    }
}

/// The part for a controller's zone: a crop plant's, or not. A slipping wheel puts the zone beside its detection, so
/// the nearest middle decides. A zone over a plant's middle is always the plant's.
pub fn part_of(zone_mm: &Range<f64>, row: &Row) -> Part {
    let middle_mm = (zone_mm.start + zone_mm.end) / 2.0;
    let nearest_mm = |places_mm: &mut dyn Iterator<Item = f64>| {
        places_mm.map(|place_mm| (place_mm - middle_mm).abs()).fold(f64::INFINITY, f64::min)
    };
    let of =
        |kind: Kind| row.canopies().iter().filter(move |canopy| canopy.kind == kind).map(|canopy| canopy.position_mm);
    let dust = row.dust_mm.iter().map(|dust_mm| (dust_mm.start + dust_mm.end) / 2.0);
    let to_plant_mm = nearest_mm(&mut of(Kind::Plant));
    let is_over_plant = of(Kind::Plant).any(|place_mm| zone_mm.contains(&place_mm));
    if is_over_plant || to_plant_mm <= nearest_mm(&mut of(Kind::Weed).chain(dust)) { Part::Plants } else { Part::Weeds }
}

/// Collects reasons, turn by turn. Successive reasons for the same part are joined.
#[derive(Clone, Debug, Default)]
pub struct Reasons(Vec<Reason>);

impl Reasons {
    /// Sets the part from `time_s` on, until the next call.
    #[inline]
    pub fn turn_to(&mut self, part: Part, time_s: f64) {
        if self.0.last().is_some_and(|last| last.part == part) {
            return;
        }
        if let Some(last) = self.0.last_mut() {
            last.times_s.end = time_s;
        }
        self.0.push(Reason { times_s: time_s..f64::INFINITY, part });
    }

    /// All reasons. The last one holds until `end_s`.
    pub fn until(mut self, end_s: f64) -> Vec<Reason> {
        if let Some(last) = self.0.last_mut() {
            last.times_s.end = end_s;
        }
        self.0
    }
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::row::Canopy;

    #[test]
    fn parts_in_tenths_of_a_percent_add_up_to_the_whole() {
        let thirds = Budget([1.0 / 3.0, 1.0 / 3.0, 1.0 / 3.0, 0.0, 0.0, 0.0, 0.0]);
        assert_eq!(thirds.tenths().map(|(_, tenths)| tenths), [333, 334, 333, 0, 0, 0, 0]);
        let odd = Budget([0.489_46, 0.249_46, 0.120_46, 0.010_46, 0.0, 0.129_46, 0.000_7]);
        assert_eq!(odd.tenths().iter().map(|(_, tenths)| tenths).sum::<u32>(), 1000);
        assert_eq!(odd.largest_loss(), (Part::Plants, 0.249_46));
    }

    #[test]
    fn ground_belongs_to_its_first_part_and_is_counted_once() {
        let machine = Machine::default();
        // The tool begins at 0 and rolls a metre in a second.
        let motion = Motion::steady(400.0, 1e9, 1000.0, 1400.0);
        let reason = |times_s: Range<f64>, part| Reason { times_s, part };
        let reasons = [
            reason(0.0..0.3, Part::Closed),
            reason(0.3..0.5, Part::Margins),
            reason(0.45..0.7, Part::Plants),
            reason(0.7..1.0, Part::Swings),
        ];
        let budget = Budget::of(&(0.0..1000.0), &[900.0..1200.0], &reasons, &machine, &motion);
        let expected = [0.1, 0.25, 0.15, 0.0, 0.0, 0.2, 0.3];
        for ((part, share), expected) in budget.shares().zip(expected) {
            assert!((share - expected).abs() < 1e-3, "{part:?}: {share}");
        }
    }

    #[test]
    fn a_zone_belongs_to_the_canopy_with_the_nearest_middle() {
        let canopies = vec![Canopy::plant(1000.0, 150.0), Canopy::weed(1110.0, 16.0), Canopy::plant(1500.0, 20.0)];
        let mut row = Row::new(canopies).unwrap();
        row.dust_mm = vec![1300.0..1302.0];
        let part = |zone_mm: Range<f64>| part_of(&zone_mm, &row);
        assert_eq!(part(905.0..1055.0), Part::Plants);
        // The weed's zone, 20 mm early: nearer to the canopy than to the weed.
        assert_eq!(part(1082.0..1098.0), Part::Weeds);
        // Canopy and weed as one detection: its middle is nearer to the weed.
        assert_eq!(part(995.0..1125.0), Part::Plants);
        assert_eq!(part(1290.0..1292.0), Part::Weeds);
        assert_eq!(part(1470.0..1480.0), Part::Plants);
    }

    #[test]
    fn reasons_follow_each_other_without_a_gap() {
        let mut reasons = Reasons::default();
        for (part, time_s) in [(Part::Closed, 0.0), (Part::Closed, 0.1), (Part::Swings, 0.2), (Part::Plants, 0.5)] {
            reasons.turn_to(part, time_s);
        }
        let times_s: Vec<Range<f64>> = reasons.until(0.9).into_iter().map(|reason| reason.times_s).collect();
        assert_eq!(times_s, [0.0..0.2, 0.2..0.5, 0.5..0.9]);
    }
}
