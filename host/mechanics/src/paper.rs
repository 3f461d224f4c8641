//! The paper's printed figures beside the results of its equations, with a verdict on each.
//!
//! Each figure is calculated twice: from the printed inputs, including earlier printed results, and from the machine
//! alone. So an error can be distinguished from a consequence of an earlier error. `weeder design --against-paper`
//! prints them.

use crate::design::Design;
use crate::equations as eq;
use crate::figure::{digits, written};
use crate::machine::{Machine, MachineError};
use crate::unit::{
    CM, COUNT, DEGREE, FACTOR, HECTARE_PER_HOUR, HP, KG_CM, KM_H, KPA, M, MM, MPA, NEWTON, NEWTON_METRE, RPM, Unit,
    WATT,
};
use serde::Serialize;

/// Whether a printed figure is right.
#[derive(Clone, Copy, Debug, PartialEq, Eq, Serialize)]
#[serde(rename_all = "snake_case")]
pub enum Verdict {
    /// The equation gives it.
    Right,
    /// It follows from an earlier wrong figure.
    Follows,
    /// The equation gives another value, even from the printed inputs.
    Wrong,
}

/// A printed figure beside ours.
#[derive(Clone, Debug, PartialEq, Serialize)]
pub struct Comparison {
    /// Its name.
    pub name: &'static str,
    /// Its equation in the paper.
    pub equation: &'static str,
    /// Unit of all its values; empty for plain numbers.
    pub unit: &'static str,
    /// The printed value.
    pub printed: f64,
    /// Decimals that the paper prints.
    #[serde(skip)]
    pub decimals: usize,
    /// The result of the equation for the printed inputs.
    pub from_printed_inputs: f64,
    /// The result if all earlier values are calculated too.
    pub calculated: f64,
    /// The same for the user's own machine.
    #[serde(skip_serializing_if = "Option::is_none")]
    pub own: Option<f64>,
    /// Whether the printed figure is right.
    pub verdict: Verdict,
    /// The reason for a difference, or a note; may be empty.
    pub remark: String,
}

/// Allowed relative deviation of a printed figure, if intermediate results were rounded.
const ROUNDING: f64 = 0.005;

/// The paper's machine, and the user's own.
struct Designs {
    paper: Design,
    own: Option<Design>,
}

