//! The command line of the monitor: editing, history, completion.
//!
//! It is written here because no crate fits. Those with all three (rustyline, reedline) take the whole terminal. The
//! one for ratatui (tui-input) has only editing, and no limit of characters.

use link::COMMAND_LENGTH;
use link::completion::{common, complete};
use link::row_names::NAME_LENGTH;
use ratatui::crossterm::event::{KeyCode, KeyEvent, KeyEventKind, KeyModifiers};

const HISTORY: usize = 100;

/// A line that is being typed. A row's name in it may have characters of any language.
#[derive(Clone, Debug, Default)]
pub struct CommandLine {
    pub text: String,
    /// Number of bytes before the cursor, which stands between two characters.
    pub cursor: usize,
    history: Vec<String>,
    /// The shown line of the history, counted from the newest. `None` for a new line.
    browsed: Option<usize>,
    /// The possible completions after Tab.
    pub candidates: Vec<String>,
}

impl CommandLine {
    pub fn clear(&mut self) {
        self.show(None, String::new());
        self.candidates.clear();
    }

    /// The beginning of the command: after a row's name and colon, if they are typed.
    fn command_start(&self) -> usize {
        let is_name = |&colon: &usize| self.text[..colon].chars().count() <= NAME_LENGTH;
        let Some(colon) = self.text.find(':').filter(is_name) else { return 0 };
        let behind = &self.text[colon + 1..];
        colon + 1 + usize::from(behind.starts_with(' '))
    }

    /// Length of the character before the cursor, in bytes; 0 at the beginning.
    fn before(&self) -> usize {
        self.text[..self.cursor].chars().next_back().map_or(0, char::len_utf8)
    }

    /// Handles a key. Returns the line when it is entered.
    pub fn key(&mut self, key: KeyEvent) -> Option<String> {
        if key.kind == KeyEventKind::Release {
            return None;
        }
        self.candidates.clear();
        let pressed = key.modifiers.difference(KeyModifiers::SHIFT);
        // Windows sends AltGr as Ctrl and Alt. A letter of ASCII with both is a shortcut.
        let is_typed = |letter: char| {
            pressed.is_empty() || !letter.is_ascii() && pressed == KeyModifiers::CONTROL.union(KeyModifiers::ALT)
        };
        match key.code {
            // A terminal in raw mode has these for a pasted LF and for CR. The LF of both enters an empty line.
            KeyCode::Char('j' | 'm') if key.modifiers == KeyModifiers::CONTROL => return self.enter(),
            KeyCode::Char('u') if key.modifiers == KeyModifiers::CONTROL => self.clear(),
            KeyCode::Char(letter) if !is_typed(letter) || letter.is_control() => {}
            KeyCode::Char(letter) if self.text.len() < self.most() => {
                self.text.insert(self.cursor, letter);
                self.cursor += letter.len_utf8();
            }
            KeyCode::Backspace if self.cursor > 0 => {
                self.cursor -= self.before();
                self.text.remove(self.cursor);
            }
            KeyCode::Delete if self.cursor < self.text.len() => {
                self.text.remove(self.cursor);
            }
            KeyCode::Left => self.cursor -= self.before(),
            KeyCode::Right => {
                self.cursor += self.text[self.cursor..].chars().next().map_or(0, char::len_utf8);
            }
            KeyCode::Home => self.cursor = 0,
            KeyCode::End => self.cursor = self.text.len(),
            KeyCode::Up => self.browse(self.browsed.map_or(0, |place| place + 1)),
            KeyCode::Down => match self.browsed {
                Some(place) if place > 0 => self.browse(place - 1),
                _ => self.show(None, String::new()),
            },
            KeyCode::Tab => self.complete(),
            KeyCode::Enter => return self.enter(),
            _ => {}
        }
        None
    }

    fn browse(&mut self, place: usize) {
        if let Some(line) = self.history.iter().rev().nth(place) {
            self.show(Some(place), line.clone());
        }
    }

    fn show(&mut self, browsed: Option<usize>, text: String) {
        (self.browsed, self.cursor, self.text) = (browsed, text.len(), text);
    }

    /// Greatest length of the line: that of a command, and of the name before it.
    fn most(&self) -> usize {
        COMMAND_LENGTH + self.command_start()
    }

    /// Completes the word before the cursor, as far as all candidates agree.
    fn complete(&mut self) {
        let (before, behind) = self.text.split_at(self.cursor);
        let (address, begun) = before.split_at(self.command_start().min(before.len()));
        let candidates: Vec<String> = complete(begun).iter().map(|command| format!("{address}{command}")).collect();
        let completed = match candidates.as_slice() {
            [] => return,
            [only] => format!("{only} "),
            several => common(several).to_owned(),
        };
        if completed.len() + behind.len() <= self.most() && completed.len() >= before.len() {
            let text = format!("{completed}{behind}");
            (self.cursor, self.text) = (completed.len(), text);
        }
        if candidates.len() > 1 {
            self.candidates = candidates;
        }
    }

