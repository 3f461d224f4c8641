//! A satellite receiver, read sentence by sentence: its fixes on the log's clock, and its faults.
//!
//! [`Receiver::take`] gets each line with the time at which it came, and [`Receiver::rolled`] gets the wheel's
//! distance. Both are called while a log is written, to add marks, and when it is read. The same lines give the same
//! fixes and marks.
//!
//! - **Moments.** RMC and GGA of the same time are one fix, at the position with more digits. It is returned when the
//!   next moment begins, or by [`Receiver::end`]. A time belongs to the day on which it agrees best with the log's clock.
//! - **Date.** Each session has its own: the one on which most of its lines agree, with the midnights between them. It
//!   may be wrong in some lines. A session ends when the log is opened again, and when the receiver's time and the log's
//!   clock part by more than the longest delay. So it does where the PC slept, and where the receiver finds the time.
//! - **Time.** A line comes some time after its moment. The delay varies, because other lines go first on the wire and
//!   the PC is busy. The receiver uses the shortest delay of the last ten or twenty seconds, since the real delay
//!   cannot be longer. The antenna's setting `delay_ms` covers the rest. If the delay rises by whole seconds and stays,
//!   or the time goes back, the receiver's clock has stepped back. Fixes wait until that is clear.
//! - **Jumps.** A fix is dropped if it is farther from the last fix than the wheel's distance and both errors explain.
//!   If dropped fixes agree with each other for [`AGREEING_MS`], the earlier fixes may have been wrong. The track then
//!   starts again with the first of them.

mod delay;
mod heard;

pub use self::heard::{Counts, Fix, Jump, Mark};

use self::delay::{LONGEST_DELAY_MS, LeastAhead};
use crate::plane::Place;
use crate::sentence::{DAY_MS, Finder, Line, Quality, Report};
use logbook::follower::WHEEL_GAP_MS;
use std::collections::BTreeMap;

/// After a jump, fixes are accepted again once they have agreed for this time, in ms.
pub const AGREEING_MS: f64 = 10_000.0;

/// And the number of fixes that must agree.
const AGREEING: usize = 5;

/// The distance of two fixes, in standard deviations, that is a jump. Noise exceeds it once in ten million cases.
const DEVIATIONS: f64 = 8.0;

/// Further distance of two fixes of the best receiver, such as by the antenna's swaying, in metres.
const SWAY_M: f64 = 0.25;

/// Greatest ratio of the machine's distance to the wheel's: the machine may skid.
const SKIDDING: f64 = 1.1;

/// The least rise of the delay that may be a step of the receiver's clock, and for how long it must stay, in ms.
const LEAST_STEP_MS: f64 = 500.0;
const STEP_STAYS_MS: f64 = 2000.0;

/// The greatest difference of such a rise from whole seconds, and between its lines, in ms.
const STEP_JITTER_MS: f64 = 300.0;

#[derive(Clone, Copy, Debug, Default)]
struct Moment {
    arrived_ms: f64,
    /// Since the midnight before the session's first line.
    utc_ms: i64,
    place: Option<Place>,
    /// The last digit of the position in metres.
    digit_m: f64,
    is_valid: bool,
    quality: Option<Quality>,
    /// The wheel when the first line came.
    wheel: Option<Wheel>,
    /// Whether it is over. Later lines of it are not used.
    is_over: bool,
}

impl Moment {
    /// By how much the log's clock is ahead of UTC.
    fn ahead_ms(&self) -> f64 {
        self.arrived_ms - self.utc_ms as f64
    }
}

/// The last report of the wheel, by the log's clock.
#[derive(Clone, Copy, Debug)]
struct Wheel {
    time_ms: f64,
    rolled_m: f64,
    speed_mm_s: f64,
}

/// A fix, and how far the wheel had rolled.
#[derive(Clone, Copy, Debug)]
struct Rolled {
    fix: Fix,
    rolled_m: f64,
}

/// A receiver.
#[derive(Clone, Debug, Default)]
pub struct Receiver {
    /// The fix's standard deviation, if the user knows it.
    pub(crate) error_m: Option<f64>,
    /// The counts so far.
    pub counts: Counts,
    /// The complete fixes that the caller has not taken yet: several if fixes that had jumped are accepted after all.
    pub fixes: Vec<Fix>,
    /// The marks that the caller has not taken yet.
    pub marks: Vec<Mark>,
    moment: Option<Moment>,
    /// For each session, how many lines have which day as that of its first line, from 1970.
    first_days: Vec<BTreeMap<i64, u64>>,
    least_ahead: LeastAhead,
    /// The last moment that has its time, in UTC.
    timed_utc_ms: i64,
    /// Moments whose delay has risen. It is not clear yet whether they came late or the receiver's clock has stepped.
    risen: Vec<Moment>,
    has_fix: Option<bool>,
    wheel: Option<Wheel>,
    last: Option<Rolled>,
    /// Fixes that have jumped and agree with each other.
    jumped: Vec<Rolled>,
    track: u32,
}

