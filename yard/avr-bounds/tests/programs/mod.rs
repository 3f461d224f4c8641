//! Builds test programs that Debian and simavr supply: arduino-core-avr with its bootloaders, avr-libc's manual,
//! simavr's tests.
//!
//! They are linked with `--emit-relocs`, which changes no byte of the program. A built program is kept in the target
//! folder.

use std::path::{Path, PathBuf};
use std::process::Command;
use std::sync::{Mutex, OnceLock};

/// Debian's arduino-core-avr, and the examples of avr-libc's manual.
const ARDUINO: &str = "/usr/share/arduino/hardware/arduino/avr";
const MANUAL: &str = "/usr/share/doc/avr-libc/examples";

/// A program, and its facts for the budgets.
pub struct Sample {
    pub name: String,
    pub elf: PathBuf,
    /// The chip, if the ELF does not name it.
    pub chip: Option<&'static str>,
    pub facts: String,
}

/// A board's name, chip and variant.
const BOARDS: [(&str, &str, &str); 3] =
    [("uno", "atmega328p", "standard"), ("mega", "atmega2560", "mega"), ("leonardo", "atmega32u4", "leonardo")];

/// Facts about functions: one calls itself, and one calls by a virtual table while its own address is taken.
const FACTS: [(&str, &str); 2] = [
    (
        "uart_putchar",
        "[recursion]\nuart_putchar = { depth = 2, because = \"it calls itself for the return in front of a line feed\" }",
    ),
    ("requestEvent()", "[calls]\n\"requestEvent()\" = [\"TwoWire::write(unsigned char const*, unsigned int)\"]"),
];

/// Every program.
pub fn samples() -> Vec<Sample> {
    static BUILT: OnceLock<Vec<(String, PathBuf)>> = OnceLock::new();
    let built = BUILT.get_or_init(|| {
        let mut built = of_arduino();
        built.extend(of_simavr());
        built.extend(of_manual());
        built.extend(of_bootloaders());
        built.sort();
        built
    });
    let sample = |(name, elf): &(String, PathBuf)| {
        // Without the C library's start-up code nothing in the ELF names the chip.
        let chip = ["atmega328p", "atmega168", "atmega8"].into_iter().find(|chip| name.ends_with(&format!(" {chip}")));
        let program = avr_bounds::Program::read(elf, chip).unwrap_or_else(|error| panic!("{name}: {error}"));
        let has = |function: &str| program.functions.values().any(|symbol| symbol.name == function);
        let facts = FACTS.iter().filter(|(function, _)| has(function)).map(|(_, facts)| *facts);
        Sample { name: name.clone(), elf: elf.clone(), chip, facts: facts.collect() }
    };
    built.iter().map(sample).collect()
}

/// The folder for built files.
fn folder(name: &str) -> PathBuf {
    let folder = Path::new(env!("CARGO_TARGET_TMPDIR")).join("programs").join(name);
    std::fs::create_dir_all(&folder).expect("there is room for a folder");
    folder
}

/// Runs a compiler. Returns whether it succeeded.
fn run(command: &mut Command) -> bool {
    command.output().unwrap_or_else(|error| panic!("{command:?}: {error}: run ./setup.sh")).status.success()
}

/// Files below a folder with this ending of their names.
fn files(folder: &Path, end: &str) -> Vec<PathBuf> {
    let Ok(entries) = std::fs::read_dir(folder) else { return Vec::new() };
    let mut found = Vec::new();
    for path in entries.filter_map(|entry| Some(entry.ok()?.path())) {
        if path.is_dir() {
            found.extend(files(&path, end));
        } else if path.to_string_lossy().ends_with(end) {
            found.push(path);
        }
    }
    found.sort();
    found
}

/// A compiler for a board of the Arduino core, with the core's options.
fn compiler(path: &Path, chip: &str, variant: &str) -> Command {
    let is_c = path.extension().is_some_and(|end| end == "c");
    let mut gcc = Command::new(if is_c { "avr-gcc" } else { "avr-g++" });
    if is_c {
        gcc.arg("-std=gnu11");
    } else if path.extension().is_some_and(|end| end == "S") {
        gcc.args(["-x", "assembler-with-cpp"]);
    } else {
        gcc.args(["-std=gnu++11", "-fpermissive", "-fno-exceptions", "-fno-threadsafe-statics"]);
    }
    gcc.args(["-g", "-Os", "-w", "-ffunction-sections", "-fdata-sections", "-DF_CPU=16000000L", "-DARDUINO=10808"]);
    gcc.args(["-DARDUINO_ARCH_AVR", "-DDECIMAL_DIG=__DECIMAL_DIG__", &format!("-mmcu={chip}")]);
    if variant == "leonardo" {
        gcc.args(["-DUSB_VID=0x2341", "-DUSB_PID=0x8036", "-DUSB_MANUFACTURER=\"x\"", "-DUSB_PRODUCT=\"y\""]);
    }
    gcc.args([format!("-I{ARDUINO}/cores/arduino"), format!("-I{ARDUINO}/variants/{variant}")]);
    gcc.args(["SPI", "SoftwareSerial", "Wire", "EEPROM"].map(|library| format!("-I{ARDUINO}/libraries/{library}/src")));
    gcc
}

