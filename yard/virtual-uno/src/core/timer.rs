//! Corrections of simavr's Timer1: ICR1, and OCR1A and TCNT1 for output A.
//!
//! Only modes with ICR1 as their top take a new one (data sheet, 16.6.3). In fast and phase-correct PWM a new one sets the
//! running period (16.9.3). simavr reads ICR1 only when mode or clock change.
//!
//! simavr's writers of OCR1A and TCNT1 are replaced. In fast PWM a new OCR1A only changes the compare value of the next
//! period (data sheet, 16.9.3). A write of TCNT1 moves the counter. simavr's own writer does this exactly, but with the
//! pins disconnected and with the compare value of the running period's start. In other modes simavr's writers work
//! alone.
//!
//! Only the non-inverting output A is corrected. A counter above its top restarts at the bottom, as in simavr, also above a
//! new one.

use super::chip::{Chip, Writer};
use simavr_ffi as simavr;
use std::ffi::c_void;

// Registers by their address in the data space (data sheet, register summary).
const TCNT0: u16 = 0x46;
const TCCR1A: u16 = 0x80;
const TCCR1B: u16 = 0x81;
pub(super) const TCNT1L: u16 = 0x84;
const TCNT1H: u16 = 0x85;
pub(super) const ICR1L: u16 = 0x86;
const ICR1H: u16 = 0x87;
pub(super) const OCR1AL: u16 = 0x88;
const OCR1AH: u16 = 0x89;
const TCNT2: u16 = 0xB2;

/// TCCR1A: connections of the outputs; 0 is PORTB.
const COM1: u8 = 0b1111 << 4;
/// Bits of the mode, in TCCR1A and TCCR1B. In modes with ICR1 as their top the first is clear and the second is set.
const WGM10: u8 = 1 << 0;
const WGM13: u8 = 1 << 4;
/// TCCR1B: the clock. 0 is none, and values above [`LAST_PRESCALER`] select a pin.
const CS1: u8 = 0b111;
const LAST_PRESCALER: u8 = 5;

/// Timer1 of a chip.
pub(super) struct Timer1 {
    timer: *mut simavr::avr_timer_t,
    compare_writer: Writer,
    counter_writer: Writer,
    /// ICR1's high byte. A write of the register leaves it in simavr's before the low byte follows.
    top_high: u8,
    /// Cycles from the running period's bottom to the match of output A; 0 without a match.
    running_compare_cycles: u64,
}

impl Timer1 {
    /// A chip's Timer1. The chip's writers must not have been replaced, and it must outlive the result.
    pub(super) fn of(chip: Chip) -> Timer1 {
        Timer1 {
            timer: chip.peripheral(TCNT1L),
            compare_writer: chip.writer(OCR1AL),
            counter_writer: chip.writer(TCNT1L),
            top_high: 0,
            running_compare_cycles: 0,
        }
    }

    /// Applies a reset.
    pub(super) fn reset(&mut self) {
        self.top_high = 0;
    }

    /// Records a level of output A. In fast PWM it rises at the bottom, where OCR1A's buffer takes effect.
    pub(super) fn output_becomes(&mut self, high: bool) {
        if high {
            // SAFETY: the timer lives as long as its chip, which outlives `self`. simavr does not change it now.
            self.running_compare_cycles = unsafe { (*self.timer).comp[0].comp_cycles };
        }
    }

    /// Whether the timer runs from the chip's clock, in fast PWM with a top that is not OCR1A.
    fn is_buffered(&self, chip: Chip) -> bool {
        // SAFETY: as in `output_becomes`.
        let timer = unsafe { &*self.timer };
        has_clock(chip)
            && timer.wgm_op_mode_kind == simavr::avr_timer_wgm_fast_pwm as i32
            && timer.mode.top() != simavr::avr_timer_wgm_reg_ocra
    }
}

/// Whether Timer1 runs from the chip's clock.
fn has_clock(chip: Chip) -> bool {
    (1..=LAST_PRESCALER).contains(&(chip.read(TCCR1B) & CS1))
}

/// Stops all timers, as a reset does. simavr's reset keeps their modes and periods. The chip must not be running.
pub(super) fn stop_all(chip: Chip, timer1: &Timer1) {
    for timer in [chip.peripheral(TCNT0), timer1.timer, chip.peripheral(TCNT2)] {
        // SAFETY: TCNT0 and TCNT2 belong to the other timers, and keep their writers. No reference to a timer is alive.
        let timer = unsafe { &mut *timer };
        timer.mode = timer.wgm_op[0];
        timer.wgm_op_mode_kind = timer.mode.kind() as i32;
        timer.cs_div_value = 0;
        timer.tov_cycles = 0;
        timer.tov_top = 0;
    }
}

