//! The ATmega328P on simavr: the only module that makes a chip and runs it. The callbacks from C are in
//! [`recorder`], and those for writes of registers in [`timer`] and [`eeprom`].
//!
//! [`Core`] owns a simavr instance and the [`Recorder`] that simavr's callbacks write to. It gives the rest of
//! [`super`] safe calls: one step, levels in, edges and bytes out. It works with port bits, cycles and bytes. Queues
//! and the pace of a terminal belong to [`super::Uno`].
//!
//! # Memory
//!
//! Each chip has two allocations: simavr's `avr_t`, made by its `mega328`, and the recorder, a leaked box.
//! Only `Drop` frees them. simavr holds the recorder's address, or that of its timer or EEPROM, as its callbacks'
//! parameter. simavr calls the callbacks only from inside the functions that this file calls. None of those calls is
//! made while a reference into the recorder or into `avr_t` is alive. simavr keeps no state outside `avr_t` except its
//! logger, which is never replaced here. So chips in several threads do not interfere.

pub(crate) mod adc;
mod chip;
mod eeprom;
pub(crate) mod measuring;
pub(crate) mod recorder;
mod timer;
mod uart;

use self::adc::{ADC_CHANNELS, SUPPLY_MILLIVOLTS};
use self::chip::Chip;
use self::eeprom::Eeprom;
use self::measuring::Place;
use self::recorder::{
    Callback, Log, PORTS, Port, Recorder, ResetCause, TIMER_OUTPUTS, on_interrupt, on_reset, on_sample, on_transmit,
};
use self::timer::Timer1;
use crate::error::UnoError;
use crate::memory::{EEPROM_BYTES, FLASH_BYTES};
use crate::pins::{CYCLES_PER_SECOND, Pin};
use simavr_ffi as simavr;
use std::ffi::c_void;
use std::ptr::{self, NonNull};
use std::{mem, slice};

unsafe extern "C" {
    /// Runs the next instruction. It is declared in sim_core.h, which simavr-ffi leaves out of its bindings.
    pub(crate) fn avr_run_one(avr: *mut simavr::avr_t) -> simavr::avr_flashaddr_t;

    /// The ATmega328P. simavr's search by name reads beyond the names of a chip that has four, and takes what lies there for
    /// more names: on arm64 it finds the ATmega324 that way.
    static mega328: simavr::avr_kind_t;
}

/// Highest interrupt vector of the ATmega328P (data sheet, table 12-6, counted from 0).
const LAST_VECTOR: u8 = 25;

/// Cycles that the core stays halted when an interrupt wakes it (data sheet, section 7.7.1).
const WAKE_UP_CYCLES: u64 = 4;

/// First address of SRAM in the data space, and its size (data sheet, figure 8-3).
pub(super) const SRAM_START: u16 = 0x0100;
const SRAM_BYTES: usize = 2048;

/// Default content of SRAM at power-up. A real chip's content is random. A byte other than zero reveals code that
/// expects zeros, and shows how deep the stack has been.
const SRAM_AT_POWER_UP: u8 = 0xC5;

/// The register of a reset's cause, and the watchdog's, by their addresses in the data space (data sheet, register
/// summary).
const MCUSR: u16 = 0x54;
const WDTCSR: u16 = 0x60;

/// WDTCSR's bits: a timeout resets the chip, and a timeout asks for an interrupt first.
const WDE: u8 = 1 << 3;
const WDIE: u8 = 1 << 6;

/// The instruction `wdr`, which feeds the watchdog.
const WDR: u16 = 0x95A8;

/// The instruction `cli`, which turns interrupts off.
const CLI: u16 = 0x94F8;

/// Cycles of a jump to itself (`rjmp`).
const LOOP_CYCLES: u64 = 2;

/// A four letter request code of simavr (`AVR_IOCTL_DEF`).
const fn request(name: &[u8; 4]) -> u32 {
    u32::from_be_bytes(*name)
}

/// An ATmega328P.
pub(super) struct Core {
    chip: Chip,
    recorder: NonNull<Recorder>,
    /// The last step left the chip asleep.
    asleep: bool,
    /// Address in flash at which the main program loops for ever.
    stalled_at: Option<u32>,
}

// SAFETY: a chip uses only its own two allocations (see the module's text) and is tied to no thread. `Core` has no
// shared access that changes it, so moving it moves the only user.
unsafe impl Send for Core {}

