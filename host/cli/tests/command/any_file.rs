//! Random input for every file that a host tool reads: damaged real files, and noise. Each is read, or refused with a
//! message in one line that names the file. No input may cause a panic or unbounded memory.

use avr_bounds::Budgets;
use field::conditions::Conditions;
use field::machine::Machine;
use field::pass::Pass;
use field::row::Row;
use field::verdict::ZoneSettings;
use field::wiring;
use files::bounded_file;
use gps::{Job, Wanted, map, picture};
use link::row_names::Names;
use link::settings_file;
use logbook::{log, replay};
use proptest::prelude::*;
use std::error::Error;
use std::path::Path;
use study::evaluation::{self, Analysis};
use study::training::table;
use uno::bootloader::Bootloader;
use uno::elf::Image;
use uno::hex;
use uno::recording;

/// The reader of a kind of file, and a file of that kind.
type Reader = (&'static str, fn(&Path) -> Result<(), Box<dyn Error>>, fn() -> Vec<u8>);

/// Longest row that is also rolled along, in mm. Longer rows only take longer.
const ROLLED_MM: f64 = 20_000.0;

const READERS: [Reader; 12] = [
    (
        "row.csv",
        |path| {
            let row = Row::parse_csv(path, bounded_file::bytes(path)?)?;
            let span = row.span_mm();
            if span.end - span.start < ROLLED_MM {
                let pass = Pass::at_speed(row, Machine::default(), ZoneSettings::default(), 700.0);
                let changes = pass.machine.pin_changes(&pass.row, &pass.motion, 0);
                assert!(changes.len() < 200_000, "{}", changes.len());
            }
            Ok(())
        },
        || b"# measured in May\nposition_mm,width_mm,kind\n250,150,plant\n500,15,weed\n750.5,160,plant\n".to_vec(),
    ),
    (
        "field.toml",
        |path| Ok(Conditions::load(path.to_str().expect("it is text")).map(drop)?),
        || b"[plot]\nrows = 2\nrow_m = 12.5\n[crop]\ncanopy_mm = 120\n[settings]\nlead_out_ms = 200\n".to_vec(),
    ),
    (
        "log.csv",
        |path| {
            let log = log::read(path)?;
            let job = Job::read(&log, &Wanted::default());
            assert!(map::features(&[("log", &job)]).features.len() >= job.events().count());
            picture::draw(&[&job], &picture::Words::default());
            replay::replay(&log)?;
            Ok(())
        },
        || {
            let lines = [
                "time_ms,kind,line",
                "0,antenna,beam_ahead_mm=500 beam_right_mm=0 delay_ms=0",
                "0,gps_found,/dev/ttyUSB0",
                "0,connected,0.2.0",
                "0,setting,k=3",
                "0,setting,margin_mm=50",
                "0,example,built_in 0 plant 1 2 3 4 5",
                "5,status,state=hold tool=out pos=100 speed_mm_s=500 windows=0 unseen_mm=300",
                "6,gps,\"$GPGGA,092750.000,5321.6802,N,00630.3372,W,1,8,1.03,61.7,M,55.2,M,,*76\"",
                "20,command,start now",
                "22,event,state is=work",
                "90,event,plant pos=944 votes=3 spacing=944 delay=668 hold=477 actuation=1145",
                "110,gps,\"$GPGGA,092750.100,5321.6802,N,00630.3371,W,1,8,1.03,61.7,M,55.2,M,,*74\"",
                "120,status,state=work tool=in pos=1500 speed_mm_s=500 windows=1 unseen_mm=0",
                "150,event,swing tool=out pos=1510",
                "160,event,alarm name=beam_blocked code=11 pos=1600",
                "220,status,state=alarm tool=out pos=1700 speed_mm_s=0 windows=0 unseen_mm=0",
            ];
            (lines.join("\n") + "\n").into_bytes()
        },
    ),
    (
        "budgets.toml",
        |path| Ok(Budgets::read(path).map(drop)?),
        || {
            b"# of main\nstack_bytes = 700\n[loops]\nwait = { passes = 9, because = \"the converter\" }\n\
              [calls]\nmain = [\"a\", \"b\"]\n"
                .to_vec()
        },
    ),
    (
        "machine-settings.toml",
        |path| Ok(settings_file::read(path).map(drop)?),
        || b"# mine\nwheel_mm = 405\nk = 3 # votes\nend_switch = true\n".to_vec(),
    ),
    (
        "rows.toml",
        |path| Ok(Names::read(path).map(drop)?),
        || b"# from the left\nleft = { serial_number = \"85735\" }\n\"row 2\" = { port = \"/dev/pts/7\" }\n".to_vec(),
    ),
    (
        "objects.csv",
        |path| Ok(table::read(path).map(drop)?),
        || {
            b"speed_mm_s,spacing_mm,delay_mm,hold_mm,actuation_mm,label\n694,500,226,250,573,plant\n555,205,350,108,458,weed\nok\n".to_vec()
        },
    ),
    (
        "trial.csv",
        |path| {
            let analysis = Analysis::of(evaluation::read_csv(path)?)?;
            assert!(!analysis.to_string().is_empty());
            Ok(())
        },
        || include_bytes!("../../../../docs/trial-example.csv").to_vec(),
    ),
    (
        "my.toml",
        |path| {
            let machine = mechanics::file::read(path)?;
            let design = mechanics::design::Design::of(&machine)?;
            assert!(!design.figures(&machine).is_empty());
            Ok(())
        },
        || mechanics::machine::Machine::default().to_toml().into_bytes(),
    ),
    (
        "logic.vcd",
        |path| Ok(recording::read(path, &[(wiring::ENCODER_A, "A"), (wiring::ENCODER_B, "B")]).map(drop)?),
        || {
            b"$timescale 1 us $end\n$scope module analyser $end\n$var wire 1 ! A $end\n$var wire 1 \" B $end\n\
              $upscope $end\n$enddefinitions $end\n#0 0! 0\"\n#10 1!\n#20 1\"\n#30 0!\n"
                .to_vec()
        },
    ),
    (
        "boot.hex",
        |path| Ok(Bootloader::read(path)?.behind(&[0; 100]).map(drop)?),
        || hex::text(&[0x12; 64]).into_bytes(),
    ),
    (
        "weeder.elf",
        |path| Ok(Image::read(path).map(drop)?),
        // The head of an ELF for AVR, with one segment.
        || {
            let mut elf = vec![0x7F, b'E', b'L', b'F', 1, 1, 1, 0, 0, 0, 0, 0, 0, 0, 0, 0];
            elf.extend([
                2, 0, 83, 0, 1, 0, 0, 0, 0, 0, 0, 0, 52, 0, 0, 0, 0, 0, 0, 0, 0, 0, 0, 0, 52, 0, 32, 0, 1, 0, 40, 0,
            ]);
            elf.extend([
                0, 0, 0, 0, 1, 0, 0, 0, 84, 0, 0, 0, 0, 0, 0, 0, 0, 0, 0, 0, 4, 0, 0, 0, 4, 0, 0, 0, 5, 0, 0, 0,
            ]);
            elf.extend([2, 0, 0, 0, 0xAA, 0xBB, 0xCC, 0xDD]);
            elf
        },
    ),
];

/// Numbers that are too large, too small, or invalid.
const NUMBERS: [&str; 12] = [
    "4294967296",
    "18446744073709551616",
    "-1",
    "-9223372036854775809",
    "2147483647",
    "1e308",
    "1e-308",
    "nan",
    "-inf",
    "0",
    "65536",
    "99999999999999999999999999999999999999",
];

/// Characters with a meaning in files or terminals.
const MARKS: [&str; 16] =
    ["\"", "\"\"\"", "'", "'''", "`", ",", ";", "=", "#", "[", "{", "\n", "\r", "\0", "\u{1b}[2J", "\u{2028}"];

/// A random change of a file.
#[derive(Clone, Debug)]
enum Mishap {
    Cut(prop::sample::Index),
    Bytes(prop::sample::Index, Vec<u8>),
    Number(prop::sample::Index, prop::sample::Index),
    Mark(prop::sample::Index, prop::sample::Index),
    Repeat(prop::sample::Index, usize, usize),
    Gone(prop::sample::Index, usize),
}

fn mishap() -> impl Strategy<Value = Mishap> {
    let index = any::<prop::sample::Index>;
    prop_oneof![
        1 => index().prop_map(Mishap::Cut),
        2 => (index(), prop::collection::vec(any::<u8>(), 1..20)).prop_map(|(at, bytes)| Mishap::Bytes(at, bytes)),
        6 => (index(), index()).prop_map(|(at, number)| Mishap::Number(at, number)),
        6 => (index(), index()).prop_map(|(at, mark)| Mishap::Mark(at, mark)),
        2 => (index(), 1..60_usize, 2..400_usize).prop_map(|(at, length, times)| Mishap::Repeat(at, length, times)),
        2 => (index(), 1..60_usize).prop_map(|(at, length)| Mishap::Gone(at, length)),
    ]
}

impl Mishap {
    fn befall(&self, file: &mut Vec<u8>) {
        if file.is_empty() {
            return;
        }
        let end = |from: usize, length: usize| (from + length).min(file.len());
        match self {
            Self::Cut(at) => file.truncate(at.index(file.len())),
            Self::Bytes(at, bytes) => {
                let from = at.index(file.len());
                file.splice(from..end(from, bytes.len()), bytes.iter().copied());
            }
            Self::Number(at, number) => {
                let is_of_number = |byte: &u8| byte.is_ascii_digit() || *byte == b'.';
                let starts: Vec<usize> = (0..file.len())
                    .filter(|&place| is_of_number(&file[place]) && (place == 0 || !is_of_number(&file[place - 1])))
                    .collect();
                if let Some(&from) = starts.get(at.index(starts.len().max(1))) {
                    let length = file[from..].iter().take_while(|byte| is_of_number(byte)).count();
                    file.splice(from..from + length, NUMBERS[number.index(NUMBERS.len())].bytes());
                }
            }
            Self::Mark(at, mark) => {
                let at = at.index(file.len());
                file.splice(at..at, MARKS[mark.index(MARKS.len())].bytes());
            }
            Self::Repeat(at, length, times) => {
                let from = at.index(file.len());
                let part = file[from..end(from, *length)].repeat(*times);
                file.splice(from..from, part);
            }
            Self::Gone(at, length) => {
                let from = at.index(file.len());
                file.drain(from..end(from, *length));
            }
        }
    }
}

/// The message must be one line. Other control characters are escaped when the command prints it.
fn assert_is_message(name: &str, error: &dyn Error) {
    let message = error.to_string();
    assert!(!message.is_empty() && message.lines().count() == 1, "{name}: {message:?}");
}

#[test]
fn the_files_from_which_mishaps_start_are_read() {
    let folder = tempfile::tempdir().unwrap();
    // The bytes of the bootloader are at an invalid address.
    for (name, read, file) in READERS.into_iter().filter(|(name, ..)| *name != "boot.hex") {
        let path = folder.path().join(name);
        std::fs::write(&path, file()).unwrap();
        read(&path).unwrap_or_else(|error| panic!("{name}: {error}"));
    }
}

proptest! {
    #![proptest_config(ProptestConfig { cases: 400, ..ProptestConfig::default() })]

    #[test]
    fn no_file_brings_a_tool_down(mishaps in prop::collection::vec(mishap(), 1..5)) {
        let folder = tempfile::tempdir().unwrap();
        for (name, read, file) in READERS {
            let mut file = file();
            mishaps.iter().for_each(|mishap| mishap.befall(&mut file));
            let path = folder.path().join(name);
            std::fs::write(&path, file).unwrap();
            if let Err(error) = read(&path) {
                assert_is_message(name, &*error);
            }
        }
    }

    #[test]
    fn noise_is_refused(noise in prop::collection::vec(any::<u8>(), 0..400)) {
        let folder = tempfile::tempdir().unwrap();
        for (name, read, _) in READERS {
            let path = folder.path().join(name);
            std::fs::write(&path, &noise).unwrap();
            if let Err(error) = read(&path) {
                assert_is_message(name, &*error);
            }
        }
    }
}
