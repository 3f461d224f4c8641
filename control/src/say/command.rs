//! The console's grammar: bytes to lines, lines to commands.
//!
//! A line is at most 80 characters and ends with CR, LF or both. Backspace deletes a character, because serial terminals send it.
//! Blanks separate words. A line with an error becomes one [`ParseError`] and has no other effect. [`say`](crate::say) runs and
//! answers commands.

use crate::settings::Setting;
use heapless::Vec;

pub use super::words::{Argument, Word};

/// Most characters of a line.
pub const LINE_LENGTH: usize = 80;

/// Marks lost bytes in the stream: SUB, ASCII's own character for it.
pub const GAP_MARK: u8 = 0x1A;

/// A command of the operator: a row of the grammar, and what its line says besides.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub struct Command {
    /// The row.
    pub action: Action,
    /// The setting that it names.
    pub setting: Setting,
    /// Its number: a value, a distance, a pulse, a speed, a feature or a place.
    pub number: u16,
    /// Whether it overrides a plausibility check.
    pub force: bool,
}

/// Speed of a dry run without an argument: 1.8 km/h.
const TEST_SPEED_MM_S: u16 = 500;

/// What is wrong with a line, in the order of its texts.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
#[repr(u8)]
pub enum Wrong {
    /// More than [`LINE_LENGTH`] characters.
    TooLong = 1,
    /// Characters other than printable ASCII.
    NotText,
    /// Bytes were lost before the firmware read them.
    CharactersLost,
    /// No command begins like this.
    UnknownCommand,
    /// No setting has this name.
    UnknownSetting,
}

/// Why a line is not a command.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub enum ParseError {
    /// The line says nothing that is known.
    Line(Wrong),
    /// The command takes other arguments.
    Usage(Word),
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
    let word = Word::find(word).ok_or(ParseError::Line(Wrong::UnknownCommand))?;
    let usage = Err(ParseError::Usage(word));
    let (first, rest) = split_word(rest);
    let (second, rest) = split_word(rest);
    let mut command = Command { action: Action::Help, setting: Setting::K, number: TEST_SPEED_MM_S, force: false };
    let kind = if first.is_empty() {
        NOTHING
    } else if matches!(word, Word::Help | Word::Get | Word::Set) {
        SETTING
    } else if let Some(argument) = Argument::find(first) {
        argument as u8
    } else {
        let Some(number) = number(first) else { return usage };
        if number > 255 && matches!(word, Word::Teach | Word::Forget) {
            return usage;
        }
        command.number = number;
        NUMBER
    };
    let mut row = 0;
    let takes = loop {
        let Some(action) = Action::from_index(row) else { return usage };
        command.action = action;
        let takes = flash::byte(&GRAMMAR, 2 * usize::from(row) + 1);
        if flash::byte(&GRAMMAR, 2 * usize::from(row)) == word as u8 && takes & KIND == kind {
            break takes & !KIND;
        }
        row += 1;
    };
    let is_complete = if second.is_empty() { takes & VALUE == 0 } else { takes != 0 };
    if !is_complete || !split_word(rest).0.is_empty() {
        return usage;
    }
    if kind == SETTING {
        command.setting = Setting::find(first).ok_or(ParseError::Line(Wrong::UnknownSetting))?;
    }
    if second.is_empty() {
        return Ok(command);
    }
    let argument = Argument::find(second);
    if takes & FORCE != 0 {
        command.force = argument == Some(Argument::Force);
        return if command.force { Ok(command) } else { usage };
    }
    command.number = match argument {
        Some(Argument::On) if takes & VALUE != 0 && command.setting.is_switched() => 1,
        Some(Argument::Off) if takes & VALUE != 0 && command.setting.is_switched() => 0,
        _ => match number(second) {
            Some(number) => number,
            None => return if takes & VALUE != 0 { Err(ParseError::Value(command.setting)) } else { usage },
        },
    };
    Ok(command)
}

/// What follows the word: an argument, by its number, or one of these.
const NOTHING: u8 = Argument::COUNT;
const NUMBER: u8 = NOTHING + 1;
const SETTING: u8 = NOTHING + 2;
const KIND: u8 = 0x1F;
const _: () = assert!(SETTING <= KIND);

/// What follows that: `force` or a speed, which may be left out, or a value. Otherwise nothing.
const FORCE: u8 = 1 << 5;
const SPEED: u8 = 1 << 6;
const VALUE: u8 = 1 << 7;