/// A figure's name, equation and printed value, and its value in both designs.
struct Figure<Q>((&'static str, &'static str, &'static str), Unit<Q>, Q, Option<Q>);

impl Designs {
    fn figure<Q>(
        &self,
        printed: (&'static str, &'static str, &'static str),
        unit: Unit<Q>,
        result: fn(&Design) -> Q,
    ) -> Figure<Q> {
        Figure(printed, unit, result(&self.paper), self.own.as_ref().map(result))
    }
}

impl<Q> Figure<Q> {
    /// The comparison with the result of the equation for the printed inputs. The printed figure is right if it is exact
    /// to half of its last digit, or off by less than half a percent.
    fn from(self, printed_inputs: Q, remark: impl Into<String>) -> Comparison {
        let Self((name, equation, printed), unit, calculated, own) = self;
        let decimals = printed.split_once('.').map_or(0, |(_, decimals)| decimals.len());
        let printed: f64 = printed.parse().unwrap_or(f64::NAN);
        let [from_printed_inputs, calculated] = [printed_inputs, calculated].map(|value| unit.value(value));
        let half_digit = 0.5 * 10_f64.powi(-(decimals as i32));
        let is = |value: f64| (printed - value).abs() <= half_digit.max(ROUNDING * value.abs());
        let verdict = match (is(calculated), is(from_printed_inputs)) {
            (true, _) => Verdict::Right,
            (false, true) => Verdict::Follows,
            (false, false) => Verdict::Wrong,
        };
        let (unit, own, remark) = (unit.name, own.map(|own| unit.value(own)), remark.into());
        Comparison { name, equation, unit, printed, decimals, from_printed_inputs, calculated, own, verdict, remark }
    }
}

/// Compares the paper's figures with ours, and with those of the user's own machine.
///
/// # Errors
/// If that machine cannot be calculated.
pub fn compare(own_machine: Option<&Machine>) -> Result<Vec<Comparison>, MachineError> {
    let Machine { weeder, soil, crop, shank, engine, chain, .. } = Machine::default();
    let both = Designs { paper: Design::of(&Machine::default())?, own: own_machine.map(Design::of).transpose()? };
    let paper = &both.paper;

    // The printed tractive force. Many other figures depend on it.
    let tractive_force = NEWTON.of(1082.4);
    let power = eq::power(tractive_force, weeder.speed, engine.safety_factor);
    let excess = f64::from(engine.power / paper.engine_power);

    let friction = written(eq::weed_friction_for(DEGREE.of(120.0)), DEGREE);
    let friction = format!("it needs a friction angle of {friction}, not {}", written(crop.weed_friction, DEGREE));

    let (inter_row_moment, intra_row_moment) = (NEWTON_METRE.of(345.6), NEWTON_METRE.of(302.4));
    let moment =
        |length_cm| eq::bending_moment(NEWTON.of(216.0), shank.impact_factor, shank.safety_factor, CM.of(length_cm));
    let diameter = |moment| eq::rod_diameter(moment, shank.allowed_stress);
    let stress = |moment, diameter_cm: f64| {
        let stress = written(eq::bending_stress(moment, CM.of(diameter_cm)), MPA);
        format!("{diameter_cm} cm would bear {stress}, {} are allowed", written(shank.allowed_stress, MPA))
    };

    let reduction = eq::chain_reduction(engine.speed, engine.gear_box_ratio, RPM.of(33.0));
    let links = eq::chain_links(14, 38, MM.of(379.0), chain.pitch);

    let (outer, inner) = (M.of(0.400), M.of(0.397));
    let torque = eq::wheel_torque(NEWTON.of(1082.0), outer);
    let shear = |thickness_mm| eq::shear_stress(torque, outer, MM.of(thickness_mm));
    let thin = written(shear(1.5), KPA);
    // The default machine has the sheet of Table 1, so both columns start from the diameters of the text.
    let thickness = (outer - inner) / 2.0;
    let printed = ("wheel thickness", "below Eq. 20", "3");
    let thickness = Figure(printed, MM, thickness, own_machine.map(|own| own.wheel.rim_thickness))
        .from(thickness, "0.400 and 0.397 m were subtracted, not halved; the sheet of Table 1 has 3 mm");

    let (speed, width) = (KM_H.of(2.5), M.of(0.4));
    let capacity = format!(
        "of {} in theory; 0.041 would be a width of {}",
        written(speed * width, HECTARE_PER_HOUR),
        written(HECTARE_PER_HOUR.of(0.041) / weeder.field_efficiency / weeder.speed, M)
    );

    Ok(vec![
        both.figure(("rolling resistance coefficient", "Eq. 5", "0.95"), FACTOR, |of| {
            of.rolling_resistance_coefficient
        })
        .from(eq::rolling_resistance_coefficient(21.95), "a slip of the decimal point"),
        both.figure(("rolling resistance", "Eq. 4", "605.77"), NEWTON, |of| of.rolling_resistance)
            .from(0.95 * paper.weight, "from the coefficient 0.95"),
        both.figure(("draft", "Eq. 7", "453.7"), NEWTON, |of| of.draft).from(paper.draft, ""),
        both.figure(("acceleration force", "Eq. 8", "23"), NEWTON, |of| of.acceleration_force)
            .from(paper.acceleration_force, ""),
        both.figure(("tractive force", "below Eq. 8", "1082.4"), NEWTON, |of| of.tractive_force)
            .from(NEWTON.of(605.77) + NEWTON.of(453.7) + NEWTON.of(23.0), "from the rolling resistance"),
        both.figure(("power", "Eq. 9", "1503.3"), WATT, |of| of.power).from(power, "from 1082.4 N"),
        both.figure(("engine", "below Eq. 9", "2.24"), HP, |of| of.engine_power).from(
            power / engine.transmission_efficiency,
            format!("from 1082.4 N: the engine is {excess:.1} times too large"),
        ),
        both.figure(("soil force on the tool", "Eq. 10", "11.04"), NEWTON, |of| of.soil_force)
            .from(paper.soil_force, ""),
        both.figure(("servo torque", "above Eq. 10", "3.86"), NEWTON_METRE, |of| of.servo_torque)
            .from(paper.servo_torque, ""),
        both.figure(("servo torque", "above Eq. 10", "39.4"), KG_CM, |of| of.servo_torque).from(paper.servo_torque, ""),
        both.figure(("soil failure zone", "Eq. 11", "10"), CM, |of| of.failure_zone)
            .from(paper.failure_zone, "30 cm less twice 5 cm; 10 cm would need rows 20 cm apart"),
        both.figure(("sweep width", "Eq. 12", "8"), CM, |of| of.sweep_width).from(
            eq::sweep_width(CM.of(10.0), soil.depth, soil.internal_friction),
            "neither of the two zones gives it",
        ),
        both.figure(("apex angle", "Eq. 13", "120"), DEGREE, |of| of.apex_angle).from(paper.apex_angle, friction),
        both.figure(("number of tools", "above Eq. 13", "5"), COUNT, |of| of.tools)
            .from(eq::tools_that_fit(CM.of(40.0), CM.of(8.0)), ""),
        both.figure(("draft of one tool", "Eq. 14", "216.48"), NEWTON, |of| of.tool_draft)
            .from(tractive_force / 5.0, "from 1082.4 N"),
        both.figure(("bending moment, between rows", "above Eq. 15", "345.6"), NEWTON_METRE, |of| {
            of.inter_row_bending_moment
        })
        .from(moment(40.0), "from the draft of one tool"),
        both.figure(("bending moment, in the row", "above Eq. 15", "302.4"), NEWTON_METRE, |of| {
            of.intra_row_bending_moment
        })
        .from(moment(35.0), "from the draft of one tool"),
        both.figure(("shank diameter, between rows", "Eq. 15, 16", "1.6"), CM, |of| of.inter_row_shank_diameter)
            .from(diameter(inter_row_moment), stress(inter_row_moment, 1.6)),
        both.figure(("shank diameter, in the row", "Eq. 15, 16", "1.4"), CM, |of| of.intra_row_shank_diameter)
            .from(diameter(intra_row_moment), stress(intra_row_moment, 1.4)),
        both.figure(("wheel speed", "Eq. 17", "33.17"), RPM, |of| of.wheel_speed)
            .from(paper.wheel_speed, "with 3.14 for pi"),
        both.figure(("reduction by the chain", "below Eq. 17", "2.72"), FACTOR, |of| of.chain_reduction)
            .from(reduction, "from 33 rpm"),
        both.figure(("driven sprocket", "below Eq. 17", "38"), FACTOR, |of| of.driven_teeth)
            .from(eq::driven_teeth(chain.drive_teeth, reduction), "from 33 rpm"),
        both.figure(("chain links", "Eq. 18", "88"), COUNT, |of| of.chain_links)
            .from(eq::even_links(links), format!("{}, rounded up to the next even number", digits(links))),
        both.figure(("chain length", "Eq. 19", "1118"), MM, |of| of.chain_length).from(88.0 * chain.pitch, ""),
        thickness,
        both.figure(("shear stress in the wheel", "Eq. 20", "293.5"), KPA, |of| of.shear_stress)
            .from(shear(3.0), format!("from 1082 N with 3 mm; {thin} with 1.5 mm")),
        both.figure(("slope of the handle", "Eq. 21", "63.43"), DEGREE, |of| of.handle_angle)
            .from(CM.of(80.0).atan2(CM.of(40.0)), ""),
        both.figure(("length of the handle", "below Eq. 21", "89.44"), CM, |of| of.handle_length)
            .from(CM.of(80.0).hypot(CM.of(40.0)), ""),
        both.figure(("field capacity at 86.25 %", "Eq. 24, 25", "0.041"), HECTARE_PER_HOUR, |of| of.effective_capacity)
            .from(eq::effective_capacity(speed, width, weeder.field_efficiency), capacity),
    ])
}
