//! What is tried on the bench: the tool by hand, the servo's times, the wheel's ticks, and a row that is only thought of.
//!
//! All of it needs the machine in HOLD, and ends when the machine is told to do something else.

use super::{Controller, Readings, Refusal, State};
use crate::{
    calibration::{Leads, Outcome, Swings},
    classifier::Classifier,
    event::Event,
    memory::Memory,
    monitor::EncoderMonitor,
    rehearsal::Rehearsal,
    schedule::Schedule,
    servo::{self, HalfMicros},
    settings::Setting,
    speed::SpeedMeter,
    units::Wheel,
};

/// What is being tried.
#[derive(Clone, Debug, Default)]
pub(super) enum Bench {
    /// Nothing.
    #[default]
    Idle,
    /// The servo has this pulse.
    ByHand(HalfMicros),
    /// The servo swings to and fro, to be timed.
    Swings(Swings),
    /// A row that is only thought of is played.
    Row(Rehearsal),
    /// It was, and the machine does not know its place any more.
    RowEnded,
}

impl Bench {
    /// Whether the tool is where something else than the machine's decisions has put it.
    pub(super) fn moves_the_tool(&self) -> bool {
        matches!(self, Self::ByHand(_) | Self::Swings(_))
    }

    /// What is left of it when the machine goes from one state to another.
    pub(super) fn interrupted(&mut self, state: State) {
        *self = match self {
            Self::Row(_) if state == State::Work => return,
            Self::Row(_) | Self::RowEnded => Self::RowEnded,
            _ => Self::Idle,
        };
    }
}

impl<C: Classifier, M: Memory> Controller<C, M> {
    /// Gives the servo a pulse by hand, in microseconds.
    ///
    /// # Errors
    /// [`Refusal::NotInHold`], [`Refusal::AlarmLatched`], and [`Refusal::OutOfRange`] for what is no servo's pulse.
    #[inline(never)]
    pub fn servo_by_hand(&mut self, pulse_us: u16) -> Result<(), Refusal> {
        self.expect_hold()?;
        let range = Setting::ServoOutUs.description();
        if !(range.least..=range.greatest).contains(&pulse_us) {
            return Err(Refusal::OutOfRange);
        }
        self.bench = Bench::ByHand(servo::from_us(pulse_us));
        Ok(())
    }

    /// Moves the tool into the row by hand.
    ///
    /// # Errors
    /// As [`servo_by_hand`](Self::servo_by_hand).
    pub fn servo_in(&mut self) -> Result<(), Refusal> {
        self.servo_by_hand(self.settings.get(Setting::ServoInUs))
    }

    /// Ends what was tried: the tool goes out of the row.
    ///
    /// # Errors
    /// [`Refusal::NotInHold`] and [`Refusal::AlarmLatched`].
    pub fn servo_out(&mut self) -> Result<(), Refusal> {
        self.expect_hold()?;
        self.bench.interrupted(State::Hold);
        Ok(())
    }

    /// Begins to time the servo; an event tells how it ends.
    ///
    /// # Errors
    /// [`Refusal::NotInHold`] and [`Refusal::AlarmLatched`].
    pub fn calibrate_servo(&mut self) -> Result<(), Refusal> {
        self.expect_hold()?;
        let (watched, gap_ms) = (self.settings.get(Setting::EndSwitch) != 0, self.settings.get(Setting::ServoGapMs));
        self.bench = Bench::Swings(Swings::new(self.readings.now, watched, gap_ms as u8));
        Ok(())
    }

    /// Begins to measure a distance, from where the machine stands.
    ///
    /// # Errors
    /// [`Refusal::NotInHold`] and [`Refusal::AlarmLatched`].
    pub fn calibrate_start(&mut self) -> Result<(), Refusal> {
        self.expect_hold()?;
        self.distance.begin(self.readings.position);
        Ok(())
    }

