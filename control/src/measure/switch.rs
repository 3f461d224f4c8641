//! A debounced switch: the work switch, or the tool's end switch.
//!
//! Only a change counts: a switch that is on at start-up has no effect until it has been off.

use crate::units::Coarse;

/// Contacts bounce for a few milliseconds. A level counts once it has lasted this long.
const SETTLE: u16 = Coarse::steps_in_ms(20);

/// A switch.
#[derive(Clone, Debug)]
pub struct Switch {
    on: bool,
    /// The last reading with the level `on`.
    steady_at: Coarse,
}

impl Switch {
    /// A switch that is off.
    pub const NONE: Self = Self { on: false, steady_at: Coarse::ZERO };

    /// Takes the level at start-up.
    pub const fn init(&mut self, now: Coarse, on: bool) {
        (self.on, self.steady_at) = (on, now);
    }

    /// Whether it is on.
    pub const fn is_on(&self) -> bool {
        self.on
    }

    /// Takes the switch's level. Returns the new state when it changes.
    #[cfg_attr(not(target_arch = "avr"), inline)]
    pub fn read(&mut self, now: Coarse, on: bool) -> Option<bool> {
        if on == self.on {
            self.steady_at = now;
        }
        if now.since(self.steady_at) < SETTLE {
            return None;
        }
        self.on = on;
        self.steady_at = now;
        Some(on)
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn a_switch_that_is_on_from_the_start_counts_only_after_it_has_been_off() {
        let mut switch = Switch { on: true, ..Switch::NONE };
        assert_eq!(switch.read(Coarse::at_ms(0), true), None);
        assert_eq!(switch.read(Coarse::at_ms(1000), true), None);
        assert_eq!(switch.read(Coarse::at_ms(1001), false), None);
        assert_eq!(switch.read(Coarse::at_ms(1021), false), Some(false));
        assert_eq!(switch.read(Coarse::at_ms(1022), true), None);
        assert_eq!(switch.read(Coarse::at_ms(1042), true), Some(true));
    }

    #[test]
    fn bouncing_contacts_count_once() {
        let mut switch = Switch { on: false, ..Switch::NONE };
        let mut thrown = 0;
        for millisecond in 0..100 {
            let on = millisecond >= 15 || millisecond % 3 == 0;
            thrown += u8::from(switch.read(Coarse::at_ms(millisecond), on).is_some());
        }
        assert_eq!(thrown, 1);
    }
}
