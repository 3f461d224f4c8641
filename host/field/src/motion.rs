//! The motion of the machine: its position in millimetres as an exact function of time.
//!
//! A [`Motion`] is a chain of pieces of constant acceleration. Each call appends a manoeuvre: stand, change speed, roll
//! to a position, stop at a position, roll back. A piece does not change its direction. So the time at which it passes
//! a position follows from one quadratic equation, without time steps, and the edges of an encoder are exact.
//!
//! A driven wheel turns farther than the machine rolls. Its slip is the share of the wheel's distance that is lost. A
//! dragged wheel that skids turns less far, and has a slip below 0. Each piece of the motion may have its own slip
//! ([`Motion::with_slip`], or [`Motion::slipping`] from some time on).
//!
//! A motion that is not decided yet is cut at a time ([`Motion::until`]), and new pieces are appended.
//!
//! It knows no machine: the user defines position 0.

mod piece;

use self::piece::Piece;
use crate::ground::spans_where;
use std::ops::Range;

/// Walking speed in millimetres a second for a speed in kilometres an hour.
pub fn mm_s(speed_km_h: f64) -> f64 {
    speed_km_h / 3.6 * 1000.0
}

/// A place was passed.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct Passing {
    /// When, in seconds since the motion began.
    pub time_s: f64,
    /// Whether the machine rolled forward, towards larger positions.
    pub forward: bool,
}

/// The machine's position as a function of time: see the module.
#[derive(Clone, Debug)]
pub struct Motion {
    start_mm: f64,
    pieces: Vec<Piece>,
    /// The piece that would follow: it begins at the end, at the speed reached there.
    end: Piece,
}

impl Motion {
    /// The machine stands at `start_mm`.
    pub fn starting_at(start_mm: f64) -> Self {
        let end = Piece {
            start_s: 0.0,
            end_s: f64::INFINITY,
            start_mm,
            end_mm: start_mm,
            speed_mm_s: 0.0,
            acceleration_mm_s2: 0.0,
            wheel_start_mm: start_mm,
            wheel_mm_a_mm: 1.0,
        };
        Self { start_mm, pieces: Vec::new(), end }
    }

    /// From standstill at `start_mm` with `acceleration_mm_s2` to a constant speed, and on to `end_mm`.
    pub fn steady(start_mm: f64, acceleration_mm_s2: f64, speed_mm_s: f64, end_mm: f64) -> Self {
        Self::starting_at(start_mm).change_speed(speed_mm_s, acceleration_mm_s2).roll_to(end_mm)
    }

    /// Continues at the current speed for a time. A standing machine stands.
    pub fn go_on_for(self, duration_s: f64) -> Self {
        let Piece { start_mm, speed_mm_s, .. } = self.end;
        let end_mm = start_mm + speed_mm_s * duration_s;
        self.then(duration_s, 0.0, end_mm, speed_mm_s)
    }

    /// Changes to a speed, negative for rolling back. The sign of the acceleration does not matter.
    ///
    /// # Panics
    /// If the acceleration is 0: the speed would never be reached.
    pub fn change_speed(self, speed_mm_s: f64, acceleration_mm_s2: f64) -> Self {
        assert!(acceleration_mm_s2 != 0.0, "a change of speed needs an acceleration");
        let before = self.end;
        if before.speed_mm_s * speed_mm_s < 0.0 {
            return self.change_speed(0.0, acceleration_mm_s2).change_speed(speed_mm_s, acceleration_mm_s2);
        }
        let change_mm_s = speed_mm_s - before.speed_mm_s;
        let acceleration_mm_s2 = acceleration_mm_s2.abs().copysign(change_mm_s);
        let duration_s = change_mm_s / acceleration_mm_s2;
        let end_mm = before.start_mm + (before.speed_mm_s + speed_mm_s) / 2.0 * duration_s;
        self.then(duration_s, acceleration_mm_s2, end_mm, speed_mm_s)
    }

