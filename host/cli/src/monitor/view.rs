//! The monitor's screen: draws the model, and does nothing else.
//!
//! State, alarm and the key for HOLD are at the top, so they are visible on a small terminal too. [`one`] draws one
//! row. [`several`] draws all rows of a machine. Both use the same [`parts`].

mod one;
mod parts;
mod several;

use super::model::Model;
use ratatui::Frame;

/// Draws all of it.
pub fn draw(model: &Model, frame: &mut Frame) {
    match model.rows.as_slice() {
        [row] => one::draw(model, row, frame),
        rows => several::draw(model, rows, frame),
    }
}

#[cfg(test)]
mod tests;
