//! The accuracy of the alarm `crop_unknown`: the decisions, compiled for the PC, weed simulated rows.
//!
//! Weeds in a gap of a stand must not raise the alarm. An unknown crop of stalks must raise it at its eighth plant at
//! the latest. `WEEDER_ROWS=10000 cargo test --release -p field --test crop_unknown -- --nocapture` tries more rows,
//! and prints the rates.

use control::alarm::Alarm;
use control::ground::examples::EXAMPLES;
use control::ground::nearest::Nearest;
use control::measure::readings::Readings;
use control::measure::reset::Cause;
use control::memory::Volatile;
use control::operate::state::State;
use control::units::{Instant, Position};
use field::conditions::Conditions;
use field::driving::drive;
use field::native::{Sensors, TURN_S, beams_before};
use field::stand::Stand;
use rand::{RngExt, SeedableRng};
use rand_chacha::ChaCha8Rng;
use rig::Rig;

/// Default number of rows of each field.
const ROWS: u64 = 300;

fn rows() -> u64 {
    std::env::var("WEEDER_ROWS").map_or(ROWS, |rows| rows.parse().expect("a number of rows"))
}

/// Weeds a row of a field. Returns the alarm that ended it, and how many plants had reached the beam by then.
fn weed(preset: &str, number: u64, spacing_mm: f64, speed_km_h: f64) -> (Option<Alarm>, usize) {
    let conditions = Conditions::preset(preset).expect("it is a preset").expect("it can be read");
    let chance = |of: u64| {
        let mut rng = ChaCha8Rng::seed_from_u64(77);
        rng.set_stream(number << 2 | of);
        rng
    };
    let stand = Stand::grow(&conditions, spacing_mm, &mut chance(0)).expect("the plants stand apart");
    let drive = drive(&conditions, &stand.span_mm, speed_km_h, &mut chance(1));
    let pass = conditions.pass(stand.row.clone(), drive.motion.clone(), chance(2).random());
    let readings = Readings::new(Instant::ZERO, Position::new(0));
    let classifier = Nearest::new(&EXAMPLES[..], Volatile::new());
    let mut weeder = Rig::wake_at(classifier, Volatile::new(), readings, beams_before(&pass), Cause::PowerOn);
    weeder.clear();
    for (setting, value) in pass.firmware_settings() {
        weeder.set(setting, value).expect("the field's settings do not contradict each other");
    }
    weeder.start(false).expect("nothing is wrong yet");
    let sensors = Sensors::new(&pass, TURN_S);
    let alarm = sensors.turns().find_map(|now| {
        for seen in now.edges {
            weeder.edge(Position::new(seen.position as i32), seen.beams);
        }
        weeder.at(now.position as i32).turn_after(1000);
        match weeder.state() {
            State::Alarm(alarm) => Some((alarm, now.time_s)),
            _ => None,
        }
    });
    let place_mm = alarm.map_or(f64::INFINITY, |(_, time_s)| pass.motion.position_mm(time_s));
    let plants = pass.row.plants().filter(|plant| plant.span_mm().start < place_mm).count();
    (alarm.map(|(alarm, _)| alarm), plants)
}

/// At most one row in this number may end in the alarm.
#[track_caller]
fn assert_rare(preset: &str, rows_an_alarm: u64) {
    let ends = |&row: &u64| {
        let spacing_mm = [300.0, 400.0, 500.0, 600.0][row as usize % 4];
        let speed_km_h = [1.0, 1.5, 2.0, 2.5][row as usize / 4 % 4];
        weed(preset, row, spacing_mm, speed_km_h).0 == Some(Alarm::CropUnknown)
    };
    let ended: Vec<u64> = (0..rows()).filter(ends).collect();
    println!("{preset}: {} of {} rows end with crop_unknown", ended.len(), rows());
    assert!(ended.len() as u64 <= rows() / rows_an_alarm, "{preset}: rows {ended:?}");
}

#[test]
fn weeds_in_a_gap_rarely_count_as_a_crop_in_a_weedy_row() {
    assert_rare("weedy", 1000);
}

#[test]
fn weeds_in_a_gap_rarely_count_as_a_crop_after_set_up() {
    assert_rare("straight", 10_000);
}

#[test]
fn maize_that_the_examples_do_not_know_is_stopped_by_the_eighth_stalk() {
    let mut stopped_at = [0; 9];
    for row in 0..rows() {
        let (alarm, stalks) = weed("maize", row, [200.0, 220.0, 250.0][row as usize % 3], 1.0);
        assert_eq!(alarm, Some(Alarm::CropUnknown), "row {row}");
        assert!(stalks <= 8, "row {row}: {stalks}");
        stopped_at[stalks] += 1;
    }
    println!("maize: rows by the stalk at which they are stopped, from none on: {stopped_at:?}");
}
