//! Faults on the virtual Uno, with small C programs whose behaviour the data sheet defines: resets and their causes,
//! bytes that change by themselves, a program that hangs, and a power failure during a write to the EEPROM.

mod common;

use common::boot;
use virtual_uno::{CYCLES_PER_SECOND, Pin};
use virtual_uno::{ResetCause, Uno, UnoError};

const MILLISECOND: u64 = CYCLES_PER_SECOND / 1000;

/// Cycles of a write to the EEPROM: 3.4 ms.
const WRITE_CYCLES: u64 = 54_400;

/// The fixture `faults`, past its start-up code.
fn running() -> Uno {
    let mut uno = boot("faults");
    uno.run_for_ms(10).unwrap();
    uno
}

/// A variable of two bytes.
fn word(uno: &Uno, symbol: &str) -> u16 {
    u16::from_le_bytes(uno.read(symbol).unwrap().try_into().unwrap())
}

#[test]
fn a_brown_out_keeps_sram_and_says_so_in_its_cause() {
    let mut uno = boot("memory");
    assert_eq!(uno.run_until_serial("\n", 10 * MILLISECOND).unwrap(), "10H\n");
    let kept = uno.read("kept").unwrap()[0];
    // Until the number of its starts is in the EEPROM.
    uno.run_for_ms(4).unwrap();
    uno.brown_out();
    // Bit 2 of MCUSR.
    assert_eq!(uno.run_until_serial("\n", 10 * MILLISECOND).unwrap(), "41H\n");
    assert_eq!(uno.read("kept").unwrap(), [kept + 1]);
    assert_eq!(uno.resets().last().unwrap().cause, ResetCause::BrownOut);
}

#[test]
fn power_that_comes_back_to_noise_leaves_the_same_noise_for_the_same_seed() {
    let noise = |seed| {
        let mut uno = running();
        uno.write("kept", &[1]).unwrap();
        uno.power_cycle_to_noise(seed);
        uno.run_for_ms(1).unwrap();
        uno.read("kept").unwrap()[0]
    };
    let noises: Vec<u8> = (0..8).map(noise).collect();
    assert_eq!(noises, (0..8).map(noise).collect::<Vec<_>>());
    assert!(noises.iter().any(|byte| *byte != noises[0]), "{noises:?}");
}

#[test]
fn a_byte_written_from_outside_is_used_by_the_program() {
    let mut uno = running();
    uno.write("turns", &0x7000_u16.to_le_bytes()).unwrap();
    uno.run_for_ms(1).unwrap();
    let turns = word(&uno, "turns");
    assert!((0x7001..0x7800).contains(&turns), "{turns:#x}");
    assert_eq!(uno.read("kept"), Some(&[0xC5][..]), "its neighbours are left alone");
}

#[test]
fn an_unwritable_variable_is_refused_by_name() {
    let mut uno = running();
    let refused = uno.write("no such variable", &[1]).unwrap_err().to_string();
    assert!(refused.contains("no variable `no such variable`"), "{refused}");
    assert!(matches!(uno.write("kept", &[1, 2]), Err(UnoError::NoVariable { length: 2, .. })));
    for address in [0x00FF, 0x08FF, 0xFFFF] {
        assert!(matches!(uno.write_sram(address, &[0; 2]), Err(UnoError::NotInSram { .. })), "{address:#x}");
    }
}

#[test]
fn the_stack_begins_behind_the_last_variable() {
    let mut uno = running();
    assert_eq!(usize::from(uno.first_stack_address()), 0x100 + uno.size().sram as usize);
    assert!(uno.deepest_stack() < 40);
    uno.write_sram(uno.first_stack_address() + 1, &[0]).unwrap();
    assert_eq!(uno.deepest_stack(), 0x800 - uno.size().sram as usize - 1);
}

#[test]
fn a_stalled_program_hangs_while_its_interrupts_go_on_until_a_reset() {
    let mut uno = running();
    uno.stall().unwrap();
    let (turns, overflows) = (word(&uno, "turns"), word(&uno, "overflows"));
    uno.run_for_ms(100).unwrap();
    assert_eq!(word(&uno, "turns"), turns);
    // An overflow takes 1.024 ms.
    assert!((97..=98).contains(&(word(&uno, "overflows") - overflows)));
    uno.reset();
    uno.run_for_ms(1).unwrap();
    assert!(word(&uno, "turns") > 0);
}

