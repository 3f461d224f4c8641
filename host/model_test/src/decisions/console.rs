//! The console as in the firmware's main loop: a line runs once the one before it is answered.

use super::Weeder;
use control::say::{self, Answer, LINE, command::LineBuffer, line::Line};
use proptest::prelude::*;
use std::collections::VecDeque;

/// The console.
#[derive(Debug)]
pub(super) struct Console {
    line: LineBuffer,
    answer: Answer,
    /// Bytes on the line, and the lines that they make.
    typed: VecDeque<u8>,
    lines: VecDeque<String>,
}

impl Console {
    pub(super) fn new() -> Self {
        Self { line: LineBuffer::new(), answer: Answer::Greeting, typed: VecDeque::new(), lines: VecDeque::new() }
    }

    /// Sends one or several lines.
    pub(super) fn put(&mut self, text: &str, lines: &[String]) {
        self.typed.extend(text.bytes().chain(*b"\n"));
        self.lines.extend(lines.iter().cloned());
    }

    /// Runs a received line, if there is one.
    pub(super) fn carry_out(&mut self, machine: &mut Weeder) -> Option<String> {
        while self.answer.is_done()
            && let Some(byte) = self.typed.pop_front()
        {
            if let Some(command) = self.line.take(byte) {
                self.answer = say::execute(command, machine);
                return Some(self.lines.pop_front().unwrap_or_default());
            }
        }
        None
    }

    /// Sends as much as there is room for.
    pub(super) fn write(&mut self, machine: &mut Weeder) -> Result<String, TestCaseError> {
        let mut line = Line::new();
        if !machine.carry_on() {
        } else if !self.answer.is_done() {
            self.answer.write_line(machine, &mut line);
        } else if let Some(event) = machine.next_event() {
            say::write_event(&event, &mut line);
        } else if let Some(plot) = machine.next_plot() {
            say::write_plot(machine, plot, &mut line);
        }
        let written: String = line.map(char::from).collect();
        prop_assert!(written.len() <= LINE, "the line {written:?} is too long");
        Ok(written)
    }

    /// Whether all lines are answered.
    pub(super) fn is_done(&self) -> bool {
        self.typed.is_empty() && self.answer.is_done()
    }
}
