//! All texts of the machine, and their numbers: a [`Text`].
//!
//! Names are with the enums that have them (`named!`), and texts about commands and settings in those tables. A `#`
//! in a text stands for a number of its line. `packed` stores and reads the texts.

use crate::{
    alarm::{Alarm, Warning},
    event_table,
    measure::reset::Cause,
    operate::{command_error::CommandError, tool::Reason},
    say::{
        line_tables::line,
        version,
        words::{self, Argument, Word},
    },
    settings::{self, Setting},
    status_table,
};

/// All texts, in the order of the table in flash.
pub(crate) const GROUPS: &[&[&str]] = &[
    SAID,
    KEYED,
    COMMAND_ERRORS,
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
];

/// The number of texts.
pub(crate) const COUNT: u16 = {
    let (mut count, mut group) = (0, 0);
    while group < GROUPS.len() {
        count += GROUPS[group].len();
        group += 1;
    }
    count as u16
};

/// A text in flash, by its number.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub struct Text(u16);

impl Text {
    /// The first text of the table.
    pub(crate) const FIRST: Self = Self(0);

    /// The first text of a group.
    pub(crate) const fn first_of(group: &[&str]) -> Self {
        let (mut first, mut place) = (0, 0);
        while !is_same_group(GROUPS[place], group) {
            first += GROUPS[place].len() as u16;
            place += 1;
        }
        Self(first)
    }

    /// A text in a line of the tables.
    pub(crate) const fn of_line(text: &str) -> Self {
        let place = place_of(text, KEYED);
        assert!(place < KEYED.len(), "the tables have it");
        Self::first_of(KEYED).plus(place as u8)
    }

    /// The text this many places after this one.
    pub(crate) const fn plus(self, places: u8) -> Self {
        Self(self.0 + places as u16)
    }

    /// Its index in the table.
    pub(crate) const fn number(self) -> u16 {
        self.0
    }
}

const fn is_same_group(one: &[&str], other: &[&str]) -> bool {
    let mut same = 0;
    while same < one.len() && same < other.len() && is_same_text(one[same].as_bytes(), other[same].as_bytes()) {
        same += 1;
    }
    same == one.len() && same == other.len()
}

const fn is_same_text(one: &[u8], other: &[u8]) -> bool {
    one.len() == other.len() && begins(one, 0, other)
}

/// Whether a part is at this offset of a text.
pub(super) const fn begins(text: &[u8], at: usize, part: &[u8]) -> bool {
    let mut same = 0;
    while same < part.len() && at + same < text.len() && text[at + same] == part[same] {
        same += 1;
    }
    same == part.len()
}

macro_rules! texts_of_events {
    ($($Event:ident $meaning:literal, $pattern:pat => $beginning:literal { $($values:tt)* } $($tail:literal)?)*) => {
        /// The texts in the lines of events, line by line.
        const OF_EVENTS: &[&[&str]] = &[$(line!(texts(line) $beginning " " $($values)* $($tail)?)),*];
    };
}

event_table!(texts_of_events);

macro_rules! texts_of_status {
    ($machine:ident: $(
        $Line:ident $meaning:literal { $($first:tt)* } $($(if $pattern:pat = $from:expr =>)? { $($values:tt)* })*;
    )*) => {
        /// The texts in the answer to `status`, group by group.
        const OF_STATUS: &[&[&str]] = &[$(line!(texts(line) "" "" $($first)*), $(line!(texts(line) "" " " $($values)*)),*),*];
    };
}

status_table!(texts_of_status);

/// Both without repetitions, and their number.
const DISTINCT: ([&str; 56], usize) = distinct(OF_STATUS, distinct(OF_EVENTS, ([""; 56], 0)));

