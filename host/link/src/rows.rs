//! Several rows at once. Each has a [`Connection`] in its own thread, so that no row waits for another.
//!
//! [`Rows::open`] opens all rows at the same time, and does not wait. [`Rows::command`] and [`Rows::hold`] send a command
//! to one row. [`Rows::next`] returns the next event of any row. A lost row is opened again automatically, and its
//! waiting commands are reported as not typed. Only a `hold` is kept: it is the first line that is typed when the row is
//! back.
//!
//! [`Hold`] follows a HOLD to all rows: which rows have obeyed, and how long the last one took. It has no clock: events
//! carry their times.

use super::connection::{Connection, Opener, PAUSE};
use super::moment::Moment;
use super::session::{HOLD, Happening, Unanswered};
use super::{LinkError, is_hold};
use std::cmp::Reverse;
use std::sync::mpsc::{self, Receiver, RecvTimeoutError, Sender, TryRecvError};
use std::thread;
use std::time::{Duration, Instant};

/// An event of one row.
#[derive(Debug)]
pub struct Heard {
    /// The row's number, in the order of opening.
    pub row: usize,
    /// When it came.
    pub at: Instant,
    /// The event.
    pub what: What,
}

/// The kinds of a row's events.
#[derive(Debug)]
pub enum What {
    /// An event of its session.
    Happened(Happening),
    /// A command that was not typed, and why.
    NotTyped {
        /// The command.
        command: String,
        /// Why.
        why: &'static str,
    },
}

/// Time in which a command must be typed.
const WAIT: Duration = Duration::from_secs(3);

enum Order {
    /// A command and its deadline.
    Type(String, Moment),
    Hold,
}

/// Several rows.
pub struct Rows {
    orders: Vec<Sender<Order>>,
    heard: Receiver<Heard>,
}

impl Rows {
    /// Opens all rows at the same time, and does not wait. The receiver gets each row's number after its first try, and
    /// why it is missing; `None` if it is connected. Missing rows are tried again, and reported as lost.
    pub fn open(openers: Vec<Opener>) -> (Self, Receiver<(usize, Option<LinkError>)>) {
        let (sender, heard) = mpsc::channel();
        let (tried, first_tries) = mpsc::channel();
        let start = |(row, open)| {
            let (orders, ordered) = mpsc::channel();
            let (heard, tried) = (sender.clone(), tried.clone());
            let tell = move |what| heard.send(Heard { row, at: Instant::now(), what }).is_ok();
            // The receiver is gone if the caller no longer waits.
            let tried = move |failure| drop(tried.send((row, failure)));
            thread::spawn(move || run(open, &ordered, tried, tell));
            orders
        };
        let orders = openers.into_iter().enumerate().map(start).collect();
        (Self { orders, heard }, first_tries)
    }

    /// The number of rows.
    pub fn count(&self) -> usize {
        self.orders.len()
    }

    /// Types a command to a row after its previous commands have been answered, within some seconds. A `hold` is typed
    /// before them, as by [`hold`](Self::hold).
    pub fn command(&self, row: usize, command: &str) {
        if is_hold(command) {
            self.hold(row);
        } else {
            self.order(row, Order::Type(command.to_owned(), Moment::now().after(WAIT)));
        }
    }

    /// Holds a row before all waiting commands, and drops these.
    pub fn hold(&self, row: usize) {
        self.order(row, Order::Hold);
    }

    fn order(&self, row: usize, order: Order) {
        if let Some(orders) = self.orders.get(row) {
            // A thread that panicked has printed why.
            let _ = orders.send(order);
        }
    }

    /// The next event, if it comes within this time.
    pub fn next(&self, patience: Duration) -> Option<Heard> {
        match self.heard.recv_timeout(patience) {
            Ok(heard) => Some(heard),
            Err(RecvTimeoutError::Timeout) => None,
            Err(RecvTimeoutError::Disconnected) => {
                thread::sleep(patience);
                None
            }
        }
    }
}

