//! Minutes of the real ELF on the virtual Uno: short rows, with a fault somewhere in each.
//!
//! Half of the machines have a second beam, and now and then one of the beams misses a plant. Each wheel slips.
//!
//! After a reset the firmware is in HOLD, and the operator lets it roll to the end of the row. From there on no plant
//! may be harmed. Rows with a faulty encoder are checked only for their alarms.

use crate::decisions::{MISSED_ONCE_IN, PLANTING};
use crate::tally::{Plan, SoakError, Tally, chance, count, total};
use field::machine::{Machine, cycle_at, time_at_s};
use field::motion::mm_s;
use field::planting::Planting;
use field::row::Row;
use field::trial::Trial;
use field::verdict::{Timing, Verdict, judge};
use field::wheel::most_slip;
use field::wiring;
use rand::{Rng, RngExt};
use rand_chacha::ChaCha8Rng;
use std::path::Path;
use trial::console::ask;
use trial::{TrialError, boot, set_up};
use uno::{CYCLES_PER_SECOND, Pin, PinChange, Pulse};
use uno::{Uno, UnoError};

/// Plants and tall weeds in a row.
const PLANTS: usize = 8;
const WEEDS: usize = 2;

/// Distances of the tool and of a second beam: the tool swings out between them at 3 km/h.
const TWO_BEAMS_MM: (f64, f64) = (500.0, 200.0);

/// The longest time from a reset until the tool is out: the firmware starts, and the servo swings.
const RESTART_S: f64 = 0.7;

/// Longest time from a reset to the greeting.
const GREETING_CYCLES: u64 = CYCLES_PER_SECOND;

/// The fault of a row.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
enum Fault {
    Reset,
    BrownOut,
    PowerCut,
    SerialNoise,
    Dust,
    EncoderJumps,
    DeadEncoder,
    SpoiledEeprom,
}

impl Fault {
    const ALL: [Self; 8] = [
        Self::Reset,
        Self::BrownOut,
        Self::PowerCut,
        Self::SerialNoise,
        Self::Dust,
        Self::EncoderJumps,
        Self::DeadEncoder,
        Self::SpoiledEeprom,
    ];

    const fn name(self) -> &'static str {
        match self {
            Self::Reset => "reset",
            Self::BrownOut => "brown_out",
            Self::PowerCut => "power_cut",
            Self::SerialNoise => "serial_noise",
            Self::Dust => "dust",
            Self::EncoderJumps => "encoder_jumps",
            Self::DeadEncoder => "dead_encoder",
            Self::SpoiledEeprom => "spoiled_eeprom",
        }
    }
}

/// Works for this many simulated minutes with the firmware at `elf`. `progress` gets the share done, from 0 to 1.
///
/// # Errors
/// If a row does not grow, or the firmware does not answer.
pub fn minutes(plan: Plan, minutes: f64, elf: &Path, mut progress: impl FnMut(f64)) -> Result<Tally, SoakError> {
    let rows = rows(plan, minutes)?;
    total((0..rows).map(|number| {
        let tally = row(plan, number, elf)?;
        progress((number + 1) as f64 / rows as f64);
        Ok(tally)
    }))
}

/// The number of rows that take at least this many minutes.
///
/// # Errors
/// If a row does not grow.
pub fn rows(plan: Plan, minutes: f64) -> Result<u64, SoakError> {
    let (mut rows, mut seconds) = (0, 0.0);
    while seconds < minutes * 60.0 {
        seconds += draw(&mut chance(plan, rows))?.motion.duration_s();
        rows += 1;
    }
    Ok(rows)
}

/// Works a row of a soak, with this number from 0, with the firmware at `elf`. Each row has a new Uno, because an Uno
/// stores every pulse.
///
/// # Errors
/// As [`minutes`].
pub fn row(plan: Plan, number: u64, elf: &Path) -> Result<Tally, SoakError> {
    let mut tally = Tally::default();
    work(&mut chance(plan, number), plan, elf, &mut tally)?;
    tally.violations = tally.violations.iter().map(|what| format!("row {}, {what}", number + 1)).collect();
    Ok(tally)
}

/// Draws a row and the speed in it.
fn draw(rng: &mut ChaCha8Rng) -> Result<Trial, SoakError> {
    let row = Planting { plants: PLANTS, weeds: WEEDS, ..PLANTING }.grow(rng.random())?;
    let mut machine = Machine::default();
    if rng.random() {
        (machine.beam_to_tool_mm, machine.second_beam_mm) = TWO_BEAMS_MM;
    }
    let timing = Timing::default();
    let mut trial = Trial::at_speed(row, machine, timing, mm_s(rng.random_range(1.0..3.0)));
    let most = most_slip(timing.margin_mm.into(), machine.beam_to_tool_mm);
    trial.motion = trial.motion.with_slip(|| rng.random_range(-most..=most));
    Ok(trial)
}

