//! The decisions compiled for the host, with the sensors that they read: the machine that simulations, replays and tests drive.
//!
//! A [`Rig`] stands where `src/main.rs` stands on the chip. It holds what the sensors show, passes it to the [`Controller`], and has the
//! controller's methods. Its driver says how the machine rolls, what breaks the beams, and how long a turn of the loop takes. All other
//! [`Readings`] stay as they are until the driver changes them, so a driver names only the sensors that it simulates.
//!
//! The decisions take an edge of a beam as it comes, and the other sensors once a turn.

mod scripted_port;

pub use self::scripted_port::{ScriptedBoard, ScriptedPort};

use control::ground::{class::Classifier, features, nearest::Nearest};
use control::measure::readings::{Edge, Readings, Startup};
use control::measure::reset::Cause;
use control::memory::{Memory, SIZE, Volatile};
use control::operate::event::Event;
use control::say::command::{Argument, LineBuffer, Word, parse};
use control::say::{self, LINE, line::Line};
use control::settings::{Setting, Settings};
use control::units::{Instant, Interval, Position};
use control::weeder::{Controller, Orders};
use std::ops::{Deref, DerefMut};

/// The firmware's classifier, with built-in examples and a memory for field examples.
pub type ByExamples<M = Volatile> = Nearest<&'static [knn::Example<{ features::COUNT }>], M>;

/// The factory settings with these changes.
///
/// # Panics
/// If a value is out of its range.
pub fn settings(changes: &[(Setting, u16)]) -> Settings {
    let mut settings = Settings::new();
    for &(setting, value) in changes {
        settings.set(setting, value).expect("it is within its range");
    }
    settings
}

/// Every line that the console's grammar takes, with a setting and with numbers.
pub fn every_command() -> Vec<String> {
    let arguments = (0..).map_while(Argument::from_index).map(|argument| argument.text().to_string());
    let follow: Vec<_> = arguments.chain(["1", "1000", "k"].map(str::to_owned)).collect();
    let with_another = |line: &String| follow.iter().map(|word| format!("{line} {word}")).collect::<Vec<_>>();
    let words: Vec<_> = (0..).map_while(Word::from_index).map(|word| word.text().to_string()).collect();
    let twos: Vec<_> = words.iter().flat_map(with_another).collect();
    let threes: Vec<_> = twos.iter().flat_map(with_another).collect();
    let lines = words.into_iter().chain(twos).chain(threes);
    lines.filter(|line| parse(line.as_bytes()).is_ok()).collect()
}

/// Which of the beams are broken.
#[derive(Clone, Copy, Debug, Default, PartialEq, Eq)]
pub struct Beams {
    /// The first.
    pub broken: bool,
    /// The second beam; false if there is none.
    pub second_broken: bool,
}

impl Beams {
    /// Those of a machine with one beam.
    pub const fn one(broken: bool) -> Self {
        Self { broken, second_broken: false }
    }
}

/// A machine to drive, see the module's words.
#[derive(Clone, Debug)]
pub struct Rig<C, M = Volatile> {
    controller: Controller<C, M>,
    /// The readings for the next turn.
    pub readings: Readings,
    beams: Beams,
    /// Whether the controller knows the second beam's level.
    watches_second: bool,
    line: LineBuffer,
}

impl<C: Classifier> Rig<C> {
    /// A new board in HOLD, at time and count 0. The operator has cleared the alarm about its settings.
    pub fn new(classifier: C) -> Self {
        let mut rig = Self::wake(classifier, Volatile::new(), Cause::PowerOn);
        rig.clear();
        rig
    }
}

impl<C: Classifier, M: Memory> Rig<C, M> {
    /// Wakes up at time and count 0, with all sensors at rest.
    pub fn wake(classifier: C, memory: M, cause: Cause) -> Self {
        Self::wake_at(classifier, memory, Readings::new(Instant::ZERO, Position::new(0)), Beams::default(), cause)
    }

    /// Wakes up with sensors that show this.
    pub fn wake_at(classifier: C, memory: M, readings: Readings, beams: Beams, cause: Cause) -> Self {
        Self::wake_from(classifier, memory, readings, beams, cause, false)
    }

