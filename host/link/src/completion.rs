//! Completes a half-typed command from the firmware's own words, its table of settings, and its parser.

use super::settings::{Setting, name};
use control::say::command::{Argument, Word, parse};

/// All lines that complete the last word of `line`, in the order of the firmware's tables.
pub fn complete(line: &str) -> Vec<String> {
    let (before, begun) = line.rsplit_once(' ').map_or(("", line), |(before, begun)| (before, begun));
    let words: Vec<&str> = before.split_whitespace().collect();
    let whole = |choice: String| if words.is_empty() { choice } else { format!("{before} {choice}") };
    let is_command = |choice: &String| parse(whole(choice.clone()).as_bytes()).is_ok();
    let choices: Vec<String> = match words.as_slice() {
        [] => (0..).map_while(Word::from_index).map(|word| word.text().to_string()).collect(),
        ["get" | "set" | "help"] => Setting::all().map(name).collect(),
        ["set", setting]
            if let Some(setting) = Setting::find(setting.as_bytes())
                && !setting.is_switched() =>
        {
            vec![setting.default().to_string()]
        }
        _ => {
            let arguments = (0..).map_while(Argument::from_index).map(|argument| argument.text().to_string());
            arguments.filter(is_command).collect()
        }
    };
    choices.into_iter().filter(|choice| choice.starts_with(begun)).map(whole).collect()
}

/// The longest prefix that all lines share.
pub fn common(lines: &[String]) -> &str {
    let Some(first) = lines.first() else { return "" };
    let shared = |other: &String| first.bytes().zip(other.bytes()).take_while(|(one, other)| one == other).count();
    // All are ASCII.
    &first[..lines.iter().map(shared).min().unwrap_or(0)]
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn commands_settings_and_their_values_are_completed() {
        assert_eq!(complete("ex"), ["examples"]);
        assert_eq!(complete("set lead_"), ["set lead_out_ms", "set lead_in_ms"]);
        assert_eq!(complete("set end_switch "), ["set end_switch on", "set end_switch off"]);
        assert_eq!(complete("set wheel_mm "), ["set wheel_mm 400"]);
        assert_eq!(complete("label p"), ["label plant"]);
        assert_eq!(complete("label weed "), ["label weed force"]);
        assert_eq!(complete("test "), ["test row", "test watchdog"]);
        assert!(complete("").len() > 10);
    }

    #[test]
    fn an_unknown_beginning_has_no_completion() {
        for line in ["xyz", "set nothing ", "hold ", "start now ", "set wheel_mm 4oo"] {
            assert!(complete(line).is_empty(), "{line:?}");
        }
    }

    #[test]
    fn the_common_part_of_completions_is_found() {
        assert_eq!(common(&complete("set lead")), "set lead_");
        assert_eq!(common(&complete("xyz")), "");
    }
}
