//! The wires: the tester toggles each line, and the weeder's console shows whether it noticed, and as which input.

use crate::plan::Plan;
use crate::servo;
use crate::{Boards, CheckError};
use derive_more::{Deref, DerefMut};
use link::{Link, LinkError, Mode, Status};
use tester_core::message::{Command, Record};
use tester_core::pins::{AT_REST, Line, WIRES, Wire};
use tester_core::player::Action;

/// Time for a switch to stop bouncing and for the LED and the curves to follow, in ms.
const SETTLE_MS: u32 = 150;

/// Time in which a stuck tool raises its alarm: the longest lead, 0.1 s, and as much again, in ms.
const STUCK_MS: u32 = 800;

/// Width of the pulse with which the tester checks its own capture, in cycles.
const OWN_PULSE: u16 = 16_000;

/// Greatest excess of the tester's own pulse, in cycles: its loop reads the clock every few microseconds.
const OWN_PULSE_ERROR: u32 = 800;

/// The weeder's console. Its methods fail if the port is gone, or the weeder does not answer.
#[derive(Deref, DerefMut)]
pub struct Weeder {
    #[deref]
    #[deref_mut]
    link: Link,
    open: Box<dyn FnMut() -> Result<Link, LinkError>>,
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
    pub fn open_again(&mut self) -> Result<(), CheckError> {
        // A port that is open is locked.
        self.link.close();
        self.link = (self.open)()?;
        Ok(())
    }

    /// The status.
    pub fn status(&mut self) -> Result<Status, CheckError> {
        let lines = self.ask("status")?;
        lines.iter().find_map(|line| Status::parse(line)).ok_or(CheckError::Answer("status"))
    }

    /// Takes it to hold, clears its alarm, and restores factory settings without saving them.
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
    pub fn drain(&mut self) -> Result<(), CheckError> {
        while self.next_line()?.is_some() {}
        Ok(())
    }

    /// Whether the beam is broken, by the curves; false if they do not come.
    fn beam_is_broken(&mut self) -> Result<bool, CheckError> {
        self.ask("plot on")?;
        let mut is_broken = false;
        for _ in 0..12 {
            let Some(line) = self.next_line()? else { continue };
            let level = line.split(',').find_map(|point| point.strip_prefix("beam_broken:")?.parse::<u8>().ok());
            is_broken = level.map_or(is_broken, |level| level != 0);
        }
        self.ask("plot off")?;
        self.drain()?;
        Ok(is_broken)
    }
}

fn wire(line: Line) -> &'static Wire {
    // The first wires are in the order of the lines' bits.
    &WIRES[line.bit().trailing_zeros() as usize]
}

fn check_wire(line: Line) -> String {
    let Wire { tester, weeder, .. } = wire(line);
    format!("check the wire from {tester} to {weeder}")
}

/// Distance of the second beam behind the first, in mm, and in counts of the factory settings' wheel.
const SECOND_BEAM_MM: u16 = 100;
const SECOND_BEAM_COUNTS: i32 = 191;

/// Plants that pass both beams, and how fast.
const PLANTS: usize = 4;
const PLANT_COUNTS_PER_S: f64 = 1300.0;

impl Boards {
    /// The errors of the wires, in sentences; empty if all are right. Afterwards the weeder is in hold.
    pub fn wire_errors(&mut self) -> Result<Vec<String>, CheckError> {
        let mut wrong = Vec::new();
        if !self.reset()? {
            let words = "the weeder does not start when the tester pulls its reset";
            wrong.push(format!("reset: {words}: check the wire from D7 to RESET"));
        }
        self.weeder.to_hold()?;
        wrong.extend(self.capture_error()?);
        wrong.extend(self.encoder_errors()?);
        wrong.extend(self.switch_and_beam_errors()?);
        if !self.measures_slip()? {
            let words = "the weeder measures no slip between the beams";
            wrong.push(format!("second beam: {words}: {}", check_wire(Line::SecondBeam)));
        }
        let records = self.tester.record_for_ms(1500)?;
        let from_weeder = |from, to| format!("check the wire from {from} of the weeder to {to} of the tester");
        if servo::pulses(&records, 0).len() < 10 {
            wrong.push(format!("servo: no pulses come: {}", from_weeder("D9", "D8")));
        }
        if !records.iter().any(|record| matches!(record, Record::Led { .. })) {
            wrong.push(format!("LED: it does not flash in hold: {}", from_weeder("D13", "D6")));
        }
        self.weeder.to_hold()?;
        Ok(wrong)
    }

