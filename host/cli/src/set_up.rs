//! `weeder set-up`: the steps of the manual's page, on a machine or on the simulated one.
//!
//! It asks, measures, sets, and saves after each step. A file stores the completed steps and the measurements, so that
//! a set-up can be continued. The steps come from the manual's page, and the margin from [`link::set_up`], as in the
//! monitor and on the page.

mod simulated;

use crate::output::{say, tell};
use crate::ports::Port;
use anyhow::{Context, Result, bail};
use clap::Args;
use files::{bounded_file, whole_file};
use link::set_up::{ManualStep, SetUp, Step, Task, steps};
use link::settings::{self, Setting, name, range, unit};
use link::{ConsoleLine, EventLine, Link, LinkError, Mode, Status};
use std::collections::BTreeSet;
use std::io::{self, BufRead, Write};
use std::path::PathBuf;
use std::thread;
use std::time::{Duration, Instant};

#[derive(Args)]
#[command(after_help = "\
It goes through the steps of docs/set-up.md. Enter accepts, s skips a step, q stops.
The next call continues at the open step.

Examples:
  weeder set-up --port /dev/ttyACM0
  weeder set-up --state left.txt --port left      each row has its own file
  weeder set-up --simulated                       what each step brings in the simulated field")]
pub struct Arguments {
    #[command(flatten)]
    port: Port,
    /// The file for progress and measurements.
    #[arg(long, value_name = "FILE", default_value = "set-up.txt")]
    state: PathBuf,
    /// Start again at the first step, and forget the measurements.
    #[arg(long)]
    again: bool,
    /// Do the steps on the simulated machine, and print what each of them brings.
    #[arg(long, conflicts_with_all = ["port", "state", "again"])]
    simulated: bool,
}

/// Time limit for the servo's six swings out and in, and for waiting for plants.
const SWINGS: Duration = Duration::from_secs(30);
const PLANTS: Duration = Duration::from_secs(600);

/// Time between two checks whether the machine stands, and the ticks after which it has left a mark.
const POLL: Duration = Duration::from_millis(200);
const ROLLED_TICKS: u32 = 500;

/// Leads through the steps.
pub fn run(arguments: &Arguments) -> Result<()> {
    if arguments.simulated {
        return say!("{}\n{}", simulated::table()?, simulated::about());
    }
    let path = &arguments.state;
    let kept = match bounded_file::text(path) {
        Err(error) if error.is_absence() => String::new(),
        text => text?,
    };
    let kept_state =
        State::parse(&kept).with_context(|| format!("{} is no file of `weeder set-up`", path.display()))?;
    let state = if arguments.again { State::parse("")? } else { kept_state };
    let link = arguments.port.open()?;
    Guide { link, state, path: path.clone() }.lead()
}

/// The completed steps and the measurements.
struct State {
    done: BTreeSet<usize>,
    measured: SetUp,
}

/// The first line of its file.
const HEAD: &str = "# What `weeder set-up` has done and measured: it goes on from here.";

/// The text before the number of a completed step.
const DONE: &str = "done ";

impl State {
    fn parse(text: &str) -> Result<Self> {
        let mut lines = text.lines();
        match lines.next() {
            None | Some(HEAD) => {}
            Some(_) => bail!("its first line has to be `{HEAD}`; give another --state"),
        }
        let is_done = |line: &&str| line.starts_with(DONE);
        let done = lines.clone().filter(is_done).filter_map(|line| line[DONE.len()..].parse().ok()).collect();
        Ok(Self { done, measured: SetUp::of_lines(lines.filter(|line| !is_done(line))) })
    }

    fn text(&self) -> String {
        let done = self.done.iter().map(|number| format!("{DONE}{number}"));
        let lines: Vec<String> =
            std::iter::once(HEAD.to_owned()).chain(done).chain(self.measured.lines()).chain([String::new()]).collect();
        lines.join("\n")
    }
}

