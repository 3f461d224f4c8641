//! What all pages are told: how each machine is now, and what each of them says.
//!
//! Machines write and pages read, and no page makes a machine wait: a page that is too slow misses what it did not read, and is told
//! so. What is kept does not grow with the number of pages.

use serde_json::{Value, json};
use std::sync::{Arc, Mutex, MutexGuard, PoisonError};
use tokio::sync::broadcast::{self, Receiver};

/// Messages of a machine that a page may be behind by: some ten seconds of it at work.
const BEHIND: usize = 128;

/// A message to the pages, as JSON.
pub type Message = Arc<str>;

/// How a machine is.
enum State {
    /// It is there: the firmware's version, and its last status.
    There { version: String, status: Option<String> },
    /// It is not, and why.
    Lost(String),
}

/// The place where machines and pages meet.
pub struct Hub {
    machines: Mutex<Vec<State>>,
    pages: broadcast::Sender<Message>,
}

impl Hub {
    /// So many machines, none of which has been heard of.
    pub fn new(machines: usize) -> Self {
        let unheard = || State::Lost("its port is being opened".to_owned());
        Self {
            machines: Mutex::new((0..machines).map(|_| unheard()).collect()),
            pages: broadcast::channel(BEHIND * machines.max(2)).0,
        }
    }

    /// The machine is there.
    pub fn there(&self, machine: usize, version: &str) {
        self.change(machine, State::There { version: version.to_owned(), status: None });
    }

    /// The machine is not there.
    pub fn lost(&self, machine: usize, why: &str) {
        self.change(machine, State::Lost(why.to_owned()));
    }

    /// The machine has given its status.
    pub fn status(&self, machine: usize, line: String) {
        let mut machines = self.machines();
        self.send(json!({ "machine": machine, "is": "status", "line": line }));
        if let Some(State::There { status, .. }) = machines.get_mut(machine) {
            *status = Some(line);
        }
    }

    /// The machine has told an event line.
    pub fn event(&self, machine: usize, line: &str) {
        let _machines = self.machines();
        self.send(json!({ "machine": machine, "is": "event", "line": line }));
    }

    /// Why a machine is not there; nothing where it is.
    pub fn why_lost(&self, machine: usize) -> Option<String> {
        match self.machines().get(machine) {
            Some(State::There { .. }) => None,
            Some(State::Lost(why)) => Some(why.clone()),
            None => Some("there is no such machine".to_owned()),
        }
    }

    /// How all machines are now, and where to hear what comes after that.
    pub fn listen(&self) -> (Vec<Message>, Receiver<Message>) {
        let machines = self.machines();
        let told = machines.iter().enumerate().flat_map(|(machine, state)| {
            let status = match state {
                State::There { status: Some(line), .. } => {
                    Some(json!({ "machine": machine, "is": "status", "line": line }))
                }
                _ => None,
            };
            [Some(state.message(machine)), status].into_iter().flatten()
        });
        (told.map(|message| message.to_string().into()).collect(), self.pages.subscribe())
    }

    fn change(&self, machine: usize, state: State) {
        let mut machines = self.machines();
        self.send(state.message(machine));
        if let Some(known) = machines.get_mut(machine) {
            *known = state;
        }
    }

    /// Sends while the machines are held, so that nobody hears a change that was in what he began with.
    fn send(&self, message: Value) {
        // Where no page listens nobody misses it.
        let _ = self.pages.send(message.to_string().into());
    }

    fn machines(&self) -> MutexGuard<'_, Vec<State>> {
        // Each state is whole by itself, whoever died beside it.
        self.machines.lock().unwrap_or_else(PoisonError::into_inner)
    }
}

impl State {
    fn message(&self, machine: usize) -> Value {
        match self {
            State::There { version, .. } => json!({ "machine": machine, "is": "there", "version": version }),
            State::Lost(why) => json!({ "machine": machine, "is": "lost", "why": why }),
        }
    }
}

#[cfg(test)]
mod tests {
    use super::*;
    use tokio::sync::broadcast::error::TryRecvError;

    fn heard(pages: &mut Receiver<Message>) -> Vec<Value> {
        std::iter::from_fn(|| pages.try_recv().ok()).map(|message| serde_json::from_str(&message).unwrap()).collect()
    }

    #[test]
    fn a_page_begins_with_how_all_machines_are_and_hears_what_comes_after() {
        let hub = Hub::new(2);
        hub.there(0, "0.2.0");
        hub.status(0, "state=hold".to_owned());
        let (now, mut later) = hub.listen();
        let now: Vec<Value> = now.iter().map(|message| serde_json::from_str(message).unwrap()).collect();
        let expected = [
            json!({ "machine": 0, "is": "there", "version": "0.2.0" }),
            json!({ "machine": 0, "is": "status", "line": "state=hold" }),
            json!({ "machine": 1, "is": "lost", "why": "its port is being opened" }),
        ];
        assert_eq!(now, expected);
        assert_eq!((hub.why_lost(0), hub.why_lost(2).is_some()), (None, true));
        hub.event(0, "state=work");
        hub.lost(0, "pulled");
        let expected = [
            json!({ "machine": 0, "is": "event", "line": "state=work" }),
            json!({ "machine": 0, "is": "lost", "why": "pulled" }),
        ];
        assert_eq!(heard(&mut later), expected);
        assert_eq!(hub.why_lost(0).as_deref(), Some("pulled"));
    }

    #[test]
    fn a_page_that_does_not_read_keeps_nobody_waiting_and_learns_that_it_has_missed_something() {
        let hub = Hub::new(1);
        let (_, mut page) = hub.listen();
        for number in 0..20 * BEHIND {
            hub.event(0, &number.to_string());
        }
        assert!(matches!(page.try_recv(), Err(TryRecvError::Lagged(missed)) if missed as usize == 18 * BEHIND));
        assert_eq!(heard(&mut page).len(), 2 * BEHIND);
    }
}
