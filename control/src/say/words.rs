//! The table of commands: words, arguments and help texts, and the grammar.

use crate::named::named;

/// Makes all of a command from its row: its word, its arguments as `help` shows them, its help text, and its actions. An action has
/// what follows the word in its line.
macro_rules! commands {
    ($($Word:ident = $word:literal, $takes:literal, $help:literal { $($Action:ident: $follows:expr,)* })*) => {
        named! {
            /// The first word of a command.
            #[expect(missing_docs, reason = "the help texts say what each does")]
            Word {
                $($Word = $word,)*
            }
        }

        pub(super) const TAKES: &[&str] = &[$($takes),*];
        pub(super) const HELPS: &[&str] = &[$($help),*];

        /// What a command does, a row of the grammar each.
        #[derive(Clone, Copy, Debug, PartialEq, Eq)]
        #[repr(u8)]
        #[expect(missing_docs, reason = "the rows say what each is")]
        pub enum Action { $($($Action,)*)* }

        impl Action {
            pub(super) const fn from_index(index: u8) -> Option<Self> {
                match index {
                    $($(index if index == Self::$Action as u8 => Some(Self::$Action),)*)*
                    _ => None,
                }
            }
        }

        /// The rows of the grammar: a word, and what follows it.
        pub const ROWS: &[[u8; 2]] = &[$($([Word::$Word as u8, $follows],)*)*];
    };
}

/// What follows the word: an argument, see [`then`], or one of these.
pub(super) const NOTHING: u8 = Argument::COUNT;
pub(super) const NUMBER: u8 = NOTHING + 1;
pub(super) const SETTING: u8 = NOTHING + 2;
pub(super) const KIND: u8 = 0x1F;
const _: () = assert!(SETTING <= KIND);

/// What follows that: `force` or a speed, which may be left out, or a value. Otherwise nothing.
pub(super) const FORCE: u8 = 1 << 5;
const SPEED: u8 = 1 << 6;
pub(super) const VALUE: u8 = 1 << 7;

const fn then(argument: Argument) -> u8 {
    argument as u8
}

use Argument::{All, In, Now, Off, On, Out, Plant, Row, Servo, Start, Teleplot, Watchdog, Weed};

commands! {
    Help = "help", " [name]", "this list, or what a setting is" {
        Help: NOTHING, Explain: SETTING,
    }
    Status = "status", "", "position, state and counts" {
        Status: NOTHING,
    }
    Get = "get", " [name]", "one setting, or all" {
        GetAll: NOTHING, Get: SETTING,
    }
    Set = "set", " name value", "change a setting" {
        Set: SETTING | VALUE,
    }
    Save = "save", "", "keep the settings" {
        Save: NOTHING,
    }
    Revert = "revert", "", "restore saved settings" {
        Revert: NOTHING,
    }
    Defaults = "defaults", "", "restore factory settings" {
        Defaults: NOTHING,
    }
    Calibrate = "calibrate", " start|servo|MM [force]", "measure a distance, or time the servo" {
        CalibrateStart: then(Start), CalibrateServo: then(Servo), Calibrate: NUMBER | FORCE,
    }
    Servo = "servo", " in|out|US", "move the tool" {
        ServoIn: then(In), ServoOut: then(Out), Servo: NUMBER,
    }
    Test = "test", " row [MM_S]|watchdog", "swing as for plants, or reset" {
        TestRow: then(Row) | SPEED, TestWatchdog: then(Watchdog),
    }
    Start = "start", " [now]", "weed; now, over unseen ground" {
        Start: NOTHING, StartNow: then(Now),
    }
    Hold = "hold", "", "tool out of the row" {
        Hold: NOTHING,
    }
    Clear = "clear", "", "clear an alarm" {
        Clear: NOTHING,
    }
    Events = "events", " on|off", "plants, swings and alarms" {
        EventsOn: then(On), EventsOff: then(Off),
    }
    Plot = "plot", " on|off|teleplot", "curves for Arduino, or Teleplot" {
        PlotOn: then(On), PlotOff: then(Off), PlotTeleplot: then(Teleplot),
    }
    Label = "label", " plant|weed [force]", "label the last detection" {
        LabelPlant: then(Plant) | FORCE, LabelWeed: then(Weed) | FORCE,
    }
    Teach = "teach", " N|plant|weed", "teach an example" {
        Feature: NUMBER, TeachPlant: then(Plant), TeachWeed: then(Weed),
    }
    Examples = "examples", "", "all examples" {
        Examples: NOTHING,
    }
    Forget = "forget", " N|all", "forget field examples" {
        Forget: NUMBER, ForgetAll: then(All),
    }
    Dump = "dump", "", "the last 16 detections" {
        Dump: NOTHING,
    }
    Version = "version", "", "the firmware" {
        Version: NOTHING,
    }
}

avr_progmem::progmem! {
    /// The rows.
    pub(super) static progmem GRAMMAR: [u8; 2 * ROWS.len()] = {
        let (mut bytes, mut place) = ([0; 2 * ROWS.len()], 0);
        while place < bytes.len() {
            bytes[place] = ROWS[place / 2][place % 2];
            place += 1;
        }
        bytes
    };
}

named! {
    /// An argument of a command.
    #[expect(missing_docs, reason = "the table of commands says which command takes each")]
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

named! {
    /// What is wrong with a line.
    Wrong {
        // It is 0, like memory before start-up.
        /// Nothing, so far.
        Nothing = "",
        /// More than [`LINE_LENGTH`](super::command::LINE_LENGTH) characters.
        TooLong = "send 80 characters at most",
        /// Characters other than printable ASCII.
        NotText = "send letters, digits and blanks only",
        /// Bytes were lost before the firmware read them.
        CharactersLost = "characters were lost, send the line again",
        /// No command begins like this.
        UnknownCommand = "no such command, help lists them all",
        /// No setting has this name.
        UnknownSetting = "no such setting, get lists them all",
    }
}
