//! Alarms and commands: the check plays a fault, and measures when the tool goes out and which code the LED flashes.
//!
//! Each scene begins at work with the tool in, on ground that the weeder takes as seen. Times count from the fault's
//! edge to the first pulse for out.

use crate::plan::Plan;
use crate::servo::{self, ORIGIN};
use crate::tester::ms;
use crate::{Boards, CheckError};
use control::alarm::Alarm;
use tester_core::message::{Command, Record};
use tester_core::pins::{AT_REST, Line};
use tester_core::player::Action;
use uno::CYCLES_PER_SECOND;

/// From the plan's start to the fault, or to the roll before it, in ms.
const STILL_MS: u32 = 200;

/// Time after the fault in which the tool must go out, in ms.
const AFTER_MS: u32 = 1000;

/// Counts a second while the machine rolls: 1.9 km/h with the factory settings' wheel.
const COUNTS_PER_S: f64 = 1000.0;

/// A quarter of a second of the LED, in ms: 2^16 steps of 4 us.
const QUARTER_MS: f64 = 262.144;

/// A fault, and the expected reaction.
#[derive(Clone, Copy, Debug)]
pub struct Scene {
    /// The alarm.
    pub alarm: Alarm,
    /// The scene's description in the report.
    pub words: &'static str,
    /// The time limit until the tool is out, in ms: the manual's limit, and a frame and a half of the servo.
    pub limit_ms: f64,
    /// Counts that the machine rolls before the fault, and the time from there to the fault in ms.
    rolled: i32,
    wait_ms: u32,
    /// Adds the fault to a plan, from a cycle on.
    fault: fn(&mut Plan, u64),
}

/// Every scene.
pub const SCENES: [Scene; 5] = [
    Scene {
        alarm: Alarm::BeamBlocked,
        words: "blocked beam",
        // The tool first goes out for a plant. The alarm comes after `max_width_mm`, 400 mm: 764 counts of the scene.
        limit_ms: 794.0,
        rolled: 300,
        wait_ms: 1,
        // The beam stays broken while the machine rolls on.
        fault: |plan, at| {
            plan.at(at, Action::level(Line::Beam, false));
            plan.roll(1000, COUNTS_PER_S);
        },
    },
    Scene {
        alarm: Alarm::BeamFlickers,
        words: "flickering beam",
        // 41 edges.
        limit_ms: 71.0,
        rolled: 100,
        wait_ms: 1,
        // The beam changes every millisecond while the machine rolls on.
        fault: |plan, _| plan.repeat(200, ms(1), Action::Flicker { mask: Line::Beam.bit() }),
    },
    Scene {
        alarm: Alarm::EncoderSilent,
        words: "silent encoder",
        // Three breaks of 150 ms each and 150 ms between.
        limit_ms: 780.0,
        rolled: 0,
        wait_ms: 1,
        fault: |plan, at| {
            for edge in 0..6 {
                plan.at(at + u64::from(ms(150 * edge)), Action::level(Line::Beam, edge % 2 == 1));
            }
        },
    },
    Scene {
        alarm: Alarm::EncoderChannelDead,
        words: "dead encoder channel",
        // More than 80 edges in 0.5 s.
        limit_ms: 530.0,
        rolled: 300,
        wait_ms: 1,
        // Channel B stops while the machine rolls on.
        fault: |plan, at| {
            plan.at(at, Action::Freeze { mask: Line::EncoderB.bit() });
            plan.roll(700, COUNTS_PER_S);
        },
    },
    Scene {
        alarm: Alarm::ToolStuck,
        words: "end switch closed with the tool in",
        // `lead_out_ms` of 230 ms, and 100 ms.
        limit_ms: 360.0,
        rolled: 0,
        wait_ms: 200,
        fault: |plan, at| plan.at(at, Action::level(Line::EndSwitch, false)),
    },
];

/// The result of a scene.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct Raised {
    /// From the fault to the first pulse for out, in ms by the weeder's clock; infinite without one.
    pub out_ms: f64,
    /// Whether the expected alarm was raised.
    pub is_expected: bool,
    /// The LED's code as a number of two digits; NaN without a code.
    pub code: f64,
}

