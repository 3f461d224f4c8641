//! The board: an Uno with its firmware, the wires on its pins, and a terminal at its serial line.

use crate::bootloader::Bootloader;
use crate::core::adc::SUPPLY_MILLIVOLTS;
use crate::core::measuring::{Cycles, InterruptStatistics, Place};
use crate::core::recorder::{Log, ReceivedByte, Reset, ResetCause};
use crate::core::{self, Core};
use crate::elf::{Image, Size, Variable};
use crate::error::UnoError;
use crate::memory::EEPROM_BYTES;
use crate::pins::{CYCLES_PER_SECOND, Pin, PinChange, Pulse, Wire};
use rand::{Rng, SeedableRng};
use rand_chacha::ChaCha8Rng;
use std::collections::VecDeque;
use std::ops::Range;
use std::path::Path;

/// The terminal's bit rate, until it follows the chip.
pub const BAUD: u64 = 115_200;

/// Cycles of a byte that a terminal sends: a start bit, eight data bits and a stop bit.
pub const SENT_BYTE_CYCLES: u64 = (10 * CYCLES_PER_SECOND + BAUD / 2) / BAUD;

/// An Arduino Uno with its firmware. Every method that runs it fails if the firmware crashes or halts for good.
pub struct Uno {
    core: Core,
    image: Image,
    /// Levels to come, by cycle.
    to_drive: VecDeque<PinChange>,
    /// Bytes that the terminal at the serial line has not sent, and the time at which the first one's stop bit ends.
    to_send: VecDeque<u8>,
    next_byte_ends: u64,
    /// Whether bytes are sent at the chip's own baud rate, not at [`BAUD`].
    follows_baud: bool,
    lost_bytes: u64,
}

impl Uno {
    /// Powers up an Uno with the firmware at `elf` and an erased EEPROM. Nothing is wired to its inputs yet ([`Uno::wired`]).
    ///
    /// # Errors
    /// If the ELF cannot be read or does not fit the chip.
    pub fn boot(elf: &Path) -> Result<Uno, UnoError> {
        Uno::boot_with_eeprom(elf, &[])
    }

    /// As [`Uno::boot`], with `eeprom` at the EEPROM's address 0; the rest is erased.
    ///
    /// # Errors
    /// As [`Uno::boot`], and if `eeprom` is longer than 1024 bytes.
    pub fn boot_with_eeprom(elf: &Path, eeprom: &[u8]) -> Result<Uno, UnoError> {
        let image = Image::read(elf)?;
        let rest = image.eeprom.get(eeprom.len()..).unwrap_or_default();
        let content = [eeprom, rest].concat();
        Uno::power_up(image, &content, 0)
    }

    /// As [`Uno::boot_with_eeprom`], with a bootloader behind the firmware. If `elf` is `None`, the other flash is
    /// erased. Every reset starts the bootloader, as with the fuses of a real Uno.
    ///
    /// # Errors
    /// As [`Uno::boot_with_eeprom`], and if the firmware overlaps the bootloader.
    pub fn boot_with_bootloader(bootloader: &Bootloader, elf: Option<&Path>, eeprom: &[u8]) -> Result<Uno, UnoError> {
        let mut image = elf.map(Image::read).transpose()?.unwrap_or_default();
        image.flash = bootloader.behind(&image.flash)?;
        Uno::power_up(image, eeprom, bootloader.start())
    }

    fn power_up(image: Image, eeprom: &[u8], reset_address: u16) -> Result<Uno, UnoError> {
        if eeprom.len() > EEPROM_BYTES {
            return Err(UnoError::EepromTooLarge(eeprom.len()));
        }
        Ok(Uno {
            core: Core::new(&image.flash, eeprom, reset_address.into(), 0, Log::default()),
            image,
            to_drive: VecDeque::new(),
            to_send: VecDeque::new(),
            next_byte_ends: 0,
            follows_baud: false,
            lost_bytes: 0,
        })
    }

    /// The Uno with these wires on its pins, each at its level at rest: before the first instruction, as at power-up.
    #[must_use]
    pub fn wired(mut self, wires: &[Wire]) -> Uno {
        for wire in wires {
            self.set(wire.pin, wire.high_at_rest);
        }
        self
    }

