//! The fixtures: small C programs that avr-gcc compiles for the virtual Uno.

use std::path::{Path, PathBuf};
use std::process::Command;

use virtual_uno::Uno;
use virtual_uno::{Pin, Wire};

/// Compiles a fixture and returns its ELF.
pub fn compile(name: &str) -> PathBuf {
    let source = Path::new(env!("CARGO_MANIFEST_DIR")).join("tests/fixtures").join(name).with_extension("c");
    // Tests run in parallel, and several compile the same fixture.
    let thread = format!("{:?}", std::thread::current().id());
    let elf = Path::new(env!("CARGO_TARGET_TMPDIR"))
        .join(format!("{name}-{}-{thread}", std::process::id()))
        .with_extension("elf");
    let output = Command::new("avr-gcc")
        .args(["-mmcu=atmega328p", "-DF_CPU=16000000UL", "-Os", "-Wall", "-Werror"])
        // Switches off the linker's own check of the size: the test needs an ELF that is too large.
        .args(["-Wl,--defsym=__TEXT_REGION_LENGTH__=65536", "-o"])
        .args([&elf, &source])
        .output()
        .unwrap_or_else(|error| panic!("avr-gcc could not be started ({error}): run ./setup.sh"));
    assert!(output.status.success(), "{}", String::from_utf8_lossy(&output.stderr));
    elf
}

/// The initial levels of the inputs.
const INPUTS: [Wire; 5] = [
    Wire { pin: Pin::D2, name: "D2", high_at_rest: false },
    Wire { pin: Pin::D3, name: "D3", high_at_rest: false },
    Wire { pin: Pin::D4, name: "D4", high_at_rest: true },
    Wire { pin: Pin::D5, name: "D5", high_at_rest: true },
    Wire { pin: Pin::D8, name: "D8", high_at_rest: true },
];

/// Powers up an Uno with a fixture.
pub fn boot(name: &str) -> Uno {
    Uno::boot(&compile(name)).expect("a fixture boots").wired(&INPUTS)
}
