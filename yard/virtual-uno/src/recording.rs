//! Recordings of the pins, as VCD files: [`read`] takes a logic analyser's, [`write()`] makes one for PulseView or GTKWave.
//!
//! Levels are at cycles of the Uno, from any time unit of the file. The caller chooses channels by the names in the
//! analyser's software. Nothing is filtered or repaired: an undefined level is an error.

use crate::file_error::FileError;
use crate::pins::{CYCLES_PER_SECOND, Pin, PinChange, Wire};
use std::collections::BTreeMap;
use std::fs::File;
use std::io::{self, BufRead, BufReader, ErrorKind, Read, Write};
use std::path::Path;
use vcd::{
    Command, IdCode, Parser, ReferenceIndex, Scope, ScopeItem, SimulationCommand, TimescaleUnit, Value, Var, Writer,
};

/// Longest recording, in hours. The firmware would take days to play a longer one.
const MOST_HOURS: u64 = 24;

/// Greatest nesting of scopes. An analyser writes one or two, and each uses the reader's stack.
const MOST_SCOPES: usize = 50;

/// Longest head of a file, in which its channels are declared.
const MOST_HEAD_BYTES: u64 = 1 << 20;

/// Unit of time of a written file: 100 ps, so that a cycle of 62.5 ns is exactly 625 units.
const UNITS: (u32, TimescaleUnit) = (100, TimescaleUnit::PS);

/// Units of time a cycle.
const UNITS_PER_CYCLE: u64 = 10_000_000_000 / CYCLES_PER_SECOND;

/// A channel that is being read.
struct Channel {
    pin: Pin,
    name: String,
    level: Option<bool>,
}

/// The levels of the recording at `path`, sorted by cycle from its time 0. The first of each channel is its initial
/// level, and the others are edges. `channels` maps pins to channel names in the file. A name that exists in several
/// scopes is written `scope.name`.
///
/// # Errors
/// If the file is no VCD, has no such channels, or leaves their levels open.
pub fn read(path: &Path, channels: &[(Pin, &str)]) -> Result<Vec<PinChange>, FileError> {
    let file = File::open(path).map_err(|source| FileError::unread(path, source))?;
    parse(path, BufReader::new(file), channels)
}

fn parse(path: &Path, file: impl BufRead, channels: &[(Pin, &str)]) -> Result<Vec<PinChange>, FileError> {
    let read_error = |source| FileError::unread(path, source);
    let wrong = |problem: String| FileError::new(path, problem);
    let mut file = file;
    let head = head(&mut file).map_err(read_error)?;
    // The reader wants a line end behind the last change.
    let mut parser = Parser::new(head.chain(file).chain(&b"\n"[..]));
    let header = parser.parse_header().map_err(read_error)?;
    let timescale =
        header.timescale.ok_or_else(|| wrong("has no $timescale: export the recording as VCD once more".to_owned()))?;

    let mut known = Vec::new();
    list_channels("", &header.items, &mut known);
    let mut wires = BTreeMap::new();
    for &(pin, name) in channels {
        let channel = Channel { pin, name: name.to_owned(), level: None };
        if wires.insert(find_channel(path, name, &known)?, channel).is_some() {
            return Err(wrong(format!("has channel `{name}` given for two signals: each needs its own")));
        }
    }

    let mut changes = Vec::new();
    let mut time = 0;
    while let Some(command) = parser.next().transpose().map_err(read_error)? {
        let line = parser.line();
        let (wire, value) = match command {
            Command::Timestamp(later) if later < time => {
                return Err(wrong(format!("goes back in time at line {line}")));
            }
            Command::Timestamp(later) => {
                time = later;
                continue;
            }
            Command::ChangeScalar(wire, value) => (wire, Some(value)),
            // Some programs write a single wire as a vector, too.
            Command::ChangeVector(wire, bits) => (wire, bits.iter().last()),
            _ => continue,
        };
        let (Some(channel), Some(value)) = (wires.get_mut(&wire), value) else { continue };
        let high = match value {
            Value::V0 => false,
            Value::V1 => true,
            Value::X | Value::Z => {
                let name = &channel.name;
                return Err(wrong(format!(
                    "has `{value}` on channel `{name}` at line {line}: only 0 and 1 are levels"
                )));
            }
        };
        if channel.level.replace(high) != Some(high) {
            let cycle = to_cycles(time, timescale);
            if cycle > MOST_HOURS * 3600 * CYCLES_PER_SECOND {
                return Err(wrong(format!(
                    "is longer than {MOST_HOURS} h at line {line}: cut the recording, or check its $timescale"
                )));
            }
            changes.push(PinChange { cycle, pin: channel.pin, high });
        }
    }
    match wires.into_values().find(|channel| channel.level.is_none()) {
        Some(Channel { name, .. }) => Err(wrong(format!("holds no samples of channel `{name}`"))),
        None => Ok(changes),
    }
}

