//! The machine and the row of "Try it", for the page's virtual Uno: [`field::rolling`], with the verdicts of
//! [`field::verdict`] on the ground behind the tool.
//!
//! There is one simulation, which [`Begun`] begins.

use field::machine::Machine;
use field::motion::mm_s;
use field::planting::{Planting, Sowing};
use field::rolling::Rolling;
use field::row::{Canopy, Kind, Row};
use field::verdict::{Verdict, ZoneSettings, judge};
use link::settings::{Setting, name};
use serde::{Deserialize, Serialize};
use serde_json::{Value, json};
use set_up::{Task, steps};
use std::cell::RefCell;
use uno::Pulse;

/// Ground that lies sown ahead of the beam.
const SOWN_AHEAD_MM: f64 = 2000.0;
/// Ground behind a plant's margin before it is judged: until then the tool could come back too early.
const BEHIND_MM: f64 = 20.0;
/// Ground in memory before the next canopy to judge: more than the tool needs to swing, at any speed.
const BEFORE_MM: f64 = 500.0;
/// An arm within this angle of fully out counts as fully out. It is half a millimetre at the tool's end, and 1 us of a
/// pulse: avr8js does not time edges more exactly (docs/simulators.md).
const CLEAR_WITHIN_DEGREES: f64 = 0.09;
/// The margin from the measurements of the machine that is set up.
const MARGIN_MM: u16 = 22;

/// A machine before a row.
#[derive(Deserialize)]
#[serde(rename_all = "camelCase")]
pub struct Begun {
    /// The Uno's cycle at this moment, with the beam at 0 mm.
    cycle: u64,
    /// The parameters of the endless row: its seed, the spacing of its plants, the share of the gaps with a tall weed, and
    /// the position of the first plant.
    seed: u64,
    spacing_mm: f64,
    weed_share: f64,
    first_mm: f64,
    /// Whether it is set up by the manual, except for the second beam. Otherwise it is the machine from the box.
    #[serde(default)]
    is_set_up: bool,
    /// Distance from the beam back to a second one; 0 without one.
    #[serde(default)]
    second_beam_mm: f64,
}

/// A change from now on.
#[derive(Deserialize)]
#[serde(rename_all = "camelCase")]
pub enum Different {
    /// The new speed in km/h; negative backwards.
    SpeedKmH(f64),
    /// The share of the wheel's distance that is lost, below 1.
    Slip(f64),
    BeamWireTorn(bool),
    EncoderDead(bool),
    /// The spacing of plants that are sown from now on.
    SpacingMm(f64),
    /// The share of their gaps with a tall weed.
    WeedShare(f64),
}

/// The verdict on a plant, or whether a weed was cut. Of two passes the greater one counts: the worse verdict on a
/// plant, and the better one on a weed.
#[derive(Clone, Copy, PartialEq, Eq, PartialOrd, Ord, Serialize)]
#[serde(untagged)]
pub enum Fate {
    Plant(Verdict),
    Weed(bool),
}

/// The machine with its row and its verdicts.
pub struct Simulation {
    rolling: Rolling,
    sowing: Sowing,
    /// The first canopy without a verdict, or to be judged again.
    next: usize,
    /// The verdicts by number in the row.
    fates: Vec<Option<Fate>>,
    /// Start time of the recorded motion.
    from_s: f64,
    /// Number of canopies that were passed to the page.
    told: usize,
}

thread_local! {
    static TRIAL: RefCell<Option<Simulation>> = const { RefCell::new(None) };
}

/// Runs `act` on the simulation. Fails if there is none.
pub fn with<Answer>(act: impl FnOnce(&mut Simulation) -> Answer) -> Result<Answer, String> {
    let missing = || "no machine was put in front of a row".to_owned();
    TRIAL.with_borrow_mut(|simulation| simulation.as_mut().map(act).ok_or_else(missing))
}

impl Begun {
    /// Begins a simulation, and replaces an earlier one. Returns the machine's dimensions, the levels of its pins, and the
    /// commands that set up its firmware.
    pub fn begin(self) -> Value {
        let mut machine = Machine {
            second_beam_mm: self.second_beam_mm,
            clear_within_degrees: CLEAR_WITHIN_DEGREES,
            ..Machine::default()
        };
        let set_up = if self.is_set_up { set_up(&mut machine) } else { Vec::new() };
        let planting = Planting { spacing_mm: self.spacing_mm, ..Planting::default() };
        let mut sowing = Sowing::new(planting, self.weed_share, self.first_mm, self.seed);
        let mut row = Vec::new();
        sowing.sow(&mut row, SOWN_AHEAD_MM);
        let simulation = Simulation {
            rolling: Rolling::new(machine, row, 0.0, self.cycle),
            sowing,
            next: 0,
            fates: Vec::new(),
            from_s: 0.0,
            told: 0,
        };
        let dimensions = json!({
            "beamToToolMm": machine.beam_to_tool_mm, "toolWidthMm": machine.tool_width_mm,
        });
        let answer = json!({ "dimensions": dimensions, "levels": simulation.levels(), "setUp": set_up });
        TRIAL.set(Some(simulation));
        answer
    }
}

/// Sets a machine up by the manual's steps, without the second beam. Returns the commands for its firmware.
fn set_up(machine: &mut Machine) -> Vec<String> {
    let mut commands = Vec::new();
    for task in steps().into_iter().flat_map(|step| step.tasks) {
        match task {
            Task::Fit("machine.tool_width_mm", width_mm) => machine.tool_width_mm = width_mm,
            Task::Set(Setting::ServoInUs, pulse_us) => machine.servo.in_us = pulse_us.into(),
            Task::Set(Setting::ServoOutUs, pulse_us) => machine.servo.out_us = pulse_us.into(),
            _ => {}
        }
        match task {
            Task::Set(setting, value) if setting != Setting::SecondBeamMm => {
                commands.push(format!("set {} {value}", name(setting)));
            }
            Task::SetMargin => commands.push(format!("set margin_mm {MARGIN_MM}")),
            _ => {}
        }
    }
    commands
}

