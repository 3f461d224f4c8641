//! Plays a recording of a real encoder to the firmware, and reads its count.
//!
//! Net, lowest and highest count come from the firmware itself. Its console is too slow for a question at every edge.
//! So the recording is paused, with constant levels, at its extremes. The question is asked, and the recording
//! continues.

use crate::console::Status;
use crate::run::{PROGRESS_CYCLES, PassError, boot};
use field::machine::counts;
use field::wiring;
use serde::Serialize;
use std::path::Path;
use uno::PinChange;

/// The firmware's count, relative to its position at the start of the recording.
#[derive(Clone, Copy, Debug, PartialEq, Eq, Serialize)]
pub struct Counted {
    /// Count at the end.
    pub net_ticks: i64,
    /// Lowest count.
    pub lowest_ticks: i64,
    /// Highest count.
    pub highest_ticks: i64,
    /// Counts that the firmware knows to have lost.
    pub lost_ticks: u64,
}

/// A replay's result.
#[derive(Clone, Debug)]
pub struct Replay {
    /// The firmware's count.
    pub counted: Counted,
    /// Encoder edges in the recording.
    pub edges: usize,
    /// Every level on every pin, inputs first.
    pub changes: Vec<PinChange>,
}

/// Pause after each stretch of the recording, so that the firmware has served the last edge.
const PAUSE_MS: u64 = 1;

/// Plays the recording to the firmware at `elf`. `progress` gets the share done, from 0 to 1.
///
/// # Errors
/// If the firmware cannot be run or does not answer.
pub fn replay(capture: &[PinChange], elf: &Path, mut progress: impl FnMut(f64)) -> Result<Replay, PassError> {
    let (first_levels, edges) = split_first_levels(capture);
    let mut uno = boot(elf, &first_levels)?;
    let mut played: Vec<PinChange> = first_levels.iter().map(|change| PinChange { cycle: 0, ..*change }).collect();
    let begin = Status::ask(&mut uno)?;

    let mut at_pauses = vec![begin.position_ticks];
    let mut rest = edges.as_slice();
    for pause in pauses(&first_levels, &edges) {
        let (stretch, later) = rest.split_at(pause - (edges.len() - rest.len()));
        rest = later;
        let Some((start, end)) = stretch.first().zip(stretch.last()) else {
            continue;
        };
        let (start, end) = (start.cycle, end.cycle);
        let from = uno.cycle();
        let moved: Vec<PinChange> =
            stretch.iter().map(|change| PinChange { cycle: change.cycle - start + from, ..*change }).collect();
        uno.drive(moved.iter().copied());
        played.extend(moved);
        while uno.cycle() < from + (end - start) {
            uno.run_until((uno.cycle() + PROGRESS_CYCLES).min(from + (end - start)))?;
            let done = edges.len() - rest.len() - stretch.len();
            let share = (uno.cycle() - from) as f64 / (end - start) as f64;
            progress((done as f64 + share * stretch.len() as f64) / edges.len() as f64);
        }
        uno.run_for_ms(PAUSE_MS)?;
        at_pauses.push(Status::ask(&mut uno)?.position_ticks);
    }
    let status = Status::ask(&mut uno)?;
    if !uno.resets().is_empty() {
        return Err(PassError::Restarted(uno.resets().len()));
    }
    let relative = at_pauses.iter().map(|ticks| ticks - begin.position_ticks);
    played.extend_from_slice(uno.changes());
    Ok(Replay {
        counted: Counted {
            net_ticks: status.position_ticks - begin.position_ticks,
            lowest_ticks: relative.clone().min().unwrap_or(0),
            highest_ticks: relative.max().unwrap_or(0),
            lost_ticks: status.lost_ticks - begin.lost_ticks,
        },
        edges: edges.iter().filter(|change| change.pin != wiring::BEAM).count(),
        changes: played,
    })
}

fn split_first_levels(changes: &[PinChange]) -> (Vec<PinChange>, Vec<PinChange>) {
    let mut seen = Vec::new();
    changes.iter().partition(|change| {
        let first = !seen.contains(&change.pin);
        if first {
            seen.push(change.pin);
        }
        first
    })
}

/// Where to pause, as numbers of played edges: after the edges that bring a perfect counter to its lowest and highest
/// count, and after the last edge.
fn pauses(first_levels: &[PinChange], edges: &[PinChange]) -> Vec<usize> {
    let counts = counts(first_levels, edges);
    // Of equal counts, each takes the first.
    let lowest = (0..counts.len()).min_by_key(|&edge| counts[edge]).unwrap_or(0);
    let highest = (0..counts.len()).rev().max_by_key(|&edge| counts[edge]).unwrap_or(0);
    let mut pauses = vec![lowest, highest, edges.len()];
    pauses.sort_unstable();
    pauses.dedup();
    pauses
}

#[cfg(test)]
mod tests {
    use super::*;
    use field::machine::encoder_edge;

    /// The edges of these steps from AB = 00. A negative number of steps goes backwards.
    fn edges(steps: &[i64]) -> Vec<PinChange> {
        let mut count = 0;
        let directions = steps.iter().flat_map(|&steps| (0..steps.abs()).map(move |_| steps.signum()));
        directions
            .zip(0..)
            .map(|(direction, index)| {
                let before = count;
                count += direction;
                encoder_edge(index * 1000, before, count)
            })
            .collect()
    }

    #[test]
    fn the_replay_pauses_at_the_extremes_and_at_the_end() {
        assert_eq!(pauses(&[], &edges(&[5, -12, 9])), [5, 17, 26]);
        assert_eq!(pauses(&[], &edges(&[7])), [0, 7], "the extremes are the ends");
    }

    #[test]
    fn the_first_level_of_each_pin_is_no_edge() {
        let recorded = [
            PinChange { cycle: 0, pin: wiring::ENCODER_A, high: true },
            PinChange { cycle: 0, pin: wiring::ENCODER_B, high: false },
            PinChange { cycle: 9, pin: wiring::ENCODER_B, high: true },
        ];
        let (first_levels, edges) = split_first_levels(&recorded);
        assert_eq!(first_levels, recorded[..2]);
        assert_eq!(edges, recorded[2..]);
    }
}