impl Core {
    /// A chip after power-up, at `cycle`, with `flash` and `eeprom` written from address 0. Both must fit;
    /// [`crate::elf::Image`] and [`super::Uno`] ensure this. It starts at `reset_address` in flash, now and after every
    /// reset. Its events are appended to `log`.
    pub(super) fn new(flash: &[u8], eeprom: &[u8], reset_address: u32, cycle: u64, log: Log) -> Core {
        // SAFETY: simavr never changes it, and its function takes nothing.
        let avr = unsafe { mega328.make.map_or(ptr::null_mut(), |make| make()) };
        assert!(!avr.is_null(), "simavr makes the chip unless memory has run out");

        // SAFETY: `avr` was just made and no other code has its address. `avr_init` is called once, after the clock was
        // set as it requires. `data` and `flash` are then simavr's, of `ramend + 1` and `flashend + 1` bytes, and
        // `flash` fits.
        let chip = unsafe {
            (*avr).frequency = CYCLES_PER_SECOND as u32;
            simavr::avr_init(avr);
            ptr::copy_nonoverlapping(flash.as_ptr(), (*avr).flash, flash.len());
            (*avr).codeend = flash.len() as u32;
            (*avr).reset_pc = reset_address;
            (*avr).pc = reset_address;
            (*avr).cycle = cycle;
            for voltage in [&raw mut (*avr).vcc, &raw mut (*avr).avcc, &raw mut (*avr).aref] {
                *voltage = SUPPLY_MILLIVOLTS.into();
            }
            Chip::of(avr)
        };

        let recorder = NonNull::from(Box::leak(Box::new(Recorder {
            chip,
            timer: Timer1::of(chip),
            eeprom: Eeprom::of(chip),
            millivolts: [0; ADC_CHANNELS],
            timer_levels: Default::default(),
            driven_high: Default::default(),
            log,
            reset_at: None,
        })));
        let parameter = recorder.as_ptr().cast::<c_void>();

        // SAFETY: `avr` is valid and initialised. Each `avr_io_getirq` names a peripheral that the chip
        // has, and simavr ignores a null for a vector that it lacks. The callbacks get the address of the recorder,
        // its timer or its EEPROM, which stays valid until `Drop` has ended the chip.
        unsafe {
            (*avr).custom.data = parameter;
            (*avr).reset = Some(on_reset);
            (*uart::of(chip)).flags = 0;
            let listen = |peripheral: u32, line: u32, callback: Callback| {
                let line = simavr::avr_io_getirq(avr, peripheral, line as i32);
                simavr::avr_irq_register_notify(line, Some(callback), parameter);
            };
            for (name, callback) in PORTS {
                listen(port_request(name), simavr::IOPORT_IRQ_REG_PORT, callback);
                listen(port_request(name), simavr::IOPORT_IRQ_DIRECTION_ALL, callback);
            }
            for output in TIMER_OUTPUTS {
                listen(request(&output.timer), simavr::TIMER_IRQ_OUT_COMP + output.output, output.callback);
            }
            listen(request(b"adc0"), simavr::ADC_IRQ_OUT_TRIGGER, on_sample);
            listen(request(b"uar0"), simavr::UART_IRQ_OUTPUT, on_transmit);
            let (timer, eeprom) = (&raw mut (*recorder.as_ptr()).timer, &raw mut (*recorder.as_ptr()).eeprom);
            chip.replace_writer(timer::OCR1AL, timer::on_compare_write, timer.cast());
            chip.replace_writer(timer::ICR1L, timer::on_top_write, timer.cast());
            chip.replace_writer(timer::TCNT1L, timer::on_counter_write, timer.cast());
            chip.replace_writer(eeprom::EECR, eeprom::on_control_write, eeprom.cast());
            for vector in 1..=LAST_VECTOR {
                let irq = simavr::avr_get_interrupt_irq(avr, vector);
                if !irq.is_null() {
                    let running = irq.add(simavr::AVR_INT_IRQ_RUNNING as usize);
                    simavr::avr_irq_register_notify(running, Some(on_interrupt), parameter);
                }
            }
        }

        let mut core = Core { chip, recorder, asleep: false, stalled_at: None };
        core.sram_mut().fill(SRAM_AT_POWER_UP);
        core.copy_eeprom(b"eesp", &mut eeprom.to_vec());
        core
    }

