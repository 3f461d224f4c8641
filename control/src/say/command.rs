//! The console's grammar: bytes to lines, lines to commands.
//!
//! A line is at most 80 characters and ends with CR, LF or both. Backspace deletes a character, because serial terminals send it.
//! Blanks separate words. A line with an error becomes one [`ParseError`] and has no other effect. [`say`](crate::say) runs and
//! answers commands.

use super::words::{FORCE, GRAMMAR, KIND, NOTHING, NUMBER, SETTING, VALUE};
use crate::settings::Setting;
use core::mem;
use heapless::Vec;

pub use super::words::{Action, Argument, ROWS, Word, Wrong};

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

impl Command {
    /// Before a line is parsed. It is all zeros, so the chip needs no copy in flash.
    pub(super) const NONE: Self = match (Action::from_index(0), Setting::from_index(0)) {
        (Some(action), Some(setting)) => Self { action, setting, number: 0, force: false },
        _ => panic!("there are commands and settings"),
    };
}

/// Parses a line.
///
/// # Errors
/// A [`ParseError`], whose text says what is allowed.
pub fn parse(line: &[u8]) -> Result<Command, ParseError> {
    let mut command = Command::NONE;
    parse_to(line, &mut command).map(|()| command)
}

/// Parses a line into a command that stays where it is. After an error the command has no meaning.
#[inline(never)]
fn parse_to(line: &[u8], command: &mut Command) -> Result<(), ParseError> {
    let mut rest = line;
    let Some(word) = Word::find(next_word(&mut rest)) else { return Err(ParseError::Line(Wrong::UnknownCommand)) };
    let usage = Err(ParseError::Usage(word));
    let (first, second) = (next_word(&mut rest), next_word(&mut rest));
    let (mut value, mut force) = (TEST_SPEED_MM_S, false);
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
        value = number;
        NUMBER
    };
    let mut row = 0;
    let (action, takes) = loop {
        let Some(action) = Action::from_index(row) else { return usage };
        let takes = flash::byte(&GRAMMAR, 2 * usize::from(row) + 1);
        if flash::byte(&GRAMMAR, 2 * usize::from(row)) == word as u8 && takes & KIND == kind {
            break (action, takes & !KIND);
        }
        row += 1;
    };
    let is_complete = if second.is_empty() { takes & VALUE == 0 } else { takes != 0 };
    if !is_complete || !next_word(&mut rest).is_empty() {
        return usage;
    }
    // Another row names no setting, and none that is a switch stands for it.
    let mut setting = Setting::TicksPerRev;
    if kind == SETTING {
        let Some(named) = Setting::find(first) else { return Err(ParseError::Line(Wrong::UnknownSetting)) };
        setting = named;
    }
    if !second.is_empty() {
        match Argument::find(second) {
            Some(Argument::Force) if takes & FORCE != 0 => force = true,
            Some(Argument::On) if setting.is_switched() => value = 1,
            Some(Argument::Off) if setting.is_switched() => value = 0,
            _ => match number(second) {
                Some(number) if takes & FORCE == 0 => value = number,
                _ if takes & VALUE != 0 => return Err(ParseError::Value(setting)),
                _ => return usage,
            },
        }
    }
    *command = Command { action, setting, number: value, force };
    Ok(())
}

/// Takes the next word of a line, empty at its end.
#[inline(never)]
fn next_word<'a>(line: &mut &'a [u8]) -> &'a [u8] {
    let start = line.iter().position(|byte| !is_blank(byte)).unwrap_or(line.len());
    let begun = &line[start..];
    let (word, rest) = begun.split_at(begun.iter().position(is_blank).unwrap_or(begun.len()));
    *line = rest;
    word
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
#[derive(Clone, Debug)]
pub struct LineBuffer {
    characters: Vec<u8, LINE_LENGTH, u8>,
    error: Wrong,
}

impl Default for LineBuffer {
    fn default() -> Self {
        Self::new()
    }
}

impl LineBuffer {
    /// An empty line.
    pub const fn new() -> Self {
        Self { characters: Vec::new(), error: Wrong::Nothing }
    }

