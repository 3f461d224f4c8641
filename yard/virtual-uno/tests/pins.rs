//! Every pin of the board as an input and as an output, the timers' outputs, and the inputs of the ADC.

mod common;

use common::{boot, compile};
use virtual_uno::{Pin, PinChange, Uno};

/// The pins that the fixture `pins` drives.
fn driven() -> impl Iterator<Item = Pin> {
    Pin::ALL.into_iter().filter(|&pin| pin != Pin::A5)
}

#[test]
fn every_pin_is_read() {
    let mut uno = boot("pins");
    for (count, high) in Pin::ALL.into_iter().flat_map(|pin| [(pin, true), (pin, false)]) {
        for pin in Pin::ALL {
            uno.set(pin, (pin == count) == high);
        }
        uno.run_for_ms(1).unwrap();
        for pin in Pin::ALL {
            let (port, bit) = pin.port_and_bit();
            let seen = uno.read(&format!("seen_{}", port.to_ascii_lowercase())).unwrap()[0];
            assert_eq!(seen >> bit & 1 != 0, (pin == count) == high, "{pin}");
            assert_eq!((uno.level(pin), uno.output(pin)), ((pin == count) == high, None), "{pin}");
        }
    }
}

#[test]
fn every_pin_is_driven() {
    let mut uno = Uno::boot(&compile("pins")).unwrap();
    uno.set(Pin::A5, true);
    uno.run_for_ms(10).unwrap();
    let turn = {
        let pulses = uno.pulses(Pin::D0);
        pulses[10].rise - pulses[9].rise
    };
    for pin in driven() {
        // Bit 0 changes each turn, bit 1 each second turn, and so on.
        let bit = pin.port_and_bit().1;
        for pulses in uno.pulses(pin).windows(2) {
            assert_eq!(pulses[0].fall - pulses[0].rise, (turn / 2) << bit, "{pin}");
            assert_eq!(pulses[1].rise - pulses[0].rise, turn << bit, "{pin}");
        }
        assert!(uno.pulses(pin).len() > 5, "{pin}");
        assert_eq!(uno.output(pin), Some(uno.level(pin)), "{pin}");
    }
    assert_eq!((uno.output(Pin::A5), uno.level(Pin::A5)), (None, true));
    assert!(uno.changes().iter().all(|change| change.pin != Pin::A5));
}

#[test]
fn a_reset_releases_every_pin() {
    let mut uno = Uno::boot(&compile("pins")).unwrap();
    uno.set(Pin::A5, true);
    uno.run_for_ms(10).unwrap();
    uno.set(Pin::A5, false);
    uno.reset();
    uno.run_for_ms(1).unwrap();
    for pin in driven() {
        let last = uno.changes().iter().rfind(|change| change.pin == pin).unwrap();
        assert_eq!((uno.output(pin), last.high), (None, false), "{pin}");
    }
}

#[test]
fn a_level_on_a_driven_pin_waits_until_the_pin_is_an_input() {
    let mut uno = Uno::boot(&compile("pins")).unwrap();
    uno.drive([PinChange { cycle: 0, pin: Pin::A5, high: true }]);
    uno.run_for_ms(1).unwrap();
    uno.set(Pin::D7, true);
    uno.set(Pin::A5, false);
    let before = uno.pulses(Pin::D7).len();
    uno.run_for_ms(10).unwrap();
    assert!(uno.pulses(Pin::D7).len() > before + 1, "the firmware drives it on");
    uno.reset();
    uno.run_for_ms(1).unwrap();
    assert_eq!((uno.output(Pin::D7), uno.level(Pin::D7)), (None, true));
}

#[test]
fn every_output_of_the_timers_reaches_its_pin() {
    let mut uno = boot("waves");
    uno.run_for_ms(2).unwrap();
    let waves = [
        (Pin::D6, 64, 256),
        (Pin::D5, 128, 256),
        (Pin::D9, 250, 1000),
        (Pin::D10, 500, 1000),
        (Pin::D11, 64, 256),
        (Pin::D3, 128, 256),
    ];
    for (pin, width, period) in waves {
        let pulses = uno.pulses(pin);
        assert!(pulses.len() > 20, "{pin}");
        for pair in pulses[1..].windows(2) {
            assert_eq!((pair[0].fall - pair[0].rise, pair[1].rise - pair[0].rise), (width, period), "{pin}");
        }
    }
}

/// The next results of the fixture `adc`.
fn results(uno: &mut Uno) -> Vec<u16> {
    let rounds = |uno: &Uno| uno.read("rounds").unwrap()[0];
    let begun = rounds(uno);
    while rounds(uno).wrapping_sub(begun) < 2 {
        uno.run_for_ms(1).unwrap();
    }
    uno.read("results").unwrap().chunks(2).map(|bytes| u16::from_le_bytes([bytes[0], bytes[1]])).collect()
}

#[test]
fn the_adc_converts_each_pin_s_voltage_to_1024ths_of_the_reference() {
    let mut uno = boot("adc");
    uno.set(Pin::D2, true);
    let voltages = [0, 5, 2500, 3300, 4999, 5000];
    for (pin, millivolts) in [Pin::A0, Pin::A1, Pin::A2, Pin::A3, Pin::A4, Pin::A5].into_iter().zip(voltages) {
        uno.set_millivolts(pin, millivolts);
    }
    assert_eq!(results(&mut uno), [0, 1, 512, 675, 1023, 1023]);
    uno.set(Pin::D2, false);
    uno.set_millivolts(Pin::A2, 550);
    assert_eq!(results(&mut uno), [0, 4, 512, 1023, 1023, 1023]);
}

#[test]
fn every_result_of_the_adc_comes_from_its_own_stretch_of_voltage() {
    let mut uno = boot("adc");
    for (reference, high) in [(5000_u32, true), (1100, false)] {
        uno.set(Pin::D2, high);
        for millivolts in (0..reference as u16).step_by(97) {
            uno.set_millivolts(Pin::A4, millivolts);
            assert_eq!(u32::from(results(&mut uno)[4]), u32::from(millivolts) * 1024 / reference, "{millivolts} mV");
        }
    }
}

#[test]
fn a_voltage_stays_over_resets_and_power_cycles() {
    let mut uno = boot("adc");
    uno.set(Pin::D2, true);
    uno.set_millivolts(Pin::A1, 1250);
    for start in [Uno::reset, Uno::power_cycle] {
        start(&mut uno);
        uno.run_for_ms(1).unwrap();
        assert_eq!(results(&mut uno)[1], 256);
    }
}

#[test]
fn an_analogue_pin_has_a_level_too() {
    let mut uno = boot("pins");
    let mut level_at = |millivolts| {
        uno.set_millivolts(Pin::A2, millivolts);
        uno.level(Pin::A2)
    };
    // Above 0.6 of the supply a pin reads high, below 0.3 low. Between them it keeps its level.
    assert_eq!([2999, 3000, 1501, 1500, 2999].map(&mut level_at), [false, true, true, false, false]);
}

#[test]
#[should_panic(expected = "D7 is not an analogue pin")]
fn a_digital_pin_takes_no_voltage() {
    boot("pins").set_millivolts(Pin::D7, 100);
}
