//! Programs from outside this project, proved and measured: examples of the Arduino core and its libraries on three
//! boards, its bootloaders, and the programs of simavr's own tests and of avr-libc's manual.
//!
//! Each program runs in simavr while its pins, its serial line and its converter get random input. No measured value
//! may exceed its proved bound: stack, handlers, stretches without interrupts. This test writes the table in README.md
//! when `UPDATE_EXPECT=1` is set.

#[expect(dead_code, reason = "its proofs are the other tests'")]
mod assembled;
mod programs;

use assembled::assembled;
use avr_bounds::command::{Options, report};
use avr_bounds::{Bounds, Budgets, Program, prove};
use programs::{Sample, samples};
use rand::{Rng, RngExt, SeedableRng};
use rand_chacha::ChaCha8Rng;
use std::collections::BTreeMap;
use std::ffi::CString;
use std::fmt::Write as _;
use std::path::Path;
use std::thread;

/// How long each program runs, and with how many kinds of input.
const CYCLES: u64 = 4_000_000;
const SEEDS: u64 = 2;

/// The stack pointer and the status register, by their addresses in the data space, and the flag of the interrupts.
const SPL: usize = 0x5D;
const INTERRUPT_FLAG: usize = 7;

/// What erased flash holds.
const ERASED: u16 = 0xFFFF;

unsafe extern "C" {
    /// Runs the next instruction. It is declared in sim_core.h, which simavr-ffi leaves out of its bindings.
    fn avr_run_one(avr: *mut simavr_ffi::avr_t) -> simavr_ffi::avr_flashaddr_t;
}

/// The measured values of a run.
#[derive(Clone, Debug, Default)]
struct Measured {
    stack_bytes: usize,
    /// The longest run of each handler, response and return included.
    handlers: BTreeMap<u8, u64>,
    critical_section_cycles: u64,
}

/// simavr's name for a call to a part of the chip (sim_io.h).
fn call_to(part: [u8; 3], name: u8) -> u32 {
    u32::from_be_bytes([part[0], part[1], part[2], name])
}