#[test]
fn a_program_can_be_stopped_at_its_first_line() {
    let mut uno = boot("faults");
    uno.run_until_symbol("main", MILLISECOND).unwrap();
    assert_eq!(word(&uno, "turns"), 0, "the start-up code has filled SRAM");
    uno.write("turns", &0x7000_u16.to_le_bytes()).unwrap();
    uno.run_for_ms(1).unwrap();
    assert!(word(&uno, "turns") > 0x7000);
    assert!(matches!(uno.run_until_symbol("main", MILLISECOND), Err(UnoError::NotReached { .. })));
    assert!(matches!(uno.run_until_symbol("mian", MILLISECOND), Err(UnoError::NoFunction(_))));
}

#[test]
fn turns_are_timed_when_asked_for() {
    let mut uno = running();
    assert_eq!(uno.turns(), None);
    uno.measure_turns();
    let before = word(&uno, "turns");
    uno.run_for_ms(10).unwrap();
    let turns = *uno.turns().unwrap();
    assert!(turns.count.abs_diff((word(&uno, "turns") - before).into()) <= 1, "{turns:?}");
    // A turn takes some 20 cycles. The longest includes the interrupt of 30.
    assert!((10.0..30.0).contains(&turns.mean()) && turns.most > 40 && turns.most < 90, "{turns:?}");
}

/// Makes the fixture write its byte, and returns the cycle at which the write began.
fn order_write(uno: &mut Uno) -> u64 {
    uno.set(Pin::D4, false);
    uno.run_until(uno.cycle() + 300).unwrap();
    uno.changes().last().expect("D13 shows that the write goes on").cycle
}

#[test]
fn a_byte_of_eeprom_takes_3_4_ms_and_nothing_else_is_done_meanwhile() {
    let mut uno = running();
    let begin = order_write(&mut uno);
    uno.run_for_ms(5).unwrap();
    let end = uno.changes().last().unwrap();
    assert!(!end.high && (end.cycle - begin).abs_diff(WRITE_CYCLES) < 60, "{} cycles", end.cycle - begin);
    assert_eq!(uno.eeprom()[9..11], [0x2A, 0xFF]);
    assert_eq!(uno.read("read_meanwhile"), Some(&[0x77][..]));
}

#[test]
fn power_that_goes_during_a_write_leaves_the_byte_undefined() {
    type Fault = fn(&mut Uno);
    let left = |after: u64, fault: Fault| {
        let mut uno = running();
        let begin = order_write(&mut uno);
        uno.run_until(begin + after).unwrap();
        uno.set(Pin::D4, true);
        fault(&mut uno);
        uno.run_for_ms(4).unwrap();
        uno.eeprom()[9]
    };
    for fault in [Uno::power_cycle, Uno::brown_out] {
        assert_eq!(left(WRITE_CYCLES / 4, fault), 0xFF, "it was being erased");
        assert_eq!(left(WRITE_CYCLES * 3 / 4, fault), 0x7F, "it was being written");
        assert_eq!(left(WRITE_CYCLES + 100, fault), 0x2A);
    }
    assert_eq!(left(WRITE_CYCLES / 4, Uno::reset), 0x2A, "a reset lets the write finish");
    let reset_and_failure = |uno: &mut Uno| {
        uno.reset();
        uno.power_cycle();
    };
    assert_eq!(left(WRITE_CYCLES / 4, reset_and_failure), 0xFF, "it was still being erased");
}

#[test]
fn a_write_to_the_eeprom_goes_on_over_a_reset() {
    let mut uno = running();
    let begin = order_write(&mut uno);
    uno.run_until(begin + WRITE_CYCLES / 4).unwrap();
    uno.reset();
    uno.run_for_ms(5).unwrap();
    // The program orders the byte again, too early, and waits for the end of the write.
    let end = uno.changes().last().unwrap();
    assert!(!end.high && (end.cycle - begin).abs_diff(WRITE_CYCLES) < 60, "{} cycles", end.cycle - begin);
    assert_eq!(uno.eeprom()[9..11], [0x2A, 0xFF]);
    assert_eq!(uno.read("read_meanwhile"), Some(&[0x77][..]));
}
