//! The words for what the machine tells apart: its alarms, its settings, what was typed.
//!
//! Such a thing is a plain enum wherever it stands. Here it gets a word for each of its variants; `names` has it write and
//! read them.

use crate::{
    alarm::{Alarm, Warning},
    measure::reset::Cause,
    operate::tool::Reason,
};

/// The first word of a command.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
#[repr(u8)]
pub enum Word {
    /// Lists the commands, or explains a setting.
    Help,
    /// One line of figures.
    Status,
    /// Shows one setting or all.
    Get,
    /// Changes a setting.
    Set,
    /// Keeps the settings.
    Save,
    /// Goes back to the saved settings.
    Revert,
    /// Goes back to the settings of a new machine.
    Defaults,
    /// Measures the wheel or the servo.
    Calibrate,
    /// Moves the tool by hand.
    Servo,
    /// Swings the tool as for a row.
    Test,
    /// Goes to work.
    Start,
    /// Takes the tool out.
    Hold,
    /// Clears an alarm.
    Clear,
    /// Tells what happens, or stops telling.
    Events,
    /// Draws curves on a plotter.
    Plot,
    /// Says what the last object was, and teaches it.
    Label,
    /// Tells a feature of an example, and teaches it.
    Teach,
    /// Lists the examples.
    Examples,
    /// Forgets examples from the field.
    Forget,
    /// Lists the last objects.
    Dump,
    /// Names the firmware.
    Version,
}

/// A word that a command may take.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
#[repr(u8)]
pub enum Argument {
    /// Of `start`.
    Now,
    /// Of `events`, and of settings that are switched.
    On,
    /// As `on`.
    Off,
    /// Of `forget`.
    All,
    /// Of `calibrate`.
    Start,
    /// Of `calibrate`.
    Servo,
    /// Of `calibrate` and `label`.
    Force,
    /// Of `servo`.
    In,
    /// Of `servo`.
    Out,
    /// Of `test`.
    Row,
    /// Of `test`.
    Watchdog,
    /// Of `plot`.
    Teleplot,
    /// Of `label`.
    Plant,
    /// Of `label`.
    Weed,
}

/// The words for the variants of enums, in the order of declaration.
macro_rules! words {
    ($($Name:ident { $($Variant:ident = $word:literal,)* })*) => {$(
        impl $Name {
            /// The words, in the order of declaration.
            pub(crate) const WORDS: &[&str] = &[$($word),*];

            /// How many there are.
            pub const COUNT: u8 = Self::WORDS.len() as u8;

            /// The one at a place in the order of declaration.
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
