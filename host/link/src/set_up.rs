//! Setting a machine up, one thing after the other: the servo's times, the wheel's slip, then the margin, which pays for what these two
//! leave unknown.
//!
//! [`SetUp`] listens to a session. It counts what was measured, and tells the next [`Step`]: to measure once more, to set the lead that
//! was worst, or how small the margin may be and what the tool keeps of it then. It begins with the first `calibrate` and asks for
//! nothing before: who has a machine that is set up is left alone. It sets nothing itself.
//!
//! The margin that is needed is a sum: the slip's scatter over the way from where the plant was last seen to the tool, what is rolled
//! in the servo's scatter at the paper's fastest speed, and the firmware's own worst. What was not measured twice has no scatter, so
//! nothing is said of a margin before.

use super::session::Happening;
use super::{EventLine, Said, Timed};
use control::settings::{Setting, Settings};
use std::{collections::VecDeque, fmt};

/// Times that the servo is to be timed, with three swings each, and that the wheel is to be measured.
const TIMINGS: usize = 2;
const STRETCHES: usize = 3;

/// Plants that tell how much the slip scatters where a second beam measures it; the newest of them count.
const PLANTS: usize = 12;

/// What the servo scatters by where somebody has looked at it: two frames of a phone's slow motion, and as much of the servo.
const BY_EYE_MS: u16 = 15;

/// The paper's fastest speed, 2.5 km/h.
const SPEED_M_S: f64 = 2.5 / 3.6;

/// The firmware's own worst swing, in millimetres: what `weeder bench-uno` measures, rounded up.
const FIRMWARE_MM: f64 = 5.0;

/// What is to be done next.
#[derive(Clone, Debug, PartialEq)]
pub enum Step {
    /// Time the servo; so many times it has been.
    TimeServo(usize),
    /// A lead is not the worst of those that were measured, which is this one.
    SetLead(Setting, u16),
    /// Measure the wheel; so many times it has been.
    MeasureWheel(usize),
    /// Drive on with the second beam; so many plants have told the slip.
    PassPlants(usize),
    /// The margin may be, or has to be, this one.
    SetMargin(Margin),
    /// The margin is right.
    Ready(Margin),
}

/// What a margin pays for, each in millimetres.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct Margin {
    /// The slip's scatter.
    pub slip_mm: f64,
    /// The servo's.
    pub servo_mm: f64,
    /// The margin in use.
    pub in_use_mm: u16,
}

impl Margin {
    /// The least margin that pays for all of it, in whole millimetres.
    pub fn least_mm(&self) -> u16 {
        (self.slip_mm + self.servo_mm + FIRMWARE_MM).ceil() as u16
    }
}

impl fmt::Display for Step {
    fn fmt(&self, f: &mut fmt::Formatter<'_>) -> fmt::Result {
        match self {
            Self::TimeServo(done) => write!(f, "time the servo: `calibrate servo` ({done} of {TIMINGS} done)"),
            Self::SetLead(lead, worst_ms) => write!(f, "take the worst time: `set {} {worst_ms}`", lead.text()),
            Self::MeasureWheel(done) => {
                write!(f, "measure 10 m: `calibrate start`, roll, `calibrate 10000` ({done} of {STRETCHES} done)")
            }
            Self::PassPlants(done) => {
                write!(f, "have the beams tell the slip: roll past {PLANTS} plants ({done} done)")
            }
            Self::SetMargin(margin) => {
                let word = if margin.least_mm() < margin.in_use_mm { "lower" } else { "raise" };
                write!(f, "{word} the margin: `set margin_mm {}`: {margin}", margin.least_mm())
            }
            Self::Ready(margin) => write!(f, "the margin pays for {margin}: `save`"),
        }
    }
}

impl fmt::Display for Margin {
    fn fmt(&self, f: &mut fmt::Formatter<'_>) -> fmt::Result {
        let Self { slip_mm, servo_mm, .. } = self;
        write!(f, "slip {slip_mm:.0} + servo {servo_mm:.0} + {FIRMWARE_MM:.0} mm at 2.5 km/h")
    }
}

/// What was measured of a machine, as a session has told it.
#[derive(Clone, Debug, Default)]
pub struct SetUp {
    /// Whether the line that is being answered measures the wheel.
    measures_the_wheel: bool,
    /// The leads of each timing in milliseconds, out and in; none where somebody has looked.
    timings: Vec<Option<(u16, u16)>>,
    ticks_per_m: Vec<u16>,
    slip_permille: VecDeque<i32>,
}

