//! The virtual Uno with small C programs, compiled here by avr-gcc. The data sheet gives their timing.
//!
//! Each program is in `fixtures/` and shows one behaviour. The weeder's firmware is not used here. Faults are in
//! `virtual_uno_faults.rs`.

mod common;

use std::path::Path;

use common::{boot, compile};
use virtual_uno::elf::Size;
use virtual_uno::{CYCLES_PER_SECOND, Pin, PinChange};
use virtual_uno::{ResetCause, SENT_BYTE_CYCLES, Uno, UnoError};

/// Bit of MCUSR a cause of reset, as the fixture `memory` sends it.
const POWER_ON: char = '1';
const EXTERNAL: char = '2';
const WATCHDOG: char = '8';

/// Cycles a bit of a firmware with UBRR 16 and double speed.
const FIRMWARE_BIT_CYCLES: u64 = 8 * 17;

const MILLISECOND: u64 = CYCLES_PER_SECOND / 1000;

/// Time in which a byte has been written to the EEPROM.
const EEPROM_WRITE_MS: u64 = 4;

#[test]
fn a_byte_takes_ten_bits_both_ways() {
    let mut uno = boot("echo");
    uno.run_until_serial("ready\n", 5 * MILLISECOND).unwrap();
    uno.run_for_ms(1).unwrap();

    let sent_at = uno.cycle();
    uno.send(b"abc");
    uno.run_for_ms(1).unwrap();
    let echo = uno.received_bytes();
    assert_eq!(echo.iter().map(|received| received.byte).collect::<Vec<_>>(), b"abc");
    for (count, received) in (1..).zip(&echo) {
        let arrived = sent_at + count * SENT_BYTE_CYCLES;
        // Waking up, entering the handler, and its first instructions.
        let delay = received.cycle - arrived;
        assert!((8..40).contains(&delay), "{delay} cycles after the stop bit");
    }
}

#[test]
fn the_transmitter_keeps_its_own_pace() {
    let mut uno = boot("echo");
    uno.run_for_ms(2).unwrap();
    let cycles: Vec<u64> = uno.received_bytes().iter().map(|received| received.cycle).collect();
    assert_eq!(cycles.len(), "ready\n".len());
    for pair in cycles[1..].windows(2) {
        let gap = pair[1] - pair[0];
        assert!(gap.abs_diff(10 * FIRMWARE_BIT_CYCLES) <= 4, "{gap} cycles");
    }
}

#[test]
fn the_receiver_keeps_three_bytes_and_loses_the_fourth() {
    let mut uno = boot("deaf");
    uno.run_for_ms(1).unwrap();
    uno.send(b"12345");
    uno.run_for_ms(1).unwrap();
    assert_eq!(uno.lost_bytes(), 2);
    // The switch on D4 makes the fixture read. Its output also says whether the chip reported the loss.
    uno.set(Pin::D4, false);
    assert_eq!(uno.run_until_serial("\n", 5 * MILLISECOND).unwrap(), "lost 123\n");
}

#[test]
fn bytes_that_waited_interrupt_one_right_after_the_other() {
    let mut uno = boot("backlog");
    uno.run_for_ms(1).unwrap();
    uno.send(b"123");
    uno.run_for_ms(1).unwrap();
    assert_eq!(uno.read("taken"), Some(&[0][..]));
    uno.set(Pin::D4, false);
    // Three handlers of some 30 cycles; a byte's time is 1389.
    uno.run_until(uno.cycle() + 200).unwrap();
    assert_eq!(uno.read("taken"), Some(&[3][..]));
    assert_eq!(uno.read("last"), Some(&b"3"[..]));
}