    /// Rolls on at the current speed until `place_mm`.
    ///
    /// # Panics
    /// If the machine does not roll towards this position.
    pub fn roll_to(self, place_mm: f64) -> Self {
        let Piece { start_mm, speed_mm_s, .. } = self.end;
        let duration_s = (place_mm - start_mm) / speed_mm_s;
        assert!(
            duration_s.is_finite() && duration_s >= 0.0,
            "at {start_mm} mm with {speed_mm_s} mm/s the machine never reaches {place_mm} mm"
        );
        self.then(duration_s, 0.0, place_mm, speed_mm_s)
    }

    /// Rolls on, brakes in time and stands at `place_mm`.
    ///
    /// # Panics
    /// If the position is nearer than the braking distance.
    pub fn stop_at(self, place_mm: f64, acceleration_mm_s2: f64) -> Self {
        let speed_mm_s = self.end.speed_mm_s;
        let braking_mm = (speed_mm_s.powi(2) / (2.0 * acceleration_mm_s2.abs())).copysign(speed_mm_s);
        self.roll_to(place_mm - braking_mm).change_speed(0.0, acceleration_mm_s2)
    }

    fn then(mut self, duration_s: f64, acceleration_mm_s2: f64, end_mm: f64, end_speed_mm_s: f64) -> Self {
        if duration_s > 0.0 {
            let piece = Piece { end_s: self.end.start_s + duration_s, end_mm, acceleration_mm_s2, ..self.end };
            self.pieces.push(piece);
            self.end = piece.then_at(end_speed_mm_s);
        }
        self.end.speed_mm_s = end_speed_mm_s;
        self
    }

    /// The same motion as far as a time, at which it goes on at the speed reached.
    pub fn until(mut self, time_s: f64) -> Self {
        let kept = self.pieces.partition_point(|piece| piece.start_s <= time_s);
        self.pieces.truncate(kept);
        let Some(last) = self.pieces.last_mut().filter(|last| time_s < last.end_s) else {
            let more_s = time_s - self.end.start_s;
            return self.go_on_for(more_s);
        };
        last.end_mm = last.position_mm(time_s);
        last.end_s = time_s;
        self.end = Piece { wheel_mm_a_mm: self.end.wheel_mm_a_mm, ..last.then_at(last.speed_at(time_s)) };
        self
    }

    /// In the pieces that follow, the wheel loses this share of its distance, below 1.
    pub fn slipping(mut self, share: f64) -> Self {
        self.end.wheel_mm_a_mm = 1.0 / (1.0 - share);
        self
    }

    /// Removes the pieces that ended before a time. Later calls must not ask for those times.
    pub fn forget(&mut self, time_s: f64) {
        self.pieces.drain(..self.pieces.partition_point(|piece| piece.end_s <= time_s));
    }

    /// Joins the last two pieces if their motion is alike, so that a motion of hours does not fill the memory.
    pub fn join(&mut self) {
        let [.., before, last] = self.pieces.as_mut_slice() else { return };
        let alike = |piece: &Piece| (piece.speed_mm_s, piece.acceleration_mm_s2, piece.wheel_mm_a_mm);
        if last.acceleration_mm_s2 == 0.0 && alike(before) == alike(last) {
            (before.end_s, before.end_mm) = (last.end_s, last.end_mm);
            self.pieces.pop();
        }
    }

    /// The motion from a time on, as its own motion with time 0 there. Its wheel does not slip.
    pub fn since(&self, time_s: f64) -> Self {
        let first = self.pieces.partition_point(|piece| piece.end_s <= time_s);
        self.pieces[first..].iter().fold(Self::starting_at(self.position_mm(time_s)), |mut motion, piece| {
            let late_s = (time_s - piece.start_s).max(0.0);
            // Its own speed, not the one before it, so that errors of rounding do not add up.
            motion.end.speed_mm_s = piece.speed_mm_s + piece.acceleration_mm_s2 * late_s;
            let duration_s = piece.end_s - piece.start_s - late_s;
            let after_mm_s = motion.end.speed_mm_s + piece.acceleration_mm_s2 * duration_s;
            motion.then(duration_s, piece.acceleration_mm_s2, piece.end_mm, after_mm_s)
        })
    }