impl Receiver {
    /// A receiver without output so far. The error is the standard deviation of a fix to the east and to the north, in
    /// metres. If it is `None`, the usual one of the reported quality is used.
    pub fn new(error_m: Option<f64>) -> Self {
        Self { error_m, ..Self::default() }
    }

    /// For each session, the midnight from which [`Fix::utc_ms`] counts, in milliseconds since the first of January
    /// 1970. `None` if no date is that of most of its lines.
    pub fn midnights_ms(&self) -> Vec<Option<i64>> {
        let midnight_ms = |first_days: &BTreeMap<i64, u64>| {
            let all: u64 = first_days.values().sum();
            first_days.iter().find(|(_, lines)| 2 * **lines > all).map(|(day, _)| day * DAY_MS)
        };
        self.first_days.iter().map(midnight_ms).collect()
    }

    /// Reports the wheel's total distance at a time of the log's clock, and its speed in mm/s.
    pub fn rolled(&mut self, time_ms: f64, rolled_m: f64, speed_mm_s: f64) {
        self.wheel = Some(Wheel { time_ms, rolled_m, speed_mm_s });
    }

    /// The Uno has restarted: the distance until the next status is unknown.
    pub fn wheel_lost(&mut self) {
        self.wheel = None;
        if let Some(moment) = &mut self.moment {
            moment.wheel = None;
        }
        self.last = None;
        self.jumped.clear();
    }

    /// Takes a line that came at this time of the log's clock.
    pub fn take(&mut self, time_ms: f64, line: &str) {
        // A log of an earlier version has lines with several sentences, or with something in front.
        for sentence in Finder::all(line.as_bytes()) {
            match Line::parse(&sentence) {
                Line::Report(report) => self.report(time_ms, report),
                Line::Other => {}
                Line::Damaged => self.counts.damaged += 1,
            }
        }
    }

    /// The end of the log: the last moment's fix is complete.
    pub fn end(&mut self) {
        self.complete();
        self.release();
    }

    /// The log is opened again: the next line begins a session.
    pub fn log_opened(&mut self) {
        self.end();
        self.moment = None;
    }

    /// The receiver is gone or silent.
    pub fn silent(&mut self) {
        self.end();
        self.no_fix();
    }

    fn report(&mut self, arrived_ms: f64, report: Report) {
        let Some(time_ms) = report.time_ms else {
            // A receiver without a satellite so far has no time.
            self.complete();
            return self.no_fix();
        };
        let utc_ms = self.utc_ms(arrived_ms, time_ms);
        let is_its =
            |moment: Moment| utc_ms == Some(moment.utc_ms) && arrived_ms - moment.arrived_ms < LONGEST_DELAY_MS;
        if !self.moment.is_some_and(is_its) {
            self.complete();
            if utc_ms.is_none() {
                self.release();
                self.least_ahead.forget();
                self.first_days.push(BTreeMap::new());
            }
            let (utc_ms, wheel) = (utc_ms.unwrap_or(time_ms), self.wheel);
            let new = Moment { arrived_ms, utc_ms, wheel, digit_m: f64::INFINITY, is_valid: true, ..Moment::default() };
            self.moment = Some(new);
        }
        let Some(moment) = &mut self.moment else { return };
        if let (Some(day), Some(first_days)) = (report.day, self.first_days.last_mut()) {
            *first_days.entry(day - moment.utc_ms.div_euclid(DAY_MS)).or_default() += 1;
        }
        moment.is_valid &= report.place.is_some();
        if report.place.is_some() && report.digit_m < moment.digit_m {
            (moment.place, moment.digit_m) = (report.place, report.digit_m);
        }
        moment.quality = moment.quality.max(report.quality);
    }

    /// A time of day on the day on which it agrees best with the log's clock. `None` if a session begins with it.
    fn utc_ms(&self, arrived_ms: f64, time_ms: i64) -> Option<i64> {
        let last = self.moment?;
        let days = ((arrived_ms - last.ahead_ms() - time_ms as f64) / DAY_MS as f64).round() as i64;
        let utc_ms = days * DAY_MS + time_ms;
        ((arrived_ms - utc_ms as f64 - last.ahead_ms()).abs() < LONGEST_DELAY_MS).then_some(utc_ms)
    }

