//! The servo's pulses under full load: all have the same length, to the cycle.

use crate::common::elf;
use trial::bench::servo::{Jitter, PULSES, jitter};

#[test]
fn five_hundred_pulses_are_the_same_while_the_encoder_turns_and_the_status_streams() {
    let jitter = jitter(&elf(), |_| {}).expect("the firmware runs");
    assert_eq!(jitter, Jitter { width_cycles: 0, frame_cycles: 0, pulses: PULSES });
}
