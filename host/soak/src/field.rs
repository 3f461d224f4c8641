//! Field work: a model-based run of random steps, from row to row.
//!
//! [`Drive`] executes each step and checks it. This file draws the machines, the rows, the steps and the faults, and
//! counts. Each row has another machine, with a second beam or without, and a wheel whose slip changes. Now and then one
//! of two beams misses a plant. The tool must be clear of every plant that a beam has seen.
//!
//! The decisions' clock and count continue over resets. They begin shortly before they overflow, so that each hour passes
//! both overflows.

use crate::board::Board;
use crate::tally::{Plan, SoakError, Tally, count, total};
use control::{measure::reset::Cause, operate::state::State, settings::Setting};
use field::machine;
use field::motion::mm_s;
use field::planting::Planting;
use field::row::Row;
use field::wheel::most_slip;
use link::settings;
use model_test::Failure;
use model_test::decisions::{CHIP_SIZE, Decisions};
use model_test::drive::Drive;
use model_test::machine::{Checked, Machine, World};
use model_test::run::{Beginning, Classification, Encoder, Run, Sight, Step, TICKS_A_MM};
use model_test::stand::{Geometry, Score};
use rand::{RngExt, SeedableRng};
use rand_chacha::ChaCha8Rng;
use std::path::Path;

/// The clock begins a minute before its overflow, and the count 200 m before its own.
const FIRST_STEPS: u32 = u32::MAX - 15_000_000;
const FIRST_COUNT: i32 = i32::MAX - 382_000;

/// The rows: plants half a metre apart, as for the built-in examples.
const PLANTING: Planting = Planting {
    plants: 40,
    spacing_mm: 500.0,
    spacing_scatter_mm: 40.0,
    canopy_mm: 150.0,
    canopy_scatter_mm: 25.0,
    weeds: 10,
    ragged: false,
};

/// A row in which plants are too near for two beams.
const DENSE: Planting = Planting {
    spacing_mm: 260.0,
    spacing_scatter_mm: 20.0,
    canopy_mm: 120.0,
    canopy_scatter_mm: 15.0,
    weeds: 0,
    ..PLANTING
};

/// Ground between the second beam and the tool: the tool swings out over it, at 3 km/h and with the margin.
const SECOND_BEAM_TO_TOOL_MM: u16 = 300;

/// Either of two beams misses one canopy in this many.
const MISSED_ONCE_IN: usize = 16;

/// Ground before and behind each row.
const HEADLAND_MM: f64 = 1000.0;

/// Turns of a save. The power fails at any moment of it.
const SAVE_TURNS: u32 = 160;