    /// The same motion with a slipping wheel: `slip` returns the share of the wheel's distance that is lost, below 1,
    /// for each piece in turn.
    pub fn with_slip(mut self, mut slip: impl FnMut() -> f64) -> Self {
        let mut wheel_mm = self.start_mm;
        for piece in &mut self.pieces {
            piece.wheel_start_mm = wheel_mm;
            piece.wheel_mm_a_mm = 1.0 / (1.0 - slip());
            wheel_mm = piece.wheel_mm(piece.end_mm);
        }
        self.end.wheel_start_mm = wheel_mm;
        self
    }

    /// Where the motion began.
    pub fn start_mm(&self) -> f64 {
        self.start_mm
    }

    /// Where the motion ended.
    pub fn end_mm(&self) -> f64 {
        self.end.end_mm
    }

    /// The speed at which the motion ended, negative backwards.
    pub fn end_speed_mm_s(&self) -> f64 {
        self.end.speed_mm_s
    }

    /// How long the motion takes.
    pub fn duration_s(&self) -> f64 {
        self.end.start_s
    }

    /// Distance of the machine for each millimetre of the wheel's rim, from the end on.
    pub fn ground_mm_a_wheel_mm(&self) -> f64 {
        1.0 / self.end.wheel_mm_a_mm
    }

    /// The position at a time. Before its beginning and after its end the machine stands.
    pub fn position_mm(&self, time_s: f64) -> f64 {
        match self.piece_at(time_s) {
            Some(piece) => piece.position_mm(time_s),
            None if time_s < 0.0 => self.start_mm,
            None => self.end.start_mm,
        }
    }

    /// Position of a point on the wheel's rim, as if it had rolled on the ground without slip.
    pub fn wheel_mm(&self, time_s: f64) -> f64 {
        match self.piece_at(time_s) {
            Some(piece) => piece.wheel_mm(piece.position_mm(time_s)),
            None if time_s < 0.0 => self.start_mm,
            None => self.end.wheel_start_mm,
        }
    }

    /// [`Motion::wheel_mm`] for times that ascend from 0: it does not search for the piece each time.
    pub fn wheel_course(&self) -> impl FnMut(f64) -> f64 {
        let standing = Piece { speed_mm_s: 0.0, ..self.end };
        let mut pieces = self.pieces.iter();
        let mut piece = *pieces.next().unwrap_or(&standing);
        move |time_s| {
            while piece.end_s <= time_s {
                piece = *pieces.next().unwrap_or(&standing);
            }
            piece.wheel_mm(piece.position_mm(time_s))
        }
    }

    /// The speed at a time, negative when rolling back.
    pub fn speed_mm_s(&self, time_s: f64) -> f64 {
        self.piece_at(time_s).map_or(0.0, |piece| piece.speed_at(time_s))
    }

    /// The highest speed, forward or back.
    pub fn top_speed_mm_s(&self) -> f64 {
        let ends = self.pieces.iter().flat_map(|piece| [piece.speed_mm_s, piece.speed_at(piece.end_s)]);
        ends.map(f64::abs).fold(0.0, f64::max)
    }

    /// The stretch that the machine rolled over during a time.
    pub fn stretch_mm(&self, times_s: &Range<f64>) -> Range<f64> {
        let pieces = self.pieces_since(times_s.start).iter().take_while(|piece| piece.start_s < times_s.end);
        let from_mm = self.position_mm(times_s.start);
        pieces
            .map(|piece| piece.start_mm)
            .chain([self.position_mm(times_s.end)])
            .fold(from_mm..from_mm, |stretch, place_mm| stretch.start.min(place_mm)..stretch.end.max(place_mm))
    }