/// Cycles from each of 20 edges on INT0 to the first instruction of its handler.
fn responses(uno: &mut Uno) -> Vec<u64> {
    uno.run_for_ms(1).unwrap();
    let edges: Vec<u64> = (1..=20).map(|count| uno.cycle() + 1013 * count).collect();
    for &cycle in &edges {
        let pin = Pin::D2;
        uno.drive([(cycle, true), (cycle + 500, false)].map(|(cycle, high)| PinChange { cycle, pin, high }));
    }
    uno.run_for_ms(2).unwrap();
    let answers = uno.changes().iter().filter(|change| change.high);
    let responses: Vec<u64> = edges.iter().zip(answers).map(|(edge, answer)| answer.cycle - edge).collect();
    assert_eq!(responses.len(), edges.len());
    responses
}

#[test]
fn entering_an_interrupt_takes_four_cycles() {
    // Entry, and the vector's `jmp` of 3 cycles. The main loop's instructions take 1 cycle, and its last one 2.
    let responses = responses(&mut boot("entry"));
    assert!(responses.contains(&7), "{responses:?}");
    assert!(responses.iter().all(|response| (7..=8).contains(response)), "{responses:?}");
}

#[test]
fn leaving_sleep_takes_four_cycles_more() {
    let mut uno = boot("entry");
    uno.set(Pin::D4, false);
    assert_eq!(responses(&mut uno), [11; 20]);
}

#[test]
fn interrupts_are_counted_and_timed_when_asked_for() {
    let mut uno = boot("entry");
    uno.run_for_ms(1).unwrap();
    assert_eq!(uno.interrupt_statistics(), None);
    uno.measure_interrupts();
    for _ in 0..3 {
        uno.set(Pin::D2, true);
        uno.run_for_ms(1).unwrap();
        uno.set(Pin::D2, false);
        uno.run_for_ms(1).unwrap();
    }
    let statistics = uno.interrupt_statistics().unwrap();
    assert_eq!(statistics.handlers.keys().collect::<Vec<_>>(), [&1]);
    let int0 = &statistics.handlers[&1];
    // Entry 4, jmp 3, sbi 2, cbi 2, reti 4.
    assert_eq!((int0.count, int0.fewest, int0.most, int0.mean()), (3, 15, 15, 15.0));
    assert_eq!(statistics.longest_off, 15);
}

#[test]
fn a_timer_pulse_is_exact_and_constant_while_the_core_is_busy() {
    let mut uno = boot("servo");
    let edges = (1..20_000).map(|count| PinChange { cycle: count * 799, pin: Pin::D2, high: count % 2 == 1 });
    uno.drive(edges);
    uno.run_for_ms(1000).unwrap();
    let pulses = uno.pulses(Pin::D9);
    assert_eq!(pulses.len(), 50);
    for pair in pulses[1..].windows(2) {
        assert_eq!(pair[0].width_us(), 1500.0);
        assert_eq!(pair[1].rise - pair[0].rise, 20 * MILLISECOND);
    }
}

/// Cycles of the fixture `pulses`: a frame, its two widths, a clock of its timer, and the longest turn of its loop.
const FRAME_CYCLES: u64 = 20 * MILLISECOND;
const NARROW_CYCLES: u64 = 3000 * TIMER_CLOCK_CYCLES;
const WIDE_CYCLES: u64 = 4000 * TIMER_CLOCK_CYCLES;
const TIMER_CLOCK_CYCLES: u64 = 8;
const TURN_CYCLES: u64 = 80;

/// Pulses an input for less than a pulse of the servo lasts.
fn knock(uno: &mut Uno, pin: Pin, cycle: u64) {
    uno.drive([(cycle, true), (cycle + 1000, false)].map(|(cycle, high)| PinChange { cycle, pin, high }));
}

/// Rise and width in cycles of the pulses that began at or after a cycle.
fn pulses_since(uno: &Uno, cycle: u64) -> Vec<(u64, u64)> {
    let pulses = uno.pulses(Pin::D9);
    pulses.iter().filter(|pulse| pulse.rise >= cycle).map(|pulse| (pulse.rise, pulse.fall - pulse.rise)).collect()
}

