//! The wheel's distance against the receiver's.
//!
//! - **The ratio** of both distances comes from straight stretches, each a line that fits the fixes over the wheel's
//!   distance. A stretch ends where the fixes leave the line; its last part is left out, because it may be in the bend
//!   already. The receiver's errors change slowly and do not average out: a stretch is as uncertain as its two ends.
//! - **The wheel spins** where it rolls on while the antenna stays.
//!
//! It does not know why they differ: another wheel, a wrong calibration, or slip.

use crate::track::{Fitted, Station};
use std::ops::Range;

/// A greater difference of the ratio from 1 is a fault, and so many standard deviations are no chance.
const WRONG: f64 = 0.02;
const DEVIATIONS: f64 = 3.0;

/// The shortest straight stretch in metres, and the greatest error of its ratio.
const SHORTEST_M: f64 = 2.0;
const GREATEST_ERROR: f64 = 0.05;

/// A machine strays from its line by so much, in metres.
const STRAYING_M: f64 = 0.03;

/// The shortest distance over which spinning is found, in metres, and in standard deviations of a fix.
const SPIN_M: f64 = 1.0;
const SPIN_DEVIATIONS: f64 = 12.0;

/// The wheel spins if the antenna moves less than this share of its distance.
const SPIN_SHARE: f64 = 0.25;

/// Metres by the receiver for a metre of the wheel.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct Ratio {
    /// The ratio.
    pub value: f64,
    /// Its standard deviation.
    pub error: f64,
}

impl Ratio {
    /// The mean of these. `None` for none. Its error is at least what they differ among each other.
    pub fn mean(of: &[Self]) -> Option<Self> {
        let weight = |ratio: &Self| ratio.error.powi(-2);
        let weights: f64 = of.iter().map(weight).sum();
        let value = of.iter().map(|ratio| weight(ratio) * ratio.value).sum::<f64>() / weights;
        let squares: f64 = of.iter().map(|ratio| weight(ratio) * (ratio.value - value).powi(2)).sum();
        let scatter = squares / (of.len() as f64 - 1.0).max(1.0);
        (!of.is_empty()).then(|| Self { value, error: (scatter.max(1.0) / weights).sqrt() })
    }

    /// Whether the wheel's distance is wrong.
    pub fn is_wrong(self) -> bool {
        let off = (self.value - 1.0).abs();
        off > WRONG && off > DEVIATIONS * self.error
    }
}

/// The ratios over the straight stretches of a track, without the places where the wheel spins.
pub(crate) fn ratios(stations: &[Station], spins: &[Range<usize>]) -> Vec<Ratio> {
    let mut ratios = Vec::new();
    let mut begin = 0;
    while let Some(first) = stations.get(begin) {
        if let Some(spin) = spins.iter().find(|spin| spin.contains(&begin)) {
            begin = spin.end;
            continue;
        }
        let mut line = Fitted::default();
        let mut end = begin;
        let is_spinning = |at: usize| at > begin && spins.iter().any(|spin| spin.start < at && at <= spin.end);
        while let Some(station) = stations.get(end).filter(|it| it.fix.track == first.fix.track && !is_spinning(end)) {
            line.add(station);
            if line.misfit_m() > allowed_m(line.error_m) {
                break;
            }
            end += 1;
        }
        // A single station is a line, so the end is behind the beginning.
        let is_bent = line.count > (end - begin) as f64;
        ratios.extend(ratio(&stations[begin..end], is_bent));
        begin = end;
    }
    ratios
}

/// The greatest misfit of a straight line.
fn allowed_m(error_m: f64) -> f64 {
    3.0 * error_m + STRAYING_M
}

/// The ratio over these stations. If the next one leaves their line, the last of them may be in the bend.
fn ratio(stations: &[Station], is_bent: bool) -> Option<Ratio> {
    let length_m = |to: &Station| (to.distance_m - stations[0].distance_m).abs();
    let all_m = length_m(stations.last()?);
    let error_m = stations.iter().map(|station| station.fix.error_m).fold(0.0, f64::max);
    // A line of this length that turns back over this end of it has the greatest misfit that counts as straight.
    let bend_m = if is_bent { (4.0 * allowed_m(error_m).powi(2) * all_m).cbrt() } else { 0.0 };
    let mut line = Fitted::default();
    stations.iter().filter(|station| length_m(station) <= all_m - bend_m).for_each(|station| line.add(station));
    let length_m = all_m - bend_m;
    let ratio = Ratio { value: line.slope().length(), error: std::f64::consts::SQRT_2 * error_m / length_m };
    (length_m >= SHORTEST_M && ratio.error <= GREATEST_ERROR && ratio.value.is_finite()).then_some(ratio)
}

/// Where the wheel spins: the first of its stations, and the last.
pub(crate) fn spins(stations: &[Station]) -> Vec<Range<usize>> {
    let mut spins: Vec<Range<usize>> = Vec::new();
    let mut last = 0;
    for (first, from) in stations.iter().enumerate() {
        let window_m = SPIN_M.max(SPIN_DEVIATIONS * from.fix.error_m);
        let rolled_m = |at: usize| (stations[at].distance_m - from.distance_m).abs();
        last = last.max(first);
        while last < stations.len() && rolled_m(last) < window_m {
            last += 1;
        }
        if last == stations.len() {
            break;
        }
        // A long window over an outage, and a jump, say nothing.
        let window = &stations[first..=last];
        let stays = |at: &Station| (at.at - from.at).length() < SPIN_SHARE * window_m && at.fix.track == from.fix.track;
        match spins.last_mut() {
            _ if !window.iter().all(stays) => {}
            Some(spin) if first <= spin.end => spin.end = last,
            _ => spins.push(first..last),
        }
    }
    spins
}
