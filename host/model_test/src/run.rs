//! Runs: a machine, a row, and the steps on it, one after the other, in an operator's terms.

use control::{measure::reset::Cause, settings::SECOND_BEAM_LEAST_MM};
use field::wheel::most_slip;
use proptest::prelude::*;
use std::fmt;

/// A detection of this width is no weed, at any slip of the wheel.
const PLANT_MM: u32 = 80;

/// Ticks of the ground wheel in a millimetre, independent of the settings.
pub const TICKS_A_MM: f64 = 1.909_86;

/// What has the watchdog reset a machine that stands in hold.
pub const TEST_WATCHDOG: &str = "test watchdog";

/// Where and when a run begins, and how the machine is.
#[derive(Clone, Debug)]
pub struct Beginning {
    /// What the counters of way and time show.
    pub count: i32,
    /// As `count`, in the clock's steps.
    pub steps: u32,
    /// A turn of the loop, after which the machine is looked at.
    pub turn_us: u64,
    /// Whether each reading is from before the edges that come with it.
    pub reads_first: bool,
    /// How fast the machine gains and loses speed.
    pub mm_s2: i32,
}

/// Something that happens.
#[derive(Clone, Debug)]
pub enum Step {
    /// A line is typed, and answered while the machine rolls on.
    Type(String),
    /// The machine rolls so far, back where that is negative, and goes on at this speed.
    Roll {
        /// How far.
        mm: i32,
        /// How fast.
        mm_s: i32,
    },
    /// The machine stands.
    Stand {
        /// How long.
        ms: u32,
    },
    /// The wheel trembles on an edge.
    Tremble {
        /// Ticks to and fro.
        times: u32,
    },
    /// The work switch is thrown.
    Switch {
        /// To where.
        on: bool,
    },
    /// Leaves, or light between them, come and go in the beam at one place.
    Dust {
        /// How often.
        times: u32,
    },
    /// The next edges of the beam get lost.
    LoseEdges {
        /// For how long.
        turns: u32,
    },
    /// The encoder says nothing, while the machine rolls on.
    Silence {
        /// How long.
        ms: u32,
    },
    /// Both channels of the encoder change at once.
    Spike {
        /// What that adds to the count.
        ticks: i32,
        /// How often, a turn apart.
        times: u32,
    },
    /// The machine is reset.
    Reset(Cause),
    /// A line is typed, and after so many turns of the loop the power goes away; a byte that is being written becomes anything.
    CutPower {
        /// What is typed.
        line: &'static str,
        /// How long the machine has for it.
        turns: u32,
        /// What becomes of the byte.
        byte: u8,
    },
    /// The stack reaches nearly down to the variables.
    LowerStack {
        /// For how long.
        turns: u32,
    },
    /// From here on the wheel turns farther than the machine rolls, or less far where that is negative.
    Slip {
        /// By how much, in thousandths of the ground.
        permille: i32,
    },
    /// The end switch no longer follows the tool, or does again.
    StickTool {
        /// Which of them.
        stuck: bool,
    },
}

impl fmt::Display for Step {
    fn fmt(&self, f: &mut fmt::Formatter<'_>) -> fmt::Result {
        match self {
            Self::Type(line) => write!(f, "type `{}`", line.escape_debug()),
            Self::Roll { mm, mm_s } if *mm_s < 0 => write!(f, "roll back {} mm at {} mm/s", -mm, -mm_s),
            Self::Roll { mm, mm_s } => write!(f, "roll {mm} mm at {mm_s} mm/s"),
            Self::Stand { ms } => write!(f, "stand for {ms} ms"),
            Self::Tremble { times } => write!(f, "stop, and tremble by a tick {times} times"),
            Self::Switch { on } => write!(f, "throw the work switch {}", if *on { "on" } else { "off" }),
            Self::Dust { times } => write!(f, "have the beam change twice, {times} times, at one place"),
            Self::LoseEdges { turns } => write!(f, "lose the beam's edges for {turns} turns of the loop"),
            Self::Silence { ms } => write!(f, "silence the encoder for {ms} ms"),
            Self::Spike { ticks, times } => write!(f, "spoil the count by {ticks} ticks, {times} times a turn apart"),
            Self::Reset(cause) => write!(f, "reset, by {cause:?}"),
            Self::CutPower { line, turns, byte } => {
                write!(f, "type `{line}`, and cut the power {turns} turns later; a byte under way becomes {byte:#04x}")
            }
            Self::LowerStack { turns } => write!(f, "leave 40 bytes of stack for {turns} turns"),
            Self::Slip { permille } => write!(f, "have the wheel turn {permille} thousandths farther than the ground"),
            Self::StickTool { stuck: true } => write!(f, "have the end switch stick"),
            Self::StickTool { stuck: false } => write!(f, "have the end switch follow the tool again"),
        }
    }
}

