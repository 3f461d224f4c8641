//! `weeder set-up`: the steps of the manual's page, on a machine or on the simulated one.
//!
//! It asks, measures, sets, and saves after each step. A file stores the completed steps and the measurements, so that
//! a set-up can be continued. The steps come from the manual's page, and the margin from [`set_up`], as in the
//! monitor and on the page.

mod changes;
mod machine;
mod measuring;
mod simulated;
mod state;

use self::changes::Changes;
use self::machine::{asked, take_arm};
use self::state::State;
use crate::input::{self, Line};
use crate::ports::Port;
use anyhow::{Context, Error, Result, ensure};
use clap::Args;
use control::alarm::Alarm;
use files::{bounded_file, whole_file};
use frame::{Messages, Results, source, whole_within};
use link::row_names::Board;
use link::settings::{self, Setting, SettingsError, allowed_top_speed, name, range, unit};
use link::{ConsoleLine, EventLine, Link, LinkError, Mode, Status, advice};
use mechanics::machine::Machine;
use set_up::{ManualStep, Task, steps};
use std::fmt;
use std::io::{self, IsTerminal, Write};
use std::path::PathBuf;
use std::sync::Arc;
use std::sync::atomic::{AtomicBool, Ordering};
use std::sync::mpsc::{Receiver, TryRecvError};

#[derive(Args)]
#[command(after_help = "\
It goes through the steps of docs/set-up.md. At every question, Enter takes what stands in [brackets], s leaves the step out,
and q stops. The next call continues at the open step. It ends with a summary.

Examples:
  weeder set-up --port /dev/ttyACM0
  weeder set-up --machine my.toml                 offers the stroke and leads of `weeder design --machine my.toml`
  weeder set-up --state left.txt --port left      each machine has its own file
  weeder set-up --simulated                       what each step brings in the simulated field")]
pub struct Arguments {
    #[command(flatten)]
    port: Port,
    /// The file for progress and measurements. It belongs to one machine.
    #[arg(long, value_name = "FILE", default_value = "set-up.txt")]
    state: PathBuf,
    /// Your machine, as for `weeder design`. Without it, the measures of arm, tool and servo are asked.
    #[arg(long, value_name = "FILE.toml", value_parser = source::file())]
    machine: Option<PathBuf>,
    /// Start again at the first step, and forget the measurements.
    #[arg(long)]
    again: bool,
    /// Do this step again, 1 to 8; docs/set-up.md says which after another part.
    #[arg(long, value_name = "N", value_parser = whole_within(1..=steps().len()), conflicts_with = "again")]
    step: Option<usize>,
    /// Do the steps on the simulated machine, and print what each of them brings.
    #[arg(long, conflicts_with_all = ["port", "state", "machine", "again", "step"])]
    simulated: bool,
}

/// More damaged plants than this, percent, are too many: a machine that was set up by the steps damages far fewer.
const MOST_DAMAGED_PERCENT: f64 = 0.5;

pub fn run(arguments: &Arguments) -> Result<()> {
    if arguments.simulated {
        return writeln!(Results, "{}\n{}", simulated::table()?, simulated::about());
    }
    let path = &arguments.state;
    let kept = match bounded_file::text(path) {
        Err(error) if error.is_absence() => String::new(),
        text => text?,
    };
    let kept_state =
        State::parse(&kept).with_context(|| format!("{} is no file of `weeder set-up`", path.display()))?;
    let mut state = if arguments.again { State::default() } else { kept_state };
    whole_file::check(path).with_context(|| format!("{} cannot be written", path.display()))?;
    let machine = arguments.machine.as_deref().map(mechanics::file::read).transpose()?;
    let measures = machine.as_ref().map(|machine| state.take_machine(machine)).unwrap_or_default();
    let known = machine.map_or_else(|| asked(&state), Ok)?;
    take_arm(&mut state.measured, &known);
    let board = Board::at(&arguments.port.board()?.port()?)?;
    let changes = Changes { other_board: state.take_board(&board), measures, again: arguments.step };
    let link = board.open()?;
    let stop = crate::ctrl_c()?;
    let guide = Guide { link, state, machine, typed: input::typed(), path: path.clone(), watches: false, stop };
    match guide.lead(changes) {
        Err(error) if error.is::<End>() => writeln!(Results, "Stopped. The same command continues here."),
        ended => ended,
    }
}

/// How the user ends a step early.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
enum End {
    LeaveOut,
    Stop,
}

impl fmt::Display for End {
    fn fmt(&self, f: &mut fmt::Formatter<'_>) -> fmt::Result {
        f.write_str("the user has ended the step")
    }
}

