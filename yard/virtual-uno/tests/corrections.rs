//! Tests of the corrections to simavr. Small firmwares measure the corrected behaviour. On the virtual Uno they print
//! the values of the data sheet, and on simavr alone other values.
//!
//! Firmwares and tests are in `upstream/`, in the form of simavr's own tests. If simavr alone becomes right, its test
//! here fails, and the correction can be removed. Corrections that are visible only from outside the chip are tested in
//! `virtual_uno.rs`.

use std::ffi::c_void;
use std::path::{Path, PathBuf};
use std::process::Command;

use simavr_ffi as simavr;
use virtual_uno::elf::Image;
use virtual_uno::{Pin, Uno, UnoError};

unsafe extern "C" {
    fn avr_run_one(avr: *mut simavr::avr_t) -> simavr::avr_flashaddr_t;
    static mega328: simavr::avr_kind_t;
}

/// A correction: its firmware, the section of the data sheet, and the firmware's output on simavr alone.
struct Correction {
    name: &'static str,
    section: &'static str,
    simavr: &'static str,
}

#[rustfmt::skip]
const CORRECTIONS: [Correction; 12] = [
    Correction { name: "interrupt_entry", section: "7.7.1", simavr: "0" },
    Correction { name: "interrupt_wakeup", section: "7.7.1", simavr: "1" },
    Correction { name: "uart_frame", section: "20.4", simavr: " 22" },
    Correction { name: "compare_buffer", section: "16.9.3", simavr: "1 1 1 2" },
    Correction { name: "counter_write", section: "16.7.2", simavr: "0 1" },
    Correction { name: "top_write", section: "16.6.3", simavr: "19999 9999" },
    Correction { name: "top_running", section: "16.9.3", simavr: "1 15 0" },
    Correction { name: "reset_timer", section: "11.1", simavr: "-22697 204 2" },
    Correction { name: "watchdog_again", section: "11.9.2", simavr: "80" },
    Correction { name: "eeprom_write", section: "8.4.2", simavr: "0" },
    Correction { name: "adc_time", section: "24.4", simavr: "36 24 14 2" },
    Correction { name: "adc_result", section: "24.7", simavr: "511" },
];

/// At input 0 of the ADC in all of them: half of AVCC.
const MILLIVOLTS: u16 = 2500;

/// Cycles after which a firmware has long been done.
const TIMEOUT_CYCLES: u64 = 16_000_000;

fn folder() -> PathBuf {
    Path::new(env!("CARGO_MANIFEST_DIR")).join("upstream")
}

/// The expected output in simavr's own test of a firmware.
fn expected(name: &str) -> String {
    let test = std::fs::read_to_string(folder().join(format!("test_atmega328p_{name}.c"))).unwrap();
    let (_, text) = test.split_once("1000000, \"").unwrap();
    text.split_once("\\n\"").unwrap().0.to_owned()
}

fn compile(name: &str) -> PathBuf {
    let elf = Path::new(env!("CARGO_TARGET_TMPDIR")).join(format!("{name}-{}.elf", std::process::id()));
    let output = Command::new("avr-gcc")
        .args(["-mmcu=atmega328p", "-DF_CPU=16000000UL", "-Os", "-Wall", "-Werror", "-o"])
        .args([&elf, &folder().join(format!("atmega328p_{name}.c"))])
        .output()
        .unwrap_or_else(|error| panic!("avr-gcc could not be started ({error})"));
    assert!(output.status.success(), "{}", String::from_utf8_lossy(&output.stderr));
    elf
}

/// A firmware's output on the virtual Uno, in a line.
fn on_the_virtual_uno(elf: &Path) -> String {
    let mut uno = Uno::boot(elf).unwrap();
    uno.set_millivolts(Pin::A0, MILLIVOLTS);
    let halted = uno.run_until(TIMEOUT_CYCLES).unwrap_err();
    assert!(matches!(halted, UnoError::Halted { .. }), "{halted}");
    uno.received()
}

