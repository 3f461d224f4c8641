//! The paper's printed figures beside the results of its equations, with a verdict on each.
//!
//! Each figure is calculated twice: from the printed inputs, including earlier printed results, and from the machine
//! alone. So an error can be distinguished from a consequence of an earlier error. `weeder design --against-paper`
//! prints them.

use crate::design::Design;
use crate::figure::{digits, written};
use crate::machine::{Machine, MachineError};
use crate::unit::{
    CM, COUNT, DEGREE, FACTOR, HECTARE_PER_HOUR, HP, KG_CM, KM_H, KPA, M, MM, MPA, NEWTON, NEWTON_METRE, RPM, Unit,
    WATT,
};
use crate::{capacity, drive, handle, shank, tool, traction, wheel};
use serde::Serialize;
use uom::si::f64::Ratio;

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

/// The two machines that are compared with the paper's figures.
struct Machines {
    paper: Design,
    own: Option<Design>,
}

impl Machines {
    /// One row. `printed` is the figure and its decimals. `from_printed_inputs` is the equation's result for the
    /// printed inputs. `calculated` finds the result in a design.
    fn compare<Q>(
        &self,
        (name, equation): (&'static str, &'static str),
        (printed, decimals): (f64, usize),
        unit: Unit<Q>,
        from_printed_inputs: Q,
        calculated: impl Fn(&Design) -> Q,
        remark: impl Into<String>,
    ) -> Comparison {
        let from_printed_inputs = unit.value(from_printed_inputs);
        let own = self.own.as_ref().map(|own| unit.value(calculated(own)));
        let calculated = unit.value(calculated(&self.paper));
        let verdict = Verdict::of(printed, decimals, calculated, from_printed_inputs);
        let remark = remark.into();
        Comparison {
            name,
            equation,
            unit: unit.name,
            printed,
            decimals,
            from_printed_inputs,
            calculated,
            own,
            verdict,
            remark,
        }
    }
}

/// Compares the paper's figures with ours, and with those of a machine of one's own.
///
/// # Errors
/// If the machine of one's own cannot be calculated.
pub fn compare(own: Option<&Machine>) -> Result<Vec<Comparison>, MachineError> {
    let machines = Machines { paper: Design::of(&Machine::default())?, own: own.map(Design::of).transpose()? };
    let mut comparisons = traction(&machines);
    comparisons.extend(tools(&machines));
    comparisons.extend(shanks(&machines));
    comparisons.extend(drive(&machines));
    comparisons.extend(wheel_and_handle(&machines));
    comparisons.extend(capacity(&machines));
    Ok(comparisons)
}

/// The printed tractive force. Many other figures depend on it.
const PRINTED_TRACTIVE_FORCE_N: f64 = 1082.4;

fn traction(machines: &Machines) -> Vec<Comparison> {
    let Machine { weeder, engine, .. } = Machine::default();
    let paper = &machines.paper;
    let tractive_force = NEWTON.of(PRINTED_TRACTIVE_FORCE_N);
    let power = traction::power(tractive_force, weeder.speed, engine.safety_factor);
    let excess = f64::from(engine.power / paper.engine_power);
    let from_tractive_force = format!("from {PRINTED_TRACTIVE_FORCE_N} N");
    vec![
        machines.compare(
            ("rolling resistance coefficient", "Eq. 5"),
            (0.95, 2),
            FACTOR,
            f64::from(traction::rolling_resistance_coefficient(Ratio::from(21.95))),
            |design| f64::from(design.rolling_resistance_coefficient),
            "a slip of the decimal point",
        ),
        machines.compare(
            ("rolling resistance", "Eq. 4"),
            (605.77, 2),
            NEWTON,
            traction::rolling_resistance(Ratio::from(0.95), paper.weight),
            |design| design.rolling_resistance,
            "from the coefficient 0.95",
        ),
        machines.compare(("draft", "Eq. 7"), (453.7, 1), NEWTON, paper.draft, |design| design.draft, ""),
        machines.compare(
            ("acceleration force", "Eq. 8"),
            (23.0, 0),
            NEWTON,
            paper.acceleration_force,
            |design| design.acceleration_force,
            "",
        ),
        machines.compare(
            ("tractive force", "below Eq. 8"),
            (PRINTED_TRACTIVE_FORCE_N, 1),
            NEWTON,
            traction::tractive_force(NEWTON.of(605.77), NEWTON.of(453.7), NEWTON.of(23.0)),
            |design| design.tractive_force,
            "from the rolling resistance",
        ),
        machines.compare(
            ("power", "Eq. 9"),
            (1503.3, 1),
            WATT,
            power,
            |design| design.power,
            from_tractive_force.as_str(),
        ),
        machines.compare(
            ("engine", "below Eq. 9"),
            (2.24, 2),
            HP,
            traction::engine_power(power, engine.transmission_efficiency),
            |design| design.engine_power,
            format!("{from_tractive_force}: the engine is {excess:.1} times too large"),
        ),
    ]
}

