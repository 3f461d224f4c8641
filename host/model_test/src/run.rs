//! Runs: a machine, a row, and the steps on it, in the operator's terms.

mod random;

pub use self::random::{beams, calm, wild};

use control::measure::reset::Cause;
use std::{fmt, ops::Range};

/// A canopy of this width is a plant, at any slip of the wheel.
const PLANT_MM: u32 = 80;

/// Ticks of the ground wheel in a millimetre, independent of the settings.
pub const TICKS_A_MM: f64 = 1.909_86;

/// The command that makes the watchdog reset a machine in hold.
pub const TEST_WATCHDOG: &str = "test watchdog";

/// How the decisions classify detections. The firmware in an Uno always uses its examples.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub enum Classification {
    /// By width alone.
    Width,
    /// By the firmware's examples.
    Examples,
}

/// The machine at the beginning of a run.
#[derive(Clone, Debug)]
pub struct Beginning {
    /// The encoder's count.
    pub count: i32,
    /// The clock, in its steps.
    pub steps: u32,
    /// Length of a turn of the loop. The machine is checked after each turn.
    pub turn_us: u64,
    /// Whether each reading is from before the edges that come with it.
    pub reads_first: bool,
    /// Acceleration of the machine, and its deceleration.
    pub mm_s2: i32,
    /// The classifier of the decisions.
    pub classification: Classification,
}

/// The encoder's health.
#[derive(Clone, Copy, Debug, Default, PartialEq, Eq)]
pub enum Encoder {
    /// It counts.
    #[default]
    Works,
    /// It counts nothing.
    Silent,
    /// One channel is dead, so that it counts up and down in turn.
    OneChannel,
}

/// A step of a run.
#[derive(Clone, Debug)]
pub enum Step {
    /// The operator types a line. The machine answers while it rolls on.
    Type(String),
    /// The machine rolls, and goes on at this speed. Both values are negative to roll back.
    Roll {
        /// The distance.
        mm: i32,
        /// The speed.
        mm_s: i32,
    },
    /// The machine brakes and stands.
    Stand {
        /// The duration, with braking.
        ms: u32,
    },
    /// The machine stops, and its wheel trembles on an edge.
    Tremble {
        /// Ticks to and fro.
        times: u32,
    },
    /// The operator turns the work switch.
    Switch {
        /// Whether to work.
        on: bool,
    },
    /// A beam changes its level, and back, at one position.
    Dust {
        /// Number of such pairs.
        times: u32,
        /// Whether this is the second beam.
        on_second: bool,
    },
    /// The next edges of the beams are lost.
    LoseEdges {
        /// The duration.
        turns: u32,
    },
    /// The encoder fails, while the machine rolls on.
    Silence {
        /// The duration.
        ms: u32,
        /// How it fails.
        encoder: Encoder,
    },
    /// Both channels of the encoder change at once.
    Spike {
        /// Ticks that each spike adds in the direction of rolling: 2, or -2 if it was about to change.
        ticks: i32,
        /// Number of spikes, a turn apart.
        times: u32,
    },
    /// The machine is reset.
    Reset(Cause),
    /// A byte of the EEPROM changes, and the machine is switched off and on. Only the decisions show it.
    Spoil {
        /// The byte's address.
        address: usize,
        /// Its new value.
        byte: u8,
    },
    /// The operator types a line, and then the power fails.
    CutPower {
        /// The line.
        line: &'static str,
        /// Turns from the line until the power fails.
        turns: u32,
        /// The new value of a byte that is being written.
        byte: u8,
    },
    /// The stack nearly reaches the variables.
    LowerStack {
        /// The duration.
        turns: u32,
    },
    /// The wheel's slip changes on new ground.
    Slip {
        /// Excess of the turned distance over the rolled one, in thousandths.
        permille: i32,
    },
    /// The end switch sticks, or follows the tool again.
    StickTool {
        /// Whether it sticks.
        stuck: bool,
    },
}

/// The steps that [`Run::written`] parses are as it takes them.
impl fmt::Display for Step {
    fn fmt(&self, f: &mut fmt::Formatter<'_>) -> fmt::Result {
        match self {
            Self::Type(line) => write!(f, "type `{}`", line.escape_debug()),
            Self::Roll { mm, mm_s } if *mm_s < 0 => write!(f, "roll back {} mm at {} mm/s", -mm, -mm_s),
            Self::Roll { mm, mm_s } => write!(f, "roll {mm} mm at {mm_s} mm/s"),
            Self::Stand { ms } => write!(f, "stand for {ms} ms"),
            other => write!(f, "{other:?}"),
        }
    }
}

