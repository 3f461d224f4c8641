//! The paper's printed figures of its own trial: equations, slopes, fits and ranges, and their contradictions.
//!
//! The trial had four speeds, two spacings and three replications: 24 plots. The adjusted R2 of Eq. 30 and 31 agree
//! with that.
//!
//! **Which of its figures fit Eq. 27?** The paper has a capacity of 0.041 ha/h, with some 85 % of the weeds removed and
//! 2 % of the plants damaged, and an engine of 2.5 hp, which is an index of 137. The printed 185 to 202 need 0.056 to
//! 0.060 ha/h at 2.5 hp, or 1.8 to 1.7 hp at 0.041 ha/h. With the capacities of Eq. 24 and 25 the power would have to
//! grow with speed, from 1.5 to 3.5 hp. So Fig. 10, where the index rises with speed, follows from Eq. 27 for one
//! engine. Eq. 30, where it falls, does not.

use super::plot::Response;
use serde::Serialize;

/// The least and greatest speed of its trial, km/h. Its slopes are not valid beyond them.
pub const SPEEDS_KM_H: (f64, f64) = (1.0, 2.5);

/// The least and greatest damage that it measured in a plot, percent of the plants.
pub const DAMAGED_PERCENT: (f64, f64) = (0.0, 3.92);

/// Machines that weed in the row, those with a beam first, as measured by their authors in a field or on a test track.
/// Each source counts weeds in its own way.
///
/// The name, the crop, the sensor for plants, the speeds in km/h, the weeds removed in percent and where they were
/// counted, the crop plants damaged in percent, and the publication. A dash is for nothing known.
pub const MACHINES: [&str; 6] = [
    "the paper's | chilli | a light beam | 1 to 2.5 | 80.1 to 89.5, in the plot | 0 to 3.92 | the paper, Eq. 28 and 29",
    "Jia et al., a tool that moves in a spiral | maize | an infrared beam | 4 to 7 | 95.8 | 0.6 | Int. J. Agric. Biol. Eng. 14(6), 2021, doi 10.25165/j.ijabe.20211406.6542",
    "Cordill and Grift, two tines | maize | the stalk's width | – | – | 8.8 without weeds, 23.7 among weeds | Biosystems Engineering, 2011, doi 10.1016/j.biosystemseng.2011.07.007",
    "Tillett et al., a rotating disc | cabbage | a camera | 1.8 | 62 to 87, within 240 mm of a plant | low | Biosystems Engineering, 2008",
    "Jiang et al., knives and herbicide | maize; cabbage | a camera | 2.0 | 90.0; 94.5 | 1.9; 0.8 | Soil and Tillage Research, 2023, doi 10.1016/j.still.2023.105837",
    "electric swinging knives | cabbage | a camera | low, in a laboratory | 96.67 | 0.83 | Agronomy 15(1) 112, 2025",
];

/// A response as a linear function of speed (A, km/h) and plant spacing (B, cm), with the printed coefficients.
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
    /// Its coefficients. All are `None` if the equation is illegible in the available copy.
    pub equation: Coefficients,
    /// The coefficients in the text around it.
    pub text: Coefficients,
    /// R2, 0 to 1.
    pub r_squared: f64,
    /// Adjusted R2, 0 to 1.
    pub adjusted_r_squared: Option<f64>,
    /// Ranges in the text, lowest and highest, in the response's unit. They should be equal.
    pub ranges: &'static [(f64, f64)],
    /// The contradictions, a sentence each.
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
    ranges: &[DAMAGED_PERCENT],
    // Eq. 28 is illegible in the available copy, which contradicts nothing.
    contradictions: &[],
};

const WEEDING_EFFICIENCY: Published = Published {
    equation_number: 29,
    equation: Coefficients { constant: Some(97.2841), per_km_h: Some(-0.1990), per_cm: Some(-0.2068) },
    text: Coefficients { constant: None, per_km_h: Some(-5.06), per_cm: Some(0.2068) },
    r_squared: 0.8361,
    adjusted_r_squared: None,
    ranges: &[(80.11, 89.49), (66.66, 86.66), (76.0, 84.0)],
    contradictions: &[
        "Eq. 29 has -0.1990 a km/h, where the text has -5.06.",
        "Eq. 29 has -0.2068 a cm, where the text has +0.2068: one sign is wrong.",
        "At the trial's speeds and spacings Eq. 29 stays between 84.4 and 86.7 %, whereas the text's slopes span 9.7 points, as 80.11 to 89.49 % does.",
        "Three ranges are printed, and the efficiencies at the best and the worst treatment (89.49 and 80.11 %) lie in one of them alone.",
        "The best spacing at 1 km/h is 60 cm in one chapter and 50 cm in another.",
    ],
};

const PERFORMANCE_INDEX: Published = Published {
    equation_number: 30,
    equation: Coefficients { constant: Some(204.83), per_km_h: Some(-6.08), per_cm: Some(0.015) },
    text: Coefficients { constant: None, per_km_h: Some(-6.08), per_cm: Some(0.015) },
    r_squared: 0.6787,
    adjusted_r_squared: Some(0.6482),
    ranges: &[(185.41, 202.20)],
    contradictions: &[
        "Eq. 30 and its text have the index fall with speed; the discussion of Fig. 10 has it rise.",
        "The text says that speed and spacing both lower the index; Eq. 30 has +0.015 a cm.",
        "By Eq. 27, an engine of 2.5 hp and the paper's 0.041 ha/h make an index of 137, and 164 at the most: not 185 to 202.",
        "By Eq. 24, 25 and 27, the index at 2.5 hp and 0.40 m doubles from 123 at 1 km/h to 257 at 2.5 km/h.",
    ],
};

