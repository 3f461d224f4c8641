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
    CM, COUNT, DEGREE, FACTOR, HECTARE_PER_HOUR, HP, KG_CM, KM_H, KPA, M, MM, MPA, NEWTON, NEWTON_METRE, RPM, WATT,
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

impl Verdict {
    /// Compares a figure with the result of its equation, from the machine alone and from the printed inputs. A figure
    /// is right if it is exact to half of its last digit, or off by less than half a percent.
    fn of(printed: f64, decimals: usize, calculated: f64, from_printed_inputs: f64) -> Self {
        let half_digit = 0.5 * 10_f64.powi(-(decimals as i32));
        let is = |value: f64| (printed - value).abs() <= half_digit.max(ROUNDING * value.abs());
        match () {
            () if is(calculated) => Self::Right,
            () if is(from_printed_inputs) => Self::Follows,
            () => Self::Wrong,
        }
    }
}

/// Makes the comparisons, each with the field of a design that holds the result:
/// `name, equation, printed value, unit, field: result for the printed inputs, remark`.
macro_rules! comparisons {
    ($paper:ident, $own:ident;
     $($name:literal, $equation:literal, $printed:literal, $unit:ident, $field:ident: $from_printed:expr, $remark:expr;)+) => {
        vec![$(Comparison::new(
            ($name, $equation),
            ($printed, $unit.name),
            $unit.value($from_printed),
            $unit.value($paper.$field),
            $own.map(|own| $unit.value(own.$field)),
            $remark.into(),
        )),+]
    };
}

