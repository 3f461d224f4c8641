//! The swing of the tool in the row: its angle, pulse, time and lead.
//!
//! The angle is the smallest that clears the widest canopy, or the zone round a stem. Its time follows from the servo's
//! torque-speed line and the arm's moment of inertia. A shorter stroke takes less time and leaves more ground weeded.
//! With a stem zone, its settings follow as well. The zone is longer than the protected width, because a stem may stand
//! off the middle. Its leads are shorter, by what its circle allows at the top speed. The margin covers a wheel and a
//! servo that were not measured yet. Top speed and gap between pulses are the board's, or the firmware's defaults. If
//! the lead is too long for the beam's distance, the top speed is lowered. A trailing arm needs a wider margin.
//!
//! The arm swings sideways about a pivot beside the row: at an angle the tool's middle is `arm * sin(angle)` from the
//! row's line. A servo turns at full speed without load. Its speed falls in a straight line to zero at the stall
//! torque. The load is the torque of the whole blade in the soil (above Eq. 10); the paper sizes its servo by it. From
//! rest the arm reaches its speed with the time constant of a motor with such a line. The arm is a round steel rod with
//! the blade at its end.
//!
//! # Limits
//!
//! The arm's weight and the spring are not in the time: the spring outweighs the arm, so both together help the way
//! out. The servo's own inertia is in its data sheet's time. Play, and a supply that gives way, are in no calculation:
//! time the servo.

mod sentences;

use crate::arm::{SwungArm, from_rest};
use crate::machine::{Machine, SwingInputs};
use crate::unit::{KG_CM, MM};
use link::settings::{Setting, Settings, explain, name};
use serde::Serialize;
use set_up::{circle, saved_ms};
use std::f64::consts::FRAC_PI_3;
use uom::si::f64::{Time, Torque};
use uom::si::time::second;
use uom::si::torque::newton_meter;

/// How far beyond the stroke the outer stop is, as docs/build.md has it.
const STOP_DEGREES: f64 = 5.0;

/// The most that a pulse delays a command, besides the gap after it, ms.
const PULSE_MS: f64 = 3.0;

/// The most that fixed frames delay it, without a shortest gap, ms.
const FRAME_MS: f64 = 20.0;

/// Pulses are whole steps of this, us, rounded outwards.
const PULSE_STEP_US: f64 = 5.0;

/// A lower top speed is a multiple of this, mm/s. That leaves some room for a longer lead.
const SPEED_STEP_MM_S: u16 = 50;

/// The required swing.
#[derive(Clone, Copy, Debug, PartialEq, Serialize)]
pub struct Swing {
    /// The zone of a single plant along the row, mm; 0 for its canopy.
    pub stem_zone_mm: u32,
    /// Smallest angle at which the tool's edge has cleared the canopy or the protected width, degrees.
    pub angle_degrees: f64,
    /// Pulse with the tool in the row, us.
    pub servo_in_us: u32,
    /// Pulse with the tool out of it, us.
    pub servo_out_us: u32,
    /// Share of the servo's torque that the soil takes, 0 to 1.
    pub load: f64,
    /// Time for that angle without load, ms.
    pub unloaded_ms: f64,
    /// Its time from rest, with the arm's inertia and against the soil, ms.
    pub loaded_ms: f64,
    /// Mass of arm and blade, kg.
    pub swung_kg: f64,
    /// Torque by which a pendulum's weight pulls it back into the row from the outer stop, kg cm; 0 for a trailing arm.
    pub weight_kg_cm: f64,
    /// Height up to which a plant's zone is clear of a pendulum that is out, mm, rounded down; 0 for a trailing arm.
    pub clear_height_mm: f64,
    /// A lower top speed, mm/s, at which the beam sees a plant early enough for the lead. `None` if none is needed.
    pub top_speed_mm_s: Option<u32>,
    /// The top speed with these settings, mm/s: the lower one, or the board's.
    pub highest_mm_s: u32,
    /// Lead of the command to leave the row, ms.
    pub lead_out_ms: u32,
    /// Lead of the command to come back, ms.
    pub lead_in_ms: u32,
    /// How much wider the margin has to be because a trailing arm carries the tool along the row, mm; 0 for a pendulum.
    pub arm_margin_mm: u32,
    /// That margin, mm. `None` for a pendulum, or if the board's is as wide.
    pub margin_mm: Option<u32>,
    /// Height by which a pendulum lifts the blade's middle over the stroke, mm; 0 for a trailing arm.
    pub lift_mm: f64,
    /// Height by which it lifts the blade's edge beside the row, mm; below 0 where that edge goes deeper.
    pub edge_lift_mm: f64,
    /// Width on either side of the row that neither tool nor sweeps weed, mm.
    pub unweeded_strip_mm: f64,
    /// Width of a tool that would fill it, mm.
    pub filling_tool_mm: f64,
}

