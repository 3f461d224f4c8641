//! Limits the connections of a door, so that HOLD always gets one.
//!
//! A connection is in one [`Stage`] at a time, and each stage has its own places. So new connections take no place from
//! known clients, event streams take none from commands, and neither takes one from HOLD. No connection is refused. If
//! a stage is full, the client with the most connections in it loses one. So a client with one connection keeps it.
//! A new connection whose request has come is read before it ends, because its place may be lost before its turn comes.
//!
//! The limits of `tower` do not fit: they count requests, and treat all clients alike.

use parking_lot::Mutex;
use std::convert::Infallible;
use std::net::IpAddr;
use std::sync::Arc;
use tokio::sync::oneshot::{self, Receiver, Sender};

/// Connections in a stage. A browser opens six.
const PLACES: usize = 32;

/// The state of a connection.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub enum Stage {
    /// It has not sent a whole request of a known client: it is new, half open, or not paired.
    Opening,
    /// It waits for an answer, reads it, or stays open for the next request.
    Asking,
    /// It receives the events.
    Listening,
    /// It has requested HOLD.
    Holding,
}

/// The other end of a connection.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub enum Client {
    /// An address that has not identified itself yet.
    Address(IpAddr),
    /// A paired phone, by its number.
    Phone(u64),
    /// The computer that has the serial ports.
    Here,
}

/// The places of a door.
#[derive(Clone, Default)]
pub struct Places(Arc<Mutex<Table>>);

#[derive(Default)]
struct Table {
    next: u64,
    /// In the order in which they entered their stages.
    taken: Vec<Taken>,
}

struct Taken {
    number: u64,
    client: Client,
    stage: Stage,
    /// Dropping this ends the connection.
    _end: Sender<Infallible>,
}

/// A place. It is free again when this is dropped.
pub struct Place {
    number: u64,
    places: Places,
    /// Its end, after it was lost and the connection has entered a stage for the first time.
    later: Mutex<Later>,
}

/// The end of a connection that has lost its first place.
enum Later {
    /// It has entered no stage yet.
    MayCome,
    Came(End),
    /// It has entered a stage: its next loss is final.
    Over,
}

/// Completes, with an error, when a connection loses its place.
pub type End = Receiver<Infallible>;

impl Places {
    /// A place for a new connection, and the signal for its end.
    pub fn take(&self, address: IpAddr) -> (Place, End) {
        let (end, ended) = oneshot::channel();
        let mut table = self.0.lock();
        let number = table.next;
        table.next += 1;
        table.enter(Taken { number, client: Client::Address(address), stage: Stage::Opening, _end: end });
        (Place { number, places: self.clone(), later: Mutex::new(Later::MayCome) }, ended)
    }
}

impl Table {
    /// Adds a connection as the newest of its stage. If the stage is full, another one loses its place.
    fn enter(&mut self, new: Taken) {
        let stage = new.stage;
        let others: Vec<&Taken> = self.taken.iter().filter(|taken| taken.stage == stage).collect();
        if others.len() >= PLACES {
            let count = |client: Client| {
                others.iter().map(|taken| taken.client).chain([new.client]).filter(|&one| one == client).count()
            };
            let most = others.iter().map(|taken| count(taken.client)).max();
            let mut those = others.iter().filter(|taken| Some(count(taken.client)) == most);
            let goes = match stage {
                // A page that listens already stays with its machines.
                Stage::Listening => those.next_back(),
                // A connection that waits for its client soon becomes the oldest. One that was just answered is not.
                Stage::Opening | Stage::Asking | Stage::Holding => those.next(),
            };
            if let Some(number) = goes.map(|taken| taken.number) {
                self.leave(number);
            }
        }
        self.taken.push(new);
    }

    fn leave(&mut self, number: u64) -> Option<Taken> {
        let index = self.taken.iter().position(|taken| taken.number == number)?;
        Some(self.taken.remove(index))
    }
}

impl Place {
    /// Assigns the connection to this client, as the newest of a stage. A connection that has lost its place enters only
    /// with its first request.
    pub fn enter(&self, stage: Stage, client: Client) {
        let mut table = self.places.0.lock();
        let mut later = self.later.lock();
        let is_first = matches!(*later, Later::MayCome);
        if let Some(taken) = table.leave(self.number) {
            table.enter(Taken { stage, client, ..taken });
            if is_first {
                *later = Later::Over;
            }
        } else if is_first {
            let (end, ended) = oneshot::channel();
            table.enter(Taken { number: self.number, client, stage, _end: end });
            *later = Later::Came(ended);
        }
    }

    /// The next end of a connection that has lost its place, if its request came in time.
    pub fn next_end(&self) -> Option<End> {
        match std::mem::replace(&mut *self.later.lock(), Later::Over) {
            Later::Came(end) => Some(end),
            Later::MayCome | Later::Over => None,
        }
    }
}

impl Drop for Place {
    fn drop(&mut self) {
        self.places.0.lock().leave(self.number);
    }
}

#[cfg(test)]
mod tests {
    use super::*;
    use std::net::Ipv4Addr;
    use tokio::sync::oneshot::error::TryRecvError;

    struct Connection(Place, End);

    impl Connection {
        fn is_open(&mut self) -> bool {
            self.1.try_recv() == Err(TryRecvError::Empty)
        }

