//! Where the tool may be in the row: the machine's distances, and the stretch of ground that its servo needs to be open.

use super::slip::Slip;
use crate::{
    settings::{Setting, Settings},
    units::{Length, LengthScale, Ticks, TicksPerSecond, Wheel},
};

/// How far the machine may be rolled back with the ground still remembered, in metres. Together with twice the longest X and
/// the widest canopy that is less than the 13 m that a [`Length`] holds.
const MEMORY_M: i16 = 8;

/// Distances that follow from the settings, for the present wheel.
#[derive(Clone, Copy, Debug)]
pub struct Geometry {
    /// The wheel by which the others are measured.
    pub wheel: Wheel,
    /// Ticks in a unit of the others.
    pub scale: LengthScale,
    /// X.
    pub beam_to_tool: Length,
    /// From the first beam back to the second; zero where there is none.
    pub second_beam: Length,
    /// Ground left alone on both sides of a canopy.
    pub margin: Length,
    /// What no canopy is wider than.
    pub max_width: Length,
    /// What is kept of a single plant; zero for all of its canopy.
    pub stem_zone: Length,
    /// Clear ground behind which a canopy is over.
    pub merge_gap: Length,
    /// From the middle of a plant to that of the next; zero where the crop is not set at even distances.
    pub guard_spacing: Length,
    /// How far off its place such a plant may stand.
    pub guard_scatter: Length,
    /// How far ground is guarded on either side of where a plant is due: the zone of a stem that stands off by the scatter.
    pub guarded: Length,
    /// How far the machine may be rolled back with the ground still remembered.
    pub memory: Length,
}

impl Geometry {
    /// No distances.
    pub const NONE: Self = Self {
        wheel: Wheel::NONE,
        scale: LengthScale::TICK,
        beam_to_tool: Length::ZERO,
        second_beam: Length::ZERO,
        margin: Length::ZERO,
        max_width: Length::ZERO,
        stem_zone: Length::ZERO,
        merge_gap: Length::ZERO,
        guard_spacing: Length::ZERO,
        guard_scatter: Length::ZERO,
        guarded: Length::ZERO,
        memory: Length::ZERO,
    };

    /// The narrowest that both beams are asked for, 8 mm or a tick: less may be an insect or a clod in one of them.
    pub fn least_seen(&self) -> Length {
        // The memory is eight metres.
        Length((self.memory.0 + 1023) >> 10)
    }

    /// Those of the settings, where the wheel turns by so many 256ths of its way more than the ground that is rolled over.
    pub fn of(settings: &Settings, excess: i8) -> Self {
        let mut geometry = Self::NONE;
        geometry.follow(settings, excess);
        geometry
    }

    /// Follows the settings, as [`of`](Self::of) does.
    pub fn follow(&mut self, settings: &Settings, excess: i8) {
        self.wheel = settings.wheel();
        let metre = self.wheel.ticks(1000);
        self.scale = LengthScale::of(metre);
        let length = |geometry: &Self, setting| geometry.length(settings, setting, excess);
        self.beam_to_tool = length(self, Setting::BeamToToolMm);
        self.second_beam = length(self, Setting::SecondBeamMm);
        self.margin = length(self, Setting::MarginMm);
        self.max_width = length(self, Setting::MaxWidthMm);
        self.stem_zone = length(self, Setting::StemZoneMm);
        self.merge_gap = length(self, Setting::MergeGapMm);
        self.guard_spacing = length(self, Setting::GuardSpacingMm);
        self.guard_scatter = Length::ZERO;
        if self.guard_spacing > Length::ZERO {
            self.guard_scatter = length(self, Setting::GuardScatterMm);
        }
        self.guarded = self.guard_scatter + Length(self.stem_zone.0 >> 1);
        self.memory = Length(self.scale.length(metre).0 * MEMORY_M);
    }

    /// A setting in millimetres, as the wheel turns over it.
    #[cfg_attr(target_arch = "avr", inline(never))]
    fn length(&self, settings: &Settings, setting: Setting, excess: i8) -> Length {
        let millimetres = settings.get(setting);
        // Each takes time, which those that are off need not.
        if millimetres == 0 {
            return Length::ZERO;
        }
        let turned = self.wheel.ticks(millimetres).0 * i32::from(Slip::WHOLE + i16::from(excess));
        self.scale.length(Ticks(turned >> 8))
    }
}

/// Distances rolled at the present speed while something answers; negative when rolling backwards.
#[derive(Clone, Copy, Debug)]
pub struct Leads {
    /// While the tool swings out.
    pub out: Length,
    /// Before the tool begins to come back: never longer than `out`.
    pub back: Length,
    /// While the beam's sensor answers.
    pub response: Length,
}

impl Leads {
    /// Those of a machine at rest.
    pub const NONE: Self = Self { out: Length::ZERO, back: Length::ZERO, response: Length::ZERO };

