//! The sensors, as the last turn read them, with the monitor of each.
//!
//! The odometer gives the position and the meter the speed. Switches are debounced. The monitors check encoder and beam. The ground
//! that the beam has seen is not here.

use super::{
    monitor::{BeamMonitor, EncoderMonitor},
    quadrature::Odometer,
    readings::Readings,
    speed::SpeedMeter,
    switch::Switch,
};
use crate::units::{Coarse, Instant, LengthScale, Position};

/// The machine's sensors.
#[derive(Clone, Debug)]
pub struct Sensors {
    /// The last readings.
    pub readings: Readings,
    /// The time of the last readings, see [`follow_clock`](Self::follow_clock).
    pub now: Coarse,
    /// The odometer's position: the count without the ticks that noise added.
    pub position: Position,
    /// The work switch.
    pub switch: Switch,
    /// The end switch.
    pub end_switch: Switch,
    /// Removes ticks that were noise.
    pub odometer: Odometer,
    /// The encoder's monitor.
    pub encoder: EncoderMonitor,
    /// The speed.
    pub meter: SpeedMeter,
    /// The beam's monitor.
    pub beam: BeamMonitor,
    /// Whether the beam is broken.
    pub beam_broken: bool,
}

impl Sensors {
    /// Sensors before [`init`](Self::init).
    pub const NONE: Self = {
        let (start, position) = (Instant::ZERO, Position::new(0));
        Self {
            readings: Readings { stack_free: 0, ..Readings::new(start, position) },
            now: Coarse::ZERO,
            position,
            switch: Switch::NONE,
            end_switch: Switch::NONE,
            odometer: Odometer::NONE,
            encoder: EncoderMonitor::NONE,
            meter: SpeedMeter::NONE,
            beam: BeamMonitor::NONE,
            beam_broken: false,
        }
    };

    /// Starts with the first `readings`. The beam's level is `broken`.
    #[inline(always)]
    pub const fn init(&mut self, broken: bool, scale: LengthScale) {
        let Readings { position, jumps, switch_on, end_switch_on, .. } = self.readings;
        self.follow_clock();
        let now = self.now;
        (self.position, self.beam_broken) = (position, broken);
        self.switch.init(now, switch_on);
        self.end_switch.init(now, end_switch_on);
        self.odometer.init(position, jumps);
        self.encoder.init(now, position);
        self.beam.init(now);
        self.meter.init(scale.wrap(position), now);
    }

    /// Takes the time of new readings in coarse steps: once, because each conversion takes more code than its result.
    pub const fn follow_clock(&mut self) {
        self.now = self.readings.now.coarse();
    }
}