/// Writes `changes`, in any order, as a VCD file with every wire by its name, inputs and outputs together. Each wire
/// starts at rest. Changes on other pins are left out. [`read`] returns exactly the same cycles.
///
/// # Errors
/// The errors of the writer.
pub fn write(file: impl Write, wires: &[Wire], changes: impl IntoIterator<Item = PinChange>) -> io::Result<()> {
    let mut changes: Vec<PinChange> = changes.into_iter().collect();
    changes.sort_by_key(|change| change.cycle);
    let mut writer = Writer::new(file);
    writer.timescale(UNITS.0, UNITS.1)?;
    writer.add_module("uno")?;
    let mut codes = Vec::new();
    for wire in wires {
        codes.push((wire, writer.add_wire(1, wire.name)?));
    }
    writer.upscope()?;
    writer.enddefinitions()?;

    writer.timestamp(0)?;
    writer.begin(SimulationCommand::Dumpvars)?;
    for &(wire, code) in &codes {
        writer.change_scalar(code, wire.high_at_rest)?;
    }
    writer.end()?;

    let mut now = 0;
    for change in changes {
        if change.cycle != now {
            now = change.cycle;
            writer.timestamp(now * UNITS_PER_CYCLE)?;
        }
        for &(wire, code) in &codes {
            if wire.pin == change.pin {
                writer.change_scalar(code, change.high)?;
            }
        }
    }
    writer.flush()
}

/// The file's head, up to the end of the channels' declarations.
fn head(file: &mut impl BufRead) -> io::Result<io::Cursor<Vec<u8>>> {
    let wrong = |problem: String| Err(io::Error::new(ErrorKind::InvalidData, problem));
    let (mut head, mut scopes) = (Vec::new(), 0_usize);
    let mut rest = file.take(MOST_HEAD_BYTES);
    loop {
        let start = head.len();
        if rest.read_until(b'\n', &mut head)? == 0 {
            break;
        }
        for word in head[start..].split(u8::is_ascii_whitespace) {
            match word {
                b"$scope" => scopes += 1,
                b"$upscope" => scopes = scopes.saturating_sub(1),
                b"$enddefinitions" => return Ok(io::Cursor::new(plain(&head))),
                _ => {}
            }
            if scopes > MOST_SCOPES {
                return wrong(format!("more than {MOST_SCOPES} scopes are nested"));
            }
        }
    }
    // The reader reports an error in a shorter head.
    if rest.limit() == 0 {
        wrong("its first MiB has no $enddefinitions".to_owned())
    } else {
        Ok(io::Cursor::new(plain(&head)))
    }
}

/// Stands for a blank within a channel's name.
const BLANK: char = '\u{a0}';