/// Runs a program with random input.
fn measure(program: &Program, seed: u64) -> Measured {
    let mut random = ChaCha8Rng::seed_from_u64(seed);
    let mut measured = Measured::default();
    let chip = program.chip;
    let response = 2 + chip.return_address_bytes() as u64;
    let name = CString::new(chip.name).expect("a name has no zero");
    // SAFETY: simavr knows the chip by its name, or returns null, which is checked. Flash has room for the contents of
    // the chip's ELF, and data for every register. Only this function uses `avr`.
    unsafe {
        let avr = simavr_ffi::avr_make_mcu_by_name(name.as_ptr());
        assert!(!avr.is_null(), "simavr has no {}", chip.name);
        simavr_ffi::avr_init(avr);
        (*avr).set_log(0);
        (*avr).frequency = 16_000_000;
        std::ptr::copy_nonoverlapping(program.flash.as_ptr(), (*avr).flash, program.flash.len());
        (*avr).codeend = chip.flash_bytes;
        (*avr).pc = program.start;
        // simavr would pause in real time for each turn of a program that waits for a byte.
        for uart in *b"01" {
            simavr_ffi::avr_ioctl(avr, call_to(*b"uas", uart), std::ptr::from_ref(&0_u32).cast_mut().cast());
        }
        let stack_pointer = |avr: *mut simavr_ffi::avr_t| {
            usize::from(*(*avr).data.add(SPL)) | usize::from(*(*avr).data.add(SPL + 1)) << 8
        };
        let word_at = |avr: *mut simavr_ffi::avr_t, address: u32| {
            u16::from_le_bytes([*(*avr).flash.add(address as usize), *(*avr).flash.add(address as usize + 1)])
        };
        let (mut is_set_up, mut is_half, mut was_on) = (false, false, false);
        let mut handler: Option<(u8, u64)> = None;
        let mut off_since = None;
        let mut next_input = 0;
        while (*avr).cycle < CYCLES {
            if (*avr).cycle >= next_input {
                next_input = (*avr).cycle + random.random_range(100..3000);
                drive(avr, &mut random);
            }
            let word = word_at(avr, (*avr).pc);
            // A bootloader has jumped to the firmware, and there is none.
            if word == ERASED {
                break;
            }
            let mut pc = (*avr).pc;
            if (*avr).state as u32 == simavr_ffi::cpu_Running {
                pc = avr_run_one(avr);
                // The two halves of the stack pointer are written one after the other, the upper one first.
                is_half = if word & 0xFE0F == 0xBE0E { true } else { is_half && word & 0xFE0F != 0xBE0D };
                is_set_up |= word & 0xFE0F == 0xBE0D || word & 0xFE0E == 0x940E || word & 0xF000 == 0xD000;
                if word == 0x9518
                    && let Some((vector, since)) = handler.take()
                {
                    let longest = measured.handlers.entry(vector).or_default();
                    *longest = (*longest).max((*avr).cycle - since + response);
                }
            }
            let sleeps = simavr_ffi::avr_cycle_timer_process(avr);
            (*avr).pc = pc;
            match (*avr).state as u32 {
                simavr_ffi::cpu_Running => {}
                simavr_ffi::cpu_Sleeping if (*avr).sreg[INTERRUPT_FLAG] != 0 => (*avr).cycle += 1 + sleeps.min(CYCLES),
                _ => break,
            }
            let is_on = (*avr).sreg[INTERRUPT_FLAG] != 0;
            if handler.is_none() {
                match (was_on, is_on) {
                    (true, false) => off_since = Some((*avr).cycle),
                    (false, true) => {
                        let took = off_since.take().map_or(0, |since| (*avr).cycle - since);
                        measured.critical_section_cycles = measured.critical_section_cycles.max(took);
                    }
                    _ => {}
                }
            }
            was_on = is_on;
            let before = (*avr).pc;
            simavr_ffi::avr_service_interrupts(avr);
            if (*avr).pc != before && (*avr).sreg[INTERRUPT_FLAG] == 0 && is_on {
                handler = Some((((*avr).pc / chip.vector_bytes) as u8, (*avr).cycle));
            }
            was_on &= handler.is_none();
            let stack_pointer = stack_pointer(avr);
            if is_set_up && !is_half && stack_pointer <= usize::from(chip.ram_last) {
                measured.stack_bytes = measured.stack_bytes.max(usize::from(chip.ram_last) - stack_pointer);
            }
        }
        simavr_ffi::avr_terminate(avr);
    }
    measured
}

/// Drives a random level or byte on a pin or a serial line.
///
/// # Safety
/// `avr` is a chip that was initialised.
unsafe fn drive(avr: *mut simavr_ffi::avr_t, random: &mut impl Rng) {
    let (part, line, value) = match random.random_range(0..4) {
        0 => (call_to(*b"uar", b"01"[random.random_range(0..2)]), 0, random.random_range(0..256)),
        1 => (call_to(*b"adc", 0), random.random_range(0..8), random.random_range(0..5000)),
        _ => (
            call_to(*b"iog", b"ABCDE"[random.random_range(0..5)]),
            random.random_range(0..8),
            random.random_range(0..2),
        ),
    };
    // SAFETY: a part that the chip lacks gives null, and every part has more lines than are requested.
    unsafe {
        let line = simavr_ffi::avr_io_getirq(avr, part, line);
        if !line.is_null() {
            simavr_ffi::avr_raise_irq(line, value);
        }
    }
}

/// Compares the measured values with the proved ones.
#[track_caller]
fn assert_within(name: &str, measured: &Measured, bounds: &Bounds) {
    assert!(measured.stack_bytes <= bounds.stack_bytes, "{name}: {measured:?}, {} proved", bounds.stack_bytes);
    for (&vector, &cycles) in &measured.handlers {
        let proved = bounds.handlers.iter().find(|handler| handler.vector == vector);
        let proved = proved.unwrap_or_else(|| panic!("{name}: the handler of vector {vector} is not known"));
        // A handler without a bound has no limit, and one that never returns was not measured.
        let proved = proved.longest.cycles;
        assert!(proved.is_none_or(|proved| cycles <= proved), "{name}, vector {vector}: {cycles} of {proved:?}");
    }
    if let Some(proved) = bounds.critical_section.cycles {
        assert!(measured.critical_section_cycles <= proved, "{name}: {measured:?}, {proved} proved");
    }
}

