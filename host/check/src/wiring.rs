//! The wires: the tester toggles each line, and the weeder's console shows whether it noticed, and as which input.

use crate::error::CheckError;
use crate::plan::Plan;
use crate::servo;
use crate::tester::Tester;
use link::{Link, LinkError, Mode, Status};
use std::ops::{Deref, DerefMut};
use tester_core::message::{Command, Record};
use tester_core::pins::{AT_REST, Line};
use tester_core::player::Action;

/// Time for a switch to stop bouncing and for the LED and the curves to follow, in ms.
const SETTLE_MS: u32 = 150;

/// Time in which a stuck tool raises its alarm: the longest lead, 0.1 s, and as much again, in ms.
const STUCK_MS: u32 = 800;

/// Width of the pulse with which the tester checks its own capture, in cycles.
const OWN_PULSE: u16 = 16_000;

/// Greatest positive error of the tester's measurement of its own pulse, in cycles: its loop reads the clock every few
/// microseconds.
const OWN_PULSE_ERROR: u32 = 800;

/// The weeder's console.
pub struct Weeder {
    link: Link,
    open: Box<dyn FnMut() -> Result<Link, LinkError>>,
}

impl Deref for Weeder {
    type Target = Link;

    fn deref(&self) -> &Link {
        &self.link
    }
}

impl DerefMut for Weeder {
    fn deref_mut(&mut self) -> &mut Link {
        &mut self.link
    }
}

impl Weeder {
    /// The weeder at the port that `open` opens. This resets the board.
    ///
    /// # Errors
    /// If the port cannot be opened, or no weeder answers.
    pub fn over(mut open: impl FnMut() -> Result<Link, LinkError> + 'static) -> Result<Self, CheckError> {
        Ok(Self { link: open()?, open: Box::new(open) })
    }

    /// Closes the port and opens it again, which resets the board through the modem line DTR.
    ///
    /// # Errors
    /// As [`Weeder::over`].
    pub fn open_again(&mut self) -> Result<(), CheckError> {
        // A port that is open is locked.
        self.link.close();
        self.link = (self.open)()?;
        Ok(())
    }

    /// The status.
    ///
    /// # Errors
    /// If it does not answer.
    pub fn status(&mut self) -> Result<Status, CheckError> {
        let lines = self.ask("status")?;
        lines.iter().find_map(|line| Status::parse(line)).ok_or(CheckError::Answer("status"))
    }

    /// Takes it to hold, clears its alarm, and restores factory settings without saving them.
    ///
    /// # Errors
    /// If it refuses.
    pub fn to_hold(&mut self) -> Result<(), CheckError> {
        self.ask("plot off")?;
        self.ask("events off")?;
        self.try_to("hold")?;
        self.try_to("clear")?;
        self.ask("defaults")?;
        Ok(())
    }

    /// Types a command that may be refused.
    fn try_to(&mut self, command: &str) -> Result<(), CheckError> {
        match self.ask(command) {
            Ok(_) | Err(LinkError::Refused { .. }) => Ok(()),
            Err(error) => Err(error.into()),
        }
    }

    /// Drops the lines that the machine has sent without a question.
    ///
    /// # Errors
    /// If the port is gone.
    pub fn drain(&mut self) -> Result<(), CheckError> {
        while self.next_line()?.is_some() {}
        Ok(())
    }

    /// Whether the beam is broken, by the curves.
    fn beam_is_broken(&mut self) -> Result<Option<bool>, CheckError> {
        self.ask("plot on")?;
        let mut broken = None;
        for _ in 0..12 {
            let Some(line) = self.next_line()? else { continue };
            let point = line.split(',').find_map(|point| point.strip_prefix("beam_broken:")?.parse::<u8>().ok());
            broken = point.map(|level| level != 0).or(broken);
        }
        self.ask("plot off")?;
        self.drain()?;
        Ok(broken)
    }
}

/// Pulls the reset for a moment. Returns whether the weeder starts then.
///
/// # Errors
/// If a port is gone.
pub fn reset(weeder: &mut Weeder, tester: &mut Tester) -> Result<bool, CheckError> {
    weeder.drain()?;
    tester.command(&Command::Reset { pulled: true })?;
    tester.record_for_ms(20)?;
    tester.command(&Command::Reset { pulled: false })?;
    Ok(weeder.greeting()?)
}

