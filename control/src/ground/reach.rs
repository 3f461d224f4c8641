//! The machine's distances in units of the wheel, and the open ground that the servo needs at a speed.

use super::slip::Slip;
use crate::{
    settings::{Setting, Settings},
    units::{Length, LengthScale, Speed, Ticks, Wheel},
};

/// Ground remembered behind the frontier, in metres. With twice the longest X and the widest canopy it stays below the 13 m of a
/// [`Length`].
const MEMORY_M: i16 = 8;

/// The settings that are lengths on the ground: neighbours in the table of settings, so that one loop converts them.
const LENGTHS: [Setting; 8] = [
    Setting::BeamToToolMm,
    Setting::SecondBeamMm,
    Setting::MarginMm,
    Setting::StemZoneMm,
    Setting::MaxWidthMm,
    Setting::MergeGapMm,
    Setting::GuardSpacingMm,
    Setting::GuardScatterMm,
];

const _: () = {
    let mut index = 0;
    while index < LENGTHS.len() {
        assert!(LENGTHS[index] as usize == LENGTHS[0] as usize + index, "they stand in this order in the table");
        index += 1;
    }
};

/// Distances from the settings, for the present wheel and slip.
#[derive(Clone, Copy, Debug)]
pub struct Geometry {
    /// The wheel that the other distances use.
    pub wheel: Wheel,
    /// Ticks in a unit of [`Length`].
    pub scale: LengthScale,
    /// A unit of [`Length`] in 2^-16 mm.
    unit: u32,
    /// The settings that are lengths, [`LENGTHS`].
    lengths: [Length; LENGTHS.len()],
    /// Ground guarded on either side of an expected plant: the scatter and half a stem zone.
    pub guarded: Length,
    /// Ground remembered behind the frontier.
    pub memory: Length,
}

impl Geometry {
    /// No distances.
    pub const NONE: Self = Self {
        wheel: Wheel::NONE,
        scale: LengthScale::TICK,
        unit: 0,
        lengths: [Length::ZERO; LENGTHS.len()],
        guarded: Length::ZERO,
        memory: Length::ZERO,
    };

    /// X: from beam to tool.
    pub const fn beam_to_tool(&self) -> Length {
        self.lengths[0]
    }

    /// From the first beam back to the second; 0 without a second beam.
    pub const fn second_beam(&self) -> Length {
        self.lengths[1]
    }

    /// Ground to keep clear on both sides of a canopy.
    pub const fn margin(&self) -> Length {
        self.lengths[2]
    }

    /// Width kept around a plant's middle; 0 keeps the whole canopy.
    pub const fn stem_zone(&self) -> Length {
        self.lengths[3]
    }

    /// How far a stem zone may reach beyond a canopy: half of it, if the canopy is narrow.
    pub const fn beyond_canopy(&self) -> Length {
        Length(self.stem_zone().0 >> 1)
    }

    /// The widest canopy.
    pub const fn max_width(&self) -> Length {
        self.lengths[4]
    }

    /// Clear ground that ends a detection.
    pub const fn merge_gap(&self) -> Length {
        self.lengths[5]
    }

    /// From the middle of a plant to the middle of the next; 0 turns guarding off.
    pub const fn guard_spacing(&self) -> Length {
        self.lengths[6]
    }

    /// How far a plant may stand from its expected place.
    pub const fn guard_scatter(&self) -> Length {
        self.lengths[7]
    }

    /// Widens the margin.
    pub fn widen_margin(&mut self, by: Length) {
        self.lengths[2] = self.lengths[2] + by;
    }

    /// The narrowest detection that both beams have to see: 8 mm or a tick. Less may be an insect or a clod in one beam.
    pub fn least_seen(&self) -> Length {
        // The memory is eight metres.
        Length((self.memory.0 + 1023) >> 10)
    }

    /// The distances of these settings. `excess` is how much farther the wheel turns than the machine rolls, in 256ths.
    pub fn of(settings: &Settings, excess: i8) -> Self {
        let mut geometry = Self::NONE;
        geometry.follow(settings, excess);
        geometry
    }