/// One program's row of the table, and the ratio of proved to measured stack.
fn row(sample: &Sample) -> (String, Option<f64>) {
    let Sample { name, elf, chip, facts } = sample;
    let budgets: Budgets = toml::from_str(facts).expect("the facts are whole");
    let program = Program::read(elf, *chip).unwrap_or_else(|error| panic!("{name}: {error}"));
    let bounds = match prove(&program, &budgets) {
        Ok(bounds) => bounds,
        Err(error) => {
            let error = error.to_string();
            let words = error.split(": ").next().unwrap_or_default();
            return (format!("| {name} | {} | refused: {words} | | | |\n", program.chip.name), None);
        }
    };
    let mut most = Measured::default();
    for seed in 0..SEEDS {
        let measured = measure(&program, seed);
        assert_within(name, &measured, &bounds);
        most.stack_bytes = most.stack_bytes.max(measured.stack_bytes);
        for (vector, cycles) in measured.handlers {
            let longest = most.handlers.entry(vector).or_default();
            *longest = (*longest).max(cycles);
        }
    }
    let ratio = bounds.stack_bytes as f64 / most.stack_bytes as f64;
    let handler = |cycles: Option<u64>| cycles.map_or("-".to_owned(), |cycles| cycles.to_string());
    // Of handlers whose loops have a bound.
    let timed = bounds.handlers.iter().filter_map(|handler| Some((handler.vector, handler.longest.cycles?)));
    let ran = timed.clone().filter_map(|(vector, _)| most.handlers.get(&vector).copied());
    let text = format!(
        "| {name} | {} | {} | {} | {ratio:.2} | {} / {} |\n",
        program.chip.name,
        bounds.stack_bytes,
        most.stack_bytes,
        handler(timed.map(|(_, cycles)| cycles).max()),
        handler(ran.max())
    );
    (text, Some(ratio))
}

#[test]
fn measured_values_never_exceed_proved_bounds() {
    let samples = samples();
    let halves: Vec<Vec<(String, Option<f64>)>> = std::thread::scope(|scope| {
        let threads: Vec<_> = samples
            .chunks(samples.len().div_ceil(2))
            .map(|samples| scope.spawn(move || samples.iter().map(row).collect()))
            .collect();
        threads.into_iter().map(|thread| thread.join().expect("no bound is exceeded")).collect()
    });
    let rows: Vec<_> = halves.concat();
    let proved: Vec<f64> = rows.iter().filter_map(|(_, ratio)| *ratio).collect();
    let tight = proved.iter().filter(|ratio| **ratio <= 1.3).count();
    let mut table = "| program | chip | stack proved | measured | ratio | longest handler, proved / measured |\n\
                     | --- | --- | ---: | ---: | ---: | ---: |\n"
        .to_owned();
    rows.iter().for_each(|(row, _)| table += row);
    let _ = writeln!(
        table,
        "\n{} programs: {} proved, {} refused. The ratio is at most 1.3 for {tight}.",
        rows.len(),
        proved.len(),
        rows.len() - proved.len()
    );
    println!("{table}");
    assert!(proved.len() >= 20, "only {} programs are proved", proved.len());
    programs::expect_in_readme("measured", &table);
}

/// The result of a proof for a program in which an instruction was replaced by `nop`.
enum Found {
    Refused,
    Changed,
    Unnoticed,
}

/// How many of the programs had each result.
#[derive(Default)]
struct Tally {
    refused: usize,
    changed: usize,
    unnoticed: usize,
}

