//! What is typed or piped into a command: bytes from a shell, a script or another program, as lines.
//!
//! CR, LF or both end a line. The text is UTF-8, because rows have names in any language. A byte order mark is dropped,
//! and UTF-16 is read, because some shells write both. A byte that is no text spoils its own line only. Lines are
//! bounded, so that input without line ends is refused too.

use std::io::{self, ErrorKind, Read};
use std::sync::mpsc::{self, Receiver};
use std::thread;

/// The greatest length of a line in bytes, or units of UTF-16: more than a row's name and a command.
const LIMIT: usize = 200;

#[derive(Clone, Debug, PartialEq, Eq)]
pub struct Line {
    /// Its number, counted from 1.
    pub number: usize,
    /// Its text. What is no text, or a control character, is U+FFFD. The end of a long line is missing.
    pub text: String,
}

#[derive(Clone, Copy, PartialEq, Eq)]
enum Encoding {
    Utf8,
    /// UTF-16 with the low byte first, or last.
    LittleEndian,
    BigEndian,
}

impl Encoding {
    /// The encoding that the first bytes show, and the length of their byte order mark. `None` if more bytes are needed.
    fn of(first: &[u8], is_all: bool) -> Option<(Self, usize)> {
        Some(match *first {
            // Enter alone is a whole line, so nothing waits for a second byte.
            [b'\r' | b'\n', ..] => (Self::Utf8, 0),
            [0xEF, 0xBB, 0xBF, ..] => (Self::Utf8, 3),
            [0xFF, 0xFE, ..] => (Self::LittleEndian, 2),
            [0xFE, 0xFF, ..] => (Self::BigEndian, 2),
            // UTF-16 without a mark: a command begins with an ASCII character.
            [1..=0x7F, 0, ..] => (Self::LittleEndian, 0),
            [0, 1..=0x7F, ..] => (Self::BigEndian, 0),
            [] | [_] | [0xEF, 0xBB] if !is_all => return None,
            _ => (Self::Utf8, 0),
        })
    }

    /// The first byte, or unit of UTF-16, and the bytes behind it.
    fn first(self, bytes: &[u8]) -> Option<(u16, &[u8])> {
        match (self, bytes) {
            (Self::Utf8, [byte, rest @ ..]) => Some((u16::from(*byte), rest)),
            (Self::LittleEndian, [low, high, rest @ ..]) => Some((u16::from_le_bytes([*low, *high]), rest)),
            (Self::BigEndian, [high, low, rest @ ..]) => Some((u16::from_be_bytes([*high, *low]), rest)),
            _ => None,
        }
    }

    fn text(self, codes: &[u16]) -> String {
        match self {
            Self::Utf8 => {
                let bytes: Vec<u8> = codes.iter().map(|code| code.to_le_bytes()[0]).collect();
                String::from_utf8_lossy(&bytes).into_owned()
            }
            Self::LittleEndian | Self::BigEndian => String::from_utf16_lossy(codes),
        }
    }
}

#[derive(Default)]
struct Lines {
    encoding: Option<Encoding>,
    /// Bytes that are no whole unit yet.
    begun: Vec<u8>,
    /// The line's bytes or units so far.
    line: Vec<u16>,
    number: usize,
    /// Whether the last one was a CR. It makes one line end with an LF behind it.
    after_return: bool,
    complete: Vec<Line>,
}

impl Lines {
    /// Takes bytes; `is_all` where no more will come. Returns the lines that they complete.
    fn take(&mut self, bytes: &[u8], is_all: bool) -> Vec<Line> {
        self.begun.extend_from_slice(bytes);
        if self.encoding.is_none()
            && let Some((encoding, mark)) = Encoding::of(&self.begun, is_all)
        {
            self.encoding = Some(encoding);
            self.begun.drain(..mark);
        }
        let Some(encoding) = self.encoding else { return Vec::new() };
        let begun = std::mem::take(&mut self.begun);
        let mut rest = begun.as_slice();
        while let Some((code, behind)) = encoding.first(rest) {
            self.code(code, encoding);
            rest = behind;
        }
        if is_all {
            // A last line without an end is a line too. Half a unit of UTF-16 is no text.
            (!rest.is_empty()).then(|| self.line.push(0xFFFD));
            (!self.line.is_empty()).then(|| self.end(encoding));
        } else {
            self.begun = rest.to_vec();
        }
        std::mem::take(&mut self.complete)
    }

    fn code(&mut self, code: u16, encoding: Encoding) {
        let after_return = std::mem::replace(&mut self.after_return, code == u16::from(b'\r'));
        match u8::try_from(code) {
            Ok(b'\n') if after_return => {}
            Ok(b'\r' | b'\n') => self.end(encoding),
            _ if self.line.len() < LIMIT => self.line.push(code),
            _ => {}
        }
    }

    fn end(&mut self, encoding: Encoding) {
        self.number += 1;
        let shown = |character: char| match character {
            '\t' => ' ',
            control if control.is_control() => char::REPLACEMENT_CHARACTER,
            character => character,
        };
        let text = encoding.text(&std::mem::take(&mut self.line)).chars().map(shown).collect();
        self.complete.push(Line { number: self.number, text });
    }
}

