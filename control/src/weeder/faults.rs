//! Faults and warnings: readings with which the machine cannot work, and states that the operator should know.

use super::Controller;
use crate::{
    alarm::{Alarm, Warning},
    ground::class::{Class, Classifier},
    measure::sensors::Sensors,
    memory::Memory,
    operate::{event::Event, manual_test::ManualTest},
    settings::Setting,
    units::Length,
};

/// How much longer than the lead the end switch may take: a servo frame (20 ms), the contacts' bouncing, and a reserve.
const END_SWITCH_GRACE_MS: u16 = 100;

/// How much longer than the lead a swing out must last for its end to count: a servo frame, and what a lead may be shortened beside a
/// stem zone. The contacts may still bounce.
const END_SWITCH_LEAST_MS: u16 = 40;

/// Least free stack in bytes for working: two interrupts' worth.
const STACK_RESERVE: u16 = 48;

/// Progress for the encoder's monitor: 1.7 to 3.3 mm with an encoder finer than 0.4 mm, four ticks with any other.
const PROGRESS: Length = Length(4);

impl<C: Classifier, M: Memory> Controller<C, M> {
    /// The fault in the readings, if any. `doubted` is the number of ticks that may be noise.
    #[cfg_attr(target_arch = "avr", inline(never))]
    pub(super) fn fault(&mut self, doubted: u8) -> Option<Alarm> {
        let working = self.is_working();
        let Sensors { now, position, .. } = self.sensors;
        let fault =
            self.sensors.encoder.read(now, position, doubted, self.ground.geometry().scale.ticks(PROGRESS).0 as u8);
        if !self.sensors.encoder.stands() {
            // Movement ends a manual test, with the tool out.
            self.manual_test = ManualTest::Idle;
        }
        if self.sensors.encoder.is_silent() {
            // The distance since then is unknown.
            self.ground.doubt();
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
        if working && self.limits.is_too_fast(self.sensors.meter.speed()) {
            return Some(Alarm::TooFast);
        }
        if working && self.ground.rolled_back_too_far() {
            return Some(Alarm::RolledBackTooFar);
        }
        self.sensors.end_switch.read(self.sensors.now, self.sensors.readings.end_switch_on);
        if self.has_end_switch()
            && (self.tool.follows_no_swing()
                || self.sensors.end_switch.is_on() != self.tool.is_out()
                // After a manual test has ended, the tool has not had its command yet.
                && self.tool.has_held(
                    self.pulse(),
                    self.sensors.readings.now.slow(),
                    self.configuration.get(Setting::LeadOutMs) + END_SWITCH_GRACE_MS,
                ))
        {
            return Some(Alarm::ToolStuck);
        }
        (self.sensors.readings.stack_free < STACK_RESERVE).then_some(Alarm::StackLow)
    }

    /// Whether there is an end switch that the tool must follow.
    fn has_end_switch(&self) -> bool {
        self.configuration.get(Setting::EndSwitch) != 0 && !self.manual_test.needs_no_end_switch()
    }

    /// A swing ends. Counts those out that the end switch has not followed: at speed they may be too short for the alarm while they
    /// last.
    pub(super) fn count_unfollowed(&mut self) {
        let least_ms = self.configuration.get(Setting::LeadOutMs) + END_SWITCH_LEAST_MS;
        if self.has_end_switch() {
            self.tool.end_swing(self.sensors.readings.now.slow(), least_ms, self.sensors.readings.end_switch_on);
        }
    }

    /// Counts unknown detections and detections of unusual width while the machine works.
    pub(super) fn count_misfit(&mut self, class: Class, width_mm: i16) {
        let enough = self.configuration.get(Setting::MisfitAfter) as u8;
        if self.is_working() && self.unknown_run.count(class, width_mm, enough) {
            self.forget_and_raise(Alarm::CropUnknown);
        }
    }

    /// Reports late commands and missing plants, each once.
    pub(super) fn report_warnings(&mut self) {
        if !self.is_working() {
            return;
        }
        if self.tool.awaits_ground() && self.ground.is_closed_at_tool() {
            // The speed may vary by an eighth of the lead.
            let lead_ms = self.configuration.get(Setting::LeadOutMs);
            if self.tool.count_if_late(self.sensors.readings.now.slow(), lead_ms - lead_ms / 8) {
                self.events.add(Event::Warning(Warning::LateCommand));
            }
        }
        if self.plant_timeout.take_warning(self.sensors.position, self.limits.no_plant()) {
            self.events.add(Event::Warning(Warning::NoPlants));
        }
    }
}
