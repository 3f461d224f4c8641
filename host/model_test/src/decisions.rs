//! The decisions as a machine under test: the controller with its console and an EEPROM, without a chip.

mod eeprom;

use crate::{
    machine::{Attended, Checked, Machine, World},
    run::{Beginning, Classification},
};
use control::{
    ground::{
        class::{Class, Classifier, ExamplesFull, Listed, Vote},
        examples::EXAMPLES,
        features::Features,
        nearest::Nearest,
    },
    measure::{quadrature::Odometer, readings::Readings, reset::Cause},
    memory::{SIZE, Volatile},
    operate::{servo, state::State, tool::Reason},
    say::{Console, LINE, command::LineBuffer},
    settings::{Setting, Settings},
    units::{Instant, Interval, Position},
    weeder::Orders,
};
pub use eeprom::CHIP_SIZE;
use eeprom::{Eeprom, Half};
use knn::Example;
use proptest::prelude::*;
use rig::{Beams, ByExamples, Rig};
use std::{cell::Cell, collections::VecDeque};

/// Detections below this width are weeds, where width alone decides.
const PLANT_MM: i16 = 60;

/// Hold minus width, in millimetres.
const MARGINS_MM: i16 = 100;

/// Classifies by width or by the firmware's examples, stores examples as the firmware does, and reports weeds.
#[derive(Debug)]
struct Observed {
    nearest: ByExamples<Half>,
    by: Classification,
    /// The width of the detection that is being classified, in millimetres.
    width_mm: i16,
    /// The width of the weed classified just now.
    weed: Cell<Option<i16>>,
}

impl Observed {
    fn observed(&self, vote: Option<Vote>) -> Option<Vote> {
        if vote.is_some_and(|vote| vote.class == Class::Weed) {
            self.weed.set(Some(self.width_mm));
        }
        vote
    }
}

impl Classifier for Observed {
    fn classify(&self, features: &Features, _: u8) -> Vote {
        let class = if features.hold_mm() - MARGINS_MM < PLANT_MM { Class::Weed } else { Class::Plant };
        Vote { class, votes: 1 }
    }

    fn begin(&mut self, features: &Features, k: u8) -> Option<Vote> {
        self.width_mm = features.hold_mm() - MARGINS_MM;
        let vote = match self.by {
            Classification::Examples => self.nearest.begin(features, k),
            Classification::Width => Some(self.classify(features, k)),
        };
        self.observed(vote)
    }

    fn go_on(&mut self) -> Option<Vote> {
        let vote = self.nearest.go_on();
        self.observed(vote)
    }

    fn built_in_class(&mut self, features: &Features) -> Class {
        match self.by {
            Classification::Examples => self.nearest.built_in_class(features),
            Classification::Width => Class::Unknown,
        }
    }

    fn teach(&mut self, features: &Features, label: u8) -> Result<(), ExamplesFull> {
        self.nearest.teach(features, label)
    }

    fn keep(&mut self, example: Example<5>) -> Result<(), ExamplesFull> {
        self.nearest.keep(example)
    }

    fn forget(&mut self, number: u8) -> bool {
        self.nearest.forget(number)
    }

    fn forget_all(&mut self) {
        self.nearest.forget_all();
    }

    fn listed(&self, place: u8) -> Option<(Listed, u8)> {
        self.nearest.listed(place)
    }

    fn spoiled(&self) -> u8 {
        self.nearest.spoiled()
    }

    fn carry_on(&mut self) -> bool {
        self.nearest.carry_on()
    }
}

type Weeder = Rig<Observed, Half>;

/// The machine under test.
#[derive(Debug)]
pub struct Decisions {
    odometer: Odometer,
    weeder: Weeder,
    orders: Orders,
    console: Console,
    line: LineBuffer,
    /// Typed bytes, and the lines that they make.
    typed: VecDeque<u8>,
    lines: VecDeque<String>,
    eeprom: Eeprom,
    beginning: Beginning,
}

/// Returns the readings in a world. It names every field of both, so that the compiler finds a missing sensor.
fn shown(steps: u32, world: &World) -> (Readings, Beams) {
    let &World { time_us, count, jumps, broken, second_broken, switch_on, end_switch_on, stack_is_low } = world;
    let readings = Readings {
        now: Instant::new(steps) + Interval::from_steps((time_us / 4) as u32),
        position: Position::new(count as i32),
        switch_on,
        lost: 0,
        jumps,
        end_switch_on,
        stack_free: if stack_is_low { 40 } else { 300 },
    };
    (readings, Beams { broken, second_broken })
}

/// The unwrapped count nearest to `count` for a position.
fn unwrapped(count: i64, position: Position) -> i64 {
    count + i64::from((position - Position::new(count as i32)).0)
}

impl Decisions {
    /// A new machine. It always starts.
    ///
    /// # Errors
    /// None; a [`Drive`](crate::drive::Drive) starts every machine in this way.
    pub fn boot(beginning: &Beginning, world: &World) -> Result<Self, TestCaseError> {
        Ok(Self::start(Eeprom::new(), beginning.clone(), world, Cause::PowerOn))
    }

    fn start(eeprom: Eeprom, beginning: Beginning, world: &World, cause: Cause) -> Self {
        let [for_settings, for_examples] = eeprom.halves();
        let nearest = Nearest::new(&EXAMPLES[..], for_examples);
        let classifier = Observed { nearest, by: beginning.classification, width_mm: 0, weed: Cell::new(None) };
        let (readings, beams) = shown(beginning.steps, world);
        let weeder = Rig::wake_at(classifier, for_settings, readings, beams, cause);
        Self {
            odometer: Odometer::new(weeder.readings.position, world.jumps),
            orders: weeder.orders(),
            weeder,
            console: Console::new(),
            line: LineBuffer::new(),
            typed: VecDeque::new(),
            lines: VecDeque::new(),
            eeprom,
            beginning,
        }
    }
}

