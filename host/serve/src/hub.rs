//! Sends each machine's state and output to all pages.
//!
//! Machines write and pages read. No page makes a machine wait: a page that is too slow misses messages, and gets a notice.
//! The memory does not grow with the number of pages.

use super::knowledge::Knowledge;
use link::moment::Moment;
use link::session::Unanswered;
use parking_lot::Mutex;
use serde_json::{Value, json};
use std::sync::Arc;
use tokio::sync::broadcast::{self, Receiver};

/// Most messages of a machine that a page may be behind: some ten seconds of work.
const BEHIND: usize = 128;

/// A message to the pages.
#[derive(Clone, Debug, PartialEq, Eq)]
pub struct Message {
    /// Its number, for [`Knowledge`].
    pub number: u64,
    /// As JSON.
    pub text: Arc<str>,
}

/// Returns the present moment.
pub type Clock = Box<dyn Fn() -> Moment + Send + Sync>;

/// Connects machines and pages.
pub struct Hub {
    clock: Clock,
    state: Mutex<State>,
    pages: broadcast::Sender<Message>,
}

struct State {
    /// Each machine's state, as the first message to a new page.
    machines: Vec<Value>,
    /// The message about each machine's last restart at work, until it works again.
    restarted: Vec<Option<Value>>,
    knowledge: Knowledge,
}

impl Hub {
    /// This number of machines, before the message with the number `first`.
    pub fn new(machines: usize, first: u64, clock: Clock) -> Self {
        let state = State {
            machines: (0..machines)
                .map(|machine| json!({ "machine": machine, "is": "lost", "why": "Waiting for the machine to answer." }))
                .collect(),
            restarted: vec![None; machines],
            knowledge: Knowledge::new(first, machines),
        };
        Self { clock, state: Mutex::new(state), pages: broadcast::channel(BEHIND * machines.max(2)).0 }
    }

    /// The present moment.
    pub fn now(&self) -> Moment {
        (self.clock)()
    }

    /// Sends what has happened at a machine, as [`Happening::news`](link::session::Happening::news) has it. A page that
    /// connects later gets the state that follows.
    pub fn news(&self, machine: usize, mut news: Value) {
        news["machine"] = machine.into();
        let mut state = self.state.lock();
        self.send(&mut state, &news);
        let known = &mut state.machines[machine];
        match news["is"].as_str().unwrap_or_default() {
            "there" | "lost" => *known = news,
            "restarted" => state.restarted[machine] = Some(news),
            what @ ("status" | "warning" | "settings" | "examples") if known["is"] == "there" => {
                known[what] = news["said"].clone();
            }
            _ => {}
        }
    }

    /// The machine works.
    pub fn works(&self, machine: usize) {
        self.state.lock().restarted[machine] = None;
    }

    /// The machine is to hold, or holds: commands of senders that do not know this yet are refused.
    pub fn hold(&self, machine: usize) {
        let mut state = self.state.lock();
        let number = self.send(&mut state, &json!({ "machine": machine, "is": "held" }));
        state.knowledge.hold(machine, number);
    }

    /// Until when a command to a machine may be typed, if its sender has seen the message of this number.
    ///
    /// # Errors
    /// If a HOLD has come since, or the message is too old.
    pub fn deadline(&self, machine: usize, seen: u64) -> Result<Moment, Unanswered> {
        self.state.lock().knowledge.deadline(machine, seen, self.now())
    }

    /// A message for one page.
    pub fn tell(&self, text: &str) -> Message {
        Message { number: self.state.lock().knowledge.number(self.now()), text: text.into() }
    }

    /// Why a machine is lost; `None` if it is connected.
    pub fn why_lost(&self, machine: usize) -> Option<String> {
        self.state.lock().machines[machine]["why"].as_str().map(str::to_owned)
    }

    /// The present state of all machines, and the receiver of later messages.
    pub fn listen(&self) -> (Vec<Message>, Receiver<Message>) {
        let mut state = self.state.lock();
        let State { machines, knowledge, restarted } = &mut *state;
        let now = self.now();
        let known = machines.iter().chain(restarted.iter().flatten());
        let message = |known: &Value| Message { number: knowledge.number(now), text: known.to_string().into() };
        let messages = known.map(message).collect();
        (messages, self.pages.subscribe())
    }

    /// Sends while the lock is held, so that a page does not get a change twice: its first state may already include it.
    /// Returns the message's number.
    fn send(&self, state: &mut State, message: &Value) -> u64 {
        let number = state.knowledge.number(self.now());
        // An error means that no page listens.
        let _ = self.pages.send(Message { number, text: message.to_string().into() });
        number
    }
}

#[cfg(test)]
mod tests {
    use super::*;
    use link::session::Happening;
    use link::settings::Settings;

    fn read(message: &Message) -> Value {
        serde_json::from_str(&message.text).unwrap()
    }

    #[test]
    fn a_new_page_gets_the_state_of_all_machines_and_then_the_changes() {
        let hub = Hub::new(2, 5000, Box::new(Moment::now));
        let (shown, examples) = (vec!["k=5".to_owned()], vec!["field 0".to_owned()]);
        let there = Happening::Connected { version: "0.2.0".to_owned(), settings: Settings::new(), shown, examples };
        hub.news(0, there.news());
        hub.news(0, json!({ "is": "status", "said": "state=hold" }));
        hub.news(0, json!({ "is": "settings", "said": ["k=3"] }));
        hub.news(0, json!({ "is": "warning", "said": "no_plants" }));
        // A lost machine has no status.
        hub.news(1, json!({ "is": "status", "said": "state=work" }));
        let (now, mut later) = hub.listen();
        let mut now: Vec<Value> = now.iter().map(read).collect();
        let help = now[0].as_object_mut().unwrap().remove("help").unwrap();
        assert_eq!(help["wheel_mm"], "wheel diameter");
        let expected = [
            json!({
                "machine": 0,
                "is": "there",
                "version": "0.2.0",
                "settings": ["k=3"],
                "examples": ["field 0"],
                "status": "state=hold",
                "warning": "no_plants",
            }),
            json!({ "machine": 1, "is": "lost", "why": "Waiting for the machine to answer." }),
        ];
        assert_eq!(now, expected);
        assert_eq!(hub.why_lost(0), None);
        hub.news(0, json!({ "is": "event", "said": "state=work" }));
        hub.news(0, json!({ "is": "lost", "why": "pulled" }));
        let expected = [
            json!({ "machine": 0, "is": "event", "said": "state=work" }),
            json!({ "machine": 0, "is": "lost", "why": "pulled" }),
        ];
        let heard: Vec<Value> = std::iter::from_fn(|| later.try_recv().ok()).map(|message| read(&message)).collect();
        assert_eq!(heard, expected);
        assert_eq!(hub.why_lost(0).as_deref(), Some("pulled"));
    }
}
