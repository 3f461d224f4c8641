//! The live virtual Uno: it runs in real time, at a pseudo terminal that any serial program opens. A simulated machine
//! rolls along a row again and again.
//!
//! [`rows`] powers up one Uno, or several that share one encoder, and runs them. Each millisecond of the chip's time an
//! Uno exchanges bytes with its terminal, and then waits for the PC's clock. A slow PC makes the chip slower, but does
//! not change the time between two of its events.
//!
//! - **Reset.** A program that opens the port of a real Uno resets it through the modem line DTR. A pseudo terminal has
//!   no such line. So the opening itself resets the Uno, unless [`Setup::keeps_running_when_opened`] is set. A
//!   bootloader then waits a second or two for new firmware, as on a real board.
//! - **Baud rate.** The chip sends and receives at the pace of its UBRR. The terminal carries bytes at any rate, so a
//!   wrong rate in a program has no effect. Unread bytes are lost when the next program opens the port.
//! - **The machine.** It stands, accelerates before the row, rolls past it and brakes behind it. After a few seconds it
//!   repeats this, forward, with the same row ahead. Or it stands until a person asks for a [`Run`]. The tool follows the firmware, and does not change the row.
//! - **The end switch.** It closes while the arm is fully out. The machine's servo turns the arm by the pulses on its
//!   line.
//! - **The receiver.** A satellite receiver on the machine has its own pseudo terminal.
//! - **EEPROM.** It is read from a file at the start, if there is one, and written to it after each change.

use anyhow::{Context, Result, bail};
use field::machine::{Machine, cycle_at, time_at_s};
use field::motion::Motion;
use field::row::Row;
use field::servo::{Servo, Stroke};
use field::wiring;
use files::bounded_file;
use std::collections::VecDeque;
use std::fs::{File, OpenOptions, TryLockError};
use std::ops::Range;
use std::path::{Path, PathBuf};
use std::sync::mpsc;
use uno::Uno;
use uno::bootloader::Bootloader;
use uno::memory::EEPROM_BYTES;
use uno::pty::Pty;
use uno::{CYCLES_PER_SECOND, PinChange, Pulse};

pub mod rows;

/// The bytes that a device on the machine sends until a time, in seconds since the Uno was powered up. Its second
/// argument returns the metres travelled at a time.
pub type Sender = Box<dyn FnMut(f64, &dyn Fn(f64) -> f64) -> Vec<u8> + Send>;

/// The parts of the simulated set-up.
#[derive(Default)]
pub struct Setup {
    /// The firmware's ELF. Without one, and with a bootloader, the rest of the flash is erased.
    pub elf: Option<PathBuf>,
    /// The bootloader; without one, a reset starts the firmware.
    pub bootloader: Option<Bootloader>,
    /// The file with the EEPROM's content. Without one the EEPROM starts erased and is not saved.
    pub eeprom: Option<PathBuf>,
    /// Path of a symbolic link to the pseudo terminal.
    pub link: Option<PathBuf>,
    /// The satellite receiver on the machine, and the path of a symbolic link to its pseudo terminal.
    pub receiver: Option<(Sender, PathBuf)>,
    /// The course of the machine. Without one, the machine stands.
    pub course: Option<Course>,
    /// The runs that a person asks for. Without them, the machine rolls by itself.
    pub runs: Option<mpsc::Receiver<Run>>,
    /// Whether to run as fast as the host can, not in real time.
    pub fast: bool,
    /// Whether to leave the chip alone when a program opens the port.
    pub keeps_running_when_opened: bool,
}

/// A run that a person asks for.
#[derive(Clone, Copy, Debug, PartialEq)]
pub enum Run {
    /// Along the row, once.
    AlongRow,
    /// Over bare ground, for this distance in millimetres.
    OverGround(f64),
}

/// A row, and the machine that rolls along it.
#[derive(Clone, Debug)]
pub struct Course {
    row: Row,
    machine: Machine,
    speed_mm_s: f64,
    /// The ground that has plants or weeds, in this row or another of the machine.
    span_mm: Range<f64>,
    /// Share of the wheel's distance that slip takes.
    slip: f64,
}

/// Chip time between two looks at the terminal and at the host's clock.
const SLICE_MS: u64 = 1;

/// Slices between two checks of the EEPROM.
const EEPROM_SLICES: u64 = 100;

/// Greatest number of bytes on their way to the chip. Others stay in the terminal, so that the program waits.
const MOST_BYTES_ON_THEIR_WAY: usize = 64;

/// Greatest number of unread bytes from the chip. Older bytes are lost.
const MOST_BYTES_UNREAD: usize = 64 * 1024;

/// Ground ahead of the row: longer than the distance from beam to tool, over which the tool waits before it begins.
const AHEAD_MM: f64 = 2500.0;