/// The beams that see a canopy.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub enum Sight {
    /// Both.
    Both,
    /// The first alone.
    First,
    /// The second alone.
    Second,
}

/// A run.
#[derive(Clone)]
pub struct Run {
    /// The machine at the beginning.
    pub beginning: Beginning,
    /// Gaps and canopies in turn, in millimetres. The row repeats.
    pub row: Vec<(u32, u32)>,
    /// The beams that see each canopy; both beams see a canopy without an entry. With entries, the real plants are
    /// checked too.
    pub sights: Vec<Sight>,
    /// The steps, in order.
    pub steps: Vec<Step>,
}

impl Run {
    /// A written run: each line is a step. A person pushes the machine.
    pub fn written(row: &[(u32, u32)], lines: &str) -> Self {
        let beginning = Beginning {
            count: 0,
            steps: 0,
            turn_us: 1000,
            reads_first: true,
            mm_s2: 3000,
            classification: Classification::Width,
        };
        let steps = lines.lines().map(str::trim).filter(|line| !line.is_empty()).map(step).collect();
        Self { beginning, row: row.to_vec(), sights: Vec::new(), steps }
    }

    /// For each beam and each tick of the row: whether the beam is broken there.
    pub fn levels(&self) -> [Vec<bool>; 2] {
        let sights = || self.sights.iter().copied().chain(std::iter::repeat(Sight::Both));
        [Sight::Second, Sight::First].map(|unseen| {
            let levels = |(&(gap, canopy), sight): (&(u32, u32), Sight)| {
                let gap = std::iter::repeat_n(false, ticks(gap) as usize);
                gap.chain(std::iter::repeat_n(sight != unseen, ticks(canopy) as usize))
            };
            self.row.iter().zip(sights()).flat_map(levels).collect()
        })
    }

    /// The ticks after which the row repeats.
    pub fn period(&self) -> i64 {
        self.row.iter().flat_map(|&(gap, canopy)| [gap, canopy]).map(ticks).sum()
    }

    /// The ticks of each canopy that is too wide for a weed.
    pub fn plants(&self) -> Vec<Range<i64>> {
        let mut end = 0;
        let spans = self.row.iter().map(|&(gap, canopy)| {
            let start = end + ticks(gap);
            end = start + ticks(canopy);
            (canopy, start..end)
        });
        spans.filter(|&(canopy, _)| canopy >= PLANT_MM).map(|(_, span)| span).collect()
    }
}

/// Whole ticks in this many millimetres.
fn ticks(mm: u32) -> i64 {
    (f64::from(mm) * TICKS_A_MM) as i64
}

/// Parses a step: `roll 450 mm at 556 mm/s`, `roll back ...`, `stand for 100 ms`, or a line to type.
fn step(line: &str) -> Step {
    let numbers: Vec<i32> = line.split(' ').filter_map(|word| word.parse().ok()).collect();
    match (line.split(' ').next(), &numbers[..]) {
        (Some("roll"), &[mm, mm_s]) if line.starts_with("roll back") => Step::Roll { mm: -mm, mm_s: -mm_s },
        (Some("roll"), &[mm, mm_s]) => Step::Roll { mm, mm_s },
        (Some("stand"), &[ms]) => Step::Stand { ms: ms as u32 },
        _ => Step::Type(line.to_owned()),
    }
}

/// Lines to type and distances to roll.
impl fmt::Debug for Run {
    fn fmt(&self, f: &mut fmt::Formatter<'_>) -> fmt::Result {
        let Self { beginning, row, sights, steps } = self;
        writeln!(f, "{beginning:?}")?;
        write!(f, "the beam is at 0 mm; the row has canopies from")?;
        let mut end = 0;
        for (gap, canopy) in row {
            write!(f, " {} to {},", end + gap, end + gap + canopy)?;
            end += gap + canopy;
        }
        writeln!(f, " and again every {end} mm")?;
        for (number, sight) in sights.iter().enumerate().filter(|(_, sight)| **sight != Sight::Both) {
            writeln!(f, "only this beam sees canopy {}: {sight:?}", number + 1)?;
        }
        steps.iter().try_for_each(|step| writeln!(f, "    {step}"))
    }
}
