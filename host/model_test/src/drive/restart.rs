//! Resets the machine, and compares what it restored with what it acknowledged as saved.

use super::{Drive, scale};
use crate::{
    machine::{Checked, Machine},
    model::Model,
    speeds::Speeds,
};
use control::{
    alarm::Alarm,
    measure::reset::Cause,
    operate::state::State,
    settings::{Setting, Settings},
};
use proptest::prelude::*;

impl<M: Machine> Drive<M> {
    /// Resets the machine. It must start in HOLD or with an alarm, with the tool out, and with everything that it
    /// acknowledged as saved.
    pub(super) fn init(&mut self, cause: Cause, torn: Option<u8>) -> Checked {
        let is_spoiled = std::mem::take(&mut self.is_spoiled);
        let is_answered = self.machine.is_done();
        let maybe = self.machine.examples();
        self.machine.reset(cause, torn, &self.world)?;
        let is_lost = self.machine.state() == State::Alarm(Alarm::SettingsLost);
        prop_assert!(is_lost || self.machine.state() == State::Hold, "it started in {:?}", self.machine.state());
        let found = (!is_lost).then(|| self.machine.settings().clone());
        // A save that was not acknowledged may be complete, or have no effect.
        let expected = [&self.saving, &self.saved].map(|kept| self.with_leads_of(kept, &found));
        if !is_spoiled && (self.saving.is_none() || expected[0] != found) {
            prop_assert_eq!(&found, &expected[1], "other settings than were saved");
        }
        self.saved = found;
        let examples = self.machine.examples();
        if is_spoiled {
        } else if is_answered {
            prop_assert_eq!(&examples, &self.taught, "other examples than were taught");
        } else {
            let is_known = |example| maybe.contains(example) || self.taught.contains(example);
            prop_assert!(examples.iter().all(is_known) || !M::IS_OPEN, "{examples:?}");
        }
        self.taught = examples;
        self.scale = scale(self.machine.settings());
        self.model = Model::new(self.here(), self.world.broken);
        let geometry = self.geometry();
        if let Some(stand) = &mut self.stand {
            stand.forget(self.world.time_us, &geometry);
        }
        // The measured speed is 0 until the first measurement.
        self.speeds = Speeds::default();
        self.speeds.take(self.world.time_us, 0.0);
        (self.saving, self.suspect, self.is_tried, self.had_second_beam) = (None, None, false, false);
        (self.tool_was_stuck, self.out_since_us) = (self.tool_is_stuck, Some(self.world.time_us));
        self.disturb();
        Ok(())
    }

    /// The saved settings, with the leads that were found, if those are in doubt.
    fn with_leads_of(&self, kept: &Option<Settings>, found: &Option<Settings>) -> Option<Settings> {
        let (true, Some(kept), Some(found)) = (self.leads_in_doubt, kept, found) else { return kept.clone() };
        let mut kept = kept.clone();
        for lead in [Setting::LeadOutMs, Setting::LeadInMs] {
            // It was within its range.
            let _ = kept.set(lead, found.get(lead));
        }
        Some(kept)
    }
}
