//! Shared code of the tests: a started Uno, an operator at its console, and a run along a row.
//!
//! A [`Run`] is a pass that a test can inspect and operate meanwhile. This file makes no verdicts: the tests do.

use field::machine::{Machine, cycle_at, encoder_edge};
use field::motion::Motion;
use field::pass::{Pass, Start};
use field::row::{Canopy, Row};
use field::servo::Command;
use field::verdict::{Judgement, PlantOutcome, Verdict, ZoneSettings, judge};
use field::wiring;
use std::ops::Range;
use std::path::PathBuf;
use uno::PinChange;
use uno::Uno;
use uno_run::Outcome;
use uno_run::console::{self, ConsoleError};
use uno_run::firmware;

/// Greatest distance between a swing's command at the pin and its ideal position.
pub const SWING_TOLERANCE_TICKS: f64 = 12.0;

/// The firmware.
pub fn elf() -> PathBuf {
    firmware::build().expect("the firmware builds")
}

/// An Uno after its start, with inputs at rest, the switch off and the beam clear. The alarm for missing saved settings
/// is cleared.
pub fn started() -> Uno {
    uno_run::boot(&elf(), &[]).expect("the firmware wakes up")
}

/// Types a command and returns the lines of its answer, without the `ok`.
#[track_caller]
pub fn ask(uno: &mut Uno, command: &str) -> Vec<String> {
    console::ask(uno, command).expect("the firmware knows the command")
}

/// Types a command that the firmware must refuse. Returns the error.
#[track_caller]
pub fn refusal(uno: &mut Uno, command: &str) -> String {
    match console::ask(uno, command) {
        Err(ConsoleError::Refused(refused)) => refused.answer,
        other => panic!("`{command}` was not refused: {other:?}"),
    }
}

/// The status, with its lines joined.
#[track_caller]
pub fn status(uno: &mut Uno) -> String {
    let lines = ask(uno, "status");
    // The end of an event's line may come first.
    let start = lines.iter().position(|line| line.starts_with("state=")).expect("a status line");
    lines[start..].join(" ")
}

/// The word behind `key=` in a line.
#[track_caller]
pub fn value<'a>(line: &'a str, key: &str) -> &'a str {
    line.split_whitespace()
        .find_map(|word| word.strip_prefix(key)?.strip_prefix('='))
        .unwrap_or_else(|| panic!("{line:?} has no {key}="))
}

/// The alarm that a line names, as `3-1 too_fast`.
pub fn named(line: &str) -> String {
    format!("{} {}", value(line, "code"), value(line, "name"))
}

/// The number behind `key=` in a line.
#[track_caller]
pub fn number(line: &str, key: &str) -> i64 {
    value(line, key).parse().unwrap_or_else(|error| panic!("{key} in {line:?}: {error}"))
}

/// Runs for a time in milliseconds.
#[track_caller]
pub fn run_for_ms(uno: &mut Uno, time_ms: u64) {
    uno.run_for_ms(time_ms).expect("the firmware runs");
}

/// Switches the work switch and waits until it has stopped bouncing.
#[track_caller]
pub fn throw_switch(uno: &mut Uno, work: bool) {
    uno.set(wiring::WORK_SWITCH, !work);
    run_for_ms(uno, 50);
}

/// Whether the servo's last pulse asks for the tool to be out.
pub fn is_out_at_the_pin(uno: &Uno) -> bool {
    let pulse = *uno.pulses(wiring::SERVO).last().expect("the servo has pulses");
    (pulse.width_us() - 2000.0).abs() < 1.0
}

/// The machine rolls at a steady speed from 0 to `end_mm`. It accelerates and brakes within a few centimetres.
pub fn steady(speed_mm_s: f64, end_mm: f64) -> Motion {
    Motion::steady(0.0, 3000.0, speed_mm_s, end_mm).change_speed(0.0, 3000.0)
}