/// Which of two beams see a thing.
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
    /// Where it begins.
    pub beginning: Beginning,
    /// Clear ground and ground with something on it, in turn, in millimetres; behind the last it begins again.
    pub row: Vec<(u32, u32)>,
    /// Which beams see each of the things in the row, both where nothing is said. The ground is judged by where these stand if anything is.
    pub sights: Vec<Sight>,
    /// What happens, in this order.
    pub steps: Vec<Step>,
}

impl Run {
    /// A run over a row, as written down: a line for each thing that is typed or rolled, by a machine that gains and loses speed as a
    /// person pushes it.
    pub fn written(row: &[(u32, u32)], lines: &str) -> Self {
        let beginning = Beginning { count: 0, steps: 0, turn_us: 1000, reads_first: true, mm_s2: 3000 };
        let steps = lines.lines().map(str::trim).filter(|line| !line.is_empty()).map(step).collect();
        Self { beginning, row: row.to_vec(), sights: Vec::new(), steps }
    }

    /// For each tick of the row whether something stands there that the first beam sees, and the second.
    pub fn levels(&self) -> [Vec<bool>; 2] {
        let ticks = |mm: u32| (f64::from(mm) * TICKS_A_MM) as usize;
        let sights = || self.sights.iter().copied().chain(std::iter::repeat(Sight::Both));
        [Sight::Second, Sight::First].map(|unseen| {
            let levels = |(&(gap, thing), sight): (&(u32, u32), Sight)| {
                let gap = std::iter::repeat_n(false, ticks(gap));
                gap.chain(std::iter::repeat_n(sight != unseen, ticks(thing)))
            };
            self.row.iter().zip(sights()).flat_map(levels).collect()
        })
    }

    /// From which tick of the row to which each plant stands that is too wide for a weed.
    pub fn plants(&self) -> Vec<(i64, i64)> {
        let ticks = |mm: u32| (f64::from(mm) * TICKS_A_MM) as i64;
        let mut place = 0;
        let spans = self.row.iter().map(|&(gap, thing)| {
            let from = place + ticks(gap);
            place = from + ticks(thing);
            (thing, (from, place))
        });
        spans.filter(|&(thing, _)| thing >= PLANT_MM).map(|(_, span)| span).collect()
    }
}

/// What a line says: `roll 450 mm at 556 mm/s`, `roll back ...`, `stand for 100 ms`, or what is typed.
fn step(line: &str) -> Step {
    let numbers: Vec<i32> = line.split(' ').filter_map(|word| word.parse().ok()).collect();
    match (line.split(' ').next(), &numbers[..]) {
        (Some("roll"), &[mm, mm_s]) if line.starts_with("roll back") => Step::Roll { mm: -mm, mm_s: -mm_s },
        (Some("roll"), &[mm, mm_s]) => Step::Roll { mm, mm_s },
        (Some("stand"), &[ms]) => Step::Stand { ms: ms as u32 },
        _ => Step::Type(line.to_owned()),
    }
}

