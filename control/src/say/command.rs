//! The console's grammar: bytes to lines, lines to commands.
//!
//! A line is at most 80 characters and ends with CR, LF or both. Backspace deletes a character, because serial terminals send it.
//! Blanks separate words. A line with an error becomes one [`ParseError`] and has no other effect. [`say`](crate::say) runs and
//! answers commands.

use crate::{ground::class::label, operate::plot::Plot, settings::Setting};
use heapless::Vec;

pub use super::words::{Argument, Word};

/// Most characters of a line.
pub const LINE_LENGTH: usize = 80;

/// Marks lost bytes in the stream: SUB, ASCII's own character for it.
pub const GAP_MARK: u8 = 0x1A;

/// A command of the operator.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
#[expect(missing_docs, reason = "the table of commands has the words of the others")]
pub enum Command {
    Help,
    /// `help name`.
    Explain(Setting),
    Status,
    GetAll,
    /// `get name`.
    Get(Setting),
    /// `set name value`.
    Set(Setting, u16),
    Save,
    Revert,
    Defaults,
    CalibrateStart,
    /// `calibrate MM`, or `calibrate MM force`.
    Calibrate {
        /// The distance rolled since the start.
        distance_mm: u16,
        /// Accepts any difference from the wheel's diameter.
        force: bool,
    },
    CalibrateServo,
    ServoIn,
    ServoOut,
    /// `servo US`, in microseconds.
    Servo(u16),
    /// `test row`, or `test row MM_S`.
    TestRow {
        /// The simulated speed, in mm/s.
        speed_mm_s: u16,
    },
    TestWatchdog,
    /// `start`, or `start now`.
    Start {
        /// At once, also over unseen ground.
        now: bool,
    },
    Hold,
    Clear,
    /// `events on|off`.
    Events(bool),
    /// `plot on|off|teleplot`.
    Plot(Plot),
    /// `label plant|weed`, or `label plant|weed force`.
    Label {
        /// The [`label`].
        label: u8,
        /// Accepts a label that contradicts the built-in examples.
        force: bool,
    },
    /// `teach N`.
    Feature(u8),
    /// `teach plant|weed`: the [`label`].
    Teach(u8),
    Examples,
    /// `forget N`.
    Forget(u8),
    ForgetAll,
    Dump,
    Version,
}

/// Speed of a dry run without an argument: 1.8 km/h.
const TEST_SPEED_MM_S: u16 = 500;

/// Why a line is not a command.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub enum ParseError {
    /// More than [`LINE_LENGTH`] characters.
    TooLong,
    /// Characters other than printable ASCII.
    NotText,
    /// Bytes were lost before the firmware read them.
    CharactersLost,
    /// No command begins like this.
    UnknownCommand,
    /// The command takes other arguments.
    Usage(Word),
    /// No setting has this name.
    UnknownSetting,
    /// The setting takes a whole number within its range.
    Value(Setting),
}

/// Parses a line.
///
/// # Errors
/// A [`ParseError`], whose text says what is allowed.
#[inline(never)]
pub fn parse(line: &[u8]) -> Result<Command, ParseError> {
    let (word, rest) = split_word(line);
    let word = Word::find(word).ok_or(ParseError::UnknownCommand)?;
    let usage = Err(ParseError::Usage(word));
    let (first, rest) = split_word(rest);
    let (second, rest) = split_word(rest);
    if !split_word(rest).0.is_empty() {
        return usage;
    }
    if let (Word::Help | Word::Get | Word::Set, false) = (word, first.is_empty()) {
        // `set` takes two words, the others one.
        if second.is_empty() == matches!(word, Word::Set) {
            return usage;
        }
        let setting = Setting::find(first).ok_or(ParseError::UnknownSetting)?;
        return match word {
            Word::Help => Ok(Command::Explain(setting)),
            Word::Get => Ok(Command::Get(setting)),
            _ => value(setting, second).map(|value| Command::Set(setting, value)).ok_or(ParseError::Value(setting)),
        };
    }
    let argument = Argument::find(first);
    // `force` overrides a plausibility check.
    let force = Argument::find(second) == Some(Argument::Force);
    let command = if first.is_empty() || argument.is_some() {
        let Some(command) = of_words(word, argument) else { return usage };
        command
    } else {
        match (word, number(first)) {
            (Word::Forget, Some(number @ 0..=255)) => Command::Forget(number as u8),
            (Word::Teach, Some(feature @ 0..=255)) => Command::Feature(feature as u8),
            (Word::Servo, Some(pulse_us)) => Command::Servo(pulse_us),
            (Word::Calibrate, Some(distance_mm)) => Command::Calibrate { distance_mm, force },
            _ => return usage,
        }
    };
    match command {
        Command::Label { label, .. } if force => Ok(Command::Label { label, force }),
        Command::Calibrate { .. } if force => Ok(command),
        Command::TestRow { .. } if !second.is_empty() => match number(second) {
            Some(speed_mm_s) => Ok(Command::TestRow { speed_mm_s }),
            None => usage,
        },
        _ if second.is_empty() => Ok(command),
        _ => usage,
    }
}

