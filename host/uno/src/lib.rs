//! The virtual Uno: an ATmega328P at 16 MHz that runs a firmware's real ELF, on simavr.
//!
//! It is of use to any firmware for an Uno: it knows pins by their number on the board, and nothing of what is wired to them. D9 and
//! D13 are recorded as outputs, the other pins from D2 on are inputs, and A0 to A5 are not there. [`elf`] and [`hex`] read and
//! write the files, [`bounds`] proves what a firmware can need at most, [`waveform`] writes down what was on the pins,
//! [`capture`] reads a recording of them, and [`pty`] is a serial port that other programs open.
//!
//! [`Uno::boot`] powers it up, [`Uno::wired`] says what is at its pins. [`Uno::set`] and [`Uno::drive`] put levels on
//! its inputs, [`Uno::send`] types into its serial line, [`Uno::run_until`] lets its clock run; [`Uno::changes`],
//! [`Uno::pulses`] and [`Uno::received`] say what it did. Time is the chip's own cycle count since the first power-up
//! and goes on over resets; the host's clock plays no part. Every Uno is by itself, so that several can run in parallel
//! threads.
//!
//! # What is set right against simavr
//!
//! - Entering an interrupt takes 4 cycles, and 4 more out of sleep (simavr: none).
//! - A byte on the serial line takes as many bits as it has (simavr: always one of parity), whichever order the firmware
//!   sets its UART up in.
//! - A received byte is there when its stop bit ends, and the receiver holds three (simavr: a byte later, and 64); a byte
//!   too many is lost and sets DOR0. The interrupt is asked for as long as one waits (simavr: once a byte's time).
//! - An edge of a timer's output carries the cycle in which it was due (simavr: the end of the instruction then running). An
//!   edge that the firmware makes carries the cycle in which its instruction began.
//! - OCR1A is double buffered in fast PWM: a new value counts from the next bottom (simavr: at once). Writing TCNT1 moves the
//!   counter and leaves the pin and the prescaler alone (simavr: sets the pin where a match is to come, and rounds).
//! - D9 follows its timer while it is connected to it (simavr copies the timer's level into PORTB, where a firmware
//!   that reads PORTB before an edge and writes it behind the edge takes the edge back).
//! - A timer is stopped by a reset (simavr keeps its mode and its period).
//! - An input keeps its level when the firmware writes its port (simavr raises pulled-up pins) and over a reset.
//! - The clock, and the watchdog's time after its own reset, go on over a reset (simavr starts them from 0 and from the past).
//! - Sleep advances the cycles and never waits; nothing is printed but simavr's errors; there is no debugger.
//! - SRAM is not zero at power-up.
//! - An EEPROM write takes 3.4 ms (simavr: none), and where power goes meanwhile its byte is undefined.
//!
//! # Faults
//!
//! [`Uno::write`] and [`Uno::write_sram`] turn bits over in SRAM, [`Uno::stall`] hangs the main program, [`Uno::reset`],
//! [`Uno::brown_out`] and [`Uno::power_cycle`] start the chip anew at any cycle, each with its cause in MCUSR (data sheet,
//! 11.9.1; the cause of the very first start is power-on); the watchdog does so by itself. SRAM keeps its content in all of
//! them but the power cycle.
//!
//! # What is not
//!
//! - Writes that only erase or do not erase first take as long as the others. The EEPROM-ready interrupt comes only after a
//!   write, and the core is not halted for the 2 to 4 cycles after an order to the EEPROM.
//! - OCR1B and the compare registers of Timer0 and Timer2 are not double buffered. PORTB's bit of D9 reads as the
//!   timer's level.
//! - TCNT1 of a stopped timer counts for nothing: the timer starts at its bottom, with the pin's edge.
//! - An edge reaches its interrupt at once; the chip's synchroniser takes two or three cycles more.
//! - The transmitter has no second buffer: it takes the next byte when the last one has left.
//! - UBRR is what the clock divides; the crystal is exact.
//! - Self-programming takes no time: a page of flash is erased or written within its instruction. Lock bits are not kept.
//!
//! The firmware is tested on avr8js as well, and what that one does otherwise stands in docs/simulators.md.
//!
//! # Who knows whom
//!
//! Imports run one way. The chip: `io_register` -> `timer`, `eeprom`, and `uart`, `interrupts`, `turns` beside them -> `recorder`,
//! which owns what simavr calls back with -> `core`, which runs it -> `terminal` -> this file. The files: `elf` -> `hex`, `bounds`,
//! `core` -> this file. `capture`, `waveform` and `pty` know none of these.