/// Makes the grammar, one row a command: its action, its word, what follows the word, and what follows that.
macro_rules! commands {
    (@) => { NOTHING };
    (@ number) => { NUMBER };
    (@ setting) => { SETTING };
    (@ $argument:ident) => { Argument::$argument as u8 };
    ($($Action:ident: $word:ident $($argument:ident)? $(+ $more:ident)?;)*) => {
        /// What a command does, a row of the grammar each.
        #[derive(Clone, Copy, Debug, PartialEq, Eq)]
        #[repr(u8)]
        #[expect(missing_docs, reason = "the rows say what each is")]
        pub enum Action { $($Action),* }

        impl Action {
            const fn from_index(index: u8) -> Option<Self> {
                match index {
                    $(index if index == Self::$Action as u8 => Some(Self::$Action),)*
                    _ => None,
                }
            }
        }

        const ROWS: &[[u8; 2]] = &[$([Word::$word as u8, commands!(@ $($argument)?) $(| $more)?]),*];
    };
}

commands! {
    LabelPlant: Label Plant + FORCE;
    LabelWeed: Label Weed + FORCE;
    CalibrateStart: Calibrate Start;
    CalibrateServo: Calibrate Servo;
    Calibrate: Calibrate number + FORCE;
    TestRow: Test Row + SPEED;
    TestWatchdog: Test Watchdog;
    Help: Help;
    Explain: Help setting;
    Status: Status;
    GetAll: Get;
    Get: Get setting;
    Set: Set setting + VALUE;
    Save: Save;
    Revert: Revert;
    Defaults: Defaults;
    ServoIn: Servo In;
    ServoOut: Servo Out;
    Servo: Servo number;
    Start: Start;
    StartNow: Start Now;
    Hold: Hold;
    Clear: Clear;
    EventsOn: Events On;
    EventsOff: Events Off;
    PlotOn: Plot On;
    PlotOff: Plot Off;
    PlotTeleplot: Plot Teleplot;
    Examples: Examples;
    Feature: Teach number;
    TeachPlant: Teach Plant;
    TeachWeed: Teach Weed;
    Forget: Forget number;
    ForgetAll: Forget All;
    Dump: Dump;
    Version: Version;
}

avr_progmem::progmem! {
    static progmem GRAMMAR: [u8; 2 * ROWS.len()] = {
        let (mut bytes, mut place) = ([0; 2 * ROWS.len()], 0);
        while place < bytes.len() {
            bytes[place] = ROWS[place / 2][place % 2];
            place += 1;
        }
        bytes
    };
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
    error: Option<Wrong>,
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
                    self.fail(Wrong::TooLong);
                }
            }
            GAP_MARK => self.fail(Wrong::CharactersLost),
            _ => self.fail(Wrong::NotText),
        }
        false
    }

    /// Second half of [`take`](Self::take): parses the line and starts the next. This takes far longer than storing a byte.
    #[inline(never)]
    pub fn read(&mut self) -> Option<Result<Command, ParseError>> {
        let line = match self.error.take() {
            Some(wrong) => Some(Err(ParseError::Line(wrong))),
            None if split_word(&self.characters).0.is_empty() => None,
            None => Some(parse(&self.characters)),
        };
        self.characters.clear();
        line
    }

    fn fail(&mut self, error: Wrong) {
        self.error.get_or_insert(error);
    }
}

#[cfg(test)]
mod tests {
    use super::*;
    use std::vec::Vec;

    fn answers(bytes: &[u8]) -> Vec<Result<Action, ParseError>> {
        let mut line = LineBuffer::new();
        let parsed = bytes.iter().filter_map(|&byte| line.take(byte));
        parsed.map(|parsed| parsed.map(|command| command.action)).collect()
    }