/// A row's thread: runs until all senders of orders and all receivers of events are gone. `tried` gets the result of the
/// first try. `tell` returns false if the receiver is gone.
fn run(open: Opener, orders: &Receiver<Order>, tried: impl FnOnce(Option<LinkError>), tell: impl Fn(What) -> bool) {
    let mut connection = Connection::waiting_for(open);
    connection.session.keeps_hold = true;
    let mut tried = Some(tried);
    loop {
        loop {
            let session = &mut connection.session;
            match orders.try_recv() {
                Ok(Order::Hold) => drop(session.hold()),
                Ok(Order::Type(command, deadline)) => {
                    let why = if !session.is_connected() {
                        "the row is not there"
                    } else if session.command(&command, deadline).is_none() {
                        "it is no command, or too many wait"
                    } else {
                        continue;
                    };
                    tell(What::NotTyped { command, why });
                }
                Err(TryRecvError::Empty) => break,
                Err(TryRecvError::Disconnected) => return,
            }
        }
        if !connection.turn(Moment::now).into_iter().all(|happening| tell(what(happening))) {
            return;
        }
        let failure = connection.session.take_failure();
        if (failure.is_some() || connection.session.is_connected())
            && let Some(tried) = tried.take()
        {
            tried(failure);
        }
        if !connection.session.is_open() {
            thread::sleep(PAUSE);
        }
    }
}

/// The kind of a session's event.
fn what(happening: Happening) -> What {
    let (command, why) = match happening {
        Happening::Unanswered { command, why: Unanswered::Late, .. } => {
            (command, "it has waited too long, type it again")
        }
        Happening::Unanswered { command, why: Unanswered::Held, .. } => (command, "hold came first"),
        happening => return What::Happened(happening),
    };
    What::NotTyped { command, why }
}

/// The state of one row in a HOLD to all.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
enum Held {
    Waiting,
    Obeyed(Duration),
    Refused,
    NotThere,
}

/// A HOLD to all rows. A row has obeyed when its firmware has answered `ok`: the servo has its command then.
#[derive(Clone, Debug)]
pub struct Hold {
    since: Instant,
    rows: Vec<Held>,
}

impl Hold {
    /// A hold that is requested at `since`. `are_there` says for each row whether it is connected.
    pub fn new(since: Instant, are_there: impl IntoIterator<Item = bool>) -> Self {
        let held = |is_there| if is_there { Held::Waiting } else { Held::NotThere };
        Self { since, rows: are_there.into_iter().map(held).collect() }
    }

    /// Updates the state from a row's event.
    pub fn take(&mut self, heard: &Heard) {
        let Some(held) = self.rows.get_mut(heard.row) else { return };
        match &heard.what {
            What::Happened(Happening::Answered { command, refusal, .. }) if command == HOLD => {
                *held = match (&*held, refusal) {
                    (Held::Obeyed(_), _) => return,
                    (_, None) => Held::Obeyed(heard.at.saturating_duration_since(self.since)),
                    (_, Some(_)) => Held::Refused,
                };
            }
            What::Happened(Happening::Lost(_)) if *held == Held::Waiting => *held = Held::NotThere,
            _ => {}
        }
    }

    /// True if no row is left to answer.
    pub fn is_over(&self) -> bool {
        !self.rows.contains(&Held::Waiting)
    }

    /// Whether every row has obeyed.
    pub fn is_obeyed(&self) -> bool {
        self.rows.iter().all(|held| matches!(held, Held::Obeyed(_)))
    }

    /// A summary in one line: how many rows have obeyed and after what time, then which rows have not.
    pub fn summary(&self, names: &[String]) -> String {
        let rows = self.rows.iter().zip(names);
        let obeyed = rows.clone().filter_map(|(held, name)| match held {
            Held::Obeyed(time) => Some((time, name)),
            _ => None,
        });
        let (count, last) = (obeyed.clone().count(), obeyed.min_by_key(|&(time, _)| Reverse(time)));
        let time = last.map_or_else(String::new, |(time, _)| format!(" in {} ms", time.as_millis()));
        let mut parts = vec![format!("HOLD {count} of {}{time}", self.rows.len())];
        for (what, state) in
            [("NOT THERE", Held::NotThere), ("REFUSED", Held::Refused), ("no answer yet", Held::Waiting)]
        {
            let those = rows.clone().filter(|&(held, _)| *held == state);
            let those: Vec<&str> = those.map(|(_, name)| name.as_str()).collect();
            if !those.is_empty() {
                parts.push(format!("{what}: {}", those.join(", ")));
            }
        }
        if let (Some((_, name)), 2..) = (last, count) {
            parts.push(format!("{name} last"));
        }
        parts.join("; ")
    }
}

#[cfg(test)]
mod tests;
