//! The antenna's track along the wheel's distance, and the positions of events on it.
//!
//! An event has a distance of the wheel, and an offset from the antenna, ahead and to the right.
//!
//! - **The antenna's position** at that distance lies between two fixes, at the wheel's share of the distance. The
//!   machine may have rolled over the same distance several times: the last time before the event was recorded counts.
//!   Several fixes of a standing wheel are averaged.
//! - **The heading** is the direction of a straight line, fitted by least squares over the wheel's distance. It uses as
//!   many fixes around the position as its error needs to fall to [`HEADING_ERROR`], but at most [`LONGEST_CHORD_M`].
//!   It is the heading of the machine, not of its motion: a machine that rolls back keeps it. Its error grows with the
//!   misfit of the line, as at a row end, where some of the fixes are in the turn.
//! - **Outages.** Two fixes are successive if at most one and a half of the receiver's intervals lie between them.
//!   Otherwise the machine is assumed to have travelled straight between them, by the wheel's distance, up to the
//!   longest allowed distance.

use crate::plane::{Metres, Place, Plane};
use crate::receiver::Fix;
use logbook::follower::STANDING_M;
use strum::{Display, IntoStaticStr};

/// The heading's error that is aimed at, in radians: 20 mm for a metre from the antenna.
pub const HEADING_ERROR: f64 = 0.02;

/// The longest distance for a heading, in metres. Rows are straight over that length.
pub const LONGEST_CHORD_M: f64 = 30.0;

/// A heading with a greater error is not used, in radians.
const NO_HEADING: f64 = 0.5;

/// Successive fixes are at most this number of the receiver's intervals apart.
const INTERVALS: f64 = 1.5;

/// How far a machine rolls back and forth behind its farthest position, in metres. Recorded events are searched back
/// to there.
const ROLLED_BACK_M: f64 = 50.0;

/// How much later than its record an event may have happened, in ms: status, fix and event each have their own delay in
/// the log.
const RECORDED_EARLY_MS: f64 = 1000.0;

/// An offset from the antenna.
#[derive(Clone, Copy, Debug, Default, PartialEq)]
pub struct Offset {
    /// Metres ahead of the antenna; negative behind it.
    pub ahead_m: f64,
    /// Metres to the right of it, seen forward; negative to the left.
    pub right_m: f64,
}

impl Offset {
    /// The same to the east and north, if `forward` is a metre in the machine's direction.
    pub(crate) fn along(self, forward: Metres) -> Metres {
        forward * self.ahead_m + forward.turned_right() * self.right_m
    }
}

/// How a position was found.
#[derive(Clone, Copy, Debug, PartialEq, Eq, IntoStaticStr)]
#[strum(serialize_all = "snake_case")]
pub enum Basis {
    /// Between two fixes that follow each other.
    Measured,
    /// Over an outage.
    Interpolated,
}

/// Why there is no position.
#[derive(Clone, Copy, Debug, PartialEq, Eq, Display)]
pub enum Missing {
    /// There is no earlier fix.
    #[strum(to_string = "no fix before it")]
    NoFixBefore,
    /// There is no later fix.
    #[strum(to_string = "no fix behind it")]
    NoFixBehind,
    /// The distance between both fixes is longer than allowed.
    #[strum(to_string = "the outage is too long")]
    OutageTooLong,
    /// The fixes have jumped between, for good.
    #[strum(to_string = "the fixes have jumped there")]
    Jumped,
    /// The fixes around do not give the machine's heading.
    #[strum(to_string = "the fixes do not show the heading")]
    NoHeading,
}

/// A position.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct Found {
    /// The place.
    pub place: Place,
    /// How it was found.
    pub basis: Basis,
    /// Its standard deviation in metres, from that of the fixes. The error of an outage is not included.
    pub error_m: f64,
    /// The time when the antenna was there, in milliseconds UTC as in the fixes.
    pub utc_ms: i64,
    /// The session of that time, as in the fixes.
    pub session: usize,
}

/// A fix on the track, or the mean of several of a standing wheel.
#[derive(Clone, Copy, Debug)]
pub(crate) struct Station {
    /// The first of them, with the greatest of their errors.
    pub(crate) fix: Fix,
    pub(crate) distance_m: f64,
    pub(crate) at: Metres,
    /// Number of fixes in its mean.
    fixes: f64,
    /// Time of the last of them.
    until_ms: f64,
}

