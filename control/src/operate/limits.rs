//! Limits calculated from the settings once, instead of in each turn.

use crate::{
    settings::{Setting, Settings},
    units::{LengthScale, Speed, Ticks, Wheel},
};

/// Limits of the present wheel.
#[derive(Clone, Copy, Debug)]
pub struct Limits {
    /// In units of remembered ground a second.
    top_speed: u16,
    /// 0 for no limit.
    no_plant: Ticks,
}

impl Limits {
    /// Limits before the settings are loaded.
    pub const NONE: Self = Self { top_speed: 0, no_plant: Ticks::ZERO };

    /// The limits of these settings with this wheel.
    pub fn of(settings: &Settings, wheel: Wheel, scale: LengthScale) -> Self {
        Self {
            top_speed: scale.length(wheel.ticks(settings.get(Setting::TopSpeedMmS))).0 as u16,
            no_plant: Ticks(wheel.ticks(1000).0 * i32::from(settings.get(Setting::NoPlantM))),
        }
    }

    /// Whether a speed is above the top speed.
    pub fn is_too_fast(self, speed: Speed) -> bool {
        speed.is_beyond(self.top_speed)
    }

    /// The distance without a plant after which the operator is warned; 0 for none.
    pub const fn no_plant(self) -> Ticks {
        self.no_plant
    }
}