    /// The tester measures its own pulse, while the weeder is in reset and drives nothing.
    fn capture_error(&mut self) -> Result<Option<String>, CheckError> {
        self.tester.command(&Command::Reset { pulled: true })?;
        self.tester.record_for_ms(40)?;
        self.tester.command(&Command::CheckCapture { width: OWN_PULSE })?;
        let records = self.tester.record_for_ms(20)?;
        self.tester.command(&Command::Reset { pulled: false })?;
        // Nothing drives the wire just after the reset is pulled, so other pulses may come.
        let mut widths = records.iter().filter_map(|record| match record {
            Record::Pulse { width, .. } => Some(*width),
            _ => None,
        });
        let right = u32::from(OWN_PULSE)..=u32::from(OWN_PULSE) + OWN_PULSE_ERROR;
        let own = widths.clone().find(|width| right.contains(width)).or_else(|| widths.next());
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
    fn encoder_errors(&mut self) -> Result<Vec<String>, CheckError> {
        // The capture's check has left the weeder in reset.
        self.weeder.greeting()?;
        self.weeder.to_hold()?;
        let (a, b) = (Line::EncoderA.bit(), Line::EncoderB.bit());
        self.tester.set(a | b, 0)?;
        let mut last = self.weeder.status()?.position;
        let mut steps = Vec::new();
        for (line, level) in [(a, a), (b, b), (a, 0), (b, 0)] {
            self.tester.set(line, level)?;
            let position = self.weeder.status()?.position;
            steps.push(position - last);
            last = position;
        }
        let mut wrong = Vec::new();
        match steps[..] {
            [1, 1, 1, 1] => {}
            [-1, -1, -1, -1] => {
                wrong.push("encoder: it counts backward: wires A0 to D2 and A1 to D3 are swapped".to_owned());
            }
            _ => {
                for (line, first) in [(Line::EncoderA, 0), (Line::EncoderB, 1)] {
                    if (steps[first], steps[first + 2]) == (0, 0) {
                        let words = "the weeder does not count its steps";
                        wrong.push(format!("{}: {words}: {}", wire(line).name, check_wire(line)));
                    }
                }
                if wrong.is_empty() {
                    let checks = [Line::EncoderA, Line::EncoderB].map(check_wire).join(", ");
                    wrong.push(format!("encoder: four steps count as {steps:?}: {checks}"));
                }
            }
        }
        Ok(wrong)
    }

    fn switch_and_beam_errors(&mut self) -> Result<Vec<String>, CheckError> {
        let mut wrong = Vec::new();
        // At rest no beam is broken, and no switch is closed.
        let at_rest = self.noticed(0)?;
        if at_rest.contains(&Line::Beam) {
            let words = "it is broken at rest: if its line is not inverted";
            wrong.push(format!("beam: {words}, {}", check_wire(Line::Beam)));
        }
        if at_rest.contains(&Line::EndSwitch) {
            wrong.push(format!("end switch: it is closed at rest: {}", check_wire(Line::EndSwitch)));
        }
        for line in [Line::WorkSwitch, Line::Beam, Line::EndSwitch, Line::SecondBeam] {
            let name = wire(line).name;
            let mut noticed = self.noticed(line.bit())?;
            noticed.retain(|seen| !at_rest.contains(seen));
            // The console does not show the second beam's level.
            if line != Line::SecondBeam && !noticed.contains(&line) && !at_rest.contains(&line) {
                wrong.push(format!("{name}: the weeder does not notice it: {}", check_wire(line)));
            }
            for other in noticed.into_iter().filter(|other| *other != line).map(wire) {
                let (other, pin) = (other.name, other.weeder);
                wrong.push(format!("{name}: the weeder takes it for the {other} ({pin}): the wires are swapped"));
            }
        }
        Ok(wrong)
    }

    /// The switches and the beam to which the weeder reacts while these lines are low.
    fn noticed(&mut self, low: u8) -> Result<Vec<Line>, CheckError> {
        let Self { weeder, tester, .. } = self;
        let mut seen = Vec::new();
        weeder.to_hold()?;
        tester.set(low, 0)?;
        tester.record_for_ms(SETTLE_MS)?;
        if weeder.status()?.mode == Mode::Work {
            seen.push(Line::WorkSwitch);
        }
        if weeder.beam_is_broken()? {
            seen.push(Line::Beam);
        }
        weeder.try_to("hold")?;
        weeder.ask("set end_switch on")?;
        tester.record_for_ms(STUCK_MS)?;
        // In hold the tool is out. An open end switch contradicts that, which is an alarm.
        if weeder.status()?.mode != Mode::Alarm {
            seen.push(Line::EndSwitch);
        }
        tester.set(low, AT_REST)?;
        tester.record_for_ms(SETTLE_MS)?;
        weeder.to_hold()?;
        Ok(seen)
    }

    /// Plants pass both beams in hold. Returns whether the weeder measures the slip between them.
    fn measures_slip(&mut self) -> Result<bool, CheckError> {
        let Self { weeder, tester, .. } = self;
        weeder.to_hold()?;
        weeder.ask(&format!("set second_beam_mm {SECOND_BEAM_MM}"))?;
        let mut plan = Plan::default();
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
        Ok(is_measured)
    }
}