#[test]
fn a_new_width_begins_with_the_next_frame_at_any_time_of_its_write() {
    let mut uno = boot("pulses");
    uno.run_until(2 * FRAME_CYCLES).unwrap();
    let start = pulses_since(&uno, 1000)[0].0;
    let during_pulses = (100..WIDE_CYCLES + 1000).step_by(613);
    let later = (WIDE_CYCLES..FRAME_CYCLES - 2 * TURN_CYCLES).step_by(9973);
    let phases: Vec<u64> = during_pulses.chain(later).collect();
    for (frame, phase) in (3..).zip(&phases) {
        knock(&mut uno, Pin::D2, start + frame * FRAME_CYCLES + phase);
    }
    let frames = phases.len() as u64 + 3;
    uno.run_until(start + frames * FRAME_CYCLES + MILLISECOND).unwrap();

    let pulses = pulses_since(&uno, start + 3 * FRAME_CYCLES);
    assert_eq!(pulses.len(), phases.len());
    for ((frame, pulse), width) in (3..).zip(pulses).zip([NARROW_CYCLES, WIDE_CYCLES].into_iter().cycle()) {
        assert_eq!(pulse, (start + frame * FRAME_CYCLES, width));
    }
}

#[test]
fn a_frame_that_is_cut_short_is_followed_by_a_whole_one() {
    let mut uno = boot("pulses");
    uno.run_until(2 * FRAME_CYCLES).unwrap();
    let first = pulses_since(&uno, 1000)[0].0;
    let mut rise = first;
    let mut width = NARROW_CYCLES;
    for phase in (WIDE_CYCLES + 100..FRAME_CYCLES - 2 * TURN_CYCLES).step_by(3931) {
        while rise + phase < uno.cycle() {
            rise += FRAME_CYCLES;
        }
        knock(&mut uno, Pin::D3, rise + phase);
        uno.run_until(rise + phase + 3 * FRAME_CYCLES / 2).unwrap();

        let changes: Vec<PinChange> =
            uno.changes().iter().filter(|change| change.cycle >= rise + phase).copied().collect();
        assert_eq!(changes[0].pin, Pin::D13, "{changes:?}");
        // TCNT1 is written 8 cycles after the lamp, and the second clock after that is the bottom.
        let pulses = pulses_since(&uno, rise + phase);
        let delay = pulses[0].0 - changes[0].cycle;
        assert!((8 + 9..=8 + 16).contains(&delay), "{delay} cycles");
        assert_eq!((pulses[0].0 - first) % TIMER_CLOCK_CYCLES, 0, "the prescaler runs on");

        rise = pulses[0].0;
        width = NARROW_CYCLES + WIDE_CYCLES - width;
        assert_eq!(pulses, [(rise, width), (rise + FRAME_CYCLES, width)]);
    }
}

#[test]
fn a_frame_that_is_cut_short_during_its_pulse_draws_the_pulse_out() {
    let mut uno = boot("pulses");
    uno.run_until(2 * FRAME_CYCLES).unwrap();
    let rise = pulses_since(&uno, 1000)[0].0 + 2 * FRAME_CYCLES;
    knock(&mut uno, Pin::D3, rise + NARROW_CYCLES / 2);
    uno.run_until(rise + 2 * FRAME_CYCLES).unwrap();
    let pulses = pulses_since(&uno, rise);
    let bottom = pulses[1].0 - FRAME_CYCLES;
    assert!((0..2 * TURN_CYCLES).contains(&(bottom - rise - NARROW_CYCLES / 2)), "{pulses:?}");
    assert_eq!(pulses, [(rise, bottom + WIDE_CYCLES - rise), (bottom + FRAME_CYCLES, WIDE_CYCLES)]);
}

