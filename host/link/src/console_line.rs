//! Parses any line of the console: the greeting, the end of an answer, a line of an answer, or an event.
//!
//! Unknown keys and words at the end are ignored, so that a newer firmware may add more. A line that lacks a required
//! part is [`ConsoleLine::Other`]. This module does not know which command a line answers. A setting's name, range and
//! unit are read from the line, not from this version's table.

use super::event_line::{
    Counts, EventLine, Fields, LineDescription, Status, ValueDescription, is_name, is_of_a_name, kind,
};
use control::ground::class::Class;
use control::ground::features::COUNT;

/// Defines the lines of answers that have no `key=value` words, and with them all lines.
macro_rules! console_lines {
    ($(
        $(#[doc = $meaning:literal])+
        $Line:ident { $($(#[doc = $about:literal])+ $field:ident: $Type:ty,)* }
    )*) => {
        /// What a line says.
        #[derive(Clone, Debug, PartialEq, Eq)]
        pub enum ConsoleLine {
            $(
                $(#[doc = $meaning])+
                $Line { $($(#[doc = $about])+ $field: $Type,)* },
            )*
            /// The first line of the answer to `status`.
            Status(Status),
            /// The second line of the answer to `status`.
            Counts(Counts),
            /// An event.
            Event(EventLine),
            /// Something else.
            Other,
        }

        /// The lines of answers, except those in [`STATUS`](crate::STATUS).
        pub const ANSWERS: &[LineDescription] = &[$(LineDescription {
            name: stringify!($Line),
            meaning: concat!($($meaning),+),
            beginning: "",
            values: &[$(ValueDescription {
                key: "",
                kind: "",
                field: Some((stringify!($field), stringify!($Type))),
                meaning: concat!($($about),+),
            }),*],
        }),*];

        impl ConsoleLine {
            /// Its name, and its fields by name.
            pub fn fields(&self) -> Fields {
                match self {
                    $(Self::$Line { $($field,)* } => {
                        (stringify!($Line), vec![$((stringify!($field), $field.clone().into())),*])
                    })*
                    Self::Status(status) => status.fields(),
                    Self::Counts(counts) => counts.fields(),
                    Self::Event(event) => event.fields(),
                    Self::Other => ("Other", Vec::new()),
                }
            }
        }
    };
}

console_lines! {
    /// The first line after a reset.
    Greeting {
        /// The firmware's version.
        version: String,
        /// The reset cause, in the firmware's word.
        cause: String,
        /// Whether the machine was at work before.
        was_at_work: bool,
    }
    /// The answer to `version`.
    Version {
        /// The firmware's version.
        version: String,
    }
    /// The end of an answer.
    End {
        /// The error, and what would be right; missing if the command succeeded.
        error: Option<String>,
    }
    /// A setting: a line of the answer to `get`, or the measured value in the answer to `calibrate MM`. A switch is 0 or 1.
    Setting {
        /// Its name.
        name: String,
        /// Its value in use.
        value: u16,
        /// Its unit; empty for a count.
        unit: String,
        /// The least value.
        least: u16,
        /// The greatest value.
        greatest: u16,
        /// Whether it is a switch.
        is_switched: bool,
        /// Its value on a new machine.
        default: u16,
        /// The saved value, if there is one.
        saved: Option<u16>,
    }
    /// A line of the answer to `help`.
    Help {
        /// A setting's or a command's name.
        name: String,
        /// What it is.
        help: String,
    }
    /// A line of the answer to `examples`.
    Example {
        /// True for a taught example, false for a built-in one.
        from_field: bool,
        /// Its number, of its kind.
        number: u16,
        /// Its class.
        label: Class,
        /// Its features, on the scale of the firmware's own examples.
        features: [u8; COUNT],
    }
}

/// The prefix of the firmware's greeting and version.
const NAME: &str = "weeder ";

impl ConsoleLine {
    /// Reads a line.
    pub fn parse(line: &str) -> Self {
        // This check is first, because a greeting may come after the beginning of any other line.
        if let Some(greeting) = greeting(line) {
            return greeting;
        }
        if line == "ok" {
            return Self::End { error: None };
        }
        if let Some(error) = line.strip_prefix("error:") {
            return Self::End { error: Some(error.trim().to_owned()) };
        }
        EventLine::parse(line)
            .map(Self::Event)
            .or_else(|| Status::parse(line).map(Self::Status))
            .or_else(|| Counts::parse(line).map(Self::Counts))
            .or_else(|| version(line))
            .or_else(|| example(line))
            .or_else(|| setting(line))
            .or_else(|| help(line))
            .unwrap_or(Self::Other)
    }
}

/// Parses `weeder VERSION, reset by CAUSE` and perhaps `, was work`, also behind a line that the reset has cut.
fn greeting(line: &str) -> Option<ConsoleLine> {
    let (before, behind) = line.split_once(", reset by ")?;
    let version = before.get(before.rfind(NAME)? + NAME.len()..)?;
    let cause = behind.split(|character| !is_of_a_name(character)).next().filter(|cause| !cause.is_empty())?;
    let was_at_work = behind[cause.len()..].starts_with(", was work,");
    let (version, cause) = (version.to_owned(), cause.to_owned());
    is_version(&version).then_some(ConsoleLine::Greeting { version, cause, was_at_work })
}

/// Parses `weeder VERSION`. A version may be followed by its commit.
fn version(line: &str) -> Option<ConsoleLine> {
    let version = line.strip_prefix(NAME)?.to_owned();
    is_version(&version).then_some(ConsoleLine::Version { version })
}

/// `field|built_in NUMBER LABEL FEATURES`.
fn example(line: &str) -> Option<ConsoleLine> {
    let mut words = line.split(' ');
    let from_field = match words.next()? {
        "field" => true,
        "built_in" => false,
        _ => return None,
    };
    let number = words.next()?.parse().ok()?;
    let label = kind::class(words.next()?).filter(|&class| class != Class::Unknown)?;
    let mut features = [0; COUNT];
    for feature in &mut features {
        *feature = words.next()?.parse().ok()?;
    }
    Some(ConsoleLine::Example { from_field, number, label, features })
}

/// Parses `NAME and arguments - description`.
fn help(line: &str) -> Option<ConsoleLine> {
    let (usage, help) = line.split_once(" - ")?;
    let name = usage.split(' ').next().filter(|name| is_name(name))?;
    (!usage.contains('=')).then(|| ConsoleLine::Help { name: name.to_owned(), help: help.to_owned() })
}

/// Parses `NAME=VALUE UNIT from LEAST to GREATEST, default VALUE, saved VALUE`. A count has no unit. A switch has `on or
/// off` in place of the range. The saved value is missing if it equals the current one.
fn setting(line: &str) -> Option<ConsoleLine> {
    let mut parts = line.split(", ");
    let (name, rest) = parts.next()?.split_once('=')?;
    let mut words = rest.split(' ');
    let value = self::value(words.next()?)?;
    let words: Vec<&str> = words.collect();
    let (unit, least, greatest) = match words[..] {
        ["on", "or", "off"] => ("", 0, 1),
        ["from", least, "to", greatest] => ("", least.parse().ok()?, greatest.parse().ok()?),
        [unit, "from", least, "to", greatest] => (unit, least.parse().ok()?, greatest.parse().ok()?),
        _ => return None,
    };
    let default = self::value(parts.next()?.strip_prefix("default ")?)?;
    let saved = match parts.next() {
        None => Some(value),
        Some("not saved") => None,
        Some(saved) => Some(self::value(saved.strip_prefix("saved ")?)?),
    };
    let (name, unit, is_switched) = (name.to_owned(), unit.to_owned(), words == ["on", "or", "off"]);
    let is_shown = is_name(&name) && parts.next().is_none();
    is_shown.then_some(ConsoleLine::Setting { name, value, unit, least, greatest, is_switched, default, saved })
}

fn value(word: &str) -> Option<u16> {
    match word {
        "on" => Some(1),
        "off" => Some(0),
        number => number.parse().ok(),
    }
}

/// `NUMBER`, or `NUMBER (COMMIT)`.
fn is_version(text: &str) -> bool {
    let (number, commit) = text.split_once(' ').unwrap_or((text, "(0)"));
    is_word(number) && commit.strip_prefix('(').and_then(|commit| commit.strip_suffix(')')).is_some_and(is_word)
}

fn is_word(text: &str) -> bool {
    !text.is_empty() && !text.contains(' ')
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::settings::{self, Setting};
    use control::ground::{class::label, nearest::Nearest};
    use control::measure::reset::Cause;
    use control::memory::Volatile;
    use knn::Example;
    use rig::Rig;
    use std::assert_matches;

    const DONE: ConsoleLine = ConsoleLine::End { error: None };

    #[test]
    fn a_setting_is_read_with_what_is_saved() {
        for (line, read_value, read_saved) in [
            ("wheel_mm=405 mm from 200 to 800, default 400", 405, Some(405)),
            ("wheel_mm=405 mm from 200 to 800, default 400, not saved", 405, None),
            ("wheel_mm=405 mm from 200 to 800, default 400, saved 410", 405, Some(410)),
            ("end_switch=off on or off, default off, saved on", 0, Some(1)),
        ] {
            let read = ConsoleLine::parse(line);
            let ConsoleLine::Setting { value, saved, .. } = read else { panic!("{read:?}") };
            assert_eq!((value, saved), (read_value, read_saved), "{line}");
        }
    }

    #[test]
    fn the_firmware_says_its_name_by_itself_and_when_asked() {
        let greeting = |version: &str, cause: &str| {
            let (version, cause) = (version.to_owned(), cause.to_owned());
            ConsoleLine::Greeting { version, cause, was_at_work: false }
        };
        for cut in ["", "o", "status pos=123 to", "error: no such com", "state is=ho", "weeder 0.1"] {
            let line = format!("{cut}weeder 0.2.0, reset by brown_out, state alarm 5-1 settings_lost, tool out");
            assert_eq!(ConsoleLine::parse(&line), greeting("0.2.0", "brown_out"), "{line}");
        }
        let of_a_commit = "obj\u{fffd}weeder 0.2.0 (abc1234+), reset by button, state hold";
        assert_eq!(ConsoleLine::parse(of_a_commit), greeting("0.2.0 (abc1234+)", "button"));
        for version in ["0.2.0", "0.2.0 (abc1234)"].map(str::to_owned) {
            assert_eq!(ConsoleLine::parse(&format!("weeder {version}")), ConsoleLine::Version { version });
        }
        for foreign in ["weeder 0.2.0 abc1234", "weeder 0.2.0 ()", "weeder  (abc1234)", "weeder 0.2.0 (abc 1234)"] {
            assert_eq!(ConsoleLine::parse(foreign), ConsoleLine::Other, "{foreign}");
        }
    }

    #[test]
    fn lines_of_answers_are_told_apart() {
        let refused = ConsoleLine::End { error: Some("no such command".to_owned()) };
        let features = [1, 2, 3, 4, 5];
        let taught = ConsoleLine::Example { from_field: true, number: 7, label: Class::Weed, features };
        let help = ConsoleLine::Help { name: "get".to_owned(), help: "shows settings".to_owned() };
        let swing = ConsoleLine::Event(EventLine::Swing { out: false, position: 3 });
        for (line, meant) in [
            ("ok", DONE),
            ("error: no such command", refused),
            ("field 7 weed 1 2 3 4 5", taught),
            ("get [name] - shows settings", help),
            ("swing tool=in pos=3", swing),
            ("", ConsoleLine::Other),
            ("okay", ConsoleLine::Other),
            ("weeder", ConsoleLine::Other),
            ("weeder ", ConsoleLine::Other),
            ("weeder 1, reset by ", ConsoleLine::Other),
            ("field 7 grass 1 2 3 4 5", ConsoleLine::Other),
            ("field 7 weed 1 2 3 4", ConsoleLine::Other),
            ("field 7 weed 1 2 3 4 256", ConsoleLine::Other),
            ("field x weed 1", ConsoleLine::Other),
            ("k=3", ConsoleLine::Other),
        ] {
            assert_eq!(ConsoleLine::parse(line), meant, "{line:?}");
        }
    }

    fn answer(command: &str) -> Vec<ConsoleLine> {
        let examples = [Example::new([1, 2, 3, 4, 5], label::PLANT), Example::new([9, 8, 7, 6, 5], label::WEED)];
        let examples = Nearest::new(&examples[..], Volatile::new());
        let said = Rig::wake(examples, Volatile::new(), Cause::Unknown).ask(command);
        said.iter().map(|line| ConsoleLine::parse(line)).collect()
    }

    #[test]
    fn every_line_of_the_firmwares_answers_is_read() {
        let table = Setting::all().map(|setting| {
            let (name, unit, is_switched) = (settings::name(setting), settings::unit(setting), setting.is_switched());
            let (least, greatest, default) = (setting.least(), setting.greatest(), setting.default());
            ConsoleLine::Setting { name, value: default, unit, least, greatest, is_switched, default, saved: None }
        });
        assert_eq!(answer("get"), table.chain([DONE]).collect::<Vec<_>>());
        assert_matches!(&answer("version")[..], [ConsoleLine::Version { .. }, DONE]);
        assert_matches!(&answer("status")[..], [ConsoleLine::Status(_), ConsoleLine::Counts(_), DONE]);
        assert_matches!(&answer("nothing")[..], [ConsoleLine::End { error: Some(_) }]);
        let examples = answer("examples");
        let [first, second, .., end] = examples.as_slice() else { panic!("{examples:?}") };
        assert_matches!(first, ConsoleLine::Example { from_field: false, label: Class::Plant, .. });
        assert_matches!(second, ConsoleLine::Example { from_field: false, label: Class::Weed, .. });
        assert_eq!(end, &DONE);
        let help = answer("help");
        assert!(help.len() > 15);
        help[..help.len() - 1].iter().for_each(|said| assert_matches!(said, ConsoleLine::Help { .. }));
        for setting in Setting::all() {
            let (name, help) = (settings::name(setting), settings::help(setting));
            let said = answer(&format!("help {name}"));
            assert!(said.contains(&ConsoleLine::Help { name, help }), "{said:?}");
        }
    }
}