/// The command for a word and its argument, if there is one.
fn of_words(word: Word, argument: Option<Argument>) -> Option<Command> {
    let words = [word as u8, argument_number(argument)];
    let place = (0..ROWS).map(usize::from).find(|&place| WORDS.load_at(place) == words)?;
    Some(COMMANDS.load_at(place))
}

/// An argument's number in the table; without an argument, the number after the last.
const fn argument_number(argument: Option<Argument>) -> u8 {
    match argument {
        Some(argument) => argument as u8,
        None => Argument::COUNT,
    }
}

/// The tables of commands without a number or a setting: the numbers of a word and its argument, and the command. There are two
/// tables, because the search reads the first row by row.
macro_rules! commands {
    () => { None };
    ($argument:ident) => { Some(Argument::$argument) };
    ($($word:ident $($argument:ident)? => $command:expr;)*) => {
        const ROWS: u8 = [$(Word::$word),*].len() as u8;

        avr_progmem::progmem! {
            static progmem WORDS: [[u8; 2]; ROWS as usize] =
                [$([Word::$word as u8, argument_number(commands!($($argument)?))]),*];
            static progmem COMMANDS: [Command; ROWS as usize] = [$($command),*];
        }
    };
}

commands! {
    // The commands with the longest lines come first, because the search takes 30 cycles a row.
    Label Plant => Command::Label { label: label::PLANT, force: false };
    Label Weed => Command::Label { label: label::WEED, force: false };
    Calibrate Start => Command::CalibrateStart;
    Calibrate Servo => Command::CalibrateServo;
    Test Row => Command::TestRow { speed_mm_s: TEST_SPEED_MM_S };
    Test Watchdog => Command::TestWatchdog;
    Help => Command::Help;
    Status => Command::Status;
    Get => Command::GetAll;
    Save => Command::Save;
    Revert => Command::Revert;
    Defaults => Command::Defaults;
    Servo In => Command::ServoIn;
    Servo Out => Command::ServoOut;
    Start => Command::Start { now: false };
    Start Now => Command::Start { now: true };
    Hold => Command::Hold;
    Clear => Command::Clear;
    Events On => Command::Events(true);
    Events Off => Command::Events(false);
    Plot On => Command::Plot(Plot::Arduino);
    Plot Off => Command::Plot(Plot::Off);
    Plot Teleplot => Command::Plot(Plot::Teleplot);
    Examples => Command::Examples;
    Teach Plant => Command::Teach(label::PLANT);
    Teach Weed => Command::Teach(label::WEED);
    Forget All => Command::ForgetAll;
    Dump => Command::Dump;
    Version => Command::Version;
}

/// A setting's value from a word: a number, or `on` or `off` for a switch.
fn value(setting: Setting, word: &[u8]) -> Option<u16> {
    match Argument::find(word) {
        Some(Argument::On) if setting.is_switched() => Some(1),
        Some(Argument::Off) if setting.is_switched() => Some(0),
        _ => number(word),
    }
}

/// The next word of a line, empty at its end, and what follows it.
#[inline(never)]
fn split_word(line: &[u8]) -> (&[u8], &[u8]) {
    let start = line.iter().position(|byte| !is_blank(byte)).unwrap_or(line.len());
    let line = &line[start..];
    line.split_at(line.iter().position(is_blank).unwrap_or(line.len()))
}

fn is_blank(byte: &u8) -> bool {
    matches!(byte, b' ' | b'\t')
}

