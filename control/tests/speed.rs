//! The speed from readings like the main loop's: irregular, and not synchronous with the encoder.

use control::{
    measure::speed::SpeedMeter,
    units::{Coarse, Instant, Interval, Speed, WrappedPosition},
};
use proptest::prelude::*;

/// A machine whose position is a function of time, read every `turn_us`.
struct Run {
    meter: SpeedMeter,
    time_us: u64,
    start: (Instant, i32),
}

impl Run {
    fn new() -> Self {
        Self::from(Instant::default(), 0)
    }

    fn from(start: Instant, count: i32) -> Self {
        Self {
            meter: SpeedMeter::new(WrappedPosition::new(count as i16), start.coarse()),
            time_us: 0,
            start: (start, count),
        }
    }

    /// Rolls for `duration_ms`; `ticks` gives the distance since the start at a time in seconds.
    fn roll(&mut self, duration_ms: u64, turn_us: u64, ticks: impl Fn(f64) -> f64) -> &mut Self {
        let end = self.time_us + duration_ms * 1000;
        while self.time_us < end {
            self.time_us += turn_us;
            let count = self.start.1.wrapping_add(ticks(self.time_us as f64 / 1e6).floor() as i32);
            self.meter.read(
                (self.start.0 + Interval::from_steps((self.time_us / 4) as u32)).coarse(),
                WrappedPosition::new(count as i16),
            );
        }
        self
    }

    fn speed(&self) -> f64 {
        f64::from(self.meter.speed().0)
    }

    fn expected(&self) -> f64 {
        f64::from(self.meter.expected().0)
    }
}

proptest! {
    #![proptest_config(ProptestConfig { failure_persistence: None, ..ProptestConfig::default() })]

    #[test]
    fn a_steady_speed_is_right_to_one_percent(
        speed in prop_oneof![20_f64..500.0, 500_f64..5_305.0, 5_305_f64..24_000.0],
        backwards in any::<bool>(),
        turn_us in 80_u64..400,
    ) {
        let speed = if backwards { -speed } else { speed };
        let mut run = Run::new();
        run.roll(1200, turn_us, |time| speed * time);
        prop_assert!((run.speed() - speed).abs() <= 1.0 + speed.abs() / 100.0, "{} is not {speed}", run.speed());
        // Some ticks of the averaging time.
        let ahead = (run.expected() - run.speed()) * speed.signum();
        prop_assert!((0.0..=50.0 + speed.abs() / 50.0).contains(&ahead), "{ahead} ticks a second ahead of {speed}");
    }

    #[test]
    fn the_expected_speed_is_ahead_of_a_machine_that_accelerates(
        // 0.26 to 1.3 m/s2 on the default wheel.
        ticks_a_s2 in 500_f64..2500.0,
        backwards in any::<bool>(),
        turn_us in 200_u64..1000,
    ) {
        let direction = if backwards { -1.0 } else { 1.0 };
        let mut run = Run::new();
        let ticks = |time: f64| direction * ticks_a_s2 * time * time / 2.0;
        run.roll(1000, turn_us, ticks);
        let ahead_ms = |run: &Run| 1000.0 * (direction * run.expected() / ticks_a_s2 - run.time_us as f64 / 1e6);
        let mean_ms = (0..50).map(|_| ahead_ms(run.roll(20, turn_us, ticks))).sum::<f64>() / 50.0;
        // 100 ms ahead of a measurement that is 40 ms old, or older where ticks are rare.
        prop_assert!((40.0..=90.0).contains(&mean_ms), "{mean_ms} ms ahead");
    }

    #[test]
    fn the_expected_speed_is_never_below_the_measured_one(
        // Up to the finest encoder at the greatest top speed, reached at once or in a second.
        speed in 100_f64..60_000.0,
        seconds in prop_oneof![Just(0.0), 0.01_f64..1.0],
        backwards in any::<bool>(),
        turn_us in 80_u64..1000,
    ) {
        let direction = if backwards { -1.0 } else { 1.0 };
        let rolled = |time: f64| if time < seconds { time * time / (2.0 * seconds) } else { time - seconds / 2.0 };
        let mut run = Run::new();
        for _ in 0..150 {
            run.roll(10, turn_us, |time| direction * speed * rolled(time));
            prop_assert!(direction * run.expected() >= direction * run.speed(), "{}, {}", run.expected(), run.speed());
        }
    }

    #[test]
    fn the_expected_speed_of_a_machine_that_brakes_is_the_measured_one(speed in 300_f64..2000.0, backwards in any::<bool>()) {
        let direction = if backwards { -1.0 } else { 1.0 };
        let mut run = Run::new();
        run.roll(1000, 700, |time| direction * speed * time);
        // It stands after a second.
        run.roll(200, 700, |time| direction * speed * (time - (time - 1.0).powi(2) / 2.0));
        prop_assert_eq!(run.expected(), run.speed());
    }

    #[test]
    fn a_machine_that_stops_is_known_to_stand_after_half_a_second(speed in 20_f64..5_305.0) {
        let mut run = Run::new();
        run.roll(500, 200, |time| speed * time);
        run.roll(520, 200, |_| speed * 0.5);
        prop_assert_eq!(run.speed(), 0.0);
    }

    #[test]
    fn counters_that_wrap_change_nothing(speed in 100_f64..5_305.0) {
        let mut plain = Run::new();
        let mut wrapping = Run::from(Instant::new(0_u32.wrapping_sub(64_000)), i32::MAX - 100);
        for run in [&mut plain, &mut wrapping] {
            run.roll(1000, 200, |time| speed * time);
        }
        prop_assert_eq!(plain.speed(), wrapping.speed());
    }
}