/// The row as each beam sees it. Now and then one of two beams misses a canopy.
fn seen(rng: &mut ChaCha8Rng, trial: &Trial) -> [Row; 2] {
    let canopies = trial.row.things();
    let beams = if trial.machine.has_second_beam() { 2 } else { 0 };
    let missed: Vec<usize> = canopies.iter().map(|_| rng.random_range(0..MISSED_ONCE_IN)).collect();
    [0, 1].map(|beam| {
        let seen = canopies.iter().zip(&missed).filter(|&(_, &missed)| missed != beam || missed >= beams);
        Row::new(seen.map(|(canopy, _)| canopy.clone()).collect()).expect("a part of a row is a row")
    })
}

fn work(rng: &mut ChaCha8Rng, plan: Plan, elf: &Path, tally: &mut Tally) -> Result<(), SoakError> {
    let trial = draw(rng)?;
    let (machine, motion) = (trial.machine, &trial.motion);
    // The chance of a fault during this row.
    let fails = rng.random_bool((plan.faults_an_hour * motion.duration_s() / 3600.0).min(1.0));
    let fault = fails.then(|| Fault::ALL[rng.random_range(0..Fault::ALL.len())]);
    if let Some(fault) = fault {
        count(&mut tally.faults, fault.name());
    }

    let [first, second] = seen(rng, &trial);
    let is_of_second = |change: &PinChange| change.pin == wiring::SECOND_BEAM;
    let with_one_beam = Machine { second_beam_mm: 0.0, ..machine };
    let mut beams = with_one_beam.beams_before(&first, motion);
    beams.extend(machine.beams_before(&second, motion).into_iter().filter(is_of_second));
    let mut uno = boot(elf, &beams).map_err(TrialError::from)?;
    set_up(&trial, &mut uno).map_err(TrialError::from)?;
    if fault == Some(Fault::SpoiledEeprom) {
        uno = restart_with_spoiled_eeprom(rng, uno, elf, tally)?;
        set_up(&trial, &mut uno).map_err(TrialError::from)?;
    }
    for command in ["events on", "start"] {
        ask(&mut uno, command).map_err(TrialError::from)?;
    }
    uno.run_for_ms(50).map_err(TrialError::from)?;

    let start_cycle = uno.cycle();
    let fails_at_s = rng.random_range(0.2..0.9) * motion.duration_s();
    let fails_at = cycle_at(start_cycle, fails_at_s);
    let mut changes = with_one_beam.pin_changes(&first, motion, start_cycle);
    changes.extend(machine.beam_changes(&second, motion, start_cycle).into_iter().filter(is_of_second));
    changes.sort_by_key(|change| change.cycle);
    match fault {
        Some(Fault::Dust) => {
            let on_second = machine.has_second_beam() && rng.random();
            add_dust(rng, &mut changes, if on_second { wiring::SECOND_BEAM } else { wiring::BEAM }, fails_at);
        }
        Some(Fault::EncoderJumps) => jump(rng, &mut changes, fails_at),
        Some(Fault::DeadEncoder) => changes.retain(|change| change.cycle < fails_at || !is_encoder(change)),
        _ => {}
    }
    uno.drive(changes);
    uno.run_until(fails_at).map_err(TrialError::from)?;
    match fault {
        Some(Fault::Reset) => uno.reset(),
        Some(Fault::BrownOut) => uno.brown_out(),
        Some(Fault::PowerCut) => uno.power_cycle_to_noise(rng.random()),
        Some(Fault::SerialNoise) => {
            let mut noise = [0; 500];
            rng.fill_bytes(&mut noise);
            // Noise must not be a command, which might stop the machine.
            uno.send(b"\n#");
            uno.send(&noise.map(|byte| if byte == b'\n' || byte == b'\r' { b'#' } else { byte }));
            uno.send(b"\nstatus\nget\n");
        }
        _ => {}
    }
    uno.run_until(cycle_at(start_cycle, motion.duration_s())).map_err(TrialError::from)?;
    uno.run_for_ms(200).map_err(TrialError::from)?;
    let heard = uno.received();

    tally.seconds += motion.duration_s();
    tally.metres += (motion.end_mm() - motion.start_mm()).abs() / 1000.0;
    tally.rows += 1;
    heard.lines().for_each(|line| tally.hear(line));
    let was_reset = matches!(fault, Some(Fault::Reset | Fault::BrownOut | Fault::PowerCut));
    if was_reset != !uno.resets().iter().all(|reset| reset.cycle < start_cycle) {
        tally.violated(fails_at_s, format_args!("{fault:?} and resets {:?}", uno.resets()));
    }

    let pulses: Vec<Pulse> = uno.pulses(wiring::SERVO);
    if was_reset {
        still_out(&pulses, fails_at, fails_at_s, tally);
    }
    let judgement = judge(&trial.row, &machine, motion, trial.timing, &pulses, start_cycle);
    let span = trial.row.span_mm();
    tally.weeded_metres += judgement.weeded_share * (span.end - span.start) / 1000.0;
    for outcome in &judgement.plants {
        tally.plants += 1;
        if outcome.verdict != Verdict::Damaged {
            continue;
        }
        let span = outcome.plant.span_mm();
        let reached =
            motion.times_within_s(&(span.start + machine.beam_to_tool_mm..span.end + machine.beam_to_tool_mm));
        let answers_in_s = match fault {
            _ if was_reset => RESTART_S,
            _ => 0.0,
        };
        let is_unanswered =
            |times: &std::ops::Range<f64>| times.start < fails_at_s + answers_in_s && times.end > fails_at_s;
        if fault == Some(Fault::EncoderJumps) || answers_in_s > 0.0 && reached.iter().any(is_unanswered) {
            tally.blind += 1;
        } else if heard.lines().any(|line| line.starts_with("weed ") && is_of(line, &span, &trial)) {
            tally.mistaken += 1;
        } else {
            tally.harmed += 1;
            tally.violated(
                reached.first().map_or(0.0, |times| times.start),
                format_args!(
                    "a plant was harmed with {fault:?} at {fails_at_s:.3} s, at most {:.0} mm/s: {outcome:?}",
                    motion.top_speed_mm_s()
                ),
            );
        }
    }
    Ok(())
}

