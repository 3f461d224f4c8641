//! Assembles small programs and proves their bounds.

use avr_bounds::{Bounds, BoundsError, Budgets, Input, LoopBounds, Program, prove};
use std::io::Write;
use std::process::{Command, Stdio};

/// Assembles a program for the ATmega328P and proves its bounds. It begins at `start`. `handler` is INT0's, if there is
/// one, and `other` is Timer0's. An unused vector leads to the reset, as in avr-libc.
pub fn try_to_prove(program: &str, input: Option<&Input>) -> Result<Bounds, BoundsError> {
    try_to_prove_with(program, input, &LoopBounds::new())
}

/// The same with loop bounds of its functions.
pub fn try_to_prove_with(program: &str, input: Option<&Input>, loops: &LoopBounds) -> Result<Bounds, BoundsError> {
    try_to_prove_by(program, &Budgets { input: input.cloned(), loops: loops.clone(), ..Budgets::default() })
}

/// The same with facts of any kind. Every time that a budget can limit must have a bound.
pub fn try_to_prove_by(program: &str, facts: &Budgets) -> Result<Bounds, BoundsError> {
    let elf = assembled(program);
    let bounds = prove(&Program::read(elf.path(), Some("atmega328p"))?, facts)?;
    let any = Some(u64::MAX);
    Budgets { handler_cycles: any, critical_section_cycles: any, ..Budgets::default() }.hold(&bounds)?;
    Ok(bounds)
}

/// The ELF of a program that begins at `start`.
pub fn assembled(program: &str) -> tempfile::NamedTempFile {
    assembled_for(program, false)
}

/// The same, for the ATmega2560 if `is_large` is set.
pub fn assembled_for(program: &str, is_large: bool) -> tempfile::NamedTempFile {
    let used = |label: &str| if program.contains(&format!("{label}:")) { label.to_owned() } else { "0".to_owned() };
    let vectors: String = (0..57)
        .map(|vector| match vector {
            0 => "jmp start\n".to_owned(),
            1 => format!("jmp {}\n", used("handler")),
            16 => format!("jmp {}\n", used("other")),
            26.. if !is_large => String::new(),
            _ => "jmp 0\n".to_owned(),
        })
        .collect();
    let functions: String = (program.lines())
        .filter_map(|line| line.trim().strip_suffix(':'))
        .filter(|label| label.parse::<u8>().is_err())
        .map(|label| format!(".type {label}, @function\n"))
        .collect();
    let elf = tempfile::NamedTempFile::new().expect("there is room for a file");
    let mut gcc = Command::new("avr-gcc")
        .arg(if is_large { "-mmcu=atmega2560" } else { "-mmcu=atmega328p" })
        .args(["-nostdlib", "-x", "assembler", "-", "-o"])
        .arg(elf.path())
        .stdin(Stdio::piped())
        .spawn()
        .unwrap_or_else(|error| panic!("avr-gcc could not be started ({error}): run ./setup.sh"));
    let mut source = gcc.stdin.take().expect("it was asked for");
    writeln!(source, "{functions}{vectors}{program}").expect("avr-gcc reads");
    drop(source);
    assert!(gcc.wait().expect("avr-gcc ends").success(), "{program}");
    elf
}

#[track_caller]
pub fn proved(program: &str) -> Bounds {
    try_to_prove(program, None).unwrap_or_else(|error| panic!("{error}"))
}

/// Asserts that a program is refused with this message.
#[track_caller]
pub fn assert_refused(program: &str, words: &str) {
    let error = try_to_prove(program, None).expect_err("it has no bounds").to_string();
    assert!(error.contains(words), "{error}");
}