    pub(super) fn cycle(&self) -> u64 {
        self.chip.cycle()
    }

    /// Address of the next instruction, in bytes.
    pub(super) fn program_counter(&self) -> u32 {
        // SAFETY: the chip is valid for as long as `self` is, and simavr is not running.
        unsafe { (*self.chip.avr()).pc }
    }

    pub(super) fn recorder(&self) -> &Recorder {
        // SAFETY: the recorder is valid for as long as `self` is. simavr is its only other user, and runs only in
        // methods that borrow `self` mutably.
        unsafe { self.recorder.as_ref() }
    }

    pub(super) fn recorder_mut(&mut self) -> &mut Recorder {
        // SAFETY: as in `recorder`.
        unsafe { self.recorder.as_mut() }
    }

    pub(super) fn is_in_handler(&self) -> bool {
        // SAFETY: as in `program_counter`.
        unsafe { (*self.chip.avr()).interrupts.running_ptr > 0 }
    }

    /// Whether interrupts are served: the I bit of the status register.
    pub(super) fn interrupts_are_enabled(&self) -> bool {
        // SAFETY: as in `program_counter`.
        unsafe { (*self.chip.avr()).sreg[simavr::S_I as usize] != 0 }
    }

    pub(super) fn place(&self) -> Place {
        match self.next_instruction() {
            _ if self.is_in_handler() => Place::InHandler,
            CLI => Place::BeforeCriticalSection,
            _ => Place::InMain,
        }
    }

    /// Makes the main program jump to its present address for ever. Handlers still run. No handler may be running now.
    pub(super) fn stall(&mut self) {
        self.stalled_at = Some(self.program_counter());
    }

    /// Serves a pending interrupt, runs an instruction or sleeps, and updates the peripherals. Several instructions may
    /// run in one step. A step passes `until` at most by the length of its last instruction.
    ///
    /// # Errors
    /// If the firmware crashed or halted for good.
    pub(super) fn step(&mut self, until: u64) -> Result<(), UnoError> {
        let avr = self.chip.avr();
        let Log { interrupts, turns, .. } = &self.recorder().log;
        let (measuring, counting_turns) = (interrupts.statistics.is_some(), turns.turns.is_some());
        let one_by_one = measuring || counting_turns || self.stalled_at.is_some();
        // SAFETY: the chip is valid, this is the only place that runs it, and no reference into it or into the recorder
        // is alive while it runs. This is `avr_callback_run_raw` without its two waits on the PC's clock.
        unsafe {
            self.add_wake_up();
            uart::hand_over_received(self.chip);
            if (*avr).interrupt_state != 0 {
                simavr::avr_service_interrupts(avr);
            }
            // To observe every instruction, the limit is the shortest possible.
            let limit = match one_by_one {
                true => 1,
                false => until.saturating_sub((*avr).cycle).max(1),
            };
            (*avr).run_cycle_limit = limit;
            (*avr).run_cycle_count = (*avr).run_cycle_count.min(limit);

            if (*avr).state as u32 == simavr::cpu_Running {
                if counting_turns && self.next_instruction() == WDR {
                    self.recorder_mut().log.turns.watchdog_is_fed((*avr).cycle);
                }
                if self.stalled_at == Some((*avr).pc) && !self.is_in_handler() {
                    (*avr).cycle += LOOP_CYCLES;
                } else {
                    (*avr).pc = avr_run_one(avr);
                }
            }
            let until_next_timer = simavr::avr_cycle_timer_process(avr);
            match (*avr).state as u32 {
                simavr::cpu_Running => self.add_wake_up(),
                simavr::cpu_Sleeping if !self.interrupts_are_enabled() && !self.watchdog_resets() => {
                    return Err(UnoError::Halted { cycle: (*avr).cycle, program_counter: (*avr).pc });
                }
                simavr::cpu_Sleeping => {
                    self.asleep = true;
                    let rest = until.saturating_sub((*avr).cycle);
                    let slept = until_next_timer.min(rest).max(1);
                    (*avr).cycle += slept;
                    self.recorder_mut().log.turns.slept(slept);
                }
                _ => return Err(UnoError::Crashed { cycle: (*avr).cycle, program_counter: (*avr).pc }),
            }
        }
        self.finish_reset(ResetCause::Watchdog);
        if measuring {
            let (cycle, enabled) = (self.cycle(), self.interrupts_are_enabled());
            self.recorder_mut().log.interrupts.interrupts_enabled(enabled, cycle);
        }
        Ok(())
    }

