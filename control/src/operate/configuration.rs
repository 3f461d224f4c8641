//! The settings in use, beside those that are saved: how the operator changes them, keeps them and takes them back.

use crate::{
    alarm::Alarm,
    memory::Memory,
    operate::{command_error::CommandError, saved::SavedSettings},
    settings::{Contradiction, Setting, Settings},
};

/// The settings in use and those that are saved.
#[derive(Clone, Debug)]
pub struct Configuration<M> {
    settings: Settings,
    /// Whether what follows from them is yet to be worked out.
    changed: bool,
    /// The X that margin, leads and top speed would have needed, where it was refused for that last.
    needed_mm: u16,
    saved: SavedSettings<M>,
}

impl<M: Memory> Configuration<M> {
    /// A configuration that nobody has loaded.
    pub const fn new(memory: M) -> Self {
        Self { settings: Settings::NONE, changed: false, needed_mm: 0, saved: SavedSettings::new(memory) }
    }

    /// Loads what is saved, or the defaults; returns what is wrong with it.
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

    /// The value of a setting that is saved, if any is.
    pub fn saved(&self, setting: Setting) -> Option<u16> {
        self.saved.value(setting)
    }

    /// Whether the settings have changed since what follows from them was worked out.
    pub fn has_changed(&self) -> bool {
        self.changed
    }

    /// What follows from the settings is worked out.
    pub fn follow(&mut self) {
        self.changed = false;
    }

    /// Sets several settings, or none of them; `is_working` tells whether the machine is.
    ///
    /// # Errors
    /// [`CommandError::NotInHold`], [`CommandError::OutOfRange`], and that of a [`Contradiction`] where there was none before; nothing
    /// is changed then.
    #[inline(never)]
    pub fn change(&mut self, changes: &[(Setting, u16)], is_working: bool) -> Result<(), CommandError> {
        let mut settings = self.settings.clone();
        for &(setting, value) in changes {
            if setting.is_hold_only() && is_working {
                return Err(CommandError::NotInHold);
            }
            settings.set(setting, value).map_err(|_| CommandError::OutOfRange)?;
            // Another wheel is one that has not been measured.
            if setting.is_of_the_wheel() {
                let _ = settings.set(Setting::TicksPerM, 0);
            }
        }
        // Settings that contradict each other already are mended one at a time.
        if let Some(contradiction) = settings.contradiction()
            && self.settings.contradiction().is_none()
        {
            return Err(self.refusal(contradiction));
        }
        self.settings = settings;
        self.changed = true;
        Ok(())
    }

    /// Goes back to the settings of a new machine.
    pub fn take_defaults(&mut self) {
        self.settings.take_defaults();
        self.changed = true;
    }

    /// Goes back to the saved settings.
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

    /// Begins to save the settings, which [`carry_on`](Self::carry_on) finishes.
    ///
    /// # Errors
    /// That of a [`Contradiction`].
    pub fn save(&mut self) -> Result<(), CommandError> {
        self.expect_no_contradiction()?;
        self.saved.save(&self.settings);
        Ok(())
    }

    /// Carries on with a save, without waiting; whether all has been written.
    pub fn carry_on(&mut self) -> bool {
        self.saved.carry_on()
    }

    /// Nothing, if the settings can be right together.
    ///
    /// # Errors
    /// That of a [`Contradiction`].
    #[inline(never)]
    pub fn expect_no_contradiction(&mut self) -> Result<(), CommandError> {
        self.settings.contradiction().map_or(Ok(()), |contradiction| Err(self.refusal(contradiction)))
    }

    /// The X that [`CommandError::BeamTooNear`] asked for last, in mm.
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
    fn what_follows_from_the_settings_is_to_be_worked_out_once_for_each_change_of_them() {
        let mut configuration = Configuration::new(Volatile::new());
        configuration.load();
        assert!(!configuration.has_changed(), "waking up works it out");
        assert_eq!(configuration.change(&[(Setting::K, 0)], false), Err(CommandError::OutOfRange));
        assert_eq!(configuration.take_saved(), Err(CommandError::NothingSaved));
        assert!(!configuration.has_changed(), "what is refused changes nothing");
        let changes: [fn(&mut Configuration<Volatile>); 3] = [
            |configuration| configuration.change(&[(Setting::K, 5)], true).expect("it may be"),
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