/// A machine and its operator in the field.
struct Field<M> {
    rng: ChaCha8Rng,
    drive: Drive<M>,
    /// The settings that the operator types for the present machine.
    typed: Vec<(Setting, u16)>,
    /// The position at which the present row ends.
    row_end: i64,
    /// Faults in a second, on average, and the time of the next.
    faults_a_second: f64,
    next_fault_s: f64,
    last_fault: (&'static str, f64),
    tally: Tally,
}

/// What a soak runs.
#[derive(Clone, Copy, Debug)]
pub enum Subject<'a> {
    /// The decisions. A part is an hour.
    Decisions,
    /// The firmware at this path. A part is a minute.
    Firmware(&'a Path),
}

/// Runs this many parts, the last of them shortened if they are no whole number. `progress` gets the share done, from 0
/// to 1.
///
/// # Errors
/// If a row does not grow, or a new machine does not start.
pub fn run(plan: Plan, subject: Subject, parts: f64, mut progress: impl FnMut(f64)) -> Result<Tally, SoakError> {
    total((0..parts.ceil() as u64).map(|number| {
        let begun = number as f64;
        let share = (parts - begun).min(1.0);
        part(plan, subject, (number, share), |done| progress((begun + share * done) / parts))
    }))
}

/// Runs the part with a number from 0, or a share of it. `progress` gets the share of that which is done.
///
/// # Errors
/// As [`run`].
pub fn part(
    plan: Plan,
    subject: Subject,
    (number, share): (u64, f64),
    progress: impl FnMut(f64),
) -> Result<Tally, SoakError> {
    match subject {
        Subject::Decisions => of_machine(plan, ("hour", number), 3600.0 * share, Decisions::boot, progress),
        Subject::Firmware(elf) => {
            let boot = |beginning: &Beginning, world: &World| Board::boot(elf, beginning, world);
            of_machine(plan, ("minute", number), 60.0 * share, boot, progress)
        }
    }
}

/// Runs a machine for a part of a soak, which has a name and a number from 0. `progress` gets the share done.
fn of_machine<M: Machine>(
    plan: Plan,
    (name, number): (&str, u64),
    seconds: f64,
    boot: impl FnOnce(&Beginning, &World) -> Result<M, Failure>,
    mut progress: impl FnMut(f64),
) -> Result<Tally, SoakError> {
    let mut rng = ChaCha8Rng::seed_from_u64(plan.seed);
    rng.set_stream(number);
    let field = Field::new(rng, plan.faults_an_hour, boot);
    let field = field.map_err(|failure| SoakError::Start(failure.to_string()))?;
    let mut tally = field.work_for(seconds, &mut progress)?;
    tally.violations = tally.violations.iter().map(|what| format!("{name} {}, {what}", number + 1)).collect();
    Ok(tally)
}

/// A run without steps, over a row as each of the machine's beams sees it. Now and then one of two beams misses a canopy.
fn run_over(row: &Row, machine: &machine::Machine, rng: &mut ChaCha8Rng) -> Run {
    let start_mm = row.span_mm().start - HEADLAND_MM;
    let mut run = standing();
    let mut end_mm = 0;
    for canopy in row.canopies() {
        let span = canopy.span_mm();
        let [from, to] = [span.start, span.end].map(|mm| (mm - start_mm).round() as u32);
        run.row.push((from - end_mm, to - from));
        end_mm = to;
        run.sights.push(match rng.random_range(0..MISSED_ONCE_IN) {
            0 if machine.has_second_beam() => Sight::Second,
            1 if machine.has_second_beam() => Sight::First,
            _ => Sight::Both,
        });
    }
    run.row.push(((HEADLAND_MM + machine.beam_to_tool_mm) as u32, 0));
    run
}

/// A run without a row or a step.
fn standing() -> Run {
    let beginning = Beginning {
        count: FIRST_COUNT,
        steps: FIRST_STEPS,
        turn_us: 1000,
        reads_first: false,
        mm_s2: 1000,
        classification: Classification::Examples,
    };
    Run { beginning, row: vec![(1000, 0)], sights: Vec::new(), steps: Vec::new() }
}

impl<M: Machine> Field<M> {
    fn new(
        rng: ChaCha8Rng,
        faults_an_hour: f64,
        boot: impl FnOnce(&Beginning, &World) -> Result<M, Failure>,
    ) -> Result<Self, Failure> {
        let mut field = Self {
            rng,
            drive: Drive::new(&standing(), boot)?,
            typed: Vec::new(),
            row_end: 0,
            faults_a_second: faults_an_hour / 3600.0,
            next_fault_s: 0.0,
            last_fault: ("nothing", 0.0),
            tally: Tally::default(),
        };
        field.draw_fault_time();
        // A new machine has an alarm about its settings until they are saved, which is no result of the soak.
        field.type_in(&["save"])?;
        field.tally = Tally::default();
        Ok(field)
    }

    /// Draws the time of the next fault.
    fn draw_fault_time(&mut self) {
        let share: f64 = self.rng.random();
        self.next_fault_s = self.drive.time_s() - (1.0 - share).ln() / self.faults_a_second;
    }