        fn enter(self, stage: Stage, client: Client) -> Self {
            self.0.enter(stage, client);
            self
        }
    }

    fn take(places: &Places, last: u8) -> Connection {
        let (place, end) = places.take(Ipv4Addr::new(192, 168, 1, last).into());
        Connection(place, end)
    }

    fn open(connections: &mut [Connection]) -> Vec<usize> {
        (0..connections.len()).filter(|&number| connections[number].is_open()).collect()
    }

    #[test]
    fn the_oldest_new_connection_of_the_address_with_the_most_goes() {
        let places = Places::default();
        let mut phone = take(&places, 1);
        let mut attack: Vec<_> = (0..200).map(|number| take(&places, 2 + number % 4)).collect();
        assert!(phone.is_open());
        assert_eq!(open(&mut attack), (200 - (PLACES - 1)..200).collect::<Vec<_>>());
        drop(attack);
        let mut alone: Vec<_> = (0..PLACES - 1).map(|_| take(&places, 2)).collect();
        assert_eq!((phone.is_open(), open(&mut alone).len()), (true, PLACES - 1));
    }

    #[test]
    fn if_each_place_has_another_address_the_oldest_goes_and_the_newest_stays() {
        let places = Places::default();
        let mut connections: Vec<_> = (0..=PLACES as u8).map(|last| take(&places, last)).collect();
        assert_eq!(open(&mut connections), (1..=PLACES).collect::<Vec<_>>());
    }

    #[test]
    fn a_stage_takes_no_place_of_another() {
        use Stage::{Asking, Holding, Listening, Opening};
        for stage in [Opening, Asking, Listening, Holding] {
            let places = Places::default();
            let others = [Opening, Asking, Listening, Holding].into_iter().filter(|&other| other != stage);
            let mut others: Vec<_> = others.map(|other| take(&places, 1).enter(other, Client::Phone(1))).collect();
            let mut attack: Vec<_> = (0..200).map(|_| take(&places, 1).enter(stage, Client::Phone(1))).collect();
            assert_eq!(open(&mut attack).len(), PLACES, "{stage:?}");
            assert_eq!(open(&mut others).len(), 3, "{stage:?}");
        }
    }

    #[test]
    fn a_phone_keeps_its_connection_for_any_number_of_others() {
        for stage in [Stage::Asking, Stage::Listening, Stage::Holding] {
            let places = Places::default();
            let mut phone = take(&places, 1).enter(stage, Client::Phone(1));
            let mut attack: Vec<_> = (0..200).map(|_| take(&places, 1).enter(stage, Client::Phone(2))).collect();
            let mut later = take(&places, 1).enter(stage, Client::Phone(1));
            assert!(phone.is_open() && later.is_open(), "{stage:?}");
            assert_eq!(open(&mut attack).len(), PLACES - 2, "{stage:?}");
        }
    }

    #[test]
    fn the_stream_that_came_first_stays_and_the_last_gives_way() {
        let places = Places::default();
        let mut streams: Vec<_> = (0..200).map(|_| take(&places, 1).enter(Stage::Listening, Client::Here)).collect();
        assert_eq!(open(&mut streams), (0..PLACES - 1).chain([199]).collect::<Vec<_>>());
    }

    #[test]
    fn the_connection_that_asked_last_stays_and_the_one_that_asked_first_gives_way() {
        let places = Places::default();
        let asking = || take(&places, 1).enter(Stage::Asking, Client::Here);
        let mut connections: Vec<_> = (0..PLACES).map(|_| asking()).collect();
        connections[0].0.enter(Stage::Asking, Client::Here);
        connections.push(asking());
        assert_eq!(open(&mut connections), [0].into_iter().chain(2..=PLACES).collect::<Vec<_>>());
    }

    #[test]
    fn a_first_request_that_came_before_the_end_gets_a_place_once() {
        let places = Places::default();
        let mut connections: Vec<_> = (0..=PLACES as u8).map(|last| take(&places, last)).collect();
        let phone = &mut connections[0];
        // A request goes through two stages before its connection's end is heard of.
        phone.0.enter(Stage::Asking, Client::Phone(1));
        phone.0.enter(Stage::Holding, Client::Phone(1));
        phone.1 = phone.0.next_end().expect("it has a place again");
        let mut attack: Vec<_> =
            (0..PLACES).map(|_| take(&places, 1).enter(Stage::Holding, Client::Phone(1))).collect();
        assert!(!phone.is_open() && phone.0.next_end().is_none());
        phone.0.enter(Stage::Holding, Client::Phone(1));
        assert!(phone.0.next_end().is_none());
        assert_eq!(open(&mut attack).len(), PLACES);
    }

    #[test]
    fn a_place_is_free_again_and_one_that_is_lost_does_not_come_back() {
        let places = Places::default();
        let mut connections: Vec<_> = (0..=PLACES).map(|_| take(&places, 1)).collect();
        assert!(!connections[0].is_open() && connections[0].0.next_end().is_none());
        connections[0].0.enter(Stage::Holding, Client::Phone(1));
        assert!(connections[0].0.next_end().is_none());
        drop(connections);
        assert!(places.0.lock().taken.is_empty());
    }
}