pub mod bounds;
pub mod capture;
mod core;
mod eeprom;
pub mod elf;
mod error;
pub mod hex;
mod interrupts;
mod io_register;
pub mod pty;
mod recorder;
mod terminal;
mod timer;
mod turns;
mod uart;
pub mod waveform;

pub use self::error::UnoError;
pub use self::interrupts::{HandlerCycles, InterruptStatistics, Place};
pub use self::recorder::{ReceivedByte, Reset, ResetCause};
pub use self::terminal::{BAUD, SENT_BYTE_CYCLES};
pub use self::turns::Turns;
pub use signal::{CYCLES_PER_SECOND, Pin, PinChange, Pulse, Wire};

use self::core::{Core, Stop};
use self::elf::{EEPROM_BYTES, Image, Size, Variable};
use self::hex::Bootloader;
use self::recorder::is_output;
use self::terminal::Terminal;
use rand::{Rng, SeedableRng};
use rand_chacha::ChaCha8Rng;
use std::collections::VecDeque;
use std::path::Path;

/// An Arduino Uno with a firmware in it.
pub struct Uno {
    core: Core,
    image: Image,
    /// Where a reset starts the chip, in bytes of flash.
    reset_address: u16,
    /// Levels to come, by cycle.
    to_drive: VecDeque<PinChange>,
    terminal: Terminal,
}

impl Uno {
    /// Powers up an Uno with the firmware at `elf` and an erased EEPROM. Nothing is wired to its inputs yet ([`Uno::wired`]).
    ///
    /// # Errors
    ///
    /// Where the ELF cannot be read or does not fit the chip.
    pub fn boot(elf: &Path) -> Result<Uno, UnoError> {
        Uno::boot_with_eeprom(elf, &[])
    }

    /// As [`Uno::boot`], with `eeprom` from the EEPROM's address 0; the rest is erased.
    ///
    /// # Errors
    ///
    /// As [`Uno::boot`], and where `eeprom` is longer than 1024 bytes.
    pub fn boot_with_eeprom(elf: &Path, eeprom: &[u8]) -> Result<Uno, UnoError> {
        if eeprom.len() > EEPROM_BYTES {
            return Err(UnoError::EepromTooLarge(eeprom.len()));
        }
        let image = Image::read(elf)?;
        let mut content = image.eeprom.clone();
        content.resize(content.len().max(eeprom.len()), 0xFF);
        content[..eeprom.len()].copy_from_slice(eeprom);
        Ok(Uno::power_up(image, &content, 0))
    }

    /// As [`Uno::boot_with_eeprom`], with a bootloader behind the firmware, or behind erased flash where `elf` is `None`. Every reset
    /// starts the bootloader, as the fuses of a real Uno have it.
    ///
    /// # Errors
    ///
    /// As [`Uno::boot_with_eeprom`], and where the firmware reaches into the bootloader.
    pub fn boot_with_bootloader(bootloader: &Bootloader, elf: Option<&Path>, eeprom: &[u8]) -> Result<Uno, UnoError> {
        if eeprom.len() > EEPROM_BYTES {
            return Err(UnoError::EepromTooLarge(eeprom.len()));
        }
        let mut image = elf.map(Image::read).transpose()?.unwrap_or_default();
        image.flash = bootloader.behind(&image.flash)?;
        Ok(Uno::power_up(image, eeprom, bootloader.start()))
    }

    fn power_up(image: Image, eeprom: &[u8], reset_address: u16) -> Uno {
        Uno {
            core: Core::new(&image.flash, eeprom, reset_address, 0),
            image,
            reset_address,
            to_drive: VecDeque::new(),
            terminal: Terminal::default(),
        }
    }

    /// The Uno with this wired to its pins: what is an input has its level at rest. Before the first instruction that is as if it
    /// had been there when power came.
    #[must_use]
    pub fn wired(mut self, wires: &[Wire]) -> Uno {
        for wire in wires.iter().filter(|wire| !is_output(wire.pin)) {
            self.set(wire.pin, wire.high_at_rest);
        }
        self
    }

