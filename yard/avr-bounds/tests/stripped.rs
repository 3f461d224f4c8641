//! What the tool does not know never makes a bound smaller: symbols and relocations are taken away at random, and every
//! bound stays or grows, or the program is refused.
//!
//! The programs are those of `measured`, and small ones whose stack was counted by hand.

#[expect(dead_code, reason = "the table in README.md is the other test's")]
mod programs;

use avr_bounds::{Bounds, Budgets, Longest, Program, prove};
use programs::{Sample, samples};
use rand::{RngExt, SeedableRng};
use rand_chacha::ChaCha8Rng;
use std::path::{Path, PathBuf};
use std::process::Command;

/// How often each program is stripped, in another way each time.
const TRIES: u64 = 6;

/// Where things are in an ELF of 32 bits, little-endian (System V ABI, chapter 4).
const SECTIONS_OFFSET: usize = 0x20;
const SECTION_BYTES: usize = 40;
const SYMBOL_BYTES: usize = 16;
const RELOCATION_BYTES: usize = 12;
const SYMBOL_TABLE: u32 = 2;
const RELOCATIONS: u32 = 4;

fn word_at(elf: &[u8], at: usize) -> usize {
    u32::from_le_bytes(elf[at..at + 4].try_into().expect("four bytes")) as usize
}

/// Takes types, sizes and names of symbols and relocations away. Each try does so with another share.
fn strip(elf: &mut [u8], random: &mut ChaCha8Rng) {
    let share = |random: &mut ChaCha8Rng| [0.0, 0.03, 0.3, 1.0][random.random_range(0..4)];
    let [types, sizes, names, sections, relocations] = [(); 5].map(|()| share(random));
    let sections_at = word_at(elf, SECTIONS_OFFSET);
    let count = usize::from(elf[0x30]) | usize::from(elf[0x31]) << 8;
    for header in (0..count).map(|section| sections_at + section * SECTION_BYTES) {
        let (kind, at, bytes) = (word_at(elf, header + 4), word_at(elf, header + 16), word_at(elf, header + 20));
        if kind == SYMBOL_TABLE as usize {
            for symbol in (at..at + bytes).step_by(SYMBOL_BYTES).skip(1) {
                // A section's own symbol stays: relocations count from it.
                let is_section = elf[symbol + 12] & 0xF == 3;
                if is_section {
                    continue;
                }
                if random.random_bool(types) {
                    elf[symbol + 12] &= 0xF0;
                }
                if random.random_bool(sizes) {
                    elf[symbol + 8..symbol + 12].fill(0);
                }
                if random.random_bool(names) {
                    elf[symbol..symbol + 4].fill(0);
                }
            }
        } else if kind == RELOCATIONS as usize && random.random_bool(sections) {
            elf[header + 20..header + 24].fill(0);
        } else if kind == RELOCATIONS as usize {
            for relocation in (at..at + bytes).step_by(RELOCATION_BYTES) {
                if random.random_bool(relocations) {
                    // A relocation of no kind.
                    elf[relocation + 4] = 0;
                }
            }
        }
    }
}

/// Every bound that a program has, with its name. A time without a bound is longer than any.
fn figures(bounds: &Bounds) -> Vec<(String, u64)> {
    let of = |longest: &Longest| longest.cycles.unwrap_or(u64::MAX);
    let mut figures = vec![
        ("stack".to_owned(), bounds.stack_bytes as u64),
        ("critical section".to_owned(), of(&bounds.critical_section)),
        ("closed".to_owned(), of(&bounds.closed)),
    ];
    for handler in &bounds.handlers {
        let name = |what: &str| format!("{what} of vector {}", handler.vector);
        let never_returns = handler.longest == Longest::default();
        figures.push((name("cycles"), if never_returns { 0 } else { of(&handler.longest) }));
        figures.push((name("response"), handler.response_cycles.unwrap_or(u64::MAX)));
        figures.push((name("stack"), handler.stack_bytes as u64));
    }
    figures
}

