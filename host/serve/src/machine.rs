//! A machine at a serial port, in its own thread. It types the clients' lines one by one and returns the answers. The hub
//! gets all other output. It makes no decisions: [`rules`](super::rules) decides which lines may be typed.

use super::hub::Hub;
use control::say::command::{Command, parse};
use link::ConsoleLine;
use link::rows::Opener;
use link::session::{HOLD, Happening, Session};
use std::collections::VecDeque;
use std::sync::Arc;
use std::thread;
use std::time::Instant;
use tokio::sync::mpsc::error::TryRecvError;
use tokio::sync::{mpsc, oneshot};

/// Shows a message to the operator at this computer.
pub type Tell = Arc<dyn Fn(&str) + Send + Sync>;

/// Most commands that wait to be typed, and most that wait to hold.
const WAITING: usize = 64;

/// Most stored lines of an answer. The longest answer has less than a tenth.
const LINES: usize = 1000;

/// The result of a line to type.
#[derive(Clone, Debug)]
pub enum Typed {
    /// The machine's answer; its last line is `ok`, or begins with `error:`.
    Answered(Vec<String>),
    /// A client held the machine first.
    Dropped,
    /// The machine was lost before it had answered.
    Lost(String),
    /// Too many commands wait.
    Busy,
}

/// A line to type, the clients that wait for it, and its answer.
struct Asked {
    line: String,
    askers: Vec<oneshot::Sender<Typed>>,
    answer: Vec<String>,
}

/// A machine, as its clients see it.
pub struct Machine {
    /// The operator's name for it.
    pub name: String,
    commands: mpsc::Sender<Asked>,
    holds: mpsc::Sender<Asked>,
}

impl Machine {
    /// Starts its thread, which ends when the machine is dropped.
    pub fn start(number: usize, name: String, open: Opener, hub: Arc<Hub>, tell: Tell) -> Self {
        let (commands, commands_to_type) = mpsc::channel(WAITING);
        let (holds, holds_to_type) = mpsc::channel(WAITING);
        let named = name.clone();
        thread::spawn(move || {
            let talk = Talk { number, name: named, hub, tell, asked: VecDeque::new() };
            talk.run(Session::waiting_for(open), commands_to_type, holds_to_type);
        });
        Self { name, commands, holds }
    }

    /// Types a command after the commands before it have been answered.
    pub async fn command(&self, line: String) -> Typed {
        ask(&self.commands, line).await
    }

    /// Types `hold` before all waiting commands.
    pub async fn hold(&self) -> Typed {
        ask(&self.holds, HOLD.to_owned()).await
    }
}

async fn ask(lines: &mpsc::Sender<Asked>, line: String) -> Typed {
    let (asker, answer) = oneshot::channel();
    match lines.try_send(Asked { line, askers: vec![asker], answer: Vec::new() }) {
        Ok(()) => answer.await.unwrap_or(Typed::Busy),
        Err(_) => Typed::Busy,
    }
}

impl Asked {
    fn end(self, typed: &Typed) {
        for asker in self.askers {
            // The client may have gone.
            let _ = asker.send(typed.clone());
        }
    }
}

struct Talk {
    number: usize,
    name: String,
    hub: Arc<Hub>,
    tell: Tell,
    /// The session's lines without an answer, in its order.
    asked: VecDeque<Asked>,
}

impl Talk {
    fn run(mut self, mut session: Session, mut commands: mpsc::Receiver<Asked>, mut holds: mpsc::Receiver<Asked>) {
        loop {
            // Holds are read before commands. So all commands sent before a hold are dropped by it.
            let to_hold: Vec<_> = std::iter::from_fn(|| holds.try_recv().ok()).collect();
            loop {
                match commands.try_recv() {
                    Ok(asked) => self.order(&mut session, asked),
                    Err(TryRecvError::Empty) => break,
                    Err(TryRecvError::Disconnected) => return,
                }
            }
            for asked in to_hold {
                self.order(&mut session, asked);
            }
            for happening in session.turn(Instant::now()) {
                self.take(&mut session, happening);
            }
        }
    }

    fn order(&mut self, session: &mut Session, asked: Asked) {
        // A command to a lost machine must not wait for it.
        if !session.is_connected() {
            let why = self.hub.why_lost(self.number);
            asked.end(&Typed::Lost(why.unwrap_or_else(|| "the machine is not there".to_owned())));
        } else if asked.line == HOLD {
            for _ in 0..session.hold() {
                if let Some(dropped) = self.asked.pop_back() {
                    dropped.end(&Typed::Dropped);
                }
            }
            match self.asked.back_mut() {
                // A hold in progress counts for this one too, as in the session.
                Some(last) if last.line == HOLD => last.askers.extend(asked.askers),
                _ => self.asked.push_back(asked),
            }
        } else if session.command(&asked.line) {
            self.asked.push_back(asked);
        } else {
            asked.end(&Typed::Busy);
        }
    }

