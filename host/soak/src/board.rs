//! The firmware in the virtual Uno as a machine for model-based runs. The run drives its pins, and observes the servo's
//! pulse and the console.
//!
//! The settings in use follow from acknowledged commands. Values that only the firmware knows, such as measured times
//! of its servo, make them uncertain until `get` is typed. Saved data is read from the EEPROM, and compared with the
//! output of the restarted firmware.

use control::alarm::Alarm;
use control::ground::class::Listed;
use control::measure::reset::Cause;
use control::memory::SIZE;
use control::operate::state::State;
use control::say::command::Action;
use control::settings::{Setting, Settings};
use field::machine::{channels, encoder_edge};
use field::wiring;
use link::Values;
use logbook::follower::InUse;
use model_test::Failure;
use model_test::decisions::field_examples;
use model_test::drive::is_end;
use model_test::machine::{Attended, Checked, Machine, World};
use model_test::run::Beginning;
use std::collections::VecDeque;
use std::path::{Path, PathBuf};
use uno::{CYCLES_PER_SECOND, Pin, PinChange, Uno};
use uno_run::console::ask;

const CYCLES_A_US: u64 = CYCLES_PER_SECOND / 1_000_000;

/// Longest time from a reset to the greeting: a loop that stalls is reset after a quarter of a second.
const GREETING_CYCLES: u64 = CYCLES_PER_SECOND;

/// Least distance of simultaneous changes on the pins, as by dust in the beam: 10 us.
const APART_CYCLES: u64 = 160;

/// Tolerance of a pulse's width against its setting.
const SAME_US: f64 = 1.5;

/// Free bytes of stack that are an alarm.
const LOW_STACK: u16 = 40;

/// Ticks that a disturbance of both channels may add: two at its start, and two at its end.
const SPIKE_TICKS: i64 = 4;

/// The servo's line, observed on D9.
#[derive(Debug, Default)]
struct ServoLine {
    rise: Option<u64>,
    /// The last pulse's width.
    width_us: f64,
}

impl ServoLine {
    fn take(&mut self, changes: &[PinChange]) {
        for change in changes.iter().filter(|change| change.pin == wiring::SERVO) {
            if change.high {
                self.rise = Some(change.cycle);
            } else if let Some(rise) = self.rise.take() {
                self.width_us = (change.cycle - rise) as f64 / CYCLES_A_US as f64;
            }
        }
    }

    fn is(&self, width_us: u16) -> bool {
        (self.width_us - f64::from(width_us)).abs() < SAME_US
    }
}

/// The machine, see the module's words.
pub struct Board {
    elf: PathBuf,
    uno: Uno,
    /// Levels of this turn, and whether each is the encoder's; those keep their order in time.
    to_come: Vec<(Vec<(Pin, bool)>, bool)>,
    /// The encoder's count.
    ticks: i64,
    /// The world's count at which the firmware's was 0.
    zero: i64,
    servo: ServoLine,
    /// Typed lines without an answer, and the line that is being answered.
    typed: VecDeque<String>,
    current: Option<String>,
    /// Received text: whole lines and the beginning of the next.
    heard: String,
    in_use: InUse,
    /// Whether the firmware is timing its servo. It may then change its leads.
    times_the_servo: bool,
    state: State,
    unseen_mm: i16,
    /// The time since which the machine is not at work, by its own report.
    rests_since: Option<u64>,
    resets: usize,
    stack_was_low: bool,
}

