//! Faults and warnings: what the readings show that the machine cannot work with, and what the operator should know.

use super::{Controller, Readings};
use crate::{
    alarm::{Alarm, Warning},
    classifier::Classifier,
    event::Event,
    memory::Memory,
    settings::Setting,
    units::{Interval, Position, Ticks},
};

/// What the end switch may take longer than the lead: a servo frame, the contacts' bouncing, and some patience.
const END_SWITCH_GRACE_MS: u32 = 100;

/// Free bytes of stack below which the machine does not work on: two interrupts' worth.
const STACK_RESERVE: u16 = 48;

impl<C: Classifier, M: Memory> Controller<C, M> {
    /// The fault that the readings show, if any; the tool was at `tool_was_at` before them.
    #[inline(never)]
    pub(super) fn fault(&mut self, tool_was_at: Position) -> Option<Alarm> {
        let Readings { now, position, jumps, end_switch_on, stack_free, .. } = self.readings;
        let working = self.is_working();
        match self.encoder.read(now, position, jumps) {
            // A machine at rest may tremble.
            Some(Alarm::EncoderChannelDead) if !working => {}
            None => {}
            fault => return fault,
        }
        if let Some(leading) = self.watch.open()
            && self.watch.is_broken()
            && self.watch.frontier() - leading > self.geometry.max_width
        {
            return Some(Alarm::BeamBlocked);
        }
        if working && Ticks(self.meter.speed().0.abs()) > self.geometry.top_speed {
            return Some(Alarm::TooFast);
        }
        let forgotten = |tool| self.schedule.has_forgotten() && self.schedule.known_from().is_ahead_of(tool);
        if working && forgotten(self.tool()) && !forgotten(tool_was_at) {
            return Some(Alarm::RolledBackTooFar);
        }
        self.end_switch.read(now, end_switch_on);
        let swing = Interval::from_ms(u32::from(self.settings.get(Setting::LeadOutMs)) + END_SWITCH_GRACE_MS);
        if self.settings.get(Setting::EndSwitch) != 0
            && !self.bench.moves_the_tool()
            && self.end_switch.is_on() != self.tool_out
            && now - self.told_at > swing
        {
            return Some(Alarm::ToolStuck);
        }
        (stack_free < STACK_RESERVE).then_some(Alarm::StackLow)
    }

    /// Tells what the operator should know, once.
    pub(super) fn warn(&mut self, tool: Position) {
        if !self.is_working() {
            return;
        }
        if self.awaits_ground && self.is_closed(tool, tool) {
            self.awaits_ground = false;
            // An eighth of the lead is what the speed may waver by.
            let lead_ms = u32::from(self.settings.get(Setting::LeadOutMs));
            if self.readings.now - self.told_at < Interval::from_ms(lead_ms - lead_ms / 8) {
                self.late = self.late.saturating_add(1);
                self.tell(Event::Warning(Warning::LateCommand));
            }
        }
        let no_plant = self.geometry.no_plant;
        if !self.warned && no_plant > Ticks::ZERO && self.watch.frontier() - self.last_seen > no_plant {
            self.warned = true;
            self.tell(Event::Warning(Warning::NoPlants));
        }
    }
}