/// Every example of the core's libraries, on every board.
fn of_arduino() -> Vec<(String, PathBuf)> {
    let mut built = Vec::new();
    for (board, chip, variant) in BOARDS {
        let core = folder(&format!("core-{board}"));
        let archive = core.join("core.a");
        if !archive.exists() {
            let mut objects = Vec::new();
            for part in ["cores/arduino", "libraries/SPI/src", "libraries/SoftwareSerial/src", "libraries/Wire/src"] {
                let part = Path::new(ARDUINO).join(part);
                for source in [".c", ".cpp", ".S"].iter().flat_map(|end| files(&part, end)) {
                    let name = source.file_name().expect("a file has a name").to_string_lossy().into_owned();
                    let object = core.join(format!("{name}.o"));
                    let took = run(compiler(&source, chip, variant).arg("-c").arg(&source).arg("-o").arg(&object));
                    assert!(took, "{} was not compiled", source.display());
                    objects.push(object);
                }
            }
            assert!(!objects.is_empty(), "there is no Arduino core: ./setup.sh brings it");
            assert!(run(Command::new("avr-ar").arg("rcs").arg(&archive).args(objects)));
        }
        for sketch in files(&Path::new(ARDUINO).join("libraries"), ".ino") {
            let name = sketch.file_stem().expect("a file has a name").to_string_lossy().into_owned();
            let (elf, source) = (core.join(format!("{name}.elf")), core.join(format!("{name}.cpp")));
            if !elf.exists() {
                std::fs::write(&source, as_cpp(&std::fs::read_to_string(&sketch).expect("it is text")))
                    .expect("there is room");
                let mut gcc = compiler(&source, chip, variant);
                gcc.arg(&source).arg(&archive).args(["-Wl,--gc-sections,--emit-relocs", "-lm", "-o"]).arg(&elf);
                assert!(run(&mut gcc), "{} was not linked", sketch.display());
            }
            built.push((format!("{board}/{name}"), elf));
        }
    }
    built
}

/// A sketch as C++: with the core's header, and every function declared in front.
fn as_cpp(sketch: &str) -> String {
    let is_head = |line: &&str| {
        line.starts_with(|first: char| first.is_ascii_alphabetic())
            && line.trim_end().ends_with(") {")
            && line.contains(' ')
    };
    let heads: String =
        (sketch.lines().filter(is_head)).map(|line| line.trim_end().trim_end_matches('{').to_owned() + ";\n").collect();
    format!("#include <Arduino.h>\n{heads}{sketch}")
}

/// The programs of simavr's tests. Each name begins with its chip.
fn of_simavr() -> Vec<(String, PathBuf)> {
    // Packages for other machines need not be there.
    let host = format!("{}-unknown-linux-gnu", std::env::consts::ARCH);
    let output = Command::new(env!("CARGO"))
        .args(["metadata", "--format-version", "1", "--offline", "--filter-platform", &host])
        .output();
    let metadata = String::from_utf8(output.expect("cargo starts").stdout).expect("it is text");
    let metadata: serde_json::Value = serde_json::from_str(&metadata).expect("it is JSON");
    let packages = metadata["packages"].as_array().expect("there are packages");
    let simavr = packages.iter().find(|package| package["name"] == "simavr-ffi").expect("simavr-ffi is used");
    let manifest = Path::new(simavr["manifest_path"].as_str().expect("it has a manifest"));
    let simavr = manifest.parent().expect("it lies in a folder").join("vendor/simavr");
    let to = folder("simavr");
    let mut built = Vec::new();
    for source in files(&simavr.join("tests"), ".c") {
        let name = source.file_stem().expect("a file has a name").to_string_lossy().into_owned();
        let chip = name.split('_').next().unwrap_or_default().to_owned();
        let is_known = avr_bounds::Chip::named(&chip).is_some();
        if !is_known {
            continue;
        }
        let elf = to.join(format!("{name}.elf"));
        let mut gcc = Command::new("avr-gcc");
        gcc.args(["-std=gnu99", "-g", "-Os", "-w", "-DF_CPU=8000000", "-Wl,--emit-relocs", &format!("-mmcu={chip}")]);
        gcc.args(
            ["simavr/sim/avr", "simavr/sim", "examples/shared"]
                .map(|part| format!("-I{}", simavr.join(part).display())),
        );
        if elf.exists() || run(gcc.arg(&source).arg("-o").arg(&elf)) {
            built.push((format!("simavr/{name}"), elf));
        }
    }
    built
}