fn tools(machines: &Machines) -> Vec<Comparison> {
    let Machine { soil, crop, .. } = Machine::default();
    let paper = &machines.paper;
    let printed_zone = CM.of(10.0);
    vec![
        machines.compare(
            ("soil force on the tool", "Eq. 10"),
            (11.04, 2),
            NEWTON,
            paper.soil_force,
            |design| design.soil_force,
            "",
        ),
        machines.compare(
            ("servo torque", "above Eq. 10"),
            (3.86, 2),
            NEWTON_METRE,
            paper.servo_torque,
            |design| design.servo_torque,
            "",
        ),
        machines.compare(
            ("servo torque", "above Eq. 10"),
            (39.4, 1),
            KG_CM,
            paper.servo_torque,
            |design| design.servo_torque,
            "",
        ),
        machines.compare(
            ("soil failure zone", "Eq. 11"),
            (10.0, 0),
            CM,
            tool::failure_zone(crop.row_spacing, crop.protection_zone),
            |design| design.failure_zone,
            "30 cm less twice 5 cm; 10 cm would need rows 20 cm apart",
        ),
        machines.compare(
            ("sweep width", "Eq. 12"),
            (8.0, 0),
            CM,
            tool::sweep_width(printed_zone, soil.depth, soil.internal_friction),
            |design| design.sweep_width,
            "neither of the two zones gives it",
        ),
        machines.compare(
            ("apex angle", "Eq. 13"),
            (120.0, 0),
            DEGREE,
            tool::apex_angle(crop.weed_friction),
            |design| design.apex_angle,
            format!(
                "it needs a friction angle of {}, not {}",
                written(tool::weed_friction_for(DEGREE.of(120.0)), DEGREE),
                written(crop.weed_friction, DEGREE)
            ),
        ),
        machines.compare(
            ("number of tools", "above Eq. 13"),
            (5.0, 0),
            COUNT,
            tool::tools_that_fit(CM.of(40.0), CM.of(8.0)),
            |design| design.tools_that_fit,
            "",
        ),
        machines.compare(
            ("draft of one tool", "Eq. 14"),
            (216.48, 2),
            NEWTON,
            tool::tool_draft(NEWTON.of(PRINTED_TRACTIVE_FORCE_N), 5),
            |design| design.tool_draft,
            format!("from {PRINTED_TRACTIVE_FORCE_N} N"),
        ),
    ]
}

fn shanks(machines: &Machines) -> Vec<Comparison> {
    let steel = Machine::default().shank;
    let (inter_row_moment, intra_row_moment) = (NEWTON_METRE.of(345.6), NEWTON_METRE.of(302.4));
    let moment = |length_cm: f64| {
        shank::bending_moment(NEWTON.of(216.0), steel.impact_factor, steel.safety_factor, CM.of(length_cm))
    };
    let stress = |moment, diameter_cm: f64| {
        let stress = written(shank::bending_stress(moment, CM.of(diameter_cm)), MPA);
        format!("{diameter_cm} cm would bear {stress}, {} are allowed", written(steel.allowed_stress, MPA))
    };
    vec![
        machines.compare(
            ("bending moment, between rows", "above Eq. 15"),
            (345.6, 1),
            NEWTON_METRE,
            moment(40.0),
            |design| design.inter_row_shank.bending_moment,
            "from the draft of one tool",
        ),
        machines.compare(
            ("bending moment, in the row", "above Eq. 15"),
            (302.4, 1),
            NEWTON_METRE,
            moment(35.0),
            |design| design.intra_row_shank.bending_moment,
            "from the draft of one tool",
        ),
        machines.compare(
            ("shank diameter, between rows", "Eq. 15, 16"),
            (1.6, 1),
            CM,
            shank::diameter(inter_row_moment, steel.allowed_stress),
            |design| design.inter_row_shank.diameter,
            stress(inter_row_moment, 1.6),
        ),
        machines.compare(
            ("shank diameter, in the row", "Eq. 15, 16"),
            (1.4, 1),
            CM,
            shank::diameter(intra_row_moment, steel.allowed_stress),
            |design| design.intra_row_shank.diameter,
            stress(intra_row_moment, 1.4),
        ),
    ]
}