    /// Pulls the reset pin. EEPROM, SRAM, inputs and the clock stay; the cause is in MCUSR.
    pub fn reset(&mut self) {
        self.core.reset();
    }

    /// Lets the supply sag for a moment: too low to run, high enough for SRAM, which keeps its content, as do EEPROM, inputs and
    /// the clock. A byte that was being written to the EEPROM is torn.
    pub fn brown_out(&mut self) {
        self.core.brown_out();
    }

    /// Hangs the main program where it is, as an endless loop would, until the next reset. Interrupts are as they are there:
    /// inside a critical section none comes any more. The clock runs on until no handler is running.
    ///
    /// # Errors
    ///
    /// As [`Uno::run_until`].
    pub fn stall(&mut self) -> Result<(), UnoError> {
        while self.core.is_in_handler() {
            self.step(self.cycle() + 1)?;
        }
        self.core.stall();
        Ok(())
    }

    /// As [`Uno::power_cycle`], with SRAM that comes up with random content, the same for the same seed. Then
    /// [`Uno::deepest_stack`] can be told only of a firmware that paints its stack.
    pub fn power_cycle_to_noise(&mut self, seed: u64) {
        self.power_cycle();
        let mut noise = [0; Core::SRAM_BYTES];
        ChaCha8Rng::seed_from_u64(seed).fill_bytes(&mut noise);
        self.core.set_sram(core::SRAM_START, &noise);
    }

    /// Takes the power away and gives it back. EEPROM, inputs and the clock stay; SRAM does not, and a byte that was being
    /// written to the EEPROM is torn.
    pub fn power_cycle(&mut self) {
        self.core.lose_power();
        let mut fresh = Core::new(self.core.flash(), &self.core.eeprom(), self.reset_address, self.core.cycle());
        fresh.take_over(&mut self.core);
        self.core = fresh;
    }

    /// Resets since the first power-up, oldest first.
    pub fn resets(&self) -> &[Reset] {
        &self.core.recorder().resets
    }

    /// The flash's 32 KiB, as the bootloader, if there is one, has written it.
    pub fn flash(&self) -> &[u8] {
        self.core.flash()
    }

    /// The EEPROM's 1024 bytes, as they would be found if power went now: a byte that is being written is torn.
    pub fn eeprom(&self) -> Vec<u8> {
        self.core.eeprom()
    }

    /// Cycles since the first power-up.
    pub fn cycle(&self) -> u64 {
        self.core.cycle()
    }

    /// Memory that the firmware takes.
    pub fn size(&self) -> Size {
        self.image.size
    }

    /// Puts a level on an input pin, now.
    ///
    /// # Panics
    ///
    /// Where the pin is an output.
    pub fn set(&mut self, pin: Pin, high: bool) {
        assert!(!is_output(pin), "{pin:?} is driven by the firmware");
        self.core.set_input(pin, high);
    }

    /// Queues levels for input pins. Each is there at the first instruction boundary at or after its cycle; what lies in the past
    /// comes at once. Changes of the same cycle keep their order, and so do those of several calls.
    ///
    /// # Panics
    ///
    /// Where a pin is an output.
    pub fn drive(&mut self, changes: impl IntoIterator<Item = PinChange>) {
        self.to_drive.extend(changes.into_iter().inspect(|change| {
            assert!(!is_output(change.pin), "{:?} is driven by the firmware", change.pin);
        }));
        self.to_drive.make_contiguous().sort_by_key(|change| change.cycle);
    }

    /// Runs until the clock has reached `cycle`, or passed it by the last instruction's length.
    ///
    /// # Errors
    ///
    /// Where the firmware crashed or halted for good.
    pub fn run_until(&mut self, cycle: u64) -> Result<(), UnoError> {
        while self.cycle() < cycle {
            self.step(cycle)?;
        }
        Ok(())
    }

    /// Runs for a time in milliseconds.
    ///
    /// # Errors
    ///
    /// As [`Uno::run_until`].
    pub fn run_for_ms(&mut self, time_ms: u64) -> Result<(), UnoError> {
        self.run_until(self.cycle() + time_ms * (CYCLES_PER_SECOND / 1000))
    }

