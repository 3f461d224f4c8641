//! Queries: the machine's state, its counters, and the next event or plot line.

use super::Controller;
use crate::{
    alarm::Warning,
    ground::{AtTool, class::Classifier},
    measure::{quadrature, readings::Readings, reset::Cause},
    memory::Memory,
    operate::{
        calibration::Distance, detections::Detections, event::Event, lamp, plot::Plot, state::State, tool::Reason,
    },
    settings::{Setting, Settings},
    units::{Length, Position},
};

impl<C: Classifier, M: Memory> Controller<C, M> {
    /// The machine's state.
    pub fn state(&self) -> State {
        self.state
    }

    /// Why the tool is out of the row while the machine works; `None` if it is in, or the machine does not work.
    pub fn reason(&self) -> Option<Reason> {
        if !self.is_working() || !self.tool.is_out() {
            None
        } else if self.sensors.encoder.is_doubtful()
            // At slow rolling, a sound encoder is quiet for some turns.
            || self.sensors.encoder.is_quiet() && !self.ground.must_be_out(true)
        {
            Some(Reason::EncoderDoubtful)
        } else if self.ground.is_unseen() {
            Some(Reason::UnseenGround)
        } else if self.ground.outruns_the_beam(true) {
            Some(Reason::TooFast)
        } else {
            Some(Reason::Plant)
        }
    }

    /// Why the tool may or may not work at its position.
    pub fn ground_at_tool(&self) -> AtTool {
        self.ground.at_tool(self.sensors.position)
    }

    /// The machine's speed in millimetres a second, negative backwards.
    pub fn speed_mm_s(&self) -> i16 {
        self.ground.geometry().millimetres(Length(self.sensors.meter.speed().0))
    }

    /// Keep-out zones at the tool or ahead of it, with an open detection.
    pub fn zones(&self) -> u8 {
        self.ground.zones()
    }

    /// The distance in mm until the tool has left unseen ground and its margin, rounded up: 0 only once it has.
    pub fn unseen_mm(&self) -> i16 {
        let unseen = self.ground.unseen();
        self.ground.geometry().millimetres(unseen) + i16::from(unseen > Length::ZERO)
    }

    /// Whether there is a second beam.
    pub fn has_second_beam(&self) -> bool {
        self.ground.has_second_beam()
    }

    /// The wheel's slip in thousandths, above 0 if the wheel turns farther than the machine rolls; `None` if it is unknown.
    pub fn slip_permille(&self) -> Option<i16> {
        self.ground.slip_permille()
    }

    /// Whether the encoder fell silent at speed. The distance since then is unknown.
    pub fn encoder_is_silent(&self) -> bool {
        self.sensors.encoder.is_silent()
    }

    /// Whether the wheel turns so fast that an edge can be missed: both channels may then change at once.
    pub fn believes_jumps(&self) -> bool {
        self.sensors.meter.speed().is_beyond(self.ground.geometry().scale.length(quadrature::FAST).0 as u16)
    }

    /// Whether the beam is broken.
    pub fn beam_is_broken(&self) -> bool {
        self.sensors.beam_broken
    }

    /// Whether the status LED is lit. During a servo test it shows the commands. While the servo is driven directly it is lit, as at
    /// work: the tool may be in the row.
    pub fn lamp_is_lit(&self) -> bool {
        if self.manual_test.swings() {
            self.tool.is_out()
        } else {
            self.manual_test.pulse().is_some() || lamp::is_lit(self.state, self.sensors.readings.now)
        }
    }

    /// Whether the tool is commanded out of the row. While the servo is driven directly, the tool may be anywhere, so it is not.
    pub fn tool_out(&self) -> bool {
        self.tool.is_out() && self.manual_test.pulse().is_none()
    }

    /// The machine's position: the encoder's count without the ticks that noise added.
    pub fn position(&self) -> Position {
        self.sensors.position
    }

    /// The last readings.
    pub fn readings(&self) -> &Readings {
        &self.sensors.readings
    }

    /// The settings in use.
    pub fn settings(&self) -> &Settings {
        self.configuration.settings()
    }

    /// The smallest `beam_to_tool_mm`, in mm, that would fit the settings refused last.
    pub fn needed_mm(&self) -> u16 {
        self.configuration.needed_mm()
    }

    /// The distance measurement for the wheel's calibration.
    pub fn distance(&self) -> &Distance {
        &self.distance
    }

    /// The saved value of a setting, if settings are saved.
    pub fn saved(&self, setting: Setting) -> Option<u16> {
        self.configuration.saved(setting)
    }

    /// The classifier.
    pub fn classifier(&self) -> &C {
        &self.classifier
    }

    /// The last detections.
    pub fn detections(&self) -> &Detections {
        &self.detections
    }

    /// The cause of the last reset.
    pub fn cause(&self) -> Cause {
        self.cause
    }

    /// Times that closed ground reached the tool before it could be out.
    pub fn late(&self) -> u16 {
        self.tool.late()
    }

    /// Console lines with an error.
    pub fn command_errors(&self) -> u16 {
        self.command_errors
    }

    /// Detections narrower than `min_width_mm`.
    pub fn dust(&self) -> u16 {
        self.dust
    }

    /// Events dropped because the queue was full.
    pub fn events_missed(&self) -> u16 {
        self.events.missed()
    }

    /// Whether the machine has worked over a long distance without a plant.
    pub fn sees_no_plants(&self) -> bool {
        self.plant_timeout.has_warned()
    }

    /// The warning whose reason is still there, if any.
    pub fn present_warning(&self) -> Option<Warning> {
        if self.sees_no_plants() {
            Some(Warning::NoPlants)
        } else {
            self.configuration.has_spoiled_copy().then_some(Warning::SettingsOlder)
        }
    }

    /// Whether the last reset ended work. False once the operator has started, held or cleared again.
    pub fn was_working(&self) -> bool {
        self.was_working
    }

    /// Whether the machine works, or worked at the last reset: the caller keeps this over a reset.
    pub fn works_or_did(&self) -> bool {
        self.is_working() || self.was_working
    }

    /// The next event to report.
    pub fn next_event(&mut self) -> Option<Event> {
        self.events.take()
    }

    /// The curves whose next points are due, 20 times a second.
    pub fn next_plot(&mut self) -> Option<Plot> {
        self.telemetry.due(self.sensors.now)
    }
}