fn yes_or_no(typed: &str) -> Result<bool, String> {
    match typed.to_lowercase().as_str() {
        "yes" | "y" => Ok(true),
        "no" | "n" => Ok(false),
        _ => Err("type yes or no, s or q".to_owned()),
    }
}

struct Guide {
    link: Link,
    state: State,
    machine: Option<Machine>,
    typed: Receiver<Line>,
    path: PathBuf,
    /// Whether detections are printed while a question waits.
    watches: bool,
    /// Whether the user has typed Ctrl-C.
    stop: Arc<AtomicBool>,
}

impl Guide {
    fn lead(mut self, changes: Changes) -> Result<()> {
        writeln!(Results, "Enter takes what stands in [brackets], s leaves a step out, q stops.")?;
        self.link.ask("events on")?;
        self.compare(&changes)?;
        let steps = steps();
        let count = steps.len();
        for step in &steps {
            let ManualStep { number, title, how, tasks } = step;
            let why = self.open(tasks)?;
            // The last step follows from the others, and is asked for each time.
            let is_again = changes.again == Some(*number);
            if self.state.done.contains(number) && why.is_none() && *number < count && !is_again {
                writeln!(Results, "Step {number} of {count}, {title}: done")?;
                continue;
            }
            writeln!(Results, "\nStep {number} of {count}: {title}\n  {how}")?;
            if is_again {
                // The file has the earlier measurements until a new one is kept.
                self.forget(tasks);
            }
            if let Err(error) = self.step(tasks) {
                if error.downcast_ref() != Some(&End::LeaveOut) {
                    return Err(error);
                }
                writeln!(Results, "  Left out.")?;
                continue;
            }
            match self.open(tasks)? {
                None => self.state.done.insert(*number),
                Some(why) => {
                    writeln!(Results, "  Step {number} is still open: {why}")?;
                    self.state.done.remove(number)
                }
            };
            self.keep()?;
        }
        self.summary(&steps)
    }

    fn forget(&mut self, tasks: &[Task]) {
        for task in tasks {
            match task {
                Task::TimeServo => self.state.measured.forget_timings(),
                Task::MeasureWheel(_) => self.state.measured.ticks_per_m.clear(),
                _ => {}
            }
        }
    }

    /// Stops if the user has typed Ctrl-C: the tool may be in the row, or swing.
    fn obey_ctrl_c(&mut self) -> Result<()> {
        if self.stop.load(Ordering::Relaxed) {
            self.link.ask("hold")?;
            return Err(Error::msg(End::Stop));
        }
        Ok(())
    }

    /// The next event of the machine, with its line. An alarm is shown and cleared first.
    fn hear(&mut self) -> Result<Option<(EventLine, String)>> {
        self.obey_ctrl_c()?;
        let Some(line) = self.link.next_line()? else { return Ok(None) };
        let ConsoleLine::Event(event) = ConsoleLine::parse(&line) else { return Ok(None) };
        if matches!(event, EventLine::Alarm { .. } | EventLine::Newer { is_alarm: true }) {
            self.clear_alarm()?;
        }
        Ok(Some((event, line)))
    }

    /// Shows a latched alarm with its advice, and clears it if the user agrees.
    fn clear_alarm(&mut self) -> Result<()> {
        let Status { alarm, mode, .. } = settings::status(&mut self.link)?;
        let Some(alarm) = alarm else {
            ensure!(mode != Mode::Alarm, "the machine has an alarm that this version does not know");
            return Ok(());
        };
        // Its own line would ask again.
        while self.link.next_line()?.is_some() {}
        // A new board, or one that has lost its settings.
        if alarm == Alarm::SettingsLost {
            writeln!(Results, "The board has no saved settings: alarm 5-1 settings_lost. If a file has them, type q.")?;
            writeln!(Results, "Then `weeder settings push FILE.toml` restores them.")?;
            if !self.restore()? {
                self.go("Save its present settings, and clear the alarm")?;
                self.link.ask("save")?;
            }
        } else {
            writeln!(Results, "\n  alarm {}: {}", advice::name(alarm), advice::alarm(alarm))?;
            match alarm {
                Alarm::ToolStuck => self.set_end_switch("Clear the alarm, and use the end switch: on, off")?,
                _ => self.go("Clear the alarm")?,
            }
        }
        self.link.ask("clear")?;
        Ok(())
    }

    /// Why a step is open: the board's settings or the measurements show it.
    fn open(&mut self, tasks: &[Task]) -> Result<Option<String>> {
        Ok(self.state.measured.open(tasks, &settings::read(&mut self.link)?))
    }