#[test]
fn every_pin_change_is_counted() {
    let mut uno = boot("servo");
    uno.run_for_ms(1).unwrap();
    let start = uno.cycle();
    // Handed over in no order: A and B by themselves.
    for (pin, offset) in [(Pin::D2, 0), (Pin::D3, 250)] {
        uno.drive((1..=600).map(|count| PinChange { cycle: start + count * 500 + offset, pin, high: count % 2 == 1 }));
    }
    uno.run_for_ms(25).unwrap();
    assert_eq!(uno.read("edges"), Some(&1200_u16.to_le_bytes()[..]));
    assert_eq!(uno.read("no such variable"), None);
}

#[test]
fn eeprom_and_sram_outlive_the_reset_pin_and_eeprom_the_power() {
    let mut uno = Uno::boot_with_eeprom(&compile("memory"), &[9, 9, 9, 9, 9, 9, 9, 0]).unwrap();
    assert_eq!(uno.run_until_serial("\n", 10 * MILLISECOND).unwrap(), format!("{POWER_ON}1H\n"));
    let kept = uno.read("kept").unwrap().to_vec();
    assert_eq!(uno.read("started"), Some(&[42, 0][..]));

    uno.reset();
    assert_eq!(uno.run_until_serial("\n", 10 * MILLISECOND).unwrap(), format!("{EXTERNAL}2H\n"));
    assert_eq!(uno.read("kept").unwrap(), [kept[0] + 1]);

    uno.run_for_ms(EEPROM_WRITE_MS).unwrap();
    uno.power_cycle();
    assert_eq!(uno.run_until_serial("\n", 10 * MILLISECOND).unwrap(), format!("{POWER_ON}3H\n"));
    assert_eq!(uno.read("kept").unwrap(), kept);
    uno.run_for_ms(EEPROM_WRITE_MS).unwrap();
    assert_eq!(uno.eeprom()[..9], [9, 9, 9, 9, 9, 9, 9, 3, 0xFF]);

    let causes: Vec<_> = uno.resets().iter().map(|reset| reset.cause).collect();
    assert_eq!(causes, [ResetCause::External, ResetCause::PowerOn]);
}

#[test]
fn a_watchdog_reset_is_reported_and_the_firmware_goes_on() {
    let mut uno = boot("memory");
    uno.run_until_serial("\n", 10 * MILLISECOND).unwrap();
    let asked_at = uno.cycle();
    uno.send(b"w");
    // EEPROM starts erased: 255 + 1 wraps to 0, and this is the second start.
    assert_eq!(uno.run_until_serial("\n", 30 * MILLISECOND).unwrap(), format!("{WATCHDOG}1H\n"));
    let [reset] = uno.resets() else {
        panic!("one reset, not {:?}", uno.resets());
    };
    assert_eq!(reset.cause, ResetCause::Watchdog);
    let waited = reset.cycle - asked_at;
    assert!((16 * MILLISECOND..17 * MILLISECOND).contains(&waited), "{waited} cycles");
    // It also resets a firmware that sleeps with interrupts off.
    uno.send(b"wh");
    assert_eq!(uno.run_until_serial("\n", 30 * MILLISECOND).unwrap(), format!("{WATCHDOG}2H\n"));
}

#[test]
fn a_watchdog_that_stays_on_bites_again_after_sixteen_milliseconds() {
    let mut uno = boot("careless");
    uno.run_for_ms(200).unwrap();
    let cycles: Vec<u64> = uno.resets().iter().map(|reset| reset.cycle).collect();
    assert!(cycles[0] > 60 * MILLISECOND);
    assert_eq!(cycles.len(), 9);
    for pair in cycles.windows(2) {
        // 2048 cycles of the watchdog's 128 kHz.
        let gap = pair[1] - pair[0];
        assert!(gap.abs_diff(16 * MILLISECOND) < 10, "{gap} cycles");
    }
}

#[test]
fn a_driven_input_keeps_its_level_over_port_writes_and_resets() {
    let mut uno = boot("memory");
    uno.set(Pin::D4, false);
    assert_eq!(uno.run_until_serial("\n", 10 * MILLISECOND).unwrap(), format!("{POWER_ON}0L\n"));
    uno.reset();
    assert_eq!(uno.run_until_serial("\n", 10 * MILLISECOND).unwrap(), format!("{EXTERNAL}1L\n"));
    uno.run_for_ms(EEPROM_WRITE_MS).unwrap();
    uno.power_cycle();
    assert_eq!(uno.run_until_serial("\n", 10 * MILLISECOND).unwrap(), format!("{POWER_ON}2L\n"));
}