    fn no_fix(&mut self) {
        if self.has_fix != Some(false) {
            self.has_fix = Some(false);
            self.counts.losses += 1;
            self.marks.push(Mark::Lost);
        }
    }

    /// Ends the pending moment.
    fn complete(&mut self) {
        let Some(moment) = self.moment.as_mut().filter(|moment| !moment.is_over) else { return };
        moment.is_over = true;
        let moment = *moment;
        if moment.place.is_none() || !moment.is_valid {
            return self.no_fix();
        }
        if self.has_fix != Some(true) {
            self.has_fix = Some(true);
            self.marks.push(Mark::Found(moment.quality.unwrap_or(Quality::Satellites)));
        }
        self.time(moment);
    }

    /// Gives a moment its time, or keeps it until it is clear whether the receiver's clock has stepped back.
    fn time(&mut self, moment: Moment) {
        let least_ms = self.least_ahead.ms().unwrap_or(moment.ahead_ms());
        let rise_ms = |moment: &Moment| moment.ahead_ms() - least_ms;
        let has_risen = (LEAST_STEP_MS..LONGEST_DELAY_MS).contains(&rise_ms(&moment));
        let stays = |first: &Moment| (moment.ahead_ms() - first.ahead_ms()).abs() < STEP_JITTER_MS;
        if !has_risen || !self.risen.first().is_none_or(stays) {
            // They came late.
            self.release();
        }
        if !has_risen {
            return self.judge(moment);
        }
        self.risen.push(moment);
        let first = self.risen[0];
        let rise_s = self.risen.iter().map(rise_ms).fold(f64::INFINITY, f64::min) / 1000.0;
        let is_whole = (rise_s - rise_s.round()).abs() < STEP_JITTER_MS / 1000.0;
        let has_stayed = moment.arrived_ms - first.arrived_ms >= STEP_STAYS_MS;
        // A time that goes back is a step in any case.
        if first.utc_ms < self.timed_utc_ms || (has_stayed && is_whole) {
            self.least_ahead.forget();
            self.marks.push(Mark::Stepped(rise_s));
        }
        if has_stayed || self.least_ahead.ms().is_none() {
            self.release();
        }
    }

    /// Gives the kept moments their time.
    fn release(&mut self) {
        std::mem::take(&mut self.risen).into_iter().for_each(|moment| self.judge(moment));
    }

    /// Compares a moment's fix with the last one, and with the wheel.
    fn judge(&mut self, moment: Moment) {
        let Some(place) = moment.place else { return };
        let time_ms = moment.utc_ms as f64 + self.least_ahead.take(moment.arrived_ms, moment.ahead_ms());
        self.timed_utc_ms = moment.utc_ms;
        let quality = moment.quality.unwrap_or(Quality::Satellites);
        // A receiver may cut its digits instead of rounding them.
        let digits_m = moment.digit_m / 3_f64.sqrt();
        let error_m = self.error_m.unwrap_or_else(|| quality.usual_error_m()).hypot(digits_m);
        let (utc_ms, track) = (moment.utc_ms, self.track);
        let session = self.first_days.len().saturating_sub(1);
        let wheel = moment.wheel.filter(|wheel| time_ms - wheel.time_ms <= WHEEL_GAP_MS);
        let fix = Fix { time_ms, utc_ms, session, place, quality, error_m, track };
        let rolled_m = wheel.map_or(0.0, |wheel| {
            // The wheel is reported ten times a second. A line that came much too late has a position that is no longer
            // known here.
            let since_s = ((fix.time_ms - wheel.time_ms) / 1000.0).clamp(-1.0, 1.0);
            wheel.rolled_m + wheel.speed_mm_s / 1000.0 * since_s
        });
        let here = Rolled { fix, rolled_m };
        // As the wheel rolls on, the machine could have reached the position of the jumped fixes. But these agree with
        // each other.
        let agrees = self.jumped.last().is_some_and(|jumped| Self::follows(jumped, &here));
        let has_jumped = |last: &Rolled| wheel.is_some() && (agrees || !Self::follows(last, &here));
        let Some(last) = self.last.filter(has_jumped) else {
            self.jumped.clear();
            return self.accept(here);
        };
        // The log's clock stands still while some computers sleep. How far the wheel has rolled since is unknown.
        let slept_ms = (utc_ms - last.fix.utc_ms) as f64 - (time_ms - last.fix.time_ms);
        if last.fix.session != session || slept_ms > WHEEL_GAP_MS {
            self.jumped.clear();
            self.track += 1;
            return self.accept(Rolled { fix: Fix { track: self.track, ..fix }, rolled_m });
        }
        self.counts.jumps += 1;
        let far_m = last.fix.place.distance_m(fix.place);
        let rolled_m = (rolled_m - last.rolled_m).abs();
        self.marks.push(Mark::Jumped(Jump { place: fix.place, time_ms: fix.time_ms, far_m, rolled_m }));
        if !agrees {
            self.jumped.clear();
        }
        self.jumped.push(here);
        let agree_ms = self.jumped.first().map_or(0.0, |first| fix.time_ms - first.fix.time_ms);
        if self.jumped.len() >= AGREEING && agree_ms >= AGREEING_MS {
            self.track += 1;
            self.marks.push(Mark::Stayed);
            for mut jumped in std::mem::take(&mut self.jumped) {
                jumped.fix.track = self.track;
                self.accept(jumped);
            }
        }
    }

