//! What is tried on the bench: the tool by hand, the servo's times, the wheel's ticks, and the swings of a row.
//!
//! All of it needs the machine in HOLD, where it stays, and ends when the machine is told to do something else. None of it
//! touches what the machine knows of the ground.

use super::{Controller, Refusal, State};
use crate::{
    calibration::{Leads, Outcome, Swings},
    classifier::Classifier,
    event::Event,
    memory::Memory,
    rehearsal::Rehearsal,
    servo::{self, HalfMicros},
    settings::Setting,
};

/// What is being tried.
#[derive(Clone, Debug)]
// Nothing is 0, as the memory is before anybody has woken up.
#[repr(u8)]
pub(super) enum Bench {
    /// Nothing.
    Idle,
    /// The servo has this pulse.
    ByHand(HalfMicros),
    /// The servo swings to and fro, to be timed.
    Swings(Swings),
    /// The tool swings as for a row of plants.
    Row(Rehearsal),
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
        self.bench = Bench::Idle;
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
        let nominal = self.settings.nominal_wheel().ticks(1000).0 as u16;
        let ended = self.distance.end(self.readings.position, distance_mm, nominal, force);
        self.set(Setting::TicksPerM, ended.map_err(Refusal::Unfit)?)
    }

    /// Swings the tool as for a row of plants, at a speed in mm/s.
    ///
    /// # Errors
    /// [`Refusal::NotInHold`], [`Refusal::AlarmLatched`], [`Refusal::Contradiction`], and [`Refusal::TestSpeed`] for what
    /// the machine would not work at.
    pub fn test_row(&mut self, speed_mm_s: u16) -> Result<(), Refusal> {
        self.expect_hold()?;
        self.expect_no_contradiction()?;
        let fastest = self.settings.get(Setting::TopSpeedMmS);
        if !(Setting::TopSpeedMmS.description().least..=fastest).contains(&speed_mm_s) {
            return Err(Refusal::TestSpeed { fastest });
        }
        self.bench = Bench::Row(Rehearsal::new(self.readings.now, speed_mm_s, &self.settings));
        Ok(())
    }

    /// Carries on with what is being tried; whether it has the tool out, if it says.
    pub(super) fn try_out(&mut self) -> Option<bool> {
        let now = self.readings.now;
        let out = match &mut self.bench {
            Bench::Idle | Bench::ByHand(_) => return None,
            Bench::Swings(swings) => match swings.step(now, self.readings.end_switch_on) {
                None => Some(swings.tool_out()),
                Some(outcome) => {
                    self.finish_swings(outcome);
                    None
                }
            },
            Bench::Row(row) => row.tool_out(now, self.tool_out),
        };
        if out.is_none() {
            self.bench = Bench::Idle;
        }
        out
    }

    /// Sets the leads by what was measured, if they fit, and tells how it ended.
    fn finish_swings(&mut self, outcome: Outcome) {
        let fits = match outcome {
            Outcome::Measured(Leads { out_ms, in_ms }) => {
                self.change(&[(Setting::LeadOutMs, out_ms), (Setting::LeadInMs, in_ms)]).is_ok()
            }
            _ => false,
        };
        self.announce(Event::Calibrated { outcome, fits });
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