/// The head as the reader takes it: UTF-8 without a byte order mark, and each channel's name in one word.
fn plain(head: &[u8]) -> Vec<u8> {
    let text = String::from_utf8_lossy(head);
    let mut words =
        text.strip_prefix('\u{feff}').unwrap_or(&text).split_inclusive(|letter: char| letter.is_ascii_whitespace());
    let mut plain = String::new();
    while let Some(word) = words.next() {
        plain += word;
        if word.trim_end() != "$var" {
            continue;
        }
        // Kind, bits and code; then the name, perhaps its bits in brackets, and the end.
        words.by_ref().take(3).for_each(|word| plain += word);
        let rest: Vec<&str> = words
            .by_ref()
            .map(str::trim_ascii)
            .take_while(|word| *word != "$end")
            .filter(|word| !word.is_empty())
            .collect();
        let (name, bits) = match rest.split_last() {
            Some((bits, name)) if bits.starts_with('[') && !name.is_empty() => (name, *bits),
            _ => (&rest[..], ""),
        };
        plain += &format!("{} {bits} $end\n", name.join(&BLANK.to_string()));
    }
    plain.into_bytes()
}

/// The nearest cycle to a time of the file.
fn to_cycles(time: u64, (count, unit): (u32, TimescaleUnit)) -> u64 {
    let units = u128::from(time) * u128::from(count) * u128::from(CYCLES_PER_SECOND);
    let divisor = u128::from(unit.divisor());
    u64::try_from((units + divisor / 2) / divisor).unwrap_or(u64::MAX)
}

/// Every channel with its scopes, as `scope.name`. One bit of a bus is `scope.name[0]`.
fn list_channels(scope: &str, items: &[ScopeItem], known: &mut Vec<(String, Var)>) {
    for item in items {
        match item {
            ScopeItem::Var(channel) => {
                let mut channel = channel.clone();
                channel.reference = channel.reference.replace(BLANK, " ");
                if let Some(bit @ ReferenceIndex::BitSelect(_)) = channel.index {
                    channel.reference += &bit.to_string();
                }
                known.push((format!("{scope}{}", channel.reference), channel));
            }
            ScopeItem::Scope(Scope { identifier, items, .. }) => {
                list_channels(&format!("{scope}{identifier}."), items, known);
            }
            _ => {}
        }
    }
}

/// The wire of the channel `name`.
fn find_channel(path: &Path, name: &str, known: &[(String, Var)]) -> Result<IdCode, FileError> {
    let matching: Vec<_> =
        known.iter().filter(|(full_name, channel)| full_name == name || channel.reference == name).collect();
    let list = |names: Vec<&str>| names.iter().map(|name| format!("`{name}`")).collect::<Vec<_>>().join(", ");
    let problem = match matching[..] {
        [(_, channel)] if channel.size == 1 => return Ok(channel.code),
        [(_, channel)] => format!("has channel `{name}` {} bits wide: a single wire is needed", channel.size),
        [] => {
            let known = known.iter().map(|(_, channel)| channel.reference.as_str()).collect();
            format!("has no channel `{name}`; it has {}", list(known))
        }
        _ => {
            let full = matching.iter().map(|(full_name, _)| full_name.as_str()).collect();
            format!("has several channels `{name}`: write one of {}", list(full))
        }
    };
    Err(FileError::new(path, problem))
}

#[cfg(test)]
mod tests {
    use super::*;

    const CHANNELS: [(Pin, &str); 2] = [(Pin::D2, "A"), (Pin::D3, "B")];

    fn recording(timescale: &str, samples: &str) -> String {
        format!(
            "$timescale {timescale} $end\n$scope module analyser $end\n$var wire 1 ! A $end\n$var wire 1 \" B $end\n\
             $var wire 8 # bus $end\n$upscope $end\n$enddefinitions $end\n{samples}\n"
        )
    }

    fn levels(file: impl AsRef<[u8]>, channels: &[(Pin, &str)]) -> Result<Vec<(u64, Pin, bool)>, String> {
        parse(Path::new("pins.vcd"), file.as_ref(), channels)
            .map(|changes| changes.iter().map(|change| (change.cycle, change.pin, change.high)).collect())
            .map_err(|error| error.to_string())
    }

