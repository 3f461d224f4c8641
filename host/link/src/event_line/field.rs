//! The fields of a line by their names, whichever line it is: the page shows them so.

use super::Mode;
use control::alarm::{Alarm, Warning};
use control::ground::{class::Class, features};
use control::say::names;
use derive_more::From;

/// A line's name, and its fields by their names.
pub type Fields = (&'static str, Vec<(&'static str, Field)>);

/// A field of a line.
#[derive(Clone, Debug, PartialEq, Eq, From)]
pub enum Field {
    /// The line does not have it.
    Missing,
    /// A number.
    #[from(i32, i16, u32, u16, u8)]
    Number(i64),
    /// Several numbers.
    #[from([u8; features::COUNT])]
    Numbers(Vec<u8>),
    /// Yes or no.
    #[from]
    Flag(bool),
    /// A word, or a text.
    #[from]
    Word(String),
}

impl<T: Into<Field>> From<Option<T>> for Field {
    fn from(field: Option<T>) -> Self {
        field.map_or(Self::Missing, T::into)
    }
}

impl From<Class> for Field {
    fn from(class: Class) -> Self {
        names::class(class).to_string().into()
    }
}

impl From<Mode> for Field {
    fn from(mode: Mode) -> Self {
        mode.name().to_owned().into()
    }
}

impl From<Alarm> for Field {
    fn from(alarm: Alarm) -> Self {
        alarm.text().to_string().into()
    }
}

impl From<Warning> for Field {
    fn from(warning: Warning) -> Self {
        warning.text().to_string().into()
    }
}
