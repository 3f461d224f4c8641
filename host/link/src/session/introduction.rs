//! The first questions of a session: version, settings, examples and status. If an answer is missing or wrong, they are
//! asked from the beginning.

use super::happening::named_warning;
use super::{Asked, EVENTS, EXAMPLES, HOLD, Happening, POLL, SETTINGS, STATUS, Session, State, VERSION};
use crate::settings::{self, Shown};
use crate::{COMMAND_LENGTH, ConsoleLine, EventLine, LinkError, Status, lines};

/// Further tries to ask for everything, if an answer is missing or belongs to another question.
const RETRIES: usize = 2;

/// The same, where a weeder has answered over this wire. To open its port again resets it, and a closed session types no
/// `hold`.
const RETRIES_OF_A_WEEDER: usize = 8;

/// Most further questions for the settings in a try.
const UNSTEADY: usize = 10;

/// The first questions. The first status is asked only if earlier tries may still be answered: it is the first answer
/// that cannot belong to those.
pub(super) const INTRODUCTION: [&str; 6] = [VERSION, STATUS, SETTINGS, EXAMPLES, EVENTS, STATUS];
const LAST: usize = INTRODUCTION.len() - 1;

/// Backspaces, which delete a line of any length. Ended instead, the rest of a line would be a late command.
pub(super) const ERASE: u8 = 0x08;

/// What the first answers have said.
#[derive(Default)]
pub(super) struct Introduction {
    /// Earlier tries.
    pub(super) tries: usize,
    /// Most answers to earlier questions that may still come.
    pub(super) late: usize,
    /// Whether a `hold` was typed whose answer cannot be told from those. It is typed again behind them.
    pub(super) has_held: bool,
    /// The last answer that was taken for one of those.
    pub(super) wrong: Option<LinkError>,
    /// How often the settings were asked for again, until two answers agree.
    pub(super) asked_again: usize,
    pub(super) shown: Vec<String>,
    pub(super) examples: Vec<String>,
    /// Bytes received since the last question.
    pub(super) bytes: usize,
    /// What was reported in the meantime.
    pub(super) early: Vec<Happening>,
}

impl Session {
    /// Empties the machine's line, and waits for silence.
    pub(super) fn settle(&mut self) {
        self.turn.to_send.extend([ERASE; COMMAND_LENGTH]);
        self.turn.to_send.push(b'\n');
        self.state = State::Settling { since: self.waited, heard: self.waited };
    }

    /// Asks for everything again, if that may help. A `hold` without an answer is typed again.
    pub(super) fn ask_again(&mut self, error: LinkError) {
        let retries = if self.version.is_empty() { RETRIES } else { RETRIES_OF_A_WEEDER };
        if !error.is_of_an_answer() || self.introduction.tries == retries {
            return self.lose(error);
        }
        let Introduction { tries, late, early, .. } = std::mem::take(&mut self.introduction);
        let late = late + self.asked.len();
        self.introduction = Introduction { tries: tries + 1, late, early, ..Introduction::default() };
        let hold = self.asked.drain(..).find(|asked| asked.line == HOLD);
        self.to_hold = hold.and_then(|hold| hold.number).or(self.to_hold);
        self.settle();
    }

    /// Takes the answer to a first question, and goes on to the next one.
    pub(super) fn take_first_answer(&mut self, question: usize, answer: Vec<String>, refusal: Option<String>) {
        let version = answer.last().and_then(|line| match ConsoleLine::parse(line) {
            ConsoleLine::Version { version } if refusal.is_none() => Some(version),
            _ => None,
        });
        let is_wrong = match question {
            0 => version.is_none(),
            1 => !answer.iter().any(|line| Status::parse(line).is_some()),
            2 => !answer.iter().any(|line| settings::shown(line).is_some()),
            _ => refusal.is_some(),
        };
        if is_wrong {
            let command = || INTRODUCTION[question].to_owned();
            let error = match refusal {
                None if question == 0 => LinkError::NotTheWeeder(answer.join(" ")),
                refusal => {
                    LinkError::Refused { command: command(), answer: refusal.unwrap_or_else(|| answer.join(" ")) }
                }
            };
            if question > 1 || self.introduction.late == 0 {
                return self.ask_again(error);
            }
            // The answer to an earlier question: the one to this is still to come.
            self.introduction.late -= 1;
            self.introduction.wrong = Some(error);
            let again = Asked { line: command(), number: None, since: self.waited, answer: Vec::new() };
            return self.asked.push_front(again);
        }
        match (question, version) {
            (0, Some(version)) => self.version = version,
            (1, _) => self.introduction.late = 0,
            (2, _) if self.is_doubtful(&answer) => {
                self.introduction.asked_again += 1;
                if self.introduction.asked_again > UNSTEADY {
                    self.ask_again(LinkError::Unsteady(SETTINGS.to_owned()));
                }
                return;
            }
            (2, _) => self.introduction.shown = answer,
            (3, _) => self.introduction.examples = answer,
            (LAST, _) => return self.connect(answer),
            _ => {}
        }
        let next = if question == 0 && self.introduction.late == 0 { 2 } else { question + 1 };
        self.state = if next == 2 && self.is_bare { State::Ready } else { State::Asking(next) };
    }

