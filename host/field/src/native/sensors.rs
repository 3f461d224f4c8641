//! The sensors of a native run: what encoder and beams tell in each turn.

use crate::machine::{Machine, PULSE_TICKS, time_at_s};
use crate::motion::{Motion, marks};
use crate::pass::Pass;
use crate::wiring;
use rig::Beams;

/// The readings of the sensors, turn by turn: the encoder's count, and the beams' edges since the turn before.
///
/// They do not depend on the firmware: each controller gets the same ones for the same row, machine and motion.
pub struct Sensors {
    turn_s: f64,
    /// The encoder's count in each turn.
    counts: Vec<i32>,
    edges: Vec<Seen>,
}

/// The readings of a turn.
pub struct Turn<'a> {
    /// Its time.
    pub time_s: f64,
    /// The encoder's count.
    pub position: i64,
    /// The beams' edges since the turn before, in their order.
    pub edges: &'a [Seen],
}

/// An edge of a beam.
#[derive(Clone, Copy, Debug)]
pub struct Seen {
    /// Its time.
    time_s: f64,
    /// The encoder's count at that time.
    pub position: i64,
    /// The beams that are broken after it.
    pub beams: Beams,
}

impl Sensors {
    /// The readings of a pass, for a loop with turns of `turn_s`. The motion begins at time 0.
    pub fn new(pass: &Pass, turn_s: f64) -> Self {
        let Pass { machine, motion, row, .. } = pass;
        let mut edges = machine.beam_changes(row, motion, 0);
        edges.sort_by_key(|edge| edge.cycle);
        let mut beams = beams_before(pass);
        let edges = edges.into_iter().map(|edge| {
            let broken = if edge.pin == wiring::BEAM { &mut beams.broken } else { &mut beams.second_broken };
            *broken = !edge.high;
            Seen { time_s: time_at_s(0, edge.cycle), position: 0, beams }
        });
        let mut edges: Vec<Seen> = edges.collect();
        let mut to_come = edges.iter_mut().peekable();
        let (mut wheel_mm, mut encoder) = (motion.wheel_course(), Encoder::of(machine, motion));
        let counts = (0..=turns(pass, turn_s)).map(|turn| {
            let time_s = f64::from(turn) * turn_s;
            while let Some(edge) = to_come.next_if(|edge| edge.time_s <= time_s) {
                edge.position = encoder.count(encoder.clean_ticks(motion.wheel_mm(edge.time_s)));
            }
            encoder.count(encoder.clean_ticks(wheel_mm(time_s))) as i32
        });
        let counts = counts.collect();
        Self { turn_s, counts, edges }
    }

    /// The turns, from the first to some after the end of the motion.
    #[inline]
    pub fn turns(&self) -> impl Iterator<Item = Turn<'_>> {
        let mut to_come = &self.edges[..];
        self.counts.iter().zip(0..).map(move |(&position, turn)| {
            let time_s = f64::from(turn) * self.turn_s;
            let mut edges = &to_come[..0];
            // Most turns have no edge.
            if to_come.first().is_some_and(|edge| edge.time_s <= time_s) {
                (edges, to_come) = to_come.split_at(to_come.partition_point(|edge| edge.time_s <= time_s));
            }
            Turn { time_s, position: position.into(), edges }
        })
    }
}

/// The encoder's count, as the wheel turns: that of [`Machine`]'s edges, without an edge for each count, for speed.
#[derive(Clone, Copy)]
struct Encoder<'a> {
    machine: &'a Machine,
    start_mm: f64,
    tick_mm: f64,
    /// The present pulse of a clean encoder, whether dirt hides it, and the counts hidden before it.
    pulse: i64,
    is_hidden: bool,
    hidden_ticks: i64,
}

impl<'a> Encoder<'a> {
    /// The encoder of a machine at the beginning of its motion.
    fn of(machine: &'a Machine, motion: &Motion) -> Self {
        Self {
            machine,
            start_mm: motion.start_mm(),
            tick_mm: machine.tick_mm(),
            pulse: 0,
            is_hidden: machine.dirt.hides(0),
            hidden_ticks: 0,
        }
    }