    /// The same, after a reset of a machine that was at work, or not.
    pub fn wake_from(
        classifier: C,
        memory: M,
        readings: Readings,
        beams: Beams,
        cause: Cause,
        was_working: bool,
    ) -> Self {
        let startup = Startup { readings, beam_broken: beams.broken, cause, was_working };
        let controller = Controller::new(classifier, memory, startup);
        Self { controller, readings, beams, watches_second: false, line: LineBuffer::new() }
    }

    /// The encoder counts to `count`.
    pub fn at(&mut self, count: i32) -> &mut Self {
        self.readings.position = Position::new(count);
        self
    }

    /// The beams' levels.
    pub fn beams(&self) -> Beams {
        self.beams
    }

    /// The beams show this from the present count on.
    pub fn see(&mut self, beams: Beams) {
        if beams != self.beams {
            self.edge(self.readings.position, beams);
        }
    }

    /// An edge comes from a beam.
    #[inline(always)]
    pub fn edge(&mut self, position: Position, beams: Beams) {
        self.beams = beams;
        let Beams { broken, second_broken } = beams;
        self.controller.take_edge(Edge::Seen { position, broken, second_broken });
    }

    /// Edges found no room to wait in.
    pub fn lose_edges(&mut self, beams: Beams) {
        self.beams = beams;
        let Beams { broken, second_broken } = beams;
        self.controller.take_edge(Edge::Lost { broken, second_broken });
    }

    /// A turn of the loop.
    pub fn turn(&mut self) -> Orders {
        self.turn_with(self.readings)
    }

    /// Sets the readings and runs a turn. Faster than [`turn`](Self::turn): it reads nothing back.
    #[inline(always)]
    pub fn turn_with(&mut self, readings: Readings) -> Orders {
        self.readings = readings;
        *self.controller.next_readings() = readings;
        let has_second = self.controller.has_second_beam();
        if has_second && !self.watches_second {
            self.edge(readings.position, self.beams);
        }
        self.watches_second = has_second;
        let orders = self.controller.step();
        self.controller.catch_up();
        orders
    }

    /// A turn of the loop after `microseconds`.
    pub fn turn_after(&mut self, microseconds: u32) -> Orders {
        self.readings.now = self.readings.now + Interval::from_steps(microseconds / 4);
        self.turn()
    }

    /// Stands for some milliseconds, with a turn in each.
    pub fn stand(&mut self, milliseconds: u32) -> Orders {
        (0..milliseconds).map(|_| self.turn_after(1000)).last().unwrap_or_else(|| self.orders())
    }

    /// Types a line. Returns the lines of the answer: the last is `ok`, or begins with `error: `.
    pub fn ask(&mut self, line: &str) -> Vec<String> {
        self.type_in(line.bytes().chain(*b"\n"))
    }

    /// Types bytes; the lines of the answers.
    ///
    /// # Panics
    /// If a line of an answer does not end, or is too long for the chip's buffer.
    pub fn type_in(&mut self, bytes: impl IntoIterator<Item = u8>) -> Vec<String> {
        let mut said = Vec::new();
        for byte in bytes {
            let Some(typed) = self.line.take(byte) else { continue };
            let mut answer = say::answer_to(typed.as_ref().map_err(|&error| error), &mut self.controller);
            self.write_all();
            while !answer.is_done() {
                let mut line = Line::new();
                answer.write_line(&self.controller, &mut line);
                let line: String = line.map(char::from).collect();
                let text = line.strip_suffix("\r\n").filter(|_| line.len() <= LINE);
                said.push(text.unwrap_or_else(|| panic!("not a line: {line:?}")).to_owned());
            }
        }
        said
    }

    /// Writes what is to be saved, as the loop does before it answers. Gives up if the memory takes no byte.
    pub fn write_all(&mut self) {
        (0..4 * SIZE).any(|_| self.controller.carry_on());
    }

    /// Takes the waiting events.
    pub fn events(&mut self) -> Vec<Event> {
        std::iter::from_fn(|| self.next_event()).collect()
    }
}

impl<C, M> Deref for Rig<C, M> {
    type Target = Controller<C, M>;

    #[inline]
    fn deref(&self) -> &Self::Target {
        &self.controller
    }
}

impl<C, M> DerefMut for Rig<C, M> {
    #[inline]
    fn deref_mut(&mut self) -> &mut Self::Target {
        &mut self.controller
    }
}