    /// Recalculates as [`of`](Self::of) does, in place.
    pub fn follow(&mut self, settings: &Settings, excess: i8) {
        self.wheel = settings.wheel();
        let metre = self.wheel.ticks(1000);
        self.scale = LengthScale::of(metre);
        self.unit = self.wheel.unit(self.scale);
        for index in 0..LENGTHS.len() {
            let Some(setting) = Setting::from_index(LENGTHS[0] as u8 + index as u8) else { break };
            self.lengths[index] = self.length(settings, setting, excess);
        }
        self.guarded = self.guard_scatter() + self.beyond_canopy();
        self.memory = Length(self.scale.length(metre).0 * MEMORY_M);
    }

    /// A length in millimetres, rounded toward zero, limited to 16 bits: [`Wheel::millimetres`] of its ticks. With a wheel that is
    /// too coarse for work, it is wrong from 65 m on.
    #[cfg_attr(target_arch = "avr", inline(never))]
    pub fn millimetres(&self, length: Length) -> i16 {
        let magnitude = u32::from(length.0.unsigned_abs()).wrapping_mul(self.unit);
        let millimetres = ((magnitude >> 16) as u16).min(i16::MAX as u16) as i16;
        if length < Length::ZERO { -millimetres } else { millimetres }
    }

    /// A setting in millimetres as a length, with slip.
    #[cfg_attr(target_arch = "avr", inline(never))]
    fn length(&self, settings: &Settings, setting: Setting, excess: i8) -> Length {
        let millimetres = settings.get(setting);
        // The conversion takes time, and a feature that is off needs none.
        if millimetres == 0 {
            return Length::ZERO;
        }
        let turned = self.wheel.ticks(millimetres).0 * i32::from(Slip::WHOLE + i16::from(excess));
        self.scale.length(Ticks(turned >> 8))
    }
}

/// Distances rolled at the present speed during each delay; negative backwards.
#[derive(Clone, Copy, Debug)]
pub struct Leads {
    /// While the tool swings out: `lead_out_ms`.
    pub out: Length,
    /// Before the tool begins to come back: `lead_in_ms`. Never longer than `out`.
    pub back: Length,
    /// During the sensor's response: `beam_response_ms`.
    pub response: Length,
}

impl Leads {
    /// Leads of a machine at rest.
    pub const NONE: Self = Self { out: Length::ZERO, back: Length::ZERO, response: Length::ZERO };

    /// The leads at a measured speed, if the machine reaches the `expected` speed, at least as high, while the tool swings out. The
    /// way back begins in a moment, at the measured speed. A lead that is too long would let the tool in too early.
    pub fn at(speed: Speed, expected: Speed, settings: &Settings) -> Self {
        let out_ms = settings.get(Setting::LeadOutMs);
        let rolled = move |speed: Speed, milliseconds| speed.distance_in_ms(milliseconds);
        // 1 ms is added for the mean delay of a command: half a tick, half a turn, half a pulse. A lead of 0 stays 0, as the paper
        // has it.
        let lead = move |speed, milliseconds: u16| rolled(speed, milliseconds + u16::from(milliseconds > 0));
        Self {
            out: lead(expected, out_ms),
            back: lead(speed, settings.get(Setting::LeadInMs).min(out_ms)),
            response: rolled(speed, settings.get(Setting::BeamResponseMs)),
        }
    }

    /// The ground that must be open for the tool to be in the row: from near to far, counted from the tool in rolling direction.
    /// The tool will be there when a command of this turn takes effect.
    ///
    /// To stay in, the tool needs a stretch that is shorter, by a fifth at both ends, than to come in. So at a steady speed the
    /// tool leaves once and returns once for each zone, although the measured speed varies.
    #[cfg_attr(not(target_arch = "avr"), inline)]
    pub fn stretch(&self, tool_out: bool) -> (Length, Length) {
        let (out, back) = (self.out.0.unsigned_abs(), self.back.0.unsigned_abs());
        // Ground beyond the lead out does not matter yet.
        let near = (back + back / 4).min(out);
        let (mut near, mut far) = (near.cast_signed(), out.cast_signed());
        if tool_out {
            // Coming back pays only if the tool can stay for at least its stroke, the difference of the leads. This also keeps it
            // out for the same zone if the speed drops. The tick at either end allows for an encoder that trembles on an edge.
            near -= near / 5 + 1;
            // It wraps at a lead of 6.8 m. Such a machine has the alarm `too_fast`.
            far = far.wrapping_add_unsigned((out - back).max(out / 4) + 1);
        }
        if self.out < Length::ZERO { (Length(-near), Length(-far)) } else { (Length(near), Length(far)) }
    }
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::settings::TICKS_PER_M_LEAST;

