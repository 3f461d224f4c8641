//! A short soak: `weeder soak` runs a day and half an hour.

use crate::common::elf;
use soak::{Plan, Subject, run};

/// A fault in nearly every row of the virtual Uno.
const PLAN: Plan = Plan { seed: 1, faults_an_hour: 300.0 };

#[test]
fn twenty_minutes_of_the_decisions_with_faults_harm_no_plant() {
    let tally = run(PLAN, Subject::Decisions, 1.0 / 3.0, |_| {}).expect("rows grow");
    assert!(tally.violations.is_empty(), "{tally}");
    assert!(tally.plants > 500 && tally.alarms.len() > 3 && tally.resets.len() > 3, "{tally}");
    // One row in eight has a stand so dense that almost nothing of it may be weeded.
    assert!(tally.weeded_metres > 0.2 * tally.metres, "{tally}");
}

#[test]
fn a_minute_of_the_firmware_with_faults_harms_no_plant() {
    let tally = run(PLAN, Subject::Firmware(&elf()), 1.0, |_| {}).expect("the firmware runs");
    assert!(tally.violations.is_empty(), "{tally}");
    assert!(tally.plants > 20 && tally.faults.len() > 2, "{tally}");
    assert!(tally.weeded_metres > 0.1 * tally.metres, "{tally}");
}