/// simavr's callback for a write of OCR1A's low byte; the high byte is in its register. `timer1` is the chip's.
pub(super) unsafe extern "C" fn on_compare_write(avr: *mut simavr::avr_t, register: u16, low: u8, timer1: *mut c_void) {
    // SAFETY: `timer1` is the one that `Core::new` registered, alive and not borrowed, and `avr` its chip.
    // simavr's writer may call back, so no reference into it is kept over the call.
    unsafe {
        let (chip, timer1) = (Chip::of(avr), timer1.cast::<Timer1>());
        if !(*timer1).is_buffered(chip) {
            let writer = (*timer1).compare_writer;
            return writer.write(chip, register, low);
        }
        chip.set(register, low);
        let compare = u16::from_le_bytes([low, chip.read(OCR1AH)]);
        let timer = &mut *(*timer1).timer;
        // The match of the running period is already planned. The next period uses this value.
        timer.comp[0].comp_cycles = match compare <= timer.tov_top {
            true => u64::from(timer.cs_div_value) * (u64::from(compare) + 1),
            false => 0,
        };
    }
}

/// simavr's callback for a write of ICR1's low byte; the high byte is in its register. `timer1` is the chip's.
pub(super) unsafe extern "C" fn on_top_write(avr: *mut simavr::avr_t, register: u16, low: u8, timer1: *mut c_void) {
    // SAFETY: as in `on_compare_write`.
    unsafe {
        let (chip, timer1) = (Chip::of(avr), timer1.cast::<Timer1>());
        if chip.read(TCCR1A) & WGM10 != 0 || chip.read(TCCR1B) & WGM13 == 0 {
            return chip.set(ICR1H, (*timer1).top_high);
        }
        (*timer1).top_high = chip.read(ICR1H);
        chip.set(register, low);
        let (timer, top) = ((*timer1).timer, u16::from_le_bytes([low, (*timer1).top_high]));
        let (kind, size) = ((*timer).wgm_op_mode_kind, (*timer).wgm_op_mode_size);
        let is_pwm = [simavr::avr_timer_wgm_pwm, simavr::avr_timer_wgm_fast_pwm].iter().any(|&pwm| pwm as i32 == kind);
        if !has_clock(chip) || !is_pwm {
            return;
        }
        let prescaler = u64::from((*timer).cs_div_value);
        let since_bottom = (*avr).cycle.wrapping_sub((*timer).tov_base);
        // simavr has no bottoms in a period of one cycle.
        if (*timer).tov_cycles <= 1 || since_bottom >= prescaler * (u64::from(top) + 1) {
            (*timer).tov_base = (*avr).cycle - since_bottom % prescaler;
        }
        // The running period keeps its compare value, and the next one has that of the register.
        let [next_low, next_high] = [OCR1AL, OCR1AH].map(|register| chip.read(register));
        let [running_low, running_high] = match (*timer1).running_compare_cycles {
            cycles if cycles > 0 && (*timer1).is_buffered(chip) => {
                ((cycles / prescaler) as u16).wrapping_sub(1).to_le_bytes()
            }
            _ => [next_low, next_high],
        };
        // simavr recalculates a running period when OCR1A is written in normal mode. There the mode's size is the top.
        ((*timer).wgm_op_mode_kind, (*timer).wgm_op_mode_size) = (simavr::avr_timer_wgm_normal as i32, top.into());
        let writer = (*timer1).compare_writer;
        chip.set(OCR1AH, running_high);
        writer.write(chip, OCR1AL, running_low);
        ((*timer).wgm_op_mode_kind, (*timer).wgm_op_mode_size) = (kind, size);
        chip.set(OCR1AH, next_high);
        on_compare_write(avr, OCR1AL, next_low, timer1.cast());
    }
}

/// simavr's callback for a write of TCNT1's low byte; the high byte is in its register. `timer1` is the chip's.
pub(super) unsafe extern "C" fn on_counter_write(avr: *mut simavr::avr_t, register: u16, low: u8, timer1: *mut c_void) {
    // SAFETY: as in `on_compare_write`.
    unsafe {
        let (chip, timer1) = (Chip::of(avr), timer1.cast::<Timer1>());
        let writer = (*timer1).counter_writer;
        if !(*timer1).is_buffered(chip) {
            return writer.write(chip, register, low);
        }
        let timer = (*timer1).timer;
        let counter = u16::from_le_bytes([low, chip.read(TCNT1H)]);
        let prescaler = u64::from((*timer).cs_div_value);
        let (cycle, top, next_compare_cycles, connections) =
            ((*avr).cycle, (*timer).tov_top, (*timer).comp[0].comp_cycles, chip.read(TCCR1A));

        // The prescaler runs on, so the counter has had its new value since the last timer clock.
        let since_clock = cycle.wrapping_sub((*timer).tov_base) % prescaler;
        (*avr).cycle = cycle - since_clock;
        // simavr divides the period by the top, which is one clock less.
        (*timer).tov_top = top.saturating_add(1);
        // A match in the clock after the write is blocked (data sheet, 16.7.2), and a lower one is past.
        let running = (*timer1).running_compare_cycles;
        let is_ahead = running > prescaler * (u64::from(counter) + 1);
        (*timer).comp[0].comp_cycles = if is_ahead { running } else { 0 };
        chip.set(TCCR1A, connections & !COM1);
        writer.write(chip, register, low);

        chip.set(TCCR1A, connections);
        (*timer).comp[0].comp_cycles = next_compare_cycles;
        (*timer).tov_top = top;
        (*avr).cycle = cycle;
        (*avr).run_cycle_count = (*avr).run_cycle_count.saturating_sub(since_clock).max(1);
    }
}