impl Board {
    /// Powers up an Uno with the firmware at `elf`, and starts clock and count as `beginning` has them.
    ///
    /// # Errors
    /// If the firmware cannot be read, or does not start.
    pub fn boot(elf: &Path, beginning: &Beginning, world: &World) -> Result<Self, Failure> {
        let mut uno = Uno::boot(elf)?;
        beams(world).into_iter().for_each(|(pin, high)| uno.set(pin, high));
        uno.run_until_symbol("main", GREETING_CYCLES)?;
        let (count, overflows) = (beginning.count.to_le_bytes(), (beginning.steps >> 8).to_le_bytes());
        uno.write("weeder_firmware::encoder::COUNT_LOW", &count[..2])?;
        uno.write("weeder_firmware::encoder::COUNT_HIGH", &count[2..])?;
        uno.write("weeder_firmware::clock::OVERFLOWS_LOW", &overflows[..1])?;
        uno.write("weeder_firmware::clock::OVERFLOWS_HIGH", &overflows[1..3])?;
        let mut board = Self {
            elf: elf.to_owned(),
            uno,
            to_come: Vec::new(),
            ticks: 0,
            zero: 0,
            servo: ServoLine::default(),
            typed: VecDeque::new(),
            current: None,
            heard: String::new(),
            in_use: InUse::factory(),
            times_the_servo: false,
            state: State::Hold,
            unseen_mm: 0,
            rests_since: None,
            resets: 0,
            stack_was_low: false,
        };
        board.init()?;
        Ok(board)
    }

    fn init(&mut self) -> Result<String, Failure> {
        let greeting = self.uno.run_until_serial("commands\r\n", GREETING_CYCLES)?;
        let state = greeting.rsplit_once(", state ").and_then(|(_, rest)| rest.split(',').next());
        self.state = match state.and_then(|state| state.split(' ').next_back()) {
            Some("hold") => State::Hold,
            Some(word) => self.alarm(word)?,
            None => return Err(Failure::fail(format!("no state in {greeting:?}"))),
        };
        (self.resets, self.stack_was_low) = (self.uno.resets().len(), false);
        (self.times_the_servo, self.rests_since) = (false, Some(self.uno.cycle()));
        Ok(greeting)
    }

    fn alarm(&self, word: &str) -> Result<State, Failure> {
        let alarm = Alarm::find(word.as_bytes());
        alarm.map(State::Alarm).ok_or_else(|| Failure::fail(format!("no alarm is called {word:?}")))
    }

    /// Takes the reported state and settings.
    fn hear(&mut self, line: &str) -> Checked {
        if line.starts_with("state=") {
            let values = Values(line);
            self.state = match values.text("state") {
                Some("hold") => State::Hold,
                Some("work") => State::Work,
                _ => self.alarm(values.text("name").unwrap_or_default())?,
            };
            self.unseen_mm = values.number("unseen_mm").unwrap_or_default();
            let rests = self.state != State::Work;
            self.rests_since = rests.then(|| self.rests_since.unwrap_or(self.uno.cycle()));
            self.times_the_servo &= self.state == State::Hold;
        } else if line.contains("calibrated") {
            self.times_the_servo = false;
            self.in_use.forget();
        } else {
            // A value out of range would differ later, and be found.
            self.in_use.show(line);
        }
        Ok(())
    }

    /// The line that was begun was answered.
    fn end(&mut self, line: &str, is_ok: bool) {
        let (true, Ok(command)) = (is_ok, link::command(line)) else { return };
        self.in_use.carry_out(&command);
        match command.action {
            Action::Set | Action::GetAll => self.begin_rest(),
            Action::Defaults | Action::Revert => self.in_use.forget(),
            Action::CalibrateServo => self.times_the_servo = true,
            Action::Hold | Action::Start | Action::StartNow | Action::Servo | Action::ServoIn | Action::ServoOut => {
                self.end_of_timing();
                // The tool has yet to come back from a manual move.
                self.begin_rest();
            }
            Action::TestRow => self.end_of_timing(),
            _ => {}
        }
    }

    /// The firmware may have measured its servo by now.
    fn end_of_timing(&mut self) {
        if std::mem::take(&mut self.times_the_servo) {
            self.in_use.forget();
        }
    }

    /// The servo's pulse gets some time again until it must be right.
    fn begin_rest(&mut self) {
        self.rests_since = self.rests_since.map(|_| self.uno.cycle());
    }

    /// Drives the turn's levels on the pins, spread over the turn.
    fn drive(&mut self, cycles: u64) {
        let begin = self.uno.cycle();
        let ticks = self.to_come.iter().filter(|(_, is_tick)| *is_tick).count() as u64;
        let (mut cycle, mut tick) = (begin, 0);
        let mut changes = Vec::new();
        for (levels, is_tick) in self.to_come.drain(..) {
            tick += u64::from(is_tick);
            cycle = (cycle + APART_CYCLES).max(if is_tick { begin + tick * cycles / (ticks + 1) } else { 0 });
            changes.extend(levels.into_iter().map(|(pin, high)| PinChange { cycle, pin, high }));
        }
        self.uno.drive(changes);
    }