/// The user's answer to a step, and how the step ended.
enum Answer {
    Go,
    LeaveOut,
    Stop,
}

/// Leads the user through the steps.
struct Guide {
    link: Link,
    state: State,
    path: PathBuf,
}

impl Guide {
    fn lead(mut self) -> Result<()> {
        if settings::status(&mut self.link)?.mode == Mode::Alarm {
            // A new board has no saved settings, which is an alarm. This saves the present ones.
            self.link.ask("save")?;
            self.link.ask("clear")?;
        }
        self.link.ask("events on")?;
        let steps = steps();
        let count = steps.len();
        for step in &steps {
            let ManualStep { number, title, how, tasks } = step;
            // The last step follows from the others, and is asked for each time.
            if self.state.done.contains(number) && *number < count {
                say!("Step {number} of {count}, {title}: done")?;
                continue;
            }
            say!("\nStep {number} of {count}: {title}\n  {how}")?;
            match self.step(tasks)? {
                Answer::Go => {
                    self.state.done.insert(*number);
                    self.keep()?;
                }
                Answer::LeaveOut => say!("  Left out.")?,
                Answer::Stop => return say!("Stopped. The same command continues here."),
            }
        }
        say!("\nThe settings are saved on the machine. The measurements are in {}.", self.path.display())
    }

    fn keep(&self) -> Result<()> {
        whole_file::write(&self.path, |to| to.write_all(self.state.text().as_bytes()))
            .with_context(|| format!("{} cannot be written", self.path.display()))
    }

    /// Asks for a line. `None` at the end of the input.
    fn prompt(&self, question: &str) -> Result<Option<String>> {
        let mut out = io::stdout().lock();
        write!(out, "  {question}: ")?;
        out.flush()?;
        let mut line = String::new();
        let read = io::stdin().lock().read_line(&mut line)?;
        Ok((read > 0).then(|| line.trim().to_owned()))
    }

    fn go(&self, question: &str) -> Result<Answer> {
        loop {
            match self.prompt(&format!("{question} (Enter, s to leave it out, q to stop)"))?.as_deref() {
                Some("") => return Ok(Answer::Go),
                Some("s") => return Ok(Answer::LeaveOut),
                None | Some("q") => return Ok(Answer::Stop),
                Some(_) => tell!("  error: type Enter, s or q"),
            }
        }
    }

    fn step(&mut self, tasks: &[Task]) -> Result<Answer> {
        for task in tasks {
            if let Task::Fit(part, value) = task {
                say!("  Part: {part} = {value} on the simulated machine")?;
            }
        }
        let answer = self.go("Do it")?;
        if !matches!(answer, Answer::Go) {
            return Ok(answer);
        }
        let mut wanted = Vec::new();
        for task in tasks {
            let goes_on = match *task {
                Task::Fit(..) => true,
                Task::Set(setting, of_the_manual) => {
                    let value = self.value(setting, Some(of_the_manual))?;
                    wanted.extend(value.map(|value| (setting, value)));
                    value.is_some()
                }
                Task::TimeServo => self.time_servo()?,
                Task::MeasureWheel(length_mm) => self.measure_wheel(length_mm)?,
                Task::SetMargin => self.set_margin()?,
            };
            if !goes_on {
                return Ok(Answer::Stop);
            }
        }
        self.push(&wanted)?;
        Ok(Answer::Go)
    }

    /// Sets and saves.
    fn push(&mut self, wanted: &[(Setting, u16)]) -> Result<()> {
        let set = settings::push(&mut self.link, wanted, &[], true)?;
        for setting in set {
            say!("  {setting} is set and saved")?;
        }
        self.state.measured.settings = settings::read(&mut self.link)?;
        Ok(())
    }

