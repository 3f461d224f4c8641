//! A margin as the sum of its parts.

use std::fmt;

/// The parts of a margin, each in millimetres.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct Margin {
    /// The slip's scatter.
    pub slip_mm: f64,
    /// The servo's.
    pub servo_mm: f64,
    /// The firmware's.
    pub firmware_mm: f64,
    /// The stems', beside a stem zone. `None` around whole canopies.
    pub stems_mm: Option<f64>,
    /// A trailing arm's; 0 for a pendulum.
    pub arm_mm: f64,
    /// Half of the blade's length along the row, because distances are to its middle.
    pub blade_mm: f64,
    /// The margin in use.
    pub in_use_mm: u16,
}

impl Margin {
    /// The least sufficient margin, in whole millimetres: the sum.
    pub fn least_mm(&self) -> u16 {
        let Self { slip_mm, servo_mm, firmware_mm, stems_mm, arm_mm, blade_mm, .. } = self;
        (slip_mm + servo_mm + firmware_mm + stems_mm.unwrap_or(0.0) + arm_mm + blade_mm).ceil() as u16
    }
}

impl fmt::Display for Margin {
    fn fmt(&self, f: &mut fmt::Formatter<'_>) -> fmt::Result {
        let Self { slip_mm, servo_mm, firmware_mm, stems_mm, arm_mm, blade_mm, .. } = self;
        let mut sum = format!("slip {slip_mm:.0} + servo {servo_mm:.0}");
        for (part, mm) in [("arm", *arm_mm), ("blade", *blade_mm)] {
            if mm > 0.0 {
                sum += &format!(" + {part} {mm:.0}");
            }
        }
        match stems_mm {
            Some(stems_mm) => write!(f, "{sum} + stem {stems_mm:.0} + {firmware_mm:.0} mm"),
            None => write!(f, "{sum} + {firmware_mm:.0} mm at 2.5 km/h"),
        }
    }
}