/// The machine for [`Boards::beam_to_window_ms`]: beam and tool 100 mm apart, a margin of 50 mm, and no lead.
const NEAR_MACHINE: [&str; 4] = ["top_speed_mm_s 200", "lead_out_ms 0", "margin_mm 50", "beam_to_tool_mm 100"];

/// From the beam's edge to the keep-out zone, 50 mm: the factory settings' wheel has 400 mm and 2400 counts.
const WINDOW_COUNTS: f64 = 50.0 * 2400.0 / (std::f64::consts::PI * 400.0);

/// Counts a second there: 0.1 m/s.
const SLOW_COUNTS_PER_S: f64 = 191.0;

impl Boards {
    /// Plays a scene. The weeder is in hold afterwards.
    pub fn play_scene(&mut self, scene: &Scene) -> Result<Raised, CheckError> {
        self.set_to_work(scene.alarm == Alarm::ToolStuck)?;
        let mut plan = Plan::default();
        plan.at(ms(STILL_MS).into(), Action::Pause);
        plan.roll(scene.rolled, COUNTS_PER_S);
        let fault = plan.end() + u64::from(ms(scene.wait_ms));
        (scene.fault)(&mut plan, fault);
        plan.at(fault + u64::from(ms(AFTER_MS)), Action::Pause);
        let played = self.play(plan)?;
        let status = self.weeder.status()?;
        let (first, second) = scene.alarm.code();
        // The record may begin at any phase: so it must hold a code with the pauses before and after it.
        let code_ms = f64::from(2 * (2 * u16::from(first + second) + 8) + 10) * QUARTER_MS;
        let records = self.tester.record_for_ms(code_ms as u32)?;
        let mut free = Plan::default();
        free.at(ms(1).into(), Action::Freeze { mask: 0 });
        self.play(free)?;
        self.tester.set(AT_REST, AT_REST)?;
        self.tester.record_for_ms(STILL_MS)?;
        self.weeder.to_hold()?;
        Ok(Raised {
            out_ms: self.first_out_ms(&played.records, played.start, fault),
            is_expected: status.alarm == Some(scene.alarm),
            code: code(&records, self.clock_ratio).map_or(f64::NAN, |(first, second)| f64::from(10 * first + second)),
        })
    }

    /// Puts the weeder to work with the tool in, and with the end switch if `has_end_switch` is set.
    fn set_to_work(&mut self, has_end_switch: bool) -> Result<(), CheckError> {
        // An earlier scene or burst, such as a wheel that stopped suddenly, counts toward some alarms until a reset.
        self.reset()?;
        self.weeder.to_hold()?;
        let end_switch = Line::EndSwitch.bit();
        if has_end_switch {
            self.tester.set(end_switch, 0)?;
            self.tester.record_for_ms(STILL_MS)?;
            self.weeder.ask("set end_switch on")?;
        }
        self.weeder.ask("start now")?;
        self.tester.set(end_switch, end_switch)?;
        self.tester.record_for_ms(2 * STILL_MS)?;
        Ok(())
    }

    /// From a moment to the beginning of the next pulse for out, in ms; infinite without one, and NaN if the tool was
    /// out before. The moment counts in cycles from `start`.
    fn first_out_ms(&self, records: &[Record], start: u32, moment: u64) -> f64 {
        let (pulses, moment) = (servo::pulses(records, start), ORIGIN + moment);
        let (before, behind) = pulses.split_at(pulses.partition_point(|pulse| pulse.rise < moment));
        // If the tool was already out, the pulse does not show the reaction to the fault.
        if before.last().is_none_or(|last| self.is_out(last)) {
            return f64::NAN;
        }
        let first = behind.iter().find(|pulse| self.is_out(pulse));
        first.map_or(f64::INFINITY, |pulse| self.weeder_ms(pulse.rise - moment))
    }

    /// From the work switch's opening to the first pulse for out, in ms.
    pub fn switch_to_out_ms(&mut self) -> Result<f64, CheckError> {
        self.tester.set(Line::WorkSwitch.bit(), 0)?;
        // `start now` at work would skip the unseen ground, so `set_to_work` first goes to hold.
        self.set_to_work(false)?;
        let mut plan = Plan::default();
        plan.at(u64::from(ms(2 * STILL_MS)), Action::level(Line::WorkSwitch, true));
        let opened = plan.end();
        plan.at(opened + u64::from(ms(AFTER_MS)), Action::Pause);
        let played = self.play(plan)?;
        Ok(self.first_out_ms(&played.records, played.start, opened))
    }

