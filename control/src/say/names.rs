//! Names: the text of each of the machine's words.

use crate::{
    alarm::{Alarm, Warning},
    ground::class::{Class, label},
    measure::reset::Cause,
    operate::{command_error::CommandError, state::State, tool::Reason},
    say::{
        packed::Text,
        texts,
        words::{self, Argument, Word, Wrong},
    },
    settings::{self, Setting},
};

/// Reads the texts of enums that are [`named!`](crate::named) from flash.
macro_rules! read_names {
    ($($Name:ident)*) => {$(
        impl $Name {
            /// Its text.
            pub fn text(self) -> Text {
                const { Text::first_of(Self::WORDS) }.after(self as u8)
            }

            /// The variant with this text.
            pub fn find(text: &[u8]) -> Option<Self> {
                Self::from_index(const { Text::first_of(Self::WORDS) }.find(Self::COUNT, text))
            }
        }
    )*};
}

read_names! { Alarm Argument Cause CommandError Reason Setting Warning Word Wrong }

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

impl Setting {
    /// Its help text.
    pub fn help(self) -> Text {
        const { Text::first_of(settings::HELPS) }.after(self as u8)
    }

    /// A blank and its unit; empty for a count or a switch.
    pub fn unit(self) -> Text {
        const { Text::first_of(settings::UNITS) }.after(self as u8)
    }
}

/// The firmware's name and version.
pub(super) const WEEDER: Text = Text::first_of(&[texts::UNPACKED]);

/// The state's name.
#[inline(never)]
pub fn state(state: State) -> Text {
    match state {
        State::Hold => Word::Hold.text(),
        State::Work => texts::WORK.text(),
        State::Alarm(_) => texts::IN_ALARM.text(),
    }
}

/// The tool's command: `in` or `out`.
pub fn place(tool_out: bool) -> Text {
    if tool_out { Argument::Out.text() } else { Argument::In.text() }
}

/// Yes or no.
pub fn answer(yes: bool) -> Text {
    if yes { texts::YES } else { texts::NO }.text()
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
        Class::Unknown => texts::UNKNOWN.text(),
    }
}