/// A whole number of 16 bits, digits only.
fn number(digits: &[u8]) -> Option<u16> {
    let mut number = 0_u16;
    for &digit in digits {
        let digit = digit.wrapping_sub(b'0');
        if digit > 9 || number > u16::MAX / 10 {
            return None;
        }
        number = (number * 10).checked_add(digit.into())?;
    }
    Some(number)
}

/// Collects bytes into lines.
#[derive(Clone, Debug, Default)]
pub struct LineBuffer {
    characters: Vec<u8, LINE_LENGTH, u8>,
    error: Option<ParseError>,
}

impl LineBuffer {
    /// An empty line.
    pub const fn new() -> Self {
        Self { characters: Vec::new(), error: None }
    }

    /// Takes a byte. At a line's end it returns the command or the error; nothing for an empty line.
    pub fn take(&mut self, byte: u8) -> Option<Result<Command, ParseError>> {
        if self.collect(byte) { self.read() } else { None }
    }

    /// First half of [`take`](Self::take): stores a byte. Returns whether it ends the line; the caller then calls
    /// [`read`](Self::read).
    #[inline(never)]
    pub fn collect(&mut self, byte: u8) -> bool {
        match byte {
            b'\r' | b'\n' => return true,
            0x08 | 0x7F => {
                self.characters.pop();
            }
            b'\t' | b' '..=b'~' => {
                if self.characters.push(byte).is_err() {
                    self.fail(ParseError::TooLong);
                }
            }
            GAP_MARK => self.fail(ParseError::CharactersLost),
            _ => self.fail(ParseError::NotText),
        }
        false
    }

    /// Second half of [`take`](Self::take): parses the line and starts the next. This takes far longer than storing a byte.
    #[inline(never)]
    pub fn read(&mut self) -> Option<Result<Command, ParseError>> {
        let line = match self.error.take() {
            Some(error) => Some(Err(error)),
            None if split_word(&self.characters).0.is_empty() => None,
            None => Some(parse(&self.characters)),
        };
        self.characters.clear();
        line
    }

    fn fail(&mut self, error: ParseError) {
        self.error.get_or_insert(error);
    }
}

#[cfg(test)]
mod tests {
    use super::*;
    use std::vec::Vec;

    fn answers(bytes: &[u8]) -> Vec<Result<Command, ParseError>> {
        let mut line = LineBuffer::new();
        bytes.iter().filter_map(|&byte| line.take(byte)).collect()
    }

    #[test]
    fn every_command_is_parsed_with_its_arguments() {
        for (line, command) in [
            (&b"help"[..], Command::Help),
            (b"help k", Command::Explain(Setting::K)),
            (b"status", Command::Status),
            (b"get", Command::GetAll),
            (b"get wheel_mm", Command::Get(Setting::WheelMm)),
            (b"set wheel_mm 405", Command::Set(Setting::WheelMm, 405)),
            (b"  set \t wheel_mm   405 ", Command::Set(Setting::WheelMm, 405)),
            (b"set end_switch on", Command::Set(Setting::EndSwitch, 1)),
            (b"set end_switch off", Command::Set(Setting::EndSwitch, 0)),
            (b"set end_switch 1", Command::Set(Setting::EndSwitch, 1)),
            (b"save", Command::Save),
            (b"revert", Command::Revert),
            (b"defaults", Command::Defaults),
            (b"calibrate start", Command::CalibrateStart),
            (b"calibrate 10000", Command::Calibrate { distance_mm: 10_000, force: false }),
            (b"calibrate 10000 force", Command::Calibrate { distance_mm: 10_000, force: true }),
            (b"calibrate servo", Command::CalibrateServo),
            (b"servo in", Command::ServoIn),
            (b"servo out", Command::ServoOut),
            (b"servo 1750", Command::Servo(1750)),
            (b"test row", Command::TestRow { speed_mm_s: 500 }),
            (b"test row 700", Command::TestRow { speed_mm_s: 700 }),
            (b"test watchdog", Command::TestWatchdog),
            (b"plot on", Command::Plot(Plot::Arduino)),
            (b"plot off", Command::Plot(Plot::Off)),
            (b"plot teleplot", Command::Plot(Plot::Teleplot)),
            (b"start", Command::Start { now: false }),
            (b"start now", Command::Start { now: true }),
            (b"hold", Command::Hold),
            (b"clear", Command::Clear),
            (b"events on", Command::Events(true)),
            (b"events off", Command::Events(false)),
            (b"label plant", Command::Label { label: label::PLANT, force: false }),
            (b"label weed", Command::Label { label: label::WEED, force: false }),
            (b"label weed force", Command::Label { label: label::WEED, force: true }),
            (b"teach 255", Command::Feature(255)),
            (b"teach plant", Command::Teach(label::PLANT)),
            (b"teach weed", Command::Teach(label::WEED)),
            (b"examples", Command::Examples),
            (b"forget 31", Command::Forget(31)),
            (b"forget all", Command::ForgetAll),
            (b"dump", Command::Dump),
            (b"version", Command::Version),
        ] {
            assert_eq!(parse(line), Ok(command), "{}", line.escape_ascii());
        }
    }

