//! Alarms and commands: the check plays a fault. The tester measures when the tool goes out and which code the LED
//! flashes.
//!
//! Each scene begins at work with the tool in, on ground that the weeder takes as seen. Times count from the fault's
//! edge to the first pulse for out.

use crate::error::CheckError;
use crate::plan::Plan;
use crate::servo::{self, ORIGIN};
use crate::tester::{Tester, ms};
use crate::wiring::{self, Weeder};
use control::alarm::Alarm;
use tester_core::message::{Command, Record};
use tester_core::pins::{AT_REST, Line};
use tester_core::player::Action;
use uno::{CYCLES_PER_SECOND, Pulse};

/// From the plan's start to the fault, or to the roll before it, in ms.
const STILL_MS: u32 = 200;

/// Time after the fault in which the tool must go out, in ms.
const AFTER_MS: u32 = 1000;

/// Counts a second while the machine rolls: 1.9 km/h with the factory settings' wheel.
const COUNTS_PER_S: f64 = 1000.0;

/// A quarter of a second of the LED, in ms: 2^16 steps of 4 us.
const QUARTER_MS: f64 = 262.144;

/// A width between the factory settings' in (1500 us) and out (2000 us).
const MIDDLE_US: f64 = 1750.0;

/// The faults.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub enum Scene {
    /// The beam stays broken while the machine rolls on.
    BlockedBeam,
    /// The beam changes every millisecond while the machine rolls on.
    FlickeringBeam,
    /// The beam breaks three times, and the encoder is silent.
    SilentEncoder,
    /// Channel B stops while the machine rolls on.
    DeadChannel,
    /// The end switch closes while the tool is in.
    EndSwitch,
}

impl Scene {
    /// Every scene.
    pub const ALL: [Self; 5] =
        [Self::BlockedBeam, Self::FlickeringBeam, Self::SilentEncoder, Self::DeadChannel, Self::EndSwitch];

    /// The expected reaction.
    pub const fn expected(self) -> Expected {
        let (alarm, words, limit_ms) = match self {
            // The tool first goes out for a plant. The alarm comes after `max_width_mm`, 400 mm: 764 counts of the scene.
            Self::BlockedBeam => (Alarm::BeamBlocked, "blocked beam", 794.0),
            // 41 edges.
            Self::FlickeringBeam => (Alarm::BeamFlickers, "flickering beam", 71.0),
            // Three breaks of 150 ms each and 150 ms between.
            Self::SilentEncoder => (Alarm::EncoderSilent, "silent encoder", 780.0),
            // More than 80 edges in 0.5 s.
            Self::DeadChannel => (Alarm::EncoderChannelDead, "dead encoder channel", 530.0),
            // `lead_out_ms` of 230 ms, and 100 ms.
            Self::EndSwitch => (Alarm::ToolStuck, "end switch closed with the tool in", 360.0),
        };
        Expected { alarm, words, limit_ms }
    }

    /// The plan, and the cycle of the fault.
    fn plan(self) -> (Plan, u64) {
        let mut plan = Plan::new();
        plan.at(ms(STILL_MS).into(), Action::Pause);
        match self {
            Self::BlockedBeam | Self::DeadChannel => plan.roll(300, COUNTS_PER_S),
            Self::FlickeringBeam => plan.roll(100, COUNTS_PER_S),
            Self::SilentEncoder | Self::EndSwitch => {}
        }
        let fault = plan.end() + u64::from(ms(if self == Self::EndSwitch { 200 } else { 1 }));
        match self {
            Self::BlockedBeam => {
                plan.at(fault, Action::level(Line::Beam, false));
                plan.roll(1000, COUNTS_PER_S);
            }
            Self::FlickeringBeam => plan.repeat(200, ms(1), Action::Flicker { mask: Line::Beam.bit() }),
            Self::SilentEncoder => {
                for edge in 0..6 {
                    plan.at(fault + u64::from(ms(150 * edge)), Action::level(Line::Beam, edge % 2 == 1));
                }
            }
            Self::DeadChannel => {
                plan.at(fault, Action::Freeze { mask: Line::EncoderB.bit() });
                plan.roll(700, COUNTS_PER_S);
            }
            Self::EndSwitch => plan.at(fault, Action::level(Line::EndSwitch, false)),
        }
        (plan, fault)
    }
}