/// What a person types and rolls.
impl fmt::Debug for Run {
    fn fmt(&self, f: &mut fmt::Formatter<'_>) -> fmt::Result {
        let Self { beginning, row, sights, steps } = self;
        writeln!(f, "{beginning:?}")?;
        write!(f, "the beam is at 0 mm; in the row stand things from")?;
        let mut place = 0;
        for (gap, thing) in row {
            write!(f, " {} to {},", place + gap, place + gap + thing)?;
            place += gap + thing;
        }
        writeln!(f, " and again every {place} mm")?;
        for (number, sight) in sights.iter().enumerate().filter(|(_, sight)| **sight != Sight::Both) {
            writeln!(f, "number {} of them is seen by this beam alone: {sight:?}", number + 1)?;
        }
        steps.iter().try_for_each(|step| writeln!(f, "    {step}"))
    }
}

/// Every command with every argument, and lines that are none.
fn line() -> BoxedStrategy<String> {
    let fixed = [
        "status",
        "help",
        "help margin_mm",
        "get",
        "get lead_out_ms",
        "save",
        "revert",
        "defaults",
        "calibrate start",
        "calibrate 1000",
        "calibrate 1000 force",
        "calibrate servo",
        "servo in",
        "servo out",
        "servo 1750",
        "servo 9999",
        "test row",
        TEST_WATCHDOG,
        "start",
        "start now",
        "hold",
        "clear",
        "events on",
        "events off",
        "plot on",
        "plot teleplot",
        "plot off",
        "label plant",
        "label weed",
        "examples",
        "forget all",
        "dump",
        "version",
        "hepl",
        "set k",
        "set wheel 400",
        "  clear\t",
        "start now please",
        "",
        "\u{1b}[A",
        "set k 3\nhold\r\nstart\n\nget k",
    ];
    prop_oneof![
        8 => prop::sample::select(fixed.map(str::to_owned).to_vec()),
        1 => (1000_u32..5000, any::<bool>())
            .prop_map(|(mm, force)| format!("calibrate {mm}{}", if force { " force" } else { "" })),
        1 => (90_u32..1500).prop_map(|mm_s| format!("test row {mm_s}")),
        1 => (400_u32..2600).prop_map(|us| format!("servo {us}")),
        1 => (0_u32..40).prop_map(|number| format!("forget {number}")),
        1 => any::<u8>().prop_map(|feature| format!("teach {feature}")),
        1 => (prop::sample::select(vec!["plant", "weed"]), prop::array::uniform5(any::<u8>())).prop_map(
            |(label, [a, b, c, d, e])| format!("teach {a}\nteach {b}\nteach {c}\nteach {d}\nteach {e}\nteach {label}")
        ),
        1 => "[ -~]{0,90}",
    ]
    .boxed()
}