    #[test]
    fn an_unknown_name_or_value_is_an_error() {
        for (line, error) in [
            (&b"hepl"[..], ParseError::UnknownCommand),
            (b"HELP", ParseError::UnknownCommand),
            (b"help me", ParseError::UnknownSetting),
            (b"set wheel 400", ParseError::UnknownSetting),
            (b"set wheel_mm 4oo", ParseError::Value(Setting::WheelMm)),
            (b"set wheel_mm -400", ParseError::Value(Setting::WheelMm)),
            (b"set wheel_mm on", ParseError::Value(Setting::WheelMm)),
            (b"set wheel_mm 65936", ParseError::Value(Setting::WheelMm)),
            (b"set end_switch yes", ParseError::Value(Setting::EndSwitch)),
        ] {
            assert_eq!(parse(line), Err(error), "{}", line.escape_ascii());
        }
    }

    #[test]
    fn arguments_that_a_command_does_not_take_name_the_allowed_ones() {
        for (word, command, arguments) in [
            (Word::Help, "help", &["me now"][..]),
            (Word::Status, "status", &["please"]),
            (Word::Set, "set", &["wheel_mm", "wheel_mm 400 mm"]),
            (Word::Start, "start", &["later"]),
            (Word::Events, "events", &["", "maybe"]),
            (
                Word::Calibrate,
                "calibrate",
                &["", "me", "start force", "servo force", "start now", "10000 faster", "70000"],
            ),
            (Word::Servo, "servo", &["", "up", "in now"]),
            (Word::Test, "test", &["", "plants", "watchdog now", "row fast", "row force"]),
            (Word::Plot, "plot", &["", "start"]),
            (Word::Label, "label", &["tree", "weed now", "weed force now", "force"]),
            (Word::Teach, "teach", &["", "256", "1 2 3 4 5", "tree", "plant force"]),
            (Word::Forget, "forget", &["", "256"]),
        ] {
            for argument in arguments {
                let line = [command, argument].join(" ");
                assert_eq!(parse(line.as_bytes()), Err(ParseError::Usage(word)), "{line}");
            }
        }
    }

    #[test]
    fn a_line_is_one_command_or_one_error_and_the_next_line_is_read() {
        let hold_and = |spaces: usize| [&b"hold"[..], &[b' '; 80][..spaces], b"\n"].concat();
        let twice = &[Ok(Command::Hold), Ok(Command::Clear)][..];
        for (text, expected) in [
            // Carriage return, line feed or both end a line.
            (&b"hold\rclear\r"[..], twice),
            (b"hold\nclear\n", twice),
            (b"hold\r\nclear\r\n", twice),
            (b"\n\nhold\r\r\n \nclear\n", twice),
            // Backspace deletes the last character.
            (b"hole\x08d\n\x7F\x7Fclear\n", twice),
            (&[&[b'x'; 300][..], b"\nclear\n"].concat(), &[Err(ParseError::TooLong), Ok(Command::Clear)]),
            (b"\xFF\0\x1Bhold\nclear\n", &[Err(ParseError::NotText), Ok(Command::Clear)]),
            (b"set k 1\x1A\nclear\n", &[Err(ParseError::CharactersLost), Ok(Command::Clear)]),
            // Eighty characters are not too long.
            (&hold_and(76), &[Ok(Command::Hold)]),
            (&hold_and(77), &[Err(ParseError::TooLong)]),
        ] {
            assert_eq!(answers(text), expected, "{}", text.escape_ascii());
        }
    }
}
