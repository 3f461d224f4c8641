//! The swing of the tool in the row: its angle, pulse, time and lead.
//!
//! The angle is the smallest that clears the widest canopy, or the zone round a stem. Its time follows from the servo's
//! torque-speed line and the arm's moment of inertia. A shorter stroke takes less time and leaves more ground weeded.
//! With a stem zone, its settings follow as well. The zone is longer than the protected width, because a stem may stand
//! off the middle. Its leads are shorter, by what its circle allows at the top speed. The margin covers a wheel and a
//! servo that were not measured yet. Top speed and gap between pulses are the board's, or the firmware's defaults. If
//! the lead is too long for the beam's distance, the top speed is lowered. A trailing arm and a long blade need a wider
//! margin.
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
//! out. The servo's own inertia is in its data sheet's time. Play along the swing, and a supply that gives way, are in no
//! calculation: time the servo. Play across the row belongs to the room.

mod sentences;

use crate::arm::{SwungArm, turn_ms};
use crate::machine::{Machine, SwingInputs};
use crate::unit::{KG_CM, MM};
use link::settings::{Setting, Settings, allowed_top_speed, explain, name, working_speed};
use serde::Serialize;
use set_up::{blade_excess_mm, circle, saved_ms, stem_excess_mm};
use uom::si::f64::{Time, Torque};
use uom::si::time::second;

/// How far beyond the stroke the outer stop is, as docs/build.md has it.
const STOP_DEGREES: f64 = 5.0;

/// The most that a pulse delays a command, besides the gap after it, ms.
const PULSE_MS: f64 = 3.0;

/// The most that fixed frames delay it, without a shortest gap, ms.
const FRAME_MS: f64 = 20.0;

/// How far the tool that is out has to be beside the circle of the stem zone, mm.
const BESIDE_ZONE_MM: f64 = 1.0;

