//! The tester's firmware: a second Uno that drives the weeder's inputs, and measures its outputs.
//!
//! The crate `tester-core` decides. Each file beside this one drives one peripheral. The loop passes bytes between the serial line
//! and the station, and measurements to the station. Interrupts play the plan and stamp pulses.

#![no_std]
#![no_main]
#![feature(asm_experimental_arch)]
#![feature(abi_avr_interrupt)]
#![allow(missing_docs, reason = "the interrupt attribute leaves no place for a handler's doc comment")]

mod burst;
mod lines;
mod serial;
mod timeline;

use avr_device::{atmega328p::Peripherals, interrupt};
use core::panic::PanicInfo;
use lines::Lines;
use serial::Serial;
use tester_core::frame::Frame;
use tester_core::message::Record;
use tester_core::station::{Board, Station};
use timeline::Tester;

#[avr_device::entry]
fn main() -> ! {
    let station = &raw mut STATION;
    // SAFETY: no other code names this static, and the entry point runs once.
    run(unsafe { &mut *station })
}

static mut STATION: Station = Station::new();

#[inline(never)]
fn run(station: &mut Station) -> ! {
    // SAFETY: the entry point is the first code to run, and runs once, so no other code holds the peripherals.
    let peripherals = unsafe { Peripherals::steal() };
    let lines = Lines::new(peripherals.PORTB, peripherals.PORTC, peripherals.PORTD);
    let mut serial = Serial::new(peripherals.USART0);
    let mut tester = Tester::new(peripherals.TC1, lines);
    // SAFETY: each interrupt's peripheral is set up, and no critical section is open.
    unsafe { interrupt::enable() };

    let mut sending = Frame::new();
    let mut sent = 0;
    let mut lit = tester.lines.lamp_is_lit();
    loop {
        if let Some(byte) = serial.read() {
            station.take(byte, &mut tester);
        }
        let now_lit = tester.lines.lamp_is_lit();
        if now_lit != lit {
            lit = now_lit;
            station.record(Record::Led { time: tester.now(), lit });
        }
        // One record a turn: a full queue drops the newest, and the gap in the numbers shows it.
        if let Some(record) = tester.measured() {
            station.record(record);
        }
        if sent == sending.len() {
            match station.next_frame() {
                Some(frame) => (sending, sent) = (frame, 0),
                None => continue,
            }
        }
        if let Some(&byte) = sending.get(sent)
            && serial.write(byte)
        {
            sent += 1;
        }
    }
}

/// After a panic the tester is silent; the computer reports that.
#[panic_handler]
fn panic(_: &PanicInfo) -> ! {
    interrupt::disable();
    loop {
        core::hint::spin_loop();
    }
}