    /// The number of taught examples that the firmware reports.
    fn listed_examples(&mut self) -> Result<usize, Failure> {
        let lines = ask(&mut self.uno, "examples")?;
        Ok(lines.iter().filter(|line| line.starts_with("field ")).count())
    }
}

/// The levels of the beams' lines.
fn beams(world: &World) -> [(Pin, bool); 2] {
    [(wiring::BEAM, !world.broken), (wiring::SECOND_BEAM, !world.second_broken)]
}

impl Machine for Board {
    const IS_OPEN: bool = false;
    /// The widest weed of the built-in examples, with a tolerance.
    const NARROW_MM: u16 = 45;
    /// A frame of the servo, a pulse that is known at its end, and a turn.
    const LATENESS_US: u64 = 26_000;

    fn count(&mut self, up: bool) {
        let before = self.ticks;
        self.ticks += if up { 1 } else { -1 };
        let PinChange { pin, high, .. } = encoder_edge(0, before, self.ticks);
        self.to_come.push((vec![(pin, high)], true));
    }

    fn spike(&mut self, _: &mut World, _: i32) -> i64 {
        let (a, b) = channels(self.ticks);
        self.to_come.push((vec![(wiring::ENCODER_A, !a), (wiring::ENCODER_B, !b)], false));
        self.to_come.push((vec![(wiring::ENCODER_A, a), (wiring::ENCODER_B, b)], false));
        SPIKE_TICKS
    }

    fn beam_edge(&mut self, world: &World) {
        self.to_come.push((beams(world).to_vec(), false));
    }

    fn own_count(&self, count: i64) -> i32 {
        (count - self.zero) as i32
    }

    fn turn(&mut self, before: &World, now: &World) -> Result<i64, Failure> {
        // All of it by name, so that the compiler finds a sensor without a pin. Encoder and beams have come edge by edge.
        let &World { time_us, count, switch_on, end_switch_on, stack_is_low, jumps: _, broken: _, second_broken: _ } =
            now;
        let cycles = (time_us - before.time_us) * CYCLES_A_US;
        let until = self.uno.cycle() + cycles;
        self.uno.set(wiring::WORK_SWITCH, !switch_on);
        self.uno.set(wiring::END_SWITCH, !end_switch_on);
        if switch_on {
            self.rests_since = None;
        }
        if stack_is_low && !self.stack_was_low {
            let corrupted = self.uno.first_stack_address() + LOW_STACK;
            self.uno.write_sram(corrupted, &[0])?;
            self.stack_was_low = true;
        }
        self.drive(cycles);
        self.uno.run_until(until)?;
        self.servo.take(&self.uno.take_changes());
        self.heard += &self.uno.received();
        if self.uno.resets().len() > self.resets {
            return Err(Failure::fail(format!("it was reset: {:?}", self.uno.resets().last())));
        }
        Ok(count)
    }

    fn check_pulse(&self, is_tried: bool) -> Checked {
        let rests = self.rests_since.is_some_and(|since| since + Self::LATENESS_US * CYCLES_A_US < self.uno.cycle());
        if is_tried || !rests || self.is_sent_out() {
            return Ok(());
        }
        Err(Failure::fail(format!("in {:?} the servo has a pulse of {} us", self.state, self.servo.width_us)))
    }

    fn settings(&self) -> &Settings {
        self.in_use.settings()
    }

    fn settings_are_in_doubt(&self) -> bool {
        !self.in_use.is_known() || self.times_the_servo
    }

    fn state(&self) -> State {
        self.state
    }

    fn unseen_mm(&self) -> i16 {
        self.unseen_mm
    }

    fn tool_out(&self) -> bool {
        self.is_sent_out() || !self.servo.is(self.in_use.settings().get(Setting::ServoInUs))
    }