/// The expected reaction to a scene.
pub struct Expected {
    /// The alarm.
    pub alarm: Alarm,
    /// The scene's description in the report.
    pub words: &'static str,
    /// The time limit until the tool is out, in ms: the manual's limit, and a frame and a half of the servo.
    pub limit_ms: f64,
}

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

/// Plays a scene. The weeder is in hold afterwards.
///
/// # Errors
/// If a board does not answer.
pub fn play(scene: Scene, weeder: &mut Weeder, tester: &mut Tester, clock_ratio: f64) -> Result<Raised, CheckError> {
    to_work(weeder, tester, scene == Scene::EndSwitch)?;
    let (mut plan, fault) = scene.plan();
    plan.at(fault + u64::from(ms(AFTER_MS)), Action::Pause);
    let played = tester.play(&plan.finish(), || weeder.drain())?;
    let status = weeder.status()?;
    let alarm = scene.expected().alarm;
    let (first, second) = alarm.code();
    // The record may begin at any phase: so it must hold a code with the pauses before and after it.
    let code_ms = f64::from(2 * (2 * u16::from(first + second) + 8) + 10) * QUARTER_MS;
    let records = tester.record_for_ms(code_ms as u32)?;
    tester.play(&freed(), || weeder.drain())?;
    tester.set(AT_REST, AT_REST)?;
    tester.record_for_ms(STILL_MS)?;
    weeder.to_hold()?;
    let out_ms = first_out(&servo::pulses(&played.records, played.start), ORIGIN + fault, clock_ratio);
    let code = code(&records, clock_ratio).map_or(f64::NAN, |(first, second)| f64::from(10 * first + second));
    Ok(Raised { out_ms, is_expected: status.alarm == Some(alarm), code })
}

/// Frees every line of a plan.
fn freed() -> Vec<tester_core::player::Piece> {
    let mut plan = Plan::new();
    plan.at(u64::from(ms(1)), Action::Freeze { mask: 0 });
    plan.finish()
}

/// Puts the weeder to work with the tool in, and with the end switch if `has_end_switch` is set.
fn to_work(weeder: &mut Weeder, tester: &mut Tester, has_end_switch: bool) -> Result<(), CheckError> {
    // The weeder's memory of an earlier scene or burst, such as a wheel that stopped suddenly, counts toward some
    // alarms. A reset clears it.
    wiring::reset(weeder, tester)?;
    weeder.to_hold()?;
    let end_switch = Line::EndSwitch.bit();
    if has_end_switch {
        tester.set(end_switch, 0)?;
        tester.record_for_ms(STILL_MS)?;
        weeder.ask("set end_switch on")?;
    }
    weeder.ask("start now")?;
    tester.set(end_switch, end_switch)?;
    tester.record_for_ms(2 * STILL_MS)?;
    Ok(())
}

/// From a moment to the beginning of the next pulse for out, in ms; infinite without one, and NaN if the tool was out
/// before.
fn first_out(pulses: &[Pulse], moment: u64, clock_ratio: f64) -> f64 {
    let is_out = |pulse: &&Pulse| pulse.width_us() * clock_ratio > MIDDLE_US;
    let behind = pulses.iter().position(|pulse| pulse.rise >= moment).unwrap_or(pulses.len());
    // If the tool was already out, the pulse does not show the reaction to the fault.
    if pulses[..behind].last().is_none_or(|last| is_out(&last)) {
        return f64::NAN;
    }
    let first = pulses[behind..].iter().find(is_out).map(|pulse| (pulse.rise - moment) as f64);
    first.map_or(f64::INFINITY, |cycles| cycles * 1000.0 / CYCLES_PER_SECOND as f64 * clock_ratio)
}