/// Asserts that no bound of a stripped program is smaller than that of the whole one. Returns whether it has bounds.
#[track_caller]
fn assert_no_smaller(name: &str, whole: &Bounds, stripped: &Bounds) {
    let stripped = figures(stripped);
    for (figure, bound) in figures(whole) {
        let found = stripped.iter().find(|(other, _)| *other == figure).map(|(_, bound)| *bound);
        assert!(found.is_some_and(|found| found >= bound), "{name}: {figure} is {bound}, and {found:?} when stripped");
    }
}

#[test]
fn what_is_stripped_makes_no_bound_smaller() {
    let first: u64 = std::env::var("WEEDER_SEED").map_or(1, |seed| seed.parse().expect("WEEDER_SEED is a number"));
    println!("WEEDER_SEED={first}");
    let file = tempfile::NamedTempFile::new().expect("there is room for a file");
    let (mut proved, mut refused) = (0, 0);
    let mut all: Vec<(String, PathBuf, Option<&str>, String)> =
        (samples().into_iter()).map(|Sample { name, elf, chip, facts }| (name, elf, chip, facts)).collect();
    all.extend(cases().into_iter().map(|(name, elf)| (name, elf, Some("atmega328p"), String::new())));
    for (number, (name, elf, chip, facts)) in (0..).zip(&all) {
        let budgets: Budgets = toml::from_str(facts).expect("the facts are whole");
        let program = Program::read(elf, *chip).unwrap_or_else(|error| panic!("{name}: {error}"));
        let Ok(whole) = prove(&program, &budgets) else { continue };
        let bytes = std::fs::read(elf).expect("it was built");
        for attempt in 0..TRIES {
            let mut stripped = bytes.clone();
            strip(&mut stripped, &mut ChaCha8Rng::seed_from_u64(first * 1_000_003 + number * TRIES + attempt));
            std::fs::write(file.path(), stripped).expect("it can be written");
            let bounds =
                Program::read(file.path(), Some(program.chip.name)).and_then(|program| prove(&program, &budgets));
            match bounds {
                Ok(bounds) => {
                    proved += 1;
                    assert_no_smaller(&format!("{name}, try {attempt}"), &whole, &bounds);
                }
                Err(_) => refused += 1,
            }
        }
    }
    println!("{proved} proved, {refused} refused");
    assert!(proved >= 50 && refused >= 50, "{proved} proved, {refused} refused");
}

/// A small program, built with options. Its sources are in `tests/cases`.
fn built(sources: &[&str], options: &[&str], chip: &str) -> PathBuf {
    let name = format!("{}{}.elf", sources.concat(), options.concat()).replace([',', '=', '/'], "");
    let elf = Path::new(env!("CARGO_TARGET_TMPDIR")).join(name);
    let folder = Path::new(env!("CARGO_MANIFEST_DIR")).join("tests/cases");
    let mut gcc = Command::new("avr-gcc");
    gcc.args([&format!("-mmcu={chip}"), "-Os"]).args(options).args(sources.iter().map(|source| folder.join(source)));
    let output = gcc.args(["-lm", "-o"]).arg(&elf).output().expect("./setup.sh brings avr-gcc");
    assert!(output.status.success(), "{}", String::from_utf8_lossy(&output.stderr));
    elf
}

/// The stack of a small program.
fn stack_of(sources: &[&str], options: &[&str]) -> Result<usize, String> {
    let program = Program::read(&built(sources, options, "atmega328p"), Some("atmega328p"));
    let bounds = program.and_then(|program| prove(&program, &Budgets::default()));
    bounds.map(|bounds| bounds.stack_bytes).map_err(|error| error.to_string())
}

/// The small programs that have bounds, with all symbols and relocations.
fn cases() -> Vec<(String, PathBuf)> {
    let sources: [&[&str]; 5] = [&["nt.S", "ntc.c"], &["nt.S", "nt2.c"], &["tab.S", "tabc.c"], &["call0.c"], &["fp.c"]];
    let case = |sources: &[&str]| (sources.join(" "), built(sources, &["-Wl,--emit-relocs"], "atmega328p"));
    sources.into_iter().map(case).collect()
}

