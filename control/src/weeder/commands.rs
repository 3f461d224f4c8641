//! The operator's commands, from switch or console.

use super::Controller;
use crate::{
    ground::class::{Class, Classifier, ExamplesFull, label},
    memory::Memory,
    operate::{command_error::CommandError, limits::Limits, plot::Plot, state::State, unknown_run::UnknownRun},
    settings::Setting,
    units::count,
};
use knn::Example;

impl<C: Classifier, M: Memory> Controller<C, M> {
    /// Goes to work, on ground that the beam has yet to see. With `now`, the tool may enter at once: ground seen before stays known,
    /// and other ground counts as bare. Not after the machine has rolled back: there the beam would miss plants of another row, and the
    /// machine may have dropped plants of this one. Nor on ground that was forgotten without an alarm.
    ///
    /// # Errors
    /// [`CommandError::AlarmLatched`], and a [`Contradiction`](crate::settings::Contradiction) between settings.
    pub fn start(&mut self, now: bool) -> Result<(), CommandError> {
        if let State::Alarm(_) = self.state {
            return Err(CommandError::AlarmLatched);
        }
        self.configuration.expect_no_contradiction()?;
        if self.configuration.has_changed() {
            self.follow_settings();
        }
        if now && !self.ground.has_rolled_back() {
            self.ground.assume_bare();
        } else {
            self.begin_ground();
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
    /// [`CommandError::NotInHold`], [`CommandError::OutOfRange`], and a new [`Contradiction`](crate::settings::Contradiction).
    /// Nothing is changed then.
    pub fn set(&mut self, setting: Setting, value: u16) -> Result<(), CommandError> {
        self.configuration.change(setting, value, self.is_working())
    }

    /// Restores factory settings in RAM. [`save`](Self::save) writes them to the EEPROM.
    ///
    /// # Errors
    /// [`CommandError::NotInHold`].
    pub fn take_defaults(&mut self) -> Result<(), CommandError> {
        self.expect_no_work()?;
        self.configuration.take_defaults();
        Ok(())
    }

    /// Loads the saved settings.
    ///
    /// # Errors
    /// [`CommandError::NotInHold`] and [`CommandError::NothingSaved`].
    pub fn take_saved(&mut self) -> Result<(), CommandError> {
        self.expect_no_work()?;
        self.configuration.take_saved()
    }

    /// Recalculates from the settings. This takes half a millisecond, so the turn that sets a setting leaves it to the next turn.
    #[inline(never)]
    pub(super) fn follow_settings(&mut self) {
        self.configuration.follow();
        let settings = self.configuration.settings();
        self.ground.follow(settings, self.sensors.position);
        if !matches!(self.state, State::Work) {
            self.ground.distrust_slip();
        }
        self.limits = Limits::of(settings, self.ground.geometry().wheel, self.ground.geometry().scale);
    }

    /// Starts to save the settings; [`carry_on`](Self::carry_on) finishes it.
    ///
    /// # Errors
    /// [`CommandError::NotInHold`], and a [`Contradiction`](crate::settings::Contradiction).
    pub fn save(&mut self) -> Result<(), CommandError> {
        self.expect_no_work()?;
        self.configuration.save()
    }

    /// Runs one step of writing settings and examples to the EEPROM, without waiting. Returns whether all are written.
    pub fn carry_on(&mut self) -> bool {
        self.configuration.carry_on() && self.classifier.carry_on()
    }

    /// Labels the last detection and teaches it to the classifier. `forced` allows a label that contradicts the built-in examples.
    ///
    /// # Errors
    /// [`CommandError::NothingToLabel`], [`CommandError::TakenForPlant`], [`CommandError::TakenForWeed`],
    /// [`CommandError::ExamplesFull`]. The detection has no label then.
    pub fn label(&mut self, label: u8, forced: bool) -> Result<(), CommandError> {
        let detection = self
            .detections
            .newest()
            .filter(|detection| {
                // Without a vote, its beginning was not seen, and its width is not that of the plant.
                detection.label.is_none() && detection.vote.votes > 0 && self.ground.unclassified().is_none()
            })
            .ok_or(CommandError::NothingToLabel)?;
        let features = detection.features();
        // A wrong label would change the class of later detections, without any sign of the cause.
        if !forced {
            match (self.classifier.built_in_class(&features), label) {
                (Class::Weed, label::PLANT) => return Err(CommandError::TakenForWeed),
                (Class::Plant, label::WEED) => return Err(CommandError::TakenForPlant),
                _ => {}
            }
        }
        self.classifier.teach(&features, label).map_err(|ExamplesFull| CommandError::ExamplesFull)?;
        detection.label = Some(label);
        // Labelling shows that the operator is watching, so the count restarts.
        self.unknown_run = UnknownRun::NONE;
        Ok(())
    }

    /// Takes the next feature of an example that the operator enters.
    pub fn enter_feature(&mut self, feature: u8) {
        self.told.add(feature);
    }

    /// Teaches the classifier the entered example. The built-in examples are not asked: the example comes from another machine or a
    /// file.
    ///
    /// # Errors
    /// [`CommandError::NotInHold`], because new examples would classify the plants between beam and tool differently;
    /// [`CommandError::IncompleteExample`] and [`CommandError::ExamplesFull`].
    pub fn teach(&mut self, label: u8) -> Result<(), CommandError> {
        self.expect_no_work()?;
        let features = self.told.take().ok_or(CommandError::IncompleteExample)?;
        self.classifier.keep(Example::new(features, label)).map_err(|ExamplesFull| CommandError::ExamplesFull)?;
        // Teaching shows that the operator is watching, so the count restarts.
        self.unknown_run = UnknownRun::NONE;
        Ok(())
    }

    /// Forgets a field example.
    ///
    /// # Errors
    /// [`CommandError::NotInHold`], as for [`teach`](Self::teach), and [`CommandError::NoSuchExample`].
    pub fn forget(&mut self, number: u8) -> Result<(), CommandError> {
        self.expect_no_work()?;
        if self.classifier.forget(number) { Ok(()) } else { Err(CommandError::NoSuchExample) }
    }

    /// Forgets all field examples. The console listens again only when all are erased.
    ///
    /// # Errors
    /// [`CommandError::NotInHold`], as for [`teach`](Self::teach).
    pub fn forget_all(&mut self) -> Result<(), CommandError> {
        self.expect_no_work()?;
        self.classifier.forget_all();
        Ok(())
    }

    /// Turns event lines on or off.
    pub fn enable_events(&mut self, on: bool) {
        self.events.turn(on);
    }

    /// Selects the curves for a plotter, or none.
    pub fn set_plot(&mut self, plot: Plot) {
        self.telemetry.set(plot);
    }

    /// Refuses a command that is not for a working machine.
    #[inline(always)]
    fn expect_no_work(&self) -> Result<(), CommandError> {
        if self.is_working() { Err(CommandError::NotInHold) } else { Ok(()) }
    }

    /// Counts a console line with an error.
    pub fn count_command_error(&mut self) {
        count(&mut self.command_errors);
    }
}