    /// Every passing of a place, in order of time.
    pub fn passings(&self, place_mm: f64) -> impl Iterator<Item = Passing> + Clone {
        self.passings_since(place_mm, 0.0)
    }

    /// As [`passings`](Self::passings), in the pieces that begin at a time or later.
    pub fn passings_since(&self, place_mm: f64, from_s: f64) -> impl Iterator<Item = Passing> + Clone {
        // A position belongs to the stretch ahead of it. It is passed forward on arrival and backward on leaving. So a
        // machine that stops on it exactly and turns has passed it twice, not once.
        let is_past = move |position_mm: f64| position_mm >= place_mm;
        self.pieces_since(from_s)
            .iter()
            .filter(move |piece| is_past(piece.start_mm) != is_past(piece.end_mm))
            .map(move |piece| Passing { time_s: piece.time_at(place_mm), forward: is_past(piece.end_mm) })
    }

    /// The times during which the position lies within a stretch.
    pub fn times_within_s(&self, stretch_mm: &Range<f64>) -> Vec<Range<f64>> {
        let ends = [stretch_mm.start, stretch_mm.end].into_iter().flat_map(|place_mm| self.passings(place_mm));
        let times = ends.map(|passing| passing.time_s).chain([0.0, self.duration_s()]);
        spans_where(times.collect(), |time_s| stretch_mm.contains(&self.position_mm(time_s)))
    }

    /// The edges of a wheel with marks `pitch_mm` apart: each mark's passing, in order of time, in the pieces that begin
    /// at a time or later.
    ///
    /// The motion begins half way between two marks.
    pub fn mark_passings(&self, pitch_mm: f64, from_s: f64) -> Vec<Passing> {
        let marks_to = |wheel_mm: f64| marks(wheel_mm - self.start_mm, pitch_mm);
        let mut passings = Vec::new();
        for piece in self.pieces_since(from_s) {
            let (from, to) = (marks_to(piece.wheel_start_mm), marks_to(piece.wheel_mm(piece.end_mm)));
            let at = |mark: i64| Passing {
                time_s: piece.time_at(piece.place_at(self.start_mm + (mark as f64 - 0.5) * pitch_mm)),
                forward: to > from,
            };
            if to > from {
                passings.extend((from + 1..=to).map(at));
            } else {
                passings.extend((to + 1..=from).rev().map(at));
            }
        }
        passings
    }

    fn pieces_since(&self, from_s: f64) -> &[Piece] {
        &self.pieces[self.pieces.partition_point(|piece| piece.start_s < from_s)..]
    }

    fn piece_at(&self, time_s: f64) -> Option<&Piece> {
        let index = self.pieces.partition_point(|piece| piece.end_s <= time_s);
        self.pieces.get(index).filter(|piece| piece.start_s <= time_s)
    }
}

/// Net marks passed after a distance, from half way between two marks: the counts of an ideal encoder.
pub fn marks(distance_mm: f64, pitch_mm: f64) -> i64 {
    // The floor without a call, because each turn of a loop calls this.
    let marks = distance_mm / pitch_mm + 0.5;
    let towards_zero = marks as i64;
    towards_zero - i64::from(towards_zero as f64 > marks)
}

/// Distance that the machine rolls ahead of the row, to reach its speed and have the tool in the row.
pub(crate) fn run_up_mm(speed_mm_s: f64, acceleration_mm_s2: f64) -> f64 {
    const LEAST_MM: f64 = 200.0;
    const SWING_IN_S: f64 = 0.6;
    LEAST_MM + SWING_IN_S * speed_mm_s + speed_mm_s.powi(2) / (2.0 * acceleration_mm_s2)
}

#[cfg(test)]
mod tests {
    use super::*;
    use proptest::prelude::*;

