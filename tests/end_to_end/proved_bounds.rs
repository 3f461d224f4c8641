//! Measured values never exceed the proved bounds: the deepest stack, every handler, every critical section. No count
//! is lost at the rate that is proved to be never lost.
//!
//! The proofs analyse the ELF (`avr_bounds`). The measurements run it under full load.

use crate::common::{Run, ask, elf, run_for_ms, started};
use crate::interrupt_budgets::roll;
use avr_bounds::{Bounds, Budgets, Program, prove};
use control::ground::detection::Detection;
use control::ground::{examples, features, field_examples, keep_out};
use control::operate::event::{self, Event};
use control::operate::{dry_run, saved};
use control::say::command::{Argument, LINE_LENGTH, ROWS, Word};
use control::say::{line, packed};
use control::settings::Setting;
use field::machine::Machine;
use field::motion::mm_s;
use field::pass::Pass;
use field::planting::Planting;
use field::verdict::ZoneSettings;
use knn::MAX_K;
use model_test::{cases, is_thorough};
use rayon::prelude::*;
use std::fs;
use std::path::Path;
use uno::elf::Image;
use uno::{CYCLES_PER_SECOND, Uno};
use uno_run::firmware::workspace_root;

/// Counts in a second beside which the loop still gets time to answer.
const BUSY_PER_S: u64 = 150_000;

/// Commands that work in HOLD.
const COMMANDS: [&str; 25] = [
    "help",
    "help k",
    "status",
    "get",
    "get k",
    "set k 5",
    "set wheel_mm 410",
    "save",
    "revert",
    "defaults",
    "version",
    "dump",
    "label plant",
    "label weed",
    "teach 255",
    "examples",
    "forget 1",
    "forget all",
    "plot on",
    "plot off",
    "calibrate start",
    "test row 500",
    "hold",
    "servo 1600",
    "servo out",
];

fn program(elf: &Path) -> Program {
    Program::read(elf, None).expect("it is an ELF that names its chip")
}

fn proved() -> Bounds {
    let budgets = Budgets::read(&workspace_root().join("budgets.toml")).expect("there are budgets");
    prove(&program(&elf()), &budgets).expect("the firmware has bounds")
}

/// Compares an Uno's measured values with the bounds.
#[track_caller]
fn assert_within(bounds: &Bounds, uno: &Uno) {
    let stack = uno.deepest_stack();
    println!("stack: {stack} of {} bytes", bounds.stack_bytes);
    assert!(stack <= bounds.stack_bytes, "{stack} bytes of stack");
    let measured = uno.interrupt_statistics().expect("they were measured");
    for (vector, handler) in &measured.handlers {
        let proved = bounds.handlers.iter().find(|proved| proved.vector == *vector).expect("every handler is known");
        let longest = proved.longest.cycles.expect("it returned");
        println!("vector {vector}: {} of {longest} cycles", handler.most);
        assert!(handler.most <= longest, "the handler of vector {vector} took {} cycles", handler.most);
    }
    let section = measured.longest_critical_section;
    let proved = bounds.critical_section.cycles.expect("it has a bound");
    println!("critical section: {section} of {proved} cycles");
    assert!(section <= proved, "{section} cycles without interrupts");
    let turn = bounds.turn.as_ref().and_then(|turn| turn.cycles).expect("every loop in it has a bound");
    let longest = uno.turns().expect("they were measured").most;
    println!("turn: {longest} of {turn} cycles");
    assert!(longest <= turn, "a turn of {longest} cycles");
}

/// The compiler may assign a 16-bit operand to an odd register. These instructions then use another pair, without a
/// warning.
#[test]
fn instructions_that_take_a_pair_of_registers_name_it() {
    let sources = std::fs::read_dir(workspace_root().join("src")).expect("the firmware's sources are there");
    let mut pairs = 0;
    for path in sources.map(|entry| entry.unwrap().path()).filter(|path| path.extension() == Some("rs".as_ref())) {
        for (line, text) in (1..).zip(std::fs::read_to_string(&path).unwrap().lines()) {
            let text = text.trim().trim_matches(['"', ',']);
            let registers = match text.split_once(' ') {
                Some(("movw", both)) => both,
                Some(("adiw" | "sbiw", both)) => both.split(',').next().unwrap(),
                _ => continue,
            };
            assert!(!registers.contains('{'), "{}, line {line}: {text}", path.display());
            pairs += 1;
        }
    }
    assert!(pairs > 0, "there is one");
}

#[test]
fn a_flooded_console_and_fast_inputs_stay_within_the_bounds() {
    let bounds = proved();
    let mut uno = started();
    uno.measure_interrupts();
    uno.measure_turns();
    roll(&mut uno, BUSY_PER_S);
    assert_within(&bounds, &uno);
    let ran: Vec<u8> = uno.interrupt_statistics().expect("they were measured").handlers.keys().copied().collect();
    let known: Vec<u8> = bounds.handlers.iter().map(|handler| handler.vector).collect();
    assert_eq!(ran, known, "every handler has run");
}