/// Pulses are whole steps of this, us, rounded outwards.
const PULSE_STEP_US: f64 = 5.0;

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
    /// Height up to which a plant's zone is clear of a pendulum that is out, mm, rounded down; 0 for a trailing arm. The
    /// plant stands nearer to the arm than the row's line, by the whole room.
    pub clear_height_mm: f64,
    /// A lower top speed, mm/s, at which the beam sees a plant early enough for the lead. `None` if none is needed.
    pub top_speed_mm_s: Option<u32>,
    /// The top speed with these settings, mm/s: the lower one, or the board's.
    pub highest_mm_s: u32,
    /// With a second beam, the speed up to which the tool works, mm/s. `None` if that is the top speed, or without one.
    pub working_mm_s: Option<u32>,
    /// Distance from beam to tool for which these speeds hold, mm.
    pub beam_to_tool_mm: u32,
    /// Lead of the command to leave the row, ms.
    pub lead_out_ms: u32,
    /// Lead of the command to come back, ms.
    pub lead_in_ms: u32,
    /// How much wider the margin has to be because a trailing arm carries the tool along the row, mm; 0 for a pendulum.
    pub arm_margin_mm: u32,
    /// Half of the blade's length along the row, mm, a part of the measured margin.
    pub blade_mm: f64,
    /// How much wider than the default the margin has to be for a long blade, mm; 0 if the default is enough.
    pub blade_margin_mm: u32,
    /// The same for stems that stand far off the middle of their canopies, mm.
    pub stem_margin_mm: u32,
    /// The margin that arm, blade and stems need, mm. `None` if the default is enough, or if the board's is as wide.
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
        let (protected_mm, room_mm) = (MM.value(inputs.protected), MM.value(inputs.room));
        let stem_zone_mm = if protected_mm > 0.0 { (protected_mm + MM.value(inputs.stem_off)).ceil() } else { 0.0 };
        let beside_mm = kept_mm(machine) / 2.0 + room_mm;
        // The firmware keeps a circle that is as wide across the row as along it.
        let beside_mm = if stem_zone_mm > 0.0 { beside_mm.max(stem_zone_mm / 2.0 + BESIDE_ZONE_MM) } else { beside_mm };
        let aside_mm = beside_mm + tool_mm / 2.0;
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
        let (arm, loaded_ms) = (SwungArm::of(machine), turn_ms(machine, angle_degrees, load));
        let dead_ms = |time: Time| 1000.0 * time.get::<second>();
        let from_mm = MM.value(inputs.sweep_from);
        let gap_ms = settings.get(Setting::ServoGapMs);
        let wait_ms = PULSE_MS + if gap_ms == 0 { FRAME_MS } else { f64::from(gap_ms) };
        let lead_out_ms = dead_ms(inputs.most_dead_time.max(inputs.least_dead_time)) + loaded_ms + wait_ms;
        // As in `set_up`: a speed that is raised again needs no longer leads.
        let top_speed_mm_s = f64::from(settings.get(Setting::TopSpeedMmS).max(Setting::TopSpeedMmS.default()));
        let (sine, cosine) = angle_degrees.to_radians().sin_cos();
        let (aside_of_stroke_mm, stroke_mm) = (arm_mm * sine, arm_mm * (1.0 - cosine));
        let edge_mm = stroke_mm - tool_mm / 2.0 * sine;
        let stop_kg_cm = arm.weight_kg_cm * (angle_degrees + STOP_DEGREES).to_radians().sin();
        let shank_mm = MM.value(machine.intra_row.shank_diameter);
        let axis_mm = arm_mm - MM.value(machine.soil.depth);
        let clear_mm = axis_mm - ((kept_mm(machine) + 2.0 * room_mm) * cosine + shank_mm) / 2.0 / sine;
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
        let blade_mm = MM.value(machine.intra_row.blade_base) / 2.0;
        let blade_margin_mm = blade_excess_mm(2.0 * blade_mm);
        let stem_margin_mm = if stem_zone_mm > 0.0 { stem_excess_mm(MM.value(inputs.stem_off)) } else { 0.0 };
        // The board's margin may be measured, and then it has these parts.
        let board_mm = f64::from(settings.get(Setting::MarginMm));
        let wider_mm = arm_margin_mm + blade_margin_mm + stem_margin_mm;
        let wide_mm = if wider_mm > 0.0 { f64::from(Setting::MarginMm.default()) + wider_mm } else { 0.0 };
        let wide_advice = if stem_margin_mm > blade_margin_mm.max(arm_margin_mm) {
            "keep whole canopies, with `protected` 0"
        } else if blade_margin_mm > arm_margin_mm {
            "take a blade that is shorter along the row"
        } else {
            "take a longer arm, or a pendulum"
        };
        let mut after = settings.clone();
        for (setting, value, advice) in [
            (Setting::ServoInUs, in_us, "fit the tool at another pulse"),
            (Setting::ServoOutUs, out_us, "take a longer arm, or fit the tool at another servo_in_us"),
            (Setting::LeadOutMs, lead_out_ms, "take a faster or a stronger servo, or a lighter arm"),
            (Setting::LeadInMs, lead_in_ms, "take a servo with a shorter dead time"),
            (Setting::MarginMm, wide_mm.max(board_mm), wide_advice),
            (Setting::StemZoneMm, stem_zone_mm, "take the stem's zone from younger plants"),
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
        let allowed_mm_s = allowed_top_speed(&after).map_err(explain)?;
        Ok(Self {
            stem_zone_mm: stem_zone_mm as u32,
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
            working_mm_s: working_speed(&after).filter(|&mm_s| mm_s < allowed_mm_s).map(u32::from),
            beam_to_tool_mm: after.get(Setting::BeamToToolMm).into(),
            lead_out_ms: lead_out_ms as u32,
            lead_in_ms: lead_in_ms as u32,
            arm_margin_mm: arm_margin_mm as u32,
            blade_mm,
            blade_margin_mm: blade_margin_mm as u32,
            stem_margin_mm: stem_margin_mm as u32,
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
mod tests;