/// The examples of avr-libc's manual, with and without `-mcall-prologues`.
fn of_manual() -> Vec<(String, PathBuf)> {
    let to = folder("manual");
    for packed in files(Path::new(MANUAL), "") {
        let name = packed.file_name().expect("a file has a name").to_string_lossy().into_owned();
        let output = Command::new("gzip").args(["-cdf"]).arg(&packed).output().expect("gzip is there");
        std::fs::write(to.join(name.trim_end_matches(".gz")), output.stdout).expect("there is room");
    }
    let programs: [(&str, &str, &[&str]); 4] = [
        ("demo", "atmega8", &["demo.c"]),
        ("largedemo", "atmega168", &["largedemo.c"]),
        ("stdiodemo", "atmega32", &["stdiodemo.c", "lcd.c", "uart.c", "hd44780.c"]),
        ("twitest", "atmega8", &["twitest.c"]),
    ];
    let mut built = Vec::new();
    for (name, chip, sources) in programs {
        for (suffix, option) in [("", "-Os"), (" -mcall-prologues", "-mcall-prologues")] {
            let elf = to.join(format!("{name}{suffix}.elf"));
            let mut gcc = Command::new("avr-gcc");
            gcc.args(["-g", "-Os", "-w", option, "-DF_CPU=8000000UL", "-Wl,--emit-relocs", &format!("-mmcu={chip}")]);
            gcc.args(sources.iter().map(|source| to.join(source))).args(["-lm", "-o"]).arg(&elf);
            if elf.exists() || run(&mut gcc) {
                built.push((format!("manual/{name}{suffix}"), elf));
            }
        }
    }
    built
}

/// The bootloaders of the Arduino core that need nothing else. They are built as in their Makefiles, each at the
/// flash's end.
fn of_bootloaders() -> Vec<(String, PathBuf)> {
    // Without the LED: with it, Debian's compiler needs more than the 512 bytes.
    let optiboot = ["-fno-split-wide-types", "-mrelax", "-nostartfiles", "-nostdlib", "-DLED_START_FLASHES=0"];
    let optiboot = |begin: &str, version: &str| {
        let sections =
            [format!("-Wl,--section-start=.text={begin}"), format!("-Wl,--section-start=.version={version}")];
        [&optiboot.map(str::to_owned)[..], &sections, &["-DBAUD_RATE=115200".to_owned()]].concat()
    };
    let boot = |begin: &str| {
        let options = ["-DMAX_TIME_COUNT=F_CPU>>4", "-DNUM_LED_FLASHES=1", "-DBAUD_RATE=19200"];
        [&options.map(str::to_owned)[..], &[format!("-Wl,--section-start=.text={begin}")]].concat()
    };
    let stk500 = ["-D_MEGA_BOARD_", "-DBAUDRATE=115200", "-funsigned-char", "-Wl,--section-start=.text=0x3e000"];
    let bootloaders = [
        ("optiboot/optiboot.c", "atmega328p", optiboot("0x7e00", "0x7ffe")),
        ("optiboot/optiboot.c", "atmega168", optiboot("0x3e00", "0x3ffe")),
        ("optiboot/optiboot.c", "atmega8", optiboot("0x1e00", "0x1ffe")),
        ("atmega/ATmegaBOOT_168.c", "atmega328p", boot("0x7800")),
        ("atmega/ATmegaBOOT_168.c", "atmega168", boot("0x3800")),
        ("atmega8/ATmegaBOOT.c", "atmega8", boot("0x1c00")),
        ("stk500v2/stk500boot.c", "atmega2560", stk500.map(str::to_owned).to_vec()),
    ];
    let to = folder("bootloaders");
    let mut built = Vec::new();
    for (source, chip, options) in bootloaders {
        let source = Path::new(ARDUINO).join("bootloaders").join(source);
        let name = source.file_stem().expect("a file has a name").to_string_lossy().into_owned();
        let elf = to.join(format!("{name}-{chip}.elf"));
        let mut gcc = Command::new("avr-gcc");
        // Without relocations, which cost optiboot the short calls that it needs for its 512 bytes.
        gcc.args(["-g", "-Os", "-w", "-DF_CPU=16000000L", &format!("-mmcu={chip}")]).args(options);
        assert!(elf.exists() || run(gcc.arg(&source).arg("-o").arg(&elf)), "{} was not built", source.display());
        built.push((format!("bootloader/{name} {chip}"), elf));
    }
    built
}

/// Asserts that README.md has this text between its markers; `UPDATE_EXPECT=1` writes it there.
pub fn expect_in_readme(name: &str, text: &str) {
    static WRITING: Mutex<()> = Mutex::new(());
    let _alone = WRITING.lock();
    let readme = Path::new(env!("CARGO_MANIFEST_DIR")).join("README.md");
    let whole = std::fs::read_to_string(&readme).expect("there is a README");
    let (begin, end) = (format!("<!-- {name} -->\n"), format!("<!-- end of {name} -->"));
    let (before, rest) = whole.split_once(&begin).unwrap_or_else(|| panic!("README.md has no {begin}"));
    let (_, behind) = rest.split_once(&end).unwrap_or_else(|| panic!("README.md has no {end}"));
    let expected = format!("{before}{begin}{text}{end}{behind}");
    if std::env::var_os("UPDATE_EXPECT").is_some() {
        std::fs::write(&readme, expected).expect("it can be written");
    } else {
        assert_eq!(whole, expected, "README.md is not what was measured: UPDATE_EXPECT=1 writes it");
    }
}
