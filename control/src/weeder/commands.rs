//! What the operator may ask of the machine, by switch or console.

use super::Controller;
use crate::{
    ground::{
        class::{Class, Classifier, ExamplesFull, label},
        field_examples,
    },
    memory::Memory,
    operate::{command_error::CommandError, limits::Limits, plot::Plot, state::State, unknown_run::UnknownRun},
    settings::Setting,
    units::count,
};
use knn::Example;

impl<C: Classifier, M: Memory> Controller<C, M> {
    /// Goes to work; with `now`, at once and over ground that the beam has not seen.
    ///
    /// # Errors
    /// [`CommandError::AlarmLatched`] while an alarm is, and that of a [`Contradiction`](crate::settings::Contradiction).
    pub fn start(&mut self, now: bool) -> Result<(), CommandError> {
        if let State::Alarm(_) = self.state {
            return Err(CommandError::AlarmLatched);
        }
        self.configuration.expect_no_contradiction()?;
        if self.configuration.has_changed() {
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
    /// [`CommandError::NotInHold`], [`CommandError::OutOfRange`], and that of a [`Contradiction`](crate::settings::Contradiction) where there
    /// was none before; nothing is changed then.
    pub fn set(&mut self, setting: Setting, value: u16) -> Result<(), CommandError> {
        self.configuration.change(&[(setting, value)], self.is_working())
    }

    /// Goes back to the settings of a new machine; [`save`](Self::save) makes it last.
    ///
    /// # Errors
    /// [`CommandError::NotInHold`].
    pub fn take_defaults(&mut self) -> Result<(), CommandError> {
        if self.is_working() {
            return Err(CommandError::NotInHold);
        }
        self.configuration.take_defaults();
        Ok(())
    }

    /// Goes back to the saved settings.
    ///
    /// # Errors
    /// [`CommandError::NotInHold`] and [`CommandError::NothingSaved`].
    pub fn take_saved(&mut self) -> Result<(), CommandError> {
        if self.is_working() {
            return Err(CommandError::NotInHold);
        }
        self.configuration.take_saved()
    }

    /// Works out what follows from the settings. That takes half a millisecond, so the turn in which they are set leaves it to
    /// the next one.
    #[inline(never)]
    pub(super) fn follow_settings(&mut self) {
        self.configuration.follow();
        if !self.is_working() {
            self.ground.forget_slip();
        }
        let settings = self.configuration.settings();
        self.ground.follow(settings, self.sensors.readings.position, self.sensors.meter.speed());
        self.limits = Limits::of(settings, self.ground.wheel());
        (self.leads_are_old, self.turn_spent) = (false, true);
    }

    /// Begins to save the settings, which [`carry_on`](Self::carry_on) finishes.
    ///
    /// # Errors
    /// [`CommandError::NotInHold`] and that of a [`Contradiction`](crate::settings::Contradiction).
    pub fn save(&mut self) -> Result<(), CommandError> {
        if self.is_working() {
            return Err(CommandError::NotInHold);
        }
        self.configuration.save()
    }

    /// Carries on with what is being kept for good, settings and examples, without waiting; whether all has been written.
    pub fn carry_on(&mut self) -> bool {
        self.configuration.carry_on() && self.classifier.carry_on()
    }

    /// Labels the last detection and teaches it to the classifier; if it is `forced`, against the built-in examples too.
    ///
    /// # Errors
    /// [`CommandError::NothingToLabel`], [`CommandError::TakenForPlant`] or [`CommandError::TakenForWeed`], and [`CommandError::ExamplesFull`]; the detection has no label then.
    pub fn label(&mut self, label: u8, forced: bool) -> Result<(), CommandError> {
        let is_judged = !self.is_classifying;
        let detection = self
            .detections
            .newest()
            .filter(|detection| is_judged && detection.label.is_none())
            .ok_or(CommandError::NothingToLabel)?;
        let features = detection.features();
        // A label that is wrong would turn the class of all that come after it, and nobody would see why.
        if !forced {
            match (self.classifier.built_in_class(&features), label) {
                (Class::Weed, label::PLANT) => return Err(CommandError::TakenForWeed),
                (Class::Plant, label::WEED) => return Err(CommandError::TakenForPlant),
                _ => {}
            }
        }
        self.classifier.teach(&features, label).map_err(|ExamplesFull| CommandError::ExamplesFull)?;
        detection.label = Some(label);
        // Whoever labels looks at what the detections are taken for.
        self.unknown_run = UnknownRun::NONE;
        Ok(())
    }

    /// Takes the next feature of an example that is told.
    pub fn tell_feature(&mut self, feature: u8) {
        self.told.add(feature);
    }

    /// Teaches the classifier the example that was told, whatever the built-in ones say of it: who tells one has it from a machine or
    /// a file.
    ///
    /// # Errors
    /// [`CommandError::NotInHold`], as what stands between beam and tool would be classified by other examples than what came before it;
    /// [`CommandError::IncompleteExample`] and [`CommandError::ExamplesFull`].
    pub fn teach(&mut self, label: u8) -> Result<(), CommandError> {
        if self.is_working() {
            return Err(CommandError::NotInHold);
        }
        let features = self.told.take().ok_or(CommandError::IncompleteExample)?;
        self.classifier.keep(Example::new(features, label)).map_err(|ExamplesFull| CommandError::ExamplesFull)?;
        // Whoever teaches looks at what the detections are taken for.
        self.unknown_run = UnknownRun::NONE;
        Ok(())
    }

    /// Forgets an example from the field.
    ///
    /// # Errors
    /// [`CommandError::NoSuchExample`].
    pub fn forget(&mut self, number: u8) -> Result<(), CommandError> {
        if self.classifier.forget(number) { Ok(()) } else { Err(CommandError::NoSuchExample) }
    }

    /// Forgets all examples from the field.
    pub fn forget_all(&mut self) {
        for number in 0..field_examples::CAPACITY {
            self.classifier.forget(number);
        }
    }

    /// Turns the telling of events on or off.
    pub fn tell_events(&mut self, on: bool) {
        self.events.turn(on);
    }

    /// Draws curves for a plotter, or no longer.
    pub fn set_plot(&mut self, plot: Plot) {
        self.telemetry.set(plot);
    }

    /// Counts a line that was not understood.
    pub fn count_mistake(&mut self) {
        count(&mut self.mistakes);
    }
}
