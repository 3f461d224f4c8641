//! How each kind of value of the tables is read.

use super::Mode;
use control::alarm::{Alarm, Warning};
use control::ground::class::Class;
use control::say::{Text, names};
use std::str::FromStr;

pub(crate) use self::{number as count, word as cause, word as reason};

pub(crate) fn number<T: FromStr>(word: &str) -> Option<T> {
    word.parse().ok()
}

/// A number, or another word if there is none.
pub(crate) fn optional(word: &str) -> Option<i32> {
    number(word)
}

pub(crate) fn state(word: &str) -> Option<Mode> {
    number(word)
}

/// A newer firmware may have more of these words.
pub(crate) fn word(word: &str) -> Option<String> {
    Some(word.to_owned())
}

pub(crate) fn class(word: &str) -> Option<Class> {
    named(word, [Class::Plant, Class::Weed, Class::Unknown], names::class)
}

pub(crate) fn place(word: &str) -> Option<bool> {
    named(word, [false, true], names::place)
}

pub(crate) fn answer(word: &str) -> Option<bool> {
    named(word, [false, true], names::answer)
}

pub(crate) fn alarm(word: &str) -> Option<Alarm> {
    Alarm::find(word.as_bytes())
}

pub(crate) fn warning(word: &str) -> Option<Warning> {
    Warning::find(word.as_bytes())
}

fn named<T: Copy, const N: usize>(word: &str, all: [T; N], name: fn(T) -> Text) -> Option<T> {
    all.into_iter().find(|&one| name(one).to_string() == word)
}