/// The errors of the wires, in sentences; empty if all are right. Afterwards the weeder is in hold.
///
/// # Errors
/// If one of the boards does not answer.
pub fn look(weeder: &mut Weeder, tester: &mut Tester) -> Result<Vec<String>, CheckError> {
    let mut wrong = Vec::new();
    if !reset(weeder, tester)? {
        wrong.push(
            "reset: the weeder does not start when the tester pulls its reset: check the wire from D7 to RESET"
                .to_owned(),
        );
    }
    weeder.to_hold()?;
    wrong.extend(capture(tester)?);
    wrong.extend(encoder(weeder, tester)?);
    wrong.extend(switches_and_beams(weeder, tester)?);
    wrong.extend(second_beam(weeder, tester)?);
    let records = tester.record_for_ms(1500)?;
    if servo::pulses(&records, 0).len() < 10 {
        wrong.push("servo: no pulses come: check the wire from D9 of the weeder to D8 of the tester".to_owned());
    }
    if !records.iter().any(|record| matches!(record, Record::Led { .. })) {
        wrong.push(
            "LED: it does not flash in hold: check the wire from D13 of the weeder to D6 of the tester".to_owned(),
        );
    }
    weeder.to_hold()?;
    Ok(wrong)
}

/// The tester measures its own pulse, while the weeder is in reset and drives nothing.
fn capture(tester: &mut Tester) -> Result<Option<String>, CheckError> {
    tester.command(&Command::Reset { pulled: true })?;
    tester.record_for_ms(40)?;
    tester.command(&Command::CheckCapture { width: OWN_PULSE })?;
    let records = tester.record_for_ms(20)?;
    tester.command(&Command::Reset { pulled: false })?;
    let own = records.iter().find_map(|record| match record {
        Record::Pulse { width, .. } => Some(*width),
        _ => None,
    });
    let right = u32::from(OWN_PULSE)..=u32::from(OWN_PULSE) + OWN_PULSE_ERROR;
    Ok(match own {
        Some(width) if right.contains(&width) => None,
        Some(width) => Some(format!(
            "tester: it measures {width} cycles for its own pulse of {OWN_PULSE}: check the wire of the reset, which keeps D9 free meanwhile"
        )),
        None => Some(
            "tester: it does not measure its own pulse at D8: nothing may hold D8 low while the weeder is in reset"
                .to_owned(),
        ),
    })
}

/// A step of each channel, four times, should count four forward.
fn encoder(weeder: &mut Weeder, tester: &mut Tester) -> Result<Vec<String>, CheckError> {
    // The capture's check has left the weeder in reset.
    weeder.greeting()?;
    weeder.to_hold()?;
    let (a, b) = (Line::EncoderA.bit(), Line::EncoderB.bit());
    tester.set(a | b, 0)?;
    let mut last = weeder.status()?.position;
    let mut steps = Vec::new();
    for (line, level) in [(a, a), (b, b), (a, 0), (b, 0)] {
        tester.set(line, level)?;
        let position = weeder.status()?.position;
        steps.push(position - last);
        last = position;
    }
    let counts = |of: [usize; 2]| of.iter().any(|&step| steps[step] != 0);
    Ok(match steps.as_slice() {
        [1, 1, 1, 1] => vec![],
        [-1, -1, -1, -1] => vec!["encoder: it counts backward: wires A0 to D2 and A1 to D3 are swapped".to_owned()],
        _ => {
            let mut wrong = vec![];
            if !counts([0, 2]) {
                wrong.push("encoder A: the weeder does not count its steps: check the wire from A0 to D2".to_owned());
            }
            if !counts([1, 3]) {
                wrong.push("encoder B: the weeder does not count its steps: check the wire from A1 to D3".to_owned());
            }
            if wrong.is_empty() {
                wrong.push(format!("encoder: four steps count as {steps:?}: check the wires at D2 and D3"));
            }
            wrong
        }
    })
}

/// The weeder's possible reactions to a line.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
enum Seen {
    Work,
    Beam,
    /// The end switch: closed.
    Out,
}

impl Seen {
    fn words(self) -> &'static str {
        match self {
            Self::Work => "the work switch (D4)",
            Self::Beam => "the beam (D8)",
            Self::Out => "the end switch (D5)",
        }
    }
}

