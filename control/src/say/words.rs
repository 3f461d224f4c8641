//! The console's words for alarms, warnings, settings, commands and arguments.
//!
//! Elsewhere these are plain enums. This file gives each variant a word; `names` writes and reads them.

use crate::{
    alarm::{Alarm, Warning},
    measure::reset::Cause,
    operate::tool::Reason,
};

/// The first word of a command.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
#[repr(u8)]
#[expect(missing_docs, reason = "the help texts say what each does")]
pub enum Word {
    Help,
    Status,
    Get,
    Set,
    Save,
    Revert,
    Defaults,
    Calibrate,
    Servo,
    Test,
    Start,
    Hold,
    Clear,
    Events,
    Plot,
    Label,
    Teach,
    Examples,
    Forget,
    Dump,
    Version,
}

/// An argument of a command.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
#[repr(u8)]
#[expect(missing_docs, reason = "the table of commands says which command takes each")]
pub enum Argument {
    Now,
    On,
    Off,
    All,
    Start,
    Servo,
    Force,
    In,
    Out,
    Row,
    Watchdog,
    Teleplot,
    Plant,
    Weed,
}

/// The words for the variants of enums, in the order of declaration.
macro_rules! words {
    ($($Name:ident { $($Variant:ident = $word:literal,)* })*) => {$(
        impl $Name {
            /// The words, in the order of declaration.
            pub(crate) const WORDS: &[&str] = &[$($word),*];

            /// The number of variants.
            pub const COUNT: u8 = Self::WORDS.len() as u8;

            /// The variant at an index in the order of declaration.
            pub const fn from_index(index: u8) -> Option<Self> {
                match index {
                    $(index if index == Self::$Variant as u8 => Some(Self::$Variant),)*
                    _ => None,
                }
            }
        }

        const _: () = {
            let _every_variant_has_a_word: fn($Name) = |variant| match variant {
                $($Name::$Variant => {})*
            };
            let mut place = 0;
            $(
                assert!($Name::$Variant as u8 == place, "the words stand here in the order of declaration");
                place += 1;
            )*
            assert!(place == $Name::COUNT);
        };
    )*};
}

words! {
    Alarm {
        BeamBlocked = "beam_blocked",
        BeamFlickers = "beam_flickers",
        BeamEdgesLost = "beam_edges_lost",
        BeamBlind = "beam_blind",
        SecondBeamBlind = "second_beam_blind",
        EncoderSilent = "encoder_silent",
        EncoderChannelDead = "encoder_channel_dead",
        EncoderJumps = "encoder_jumps",
        TooFast = "too_fast",
        RolledBackTooFar = "rolled_back_too_far",
        ScheduleFull = "schedule_full",
        CropUnknown = "crop_unknown",
        ToolStuck = "tool_stuck",
        SettingsLost = "settings_lost",
        SettingsContradict = "settings_contradict",
        StackLow = "stack_low",
    }

    Warning {
        LateCommand = "late_command",
        NoPlants = "no_plants",
        SlipUnknown = "slip_unknown",
    }

    Reason {
        Plant = "plant",
        UnseenGround = "unseen_ground",
        TooFast = "too_fast",
        EncoderDoubtful = "encoder_doubtful",
    }

    Cause {
        PowerOn = "power_on",
        ResetPin = "reset_pin",
        BrownOut = "brown_out",
        Watchdog = "watchdog",
        LoopStalled = "loop_stalled",
        Panic = "panic",
        Unknown = "unknown",
    }

    Word {
        Help = "help",
        Status = "status",
        Get = "get",
        Set = "set",
        Save = "save",
        Revert = "revert",
        Defaults = "defaults",
        Calibrate = "calibrate",
        Servo = "servo",
        Test = "test",
        Start = "start",
        Hold = "hold",
        Clear = "clear",
        Events = "events",
        Plot = "plot",
        Label = "label",
        Teach = "teach",
        Examples = "examples",
        Forget = "forget",
        Dump = "dump",
        Version = "version",
    }

    Argument {
        Now = "now",
        On = "on",
        Off = "off",
        All = "all",
        Start = "start",
        Servo = "servo",
        Force = "force",
        In = "in",
        Out = "out",
        Row = "row",
        Watchdog = "watchdog",
        Teleplot = "teleplot",
        Plant = "plant",
        Weed = "weed",
    }
}
