//! Where the tool may be in the row: distances and leads, and the one question that each turn of the loop asks.

use super::Controller;
use crate::{
    classifier::Classifier,
    memory::Memory,
    settings::{Setting, Settings},
    units::{Position, Ticks, TicksPerSecond},
};

/// Distances that follow from the settings, in ticks of the present wheel.
#[derive(Clone, Copy, Debug)]
pub(super) struct Geometry {
    pub(super) beam_to_tool: Ticks,
    pub(super) margin: Ticks,
    pub(super) max_width: Ticks,
    pub(super) merge_gap: Ticks,
    /// As ticks a second.
    pub(super) top_speed: Ticks,
    /// Zero for none.
    pub(super) no_plant: Ticks,
}

impl Geometry {
    pub(super) fn of(settings: &Settings) -> Self {
        Self {
            beam_to_tool: settings.ticks(Setting::BeamToToolMm),
            margin: settings.ticks(Setting::MarginMm),
            max_width: settings.ticks(Setting::MaxWidthMm),
            merge_gap: Ticks(i32::from(settings.get(Setting::MergeGapTicks))),
            top_speed: settings.ticks(Setting::TopSpeedMmS),
            no_plant: Ticks(settings.wheel().ticks(1000).0 * i32::from(settings.get(Setting::NoPlantM))),
        }
    }
}

/// Distances rolled at the present speed while something answers; negative when rolling backwards.
#[derive(Clone, Copy, Debug, Default)]
pub(super) struct Leads {
    /// While the tool swings out.
    pub(super) out: Ticks,
    /// Before the tool begins to come back: never longer than `out`.
    pub(super) back: Ticks,
    /// While the beam's sensor answers.
    pub(super) response: Ticks,
}

impl Leads {
    pub(super) fn at(speed: TicksPerSecond, settings: &Settings) -> Self {
        let out_ms = settings.get(Setting::LeadOutMs);
        // A lead is longer by what a command takes to the pin in the mean: half a tick, half a turn of the loop, half a pulse.
        // Without a lead the paper's schedule stands as it is.
        let lead = |milliseconds: u16| speed.distance_in_ms(milliseconds + u16::from(milliseconds > 0));
        Self {
            out: lead(out_ms),
            back: lead(settings.get(Setting::LeadInMs).min(out_ms)),
            response: speed.distance_in_ms(settings.get(Setting::BeamResponseMs)),
        }
    }
}

impl<C: Classifier, M: Memory> Controller<C, M> {
    /// The ground that the tool works on.
    pub(super) fn tool(&self) -> Position {
        self.readings.position - self.geometry.beam_to_tool
    }

    /// Whether closed ground comes up before the tool could be out of the row, or in its place again.
    pub(super) fn must_be_out(&self, tool: Position) -> bool {
        let Leads { out, back, .. } = self.leads;
        let one = Ticks(if out < Ticks::ZERO { -1 } else { 1 });
        // The stretch of ground that must be open for the tool to be in the row when this decision shows.
        let (near, far) = if self.tool_out {
            // Coming back pays only if the tool can stay for as long as its stroke takes, the difference of the leads.
            // That also keeps it out for the window that it left for, should the speed falter. The tick on either side
            // is for an encoder that trembles on an edge.
            (back - one, out + (out - back) + one)
        } else {
            // A window once left stays left while the measured speed wavers by less than a quarter.
            (back + Ticks(back.0 / 4), out)
        };
        self.encoder.is_doubtful()
            || self.tool_out && self.encoder.is_quiet()
            || self.is_closed(tool + near, tool + far)
            || self.outruns_the_beam(tool)
    }

    /// Whether the machine is so fast that a plant just behind the beam would be reached before the tool is out.
    pub(super) fn outruns_the_beam(&self, tool: Position) -> bool {
        let out = self.leads.out;
        // Slowing down by an eighth is what it takes to be trusted again.
        let lead = if self.tool_out { out + Ticks(out.0 / 8) } else { out };
        (tool + lead) - self.watch.frontier() >= -self.geometry.margin
    }

    /// Whether any of the ground between two places is closed: unknown, or within the margin of a canopy, the one that is
    /// still being seen included.
    pub(super) fn is_closed(&self, one: Position, other: Position) -> bool {
        let margin = self.geometry.margin;
        let far = if one.is_ahead_of(other) { one } else { other };
        self.schedule.is_closed(one, other, margin) || self.watch.open().is_some_and(|leading| far - leading >= -margin)
    }
}
