//! The leads that follow from the servo's measured times.

use crate::{circle, keeps_stems, pulses};
use control::settings::{Setting, Settings};

/// The servo's scatter beside a stem zone, as a time on its way out and in. The way out has the dead time's scatter, the
/// load's, and a command's wait for the pulse. The way in has the dead time's only. Leads that are shortened by the same
/// time on both ways damage plants behind the tool, at 4 km/h twice as many as at 1 km/h.
const SCATTER_OUT_MS: f64 = 20.0;
const SCATTER_IN_MS: f64 = 9.0;

/// What the two measured leads differ by beside the stroke: the longest wait of a command, and the scatter of a hobby
/// servo's dead time.
const BESIDE_STROKE_MS: f64 = 40.0;

/// The servo, timed.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub(crate) struct Timing {
    /// The leads in milliseconds, out and in. `None` if the operator sets them by eye.
    pub(crate) leads: Option<(u16, u16)>,
    /// The pulse widths of the stroke.
    pub(crate) pulses: (u16, u16),
}

/// The leads that follow from the times. None if the operator sets them by eye.
pub(crate) fn leads(timings: &[Timing], settings: &Settings) -> Vec<(Setting, u16)> {
    let (outs, ins) = extremes(timings);
    let (Some(longest_ms), Some(shortest_ms)) = (outs.max(), ins.min()) else { return Vec::new() };
    let [saved_out_ms, saved_in_ms] = if keeps_stems(settings) {
        let (in_us, out_us) = pulses(settings);
        saved_ms(
            settings.get(Setting::TopSpeedMmS).into(),
            travel_ms(timings),
            settings.get(Setting::StemZoneMm).into(),
            circle::aside_mm(in_us.abs_diff(out_us)),
        )
    } else {
        [0, 0]
    };
    vec![
        (Setting::LeadOutMs, longest_ms.saturating_sub(saved_out_ms)),
        (Setting::LeadInMs, shortest_ms.saturating_add(saved_in_ms)),
    ]
}

/// The time of the stroke, from the times that were measured; 0 if it was timed by eye.
pub(crate) fn travel_ms(timings: &[Timing]) -> f64 {
    let (outs, ins) = extremes(timings);
    let differ_ms =
        outs.max().zip(ins.min()).map_or(0, |(longest_ms, shortest_ms)| longest_ms.saturating_sub(shortest_ms));
    (f64::from(differ_ms) - BESIDE_STROKE_MS).max(0.0)
}

/// By how much the leads out and in beside a stem zone are shorter than the worst times: what the circle allows at the
/// highest speed, and the servo's scatter, which is smaller for a quick servo. The margin pays for the scatter.
pub fn saved_ms(top_speed_mm_s: f64, travel_ms: f64, zone_mm: f64, aside_mm: f64) -> [u16; 2] {
    let overlap_ms = circle::overlap_ms(top_speed_mm_s, travel_ms, zone_mm, aside_mm);
    let of_60_ms = (travel_ms / 60.0).min(1.0);
    [SCATTER_OUT_MS, SCATTER_IN_MS].map(|scatter_ms| (overlap_ms + scatter_ms * of_60_ms) as u16)
}

/// The leads out and in that were timed.
pub(crate) fn extremes(timings: &[Timing]) -> (impl Iterator<Item = u16> + Clone, impl Iterator<Item = u16> + Clone) {
    let leads = || timings.iter().filter_map(|timing| timing.leads);
    (leads().map(|(out_ms, _)| out_ms), leads().map(|(_, in_ms)| in_ms))
}
