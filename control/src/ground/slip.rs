//! Wheel slip, from detections that pass both beams.
//!
//! Consecutive detections have to agree before a slip is trusted: two, or three if the slip jumps. After `WITHOUT_SLIP` detections
//! without agreement the slip is unknown.

use crate::units::{Length, share};
use core::num::NonZero;

/// Consecutive detections without a slip until it is unknown: as few as a plant with its weeds, as many as the leaves of a canopy.
const WITHOUT_SLIP: u8 = 6;

/// Greatest difference between consecutive slips that agree, in 256ths. The ground changes by some 5 % from plant to plant. A leaf
/// at either end of a canopy adds to that.
const AGREES: u8 = 24;

/// If a slip differs from the trusted one by more than this (16 %), a third detection has to agree. Soft ground slips by 12 %, and
/// in no row does it change by more between plants.
const JUMP: u8 = 40;

/// How much farther the wheel turns than the machine rolls, in 256ths of the distance rolled; negative if less.
#[derive(Clone, Debug, PartialEq, Eq)]
pub struct Slip {
    /// The slip of the last detection, and how many consecutive ones agree with it.
    last: i8,
    agreeing: u8,
    /// The trusted slip, or the last trusted one.
    excess: i8,
    is_known: bool,
    /// Consecutive detections without agreement.
    without_slip: u8,
    change: SlipChange,
}

/// What has changed about the slip.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
#[repr(u8)]
pub enum SlipChange {
    /// No change.
    None,
    /// A detection confirmed a slip.
    Measured,
    /// Too many detections gave none: the slip is unknown.
    Lost,
}

impl Slip {
    /// No slip measured.
    pub const NONE: Self =
        Self { last: 0, agreeing: 0, excess: 0, is_known: false, without_slip: 0, change: SlipChange::None };

    /// Units in the whole: `excess` is in 256ths.
    pub const WHOLE: i16 = 256;

    /// Slip of 30 % in either direction. Anything beyond is not the same plant.
    const LEAST: i16 = -59;
    const GREATEST: i16 = 110;

    /// How much farther the wheel turns, in 256ths of the distance rolled; 0 if unknown.
    pub fn excess(&self) -> i8 {
        if self.is_known { self.excess } else { 0 }
    }

    /// The slip may have changed: it is unknown until detections agree again.
    pub(super) fn distrust(&mut self) {
        *self = Self { excess: self.excess, ..Self::NONE };
    }

    /// Whether the slip is known.
    pub(super) fn is_known(&self) -> bool {
        self.is_known
    }

    /// What has changed since the last call.
    pub(super) fn take_change(&mut self) -> SlipChange {
        core::mem::replace(&mut self.change, SlipChange::None)
    }

    /// The next detections start a new run of agreement.
    pub(super) fn break_run(&mut self) {
        self.agreeing = 0;
    }

    /// [`excess`](Self::excess), and the last trusted slip even if it is now unknown.
    pub fn present_and_last(&self) -> (i8, i8) {
        (self.excess(), self.excess)
    }

    /// Slip in thousandths of the wheel's distance, above 0 if the wheel turns farther than the machine rolls; `None` if unknown.
    #[cfg_attr(target_arch = "avr", inline(never))]
    pub fn permille(&self) -> Option<i16> {
        let turned = (Self::WHOLE + i16::from(self.excess)) as u16;
        let rolled_permille = (256_000 / u32::from(turned)) as i16;
        self.is_known.then_some(1000 - rolled_permille)
    }

    /// A detection passed both beams. `apart` is the beams' distance with the slip known so far, `travel` how far the wheel turned
    /// between them; 0 if ambiguous.
    #[cfg_attr(target_arch = "avr", inline(never))]
    pub(super) fn measure(&mut self, apart: Length, travel: Length) {
        let trusted = self.excess();
        let turned = (Self::WHOLE + i16::from(trusted)) as u16;
        let turned = share(turned, travel.0 as u16, NonZero::new(apart.0 as u16).unwrap_or(NonZero::<u16>::MIN));
        let excess = turned as i16 - Self::WHOLE;
        let (last, now) = (self.last, excess as i8);
        self.last = now;
        if !(Self::LEAST..=Self::GREATEST).contains(&excess) {
            self.agreeing = 0;
        } else if now.abs_diff(last) > AGREES {
            self.agreeing = 1;
        } else if self.agreeing < 3 {
            self.agreeing += 1;
        }
        if self.agreeing > 1 + u8::from(now.abs_diff(trusted) > JUMP) {
            self.excess = ((i16::from(last) + i16::from(now)) >> 1) as i8;
            (self.is_known, self.without_slip, self.change) = (true, 0, SlipChange::Measured);
            return;
        }
        if self.without_slip < WITHOUT_SLIP {
            self.without_slip += 1;
            if self.without_slip == WITHOUT_SLIP {
                (self.is_known, self.change) = (false, SlipChange::Lost);
            }
        }
    }
}