    /// Works row after row for this many seconds, or until a check fails.
    fn work_for(mut self, last_s: f64, progress: &mut impl FnMut(f64)) -> Result<Tally, SoakError> {
        while self.drive.time_s() < last_s && self.tally.violations.is_empty() {
            let (machine, stem_zone_mm) = self.draw_machine();
            let is_dense = machine.has_second_beam() && self.rng.random_bool(0.25);
            let row = if is_dense { DENSE } else { PLANTING }.grow(self.rng.random())?;
            self.work(&row, &machine, stem_zone_mm, last_s);
            progress((self.drive.time_s() / last_s).min(1.0));
        }
        Ok(self.tally)
    }

    /// Draws a machine, and its stem zone in millimetres. The operator types its settings for the next row.
    fn draw_machine(&mut self) -> (machine::Machine, u16) {
        let mut machine = machine::Machine::default();
        if self.rng.random() {
            let to_tool_mm = self.rng.random_range(470..=1000_u16);
            let apart_mm = self.rng.random_range(to_tool_mm * 7 / 20..=to_tool_mm - SECOND_BEAM_TO_TOOL_MM);
            (machine.beam_to_tool_mm, machine.second_beam_mm) = (to_tool_mm.into(), apart_mm.into());
        }
        let stem_zone_mm = if self.rng.random_bool(0.25) { 90 } else { 0 };
        self.typed = vec![
            // The stem zone needs it, with the nearest beam.
            (Setting::TopSpeedMmS, 1150),
            (Setting::BeamToToolMm, machine.beam_to_tool_mm as u16),
            (Setting::SecondBeamMm, machine.second_beam_mm as u16),
            (Setting::StemZoneMm, stem_zone_mm),
        ];
        (machine, stem_zone_mm)
    }

    /// Works a row from its headland to its end, or to the soak's end.
    fn work(&mut self, row: &Row, machine: &machine::Machine, stem_zone_mm: u16, last_s: f64) {
        let run = run_over(row, machine, &mut self.rng);
        let outcome = self.work_run(&run, machine, stem_zone_mm, last_s);
        let Score { metres, weeded_metres, plants, harmed, mistaken, blind } = self.drive.score();
        self.tally += Tally { rows: 1, metres, weeded_metres, plants, harmed, mistaken, blind, ..Tally::default() };
        self.tally.seconds = self.drive.time_s();
        if let Err(Failure::Fail(failure) | Failure::Reject(failure)) = outcome {
            let (fault, fault_s) = self.last_fault;
            let (row, state, time_s) = (self.tally.rows, self.drive.machine().state(), self.drive.time_s());
            self.tally.violations.push(format!(
                "at {time_s:.3} s: row {row}, in {state:?}, {:.3} s after {fault}: {failure}",
                time_s - fault_s
            ));
        }
    }

    fn work_run(&mut self, run: &Run, machine: &machine::Machine, stem_zone_mm: u16, last_s: f64) -> Checked {
        let ticks = |mm: f64| (mm * TICKS_A_MM) as i64;
        let us = |ms: f64| (ms * 1000.0) as u64;
        let geometry = Geometry {
            beam_to_tool: ticks(machine.beam_to_tool_mm),
            second_beam: ticks(machine.second_beam_mm),
            dead_us: us(machine.servo.dead_time_ms),
            swing_us: us(machine.servo.dead_time_ms + machine.servo.travel_ms),
        };
        self.drive.enter_row(run, geometry, ticks(stem_zone_mm.into()))?;
        self.set_up()?;
        self.row_end = run.period();
        while self.drive.position() < self.row_end && self.drive.time_s() < last_s {
            let most =
                most_slip(self.drive.machine().settings().get(Setting::MarginMm).into(), machine.beam_to_tool_mm);
            let permille = (1000.0 * self.rng.random_range(-most..=most)) as i32;
            self.execute(&Step::Slip { permille })?;
            let (mm_s, leg_s) = self.draw_leg();
            self.start_again()?;
            self.roll(mm_s, last_s.min(self.drive.time_s() + leg_s))?;
        }
        Ok(())
    }

