//! The words for what the machine tells apart: its alarms, its settings, what was typed.
//!
//! Such a thing is a plain enum wherever it stands. Here it gets a word for each of its variants, to be written and to be read;
//! the words lie in flash with all the other [texts](crate::say::packed).

use crate::{
    alarm::{Alarm, Warning},
    measure::reset::Cause,
    say::{
        command::{Argument, Word},
        packed::Text,
    },
    settings::{self, Setting},
    weeder::Reason,
};

/// Has an enum write and read its words, `WORDS`.
macro_rules! written {
    ($Name:ident) => {
        impl $Name {
            const FIRST: Text = Text::first_of(Self::WORDS);

            /// The word for it.
            pub const fn text(self) -> Text {
                Self::FIRST.plus(self as u8)
            }

            /// The one that `word` stands for.
            pub fn find(word: &[u8]) -> Option<Self> {
                Self::from_index(Self::FIRST.find(Self::COUNT, word))
            }
        }
    };
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

        written!($Name);

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

written!(Setting);

impl Setting {
    /// What it is, for the operator.
    pub fn help(self) -> Text {
        const { Text::first_of(settings::HELPS) }.plus(self as u8)
    }

    /// Its unit behind a blank, or nothing where it is a count or switched.
    pub fn unit(self) -> Text {
        const { Text::first_of(settings::UNITS) }.plus(self as u8)
    }
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
        Teleplot = "teleplot",
        Plant = "plant",
        Weed = "weed",
    }
}