    /// Pulls the reset pin. EEPROM, SRAM, inputs and the clock stay; the cause is in MCUSR.
    pub fn reset(&mut self) {
        self.core.reset(ResetCause::External);
    }

    /// Lets the supply voltage drop for a moment: too low to run, high enough for SRAM, which keeps its content.
    /// EEPROM, inputs and the clock are kept too. A byte that was being written to the EEPROM is torn.
    pub fn brown_out(&mut self) {
        self.core.tear_eeprom();
        self.core.reset(ResetCause::BrownOut);
    }

    /// Stops the main program in an endless loop at its present instruction, until the next reset. The interrupt flag
    /// is not changed: inside a critical section no interrupt is served. The clock first runs on until no handler is
    /// running.
    pub fn stall(&mut self) -> Result<(), UnoError> {
        while self.core.is_in_handler() {
            self.run_instruction()?;
        }
        self.core.stall();
        Ok(())
    }

    /// As [`Uno::power_cycle`], but SRAM starts with random content, the same for the same seed. Then
    /// [`Uno::deepest_stack`] is valid only for firmware that paints its stack.
    pub fn power_cycle_to_noise(&mut self, seed: u64) {
        self.power_cycle();
        ChaCha8Rng::seed_from_u64(seed).fill_bytes(self.core.sram_mut());
    }

    /// Switches the power off and on. EEPROM, inputs and the clock are kept. SRAM is lost, and a byte that was being
    /// written to the EEPROM is torn.
    pub fn power_cycle(&mut self) {
        self.core.power_cycle();
    }

    /// Resets since the first power-up, oldest first.
    pub fn resets(&self) -> &[Reset] {
        &self.core.recorder().log.resets
    }

    /// The flash's 32 KiB, with the changes by the bootloader, if there is one.
    pub fn flash(&self) -> &[u8] {
        self.core.flash()
    }

    /// The EEPROM's 1024 bytes as after a power failure now: a byte that is being written is torn.
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

    /// Sets the level of a pin now. While the firmware drives the pin, the level waits until it is an input again.
    pub fn set(&mut self, pin: Pin, high: bool) {
        match pin.adc_channel() {
            Some(_) => self.set_millivolts(pin, if high { SUPPLY_MILLIVOLTS } else { 0 }),
            None => self.core.set_input(pin, high),
        }
    }

    /// Puts a voltage on an analogue pin, now. It is 0 at first, and stays over resets. The pin reads high from 3 V on and low up
    /// to 1.5 V; in between it keeps its level (data sheet, DC characteristics).
    ///
    /// # Panics
    /// If the pin is none of A0 to A5.
    pub fn set_millivolts(&mut self, pin: Pin, millivolts: u16) {
        let channel = pin.adc_channel().unwrap_or_else(|| panic!("{pin} is not an analogue pin: take A0 to A5"));
        if millivolts >= SUPPLY_MILLIVOLTS / 10 * 6 {
            self.core.set_input(pin, true);
        } else if millivolts <= SUPPLY_MILLIVOLTS / 10 * 3 {
            self.core.set_input(pin, false);
        }
        self.core.recorder_mut().millivolts[usize::from(channel)] = millivolts;
    }

    /// The level that the firmware drives a pin to; `None` while the pin is an input.
    pub fn output(&self, pin: Pin) -> Option<bool> {
        self.core.output(pin)
    }

    /// The level at a pin: the one that the firmware drives, or else the one that it reads.
    pub fn level(&self, pin: Pin) -> bool {
        self.core.output(pin).unwrap_or_else(|| self.core.input(pin))
    }

    /// Queues levels for pins, as [`Uno::set`] sets them. Each is applied at the first instruction boundary at or after
    /// its cycle; changes in the past are applied at once. Changes of the same cycle keep their order, also over
    /// several calls.
    pub fn drive(&mut self, changes: impl IntoIterator<Item = PinChange>) {
        self.to_drive.extend(changes);
        self.to_drive.make_contiguous().sort_by_key(|change| change.cycle);
    }

