//! What things are called.

use crate::{
    ground::class::{Class, label},
    operate::state::State,
    say::{
        command::{Argument, Word},
        packed::Text,
        texts,
    },
};

pub(super) fn state_name(state: State) -> Text {
    match state {
        State::Hold => Word::Hold.text(),
        State::Work => texts::WORK,
        State::Alarm(_) => texts::IN_ALARM,
    }
}

pub(super) fn place_name(tool_out: bool) -> Text {
    if tool_out { Argument::Out.text() } else { Argument::In.text() }
}

pub(super) fn label_name(label: u8) -> Text {
    if label == label::PLANT { Argument::Plant.text() } else { Argument::Weed.text() }
}

pub(super) fn class_name(class: Class) -> Text {
    match class {
        Class::Plant => Argument::Plant.text(),
        Class::Weed => Argument::Weed.text(),
        Class::Unknown => texts::UNKNOWN,
    }
}