/// Ground that the tool travels behind the row.
const BEHIND_MM: f64 = 500.0;

/// How fast the machine gains its speed, and brakes.
const ACCELERATION_MM_S2: f64 = 1000.0;

/// Time of standing before and after each run.
const STANDING_S: u64 = 3;

/// Counts in a step of the encoder after which both channels are as they were.
const TICKS_IN_A_PERIOD: f64 = 4.0;

impl Course {
    /// A machine with one or several rows and one wheel: one course for each row. All rows roll along the same ground at
    /// the same time. The wheel turns farther than the machine rolls by the share `slip` of its distance.
    pub fn of_rows(rows: Vec<Row>, machine: Machine, speed_mm_s: f64, slip: f64) -> Vec<Self> {
        let spans = || rows.iter().map(Row::span_mm);
        let start = spans().map(|span| span.start).fold(f64::INFINITY, f64::min);
        let end = spans().map(|span| span.end).fold(f64::NEG_INFINITY, f64::max);
        rows.into_iter().map(|row| Self { row, machine, speed_mm_s, span_mm: start..end, slip }).collect()
    }

    /// How far the machine rolls each time.
    pub fn rolls_mm(&self) -> f64 {
        let motion = self.motion(Run::AlongRow);
        motion.end_mm() - motion.start_mm()
    }

    /// The motion of a run. At its end the encoder's channels are as at the start.
    fn motion(&self, run: Run) -> Motion {
        let span = &self.span_mm;
        let braking_mm = |speed_mm_s: f64| speed_mm_s.powi(2) / (2.0 * ACCELERATION_MM_S2);
        let (start_mm, wanted_mm, speed_mm_s) = match run {
            Run::AlongRow => {
                let start_mm = span.start - AHEAD_MM;
                let behind_mm = self.machine.beam_to_tool_mm + BEHIND_MM + braking_mm(self.speed_mm_s);
                (start_mm, span.end + behind_mm - start_mm, self.speed_mm_s)
            }
            Run::OverGround(length_mm) => {
                // A short run ends before the machine has gained its speed.
                let reached_mm_s = (ACCELERATION_MM_S2 * length_mm / 2.0).sqrt();
                (span.end + AHEAD_MM, length_mm, self.speed_mm_s.min(reached_mm_s))
            }
        };
        let period_mm = TICKS_IN_A_PERIOD * self.machine.tick_mm() * (1.0 - self.slip);
        let periods = wanted_mm / period_mm;
        let length_mm = period_mm * if run == Run::AlongRow { periods.ceil() } else { periods.round() };
        let until_mm = start_mm + length_mm - braking_mm(speed_mm_s);
        Motion::steady(start_mm, ACCELERATION_MM_S2, speed_mm_s, until_mm)
            .change_speed(0.0, ACCELERATION_MM_S2)
            .with_slip(|| self.slip)
    }
}

/// The distance travelled: the total before the last run, the start time of that run, and its motion.
struct Way {
    before_mm: f64,
    set_off_s: f64,
    motion: Motion,
}

impl Way {
    /// The distance travelled at a time, in metres.
    fn rolled_m(&self, time_s: f64) -> f64 {
        let since_mm = self.motion.position_mm(time_s - self.set_off_s) - self.motion.start_mm();
        (self.before_mm + since_mm) / 1000.0
    }
}

/// The satellite receiver on the machine, and its terminal.
struct Receiver {
    sends: Sender,
    pty: Pty,
    unread: VecDeque<u8>,
}

impl Receiver {
    fn start((sends, link): (Sender, PathBuf)) -> Result<Self> {
        Ok(Self { sends, pty: terminal(Some(&link))?, unread: VecDeque::new() })
    }

    /// Passes on its output until a cycle.
    fn serve(&mut self, cycle: u64, way: &Way) -> Result<()> {
        // It sends without a request, and takes no commands.
        if self.pty.was_opened()? {
            self.unread.clear();
        }
        self.pty.read(&mut [0; MOST_BYTES_ON_THEIR_WAY])?;
        self.unread.extend((self.sends)(time_at_s(0, cycle), &|time_s| way.rolled_m(time_s)));
        give(&mut self.pty, &mut self.unread)
    }
}

/// Writes the waiting bytes to a program, as far as it has room. Drops the oldest surplus bytes.
fn give(pty: &mut Pty, unread: &mut VecDeque<u8>) -> Result<()> {
    let written = pty.write(unread.make_contiguous())?;
    unread.drain(..written);
    let too_many = unread.len().saturating_sub(MOST_BYTES_UNREAD);
    unread.drain(..too_many);
    Ok(())
}