const FIELD_EFFICIENCY: Published = Published {
    equation_number: 31,
    equation: Coefficients { constant: Some(82.50), per_km_h: Some(-2.06), per_cm: Some(0.09) },
    text: Coefficients { constant: None, per_km_h: Some(-2.06), per_cm: None },
    r_squared: 0.6831,
    adjusted_r_squared: Some(0.6529),
    ranges: &[(81.25, 86.25), (80.0, 90.0)],
    contradictions: &[
        "The text has field efficiency higher at 50 than at 60 cm; Eq. 31 has +0.09 a cm, which is the reverse.",
        "The lowest efficiency is 81.25 % in the range, and 83.33 % at the treatment that is called the lowest.",
        "86.25 % is reached at 1 km/h in the results, and at 2.5 km/h in the abstract.",
    ],
};

#[cfg(test)]
mod tests {
    use super::*;
    use crate::evaluation::PlotRecord;
    use crate::evaluation::tests::PLOT;

    /// The engine that was chosen, hp.
    const POWER_HP: f64 = 2.5;

    /// The working width with the inter-row tools, m.
    const WIDTH_M: f64 = 0.40;

    /// The index of a plot with these counts out of 10,000: the paper prints two decimals.
    fn index(capacity_ha_h: f64, damaged: u32, weeds_after: u32, power_hp: f64) -> f64 {
        let (area_m2, time_s) = (capacity_ha_h * 10_000.0, 3600.0);
        let (weeds, plants) = (Some(10_000), Some(10_000));
        let record =
            PlotRecord { weeds_before: weeds, weeds_after: Some(weeds_after), plants, damaged: Some(damaged), ..PLOT };
        let (area_m2, time_s, power_hp) = (Some(area_m2), Some(time_s), Some(power_hp));
        PlotRecord { area_m2, time_s, power_hp, ..record }.performance().performance_index.unwrap()
    }

    #[test]
    fn the_printed_index_needs_the_documented_capacity_and_power() {
        assert_eq!(index(0.041, 200, 1500, POWER_HP).round(), 137.0);
        assert_eq!(index(0.041, 0, 0, POWER_HP).round(), 164.0);
        // The best and the worst treatment: 89.49 % and no damage, 80.11 % and 3.92 %.
        let best = |capacity_ha_h, power_hp| index(capacity_ha_h, 0, 1051, power_hp);
        let worst = |capacity_ha_h, power_hp| index(capacity_ha_h, 392, 1989, power_hp);
        let near = |value: f64, printed: f64| (value / printed - 1.0).abs() < 0.02;
        assert!(near(best(0.0565, POWER_HP), 202.20) && near(worst(0.0602, POWER_HP), 185.41));
        assert!(near(best(0.041, 1.8), 202.20) && near(worst(0.041, 1.7), 185.41));
        let (slow, fast) = (1.0 * WIDTH_M / 10.0 * 0.8625, 2.5 * WIDTH_M / 10.0 * 0.8333);
        assert_eq!((best(slow, POWER_HP).round(), worst(fast, POWER_HP).round()), (123.0, 257.0));
        assert!(near(best(slow, 1.53), 202.20) && near(worst(fast, 3.46), 185.41));
    }

    #[test]
    fn the_printed_equations_give_the_stated_contradictions() {
        let all = |response| {
            let Coefficients { constant, per_km_h, per_cm } = Published::of(response).equation;
            let at = |speed: f64, spacing: f64| Some(constant? + per_km_h? * speed + per_cm? * spacing);
            let of_speed = |speed| [50.0, 60.0].map(|spacing| at(speed, spacing));
            [1.0, 1.5, 2.0, 2.5].into_iter().flat_map(of_speed).collect::<Option<Vec<f64>>>()
        };
        assert_eq!(all(Response::PlantDamage), None);
        let within = |response, lowest: f64, highest: f64| {
            let values = all(response).unwrap();
            let (low, high) = values.iter().fold((f64::MAX, f64::MIN), |(low, high), v| (low.min(*v), high.max(*v)));
            assert!((low - lowest).abs() < 0.05 && (high - highest).abs() < 0.05, "{low} to {high}");
        };
        within(Response::WeedingEfficiency, 84.4, 86.7);
        within(Response::PerformanceIndex, 190.4, 199.65);
        within(Response::FieldEfficiency, 81.85, 85.84);
        let Coefficients { per_km_h, per_cm, .. } = Published::of(Response::WeedingEfficiency).text;
        let span = 1.5 * per_km_h.unwrap() - 10.0 * per_cm.unwrap();
        assert!((span - -9.7).abs() < 0.05, "{span}");
    }

    #[test]
    fn the_printed_fits_are_those_of_24_plots() {
        for response in [Response::PerformanceIndex, Response::FieldEfficiency] {
            let Published { r_squared, adjusted_r_squared, .. } = Published::of(response);
            let adjusted = 1.0 - (1.0 - r_squared) * 23.0 / 21.0;
            assert!((adjusted - adjusted_r_squared.unwrap()).abs() < 2e-4, "{adjusted}");
        }
    }
}
