//! The console: commands in, answers and events out.
//!
//! Bytes become lines, and a line becomes a [`command`]. One turn of the loop runs it, and later turns answer it. An answer can be
//! longer than the serial buffer, and no call may wait. So an [`Answer`] remembers how far it has been written. It builds its next
//! [`Line`] once the last one is sent. [`Console`] does one small step in each turn: it reads or writes a few characters, builds a
//! line, or runs a command. No input can stop the loop.
//!
//! All texts are in flash ([`packed`]), with the names of alarms and settings. No module outside imports this one. Inside it,
//! imports run `words` -> `texts` -> [`packed`] -> [`names`] -> [`command`], `line` -> the modules that build lines -> `answer`
//! -> `execute` -> this file.

mod answer;
pub mod command;
mod errors;
mod execute;
pub mod line;
mod line_tables;
mod lines;
pub mod names;
pub mod packed;
mod texts;
mod version;
mod words;

pub use self::{
    answer::Answer,
    execute::{answer_to, execute},
    lines::{write_event, write_plot},
    packed::Text,
};

use self::{
    command::{Command, LineBuffer},
    line::Line,
};
use crate::{ground::class::Classifier, memory::Memory, weeder::Controller};

/// Most characters of a line, its end included.
pub const LINE: usize = 140;

/// The answer in progress, and the line that is being sent.
#[derive(Clone, Debug)]
pub struct Console {
    answer: Answer,
    /// The last command that was typed.
    command: Command,
    line: Line,
}

impl Default for Console {
    fn default() -> Self {
        Self::new()
    }
}

impl Console {
    /// A console that sends the greeting first.
    pub const fn new() -> Self {
        Self { answer: Answer::Greeting, command: Command::NONE, line: Line::new() }
    }

    /// Whether the console takes a line: only once the last one is answered in full. Until then the bytes wait.
    pub fn listens(&self) -> bool {
        self.answer.is_done() && self.line.is_done()
    }

    /// Takes a line that is complete; a later turn runs it. Returns false for an empty line.
    #[cfg_attr(target_arch = "avr", inline(never))]
    pub fn take<C: Classifier, M: Memory>(
        &mut self,
        typed: &mut LineBuffer,
        controller: &mut Controller<C, M>,
    ) -> bool {
        let Some(line) = typed.read(&mut self.command) else { return false };
        self.answer = match line {
            Ok(()) => Answer::Typed,
            Err(error) => execute::refuse(error, controller),
        };
        true
    }

    /// The next byte to send.
    pub fn next_byte(&mut self) -> Option<u8> {
        self.line.next()
    }

    /// Runs one step that fits a turn: writes a byte to the EEPROM, runs a command, or builds the next line. An answer is never
    /// interrupted; events come after it, and curves last. Returns whether the EEPROM has more bytes to write.
    pub fn carry_on<C: Classifier, M: Memory>(&mut self, controller: &mut Controller<C, M>) -> bool {
        if !self.line.is_done() {
            return false;
        }
        // An answer waits for its command's EEPROM writes: `ok` means that they are done.
        if !controller.carry_on() {
            return true;
        }
        if self.answer == Answer::Typed {
            self.answer = execute(&self.command, controller);
        } else if !self.answer.is_done() {
            self.answer.write_line(controller, &mut self.line);
        } else if let Some(event) = controller.next_event() {
            write_event(&event, &mut self.line);
        } else if let Some(plot) = controller.next_plot() {
            write_plot(controller, plot, &mut self.line);
        }
        false
    }
}