    /// The count of a clean encoder when the wheel's rim is at a position.
    #[inline]
    fn clean_ticks(&self, wheel_mm: f64) -> i64 {
        marks(wheel_mm - self.start_mm, self.tick_mm)
    }

    /// The count when a clean encoder has `ticks`. The time grows with the distance from the last call.
    #[inline(always)]
    fn count(&mut self, ticks: i64) -> i64 {
        let pulse = self.machine.pulse(ticks);
        if pulse != self.pulse {
            self.roll_to(pulse);
        }
        let in_pulse = if self.is_hidden { self.machine.hidden_in_pulse(ticks) } else { 0 };
        ticks - self.hidden_ticks - in_pulse
    }

    /// Rolls to a pulse and counts the hidden ticks. Rolling back restores them.
    #[inline(always)]
    fn roll_to(&mut self, pulse: i64) {
        let step = (pulse - self.pulse).signum();
        while self.pulse != pulse {
            // The whole pulse was passed, forward or back.
            self.hidden_ticks += if self.is_hidden && step > 0 { PULSE_TICKS } else { 0 };
            self.pulse += step;
            self.is_hidden = self.machine.dirt.hides(self.pulse);
            self.hidden_ticks -= if self.is_hidden && step < 0 { PULSE_TICKS } else { 0 };
        }
    }
}

/// The beams' levels before the motion begins.
pub fn beams_before(pass: &Pass) -> Beams {
    let Pass { machine, motion, row, .. } = pass;
    let before = machine.beams_before(row, motion);
    let is_broken = |pin| before.iter().any(|beam| beam.pin == pin && !beam.high);
    Beams { broken: is_broken(wiring::BEAM), second_broken: is_broken(wiring::SECOND_BEAM) }
}

/// The number of the last turn of a loop in a pass.
pub(crate) fn turns(pass: &Pass, turn_s: f64) -> u32 {
    (pass.motion.duration_s() / turn_s).ceil() as u32
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::machine::{Dirt, tests::count_at};
    use crate::native::TURN_S;
    use crate::planting::Planting;
    use crate::verdict::ZoneSettings;
    use rand::{RngExt, SeedableRng};
    use rand_chacha::ChaCha8Rng;

    #[test]
    fn counts_computed_together_equal_those_of_each_turn_and_edge() {
        for seed in 0..8 {
            let mut rng = ChaCha8Rng::seed_from_u64(seed);
            let row =
                Planting { plants: 6, weeds: 4, ragged: true, ..Planting::default() }.grow_with_room(seed).unwrap();
            let dirt = Dirt { share: rng.random_range(0.0..0.1), seed };
            let machine = Machine { second_beam_mm: 150.0, dirt, ..Machine::default() };
            let speed_mm_s = rng.random_range(300.0..900.0);
            // It also rolls back behind its start, to negative counts.
            let motion = Motion::starting_at(0.0)
                .change_speed(speed_mm_s, 900.0)
                .stop_at(1000.0, 900.0)
                .go_on_for(0.3)
                .change_speed(-speed_mm_s, 900.0)
                .stop_at(-200.0, 900.0)
                .change_speed(speed_mm_s, 900.0)
                .roll_to(3500.0)
                .with_slip(|| rng.random_range(-0.05..0.1));
            let pass = Pass { motion, ..Pass::at_speed(row, machine, ZoneSettings::default(), speed_mm_s) };
            let mut told = 0;
            for Turn { time_s, position, edges } in Sensors::new(&pass, TURN_S).turns() {
                assert_eq!(position, count_at(&pass.machine, &pass.motion, time_s), "seed {seed} at {time_s} s");
                for edge in edges {
                    assert!(time_s - TURN_S < edge.time_s && edge.time_s <= time_s, "seed {seed} at {time_s} s");
                    let count = count_at(&pass.machine, &pass.motion, edge.time_s);
                    assert_eq!(edge.position, count, "seed {seed} at {} s", edge.time_s);
                }
                told += edges.len();
            }
            let all = pass.machine.pin_changes(&pass.row, &pass.motion, 0);
            let of_beams = all.iter().filter(|change| [wiring::BEAM, wiring::SECOND_BEAM].contains(&change.pin));
            assert!(told > 40, "{told}");
            assert_eq!(told, of_beams.count(), "seed {seed}");
        }
    }
}
