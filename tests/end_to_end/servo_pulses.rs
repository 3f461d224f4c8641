//! The servo's signal at the pin: widths to a tenth of a microsecond, frames of 20 ms, and shorter frames for a swing.

use crate::common::{Run, ask, pass, run_for_ms, started, steady};
use field::motion::mm_s;
use field::row::{Canopy, Row};
use field::wiring;
use uno::Uno;
use uno::{CYCLES_PER_SECOND, Pulse};

fn microseconds(cycles: u64) -> f64 {
    cycles as f64 * 1e6 / CYCLES_PER_SECOND as f64
}

/// Asserts that the pulse has one of these widths.
#[track_caller]
fn assert_width(pulse: Pulse, widths_us: &[f64]) {
    assert!(widths_us.iter().any(|width_us| (pulse.width_us() - width_us).abs() <= 0.1), "{} us", pulse.width_us());
}

/// The pulses while the machine weeds past three plants with a busy console.
fn pulses_while_weeding(gap_ms: u32) -> Vec<Pulse> {
    let row = Row::new([300.0, 800.0, 1300.0].map(|place_mm| Canopy::plant(place_mm, 140.0)).to_vec()).expect("a row");
    let mut run =
        Run::begin(pass(row, steady(mm_s(2.5), 2000.0)), &[&format!("set servo_gap_ms {gap_ms}"), "start now"]);
    run.roll_on_asking("get", 90);
    run.roll_to_the_end();
    assert!(run.commands().len() >= 6, "{:?}", run.commands());
    run.uno.pulses(wiring::SERVO)
}

/// Asserts that every pulse is complete, and that frames last 20 ms. A swing may shorten a frame after the gap.
#[track_caller]
fn assert_frames(pulses: &[Pulse], gap_ms: u32) {
    let mut cut_short = 0;
    for pair in pulses.windows(2) {
        assert_width(pair[0], &[1500.0, 2000.0]);
        let (frame_us, gap_us) = (microseconds(pair[1].rise - pair[0].rise), microseconds(pair[1].rise - pair[0].fall));
        let swing = (pair[0].width_us() - pair[1].width_us()).abs() > 1.0;
        assert!(gap_us >= f64::from(gap_ms) * 1000.0, "a gap of {gap_us} us");
        if swing && gap_ms > 0 && frame_us < 19_999.0 {
            cut_short += 1;
        } else {
            assert!((frame_us - 20_000.0).abs() <= 0.1, "a frame of {frame_us} us");
        }
    }
    assert_eq!(cut_short > 0, gap_ms > 0);
}

#[test]
fn pulses_are_exact_and_a_swing_cuts_a_frame_short_after_the_gap() {
    assert_frames(&pulses_while_weeding(3), 3);
}

#[test]
fn a_longer_gap_is_kept() {
    assert_frames(&pulses_while_weeding(12), 12);
}

#[test]
fn without_a_gap_every_frame_is_20_ms() {
    assert_frames(&pulses_while_weeding(0), 0);
}

/// The pulses of the last second, without the frame in which the setting changed.
fn settled_pulses(uno: &mut Uno) -> Vec<Pulse> {
    run_for_ms(uno, 50);
    let begin = uno.cycle();
    run_for_ms(uno, 300);
    uno.pulses(wiring::SERVO).into_iter().filter(|pulse| pulse.rise > begin).collect()
}

#[test]
fn servo_settings_take_effect_in_hold_at_the_pin() {
    let mut uno = started();
    for width_us in [500, 1900, 2100, 2500] {
        ask(&mut uno, &format!("set servo_out_us {width_us}"));
        let pulses = settled_pulses(&mut uno);
        assert!(pulses.len() >= 14, "{pulses:?}");
        for pulse in pulses {
            assert_width(pulse, &[f64::from(width_us)]);
        }
    }
    ask(&mut uno, "set servo_in_us 1333");
    settled_pulses(&mut uno).into_iter().for_each(|pulse| assert_width(pulse, &[2500.0]));
    ask(&mut uno, "start now");
    settled_pulses(&mut uno).into_iter().for_each(|pulse| assert_width(pulse, &[1333.0]));
}