/// The LED's code between two pauses, if there is one.
fn code(records: &[Record], clock_ratio: f64) -> Option<(u8, u8)> {
    let lit = |record: &Record| match *record {
        Record::Led { time, lit: true } => Some(time),
        _ => None,
    };
    let rises: Vec<u32> = records.iter().filter_map(lit).collect();
    // From a flash to the next are two quarters. The gap between the digits makes it four, and the pause eight.
    let gaps = rises.windows(2).map(|two| {
        let ms = f64::from(two[1].wrapping_sub(two[0])) * 1000.0 / CYCLES_PER_SECOND as f64 * clock_ratio;
        (ms / QUARTER_MS).round() as u32
    });
    let mut digits = [0_u8; 2];
    let (mut digit, mut is_begun) = (0, false);
    for gap in gaps {
        if is_begun {
            *digits.get_mut(digit)? += 1;
        }
        match gap {
            2 => {}
            4 => digit += 1,
            8 if is_begun => return (digit == 1).then_some((digits[0], digits[1])),
            8 => (is_begun, digit) = (true, 0),
            _ => return None,
        }
    }
    None
}

/// From the work switch's opening to the first pulse for out, in ms.
///
/// # Errors
/// If a board does not answer.
pub fn switch_to_out_ms(weeder: &mut Weeder, tester: &mut Tester, clock_ratio: f64) -> Result<f64, CheckError> {
    tester.set(Line::WorkSwitch.bit(), 0)?;
    // `start now` at work would skip the unseen ground, so `to_work` first goes to hold.
    to_work(weeder, tester, false)?;
    let mut plan = Plan::new();
    plan.at(u64::from(ms(2 * STILL_MS)), Action::level(Line::WorkSwitch, true));
    let opened = plan.end();
    plan.at(opened + u64::from(ms(AFTER_MS)), Action::Pause);
    let played = tester.play(&plan.finish(), || weeder.drain())?;
    Ok(first_out(&servo::pulses(&played.records, played.start), ORIGIN + opened, clock_ratio))
}

/// The machine for [`beam_to_window_ms`]: beam and tool 100 mm apart, a margin of 50 mm, and no lead.
const NEAR_MACHINE: [&str; 4] = ["top_speed_mm_s 200", "lead_out_ms 0", "margin_mm 50", "beam_to_tool_mm 100"];

/// From the beam's edge to the keep-out zone: 50 mm in counts of the factory settings' wheel, 400 mm and 2400 counts
/// around.
const WINDOW_COUNTS: f64 = 50.0 * 2400.0 / (std::f64::consts::PI * 400.0);

/// Counts a second there: 0.1 m/s.
const SLOW_COUNTS_PER_S: f64 = 191.0;

/// From the moment that a keep-out zone is due at the tool to the first pulse for out, in ms; negative if the pulse
/// comes first. The zone follows from the beam's edge, half a second before.
///
/// # Errors
/// If a board does not answer.
pub fn beam_to_window_ms(weeder: &mut Weeder, tester: &mut Tester, clock_ratio: f64) -> Result<f64, CheckError> {
    weeder.to_hold()?;
    for setting in NEAR_MACHINE {
        weeder.ask(&format!("set {setting}"))?;
    }
    weeder.ask("start now")?;
    tester.record_for_ms(2 * STILL_MS)?;
    let mut plan = Plan::new();
    plan.roll(100, SLOW_COUNTS_PER_S);
    plan.at(plan.end(), Action::level(Line::Beam, false));
    let edge = plan.end();
    plan.roll(150, SLOW_COUNTS_PER_S);
    plan.at(plan.end(), Action::level(Line::Beam, true));
    let played = tester.play(&plan.finish(), || weeder.drain())?;
    weeder.to_hold()?;
    let out_ms = first_out(&servo::pulses(&played.records, played.start), ORIGIN + edge, clock_ratio);
    Ok(out_ms - WINDOW_COUNTS * 1000.0 / SLOW_COUNTS_PER_S * clock_ratio)
}

/// From typing `hold` to the first pulse for out, in ms. This includes the delays of the computer and of the serial
/// lines.
///
/// # Errors
/// If a board does not answer.
pub fn hold_to_out_ms(weeder: &mut Weeder, tester: &mut Tester, clock_ratio: f64) -> Result<f64, CheckError> {
    to_work(weeder, tester, false)?;
    let mut records = tester.record_for_ms(STILL_MS)?;
    let typed = tester.command(&Command::Clock)?.time;
    weeder.send("hold")?;
    records.extend(tester.record_for_ms(AFTER_MS)?);
    weeder.drain()?;
    weeder.to_hold()?;
    Ok(first_out(&servo::pulses(&records, typed), ORIGIN, clock_ratio))
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