    /// Whether the watchdog resets the chip when it runs out.
    fn watchdog_resets(&self) -> bool {
        self.chip.read(WDTCSR) & (WDE | WDIE) == WDE
    }

    /// Halts the core for a moment after a wake-up, by a pin between two steps or by a peripheral in the last step.
    fn add_wake_up(&mut self) {
        // SAFETY: as in `program_counter`.
        let chip = unsafe { &mut *self.chip.avr() };
        if self.asleep && chip.state as u32 == simavr::cpu_Running {
            chip.cycle += WAKE_UP_CYCLES;
            self.asleep = false;
        }
    }

    /// Resets the chip, for another cause than power-on.
    pub(super) fn reset(&mut self, cause: ResetCause) {
        // simavr keeps the bits of MCUSR over a reset.
        self.chip.set(MCUSR, self.chip.read(MCUSR) | cause as u8);
        // SAFETY: as in `step`.
        unsafe { simavr::avr_reset(self.chip.avr()) };
        self.finish_reset(cause);
    }

    /// Leaves the byte that is being written to the EEPROM as a power failure now does.
    pub(super) fn tear_eeprom(&mut self) {
        let mut content = self.eeprom();
        self.copy_eeprom(b"eesp", &mut content);
        self.recorder_mut().eeprom.stop();
    }

    /// The first word of the next instruction.
    fn next_instruction(&self) -> u16 {
        // SAFETY: as in `program_counter`; simavr's flash has room behind its last word. The program counter lies inside it,
        // because otherwise the chip has crashed before.
        unsafe {
            let avr = self.chip.avr();
            let word = (*avr).flash.add((*avr).pc as usize);
            u16::from_le_bytes([*word, *word.add(1)])
        }
    }

    /// Replaces the chip by one that powers up now, with the same flash, EEPROM, recorded events and input levels.
    pub(super) fn power_cycle(&mut self) {
        let (eeprom, cycle) = (self.eeprom(), self.cycle());
        // SAFETY: as in `program_counter`.
        let reset_address = unsafe { (*self.chip.avr()).reset_pc };
        let recorder = self.recorder_mut();
        recorder.restart(cycle, ResetCause::PowerOn);
        let (log, millivolts) = (mem::take(&mut recorder.log), recorder.millivolts);
        let mut fresh = Core::new(self.flash(), &eeprom, reset_address, cycle, log);
        fresh.recorder_mut().millivolts = millivolts;
        for (pin, high) in self.held_inputs() {
            fresh.set_input(pin, high);
        }
        *self = fresh;
    }

    /// Corrects simavr after a reset: it sets its clock to 0, keeps its ports' values, and forgets the
    /// inputs' levels.
    fn finish_reset(&mut self, cause: ResetCause) {
        let Some(cycle) = self.recorder_mut().reset_at.take() else {
            return;
        };
        self.asleep = false;
        self.stalled_at = None;
        // SAFETY: as in `step`. The watchdog's timer, the only one that can run now, was set from this cycle.
        unsafe {
            (*self.chip.avr()).cycle = cycle;
            eeprom::go_on(self.chip, &raw mut (*self.recorder.as_ptr()).eeprom);
            // A port reports no value that it had before the reset, although its registers are 0 now.
            for (name, _) in PORTS {
                let lines = (*Port::peripheral(self.chip, name)).io.irq;
                for line in [simavr::IOPORT_IRQ_REG_PORT, simavr::IOPORT_IRQ_DIRECTION_ALL] {
                    (*lines.add(line as usize)).value = 0;
                }
            }
        }
        timer::stop_all(self.chip, &self.recorder().timer);
        self.recorder_mut().restart(cycle, cause);
        for (pin, high) in self.held_inputs() {
            self.set_input(pin, high);
        }
    }

    /// The pins with an external level, and that level.
    fn held_inputs(&self) -> Vec<(Pin, bool)> {
        let held = |pin: Pin| {
            let (port, bit) = pin.port_and_bit();
            // SAFETY: as in `program_counter`.
            let external = unsafe { (*Port::peripheral(self.chip, port)).external };
            (external.pull_mask & 1 << bit != 0).then_some((pin, external.pull_value & 1 << bit != 0))
        };
        Pin::ALL.into_iter().filter_map(held).collect()
    }