#[test]
fn weeding_and_every_command_stay_within_the_bounds() {
    let bounds = proved();
    let row =
        Planting { plants: 4, weeds: 2, ragged: true, ..Planting::default() }.grow(1).expect("everything has room");
    let pass = Pass::at_speed(row, Machine::default(), ZoneSettings::default(), mm_s(2.5));
    let mut run = Run::begin(pass, &[]);
    run.uno.measure_interrupts();
    run.uno.measure_turns();
    run.roll_on_asking("status", 40);
    run_for_ms(&mut run.uno, 500);
    ask(&mut run.uno, "hold");
    for command in COMMANDS {
        // Some are refused in this state, which is also an answer.
        run.uno.send(format!("{command}\n").as_bytes());
        run_for_ms(&mut run.uno, 400);
    }
    assert_within(&bounds, &run.uno);
}

#[test]
fn no_count_is_lost_at_the_rate_that_is_never_lost() {
    let edges = proved().edges.expect("the encoder is watched");
    println!("{} counts a second, {} cycles of wait", edges.never_lost_per_s, edges.wait_cycles);
    // A rate that is a multiple of 100.
    roll(&mut started(), edges.never_lost_per_s / 100 * 100);
}

#[test]
fn no_turn_lasts_until_the_heartbeat_takes_the_loop_for_stalled() {
    let source = fs::read_to_string(workspace_root().join("src/heartbeat.rs")).expect("it is there");
    let periods = source.split("const PERIODS: u8 = ").nth(1).and_then(|rest| rest.split(';').next());
    let periods: u64 = periods.and_then(|periods| periods.parse().ok()).expect("it says when");
    // A period of the clock's interrupt is 1.024 ms. The interrupt also ends the sleep behind the turn.
    let period = 1024 * CYCLES_PER_SECOND / 1_000_000;
    let turn = proved().turn.and_then(|turn| turn.cycles).expect("every loop in it has a bound");
    assert!(turn + period < periods * period, "{turn} of {} cycles", periods * period);
}

#[test]
fn loops_are_said_to_turn_as_often_as_the_constants_behind_them_have_it() {
    let budgets = Budgets::read(&workspace_root().join("budgets.toml")).expect("there are budgets");
    // The bounds for the outermost loops of a function, and for inner loops.
    let by_depth =
        |function: &str| budgets.loops[function].passes.iter().map(|&passes| passes as usize).collect::<Vec<_>>();
    let passes = |function: &str| match by_depth(function)[..] {
        [passes] => passes,
        ref several => panic!("{function}: {several:?}"),
    };
    // Once for each, and once more to find that there are no more.
    for function in
        ["settings::Settings::take_defaults", "operate::saved::SavedSettings::values", "operate::saved::image"]
    {
        assert_eq!(passes(&format!("control::{function}")), usize::from(Setting::COUNT) + 1, "{function}");
    }
    // The check itself takes two bytes.
    assert_eq!(passes("control::memory::checksum"), saved::COPY - 2 + 1);
    for function in ["Ground::is_closed", "Ground::zones"] {
        assert_eq!(passes(&format!("control::ground::{function}")), keep_out::CAPACITY + 1, "{function}");
    }
    for function in ["say::command::next_word", "say::command::number"] {
        assert_eq!(passes(&format!("control::{function}")), LINE_LENGTH + 1, "{function}");
    }
    // A typed word may continue after the longest word of a group.
    let words = [
        Setting::all().map(Setting::text).collect::<Vec<_>>(),
        (0..Word::COUNT).filter_map(Word::from_index).map(Word::text).collect(),
        (0..Argument::COUNT).filter_map(Argument::from_index).map(Argument::text).collect(),
    ];
    let most = words.iter().map(Vec::len).max().expect("there are groups");
    let longest = words.iter().flatten().map(|word| word.bytes().count()).max().expect("there are words");
    assert_eq!(by_depth("control::say::packed::Text::find"), [most + 1, longest + 1]);
    assert_eq!(passes("control::say::packed::Text::start"), packed::LARGEST_GROUP);
    assert_eq!(passes("control::say::command::parse_to"), ROWS.len() + 1);
    assert_eq!(passes("control::say::packed::Characters::next"), packed::HALVINGS + 1);
    // Twice, and once more to find that there is no third time.
    assert_eq!(by_depth("control::ground::Ground::widen"), [3, keep_out::CAPACITY + 1]);
    assert_eq!(passes("control::say::line::Line::next"), line::TEXTS + 1);
    assert_eq!(passes("weeder_firmware::run"), dry_run::PLANTS as usize + 1);
    for function in ["answer::Answer::write_line", "execute::execute"] {
        assert_eq!(
            passes(&format!("control::say::{function}")),
            usize::from(field_examples::CAPACITY) + 1,
            "{function}"
        );
    }
    // A label is checked with all built-in examples at once. A slot has the features, the label and the CRC.
    let slot = features::COUNT + 1 + 2;
    assert_eq!(by_depth("control::ground::nearest::Nearest::ask"), [examples::COUNT + 1, slot + 1]);
    assert_eq!(by_depth("control::ground::nearest::Nearest::keep"), [field_examples::CAPACITY as usize + 1, slot + 1]);
    assert_eq!(passes("control::ground::field_examples::FieldExamples::slot"), slot + 1);
    for function in ["control::ground::nearest::Nearest::begin", "control::ground::nearest::Nearest::vote"] {
        assert_eq!(passes(function), usize::from(MAX_K) + 1, "{function}");
    }
    assert_eq!(passes("knn::nearest::Nearest::join"), usize::from(MAX_K));
    assert_eq!(passes("weeder_firmware::eeprom::Eeprom::update"), saved::COPY + 1);
    // The ELF must have the loops' own records: of the edges that a turn takes, and of the console's bytes.
    let records = program(&elf()).records.len();
    assert_eq!(records, 2);
    // Bytes that move when an entry of a list is removed. An entry takes at least as many bytes on the PC.
    let moves = [(event::CAPACITY - 1) * size_of::<Event>(), (keep_out::CAPACITY - 1) * size_of::<Detection>()];
    for function in ["memcpy", "memmove", "memset"] {
        assert!(moves.iter().all(|&moved| passes(function) > moved), "{function}: {moves:?}");
    }
}