    fn take(&mut self, session: &mut Session, happening: Happening) {
        match happening {
            Happening::Connected { version, shown, examples, .. } => {
                self.hub.there(self.number, &version, &shown, &examples);
                (self.tell)(&format!("{}: weeder {version} is there.", self.name));
            }
            Happening::Lost(why) => {
                self.hub.lost(self.number, &why);
                (self.tell)(&format!("{}: {why}.", self.name));
                for asked in self.asked.drain(..) {
                    asked.end(&Typed::Lost(why.clone()));
                }
            }
            Happening::Status(_, line) => self.hub.know(self.number, "status", line.into()),
            Happening::Event(_, line) => self.hub.event(self.number, &line),
            Happening::Answer(line) => {
                let is_end = matches!(ConsoleLine::parse(&line), ConsoleLine::End { .. });
                let Some(asked) = self.asked.front_mut() else { return };
                if is_end || asked.answer.len() < LINES {
                    asked.answer.push(line);
                }
                if is_end && let Some(mut asked) = self.asked.pop_front() {
                    let answer = std::mem::take(&mut asked.answer);
                    // The pages need the events.
                    if parse(asked.line.as_bytes()) == Ok(Command::Events(false)) {
                        session.turn_events_on();
                    }
                    asked.end(&Typed::Answered(answer));
                }
            }
            Happening::Settings(_, shown) => self.hub.know(self.number, "settings", shown.into()),
            Happening::Examples(lines) => self.hub.know(self.number, "examples", lines.into()),
            Happening::Command(_) => {}
        }
    }
}

#[cfg(test)]
mod tests {
    use super::*;
    use link::settings::{Setting, name};
    use link::{Link, LinkError};
    use serde_json::{Value, json};
    use std::io::{self, Read, Write};
    use std::sync::Mutex;
    use std::sync::atomic::{AtomicBool, Ordering};
    use std::time::Duration;
    use tokio::runtime;
    use tokio::time::{sleep, timeout};

    /// The typed lines, and three switches: events on, `dump` answered, cable plugged in.
    #[derive(Clone, Default)]
    struct Desk {
        typed: Arc<Mutex<Vec<String>>>,
        tells_events: Arc<AtomicBool>,
        answers_dump: Arc<AtomicBool>,
        is_there: Arc<AtomicBool>,
    }

    impl Desk {
        fn typed(&self) -> Vec<String> {
            self.typed.lock().unwrap().clone()
        }
    }

    /// A firmware in hold.
    struct Firmware {
        desk: Desk,
        line: Vec<u8>,
        owes_dump: bool,
        to_read: VecDeque<u8>,
    }

    impl Read for Firmware {
        fn read(&mut self, buffer: &mut [u8]) -> io::Result<usize> {
            if !self.desk.is_there.load(Ordering::Relaxed) {
                return Ok(0);
            }
            if self.owes_dump && self.desk.answers_dump.load(Ordering::Relaxed) {
                self.owes_dump = false;
                let behind = std::mem::take(&mut self.to_read);
                self.to_read = b"dumped\nok\n".iter().copied().chain(behind).collect();
            }
            if self.to_read.is_empty() || self.owes_dump {
                thread::sleep(Duration::from_millis(1));
                return Err(io::ErrorKind::TimedOut.into());
            }
            self.to_read.read(buffer)
        }
    }

    impl Write for Firmware {
        fn write(&mut self, bytes: &[u8]) -> io::Result<usize> {
            for &byte in bytes {
                if byte != b'\n' {
                    self.line.push(byte);
                    continue;
                }
                let line = String::from_utf8(std::mem::take(&mut self.line)).unwrap();
                let is_set = self.desk.typed().iter().any(|line| line == "set k 5");
                let setting = |setting: Setting| match name(setting) {
                    name if name == "k" && is_set => "k=5\n".to_owned(),
                    name => format!("{name}={}\n", setting.description().default),
                };
                if line.starts_with("events ") {
                    self.desk.tells_events.store(line == "events on", Ordering::Relaxed);
                }
                let answer = match line.as_str() {
                    "" => continue,
                    "version" => "weeder 0.2.0\n".to_owned(),
                    "get" => Setting::all().map(setting).collect(),
                    "status" => "state=hold tool=out pos=7 speed_mm_s=0 windows=0 unseen_mm=400\n".to_owned(),
                    "examples" => "built_in 0 plant 1 2 3 4 5\n".to_owned(),
                    "events on" => String::new(),
                    "dump" => {
                        self.desk.typed.lock().unwrap().push(line);
                        self.owes_dump = true;
                        continue;
                    }
                    _ => {
                        self.desk.typed.lock().unwrap().push(line);
                        String::new()
                    }
                };
                self.to_read.extend((answer + "ok\n").bytes());
            }
            Ok(bytes.len())
        }

        fn flush(&mut self) -> io::Result<()> {
            Ok(())
        }
    }