#[test]
fn code_that_no_symbol_calls_a_function_is_a_target_of_pointers() {
    // Two calls, and ten bytes that `deep` pushes.
    for option in ["-mrelax", "-Wl,--emit-relocs"] {
        assert_eq!(stack_of(&["nt.S", "ntc.c"], &[option]), Ok(14));
        assert_eq!(stack_of(&["nt.S", "nt2.c"], &[option]), Ok(14));
    }
    // The table stands behind a function without a size.
    assert_eq!(stack_of(&["tab.S", "tabc.c"], &["-mrelax"]), Ok(108));
    assert_eq!(stack_of(&["tab.S", "tabc.c"], &["-Wl,--emit-relocs"]), Ok(108));
    // One pointer to one function: two calls. Start-up code is no target.
    assert_eq!(stack_of(&["fp.c"], &[]), Ok(4));
}

#[test]
fn a_call_of_address_0_is_followed_only_during_start_up() {
    // Its return address is on the stack while interrupts are still on.
    assert_eq!(stack_of(&["call0.c"], &[]), Ok(34));
    let error = stack_of(&["jmp0.S"], &["-nostartfiles"]).expect_err("it starts again with interrupts on");
    assert!(error.contains("between the two halves of the stack pointer"), "{error}");
}

#[test]
fn a_program_without_known_vectors_must_leave_interrupts_off() {
    let elf = built(&["boot.S"], &["-nostartfiles", "-Wl,-Ttext=0x7000"], "atmega328p");
    let program = Program::read(&elf, Some("atmega328p")).expect("it is an ELF");
    let error = prove(&program, &Budgets::default()).expect_err("its handlers are unknown").to_string();
    assert!(error.contains("no interrupt vectors were found") && error.contains("vectors = 0x7000"), "{error}");
    let told: Budgets = toml::from_str("vectors = 0x7000").expect("it is whole");
    // A call and ten bytes before interrupts are on; a call, and the handler's five bytes.
    assert_eq!(prove(&program, &told).expect("its handlers are known").stack_bytes, 12);
    assert_eq!(prove(&program, &told).expect("its handlers are known").handlers.len(), 1);
}

#[test]
fn eind_from_an_unknown_value_is_refused() {
    let elf = built(&["eind.c"], &["-mrelax"], "atmega2560");
    let error = Program::read(&elf, None).and_then(|program| prove(&program, &Budgets::default()));
    let error = error.expect_err("calls may lead anywhere").to_string();
    assert!(error.contains("sets EIND to something else than 0"), "{error}");
}

#[test]
fn roots_and_arcs_of_the_c_library_have_bounds() {
    for function in ["sqrt(x)", "asin(x)", "acos(x)", "cbrt(x)", "hypot(x, x)"] {
        let source = tempfile::Builder::new().suffix(".c").tempfile().expect("there is room for a file");
        let text = format!("#include <math.h>\nvolatile double x;\nint main(void) {{ for (;;) x = {function}; }}\n");
        std::fs::write(source.path(), text).expect("it can be written");
        let path = source.path().to_str().expect("it is text");
        stack_of(&[path], &[]).unwrap_or_else(|error| panic!("{function}: {error}"));
    }
}

#[test]
fn a_symbol_s_size_beyond_the_code_counts_as_none() {
    let elf = built(&["fp.c"], &[], "atmega328p");
    let mut bytes = std::fs::read(&elf).expect("it was built");
    let sections_at = word_at(&bytes, SECTIONS_OFFSET);
    let headers = (0..usize::from(bytes[0x30])).map(|section| sections_at + section * SECTION_BYTES);
    let table = headers.into_iter().find(|&header| word_at(&bytes, header + 4) == SYMBOL_TABLE as usize);
    let table = table.expect("it has symbols");
    let (at, length) = (word_at(&bytes, table + 16), word_at(&bytes, table + 20));
    for symbol in (at..at + length).step_by(SYMBOL_BYTES).skip(1) {
        bytes[symbol + 8..symbol + 12].fill(0xFF);
    }
    let file = tempfile::NamedTempFile::new().expect("there is room for a file");
    std::fs::write(file.path(), bytes).expect("it can be written");
    let program = Program::read(file.path(), None).expect("it is an ELF");
    assert_eq!(prove(&program, &Budgets::default()).expect("it has bounds").stack_bytes, 4);
}