#[test]
fn faults_that_are_put_in_are_found() {
    let mut tallies: BTreeMap<&str, Tally> = BTreeMap::new();
    let results: Vec<_> = thread::scope(|scope| {
        let threads: Vec<_> = samples().into_iter().map(|sample| scope.spawn(move || put_in_faults(&sample))).collect();
        threads.into_iter().flat_map(|thread| thread.join().expect("its asserts hold")).collect()
    });
    for (kind, result) in results {
        let tally = tallies.entry(kind).or_default();
        match result {
            Found::Refused => tally.refused += 1,
            Found::Changed => tally.changed += 1,
            Found::Unnoticed => tally.unnoticed += 1,
        }
    }
    let mut table =
        "| what is left out | copies | refused | other bounds | unnoticed |\n| --- | ---: | ---: | ---: | ---: |\n"
            .to_owned();
    for (kind, Tally { refused, changed, unnoticed }) in &tallies {
        let copies = refused + changed + unnoticed;
        let share = |part: usize| format!("{part} ({} %)", part * 100 / copies);
        let _ = writeln!(
            table,
            "| {kind} | {copies} | {} | {} | {} |",
            share(*refused),
            share(*changed),
            share(*unnoticed)
        );
    }
    println!("{table}");
    for kind in ["a push", "a pop", "a push and its pop", "the saving of SREG in a handler"] {
        let tally = tallies.get(kind).unwrap_or_else(|| panic!("no program has {kind}"));
        assert!(tally.unnoticed * 50 <= tally.refused, "{kind}: {} of {} unnoticed", tally.unnoticed, tally.refused);
    }
    programs::expect_in_readme("faults", &table);
}

/// The proof's result for each copy of a program with a fault.
fn put_in_faults(Sample { name, elf, chip, facts }: &Sample) -> Vec<(&'static str, Found)> {
    let budgets: Budgets = toml::from_str(facts).expect("the facts are whole");
    let mut program = Program::read(elf, *chip).unwrap_or_else(|error| panic!("{name}: {error}"));
    let Ok(whole) = prove(&program, &budgets) else { return Vec::new() };
    let mut found = Vec::new();
    for (kind, places) in faults(&program, &whole) {
        let before = program.flash.clone();
        places.iter().for_each(|&at| program.flash[at..at + 2].fill(0));
        let result = match prove(&program, &budgets) {
            Err(_) => Found::Refused,
            Ok(bounds) if bounds != whole => Found::Changed,
            Ok(_) => Found::Unnoticed,
        };
        found.push((kind, result));
        program.flash = before;
    }
    found
}

/// Faults of every kind in a program, up to four of each, by the addresses of the removed instructions.
fn faults(program: &Program, bounds: &Bounds) -> Vec<(&'static str, Vec<usize>)> {
    const PER_KIND: usize = 4;

    let handlers: Vec<&str> = bounds.handlers.iter().map(|handler| handler.function.as_str()).collect();
    let mut found: BTreeMap<&'static str, Vec<Vec<usize>>> = BTreeMap::new();
    for function in &bounds.functions {
        // A handler's entry is its vector.
        let named = program.functions.iter().find(|(_, symbol)| symbol.name == function.function);
        let Some((&first, symbol)) = named else { continue };
        let words: Vec<(usize, u16)> = (first..first + symbol.bytes)
            .step_by(2)
            .map(|at| at as usize)
            .map(|at| (at, u16::from_le_bytes([program.flash[at], program.flash[at + 1]])))
            .collect();
        let register = |word: u16| word >> 4 & 0x1F;
        let (is_push, is_pop) = (|word: u16| word & 0xFE0F == 0x920F, |word: u16| word & 0xFE0F == 0x900F);
        let mut add = |kind, places: Vec<usize>| found.entry(kind).or_default().push(places);
        // Pushes and pops of call-saved registers.
        let is_saved = |word: u16| matches!(register(word), 2..=17 | 28 | 29);
        for (place, &(at, word)) in words.iter().enumerate().filter(|(_, (_, word))| is_saved(*word)) {
            if is_push(word) {
                add("a push", vec![at]);
                let pops =
                    words[place..].iter().filter(|(_, other)| is_pop(*other) && register(*other) == register(word));
                let pops: Vec<usize> = pops.map(|(at, _)| *at).collect();
                let pushes = words.iter().filter(|(_, other)| is_push(*other) && register(*other) == register(word));
                if !pops.is_empty() && pushes.count() == 1 {
                    add("a push and its pop", [vec![at], pops].concat());
                }
            } else if is_pop(word) {
                add("a pop", vec![at]);
            }
        }
        let status: Vec<(usize, u16)> =
            words.iter().copied().filter(|(_, word)| matches!(word & 0xFE0F, 0xB60F | 0xBE0F)).collect();
        if handlers.contains(&function.function.as_str()) && status.len() >= 2 {
            add("the saving of SREG in a handler", vec![status[0].0]);
            add("the restoring of SREG in a handler", vec![status[status.len() - 1].0]);
        }
        if let Some(&(clear, _)) = words.iter().find(|(_, word)| *word == 0x94F8) {
            let sets = words.iter().filter(|(at, word)| *at > clear && (*word == 0x9478 || word & 0xFE0F == 0xBE0F));
            let sets: Vec<usize> = sets.map(|(at, _)| *at).take(1).collect();
            if !sets.is_empty() {
                add("cli and what ends its stretch", [vec![clear], sets.clone()].concat());
                add("what ends a stretch without interrupts", sets);
            }
        }
    }
    let few = |(kind, mut all): (&'static str, Vec<Vec<usize>>)| {
        let apart = all.len().div_ceil(PER_KIND).max(1);
        all = all.into_iter().step_by(apart).collect();
        all.into_iter().map(move |places| (kind, places))
    };
    found.into_iter().flat_map(few).collect()
}