impl Simulation {
    /// Applies a change. Returns the levels of the machine's pins.
    pub fn change(&mut self, different: Different) -> Value {
        let Self { rolling, sowing, .. } = self;
        match different {
            Different::SpeedKmH(speed_km_h) => rolling.target_mm_s = mm_s(speed_km_h),
            Different::Slip(share) => rolling.slip_by(share),
            Different::BeamWireTorn(is_torn) => rolling.faults.beam_wire_torn = is_torn,
            Different::EncoderDead(is_dead) => rolling.faults.encoder_dead = is_dead,
            Different::SpacingMm(spacing_mm) => sowing.planting.spacing_mm = spacing_mm,
            Different::WeedShare(share) => sowing.weed_share = share,
        }
        self.levels()
    }

    /// Rolls the machine on until a cycle of the Uno's clock, and sows ahead of it. Returns the changes at the pins:
    /// cycle, pin and level.
    pub fn roll(&mut self, cycle: f64) -> Value {
        let Self { rolling, sowing, .. } = self;
        let changes = rolling.roll_until(cycle as u64);
        let until_mm = rolling.place_mm() + SOWN_AHEAD_MM;
        sowing.sow(&mut rolling.row, until_mm);
        changes.iter().map(|change| json!([change.cycle, change.pin.number(), change.high])).collect()
    }

    /// Passes a pulse of the Uno to its servo, by the cycles of its edges.
    pub fn hear(&mut self, rise: f64, fall: f64) -> Value {
        json!(self.rolling.hear(Pulse { rise: rise as u64, fall: fall as u64 }))
    }

    /// The machine's state, and the canopies that were sown since the last call.
    pub fn look(&mut self) -> Value {
        let Self { rolling, told, .. } = self;
        let machine = &rolling.machine;
        let degrees = rolling.degrees();
        let across_mm = machine.across_mm(degrees);
        let thing = |canopy: &Canopy| {
            let kind = if canopy.kind == Kind::Weed { "weed" } else { "plant" };
            json!({ "kind": kind, "placeMm": canopy.position_mm, "widthMm": canopy.width_mm })
        };
        let sown: Vec<Value> = rolling.row[*told..].iter().map(thing).collect();
        *told = rolling.row.len();
        let state = json!({
            "placeMm": rolling.place_mm(),
            "toolMm": rolling.tool_mm(),
            "speedMmS": rolling.speed_mm_s(),
            "degrees": degrees,
            "acrossMm": across_mm,
            "isClear": degrees >= machine.clear_degrees(),
            "isWeeding": across_mm < machine.tool_width_mm / 2.0,
            "isBroken": rolling.is_beam_broken(),
            "ticks": rolling.ticks,
            "groundMmATick": rolling.ground_mm_a_tick(),
            "commands": rolling.commands,
        });
        json!({ "state": state, "sown": sown })
    }

    fn levels(&self) -> Value {
        self.rolling.levels().into_iter().map(|(pin, high)| json!([pin.number(), high])).collect()
    }

    /// Judges the canopies behind the tool that have no verdict yet. Returns their numbers and verdicts.
    pub fn judge(&mut self, margin_mm: u32, stem_zone_mm: u32) -> Vec<(usize, Fate)> {
        let is_behind =
            |canopy: &Canopy| canopy.span_mm().end + f64::from(margin_mm) + BEHIND_MM < self.rolling.tool_mm();
        let behind = self.rolling.row.partition_point(is_behind);
        let first = std::mem::replace(&mut self.next, behind);
        let (Some(canopies), true) = (self.rolling.row.get(first..behind), first < behind) else {
            return Vec::new();
        };
        let Ok(row) = Row::new(canopies.to_vec()) else {
            return Vec::new();
        };
        let timing = ZoneSettings { margin_mm, stem_zone_mm, ..ZoneSettings::default() };
        let (motion, pulses, start_cycle) = self.rolling.since(self.from_s);
        let judgement = judge(&row, &self.rolling.machine, &motion, timing, pulses, start_cycle);
        let mut plants = judgement.plants.iter().map(|plant| plant.verdict);
        let mut weeds = judgement.weeds.iter().map(|weed| weed.cut);
        self.fates.resize(self.fates.len().max(behind), None);
        let mut judged = Vec::with_capacity(canopies.len());
        for (number, canopy) in (first..).zip(canopies) {
            let now = match canopy.kind {
                Kind::Plant => plants.next().map(Fate::Plant),
                Kind::Weed => weeds.next().map(Fate::Weed),
            };
            let fate = now.max(self.fates[number]);
            self.fates[number] = fate;
            judged.extend(fate.map(|fate| (number, fate)));
        }
        self.forget();
        judged
    }

    /// Forgets the motion from before the tool came near the next canopy to judge.
    fn forget(&mut self) {
        let tool_mm = self.rolling.tool_mm();
        let next_mm = self.rolling.row.get(self.next).map_or(tool_mm, |next| next.span_mm().start.min(tool_mm));
        let near_mm = next_mm - BEFORE_MM + self.rolling.machine.beam_to_tool_mm;
        if let Some(near_s) = self.rolling.passed_s(near_mm, self.from_s) {
            self.from_s = near_s;
            self.rolling.forget(near_s);
        }
    }
}