impl Machine for Decisions {
    const IS_OPEN: bool = true;
    const NARROW_MM: u16 = 0;
    const LATENESS_US: u64 = 0;

    fn count(&mut self, _: bool) {}

    fn spike(&mut self, world: &mut World, ticks: i32) -> i64 {
        world.count += i64::from(ticks);
        world.jumps = world.jumps.wrapping_add(1);
        0
    }

    fn beam_edge(&mut self, world: &World) {
        let (readings, beams) = shown(self.beginning.steps, world);
        self.weeder.edge(readings.position, beams);
    }

    fn lose_edges(&mut self, world: &World) -> Checked {
        self.weeder.lose_edges(shown(self.beginning.steps, world).1);
        Ok(())
    }

    fn place(&self, count: i64) -> i64 {
        unwrapped(count, self.odometer.place(Position::new(count as i32)))
    }

    fn own_count(&self, count: i64) -> i32 {
        count as i32
    }

    fn turn(&mut self, before: &World, now: &World) -> Result<i64, TestCaseError> {
        let (readings, _) = shown(self.beginning.steps, if self.beginning.reads_first { before } else { now });
        self.odometer.read(readings.position, readings.jumps, self.weeder.believes_jumps());
        let place = unwrapped(now.count, self.odometer.place(readings.position));
        self.orders = self.weeder.turn_with(readings);
        Ok(place)
    }

    fn check_pulse(&self, is_tried: bool) -> Checked {
        let pulse_of = |setting| servo::from_us(self.weeder.settings().get(setting));
        let (inside, outside) = (pulse_of(Setting::ServoInUs), pulse_of(Setting::ServoOutUs));
        let Orders { pulse, pulse_out, .. } = self.orders;
        prop_assert_eq!(pulse_out, outside);
        if !self.weeder.has_heartbeat() {
            prop_assert!(
                pulse == outside && self.weeder.state() == State::Hold,
                "a pulse of {pulse} during the watchdog test"
            );
        }
        let (state, out) = (self.weeder.state(), self.weeder.tool_out());
        if state == State::Work {
            prop_assert_eq!(pulse, if out { outside } else { inside });
        } else if matches!(state, State::Alarm(_)) || !is_tried {
            prop_assert!(out && pulse == outside, "the tool is in the row in {state:?}");
        }
        Ok(())
    }

    fn take_weed(&mut self) -> Option<i16> {
        self.weeder.classifier().weed.take()
    }

    fn settings(&self) -> &Settings {
        self.weeder.settings()
    }

    fn settings_are_in_doubt(&self) -> bool {
        false
    }

    fn state(&self) -> State {
        self.weeder.state()
    }

    fn has_heartbeat(&self) -> bool {
        self.weeder.has_heartbeat()
    }

    fn reason(&self) -> Option<Reason> {
        self.weeder.reason()
    }

    fn unseen_mm(&self) -> i16 {
        self.weeder.unseen_mm()
    }

    fn tool_out(&self) -> bool {
        self.weeder.tool_out()
    }

    fn is_sent_out(&self) -> bool {
        self.orders.pulse == self.orders.pulse_out
    }

    fn put(&mut self, text: &str, lines: &[String]) {
        self.typed.extend(text.bytes().chain(*b"\n"));
        self.lines.extend(lines.iter().cloned());
    }

    fn attend(&mut self) -> Result<Attended, TestCaseError> {
        let mut begun = None;
        // The console runs a line at once if no byte is left to save.
        if !self.typed.is_empty() && self.console.listens() && self.weeder.carry_on() {
            while self.console.listens()
                && let Some(byte) = self.typed.pop_front()
            {
                if self.line.collect(byte) && self.console.take(&mut self.line, &mut self.weeder) {
                    begun = self.lines.pop_front();
                }
            }
        }
        self.console.carry_on(&mut self.weeder);
        let written: String = std::iter::from_fn(|| self.console.next_byte()).map(char::from).collect();
        prop_assert!(written.len() <= LINE, "the line {written:?} is too long");
        Ok(Attended { begun, written: written.lines().map(|line| line.trim_end().to_owned()).collect() })
    }

    fn is_done(&self) -> bool {
        self.typed.is_empty() && self.console.listens()
    }

    fn examples(&self) -> Vec<Listed> {
        field_examples(self.eeprom.examples())
    }

    fn spoil(&mut self, address: usize, byte: u8) -> Checked {
        self.eeprom.spoil(address, byte);
        Ok(())
    }

    fn reset(&mut self, cause: Cause, torn: Option<u8>, world: &World) -> Checked {
        self.eeprom.reset(torn);
        *self = Self::start(self.eeprom.clone(), self.beginning.clone(), world, cause);
        prop_assert!(self.weeder.tool_out() && self.is_sent_out());
        Ok(())
    }
}

/// The field examples in the examples' half of an EEPROM.
pub fn field_examples(bytes: [u8; SIZE]) -> Vec<Listed> {
    let classifier = Nearest::new(&EXAMPLES[..], Volatile::holding(bytes));
    let all = std::iter::successors(classifier.listed(0), |&(_, next)| classifier.listed(next));
    all.map(|(listed, _)| listed).filter(|listed| listed.from_field).collect()
}
