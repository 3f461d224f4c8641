//! The console: what is typed, and what the machine says.
//!
//! Bytes become lines and lines become a [`command`], which a turn of the loop carries out and others answer. An answer can be
//! longer than the serial line's buffer, and nothing here may wait for it to drain. So an [`Answer`] is a place in a text that puts
//! its next [`Line`] together whenever the one before it has gone out. [`Console`] has all of it happen in turns of the main
//! loop, each of which does little: it reads or writes a few characters, or puts one line together, or carries one command
//! out. Whatever is typed, the loop turns on.
//!
//! All that is said lies in flash ([`packed`]), the words for alarms, settings and the like among it. Nothing below imports
//! any of this, and here imports run `words` -> `texts` -> `packed` -> `names`, `line` -> [`command`], and the lines that are
//! put together -> `answer` -> `execute` -> this file.

mod answer;
pub mod command;
mod errors;
mod event_table;
mod events;
mod execute;
pub mod line;
pub mod names;
pub mod packed;
mod status;
mod texts;
mod version;
mod words;

pub use self::{answer::Answer, events::write_event, execute::execute, status::write_plot, texts::Text};

use self::{
    command::{Command, ParseError},
    line::Line,
};
use crate::{ground::class::Classifier, memory::Memory, weeder::Controller};

/// Characters that a line has at most, its end included.
pub const LINE: usize = 140;

/// The console's answers: what answers the line that was typed last, and the line that is being written.
#[derive(Clone, Debug, Default)]
pub struct Console {
    answer: Answer,
    line: Line,
}

impl Console {
    /// A console that greets after a reset.
    pub const fn new() -> Self {
        Self { answer: Answer::Greeting, line: Line::new() }
    }

    /// Whether a line can be taken: one is read only when the one before it has been answered in full; until then the bytes wait.
    pub fn listens(&self) -> bool {
        self.answer.is_done() && self.line.is_done()
    }

    /// Takes a line that was typed, to carry it out in a later turn.
    pub fn take(&mut self, line: Result<Command, ParseError>) {
        self.answer = Answer::Typed(line);
    }

    /// The next byte of the line that is being written.
    pub fn next_byte(&mut self) -> Option<u8> {
        self.line.next()
    }

    /// Does the next thing for which a turn of the loop is long enough: has a byte kept for good, carries out what was typed, or
    /// puts the next line together. An answer comes in one piece, then what there is to tell, then the curves.
    pub fn carry_on<C: Classifier, M: Memory>(&mut self, controller: &mut Controller<C, M>) {
        // An answer waits for what its command wrote to the EEPROM: `ok` means that it is there.
        if !self.line.is_done() || !controller.carry_on() {
            return;
        }
        if let Answer::Typed(line) = self.answer {
            self.answer = execute(line, controller);
        } else if !self.answer.is_done() {
            self.answer.write_line(controller, &mut self.line);
        } else if let Some(event) = controller.next_event() {
            write_event(&event, &mut self.line);
        } else if let Some(plot) = controller.next_plot() {
            write_plot(controller, plot, &mut self.line);
        }
    }
}