impl Swing {
    /// The swing of a machine, whose servo turns against this torque.
    ///
    /// # Errors
    /// If the arm is too short, the servo too weak or too slow, or the beam too near, in words.
    pub fn of(machine: &Machine, torque: Torque) -> Result<Self, String> {
        Self::fitted(machine, torque, &Settings::new())
    }

    /// The same with a board's gap and top speed, from where its tool was fitted in the row, and to the same side. Settings
    /// with the default pulses tell neither.
    ///
    /// # Errors
    /// As [`of`](Self::of).
    pub fn fitted(machine: &Machine, torque: Torque, settings: &Settings) -> Result<Self, String> {
        let pulses = [Setting::ServoInUs, Setting::ServoOutUs];
        let tool_mm = MM.value(machine.intra_row.width);
        if pulses.iter().all(|&pulse| settings.get(pulse) == pulse.default()) {
            return Self::with_tool(machine, torque, settings, tool_mm, machine.swing.pulse_in, true);
        }
        let [in_us, out_us] = pulses.map(|pulse| f64::from(settings.get(pulse)));
        Self::with_tool(machine, torque, settings, tool_mm, in_us, in_us <= out_us)
    }

    /// The same with a tool of another width in mm, from this pulse in us, and with longer or shorter pulses.
    fn with_tool(
        machine: &Machine,
        torque: Torque,
        settings: &Settings,
        tool_mm: f64,
        in_us: f64,
        is_longer: bool,
    ) -> Result<Self, String> {
        let inputs = machine.swing;
        let arm_mm = MM.value(machine.intra_row.shank_length);
        let aside_mm = kept_mm(machine) / 2.0 + MM.value(inputs.room) + tool_mm / 2.0;
        if aside_mm >= arm_mm {
            return Err(format!(
                "an arm of {arm_mm:.0} mm cannot bring the tool {aside_mm:.0} mm aside, which the plant asks for: \
                 take a longer one"
            ));
        }
        let (needed_kg_cm, stall_kg_cm) = (KG_CM.value(torque), KG_CM.value(machine.intra_row.servo_torque));
        let load = needed_kg_cm / stall_kg_cm;
        if load >= 1.0 {
            return Err(format!(
                "the soil takes {needed_kg_cm:.1} of the servo's {stall_kg_cm:.1} kg cm: it stalls; take a stronger one"
            ));
        }
        let exact_degrees = (aside_mm / arm_mm).asin().to_degrees();
        let us_a_degree = inputs.pulse_for_90 / 90.0;
        let stroke_us = (exact_degrees * us_a_degree / PULSE_STEP_US).ceil() * PULSE_STEP_US;
        let angle_degrees = stroke_us / us_a_degree;
        let unloaded_ms = 1000.0 * inputs.servo_time_60.get::<second>() * angle_degrees / 60.0;
        let arm = SwungArm::of(machine);
        // The speed of rotation without load is 60 degrees in the data sheet's time.
        let time_constant_s = arm.inertia_kg_m2 * FRAC_PI_3
            / (inputs.servo_time_60.get::<second>() * machine.intra_row.servo_torque.get::<newton_meter>());
        let loaded_ms = from_rest(unloaded_ms / (1.0 - load), 1000.0 * time_constant_s);
        let dead_ms = |time: Time| 1000.0 * time.get::<second>();
        let from_mm = MM.value(inputs.sweep_from);
        let gap_ms = settings.get(Setting::ServoGapMs);
        let wait_ms = PULSE_MS + if gap_ms == 0 { FRAME_MS } else { f64::from(gap_ms) };
        let lead_out_ms = dead_ms(inputs.most_dead_time.max(inputs.least_dead_time)) + loaded_ms + wait_ms;
        let protected_mm = MM.value(inputs.protected);
        let stem_zone_mm = if protected_mm > 0.0 { protected_mm + MM.value(inputs.stem_off) } else { 0.0 };
        let top_speed_mm_s = f64::from(settings.get(Setting::TopSpeedMmS));
        let (sine, cosine) = angle_degrees.to_radians().sin_cos();
        let (aside_of_stroke_mm, stroke_mm) = (arm_mm * sine, arm_mm * (1.0 - cosine));
        let edge_mm = stroke_mm - tool_mm / 2.0 * sine;
        let stop_kg_cm = arm.weight_kg_cm * (angle_degrees + STOP_DEGREES).to_radians().sin();
        let shank_mm = MM.value(machine.intra_row.shank_diameter);
        let axis_mm = arm_mm - MM.value(machine.soil.depth);
        let clear_mm = axis_mm - (kept_mm(machine) * cosine + shank_mm) / 2.0 / sine;
        // Over a whole canopy the tool is fully out.
        let (mut saved, mut carried_mm) = ([0.0; 2], stroke_mm);
        if stem_zone_mm > 0.0 {
            saved = saved_ms(top_speed_mm_s, unloaded_ms, stem_zone_mm, aside_of_stroke_mm).map(f64::from);
            let rolled_mm = circle::rolled_mm(top_speed_mm_s, unloaded_ms, stem_zone_mm, aside_of_stroke_mm);
            carried_mm = circle::carried_mm(arm_mm, tool_mm, stem_zone_mm, rolled_mm);
        }
        let [saved_out_ms, saved_in_ms] = saved;
        let in_us = in_us.round();
        let out_us = if is_longer { in_us + stroke_us } else { in_us - stroke_us };
        let lead_out_ms = (lead_out_ms - saved_out_ms).ceil().max(0.0);
        let lead_in_ms = (dead_ms(inputs.least_dead_time.min(inputs.most_dead_time)) + saved_in_ms).floor();
        let is_pendulum = inputs.arm_trails == 0;
        let of_pendulum = |value: f64| if is_pendulum { value } else { 0.0 };
        let arm_margin_mm = if is_pendulum { 0.0 } else { carried_mm.ceil() };
        // The board's margin may be measured, and then it has the arm's part.
        let board_mm = f64::from(settings.get(Setting::MarginMm));
        let wide_mm = if arm_margin_mm > 0.0 { f64::from(Setting::MarginMm.default()) + arm_margin_mm } else { 0.0 };
        let mut after = settings.clone();
        for (setting, value, advice) in [
            (Setting::ServoInUs, in_us, "fit the tool at another pulse"),
            (Setting::ServoOutUs, out_us, "take a longer arm, or fit the tool at another servo_in_us"),
            (Setting::LeadOutMs, lead_out_ms, "take a faster or a stronger servo, or a lighter arm"),
            (Setting::LeadInMs, lead_in_ms, "take a servo with a shorter dead time"),
            (Setting::MarginMm, wide_mm.max(board_mm), "take a longer arm, or a pendulum"),
        ] {
            // `as` saturates: a negative pulse becomes 0, which is out of range.
            if after.set(setting, value as u16).is_err() {
                let (name, least, greatest) = (name(setting), setting.least(), setting.greatest());
                return Err(format!(
                    "the swing needs {name} {value}, and the firmware takes {least} to {greatest}: {advice}"
                ));
            }
        }
        let board_mm_s = settings.get(Setting::TopSpeedMmS);
        let speeds = (Setting::TopSpeedMmS.least()..=board_mm_s).rev();
        let mut speeds = speeds.filter(|mm_s| *mm_s == board_mm_s || mm_s.is_multiple_of(SPEED_STEP_MM_S));
        let allowed_mm_s = speeds.find(|&mm_s| {
            // It is in its range.
            let _ = after.set(Setting::TopSpeedMmS, mm_s);
            after.contradiction().is_none()
        });
        let allowed_mm_s = allowed_mm_s.ok_or_else(|| after.contradiction().map(explain).unwrap_or_default())?;
        Ok(Self {
            stem_zone_mm: stem_zone_mm.ceil() as u32,
            angle_degrees,
            servo_in_us: in_us as u32,
            servo_out_us: out_us as u32,
            load,
            unloaded_ms,
            loaded_ms,
            swung_kg: arm.mass_kg,
            weight_kg_cm: of_pendulum(stop_kg_cm),
            clear_height_mm: of_pendulum(clear_mm.max(0.0).floor()),
            top_speed_mm_s: (allowed_mm_s < board_mm_s).then_some(allowed_mm_s.into()),
            highest_mm_s: allowed_mm_s.into(),
            lead_out_ms: lead_out_ms as u32,
            lead_in_ms: lead_in_ms as u32,
            arm_margin_mm: arm_margin_mm as u32,
            margin_mm: (wide_mm > board_mm).then_some(wide_mm as u32),
            lift_mm: of_pendulum(stroke_mm),
            edge_lift_mm: of_pendulum(edge_mm),
            unweeded_strip_mm: if machine.inter_row.tools == 0 { 0.0 } else { (from_mm - tool_mm / 2.0).max(0.0) },
            filling_tool_mm: 2.0 * from_mm,
        })
    }

