//! Completes a half-typed command from the firmware's own words and its table of settings.

use super::settings::{Setting, name};
use control::say::command::Word;

/// All lines that complete the last word of `line`, in the order of the firmware's tables.
pub fn complete(line: &str) -> Vec<String> {
    let (before, begun) = line.rsplit_once(' ').map_or(("", line), |(before, begun)| (before, begun));
    let words: Vec<&str> = before.split_whitespace().collect();
    let choices: Vec<String> = match words.as_slice() {
        [] => (0..).map_while(Word::from_index).map(|word| word.text().bytes().map(char::from).collect()).collect(),
        ["get" | "set" | "help"] => Setting::all().map(name).collect(),
        ["set", setting] => match Setting::find(setting.as_bytes()) {
            Some(setting) if setting.is_switched() => owned(&["on", "off"]),
            Some(setting) => vec![setting.description().default.to_string()],
            None => Vec::new(),
        },
        ["start"] => owned(&["now"]),
        ["events"] => owned(&["on", "off"]),
        ["plot"] => owned(&["on", "off", "teleplot"]),
        ["label" | "teach"] => owned(&["plant", "weed"]),
        ["label", _] => owned(&["force"]),
        ["forget"] => owned(&["all"]),
        ["servo"] => owned(&["in", "out"]),
        ["calibrate"] => owned(&["start", "servo"]),
        ["test"] => owned(&["row"]),
        _ => Vec::new(),
    };
    let fitting = choices.into_iter().filter(|choice| choice.starts_with(begun));
    fitting.map(|choice| if words.is_empty() { choice } else { format!("{before} {choice}") }).collect()
}

fn owned(words: &[&str]) -> Vec<String> {
    words.iter().map(|&word| word.to_owned()).collect()
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
