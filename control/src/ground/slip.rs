//! Slip, as detections that pass both beams tell it.
//!
//! Detections running have to agree before a slip is believed: two of them, and three where it jumps. Behind `UNTOLD` detections that
//! told nothing, no slip is known any more.

use crate::units::Length;

/// Detections running that told no slip, until none is known: as few as a plant with its weeds, as many as a canopy of leaves.
const UNTOLD: u8 = 6;

/// By how much the slips of detections running may differ, in 256ths: ground changes by some 5 % from plant to plant, and a leaf at either
/// end of a canopy makes some more.
const AGREES: u8 = 24;

/// A slip that differs by more from what is believed, 16 %, needs a third detection that agrees: soft ground slips by 12 %, and no row has
/// it change by more from one plant to the next.
const JUMP: u8 = 40;

/// What slip makes of the wheel's way: how much more it turns than the ground that is rolled over, in 256ths of that; less is
/// negative.
#[derive(Clone, Debug, PartialEq, Eq)]
pub struct Slip {
    /// By the last detection, and how many running agree with it.
    last: i8,
    running: u8,
    /// What is believed, or was last.
    excess: i8,
    is_known: bool,
    /// Detections running that told none.
    untold: u8,
    news: News,
}

/// What has become of the slip.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
#[repr(u8)]
pub enum News {
    /// Nothing.
    None,
    /// A detection told it.
    Told,
    /// One too many told none.
    Lost,
}

impl Slip {
    /// None was measured yet.
    pub const NONE: Self = Self { last: 0, running: 0, excess: 0, is_known: false, untold: 0, news: News::None };

    /// What a 256th is a part of.
    pub const WHOLE: i16 = 256;

    /// Slip of 30 % either way: what is beyond was no plant.
    const LEAST: i16 = -59;
    const GREATEST: i16 = 110;

    /// How much more the wheel turns, in 256ths of the ground, as far as is known.
    pub fn excess(&self) -> i8 {
        if self.is_known { self.excess } else { 0 }
    }

    /// Whether any is known.
    pub(super) fn is_known(&self) -> bool {
        self.is_known
    }

    /// As if it were known.
    #[cfg(test)]
    pub(super) fn be_known(&mut self) {
        (self.is_known, self.untold) = (true, 0);
    }

    /// What has become of it since this was last asked.
    pub(super) fn take_news(&mut self) -> News {
        core::mem::replace(&mut self.news, News::None)
    }

    /// The detections to come do not agree with those before.
    pub(super) fn break_run(&mut self) {
        self.running = 0;
    }

    /// As [`excess`](Self::excess), and what was believed until it became doubtful.
    pub fn believed(&self) -> (i8, i8) {
        (self.excess(), self.excess)
    }

    /// Slip in thousandths of the wheel's way, above 0 where it turns farther than the machine rolls; none where too few plants have
    /// told it.
    #[cfg_attr(target_arch = "avr", inline(never))]
    pub fn permille(&self) -> Option<i16> {
        let turned = (Self::WHOLE + i16::from(self.excess)) as u16;
        let rolled_permille = (256_000 / u32::from(turned)) as i16;
        self.is_known.then_some(1000 - rolled_permille)
    }

    /// A detection passed both beams, which stand `apart` by the slip known so far, in another way; none where it cannot be told.
    #[cfg_attr(target_arch = "avr", inline(never))]
    pub(super) fn measure(&mut self, apart: Length, way: Length) {
        let believed = self.excess();
        let turned = (Self::WHOLE + i16::from(believed)) as u16;
        let turned = u32::from(turned) * u32::from(way.0 as u16) / u32::from((apart.0 as u16).max(1));
        let excess = turned as i16 - Self::WHOLE;
        let (last, now) = (self.last, excess as i8);
        self.last = now;
        if !(Self::LEAST..=Self::GREATEST).contains(&excess) {
            self.running = 0;
        } else if now.abs_diff(last) > AGREES {
            self.running = 1;
        } else if self.running < 3 {
            self.running += 1;
        }
        if self.running > 1 + u8::from(now.abs_diff(believed) > JUMP) {
            self.excess = ((i16::from(last) + i16::from(now)) >> 1) as i8;
            (self.is_known, self.untold, self.news) = (true, 0, News::Told);
            return;
        }
        if self.untold < UNTOLD {
            self.untold += 1;
            if self.untold == UNTOLD {
                (self.is_known, self.news) = (false, News::Lost);
            }
        }
    }
}
