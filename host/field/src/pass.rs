//! A pass: all inputs of weeding a row, except the controller.
//!
//! The machine's motion does not depend on the firmware. So a pass is complete before it runs: row, machine, motion,
//! and the firmware's settings. The controller is the [native run](crate::native), one of its
//! [`baselines`](crate::baselines), or the real firmware, which is in another crate.

use crate::budget::Reason;
use crate::conditions::{Conditions, Mechanism};
use crate::machine::{Dirt, Machine};
use crate::motion::{Motion, run_up_mm};
use crate::row::{Row, Stem};
use crate::servo::{Scatter, Servo};
use crate::verdict::ZoneSettings;
use control::ground::features;
use control::settings::Setting;
use knn::Example;
use uno::Pulse;

/// How the firmware is put to work.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub enum Start {
    /// By the command `start`: the tool enters the row when ground that the beam has seen reaches it.
    Command,
    /// By the command `start now`: the tool enters the row at once.
    Now,
    /// By the work switch, from high to low.
    Switch,
}

/// The inputs of a pass.
#[derive(Clone, Debug)]
pub struct Pass {
    /// The row's plants and weeds.
    pub row: Row,
    /// The machine.
    pub machine: Machine,
    /// How it rolls.
    pub motion: Motion,
    /// The firmware's margin and leads.
    pub timing: ZoneSettings,
    /// How the firmware is put to work.
    pub start: Start,
    /// Further settings. Those of the machine replace its own, and the others follow machine and timing.
    pub settings: Vec<(Setting, u16)>,
    /// Examples that are taught in addition to the built-in ones.
    pub examples: Vec<Example<{ features::COUNT }>>,
}

/// A controller's work on a pass's row.
#[derive(Clone, Debug, PartialEq)]
pub struct Weeded {
    /// The servo's pulses, the first of each width.
    pub pulses: Vec<Pulse>,
    /// The cycle at which the motion began.
    pub start_cycle: u64,
    /// Whether the firmware was not at work at the end.
    pub alarm: bool,
    /// Why the tool was in the row or out of it, from the beginning of the motion to its end.
    pub reasons: Vec<Reason>,
}

/// How fast the machine gains its speed.
const ACCELERATION_MM_S2: f64 = 1000.0;

/// How fast it brakes at the end.
const BRAKING_MM_S2: f64 = 3000.0;

/// Distance that the tool rolls on behind the row.
const RUN_OUT_MM: f64 = 100.0;

/// The firmware's greatest top speed, 10.8 km/h. A machine is set to a quarter more than its speed, if the distance
/// from beam to tool allows it.
const TOP_SPEED_MM_S: f64 = 3000.0;

/// The firmware's least top speed. No setting contradicts it.
const SLOWEST_TOP_SPEED_MM_S: f64 = 100.0;

impl Pass {
    /// A pass of the whole row at one speed, from a standstill ahead of it until the tool has passed its end.
    pub fn at_speed(row: Row, machine: Machine, timing: ZoneSettings, speed_mm_s: f64) -> Self {
        let span = row.span_mm();
        let motion = Motion::steady(
            span.start - run_up_mm(speed_mm_s, ACCELERATION_MM_S2),
            ACCELERATION_MM_S2,
            speed_mm_s,
            span.end + machine.beam_to_tool_mm + RUN_OUT_MM,
        );
        // A real machine does not stop at once. To the firmware that would be a failed encoder.
        let motion = motion.change_speed(0.0, BRAKING_MM_S2);
        Self { row, machine, motion, timing, start: Start::Command, settings: Vec::new(), examples: Vec::new() }
    }

    /// The value of a further setting, if there is one.
    fn own(&self, setting: Setting) -> Option<u16> {
        self.settings.iter().find(|(own, _)| *own == setting).map(|&(_, value)| value)
    }

    /// The firmware's own calculation of how long it sees a plant before the tool is out: the lead, an eighth of it,
    /// the sensor's response as it is set, and a millisecond.
    fn notice_s(&self) -> f64 {
        let response_ms = self.own(Setting::BeamResponseMs).unwrap_or(Setting::BeamResponseMs.default());
        f64::from(self.timing.lead_out_ms) * 1.125e-3 + f64::from(response_ms + 1) / 1000.0
    }

    /// The speed from which on the firmware keeps the tool out of the row: a plant just behind the last beam would reach
    /// the tool before the tool is out.
    pub fn too_fast_mm_s(&self) -> f64 {
        let Machine { beam_to_tool_mm, second_beam_mm, .. } = self.machine;
        (beam_to_tool_mm - second_beam_mm.max(self.before_plant_mm())) / self.notice_s()
    }