    /// Asks for a setting's value. `None` if the user stops.
    fn value(&mut self, setting: Setting, of_the_manual: Option<u16>) -> Result<Option<u16>> {
        let now = settings::read(&mut self.link)?.get(setting);
        let range_of = setting.description();
        let manual = of_the_manual.map_or(String::new(), |value| format!(", m takes the manual's {value}"));
        loop {
            let question = format!("{} in {}; Enter keeps {now}{manual}, or type it", name(setting), unit(setting));
            let value = match self.prompt(&question)?.as_deref() {
                None | Some("q") => return Ok(None),
                Some("") => Some(now),
                Some("m") => of_the_manual,
                Some(typed) => typed.parse().ok(),
            };
            match value.filter(|value| (range_of.least..=range_of.greatest).contains(value)) {
                Some(value) => return Ok(Some(value)),
                None => tell!("  error: {} has to be a whole number, {}", name(setting), range(setting)),
            }
        }
    }

    /// Waits for an event of the machine.
    fn wait_for<T>(&mut self, time: Duration, wanted: impl Fn(&EventLine) -> Option<T>) -> Result<Option<(T, String)>> {
        let deadline = Instant::now() + time;
        while Instant::now() < deadline {
            let Some(line) = self.link.next_line()? else { continue };
            if let ConsoleLine::Event(event) = ConsoleLine::parse(&line)
                && let Some(found) = wanted(&event)
            {
                return Ok(Some((found, line)));
            }
        }
        Ok(None)
    }

    /// Types a command. `None` if the machine refuses it; the reason was printed.
    fn ask(&mut self, command: &str) -> Result<Option<Vec<String>>> {
        match self.link.ask(command) {
            Ok(answer) => Ok(Some(answer)),
            Err(LinkError::Refused { answer, .. }) => {
                tell!("  {answer}");
                Ok(None)
            }
            Err(error) => Err(error.into()),
        }
    }

    /// Times the servo until there are enough measurements over the present stroke.
    fn time_servo(&mut self) -> Result<bool> {
        self.push(&[])?;
        loop {
            let settings = settings::read(&mut self.link)?;
            let missing = self.state.measured.missing(&settings);
            let Some(step) = missing.iter().find(|step| matches!(step, Step::TimeServo(_))) else {
                let leads = missing.iter().filter_map(|step| match *step {
                    Step::SetLead(lead, worst_ms) => Some((lead, worst_ms)),
                    _ => None,
                });
                let leads: Vec<(Setting, u16)> = leads.collect();
                self.push(&leads)?;
                return Ok(true);
            };
            say!("  Next, {step}")?;
            if !matches!(self.go("Keep clear of the tool")?, Answer::Go) {
                return Ok(false);
            }
            self.stands_at(None)?;
            if self.ask("calibrate servo")?.is_none() {
                continue;
            }
            let calibrated = |event: &EventLine| {
                use EventLine::{CalibratedByEye, CalibratedBySwitch, NotCalibrated};
                matches!(event, CalibratedBySwitch { .. } | CalibratedByEye {} | NotCalibrated {}).then_some(*event)
            };
            let Some((event, line)) = self.wait_for(SWINGS, calibrated)? else {
                bail!("the machine has not reported the swings: is it in hold?");
            };
            match event {
                EventLine::NotCalibrated {} => {
                    tell!("  error: the end switch did not follow: see to it, or type `set end_switch off`")
                }
                EventLine::CalibratedBySwitch { out_ms, in_ms, is_set } => {
                    say!("  The tool was out after {out_ms} ms, and began to come back after {in_ms} ms.")?;
                    if !is_set {
                        bail!(
                            "a lead of {out_ms} ms needs the beam farther ahead, or a lower top_speed_mm_s: change one of them"
                        );
                    }
                    self.state.measured.take_line(&line);
                }
                _ => {
                    self.state.measured.take_line(&line);
                    let mut leads = Vec::new();
                    for lead in [Setting::LeadOutMs, Setting::LeadInMs] {
                        let Some(value) = self.value(lead, None)? else { return Ok(false) };
                        leads.push((lead, value));
                    }
                    self.push(&leads)?;
                }
            }
            self.keep()?;
        }
    }

