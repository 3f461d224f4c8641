//! What things are called.

use crate::{
    classifier::{Class, label},
    console::{Argument, Word},
    controller::State,
    said,
    text::Text,
};

pub(super) fn state_name(state: State) -> Text {
    match state {
        State::Hold => Word::Hold.text(),
        State::Work => said::WORK,
        State::Alarm(_) => said::IN_ALARM,
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
        Class::Unknown => said::UNKNOWN,
    }
}