    /// Runs until the clock has reached `cycle`, or passed it by the last instruction's length.
    pub fn run_until(&mut self, cycle: u64) -> Result<(), UnoError> {
        while self.cycle() < cycle {
            self.step(cycle)?;
        }
        Ok(())
    }

    /// Runs for a time in milliseconds.
    pub fn run_for_ms(&mut self, time_ms: u64) -> Result<(), UnoError> {
        self.run_until(self.cycle() + time_ms * (CYCLES_PER_SECOND / 1000))
    }

    /// Runs until the firmware has sent `text`. Takes all output up to the text's end.
    ///
    /// # Errors
    /// As [`Uno::run_until`], and if the text has not come after `timeout_cycles`.
    pub fn run_until_serial(&mut self, text: &str, timeout_cycles: u64) -> Result<String, UnoError> {
        let deadline = self.cycle() + timeout_cycles;
        loop {
            let bytes = to_bytes(&self.core.recorder().log.received);
            if let Some(start) = (0..=bytes.len()).find(|&start| bytes[start..].starts_with(text.as_bytes())) {
                let end = start + text.len();
                self.core.recorder_mut().log.received.drain(..end);
                return Ok(String::from_utf8_lossy(&bytes[..end]).into_owned());
            }
            if self.cycle() >= deadline {
                return Err(UnoError::NoAnswer {
                    text: text.to_owned(),
                    timeout_cycles,
                    received: String::from_utf8_lossy(&bytes).into_owned(),
                });
            }
            while self.core.recorder().log.received.len() == bytes.len() && self.cycle() < deadline {
                self.step(deadline)?;
            }
        }
    }

    /// Runs until the next instruction is the first of a function. The function is named by its path from the crate on.
    /// At `main` the start-up code has filled SRAM, and no line of the firmware's own has run.
    ///
    /// # Errors
    /// As [`Uno::run_until`], if the ELF has no such function, and if it is not reached within `timeout_cycles`.
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

    /// Runs one instruction. If an interrupt is due, that is the first one of its handler, after the response.
    pub fn run_instruction(&mut self) -> Result<(), UnoError> {
        // A cycle is less than any instruction has.
        self.step(self.cycle() + 1)
    }

    /// Whether interrupts are served: false in a handler and in a critical section.
    pub fn interrupts_are_enabled(&self) -> bool {
        self.core.interrupts_are_enabled()
    }

    /// Where the program stands.
    pub fn place(&self) -> Place {
        self.core.place()
    }

    /// Gives the receiver a byte whose stop bit ends now, past the queue of [`Uno::send`]. Returns whether it had room.
    pub fn receive(&mut self, byte: u8) -> bool {
        self.core.receive(byte)
    }

    /// Runs one step, after applying all that is due.
    fn step(&mut self, until: u64) -> Result<(), UnoError> {
        while let Some(change) = self.to_drive.pop_front_if(|change| change.cycle <= self.core.cycle()) {
            self.set(change.pin, change.high);
        }
        while let Some(byte) = self.to_send.pop_front_if(|_| self.next_byte_ends <= self.core.cycle()) {
            // A byte is lost if the chip has no room for it.
            self.lost_bytes += u64::from(!self.core.receive(byte));
            self.next_byte_ends += self.byte_cycles();
        }
        let next_level = self.to_drive.front().map(|change| change.cycle);
        let until =
            [next_level, self.to_send.front().map(|_| self.next_byte_ends)].into_iter().flatten().fold(until, u64::min);
        self.core.step(until)
    }

    /// Sends bytes to the serial line at its pace, after those that are still queued.
    pub fn send(&mut self, bytes: &[u8]) {
        if self.to_send.is_empty() {
            self.next_byte_ends = self.next_byte_ends.max(self.cycle() + self.byte_cycles());
        }
        self.to_send.extend(bytes);
    }

    fn byte_cycles(&self) -> u64 {
        if self.follows_baud { self.core.byte_cycles() } else { SENT_BYTE_CYCLES }
    }

    /// From now on bytes are sent at the rate of the chip's UART: a bootloader may have another one than [`BAUD`].
    pub fn follow_baud(&mut self) {
        self.follows_baud = true;
    }