    #[test]
    fn times_in_every_unit_become_cycles() {
        let (a, b) = (Pin::D2, Pin::D3);
        for (timescale, time) in [("1 us", 1000), ("10 us", 100), ("1 ms", 1), ("100 ps", 10_000_000)] {
            let file = recording(timescale, &format!("#0 0! 1\" #{time} 1! 1\" b101 # #{} 0\"", 3 * time));
            let expected = [(0, a, false), (0, b, true), (16_000, a, true), (48_000, b, false)];
            assert_eq!(levels(&file, &CHANNELS).unwrap(), expected, "{timescale}");
        }
    }

    #[test]
    fn any_habits_of_other_programs_together_leave_the_levels_as_they_are() {
        let expected = levels(recording("1 us", "#0 0! 1\" #5 1!"), &CHANNELS).unwrap();
        for habits in 0..1_u32 << 8 {
            let has = |habit: u32| habits >> habit & 1 == 1;
            let samples = match (has(0), has(1)) {
                (false, false) => "#0\n0!\n1\"\n#5\n1!",
                (true, false) => "#0\nb0 !\nb1 \"\n#5\nb1 !",
                (false, true) => "#0\n$dumpvars\n0!\n1\"\n$end\n#5\n1!\n1!",
                (true, true) => "#0 $dumpvars b0 ! 1\" $end #5 b1 !",
            };
            let mut text = recording(if has(2) { "1us" } else { "1 us" }, samples);
            let mut names = ["A", "B"];
            if has(3) {
                names = ["Channel 0", "Channel 1 (index)"];
                text = text.replace("! A", &format!("! {}", names[0])).replace("\" B", &format!("\" {}", names[1]));
            }
            if has(4) {
                text = text.trim_end().to_owned();
            }
            if has(5) {
                text = text.replace('\n', "\r\n");
            }
            let mut file = text.into_bytes();
            if has(6) {
                file.splice(0..0, *b"$date 4. M\xE4rz 2026 $end\n$version\n\tAnalyser 2\n$end\n");
            }
            if has(7) {
                file.splice(0..0, *b"\xEF\xBB\xBF");
            }
            let channels = [(Pin::D2, names[0]), (Pin::D3, names[1])];
            let shown = String::from_utf8_lossy(&file);
            assert_eq!(levels(&file, &channels).as_ref(), Ok(&expected), "{habits:#b}: {shown}");
        }
    }

    #[test]
    fn a_time_between_two_cycles_goes_to_the_nearest() {
        let file = recording("1 ns", "#0 0! 0\" #31 1! #32 0! #94 1!");
        let cycles: Vec<u64> = levels(&file, &CHANNELS).unwrap().iter().map(|change| change.0).collect();
        assert_eq!(cycles, [0, 0, 0, 1, 2]);
    }

    #[test]
    fn a_wrong_choice_of_channels_is_an_error_with_the_available_ones() {
        let file = recording("1 us", "#0 0! 0\"");
        let error = |channels: &[(Pin, &str)]| levels(&file, channels).unwrap_err();
        let with_b = |b| [CHANNELS[0], (Pin::D3, b)];
        let unknown = error(&with_b("C"));
        assert_eq!(unknown, "pins.vcd has no channel `C`; it has `A`, `B`, `bus`");
        assert!(error(&with_b("bus")).contains("8 bits wide"));
        assert!(error(&with_b("A")).contains("given for two signals"));
        assert!(error(&[CHANNELS[0], CHANNELS[1], (Pin::D8, "B")]).contains("given for two signals"));
        assert!(levels(&file, &[(Pin::D2, "analyser.A"), CHANNELS[1]]).is_ok());
    }

