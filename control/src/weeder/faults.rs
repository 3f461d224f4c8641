//! Faults and warnings: what the readings show that the machine cannot work with, and what the operator should know.

use super::Controller;
use crate::{
    alarm::{Alarm, Warning},
    ground::{
        class::{Class, Classifier},
        examples::NARROW_MM,
    },
    measure::readings::Readings,
    memory::Memory,
    operate::event::Event,
    settings::{Setting, Settings},
    units::{Length, Position, Ticks, Wheel},
};

/// What the end switch may take longer than the lead: a servo frame, the contacts' bouncing, and some patience.
const END_SWITCH_GRACE_MS: u16 = 100;

/// Free bytes of stack below which the machine does not work on: two interrupts' worth.
const STACK_RESERVE: u16 = 48;

/// What the encoder's monitor takes for progress: 1.7 to 3.3 mm with an encoder finer than 0.4 mm, and four ticks with any other.
const PROGRESS: Length = Length(4);

/// What the machine is not to go beyond, in ticks of the present wheel.
#[derive(Clone, Copy, Debug)]
pub(super) struct Limits {
    /// In ticks a second, 60,000 at the most.
    top_speed: u16,
    /// Zero for none.
    no_plant: Ticks,
}

impl Limits {
    pub(super) const NONE: Self = Self { top_speed: 0, no_plant: Ticks::ZERO };

    pub(super) fn of(settings: &Settings, wheel: Wheel) -> Self {
        Self {
            top_speed: wheel.ticks(settings.get(Setting::TopSpeedMmS)).0 as u16,
            no_plant: Ticks(wheel.ticks(1000).0 * i32::from(settings.get(Setting::NoPlantM))),
        }
    }
}

/// How far the machine has worked without seeing a plant.
#[derive(Clone, Debug)]
pub(super) struct NoPlants {
    /// Where the last object ended, or work began.
    since: Position,
    warned: bool,
}

impl NoPlants {
    /// None since here.
    pub(super) const fn since(position: Position) -> Self {
        Self { since: position, warned: false }
    }

    /// Whether the operator is to be warned, once, as none was seen on a way longer than this; zero never.
    fn warn(&mut self, position: Position, longest: Ticks) -> bool {
        if self.warned || longest == Ticks::ZERO || position - self.since <= longest {
            return false;
        }
        self.warned = true;
        true
    }

    /// Whether the operator was warned.
    pub(super) const fn has_warned(&self) -> bool {
        self.warned
    }
}

/// Objects as narrow as a weed since the last one that was wider or taken for a plant, or that was labelled, or since work began.
///
/// Those that are unknown are kept, and count nevertheless: a stalk far behind the last plant is like no example, be it crop or weed.
#[derive(Clone, Debug)]
pub(super) struct Misfits {
    count: u8,
    /// Whether any of them was taken for a weed: else nothing is lost.
    any_weed: bool,
}

impl Misfits {
    /// No objects.
    pub(super) const NONE: Self = Self { count: 0, any_weed: false };

    /// Counts an object; whether these are so many now, or more; zero never.
    fn count(&mut self, class: Class, width_mm: i16, enough: u8) -> bool {
        if class == Class::Plant || width_mm >= NARROW_MM {
            *self = Self::NONE;
        } else if width_mm > 0 {
            // A leaf that moves while the machine stands has no width.
            self.count = self.count.saturating_add(1);
            self.any_weed |= class == Class::Weed;
        }
        self.any_weed && self.count > enough.wrapping_sub(1)
    }
}

impl<C: Classifier, M: Memory> Controller<C, M> {
    /// The fault that the readings show, if any; so many of the encoder's ticks are `doubted`.
    #[cfg_attr(target_arch = "avr", inline(never))]
    pub(super) fn fault(&mut self, doubted: u8) -> Option<Alarm> {
        let Readings { now, position, end_switch_on, stack_free, .. } = self.sensors.readings;
        let working = self.is_working();
        let fault = self.sensors.encoder.read(now, position, doubted, self.ground.ticks(PROGRESS).0 as u8);
        if self.sensors.encoder.is_silent() {
            // Nobody knows how far the machine has rolled since.
            self.ground.forget();
        }
        match fault {
            // A machine at rest may tremble.
            Some(Alarm::EncoderChannelDead) if !working => {}
            None => {}
            fault => return fault,
        }
        if self.ground.is_blocked() {
            return Some(Alarm::BeamBlocked);
        }
        if working && self.sensors.meter.speed().is_beyond(self.limits.top_speed) {
            return Some(Alarm::TooFast);
        }
        if working && self.ground.rolled_back_too_far() {
            return Some(Alarm::RolledBackTooFar);
        }
        self.sensors.end_switch.read(now, end_switch_on);
        if self.configuration.get(Setting::EndSwitch) != 0
            && !self.bench.needs_no_end_switch()
            && self.sensors.end_switch.is_on() != self.tool.is_out()
            // Where what was done by hand has ended just now, the tool is yet to be told.
            && self.tool.has_had(self.orders().pulse, now, self.configuration.get(Setting::LeadOutMs) + END_SWITCH_GRACE_MS)
        {
            return Some(Alarm::ToolStuck);
        }
        (stack_free < STACK_RESERVE).then_some(Alarm::StackLow)
    }

    /// Counts what an object was taken for, while it is at stake.
    pub(super) fn count_misfit(&mut self, class: Class, width_mm: i16) {
        if self.is_working() && self.misfits.count(class, width_mm, self.configuration.get(Setting::MisfitAfter) as u8)
        {
            self.raise(Alarm::CropUnknown);
        }
    }

    /// Tells what the operator should know, once.
    pub(super) fn warn(&mut self) {
        if !self.is_working() {
            return;
        }
        if self.tool.awaits_ground() && self.ground.is_closed_at_tool() {
            // An eighth of the lead is what the speed may waver by.
            let lead_ms = self.configuration.get(Setting::LeadOutMs);
            if self.tool.is_late(self.sensors.readings.now, lead_ms - lead_ms / 8) {
                self.events.add(Event::Warning(Warning::LateCommand));
            }
        }
        if self.no_plants.warn(self.sensors.readings.position, self.limits.no_plant) {
            self.events.add(Event::Warning(Warning::NoPlants));
        }
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn a_plant_however_narrow_and_whatever_is_wide_end_the_count_of_misfits() {
        for (class, width_mm, ends) in [
            (Class::Plant, NARROW_MM - 1, true),
            (Class::Weed, NARROW_MM, true),
            (Class::Unknown, NARROW_MM, true),
            (Class::Unknown, NARROW_MM - 1, false),
            (Class::Weed, 0, false),
        ] {
            let mut misfits = Misfits::NONE;
            assert!(!misfits.count(Class::Weed, 10, 3) && !misfits.count(Class::Weed, 10, 3));
            misfits.count(class, width_mm, 3);
            assert_eq!(misfits.count(Class::Weed, 10, 3), !ends, "{class:?} {width_mm} mm");
        }
    }
}
