//! The rules that decide who may type which command. The firmware's own parser (`control::say::command`) reads the
//! lines, so a line means here what it means on the machine.
//!
//! The operator at the computer with the port may type everything, as in `weeder monitor`. Over the network, a paired
//! client may type commands that neither put the tool into the row nor change the machine. It may type `start` and
//! `clear` only if the operator allowed this when starting `weeder serve`. All other commands are refused over the
//! network, and so are commands that this version does not know.

use control::say::command::Action;
use thiserror::Error;

/// The origin of a command.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub enum Reach {
    /// From the computer that has the port.
    Here,
    /// From the network.
    Lan {
        /// Whether the operator allowed start over the network.
        may_start: bool,
    },
}

/// Why a line is not passed on to the machine.
#[derive(Clone, Copy, Debug, PartialEq, Eq, Error)]
pub enum Forbidden {
    #[error("that is no command: it has to be one line of 1 to {} printable ASCII characters", link::COMMAND_LENGTH)]
    NoLine,
    #[error("`weeder serve` does not know that command, and passes on only known commands: `help` lists them")]
    Unknown,
    #[error("this is not allowed from here: go to the machine, or have `weeder serve` started with --allow-start")]
    NoStart,
    #[error(
        "this takes the tool over ground that the beam has not seen, and is never allowed over the network: go to the machine"
    )]
    Unseen,
    #[error(
        "this moves the tool, and is never allowed over the network: go to the computer that has the machine's port"
    )]
    MovesTool,
    #[error("this changes the machine, and is never allowed over the network: go to the computer that has its port")]
    ChangesMachine,
    #[error(
        "this changes the events for all clients, and is never allowed over the network: type it at the computer with the port"
    )]
    ChangesWire,
}

/// Decides whether a line may be typed from there.
///
/// # Errors
/// Why it is not allowed, and where it is.
pub fn allow(line: &str, reach: Reach) -> Result<(), Forbidden> {
    // Every client may hold. A program may send the line's end too.
    if link::is_hold(line) {
        return Ok(());
    }
    // The machine does not answer a line without a word.
    if !link::is_command(line) || line.trim().is_empty() {
        return Err(Forbidden::NoLine);
    }
    // The machine itself reports errors in a line of the operator's.
    let Reach::Lan { may_start } = reach else { return Ok(()) };
    let action = link::command(line).map_err(|_| Forbidden::Unknown)?.action;
    why_not(action).filter(|&why| !(may_start && why == Forbidden::NoStart)).map_or(Ok(()), Err)
}

