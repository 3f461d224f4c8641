//! A test of a user's own firmware, as in README.md.

use std::path::Path;
use std::process::Command;
use virtual_uno::{Pin, Uno};

#[test]
fn the_led_is_on_for_half_of_each_second() {
    let elf = Path::new(env!("CARGO_TARGET_TMPDIR")).join("blink.elf");
    let gcc = ["-mmcu=atmega328p", "-DF_CPU=16000000UL", "-Os", "tests/fixtures/blink.c", "-o"];
    assert!(Command::new("avr-gcc").args(gcc).arg(&elf).status().unwrap().success());

    let mut uno = Uno::boot(&elf).unwrap();
    uno.run_for_ms(4600).unwrap();
    let pulses = uno.pulses(Pin::D13);
    assert_eq!(pulses.len(), 5);
    assert!(pulses.iter().all(|pulse| (pulse.width_us() - 500_000.0).abs() < 1.0));
}
