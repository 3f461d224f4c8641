//! Quantities as people write them: a number and a unit, such as `"400 mm"`.
//!
//! The quantities are those of [`uom`], so a force cannot be added to a length. A [`Unit`] connects a name with one of
//! them. [`Written`] lists the valid units of a kind of quantity. Numbers without a unit, such as a number of teeth,
//! use the same code. The ranges of values are the machine's.
//!
//! The parser is written here because `uom` has neither `kg cm` nor `ha/h`, and does not list the valid units in its
//! errors.

use serde::Deserializer;
use serde::de::Visitor;
use std::fmt::{self, Display, Formatter};
use std::marker::PhantomData;
use uom::si::diffusion_coefficient::square_meter_per_second;
use uom::si::f64::{
    Angle, AngularVelocity, DiffusionCoefficient, Force, Length, Mass, Power, Pressure, Ratio, Time, Torque, Velocity,
};
use uom::si::{
    angle::{degree, radian},
    angular_velocity::revolution_per_minute,
    force::newton,
    length::{centimeter, meter, millimeter},
    mass::{gram, kilogram},
    power::{horsepower, kilowatt, watt},
    pressure::{kilopascal, megapascal, pascal},
    ratio::percent,
    time::{millisecond, second},
    torque::{kilogram_force_meter, newton_meter},
    velocity::{kilometer_per_hour, meter_per_second},
};

/// Area in a time, which `uom` knows by the name of another quantity of the same dimension.
pub type AreaRate = DiffusionCoefficient;

/// A unit that a quantity may be written in.
#[derive(Clone, Copy, Debug)]
pub struct Unit<Q> {
    /// Its text behind the number; empty for plain numbers.
    pub name: &'static str,
    of: fn(f64) -> Q,
    value: fn(&Q) -> f64,
}

impl<Q> Unit<Q> {
    /// The quantity that is `value` of this unit.
    pub fn of(&self, value: f64) -> Q {
        (self.of)(value)
    }

    /// How many of this unit a quantity is.
    pub fn value(&self, quantity: Q) -> f64 {
        (self.value)(&quantity)
    }
}

const fn unit<Q>(name: &'static str, of: fn(f64) -> Q, value: fn(&Q) -> f64) -> Unit<Q> {
    Unit { name, of, value }
}

/// A kind of quantity that can be read from text.
pub trait Written: Copy + 'static {
    /// The kind, with its article.
    const KIND: &'static str;
    /// Its valid units; a single unit without a name for plain numbers.
    const UNITS: &'static [Unit<Self>];
}

/// Millimetre.
pub const MM: Unit<Length> = unit("mm", Length::new::<millimeter>, Length::get::<millimeter>);
/// Centimetre.
pub const CM: Unit<Length> = unit("cm", Length::new::<centimeter>, Length::get::<centimeter>);
/// Metre.
pub const M: Unit<Length> = unit("m", Length::new::<meter>, Length::get::<meter>);

impl Written for Length {
    const KIND: &'static str = "a length";
    const UNITS: &'static [Unit<Self>] = &[MM, CM, M];
}

/// Kilogram.
pub const KG: Unit<Mass> = unit("kg", Mass::new::<kilogram>, Mass::get::<kilogram>);

impl Written for Mass {
    const KIND: &'static str = "a mass";
    const UNITS: &'static [Unit<Self>] = &[KG, unit("g", Mass::new::<gram>, Mass::get::<gram>)];
}

/// Second.
pub const SECOND: Unit<Time> = unit("s", Time::new::<second>, Time::get::<second>);

impl Written for Time {
    const KIND: &'static str = "a time";
    const UNITS: &'static [Unit<Self>] = &[SECOND, unit("ms", Time::new::<millisecond>, Time::get::<millisecond>)];
}

/// Kilometre per hour.
pub const KM_H: Unit<Velocity> = unit("km/h", Velocity::new::<kilometer_per_hour>, Velocity::get::<kilometer_per_hour>);

impl Written for Velocity {
    const KIND: &'static str = "a speed";
    const UNITS: &'static [Unit<Self>] =
        &[KM_H, unit("m/s", Velocity::new::<meter_per_second>, Velocity::get::<meter_per_second>)];
}