/// The antenna's track along the wheel's distance.
#[derive(Clone, Debug)]
pub struct Track {
    plane: Plane,
    pub(crate) stations: Vec<Station>,
    interval_ms: f64,
    longest_outage_m: f64,
}

impl Track {
    /// The track through these fixes in order of time, each with the wheel's distance in metres.
    pub fn through(fixes: &[(f64, Fix)], longest_outage_m: f64) -> Self {
        let plane = Plane::around(fixes.first().map_or(Place::default(), |(_, fix)| fix.place));
        let mut stations: Vec<Station> = Vec::with_capacity(fixes.len());
        for &(distance_m, fix) in fixes {
            let at = plane.metres(fix.place);
            let stands =
                |last: &&mut Station| last.fix.track == fix.track && (distance_m - last.distance_m).abs() < STANDING_M;
            if let Some(last) = stations.last_mut().filter(stands) {
                last.fixes += 1.0;
                last.at += (at - last.at) / last.fixes;
                last.fix.error_m = last.fix.error_m.max(fix.error_m);
                last.until_ms = fix.time_ms;
            } else {
                stations.push(Station { fix, distance_m, at, fixes: 1.0, until_ms: fix.time_ms });
            }
        }
        let mut intervals: Vec<f64> = fixes.windows(2).map(|pair| pair[1].1.time_ms - pair[0].1.time_ms).collect();
        intervals.sort_by(f64::total_cmp);
        let interval_ms = intervals.get(intervals.len() / 2).copied().unwrap_or(f64::INFINITY);
        Self { plane, stations, interval_ms, longest_outage_m }
    }

    /// The position of an event with this offset from the antenna, at this distance of the wheel. It was recorded at
    /// this time of the log's clock.
    ///
    /// # Errors
    /// Why it has no position.
    pub fn find(&self, distance_m: f64, recorded_ms: f64, offset: Offset) -> Result<Found, Missing> {
        let first = self.passed(distance_m, recorded_ms)?;
        let (from, to) = (&self.stations[first], &self.stations[first + 1]);
        if from.fix.track != to.fix.track {
            return Err(Missing::Jumped);
        }
        // The wheel stands at the beginning of the pair, and at its end.
        let session = from.fix.session;
        let began = from.fix.utc_ms as f64 + (from.until_ms - from.fix.time_ms);
        let logged_ms = to.fix.time_ms - from.until_ms;
        let passed_ms = if to.fix.session == session { to.fix.utc_ms as f64 - began } else { logged_ms };
        // The log's clock stands still while some computers sleep.
        let is_outage = to.fix.session != session || logged_ms.max(passed_ms) > INTERVALS * self.interval_ms;
        let basis = if is_outage { Basis::Interpolated } else { Basis::Measured };
        if is_outage && (to.distance_m - from.distance_m).abs() > self.longest_outage_m {
            return Err(Missing::OutageTooLong);
        }
        let share = (distance_m - from.distance_m) / (to.distance_m - from.distance_m);
        let mut at = from.at + (to.at - from.at) * share;
        let mut error_m = from.fix.error_m.max(to.fix.error_m);
        let beside_m = offset.ahead_m.hypot(offset.right_m);
        if beside_m > 0.0 {
            let (forward, heading_error) = self.heading(first, distance_m).ok_or(Missing::NoHeading)?;
            at += offset.along(forward);
            error_m = error_m.hypot(beside_m * heading_error);
        }
        let utc_ms = (began + share * passed_ms).round() as i64;
        Ok(Found { place: self.plane.place(at), basis, error_m, utc_ms, session })
    }

    /// The first of the two fixes between which the wheel passed this distance for the last time before the event was
    /// recorded.
    fn passed(&self, distance_m: f64, recorded_ms: f64) -> Result<usize, Missing> {
        let before = self.stations.partition_point(|station| station.fix.time_ms <= recorded_ms + RECORDED_EARLY_MS);
        for first in (0..before).rev() {
            let from_m = self.stations[first].distance_m;
            let Some(to) = self.stations.get(first + 1) else { continue };
            let (low, high) = (from_m.min(to.distance_m), from_m.max(to.distance_m));
            // The fixes of a standstill are one station, which lies where the first of them does: the track ends a little beyond.
            let beyond = if first + 2 == self.stations.len() { STANDING_M } else { 0.0 };
            if (low - beyond..=high + beyond).contains(&distance_m) && high > low {
                return Ok(first);
            }
            if high < distance_m - ROLLED_BACK_M.max(self.longest_outage_m) {
                break;
            }
        }
        // It was recorded before the next fix, or before all fixes.
        let farthest =
            self.stations[..before].iter().map(|station| station.distance_m).fold(f64::NEG_INFINITY, f64::max);
        Err(if distance_m > farthest && before > 0 { Missing::NoFixBehind } else { Missing::NoFixBefore })
    }

