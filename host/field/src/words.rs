//! Numbers in sentences.

use std::fmt::Display;

/// A number of things in words, such as `1 plant` and `2 plants`.
pub fn counted(number: impl Display, thing: &str) -> String {
    let number = number.to_string();
    let plural = if number == "1" { "" } else { "s" };
    format!("{number} {thing}{plural}")
}
