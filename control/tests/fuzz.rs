//! Fuzz targets: any bytes on the serial line, and any contents of the EEPROM.
//!
//! `cargo test` runs each with some thousand random inputs. `cargo bolero test -p control --release TARGET` lets libFuzzer search
//! more until it is stopped, and keeps its findings for `cargo test`.

use bolero::{TypeGenerator, check};
use control::{
    alarm::Alarm,
    ground::{class::Classifier, examples::EXAMPLES, field_examples, nearest::Nearest},
    measure::reset::Cause,
    memory::{ERASED, SIZE, Volatile},
    operate::{
        saved::{COPY, SavedSettings},
        state::State,
    },
    say::{
        self, Answer, LINE,
        command::{LineBuffer, Word},
        line::Line,
    },
    settings::{Setting, Settings},
};
use rig::{ByExamples, Rig};

/// The machine as the firmware has it, with these contents of its EEPROM's halves.
fn machine(for_settings: Volatile, for_examples: Volatile) -> Rig<ByExamples> {
    Rig::wake(Nearest::new(&EXAMPLES[..], for_examples), for_settings, Cause::PowerOn)
}

/// Input on the serial line. Random bytes alone seldom make a command.
#[derive(Clone, Debug, TypeGenerator)]
enum Typed {
    Bytes(Vec<u8>),
    Command(u8),
    Setting(u8),
    Argument(u8),
    Number(u16),
    End,
}

const ARGUMENTS: [&str; 12] =
    ["now", "on", "off", "all", "plant", "weed", "start", "in", "out", "servo", "force", "json"];

impl Typed {
    fn write_to(&self, bytes: &mut Vec<u8>) {
        match self {
            Self::Bytes(some) => bytes.extend(some),
            Self::Command(place) => {
                bytes.extend(Word::from_index(place % Word::COUNT).iter().flat_map(|w| w.text().bytes()))
            }
            Self::Setting(place) => {
                bytes.extend(Setting::from_index(place % Setting::COUNT).iter().flat_map(|s| s.text().bytes()));
            }
            Self::Argument(place) => bytes.extend(ARGUMENTS[usize::from(*place) % ARGUMENTS.len()].bytes()),
            Self::Number(number) => bytes.extend(number.to_string().bytes()),
            Self::End => bytes.push(b'\n'),
        }
        bytes.push(b' ');
    }
}

#[test]
fn every_line_is_answered_by_lines_that_fit_and_one_verdict() {
    check!().with_type::<Vec<Typed>>().with_iterations(1500).for_each(|typed| {
        let mut bytes = Vec::new();
        typed.iter().for_each(|typed| typed.write_to(&mut bytes));
        bytes.push(b'\n');
        let mut machine = machine(Volatile::new(), Volatile::new());
        let mut line = LineBuffer::new();
        for (turn, byte) in (0..).zip(bytes) {
            machine.at(turn / 4).turn_after(500);
            let Some(command) = line.take(byte) else { continue };
            let mut answer = say::answer_to(command.as_ref().map_err(|&error| error), &mut machine);
            while !machine.carry_on() {}
            let mut verdicts = 0;
            while !answer.is_done() {
                assert_eq!(verdicts, 0, "{command:?} has lines after its verdict");
                let mut out = Line::new();
                answer.write_line(&machine, &mut out);
                let out: Vec<u8> = out.collect();
                assert!(out.len() <= LINE, "{:?} has {} bytes", String::from_utf8_lossy(&out), out.len());
                let text = out.strip_suffix(b"\r\n").expect("a line ends");
                assert!(text.iter().all(|byte| (b' '..=b'~').contains(byte)), "{}", text.escape_ascii());
                verdicts += usize::from(text == b"ok" || text.starts_with(b"error: "));
            }
            assert_eq!((verdicts, answer), (1, Answer::Done), "{command:?}");
            while let Some(event) = machine.next_event() {
                let mut out = Line::new();
                say::write_event(&event, &mut out);
                let out: Vec<u8> = out.collect();
                assert!(out.len() <= LINE && out.ends_with(b"\r\n"), "{}", out.escape_ascii());
            }
        }
    });
}