/// A row that begins beyond the end of every motion.
pub fn bare_ground() -> Row {
    Row::new(vec![Canopy::plant(100_000.0, 100.0)]).expect("a plant is a row")
}

/// A pass of the usual machine and timing, started by `start`.
pub fn pass(row: Row, motion: Motion) -> Pass {
    Pass {
        row,
        machine: Machine::default(),
        motion,
        timing: ZoneSettings::default(),
        start: Start::Command,
        settings: Vec::new(),
        examples: Vec::new(),
    }
}

/// Runs a pass to its end.
#[track_caller]
pub fn outcome(pass: &Pass) -> Outcome {
    uno_run::run(pass, &elf(), |_| {}).expect("the firmware runs")
}

/// Asserts that every plant was kept, with the margin less its tolerance on both sides.
#[track_caller]
pub fn assert_all_kept(judgement: &Judgement) {
    let harmed: Vec<&PlantOutcome> = judgement.plants.iter().filter(|plant| plant.verdict != Verdict::Kept).collect();
    assert!(harmed.is_empty(), "{harmed:#?}");
}

/// Asserts that each plant has its own swing out and swing in, and that there are no other swings.
#[track_caller]
pub fn assert_a_swing_each(judgement: &Judgement, commands: &[Command]) {
    for plant in &judgement.plants {
        assert_eq!(plant.swings, 1, "{plant:?}");
        assert!(plant.out_error_ticks.is_some() && plant.in_error_ticks.is_some(), "{plant:?}");
    }
    assert_eq!(judgement.idle_swings, 0);
    // Two for each plant. Before them are the tool out at power-up, and its first swing in.
    assert_eq!(commands.len(), 2 + 2 * judgement.plants.len(), "{commands:?}");
}

/// Asserts that each command at the pin was close to its ideal position.
#[track_caller]
pub fn assert_commands_in_place(judgement: &Judgement) {
    for plant in &judgement.plants {
        for error in [plant.out_error_ticks, plant.in_error_ticks].into_iter().flatten() {
            assert!(error.abs() <= SWING_TOLERANCE_TICKS, "{plant:?}");
        }
    }
}

/// Asserts that the count is exact.
#[track_caller]
pub fn assert_position_exact(outcome: &Outcome) {
    assert_eq!(outcome.status.position_ticks, outcome.true_ticks);
    assert_eq!(outcome.status.lost_ticks, 0);
}

/// Types bytes. Returns every line that comes in the time for answering all of them.
#[track_caller]
pub fn exchange(uno: &mut Uno, bytes: &[u8]) -> Vec<String> {
    uno.received();
    uno.send(bytes);
    // A byte takes 0.087 ms, and the slowest command, `save`, less than 200 ms.
    run_for_ms(uno, bytes.len() as u64 / 10 + 300);
    uno.received().lines().map(str::to_owned).collect()
}

/// A machine that rolls along a row, with events on.
pub struct Run {
    /// The Uno.
    pub uno: Uno,
    pass: Pass,
    start_cycle: u64,
    heard: String,
}

impl Run {
    /// Starts the firmware, types these commands and those of the pass's start, and sets the machine in motion.
    #[track_caller]
    pub fn begin(pass: Pass, commands: &[&str]) -> Self {
        Self::begin_altered(pass, commands, |_, changes| changes)
    }

    /// As [`Run::begin`], with changed levels on the pins: `alter` gets the cycle at which the motion begins, and the
    /// changes of a machine without faults.
    #[track_caller]
    pub fn begin_altered(
        pass: Pass,
        commands: &[&str],
        alter: impl FnOnce(u64, Vec<PinChange>) -> Vec<PinChange>,
    ) -> Self {
        let inputs = pass.machine.beams_before(&pass.row, &pass.motion);
        Self::set_off(uno_run::boot(&elf(), &inputs).expect("it wakes up"), pass, commands, alter)
    }