/// Why a command is refused over the network. Every new command must be added here.
fn why_not(action: Action) -> Option<Forbidden> {
    use Action::*;
    match action {
        Help | Explain | Status | GetAll | Get | Hold | EventsOn | Examples | Dump | Version => None,
        // A client that has not seen the fault must not clear a latched alarm.
        Start | Clear => Some(Forbidden::NoStart),
        StartNow => Some(Forbidden::Unseen),
        CalibrateServo | ServoIn | ServoOut | Servo | TestRow | TestWatchdog => Some(Forbidden::MovesTool),
        Set | Save | Revert | Defaults | CalibrateStart | Calibrate | LabelPlant | LabelWeed | Feature | TeachPlant
        | TeachWeed | Forget | ForgetAll => Some(Forbidden::ChangesMachine),
        EventsOff | PlotOn | PlotOff | PlotTeleplot => Some(Forbidden::ChangesWire),
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    const WATCHING: Reach = Reach::Lan { may_start: false };
    const STARTING: Reach = Reach::Lan { may_start: true };

    /// Every command, under its rule in the manual's table.
    const RULES: [(Option<Forbidden>, &[&str]); 9] = [
        (None, &["help", "help k", "status", "get", "get k", "events on", "examples", "dump", "version"]),
        (None, &["  status ", "get  k"]),
        (Some(Forbidden::NoStart), &["start", "clear", " start", "clear  "]),
        (Some(Forbidden::Unseen), &["start now", "  start   now "]),
        (
            Some(Forbidden::MovesTool),
            &["servo in", "servo out", "servo 1500", "test row", "test row 900", "test watchdog", "calibrate servo"],
        ),
        (Some(Forbidden::ChangesMachine), &["set k 3", "set margin_mm 0", "save", "revert", "defaults"]),
        (Some(Forbidden::ChangesMachine), &["calibrate start", "calibrate 10000", "calibrate 10000 force"]),
        (
            Some(Forbidden::ChangesMachine),
            &["label plant", "label weed force", "teach 3", "teach plant", "forget 3", "forget all"],
        ),
        (Some(Forbidden::ChangesWire), &["events off", "plot on", "plot off", "plot teleplot"]),
    ];

    /// All of these lines, and why the network may not type them.
    fn lines() -> impl Iterator<Item = (&'static str, Option<Forbidden>)> {
        RULES.into_iter().flat_map(|(why, lines)| lines.iter().map(move |&line| (line, why)))
    }

    #[test]
    fn every_line_is_typed_by_its_rule_and_every_client_may_hold() {
        for (line, why) in lines() {
            let started = why.filter(|why| *why != Forbidden::NoStart);
            for (reach, why) in [(Reach::Here, None), (WATCHING, why), (STARTING, started)] {
                assert_eq!(allow(line, reach), why.map_or(Ok(()), Err), "{line:?} from {reach:?}");
            }
        }
        for line in ["hold", " hold", "hold   ", "HOLD", "Hold", "hold.", "HOLD !", "hold\n", "Hold!\r\n"] {
            for reach in [Reach::Here, WATCHING, STARTING] {
                assert!(link::is_hold(line) && allow(line, reach) == Ok(()), "{line:?} from {reach:?}");
            }
        }
    }

    #[test]
    fn every_command_of_the_console_is_under_a_rule_that_is_tested() {
        use control::say::command::Word;
        let tested: Vec<&str> = lines().map(|(line, _)| line).chain(["hold"]).collect();
        for word in (0..).map_while(Word::from_index) {
            let word: String = word.text().bytes().map(char::from).collect();
            assert!(tested.iter().any(|line| line.split_whitespace().next() == Some(&word)), "{word}");
        }
    }

    #[test]
    fn the_table_of_the_manual_has_the_rule_of_every_command() {
        let manual = include_str!("../../../docs/serve.md");
        let words = |cell: &'static str| cell.split('`').skip(1).step_by(2);
        let rows: Vec<Vec<&'static str>> = manual
            .lines()
            .map(|line| line.trim_matches('|').split('|').map(str::trim).collect())
            .filter(|cells: &Vec<&str>| cells.len() == 4)
            .collect();
        assert_eq!(rows.first().map(|cells| &cells[1..]), Some(&["at the computer", "paired phone", "others"][..]));
        // The manual lists `start now` in another row than `start`.
        let of = |line: &str| {
            let words = rows.iter().flat_map(|cells| words(cells[0]).map(move |word| (cells, word)));
            let own = words.filter(|(_, word)| format!("{line} ").starts_with(&format!("{word} ")));
            own.max_by_key(|(_, word)| word.len()).map(|(cells, _)| cells)
        };
        for line in lines().map(|(line, _)| line).chain(["hold"]) {
            let line = line.split_whitespace().collect::<Vec<_>>().join(" ");
            let cells = of(&line).unwrap_or_else(|| panic!("{line} is not in the table"));
            let phone = match [WATCHING, STARTING].map(|reach| allow(&line, reach).is_ok()) {
                [true, true] => "yes",
                [false, true] => "only with `--allow-start`",
                _ => "never",
            };
            assert_eq!(cells[1..], ["yes", phone, "no"], "{line}");
        }
    }

    #[test]
    fn unknown_commands_are_not_passed_on_over_the_network() {
        for line in ["starts", "start later", "start now now", "set k", "launch", "help me", "servo", "\u{1}"] {
            assert!(allow(line, STARTING).is_err(), "{line:?}");
        }
        assert_eq!(allow("launch", Reach::Here), Ok(()));
        // The machine reads capital letters as small ones.
        assert_eq!(allow("START", STARTING), Ok(()));
        assert_eq!(allow("START", WATCHING), allow("start", WATCHING));
        assert!(allow("Set margin_mm 5", STARTING).is_err());
    }

    #[test]
    fn an_empty_or_double_line_is_never_passed_on() {
        let long = "x".repeat(link::COMMAND_LENGTH + 1);
        for line in
            ["", "   ", "status\nstart", "status\rstart", "hold\u{8}\u{8}\u{8}\u{8}start", "\tstart", "grün", &long]
        {
            for reach in [Reach::Here, WATCHING, STARTING] {
                assert_eq!(allow(line, reach), Err(Forbidden::NoLine), "{line:?} from {reach:?}");
            }
        }
    }
}