    /// Draws a leg's speed in mm/s and its time in seconds: mostly a walk, now and then a stop or some distance back.
    fn draw_leg(&mut self) -> (i32, f64) {
        let rng = &mut self.rng;
        match rng.random_range(0..10) {
            0 => (0, rng.random_range(0.5..6.0)),
            1 if self.drive.position() > 5000 => (-mm_s(rng.random_range(0.5..1.5)) as i32, rng.random_range(0.3..1.5)),
            _ => (mm_s(rng.random_range(0.8..3.0)) as i32, rng.random_range(0.5..6.0)),
        }
    }

    /// Rolls at a speed until a time, or to the row's end, with the faults that are due meanwhile.
    fn roll(&mut self, mm_s: i32, until_s: f64) -> Checked {
        while self.drive.time_s() < until_s && self.drive.position() < self.row_end {
            let ms = ((until_s.min(self.next_fault_s) - self.drive.time_s()) * 1000.0).ceil();
            let rest_mm = (self.row_end - self.drive.position()) as f64 / TICKS_A_MM;
            let mm = (f64::from(mm_s) * ms / 1000.0).min(rest_mm) as i32 + mm_s.signum();
            self.execute(&if mm_s == 0 { Step::Stand { ms: ms as u32 } } else { Step::Roll { mm, mm_s } })?;
            if self.drive.time_s() >= self.next_fault_s {
                self.fail()?;
                self.draw_fault_time();
            }
        }
        Ok(())
    }

    /// Executes a step. Counts the events that the machine wrote.
    fn execute(&mut self, step: &Step) -> Checked {
        let outcome = self.drive.execute(step);
        for line in self.drive.take_events() {
            self.tally.hear(&line);
        }
        outcome
    }

    fn type_in(&mut self, lines: &[&str]) -> Checked {
        lines.iter().try_for_each(|&line| self.execute(&Step::Type(line.to_owned())))
    }

    /// Whether the firmware has the settings of the present machine.
    fn is_set_up(&self) -> bool {
        let settings = self.drive.machine().settings();
        self.typed.iter().all(|&(setting, value)| settings.get(setting) == value)
    }

    /// After a reset, the operator turns the events on. If the settings are those of another machine, or were lost, the
    /// operator stops to type and save them.
    fn set_up(&mut self) -> Checked {
        self.type_in(&["events on"])?;
        if self.is_set_up() {
            return Ok(());
        }
        self.execute(&Step::Tremble { times: 0 })?;
        self.type_in(&["clear", "set second_beam_mm 0"])?;
        for (setting, value) in self.typed.clone() {
            self.type_in(&[&format!("set {} {value}", settings::name(setting))])?;
        }
        self.type_in(&["save"])?;
        if self.is_set_up() { Ok(()) } else { Err(Failure::fail("the machine refuses its settings")) }
    }

    /// The operator clears a latched alarm, and starts.
    fn start_again(&mut self) -> Checked {
        if self.drive.machine().state() == State::Work {
            return Ok(());
        }
        self.type_in(&["clear", "start"])?;
        if self.drive.machine().state() == State::Hold {
            Err(Failure::fail("the machine does not start on command"))
        } else {
            Ok(())
        }
    }