/// Settings of machines that may be built, and now and then of others.
fn setting() -> BoxedStrategy<String> {
    let usual = prop_oneof![
        4 => (Just("lead_out_ms"), 0_u32..=500),
        4 => (Just("lead_in_ms"), 0_u32..=500),
        3 => (Just("top_speed_mm_s"), 300_u32..=1600),
        2 => (Just("margin_mm"), 0_u32..=200),
        2 => (Just("stem_zone_mm"), 0_u32..=200),
        2 => (Just("beam_to_tool_mm"), 100_u32..=900),
        2 => (Just("merge_gap_mm"), 0_u32..=160),
        2 => (Just("max_width_mm"), 200_u32..=1500),
        1 => (Just("ticks_per_m"), 1500_u32..=2500),
        1 => (Just("wheel_mm"), 300_u32..=600),
        1 => (Just("end_switch"), 0_u32..=1),
        1 => (Just("beam_response_ms"), 0_u32..=5),
        1 => (Just("servo_gap_ms"), 0_u32..=15),
        1 => (Just("no_plant_m"), 0_u32..=3),
        1 => (Just("servo_out_us"), 500_u32..=2500),
        1 => (Just("servo_in_us"), 500_u32..=2500),
        2 => (Just("guard_spacing_mm"), 0_u32..=700),
        1 => (Just("guard_scatter_mm"), 0_u32..=100),
        1 => (Just("second_beam_mm"), 0_u32..=300),
        1 => (Just("min_width_mm"), 0_u32..=60),
        1 => (Just("misfit_after"), 0_u32..=6),
        1 => (Just("k"), 1_u32..=15),
    ];
    let names = [
        "ticks_per_rev",
        "wheel_mm",
        "ticks_per_m",
        "beam_to_tool_mm",
        "second_beam_mm",
        "margin_mm",
        "stem_zone_mm",
        "lead_out_ms",
        "lead_in_ms",
        "servo_in_us",
        "servo_out_us",
        "servo_gap_ms",
        "k",
        "guard_spacing_mm",
        "guard_scatter_mm",
        "min_width_mm",
        "misfit_after",
        "max_width_mm",
        "merge_gap_mm",
        "beam_response_ms",
        "top_speed_mm_s",
        "no_plant_m",
        "end_switch",
    ];
    let any = (prop::sample::select(names.to_vec()), prop_oneof![0_u32..=600, 0_u32..=70_000]);
    // A wheel that counts so rarely cannot tell where it is, and is nowhere sure enough to weed.
    let any =
        any.prop_filter("a wheel that counts", |&(name, value)| name != "ticks_per_m" || !(1..400).contains(&value));
    prop_oneof![9 => usual, 1 => any].prop_map(|(name, value)| format!("set {name} {value}")).boxed()
}

/// Rolls for a time at a speed.
fn roll(mm_s: impl Strategy<Value = i32> + 'static, ms: std::ops::Range<i32>) -> BoxedStrategy<Step> {
    (mm_s, ms).prop_map(|(mm_s, ms)| Step::Roll { mm: mm_s * ms / 1000 + mm_s.signum(), mm_s }).boxed()
}

fn typed(line: &str) -> Step {
    Step::Type(line.to_owned())
}