/// Turn per minute.
pub const RPM: Unit<AngularVelocity> =
    unit("rpm", AngularVelocity::new::<revolution_per_minute>, AngularVelocity::get::<revolution_per_minute>);

impl Written for AngularVelocity {
    const KIND: &'static str = "a speed of rotation";
    const UNITS: &'static [Unit<Self>] = &[RPM];
}

/// Degree.
pub const DEGREE: Unit<Angle> = unit("degrees", Angle::new::<degree>, Angle::get::<degree>);

impl Written for Angle {
    const KIND: &'static str = "an angle";
    const UNITS: &'static [Unit<Self>] = &[
        DEGREE,
        unit("°", Angle::new::<degree>, Angle::get::<degree>),
        unit("rad", Angle::new::<radian>, Angle::get::<radian>),
    ];
}

/// Kilopascal.
pub const KPA: Unit<Pressure> = unit("kPa", Pressure::new::<kilopascal>, Pressure::get::<kilopascal>);
/// Megapascal.
pub const MPA: Unit<Pressure> = unit("MPa", Pressure::new::<megapascal>, Pressure::get::<megapascal>);

impl Written for Pressure {
    const KIND: &'static str = "a pressure or stress";
    const UNITS: &'static [Unit<Self>] = &[KPA, MPA, unit("Pa", Pressure::new::<pascal>, Pressure::get::<pascal>)];
}

/// Watt.
pub const WATT: Unit<Power> = unit("W", Power::new::<watt>, Power::get::<watt>);
/// Mechanical horsepower, 745.7 W.
pub const HP: Unit<Power> = unit("hp", Power::new::<horsepower>, Power::get::<horsepower>);

impl Written for Power {
    const KIND: &'static str = "a power";
    const UNITS: &'static [Unit<Self>] = &[WATT, unit("kW", Power::new::<kilowatt>, Power::get::<kilowatt>), HP];
}

/// Newton.
pub const NEWTON: Unit<Force> = unit("N", Force::new::<newton>, Force::get::<newton>);

/// The weight of a kilogram on an arm of a centimetre: the usual unit in data sheets of servos.
pub const KG_CM: Unit<Torque> = Unit {
    name: "kg cm",
    of: |value| Torque::new::<kilogram_force_meter>(value / 100.0),
    value: |quantity| quantity.get::<kilogram_force_meter>() * 100.0,
};
/// Newton metre.
pub const NEWTON_METRE: Unit<Torque> = unit("N m", Torque::new::<newton_meter>, Torque::get::<newton_meter>);

impl Written for Torque {
    const KIND: &'static str = "a torque";
    const UNITS: &'static [Unit<Self>] = &[KG_CM, NEWTON_METRE];
}

/// Hundredth.
pub const PERCENT: Unit<Ratio> = unit("%", Ratio::new::<percent>, Ratio::get::<percent>);

impl Written for Ratio {
    const KIND: &'static str = "a share";
    const UNITS: &'static [Unit<Self>] = &[PERCENT];
}

/// Hectare per hour.
pub const HECTARE_PER_HOUR: Unit<AreaRate> = Unit {
    name: "ha/h",
    of: |value| AreaRate::new::<square_meter_per_second>(value * 10_000.0 / 3600.0),
    value: |rate| rate.get::<square_meter_per_second>() * 3600.0 / 10_000.0,
};

/// A ratio or factor, as a plain number.
pub const FACTOR: Unit<f64> = Unit { name: "", of: |value| value, value: |factor| *factor };

impl Written for f64 {
    const KIND: &'static str = "a plain number";
    const UNITS: &'static [Unit<Self>] = &[FACTOR];
}

/// A count.
pub const COUNT: Unit<u32> = Unit { name: "", of: |value| value as u32, value: |count| (*count).into() };

impl Written for u32 {
    const KIND: &'static str = "a whole number from 0";
    const UNITS: &'static [Unit<Self>] = &[COUNT];
}

/// The error that a text is no quantity of this kind, with the valid units.
fn no_quantity<Q: Written>(written: impl Display) -> String {
    let names: Vec<&str> = Q::UNITS.iter().map(|unit| unit.name).collect();
    let right = match names.as_slice() {
        ["", ..] | [] => "one without quotes and unit".to_owned(),
        [only] => format!("a number and {only}, in quotes"),
        [first @ .., last] => format!("a number and {} or {last}, in quotes", first.join(", ")),
    };
    format!("{written} is not {}: write {right}", Q::KIND)
}