    /// Injects a fault.
    fn fail(&mut self) -> Checked {
        let rng = &mut self.rng;
        let mut lines = Vec::new();
        let (fault, step) = match rng.random_range(0..9) {
            0 => {
                ("dust", Step::Dust { times: rng.random_range(1..40), on_second: self.typed[1].1 > 0 && rng.random() })
            }
            1 => {
                let encoders = [("dead_channel", Encoder::OneChannel), ("silent_encoder", Encoder::Silent)];
                let (fault, encoder) = encoders[rng.random_range(0..2)];
                (fault, Step::Silence { ms: rng.random_range(5..600), encoder })
            }
            2 => ("encoder_jumps", Step::Spike { ticks: 2, times: rng.random_range(1..60) }),
            3 => ("lost_edges", Step::LoseEdges { turns: rng.random_range(0..3) }),
            4 => ("low_stack", Step::LowerStack { turns: 1 }),
            5 => {
                let causes = [Cause::PowerOn, Cause::BrownOut, Cause::LoopStalled, Cause::Watchdog];
                // On the chip, the loop's monitor comes before the watchdog.
                let possible = if M::IS_OPEN { &causes[..] } else { &causes[..3] };
                ("reset", Step::Reset(possible[rng.random_range(0..possible.len())]))
            }
            6 => {
                let no_plant_m = rng.random_range(1..8);
                lines = vec!["hold".to_owned(), "clear".to_owned(), format!("set no_plant_m {no_plant_m}")];
                let (turns, byte) = (rng.random_range(0..SAVE_TURNS), rng.random());
                ("power_lost_in_a_save", Step::CutPower { line: "save", turns, byte })
            }
            7 => {
                let (address, byte) = (rng.random_range(0..CHIP_SIZE), rng.random());
                ("spoiled_eeprom", Step::Spoil { address, byte })
            }
            _ => {
                let mut noise: String = (0..rng.random_range(1..300))
                    .map(|_| if rng.random_range(0..4) == 0 { '\n' } else { char::from(rng.random::<u8>()) })
                    .collect();
                // The chip drops what comes while it answers, so on its line the noise is one line.
                if !M::IS_OPEN {
                    noise = noise.replace(['\n', '\r'], "#");
                }
                noise += "\nstatus\nget\ndump\nexamples";
                ("console_noise", Step::Type(noise))
            }
        };
        count(&mut self.tally.faults, fault);
        self.last_fault = (fault, self.drive.time_s());
        lines.into_iter().try_for_each(|line| self.execute(&Step::Type(line)))?;
        self.execute(&step)?;
        if matches!(step, Step::Reset(_) | Step::CutPower { .. } | Step::Spoil { .. }) { self.set_up() } else { Ok(()) }
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    fn field() -> Field<Decisions> {
        Field::new(ChaCha8Rng::seed_from_u64(1), 0.0, Decisions::boot).expect("a new machine starts")
    }

    /// Six minutes of work without faults by a machine with these leads.
    fn with_leads(lead_out_ms: u16, lead_in_ms: u16) -> Tally {
        let mut field = field();
        let lines = [&*format!("set lead_in_ms {lead_in_ms}"), &format!("set lead_out_ms {lead_out_ms}"), "save"];
        field.type_in(&lines).expect("in HOLD");
        field.work_for(360.0, &mut |_| {}).expect("rows grow")
    }

    #[test]
    fn a_tool_that_leaves_too_late_is_seen_to_harm_a_plant() {
        let tally = with_leads(0, 0);
        assert!(tally.harmed > 0 && tally.violations[0].contains("a plant was harmed"), "{tally}");
    }

    #[test]
    fn harm_is_found_if_the_firmware_ignores_the_second_beam() {
        let mut field = field();
        while field.tally.violations.is_empty() && field.tally.rows < 20 {
            let (machine, stem_zone_mm) = field.draw_machine();
            // The beam is there, but its wire is not.
            field.typed.retain(|(setting, _)| *setting != Setting::SecondBeamMm);
            field.typed.push((Setting::SecondBeamMm, 0));
            let row = PLANTING.grow(field.rng.random()).expect("rows grow");
            field.work(&row, &machine, stem_zone_mm, f64::INFINITY);
        }
        assert!(field.tally.violations.iter().any(|what| what.contains("a plant was harmed")), "{}", field.tally);
    }

    #[test]
    fn a_tool_with_the_right_leads_harms_no_plant_and_weeds() {
        let tally = with_leads(180, 40);
        assert!(tally.harmed == 0 && tally.blind == 0 && tally.violations.is_empty(), "{tally}");
        assert!(tally.plants > 200 && tally.weeded_metres > 0.3 * tally.metres, "{tally}");
    }
}
