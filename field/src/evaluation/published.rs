//! What the paper printed of its own trial: equations, slopes, fits and ranges, and where these contradict each other.

use super::Response;
use serde::Serialize;

/// A response as a linear function of speed (A, km/h) and plant spacing (B, cm), as far as it was printed.
#[derive(Clone, Copy, Debug, PartialEq, Serialize)]
pub struct Coefficients {
    /// At speed 0 and spacing 0, in the response's unit.
    pub constant: Option<f64>,
    /// For each km/h.
    pub per_km_h: Option<f64>,
    /// For each cm of spacing.
    pub per_cm: Option<f64>,
}

/// The paper's figures for one response.
#[derive(Clone, Copy, Debug, PartialEq, Serialize)]
pub struct Published {
    /// The equation's number in the paper.
    pub equation_number: u32,
    /// Its coefficients; all `None` where the equation cannot be read in the copy at hand.
    pub equation: Coefficients,
    /// The coefficients as the text around it gives them.
    pub text: Coefficients,
    /// R2, 0 to 1.
    pub r_squared: f64,
    /// Adjusted R2, 0 to 1.
    pub adjusted_r_squared: Option<f64>,
    /// Ranges that the text gives, lowest and highest, in the response's unit: they should be one.
    pub ranges: &'static [(f64, f64)],
    /// What contradicts what, a sentence each.
    pub contradictions: &'static [&'static str],
}

impl Published {
    /// The paper's figures for a response.
    pub fn of(response: Response) -> Self {
        match response {
            Response::PlantDamage => PLANT_DAMAGE,
            Response::WeedingEfficiency => WEEDING_EFFICIENCY,
            Response::PerformanceIndex => PERFORMANCE_INDEX,
            Response::FieldEfficiency => FIELD_EFFICIENCY,
        }
    }
}

const UNKNOWN: Coefficients = Coefficients { constant: None, per_km_h: None, per_cm: None };

const PLANT_DAMAGE: Published = Published {
    equation_number: 28,
    equation: UNKNOWN,
    text: Coefficients { constant: None, per_km_h: Some(1.26), per_cm: Some(-0.081) },
    r_squared: 0.79,
    adjusted_r_squared: None,
    ranges: &[(0.0, 3.92)],
    contradictions: &[],
};

const WEEDING_EFFICIENCY: Published = Published {
    equation_number: 29,
    equation: Coefficients { constant: Some(97.2841), per_km_h: Some(-0.1990), per_cm: Some(-0.2068) },
    text: Coefficients { constant: None, per_km_h: Some(-5.06), per_cm: Some(0.2068) },
    r_squared: 0.8361,
    adjusted_r_squared: None,
    ranges: &[(80.11, 89.49), (66.66, 86.66), (76.0, 84.0)],
    contradictions: &[],
};

const PERFORMANCE_INDEX: Published = Published {
    equation_number: 30,
    equation: Coefficients { constant: Some(204.83), per_km_h: Some(-6.08), per_cm: Some(0.015) },
    text: Coefficients { constant: None, per_km_h: Some(-6.08), per_cm: Some(0.015) },
    r_squared: 0.6787,
    adjusted_r_squared: Some(0.6482),
    ranges: &[(185.41, 202.20)],
    contradictions: &[],
};

const FIELD_EFFICIENCY: Published = Published {
    equation_number: 31,
    equation: Coefficients { constant: Some(82.50), per_km_h: Some(-2.06), per_cm: Some(0.09) },
    text: Coefficients { constant: None, per_km_h: Some(-2.06), per_cm: None },
    r_squared: 0.6831,
    adjusted_r_squared: Some(0.6529),
    ranges: &[(81.25, 86.25)],
    contradictions: &[],
};