/// The arm that the servo swings, and its end switch.
struct Arm {
    servo: Servo,
    clear_within_degrees: f64,
    /// When the pulse on the line began.
    rise: Option<u64>,
    /// The pulses that commanded another angle than the one before.
    pulses: Vec<Pulse>,
    stroke: Option<Stroke>,
}

/// Swings in memory: enough for a day. After that their random values repeat.
const SWINGS: usize = 10_000;

impl Arm {
    fn of(machine: &Machine) -> Self {
        let Machine { servo, clear_within_degrees, .. } = *machine;
        Self { servo, clear_within_degrees, rise: None, pulses: Vec::new(), stroke: None }
    }

    /// Takes pin changes. Returns whether the arm is fully out at a cycle; `None` before the first pulse.
    fn turn(&mut self, changes: &[PinChange], cycle: u64) -> Option<bool> {
        for change in changes.iter().filter(|change| change.pin == wiring::SERVO) {
            match (change.high, self.rise.take()) {
                (true, _) => self.rise = Some(change.cycle),
                (false, Some(rise)) => self.hear(Pulse { rise, fall: change.cycle }),
                (false, None) => {}
            }
        }
        let degrees = self.stroke.as_ref()?.degrees(time_at_s(0, cycle));
        // The firmware's stroke may differ from the machine's. Fully out is the angle of the firmware's pulse.
        let out_degrees = self.servo.stroke_degrees().min(self.farthest_degrees());
        Some(degrees >= out_degrees - self.clear_within_degrees)
    }

    /// The greatest angle that was asked for lately.
    fn farthest_degrees(&self) -> f64 {
        let last = self.pulses.len().saturating_sub(2);
        self.servo.commands(&self.pulses[last..]).iter().map(|command| command.degrees).fold(0.0, f64::max)
    }

    fn hear(&mut self, pulse: Pulse) {
        if self.pulses.last().is_some_and(|last| (last.width_us() - pulse.width_us()).abs() < 1.0) {
            return;
        }
        if self.pulses.len() == SWINGS {
            self.pulses.drain(..SWINGS - 2);
        }
        self.pulses.push(pulse);
        self.stroke = Some(self.servo.stroke(&self.servo.commands(&self.pulses), 0));
    }
}

/// A virtual Uno at a pseudo terminal.
struct LiveUno {
    uno: Uno,
    /// Its terminal. `None` while its cable is unplugged.
    pty: Option<Pty>,
    path: PathBuf,
    link: Option<PathBuf>,
    receiver: Option<Receiver>,
    course: Option<Course>,
    runs: Option<mpsc::Receiver<Run>>,
    arm: Option<Arm>,
    way: Way,
    /// When the machine sets off again.
    sets_off: u64,
    eeprom: Option<EepromFile>,
    /// Bytes from the chip that the program has not had room for.
    unread: VecDeque<u8>,
    resets_when_opened: bool,
    /// Its run time, in slices.
    slices: u64,
}

impl LiveUno {
    /// Powers it up. Its clock stands until it runs.
    fn start(setup: Setup) -> Result<LiveUno> {
        let eeprom = setup.eeprom.map(EepromFile::open).transpose()?;
        let content = eeprom.as_ref().map_or(&[][..], |file| &file.content);
        let mut uno = match (&setup.bootloader, &setup.elf) {
            (Some(bootloader), elf) => Uno::boot_with_bootloader(bootloader, elf.as_deref(), content)?,
            (None, Some(elf)) => Uno::boot_with_eeprom(elf, content)?,
            (None, None) => bail!("there is nothing to run: give a firmware's ELF, a bootloader, or both"),
        };
        uno = uno.wired(&wiring::WIRES);
        uno.follow_baud();
        let pty = terminal(setup.link.as_deref())?;
        Ok(LiveUno {
            uno,
            path: pty.path().to_owned(),
            pty: Some(pty),
            link: setup.link,
            receiver: setup.receiver.map(Receiver::start).transpose()?,
            arm: setup.course.as_ref().map(|course| Arm::of(&course.machine)),
            sets_off: STANDING_S * CYCLES_PER_SECOND,
            course: setup.course,
            runs: setup.runs,
            way: Way { before_mm: 0.0, set_off_s: 0.0, motion: Motion::starting_at(0.0) },
            eeprom,
            unread: VecDeque::new(),
            resets_when_opened: !setup.keeps_running_when_opened,
            slices: 0,
        })
    }

    fn slice(&mut self) -> Result<()> {
        self.serve()?;
        self.roll();
        self.slices += 1;
        // Counts from the start. The last instruction of each slice runs over its end, and these errors must not add
        // up: several Unos share a wheel.
        self.uno.run_until(self.slices * SLICE_MS * (CYCLES_PER_SECOND / 1000))?;
        // They would pile up.
        let changes = self.uno.take_changes();
        if let Some(arm) = &mut self.arm
            && let Some(is_out) = arm.turn(&changes, self.uno.cycle())
        {
            self.uno.set(wiring::END_SWITCH, !is_out);
        }
        if self.slices.is_multiple_of(EEPROM_SLICES) { self.keep_eeprom() } else { Ok(()) }
    }