    /// The settings that follow, in an order that the firmware of a new board takes.
    pub fn settings(&self) -> Vec<(&'static str, u32)> {
        let mut pulses = [("servo_in_us", self.servo_in_us), ("servo_out_us", self.servo_out_us)];
        if self.servo_in_us == u32::from(Setting::ServoOutUs.default()) {
            // In between, both pulses would be equal.
            pulses.reverse();
        }
        let slower = self.top_speed_mm_s.map(|mm_s| ("top_speed_mm_s", mm_s));
        let leads = [("lead_out_ms", self.lead_out_ms), ("lead_in_ms", self.lead_in_ms)];
        let margin = self.margin_mm.map(|mm| ("margin_mm", mm));
        let zone = (self.stem_zone_mm > 0).then_some(("stem_zone_mm", self.stem_zone_mm));
        // A lower speed comes before the lead that needs it, and a wider margin after a shorter lead.
        pulses.into_iter().chain(slower).chain(leads).chain(margin).chain(zone).collect()
    }

    /// The same as lines for the firmware's console.
    pub fn set_lines(&self) -> Vec<String> {
        self.settings().into_iter().map(|(name, value)| format!("set {name} {value}")).collect()
    }
}

/// Width of the zone that the tool must clear.
fn kept_mm(machine: &Machine) -> f64 {
    let SwingInputs { protected, widest_canopy, .. } = machine.swing;
    let protected_mm = MM.value(protected);
    if protected_mm > 0.0 { protected_mm } else { MM.value(widest_canopy) }
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::unit::{KG, KM_H, SECOND};

    fn with_tool_of_100_mm() -> Machine {
        let mut machine = Machine::default();
        machine.intra_row.width = MM.of(100.0);
        machine
    }

    /// A board whose tool was fitted with these pulses, in and out.
    fn board([in_us, out_us]: [u16; 2]) -> Settings {
        let mut settings = Settings::new();
        settings.set(Setting::ServoInUs, in_us).expect("it is in its range");
        settings.set(Setting::ServoOutUs, out_us).expect("it is in its range");
        settings
    }

    #[test]
    fn a_thick_shank_swings_late_falls_back_without_a_strong_spring_and_stands_over_high_plants() {
        // By hand: 1.94 kg of rod and 0.4 kg of blade, 0.1283 kg m2 and 47.97 kg cm, 22.1 of them at 27.5 degrees. The time
        // constant is 142.7 ms, and 71.8 ms at the final speed become 171.6 ms from rest. A numerical integration agrees.
        let mut machine = Machine::default();
        machine.intra_row.shank_diameter = MM.of(30.0);
        machine.intra_row.blade_mass = KG.of(0.4);
        machine.intra_row.width = MM.of(130.0);
        (machine.swing.protected, machine.swing.room) = (MM.of(90.0), MM.of(23.0));
        let torque = KG_CM.of(9.85);
        let swing = Swing::of(&machine, torque).expect("it swings");
        let near =
            |value: f64, expected: f64| assert!((value / expected - 1.0).abs() < 0.01, "{value}, not {expected}");
        near(swing.swung_kg, 2.342);
        near(swing.loaded_ms, 171.6);
        near(swing.weight_kg_cm, 22.15);
        near(swing.clear_height_mm, 177.0);
        near(swing.edge_lift_mm, 1.77);
        let said = swing.sentences(&machine, torque).join(" ");
        assert!(said.contains("20.0 kg cm: no spring can. Take a lighter arm"), "{said}");
    }

    #[test]
    fn a_stem_s_zone_needs_a_shorter_stroke_than_its_canopy_and_comes_with_its_settings() {
        let torque = KG_CM.of(10.0);
        let mut machine = with_tool_of_100_mm();
        let canopy = Swing::of(&machine, torque).expect("it swings");
        assert_eq!((canopy.servo_out_us, canopy.set_lines().len()), (1795, 4));
        machine.swing.protected = MM.of(90.0);
        let stem = Swing::of(&machine, torque).expect("it swings");
        // 45 + 10 + 50 mm of an arm of 350 are 17.5 degrees.
        let lines = ["set servo_out_us 1695", "set lead_out_ms 152", "set stem_zone_mm 100"];
        assert!(lines.iter().all(|line| stem.set_lines().iter().any(|set| set == line)), "{:?}", stem.set_lines());
        assert!(
            stem.sentences(&machine, torque)[0].starts_with("The tool clears a stem's zone of 90 mm at 17."),
            "{stem:?}"
        );
    }

    #[test]
    fn a_stroke_begins_where_the_tool_was_fitted_and_goes_to_the_same_side() {
        for (board_us, pulses) in [
            ([1500, 2000], [1500, 1795]),
            ([1620, 2000], [1620, 1915]),
            ([1480, 1000], [1480, 1185]),
            ([1500, 2100], [1500, 1795]),
        ] {
            let machine = with_tool_of_100_mm();
            let fitted = Swing::fitted(&machine, KG_CM.of(10.0), &board(board_us)).expect("it swings");
            assert_eq!([fitted.servo_in_us, fitted.servo_out_us], pulses);
            // A narrower tool offers the same stroke for the tool that fills the strip.
            let machine = Machine::default();
            let narrow = Swing::fitted(&machine, KG_CM.of(10.0), &board(board_us)).expect("it swings");
            let sentences = narrow.sentences(&machine, KG_CM.of(10.0)).join(" ");
            assert!(
                sentences.contains("a tool of 100 mm would fill that, and swing out to 26.6 degrees."),
                "{sentences}"
            );
        }
    }

    #[test]
    fn fixed_frames_and_a_higher_top_speed_of_the_board_need_safer_leads() {
        let leads = |machine: &Machine, setting: Setting, value: u16| {
            let mut settings = Settings::new();
            settings.set(setting, value).expect("it is in its range");
            let swing = Swing::fitted(machine, KG_CM.of(10.0), &settings).expect("it swings");
            (swing.lead_out_ms, swing.lead_in_ms)
        };
        let mut machine = with_tool_of_100_mm();
        let (out_ms, in_ms) = leads(&machine, Setting::ServoGapMs, 3);
        assert_eq!(leads(&machine, Setting::ServoGapMs, 0), (out_ms + 17, in_ms));
        machine.swing.protected = MM.of(90.0);
        let (out_ms, in_ms) = leads(&machine, Setting::TopSpeedMmS, 1300);
        let (fast_out_ms, fast_in_ms) = leads(&machine, Setting::TopSpeedMmS, 2000);
        assert!(fast_out_ms > out_ms && fast_in_ms < in_ms, "{fast_out_ms} {fast_in_ms}");
    }

    #[test]
    fn the_firmware_takes_each_line_and_a_long_lead_comes_with_the_highest_speed_for_it() {
        // The soil's torque on the paper's blade, and on one of 2.5 mm.
        // The trailing arm's margin is 26 mm wider, too wide for the default lead. A new board's tool is out at the last
        // pulse.
        for (kg_cm, arm_trails, pulse_in, slower_mm_s) in [
            (39.4, 0, 1500.0, Some(1000)),
            (39.4, 1, 1500.0, Some(900)),
            (10.0, 1, 1500.0, None),
            (10.0, 0, 2000.0, None),
        ] {
            let mut machine = Machine::default();
            (machine.swing.arm_trails, machine.swing.pulse_in) = (arm_trails, pulse_in);
            let swing = Swing::of(&machine, KG_CM.of(kg_cm)).expect("it swings");
            let mut settings = Settings::new();
            for (name, value) in swing.settings() {
                let setting = Setting::find(name.as_bytes()).expect("it is a setting");
                settings.change(setting, value as u16).expect("it is in its range");
                assert_eq!(settings.contradiction(), None, "{name} {value}");
            }
            assert_eq!(swing.top_speed_mm_s, slower_mm_s, "{swing:?}");
            assert_eq!(
                u32::from(settings.get(Setting::MarginMm)),
                u32::from(Setting::MarginMm.default()) + swing.arm_margin_mm
            );
            let faster_mm_s = settings.get(Setting::TopSpeedMmS) + SPEED_STEP_MM_S;
            settings.set(Setting::TopSpeedMmS, faster_mm_s).expect("it is in its range");
            assert!(slower_mm_s.is_none() || settings.contradiction().is_some(), "{faster_mm_s}");
        }
        let mut near = Settings::new();
        near.set(Setting::BeamToToolMm, 100).expect("it is in its range");
        near.set(Setting::MarginMm, 90).expect("it is in its range");
        let error = Swing::fitted(&Machine::default(), KG_CM.of(39.4), &near).expect_err("it is refused");
        assert!(error.contains("together need a beam_to_tool_mm of "), "{error}");
    }

    #[test]
    fn a_swing_whose_settings_the_firmware_refuses_says_what_to_change() {
        let changed = |change: fn(&mut Machine)| {
            let mut machine = with_tool_of_100_mm();
            change(&mut machine);
            machine
        };
        for (machine, pulses, problem) in [
            (
                changed(|machine| machine.swing.servo_time_60 = SECOND.of(1.5)),
                [1500, 2000],
                "the swing needs lead_out_ms 888, and the firmware takes 0 to 500: take a faster or a stronger servo, or \
                 a lighter arm",
            ),
            (
                changed(|machine| machine.swing.pulse_for_90 = 2500.0),
                [1900, 2000],
                "the swing needs servo_out_us 2635, and the firmware takes 500 to 2500: \
                 take a longer arm, or fit the tool at another servo_in_us",
            ),
            (
                with_tool_of_100_mm(),
                [700, 600],
                "the swing needs servo_out_us 405, and the firmware takes 500 to 2500: \
                 take a longer arm, or fit the tool at another servo_in_us",
            ),
            (
                changed(|machine| {
                    machine.swing.arm_trails = 1;
                    machine.swing.widest_canopy = MM.of(450.0);
                    machine.intra_row.shank_length = MM.of(300.0);
                }),
                [1500, 2000],
                "the swing needs margin_mm 258, and the firmware takes 0 to 200: take a longer arm, or a pendulum",
            ),
        ] {
            let error = Swing::fitted(&machine, KG_CM.of(10.0), &board(pulses)).expect_err("it is refused");
            assert_eq!(error, problem);
        }
        // The file's pulse goes out of the range, but the board's tool swings to the other side.
        let machine = changed(|machine| machine.swing.pulse_in = 2300.0);
        assert!(Swing::of(&machine, KG_CM.of(10.0)).is_err());
        assert!(Swing::fitted(&machine, KG_CM.of(10.0), &board([2300, 1800])).is_ok());
    }

    #[test]
    fn a_trailing_arm_s_wider_margin_is_one_of_its_settings() {
        let mut machine = Machine::default();
        machine.intra_row.shank_length = MM.of(200.0);
        machine.swing.widest_canopy = MM.of(300.0);
        machine.swing.arm_trails = 1;
        let swing = Swing::of(&machine, KG_CM.of(5.6)).expect("it swings");
        assert!(swing.set_lines().ends_with(&["set margin_mm 175".to_owned()]), "{:?}", swing.set_lines());
        // A board whose margin is as wide keeps it.
        let mut board = Settings::new();
        board.set(Setting::MarginMm, 180).expect("it is in its range");
        let swing = Swing::fitted(&machine, KG_CM.of(5.6), &board).expect("it swings");
        assert_eq!((swing.arm_margin_mm, swing.margin_mm), (125, None));
    }

    #[test]
    fn a_machine_that_is_too_fast_and_sweeps_in_the_zone_are_named() {
        let words = |change: fn(&mut Machine)| {
            let (mut machine, torque) = (Machine::default(), KG_CM.of(39.4));
            change(&mut machine);
            Swing::of(&machine, torque).expect("it swings").sentences(&machine, torque).join(" ")
        };
        let slow_servo = words(|machine| machine.swing.servo_time_60 = SECOND.of(0.35));
        assert!(slow_servo.contains("2.5 km/h are 694 mm/s. Above 600 mm/s, alarm 3-1"), "{slow_servo}");
        assert!(words(|machine| machine.weeder.speed = KM_H.of(5.0)).contains("Above 1000 mm/s, alarm 3-1"));
        let inside = words(|machine| {
            (machine.swing.protected, machine.swing.sweep_from) = (MM.of(90.0), MM.of(20.0));
        });
        assert!(inside.contains("The sweeps run 25 mm inside the stem zone:"), "{inside}");
        let beside = words(|machine| {
            (machine.swing.protected, machine.swing.sweep_from) = (MM.of(90.0), MM.of(65.0));
        });
        assert!(beside.contains("The sweeps start 20 mm beside the stem zone's protected part."), "{beside}");
        assert!(words(|machine| machine.swing.sweep_from = MM.of(20.0)).contains("30 mm inside the protection zone"));
        let (usual, without) = (words(|_| ()), words(|machine| machine.inter_row.tools = 0));
        assert!(!usual.contains("alarm 3-1") && !usual.contains("The sweeps"), "{usual}");
        assert!(!without.contains("sweeps"), "{without}");
    }
}
