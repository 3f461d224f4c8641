//! The monitor's screen: from what is known to what is drawn, and nothing else.
//!
//! State, alarm and the key for HOLD stand at the top, whatever else there is no room for. [`one`] draws one row, [`several`] all rows
//! of a machine at a glance, both with the same [`parts`].

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