    /// Takes a byte. At a line's end it returns the command or the error; nothing for an empty line.
    pub fn take(&mut self, byte: u8) -> Option<Result<Command, ParseError>> {
        if !self.collect(byte) {
            return None;
        }
        let mut command = Command::NONE;
        Some(self.read(&mut command)?.map(|()| command))
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
                if self.characters.push(byte.to_ascii_lowercase()).is_err() {
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
    pub fn read(&mut self, command: &mut Command) -> Option<Result<(), ParseError>> {
        let line = match mem::replace(&mut self.error, Wrong::Nothing) {
            Wrong::Nothing if next_word(&mut &self.characters[..]).is_empty() => None,
            Wrong::Nothing => Some(parse_to(&self.characters, command)),
            wrong => Some(Err(ParseError::Line(wrong))),
        };
        self.characters.clear();
        line
    }

    fn fail(&mut self, error: Wrong) {
        if self.error == Wrong::Nothing {
            self.error = error;
        }
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
        let plain = |action| Command { action, setting: Setting::TicksPerRev, number: 500, force: false };
        let with = |action, number| Command { number, ..plain(action) };
        let forced = |command| Command { force: true, ..command };
        let of = |action, setting| Command { setting, ..plain(action) };
        let set = |setting, number| Command { setting, ..with(Set, number) };
        for (line, command) in [
            (&b"help"[..], plain(Help)),
            (b"help k", of(Explain, Setting::K)),
            (b"status", plain(Status)),
            (b"get", plain(GetAll)),
            (b"get wheel_mm", of(Get, Setting::WheelMm)),
            (b"set wheel_mm 405", set(Setting::WheelMm, 405)),
            (b"  set \t wheel_mm   405 ", set(Setting::WheelMm, 405)),
            (b"set end_switch on", set(Setting::EndSwitch, 1)),
            (b"set end_switch off", set(Setting::EndSwitch, 0)),
            (b"set end_switch 1", set(Setting::EndSwitch, 1)),
            (b"save", plain(Save)),
            (b"revert", plain(Revert)),
            (b"defaults", plain(Defaults)),
            (b"calibrate start", plain(CalibrateStart)),
            (b"calibrate servo", plain(CalibrateServo)),
            (b"calibrate 10000", with(Calibrate, 10_000)),
            (b"calibrate 10000 force", forced(with(Calibrate, 10_000))),
            (b"servo in", plain(ServoIn)),
            (b"servo out", plain(ServoOut)),
            (b"servo 1750", with(Servo, 1750)),
            (b"test row", with(TestRow, 500)),
            (b"test row 700", with(TestRow, 700)),
            (b"test watchdog", plain(TestWatchdog)),
            (b"plot on", plain(PlotOn)),
            (b"plot off", plain(PlotOff)),
            (b"plot teleplot", plain(PlotTeleplot)),
            (b"start", plain(Start)),
            (b"start now", plain(StartNow)),
            (b"hold", plain(Hold)),
            (b"clear", plain(Clear)),
            (b"events on", plain(EventsOn)),
            (b"events off", plain(EventsOff)),
            (b"label plant", plain(LabelPlant)),
            (b"label plant force", forced(plain(LabelPlant))),
            (b"label weed", plain(LabelWeed)),
            (b"label weed force", forced(plain(LabelWeed))),
            (b"teach 255", with(Feature, 255)),
            (b"teach plant", plain(TeachPlant)),
            (b"teach weed", plain(TeachWeed)),
            (b"examples", plain(Examples)),
            (b"forget 31", with(Forget, 31)),
            (b"forget all", plain(ForgetAll)),
            (b"dump", plain(Dump)),
            (b"version", plain(Version)),
        ] {
            assert_eq!(parse(line), Ok(command), "{}", line.escape_ascii());
        }
    }

    #[test]
    fn an_unknown_name_or_value_is_an_error() {
        for (line, error) in [
            (&b"hepl"[..], ParseError::Line(Wrong::UnknownCommand)),
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
            // Capital letters count as small ones.
            (b"HOLD\nClear\n", twice),
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