    /// Waits until the machine stands, and returns its position. With `from`, it must first have left that position.
    fn stands_at(&mut self, from: Option<i32>) -> Result<i32> {
        let mut before = None;
        loop {
            let Status { position, speed_mm_s, .. } = settings::status(&mut self.link)?;
            let has_rolled = from.is_none_or(|from| position.abs_diff(from) > ROLLED_TICKS);
            if has_rolled && speed_mm_s == 0 && before == Some(position) {
                return Ok(position);
            }
            before = Some(position);
            thread::sleep(POLL);
        }
    }

    /// Measures the wheel until there are enough measurements.
    fn measure_wheel(&mut self, length_mm: u16) -> Result<bool> {
        loop {
            let stretches = self.state.measured.stretches();
            if stretches >= SetUp::STRETCHES {
                self.push(&[])?;
                return Ok(true);
            }
            say!("  Stretch {} of {}", stretches + 1, SetUp::STRETCHES)?;
            if !matches!(self.go("Stand at the first mark, and stand still")?, Answer::Go) {
                return Ok(false);
            }
            let from = self.stands_at(None)?;
            if self.ask("calibrate start")?.is_none() {
                continue;
            }
            let typed =
                self.prompt(&format!("Roll to the other mark and stand; the distance in mm, Enter for {length_mm}"))?;
            let length = match typed.as_deref() {
                None | Some("q") => return Ok(false),
                Some("") => length_mm.to_string(),
                Some(typed) => typed.to_owned(),
            };
            self.stands_at(Some(from))?;
            let command = format!("calibrate {length}");
            let Some(answer) = self.ask(&command)? else { continue };
            self.state.measured.take_line(&format!("> {command}"));
            answer.iter().for_each(|line| self.state.measured.take_line(line));
            answer.iter().try_for_each(|line| say!("  {line}"))?;
            self.push(&[])?;
            self.keep()?;
        }
    }

    /// Sets the margin that follows from the measurements, or prints what is missing.
    fn set_margin(&mut self) -> Result<bool> {
        self.push(&[])?;
        let settings = settings::read(&mut self.link)?;
        loop {
            match self.state.measured.margin(&settings) {
                Ok(margin) => {
                    let least_mm = margin.least_mm();
                    say!("  The measurements ask for {least_mm} mm: {margin}")?;
                    let Some(value) = self.value(Setting::MarginMm, Some(least_mm))? else { return Ok(false) };
                    self.state.measured.take_line(&format!("> set {} {value}", name(Setting::MarginMm)));
                    self.push(&[(Setting::MarginMm, value)])?;
                    if let Some(warning) = self.state.measured.warning(&settings::read(&mut self.link)?) {
                        tell!("  Warning: {warning}");
                    }
                    return Ok(true);
                }
                Err(missing) => {
                    let [Step::PassPlants(_)] = missing[..] else {
                        for step in missing {
                            say!("  Missing: {step}")?;
                        }
                        say!("  The margin stays at {} mm.", settings.get(Setting::MarginMm))?;
                        return Ok(true);
                    };
                    say!("  Roll past plants: both beams measure the slip.")?;
                    if !self.pass_plants()? {
                        return Ok(false);
                    }
                }
            }
        }
    }

    /// Listens to the next plant that passes both beams.
    fn pass_plants(&mut self) -> Result<bool> {
        let slip = |event: &EventLine| match *event {
            EventLine::Slip { permille } => Some(permille),
            _ => None,
        };
        let Some((permille, line)) = self.wait_for(PLANTS, slip)? else {
            tell!("  No plant has passed both beams for {} minutes.", PLANTS.as_secs() / 60);
            return Ok(false);
        };
        say!("  slip {permille} permille")?;
        self.state.measured.take_line(&line);
        self.keep()?;
        Ok(true)
    }
}