fn switches_and_beams(weeder: &mut Weeder, tester: &mut Tester) -> Result<Vec<String>, CheckError> {
    let mut wrong = Vec::new();
    let expected = [
        (Line::WorkSwitch, "work switch", Some(Seen::Work), "A5 to D4"),
        (Line::Beam, "beam", Some(Seen::Beam), "A2 to D8"),
        (Line::EndSwitch, "end switch", Some(Seen::Out), "A4 to D5"),
        (Line::SecondBeam, "second beam", None, "A3 to D10"),
    ];
    // At rest no beam is broken, and no switch is closed.
    let at_rest = noticed(weeder, tester, 0)?;
    if at_rest.contains(&Seen::Beam) {
        wrong.push("beam: it is broken at rest: its line is inverted, or the wire from A2 to D8 is missing".to_owned());
    }
    if at_rest.contains(&Seen::Out) {
        wrong.push("end switch: it is closed at rest: check the wire from A4 to D5".to_owned());
    }
    for (line, name, seen, wire) in expected {
        let noticed = noticed(weeder, tester, line.bit())?;
        let is_new = |seen: &Seen| !at_rest.contains(seen);
        if let Some(seen) = seen
            && !noticed.contains(&seen)
            && is_new(&seen)
        {
            wrong.push(format!("{name}: the weeder does not notice it: check the wire from {wire}"));
        }
        for other in noticed.iter().filter(|&other| Some(*other) != seen && is_new(other)) {
            wrong.push(format!("{name}: the weeder takes it for {}: the wires are swapped", other.words()));
        }
    }
    Ok(wrong)
}

/// The weeder's reactions while these lines are low.
fn noticed(weeder: &mut Weeder, tester: &mut Tester, low: u8) -> Result<Vec<Seen>, CheckError> {
    let mut seen = Vec::new();
    weeder.to_hold()?;
    tester.set(low, 0)?;
    tester.record_for_ms(SETTLE_MS)?;
    if weeder.status()?.mode == Mode::Work {
        seen.push(Seen::Work);
    }
    if weeder.beam_is_broken()? == Some(true) {
        seen.push(Seen::Beam);
    }
    weeder.try_to("hold")?;
    weeder.ask("set end_switch on")?;
    tester.record_for_ms(STUCK_MS)?;
    // In hold the tool is out. An open end switch contradicts that, which is an alarm.
    if weeder.status()?.mode != Mode::Alarm {
        seen.push(Seen::Out);
    }
    tester.set(low, AT_REST)?;
    tester.record_for_ms(SETTLE_MS)?;
    weeder.to_hold()?;
    Ok(seen)
}

/// Plants pass both beams in hold, and the weeder must measure the slip between them. Returns the error, if it does
/// not.
fn second_beam(weeder: &mut Weeder, tester: &mut Tester) -> Result<Option<String>, CheckError> {
    weeder.to_hold()?;
    weeder.ask(&format!("set second_beam_mm {SECOND_BEAM_MM}"))?;
    let mut plan = Plan::new();
    let mut play = |counts, line: Line, high: bool| {
        plan.roll(counts, PLANT_COUNTS_PER_S);
        plan.at(plan.end(), Action::level(line, high));
    };
    for _ in 0..PLANTS {
        play(500, Line::Beam, false);
        play(150, Line::Beam, true);
        play(SECOND_BEAM_COUNTS - 150, Line::SecondBeam, false);
        play(150, Line::SecondBeam, true);
    }
    plan.roll(300, PLANT_COUNTS_PER_S);
    weeder.ask("events on")?;
    let mut is_measured = false;
    tester.play(&plan.finish(), || {
        while let Some(line) = weeder.next_line()? {
            is_measured |= line.starts_with("slip ");
        }
        Ok(())
    })?;
    weeder.to_hold()?;
    Ok((!is_measured).then(|| {
        "second beam: the weeder measures no slip between the beams: check the wire from A3 to D10".to_owned()
    }))
}

/// Distance of the second beam behind the first, in mm, and in counts of the factory settings' wheel.
const SECOND_BEAM_MM: u16 = 100;
const SECOND_BEAM_COUNTS: i32 = 191;

/// Plants that pass both beams, and how fast.
const PLANTS: usize = 4;
const PLANT_COUNTS_PER_S: f64 = 1300.0;