    /// Sets the external level of an input pin from now on.
    pub(super) fn set_input(&mut self, pin: Pin, high: bool) {
        let (port, bit) = pin.port_and_bit();
        let avr = self.chip.avr();
        // SAFETY: as in `step`.
        unsafe {
            // Only so, simavr raises the pin to this level, not to its pull-up's, when the firmware writes the port.
            let external = &raw mut (*Port::peripheral(self.chip, port)).external;
            (*external).pull_mask |= 1 << bit;
            (*external).pull_value = (*external).pull_value & !(1 << bit) | u8::from(high) << bit;
            if Port::of(self.chip, port).direction & 1 << bit == 0 {
                let line = simavr::avr_io_getirq(avr, port_request(port), bit.into());
                simavr::avr_raise_irq(line, high.into());
            }
        }
    }

    /// The level that the firmware drives the pin to; `None` if it is an input.
    pub(super) fn output(&self, pin: Pin) -> Option<bool> {
        let (port, bit) = pin.port_and_bit();
        (Port::of(self.chip, port).direction & 1 << bit != 0).then(|| self.recorder().is_driven_high(pin))
    }

    /// The level that the firmware reads at an input.
    pub(super) fn input(&self, pin: Pin) -> bool {
        let (port, bit) = pin.port_and_bit();
        Port::of(self.chip, port).pins & 1 << bit != 0
    }

    pub(super) fn receive(&mut self, byte: u8) -> bool {
        uart::receive(self.chip, byte)
    }

    /// The EEPROM's content after a power failure now.
    pub(super) fn eeprom(&self) -> Vec<u8> {
        let mut content = vec![0; EEPROM_BYTES];
        self.copy_eeprom(b"eegp", &mut content);
        self.recorder().eeprom.tear(&mut content, self.cycle());
        content
    }

    /// Copies from the EEPROM's address 0 to `content` (request `eegp`), or the other way (`eesp`).
    fn copy_eeprom(&self, name: &[u8; 4], content: &mut [u8]) {
        let mut description =
            simavr::avr_eeprom_desc_t { ee: content.as_mut_ptr(), offset: 0, size: content.len() as u32 };
        // SAFETY: `description` names a buffer and its size; simavr copies, and refuses an empty or too long buffer. No
        // reference into the EEPROM exists.
        unsafe { simavr::avr_ioctl(self.chip.avr(), request(name), (&raw mut description).cast()) };
    }

    /// The whole flash, with the changes by the firmware or its bootloader.
    pub(super) fn flash(&self) -> &[u8] {
        // SAFETY: simavr owns `flash`, of `flashend + 1` bytes, and changes it only in methods that borrow `self` mutably.
        unsafe { slice::from_raw_parts((*self.chip.avr()).flash, FLASH_BYTES) }
    }

    pub(super) fn byte_cycles(&self) -> u64 {
        uart::cycles_per_byte(self.chip)
    }

    pub(super) fn sram(&self) -> &[u8] {
        // SAFETY: SRAM lies inside `data`, which simavr owns and changes only in methods that borrow `self` mutably.
        unsafe { slice::from_raw_parts((*self.chip.avr()).data.add(SRAM_START.into()), SRAM_BYTES) }
    }

    pub(super) fn sram_mut(&mut self) -> &mut [u8] {
        // SAFETY: as in `sram`, and `self` is borrowed mutably.
        unsafe { slice::from_raw_parts_mut((*self.chip.avr()).data.add(SRAM_START.into()), SRAM_BYTES) }
    }
}

impl Drop for Core {
    fn drop(&mut self) {
        // SAFETY: both were allocated in `new`, the chip by simavr's malloc, which leaves freeing `avr_t` itself to its
        // maker. Neither is used after this.
        unsafe {
            simavr::avr_terminate(self.chip.avr());
            libc::free(self.chip.avr().cast());
            drop(Box::from_raw(self.recorder.as_ptr()));
        }
    }
}

/// simavr's request code for the lines of a port.
const fn port_request(name: char) -> u32 {
    request(&[b'i', b'o', b'g', name as u8])
}