    /// Runs until the firmware has sent `text`, and takes all that it sent up to the text's end.
    ///
    /// # Errors
    ///
    /// As [`Uno::run_until`], and where the text has not come after `timeout_cycles`.
    pub fn run_until_serial(&mut self, text: &str, timeout_cycles: u64) -> Result<String, UnoError> {
        let deadline = self.cycle() + timeout_cycles;
        loop {
            let bytes = to_bytes(&self.core.recorder().received);
            if let Some(start) = find(&bytes, text.as_bytes()) {
                let end = start + text.len();
                self.core.recorder_mut().received.drain(..end);
                return Ok(String::from_utf8_lossy(&bytes[..end]).into_owned());
            }
            if self.cycle() >= deadline {
                return Err(UnoError::NoAnswer {
                    text: text.to_owned(),
                    timeout_cycles,
                    received: String::from_utf8_lossy(&bytes).into_owned(),
                });
            }
            while self.core.recorder().received.len() == bytes.len() && self.cycle() < deadline {
                self.step(deadline)?;
            }
        }
    }

    /// Runs until the next instruction is the first of a function, by its path from the crate on: `main` is where the start-up
    /// code has filled SRAM and no line of the firmware's own has run.
    ///
    /// # Errors
    ///
    /// As [`Uno::run_until`], where the ELF has no such function, and where it is not reached within `timeout_cycles`.
    pub fn run_until_symbol(&mut self, symbol: &str, timeout_cycles: u64) -> Result<(), UnoError> {
        let address = self.image.functions.get(symbol).copied();
        let address = address.ok_or_else(|| UnoError::NoFunction(symbol.to_owned()))?;
        let deadline = self.cycle() + timeout_cycles;
        while self.core.program_counter() != address {
            if self.cycle() >= deadline {
                return Err(UnoError::NotReached { symbol: symbol.to_owned(), timeout_cycles });
            }
            self.run_instruction()?;
        }
        Ok(())
    }

    /// Runs one instruction. Where an interrupt is due, that is the first one of its handler, behind the response.
    ///
    /// # Errors
    ///
    /// As [`Uno::run_until`].
    pub fn run_instruction(&mut self) -> Result<(), UnoError> {
        // A cycle is less than any instruction has.
        self.step(self.cycle() + 1)
    }

    /// Where the program stands.
    pub fn place(&self) -> Place {
        self.core.place()
    }

    /// Gives the receiver a byte whose stop bit ends now, beside those that [`Uno::send`] has on their way. Returns whether it had
    /// room.
    pub fn receive(&mut self, byte: u8) -> bool {
        self.core.receive(byte)
    }

    /// Runs a step, and what falls due before it.
    fn step(&mut self, until: u64) -> Result<(), UnoError> {
        while let Some(change) = self.to_drive.pop_front_if(|change| change.cycle <= self.core.cycle()) {
            self.core.set_input(change.pin, change.high);
        }
        self.terminal.send_what_is_due(&mut self.core);
        let next_level = self.to_drive.front().map(|change| change.cycle);
        let until = [next_level, self.terminal.next_byte_ends()].into_iter().flatten().fold(until, u64::min);
        self.core.step(until).map_err(|stop| {
            let (cycle, program_counter) = (self.core.cycle(), self.core.program_counter());
            match stop {
                Stop::Crashed => UnoError::Crashed { cycle, program_counter },
                Stop::Halted => UnoError::Halted { cycle, program_counter },
            }
        })
    }

    /// Types bytes into the serial line, at the pace of the line and behind those that are still on their way.
    pub fn send(&mut self, bytes: &[u8]) {
        self.terminal.send(bytes, &self.core);
    }

    /// From now on sent bytes come at the rate that the chip's UART is set to, whichever that is, and not at [`BAUD`]: a
    /// bootloader has a rate of its own.
    pub fn follow_baud(&mut self) {
        self.terminal.follow_baud();
    }

    /// Sent bytes that are still on their way to the receiver.
    pub fn bytes_on_their_way(&self) -> usize {
        self.terminal.bytes_on_their_way()
    }

    /// Pushes up to 63 bytes into the receiver at once, faster than any line could: simavr keeps them and hands them out one
    /// by one.
    pub fn send_at_once(&mut self, bytes: &[u8]) {
        for &byte in bytes {
            self.core.flood(byte);
        }
    }

    /// Sent bytes that the receiver had no room for, because the firmware did not read in time.
    pub fn lost_bytes(&self) -> u64 {
        self.terminal.lost_bytes()
    }

