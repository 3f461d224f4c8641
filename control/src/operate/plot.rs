//! Curves for a plotter: the format, and when the next points are due.

use crate::units::Coarse;

/// Time between two points of a plotter's curves.
const PERIOD: u16 = Coarse::steps_in_ms(50);

/// Curves for a plotter.
#[derive(Clone, Copy, Debug, Default, PartialEq, Eq)]
pub enum Plot {
    /// No curves.
    #[default]
    Off,
    /// For the Arduino IDE's Serial Plotter.
    Arduino,
    /// For Teleplot.
    Teleplot,
}

/// The curves that are sent.
#[derive(Clone, Debug)]
pub struct Telemetry {
    plot: Plot,
    drawn_at: Coarse,
}

impl Telemetry {
    /// No curves.
    pub const NONE: Self = Self { plot: Plot::Off, drawn_at: Coarse::ZERO };

    /// Starts: the next points are due a period from now.
    pub const fn init(&mut self, now: Coarse) {
        self.drawn_at = now;
    }

    /// Selects the curves, or none.
    pub fn set(&mut self, plot: Plot) {
        self.plot = plot;
    }

    /// The format whose next points are due, 20 times a second.
    pub fn due(&mut self, now: Coarse) -> Option<Plot> {
        if self.plot == Plot::Off || now.since(self.drawn_at) < PERIOD {
            return None;
        }
        self.drawn_at = now;
        Some(self.plot)
    }
}
