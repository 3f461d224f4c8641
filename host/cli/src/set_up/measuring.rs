//! The measurements of a set-up: the servo's times, the wheel, and the margin that follows from them.

use super::{End, Guide, yes_or_no};
use anyhow::{Error, Result, bail};
use frame::{Messages, Results};
use link::settings::{self, Setting, name, range};
use link::{EventLine, Mode, Status};
use set_up::{SEE_TO_SERVO, SetUp, Step};
use std::io::{self, IsTerminal};
use std::sync::mpsc::RecvTimeoutError;
use std::thread;
use std::time::{Duration, Instant};

/// Time limit for the servo's six swings out and in, which take 20 s: a simulated machine on a busy computer is slower.
const SWINGS: Duration = Duration::from_secs(60);

/// Time limit for plants to pass.
const PLANTS: Duration = Duration::from_secs(600);

/// Time between two checks whether the machine stands, and the ticks after which it has left a mark.
const POLL: Duration = Duration::from_millis(200);
const ROLLED_TICKS: u32 = 500;

/// After this time, a wait for the machine says what the encoder counts.
const PATIENCE: Duration = Duration::from_secs(5);

/// Time in which a line that was typed before comes.
const TYPED: Duration = Duration::from_millis(20);

/// From this speed on, the machine ends timed swings: 0.05 km/h, rounded up.
const ROLLS_MM_S: u32 = 15;

const END_SWITCH: &str = "An end switch on D5 times the servo by itself: on, off";

/// What is seen of six swings without an end switch, as docs/calibration.md has it.
const SEEN: [(Setting, &str); 2] = [
    (Setting::LeadOutMs, "The longest time from a swing's begin until the tool was out, in ms"),
    (Setting::LeadInMs, "The shortest time from a command in until the tool began to move, in ms"),
];

impl Guide {
    /// Times the servo until there are enough measurements over the present stroke.
    pub(super) fn time_servo(&mut self) -> Result<()> {
        self.push(&[])?;
        self.set_end_switch(END_SWITCH)?;
        loop {
            let settings = settings::read(&mut self.link)?;
            let missing = self.state.measured.missing(&settings);
            let Some(step) = missing.iter().find(|step| matches!(step, Step::TimeServo(_))) else {
                let leads = missing.iter().filter_map(|step| match *step {
                    Step::SetLead(lead, worst_ms) => Some((lead, worst_ms)),
                    _ => None,
                });
                let leads: Vec<(Setting, u16)> = leads.collect();
                return self.push(&leads);
            };
            writeln!(Results, "  Next, {step}")?;
            self.go("Stop the machine where no plant is within the tool's reach. Keep clear of the tool")?;
            let from = self.stands_at(None)?;
            if self.ask("calibrate servo")?.is_none() {
                continue;
            }
            if io::stdin().is_terminal() {
                writeln!(Results, "  The tool swings six times. Enter ends that at once.")?;
            }
            let Some((event, line)) = self.swings(from)? else { continue };
            match event {
                EventLine::NotCalibrated {} => {
                    writeln!(Messages, "  error: the end switch did not follow: see to it, or type off");
                    // A switch that never closes has an alarm in a third of a second, which asks the same.
                    thread::sleep(Duration::from_millis(500));
                    match settings::status(&mut self.link)?.alarm {
                        Some(_) => self.clear_alarm()?,
                        None => self.set_end_switch(END_SWITCH)?,
                    }
                }
                EventLine::CalibratedBySwitch { out_ms, in_ms, is_set } => {
                    writeln!(
                        Results,
                        "  The tool was out after {out_ms} ms, and began to come back after {in_ms} ms."
                    )?;
                    if !Setting::LeadOutMs.allows(out_ms) || !Setting::LeadInMs.allows(in_ms) {
                        bail!(
                            "the firmware takes leads of up to {} ms: take a faster servo or valve, or a shorter stroke",
                            Setting::LeadOutMs.greatest()
                        );
                    }
                    if !is_set {
                        bail!(
                            "a lead of {out_ms} ms needs the beam farther ahead, or a lower top_speed_mm_s: change one of them"
                        );
                    }
                    self.state.measured.take_line(&line);
                }
                _ => {
                    let seen = self.seen()?;
                    let leads = self.agree(seen, true)?;
                    self.state.measured.take_line(&line);
                    for (lead, ms) in leads {
                        self.state.measured.take_line(&format!("> set {} {ms}", name(lead)));
                    }
                }
            }
            self.keep()?;
        }
    }

    /// Asks for the times that the user saw. Nothing is offered: what was calculated is no measurement.
    fn seen(&mut self) -> Result<Vec<(Setting, u16)>> {
        loop {
            let mut seen = Vec::new();
            for (lead, question) in SEEN {
                let ms = self.ask_for(question, None, |typed| {
                    let value = typed.parse().ok().filter(|value| lead.allows(*value));
                    value.ok_or_else(|| format!("it has to be a whole number, {}", range(lead)))
                })?;
                seen.push((lead, ms));
            }
            let [(_, out_ms), (_, in_ms)] = seen[..] else { continue };
            let question =
                format!("Out after {out_ms} ms, and on its way back after {in_ms} ms. Is that right: yes, no");
            if self.ask_for(&question, Some("yes"), yes_or_no)? {
                return Ok(seen);
            }
        }
    }