#[test]
fn a_crash_and_a_halt_are_errors_that_say_where() {
    let mut uno = boot("memory");
    uno.run_until_serial("\n", 10 * MILLISECOND).unwrap();
    uno.send(b"c");
    assert!(matches!(uno.run_for_ms(5), Err(UnoError::Crashed { .. })));

    let mut uno = boot("memory");
    uno.run_until_serial("\n", 10 * MILLISECOND).unwrap();
    uno.send(b"h");
    let halted = uno.run_for_ms(5).unwrap_err();
    assert!(matches!(halted, UnoError::Halted { .. }));
    assert!(halted.to_string().contains("sleeps with interrupts off"), "{halted}");
}

#[test]
fn a_missing_answer_is_an_error_that_shows_the_received_text() {
    let mut uno = boot("echo");
    let error = uno.run_until_serial("steady", 5 * MILLISECOND).unwrap_err().to_string();
    assert!(error.contains("\"steady\"") && error.contains("\"ready\\n\""), "{error}");
    assert_eq!(uno.received(), "ready\n");
}

#[test]
fn several_unos_run_in_parallel_and_do_not_meet() {
    let elf = compile("servo");
    let run = |gap: u64| {
        let mut uno = Uno::boot(&elf).unwrap();
        uno.drive((1..=200).map(|count| PinChange {
            cycle: MILLISECOND + count * gap,
            pin: Pin::D3,
            high: count % 2 == 1,
        }));
        uno.run_for_ms(100).unwrap();
        (uno.read("edges").unwrap().to_vec(), uno.pulses(Pin::D9), uno.cycle())
    };
    let alone = run(3000);
    let together: Vec<_> = std::thread::scope(|scope| {
        let threads: Vec<_> = (0..4).map(|_| scope.spawn(|| run(3000))).collect();
        threads.into_iter().map(|thread| thread.join().unwrap()).collect()
    });
    for result in together {
        assert_eq!(result, alone);
    }
}

#[test]
fn an_elf_that_is_none_is_refused_by_name() {
    let source = Path::new(env!("CARGO_MANIFEST_DIR")).join("tests/fixtures/echo.c");
    let refused = Uno::boot(&source).err().unwrap().to_string();
    assert!(refused.contains("echo.c is not a readable ELF file"), "{refused}");
    let own = std::env::current_exe().unwrap();
    let refused = Uno::boot(&own).err().unwrap().to_string();
    assert!(refused.contains("an ELF for AVR is needed"), "{refused}");
}

#[test]
fn the_size_is_the_sum_of_the_sections() {
    let mut uno = boot("memory");
    // .noinit has `kept`. .data has `started`, whose initial value also takes flash.
    assert_eq!(uno.size().sram, 3);
    assert!((100..1000).contains(&uno.size().flash), "{:?}", uno.size());
    uno.run_for_ms(5).unwrap();
    assert!((2..40).contains(&uno.deepest_stack()), "{}", uno.deepest_stack());
}

#[test]
fn a_firmware_too_large_for_the_chip_is_measured_but_not_run() {
    let elf = compile("oversized");
    let Size { flash, sram } = Size::read(&elf).expect("it is an ELF for AVR");
    assert!((40_100..40_500).contains(&flash), "{flash}");
    assert_eq!(sram, 100);
    let error = Uno::boot(&elf).err().expect("40 kB do not fit into 32 KiB").to_string();
    // The first values of variables come behind the code, which is too large by itself.
    let too_large = format!("has {} bytes for the flash: the ATmega328P holds 32768", flash - sram);
    assert!(error.ends_with(&too_large), "{error}");
}
