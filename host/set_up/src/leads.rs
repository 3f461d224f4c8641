//! The leads that follow from the servo's measured times.

use crate::circle::{self, Arm};
use crate::{keeps_stems, stroke_us};
use control::settings::{Setting, Settings};

/// The servo's scatter beside a stem zone, as a time on its way out and in. The way out has the dead time's scatter, the
/// load's, and a command's wait for the pulse. The way in has the dead time's only: a load makes it safer. Leads that are
/// shortened by the same time on both ways damage plants behind the tool, at 4 km/h twice as many as at 1 km/h.
const SCATTER_OUT_MS: f64 = 20.0;
const SCATTER_IN_MS: f64 = 9.0;

/// The lead out is shortened by this at most. An end switch has to close within 100 ms of that lead: else the firmware raises
/// alarm 4-1. The other 40 ms are for the switch, and for a servo that has become slower.
const MOST_SAVED_OUT_MS: f64 = 60.0;

/// What the two measured leads differ by beside the stroke: the longest wait of a command, and the scatter of a hobby
/// servo's dead time.
const BESIDE_STROKE_MS: f64 = 40.0;

/// The servo, timed.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub(crate) struct TimedServo {
    /// The leads in milliseconds, out and in. By eye, `None` until the operator has set what was seen.
    pub(crate) leads: [Option<u16>; 2],
    /// Whether the operator timed it by eye.
    pub(crate) by_eye: bool,
    /// The values of [`OVER`](crate::OVER).
    pub(crate) over: [u16; 3],
}

/// The leads that follow from the times. Those seen by eye are not shortened.
pub(crate) fn leads(timings: &[TimedServo], settings: &Settings, arm: Arm) -> Vec<(Setting, u16)> {
    let [saved_out_ms, saved_in_ms] = if keeps_stems(settings) {
        // A speed that is raised again needs no longer leads.
        let top_mm_s = settings.get(Setting::TopSpeedMmS).max(Setting::TopSpeedMmS.default()).into();
        let zone_mm = settings.get(Setting::StemZoneMm).into();
        let (pulse_us, longest_ms) = (stroke_us(settings), travel_ms(timings));
        let saved = |travel_ms: f64| saved_ms(top_mm_s, travel_ms, zone_mm, arm.aside_mm(pulse_us));
        // The longest travel is one against the soil. The way back may have no load.
        [saved(longest_ms)[0], saved(longest_ms.min(arm.unloaded_ms(pulse_us)))[1]]
    } else {
        [0, 0]
    };
    let [out, back] = extremes(timings);
    let out = out.map(|(_, longest_ms)| (Setting::LeadOutMs, longest_ms.saturating_sub(saved_out_ms)));
    let back = back.map(|(shortest_ms, _)| (Setting::LeadInMs, shortest_ms.saturating_add(saved_in_ms)));
    out.into_iter().chain(back).collect()
}

/// Whether a time may be the operator's, who adds a reserve.
pub(crate) fn by_eye(timings: &[TimedServo]) -> bool {
    timings.iter().any(|timing| timing.by_eye)
}

/// The time of the stroke, from the times that were measured; 0 if it was timed by eye.
pub(crate) fn travel_ms(timings: &[TimedServo]) -> f64 {
    match extremes(timings) {
        [Some((_, longest_ms)), Some((shortest_ms, _))] if !by_eye(timings) => {
            (f64::from(longest_ms.saturating_sub(shortest_ms)) - BESIDE_STROKE_MS).max(0.0)
        }
        _ => 0.0,
    }
}

/// By how much the leads out and in beside a stem zone are shorter than the worst times: what the circle allows at the
/// highest speed, and the servo's scatter, which is smaller for a quick servo. The margin pays for the scatter.
pub fn saved_ms(top_speed_mm_s: f64, travel_ms: f64, zone_mm: f64, aside_mm: f64) -> [u16; 2] {
    let overlap_ms = circle::overlap_ms(top_speed_mm_s, travel_ms, zone_mm, aside_mm);
    let of_60_ms = (travel_ms / 60.0).min(1.0);
    let [out_ms, in_ms] = [SCATTER_OUT_MS, SCATTER_IN_MS].map(|scatter_ms| overlap_ms + scatter_ms * of_60_ms);
    [out_ms.min(MOST_SAVED_OUT_MS) as u16, in_ms as u16]
}

/// The least and the greatest of the leads out, and of the leads in. `None` if none is known.
pub(crate) fn extremes(timings: &[TimedServo]) -> [Option<(u16, u16)>; 2] {
    [0, 1].map(|way: usize| {
        let leads = || timings.iter().filter_map(move |timing| timing.leads[way]);
        leads().min().zip(leads().max())
    })
}