/// Some things that happen one after the other.
fn steps() -> BoxedStrategy<Vec<Step>> {
    use Step::*;
    let forward = || roll(prop_oneof![8 => 100..800, 1 => 5..100, 2 => 800..1500], 20..700);
    let back = || roll(prop_oneof![6 => -600..-50, 1 => -50..-5, 1 => -1500..-600], 20..600);
    let cause = prop::sample::select(vec![Cause::PowerOn, Cause::BrownOut, Cause::LoopStalled]);
    let kept =
        prop::sample::select(vec!["save", "label weed", "label plant", "forget all", "forget 0", "hold", "status"]);
    let fault = || {
        prop_oneof![
            2 => (1_u32..30).prop_map(|times| Dust { times }),
            2 => (1_u32..4).prop_map(|turns| LoseEdges { turns }),
            1 => roll(1500..2500, 50..300),
            1 => (5_u32..300).prop_map(|ms| Silence { ms }),
            1 => (prop_oneof![Just(-2), Just(2)], 1_u32..30).prop_map(|(ticks, times)| Spike { ticks, times }),
            1 => (1_u32..20).prop_map(|turns| LowerStack { turns }),
            1 => any::<bool>().prop_map(|stuck| StickTool { stuck }),
        ]
    };
    let to_work = || prop_oneof![6 => Just("start"), 1 => Just("start now")];
    let one = prop_oneof![
        12 => forward(),
        5 => back(),
        2 => (1_u32..600).prop_map(|ms| Stand { ms }),
        1 => (1_u32..100).prop_map(|times| Tremble { times }),
        5 => line().prop_map(Type),
        4 => setting().prop_map(Type),
        2 => any::<bool>().prop_map(|on| Switch { on }),
        3 => fault(),
        1 => cause.prop_map(Reset),
        1 => (kept, 0_u32..600, any::<u8>()).prop_map(|(line, turns, byte)| CutPower { line, turns, byte }),
    ];
    // A row or the servo's swings come to their end, and something is typed in that very turn or near it.
    let bench = prop_oneof![
        (900_u32..1300).prop_map(|mm_s| (format!("test row {mm_s}"), 3500 * 1000 / mm_s)),
        Just(("calibrate servo".to_owned(), 9000)),
    ];
    let bench = (bench, 0_u32..20, line()).prop_map(|((bench, ms), off, line)| {
        vec![typed("hold"), Stand { ms: 200 }, Type(bench), Stand { ms: ms + off - 15 }, Type(line)]
    });
    prop_oneof![
        24 => one.prop_map(|step| vec![step]),
        // A crop at even distances, and the machine says what it guards of it.
        2 => (150_u32..900, to_work(), forward(), forward()).prop_map(|(mm, start, roll, on)| {
            let set = Type(format!("set guard_spacing_mm {mm}"));
            vec![typed("events on"), set, typed("clear"), typed(start), roll, on]
        }),
        // Single plants, kept only at their stems.
        2 => (40_u32..200, to_work(), forward(), forward()).prop_map(|(mm, start, roll, on)| {
            vec![typed("hold"), Type(format!("set stem_zone_mm {mm}")), typed("clear"), typed(start), roll, on]
        }),
        // A second beam: the machine measures the wheel's slip from plant to plant.
        2 => (50_u32..350, to_work(), forward(), forward()).prop_map(|(mm, start, roll, on)| {
            vec![Type(format!("set second_beam_mm {mm}")), typed("clear"), typed(start), roll, on]
        }),
        6 => (to_work(), forward()).prop_map(|(start, roll)| vec![typed("clear"), typed(start), roll]),
        // A fault in any state. Afterwards the run continues from there.
        6 => (fault(), back(), to_work(), forward()).prop_map(|(fault, back, start, forward)| {
            vec![fault, back, typed("clear"), typed(start), forward]
        }),
        // Far and fast, beyond what the machine remembers.
        1 => (prop_oneof![-11_000..-2000, 2000..12_000], to_work()).prop_map(|(mm, start)| {
            vec![typed("hold"), Roll { mm, mm_s: 6000 * mm.signum() }, Stand { ms: 1 }, typed("clear"), typed(start)]
        }),
        1 => bench,
    ]
    .boxed()
}

/// Clear ground and things in turn: plants, weeds, leaves with light between them.
fn row() -> BoxedStrategy<Vec<(u32, u32)>> {
    let gap = prop_oneof![2 => 1_u32..40, 5 => 40_u32..900];
    let thing = prop_oneof![2 => 2_u32..40, 5 => 60_u32..300, 1 => 300_u32..500];
    prop::collection::vec((gap, thing), 1..12).boxed()
}

/// Anywhere, or where a counter is about to run over its end.
fn beginning() -> BoxedStrategy<Beginning> {
    let count = prop_oneof![Just(0), i32::MAX - 20_000..=i32::MAX, i32::MIN..i32::MIN + 5_000, any::<i32>()];
    let steps = prop_oneof![Just(0), u32::MAX - 2_000_000..=u32::MAX, any::<u32>()];
    (count, steps, 300_u64..2000, any::<bool>(), 300..6000)
        .prop_map(|(count, steps, turn_us, reads_first, mm_s2)| Beginning { count, steps, turn_us, reads_first, mm_s2 })
        .boxed()
}

fn runs(steps: BoxedStrategy<Vec<Step>>) -> BoxedStrategy<Run> {
    (beginning(), row(), steps)
        .prop_map(|(beginning, row, steps)| Run { beginning, row, sights: Vec::new(), steps })
        .boxed()
}

/// Runs on which anything happens, so many times at the most.
pub fn wild(happen: usize) -> BoxedStrategy<Run> {
    runs(prop::collection::vec(steps(), 1..happen).prop_map(|some| some.into_iter().flatten().collect()).boxed())
}

