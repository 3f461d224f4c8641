//! Why the decisions of a native run keep the tool out: the parts of its [loss budget](crate::budget).

use crate::budget::{Part, Reason, Reasons, part_of};
use crate::pass::Pass;
use control::ground::AtTool;
use control::operate::event::Event;
use control::operate::{state::State, tool};
use control::units::Position;
use rig::{ByExamples, Rig};

type Weeder = Rig<ByExamples>;

/// Longest wait of a command for the servo's frame.
const SERVO_FRAME_S: f64 = 0.020;

/// Why the decisions keep the tool out, turn by turn.
pub(super) struct Why<'a> {
    pass: &'a Pass,
    reasons: Reasons,
    /// The slowest swing: after this time a commanded tool has arrived.
    slowest_s: f64,
    /// The time of the command into the row, if it is commanded in.
    in_since_s: Option<f64>,
    /// The last zone, and its part of the budget.
    zone: Option<((Position, Position), Part)>,
    is_guarding: bool,
    /// The middles of the guarded zones that are still ahead of the tool, or at it.
    guarded: Vec<Position>,
}

impl<'a> Why<'a> {
    /// Of a pass, whose machine guards missed plants or not.
    pub(super) fn of(pass: &'a Pass, is_guarding: bool) -> Self {
        Self {
            pass,
            reasons: Reasons::default(),
            slowest_s: pass.machine.servo.slowest_s() + SERVO_FRAME_S,
            in_since_s: None,
            zone: None,
            is_guarding,
            guarded: Vec::new(),
        }
    }

    pub(super) fn into_reasons(self) -> Vec<Reason> {
        self.reasons.until(self.pass.motion.duration_s())
    }

    /// Records the present reason after a turn. Not inlined, which makes the loop faster.
    #[inline(never)]
    pub(super) fn look(&mut self, weeder: &mut Weeder, is_in: bool, time_s: f64) {
        while self.is_guarding
            && let Some(event) = weeder.next_event()
        {
            if let Event::Guarded(middle) = event {
                self.guarded.push(middle);
            }
        }
        if !is_in {
            self.in_since_s = None;
        } else if time_s - *self.in_since_s.get_or_insert(time_s) > self.slowest_s {
            // It weeds: no reason to look up, which saves time.
            return self.reasons.turn_to(Part::Swings, time_s);
        }
        let part = self.part(weeder, time_s);
        self.reasons.turn_to(part, time_s);
    }

    fn part(&mut self, weeder: &Weeder, time_s: f64) -> Part {
        if weeder.state() != State::Work {
            return Part::Closed;
        }
        match weeder.ground_at_tool() {
            AtTool::Unknown => Part::Closed,
            AtTool::Open => match weeder.reason() {
                None | Some(tool::Reason::Plant) => Part::Swings,
                Some(_) => Part::Closed,
            },
            AtTool::Kept { tool, begin, end } => {
                let kept_for = match self.zone {
                    Some((zone, part)) if zone == (begin, end) => part,
                    _ => self.kept_for(tool, begin, end, time_s),
                };
                self.zone = Some(((begin, end), kept_for));
                let is_in_margin = begin.is_ahead_of(tool) || tool.is_ahead_of(end);
                if is_in_margin && kept_for == Part::Plants { Part::Margins } else { kept_for }
            }
        }
    }

    /// The part of the budget that a zone belongs to.
    fn kept_for(&mut self, tool: Position, begin: Position, end: Position, time_s: f64) -> Part {
        self.guarded.retain(|middle| !begin.is_ahead_of(*middle));
        if self.guarded.iter().any(|middle| !middle.is_ahead_of(end)) {
            return Part::Guarded;
        }
        let Pass { machine, motion, row, .. } = self.pass;
        let tool_mm = machine.tool_mm(motion.position_mm(time_s));
        let place_mm = |place: Position| tool_mm + f64::from((place - tool).0) * machine.tick_mm();
        part_of(&(place_mm(begin)..place_mm(end)), row)
    }
}
