//! A simulated satellite receiver on the machine. It sends the antenna's position as lines of NMEA 0183.
//!
//! The machine travels straight from a position on the earth in one direction. At a fixed rate RMC and GGA give the
//! antenna's position. Their noise to the east and to the north is normal, and independent from fix to fix. The lines
//! come some time after their moment. [`Trouble`] interrupts the fix, makes it jump, and changes bytes of lines.
//!
//! The error of a real receiver drifts over minutes instead of changing from fix to fix. The model also leaves out that
//! a machine sways and turns.

use crate::plane::{Metres, Place, Plane};
use crate::sentence::{Quality, framed};
use crate::track::Offset;
use chrono::{DateTime, Utc};
use rand::{RngExt, SeedableRng};
use rand_chacha::ChaCha8Rng;
use rand_distr::{Distribution, StandardNormal};
use std::ops::Range;

/// A receiver and its antenna's position.
#[derive(Clone, Debug)]
pub struct ReceiverSetup {
    /// Fixes a second.
    pub rate_hz: f64,
    /// The standard deviation of a fix to the east, and to the north.
    pub error_mm: f64,
    /// From the moment of a fix until its lines have come.
    pub delay_ms: f64,
    /// The beam's position relative to the antenna.
    pub beam: Offset,
    /// The beam's position before the machine has moved.
    pub from: Place,
    /// The machine's direction, in degrees from north to the east.
    pub direction_degrees: f64,
    /// When the Uno is powered up: milliseconds from 1970, UTC.
    pub began_ms: i64,
    /// The receiver's faults, if there are any.
    pub trouble: Option<Trouble>,
    /// Selects the random errors.
    pub seed: u64,
}

/// Repeated faults of a receiver.
#[derive(Clone, Debug)]
pub struct Trouble {
    /// Seconds after which it repeats.
    pub every_s: f64,
    /// When there is no fix, in seconds of that.
    pub outage_s: Range<f64>,
    /// The time during which fixes are displaced.
    pub jump_s: Range<f64>,
    /// The displacement, in metres to the north.
    pub jump_m: f64,
    /// The share of lines with a changed byte.
    pub damaged: f64,
}

impl Default for ReceiverSetup {
    /// A receiver with RTK on a machine whose antenna is half a metre behind its beam.
    fn default() -> Self {
        Self {
            rate_hz: 5.0,
            error_mm: 15.0,
            delay_ms: 0.0,
            beam: Offset { ahead_m: 0.5, right_m: 0.0 },
            from: Place { latitude: 52.279, longitude: 8.0255 },
            direction_degrees: 75.0,
            began_ms: 1_780_000_000_000,
            trouble: None,
            seed: 1,
        }
    }
}

impl Default for Trouble {
    /// Each minute there are six seconds without a fix, and three seconds of fixes that are two metres off. One line in
    /// a hundred is damaged.
    fn default() -> Self {
        Self { every_s: 60.0, outage_s: 40.0..46.0, jump_s: 20.0..23.0, jump_m: 2.0, damaged: 0.01 }
    }
}

/// A simulated receiver.
#[derive(Clone, Debug)]
pub struct SimulatedReceiver {
    setup: ReceiverSetup,
    plane: Plane,
    noise: ChaCha8Rng,
    /// Fixes so far.
    fixes: u64,
}

impl SimulatedReceiver {
    /// A receiver before its first fix.
    pub fn new(setup: ReceiverSetup) -> Self {
        let plane = Plane::around(setup.from);
        let noise = ChaCha8Rng::seed_from_u64(setup.seed);
        Self { setup, plane, noise, fixes: 0 }
    }

    /// The position of an object when the machine has travelled `distance_m`. `beside` is its offset from the beam.
    pub fn place(&self, distance_m: f64, beside: Offset) -> Place {
        self.plane.place(self.metres(distance_m, beside))
    }

    fn metres(&self, distance_m: f64, beside: Offset) -> Metres {
        let forward = Metres::toward(self.setup.direction_degrees);
        forward * distance_m + beside.along(forward)
    }

