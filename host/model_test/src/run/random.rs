//! Random runs: the strategies that draw the machine, the row and the steps.

use super::{Beginning, Classification, Encoder, PLANT_MM, Run, Sight, Step};
use control::{
    measure::reset::Cause,
    settings::{SECOND_BEAM_LEAST_MM, Setting},
};
use field::wheel::most_slip;
use proptest::{prelude::*, strategy::Union};
use std::ops::{Range, RangeInclusive};

/// Delay of the measured speed.
const MEASURED_WITHIN_S: f64 = 0.05;

/// Every command with every argument, and lines that are not commands.
fn line() -> BoxedStrategy<String> {
    let others = [
        "help margin_mm",
        "get lead_out_ms",
        "servo 1750",
        "servo 9999",
        "hepl",
        "set k",
        "set wheel 400",
        "  clear\t",
        "start now please",
        "",
        "\u{1b}[A",
        "set k 3\nhold\r\nstart\n\nget k",
    ];
    let fixed: Vec<_> = rig::every_command().into_iter().chain(others.map(str::to_owned)).collect();
    prop_oneof![
        8 => prop::sample::select(fixed),
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

/// How often a setting is set, and its values on practical machines.
fn usual(setting: Setting) -> (u32, RangeInclusive<u32>) {
    use Setting::*;
    match setting {
        LeadOutMs => (4, 0..=500),
        LeadInMs => (4, 0..=500),
        TopSpeedMmS => (3, 300..=1600),
        MarginMm => (2, 0..=200),
        StemZoneMm => (2, 0..=200),
        BeamToToolMm => (2, 100..=900),
        MergeGapMm => (2, 0..=160),
        MaxWidthMm => (2, 200..=1500),
        TicksPerM => (1, 1500..=2500),
        WheelMm => (1, 300..=600),
        EndSwitch => (1, 0..=1),
        BeamResponseMs => (1, 0..=5),
        ServoGapMs => (1, 0..=15),
        NoPlantM => (1, 0..=3),
        ServoOutUs => (1, 500..=2500),
        ServoInUs => (1, 500..=2500),
        GuardSpacingMm => (2, 0..=700),
        GuardScatterMm => (1, 0..=100),
        SecondBeamMm => (1, 0..=300),
        MinWidthMm => (1, 0..=60),
        MisfitAfter => (1, 0..=6),
        K => (1, 1..=15),
        TicksPerRev => (1, 2000..=3000),
    }
}

/// Settings of practical machines, and now and then of others.
fn setting() -> BoxedStrategy<String> {
    let usual = Setting::all().map(|setting| {
        let (weight, values) = usual(setting);
        (weight, (Just(setting), values).boxed())
    });
    let any = (prop::sample::select(Setting::all().collect::<Vec<_>>()), prop_oneof![0_u32..=600, 0_u32..=70_000]);
    // With fewer ticks a metre the machine never knows its position well enough to weed.
    let counts = |(setting, value): &_| *setting != Setting::TicksPerM || !(1..400).contains(value);
    prop_oneof![9 => Union::new_weighted(usual.collect()), 1 => any.prop_filter("a wheel that counts", counts)]
        .prop_map(|(setting, value)| format!("set {} {value}", setting.text()))
        .boxed()
}

/// Rolls for a time at a speed.
fn roll(mm_s: impl Strategy<Value = i32> + 'static, ms: Range<i32>) -> BoxedStrategy<Step> {
    (mm_s, ms).prop_map(|(mm_s, ms)| Step::Roll { mm: mm_s * ms / 1000 + mm_s.signum(), mm_s }).boxed()
}

fn typed(line: &str) -> Step {
    Step::Type(line.to_owned())
}

/// A short sequence of steps.
fn steps() -> BoxedStrategy<Vec<Step>> {
    use Step::*;
    let forward = || roll(prop_oneof![8 => 100..800, 1 => 5..100, 2 => 800..1500], 20..700);
    let back = || roll(prop_oneof![6 => -600..-50, 1 => -50..-5, 1 => -1500..-600], 20..600);
    let cause = prop::sample::select(vec![Cause::PowerOn, Cause::BrownOut, Cause::LoopStalled]);
    let kept =
        prop::sample::select(vec!["save", "label weed", "label plant", "forget all", "forget 0", "hold", "status"]);
    let fault = || {
        prop_oneof![
            2 => (1_u32..30).prop_map(|times| Dust { times, on_second: false }),
            2 => (1_u32..4).prop_map(|turns| LoseEdges { turns }),
            1 => roll(1500..2500, 50..300),
            1 => (5_u32..300).prop_map(|ms| Silence { ms, encoder: Encoder::Silent }),
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
        // With the factory's lead and speed, a zone needs a beam farther ahead.
        2 => (30_u32..200).prop_map(|mm| Type(format!("hold\nset top_speed_mm_s 700\nset margin_mm 20\nset stem_zone_mm {mm}\nstart"))),
        2 => any::<bool>().prop_map(|on| Switch { on }),
        3 => fault(),
        1 => cause.prop_map(Reset),
        1 => (kept, 0_u32..600, any::<u8>()).prop_map(|(line, turns, byte)| CutPower { line, turns, byte }),
    ];
    // A dry run or the servo's test ends, and a line is typed in that turn or near it.
    let bench = prop_oneof![
        (900_u32..1300).prop_map(|mm_s| (format!("test row {mm_s}"), 3500 * 1000 / mm_s)),
        Just(("calibrate servo".to_owned(), 18_000)),
    ];
    let bench = (bench, 0_u32..20, line()).prop_map(|((bench, ms), off, line)| {
        vec![typed("hold"), Stand { ms: 200 }, Type(bench), Stand { ms: ms + off - 15 }, Type(line)]
    });
    prop_oneof![
        24 => one.prop_map(|step| vec![step]),
        // A crop at even distances. The machine reports where it guards missed plants.
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
        // Farther than the machine remembers, and fast.
        1 => (prop_oneof![-11_000..-2000, 2000..12_000], to_work()).prop_map(|(mm, start)| {
            vec![typed("hold"), Roll { mm, mm_s: 6000 * mm.signum() }, Stand { ms: 1 }, typed("clear"), typed(start)]
        }),
        1 => bench,
    ]
    .boxed()
}

/// Gaps and canopies in turn: plants, weeds, leaves with light between them.
fn row() -> BoxedStrategy<Vec<(u32, u32)>> {
    let gap = prop_oneof![2 => 1_u32..40, 5 => 40_u32..900];
    let canopy = prop_oneof![2 => 2_u32..40, 5 => 60_u32..300, 1 => 300_u32..500];
    prop::collection::vec((gap, canopy), 1..12).boxed()
}

/// Any counts, often shortly before an overflow.
fn beginning() -> BoxedStrategy<Beginning> {
    let count = prop_oneof![Just(0), i32::MAX - 20_000..=i32::MAX, i32::MIN..i32::MIN + 5_000, any::<i32>()];
    let steps = prop_oneof![Just(0), u32::MAX - 2_000_000..=u32::MAX, any::<u32>()];
    (count, steps, 300_u64..2000, any::<bool>(), 300..6000)
        .prop_map(|(count, steps, turn_us, reads_first, mm_s2)| {
            let classification = Classification::Width;
            Beginning { count, steps, turn_us, reads_first, mm_s2, classification }
        })
        .boxed()
}

fn runs(steps: BoxedStrategy<Vec<Step>>) -> BoxedStrategy<Run> {
    (beginning(), row(), steps)
        .prop_map(|(beginning, row, steps)| Run { beginning, row, sights: Vec::new(), steps })
        .boxed()
}

/// Runs with any steps: at most `sequences` short sequences of them.
pub fn wild(sequences: usize) -> BoxedStrategy<Run> {
    runs(prop::collection::vec(steps(), 1..sequences).prop_map(|some| some.into_iter().flatten().collect()).boxed())
}

/// A row at even distances or not, with weeds and dust. Now and then a beam misses a canopy.
fn stand() -> BoxedStrategy<Vec<((u32, u32), Sight)>> {
    let sight = || prop_oneof![14 => Just(Sight::Both), 1 => Just(Sight::First), 1 => Just(Sight::Second)];
    let even =
        (prop_oneof![2 => 40_u32..150, 3 => 150_u32..600], PLANT_MM..160, prop::collection::vec(sight(), 14..30))
            .prop_map(|(gap, width, sights)| sights.into_iter().map(|sight| ((gap, width), sight)).collect::<Vec<_>>());
    let narrow = (30_u32..200, prop_oneof![1 => 2_u32..12, 2 => 12_u32..50]);
    let canopy = prop_oneof![4 => (30_u32..600, PLANT_MM..220), 1 => narrow];
    let uneven = prop::collection::vec((canopy, sight()), 14..30);
    prop_oneof![2 => even, 1 => uneven].boxed()
}

/// Runs of a machine with two beams, which works and rolls forward and back at most `rolls` times while its slip changes.
/// Up to half of the margin is for the change of speed during a swing. The rest has room for three times the greatest error
/// from slip: for a value measured before a change and used after it.
pub fn beams(rolls: usize) -> BoxedStrategy<Run> {
    let machine = (250_u32..=1000, 35_u32..95, 20_u32..70, prop_oneof![Just(0_u32), 40_u32..120]);
    let rolled = || prop_oneof![6 => roll(100..500, 500..6000), 2 => roll(-400..-50, 100..2500)];
    let step = prop_oneof![
        8 => rolled().prop_map(|roll| (0, roll)),
        3 => (-100_i32..=100).prop_map(|share| (share, Step::Stand { ms: 1 })),
        1 => (1_u32..800).prop_map(|ms| (0, Step::Stand { ms })),
        1 => (1_u32..40).prop_map(|times| (0, Step::Tremble { times })),
        // An alarm: the ground and the slip are forgotten.
        1 => (1_u32..4).prop_map(|turns| (0, Step::LoseEdges { turns })),
    ];
    let steps = prop::collection::vec(step, 6..rolls);
    let going = roll(200..500, 3000..12_000);
    (beginning(), stand(), machine, going, steps)
        .prop_map(|(mut beginning, stand, (beam_to_tool_mm, share, margin_mm, lead_out_ms), going, steps)| {
            let mut spare_mm = f64::from(margin_mm);
            if lead_out_ms > 0 {
                let late_s = f64::from(lead_out_ms) / 1000.0 + MEASURED_WITHIN_S;
                beginning.mm_s2 = beginning.mm_s2.min((spare_mm / late_s.powi(2)) as i32);
                spare_mm -= f64::from(beginning.mm_s2) * late_s.powi(2) / 2.0;
            }
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
            let most_permille = (1000.0 * most_slip(spare_mm, beam_to_tool_mm.into())) as i32;
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

/// Runs of a machine that is set up and works. It rolls steadily forward and back, at most `rolls` times.
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
