//! All texts of the machine. `packed` stores and reads them.
//!
//! Names are with the enums that have them (`named!`). Texts about commands and settings are in those tables, and lines with
//! `key=value` words in theirs. In a text, `#` stands for a number of its line, and `@` for a word: the line's next text.

use crate::{
    alarm::{Alarm, Warning},
    line_tables,
    measure::reset::Cause,
    operate::{command_error::CommandError, tool::Reason},
    say::{
        version,
        words::{self, Argument, Word, Wrong},
    },
    settings::{self, Setting},
};

/// All texts, in the order of the table in flash. First those that the code names. Of the other groups, the code finds a text by its
/// place in the group, so they have no `@`.
pub(crate) const GROUPS: &[&[&str]] = &[
    &NAMED,
    CommandError::WORDS,
    Wrong::WORDS,
    words::TAKES,
    words::HELPS,
    settings::UNITS,
    settings::HELPS,
    Setting::WORDS,
    Word::WORDS,
    Argument::WORDS,
    Alarm::WORDS,
    Warning::WORDS,
    Reason::WORDS,
    Cause::WORDS,
    &[UNPACKED],
];

/// The texts that the code names: those below, and the lines of the tables.
const NAMED: [&str; SAID.len() + LINES.len()] = {
    let (mut texts, mut place) = ([""; SAID.len() + LINES.len()], 0);
    while place < texts.len() {
        texts[place] = if place < SAID.len() { SAID[place] } else { LINES[place - SAID.len()] };
        place += 1;
    }
    texts
};

/// Lists the lines of the tables. A line of the status has a text for each group.
macro_rules! list_lines {
    (
        events {$(
            $Event:ident $meaning:literal, $pattern:pat => $beginning:literal {
                $($part:literal $kind:ident($value:expr) $(=> $field:ident: $Type:ty)?, $about:literal;)*
            } $($tail:literal)?
        )*}
        status $machine:ident {$(
            $Line:ident $says:literal $($(if $condition:pat = $from:expr =>)? {
                $($word:literal $of:ident($state:expr) $(=> $to:ident: $Of:ty)?, $tells:literal;)*
            })*;
        )*}
    ) => {
        pub(super) const LINES: &[&str] = &[$(concat!($beginning, $($part,)* $($tail)?),)* $($(concat!($($word),*),)*)*];
    };
}

line_tables!(list_lines);

/// The last text. No fragment is made of it, because it may name a commit.
pub(crate) const UNPACKED: &str = version::NAME;

/// A text that the code names. One byte numbers it.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub(crate) struct NamedText(pub(super) u8);

impl NamedText {
    /// The first of them.
    pub(super) const FIRST: Self = Self(0);

    /// A text of the first group.
    pub(crate) const fn of(text: &str) -> Self {
        let (group, mut number, mut place) = (GROUPS[0], 0, 0);
        while !is_same(group[place], text) {
            number += parts(group[place]);
            place += 1;
        }
        assert!(number + parts(text) <= u8::MAX as usize, "one byte numbers the texts that the code names");
        Self(number as u8)
    }

    /// The text behind it: the part after a word, if it is the part before that.
    pub(super) const fn next(self) -> Self {
        Self(self.0 + 1)
    }
}

pub(super) const fn is_same(one: &str, other: &str) -> bool {
    let (one, other, mut same) = (one.as_bytes(), other.as_bytes(), 0);
    while same < one.len() && same < other.len() && one[same] == other[same] {
        same += 1;
    }
    same == one.len() && same == other.len()
}

/// Stands for a word in a text.
pub(super) const WORD: u8 = b'@';

/// The parts of a text before, between and behind its words.
pub(super) const fn parts(text: &str) -> usize {
    let (mut parts, mut at) = (1, 0);
    while at < text.len() {
        parts += (text.as_bytes()[at] == WORD) as usize;
        at += 1;
    }
    parts
}

/// Names texts.
macro_rules! said {
    ($($NAME:ident = $text:literal;)*) => {
        const SAID: &[&str] = &[$($text),*];

        $(pub(crate) const $NAME: NamedText = NamedText::of($text);)*
    };
}

said! {
    END = "\r\n";
    OK = "ok";
    ERROR = "error: ";
    RESET_BY = ", reset by ";
    WAS_WORK = ", was work";
    STATE = ", state ";
    TOOL_OUT = ", tool out; help lists the commands";
    DASH = " - ";
    IN_WORDS = " #-# ";
    NUMBER = "#";
    IS = "=";
    DEFAULT = ", default ";
    SAVED = ", saved ";
    NOT_SAVED = ", not saved";
    RANGE = " from # to #";
    ON_OR_OFF = " on or off";
    TAKES = " takes";
    TAKES_A_NUMBER = " takes a whole number";
    NONE = "none";
    YES = "yes";
    NO = "no";
    SERIAL_PLOTTER = "speed_mm_s:#,tool_deg:#,beam_broken:#,windows:#";
    TELEPLOT = ">speed_mm_s:#\r\n>tool_deg:#\r\n>beam_broken:#\r\n>windows:#";
    FIELD = "field";
    BUILT_IN = "built_in";
    EXAMPLE = " # ";
    FEATURES = " # # # # #";
    SPOILED = "spoiled=#";
    DUMPED = "#,#,#,#,#,";
    VOTES = ",#,";
    DUMP = "speed_mm_s,spacing_mm,delay_mm,hold_mm,actuation_mm,answer,votes,label";
    WORK = "work";
    UNKNOWN = "unknown";
    IN_ALARM = "alarm";
    USAGE = "the words do not fit, the command is ";
    HOLD_TO_SET = " changes where the tool is, hold first";
    OFF_THE_DIAMETER = "that is # permille off the diameter of the wheel";
    TAKEN_FOR = "the built-in examples say ";
    LOOK_AGAIN = ", look again, or add force";
}
