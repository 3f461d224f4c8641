//! A machine at a serial port, in its own thread. It types the clients' lines one by one and returns the answers. The hub
//! gets all other output. It makes no decisions: [`rules`](super::rules) decides which lines may be typed.

use super::hub::Hub;
use link::advice;
use link::connection::{Connection, Opener, PAUSE};
use link::moment::Moment;
use link::session::{HOLD, Happening, Unanswered};
use link::settings::other_version;
use link::{EventLine, Mode};
use std::collections::HashMap;
use std::sync::Arc;
use std::thread;
use std::time::Duration;
use tokio::sync::mpsc::error::TryRecvError;
use tokio::sync::{mpsc, oneshot};
use tokio::time::timeout;

/// Shows a message to the operator at this computer.
pub type Tell = Arc<dyn Fn(&str) + Send + Sync>;

/// Most commands that wait to be typed, and most that wait to hold.
const WAITING: usize = 64;

/// Most stored lines of an answer. The longest answer has less than a tenth.
const LINES: usize = 1000;

const ANSWER_TIME: Duration = Duration::from_secs(30);

/// The machine's answer to a line; its last line is `ok`, or begins with `error:`.
pub type Answer = Result<Vec<String>, Unanswered>;

/// A client's line to type, and where its answer goes.
struct Asked {
    line: String,
    /// The last moment at which it may be typed. It does not hold for `hold`.
    deadline: Moment,
    asker: oneshot::Sender<Answer>,
}

/// A machine, as its clients see it.
pub struct Machine {
    /// The operator's name for it.
    pub name: String,
    number: usize,
    hub: Arc<Hub>,
    commands: mpsc::Sender<Asked>,
    holds: mpsc::Sender<Asked>,
}

impl Machine {
    /// Starts its thread, which ends when the machine is dropped.
    pub fn start(number: usize, name: String, open: Opener, hub: Arc<Hub>, tell: Tell) -> Self {
        let (machine, asked) = Self::new(number, name, hub);
        let (named, hub) = (machine.name.clone(), Arc::clone(&machine.hub));
        thread::spawn(move || {
            let mut talk = Talk::new(number, named, hub, tell, open, asked);
            while talk.turn() {
                if !talk.connection.session.is_open() {
                    thread::sleep(PAUSE);
                }
            }
        });
        machine
    }

    /// A machine, and its clients' commands and holds.
    fn new(number: usize, name: String, hub: Arc<Hub>) -> (Self, [mpsc::Receiver<Asked>; 2]) {
        let [(commands, to_type), (holds, to_hold)] = [mpsc::channel(WAITING), mpsc::channel(WAITING)];
        (Self { name, number, hub, commands, holds }, [to_type, to_hold])
    }

    /// Types a client's command after the commands before it have been answered, if the client has seen a message that
    /// is recent enough then.
    pub async fn command(&self, line: String, seen: u64) -> Answer {
        ask(&self.commands, line, self.hub.deadline(self.number, seen)?).await
    }

    /// Types `hold` before all waiting commands. A lost machine gets it when it is back.
    pub async fn hold(&self) -> Answer {
        self.hub.hold(self.number);
        ask(&self.holds, HOLD.to_owned(), Moment::NEVER).await
    }
}

async fn ask(lines: &mpsc::Sender<Asked>, line: String, deadline: Moment) -> Answer {
    let (asker, answer) = oneshot::channel();
    lines.try_send(Asked { line, deadline, asker }).map_err(|_| busy())?;
    let silent = || Unanswered::Unknown("the machine does not answer".to_owned());
    timeout(ANSWER_TIME, answer).await.map_err(|_| silent())?.unwrap_or_else(|_| Err(busy()))
}

fn busy() -> Unanswered {
    Unanswered::NotTyped("too much waits for the machine: try again".to_owned())
}

struct Talk {
    number: usize,
    name: String,
    hub: Arc<Hub>,
    tell: Tell,
    connection: Connection,
    commands: mpsc::Receiver<Asked>,
    holds: mpsc::Receiver<Asked>,
    /// The clients that wait for the answer to a command, by its number in the session. Several may wait for a `hold`.
    askers: HashMap<u64, Vec<oneshot::Sender<Answer>>>,
    /// The lines of the answer in progress.
    answer: Vec<String>,
}