    fn is_sent_out(&self) -> bool {
        self.servo.is(self.in_use.settings().get(Setting::ServoOutUs))
    }

    fn put(&mut self, text: &str, lines: &[String]) {
        self.uno.send(format!("{text}\n").as_bytes());
        self.typed.extend(lines.iter().cloned());
    }

    fn attend(&mut self) -> Result<Attended, Failure> {
        let mut attended = Attended::default();
        if self.current.is_none() {
            self.current = self.typed.pop_front();
            attended.begun = self.current.clone();
            match self.current.as_deref().and_then(|line| line.split([' ', '\t']).next()) {
                Some("start" | "servo" | "calibrate" | "test") => self.rests_since = None,
                // The pulse for out may change, now or soon.
                Some("set" | "defaults" | "revert") => self.begin_rest(),
                _ => {}
            }
        }
        // One line end at a time: the next line begins after it.
        while let Some((line, rest)) = self.heard.split_once('\n') {
            let (line, rest) = (line.trim_end().to_owned(), rest.to_owned());
            self.heard = rest;
            self.hear(&line)?;
            let ends = is_end(&line);
            attended.written.push(line);
            if ends {
                let Some(begun) = self.current.take() else {
                    return Err(Failure::fail(format!("{:?} answers nothing", attended.written.last())));
                };
                self.end(&begun, attended.written.last().is_some_and(|line| line == "ok"));
                break;
            }
        }
        Ok(attended)
    }

    fn is_done(&self) -> bool {
        let is_said = self.uno.bytes_pending() == 0 && self.typed.is_empty();
        is_said && self.current.is_none() && !self.heard.contains('\n')
    }

    fn examples(&self) -> Vec<Listed> {
        let mut bytes = [0; SIZE];
        bytes.copy_from_slice(&self.uno.eeprom()[SIZE..]);
        field_examples(bytes)
    }

    fn spoil(&mut self, address: usize, byte: u8) -> Checked {
        let mut eeprom = self.uno.eeprom();
        eeprom[address] = byte;
        self.uno = Uno::boot_with_eeprom(&self.elf, &eeprom)?;
        let (a, b) = channels(self.ticks);
        self.uno.set(wiring::ENCODER_A, a);
        self.uno.set(wiring::ENCODER_B, b);
        Ok(())
    }

    fn reset(&mut self, cause: Cause, torn: Option<u8>, world: &World) -> Checked {
        beams(world).into_iter().for_each(|(pin, high)| self.uno.set(pin, high));
        // A line on its way would otherwise reach the restarted machine.
        while self.uno.bytes_pending() > 0 {
            self.uno.run_for_ms(1)?;
        }
        let mut cause = cause;
        match cause {
            Cause::LoopStalled => {
                self.uno.stall()?;
                // In a critical section the heartbeat's interrupt is not served, and leaves no mark.
                if !self.uno.interrupts_are_enabled() {
                    cause = Cause::Watchdog;
                }
            }
            Cause::BrownOut => self.uno.brown_out(),
            Cause::ResetPin => self.uno.reset(),
            _ => match torn {
                Some(byte) => self.uno.power_cycle_to_noise(byte.into()),
                None => self.uno.power_cycle(),
            },
        }
        self.uno.received();
        self.zero = world.count;
        let greeting = self.init()?;
        let text: String = cause.text().bytes().map(char::from).collect();
        if !greeting.contains(&format!("reset by {text},")) {
            return Err(Failure::fail(format!("reset by {text}, and it says {greeting:?}")));
        }
        (self.current, self.heard) = (None, greeting);
        self.typed.clear();
        self.uno.take_changes();
        self.servo = ServoLine::default();
        for line in ask(&mut self.uno, "get")? {
            self.hear(&line)?;
        }
        let (told, kept) = (self.listed_examples()?, self.examples().len());
        if told != kept {
            return Err(Failure::fail(format!("it tells {told} examples, and {kept} are kept")));
        }
        self.servo.take(&self.uno.take_changes());
        if !self.is_sent_out() {
            return Err(Failure::fail(format!("it wakes up with a pulse of {} us", self.servo.width_us)));
        }
        Ok(())
    }
}