    /// As [`Run::begin_altered`], with a firmware that has woken up already.
    #[track_caller]
    pub fn set_off(
        mut uno: Uno,
        pass: Pass,
        commands: &[&str],
        alter: impl FnOnce(u64, Vec<PinChange>) -> Vec<PinChange>,
    ) -> Self {
        uno_run::set_up(&pass, &mut uno).expect("the firmware takes the pass's settings");
        ask(&mut uno, "events on");
        for command in commands {
            ask(&mut uno, command);
        }
        match pass.start {
            Start::Command => uno.send(b"start\n"),
            Start::Now => uno.send(b"start now\n"),
            Start::Switch => uno.set(wiring::WORK_SWITCH, false),
        }
        run_for_ms(&mut uno, 100);
        uno.received();
        let start_cycle = uno.cycle();
        uno.drive(alter(start_cycle, pass.machine.pin_changes(&pass.row, &pass.motion, start_cycle)));
        Self { uno, pass, start_cycle, heard: String::new() }
    }

    /// Rolls on until the machine first reaches a position.
    #[track_caller]
    pub fn roll_to(&mut self, place_mm: f64) {
        let passing = self.pass.motion.passings(place_mm).next().expect("the machine comes to the place");
        self.uno.run_until(cycle_at(self.start_cycle, passing.time_s)).expect("the firmware runs");
    }

    /// Types a line at an interval in milliseconds, until the motion's end.
    #[track_caller]
    pub fn roll_on_asking(&mut self, line: &str, every_ms: u64) {
        let end = self.end_cycle();
        while self.uno.cycle() < end {
            self.uno.send(format!("{line}\n").as_bytes());
            run_for_ms(&mut self.uno, every_ms);
        }
    }

    /// Rolls on to the motion's end, and waits for the last of its events.
    #[track_caller]
    pub fn roll_to_the_end(&mut self) {
        self.uno.run_until(self.end_cycle()).expect("the firmware runs");
        run_for_ms(&mut self.uno, 50);
        assert_eq!(self.uno.resets(), []);
    }

    fn end_cycle(&self) -> u64 {
        cycle_at(self.start_cycle, self.pass.motion.duration_s())
    }

    /// The cycles of the whole motion.
    pub fn cycles(&self) -> Range<u64> {
        self.start_cycle..self.end_cycle()
    }

    /// The machine's position at a cycle.
    pub fn place_mm(&self, cycle: u64) -> f64 {
        self.pass.motion.position_mm(field::machine::time_at_s(self.start_cycle, cycle))
    }

    /// Every line that the firmware has sent so far.
    pub fn lines(&mut self) -> Vec<String> {
        self.heard += &self.uno.received();
        self.heard.lines().map(str::to_owned).collect()
    }

    /// The event lines of this name.
    pub fn events(&mut self, name: &str) -> Vec<String> {
        let mut lines = self.lines();
        lines.retain(|line| line.split_whitespace().next() == Some(name));
        lines
    }

    /// The result for the row.
    pub fn judgement(&self) -> Judgement {
        let Pass { row, machine, motion, timing, .. } = &self.pass;
        judge(row, machine, motion, *timing, &self.uno.pulses(wiring::SERVO), self.start_cycle)
    }

    /// The commands at the servo's pin.
    pub fn commands(&self) -> Vec<Command> {
        self.pass.machine.servo.commands(&self.uno.pulses(wiring::SERVO))
    }

    /// The first command after a cycle.
    #[track_caller]
    pub fn first_command_after(&self, cycle: u64) -> Command {
        let mut commands = self.commands().into_iter();
        commands.find(|command| command.rise_cycle > cycle).expect("there is a command")
    }
}

/// Steps of an encoder, +1 or -1, as levels on its pins from AB = 00, each at its cycle.
pub fn encoder_steps(steps: impl IntoIterator<Item = (u64, i32)>) -> Vec<PinChange> {
    let mut ticks = 0;
    steps
        .into_iter()
        .map(|(cycle, step)| {
            let before = ticks;
            ticks += i64::from(step);
            encoder_edge(cycle, before, ticks)
        })
        .collect()
}
