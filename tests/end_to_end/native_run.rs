//! The native run and the firmware on the virtual Uno swing at the same positions.
//!
//! The rows have all conditions of the presets except stops. A braking machine may stop exactly at the edge of a zone.
//! There the last reading of the speed decides whether the tool swings once more, and the two runs read it at different
//! moments. The same holds for a gap that is just long enough for the tool, so visits to the row that are that short are left out.

use field::conditions::{Conditions, presets};
use field::driving::drive;
use field::native::{self, Sensors};
use field::pass::{Pass, Start};
use field::servo::{Command, Servo};
use field::stand::Stand;
use model_test::cases;
use rand::seq::IndexedRandom;
use rand::{RngExt, SeedableRng};
use rand_chacha::ChaCha8Rng;
use rayon::prelude::*;
use uno::Pulse;
use uno_run::firmware;

/// Greatest difference of a swing at an even speed: a servo's frame.
const FRAME_S: f64 = 0.020;

/// Where the speed changes, one tick more in the averaging time lets the machine expect so many ticks a second more
/// (`control::measure::speed`). The readings of both runs come at different moments, so one may count that tick first.
const EXPECTED_STEP: f64 = 16.0;

/// A visit to the row that is shorter, from one command to the next, is in a gap at the limit: the difference of the leads.
const SHORT_S: f64 = 0.25;

/// The swings into the row and out of it, without short visits.
fn swings(servo: &Servo, pulses: &[Pulse]) -> Vec<Command> {
    let mut swings: Vec<Command> = Vec::new();
    // The tool is out from the beginning. On the Uno this is before the command with the setting of the width.
    for command in servo.commands(pulses).into_iter().skip_while(|command| command.is_out) {
        let entered = swings.last().filter(|last| command.is_out && !last.is_out);
        if entered.is_some_and(|entered| (command.rise_cycle - entered.rise_cycle) as f64 / 16e6 < SHORT_S) {
            swings.pop();
        } else {
            swings.push(command);
        }
    }
    swings
}

/// A short row under the conditions of a preset, with its own speed and spacing.
fn random_row(seed: u64) -> Pass {
    let mut rng = ChaCha8Rng::seed_from_u64(seed);
    let presets: Vec<&str> = presets().collect();
    let mut conditions = Conditions::preset(presets.choose(&mut rng).unwrap()).unwrap().unwrap();
    conditions.set("plot.row_m", 3.0).unwrap();
    conditions.set("driving.stops_per_100_m", 0.0).unwrap();
    let stand = Stand::grow(&conditions, rng.random_range(400.0..700.0), &mut rng).unwrap();
    let drive = drive(&conditions, &stand.span_mm, rng.random_range(0.8..3.0), &mut rng);
    Pass {
        row: stand.row,
        machine: conditions.machine(rng.random()),
        motion: drive.motion,
        timing: conditions.timing(),
        start: Start::Command,
        settings: conditions.firmware_settings(),
        examples: Vec::new(),
    }
}

#[test]
fn the_native_run_swings_as_the_firmware_does_on_random_rows() {
    let elf = firmware::build().unwrap();
    let rows = cases(50);
    let swings: usize = (0..rows)
        .into_par_iter()
        .map(|seed| {
            let pass = random_row(seed);
            let servo = pass.machine.servo;
            let on_the_uno = uno_run::run(&pass, &elf, |_| ()).unwrap();
            let by_the_native_run = native::weed(&pass, &Sensors::new(&pass, native::TURN_S)).unwrap();
            let (real, native) = (swings(&servo, &on_the_uno.pulses), swings(&servo, &by_the_native_run.pulses));
            assert_eq!(real.len(), native.len(), "row {seed}: {real:?} {native:?}");
            for (real, native) in real.iter().zip(&native) {
                assert_eq!(real.degrees, native.degrees, "row {seed}");
                let real_s = (real.rise_cycle - on_the_uno.start_cycle) as f64 / 16e6;
                let native_s = native.rise_cycle as f64 / 16e6;
                let ticks_a_second = pass.motion.speed_mm_s(native_s) / pass.machine.tick_mm();
                let lead_s = f64::from(pass.timing.lead_out_ms) / 1000.0;
                let most_s = FRAME_S + lead_s * EXPECTED_STEP / ticks_a_second;
                assert!((real_s - native_s).abs() <= most_s, "row {seed}: {real_s} s, not {native_s} s");
            }
            real.len()
        })
        .sum();
    assert!(swings > 7 * rows as usize, "{swings}");
}
