//! Names: the text of each of the machine's words, and the search for a typed word.

use crate::{
    alarm::{Alarm, Warning},
    ground::class::{Class, label},
    measure::reset::Cause,
    operate::{state::State, tool::Reason},
    say::{
        packed,
        texts::{self, Text},
        words::{Argument, Word},
    },
    settings::{self, Setting},
};

/// Gives an enum the texts of its words, `WORDS`, and the search for a word.
macro_rules! written {
    ($($Name:ident)*) => {$(
        impl $Name {
            const FIRST: Text = Text::first_of(Self::WORDS);

            /// Its word.
            pub const fn text(self) -> Text {
                Self::FIRST.plus(self as u8)
            }

            /// The variant for a word.
            pub fn find(word: &[u8]) -> Option<Self> {
                Self::from_index(packed::find(Self::FIRST, Self::COUNT, word))
            }
        }
    )*};
}

written! { Setting Word Argument Alarm Warning Reason Cause }

impl Setting {
    /// Its help text.
    pub fn help(self) -> Text {
        const { Text::first_of(settings::HELPS) }.plus(self as u8)
    }

    /// A blank and its unit; empty for a count or a switch.
    pub fn unit(self) -> Text {
        const { Text::first_of(settings::UNITS) }.plus(self as u8)
    }
}

/// The state's name.
#[inline(never)]
pub fn state(state: State) -> Text {
    match state {
        State::Hold => Word::Hold.text(),
        State::Work => texts::WORK,
        State::Alarm(_) => texts::IN_ALARM,
    }
}

/// A warning's name.
pub fn warning(warning: Warning) -> Text {
    warning.text()
}

/// The name of the reason for the tool being out.
pub fn reason(reason: Reason) -> Text {
    reason.text()
}

/// The name of a reset's cause.
pub fn cause(cause: Cause) -> Text {
    cause.text()
}

/// The tool's command: `in` or `out`.
pub fn place(tool_out: bool) -> Text {
    if tool_out { Argument::Out.text() } else { Argument::In.text() }
}

/// Yes or no.
pub fn answer(yes: bool) -> Text {
    if yes { texts::YES } else { texts::NO }
}

/// A [label](mod@crate::ground::class::label)'s name.
pub fn label(label: u8) -> Text {
    if label == label::PLANT { Argument::Plant.text() } else { Argument::Weed.text() }
}

/// A class's name.
pub fn class(class: Class) -> Text {
    match class {
        Class::Plant => Argument::Plant.text(),
        Class::Weed => Argument::Weed.text(),
        Class::Unknown => texts::UNKNOWN,
    }
}