    /// Whether the machine can have travelled from one fix to the other.
    fn follows(from: &Rolled, to: &Rolled) -> bool {
        let room_m = SWAY_M + DEVIATIONS * from.fix.error_m.max(to.fix.error_m);
        let far_m = from.fix.place.distance_m(to.fix.place);
        far_m <= SKIDDING * (to.rolled_m - from.rolled_m).abs() + room_m
    }

    fn accept(&mut self, here: Rolled) {
        self.counts.fixes += 1;
        self.fixes.push(here.fix);
        self.last = Some(here);
    }
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::plane::{Metres, Plane};
    use crate::sentence::framed;
    use crate::simulated;
    use proptest::prelude::*;

    /// The 31st of December 2026, in days from 1970.
    const DAY: i64 = 20_818;

    const FIELD: Place = Place { latitude: 52.1, longitude: 8.5 };

    fn gga(utc_ms: i64, place: Place) -> String {
        framed(&simulated::gga(utc_ms, Some((place, Quality::Rtk))))
    }

    fn rmc(utc_ms: i64, place: Place) -> String {
        framed(&simulated::rmc(utc_ms, Some((place, Quality::Rtk))))
    }

    /// A receiver that rolls half a metre a second to the east of a position. It sends a fix once a second from a
    /// moment on. `change` gets the number of each second and its two lines.
    fn rolling(from: Place, start_ms: i64, seconds: i64, change: impl Fn(i64, [String; 2]) -> [String; 2]) -> Receiver {
        let plane = Plane::around(from);
        let mut receiver = Receiver::new(None);
        for second in 0..seconds {
            let utc_ms = start_ms + 1000 * second;
            let place = plane.place(Metres { east: 0.5 * second as f64, north: 0.0 });
            let time_ms = 1000.0 * second as f64;
            receiver.rolled(time_ms, 0.5 * second as f64, 500.0);
            for line in change(second, [gga(utc_ms, place), rmc(utc_ms, place)]) {
                receiver.take(time_ms + 80.0, &line);
            }
        }
        receiver.end();
        receiver
    }