#[test]
fn a_speed_that_no_machine_has_stays_the_fastest_and_does_not_turn_round() {
    // The fastest count that the chip does not lose, forward and back.
    for counts_per_s in [30_000.0, 100_000.0, 290_000.0, -30_000.0, -290_000.0] {
        let mut run = Run::new();
        for _ in 0..1000 {
            run.roll(1, 200, |time| counts_per_s * time);
            let (speed, expected) = (run.speed() / counts_per_s.signum(), run.expected() / counts_per_s.signum());
            assert!(speed >= 0.0 && expected >= speed, "{speed} and {expected} at {counts_per_s}");
        }
        assert!(run.speed().abs() > 20_000.0, "{}", run.speed());
    }
}

#[test]
fn a_stop_shows_within_tens_of_milliseconds() {
    let mut run = Run::new();
    run.roll(500, 200, |time| 1326.0 * time);
    run.roll(50, 200, |_| 663.0);
    assert!(run.speed() <= 25.0, "{}", run.speed());
}

#[test]
fn a_start_from_standstill_is_not_delayed_by_the_time_of_standing() {
    let mut run = Run::new();
    run.roll(5000, 200, |_| 0.0);
    run.roll(100, 200, |time| 1326.0 * (time - 5.0));
    assert!((run.speed() - 1326.0).abs() < 20.0, "{}", run.speed());
}

#[test]
fn a_reversal_is_followed() {
    let mut run = Run::new();
    run.roll(500, 200, |time| 800.0 * time);
    run.roll(150, 200, |time| 400.0 - 800.0 * (time - 0.5));
    assert!((run.speed() + 800.0).abs() < 20.0, "{}", run.speed());
}

#[test]
fn a_machine_that_trembles_on_an_edge_stands() {
    let mut run = Run::new();
    run.roll(1000, 200, |time| f64::from((time * 50.0) as u32 % 2));
    assert!(run.speed().abs() <= 15.0, "{}", run.speed());
}

#[test]
fn one_tick_backwards_changes_the_speed_by_its_share() {
    let mut run = Run::new();
    run.roll(500, 200, |time| 1326.0 * time);
    run.roll(20, 200, |time| 1326.0 * time - if time < 0.505 { 1.5 } else { 0.0 });
    assert!((run.speed() - 1326.0).abs() < 40.0, "{}", run.speed());
}