    /// A speed is reached and kept for a time, again and again. The machine may stand, roll back and slip.
    fn motions() -> impl Strategy<Value = Motion> {
        let leg = (-900.0..900.0, 200.0..1500.0, 0.0..2.0, -0.1..0.2);
        prop::collection::vec(leg, 1..8).prop_map(|legs| {
            legs.into_iter().fold(Motion::starting_at(-100.0), |motion, (speed_mm_s, acceleration, for_s, slip)| {
                motion.slipping(slip).change_speed(speed_mm_s, acceleration).go_on_for(for_s)
            })
        })
    }

    /// Times from the beginning to just before the end: after it the machine stands.
    fn times_s(motion: &Motion) -> impl Iterator<Item = f64> {
        let step_s = motion.duration_s() / 200.0;
        (0..200).map(move |step| f64::from(step) * step_s)
    }

    proptest! {
        #[test]
        fn position_speed_and_stretches_agree(motion in motions(), share in 0.1..1.0_f64) {
            let until_s = share * motion.duration_s();
            let stretch = motion.stretch_mm(&(0.0..until_s));
            let (mut least_mm, mut most_mm) = (f64::INFINITY, f64::NEG_INFINITY);
            let mut course = motion.wheel_course();
            for time_s in times_s(&motion) {
                let place_mm = motion.position_mm(time_s);
                let moved_mm = motion.position_mm(time_s + 1e-5) - place_mm;
                prop_assert!((moved_mm / 1e-5 - motion.speed_mm_s(time_s)).abs() < 0.02, "at {time_s} s");
                prop_assert_eq!(course(time_s), motion.wheel_mm(time_s));
                if time_s <= until_s {
                    (least_mm, most_mm) = (least_mm.min(place_mm), most_mm.max(place_mm));
                }
            }
            let missed_mm = motion.top_speed_mm_s() * motion.duration_s() / 200.0;
            prop_assert!((-1e-6..=missed_mm).contains(&(least_mm - stretch.start)), "{stretch:?}, {least_mm}");
            prop_assert!((-1e-6..=missed_mm).contains(&(stretch.end - most_mm)), "{stretch:?}, {most_mm}");
        }

        #[test]
        fn places_and_marks_are_passed_when_the_machine_is_there(
            motion in motions(), place_mm in -1000.0..2000.0_f64, pitch_mm in 0.4..5.0_f64,
        ) {
            let passings: Vec<Passing> = motion.passings(place_mm).collect();
            for passing in &passings {
                prop_assert!((motion.position_mm(passing.time_s) - place_mm).abs() < 1e-6);
            }
            prop_assert!(passings.windows(2).all(|two| two[0].time_s <= two[1].time_s && two[0].forward != two[1].forward));
            let is_past = |position_mm: f64| position_mm >= place_mm;
            prop_assert_eq!(passings.len() % 2 == 1, is_past(motion.start_mm()) != is_past(motion.end_mm()));
            for times in motion.times_within_s(&(place_mm..place_mm + 300.0)) {
                let ends_mm = [times.start, times.end].map(|time_s| motion.position_mm(time_s) - place_mm);
                prop_assert!(ends_mm.iter().all(|end_mm| (-1e-6..300.0 + 1e-6).contains(end_mm)), "{ends_mm:?}");
            }
            let (mut count, mut last_s) = (0, 0.0);
            for passing in motion.mark_passings(pitch_mm, 0.0) {
                prop_assert!(passing.time_s >= last_s, "marks are in order of time");
                last_s = passing.time_s;
                let mark = if passing.forward { count + 1 } else { count };
                let wheel_mm = motion.start_mm() + (f64::from(mark) - 0.5) * pitch_mm;
                prop_assert!((motion.wheel_mm(passing.time_s) - wheel_mm).abs() < 1e-6);
                count += if passing.forward { 1 } else { -1 };
            }
            let turned_mm = motion.wheel_mm(motion.duration_s()) - motion.start_mm();
            prop_assert_eq!(i64::from(count), marks(turned_mm, pitch_mm));
        }

        #[test]
        fn a_motion_that_is_cut_has_its_beginning_and_its_rest(whole in motions(), share in 0.0..0.99_f64) {
            let cut_s = share * whole.duration_s();
            let cut = whole.clone().until(cut_s);
            prop_assert_eq!((cut.duration_s(), cut.end_mm()), (cut_s, whole.position_mm(cut_s)));
            let on = cut.clone().until(cut_s + 0.5);
            prop_assert!((on.end_mm() - cut.end_mm() - whole.speed_mm_s(cut_s) * 0.5).abs() < 1e-9);
            let back = cut.change_speed(-250.0, 500.0).until(cut_s + 20.0);
            prop_assert_eq!(back.speed_mm_s(cut_s + 19.0), -250.0);
            let (left, mut kept) = (whole.since(cut_s), whole.clone());
            kept.forget(cut_s);
            prop_assert!((left.duration_s() + cut_s - whole.duration_s()).abs() < 1e-9);
            for time_s in times_s(&whole) {
                let place_mm = whole.position_mm(time_s);
                if time_s < cut_s {
                    prop_assert_eq!(back.position_mm(time_s), place_mm);
                } else {
                    prop_assert_eq!(kept.position_mm(time_s), place_mm);
                    prop_assert!((left.position_mm(time_s - cut_s) - place_mm).abs() < 1e-6);
                }
            }
        }
    }