    #[test]
    fn the_stretch_to_stay_in_lies_within_the_stretch_to_come_in() {
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
    fn the_stretch_of_a_lead_that_no_machine_has_is_calculated_too() {
        for (out, back) in [(16_384, 0), (i16::MAX, 0), (i16::MAX, i16::MAX), (-i16::MAX, 0), (-i16::MAX, -i16::MAX)] {
            for tool_out in [false, true] {
                Leads { out: Length(out), back: Length(back), response: Length::ZERO }.stretch(tool_out);
            }
        }
    }

    #[test]
    fn the_open_stretch_is_longer_for_a_tool_that_is_out() {
        let forward = Leads { out: Length(103), back: Length(60), response: Length::ZERO };
        assert_eq!(forward.stretch(false), (Length(75), Length(103)));
        assert_eq!(forward.stretch(true), (Length(75 - 16), Length(103 + 43 + 1)));
        let late_back = Leads { back: Length(100), ..forward };
        assert_eq!(late_back.stretch(true), (Length(103 - 21), Length(103 + 25 + 1)));
        let backward = Leads { out: Length(-103), back: Length(-60), ..forward };
        assert_eq!(backward.stretch(true), (Length(16 - 75), Length(-103 - 43 - 1)));
    }

    #[test]
    fn a_lead_is_the_distance_in_its_time_and_a_millisecond() {
        let (speed, expected) = (Speed(1000), Speed(1100));
        // Only the swing out is led at the expected speed.
        for (lead_out_ms, expected_leads) in [(180, [199, 41, 7]), (0, [0, 0, 7])] {
            let settings = Settings::with(&[
                (Setting::LeadOutMs, lead_out_ms),
                (Setting::LeadInMs, 40),
                (Setting::BeamResponseMs, 7),
            ]);
            let Leads { out, back, response } = Leads::at(speed, expected, &settings);
            assert_eq!([out.0, back.0, response.0], expected_leads);
        }
    }

    #[test]
    fn every_length_has_the_millimetres_of_its_ticks() {
        for ticks_per_m in (TICKS_PER_M_LEAST..=20_000).step_by(37) {
            let geometry = Geometry::of(&Settings::with(&[(Setting::TicksPerM, ticks_per_m)]), 0);
            for length in (i16::MIN..=i16::MAX).map(Length) {
                let ticks = geometry.scale.ticks(length);
                assert_eq!(
                    geometry.millimetres(length),
                    geometry.wheel.millimetres(ticks),
                    "{length:?}, {ticks_per_m}"
                );
            }
        }
    }

    #[test]
    fn lengths_of_every_wheel_fit_16_bits() {
        for ticks_per_m in 40..=20_000 {
            let settings = Settings::with(&[
                (Setting::TicksPerM, ticks_per_m),
                (Setting::BeamToToolMm, 2000),
                (Setting::MaxWidthMm, 1500),
            ]);
            let geometry = Geometry::of(&settings, 0);
            let (scale, beam_to_tool, memory) = (geometry.scale, geometry.beam_to_tool(), geometry.memory);
            let farthest = i32::from(memory.0) + 2 * i32::from(beam_to_tool.0) + i32::from(geometry.max_width().0);
            assert!(farthest < i16::MAX.into(), "{ticks_per_m} a metre: {farthest}");
            let error = scale.ticks(beam_to_tool).0 - 2 * i32::from(ticks_per_m);
            assert!(error <= 0 && -error < 16, "{ticks_per_m} a metre: {error}");
        }
    }
}
