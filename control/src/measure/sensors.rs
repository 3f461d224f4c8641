//! The sensors, as a turn of the loop has read them, with what watches over each.
//!
//! Place by the odometer, speed by the meter, levels of the switches once they have settled, and whether encoder and beam can be
//! believed. What the beam has seen of the ground is not here.

use super::{
    monitor::{BeamMonitor, EncoderMonitor},
    quadrature::Odometer,
    readings::{Readings, Startup},
    speed::SpeedMeter,
    switch::Switch,
};
use crate::units::{Instant, Position};

/// The machine's sensors.
#[derive(Clone, Debug)]
pub struct Sensors {
    /// The last readings, with the odometer's place for a position.
    pub readings: Readings,
    /// The work switch.
    pub switch: Switch,
    /// The end switch.
    pub end_switch: Switch,
    /// What noise has added to the encoder's count.
    pub odometer: Odometer,
    /// Whether the encoder can be believed.
    pub encoder: EncoderMonitor,
    /// The speed.
    pub meter: SpeedMeter,
    /// Whether the beam can be believed.
    pub beam: BeamMonitor,
    /// Whether the beam is broken.
    pub beam_broken: bool,
}

impl Sensors {
    /// Sensors that nobody has read.
    pub const NONE: Self = {
        let (start, place) = (Instant::ZERO, Position::new(0));
        Self {
            readings: Readings { stack_free: 0, ..Readings::new(start, place) },
            switch: Switch::NONE,
            end_switch: Switch::NONE,
            odometer: Odometer::NONE,
            encoder: EncoderMonitor::NONE,
            meter: SpeedMeter::NONE,
            beam: BeamMonitor::NONE,
            beam_broken: false,
        }
    };

    /// The machine wakes up, with sensors that nobody has read.
    #[inline(always)]
    pub const fn init(&mut self, Startup { readings, beam_broken, .. }: Startup) {
        let Readings { now, position, jumps, .. } = readings;
        (self.readings, self.beam_broken) = (readings, beam_broken);
        self.switch.init(readings.switch_on);
        self.end_switch.init(readings.end_switch_on);
        self.odometer.init(position, jumps);
        self.encoder.init(now, position);
        self.beam.init(now);
        self.meter.init(position, now);
    }
}
