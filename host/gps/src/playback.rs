//! A file of a receiver's bytes, cut into pieces that are due as the receiver sent them.
//!
//! A time that goes back, and a pause that no user waits for, are told and jumped over.

use crate::recorder::useless;
use crate::sentence::{DAY_MS, Finder, Line};
use std::collections::VecDeque;

/// A longer pause is jumped over, in ms.
const LONGEST_PAUSE_MS: i64 = 60_000;

/// A part of the file that ends with a sentence.
#[derive(Clone, Debug, PartialEq, Eq)]
pub struct Piece {
    /// Milliseconds since the first time in the file.
    pub due_ms: u64,
    /// The bytes.
    pub bytes: Vec<u8>,
    /// What the operator should know about its time.
    pub note: Option<String>,
}

/// The pieces of a file.
///
/// # Errors
/// If no sentence can be used, and what would be right.
pub fn pieces(file: &[u8]) -> Result<VecDeque<Piece>, &'static str> {
    let mut finder = Finder::default();
    let mut pieces = VecDeque::new();
    let (mut bytes, mut note) = (Vec::new(), None);
    let (mut due_ms, mut usual_ms, mut last_ms) = (0, 0, None::<i64>);
    let (mut is_useful, mut why) = (false, "no line is NMEA 0183: name a file of a receiver's lines");
    for &byte in file.iter().chain(b"\n") {
        bytes.push(byte);
        let Some(sentence) = finder.take(byte) else { continue };
        let line = Line::parse(&sentence);
        why = useless(why, &line, &sentence);
        if let Line::Report(report) = line {
            is_useful = true;
            if let Some(time_ms) = report.time_ms {
                // The time of day begins again at 0 at midnight.
                let step_ms = (time_ms - last_ms.unwrap_or(time_ms) + DAY_MS / 2).rem_euclid(DAY_MS) - DAY_MS / 2;
                if step_ms < 0 {
                    note = Some(format!(
                        "the file's time goes back by {:.1} s: read on without a wait",
                        -step_ms as f64 / 1000.0
                    ));
                } else if step_ms > LONGEST_PAUSE_MS {
                    note = Some(format!("the file has a pause of {:.1} min: jumped over", step_ms as f64 / 60_000.0));
                } else if step_ms > 0 {
                    usual_ms = step_ms;
                }
                if step_ms != 0 {
                    due_ms += usual_ms.unsigned_abs();
                }
                last_ms = Some(time_ms);
            }
        }
        pieces.push_back(Piece { due_ms, bytes: std::mem::take(&mut bytes), note: note.take() });
    }
    if is_useful { Ok(pieces) } else { Err(why) }
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn a_file_is_read_at_the_pace_of_its_times_over_midnight_too() {
        let lines = ["$GPRMC,235959.00,V,,,,,,,311226,,,N*79", "noise", "$GPRMC,000000.50,V,,,,,,,010127,,,N*7D"];
        let pieces = pieces(lines.join("\r\n").as_bytes()).unwrap();
        assert_eq!(pieces.iter().map(|piece| piece.due_ms).collect::<Vec<_>>(), [0, 1500]);
        assert_eq!(pieces.iter().map(|piece| piece.bytes.len()).sum::<usize>(), lines.join("\r\n").len());
    }
}