    fn enter(&mut self) -> Option<String> {
        let line = self.text.trim().to_owned();
        self.show(None, String::new());
        if line.is_empty() {
            return None;
        }
        if self.history.last() != Some(&line) {
            self.history.push(line.clone());
        }
        let excess = self.history.len().saturating_sub(HISTORY);
        self.history.drain(..excess);
        Some(line)
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    /// Presses the keys of a text, in which `\t` is Tab, and `\n` Enter.
    fn typed(line: &mut CommandLine, text: &str) {
        for character in text.chars() {
            line.key(match character {
                '\t' => KeyCode::Tab.into(),
                '\n' => KeyCode::Enter.into(),
                character => KeyCode::Char(character).into(),
            });
        }
    }

    #[test]
    fn a_line_is_edited_at_the_cursor_and_entered() {
        let mut line = CommandLine::default();
        typed(&mut line, " hole");
        line.key(KeyCode::Backspace.into());
        typed(&mut line, "d!");
        line.key(KeyCode::Left.into());
        line.key(KeyCode::Delete.into());
        assert_eq!((line.text.as_str(), line.cursor), (" hold", 5));
        assert_eq!(line.key(KeyCode::Enter.into()).as_deref(), Some("hold"));
        assert_eq!(line.key(KeyCode::Enter.into()), None, "the line is empty again");
    }

    #[test]
    fn up_and_down_recall_entered_lines() {
        let mut line = CommandLine::default();
        typed(&mut line, "status\nget k\nget k\n");
        let mut shown = |code: KeyCode| {
            line.key(code.into());
            line.text.clone()
        };
        assert_eq!([shown(KeyCode::Up), shown(KeyCode::Up), shown(KeyCode::Up)], ["get k", "status", "status"]);
        assert_eq!([shown(KeyCode::Down), shown(KeyCode::Down), shown(KeyCode::Down)], ["get k", "", ""]);
    }

    #[test]
    fn tab_completes_the_common_part_and_shows_the_choices() {
        let mut line = CommandLine::default();
        typed(&mut line, "set lea\t");
        assert_eq!(line.text, "set lead_");
        assert_eq!(line.candidates, ["set lead_out_ms", "set lead_in_ms"]);
        typed(&mut line, "o");
        assert!(line.candidates.is_empty());
        typed(&mut line, "\t");
        assert_eq!((line.text.as_str(), line.cursor), ("set lead_out_ms ", 16));
        typed(&mut line, "xyz\t");
        assert_eq!(line.text, "set lead_out_ms xyz");
    }

    #[test]
    fn a_row_name_before_a_command_limits_no_length_or_completion() {
        let mut line = CommandLine::default();
        typed(&mut line, "row3: set lead_o\t");
        assert_eq!(line.text, "row3: set lead_out_ms ");
        typed(&mut line, &"x".repeat(200));
        assert_eq!(line.text.len(), "row3: ".len() + COMMAND_LENGTH);
        line.clear();
        assert_eq!((line.text.as_str(), line.cursor), ("", 0));
        typed(&mut line, "set servo\t");
        assert!(!line.candidates.is_empty());
        line.clear();
        assert!(line.candidates.is_empty());
    }

    #[test]
    fn pasted_lines_are_entered_and_control_keys_type_no_letter() {
        let key = |line: &mut CommandLine, letter, modifiers| line.key(KeyEvent::new(KeyCode::Char(letter), modifiers));
        for ends in [&["j"][..], &["enter"], &["enter", "j"], &["m", "j"]] {
            let (mut line, mut entered) = (CommandLine::default(), Vec::new());
            for text in ["set k 5", "hold"] {
                typed(&mut line, text);
                for end in ends {
                    entered.extend(match *end {
                        "enter" => line.key(KeyCode::Enter.into()),
                        letter => key(&mut line, letter.chars().next().unwrap(), KeyModifiers::CONTROL),
                    });
                }
            }
            assert_eq!(entered, ["set k 5", "hold"], "{ends:?}");
        }
        let mut line = CommandLine::default();
        typed(&mut line, "hold");
        for letter in (' '..='~').filter(|letter| !"jmu".contains(*letter)) {
            for modifiers in [KeyModifiers::CONTROL, KeyModifiers::ALT, KeyModifiers::CONTROL | KeyModifiers::ALT] {
                assert_eq!((key(&mut line, letter, modifiers), line.text.as_str()), (None, "hold"), "{letter:?}");
            }
        }
        key(&mut line, 'S', KeyModifiers::SHIFT);
        assert_eq!(line.text, "holdS");
        key(&mut line, 'u', KeyModifiers::CONTROL);
        assert_eq!((line.text.as_str(), line.cursor), ("", 0));
    }

    #[test]
    fn a_row_s_name_in_any_language_is_typed_and_edited() {
        let mut line = CommandLine::default();
        typed(&mut line, "s\u{fc}d \u{921}: set lead_o\t");
        assert_eq!(line.text, "s\u{fc}d \u{921}: set lead_out_ms ");
        line.key(KeyCode::Home.into());
        line.key(KeyCode::Right.into());
        line.key(KeyCode::Right.into());
        line.key(KeyCode::Left.into());
        line.key(KeyCode::Delete.into());
        typed(&mut line, "\u{e9}");
        line.key(KeyEvent::new(KeyCode::Char('\u{105}'), KeyModifiers::CONTROL | KeyModifiers::ALT));
        line.key(KeyCode::Backspace.into());
        assert_eq!((line.text.as_str(), line.cursor), ("s\u{e9}d \u{921}: set lead_out_ms ", 3));
    }

    #[test]
    fn invalid_lines_are_not_typed() {
        let mut line = CommandLine::default();
        typed(&mut line, "h\u{1b}ld");
        assert_eq!(line.text, "hld");
        typed(&mut line, &"x".repeat(200));
        assert_eq!(line.text.len(), COMMAND_LENGTH);
    }
}