    /// All first questions are answered, with this status as the last. A newer firmware's may be unknown here.
    fn connect(&mut self, status: Vec<String>) {
        let Introduction { shown, examples, early, .. } = std::mem::take(&mut self.introduction);
        let (settings, version) = (Shown::by(&shown).settings, self.version.clone());
        self.state = State::Ready;
        (self.poll_at, self.is_loss_told) = (self.waited + POLL, true);
        self.turn.happened.push(Happening::Connected { version, settings, shown, examples });
        self.warning = None;
        let named = status.iter().find_map(|line| named_warning(line));
        // The machine announces a warning once, perhaps before this connection.
        let announced = named.and_then(|warning| {
            let (event, line) = (EventLine::Warning { warning }, format!("warning name={}", warning.text()));
            let is_told = early.iter().any(|told| matches!(told, Happening::Event(_, said) if *said == line));
            (!is_told).then_some(Happening::Event(event, line))
        });
        // Before the first event, so that a log begins with the machine's state.
        let status = status.into_iter().find_map(|line| Some(Happening::Status(Status::parse(&line)?, line)));
        status.into_iter().chain(announced).chain(early).for_each(|happening| self.report(happening));
        self.take_named(named);
    }
}

/// Why a question has no answer, by the lines that have come and the beginning of another one.
pub(crate) fn silence(question: &str, answer: &[String], partial: &str) -> LinkError {
    let received = answer.iter().map(String::as_str).chain([partial]).collect::<Vec<_>>().join("\n");
    let strange = received.matches(lines::STRANGE).count();
    if 4 * strange > received.chars().count() {
        return LinkError::Noise;
    }
    let tail = received.char_indices().rev().nth(200).map_or(0, |(at, _)| at);
    let received = received[tail..].trim().to_owned();
    // Such as a satellite receiver at a converter that Unos have too.
    let is_weeder_s = |line| matches!(ConsoleLine::parse(line), ConsoleLine::Version { .. } | ConsoleLine::Event(_));
    if question == VERSION && !received.is_empty() && !received.lines().any(is_weeder_s) {
        return LinkError::NotTheWeeder(received);
    }
    LinkError::Silent { command: question.to_owned(), received }
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::moment::Moment;
    use crate::settings::Setting;
    use control::alarm::Warning;
    use std::time::Duration;

    /// A machine's answer to the session's question, if it has one: with these settings and this end of its status.
    fn answer(session: &Session, settings: &str, named: &str) -> String {
        let said = match session.asked.front().map(|asked| asked.line.as_str()) {
            None => return String::new(),
            Some(VERSION) => "weeder 0.2.0\r\n",
            Some(SETTINGS) => settings,
            Some(STATUS) => {
                &format!("state=hold tool=out pos=0 speed_mm_s=0 windows=0 unseen_mm=400\r\nlost=0 jumps=0{named}\r\n")
            }
            Some(_) => "",
        };
        format!("{said}ok\r\n")
    }

    #[test]
    fn a_warning_lasts_until_the_status_or_the_next_hold_ends_it() {
        let (mut session, mut now, mut events) = (Session::default(), Moment::default(), Vec::new());
        session.open(false);
        let mut warnings = |said: &str, named: &str| {
            let (mut received, mut warnings) = (said.to_owned(), Vec::new());
            for _ in 0..25 {
                now = now.after(Duration::from_millis(20));
                let happened = session.turn(now, received.as_bytes()).happened;
                warnings.extend(happened.into_iter().filter_map(|happening| match happening {
                    Happening::Warning(warning) => Some(warning),
                    Happening::Event(_, line) => {
                        events.push(line);
                        None
                    }
                    _ => None,
                }));
                received = answer(&session, "k=3 from 1 to 15, default 3, not saved\r\n", named);
            }
            warnings
        };
        let (older, no_plants) = (" warning=settings_older", " warning=no_plants");
        let cases: [(&str, &str, &[Option<Warning>]); 8] = [
            ("", older, &[Some(Warning::SettingsOlder)]),
            ("warning name=late_command\r\n", older, &[Some(Warning::LateCommand)]),
            ("state is=work\r\n", older, &[]),
            ("state is=hold\r\n", older, &[None, Some(Warning::SettingsOlder)]),
            ("", "", &[None]),
            ("warning name=no_plants\r\n", no_plants, &[Some(Warning::NoPlants)]),
            ("state is=hold\r\n", no_plants, &[]),
            ("", "", &[None]),
        ];
        for (said, named, changes) in cases {
            assert_eq!(warnings(said, named), changes, "{said:?}{named}");
        }
        // A log and a script get the one that stood at the connection as an event.
        let said = cases.iter().map(|(said, ..)| said.trim()).filter(|said| !said.is_empty());
        assert_eq!(events, ["warning name=settings_older"].into_iter().chain(said).collect::<Vec<_>>());
    }

    #[test]
    fn a_machine_that_was_there_is_asked_longer_than_a_device_that_never_was() {
        // The time of silence from which on the wire is given up, in seconds.
        for (was_there, seconds) in [(true, 15..25), (false, 5..8)] {
            let (mut session, mut now, mut received) = (Session::default(), Moment::default(), String::new());
            session.open(false);
            let mut silent_since = Duration::ZERO;
            while session.is_open() {
                now = now.after(Duration::from_millis(20));
                drop(session.turn(now, received.as_bytes()));
                received.clear();
                if was_there && now.ticking < Duration::from_secs(2) {
                    received = answer(&session, "k=3 from 1 to 15, default 3\r\n", "");
                    silent_since = now.ticking;
                }
            }
            let silent = now.ticking - silent_since;
            assert!(seconds.contains(&silent.as_secs()), "{was_there}: {silent:?}");
            assert!(matches!(session.take_failure(), Some(LinkError::Silent { .. })));
        }
    }

    #[test]
    fn settings_count_when_two_answers_agree() {
        let line = |setting: Setting| format!("{}={} from 0 to 9\r\n", setting.text(), setting.default());
        let all: Vec<String> = Setting::all().map(line).collect();
        // Another version lacks one in every answer.
        for (damaged, found) in [([true, false, false], all.len()), ([true; 3], all.len() - 1)] {
            let (mut session, mut now, mut received) = (Session::default(), Moment::default(), String::new());
            let (mut answers, mut shown) = (damaged.iter().cycle(), Vec::new());
            session.open(false);
            for turn in 0..250 {
                if turn == 150 {
                    session.command("save", Moment::NEVER).unwrap();
                }
                now = now.after(Duration::from_millis(20));
                for happening in session.turn(now, received.as_bytes()).happened {
                    if let Happening::Connected { shown: lines, .. } | Happening::Settings(_, lines) = happening {
                        shown.push(lines.len());
                    }
                }
                let asks = session.asked.front().is_some_and(|asked| asked.line == SETTINGS);
                let lost = usize::from(asks && *answers.next().unwrap());
                received = answer(&session, &all[lost..].concat(), "");
            }
            assert_eq!(shown, [found; 2]);
        }
    }

    #[test]
    fn a_machine_that_never_shows_the_same_settings_twice_is_given_up() {
        let (mut session, mut now, mut k) = (Session::default(), Moment::default(), 0);
        let mut received = String::new();
        session.open(false);
        while session.is_open() {
            now = now.after(Duration::from_millis(20));
            assert!(now.ticking < Duration::from_secs(60));
            drop(session.turn(now, received.as_bytes()));
            k = k % 15 + 1;
            received = answer(&session, &format!("k={k} from 1 to 15, default 3\r\n"), "");
        }
        assert!(matches!(session.take_failure(), Some(LinkError::Unsteady(_))));
    }
}
