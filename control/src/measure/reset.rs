//! The cause of a reset, from the chip's reset flags and a mark that the firmware left in SRAM.
//!
//! A bootloader, such as optiboot, may clear the flags before the firmware starts. The mark survives a reset, so a stalled loop and
//! a panic are still known then. Any other cause is [`Cause::Unknown`].

use crate::named::named;

named! {
    /// The cause of a start.
    Cause {
        /// The power came on.
        PowerOn = "power_on",
        /// The reset pin was pulled: by the button, or by a computer that opened the serial line.
        ResetPin = "reset_pin",
        /// The supply was too low for a moment.
        BrownOut = "brown_out",
        /// The watchdog expired, without a mark.
        Watchdog = "watchdog",
        /// The loop stopped turning.
        LoopStalled = "loop_stalled",
        /// The firmware panicked: an impossible state.
        Panic = "panic",
        /// The flags were cleared before the firmware saw them.
        Unknown = "unknown",
    }
}

/// Marks that the firmware leaves in SRAM. At power-up SRAM holds either of them with a chance of one in 32,768.
pub mod mark {
    /// No mark.
    pub const NONE: u16 = 0;
    /// The loop stopped turning.
    pub const LOOP_STALLED: u16 = 0x5AC3;
    /// The firmware panicked.
    pub const PANIC: u16 = 0xA53C;
}

/// Bits of MCUSR (data sheet, section 11.9.1).
mod flag {
    pub const POWER_ON: u8 = 1 << 0;
    pub const RESET_PIN: u8 = 1 << 1;
    pub const BROWN_OUT: u8 = 1 << 2;
    pub const WATCHDOG: u8 = 1 << 3;
}

impl Cause {
    /// The cause, from MCUSR at start-up and the mark in SRAM.
    ///
    /// Low supply may have corrupted the mark, so the mark is ignored then. Otherwise a mark comes first, because the firmware left
    /// it on the way to a reset. Among several flags, the one that can cause the others wins.
    pub const fn of(mcusr: u8, mark: u16) -> Self {
        if mcusr & flag::POWER_ON != 0 {
            Self::PowerOn
        } else if mcusr & flag::BROWN_OUT != 0 {
            Self::BrownOut
        } else if mark == mark::LOOP_STALLED {
            Self::LoopStalled
        } else if mark == mark::PANIC {
            Self::Panic
        } else if mcusr & flag::WATCHDOG != 0 {
            Self::Watchdog
        } else if mcusr & flag::RESET_PIN != 0 {
            Self::ResetPin
        } else {
            Self::Unknown
        }
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    const MARKS: [u16; 4] = [mark::NONE, mark::LOOP_STALLED, mark::PANIC, 0xC5C5];

    #[test]
    fn after_low_supply_the_mark_is_ignored() {
        for mark in MARKS {
            for others in [0, flag::RESET_PIN, flag::WATCHDOG] {
                assert_eq!(Cause::of(flag::POWER_ON | flag::BROWN_OUT | others, mark), Cause::PowerOn);
                assert_eq!(Cause::of(flag::BROWN_OUT | others, mark), Cause::BrownOut);
            }
        }
    }

    #[test]
    fn a_mark_comes_before_the_watchdog_flag_and_cleared_flags() {
        for mcusr in [flag::WATCHDOG, flag::RESET_PIN, 0] {
            assert_eq!(Cause::of(mcusr, mark::LOOP_STALLED), Cause::LoopStalled);
            assert_eq!(Cause::of(mcusr, mark::PANIC), Cause::Panic);
        }
    }

    #[test]
    fn without_a_mark_the_flags_decide() {
        for mark in [mark::NONE, 0xC5C5, mark::PANIC ^ 1] {
            assert_eq!(Cause::of(flag::WATCHDOG, mark), Cause::Watchdog);
            assert_eq!(Cause::of(flag::WATCHDOG | flag::RESET_PIN, mark), Cause::Watchdog);
            assert_eq!(Cause::of(flag::RESET_PIN, mark), Cause::ResetPin);
            assert_eq!(Cause::of(0, mark), Cause::Unknown);
        }
    }
}
