//! The check, from the wires to the report.

use crate::alarms::SCENES;
use crate::rates::{PROVED_CYCLES, Turning};
use crate::report::{Figure, Report};
use crate::resets::{Kept, ResetBy, Restart};
use crate::row::{self, Outcome};
use crate::servo::{self, Steady};
use crate::{Boards, CheckError};
use control::alarm::Alarm;
use tester_core::pins::Line;
use uno::CYCLES_PER_SECOND;

/// The checks to run.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub struct Extent {
    /// A shorter check.
    pub brief: bool,
    /// Whether the boards are virtual ones.
    pub simulated: bool,
}

impl Extent {
    /// Plants and tall weeds of a row, and the speeds in km/h.
    fn rows(self) -> (usize, usize, &'static [f64]) {
        if self.brief { (3, 1, &[2.5]) } else { (20, 5, &[1.0, 2.5, 4.0]) }
    }

    fn pulses_ms(self) -> u32 {
        if self.brief { 400 } else { 10_000 }
    }
}

/// Checks a board. `progress` gets the next step, and the completed share from 0 to 1. At the end the weeder has its
/// saved settings again, also after an error.
///
/// # Errors
/// If a board does not answer, or the check is interrupted. A report of wrong wires has nothing else.
pub fn run(boards: &mut Boards, extent: Extent, progress: impl FnMut(&'static str, f64)) -> Result<Report, CheckError> {
    let report = check(boards, extent, progress);
    let reset = boards.reset();
    let report = report?;
    reset?;
    Ok(report)
}

fn check(
    boards: &mut Boards,
    extent: Extent,
    mut progress: impl FnMut(&'static str, f64),
) -> Result<Report, CheckError> {
    progress("wires", 0.0);
    let checked = if extent.simulated { "simulated" } else { "boards" };
    let version = boards.weeder.version().to_owned();
    let report = |figures| Report::new(&version, checked, extent.brief, figures);
    let wires = boards.wire_errors()?;
    if !wires.is_empty() {
        return Ok(Report { wires, ..report(vec![]) });
    }
    progress("pulses", 0.1);
    let mut figures = pulses(boards, extent)?;
    progress("rates", 0.15);
    figures.extend(rates(boards, extent)?);
    progress("alarms", 0.25);
    figures.extend(alarms(boards, extent)?);
    progress("resets", 0.4);
    figures.extend(boards.with_an_example(|boards| resets(boards, extent))?);
    let (plants, weeds, speeds) = extent.rows();
    for (number, &speed) in speeds.iter().enumerate() {
        progress("rows", 0.6 + 0.4 * number as f64 / speeds.len() as f64);
        let outcome = boards.weed(&row::pass(plants, weeds, speed)?)?;
        figures.extend(of_row(&outcome, plants, weeds, speed));
    }
    progress("done", 1.0);
    Ok(report(figures))
}

/// The figures of the pulses in hold. They give the clocks' ratio.
fn pulses(boards: &mut Boards, extent: Extent) -> Result<Vec<Figure>, CheckError> {
    boards.tester.take_records();
    let records = boards.tester.record_for_ms(extent.pulses_ms())?;
    let Steady { clock_ratio, width_us, width_spread_us, frame_spread_us } =
        servo::steady(&servo::pulses(&records, 0)).ok_or(CheckError::NoPulses)?;
    boards.clock_ratio = clock_ratio;
    Ok(vec![
        Figure::new("clock_ratio", "the weeder's clock over the tester's", "", clock_ratio, 0.02).within(0.99..=1.01),
        Figure::new("pulse_out_us", "pulse, tool out", "us", width_us, 1.0).within(1998.0..=2002.0),
        Figure::new("pulse_spread_us", "longest less shortest pulse", "us", width_spread_us, 0.5).within(..=1.0),
        Figure::new("frame_spread_us", "longest less shortest frame", "us", frame_spread_us, 0.5).within(..=1.0),
    ])
}

/// The rate that `weeder bounds` proves, in counts a second.
const PROVED_PER_S: f64 = (CYCLES_PER_SECOND / PROVED_CYCLES as u64) as f64;

/// With jitter of 30 %, two counts take at least 1.4 times the mean. This number of cycles keeps to the proof.
const JITTERED_CYCLES: u32 = 79;

fn rates(boards: &mut Boards, extent: Extent) -> Result<Vec<Figure>, CheckError> {
    let mut figures = Vec::new();
    let all = [(true, true), (true, false), (false, true), (false, false)];
    for &(forward, busy) in if extent.brief { &all[..1] } else { &all[..] } {
        let way = if forward { "forward" } else { "backward" };
        let load = if busy { "busy" } else { "idle" };
        // If no rate passes, counts are lost even at the proved rate.
        let highest = boards.highest_rate(forward, busy)?.unwrap_or(f64::INFINITY);
        let what = format!("highest rate without a lost count, {way}, {load}");
        figures.push(
            Figure::new(format!("highest_{way}_{load}"), what, "counts/s", highest.round(), RATE_TOLERANCE)
                .within(PROVED_PER_S..)
                .proved(PROVED_PER_S),
        );
        let turning = Turning { cycles: JITTERED_CYCLES, forward, jittered: true, busy };
        let what = format!("counts lost at {}/s {way}, {load}, 30 % jitter", turning.per_s().round());
        // A weeder that has restarted has lost all counts.
        let lost = boards.lost_counts(turning)?.map_or(f64::INFINITY, |lost| lost as f64);
        figures.push(Figure::count(format!("lost_jitter_{way}_{load}"), what, lost).within(..=0.0).proved(0.0));
    }
    for (channel, name) in [(Line::EncoderA, "A"), (Line::EncoderB, "B")] {
        let left = boards.left_by_glitches(channel)?;
        let what = format!("counts left by glitches of channel {name}");
        figures.push(Figure::count(format!("glitches_{name}"), what, left).within(..=0.0));
    }
    Ok(figures)
}

/// Tolerance of the highest rate against the simulation's, in counts a second: a step of the search.
const RATE_TOLERANCE: f64 = 40_000.0;

/// Tolerance of times: a servo's frame and some turns of the loop, in ms.
const TIME_TOLERANCE_MS: f64 = 25.0;

fn time(id: impl Into<String>, what: impl Into<String>, value_ms: f64) -> Figure {
    Figure::new(id, what, "ms", value_ms, TIME_TOLERANCE_MS)
}

/// 1 if it is true, and right only then.
fn truth(id: String, what: String, value: bool) -> Figure {
    Figure::count(id, what, u8::from(value).into()).within(1.0..)
}

/// The figures of alarms, and of commands that take the tool out.
fn alarms(boards: &mut Boards, extent: Extent) -> Result<Vec<Figure>, CheckError> {
    let mut figures = Vec::new();
    let in_brief = [Alarm::BeamFlickers, Alarm::EncoderChannelDead];
    for scene in SCENES.iter().filter(|scene| !extent.brief || in_brief.contains(&scene.alarm)) {
        let raised = boards.play_scene(scene)?;
        let name = scene.alarm.text();
        let (first, second) = scene.alarm.code();
        let code = f64::from(10 * first + second);
        let what = |what: &str| format!("{}: {what}", scene.words);
        figures.extend([
            time(format!("{name}_out"), what("until the tool is out"), raised.out_ms).within(..=scene.limit_ms),
            truth(format!("{name}_raised"), what("alarm raised"), raised.is_expected),
            Figure::count(format!("{name}_code"), what("code of the LED"), raised.code).within(code..=code),
        ]);
    }
    let switch = boards.switch_to_out_ms()?;
    let hold = boards.hold_to_out_ms()?;
    let beam = boards.beam_to_window_ms()?;
    figures.extend([
        time("switch_out", "work switch opened, until the tool is out", switch).within(..=100.0),
        time("beam_out", "from a beam's edge to the window: out later than due", beam).within(-5.0..=30.0),
        time("hold_out", "`hold` typed, until the tool is out, computer included", hold).within(..=300.0),
    ]);
    Ok(figures)
}

/// Longest time without a pulse, in ms, and its tolerance: a bootloader takes up to 2 s, and a virtual Uno has none.
const RESET_MS: f64 = 2500.0;

fn resets(boards: &mut Boards, extent: Extent) -> Result<Vec<Figure>, CheckError> {
    let before = Kept::read(boards)?;
    let mut figures = Vec::new();
    for (way, id, words) in [
        (ResetBy::Pin, "pin", "reset by its pin, at work and rolling"),
        (ResetBy::Port, "port", "reset by opening the port, at work and rolling"),
        (ResetBy::Watchdog, "watchdog", "restarted by the watchdog, in hold"),
    ] {
        let Restart { without_pulse_ms, is_out } = boards.restart(way, extent.simulated)?;
        let what = |what: &str| format!("{words}: {what}");
        figures.extend([
            Figure::new(format!("reset_{id}_pulse"), what("without a pulse"), "ms", without_pulse_ms, RESET_MS)
                .within(..=RESET_MS),
            truth(format!("reset_{id}_out"), what("the tool is out behind it"), is_out),
        ]);
    }
    let moments = if extent.brief { 6 } else { 50 };
    let saves = boards.reset_while_saving(moments)?;
    let lost = before.lost(&Kept::read(boards)?) as f64;
    let torn = format!("settings torn by {moments} resets while saving");
    figures.extend([
        Figure::count("save_torn", torn, saves.torn.into()).within(..=0.0),
        Figure::new("save_new", "of these, new settings kept", "", saves.new.into(), moments.into()),
        Figure::count("kept", "settings and taught examples lost by all resets", lost).within(..=0.0),
    ]);
    Ok(figures)
}

/// Tolerances of a swing's mean and greatest error against the simulation's, in counts. Where two zones nearly touch, a
/// fraction of a count decides whether a run merges them. Single swings of 79 counts depend on that, and runs of the
/// same firmware had means from 9.1 to 13.0.
const SWING_TOLERANCES: [f64; 2] = [6.0, 80.0];

fn of_row(outcome: &Outcome, plants: usize, weeds: usize, speed: f64) -> Vec<Figure> {
    let Outcome { judgement, lost_counts } = outcome;
    let errors = || judgement.swing_errors_ticks().into_iter().map(f64::abs);
    let mean = errors().sum::<f64>() / errors().count().max(1) as f64;
    let [of_mean, of_worst] = SWING_TOLERANCES;
    let id = |what: &str| format!("row_{speed}_{what}");
    let what = |what: &str| format!("row of {plants} plants and {weeds} weeds at {speed} km/h: {what}");
    let count = |id_part, words, value| Figure::count(id(id_part), what(words), value);
    vec![
        count("reached", "zones reached", judgement.reached() as f64).within(..=0.0),
        count("cut", "tall weeds cut", judgement.weeds.iter().filter(|weed| weed.cut).count() as f64),
        count("lost", "counts lost", lost_counts.abs() as f64).within(..=0.0),
        Figure::new(id("swing_mean"), what("mean error of a swing"), "counts", mean, of_mean),
        Figure::new(
            id("swing_worst"),
            what("largest error of a swing"),
            "counts",
            errors().fold(0.0, f64::max),
            of_worst,
        ),
    ]
}