    /// Sets the wheel's ticks a metre by a distance that was rolled since [`calibrate_start`](Self::calibrate_start).
    ///
    /// # Errors
    /// [`Refusal::Unfit`], [`Refusal::NotInHold`], [`Refusal::OutOfRange`] and [`Refusal::Contradiction`]; nothing is changed then.
    pub fn calibrate(&mut self, distance_mm: u16, force: bool) -> Result<(), Refusal> {
        let nominal = Wheel { ticks_per_m: 0, ..self.settings.wheel() }.ticks(1000).0 as u16;
        let ended = self.distance.end(self.readings.position, distance_mm, nominal, force);
        self.set(Setting::TicksPerM, ended.map_err(Refusal::Unfit)?)
    }

    /// Plays a row that is only thought of, at a speed in mm/s.
    ///
    /// # Errors
    /// [`Refusal::NotInHold`], [`Refusal::AlarmLatched`], [`Refusal::Contradiction`], and [`Refusal::TestSpeed`] for what
    /// the machine would not work at.
    pub fn test_row(&mut self, speed_mm_s: u16) -> Result<(), Refusal> {
        self.expect_hold()?;
        let fastest = self.settings.get(Setting::TopSpeedMmS);
        if !(Setting::TopSpeedMmS.description().least..=fastest).contains(&speed_mm_s) {
            return Err(Refusal::TestSpeed { fastest });
        }
        // What is refused leaves the machine as it was: so the ground is forgotten last.
        self.start(false)?;
        let Readings { now, position, .. } = self.readings;
        self.begin_anew(self.readings, false);
        let ticks_per_m = self.settings.wheel().ticks(1000).0 as u16;
        self.bench = Bench::Row(Rehearsal { begin: now, start: position, speed_mm_s, ticks_per_m });
        Ok(())
    }

    /// Carries on with what is being tried, before the machine decides; returns the readings that it is to decide by.
    pub(super) fn try_on(&mut self, mut readings: Readings) -> Readings {
        match &mut self.bench {
            Bench::Idle | Bench::ByHand(_) => {}
            Bench::Swings(swings) => {
                if let Some(outcome) = swings.step(readings.now, readings.end_switch_on) {
                    self.bench = Bench::Idle;
                    self.finish_swings(outcome);
                }
            }
            Bench::Row(row) => {
                let rolled_mm = row.rolled_mm(readings.now);
                readings.position = row.position(rolled_mm);
                // The encoder need not be wired, and its contacts may pick up anything.
                readings.jumps = self.readings.jumps;
                match Rehearsal::beam_is_broken(rolled_mm, self.settings.get(Setting::BeamToToolMm)) {
                    None => self.enter(State::Hold),
                    Some(broken) if broken != self.watch.is_broken() => self.take_edge(readings.position, broken),
                    Some(_) => {}
                }
            }
            Bench::RowEnded => {
                self.bench = Bench::Idle;
                self.begin_anew(readings, self.beam_broken);
            }
        }
        readings
    }

    /// Sets the leads by what was measured, if they fit, and tells how it ended.
    fn finish_swings(&mut self, outcome: Outcome) {
        let mut fits = false;
        if let Outcome::Measured(Leads { out_ms, in_ms }) = outcome {
            fits = self.set(Setting::LeadOutMs, out_ms).is_ok() && self.set(Setting::LeadInMs, in_ms).is_ok();
        }
        self.announce(Event::Calibrated { outcome, fits });
    }

    /// Forgets all ground: the machine is somewhere else than it knows.
    fn begin_anew(&mut self, readings: Readings, broken: bool) {
        let Readings { now, position, jumps, .. } = readings;
        self.meter = SpeedMeter::new(position, now);
        self.encoder = EncoderMonitor::new(now, position, jumps);
        self.leads = super::Leads::default();
        self.watch.restart(position, broken);
        self.schedule = Schedule::new(position);
        self.last_plant = position;
        self.last_seen = position;
        self.readings.position = position;
    }

    #[inline(never)]
    fn expect_hold(&self) -> Result<(), Refusal> {
        match self.state {
            State::Hold => Ok(()),
            State::Work => Err(Refusal::NotInHold),
            State::Alarm(_) => Err(Refusal::AlarmLatched),
        }
    }
}