    /// Asks whether the end switch is in use.
    pub(super) fn set_end_switch(&mut self, question: &str) -> Result<()> {
        let has_switch = settings::read(&mut self.link)?.get(Setting::EndSwitch) > 0;
        let shown = if has_switch { "on" } else { "off" };
        let wanted = self.ask_for(question, Some(shown), |typed| match typed {
            "on" => Ok(1),
            "off" => Ok(0),
            _ => Err("type on or off".to_owned()),
        })?;
        self.push(&[(Setting::EndSwitch, wanted)])
    }

    /// Waits for the result of the timed swings. `None` if the machine has dropped them; the reason was printed.
    fn swings(&mut self, from: i32) -> Result<Option<(EventLine, String)>> {
        let calibrated = |event: &EventLine| {
            use EventLine::{CalibratedByEye, CalibratedBySwitch, NotCalibrated};
            matches!(event, CalibratedBySwitch { .. } | CalibratedByEye {} | NotCalibrated {})
        };
        let deadline = Instant::now() + SWINGS;
        let mut has_moved = false;
        while Instant::now() < deadline && !has_moved {
            let until = Instant::now() + POLL;
            while Instant::now() < until {
                match self.hear()? {
                    Some((EventLine::Alarm { .. }, _)) => return Ok(None),
                    Some((event, line)) if calibrated(&event) => return Ok(Some((event, line))),
                    _ => {}
                }
            }
            // Piped lines answer later questions.
            if io::stdin().is_terminal() && self.end_swings()? {
                return Ok(None);
            }
            has_moved = settings::status(&mut self.link)?.speed_mm_s.unsigned_abs() >= ROLLS_MM_S;
        }
        let has_moved = has_moved || settings::status(&mut self.link)?.position != from;
        if has_moved {
            writeln!(
                Messages,
                "  The wheel moved, so the machine has dropped the measurement. Hold the machine still."
            );
        } else {
            writeln!(Messages, "  The machine has not reported the swings within {} seconds.", SWINGS.as_secs());
        }
        Ok(None)
    }

    /// Ends the swings if the user has typed anything, and returns whether that is so.
    fn end_swings(&mut self) -> Result<bool> {
        let typed = self.obey_typed();
        if !matches!(typed, Ok(false)) {
            self.link.ask("hold")?;
            writeln!(Results, "  The swings are ended, and the tool is out.")?;
        }
        typed
    }

    /// Waits until the machine stands, and returns its position. With `from`, it must first have left that position.
    fn stands_at(&mut self, from: Option<i32>) -> Result<i32> {
        let (since, mut before, mut is_told) = (Instant::now(), None, false);
        loop {
            let Status { position, speed_mm_s, mode, .. } = settings::status(&mut self.link)?;
            if mode == Mode::Alarm {
                self.clear_alarm()?;
                continue;
            }
            let has_rolled = from.is_none_or(|from| position.abs_diff(from) > ROLLED_TICKS);
            if has_rolled && speed_mm_s == 0 && before == Some(position) {
                return Ok(position);
            }
            if since.elapsed() > PATIENCE {
                if !std::mem::replace(&mut is_told, true) {
                    let wanted = if has_rolled { "stand still" } else { "roll farther" };
                    writeln!(
                        Messages,
                        "  The machine has to {wanted}: pos={position} speed_mm_s={speed_mm_s}. If that is wrong, see to the \
                         encoder. s leaves the step out, q stops."
                    );
                }
                self.obey_typed()?;
            }
            self.obey_ctrl_c()?;
            before = Some(position);
            thread::sleep(POLL);
        }
    }

    /// Ends the step if the user has typed that. Drops any other line, and returns whether there was one.
    pub(super) fn obey_typed(&self) -> Result<bool> {
        match self.typed.recv_timeout(TYPED).as_ref().map(|typed| typed.text.trim()) {
            Ok("s") => Err(Error::msg(End::LeaveOut)),
            Ok("q") | Err(RecvTimeoutError::Disconnected) => Err(Error::msg(End::Stop)),
            typed => Ok(typed.is_ok()),
        }
    }