    /// The machine's heading between a fix and the next, as a metre forward, and its standard deviation in radians.
    fn heading(&self, first: usize, distance_m: f64) -> Option<(Metres, f64)> {
        let stations = &self.stations;
        let track = stations[first].fix.track;
        let is_in = |station: &Station| {
            station.fix.track == track && (station.distance_m - distance_m).abs() <= LONGEST_CHORD_M / 2.0
        };
        let (mut begin, mut end) = (first, first + 2);
        let mut line = Fitted::default();
        stations[begin..end].iter().for_each(|station| line.add(station));
        let mut best = line;
        loop {
            if line.heading_error() < best.heading_error() {
                best = line;
            }
            let behind = begin.checked_sub(1).filter(|&at| is_in(&stations[at]));
            let ahead = stations.get(end).filter(|station| is_in(station));
            let error = best.heading_error();
            if error <= HEADING_ERROR || (behind.is_none() && ahead.is_none()) {
                let length = best.slope().length();
                return (error <= NO_HEADING && length > 0.0).then(|| (best.slope() / length, error));
            }
            behind.into_iter().for_each(|at| line.add(&stations[at]));
            ahead.into_iter().for_each(|station| line.add(station));
            begin = behind.unwrap_or(begin);
            end += usize::from(ahead.is_some());
        }
    }
}

/// The straight line that fits some fixes over the wheel's distance, by least squares.
#[derive(Clone, Copy, Debug, Default)]
pub(crate) struct Fitted {
    /// The first fix, from which the others count.
    origin: Option<(f64, Metres)>,
    /// Number of fixes.
    pub(crate) count: f64,
    /// The greatest error of a fix.
    pub(crate) error_m: f64,
    /// Sums of distances and positions, and of their squares and products.
    distance: f64,
    at: Metres,
    distance_distance: f64,
    distance_at: Metres,
    at_at: Metres,
    east_north: f64,
}

impl Fitted {
    pub(crate) fn add(&mut self, station: &Station) {
        let (distance_m, at) = *self.origin.get_or_insert((station.distance_m, station.at));
        let (distance, at) = (station.distance_m - distance_m, station.at - at);
        self.count += 1.0;
        self.error_m = self.error_m.max(station.fix.error_m);
        self.distance += distance;
        self.at += at;
        self.distance_distance += distance * distance;
        self.distance_at += at * distance;
        self.at_at += Metres { east: at.east * at.east, north: at.north * at.north };
        self.east_north += at.east * at.north;
    }

    /// The sum of the squared distances from their mean.
    fn spread(&self) -> f64 {
        self.distance_distance - self.distance * self.distance / self.count
    }

    /// Metres to the east and north for each metre of the wheel.
    pub(crate) fn slope(&self) -> Metres {
        (self.distance_at - self.at * (self.distance / self.count)) / self.spread()
    }

    /// The variances of the positions to the east and north, and their covariance.
    fn variances(&self) -> (f64, f64, f64) {
        let mean = self.at / self.count;
        let variance = |squares: f64, mean: f64| squares / self.count - mean * mean;
        let covariance = self.east_north / self.count - mean.east * mean.north;
        (variance(self.at_at.east, mean.east), variance(self.at_at.north, mean.north), covariance)
    }

    /// How far the fixes are from the line, as the root of the mean square. 0 for fixes of one distance.
    pub(crate) fn misfit_m(&self) -> f64 {
        let (east, north, _) = self.variances();
        let along = self.slope().length().powi(2) * self.spread() / self.count;
        (east + north - along).max(0.0).sqrt()
    }

    /// The standard deviation of its direction in radians: by the error of the fixes, and by the bend in which they are.
    fn heading_error(&self) -> f64 {
        let slope = self.slope();
        let forward = slope / slope.length();
        let (east, north, covariance) = self.variances();
        // The variance beside the line.
        let beside = east * forward.north.powi(2) + north * forward.east.powi(2)
            - 2.0 * covariance * forward.east * forward.north;
        // What the fixes' own error does not explain is a bend. Its error does not become less with more fixes.
        let bend = (beside - self.error_m.powi(2)).max(0.0);
        let error = (self.error_m.powi(2) / self.spread() + bend * self.count / self.spread()).sqrt();
        if error.is_nan() { f64::INFINITY } else { error }
    }
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::sentence::Quality;
    use proptest::prelude::*;