impl Talk {
    fn new(
        number: usize,
        name: String,
        hub: Arc<Hub>,
        tell: Tell,
        open: Opener,
        [commands, holds]: [mpsc::Receiver<Asked>; 2],
    ) -> Self {
        let mut connection = Connection::waiting_for(open);
        (connection.session.keeps_hold, connection.session.keeps_events) = (true, true);
        Self { number, name, hub, tell, connection, commands, holds, askers: HashMap::new(), answer: Vec::new() }
    }

    /// Returns false when the machine is dropped.
    fn turn(&mut self) -> bool {
        // Holds are read before commands. So all commands sent before a hold are dropped by it.
        let to_hold: Vec<_> = std::iter::from_fn(|| self.holds.try_recv().ok()).collect();
        loop {
            match self.commands.try_recv() {
                Ok(asked) => self.ask(asked),
                Err(TryRecvError::Empty) => break,
                Err(TryRecvError::Disconnected) => return false,
            }
        }
        to_hold.into_iter().for_each(|asked| self.ask(asked));
        for happening in self.connection.turn(|| self.hub.now()) {
            self.take(happening);
        }
        true
    }

    /// Hands a line to the session. A lost machine gets `hold` when it is back, and no other line. Its client does not
    /// wait for that.
    fn ask(&mut self, Asked { line, deadline, asker }: Asked) {
        let session = &mut self.connection.session;
        let is_connected = session.is_connected();
        let number = match line.as_str() {
            HOLD => Some(session.hold()),
            line if is_connected => session.command(line, deadline),
            _ => None,
        };
        let why = match number {
            Some(number) if is_connected => return self.askers.entry(number).or_default().push(asker),
            _ if is_connected => busy(),
            _ => Unanswered::NotTyped(self.hub.why_lost(self.number).unwrap_or("the machine is not there".to_owned())),
        };
        let _ = asker.send(Err(why));
    }

    /// Ends a command. Its clients may be gone.
    fn end(&mut self, number: u64, answer: &Answer) {
        for asker in self.askers.remove(&number).unwrap_or_default() {
            let _ = asker.send(answer.clone());
        }
    }

    fn take(&mut self, happening: Happening) {
        let news = happening.news();
        match happening {
            Happening::Connected { version, shown, .. } => {
                self.hub.news(self.number, news);
                self.tell(&format!("weeder {version} is there"));
                if let Some(other) = other_version(&version, &shown) {
                    self.tell(&other);
                }
            }
            Happening::Started { while_at_work: Some(cause), .. } => {
                self.hub.news(self.number, news);
                self.tell(&advice::restarted(&cause));
            }
            Happening::Lost(why) => {
                self.hub.news(self.number, news);
                self.tell(&why);
                self.answer.clear();
            }
            Happening::Event(event, _) => {
                // Its switch and its alarms are HOLDs too.
                if let EventLine::State { mode: Mode::Hold | Mode::Alarm }
                | EventLine::Alarm { .. }
                | EventLine::Newer { is_alarm: true } = event
                {
                    self.hub.hold(self.number);
                }
                if let EventLine::State { mode: Mode::Work } = event {
                    self.hub.works(self.number);
                }
                self.hub.news(self.number, news);
            }
            Happening::Status(..) | Happening::Warning(_) | Happening::Settings(..) | Happening::Examples(_) => {
                self.hub.news(self.number, news);
            }
            Happening::Started { .. } | Happening::Command(_) => {}
            Happening::Answer(line) => {
                self.answer.truncate(LINES - 1);
                self.answer.push(line);
            }
            Happening::Answered { number, .. } => {
                let lines = std::mem::take(&mut self.answer);
                self.end(number, &Ok(lines));
            }
            Happening::Unanswered { number, why, .. } => self.end(number, &Err(why)),
        }
    }

    /// Tells the operator something about this machine.
    fn tell(&self, what: &str) {
        (self.tell)(&format!("{}: {what}.", self.name));
    }
}