#[test]
fn functions_of_one_name_have_a_box_and_a_figure_each() {
    // `a::step::<u8>` and `a::step::<u16>`.
    let program = |more: &str| {
        let callers = "start:\n rcall _RINvC1a4stephE\n rcall _RINvC1a4steptE\n rjmp start\n";
        assembled(&format!("{callers}_RINvC1a4stephE:\n {more} ret\n_RINvC1a4steptE:\n push r2\n pop r2\n ret"))
    };
    let (old, new) = (program(""), program("nop\n"));
    let text = |options: Options| {
        let options = Options { chip: Some("atmega328p".to_owned()), ..options };
        report(new.path(), &options).expect("it has bounds").text
    };
    let changed = text(Options { diff: Some(old.path().to_owned()), ..Options::default() });
    assert!(changed.contains("a::step, cycles") && !changed.contains("a::step (2)"), "{changed}");
    let graph = text(Options { dot: true, ..Options::default() });
    assert_eq!(graph.matches(" -> ").count(), 2, "{graph}");
}

#[test]
fn avr_bounds_prints_its_report_in_every_form() {
    let samples = samples();
    let sample = samples.iter().find(|sample| sample.name == "uno/eeprom_write").expect("it is built");
    let elf: &Path = &sample.elf;
    let run = |arguments: &[&str]| {
        let mut command = std::process::Command::new(env!("CARGO_BIN_EXE_avr-bounds"));
        let output = command.arg(elf).args(arguments).output().expect("it starts");
        let text = String::from_utf8_lossy(&output.stdout).into_owned() + &String::from_utf8_lossy(&output.stderr);
        (output.status.code(), text)
    };
    let (code, text) = run(&[]);
    assert!(code == Some(0) && text.contains("The deepest stack on the"), "{text}");
    let (code, text) = run(&["--json"]);
    assert!(code == Some(0) && text.contains("\"stack_bytes\""), "{text}");
    let (code, text) = run(&["--dot"]);
    assert!(code == Some(0) && text.starts_with("digraph calls {") && text.contains("label=\"main\\n"), "{text}");
    assert_eq!(run(&["--diff", elf.to_str().expect("it is text")]), (Some(0), "No bound changed.\n".to_owned()));
    let (code, text) = run(&["--function", "main"]);
    assert!(code == Some(0) && text.starts_with("main, at 0x") && text.contains("it never returns"), "{text}");
    let (code, text) = run(&["--function", "gone"]);
    assert!(code == Some(2) && text.contains("no function called gone"), "{text}");
    let file = tempfile::NamedTempFile::new().expect("there is room for a file");
    std::fs::write(file.path(), "stack_bytes = 1").expect("it can be written");
    let (code, text) = run(&["--budgets", file.path().to_str().expect("it is text")]);
    assert!(code == Some(1) && text.contains("OVER"), "{text}");
    let (code, text) = run(&["--chip", "atmega4"]);
    assert!(code == Some(2) && text.contains("was made for the atmega328p, not for the atmega4"), "{text}");
}