/// The lines of standard input, each read once the caller has taken the one before. The channel ends with the input.
pub fn typed() -> Receiver<Line> {
    let (sender, typed) = mpsc::sync_channel(0);
    // Reading blocks until a person types, so it has its own thread. The thread ends with the process.
    thread::spawn(move || {
        let (mut input, mut lines, mut bytes) = (io::stdin().lock(), Lines::default(), [0; 1024]);
        loop {
            let count = match input.read(&mut bytes) {
                Ok(count) => count,
                Err(error) if error.kind() == ErrorKind::Interrupted => continue,
                // An input that is gone has ended. What came before is sent.
                Err(_) => 0,
            };
            let lines = lines.take(&bytes[..count], count == 0);
            if !lines.into_iter().all(|line| sender.send(line).is_ok()) || count == 0 {
                return;
            }
        }
    });
    typed
}

#[cfg(test)]
mod tests {
    use super::*;
    use proptest::collection::vec;
    use proptest::prelude::*;

    /// The lines of an input that comes in pieces of this length.
    fn lines(input: &[u8], piece: usize) -> Vec<(usize, String)> {
        let mut lines = Lines::default();
        let mut all: Vec<Line> = input.chunks(piece).flat_map(|bytes| lines.take(bytes, false)).collect();
        all.extend(lines.take(&[], true));
        all.into_iter().map(|line| (line.number, line.text)).collect()
    }

    #[test]
    fn a_line_is_passed_on_before_the_next_byte_comes() {
        for end in ["\n", "\r", "\r\n"] {
            let mut lines = Lines::default();
            let hold = lines.take(format!("hold{end}").as_bytes(), false);
            assert_eq!(hold, [Line { number: 1, text: "hold".to_owned() }], "{end:?}");
            let enter = Lines::default().take(end.as_bytes(), false);
            assert_eq!(enter, [Line { number: 1, text: String::new() }], "{end:?}");
        }
    }

    #[test]
    fn endless_input_is_bounded_and_what_follows_is_read() {
        let mut input = vec![b'x'; 100_000];
        input.extend(b"\nhold\n");
        assert_eq!(lines(&input, 1000), [(1, "x".repeat(LIMIT)), (2, "hold".to_owned())]);
        assert_eq!(lines(&[0; 5000], 7).len(), 1);
    }

    #[test]
    fn a_row_s_name_in_any_language_is_read_and_what_is_no_text_is_marked() {
        let name = "s\u{fc}d \u{921}\u{940}: hold";
        assert_eq!(lines(format!("{name}\n").as_bytes(), 1), [(1, name.to_owned())]);
        assert_eq!(lines(b"s\x81d:\thold\x1b", 1), [(1, "s\u{fffd}d: hold\u{fffd}".to_owned())]);
    }

    /// A line's text. Some characters have a line end among their bytes in UTF-16.
    fn any_text() -> impl Strategy<Value = String> {
        prop_oneof![
            4 => "[ -~]{0,90}",
            1 => "[a-z #]{0,20}[\u{e4}\u{e9}\u{20ac}\u{10a}\u{a0a}\u{200b}\u{1f33f}]{1,3}[a-z ]{0,9}",
        ]
    }

    fn encoded(character: char, encoding: &str) -> Vec<u8> {
        let units = || character.encode_utf16(&mut [0; 2]).to_vec();
        match encoding {
            "utf-8" => character.to_string().into_bytes(),
            "latin-1" => vec![u8::try_from(u32::from(character)).unwrap_or(b'\x80')],
            "utf-16le" => units().into_iter().flat_map(u16::to_le_bytes).collect(),
            _ => units().into_iter().flat_map(u16::to_be_bytes).collect(),
        }
    }

    proptest! {
        #[test]
        fn input_in_any_shell_encoding_keeps_its_lines_and_numbers(
            texts in vec(any_text(), 0..6),
            // What shells do with a text: how they encode it, mark it, end its lines, and whether they end the last one.
            encoding in prop::sample::select(vec!["utf-8", "latin-1", "utf-16le", "utf-16be"]),
            marked in any::<bool>(),
            end in prop::sample::select(vec!["\n", "\r\n", "\r"]),
            last_ended in any::<bool>(),
            piece in 1..9_usize,
        ) {
            // Without a mark, only a first ASCII character shows that it is UTF-16.
            let is_shown = marked || texts.first().is_none_or(|text| text.starts_with(|c: char| c.is_ascii()));
            prop_assume!(!encoding.starts_with("utf-16") || is_shown);
            let mut script = texts.join(end);
            if last_ended && !texts.is_empty() {
                script.push_str(end);
            }
            if marked && encoding != "latin-1" {
                script.insert(0, '\u{feff}');
            }
            let input: Vec<u8> = script.chars().flat_map(|character| encoded(character, encoding)).collect();
            let mut found = lines(&input, piece).into_iter();
            for (number, text) in (1..).zip(&texts) {
                let is_last = number == texts.len();
                match found.next() {
                    Some((at, line)) => {
                        prop_assert_eq!(at, number);
                        if text.is_ascii() || encoding != "latin-1" {
                            prop_assert_eq!(&line, text);
                        } else {
                            prop_assert!(!link::is_command(&line), "{:?} became {:?}", text, line);
                        }
                    }
                    // Only a last line that is empty and has no end is no line.
                    None => prop_assert!(is_last && text.is_empty() && !last_ended, "line {} is lost", number),
                }
            }
            prop_assert_eq!(found.next(), None);
        }
    }
}