/// Reads a number and a unit. Spaces between them, and spaces and dots within the unit, do not matter.
///
/// # Errors
/// If there is no number, or the unit is missing or of another kind of quantity; it says which units there are.
pub fn parse<Q: Written>(text: &str) -> Result<Q, String> {
    let closed_up = |name: &str| name.replace(|c: char| c.is_whitespace() || c == '·', "");
    // A number ends where a unit begins. An e is then an exponent's.
    let split = |(at, _)| {
        let (number, name) = text.split_at(at);
        let unit = Q::UNITS.iter().find(|unit| !unit.name.is_empty() && closed_up(unit.name) == closed_up(name))?;
        Some((number.trim().parse().ok().filter(|number: &f64| number.is_finite())?, unit))
    };
    let read = text.char_indices().find_map(split).map(|(number, unit)| unit.of(number));
    read.ok_or_else(|| no_quantity::<Q>(format_args!("\"{text}\"")))
}

/// Reads a quantity as a string with its unit, and a plain number as such; for serde's `deserialize_with`.
///
/// # Errors
/// The errors of [`parse`].
pub(crate) fn read<'de, Q: Written, D: Deserializer<'de>>(deserializer: D) -> Result<Q, D::Error> {
    deserializer.deserialize_any(WrittenVisitor(PhantomData))
}

struct WrittenVisitor<Q>(PhantomData<Q>);

impl<Q: Written> Visitor<'_> for WrittenVisitor<Q> {
    type Value = Q;

    fn expecting(&self, formatter: &mut Formatter<'_>) -> fmt::Result {
        formatter.write_str(Q::KIND)
    }

    fn visit_str<E: serde::de::Error>(self, text: &str) -> Result<Q, E> {
        parse(text).map_err(E::custom)
    }

    fn visit_f64<E: serde::de::Error>(self, number: f64) -> Result<Q, E> {
        // The conversion of a whole number's unit truncates, so the result differs if the input was not whole.
        let plain = Q::UNITS.first().filter(|unit| unit.name.is_empty());
        let read = plain.map(|unit| (unit.of(number), unit)).filter(|(read, unit)| unit.value(*read) == number);
        read.map(|(read, _)| read).ok_or_else(|| E::custom(no_quantity::<Q>(number)))
    }

    fn visit_i64<E: serde::de::Error>(self, number: i64) -> Result<Q, E> {
        self.visit_f64(number as f64)
    }
}

#[cfg(test)]
mod tests {
    use super::*;
    use approx::assert_relative_eq;

    #[test]
    fn a_length_is_the_same_in_every_unit() {
        for text in ["0.4 m", "40 cm", "400 mm", "400mm", " 400  mm "] {
            assert_relative_eq!(M.value(parse(text).unwrap()), 0.4, epsilon = 1e-12);
        }
    }

    #[test]
    fn torque_is_read_as_servo_makers_write_it() {
        assert_relative_eq!(NEWTON_METRE.value(parse("60 kg cm").unwrap()), 5.884, epsilon = 1e-3);
        for text in ["5.884 N m", "5.884 Nm", "5.884 N·m"] {
            assert_relative_eq!(KG_CM.value(parse(text).unwrap()), 60.0, epsilon = 1e-2);
        }
    }

    #[test]
    fn a_missing_unit_is_answered_with_the_right_one() {
        let error = parse::<Ratio>("0.9").unwrap_err();
        assert_eq!(error, "\"0.9\" is not a share: write a number and %, in quotes");
    }

    #[test]
    fn a_number_may_have_an_exponent() {
        assert_relative_eq!(MM.value(parse("4e2 mm").unwrap()), 400.0, epsilon = 1e-9);
        assert_relative_eq!(KG.value(parse::<Mass>("1e300 kg").unwrap()), 1e300, max_relative = 1e-9);
        assert!(parse::<Length>("4e mm").is_err() && parse::<Length>("e2 mm").is_err());
    }

    #[test]
    fn text_that_is_no_number_is_refused() {
        for text in ["", "mm", "nan mm", "inf mm", "4oo mm", "1,5 mm"] {
            assert!(parse::<Length>(text).is_err(), "{text}");
        }
    }
}
