//! The table of commands: words, arguments and help texts.

use crate::named::named;

/// For each command its first word, the arguments that `help` shows, and its help text.
macro_rules! commands {
    ($($Word:ident = $word:literal, $takes:literal, $help:literal;)*) => {
        named! {
            /// The first word of a command.
            #[expect(missing_docs, reason = "the help texts say what each does")]
            Word {
                $($Word = $word,)*
            }
        }

        pub(super) const TAKES: &[&str] = &[$($takes),*];
        pub(super) const HELPS: &[&str] = &[$($help),*];
    };
}

commands! {
    Help = "help", " [name]", "this list, or what a setting is";
    Status = "status", "", "position, state and counts";
    Get = "get", " [name]", "one setting, or all";
    Set = "set", " name value", "change a setting";
    Save = "save", "", "keep the settings";
    Revert = "revert", "", "restore saved settings";
    Defaults = "defaults", "", "restore factory settings";
    Calibrate = "calibrate", " start|servo|MM [force]", "measure a distance, or time the servo";
    Servo = "servo", " in|out|US", "move the tool";
    Test = "test", " row [MM_S]|watchdog", "swing as for plants, or reset";
    Start = "start", " [now]", "weed; now, over unseen ground";
    Hold = "hold", "", "tool out of the row";
    Clear = "clear", "", "clear an alarm";
    Events = "events", " on|off", "plants, swings and alarms";
    Plot = "plot", " on|off|teleplot", "curves for Arduino, or Teleplot";
    Label = "label", " plant|weed [force]", "label the last detection";
    Teach = "teach", " N|plant|weed", "teach an example";
    Examples = "examples", "", "all examples";
    Forget = "forget", " N|all", "forget field examples";
    Dump = "dump", "", "the last 16 detections";
    Version = "version", "", "the firmware";
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