    /// Takes the bytes that have come from the firmware, with their cycles.
    pub fn received_bytes(&mut self) -> Vec<ReceivedByte> {
        std::mem::take(&mut self.core.recorder_mut().received)
    }

    /// Takes the text that has come from the firmware; what is not UTF-8 is replaced.
    pub fn received(&mut self) -> String {
        let bytes = to_bytes(&self.received_bytes());
        String::from_utf8_lossy(&bytes).into_owned()
    }

    /// Takes the edges of the output pins: from now on [`Uno::changes`] begins with the next one. An Uno that runs for days
    /// would pile them up.
    pub fn take_changes(&mut self) -> Vec<PinChange> {
        std::mem::take(&mut self.core.recorder_mut().changes)
    }

    /// Every edge of the output pins since the first power-up, oldest first.
    pub fn changes(&self) -> &[PinChange] {
        &self.core.recorder().changes
    }

    /// The complete pulses on an output pin since the first power-up, oldest first.
    pub fn pulses(&self, pin: Pin) -> Vec<Pulse> {
        let edges: Vec<_> = self.changes().iter().filter(|change| change.pin == pin).collect();
        edges
            .windows(2)
            .filter(|edges| edges[0].high && !edges[1].high)
            .map(|edges| Pulse { rise: edges[0].cycle, fall: edges[1].cycle })
            .collect()
    }

    /// Counts and times interrupts from now on; a second call starts afresh. The simulation is slower for it.
    pub fn measure_interrupts(&mut self) {
        self.core.measure_interrupts();
    }

    /// What the interrupts have cost since [`Uno::measure_interrupts`]; `None` before it.
    pub fn interrupt_statistics(&self) -> Option<&InterruptStatistics> {
        self.core.interrupt_statistics()
    }

    /// Times the main loop's turns from now on; a second call starts afresh. The simulation is slower for it.
    pub fn measure_turns(&mut self) {
        self.core.measure_turns();
    }

    /// The main loop's turns since [`Uno::measure_turns`]; `None` before it.
    pub fn turns(&self) -> Option<&Turns> {
        self.core.turns()
    }

    /// A variable's bytes in SRAM, by its symbol: in Rust the path from the crate on. `None` where there is no such symbol.
    pub fn read(&self, symbol: &str) -> Option<&[u8]> {
        let variable = self.image.variables.get(symbol)?;
        Some(self.core.sram(variable.address, variable.size))
    }

    /// Puts bytes into a variable from its first byte on, as bits that fall over would. It is named as in [`Uno::read`].
    ///
    /// # Errors
    ///
    /// Where there is no such symbol, or more bytes than it has.
    pub fn write(&mut self, symbol: &str, bytes: &[u8]) -> Result<(), UnoError> {
        let length = bytes.len();
        match self.image.variables.get(symbol) {
            Some(&Variable { address, size }) if length <= size.into() => self.write_sram(address, bytes),
            _ => Err(UnoError::NoVariable { symbol: symbol.to_owned(), length }),
        }
    }

    /// Puts bytes into SRAM from an address of the data space on.
    ///
    /// # Errors
    ///
    /// Where they do not fit into SRAM, which is from 0x0100 to 0x08FF.
    pub fn write_sram(&mut self, address: u16, bytes: &[u8]) -> Result<(), UnoError> {
        let length = bytes.len();
        let fits = u16::try_from(length).is_ok_and(|count| self.core.sram(address, count).len() == length);
        if !fits {
            return Err(UnoError::NotInSram { address, length });
        }
        self.core.set_sram(address, bytes);
        Ok(())
    }

    /// Address of the first byte behind the static data, down to which the stack may grow.
    pub fn first_stack_address(&self) -> u16 {
        core::SRAM_START + self.image.size.sram as u16
    }

    /// The most bytes that the stack has taken since power-up, or since the firmware painted it, as far as they were written.
    pub fn deepest_stack(&self) -> usize {
        self.core.deepest_stack(self.image.size.sram as u16)
    }
}

fn to_bytes(received: &[ReceivedByte]) -> Vec<u8> {
    received.iter().map(|received| received.byte).collect()
}

/// Where `text` begins in `bytes`.
fn find(bytes: &[u8], text: &[u8]) -> Option<usize> {
    (0..=bytes.len()).find(|&start| bytes[start..].starts_with(text))
}
