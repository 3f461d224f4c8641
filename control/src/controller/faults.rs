//! Faults and warnings: what the readings show that the machine cannot work with, and what the operator should know.

use super::{Controller, Readings, bench::Bench, count};
use crate::{
    alarm::{Alarm, Warning},
    classifier::Classifier,
    event::Event,
    memory::Memory,
    settings::{Setting, Settings},
    units::{Interval, Length, Ticks},
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

    pub(super) fn of(settings: &Settings) -> Self {
        let wheel = settings.wheel();
        Self {
            top_speed: wheel.ticks(settings.get(Setting::TopSpeedMmS)).0 as u16,
            no_plant: Ticks(wheel.ticks(1000).0 * i32::from(settings.get(Setting::NoPlantM))),
        }
    }
}

impl<C: Classifier, M: Memory> Controller<C, M> {
    /// The fault that the readings show, if any; so many of the encoder's ticks are `doubted`.
    #[inline(never)]
    pub(super) fn fault(&mut self, doubted: u8) -> Option<Alarm> {
        let Readings { now, position, end_switch_on, stack_free, .. } = self.readings;
        let working = self.is_working();
        let fault = self.encoder.read(now, position, doubted, self.ground.ticks(PROGRESS).0 as u8);
        if self.encoder.is_silent() {
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
        if working && self.meter.speed().is_beyond(self.limits.top_speed) {
            return Some(Alarm::TooFast);
        }
        if working && self.ground.rolled_back_too_far() {
            return Some(Alarm::RolledBackTooFar);
        }
        self.end_switch.read(now, end_switch_on);
        if self.settings.get(Setting::EndSwitch) != 0
            && !matches!(self.bench, Bench::ByHand(_) | Bench::Swings(_))
            && self.end_switch.is_on() != self.tool_out
            // What was done by hand has ended just now, and the tool is yet to be told.
            && self.orders().pulse == self.pulse
            && self.was_told_for(self.settings.get(Setting::LeadOutMs) + END_SWITCH_GRACE_MS)
        {
            return Some(Alarm::ToolStuck);
        }
        (stack_free < STACK_RESERVE).then_some(Alarm::StackLow)
    }

    /// Whether the servo was told its pulse so long ago.
    #[inline(never)]
    fn was_told_for(&self, milliseconds: u16) -> bool {
        self.readings.now - self.told_at >= Interval::from_ms(milliseconds.into())
    }

    /// Tells what the operator should know, once.
    pub(super) fn warn(&mut self) {
        if !self.is_working() {
            return;
        }
        if self.awaits_ground && self.ground.is_closed_at_tool() {
            self.awaits_ground = false;
            // An eighth of the lead is what the speed may waver by.
            let lead_ms = self.settings.get(Setting::LeadOutMs);
            if !self.was_told_for(lead_ms - lead_ms / 8) {
                count(&mut self.late);
                self.tell(Event::Warning(Warning::LateCommand));
            }
        }
        let no_plant = self.limits.no_plant;
        if !self.warned && no_plant > Ticks::ZERO && self.readings.position - self.last_seen > no_plant {
            self.warned = true;
            self.tell(Event::Warning(Warning::NoPlants));
        }
    }
}