/// Flash with a function that begins by writing to a register. The write replaces its first instruction. `None` if that
/// instruction is not a pure move or comparison.
fn with_a_write(flash: &[u8], function: usize, register: u16) -> Option<Vec<u8>> {
    let first = u16::from_le_bytes([flash[function], flash[function + 1]]);
    let (is_movw, is_mov) = (first >> 8 == 0x01, first & 0xFC00 == 0x2C00);
    let (is_ldi, is_cpi) = (first >> 12 == 0xE, first >> 12 == 0x3);
    let mut flash = flash.to_vec();
    // `mov` from r24.
    let mov = 0x2C00 | 1 << 9 | 8 | (register & 0x10) << 4 | (register & 0xF) << 4;
    flash[function..function + 2].copy_from_slice(&mov.to_le_bytes());
    (is_movw || is_mov || is_ldi || is_cpi).then_some(flash)
}

#[test]
fn a_function_that_writes_to_a_register_that_it_should_preserve_is_found() {
    let elf = elf();
    let image = Image::read(&elf).expect("it is an ELF");
    let file = std::fs::read(&elf).expect("it can be read");
    // The file has the code in the same order as flash.
    let start = file.windows(64).position(|window| *window == image.flash[..64]).expect("flash is in the file");
    assert_eq!(file[start..start + 0x4000], image.flash[..0x4000]);
    // Whether the write was found; `None` if it was not possible.
    let is_found = |(name, &at): (&String, &u32)| {
        // One register for each function. The frame pointer is left out: without it the stack could not be followed.
        let register = if at & 2 == 0 { 16 } else { 14 };
        let flash = with_a_write(&image.flash, at as usize, register)?;
        let mut file = file.clone();
        file[start..start + flash.len()].copy_from_slice(&flash);
        let broken = Path::new(env!("CARGO_TARGET_TMPDIR")).join(format!("spoils-a-register-{at}.elf"));
        std::fs::write(&broken, file).expect("it can be written");
        let proved = prove(&program(&broken), &Budgets::default());
        std::fs::remove_file(&broken).expect("it is there");
        match proved {
            Ok(_) => Some(false),
            Err(error) => {
                let error = error.to_string();
                let registers = error.split_once(" does not preserve ").map(|(_, registers)| registers);
                let registers = registers.unwrap_or_else(|| panic!("{name} with a write to r{register}: {error}"));
                Some(registers.contains(&format!("r{register}")))
            }
        }
    };
    let functions: Vec<_> = image.functions.iter().collect();
    let apart = functions.len().div_ceil(cases(functions.len() as u64) as usize);
    let (found, unnoticed): (Vec<bool>, Vec<bool>) =
        functions.into_par_iter().step_by(apart).filter_map(is_found).partition(|is_found| *is_found);
    let (found, unnoticed) = (found.len(), unnoticed.len());
    // The others never return, or are never called.
    println!("{found} were found, {unnoticed} went unnoticed");
    let least = if is_thorough() { 10 } else { 0 };
    assert!(found > least, "{found} were found");
}
