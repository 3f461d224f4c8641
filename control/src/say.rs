//! How all that is said reaches the line: a text, a number behind it, or numbers within it.

use crate::{
    classifier::{Class, label},
    console::{Argument, Word},
    controller::State,
    said,
    text::Text,
};
use ufmt::{uWrite, uwrite};

/// A text and a number after it: in one place, and in one width, which costs the least flash.
#[inline(never)]
pub(crate) fn say_number<W: uWrite + ?Sized>(out: &mut W, text: Text, number: i32) -> Result<(), W::Error> {
    say(out, text)?;
    uwrite!(out, "{}", number)
}

/// A text.
#[inline(never)]
pub(crate) fn say<W: uWrite + ?Sized>(out: &mut W, text: Text) -> Result<(), W::Error> {
    say_numbers(out, text, &[])
}

/// A text in which each `#` stands for the next of the numbers.
#[inline(never)]
pub(crate) fn say_numbers<W: uWrite + ?Sized>(out: &mut W, text: Text, numbers: &[i32]) -> Result<(), W::Error> {
    let mut numbers = numbers.iter();
    for character in text.bytes() {
        match numbers.as_slice() {
            [number, ..] if character == b'#' => {
                numbers.next();
                uwrite!(out, "{}", *number)?;
            }
            _ => out.write_char(char::from(character))?,
        }
    }
    Ok(())
}

/// A name and what it stands for.
pub(crate) fn explain<W: uWrite + ?Sized>(out: &mut W, name: Text, explanation: Text) -> Result<(), W::Error> {
    say(out, name)?;
    say(out, said::DASH)?;
    say(out, explanation)
}

pub(crate) fn state_name(state: State) -> Text {
    match state {
        State::Hold => Word::Hold.text(),
        State::Work => said::WORK,
        State::Alarm(_) => said::IN_ALARM,
    }
}

pub(crate) fn place_name(tool_out: bool) -> Text {
    if tool_out { Argument::Out.text() } else { Argument::In.text() }
}

pub(crate) fn label_name(label: u8) -> Text {
    if label == label::PLANT { Argument::Plant.text() } else { Argument::Weed.text() }
}

pub(crate) fn class_name(class: Class) -> Text {
    match class {
        Class::Plant => Argument::Plant.text(),
        Class::Weed => Argument::Weed.text(),
        Class::Unknown => said::UNKNOWN,
    }
}

/// The state, and which alarm.
pub(crate) fn write_state<W: uWrite + ?Sized>(state: State, out: &mut W) -> Result<(), W::Error> {
    say(out, state_name(state))?;
    if let State::Alarm(alarm) = state {
        say(out, said::BLANK)?;
        say(out, alarm.text())?;
    }
    Ok(())
}