/// A stand at even distances or not, with weeds and dust in it, and which beams see each of them: now and then one misses something.
fn stand() -> BoxedStrategy<Vec<((u32, u32), Sight)>> {
    let sight = || prop_oneof![14 => Just(Sight::Both), 1 => Just(Sight::First), 1 => Just(Sight::Second)];
    let even =
        (prop_oneof![2 => 40_u32..150, 3 => 150_u32..600], PLANT_MM..160, prop::collection::vec(sight(), 14..30))
            .prop_map(|(gap, width, sights)| sights.into_iter().map(|sight| ((gap, width), sight)).collect::<Vec<_>>());
    let narrow = (30_u32..200, prop_oneof![1 => 2_u32..12, 2 => 12_u32..50]);
    let thing = prop_oneof![4 => (30_u32..600, PLANT_MM..220), 1 => narrow];
    let uneven = prop::collection::vec((thing, sight()), 14..30);
    prop_oneof![2 => even, 1 => uneven].boxed()
}

/// Runs of a machine with two beams, at work and rolled forward and back so many times at the most, with slip that changes. Its margin
/// has room for three times as much as that alone makes: what was measured before a change and what is right behind it.
pub fn beams(rolls: usize) -> BoxedStrategy<Run> {
    let machine = (250_u32..=1000, 35_u32..95, 20_u32..70, prop_oneof![Just(0_u32), 40_u32..120]);
    let rolled = || prop_oneof![6 => roll(100..500, 500..6000), 2 => roll(-400..-50, 100..2500)];
    let step = prop_oneof![
        8 => rolled().prop_map(|roll| (0, roll)),
        3 => (-100_i32..=100).prop_map(|share| (share, Step::Stand { ms: 1 })),
        1 => (1_u32..800).prop_map(|ms| (0, Step::Stand { ms })),
        1 => (1_u32..40).prop_map(|times| (0, Step::Tremble { times })),
    ];
    let steps = prop::collection::vec(step, 6..rolls);
    let going = roll(200..500, 3000..12_000);
    (beginning(), stand(), machine, going, steps)
        .prop_map(|(beginning, stand, (beam_to_tool_mm, share, margin_mm, lead_out_ms), going, steps)| {
            let (row, sights) = stand.into_iter().unzip();
            let least_mm = u32::from(SECOND_BEAM_LEAST_MM);
            let settings = [
                ("misfit_after", 0),
                ("beam_response_ms", 0),
                ("lead_in_ms", 0),
                ("lead_out_ms", lead_out_ms),
                ("top_speed_mm_s", 800),
                ("margin_mm", margin_mm),
                ("beam_to_tool_mm", beam_to_tool_mm),
                (
                    "second_beam_mm",
                    (beam_to_tool_mm * share / 100).clamp(least_mm, 900.min(beam_to_tool_mm - least_mm)),
                ),
            ];
            let settings = settings.map(|(name, value)| Step::Type(format!("set {name} {value}")));
            let most_permille = (1000.0 * most_slip(margin_mm.into(), beam_to_tool_mm.into())) as i32;
            let steps = steps.into_iter().flat_map(|(share, step)| match step {
                Step::Stand { ms: 1 } => vec![Step::Slip { permille: most_permille * share / 100 }],
                Step::Roll { .. } => vec![typed("clear"), typed("start"), step],
                step => vec![step],
            });
            let start = [typed("start"), going];
            let steps = settings.into_iter().chain(start).chain(steps).collect();
            Run { beginning, row, sights, steps }
        })
        .boxed()
}

/// Runs of a machine that is set up and at work. It rolls steadily forward and back, `rolls` times at most.
pub fn calm(rolls: usize) -> BoxedStrategy<Run> {
    let rolled = prop_oneof![5 => roll(60..1400, 500..5000), 1 => roll(-800..-60, 100..3000)];
    let steps = (prop::collection::vec(setting(), 0..5), prop::collection::vec(rolled, 1..rolls));
    runs(
        steps
            .prop_map(|(settings, rolls)| {
                let settings = settings.into_iter().map(Step::Type);
                settings.chain([typed("start")]).chain(rolls).collect::<Vec<_>>()
            })
            .boxed(),
    )
}
