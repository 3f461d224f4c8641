//! A figure for people and programs: name, equation, number, unit, and a line of interpretation.

use crate::unit::Unit;
use serde::Serialize;

/// One result of a design.
#[derive(Clone, Debug, PartialEq, Serialize)]
pub struct Figure {
    /// Its name for programs.
    pub key: &'static str,
    /// Its name.
    pub name: &'static str,
    /// Its equation in the paper.
    pub equation: &'static str,
    /// Its value in `unit`.
    pub value: f64,
    /// Its unit; empty for plain numbers.
    pub unit: &'static str,
    /// Its meaning for this machine.
    pub sense: String,
    /// Whether it asks for a change of the machine.
    pub concern: bool,
}

/// Value with four significant digits, without trailing zeros.
pub fn digits(value: f64) -> String {
    let text = format!("{value:.*}", significant_decimals(value));
    if text.contains('.') { text.trim_end_matches('0').trim_end_matches('.').to_owned() } else { text }
}

/// Value with four significant digits, or with more if `decimals` needs them.
pub fn digits_beside(value: f64, decimals: usize) -> String {
    if decimals > significant_decimals(value) { format!("{value:.decimals$}") } else { digits(value) }
}

fn significant_decimals(value: f64) -> usize {
    let magnitude = if value == 0.0 { 0.0 } else { value.abs().log10().floor() };
    (3.0 - magnitude).clamp(0.0, 9.0) as usize
}

/// Value and unit with four significant digits.
pub fn written<Q>(quantity: Q, unit: Unit<Q>) -> String {
    format!("{} {}", digits(unit.value(quantity)), unit.name).trim_end().to_owned()
}
