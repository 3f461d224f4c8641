//! What things are called: the text of each of the machine's words (`words`), and which of them was typed.

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

/// Has an enum write and read its words, `WORDS`.
macro_rules! written {
    ($($Name:ident)*) => {$(
        impl $Name {
            const FIRST: Text = Text::first_of(Self::WORDS);

            /// The word for it.
            pub const fn text(self) -> Text {
                Self::FIRST.plus(self as u8)
            }

            /// The one that `word` stands for.
            pub fn find(word: &[u8]) -> Option<Self> {
                Self::from_index(packed::find(Self::FIRST, Self::COUNT, word))
            }
        }
    )*};
}

written! { Setting Word Argument Alarm Warning Reason Cause }

impl Setting {
    /// What it is, for the operator.
    pub fn help(self) -> Text {
        const { Text::first_of(settings::HELPS) }.plus(self as u8)
    }

    /// Its unit behind a blank, or nothing where it is a count or switched.
    pub fn unit(self) -> Text {
        const { Text::first_of(settings::UNITS) }.plus(self as u8)
    }
}

/// What the machine does.
pub fn state(state: State) -> Text {
    match state {
        State::Hold => Word::Hold.text(),
        State::Work => texts::WORK,
        State::Alarm(_) => texts::IN_ALARM,
    }
}

/// An alarm's name.
pub fn alarm(alarm: Alarm) -> Text {
    alarm.text()
}

/// A warning's name.
pub fn warning(warning: Warning) -> Text {
    warning.text()
}

/// Where the tool is, or is to be.
pub fn place(tool_out: bool) -> Text {
    if tool_out { Argument::Out.text() } else { Argument::In.text() }
}

/// Yes or no.
pub fn answer(yes: bool) -> Text {
    if yes { texts::YES } else { texts::NO }
}

/// What a [label](mod@crate::ground::class::label) stands for.
pub fn label(label: u8) -> Text {
    if label == label::PLANT { Argument::Plant.text() } else { Argument::Weed.text() }
}

/// What a detection was taken for.
pub fn class(class: Class) -> Text {
    match class {
        Class::Plant => Argument::Plant.text(),
        Class::Weed => Argument::Weed.text(),
        Class::Unknown => texts::UNKNOWN,
    }
}