const fn distinct(
    lines: &[&[&'static str]],
    (mut texts, mut count): ([&'static str; 56], usize),
) -> ([&'static str; 56], usize) {
    let mut line = 0;
    while line < lines.len() {
        let mut place = 0;
        while place < lines[line].len() {
            let text = lines[line][place];
            if place_of(text, &texts) == texts.len() {
                (texts[count], count) = (text, count + 1);
            }
            place += 1;
        }
        line += 1;
    }
    (texts, count)
}

/// The texts of the tables.
const KEYED: &[&str] = DISTINCT.0.split_at(DISTINCT.1).0;

/// A text's index; the length if it is not there.
const fn place_of(text: &str, texts: &[&str]) -> usize {
    let mut place = 0;
    while place < texts.len() && !is_same_text(texts[place].as_bytes(), text.as_bytes()) {
        place += 1;
    }
    place
}

/// Names the texts.
macro_rules! said {
    ($($NAME:ident = $text:expr;)*) => {
        const SAID: &[&str] = &[$($text),*];

        said!(Text::first_of(SAID); $($NAME)*);
    };
    ($place:expr; $NAME:ident $($rest:ident)*) => {
        pub(crate) const $NAME: Text = $place;

        said!($NAME.plus(1); $($rest)*);
    };
    ($place:expr;) => {};
}

said! {
    END = "\r\n";
    OK = "ok";
    ERROR = "error: ";
    WEEDER = version::NAME;
    RESET_BY = ", reset by ";
    STATE = ", state ";
    WAS_WORK = ", was work";
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
    TOO_LONG = "send 80 characters at most";
    NOT_TEXT = "send letters, digits and blanks only";
    CHARACTERS_LOST = "characters were lost, send the line again";
    UNKNOWN_COMMAND = "no such command, help lists them all";
    UNKNOWN_SETTING = "no such setting, get lists them all";
    USAGE = "the words do not fit, the command is ";
    HOLD_TO_SET = " changes where the tool is, hold first";
    WHEEL_DIFFERS = "that would be ticks_per_m #, the wheel has #";
    OFF_THE_DIAMETER = "that is # permille off the diameter of the wheel";
    TAKEN_FOR = "the built-in examples say ";
    LOOK_AGAIN = ", look again, or add force";
}

/// The texts of command errors: one each, up to `WheelDiffers`. From there on several texts make the line.
macro_rules! command_errors {
    ($($CommandError:ident $text:literal;)*) => {
        const COMMAND_ERRORS: &[&str] = &[$($text),*];

        const _: () = {
            let mut place = 0;
            $(
                assert!(CommandError::$CommandError as u8 == place, "the errors stand here in the order of declaration");
                place += 1;
            )*
            assert!(place == CommandError::WheelDiffers as u8);
        };
    };
}

impl CommandError {
    /// Its text, if it has only one.
    pub(crate) fn text(self) -> Text {
        const { Text::first_of(COMMAND_ERRORS) }.plus(self as u8)
    }
}

command_errors! {
    AlarmLatched "an alarm is latched, see status, then clear it";
    NotInHold "the machine is at work, hold first";
    PulsesEqual "servo_in_us and servo_out_us would be equal, and the tool would not move";
    BeamTooNear "margin, leads and top speed would need beam_to_tool_mm # or more, change one of them first";
    SecondBeamAstray "second_beam_mm is to be 0, or 72 or more from beam and tool, and beam_to_tool_mm 1000 at most";
    EncoderTooCoarse "a wheel gives 900 ticks a metre or more, take a finer encoder";
    Rolls "the machine rolls, stop first";
    NothingToLabel "there is no detection without a label, let the beam see one first";
    IncompleteExample "tell its 5 features first, as examples lists them";
    ExamplesFull "all 32 places are taken, forget one first";
    NoSuchExample "no field example has this number, examples lists them";
    NothingSaved "no settings are saved, save does it";
    NotBegun "calibrate start first, then roll";
    TooShort "roll 1000 mm at least, 10000 are better";
    TestSpeed "test row takes a speed in mm/s from 100 to #";
}

impl Word {
    /// Its arguments, each after a blank.
    pub(crate) fn takes(self) -> Text {
        const { Text::first_of(words::TAKES) }.plus(self as u8)
    }

    /// Its help text.
    pub(crate) fn help(self) -> Text {
        const { Text::first_of(words::HELPS) }.plus(self as u8)
    }
}
