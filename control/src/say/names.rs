//! Names: the text of each of the machine's words that is not an enum's own.

use crate::{
    ground::class::{Class, label},
    operate::state::State,
    say::{
        packed::Text,
        texts,
        words::{Argument, Word},
    },
    settings::{self, Setting},
};

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