    const FIELD: Place = Place { latitude: -33.4, longitude: -179.999_99 };

    /// Fixes once a second, at half a metre a second. `at` returns the antenna's position after a distance in metres.
    fn driven(distances_m: impl IntoIterator<Item = f64>, at: impl Fn(f64) -> Metres) -> Vec<(f64, Fix)> {
        let plane = Plane::around(FIELD);
        let fix = |(second, distance_m): (usize, f64)| {
            let (time_ms, utc_ms) = (1000.0 * second as f64, 1000 * second as i64);
            let place = plane.place(at(distance_m));
            (distance_m, Fix { time_ms, utc_ms, session: 0, place, quality: Quality::Rtk, error_m: 0.015, track: 0 })
        };
        distances_m.into_iter().enumerate().map(fix).collect()
    }

    fn eastward(distance_m: f64) -> Metres {
        Metres { east: distance_m, north: 0.0 }
    }

    fn track(fixes: &[(f64, Fix)]) -> Track {
        Track::through(fixes, 20.0)
    }

    fn every_half_metre(count: u32) -> impl Iterator<Item = f64> {
        (0..count).map(|second| 0.5 * f64::from(second))
    }

    #[track_caller]
    fn off_m(found: Result<Found, Missing>, metres: Metres) -> f64 {
        (Plane::around(FIELD).metres(found.expect("it has a place").place) - metres).length()
    }

    #[test]
    fn the_track_reaches_to_where_the_machine_stands_at_its_end() {
        // The fixes of the standstill are one station, at the first of them.
        let distances_m = every_half_metre(10).chain([4.998, 5.0, 5.0]);
        let track = track(&driven(distances_m, eastward));
        for distance_m in [4.998, 5.0, 5.002] {
            let found = track.find(distance_m, 12_000.0, Offset::default());
            assert!(off_m(found, eastward(distance_m)) < 0.005);
        }
        assert_eq!(track.find(5.01, 12_000.0, Offset::default()), Err(Missing::NoFixBehind));
    }

    proptest! {
        #[test]
        fn on_a_straight_row_positions_are_right_for_every_direction_and_offset(
            direction in 0.0..360.0_f64, distance_m in 0.1..29.4_f64, ahead_m in -3.0..3.0_f64, right_m in -3.0..3.0_f64,
        ) {
            let forward = Metres::toward(direction);
            let fixes = driven(every_half_metre(60), |distance_m| forward * distance_m);
            let track = track(&fixes);
            let found = track.find(distance_m, 2000.0 * distance_m, Offset { ahead_m, right_m });
            let expected = forward * (distance_m + ahead_m) + forward.turned_right() * right_m;
            prop_assert!(off_m(found, expected) < 1e-4);
            prop_assert_eq!(found.expect("it has a place").utc_ms, (2000.0 * distance_m).round() as i64);
        }

        #[test]
        fn events_in_a_short_outage_lie_between_the_fixes_around_it(
            lost in 2..50_u32, length in 1..40_u32, distance_m in 0.0..29.0_f64,
        ) {
            let fixes = driven(every_half_metre(60), eastward);
            let kept: Vec<_> =
                fixes.iter().enumerate().filter(|(at, _)| !(lost..lost + length).contains(&(*at as u32))).map(|(_, it)| *it).collect();
            let track = Track::through(&kept, 10.0);
            let found = track.find(distance_m, 2000.0 * distance_m, Offset::default());
            let end_m = 0.5 * f64::from(lost + length);
            let has_no_end = end_m > 29.5;
            // A machine may still stand at the track's last fix a little beyond it.
            let outage = 0.5 * f64::from(lost - 1) + if has_no_end { STANDING_M } else { 0.0 }..end_m;
            let expected = eastward(distance_m);
            if !outage.contains(&distance_m) {
                prop_assert_eq!(found.map(|found| found.basis), Ok(Basis::Measured));
                prop_assert!(off_m(found, expected) < 1e-4);
            } else if has_no_end {
                prop_assert_eq!(found, Err(Missing::NoFixBehind));
            } else if outage.end - outage.start > 10.0 {
                prop_assert_eq!(found, Err(Missing::OutageTooLong));
            } else {
                prop_assert_eq!(found.map(|found| found.basis), Ok(Basis::Interpolated));
                prop_assert!(off_m(found, expected) < 1e-4);
            }
        }
    }