#[cfg(test)]
mod any_order;

#[cfg(test)]
mod tests {
    use super::*;
    use link::{LinkError, Wire};
    use rig::ScriptedBoard;
    use serde_json::Value;
    use tokio::time::sleep;

    pub(super) fn opener(board: &ScriptedBoard) -> Opener {
        let port = board.clone();
        Box::new(move || Ok(Wire::over(port.open().ok_or(LinkError::Absent("it".to_owned()))?, false)))
    }

    async fn machine() -> (Machine, Arc<Hub>, ScriptedBoard) {
        let (hub, board) = (Arc::new(Hub::new(1, 0, Box::new(Moment::now))), ScriptedBoard::plugged_in());
        let machine = Machine::start(0, "uno".to_owned(), opener(&board), Arc::clone(&hub), Arc::new(|_| {}));
        until(|| hub.why_lost(0).is_none()).await;
        (machine, hub, board)
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

    /// Types a command with a deadline that a busy computer meets.
    async fn type_soon(machine: &Machine, line: &str) -> Answer {
        ask(&machine.commands, line.to_owned(), Moment::now().after(Duration::from_secs(60))).await
    }

    fn ok() -> Answer {
        Ok(vec!["ok".to_owned()])
    }

    #[tokio::test]
    async fn hold_drops_waiting_commands_and_is_typed_once_for_all_clients() {
        let (machine, _, board) = machine().await;
        let others = async {
            until(|| board.typed() == ["events on", "silence"]).await;
            let answers = tokio::join!(type_soon(&machine, "start"), machine.hold(), machine.hold());
            assert_eq!(answers, (Err(Unanswered::Held), ok(), ok()));
        };
        // It does not wait for the answer in progress. The first `ok` is taken for that.
        let answered_later = async {
            until(|| board.typed() == ["events on", "silence", "hold"]).await;
            board.say(b"ok\n");
        };
        let (before, (), ()) = tokio::join!(type_soon(&machine, "silence"), others, answered_later);
        assert_eq!(before, ok());
        assert_eq!(board.typed(), ["events on", "silence", "hold"]);
    }

    #[tokio::test]
    async fn a_page_gets_everything_first_and_then_each_change() {
        let (machine, hub, board) = machine().await;
        let there = || serde_json::from_str::<Value>(&hub.listen().0[0].text).unwrap();
        until(|| there()["status"].is_string()).await;
        let known = there();
        assert!(known["is"] == "there" && known["version"].is_string() && known["examples"].is_array(), "{known}");
        let shows = |known: &Value, value: &str| known["settings"].to_string().contains(value);
        assert!(shows(&known, "k=3 "));
        let (_, mut early) = hub.listen();
        assert_eq!(type_soon(&machine, "set k 5").await, ok());
        until(|| shows(&there(), "k=5 ")).await;
        let mut told = std::iter::from_fn(|| early.try_recv().ok()).map(|message| message.text);
        assert!(told.any(|text| text.contains(r#""is":"settings""#) && text.contains("k=5 ")));
        assert_eq!(type_soon(&machine, "events off").await, ok());
        until(|| board.typed() == ["events on", "set k 5", "get k", "events off", "events on"]).await;
    }

    #[tokio::test]
    async fn of_the_commands_to_a_lost_machine_only_hold_is_typed_when_it_is_back() {
        let (machine, hub, board) = machine().await;
        let pulled = async {
            until(|| board.typed() == ["events on", "silence"]).await;
            board.plug(false);
        };
        let (before, ()) = tokio::join!(type_soon(&machine, "silence"), pulled);
        assert!(matches!(&before, Err(Unanswered::Unknown(why)) if why.contains("the port is gone")), "{before:?}");
        for typed in [type_soon(&machine, "start").await, machine.hold().await] {
            assert!(matches!(typed, Err(Unanswered::NotTyped(_))), "{typed:?}");
        }
        board.plug(true);
        until(|| hub.why_lost(0).is_none()).await;
        assert_eq!(type_soon(&machine, "clear").await, ok());
        assert_eq!(board.typed(), ["events on", "silence", "hold", "events on", "clear"]);
    }
}
