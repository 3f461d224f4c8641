//! What the machine is not to go beyond, worked out from the settings once and not anew each turn.

use crate::{
    settings::{Setting, Settings},
    units::{Ticks, TicksPerSecond, Wheel},
};

/// What the machine is not to go beyond, in ticks of the present wheel.
#[derive(Clone, Copy, Debug)]
pub struct Limits {
    /// In ticks a second, 60,000 at the most.
    top_speed: u16,
    /// Zero for none.
    no_plant: Ticks,
}

impl Limits {
    /// Those of a machine that has not woken up.
    pub const NONE: Self = Self { top_speed: 0, no_plant: Ticks::ZERO };

    /// Those that these settings give, with this wheel.
    pub fn of(settings: &Settings, wheel: Wheel) -> Self {
        Self {
            top_speed: wheel.ticks(settings.get(Setting::TopSpeedMmS)).0 as u16,
            no_plant: Ticks(wheel.ticks(1000).0 * i32::from(settings.get(Setting::NoPlantM))),
        }
    }

    /// Whether a speed is beyond the greatest at which the machine works.
    pub fn is_too_fast(self, speed: TicksPerSecond) -> bool {
        speed.is_beyond(self.top_speed)
    }

    /// The way without a plant after which the operator is warned; zero for none.
    pub const fn no_plant(self) -> Ticks {
        self.no_plant
    }
}