impl Comparison {
    fn new(
        (name, equation): (&'static str, &'static str),
        (printed, unit): (&str, &'static str),
        from_printed_inputs: f64,
        calculated: f64,
        own: Option<f64>,
        remark: String,
    ) -> Self {
        let decimals = printed.split_once('.').map_or(0, |(_, decimals)| decimals.len());
        let printed = printed.parse().unwrap_or(f64::NAN);
        let verdict = Verdict::of(printed, decimals, calculated, from_printed_inputs);
        Self { name, equation, unit, printed, decimals, from_printed_inputs, calculated, own, verdict, remark }
    }
}

/// Compares the paper's figures with ours, and with those of a machine of one's own.
///
/// # Errors
/// If the machine of one's own cannot be calculated.
pub fn compare(own_machine: Option<&Machine>) -> Result<Vec<Comparison>, MachineError> {
    let Machine { weeder, soil, crop, shank, engine, chain, .. } = Machine::default();
    let (paper, own) = (Design::of(&Machine::default())?, own_machine.map(Design::of).transpose()?);

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
    let thickness_mm = MM.value((outer - inner) / 2.0);
    let thickness = Comparison::new(
        ("wheel thickness", "below Eq. 20"),
        ("3", MM.name),
        thickness_mm,
        thickness_mm,
        own_machine.map(|own| MM.value(own.wheel.rim_thickness)),
        "0.400 and 0.397 m were subtracted, not halved; the sheet of Table 1 has 3 mm".into(),
    );

    let (speed, width) = (KM_H.of(2.5), M.of(0.4));
    let capacity = format!(
        "of {} in theory; 0.041 would be a width of {}",
        written(speed * width, HECTARE_PER_HOUR),
        written(HECTARE_PER_HOUR.of(0.041) / weeder.field_efficiency / weeder.speed, M)
    );

    let mut comparisons = comparisons! { paper, own;
        "rolling resistance coefficient", "Eq. 5", "0.95", FACTOR, rolling_resistance_coefficient:
            eq::rolling_resistance_coefficient(21.95), "a slip of the decimal point";
        "rolling resistance", "Eq. 4", "605.77", NEWTON, rolling_resistance:
            0.95 * paper.weight, "from the coefficient 0.95";
        "draft", "Eq. 7", "453.7", NEWTON, draft: paper.draft, "";
        "acceleration force", "Eq. 8", "23", NEWTON, acceleration_force: paper.acceleration_force, "";
        "tractive force", "below Eq. 8", "1082.4", NEWTON, tractive_force:
            NEWTON.of(605.77) + NEWTON.of(453.7) + NEWTON.of(23.0), "from the rolling resistance";
        "power", "Eq. 9", "1503.3", WATT, power: power, "from 1082.4 N";
        "engine", "below Eq. 9", "2.24", HP, engine_power:
            power / engine.transmission_efficiency,
            format!("from 1082.4 N: the engine is {excess:.1} times too large");
        "soil force on the tool", "Eq. 10", "11.04", NEWTON, soil_force: paper.soil_force, "";
        "servo torque", "above Eq. 10", "3.86", NEWTON_METRE, servo_torque: paper.servo_torque, "";
        "servo torque", "above Eq. 10", "39.4", KG_CM, servo_torque: paper.servo_torque, "";
        "soil failure zone", "Eq. 11", "10", CM, failure_zone:
            paper.failure_zone, "30 cm less twice 5 cm; 10 cm would need rows 20 cm apart";
        "sweep width", "Eq. 12", "8", CM, sweep_width:
            eq::sweep_width(CM.of(10.0), soil.depth, soil.internal_friction), "neither of the two zones gives it";
        "apex angle", "Eq. 13", "120", DEGREE, apex_angle: paper.apex_angle, friction;
        "number of tools", "above Eq. 13", "5", COUNT, tools: eq::tools_that_fit(CM.of(40.0), CM.of(8.0)), "";
        "draft of one tool", "Eq. 14", "216.48", NEWTON, tool_draft: tractive_force / 5.0, "from 1082.4 N";
        "bending moment, between rows", "above Eq. 15", "345.6", NEWTON_METRE, inter_row_bending_moment:
            moment(40.0), "from the draft of one tool";
        "bending moment, in the row", "above Eq. 15", "302.4", NEWTON_METRE, intra_row_bending_moment:
            moment(35.0), "from the draft of one tool";
        "shank diameter, between rows", "Eq. 15, 16", "1.6", CM, inter_row_shank_diameter:
            diameter(inter_row_moment), stress(inter_row_moment, 1.6);
        "shank diameter, in the row", "Eq. 15, 16", "1.4", CM, intra_row_shank_diameter:
            diameter(intra_row_moment), stress(intra_row_moment, 1.4);
        "wheel speed", "Eq. 17", "33.17", RPM, wheel_speed: paper.wheel_speed, "with 3.14 for pi";
        "reduction by the chain", "below Eq. 17", "2.72", FACTOR, chain_reduction: reduction, "from 33 rpm";
        "driven sprocket", "below Eq. 17", "38", FACTOR, driven_teeth:
            eq::driven_teeth(chain.drive_teeth, reduction), "from 33 rpm";
        "chain links", "Eq. 18", "88", COUNT, chain_links:
            eq::even_links(links), format!("{}, rounded up to the next even number", digits(links));
        "chain length", "Eq. 19", "1118", MM, chain_length: 88.0 * chain.pitch, "";
    };
    comparisons.push(thickness);
    comparisons.extend(comparisons! { paper, own;
        "shear stress in the wheel", "Eq. 20", "293.5", KPA, shear_stress:
            shear(3.0), format!("from 1082 N with 3 mm; {thin} with 1.5 mm");
        "slope of the handle", "Eq. 21", "63.43", DEGREE, handle_angle: CM.of(80.0).atan2(CM.of(40.0)), "";
        "length of the handle", "below Eq. 21", "89.44", CM, handle_length: CM.of(80.0).hypot(CM.of(40.0)), "";
        "field capacity at 86.25 %", "Eq. 24, 25", "0.041", HECTARE_PER_HOUR, effective_capacity:
            eq::effective_capacity(speed, width, weeder.field_efficiency), capacity;
    });
    Ok(comparisons)
}
