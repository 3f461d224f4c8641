//! What the machine shows of itself: its state, what it has counted, and what there is to tell.

use super::Controller;
use crate::{
    ground::{AtTool, class::Classifier},
    measure::{quadrature, readings::Readings, reset::Cause},
    memory::Memory,
    operate::{
        calibration::Distance, detections::Detections, event::Event, lamp, plot::Plot, state::State, tool::Reason,
    },
    settings::{Setting, Settings},
    units::Ticks,
};

impl<C: Classifier, M: Memory> Controller<C, M> {
    /// What the machine is doing.
    pub fn state(&self) -> State {
        self.state
    }

    /// Why the tool is out of the row although the machine works.
    pub fn reason(&self) -> Option<Reason> {
        if !self.is_working() || !self.tool.is_out() {
            None
        } else if self.sensors.encoder.is_doubtful() || self.sensors.encoder.is_quiet() {
            Some(Reason::EncoderDoubtful)
        } else if self.ground.is_unseen() {
            Some(Reason::UnseenGround)
        } else if self.ground.outruns_the_beam(true) {
            Some(Reason::TooFast)
        } else {
            Some(Reason::Plant)
        }
    }

    /// What keeps the tool out where it is.
    pub fn ground_at_tool(&self) -> AtTool {
        self.ground.at_tool(self.sensors.readings.position)
    }

    /// The machine's speed in millimetres a second, negative backwards.
    pub fn speed_mm_s(&self) -> i16 {
        self.ground.millimetres(Ticks(self.sensors.meter.speed().0))
    }

    /// Windows at the tool or ahead of it, the one still being seen included.
    pub fn zones(&self) -> u8 {
        self.ground.zones()
    }

    /// How far the machine has to roll until ground that the beam has seen reaches the tool, in millimetres.
    pub fn unseen_mm(&self) -> i16 {
        self.ground.millimetres(self.ground.unseen())
    }

    /// Whether there is a second beam.
    pub fn has_second_beam(&self) -> bool {
        self.ground.has_second_beam()
    }

    /// The wheel's slip in thousandths, above 0 where it turns farther than the machine rolls; none where nothing has told it.
    pub fn slip_permille(&self) -> Option<i16> {
        self.ground.slip_permille()
    }

    /// Whether the encoder fell silent from one moment to the next, so that nobody knows how far the machine has rolled since.
    pub fn encoder_is_silent(&self) -> bool {
        self.sensors.encoder.is_silent()
    }

    /// Whether the wheel turns so fast that an edge may be missed, and both channels may have changed at once.
    pub fn believes_jumps(&self) -> bool {
        self.sensors.meter.speed().is_beyond(quadrature::FAST)
    }

    /// Whether the beam is broken.
    pub fn beam_is_broken(&self) -> bool {
        self.sensors.beam_broken
    }

    /// Whether the status LED shines: while the servo is being tried, it marks the commands.
    pub fn lamp_is_lit(&self) -> bool {
        if self.bench.swings() { self.tool.is_out() } else { lamp::is_lit(self.state, self.sensors.readings.now) }
    }

    /// Whether the tool is to be out of the row.
    pub fn tool_out(&self) -> bool {
        self.tool.is_out()
    }

    /// The last readings.
    pub fn readings(&self) -> &Readings {
        &self.sensors.readings
    }

    /// The settings in use.
    pub fn settings(&self) -> &Settings {
        self.configuration.settings()
    }

    /// The X that was needed where the settings were refused for that last, in mm.
    pub fn needed_mm(&self) -> u16 {
        self.configuration.needed_mm()
    }

    /// The stretch by which the wheel is measured.
    pub fn distance(&self) -> &Distance {
        &self.distance
    }

    /// The value of a setting that is saved, if any is.
    pub fn saved(&self, setting: Setting) -> Option<u16> {
        self.configuration.saved(setting)
    }

    /// What tells plants from weeds.
    pub fn classifier(&self) -> &C {
        &self.classifier
    }

    /// The last detections.
    pub fn detections(&self) -> &Detections {
        &self.detections
    }

    /// Why the machine was reset.
    pub fn cause(&self) -> Cause {
        self.cause
    }

    /// Times that closed ground reached the tool sooner than it could be out.
    pub fn late(&self) -> u16 {
        self.tool.late()
    }

    /// Lines that were not understood.
    pub fn mistakes(&self) -> u16 {
        self.mistakes
    }

    /// Detections that were too narrow to be classified.
    pub fn dust(&self) -> u16 {
        self.dust
    }

    /// Events that found no room to wait in.
    pub fn events_missed(&self) -> u16 {
        self.events.missed()
    }

    /// Whether the machine has worked for a long way without seeing a plant.
    pub fn sees_no_plants(&self) -> bool {
        self.plant_timeout.has_warned()
    }

    /// The next event to be told.
    pub fn next_event(&mut self) -> Option<Event> {
        self.events.take()
    }

    /// The curves of which the next points are due, which are due 20 times a second.
    pub fn next_plot(&mut self) -> Option<Plot> {
        self.telemetry.due(self.sensors.readings.now)
    }
}
