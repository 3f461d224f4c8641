//! The servo's pulses: widths and frames, and from them the ratio of the clocks.
//!
//! The weeder's timer makes a frame of exactly 20 ms by its own crystal. The tester measures the frame by its own. So
//! the mean frame gives the ratio, which corrects every other time. If both crystals are off by the same share, no
//! measurement here can show it.

use tester_core::message::Record;
use uno::{CYCLES_PER_SECOND, Pulse};

/// A frame by the weeder's clock, in cycles.
pub const FRAME_CYCLES: f64 = CYCLES_PER_SECOND as f64 / 50.0;

/// Times are shifted by this, so that pulses before the plan's start have times above 0.
pub const ORIGIN: u64 = 1 << 31;

/// The pulses among these records, in cycles of the tester: [`ORIGIN`] is the moment `start`.
pub fn pulses(records: &[Record], start: u32) -> Vec<Pulse> {
    let pulse = |record: &Record| match *record {
        Record::Pulse { start: rise, width } => {
            let rise = ORIGIN.wrapping_add_signed((rise.wrapping_sub(start) as i32).into());
            Some(Pulse { rise, fall: rise + u64::from(width) })
        }
        _ => None,
    };
    records.iter().filter_map(pulse).collect()
}

/// Statistics of pulses with one width.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct Steady {
    /// The weeder's clock over the tester's: above 1 if the weeder's is faster.
    pub clock_ratio: f64,
    /// Mean width by the weeder's clock, in us.
    pub width_us: f64,
    /// Longest less shortest width, in us.
    pub width_spread_us: f64,
    /// Longest less shortest frame, in us.
    pub frame_spread_us: f64,
}

/// Measures pulses of constant width; `None` for fewer than three.
pub fn steady(pulses: &[Pulse]) -> Option<Steady> {
    let frames: Vec<f64> = pulses.windows(2).map(|two| (two[1].rise - two[0].rise) as f64).collect();
    if frames.len() < 2 {
        return None;
    }
    let mean = |values: &[f64]| values.iter().sum::<f64>() / values.len() as f64;
    let spread = |values: &[f64]| {
        let highest = values.iter().copied().fold(f64::NEG_INFINITY, f64::max);
        highest - values.iter().copied().fold(f64::INFINITY, f64::min)
    };
    let us = |cycles: f64| cycles * 1e6 / CYCLES_PER_SECOND as f64;
    let clock_ratio = FRAME_CYCLES / mean(&frames);
    let widths: Vec<f64> = pulses.iter().map(|pulse| (pulse.fall - pulse.rise) as f64).collect();
    Some(Steady {
        clock_ratio,
        width_us: us(mean(&widths)) * clock_ratio,
        width_spread_us: us(spread(&widths)) * clock_ratio,
        frame_spread_us: us(spread(&frames)) * clock_ratio,
    })
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn the_frame_distinguishes_the_clocks() {
        // The weeder's clock is faster by 0.3 %: its frame is shorter by the tester's.
        let frame = FRAME_CYCLES / 1.003;
        let record = |number: u32| {
            let start = (u32::MAX - 500_000).wrapping_add((f64::from(number) * frame) as u32);
            Record::Pulse { start, width: (24_000.0 / 1.003) as u32 }
        };
        let records: Vec<Record> = (0..20).map(record).collect();
        let pulses = pulses(&records, u32::MAX - 400_000);
        assert!(pulses[0].rise < ORIGIN && pulses[1].rise > ORIGIN);
        let steady = steady(&pulses).unwrap();
        assert!((steady.clock_ratio - 1.003).abs() < 1e-6, "{steady:?}");
        assert!((steady.width_us - 1500.0).abs() < 0.1, "{steady:?}");
        assert_eq!(super::steady(&pulses[..2]), None);
    }
}