#[test]
fn a_reading_that_changes_a_speed_is_reported() {
    let mut meter = SpeedMeter::new(WrappedPosition::new(0), Coarse::ZERO);
    let mut reported = 0;
    for milliseconds in 0..2000_u32 {
        // It accelerates, rolls at constant speed and stands.
        let count = (milliseconds * milliseconds / 500).min(milliseconds).min(1000);
        let now = Instant::default() + Interval::from_ms(milliseconds);
        let before = (meter.speed(), meter.expected());
        let is_reported = meter.read(now.coarse(), WrappedPosition::new(count as i16));
        assert!(is_reported || (meter.speed(), meter.expected()) == before, "at {milliseconds} ms");
        reported += u32::from(is_reported);
    }
    assert_eq!((meter.speed(), meter.expected()), (Speed(0), Speed(0)));
    assert!(reported < 150, "{reported} of 2000 readings");
}

#[test]
fn uneven_edges_do_not_make_a_creeping_wheel_falter() {
    // Each second edge is late by a third of the distance between two, as with real encoders.
    let ticks = |time: f64| {
        let place = 60.0 * time;
        let is_yet_to_come = (place as u32).is_multiple_of(2) && place.fract() < 1.0 / 3.0;
        place - f64::from(u8::from(is_yet_to_come))
    };
    let mut run = Run::new();
    run.roll(500, 200, ticks);
    for _ in 0..1000 {
        run.roll(1, 200, ticks);
        assert!((run.speed() - 60.0).abs() < 5.0, "{}", run.speed());
    }
}

#[test]
fn a_silent_wheel_is_slower_than_a_tick_in_its_silence_in_both_directions() {
    for direction in [1.0, -1.0] {
        let mut run = Run::new();
        run.roll(500, 200, |time| direction * 1000.0 * time);
        for silence_ms in 1..500 {
            run.roll(1, 200, |_| direction * 500.0);
            let speed = direction * run.speed();
            // The last tick may have come up to a millisecond earlier. The meter checks the silence only after each further eighth
            // of it.
            let [least, most] = [silence_ms + 1, silence_ms].map(|ms| 1000.0 / f64::from(ms));
            let is_of_the_silence = (least - 1.0..=most * 9.0 / 8.0 + 1.0).contains(&speed);
            assert!(silence_ms < 12 || is_of_the_silence, "{speed} after {silence_ms} ms");
        }
    }
    // A speed that was lower already does not rise.
    let mut run = Run::new();
    run.roll(2000, 200, |time| 10.0 * time);
    for _ in 0..200 {
        run.roll(1, 200, |_| 20.0);
        assert!(run.speed() <= 10.0, "{}", run.speed());
    }
}

#[test]
fn the_speed_updates_at_each_eighth_of_the_silence() {
    let mut run = Run::new();
    run.roll(500, 200, |time| 1000.0 * time);
    let (mut known, mut told) = (run.speed(), 0);
    for _ in 0..600 {
        run.roll(1, 200, |_| 500.0);
        told += u32::from(run.speed() != known);
        known = run.speed();
    }
    // From 10 to 500 ms there are 34 eighths; the last ones differ by less than a tick a second.
    assert!((20..=34).contains(&told), "{told} times");
}

#[test]
fn a_start_after_a_stop_is_not_delayed_by_what_was_measured_before_it() {
    for stands_ms in [600, 5000] {
        let stands_s = stands_ms as f64 / 1000.0;
        let mut run = Run::new();
        run.roll(500, 200, |time| 1326.0 * time);
        run.roll(stands_ms, 200, |_| 663.0);
        run.roll(40, 200, |time| 663.0 + 1326.0 * (time - 0.5 - stands_s));
        assert!((run.speed() - 1326.0).abs() < 60.0, "{} after {stands_ms} ms", run.speed());
    }
}
