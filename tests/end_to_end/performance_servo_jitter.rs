//! The servo's pulses under full load: all have the same length, to the cycle.

use crate::common::elf;
use uno_run::bench::servo::{Jitter, PULSES, jitter};

#[test]
fn five_hundred_pulses_are_the_same_under_load() {
    let jitter = jitter(&elf(), |_| {}).expect("the firmware runs");
    let Jitter { width_cycles, frame_cycles, pulses, .. } = jitter;
    assert_eq!((width_cycles, frame_cycles, pulses), (0, 0, PULSES));
}