    /// Ground that the firmware keeps clear ahead of a plant just behind the beam: the margin, and half of a stem zone.
    fn before_plant_mm(&self) -> f64 {
        f64::from(self.timing.margin_mm + self.timing.stem_zone_mm / 2)
    }

    /// The firmware's settings, in an order without intermediate contradictions. Further settings replace those of the
    /// machine, and the top speed comes last.
    pub fn firmware_settings(&self) -> Vec<(Setting, u16)> {
        let Machine { wheel_mm, ticks_per_rev, beam_to_tool_mm, second_beam_mm, servo, .. } = self.machine;
        let ZoneSettings { margin_mm, lead_out_ms, lead_in_ms, .. } = self.timing;
        let of = |setting: Setting, machine: f64| (setting, self.own(setting).unwrap_or(machine.round() as u16));
        let beam_to_tool = of(Setting::BeamToToolMm, beam_to_tool_mm);
        let notice_mm = f64::from(beam_to_tool.1) - self.before_plant_mm() - 2.0;
        let wanted_mm_s = (1.25 * self.motion.top_speed_mm_s()).max(SLOWEST_TOP_SPEED_MM_S);
        let top_speed_mm_s = wanted_mm_s.min(notice_mm / self.notice_s()).min(TOP_SPEED_MM_S);
        let mut settings = vec![
            (Setting::TopSpeedMmS, SLOWEST_TOP_SPEED_MM_S as u16),
            // Without a margin there is room for each lead.
            (Setting::MarginMm, 0),
            // The default encoder is fine enough for each wheel.
            of(Setting::WheelMm, wheel_mm),
            of(Setting::TicksPerRev, ticks_per_rev.into()),
            beam_to_tool,
            of(Setting::SecondBeamMm, second_beam_mm),
            (Setting::LeadOutMs, lead_out_ms as u16),
            (Setting::MarginMm, margin_mm as u16),
            (Setting::LeadInMs, lead_in_ms as u16),
            of(Setting::ServoInUs, servo.in_us),
            of(Setting::ServoOutUs, servo.out_us),
        ];
        if servo.in_us.round() == f64::from(Setting::ServoOutUs.default()) {
            // In between, both pulses would be equal.
            settings.insert(0, (Setting::ServoOutUs, 1750));
        }
        let is_sent = |wanted: &Setting| settings.iter().any(|(sent, _)| sent == wanted);
        let others: Vec<_> = self.settings.iter().filter(|(setting, _)| !is_sent(setting)).collect();
        settings.extend(others);
        settings.push(of(Setting::TopSpeedMmS, top_speed_mm_s.floor()));
        settings
    }
}

/// A field as the firmware meets it.
impl Conditions {
    /// The machine. The seed selects its servo's and encoder's random deviations.
    pub fn machine(&self, seed: u64) -> Machine {
        let Mechanism { beam_to_tool_mm, second_beam_mm, arm_mm, arm, tool_width_mm, tool_length_mm, .. } =
            self.machine;
        let Mechanism { dead_time_ms, dead_time_scatter_ms, travel_ms, load_kg_cm, stall_kg_cm, .. } = self.machine;
        let scatter = Scatter { dead_time_ms: dead_time_scatter_ms, load: load_kg_cm / stall_kg_cm, seed };
        // The stroke follows from the firmware's settings.
        let default = Servo::default();
        let in_us = self.setting_or(Setting::ServoInUs, default.in_us);
        let out_us = self.setting_or(Setting::ServoOutUs, default.out_us);
        Machine {
            beam_to_tool_mm,
            second_beam_mm,
            arm_mm,
            arm,
            tool_width_mm,
            tool_length_mm,
            servo: Servo { in_us, out_us, dead_time_ms, travel_ms, scatter },
            beam_mm: self.sensors.beam_mm,
            beam_response_ms: self.sensors.beam_response_ms,
            dirt: Dirt { share: self.sensors.lost_pulses_percent / 100.0, seed },
            ..Machine::default()
        }
    }

    /// The firmware's margin, leads and stem zone.
    pub fn timing(&self) -> ZoneSettings {
        let of = |setting: Setting| self.setting_or(setting, setting.default().into()) as u32;
        ZoneSettings {
            margin_mm: of(Setting::MarginMm),
            lead_out_ms: of(Setting::LeadOutMs),
            lead_in_ms: of(Setting::LeadInMs),
            stem_zone_mm: of(Setting::StemZoneMm),
        }
    }