    /// Prints what is set, what it is expected to weed, what is missing, and what to read next.
    fn summary(&mut self, steps: &[ManualStep]) -> Result<()> {
        let settings = settings::read(&mut self.link)?;
        writeln!(Results, "\nSummary\n  Set and saved:")?;
        for setting in Setting::all().filter(|&setting| settings.get(setting) != setting.default()) {
            let value = match (setting.is_switched(), settings.get(setting)) {
                (false, value) => value.to_string(),
                (true, value) => if value == 0 { "off" } else { "on" }.to_owned(),
            };
            writeln!(Results, "    {} {value} {}", name(setting), unit(setting))?;
        }
        let mut is_open = false;
        for ManualStep { number, title, tasks, .. } in steps {
            let why = self.state.measured.open(tasks, &settings);
            if why.is_some() || !self.state.done.contains(number) {
                is_open = true;
                writeln!(
                    Results,
                    "  Open: step {number}, {title}{}",
                    why.map(|why| format!(": {why}")).unwrap_or_default()
                )?;
            }
        }
        if let Some(warning) = self.state.measured.margin_warning(&settings) {
            writeln!(Results, "  Warning: {warning}")?;
        }
        let width_mm = self.tool_width_mm().context("the tool's width was not given in step 3");
        let machine = width_mm.and_then(|_| self.machine.map_or_else(|| asked(&self.state), Ok));
        let stroke_ms = self.state.measured.stroke_ms(&settings);
        let expected = machine.and_then(|machine| simulated::expected(&settings, &machine, stroke_ms));
        let if_open = if is_open { ", if the open steps change nothing" } else { "" };
        let said = match &expected {
            Ok((said, _)) => said.clone(),
            Err(error) => format!("not calculated, because {error:#}"),
        };
        writeln!(Results, "  Expected{if_open}: {said}")?;
        if expected.is_ok_and(|(_, damaged_percent)| damaged_percent > MOST_DAMAGED_PERCENT) {
            writeln!(Results, "  Warning: that damages too many plants. Do not weed like this.")?;
        }
        writeln!(Results, "  The measurements are in {}.", self.path.display())?;
        if is_open {
            return writeln!(Results, "  Next, do the open steps: the same command asks for them.");
        }
        writeln!(Results, "  Next, read docs/work.md (in a release: manual/docs/work.md).")
    }

    fn keep(&self) -> Result<()> {
        whole_file::write(&self.path, |to| to.write_all(self.state.text().as_bytes()))
            .with_context(|| format!("{} cannot be written", self.path.display()))
    }