    #[test]
    fn a_wheel_that_slips_turns_farther_than_the_machine_rolls() {
        let motion = Motion::steady(0.0, 1000.0, 500.0, 1900.0).with_slip(|| 0.05);
        assert!((motion.wheel_mm(motion.duration_s()) - 2000.0).abs() < 1e-9);
        assert_eq!(motion.end_mm(), 1900.0);
        let passings = motion.mark_passings(10.0, 0.0);
        assert_eq!(passings.len(), 200);
        let hundredth = motion.position_mm(passings[99].time_s);
        assert!((hundredth - 995.0 * 0.95).abs() < 1e-6, "{hundredth} mm");
    }

    #[test]
    fn a_wheel_slips_from_the_given_time_on() {
        let motion = Motion::starting_at(0.0).change_speed(500.0, 1000.0).until(0.25).slipping(0.05);
        let motion = motion.change_speed(500.0, 1000.0).until(3.0);
        let before_mm = 500.0 * 0.25 * 0.25;
        assert!((motion.end_mm() - (125.0 + 500.0 * 2.5)).abs() < 1e-9);
        let wheel_mm = before_mm + (motion.end_mm() - before_mm) / 0.95;
        assert!((motion.wheel_mm(3.0) - wheel_mm).abs() < 1e-9);
        assert!((motion.until(4.0).wheel_mm(4.0) - wheel_mm - 500.0 / 0.95).abs() < 1e-9);
    }

    #[test]
    fn a_motion_that_goes_on_alike_is_of_one_piece() {
        let mut motion = Motion::starting_at(0.0);
        for step in 1..=4000_i32 {
            let speed_mm_s = if step <= 1000 { 0.0 } else { 700.0 };
            motion = motion.slipping(0.05).change_speed(speed_mm_s, 1e6).until(f64::from(step) / 1000.0);
            motion.join();
        }
        assert_eq!(motion.pieces.len(), 3, "it stood, got its speed, and rolled");
        assert!((motion.position_mm(2.5) - 1050.0).abs() < 0.5);
        assert!((motion.wheel_mm(2.5) - motion.position_mm(2.5) / 0.95).abs() < 1e-6);
    }

    #[test]
    fn a_place_on_which_the_machine_turns_is_passed_there_and_back() {
        let motion = Motion::starting_at(0.0)
            .change_speed(100.0, 100.0)
            .stop_at(200.0, 100.0)
            .change_speed(-100.0, 100.0)
            .roll_to(100.0);
        assert_eq!(motion.position_mm(3.0), 200.0);
        let directions: Vec<bool> = motion.passings(200.0).map(|passing| passing.forward).collect();
        assert_eq!(directions, [true, false]);
    }
}