impl SetUp {
    /// Listens to what happened.
    pub fn take(&mut self, happening: &Happening) {
        match happening {
            Happening::Command(line) => {
                let words: Vec<&str> = line.split_whitespace().collect();
                self.measures_the_wheel =
                    matches!(words[..], ["calibrate", length, ..] if length.parse::<u16>().is_ok());
            }
            Happening::Answer(line) if self.measures_the_wheel => {
                if let Said::Setting(shown) = Said::parse(line)
                    && shown.name.as_bytes() == Setting::TicksPerM.text().to_string().as_bytes()
                {
                    self.ticks_per_m.push(shown.value);
                }
            }
            Happening::Event(EventLine::Calibrated { by, .. }, _) => match *by {
                Timed::EndSwitch { out_ms, in_ms } => self.timings.push(Some((out_ms, in_ms))),
                Timed::Eye => self.timings.push(None),
                Timed::None => {}
            },
            Happening::Event(EventLine::Slip { permille }, _) => {
                self.slip_permille.push_back(*permille);
                if self.slip_permille.len() > PLANTS {
                    self.slip_permille.pop_front();
                }
            }
            _ => {}
        }
    }

    /// What is to be done next with these settings in use; nothing before the first thing was measured by `calibrate`.
    pub fn next(&self, settings: &Settings) -> Option<Step> {
        if self.timings.is_empty() && self.ticks_per_m.is_empty() {
            return None;
        }
        if self.timings.len() < TIMINGS {
            return Some(Step::TimeServo(self.timings.len()));
        }
        let timed = || self.timings.iter().flatten();
        let (outs, ins) = (timed().map(|&(out_ms, _)| out_ms), timed().map(|&(_, in_ms)| in_ms));
        let longest = outs.clone().max().filter(|&longest| longest > settings.get(Setting::LeadOutMs));
        let shortest = ins.clone().min().filter(|&shortest| shortest < settings.get(Setting::LeadInMs));
        let lead = longest.map(|worst| Step::SetLead(Setting::LeadOutMs, worst));
        if let Some(lead) = lead.or(shortest.map(|worst| Step::SetLead(Setting::LeadInMs, worst))) {
            return Some(lead);
        }
        let beam_to_tool_mm = f64::from(settings.get(Setting::BeamToToolMm));
        let second_beam_mm = f64::from(settings.get(Setting::SecondBeamMm));
        let slip_mm = if second_beam_mm > 0.0 {
            if self.slip_permille.len() < PLANTS {
                return Some(Step::PassPlants(self.slip_permille.len()));
            }
            // What is told is the median of three plants: the slip of one may be as far off it as the medians are from each other.
            f64::from(range(self.slip_permille.iter().copied())) / 1000.0 * (beam_to_tool_mm - second_beam_mm)
        } else {
            let &[.., in_use] = &self.ticks_per_m[..] else { return Some(Step::MeasureWheel(0)) };
            if self.ticks_per_m.len() < STRETCHES {
                return Some(Step::MeasureWheel(self.ticks_per_m.len()));
            }
            let farthest = self.ticks_per_m.iter().map(|ticks| ticks.abs_diff(in_use)).max().unwrap_or(0);
            f64::from(farthest) / f64::from(in_use.max(1)) * beam_to_tool_mm
        };
        let scatter_ms = if self.timings.contains(&None) { BY_EYE_MS } else { range(outs).max(range(ins)) };
        let servo_mm = f64::from(scatter_ms) * SPEED_M_S;
        let margin = Margin { slip_mm, servo_mm, in_use_mm: settings.get(Setting::MarginMm) };
        let is_least = margin.in_use_mm == margin.least_mm();
        Some(if is_least { Step::Ready(margin) } else { Step::SetMargin(margin) })
    }
}

/// The greatest of some values less the least.
fn range<T: Ord + Copy + std::ops::Sub<Output = T> + Default>(values: impl Iterator<Item = T> + Clone) -> T {
    let ends = values.clone().max().zip(values.min());
    ends.map_or_else(T::default, |(greatest, least)| greatest - least)
}

#[cfg(test)]
mod tests {
    use super::*;

    fn settings(changes: &[(Setting, u16)]) -> Settings {
        let mut settings = Settings::new();
        for &(setting, value) in changes {
            settings.set(setting, value).expect("within its range");
        }
        settings
    }

    /// A session in which these lines were typed, told or answered.
    fn after(lines: &[&str]) -> SetUp {
        let mut set_up = SetUp::default();
        for line in lines {
            let happening = match (line.strip_prefix("> "), EventLine::parse(line)) {
                (Some(typed), _) => Happening::Command(typed.to_owned()),
                (None, Some(event)) => Happening::Event(event, (*line).to_owned()),
                (None, None) => Happening::Answer((*line).to_owned()),
            };
            set_up.take(&happening);
        }
        set_up
    }

    const TIMED: [&str; 2] =
        ["calibrated lead_out_ms=150 lead_in_ms=52 set=yes", "calibrated lead_out_ms=158 lead_in_ms=56 set=yes"];