    /// Passes on the remaining output.
    fn end(&mut self) -> Result<()> {
        self.serve()?;
        self.keep_eeprom()
    }

    fn plug_in(&mut self) -> Result<()> {
        let pty = terminal(self.link.as_deref())?;
        self.path = pty.path().to_owned();
        self.pty = Some(pty);
        Ok(())
    }

    /// Passes on the receiver's output, resets the chip if a program has opened the port, and passes bytes both ways.
    fn serve(&mut self) -> Result<()> {
        if let Some(receiver) = &mut self.receiver {
            receiver.serve(self.uno.cycle(), &self.way)?;
        }
        let Some(pty) = &mut self.pty else {
            // Discards the output: no program is connected.
            self.uno.received_bytes();
            return Ok(());
        };
        if pty.was_opened()? {
            self.unread.clear();
            if self.resets_when_opened {
                self.uno.reset();
            }
        }

        let mut buffer = [0; MOST_BYTES_ON_THEIR_WAY];
        let room = MOST_BYTES_ON_THEIR_WAY.saturating_sub(self.uno.bytes_pending());
        let count = pty.read(&mut buffer[..room])?;
        self.uno.send(&buffer[..count]);

        self.unread.extend(self.uno.received_bytes().iter().map(|received| received.byte));
        give(pty, &mut self.unread)
    }

    /// Starts a run when the machine has stood for long enough, or when a person asks for one.
    fn roll(&mut self) {
        if let Some(course) = &self.course
            && self.uno.cycle() >= self.sets_off
        {
            let run = match &self.runs {
                None => Run::AlongRow,
                Some(runs) => {
                    let Ok(run) = runs.try_recv() else { return };
                    self.sets_off = self.uno.cycle();
                    run
                }
            };
            // All Unos that share the wheel use the same cycle, although their last instructions end at different ones.
            let motion = course.motion(run);
            self.uno.drive(course.machine.pin_changes(&course.row, &motion, self.sets_off));
            let end = cycle_at(self.sets_off, motion.duration_s());
            let set_off_s = self.sets_off as f64 / CYCLES_PER_SECOND as f64;
            self.way = Way { before_mm: 1000.0 * self.way.rolled_m(set_off_s), set_off_s, motion };
            self.sets_off = end + if self.runs.is_some() { 0 } else { STANDING_S * CYCLES_PER_SECOND };
        }
    }

    fn keep_eeprom(&mut self) -> Result<()> {
        self.eeprom.as_mut().map_or(Ok(()), |file| file.keep(self.uno.eeprom()))
    }
}

/// A pseudo terminal, with a link to it where one is wanted.
fn terminal(link: Option<&Path>) -> Result<Pty> {
    let mut pty = Pty::open()?;
    if let Some(link) = link {
        pty.link(link)?;
    }
    Ok(pty)
}

struct EepromFile {
    path: PathBuf,
    /// Locked: two virtual Unos would overwrite what the other has saved.
    _lock: File,
    content: Vec<u8>,
}

impl EepromFile {
    /// Opens it; a file that does not exist yet is an erased EEPROM.
    fn open(path: PathBuf) -> Result<EepromFile> {
        let is_new = !path.exists();
        let opened = OpenOptions::new().write(true).create(true).truncate(false).open(&path);
        let lock = opened.with_context(|| unusable(&path))?;
        if matches!(lock.try_lock(), Err(TryLockError::WouldBlock)) {
            bail!("another virtual Uno keeps its EEPROM in {}: name another file by --eeprom", path.display());
        }
        if is_new {
            let mut file = EepromFile { path, _lock: lock, content: Vec::new() };
            file.keep(vec![0xFF; EEPROM_BYTES])?;
            return Ok(file);
        }
        let content = bounded_file::bytes(&path).with_context(|| unusable(&path))?;
        if content.len() != EEPROM_BYTES {
            let (path, bytes) = (path.display(), content.len());
            bail!("{path} has {bytes} bytes: a file that keeps the EEPROM has {EEPROM_BYTES}")
        }
        Ok(EepromFile { path, _lock: lock, content })
    }

    /// Writes it where the content has changed.
    fn keep(&mut self, content: Vec<u8>) -> Result<()> {
        if content != self.content {
            std::fs::write(&self.path, &content).with_context(|| unusable(&self.path))?;
            self.content = content;
        }
        Ok(())
    }
}

fn unusable(path: &Path) -> String {
    format!("the EEPROM's file {} cannot be read or written", path.display())
}
