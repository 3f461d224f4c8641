//! What the operator may ask of the machine, by switch or console, and why it may refuse.

use super::{Controller, State, count, faults::Limits};
use crate::{
    calibration::Unfit,
    classifier::{Class, Classifier, Full, label},
    console::Plot,
    memory::Memory,
    settings::{Contradiction, Setting, Settings},
    taught,
};

/// A command that the present state does not allow.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub enum Refusal {
    /// An alarm is latched.
    AlarmLatched,
    /// The setting changes where the tool is, or is to be saved, and the machine is at work.
    NotInHold,
    /// The value lies outside the setting's range.
    OutOfRange,
    /// The settings would contradict each other.
    Contradiction(Contradiction),
    /// There is no object to label yet, or the last one has its label.
    NothingToLabel,
    /// The built-in examples are sure that the object is of this class, which is not the label's.
    TakenFor(Class),
    /// All places for examples are taken.
    ExamplesFull,
    /// No example from the field has this number.
    NoSuchExample,
    /// No settings are saved that could be taken back.
    NothingSaved,
    /// What was rolled tells nothing of the wheel.
    Unfit(Unfit),
    /// A row is not played at such a speed.
    TestSpeed {
        /// The highest speed at which it is, in mm/s.
        fastest: u16,
    },
}

impl<C: Classifier, M: Memory> Controller<C, M> {
    /// Goes to work; with `now`, at once and over ground that the beam has not seen.
    ///
    /// # Errors
    /// [`Refusal::AlarmLatched`] while an alarm is, and [`Refusal::Contradiction`].
    pub fn start(&mut self, now: bool) -> Result<(), Refusal> {
        if let State::Alarm(_) = self.state {
            return Err(Refusal::AlarmLatched);
        }
        self.expect_no_contradiction()?;
        if self.settings_changed {
            self.follow_settings();
        }
        if now {
            self.ground.trust();
        }
        self.go_to_work();
        Ok(())
    }

    /// Takes the tool out of the row. A latched alarm stays.
    pub fn hold(&mut self) {
        if !matches!(self.state, State::Alarm(_)) {
            self.enter(State::Hold);
        }
    }

    /// Clears an alarm; the machine is in HOLD afterwards.
    pub fn clear(&mut self) {
        if let State::Alarm(_) = self.state {
            self.enter(State::Hold);
        }
    }

    /// Sets a setting.
    ///
    /// # Errors
    /// [`Refusal::NotInHold`], [`Refusal::OutOfRange`], and [`Refusal::Contradiction`] where there was none before; nothing
    /// is changed then.
    pub fn set(&mut self, setting: Setting, value: u16) -> Result<(), Refusal> {
        self.change(&[(setting, value)])
    }

    /// Sets several settings, or none of them.
    ///
    /// # Errors
    /// As [`set`](Self::set).
    #[inline(never)]
    pub(super) fn change(&mut self, changes: &[(Setting, u16)]) -> Result<(), Refusal> {
        let mut settings = self.settings.clone();
        for &(setting, value) in changes {
            if setting.description().hold_only && self.is_working() {
                return Err(Refusal::NotInHold);
            }
            settings.set(setting, value).map_err(|_| Refusal::OutOfRange)?;
            // Another wheel is one that has not been measured.
            if setting.is_of_the_wheel() {
                let _ = settings.set(Setting::TicksPerM, 0);
            }
        }
        // Settings that contradict each other already are mended one at a time.
        if let Some(contradiction) = settings.contradiction()
            && self.settings.contradiction().is_none()
        {
            return Err(Refusal::Contradiction(contradiction));
        }
        self.settings = settings;
        self.settings_changed = true;
        Ok(())
    }

    /// Takes all settings back that a new machine has; [`save`](Self::save) makes it last.
    ///
    /// # Errors
    /// [`Refusal::NotInHold`].
    pub fn take_defaults(&mut self) -> Result<(), Refusal> {
        if self.is_working() {
            return Err(Refusal::NotInHold);
        }
        self.settings = Settings::new();
        self.settings_changed = true;
        Ok(())
    }

    /// Takes all settings back that are saved.
    ///
    /// # Errors
    /// [`Refusal::NotInHold`] and [`Refusal::NothingSaved`].
    pub fn take_saved(&mut self) -> Result<(), Refusal> {
        if self.is_working() {
            return Err(Refusal::NotInHold);
        }
        self.settings = self.saved.settings().ok_or(Refusal::NothingSaved)?;
        self.settings_changed = true;
        Ok(())
    }

    /// Works out what follows from the settings. That takes half a millisecond, so the turn in which they are set leaves it to
    /// the next one.
    #[inline(never)]
    pub(super) fn follow_settings(&mut self) {
        self.settings_changed = false;
        self.limits = Limits::of(&self.settings);
        self.ground.follow(&self.settings, self.readings.position, self.meter.speed());
    }

    /// Begins to save the settings, which [`carry_on`](Self::carry_on) finishes.
    ///
    /// # Errors
    /// [`Refusal::NotInHold`] and [`Refusal::Contradiction`].
    pub fn save(&mut self) -> Result<(), Refusal> {
        if self.is_working() {
            return Err(Refusal::NotInHold);
        }
        self.expect_no_contradiction()?;
        self.saved.save(&self.settings);
        Ok(())
    }

    /// Carries on with what is being kept for good, settings and examples, without waiting; whether all has been written.
    pub fn carry_on(&mut self) -> bool {
        self.saved.carry_on() && self.classifier.carry_on()
    }

    /// Labels the last object and teaches it to the classifier; if it is `forced`, against the built-in examples too.
    ///
    /// # Errors
    /// [`Refusal::NothingToLabel`], [`Refusal::TakenFor`] and [`Refusal::ExamplesFull`]; the object has no label then.
    pub fn label(&mut self, label: u8, forced: bool) -> Result<(), Refusal> {
        let unlabelled = self.objects.last_mut().filter(|object| object.label.is_none());
        let object = unlabelled.ok_or(Refusal::NothingToLabel)?;
        let features = object.features();
        // A label that is wrong would turn the class of all that come after it, and nobody would see why.
        if !forced {
            let taken_for = self.classifier.built_in_class(&features);
            if taken_for == if label == label::PLANT { Class::Weed } else { Class::Plant } {
                return Err(Refusal::TakenFor(taken_for));
            }
        }
        self.classifier.teach(&features, label).map_err(|Full| Refusal::ExamplesFull)?;
        object.label = Some(label);
        Ok(())
    }

    /// Forgets an example from the field.
    ///
    /// # Errors
    /// [`Refusal::NoSuchExample`].
    pub fn forget(&mut self, number: u8) -> Result<(), Refusal> {
        if self.classifier.forget(number) { Ok(()) } else { Err(Refusal::NoSuchExample) }
    }

    /// Forgets all examples from the field.
    pub fn forget_all(&mut self) {
        for number in 0..taught::CAPACITY {
            self.classifier.forget(number);
        }
    }

    /// Turns the telling of events on or off.
    pub fn tell_events(&mut self, on: bool) {
        self.events_on = on;
        self.events.clear();
    }

    /// Draws curves for a plotter, or no longer.
    pub fn set_plot(&mut self, plot: Plot) {
        self.plot = plot;
    }

    #[inline(never)]
    pub(super) fn expect_no_contradiction(&self) -> Result<(), Refusal> {
        self.settings.contradiction().map_or(Ok(()), |contradiction| Err(Refusal::Contradiction(contradiction)))
    }

    /// Counts a line that was not understood.
    pub fn count_mistake(&mut self) {
        count(&mut self.mistakes);
    }
}
