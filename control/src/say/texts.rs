//! All texts of the machine. `packed` stores and reads them.
//!
//! Names are with the enums that have them (`named!`). Texts about commands and settings are in those tables, and lines with
//! `key=value` words in theirs. In a text, `#` stands for a number of its line, and `@` for a word: the line's next text.

use crate::{
    alarm::{Alarm, Warning},
    measure::reset::Cause,
    operate::{command_error::CommandError, tool::Reason},
    say::{
        command::Wrong,
        line::NamedText,
        lines, version,
        words::{self, Argument, Word},
    },
    settings::{self, Setting},
};

use super::packed::Text;

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
const NAMED: [&str; SAID.len() + lines::LINES.len()] = {
    let (mut texts, mut place) = ([""; SAID.len() + lines::LINES.len()], 0);
    while place < texts.len() {
        texts[place] = if place < SAID.len() { SAID[place] } else { lines::LINES[place - SAID.len()] };
        place += 1;
    }
    texts
};

/// The last text. No fragment is made of it, because it may name a commit.
pub(crate) const UNPACKED: &str = version::NAME;

/// The version.
pub(crate) const WEEDER: Text = Text::first_of(&[UNPACKED]);

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

impl Word {
    /// Its arguments, each after a blank.
    pub(crate) fn takes(self) -> Text {
        const { Text::first_of(words::TAKES) }.after(self as u8)
    }

    /// Its help text.
    pub(crate) fn help(self) -> Text {
        const { Text::first_of(words::HELPS) }.after(self as u8)
    }
}