    /// Those at a speed, in units of the scale.
    pub fn at(speed: TicksPerSecond, settings: &Settings, scale: LengthScale) -> Self {
        let out_ms = settings.get(Setting::LeadOutMs);
        let rolled = |milliseconds| scale.length(speed.distance_in_ms(milliseconds));
        // A lead is longer by what a command takes to the pin in the mean: half a tick, half a turn of the loop, half a pulse.
        // Without a lead the paper's schedule stands as it is.
        let lead = |milliseconds: u16| rolled(milliseconds + u16::from(milliseconds > 0));
        Self {
            out: lead(out_ms),
            back: lead(settings.get(Setting::LeadInMs).min(out_ms)),
            response: rolled(settings.get(Setting::BeamResponseMs)),
        }
    }

    /// The stretch of ground, from the tool on, that has to be open for the tool to be in the row when a decision made now
    /// shows: where it begins and where it ends, in the direction of rolling.
    ///
    /// What keeps a tool in the row is a part of what lets it in, and less by a fifth at both ends. So at a steady speed it goes
    /// out once for a window and comes in once behind it, although the measured speed wavers.
    #[cfg_attr(not(target_arch = "avr"), inline)]
    pub fn stretch(&self, tool_out: bool) -> (Length, Length) {
        let (out, back) = (self.out.0.unsigned_abs(), self.back.0.unsigned_abs());
        // What lies farther than the lead out is not asked for yet.
        let near = (back + back / 4).min(out);
        let (mut near, mut far) = (near.cast_signed(), out.cast_signed());
        if tool_out {
            // Coming back pays only if the tool can stay for as long as its stroke takes, the difference of the leads. That also
            // keeps it out for the window that it left for, should the speed falter. The tick on either side is for an encoder
            // that trembles on an edge.
            near -= near / 5 + 1;
            far += (out - back).max(out / 4).cast_signed() + 1;
        }
        if self.out < Length::ZERO { (Length(-near), Length(-far)) } else { (Length(near), Length(far)) }
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn what_keeps_the_tool_in_is_a_part_of_what_lets_it_in() {
        for out in -300..=300_i16 {
            for back in 0..=out.abs() {
                let leads = Leads { out: Length(out), back: Length(back * out.signum()), response: Length::ZERO };
                let sorted = |(one, other): (Length, Length)| (one.min(other), one.max(other));
                let (stays_from, stays_to) = sorted(leads.stretch(false));
                let (enters_from, enters_to) = sorted(leads.stretch(true));
                assert!(enters_from < stays_from && stays_to < enters_to, "{leads:?}");
            }
        }
    }

    #[test]
    fn the_ground_that_has_to_be_open_lies_between_the_leads_and_a_part_of_them_farther() {
        let forward = Leads { out: Length(103), back: Length(60), response: Length::ZERO };
        assert_eq!(forward.stretch(false), (Length(75), Length(103)));
        assert_eq!(forward.stretch(true), (Length(75 - 16), Length(103 + 43 + 1)));
        let late_back = Leads { back: Length(100), ..forward };
        assert_eq!(late_back.stretch(true), (Length(103 - 21), Length(103 + 25 + 1)));
        let backward = Leads { out: Length(-103), back: Length(-60), ..forward };
        assert_eq!(backward.stretch(true), (Length(16 - 75), Length(-103 - 43 - 1)));
    }

    #[test]
    fn a_lead_is_what_is_rolled_in_its_time_and_a_millisecond_and_none_is_none() {
        let mut settings = Settings::new();
        let leads = |settings: &Settings| {
            let Leads { out, back, response } = Leads::at(TicksPerSecond(1000), settings, LengthScale::TICK);
            (out, back, response)
        };
        for (setting, milliseconds) in
            [(Setting::LeadOutMs, 180), (Setting::LeadInMs, 40), (Setting::BeamResponseMs, 7)]
        {
            settings.set(setting, milliseconds).expect("within its range");
        }
        assert_eq!(leads(&settings), (Length(181), Length(41), Length(7)));
        settings.set(Setting::LeadOutMs, 0).expect("within its range");
        assert_eq!(leads(&settings), (Length::ZERO, Length::ZERO, Length(7)));
    }

    #[test]
    fn lengths_of_every_wheel_fit_what_is_remembered() {
        for ticks_per_m in 40..=20_000 {
            let mut settings = Settings::new();
            for (setting, value) in
                [(Setting::TicksPerM, ticks_per_m), (Setting::BeamToToolMm, 2000), (Setting::MaxWidthMm, 1500)]
            {
                settings.set(setting, value).expect("within its range");
            }
            let Geometry { scale, beam_to_tool, max_width, memory, .. } = Geometry::of(&settings, 0);
            let farthest = i32::from(memory.0) + 2 * i32::from(beam_to_tool.0) + i32::from(max_width.0);
            assert!(farthest < i16::MAX.into(), "{ticks_per_m} a metre: {farthest}");
            let error = scale.ticks(beam_to_tool).0 - 2 * i32::from(ticks_per_m);
            assert!(error <= 0 && -error < 16, "{ticks_per_m} a metre: {error}");
        }
    }
}