    /// The bytes up to this time, in seconds since power-up. `distance_m` returns the distance travelled at a time.
    pub fn bytes_until(&mut self, time_s: f64, distance_m: impl Fn(f64) -> f64) -> Vec<u8> {
        let mut bytes = Vec::new();
        loop {
            let moment_s = self.fixes as f64 / self.setup.rate_hz;
            if moment_s + self.setup.delay_ms / 1000.0 > time_s {
                return bytes;
            }
            self.fixes += 1;
            for line in self.sentences(moment_s, distance_m(moment_s)) {
                bytes.extend(self.sent(line));
            }
        }
    }

    fn sentences(&mut self, moment_s: f64, distance_m: f64) -> [String; 2] {
        let Offset { ahead_m, right_m } = self.setup.beam;
        let mut at = self.metres(distance_m, Offset { ahead_m: -ahead_m, right_m: -right_m });
        let mut normal = || StandardNormal.sample(&mut self.noise);
        at += Metres { east: normal(), north: normal() } * (self.setup.error_mm / 1000.0);
        let mut has_fix = true;
        if let Some(trouble) = &self.setup.trouble {
            let second = moment_s.rem_euclid(trouble.every_s);
            has_fix = !trouble.outage_s.contains(&second);
            if trouble.jump_s.contains(&second) {
                at.north += trouble.jump_m;
            }
        }
        let utc_ms = self.setup.began_ms + (moment_s * 1000.0).round() as i64;
        let quality = match self.setup.error_mm {
            ..=50.0 => Quality::Rtk,
            ..=400.0 => Quality::FloatRtk,
            ..=1000.0 => Quality::Differential,
            _ => Quality::Satellites,
        };
        let fix = has_fix.then(|| (self.plane.place(at), quality));
        [rmc(utc_ms, fix), gga(utc_ms, fix)]
    }

    /// A sentence's line, as sent.
    fn sent(&mut self, text: String) -> Vec<u8> {
        let mut bytes = framed(&text).into_bytes();
        let damaged = self.setup.trouble.as_ref().map_or(0.0, |trouble| trouble.damaged);
        if damaged > 0.0 && self.noise.random_bool(damaged) {
            let at = self.noise.random_range(0..text.len());
            bytes[at] ^= 1 << self.noise.random_range(0..7);
        }
        bytes.extend(b"\r\n");
        bytes
    }
}

/// The text of RMC for a moment, in milliseconds from 1970, UTC. `None` for a receiver without a fix.
pub fn rmc(utc_ms: i64, fix: Option<(Place, Quality)>) -> String {
    let moment = moment(utc_ms);
    let (clock, date) = (moment.format("%H%M%S%.3f"), moment.format("%d%m%y"));
    let Some((place, quality)) = fix else { return format!("GNRMC,{clock},V,,,,,,,{date},,,N") };
    format!("GNRMC,{clock},A,{},,,{date},,,{}", coordinates(place), codes(quality).0)
}

/// The text of GGA, as [`rmc`].
pub fn gga(utc_ms: i64, fix: Option<(Place, Quality)>) -> String {
    let clock = moment(utc_ms).format("%H%M%S%.3f");
    let Some((place, quality)) = fix else { return format!("GNGGA,{clock},,,,,0,00,99.9,,M,,M,,") };
    format!("GNGGA,{clock},{},{},14,0.7,60.0,M,46.0,M,,", coordinates(place), codes(quality).1)
}

fn moment(utc_ms: i64) -> DateTime<Utc> {
    DateTime::from_timestamp_millis(utc_ms).unwrap_or_default()
}

/// The mode in RMC and the quality in GGA.
fn codes(quality: Quality) -> (char, u8) {
    match quality {
        Quality::Satellites => ('A', 1),
        Quality::Differential => ('D', 2),
        Quality::FloatRtk => ('F', 5),
        Quality::Rtk => ('R', 4),
    }
}

fn coordinates(place: Place) -> String {
    // Minutes with seven decimals are 0.2 mm. Whole numbers avoid a result of sixty minutes.
    let angle = |degrees: f64| {
        let units = (degrees.abs() * 6e8).round() as u64;
        (units / 600_000_000, (units % 600_000_000) as f64 / 1e7)
    };
    let ((north, north_minutes), (east, east_minutes)) = (angle(place.latitude), angle(place.longitude));
    let (ns, ew) = (if place.latitude < 0.0 { 'S' } else { 'N' }, if place.longitude < 0.0 { 'W' } else { 'E' });
    format!("{north:02}{north_minutes:010.7},{ns},{east:03}{east_minutes:010.7},{ew}")
}
