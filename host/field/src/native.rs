//! The native run: weeds a row with the firmware's own decisions, compiled for the host.
//!
//! [`weed`] runs the loop of `src/main.rs` with the same [`control`] code and examples. A turn reads clock and encoder, takes
//! the beam's edges with their positions, and commands the servo. It takes a millisecond; the chip is faster. Nothing else
//! is simplified: motion, beam, encoder and servo are the same as for the virtual Uno. It is some twenty thousand times
//! faster than real time, for studies of many rows. It also returns why the tool was out, for the
//! [loss budget](crate::budget).
//!
//! It has no console, EEPROM, interrupts or cycles. The virtual Uno has.

mod sensors;
mod servo_line;
mod why;

pub(crate) use self::sensors::turns;
pub use self::sensors::{Seen, Sensors, Turn, beams_before};
pub use self::servo_line::ServoLine;

use self::why::Why;
use crate::pass::{Pass, Start, Weeded};
use control::ground::class::label;
use control::ground::examples::EXAMPLES;
use control::ground::nearest::Nearest;
use control::measure::readings::Readings;
use control::measure::reset::Cause;
use control::memory::Volatile;
use control::operate::event::Event;
use control::operate::state::State;
use control::settings::Setting;
use control::units::{Instant, Interval, Position};
use rig::{ByExamples, Rig};
use thiserror::Error;

type Weeder = Rig<ByExamples>;

/// A turn of the loop.
pub const TURN_S: f64 = 0.001;
const STEPS_A_TURN: u32 = Interval::STEPS_PER_SECOND / 1000;

/// The machine stands for 0.1 s before it rolls, so that the clock does not start at 0.
const STILL_STEPS: u32 = Interval::STEPS_PER_SECOND / 10;

/// Turns between two samples of the reasons: 3 mm at 2.5 km/h. A zone's begin and end are late by the same mean, so its
/// length is right.
const LOOK_TURNS: u32 = 4;

/// The firmware or its decisions refused a line.
#[derive(Debug, Error, PartialEq)]
#[error("the firmware answers `{command}` with `{answer}`")]
pub struct Refused {
    /// The typed line.
    pub command: String,
    /// The console's answer, which begins with `error:`.
    pub answer: String,
}

/// Weeds the pass's row with the firmware's decisions. The motion begins at time and cycle 0. `sensors` must come from this
/// pass, with turns of [`TURN_S`].
///
/// # Errors
/// If they refuse a setting or the start.
pub fn weed(pass: &Pass, sensors: &Sensors) -> Result<Weeded, Refused> {
    run(pass, sensors, false, |_| ())
}

/// The slip that the second beam measures, in thousandths, plant by plant.
///
/// # Errors
/// As [`weed`].
pub fn slips_permille(pass: &Pass, sensors: &Sensors) -> Result<Vec<i16>, Refused> {
    let mut slips = Vec::new();
    run(pass, sensors, true, |weeder| {
        while let Some(event) = weeder.next_event() {
            if let Event::Slip { permille } = event {
                slips.push(permille);
            }
        }
    })?;
    Ok(slips)
}

/// Weeds the row. Calls `listen` after each turn, with events if `is_told`.
#[inline(always)]
fn run(pass: &Pass, sensors: &Sensors, is_told: bool, mut listen: impl FnMut(&mut Weeder)) -> Result<Weeded, Refused> {
    let readings = Readings::new(instant(0), Position::new(0));
    let classifier = Nearest::new(&EXAMPLES[..], Volatile::new());
    let mut weeder: Weeder = Rig::wake_at(classifier, Volatile::new(), readings, beams_before(pass), Cause::PowerOn);
    type_line(&mut weeder, "clear")?;
    for (setting, value) in pass.firmware_settings() {
        type_line(&mut weeder, &format!("set {} {value}", setting.text()))?;
    }
    for example in &pass.examples {
        example.features.into_iter().for_each(|feature| weeder.enter_feature(feature));
        type_line(&mut weeder, if example.label == label::PLANT { "teach plant" } else { "teach weed" })?;
    }
    type_line(&mut weeder, if pass.start == Start::Now { "start now" } else { "start" })?;

    let is_guarding = weeder.settings().get(Setting::GuardSpacingMm) > 0;
    if is_guarding || is_told {
        type_line(&mut weeder, "events on")?;
    }
    let mut why = Why::of(pass, is_guarding);
    let orders = weeder.orders();
    let mut line = ServoLine::new(orders.pulse, orders.gap_ms);
    for (turn, Turn { time_s, position, edges }) in (0..=turns(pass, TURN_S)).zip(sensors.turns()) {
        for &Seen { position, beams, .. } in edges {
            weeder.edge(Position::new(position as i32), beams);
        }
        let orders = weeder.turn_with(Readings::new(instant(turn), Position::new(position as i32)));
        line.command(orders.pulse, time_s);
        listen(&mut weeder);
        if turn % LOOK_TURNS == 0 {
            why.look(&mut weeder, orders.pulse != orders.pulse_out, time_s);
        }
    }
    let (pulses, reasons) = (line.into_pulses(), why.into_reasons());
    Ok(Weeded { pulses, start_cycle: 0, alarm: weeder.state() != State::Work, reasons })
}

/// The firmware's clock in a turn.
fn instant(turn: u32) -> Instant {
    Instant::new(turn.wrapping_mul(STEPS_A_TURN).wrapping_add(STILL_STEPS))
}

fn type_line(weeder: &mut Weeder, command: &str) -> Result<(), Refused> {
    match weeder.ask(command).pop() {
        Some(answer) if answer != "ok" => Err(Refused { command: command.to_owned(), answer }),
        _ => Ok(()),
    }
}
