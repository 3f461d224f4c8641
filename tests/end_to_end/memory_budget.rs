//! The firmware's memory budget on an ATmega328P.

use crate::common::{Run, ask, elf};
use field::machine::Machine;
use field::motion::mm_s;
use field::planting::Planting;
use field::trial::Trial;
use field::verdict::Timing;
use std::process::Command;
use uno::elf::{Image, Size};

/// The flash below the Uno's bootloader, less a reserve of 256 bytes.
const FLASH_BYTES: u64 = 32_256 - 256;

/// The 2 KiB of SRAM, less the proved stack (budgets.toml) and a reserve of 400 bytes.
const SRAM_BYTES: u64 = 1252;

/// The stack's room at link time, by memory.x.
const STACK_BYTES: usize = 768;

#[test]
fn the_stack_stays_within_its_reserve() {
    let row = Planting { plants: 4, weeds: 2, ..Planting::default() }.grow(1).expect("everything has room");
    let mut run = Run::begin(Trial::at_speed(row, Machine::default(), Timing::default(), mm_s(2.5)), &[]);
    run.roll_to_the_end();
    for command in ["status", "help", "help k", "get", "dump", "label plant", "examples", "forget all", "set k 5"] {
        ask(&mut run.uno, command);
    }
    let deepest = run.uno.deepest_stack();
    println!("deepest stack {deepest} of {STACK_BYTES} bytes");
    assert!(deepest <= STACK_BYTES, "{deepest} bytes of stack");
}

#[test]
fn the_firmware_stays_within_its_memory_budget() {
    let Size { flash, sram } = Size::read(&elf()).expect("the ELF can be read");
    println!("flash {flash} of {FLASH_BYTES} bytes, static SRAM {sram} of {SRAM_BYTES} bytes");
    assert!(flash <= FLASH_BYTES, "{flash} bytes of flash");
    assert!(sram <= SRAM_BYTES, "{sram} bytes of static SRAM");
}

#[test]
fn the_flash_that_the_tools_tell_is_what_avr_size_counts_and_what_is_flashed() {
    let output = Command::new("avr-size").arg("-A").arg(elf()).output().expect("./setup.sh brings avr-size");
    let sections = String::from_utf8(output.stdout).expect("it is text");
    let bytes = |name: &str| -> u64 {
        let mut lines = sections.lines().map(|line| line.split_whitespace());
        let mut line = lines.find(|line| line.clone().next() == Some(name)).expect("the section is there");
        line.nth(1).expect("it has a size").parse().expect("the size is a number")
    };
    let counted = bytes(".text") + bytes(".data");
    assert_eq!(Size::read(&elf()).expect("the ELF can be read").flash, counted);
    assert_eq!(Image::read(&elf()).expect("the ELF can be read").flash.len() as u64, counted);
    // Its mark survives a reset in SRAM, and has no initial value in flash.
    assert!(bytes(".noinit") > 0);
}
