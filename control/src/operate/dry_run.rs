//! A dry run: the servo swings as for a row of plants, without a field or a sensor.
//!
//! The row has plants of 150 mm, 500 mm apart, on known ground. The tool rolls along it at a constant speed. The swings follow from
//! margin, leads and speed with the same rule as on real ground ([`Leads::stretch`]), in millimetres. The machine's real ground is
//! neither used nor changed.

use crate::{
    ground::reach::Leads,
    settings::{Setting, Settings},
    units::{Instant, Length, Slow, Speed},
};

/// Plants in the row.
pub const PLANTS: i16 = 6;

const SPACING_MM: i16 = 500;
const CANOPY_MM: i16 = 150;

/// A dry run in progress.
#[derive(Clone, Copy, Debug)]
pub struct DryRun {
    begin: Slow,
    speed_mm_s: u16,
    /// In millimetres instead of ticks.
    leads: Leads,
    margin_mm: i16,
}

impl DryRun {
    /// Starts half a metre before the first plant, at a speed in mm/s, with the settings' margin and leads.
    pub fn new(begin: Instant, speed_mm_s: u16, settings: &Settings) -> Self {
        let speed = Speed(speed_mm_s as i16);
        let leads = Leads::at(speed, speed, settings);
        Self { begin: begin.slow(), speed_mm_s, leads, margin_mm: settings.get(Setting::MarginMm) as i16 }
    }

    /// Whether the tool has to be out now; `was_out` is the last answer. `None` after the last plant. The caller has to ask within
    /// half a minute of the end.
    pub fn tool_out(&self, now: Instant, was_out: bool) -> Option<bool> {
        let time = now.slow().since(self.begin);
        // In steps of 1.024 ms.
        let tool_mm = (u32::from(time) * u32::from(self.speed_mm_s) * 16 / 15_625) as u16;
        let last_mm = SPACING_MM * (PLANTS + 1);
        if tool_mm > last_mm as u16 {
            return None;
        }
        let (Length(from_mm), Length(to_mm)) = self.leads.stretch(was_out);
        let (from_mm, to_mm) = (tool_mm as i16 + from_mm - self.margin_mm, tool_mm as i16 + to_mm + self.margin_mm);
        Some((1..=PLANTS).any(|plant| {
            let leading_mm = SPACING_MM * plant;
            leading_mm <= to_mm && leading_mm + CANOPY_MM >= from_mm
        }))
    }
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::units::Interval;
    use std::vec::Vec;

    /// The swings of a dry run: the position of each in mm, and whether it is a swing out.
    fn swings(speed_mm_s: u16, settings: &Settings) -> Vec<(u32, bool)> {
        let begin = Instant::new(u32::MAX - 300_000);
        let row = DryRun::new(begin, speed_mm_s, settings);
        let (mut out, mut swings) = (true, Vec::new());
        for milliseconds in 0.. {
            let now = begin + Interval::from_ms(milliseconds);
            let Some(must_be_out) = row.tool_out(now, out) else { break };
            if must_be_out != out {
                out = must_be_out;
                swings.push((milliseconds * u32::from(speed_mm_s) / 1000, out));
            }
        }
        assert!(!out, "the tool is in behind the last plant");
        swings
    }

    #[test]
    fn the_tool_leaves_and_returns_once_for_each_plant_at_its_margin_and_lead() {
        for speed_mm_s in [100, 278, 500, 556] {
            let swings = swings(speed_mm_s, &Settings::new());
            assert_eq!(swings.len(), 13, "in, and out and in for each of six plants: {swings:?}");
            let speed = u32::from(speed_mm_s);
            for (plant, pair) in (1..).zip(swings[1..].chunks(2)) {
                let [(leaves_mm, true), (returns_mm, false)] = pair else { panic!("{swings:?}") };
                let [leaves_at, returns_at] = [450 - speed * 231 / 1000, 700 - speed * 41 / 1000];
                let [off_out, off_in] = [
                    leaves_mm.abs_diff(500 * (plant - 1) + leaves_at),
                    returns_mm.abs_diff(500 * (plant - 1) + returns_at),
                ];
                assert!(off_out <= 2 && off_in <= 4, "plant {plant} at {speed} mm/s: {swings:?}");
            }
        }
    }

    #[test]
    fn zones_too_near_for_two_strokes_are_one() {
        for speed_mm_s in [1000, 1300] {
            let settings = Settings::with(&[(Setting::LeadOutMs, 180)]);
            assert_eq!(swings(speed_mm_s, &settings).len(), 3, "in, out for all of them, and in");
        }
    }

    #[test]
    fn equal_leads_give_one_swing_each_way_a_plant() {
        for lead_ms in [0, 100, 180, 240] {
            let settings = Settings::with(&[(Setting::LeadOutMs, lead_ms), (Setting::LeadInMs, lead_ms)]);
            assert_eq!(swings(556, &settings).len(), 13, "{lead_ms} ms");
        }
    }
}