    /// From the moment that a keep-out zone is due at the tool to the first pulse for out, in ms; negative if the pulse
    /// comes first. The zone follows from the beam's edge, half a second before.
    pub fn beam_to_window_ms(&mut self) -> Result<f64, CheckError> {
        self.weeder.to_hold()?;
        for setting in NEAR_MACHINE {
            self.weeder.ask(&format!("set {setting}"))?;
        }
        self.weeder.ask("start now")?;
        self.tester.record_for_ms(2 * STILL_MS)?;
        let mut plan = Plan::default();
        plan.roll(100, SLOW_COUNTS_PER_S);
        plan.at(plan.end(), Action::level(Line::Beam, false));
        let edge = plan.end();
        plan.roll(150, SLOW_COUNTS_PER_S);
        plan.at(plan.end(), Action::level(Line::Beam, true));
        let played = self.play(plan)?;
        self.weeder.to_hold()?;
        let out_ms = self.first_out_ms(&played.records, played.start, edge);
        Ok(out_ms - WINDOW_COUNTS * 1000.0 / SLOW_COUNTS_PER_S * self.clock_ratio)
    }

    /// From typing `hold` to the first pulse for out, in ms, with the delays of computer and serial lines.
    pub fn hold_to_out_ms(&mut self) -> Result<f64, CheckError> {
        self.set_to_work(false)?;
        let mut records = self.tester.record_for_ms(STILL_MS)?;
        let typed = self.tester.command(&Command::Clock)?.time;
        self.weeder.send("hold")?;
        records.extend(self.tester.record_for_ms(AFTER_MS)?);
        self.weeder.drain()?;
        self.weeder.to_hold()?;
        Ok(self.first_out_ms(&records, typed, 0))
    }
}

/// The LED's code between two pauses, if there is one. `clock_ratio` is the weeder's clock over the tester's.
fn code(records: &[Record], clock_ratio: f64) -> Option<(u8, u8)> {
    let lit = |record: &Record| match *record {
        Record::Led { time, lit: true } => Some(time),
        _ => None,
    };
    let rises: Vec<u32> = records.iter().filter_map(lit).collect();
    let gap = |two: &[u32]| {
        let ms = f64::from(two[1].wrapping_sub(two[0])) * 1000.0 / CYCLES_PER_SECOND as f64 * clock_ratio;
        (ms / QUARTER_MS).round() as u32
    };
    let gaps: Vec<u32> = rises.windows(2).map(gap).collect();
    // From a flash to the next are two quarters. The gap between the digits makes it four, and the pause eight.
    let mut codes = gaps.split(|&gap| gap == 8).skip(1);
    let (code, _behind_the_pause) = (codes.next()?, codes.next()?);
    let (first, second) = code.split_at(code.iter().position(|&gap| gap == 4)?);
    let is_code = first.iter().chain(&second[1..]).all(|&gap| gap == 2);
    is_code.then_some((first.len() as u8 + 1, second.len() as u8))
}

#[cfg(test)]
mod tests {
    use super::*;

    /// The LED's edges of a code, from its pause on.
    fn flashed(first: u8, second: u8) -> Vec<Record> {
        let quarter = QUARTER_MS * CYCLES_PER_SECOND as f64 / 1000.0;
        let mut quarters = 5;
        let mut records = Vec::new();
        for _ in 0..4 {
            for (flashes, dark) in [(first, 2), (second, 6)] {
                for _ in 0..flashes {
                    let time = |quarters: u32| (f64::from(quarters) * quarter) as u32;
                    records.push(Record::Led { time: time(quarters), lit: true });
                    records.push(Record::Led { time: time(quarters + 1), lit: false });
                    quarters += 2;
                }
                quarters += dark;
            }
        }
        records
    }

    #[test]
    fn a_code_is_read_from_pause_to_pause_wherever_the_record_begins() {
        for (first, second) in [(1, 1), (2, 3), (4, 1), (5, 2)] {
            let records = flashed(first, second);
            for begin in 0..4 {
                assert_eq!(code(&records[begin..], 1.0), Some((first, second)), "{first}-{second} from {begin}");
            }
        }
        assert_eq!(code(&flashed(2, 2)[..6], 1.0), None);
    }
}
