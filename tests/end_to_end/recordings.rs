//! Recordings of an encoder, made here and played to the firmware: it counts every step.

use crate::common::{elf, encoder_steps};
use field::wiring;
use rand::{RngExt, SeedableRng};
use rand_chacha::ChaCha8Rng;
use std::fs::File;
use std::io::BufWriter;
use std::path::Path;
use uno::recording;
use uno_run::replay::{Counted, replay};

/// Writes the steps as a waveform file, lets the firmware count it, and compares with the sum of the steps.
#[track_caller]
fn assert_counts(name: &str, steps: &[(u64, i32)]) {
    let path = Path::new(env!("CARGO_TARGET_TMPDIR")).join(name).with_extension("vcd");
    let file = File::create(&path).expect("the recording is written");
    recording::write(BufWriter::new(file), &wiring::WIRES, encoder_steps(steps.iter().copied()))
        .expect("it is written");
    let channels = [(wiring::ENCODER_A, "encoder_a"), (wiring::ENCODER_B, "encoder_b")];
    let capture = recording::read(&path, &channels).expect("the recording is read");
    let replay = replay(&capture, &elf(), |_| {}).expect("the firmware runs");

    let (mut count, mut lowest, mut highest) = (0_i64, 0, 0);
    for &(_, step) in steps {
        count += i64::from(step);
        lowest = lowest.min(count);
        highest = highest.max(count);
    }
    assert_eq!(replay.edges, steps.len());
    let counted = Counted { net_ticks: count, lowest_ticks: lowest, highest_ticks: highest, lost_ticks: 0 };
    assert_eq!(replay.counted, counted);
}

/// Steps from one turning point to the next, with random times around `mean_cycles`.
fn jittered(rng: &mut ChaCha8Rng, turning_points: &[i32], mean_cycles: u64) -> Vec<(u64, i32)> {
    let (mut cycle, mut count) = (mean_cycles, 0_i32);
    let mut steps = Vec::new();
    for &turning_point in turning_points {
        while count != turning_point {
            let step = (turning_point - count).signum();
            count += step;
            steps.push((cycle, step));
            cycle += rng.random_range(mean_cycles / 3..mean_cycles * 5 / 3);
        }
    }
    steps
}

#[test]
fn a_recording_with_reversals_and_jitter_is_counted_to_the_step() {
    let mut rng = ChaCha8Rng::seed_from_u64(1);
    let steps = jittered(&mut rng, &[700, -450, 1200, 1190, 1203, -80, 333], 12_000);
    assert_counts("reversals", &steps);
}

#[test]
fn a_recording_that_begins_backwards_is_counted_to_the_step() {
    let mut rng = ChaCha8Rng::seed_from_u64(2);
    let steps = jittered(&mut rng, &[-900, 5, -3, 40, -1500, -1499], 9000);
    assert_counts("backwards", &steps);
}

#[test]
fn a_wheel_that_trembles_on_an_edge_counts_no_further() {
    let mut rng = ChaCha8Rng::seed_from_u64(3);
    let mut steps = jittered(&mut rng, &[100], 10_000);
    let mut cycle = steps.last().expect("steps").0;
    for _ in 0..2000 {
        cycle += rng.random_range(400..3000);
        steps.push((cycle, -1));
        cycle += rng.random_range(400..3000);
        steps.push((cycle, 1));
    }
    assert_counts("trembling", &steps);
}

#[test]
fn steps_at_random_are_counted_one_by_one() {
    let mut rng = ChaCha8Rng::seed_from_u64(4);
    let mut cycle = 0;
    let steps: Vec<(u64, i32)> = (0..20_000)
        .map(|_| {
            cycle += rng.random_range(600..1400);
            (cycle, if rng.random_bool(0.52) { 1 } else { -1 })
        })
        .collect();
    assert_counts("random", &steps);
}
