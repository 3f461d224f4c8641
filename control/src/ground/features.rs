//! The paper's five features of a detection.
//!
//! Speed, encoder value, delay, hold and actuation are in mm and mm/s. They describe how a reference machine would schedule the
//! detection: beam 400 mm ahead of the tool, 50 mm margin, 180 and 40 ms of lead. So examples from one machine hold on another,
//! with any wheel, encoder and settings. The default lead is longer, but the examples would not hold if the reference followed it.

/// Features in a vector.
pub const COUNT: usize = 5;

/// The forward speeds of the paper's trial, in mm/s: 1, 1.5, 2 and 2.5 km/h.
pub const SPEED_CLASSES_MM_S: [i16; 4] = [278, 417, 556, 694];

/// The reference machine of all features.
mod reference {
    pub const BEAM_TO_TOOL_MM: u16 = 400;
    pub const MARGIN_MM: u16 = 50;
    pub const LEAD_OUT_MS: u16 = 180;
    pub const LEAD_IN_MS: u16 = 40;
}

/// Hold minus width, in mm.
pub const HOLD_BEYOND_WIDTH_MM: i16 = 2 * reference::MARGIN_MM as i16;

/// The feature vector of a detection, in the paper's order:
///
/// - S: the machine's speed class in mm/s.
/// - E: distance since the last plant's leading edge, the plant spacing, in mm.
/// - Y: delay until the command to leave the row (Eq. 1 minus the lead), in mm.
/// - Z: hold, the distance for which the tool stays out (Eq. 2), in mm.
/// - R: actuation, the position of the command to come back (Eq. 3 minus the lead), in mm.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub struct Features(pub [i16; COUNT]);

impl Features {
    /// The features of a detection of `width_mm`, `spacing_mm` behind the last plant, in one of the speed classes.
    #[inline(never)]
    pub const fn describe(speed_class_mm_s: i16, spacing_mm: i16, width_mm: i16) -> Self {
        let delay = reference::BEAM_TO_TOOL_MM - reference::MARGIN_MM;
        let hold = width_mm as u16 + 2 * reference::MARGIN_MM;
        Self([
            speed_class_mm_s,
            spacing_mm,
            (delay - rolled(speed_class_mm_s, reference::LEAD_OUT_MS)) as i16,
            limited(hold),
            limited(delay + hold - rolled(speed_class_mm_s, reference::LEAD_IN_MS)),
        ])
    }

    /// The features in the paper's order: speed, encoder value, delay, hold, actuation.
    pub const fn values(&self) -> &[i16; COUNT] {
        &self.0
    }

    /// S: the machine's speed class in mm/s.
    pub const fn speed_mm_s(&self) -> i16 {
        self.0[0]
    }

    /// E: distance since the last plant's leading edge, the plant spacing, in mm.
    pub const fn spacing_mm(&self) -> i16 {
        self.0[1]
    }

    /// Z: hold, the distance for which the tool stays out (Eq. 2), in mm.
    pub const fn hold_mm(&self) -> i16 {
        self.0[3]
    }
}

/// The distance rolled, in mm. In units of 20 ms, a speed class times a lead fits 16 bits. The chip divides 16 bits three times as
/// fast as 32.
const fn rolled(speed_mm_s: i16, milliseconds: u16) -> u16 {
    speed_mm_s as u16 * (milliseconds / 20) / 50
}

const fn limited(millimetres: u16) -> i16 {
    if millimetres > i16::MAX as u16 { i16::MAX } else { millimetres as i16 }
}

/// The nearest of the paper's speed classes, in mm/s; the fastest for anything faster.
pub const fn speed_class(speed_mm_s: i16) -> i16 {
    match speed_mm_s {
        ..348 => 278,
        348..487 => 417,
        487..626 => 556,
        626.. => 694,
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn a_speed_belongs_to_the_nearest_of_the_papers_classes() {
        for (speed, class) in
            [(-50, 278), (0, 278), (347, 278), (348, 417), (486, 417), (487, 556), (694, 694), (2778, 694)]
        {
            assert_eq!(speed_class(speed), class, "{speed}");
        }
    }

    #[test]
    fn the_features_are_the_papers_schedule_on_the_reference_machine() {
        // 150 mm of canopy at 2.5 km/h: Y = 350 mm less 124 mm of lead, Z = 250 mm, R = 600 mm less 27 mm.
        let features = Features::describe(694, 500, 150);
        assert_eq!(features.values(), &[694, 500, 226, 250, 573]);
    }

    #[test]
    fn features_beyond_16_bits_are_limited() {
        let features = Features::describe(278, i16::MAX, i16::MAX);
        assert_eq!(features.values()[3..], [i16::MAX; 2]);
    }
}