    /// The pass of a row and a motion with this machine and these settings. The seed is that of [`Self::machine`].
    pub fn pass(&self, row: Row, motion: Motion, seed: u64) -> Pass {
        Pass {
            row,
            machine: self.machine(seed),
            motion,
            timing: self.timing(),
            start: Start::Command,
            settings: self.firmware_settings(),
            examples: Vec::new(),
        }
    }

    /// The pass of a row at one speed, with this crop's zone round each stem. The seed is that of [`Self::machine`].
    pub fn pass_at_speed(&self, mut row: Row, speed_mm_s: f64, seed: u64) -> Pass {
        let protected_mm = self.crop.protected_mm / 2.0;
        row.stems = Some(row.plants().map(|plant| Stem { protected_mm, ..Stem::at(plant.position_mm) }).collect());
        let pass = Pass::at_speed(row, self.machine(seed), self.timing(), speed_mm_s);
        Pass { settings: self.firmware_settings(), ..pass }
    }

    /// Which settings describe another machine than the simulated one, and what to set instead. A field file may hold
    /// the settings of a real machine.
    pub(crate) fn other_machine(&self) -> Vec<String> {
        let of = |setting: Setting| self.setting_or(setting, setting.default().into());
        let (wheel_mm, ticks_per_rev) = (of(Setting::WheelMm), of(Setting::TicksPerRev) as u32);
        let set_mm = match of(Setting::TicksPerM) {
            0.0 => Machine { wheel_mm, ticks_per_rev, ..Machine::default() }.tick_mm(),
            ticks_per_m => 1000.0 / ticks_per_m,
        };
        let clean_mm = Machine::default().tick_mm();
        let slipping_mm = clean_mm * (1.0 - self.ground.slip_percent / 100.0);
        // Settings before and after a calibration are within a tenth of one of these.
        let is_other = [clean_mm, slipping_mm].iter().all(|tick_mm| (set_mm / tick_mm - 1.0).abs() > 0.1);
        let wheel = is_other.then(|| {
            let (set_per_m, right_per_m) = (1000.0 / set_mm, 1000.0 / slipping_mm);
            format!(
                "The settings expect {set_per_m:.0} encoder counts a metre, but the simulated wheel makes \
                 {right_per_m:.0} with its slip. \
                 Set ticks_per_m to {right_per_m:.0}, and leave out ticks_per_rev and wheel_mm."
            )
        });
        let Mechanism { beam_to_tool_mm, second_beam_mm, .. } = self.machine;
        let beams = [(Setting::BeamToToolMm, beam_to_tool_mm), (Setting::SecondBeamMm, second_beam_mm)];
        let beams = beams.into_iter().filter_map(|(setting, has_mm)| {
            let (name, set_mm) = (setting.text().to_string(), self.setting_or(setting, has_mm));
            (set_mm.round() != has_mm.round()).then(|| {
                format!(
                    "settings.{name} is {set_mm}, but the simulated machine has {has_mm}. Set machine.{name} instead."
                )
            })
        });
        wheel.into_iter().chain(beams).collect()
    }

    /// A setting of the firmware, or what it is otherwise.
    fn setting_or(&self, setting: Setting, otherwise: f64) -> f64 {
        self.settings.get(&setting.text().to_string()).map_or(otherwise, |&value| value.into())
    }

    /// The firmware's other settings, without those from machine and timing.
    pub fn firmware_settings(&self) -> Vec<(Setting, u16)> {
        let timing = [Setting::MarginMm, Setting::LeadOutMs, Setting::LeadInMs];
        // In the table's order, the wheel comes before its calibration. The other way round, the wheel would reset it.
        let others = Setting::all().filter(|setting| !timing.contains(setting));
        others.filter_map(|setting| Some((setting, *self.settings.get(&setting.text().to_string())?))).collect()
    }
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::motion::mm_s;
    use crate::row::Canopy;
    use control::settings::Settings;

