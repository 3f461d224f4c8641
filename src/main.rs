//! The weeder's firmware: setup, and the loop that reads, decides and applies.
//!
//! The crate `control` decides. Each file beside this one drives one peripheral and its interrupt; interrupts only count, stamp or
//! move bytes. Only this file uses them all. The loop never waits for the serial line, the field, or an EEPROM write. It sleeps
//! until an interrupt brings something new.

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
mod idle;
mod loop_bound;
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
    measure::{
        readings::{Edge, Readings},
        reset::Cause,
    },
    say::{Console, command::LineBuffer},
    units::Position,
    weeder::{Controller, Uninit},
};
use eeprom::Eeprom;
use embedded_hal::digital::{InputPin, OutputPin};
use embedded_hal_nb::serial::Read;
use ufmt::uWrite;

/// The decisions, with this machine's classifier and memories.
type Weeder = Controller<Nearest<examples::BuiltIn, Eeprom>, Eeprom>;
type UninitWeeder = Uninit<Nearest<examples::BuiltIn, Eeprom>, Eeprom>;

/// Most bytes that a turn reads or writes: more than the line carries in that time.
const CONSOLE_BYTES: u8 = 8;

#[avr_device::entry]
fn main() -> ! {
    let (console, uninit, typed) = (&raw mut CONSOLE, &raw mut UNINIT, &raw mut TYPED);
    // SAFETY: no other code names these statics, and the entry point runs once.
    let (console, uninit, typed) = unsafe { (&mut *console, &mut *uninit, &mut *typed) };
    // In a stack frame of its own: bytes more than 63 from a frame's end take five more instructions to access.
    run(typed, console, uninit)
}

static mut CONSOLE: Console = Console::new();

static mut TYPED: LineBuffer = LineBuffer::new();

static mut UNINIT: UninitWeeder = {
    // SAFETY: only the entry point takes the static, once, and passes it to the loop.
    let (settings, examples) = unsafe { (Eeprom::new(), Eeprom::new()) };
    Uninit::new(Nearest::new(examples::BuiltIn, examples), settings)
};

/// Sets up the peripherals and runs the loop.
#[inline(never)]
fn run(typed: &mut LineBuffer, console: &mut Console, uninit: &mut UninitWeeder) -> ! {
    // SAFETY: the entry point is the first code to run, and runs once, so no other code holds the peripherals.
    let peripherals = unsafe { Peripherals::steal() };
    // Before the first interrupt, because the handlers overwrite GPIOR2.
    let cause = reset::cause(&peripherals.CPU);
    let board::Pins { mut lamp, mut work_switch, mut end_switch } = board::pins(&peripherals.PORTB, &peripherals.PORTD);
    let clock = clock::Clock::new(peripherals.TC0);
    encoder::watch(&peripherals.EXINT, &peripherals.PORTD, &peripherals.CPU);
    let beam = beam::Beam::new(&peripherals.EXINT, &peripherals.PORTB);
    let mut serial = serial::Serial::new(peripherals.USART0);
    idle::allow(&peripherals.CPU);
    watchdog::start();
    // SAFETY: each interrupt's peripheral is set up, and no critical section is open.
    unsafe { interrupt::enable() };

    let mut stack = stack::Stack::new();
    let mut read = move |readings: &mut Readings| {
        readings.now = clock.now();
        let encoder::Counts { position, lost, jumps } = encoder::counts();
        (readings.position, readings.lost, readings.jumps) = (Position::new(position), lost, jumps);
        let (Ok(switch_on), Ok(end_switch_on)) = (work_switch.is_low(), end_switch.is_low());
        (readings.switch_on, readings.end_switch_on) = (switch_on, end_switch_on);
        readings.stack_free = stack.free();
    };
    eeprom::finish(&peripherals.EEPROM);
    read(uninit.readings());
    let controller = init(uninit, beam.are_broken().0, cause);
    // The pulse for "tool out" is a setting, so the servo starts after the settings are loaded.
    let mut servo = servo::Servo::new(peripherals.TC1, &peripherals.PORTB, controller.pulse());

    'turn: loop {
        watchdog::feed();
        idle::begin_turn();
        // Read first: an edge that is still queued then has no later position than the next readings.
        read(controller.next_readings());
        let is_new = beam.watch_second(controller.has_second_beam());
        // Read before the edges. Then all edges queued before the loss come first, and none follows the level read at the end.
        let lost = beam::take_lost();
        // At most as many as the queue holds, so that edges which keep coming cannot stop the loop.
        for _ in 0..beam::SLOTS as u8 {
            loop_bound::at_most::<{ beam::SLOTS as u8 + 1 }>();
            let Some(edge) = beam::next_edge() else { break };
            controller.take_edge(edge);
        }
        if lost {
            let (broken, second_broken) = beam.are_broken();
            controller.take_edge(Edge::Lost { broken, second_broken });
        }
        if is_new {
            let (broken, second_broken) = beam.are_broken();
            controller.take_edge(Edge::Seen { position: controller.readings().position, broken, second_broken });
        }
        let orders = controller.step();
        reset::keep(controller.works_or_did());
        if controller.has_heartbeat() {
            heartbeat::beat(orders.pulse_out);
        }
        servo.command(orders.pulse, orders.gap_ms);
        let Ok(()) = lamp.set_state(controller.lamp_is_lit().into());

        // A turn has time for one of these: a long calculation, some bytes of the console, or one step of its work.
        if controller.catch_up() {
            continue;
        }
        for _ in 0..CONSOLE_BYTES {
            loop_bound::at_most::<CONSOLE_BYTES>();
            if serial.room() > 0
                && let Some(byte) = console.next_byte()
            {
                // The room was just checked.
                let _ = serial.write_char(byte.into());
            } else if console.listens()
                && let Ok(byte) = serial.read()
            {
                if typed.collect(byte) {
                    console.take(typed, controller);
                    break;
                }
            } else {
                if console.carry_on(controller) {
                    continue 'turn;
                }
                break;
            }
        }
        idle::sleep();
    }
}

/// Starts the controller with the EEPROM's contents. A separate function, so that its stack frame is not part of the loop's.
#[inline(never)]
fn init(uninit: &mut UninitWeeder, beam_broken: bool, cause: Cause) -> &mut Weeder {
    uninit.init(beam_broken, cause, reset::was_working())
}
