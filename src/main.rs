//! The weeder's firmware: wiring, and the loop that reads, decides and applies.
//!
//! The crate `control` decides, and each file beside this one knows one peripheral with its interrupt, which only counts,
//! stamps or moves bytes. This is the only file that knows them all. The loop never waits for the serial line or the
//! field, nor for a byte on its way into the EEPROM.

#![no_std]
#![no_main]
#![feature(asm_experimental_arch)]
#![allow(missing_docs, reason = "the interrupt attribute leaves no place for a handler's doc comment")]

mod beam;
mod board;
mod clock;
mod eeprom;
mod encoder;
mod examples;
mod handler;
mod heartbeat;
mod passes;
mod reset;
mod ring;
mod serial;
mod servo;
mod shared;
mod stack;
mod watchdog;

use avr_device::{atmega328p::Peripherals, interrupt};
use control::{
    ground::nearest::Nearest,
    measure::readings::{Readings, Startup},
    say::{Console, command::LineBuffer},
    units::Position,
    weeder::{Controller, Uninit},
};
use embedded_hal::digital::{InputPin, OutputPin};
use embedded_hal_nb::serial::Read;
use ufmt::uWrite;

/// The decisions, with the memories of this machine.
type Weeder = Controller<Nearest<examples::BuiltIn, eeprom::Upper>, eeprom::Lower>;
type UninitWeeder = Uninit<Nearest<examples::BuiltIn, eeprom::Upper>, eeprom::Lower>;

/// Bytes that a turn of the loop reads or writes at most: more than the line carries meanwhile.
const CONSOLE_BYTES: u8 = 8;

#[avr_device::entry]
fn main() -> ! {
    let (console, asleep) = (&raw mut CONSOLE, &raw mut ASLEEP);
    // SAFETY: nothing else names these statics, and the entry point runs once.
    let (console, asleep) = unsafe { (&mut *console, &mut *asleep) };
    // In a frame of its own: a byte that lies farther than 63 from a frame's end takes five more instructions to reach.
    run(&mut LineBuffer::new(), console, asleep)
}

static mut CONSOLE: Console = Console::new();

static mut ASLEEP: UninitWeeder = {
    // SAFETY: these are the only halves, and what holds them is taken once, by the entry point.
    let (settings, examples) = unsafe { (eeprom::Lower::new(), eeprom::Upper::new()) };
    Uninit::new(Nearest::asleep(examples::BuiltIn, examples), settings)
};

/// Sets everything up, and turns the loop.
#[inline(never)]
fn run(typed: &mut LineBuffer, console: &mut Console, asleep: &mut UninitWeeder) -> ! {
    // SAFETY: the entry point is the first code to run and runs once, as this does, so nobody else holds the peripherals.
    let peripherals = unsafe { Peripherals::steal() };
    // Before the first interrupt: their handlers use the register that told it.
    let cause = reset::cause(&peripherals.CPU);
    let board::Pins { mut lamp, mut work_switch, mut end_switch } = board::pins(&peripherals.PORTB, &peripherals.PORTD);
    let clock = clock::Clock::new(peripherals.TC0);
    encoder::watch(&peripherals.EXINT, &peripherals.PORTD, &peripherals.CPU);
    let mut beam = beam::Beam::new(&peripherals.EXINT, &peripherals.PORTB);
    let mut serial = serial::Serial::new(peripherals.USART0);
    // SAFETY: every interrupt's peripheral is set up, and no critical section is open.
    unsafe { interrupt::enable() };
    watchdog::start();

    let mut stack = stack::Stack::new();
    let mut read = move || {
        let now = clock.now();
        let encoder::Counts { position, lost, jumps } = encoder::counts();
        let (Ok(switch_on), Ok(end_switch_on)) = (work_switch.is_low(), end_switch.is_low());
        let stack_free = stack.free();
        Readings { now, position: Position::new(position), switch_on, lost, jumps, end_switch_on, stack_free }
    };
    eeprom::finish(&peripherals.EEPROM);
    let controller = init(asleep, Startup { readings: read(), beam_broken: beam.is_broken(), cause });
    // The settings say which pulse has the tool out, so there is none before they are loaded.
    let mut servo = servo::Servo::new(peripherals.TC1, &peripherals.PORTB, controller.orders().pulse);

    loop {
        watchdog::feed();
        // The readings come first: an edge that is still in the queue is then never farther than the next readings.
        let readings = read();
        beam.watch_second(controller.has_second_beam());
        let orders = controller.turn(readings, beam.edges());
        if controller.has_heartbeat() {
            heartbeat::beat(orders.pulse_out);
        }
        servo.command(orders.pulse, orders.gap_ms);
        let Ok(()) = lamp.set_state(controller.lamp_is_lit().into());

        // A turn has little time for the console: some bytes, or one thing that takes longer than a byte does. One that
        // has done enough has none.
        let bytes = if orders.turn_spent { 0 } else { CONSOLE_BYTES };
        for _ in 0..bytes {
            passes::at_most::<CONSOLE_BYTES>();
            if serial.room() > 0
                && let Some(byte) = console.next_byte()
            {
                // There is room, as was just seen.
                let _ = serial.write_char(byte.into());
            } else if console.listens()
                && let Ok(byte) = serial.read()
            {
                if typed.collect(byte) {
                    if let Some(said) = typed.read() {
                        console.take(said);
                    }
                    break;
                }
            } else {
                console.carry_on(controller);
                break;
            }
        }
    }
}

/// Wakes the decisions up, with what the EEPROM holds. A function of its own, so that the loop's stack does not hold for
/// ever what only this needs.
#[inline(never)]
fn init(asleep: &mut UninitWeeder, startup: Startup) -> &mut Weeder {
    asleep.init(startup)
}