    /// Sent bytes that have not reached the receiver yet.
    pub fn bytes_pending(&self) -> usize {
        self.to_send.len()
    }

    /// Sent bytes that the receiver had no room for, because the firmware did not read in time.
    pub fn lost_bytes(&self) -> u64 {
        self.lost_bytes
    }

    /// Takes the bytes that have come from the firmware, with their cycles.
    pub fn received_bytes(&mut self) -> Vec<ReceivedByte> {
        std::mem::take(&mut self.core.recorder_mut().log.received)
    }

    /// Takes the firmware's output as text. Invalid UTF-8 is replaced.
    pub fn received(&mut self) -> String {
        let bytes = to_bytes(&self.received_bytes());
        String::from_utf8_lossy(&bytes).into_owned()
    }

    /// Takes the edges of the output pins out of [`Uno::changes`], so that an Uno can run for days.
    pub fn take_changes(&mut self) -> Vec<PinChange> {
        std::mem::take(&mut self.core.recorder_mut().log.changes)
    }

    /// Every edge of the output pins since the first power-up, oldest first.
    pub fn changes(&self) -> &[PinChange] {
        &self.core.recorder().log.changes
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

    /// Counts and times interrupts from now on; a second call restarts. This slows the simulation.
    pub fn measure_interrupts(&mut self) {
        self.core.recorder_mut().log.interrupts.turn_on();
    }

    /// The interrupts' statistics since [`Uno::measure_interrupts`]; `None` before it.
    pub fn interrupt_statistics(&self) -> Option<&InterruptStatistics> {
        self.core.recorder().log.interrupts.statistics.as_ref()
    }

    /// Times the main loop's turns from now on; a second call restarts. This slows the simulation.
    pub fn measure_turns(&mut self) {
        self.core.recorder_mut().log.turns.turn_on();
    }

    /// The main loop's turns since [`Uno::measure_turns`]; `None` before it.
    pub fn turns(&self) -> Option<&Cycles> {
        self.core.recorder().log.turns.turns.as_ref()
    }

    /// A variable's bytes in SRAM, by its symbol: in Rust the path from the crate on. `None` without such a symbol.
    pub fn read(&self, symbol: &str) -> Option<&[u8]> {
        let &Variable { address, size } = self.image.variables.get(symbol)?;
        self.core.sram().get(in_sram(address, size.into())?)
    }

    /// Puts bytes into a variable from its first byte on, as bits that fall over would. It is named as in [`Uno::read`].
    ///
    /// # Errors
    /// If there is no such symbol, or more bytes than it has.
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
    /// If they do not fit into SRAM, which is from 0x0100 to 0x08FF.
    pub fn write_sram(&mut self, address: u16, bytes: &[u8]) -> Result<(), UnoError> {
        let sram = self.core.sram_mut();
        let stretch = in_sram(address, bytes.len()).and_then(|stretch| sram.get_mut(stretch));
        stretch.ok_or(UnoError::NotInSram { address, length: bytes.len() })?.copy_from_slice(bytes);
        Ok(())
    }

    /// Address of the first byte behind the static data: the lower limit of the stack.
    pub fn first_stack_address(&self) -> u16 {
        core::SRAM_START + self.image.size.sram as u16
    }

    /// The most bytes that the stack has used since power-up, or since the firmware painted it. Below the deepest byte
    /// SRAM still holds one fill byte. Bytes that were never written are not counted.
    pub fn deepest_stack(&self) -> usize {
        let above = self.core.sram().get(self.image.size.sram as usize..).unwrap_or_default();
        let untouched = above.iter().take_while(|&&byte| byte == above[0]).count();
        above.len() - untouched
    }
}

/// A stretch of the data space, as indices into SRAM; `None` if it begins before SRAM.
fn in_sram(address: u16, length: usize) -> Option<Range<usize>> {
    let start = address.checked_sub(core::SRAM_START)?.into();
    Some(start..start + length)
}

fn to_bytes(received: &[ReceivedByte]) -> Vec<u8> {
    received.iter().map(|received| received.byte).collect()
}