    /// Asks until `parse` takes the answer; it fails with what would be right. Enter takes `shown`.
    fn ask_for<T>(
        &mut self,
        question: &str,
        shown: Option<&str>,
        parse: impl Fn(&str) -> Result<T, String>,
    ) -> Result<T> {
        'question: loop {
            // At a terminal, a line that was typed before the question is no answer to it.
            while io::stdin().is_terminal() && self.obey_typed()? {}
            let mut out = io::stdout().lock();
            write!(out, "  {question}{}: ", shown.map(|shown| format!(" [{shown}]")).unwrap_or_default())?;
            out.flush()?;
            drop(out);
            let typed = loop {
                match self.typed.try_recv() {
                    Ok(typed) => break typed,
                    Err(TryRecvError::Disconnected) => return Err(Error::msg(End::Stop)),
                    // Waits a fiftieth of a second for a line of the machine.
                    Err(TryRecvError::Empty) => match self.hear()? {
                        Some((EventLine::Alarm { .. }, _)) => continue 'question,
                        Some((EventLine::Detection { .. }, line)) if self.watches => writeln!(Results, "\n    {line}")?,
                        _ => {}
                    },
                }
            };
            let answer = match (typed.text.trim(), shown) {
                ("s", _) => return Err(Error::msg(End::LeaveOut)),
                ("q", _) => return Err(Error::msg(End::Stop)),
                ("", None) => Err("type the value, s or q".to_owned()),
                ("", Some(shown)) => parse(shown),
                (typed, _) => parse(typed),
            };
            match answer {
                Ok(answer) => return Ok(answer),
                Err(right) => writeln!(Messages, "  error: {right}"),
            }
        }
    }

    /// Waits until the user goes on.
    fn go(&mut self, question: &str) -> Result<()> {
        self.ask_for(question, Some("go on"), |typed| match typed {
            "go on" => Ok(()),
            _ => Err("type Enter, s or q".to_owned()),
        })
    }

    fn step(&mut self, tasks: &[Task]) -> Result<()> {
        self.clear_alarm()?;
        if tasks.is_empty() {
            return self.watch();
        }
        let needs_stroke = tasks.iter().any(|task| matches!(task, Task::Set(Setting::StemZoneMm, _)));
        let calculated = if needs_stroke { self.calculated()? } else { Vec::new() };
        for task in tasks {
            match *task {
                Task::Fit("machine.tool_width_mm", _) => self.measure_tool()?,
                // Settings are asked for below.
                Task::Fit(..) | Task::Set(..) => {}
                Task::TimeServo => self.time_servo()?,
                Task::MeasureWheel(length_mm) => self.measure_wheel(length_mm)?,
                Task::SetMargin => self.set_margin()?,
            }
        }
        // A lower top speed and a trailing arm's margin are not in the tasks.
        let mut to_set: Vec<Setting> = calculated.iter().map(|&(setting, _)| setting).collect();
        for task in tasks {
            if let Task::Set(setting, _) = *task
                && !to_set.contains(&setting)
            {
                to_set.push(setting);
            }
        }
        self.set(&to_set, &calculated)
    }

    fn set(&mut self, to_set: &[Setting], calculated: &[(Setting, u16)]) -> Result<()> {
        let wanted = self.values(to_set, calculated)?;
        self.agree(wanted, false).map(drop)
    }

    /// Asks for these settings. Enter takes the calculated value, or else the present one.
    fn values(&mut self, to_set: &[Setting], calculated: &[(Setting, u16)]) -> Result<Vec<(Setting, u16)>> {
        let offered = |setting| calculated.iter().find(|(offered, _)| *offered == setting).map(|&(_, value)| value);
        to_set.iter().map(|&setting| Ok((setting, self.value(setting, offered(setting))?))).collect()
    }

    /// Sets these settings. While they contradict the others, asks for them again, unless they `are_measured`, and for a lower top
    /// speed that would do.
    fn agree(&mut self, mut wanted: Vec<(Setting, u16)>, are_measured: bool) -> Result<Vec<(Setting, u16)>> {
        loop {
            let pushed = self.push(&wanted);
            match pushed.as_ref().map_err(Error::downcast_ref) {
                Err(Some(error @ SettingsError::Contradiction(_))) if !wanted.is_empty() => {
                    writeln!(Messages, "  error: {error}")
                }
                _ => return pushed.map(|()| wanted),
            }
            wanted.retain(|&(setting, _)| setting != Setting::TopSpeedMmS);
            if !are_measured {
                let to_set: Vec<Setting> = wanted.iter().map(|&(setting, _)| setting).collect();
                wanted = self.values(&to_set, &wanted)?;
            }
            // A near beam or a long lead leaves the tool little time.
            let mut after = settings::read(&mut self.link)?;
            for &(setting, value) in &wanted {
                // It is in its range.
                let _ = after.set(setting, value);
            }
            match allowed_top_speed(&after) {
                Ok(allowed_mm_s) if allowed_mm_s < after.get(Setting::TopSpeedMmS) => {
                    wanted.extend(self.values(&[Setting::TopSpeedMmS], &[(Setting::TopSpeedMmS, allowed_mm_s)])?);
                }
                _ if are_measured => return pushed.map(|()| wanted),
                _ => {}
            }
        }
    }

    /// Shows the detections as they come.
    fn watch(&mut self) -> Result<()> {
        self.watches = true;
        let ended = self.go("The lines come here. When each plant gives one");
        self.watches = false;
        ended
    }

    fn push(&mut self, wanted: &[(Setting, u16)]) -> Result<()> {
        let set = settings::push(&mut self.link, wanted, &[], true)?;
        for setting in set {
            writeln!(Results, "  {setting} is set and saved")?;
        }
        self.state.measured.settings = settings::read(&mut self.link)?;
        Ok(())
    }

    /// Asks for a setting's value. Enter takes the offered one, or else the present one.
    fn value(&mut self, setting: Setting, offered: Option<u16>) -> Result<u16> {
        let now = settings::read(&mut self.link)?.get(setting);
        // A count has no unit.
        let mut question = format!("{} in {}", name(setting), unit(setting)).trim_end_matches(" in ").to_owned();
        if offered.is_some_and(|offered| offered != now) {
            question += &format!(", now {now}");
        }
        let shown = offered.unwrap_or(now).to_string();
        self.ask_for(&question, Some(&shown), |typed| {
            let value = typed.parse().ok().filter(|value| setting.allows(*value));
            value.ok_or_else(|| format!("{} has to be a whole number, {}", name(setting), range(setting)))
        })
    }

    /// Types a command. `None` if the machine refuses it; the reason was printed, and an alarm cleared.
    fn ask(&mut self, command: &str) -> Result<Option<Vec<String>>> {
        match self.link.ask(command) {
            Ok(answer) => Ok(Some(answer)),
            Err(LinkError::Refused { answer, .. }) => {
                writeln!(Messages, "  {answer}");
                self.clear_alarm()?;
                Ok(None)
            }
            Err(error) => Err(error.into()),
        }
    }
}
