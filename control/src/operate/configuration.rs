//! The settings in use and the saved ones: the operator changes, saves and reloads them here.

use crate::{
    alarm::Alarm,
    memory::Memory,
    operate::{command_error::CommandError, saved::SavedSettings},
    settings::{Contradiction, Setting, Settings},
};

/// The settings in use and the saved settings.
#[derive(Clone, Debug)]
pub struct Configuration<M> {
    settings: Settings,
    /// Whether leads, distances and limits are yet to be recalculated.
    changed: bool,
    /// The X that the margin, leads and top speed refused last would have needed.
    needed_mm: u16,
    saved: SavedSettings<M>,
}

impl<M: Memory> Configuration<M> {
    /// A configuration before [`load`](Self::load).
    pub const fn new(memory: M) -> Self {
        Self { settings: Settings::NONE, changed: false, needed_mm: 0, saved: SavedSettings::new(memory) }
    }

    /// Loads the saved settings, or the defaults. Returns an alarm if the settings are lost or contradict each other.
    pub fn load(&mut self) -> Option<Alarm> {
        if self.saved.load_into(&mut self.settings) {
            return self.settings.contradiction().map(|_| Alarm::SettingsContradict);
        }
        self.settings.take_defaults();
        Some(Alarm::SettingsLost)
    }

    /// The settings in use.
    pub fn settings(&self) -> &Settings {
        &self.settings
    }

    /// The value of a setting in use.
    pub fn get(&self, setting: Setting) -> u16 {
        self.settings.get(setting)
    }

    /// The saved value of a setting, if settings are saved.
    pub fn saved(&self, setting: Setting) -> Option<u16> {
        self.saved.value(setting)
    }

    /// Whether a saved copy has changed since it was saved, so that the settings in use may be older.
    pub fn has_spoiled_copy(&self) -> bool {
        self.saved.is_spoiled()
    }

    /// Whether the settings have changed since [`follow`](Self::follow).
    pub fn has_changed(&self) -> bool {
        self.changed
    }

    /// The caller has recalculated from the settings.
    pub fn follow(&mut self) {
        self.changed = false;
    }

    /// Changes a setting. `is_working` tells whether the machine works.
    ///
    /// # Errors
    /// [`CommandError::NotInHold`], [`CommandError::OutOfRange`], and a new [`Contradiction`]. Nothing is changed then.
    #[inline(never)]
    pub fn change(&mut self, setting: Setting, value: u16, is_working: bool) -> Result<(), CommandError> {
        if setting.is_hold_only() && is_working {
            return Err(CommandError::NotInHold);
        }
        // Settings that already contradict each other are corrected one at a time.
        let contradicted = self.settings.contradiction().is_some();
        let (old, old_calibration) = (self.settings.get(setting), self.settings.get(Setting::TicksPerM));
        self.settings.change(setting, value).map_err(|_| CommandError::OutOfRange)?;
        if !contradicted && let Err(refusal) = self.expect_no_contradiction() {
            let _ = self.settings.set(Setting::TicksPerM, old_calibration);
            let _ = self.settings.set(setting, old);
            return Err(refusal);
        }
        self.changed = true;
        self.saved.change();
        Ok(())
    }

    /// Restores factory settings.
    pub fn take_defaults(&mut self) {
        self.settings.take_defaults();
        self.changed = true;
    }

    /// Loads the saved settings.
    ///
    /// # Errors
    /// [`CommandError::NothingSaved`].
    pub fn take_saved(&mut self) -> Result<(), CommandError> {
        if !self.saved.restore(&mut self.settings) {
            return Err(CommandError::NothingSaved);
        }
        self.changed = true;
        Ok(())
    }

    /// Starts to save the settings; [`carry_on`](Self::carry_on) finishes it.
    ///
    /// # Errors
    /// A [`Contradiction`].
    pub fn save(&mut self) -> Result<(), CommandError> {
        self.expect_no_contradiction()?;
        self.saved.save();
        Ok(())
    }

    /// Runs one step of a save, without waiting. Returns whether all is written.
    pub fn carry_on(&mut self) -> bool {
        self.saved.carry_on(&self.settings)
    }

    /// Checks that the settings fit together.
    ///
    /// # Errors
    /// A [`Contradiction`].
    #[inline(never)]
    pub fn expect_no_contradiction(&mut self) -> Result<(), CommandError> {
        self.settings.contradiction().map_or(Ok(()), |contradiction| Err(self.refusal(contradiction)))
    }

    /// The least X for the last [`CommandError::BeamTooNear`], in mm.
    pub fn needed_mm(&self) -> u16 {
        self.needed_mm
    }

    fn refusal(&mut self, contradiction: Contradiction) -> CommandError {
        match contradiction {
            Contradiction::PulsesEqual => CommandError::PulsesEqual,
            Contradiction::SecondBeamAstray => CommandError::SecondBeamAstray,
            Contradiction::EncoderTooCoarse => CommandError::EncoderTooCoarse,
            Contradiction::BeamTooNear { needed_mm } => {
                self.needed_mm = needed_mm;
                CommandError::BeamTooNear
            }
        }
    }
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::memory::Volatile;

    #[test]
    fn each_change_of_settings_asks_for_one_recalculation() {
        let mut configuration = Configuration::new(Volatile::new());
        configuration.load();
        assert!(!configuration.has_changed(), "start-up recalculates");
        assert_eq!(configuration.change(Setting::K, 0, false), Err(CommandError::OutOfRange));
        assert_eq!(configuration.take_saved(), Err(CommandError::NothingSaved));
        assert!(!configuration.has_changed(), "a refused change changes nothing");
        let changes: [fn(&mut Configuration<Volatile>); 3] = [
            |configuration| configuration.change(Setting::K, 5, true).expect("within its range"),
            |configuration| configuration.take_defaults(),
            |configuration| {
                configuration.save().expect("nothing contradicts");
                while !configuration.carry_on() {}
                configuration.take_saved().expect("it was saved");
            },
        ];
        for change in changes {
            change(&mut configuration);
            assert!(configuration.has_changed());
            configuration.follow();
            assert!(!configuration.has_changed());
        }
    }
}