    #[test]
    fn every_command_is_parsed_with_its_arguments() {
        use Action::*;
        for (line, action) in [
            (&b"help"[..], Help),
            (b"status", Status),
            (b"get", GetAll),
            (b"save", Save),
            (b"revert", Revert),
            (b"defaults", Defaults),
            (b"calibrate start", CalibrateStart),
            (b"calibrate servo", CalibrateServo),
            (b"servo in", ServoIn),
            (b"servo out", ServoOut),
            (b"test watchdog", TestWatchdog),
            (b"plot on", PlotOn),
            (b"plot off", PlotOff),
            (b"plot teleplot", PlotTeleplot),
            (b"start", Start),
            (b"start now", StartNow),
            (b"hold", Hold),
            (b"clear", Clear),
            (b"events on", EventsOn),
            (b"events off", EventsOff),
            (b"label plant", LabelPlant),
            (b"label weed", LabelWeed),
            (b"teach plant", TeachPlant),
            (b"teach weed", TeachWeed),
            (b"examples", Examples),
            (b"forget all", ForgetAll),
            (b"dump", Dump),
            (b"version", Version),
        ] {
            let parsed = parse(line).map(|command| (command.action, command.force));
            assert_eq!(parsed, Ok((action, false)), "{}", line.escape_ascii());
        }
        for (line, action, number) in [
            (&b"calibrate 10000"[..], Calibrate, 10_000),
            (b"servo 1750", Servo, 1750),
            (b"test row", TestRow, 500),
            (b"test row 700", TestRow, 700),
            (b"teach 255", Feature, 255),
            (b"forget 31", Forget, 31),
        ] {
            let parsed = parse(line).map(|command| (command.action, command.number, command.force));
            assert_eq!(parsed, Ok((action, number, false)), "{}", line.escape_ascii());
        }
        for (line, action) in [
            (&b"calibrate 10000 force"[..], Calibrate),
            (b"label plant force", LabelPlant),
            (b"label weed force", LabelWeed),
        ] {
            let parsed = parse(line).map(|command| (command.action, command.force));
            assert_eq!(parsed, Ok((action, true)), "{}", line.escape_ascii());
        }
        for (line, action, setting) in [(&b"help k"[..], Explain, Setting::K), (b"get wheel_mm", Get, Setting::WheelMm)]
        {
            let parsed = parse(line).map(|command| (command.action, command.setting));
            assert_eq!(parsed, Ok((action, setting)), "{}", line.escape_ascii());
        }
        for (line, setting, value) in [
            (&b"set wheel_mm 405"[..], Setting::WheelMm, 405),
            (b"  set \t wheel_mm   405 ", Setting::WheelMm, 405),
            (b"set end_switch on", Setting::EndSwitch, 1),
            (b"set end_switch off", Setting::EndSwitch, 0),
            (b"set end_switch 1", Setting::EndSwitch, 1),
        ] {
            let parsed = parse(line).map(|command| (command.action, command.setting, command.number));
            assert_eq!(parsed, Ok((Set, setting, value)), "{}", line.escape_ascii());
        }
    }

    #[test]
    fn an_unknown_name_or_value_is_an_error() {
        for (line, error) in [
            (&b"hepl"[..], ParseError::Line(Wrong::UnknownCommand)),
            (b"HELP", ParseError::Line(Wrong::UnknownCommand)),
            (b"help me", ParseError::Line(Wrong::UnknownSetting)),
            (b"set wheel 400", ParseError::Line(Wrong::UnknownSetting)),
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
            (Word::Help, "help", &["k now", "me now"][..]),
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
        let twice = &[Ok(Action::Hold), Ok(Action::Clear)][..];
        for (text, expected) in [
            // Carriage return, line feed or both end a line.
            (&b"hold\rclear\r"[..], twice),
            (b"hold\nclear\n", twice),
            (b"hold\r\nclear\r\n", twice),
            (b"\n\nhold\r\r\n \nclear\n", twice),
            // Backspace deletes the last character.
            (b"hole\x08d\n\x7F\x7Fclear\n", twice),
            (&[&[b'x'; 300][..], b"\nclear\n"].concat(), &[Err(ParseError::Line(Wrong::TooLong)), Ok(Action::Clear)]),
            (b"\xFF\0\x1Bhold\nclear\n", &[Err(ParseError::Line(Wrong::NotText)), Ok(Action::Clear)]),
            (b"set k 1\x1A\nclear\n", &[Err(ParseError::Line(Wrong::CharactersLost)), Ok(Action::Clear)]),
            // Eighty characters are not too long.
            (&hold_and(76), &[Ok(Action::Hold)]),
            (&hold_and(77), &[Err(ParseError::Line(Wrong::TooLong))]),
        ] {
            assert_eq!(answers(text), expected, "{}", text.escape_ascii());
        }
    }
}