    #[test]
    fn no_setting_contradicts_those_before_it() {
        let changes: [&[(&str, f64)]; 7] = [
            // The automatic top speed follows the response.
            &[("beam_response_ms", 5.0)],
            // The field's top speed fits its response, but the automatic one would not.
            &[
                ("machine.beam_to_tool_mm", 500.0),
                ("margin_mm", 30.0),
                ("lead_out_ms", 212.0),
                ("top_speed_mm_s", 1805.0),
                ("beam_response_ms", 20.0),
            ],
            &[("machine.second_beam_mm", 200.0), ("beam_to_tool_mm", 1500.0), ("second_beam_mm", 0.0)],
            &[("ticks_per_rev", 1000.0), ("wheel_mm", 300.0)],
            &[("servo_in_us", 2000.0), ("servo_out_us", 1500.0)],
            // So near a beam leaves room for a long lead or a wide margin.
            &[("machine.beam_to_tool_mm", 100.0), ("margin_mm", 10.0), ("lead_out_ms", 500.0)],
            &[("machine.beam_to_tool_mm", 100.0), ("margin_mm", 90.0), ("lead_out_ms", 50.0)],
        ];
        for changes in changes {
            let row = Row::new(vec![Canopy::plant(500.0, 150.0)]).unwrap();
            let conditions = Conditions::with("transplanted", changes);
            let mut settings = Settings::new();
            let sent = conditions.pass_at_speed(row, mm_s(5.0), 1).firmware_settings();
            for &(setting, value) in &sent {
                settings.change(setting, value).unwrap();
                assert_eq!(settings.contradiction(), None, "{changes:?}: {} {value}", setting.text());
            }
            for (setting, value) in conditions.firmware_settings() {
                assert_eq!(settings.get(setting), value, "{changes:?}: {}", setting.text());
                let is_in_steps = [Setting::TopSpeedMmS, Setting::ServoOutUs].contains(&setting);
                let times = sent.iter().filter(|(sent, _)| *sent == setting).count();
                assert!(times == 1 || is_in_steps, "{changes:?}: {} {times} times", setting.text());
            }
        }
    }

    #[test]
    fn settings_of_another_machine_get_a_warning() {
        let warning = |change: (&str, f64)| Conditions::with("transplanted", &[change]).warning().unwrap_or_default();
        // Not calibrated, calibrated by the diameter, and measured.
        for same in [("wheel_mm", 400.0), ("wheel_mm", 380.0), ("ticks_per_m", 2010.0), ("beam_to_tool_mm", 400.0)] {
            assert_eq!(warning(same), "");
        }
        for other in [("ticks_per_rev", 6000.0), ("wheel_mm", 500.0), ("ticks_per_m", 3820.0)] {
            assert!(warning(other).contains("Set ticks_per_m to 2010, and leave out"), "{other:?}: {}", warning(other));
        }
        let said = warning(("beam_to_tool_mm", 600.0));
        assert!(said.starts_with("settings.beam_to_tool_mm is 600, but the simulated machine has 400. Set"), "{said}");
    }

    #[test]
    fn a_calibrated_wheel_is_set_after_its_diameter_which_would_reset_it() {
        let conditions = Conditions::with("transplanted", &[("ticks_per_m", 2010.0), ("wheel_mm", 400.0)]);
        assert_eq!(conditions.firmware_settings(), [(Setting::WheelMm, 400), (Setting::TicksPerM, 2010)]);
    }

    #[test]
    fn the_zone_round_each_stem_is_the_field_s() {
        let conditions = Conditions::with("maize", &[("crop.protected_mm", 40.0)]);
        let row = Row::new(vec![Canopy::plant(500.0, 20.0), Canopy::weed(600.0, 9.0), Canopy::plant(700.0, 20.0)]);
        let stems = conditions.pass_at_speed(row.unwrap(), 500.0, 1).row.stems();
        let zones: Vec<(f64, f64)> = stems.iter().map(|stem| (stem.along_mm, stem.protected_mm)).collect();
        assert_eq!(zones, [(500.0, 20.0), (700.0, 20.0)]);
    }

    #[test]
    fn the_last_beam_limits_the_speed() {
        // 200 mm behind the second beam, in nine eighths of 116 ms and 2 ms.
        let too_fast_mm_s = |changes: &[(&str, f64)]| {
            let row = Row::new(vec![Canopy::plant(500.0, 150.0)]).unwrap();
            Conditions::with("walked", changes).pass_at_speed(row, 500.0, 1).too_fast_mm_s().round()
        };
        assert_eq!(too_fast_mm_s(&[]), 1509.0);
        // A slower sensor takes 10 ms of it.
        assert_eq!(too_fast_mm_s(&[("beam_response_ms", 11.0)]), 1404.0);
        // Without it, the margin and half of the stem zone are kept too.
        assert_eq!(too_fast_mm_s(&[("machine.second_beam_mm", 0.0)]), 2438.0);
    }

    #[test]
    fn margin_and_leads_are_set_once_as_the_timing() {
        let conditions = Conditions::with("transplanted", &[("lead_out_ms", 200.0), ("margin_mm", 40.0)]);
        assert_eq!(
            conditions.timing(),
            ZoneSettings { lead_out_ms: 200, margin_mm: 40, ..Conditions::default().timing() }
        );
        assert!(conditions.firmware_settings().is_empty());
    }
}