    #[test]
    fn before_the_first_fix_and_behind_the_last_there_is_no_place() {
        let fixes = driven(every_half_metre(10), eastward);
        let track = track(&fixes);
        assert_eq!(track.find(-0.1, 5000.0, Offset::default()), Err(Missing::NoFixBefore));
        assert_eq!(track.find(4.6, 9000.0, Offset::default()), Err(Missing::NoFixBehind));
        assert_eq!(track.find(1.0, -1500.0, Offset::default()), Err(Missing::NoFixBefore));
        assert_eq!(Track::through(&[], 20.0).find(0.0, 0.0, Offset::default()), Err(Missing::NoFixBefore));
    }

    #[test]
    fn a_machine_that_rolls_back_keeps_its_heading_and_the_last_pass_counts() {
        // Four metres forward, two back on the same line, and forward on another line, a metre to the north.
        let ways = (0..=8).chain((4..8).rev()).chain(5..=12).map(|step| 0.5 * f64::from(step));
        let mut fixes = driven(ways, eastward);
        let plane = Plane::around(FIELD);
        for (distance_m, fix) in &mut fixes[13..] {
            fix.place = plane.place(Metres { east: *distance_m, north: 1.0 });
        }
        let track = track(&fixes);
        let ahead = Offset { ahead_m: 1.0, right_m: 0.0 };
        assert!(off_m(track.find(3.25, 7000.0, ahead), eastward(4.25)) < 1e-3);
        assert!(off_m(track.find(3.25, 10_400.0, ahead), eastward(4.25)) < 1e-3, "on the way back");
        let later = track.find(3.25, 16_000.0, Offset::default());
        assert!(off_m(later, Metres { east: 3.25, north: 1.0 }) < 1e-3);
    }

    #[test]
    fn at_a_row_end_the_error_covers_a_heading_that_reaches_into_the_turn() {
        // Ten metres to the east, and then around a circle of 1.5 m, with a receiver whose heading needs a long line.
        let at = |distance_m: f64| match distance_m - 10.0 {
            ..0.0 => eastward(distance_m),
            turned_m => {
                let (sin, cos) = (turned_m / 1.5).sin_cos();
                Metres { east: 10.0 + 1.5 * sin, north: 1.5 - 1.5 * cos }
            }
        };
        let mut fixes = driven(every_half_metre(30), at);
        fixes.iter_mut().for_each(|(_, fix)| fix.error_m = 0.1);
        let track = track(&fixes);
        for distance_m in (0..28).map(|step| f64::from(step) / 2.0) {
            let found = track.find(distance_m, 30_000.0, Offset { ahead_m: 1.0, right_m: 0.0 });
            let Ok(Found { error_m, .. }) = found else { continue };
            let turned = f64::max(0.0, (distance_m - 10.0) / 1.5);
            let forward = Metres { east: turned.cos(), north: turned.sin() };
            let off_m = off_m(found, at(distance_m) + forward);
            assert!(off_m <= 2.0 * error_m, "at {distance_m}: {off_m} m off, and {error_m}");
        }
    }

    #[test]
    fn where_the_fixes_have_jumped_for_good_nothing_is_interpolated() {
        let mut fixes = driven(every_half_metre(20), eastward);
        fixes[10..].iter_mut().for_each(|(_, fix)| fix.track = 1);
        let track = track(&fixes);
        assert_eq!(track.find(4.75, 9500.0, Offset::default()), Err(Missing::Jumped));
        assert!(track.find(4.25, 9500.0, Offset { ahead_m: 1.0, right_m: 0.0 }).is_ok());
    }

    #[test]
    fn a_standing_machine_is_at_the_mean_of_its_fixes() {
        let mut fixes = driven([0.0, 0.0, 0.0, 0.5], eastward);
        let plane = Plane::around(FIELD);
        for (at, north) in [(0, 0.3), (1, -0.3), (2, 0.6)] {
            fixes[at].1.place = plane.place(Metres { east: 0.0, north });
        }
        fixes.iter_mut().for_each(|(_, fix)| fix.error_m = 0.5);
        let track = track(&fixes);
        assert!(off_m(track.find(0.0, 4000.0, Offset::default()), Metres { east: 0.0, north: 0.2 }) < 1e-4);
        let beside = Offset { ahead_m: 1.0, right_m: 0.0 };
        assert_eq!(track.find(0.25, 4000.0, beside), Err(Missing::NoHeading));
    }
}