/// An EEPROM's contents: saves in order, and later corrupted bytes. Random bytes alone would never have a right CRC.
#[derive(Clone, Debug, TypeGenerator)]
struct Eeprom {
    filled_with: Option<Vec<u8>>,
    saved: Vec<Vec<(u8, u16)>>,
    spoiled: Vec<(u16, u8)>,
    /// Bytes of the last save before the power fails.
    power: u8,
}

/// The defaults with changes: within each range, but possibly contradicting each other.
fn settings(changes: &[(u8, u16)]) -> Settings {
    let mut settings = Settings::new();
    for &(place, value) in changes {
        let setting = Setting::from_index(place % Setting::COUNT).expect("a place in the table");
        let width = u32::from(setting.greatest() - setting.least()) + 1;
        let value = setting.least() + (u32::from(value) % width) as u16;
        settings.set(setting, value).expect("within the range");
    }
    settings
}

fn save(memory: Volatile, settings: &Settings) -> Volatile {
    let mut saved = SavedSettings::new(memory);
    saved.load();
    saved.save();
    while !saved.carry_on(settings) {}
    saved.into_memory()
}

fn load(memory: &Volatile) -> Option<Settings> {
    SavedSettings::new(memory.clone()).load()
}

#[test]
fn with_any_eeprom_the_machine_starts_with_valid_settings_or_an_alarm() {
    check!().with_type::<Eeprom>().with_iterations(5000).for_each(|eeprom| {
        let fill = eeprom.filled_with.as_deref().filter(|fill| !fill.is_empty()).unwrap_or(&[ERASED]);
        let mut content = [0; 2 * SIZE];
        content.iter_mut().zip(fill.iter().cycle()).for_each(|(byte, &fill)| *byte = fill);
        let (for_settings, for_examples) = content.split_at(SIZE);
        let mut memory = Volatile::holding(for_settings.try_into().expect("half the EEPROM"));
        for changes in &eeprom.saved {
            memory = save(memory, &settings(changes));
        }
        let mut examples = Volatile::holding(for_examples.try_into().expect("the other half"));
        for &(address, byte) in &eeprom.spoiled {
            let address = usize::from(address) % (2 * SIZE);
            let half = if address < SIZE { &mut memory } else { &mut examples };
            half.bytes[address % SIZE] = byte;
        }

        let machine = machine(memory.clone(), examples);
        let found = load(&memory);
        let expected = match &found {
            None => State::Alarm(Alarm::SettingsLost),
            Some(settings) if settings.contradiction().is_some() => State::Alarm(Alarm::SettingsContradict),
            Some(_) => State::Hold,
        };
        assert_eq!(machine.state(), expected);
        assert!(machine.tool_out());
        assert_eq!(machine.settings(), &found.clone().unwrap_or_default());
        for setting in Setting::all() {
            assert!(setting.allows(machine.settings().get(setting)), "{}", setting as u8);
        }
        if eeprom.spoiled.is_empty()
            && let Some(last) = eeprom.saved.last()
        {
            assert_eq!(found, Some(settings(last)), "the last save is missing");
        }
        assert!(machine.classifier().spoiled() <= field_examples::CAPACITY);
        let mut place = 0;
        while let Some((_, next)) = machine.classifier().listed(place) {
            assert!(next > place);
            place = next;
        }

        // Another save, and a power failure during it.
        // A save writes the first byte twice.
        let power = usize::from(eeprom.power) % (COPY + 2);
        let new = settings(&[(0, 1), (10, eeprom.power.into())]);
        let mut failing = memory;
        failing.lose_power_after(power);
        let after = load(&save(failing, &new).with_power());
        // Writing a corrupted byte may correct it. Then an earlier save is valid again.
        let once_saved = eeprom.saved.iter().any(|changes| after == Some(settings(changes)));
        let filled = eeprom.filled_with.is_some();
        assert!(after == found || after.as_ref() == Some(&new) || once_saved || filled, "{power} bytes: {after:?}");
        assert!(power <= COPY || after == Some(new), "the save was complete");
    });
}
