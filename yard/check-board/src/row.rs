//! A row: the weeder weeds it, the tester plays wheel and beam and records the pulses, and the verdict is that of
//! `weeder sim`.

use crate::plan::Plan;
use crate::servo::{self, ORIGIN};
use crate::tester::ms;
use crate::{Boards, CheckError};
use field::conditions::Conditions;
use field::pass::Pass;
use field::planting::Planting;
use field::verdict::{Judgement, judge};
use link::settings::name;
use tester_core::player::Action;
use uno::{CYCLES_PER_SECOND, Pulse};

/// The machine on the boards: guided, and set up.
const FIELD: &str = "straight";

const SEED: u64 = 1;

/// From the plan's start to the motion's, in ms: some pulses come before.
const STILL_MS: u32 = 100;

/// The result of a row.
#[derive(Clone, Debug)]
pub struct Outcome {
    /// The results for the plants and weeds.
    pub judgement: Judgement,
    /// Counts that the weeder has less than were played.
    pub lost_counts: i64,
}

/// A row as of `weeder sim`, with this number of plants and tall weeds, at a speed.
///
/// # Errors
/// If it cannot be grown.
pub fn pass(plants: usize, weeds: usize, speed_km_h: f64) -> Result<Pass, CheckError> {
    let row = |error: &dyn std::fmt::Display| CheckError::Row(error.to_string());
    let conditions = Conditions::preset(FIELD).ok_or_else(|| row(&FIELD))?.map_err(|error| row(&error))?;
    let planting = Planting { plants, canopy_scatter_mm: 22.5, weeds, ..Planting::default() };
    let stand = planting.grow_with_room(SEED).map_err(|error| row(&error))?;
    Ok(conditions.pass_at_speed(stand, field::motion::mm_s(speed_km_h), SEED))
}

/// A width this near to a setting of the servo counts as it, in us: the simulated servo follows any difference.
const SAME_WIDTH_US: f64 = 1.0;

impl Boards {
    /// Lets the weeder weed a row. Afterwards it is in hold, with unsaved settings.
    pub fn weed(&mut self, pass: &Pass) -> Result<Outcome, CheckError> {
        let Pass { row, machine, motion, .. } = pass;
        self.weeder.to_hold()?;
        for (setting, value) in pass.firmware_settings() {
            self.weeder.ask(&format!("set {} {value}", name(setting)))?;
        }
        let before = self.weeder.status()?.position;
        self.weeder.ask("start")?;
        let mut plan = Plan::default();
        let begin = u64::from(ms(STILL_MS));
        plan.follow(&machine.pin_changes(row, motion, 0), begin);
        plan.at(begin + (motion.duration_s() * CYCLES_PER_SECOND as f64) as u64, Action::Pause);
        let played = self.play(plan)?;
        let status = self.weeder.status()?;
        self.weeder.ask("hold")?;
        // By the weeder's clock, as its settings are.
        let corrected = |pulse: Pulse| {
            let width_us = pulse.width_us() * self.clock_ratio;
            let mut set_us = [machine.servo.in_us, machine.servo.out_us].into_iter();
            let width_us = set_us.find(|set| (width_us - set).abs() < SAME_WIDTH_US).unwrap_or(width_us);
            Pulse { fall: pulse.rise + (width_us * CYCLES_PER_SECOND as f64 / 1e6).round() as u64, ..pulse }
        };
        let pulses: Vec<_> = servo::pulses(&played.records, played.start).into_iter().map(corrected).collect();
        Ok(Outcome {
            judgement: judge(row, machine, motion, pass.timing, &pulses, ORIGIN + begin),
            lost_counts: i64::from(played.ticks) - i64::from(status.position.wrapping_sub(before)),
        })
    }
}