    /// Measures the wheel until there are enough measurements.
    pub(super) fn measure_wheel(&mut self, length_mm: u16) -> Result<()> {
        let settings = settings::read(&mut self.link)?;
        if self.state.measured.missing(&settings).contains(&Step::MeasureWheel(0)) {
            // They were of another wheel.
            self.state.measured.ticks_per_m.clear();
        }
        'stretches: loop {
            let stretches = self.state.measured.ticks_per_m.len();
            if stretches >= SetUp::STRETCHES {
                return self.push(&[]);
            }
            writeln!(Results, "  Stretch {} of {}", stretches + 1, SetUp::STRETCHES)?;
            self.go("Stand at the first mark, and stand still")?;
            let from = self.stands_at(None)?;
            if self.ask("calibrate start")?.is_none() {
                continue;
            }
            let question = "Roll to the other mark and stand still; the distance in mm, or again";
            // The machine still knows the first mark after a refusal.
            let (command, answer) = loop {
                let length = self.ask_for(question, Some(&length_mm.to_string()), distance)?;
                if length == AGAIN {
                    continue 'stretches;
                }
                if let Some(warning) = backward(from, self.stands_at(Some(from))?) {
                    writeln!(Messages, "  Warning: {warning}");
                }
                let command = format!("calibrate {length}");
                if let Some(answer) = self.ask(&command)? {
                    break (command, answer);
                }
            };
            self.state.measured.take_line(&format!("> {command}"));
            answer.iter().for_each(|line| self.state.measured.take_line(line));
            answer.iter().try_for_each(|line| writeln!(Results, "  {line}"))?;
            self.push(&[])?;
            self.keep()?;
        }
    }

    /// Sets the margin that follows from the measurements, or prints what is missing.
    pub(super) fn set_margin(&mut self) -> Result<()> {
        self.push(&[])?;
        let settings = settings::read(&mut self.link)?;
        if matches!(self.state.measured.missing(&settings)[..], [Step::PassPlants(_)]) {
            writeln!(Results, "  Roll past plants: both beams measure the slip.")?;
        }
        loop {
            match self.state.measured.margin(&settings) {
                Ok(margin) => {
                    let least_mm = margin.least_mm();
                    writeln!(Results, "  The measurements ask for {least_mm} mm: {margin}")?;
                    let value = self.value(Setting::MarginMm, Some(least_mm))?;
                    self.state.measured.take_line(&format!("> set {} {value}", name(Setting::MarginMm)));
                    self.push(&[(Setting::MarginMm, value)])?;
                    if let Some(warning) = self.state.measured.warning(&settings::read(&mut self.link)?) {
                        writeln!(Messages, "  Warning: {warning}");
                    }
                    return Ok(());
                }
                Err(missing) => {
                    let [Step::PassPlants(_)] = missing[..] else {
                        for step in &missing {
                            writeln!(Results, "  Missing: {step}")?;
                        }
                        // A slip of the finger, for example.
                        if let [Step::MeasureAgain(_, SEE_TO_SERVO)] = missing[..]
                            && self.ask_for(
                                "Forget the servo's times, and time it again: yes, no",
                                Some("no"),
                                yes_or_no,
                            )?
                        {
                            self.state.measured.forget_timings();
                        }
                        return writeln!(Results, "  The margin stays at {} mm.", settings.get(Setting::MarginMm));
                    };
                    self.pass_plant()?;
                }
            }
        }
    }

    /// Listens to the next plant that passes both beams.
    fn pass_plant(&mut self) -> Result<()> {
        let deadline = Instant::now() + PLANTS;
        while Instant::now() < deadline {
            self.obey_typed()?;
            if let Some((EventLine::Slip { permille }, line)) = self.hear()? {
                writeln!(Results, "  slip {permille} permille")?;
                self.state.measured.take_line(&line);
                return self.keep();
            }
        }
        writeln!(Messages, "  No plant has passed both beams for {} minutes.", PLANTS.as_secs() / 60);
        Err(Error::msg(End::LeaveOut))
    }
}

/// The answer that begins a stretch again.
const AGAIN: &str = "again";

/// A distance in mm, as the machine takes it: with `force` for one that does not fit the wheel. Or [`AGAIN`].
fn distance(typed: &str) -> Result<String, String> {
    let length = typed.strip_suffix(" force").unwrap_or(typed);
    let is_right = typed == AGAIN || length.parse::<u16>().is_ok();
    let right = "type a whole number in mm, as `10000` or `10000 force`, or `again` for a new stretch";
    if is_right { Ok(typed.to_owned()) } else { Err(right.to_owned()) }
}

/// A warning if the machine counted backward between these positions.
fn backward(from: i32, to: i32) -> Option<&'static str> {
    let warning = "the machine counted backward. If it rolled forward, swap D2 and D3 at the encoder";
    (to.wrapping_sub(from) < 0).then_some(warning)
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn a_stretch_that_counts_backward_gets_a_warning() {
        assert_eq!(backward(100, 19_000), None);
        assert_eq!(backward(i32::MAX, i32::MIN + 19_000), None);
        assert!(backward(100, -19_000).is_some_and(|warning| warning.contains("swap D2 and D3")));
    }

    #[test]
    fn a_distance_is_a_whole_number_of_millimetres() {
        for (typed, is_right) in [
            ("5000", true),
            ("5000 force", true),
            ("again", true),
            ("5 m", false),
            ("5\u{a0}000", false),
            ("start", false),
        ] {
            assert_eq!(distance(typed).is_ok(), is_right, "{typed}");
        }
    }
}