    const MEASURED: [&str; 7] = [
        "> calibrate 10000",
        "ticks_per_m=1910 from 0 to 20000, default 0, not saved",
        "> get ticks_per_m",
        "ticks_per_m=1700 from 0 to 20000, default 0, not saved",
        "> calibrate 10000 force",
        "ticks_per_m=1930 from 0 to 20000, default 0, not saved",
        "ok",
    ];

    #[test]
    fn a_machine_of_which_nothing_was_measured_is_left_alone() {
        let set_up = after(&["> get", MEASURED[1], "slip permille=12"]);
        assert_eq!(set_up.next(&Settings::new()), None);
    }

    #[test]
    fn servo_wheel_and_margin_come_one_after_the_other() {
        let mut lines = vec![TIMED[0]];
        let leads = [(Setting::LeadOutMs, 150), (Setting::LeadInMs, 56)];
        assert_eq!(after(&lines).next(&settings(&leads)), Some(Step::TimeServo(1)));
        lines.push(TIMED[1]);
        assert_eq!(after(&lines).next(&settings(&leads)), Some(Step::SetLead(Setting::LeadOutMs, 158)));
        let leads = [(Setting::LeadOutMs, 158), (Setting::LeadInMs, 56)];
        assert_eq!(after(&lines).next(&settings(&leads)), Some(Step::SetLead(Setting::LeadInMs, 52)));
        let leads = [(Setting::LeadOutMs, 158), (Setting::LeadInMs, 52)];
        assert_eq!(after(&lines).next(&settings(&leads)), Some(Step::MeasureWheel(0)));
        lines.extend(MEASURED);
        assert_eq!(after(&lines).next(&settings(&leads)), Some(Step::MeasureWheel(2)));
        lines.extend(["> calibrate 10000", "ticks_per_m=1920 from 0 to 20000, default 0, not saved"]);
        // 10 of 1920 ticks over 400 mm, 8 ms at 0.694 m/s, and the firmware's 5 mm.
        let step = after(&lines).next(&settings(&leads));
        let Some(Step::SetMargin(margin)) = step else { panic!("{step:?}") };
        assert!(
            (margin.slip_mm - 400.0 * 10.0 / 1920.0).abs() < 1e-9 && (margin.servo_mm - 8.0 * SPEED_M_S).abs() < 1e-9
        );
        assert_eq!(margin.least_mm(), 13);
        assert_eq!(
            Step::SetMargin(margin).to_string(),
            "lower the margin: `set margin_mm 13`: slip 2 + servo 6 + 5 mm at 2.5 km/h"
        );
        let ready = [leads[0], leads[1], (Setting::MarginMm, 13)];
        assert!(matches!(after(&lines).next(&settings(&ready)), Some(Step::Ready(_))));
        let low = [leads[0], leads[1], (Setting::MarginMm, 12)];
        let step = after(&lines).next(&settings(&low)).expect("something is to be done").to_string();
        assert!(step.starts_with("raise the margin: `set margin_mm 13`"), "{step}");
    }

    #[test]
    fn with_a_second_beam_plants_measure_the_wheel() {
        let leads = [(Setting::LeadOutMs, 158), (Setting::LeadInMs, 52), (Setting::SecondBeamMm, 200)];
        let mut lines = TIMED.to_vec();
        lines.extend(["slip permille=40"; 5]);
        assert_eq!(after(&lines).next(&settings(&leads)), Some(Step::PassPlants(5)));
        // What was long ago does not count.
        lines.extend(["slip permille=50", "slip permille=70"].repeat(PLANTS / 2));
        let step = after(&lines).next(&settings(&leads));
        let Some(Step::SetMargin(margin)) = step else { panic!("{step:?}") };
        assert!((margin.slip_mm - 4.0).abs() < 1e-9, "a fiftieth of 200 mm: {margin:?}");
    }

    #[test]
    fn a_servo_that_somebody_has_looked_at_scatters_by_what_an_eye_can_tell() {
        let by_eye = "calibrated by=eye, set lead_out_ms and lead_in_ms to what you saw";
        let failed = "calibrated by=none, the end switch did not follow";
        let mut lines = vec![by_eye, failed, by_eye];
        lines.extend(MEASURED);
        lines.extend(MEASURED);
        let step = after(&lines).next(&Settings::new());
        let Some(Step::SetMargin(margin)) = step else { panic!("{step:?}") };
        assert!((margin.servo_mm - f64::from(BY_EYE_MS) * SPEED_M_S).abs() < 1e-9);
    }

    #[test]
    fn every_step_fits_on_a_line_of_80_characters() {
        let margin = Margin { slip_mm: 123.0, servo_mm: 123.0, in_use_mm: 50 };
        let steps = [
            Step::TimeServo(1),
            Step::SetLead(Setting::LeadOutMs, 158),
            Step::MeasureWheel(2),
            Step::PassPlants(11),
            Step::SetMargin(margin),
            Step::Ready(margin),
        ];
        for step in steps {
            assert!(step.to_string().len() <= 80, "{} in {step}", step.to_string().len());
        }
    }
}