    #[test]
    fn the_bits_of_a_bus_are_channels_of_their_own() {
        let expected = levels(recording("1 us", "#0 0! 1\" #5 1!"), &CHANNELS);
        let file = recording("1 us", "#0 0! 1\" #5 1!").replace("! A", "! D [0]").replace("\" B", "\" D [1]");
        assert_eq!(levels(&file, &[(Pin::D2, "D[0]"), (Pin::D3, "analyser.D[1]")]), expected);
        assert_eq!(levels(&file, &CHANNELS).unwrap_err(), "pins.vcd has no channel `A`; it has `D[0]`, `D[1]`, `bus`");
    }

    #[test]
    fn a_name_in_two_scopes_must_be_written_in_full() {
        let file = recording("1 us", "#0 0! 0\" 1$")
            .replace("$enddefinitions", "$scope module other $end $var wire 1 $ A $end $upscope $end $enddefinitions");
        assert_eq!(
            levels(&file, &CHANNELS).unwrap_err(),
            "pins.vcd has several channels `A`: write one of `analyser.A`, `other.A`"
        );
        let chosen = levels(&file, &[(Pin::D2, "other.A"), CHANNELS[1]]).unwrap();
        assert!(chosen.contains(&(0, Pin::D2, true)));
    }

    #[test]
    fn a_recording_that_leaves_levels_open_is_refused() {
        let error = |file: &str| levels(file, &CHANNELS).unwrap_err();
        let open = error(&recording("1 us", "#0 0! 0\"\n#5 x!"));
        assert!(open.contains("pins.vcd has `x` on channel `A` at line 9"), "{open}");
        assert!(error(&recording("1 us", "#0 0!")).contains("no samples of channel `B`"));
        assert!(error(&recording("1 us", "#5 0! 0\" #4 1!")).contains("back in time"));
        assert!(error(&recording("1 us", "").replace("$timescale 1 us $end", "")).contains("no $timescale"));
        assert!(error("").contains("pins.vcd cannot be read"));
        assert!(error("position,width\n").contains("pins.vcd cannot be read"));
    }

    #[test]
    fn a_recording_that_would_never_end_or_is_nested_without_end_is_refused() {
        let endless = levels(recording("1 s", "#0 0! 0\"\n#18446744073709551615 1!"), &CHANNELS).unwrap_err();
        assert!(endless.contains("pins.vcd is longer than 24 h at line 9"), "{endless}");
        let nested = "$timescale 1 us $end\n".to_owned() + &"$scope module a $end\n".repeat(100_000);
        let error = parse(Path::new("pins.vcd"), nested.as_bytes(), &CHANNELS).unwrap_err();
        assert!(std::error::Error::source(&error).unwrap().to_string().contains("more than 50 scopes"), "{error}");
        let error = parse(Path::new("pins.vcd"), vec![b' '; 2 << 20].as_slice(), &CHANNELS).unwrap_err();
        assert!(std::error::Error::source(&error).unwrap().to_string().contains("has no $enddefinitions"), "{error}");
    }

    #[test]
    fn a_waveform_reads_back_to_the_very_cycles() {
        let wires = [
            Wire { pin: Pin::D2, name: "clock", high_at_rest: false },
            Wire { pin: Pin::D3, name: "data", high_at_rest: false },
            Wire { pin: Pin::D8, name: "button", high_at_rest: true },
        ];
        let written = (1..500_u64).map(|count| PinChange {
            cycle: count * count * 7919,
            pin: wires[count as usize % 3].pin,
            // The button begins high, the others low.
            high: (count.div_ceil(3) % 2 == 1) != (count % 3 == 2),
        });
        let written: Vec<PinChange> = written.collect();
        let mut file = Vec::new();
        write(&mut file, &wires, written.iter().rev().copied()).unwrap();
        let read = parse(Path::new("pins.vcd"), &*file, &wires.map(|wire| (wire.pin, wire.name)));

        let at_rest = wires.map(|wire| PinChange { cycle: 0, pin: wire.pin, high: wire.high_at_rest });
        assert_eq!(read.unwrap(), [&at_rest[..], &written].concat());
    }
}