unsafe extern "C" fn take(_: *mut simavr::avr_irq_t, byte: u32, text: *mut c_void) {
    // SAFETY: `on_simavr` registers its own vector, and uses it again only after the chip has ended.
    unsafe { (*text.cast::<Vec<u8>>()).push(byte as u8) };
}

/// A firmware's output on simavr alone, run as in simavr's tests.
fn on_simavr(elf: &Path) -> String {
    let flash = Image::read(elf).unwrap().flash;
    let mut text = Vec::<u8>::new();
    // SAFETY: the chip is made, set up, run and ended here. `flash` fits, because `Image` checks it, and `text`
    // outlives the chip.
    unsafe {
        let avr = mega328.make.expect("it has a function")();
        simavr::avr_init(avr);
        (*avr).set_log(0);
        (*avr).frequency = 16_000_000;
        (*avr).vcc = 5000;
        (*avr).avcc = 5000;
        std::ptr::copy_nonoverlapping(flash.as_ptr(), (*avr).flash, flash.len());
        (*avr).codeend = flash.len() as u32;
        let line = |name: &[u8; 4], line: u32| simavr::avr_io_getirq(avr, u32::from_be_bytes(*name), line as i32);
        let output = line(b"uar0", simavr::UART_IRQ_OUTPUT);
        simavr::avr_irq_register_notify(output, Some(take), (&raw mut text).cast());
        let mut uart_flags = 0_u32;
        simavr::avr_ioctl(avr, u32::from_be_bytes(*b"uas0"), (&raw mut uart_flags).cast());
        simavr::avr_raise_irq(line(b"adc0", simavr::ADC_IRQ_ADC0), MILLIVOLTS.into());
        while (*avr).cycle < TIMEOUT_CYCLES {
            if (*avr).state as u32 == simavr::cpu_Running {
                (*avr).pc = avr_run_one(avr);
            }
            let rest = simavr::avr_cycle_timer_process(avr);
            if (*avr).state as u32 == simavr::cpu_Sleeping {
                if (*avr).sreg[simavr::S_I as usize] == 0 {
                    break;
                }
                (*avr).cycle += 1 + rest;
            }
            simavr::avr_service_interrupts(avr);
        }
        simavr::avr_terminate(avr);
    }
    String::from_utf8(text).unwrap()
}

#[test]
fn the_virtual_uno_follows_the_data_sheet_and_simavr_alone_does_not() {
    for Correction { name, simavr, .. } in CORRECTIONS {
        let elf = compile(name);
        assert_eq!(on_the_virtual_uno(&elf), format!("{}\n", expected(name)), "{name} on the virtual Uno");
        assert_eq!(on_simavr(&elf), format!("{simavr}\n"), "{name} on simavr alone");
        assert_ne!(simavr, expected(name), "{name} shows nothing");
    }
}

#[test]
fn the_readme_lists_every_correction_with_its_section_and_its_figures() {
    let readme = include_str!("../README.md");
    for Correction { name, section, simavr } in CORRECTIONS {
        let row = readme.lines().find(|line| line.ends_with(&format!("| `{name}` |")));
        let row = row.unwrap_or_else(|| panic!("README.md has no row of {name}"));
        let cells: Vec<&str> = row.split('|').map(str::trim).collect();
        assert_eq!(cells[2..5], [section, expected(name).trim(), simavr.trim()], "{name}");
    }
    let firmwares = std::fs::read_dir(folder()).unwrap().map(|entry| entry.unwrap().file_name());
    let listed = firmwares.filter(|name| name.to_string_lossy().starts_with("atmega")).count();
    assert_eq!(listed, CORRECTIONS.len());
}

#[test]
fn the_readme_shows_the_test_of_a_blinking_led() {
    let (_, test) = include_str!("blink.rs").split_once("\n\n").unwrap();
    assert!(include_str!("../README.md").contains(test));
}
