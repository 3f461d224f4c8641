//! The firmware's memory budget on an ATmega328P.

use crate::common::{Run, ask, elf};
use field::machine::Machine;
use field::motion::mm_s;
use field::pass::Pass;
use field::planting::Planting;
use field::verdict::ZoneSettings;
use std::fs;
use std::process::Command;
use uno::elf::{Image, Size};
use uno_run::firmware::workspace_root;

/// The budgets, as in .ci/run.
const FLASH_BYTES: u64 = 30_030;
const SRAM_BYTES: u64 = 1120;

/// The stack's room at link time, by memory.x.
const STACK_BYTES: usize = 768;

#[test]
fn the_stack_stays_within_its_reserve() {
    let row = Planting { plants: 4, weeds: 2, ..Planting::default() }.grow(1).expect("everything has room");
    let mut run = Run::begin(Pass::at_speed(row, Machine::default(), ZoneSettings::default(), mm_s(2.5)), &[]);
    run.roll_to_the_end();
    for command in
        ["status", "help", "help k", "get", "dump", "label plant", "examples", "hold", "forget all", "set k 5"]
    {
        ask(&mut run.uno, command);
    }
    let deepest = run.uno.deepest_stack();
    println!("deepest stack {deepest} of {STACK_BYTES} bytes");
    assert!(deepest <= STACK_BYTES, "{deepest} bytes of stack");
}

#[test]
fn the_firmware_stays_within_its_memory_budget() {
    let Size { flash, sram } = Size::read(&elf()).expect("the ELF can be read");
    let gate = fs::read_to_string(workspace_root().join(".ci/run")).expect("it is text");
    assert!(gate.contains(&format!("flash_budget={FLASH_BYTES} sram_budget={SRAM_BYTES}")), "see .ci/run");
    println!("flash {flash} of {FLASH_BYTES} bytes, static SRAM {sram} of {SRAM_BYTES} bytes");
    assert!(flash <= FLASH_BYTES, "{flash} bytes of flash");
    assert!(sram <= SRAM_BYTES, "{sram} bytes of static SRAM");
}

#[test]
fn the_reported_flash_equals_that_of_avr_size_and_the_image() {
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

/// Whether a name matches a linker script's pattern, in which `*` stands for any characters.
fn matches(pattern: &str, name: &str) -> bool {
    match pattern.split_once('*') {
        None => pattern == name,
        Some((begin, rest)) => {
            name.strip_prefix(begin).is_some_and(|name| (0..=name.len()).any(|skipped| matches(rest, &name[skipped..])))
        }
    }
}

/// The linker ignores a line that matches no function. Calls of the function that it meant become long.
#[test]
fn each_line_of_the_order_of_functions_matches_one() {
    let output = Command::new("avr-nm").arg(elf()).output().expect("./setup.sh brings avr-nm");
    let symbols = String::from_utf8(output.stdout).expect("it is text");
    let names: Vec<&str> = symbols.lines().filter_map(|line| line.split_whitespace().last()).collect();
    let order = fs::read_to_string(workspace_root().join("functions.x")).expect("it is there");
    let patterns: Vec<&str> =
        order.lines().filter_map(|line| line.strip_prefix("*(.text.")?.strip_suffix(')')).collect();
    assert!(patterns.len() > 50, "{} lines", patterns.len());
    let unmatched: Vec<_> =
        patterns.iter().filter(|pattern| !names.iter().any(|name| matches(pattern, name))).collect();
    assert!(unmatched.is_empty(), "run .ci/order: these lines of functions.x match no function: {unmatched:#?}");
}
