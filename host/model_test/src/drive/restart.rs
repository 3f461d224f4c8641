//! Resets the machine, and compares what it restored with what it acknowledged as saved.

use super::Drive;
use crate::machine::{Checked, Machine};
use control::{
    alarm::Alarm,
    ground::class::Listed,
    measure::reset::Cause,
    operate::state::State,
    settings::{Setting, Settings},
};
use proptest::prelude::*;

/// The data that the machine must restore.
#[derive(Debug, Default)]
pub(super) struct Saves {
    /// The settings of the last acknowledged save, and those of a save in progress.
    pub(super) saved: Option<Settings>,
    pub(super) saving: Option<Settings>,
    /// Whether the machine may have measured other leads before it saved.
    pub(super) leads_in_doubt: bool,
    /// Whether a byte of the EEPROM was changed, so that the next start may find anything.
    pub(super) is_spoiled: bool,
    pub(super) taught: Vec<Listed>,
}

impl Saves {
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

impl<M: Machine> Drive<M> {
    /// Resets the machine. It must start in HOLD or with an alarm, with the tool out, and with everything that it
    /// acknowledged as saved.
    pub(super) fn init(&mut self, cause: Cause, torn: Option<u8>) -> Checked {
        let Self { machine, physics, expectations, .. } = self;
        let saves = &mut expectations.saves;
        let is_spoiled = std::mem::take(&mut saves.is_spoiled);
        let (is_answered, maybe) = (machine.is_done(), machine.examples());
        machine.reset(cause, torn, &physics.world)?;
        let is_lost = machine.state() == State::Alarm(Alarm::SettingsLost);
        prop_assert!(is_lost || machine.state() == State::Hold, "it started in {:?}", machine.state());
        let found = (!is_lost).then(|| machine.settings().clone());
        // A save that was not acknowledged may be complete, or have no effect.
        let expected = [&saves.saving, &saves.saved].map(|kept| saves.with_leads_of(kept, &found));
        if !is_spoiled && (saves.saving.is_none() || expected[0] != found) {
            prop_assert_eq!(&found, &expected[1], "other settings than were saved");
        }
        saves.saved = found;
        let examples = machine.examples();
        if is_spoiled {
        } else if is_answered {
            prop_assert_eq!(&examples, &saves.taught, "other examples than were taught");
        } else {
            let is_known = |example| maybe.contains(example) || saves.taught.contains(example);
            prop_assert!(examples.iter().all(is_known) || !M::IS_OPEN, "{examples:?}");
        }
        (saves.taught, saves.saving) = (examples, None);
        (physics.tool_was_stuck, physics.out_since_us) = (physics.tool_is_stuck, Some(physics.world.time_us));
        expectations.restart(machine, physics);
        Ok(())
    }
}
