//! The timing error of swing commands at the servo's pin: hundreds of random rows, and a machine at four times its
//! design speed.

use crate::common::elf;
use field::machine::Machine;
use model_test::cases;
use uno_run::bench::swings::{Lateness, Rows, lateness};

/// Greatest and mean distance of a command from its ideal position at 2.5 km/h, in ticks.
const WORST_TICKS: f64 = 9.0;
const MEAN_TICKS: f64 = 3.0;

/// The same as times: a tick takes 0.754 ms at 2.5 km/h.
const WORST_MS: f64 = WORST_TICKS * 0.754;
const MEAN_MS: f64 = MEAN_TICKS * 0.754;

#[track_caller]
fn lateness_without_damage(rows: &Rows) -> Lateness {
    let lateness = lateness(&elf(), rows, |_| {}).expect("the firmware runs");
    assert_eq!((lateness.reached, lateness.wrong_positions), (0, 0), "of {} plants", lateness.plants);
    let swings = lateness.errors_ticks.len();
    assert!(swings >= 5 * rows.seeds.clone().count(), "{swings} swings");
    lateness
}

#[test]
fn over_many_rows_at_2_5_km_h_every_command_comes_close_to_its_place() {
    let lateness = lateness_without_damage(&Rows::at_walking_speed(1000..1000 + cases(200)));
    assert_eq!(lateness.not_kept, 0, "of {} plants", lateness.plants);
    let (worst, mean) = (lateness.worst_ticks(), lateness.mean_ticks());
    let (earliest, latest) = lateness.span_ticks();
    println!("{} swings, {earliest:.2} to {latest:.2} ticks late, {mean:.2} in the mean", lateness.errors_ticks.len());
    assert!(worst <= WORST_TICKS, "{worst} ticks");
    assert!(mean <= MEAN_TICKS, "{mean} ticks");
}

#[test]
fn at_10_km_h_no_plant_is_damaged_and_commands_are_as_exact_in_time() {
    // 180 ms are half a metre at this speed: the beam must look farther ahead, and the plants need more distance.
    let machine = Machine { beam_to_tool_mm: 800.0, ..Machine::default() };
    let rows = Rows { seeds: 0..cases(20), machine, speed_km_h: 10.0, spacing_mm: 1400.0..1800.0, weeds: 0 };
    let lateness = lateness_without_damage(&rows);
    let [worst, mean] =
        [lateness.worst_ticks(), lateness.mean_ticks()].map(|ticks| ticks / lateness.ticks_per_s * 1000.0);
    println!("{} swings, {worst:.2} ms at worst, {mean:.2} ms in the mean", lateness.errors_ticks.len());
    assert!(worst <= WORST_MS, "{worst} ms");
    assert!(mean <= MEAN_MS, "{mean} ms");
}