    /// A connected machine.
    fn machine() -> (Machine, Arc<Hub>, Desk) {
        let desk = Desk::default();
        desk.is_there.store(true, Ordering::Relaxed);
        let (hub, at_port) = (Arc::new(Hub::new(1)), desk.clone());
        let open = move || {
            if !at_port.is_there.load(Ordering::Relaxed) {
                return Err(LinkError::Absent("it".to_owned()));
            }
            let (line, to_read) = (Vec::new(), VecDeque::new());
            Link::over(Firmware { desk: at_port.clone(), line, owes_dump: false, to_read }, false)
        };
        let machine = Machine::start(0, "uno".to_owned(), Box::new(open), Arc::clone(&hub), Arc::new(|_| {}));
        (machine, hub, desk)
    }

    /// Waits until the condition holds.
    async fn until(is_so: impl Fn() -> bool) {
        let look = async {
            while !is_so() {
                sleep(Duration::from_millis(1)).await;
            }
        };
        timeout(Duration::from_secs(60), look).await.expect("it comes to be so");
    }

    fn run(test: impl Future<Output = ()>) {
        runtime::Builder::new_current_thread().enable_time().build().unwrap().block_on(test);
    }

    #[test]
    fn hold_drops_waiting_commands_and_is_typed_once_for_all_clients() {
        run(async {
            let (machine, hub, desk) = machine();
            until(|| hub.why_lost(0).is_none()).await;
            let others = async {
                until(|| desk.typed() == ["dump"]).await;
                let (started, one, two) =
                    tokio::join!(machine.command("start".to_owned()), machine.hold(), machine.hold());
                assert!(matches!(started, Typed::Dropped), "{started:?}");
                for held in [one, two] {
                    assert!(matches!(&held, Typed::Answered(lines) if *lines == ["ok"]), "{held:?}");
                }
            };
            // It does not wait for the answer in progress.
            let answered_later = async {
                until(|| desk.typed() == ["dump", "hold"]).await;
                desk.answers_dump.store(true, Ordering::Relaxed);
            };
            let (dumped, (), ()) = tokio::join!(machine.command("dump".to_owned()), others, answered_later);
            assert!(matches!(&dumped, Typed::Answered(lines) if *lines == ["dumped", "ok"]), "{dumped:?}");
            assert_eq!(desk.typed(), ["dump", "hold"]);
        });
    }

    #[test]
    fn a_page_gets_everything_when_it_connects_and_then_the_changes() {
        run(async {
            let (machine, hub, _) = machine();
            let there = || serde_json::from_str::<Value>(&hub.listen().0[0]).unwrap();
            until(|| there()["status"].is_string()).await;
            let known = there();
            assert_eq!((known["is"].as_str(), known["version"].as_str()), (Some("there"), Some("0.2.0")));
            assert_eq!(known["examples"], json!(["built_in 0 plant 1 2 3 4 5"]));
            let shows = |known: &Value, line| known["settings"].as_array().unwrap().contains(&json!(line));
            assert!(shows(&known, "k=3"));
            let (_, mut early) = hub.listen();
            let set = machine.command("set k 5".to_owned()).await;
            assert!(matches!(&set, Typed::Answered(lines) if *lines == ["ok"]), "{set:?}");
            until(|| shows(&there(), "k=5")).await;
            let told = std::iter::from_fn(|| early.try_recv().ok());
            assert!(told.into_iter().any(|message| message.contains(r#""is":"settings""#) && message.contains("k=5")));
        });
    }

    #[test]
    fn events_that_a_client_turns_off_are_turned_on_again_for_the_pages() {
        run(async {
            let (machine, hub, desk) = machine();
            until(|| hub.why_lost(0).is_none()).await;
            let off = machine.command("events off".to_owned()).await;
            assert!(matches!(off, Typed::Answered(_)), "{off:?}");
            until(|| desk.tells_events.load(Ordering::Relaxed)).await;
            assert_eq!(desk.typed(), ["events off"]);
        });
    }

    #[test]
    fn commands_to_a_lost_machine_are_not_typed_when_it_is_back() {
        run(async {
            let (machine, hub, desk) = machine();
            until(|| hub.why_lost(0).is_none()).await;
            let pulled = async {
                until(|| desk.typed() == ["dump"]).await;
                desk.is_there.store(false, Ordering::Relaxed);
            };
            let (dumped, ()) = tokio::join!(machine.command("dump".to_owned()), pulled);
            assert!(matches!(&dumped, Typed::Lost(why) if why.contains("the port is gone")), "{dumped:?}");
            for typed in [machine.command("start".to_owned()).await, machine.hold().await] {
                assert!(matches!(typed, Typed::Lost(_)), "{typed:?}");
            }
            desk.is_there.store(true, Ordering::Relaxed);
            until(|| hub.why_lost(0).is_none()).await;
            let cleared = machine.command("clear".to_owned()).await;
            assert!(matches!(cleared, Typed::Answered(_)), "{cleared:?}");
            assert_eq!(desk.typed(), ["dump", "clear"]);
        });
    }
}