/// Whether an event's position lies in a plant. The motion is all forward, and the firmware counts from its beginning.
fn is_of(line: &str, span_mm: &std::ops::Range<f64>, trial: &Trial) -> bool {
    let ticks = line.split_whitespace().find_map(|word| word.strip_prefix("pos=")?.parse::<f64>().ok());
    let passings = trial.motion.mark_passings(trial.machine.tick_mm());
    ticks.and_then(|ticks| passings.get(ticks.max(0.0) as usize)).is_some_and(|passing| {
        let place_mm = trial.motion.position_mm(passing.time_s);
        (span_mm.start - 10.0..span_mm.end + 10.0).contains(&place_mm)
    })
}

/// After a reset no pulse has the tool in the row.
fn still_out(pulses: &[Pulse], since: u64, time_s: f64, tally: &mut Tally) {
    // A pulse that began before the reset may end.
    let after = pulses.iter().filter(|pulse| pulse.rise > since + CYCLES_PER_SECOND / 1000);
    if let Some(pulse) = after.into_iter().find(|pulse| (pulse.width_us() - 2000.0).abs() > 2.0) {
        let late_s = time_at_s(since, pulse.rise);
        tally.violated(time_s, format_args!("{late_s:.3} s after a reset the servo has {} us", pulse.width_us()));
    }
}

/// Saves, damages some bytes, and powers up the Uno again with them.
fn restart_with_spoiled_eeprom(
    rng: &mut ChaCha8Rng,
    mut uno: Uno,
    elf: &Path,
    tally: &mut Tally,
) -> Result<Uno, SoakError> {
    ask(&mut uno, "save").map_err(TrialError::from)?;
    let mut eeprom = uno.eeprom();
    for _ in 0..rng.random_range(1..20) {
        let address = rng.random_range(0..eeprom.len());
        eeprom[address] = rng.random();
    }
    let mut uno = Uno::boot_with_eeprom(elf, &eeprom).map_err(TrialError::from)?.wired(&wiring::WIRES);
    let greeting: Result<String, UnoError> = uno.run_until_serial("commands\r\n", GREETING_CYCLES);
    let greeting = greeting.map_err(TrialError::from)?;
    if greeting.contains("settings_lost") {
        count(&mut tally.alarms, "settings_lost");
    }
    if !greeting.contains("tool out") {
        tally.violated(tally.seconds, format_args!("with a spoiled EEPROM it starts with {greeting:?}"));
    }
    ask(&mut uno, "clear").map_err(TrialError::from)?;
    Ok(uno)
}

/// A beam flickers for a while: each flicker begins and ends with the level that was there.
fn add_dust(rng: &mut ChaCha8Rng, changes: &mut Vec<PinChange>, pin: Pin, from: u64) {
    let until = from + rng.random_range(CYCLES_PER_SECOND / 50..CYCLES_PER_SECOND / 4);
    let level_at = |changes: &[PinChange], cycle: u64| {
        changes.iter().rev().find(|change| change.pin == pin && change.cycle <= cycle).is_none_or(|change| change.high)
    };
    let mut dust = Vec::new();
    let mut cycle = from;
    while cycle < until {
        let length = CYCLES_PER_SECOND / 500;
        let is_steady = !changes.iter().any(|c| c.pin == pin && (cycle..=cycle + length).contains(&c.cycle));
        if is_steady {
            let high = level_at(changes, cycle);
            dust.push(PinChange { cycle, pin, high: !high });
            dust.push(PinChange { cycle: cycle + length, pin, high });
        }
        cycle += rng.random_range(2..6) * length;
    }
    changes.extend(dust);
    changes.sort_by_key(|change| change.cycle);
}

/// Both channels change at once, 10 to 59 times.
fn jump(rng: &mut ChaCha8Rng, changes: &mut [PinChange], from: u64) {
    let mut left = rng.random_range(10..60);
    for place in 1..changes.len() {
        let (before, change) = (changes[place - 1], changes[place]);
        if left > 0 && change.cycle > from && is_encoder(&before) && is_encoder(&change) && place % 2 == 0 {
            changes[place].cycle = before.cycle;
            left -= 1;
        }
    }
}

const fn is_encoder(change: &PinChange) -> bool {
    matches!(change.pin, wiring::ENCODER_A | wiring::ENCODER_B)
}