    proptest! {
        #[test]
        fn midnight_the_antimeridian_and_either_hemisphere_change_nothing(
            latitude in -80.0..80.0_f64, near in 0..4_usize, off in -0.0001..0.0001_f64, start_s in -30..30_i64,
        ) {
            let longitude = [180.0 - off.abs(), -180.0 + off.abs(), off, 100.0][near];
            let start_ms = (DAY + 1) * DAY_MS + 1000 * start_s;
            let receiver = rolling(Place { latitude, longitude }, start_ms, 40, |_, lines| lines);
            let Receiver { fixes, marks, .. } = &receiver;
            prop_assert_eq!(fixes.len(), 40);
            prop_assert_eq!(receiver.counts, Counts { fixes: 40, ..Counts::default() });
            prop_assert_eq!(marks, &[Mark::Found(Quality::Rtk)]);
            let midnights_ms = receiver.midnights_ms();
            prop_assert_eq!(midnights_ms.len(), 1);
            let midnight_ms = midnights_ms[0].expect("RMC has a date");
            for (second, pair) in fixes.windows(2).enumerate() {
                prop_assert_eq!(midnight_ms + pair[0].utc_ms, start_ms + 1000 * second as i64);
                let far_m = pair[0].place.distance_m(pair[1].place);
                prop_assert!((far_m - 0.5).abs() < 1e-3, "{}", far_m);
                prop_assert!((pair[1].time_ms - pair[0].time_ms - 1000.0).abs() < 1e-6);
            }
        }

        #[test]
        fn a_stream_that_is_cut_at_any_byte_has_no_wrong_fix(from in 0..4000_usize, to in 0..4000_usize) {
            let mut stream = String::new();
            for second in 0..20 {
                stream += &format!("{}\r\n{}\r\n", gga(1000 * second, FIELD), rmc(1000 * second, FIELD));
            }
            let (from, to) = (from % stream.len(), to % stream.len());
            let mut receiver = Receiver::new(None);
            let cut = stream[..from].to_owned() + &stream[from.max(to)..];
            // A checksum has 8 bits, so of 256 seams one looks like a whole line.
            let is_known = |line: &str| stream.lines().any(|whole| whole == line) || Line::parse(line) == Line::Damaged;
            prop_assume!(cut.lines().all(is_known));
            cut.lines().enumerate().for_each(|(at, line)| receiver.take(500.0 * at as f64, line));
            for fix in &receiver.fixes {
                prop_assert!(fix.place.distance_m(FIELD) < 1e-3);
            }
            prop_assert!(receiver.counts.damaged <= 1);
        }
    }

    #[test]
    fn a_fix_keeps_its_time_despite_late_lines_and_clock_drift() {
        // The second clock is 100 in a million too fast: 0.7 s in two hours.
        let cases = [(20, 1.0, [0.0, 300.0, 35.0, 1900.0], 1e-6), (7200, 1.0001, [0.0; 4], 12.1)];
        for (seconds, pace, late_ms, within_ms) in cases {
            let mut receiver = Receiver::new(None);
            for second in 0..seconds {
                let due_ms = 1000.0 * pace * second as f64 + 70.0;
                receiver.take(due_ms + late_ms[second as usize % late_ms.len()], &gga(1000 * second, FIELD));
            }
            for fix in &receiver.fixes {
                let true_ms = pace * fix.utc_ms as f64 + 70.0;
                assert!((fix.time_ms - true_ms).abs() <= within_ms, "{fix:?}");
            }
        }
    }

    #[test]
    fn a_lost_fix_is_marked_once_and_so_is_the_next_one() {
        let lost = |second: i64, lines| {
            let none = framed(&simulated::rmc(1000 * second, None));
            if (10..15).contains(&second) { [none.clone(), none] } else { lines }
        };
        let receiver = rolling(FIELD, 0, 30, lost);
        assert_eq!(receiver.marks, [Mark::Found(Quality::Rtk), Mark::Lost, Mark::Found(Quality::Rtk)]);
        assert_eq!(receiver.counts, Counts { fixes: 25, losses: 1, jumps: 0, damaged: 0 });
    }

    #[test]
    fn fixes_that_jump_are_marked_and_used_only_if_they_stay_there() {
        let plane = Plane::around(FIELD);
        for (off, jumps, tracks) in [(10..13, 3, vec![0; 27]), (10..30, 11, [vec![0; 10], vec![1; 20]].concat())] {
            let receiver = rolling(FIELD, 0, 30, |second, lines| {
                let place = plane.place(Metres { east: 0.5 * second as f64, north: 2.0 });
                if off.contains(&second) { [gga(1000 * second, place), rmc(1000 * second, place)] } else { lines }
            });
            assert_eq!(receiver.counts, Counts { fixes: tracks.len() as u64, jumps, ..Counts::default() });
            let Receiver { fixes, marks, .. } = &receiver;
            let jumped = |mark: &&Mark| matches!(mark, Mark::Jumped(jump) if jump.far_m >= 2.0);
            assert_eq!(marks.iter().filter(jumped).count() as u64, jumps);
            assert_eq!(marks.last() == Some(&Mark::Stayed), tracks.contains(&1));
            assert_eq!(fixes.iter().map(|fix| fix.track).collect::<Vec<_>>(), tracks);
        }
    }

    #[test]
    fn a_receiver_without_a_fix_from_the_beginning_is_marked_so() {
        let mut receiver = Receiver::new(None);
        (0..5).for_each(|second| receiver.take(1000.0 * f64::from(second), &framed("GPRMC,,V,,,,,,,,,,N")));
        assert_eq!(receiver.marks, [Mark::Lost]);
        assert_eq!(receiver.midnights_ms(), []);
    }
}