fn drive(machines: &Machines) -> Vec<Comparison> {
    let Machine { engine, chain, .. } = Machine::default();
    let paper = &machines.paper;
    let reduction = drive::chain_reduction(engine.speed, engine.gear_box_ratio, RPM.of(33.0));
    let links = drive::chain_links(14, 38, MM.of(379.0), chain.pitch);
    vec![
        machines.compare(
            ("wheel speed", "Eq. 17"),
            (33.17, 2),
            RPM,
            paper.wheel_speed,
            |design| design.wheel_speed,
            "with 3.14 for pi",
        ),
        machines.compare(
            ("reduction by the chain", "below Eq. 17"),
            (2.72, 2),
            FACTOR,
            reduction,
            |design| design.chain_reduction,
            "from 33 rpm",
        ),
        machines.compare(
            ("driven sprocket", "below Eq. 17"),
            (38.0, 0),
            FACTOR,
            drive::driven_teeth(chain.drive_teeth, reduction),
            |design| design.exact_driven_teeth,
            "from 33 rpm",
        ),
        machines.compare(
            ("chain links", "Eq. 18"),
            (88.0, 0),
            COUNT,
            drive::even_links(links),
            |design| design.chain_links,
            format!("{}, rounded up to the next even number", digits(links)),
        ),
        machines.compare(
            ("chain length", "Eq. 19"),
            (1118.0, 0),
            MM,
            drive::chain_length(88, chain.pitch),
            |design| design.chain_length,
            "",
        ),
    ]
}

fn wheel_and_handle(machines: &Machines) -> Vec<Comparison> {
    let (outer, inner) = (M.of(0.400), M.of(0.397));
    let torque = wheel::torque(NEWTON.of(1082.0), outer);
    let stress =
        |thickness_mm: f64| wheel::shear_stress(torque, outer, wheel::inner_diameter(outer, MM.of(thickness_mm)));
    let thickness = wheel::thickness(outer, inner);
    let (elbow_height, operator_distance) = (CM.of(80.0), CM.of(40.0));
    vec![
        // The default machine has the sheet of Table 1, so both columns start from the diameters of the text.
        Comparison {
            calculated: MM.value(thickness),
            verdict: Verdict::of(3.0, 0, MM.value(thickness), MM.value(thickness)),
            ..machines.compare(
                ("wheel thickness", "below Eq. 20"),
                (3.0, 0),
                MM,
                thickness,
                |design| design.rim_thickness,
                "0.400 and 0.397 m were subtracted, not halved; the sheet of Table 1 has 3 mm",
            )
        },
        machines.compare(
            ("shear stress in the wheel", "Eq. 20"),
            (293.5, 1),
            KPA,
            stress(3.0),
            |design| design.shear_stress,
            format!("from 1082 N with 3 mm; {} with 1.5 mm", written(stress(1.5), KPA)),
        ),
        machines.compare(
            ("slope of the handle", "Eq. 21"),
            (63.43, 2),
            DEGREE,
            handle::angle(elbow_height, operator_distance),
            |design| design.handle_angle,
            "",
        ),
        machines.compare(
            ("length of the handle", "below Eq. 21"),
            (89.44, 2),
            CM,
            handle::length(elbow_height, operator_distance),
            |design| design.handle_length,
            "",
        ),
    ]
}

fn capacity(machines: &Machines) -> Vec<Comparison> {
    let weeder = Machine::default().weeder;
    let theoretical = capacity::theoretical(KM_H.of(2.5), M.of(0.4));
    let width = HECTARE_PER_HOUR.of(0.041) / weeder.field_efficiency / weeder.speed;
    vec![machines.compare(
        ("field capacity at 86.25 %", "Eq. 24, 25"),
        (0.041, 3),
        HECTARE_PER_HOUR,
        capacity::effective(theoretical, weeder.field_efficiency),
        |design| design.effective_capacity,
        format!(
            "of {} in theory; 0.041 would be a width of {}",
            written(theoretical, HECTARE_PER_HOUR),
            written(width, M)
        ),
    )]
}
