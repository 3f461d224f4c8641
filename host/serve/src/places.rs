//! Limits the connections of a door, so that HOLD always gets one.
//!
//! A connection is in one [`Stage`] at a time, and each stage has its own places. So new connections take no place from
//! known clients, event streams take none from commands, and neither takes one from HOLD. No connection is refused. If
//! a stage is full, the client with the most connections in it loses one. So a client with one connection keeps it.
//! A new connection whose request has come is read before it ends, because its place may be lost before its turn comes.
//!
//! The limits of `tower` do not fit: they count requests, and treat all clients alike.

use parking_lot::Mutex;
use std::net::IpAddr;
use std::sync::Arc;
use std::sync::atomic::{AtomicBool, Ordering};
use tokio::sync::Notify;

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

/// The places that are taken, in the order in which their connections entered their stages.
#[derive(Default)]
struct Table(Vec<Taken>);

struct Taken {
    client: Client,
    stage: Stage,
    /// Notified when the place is lost. It also identifies the connection.
    lost: Arc<Notify>,
}

/// A place. It is free again when this is dropped.
pub struct Place {
    places: Places,
    lost: Arc<Notify>,
    /// Whether the connection has entered no stage by a request yet, and may: it then gets a place also after a loss.
    may_come: AtomicBool,
}

impl Places {
    /// A place for a new connection.
    pub fn take(&self, address: IpAddr) -> Place {
        let place = Place { places: self.clone(), lost: Arc::new(Notify::new()), may_come: AtomicBool::new(true) };
        self.0.lock().enter(place.taken(Stage::Opening, Client::Address(address)));
        place
    }
}

impl Table {
    /// Adds a connection as the newest of its stage. If the stage is full, another one loses its place.
    fn enter(&mut self, new: Taken) {
        let others: Vec<&Taken> = self.0.iter().filter(|taken| taken.stage == new.stage).collect();
        if others.len() >= PLACES {
            let clients = || others.iter().map(|taken| taken.client).chain([new.client]);
            let count = |taken: &&&Taken| clients().filter(|&client| client == taken.client).count();
            // Of clients with as many connections, the last one is found.
            let goes = match new.stage {
                // A page that listens already stays with its machines.
                Stage::Listening => others.iter().max_by_key(count),
                // A connection that waits for its client soon becomes the oldest. One that was just answered is not.
                Stage::Opening | Stage::Asking | Stage::Holding => others.iter().rev().max_by_key(count),
            };
            if let Some(lost) = goes.map(|taken| Arc::clone(&taken.lost)) {
                self.leave(&lost);
                lost.notify_one();
            }
        }
        self.0.push(new);
    }

    fn find(&self, lost: &Arc<Notify>) -> Option<usize> {
        self.0.iter().position(|taken| Arc::ptr_eq(&taken.lost, lost))
    }

    /// Frees a place. Returns false if it is lost already.
    fn leave(&mut self, lost: &Arc<Notify>) -> bool {
        self.find(lost).map(|index| self.0.remove(index)).is_some()
    }
}

impl Place {
    fn taken(&self, stage: Stage, client: Client) -> Taken {
        Taken { client, stage, lost: Arc::clone(&self.lost) }
    }

    /// Assigns the connection to this client, as the newest of a stage. A connection that has lost its place enters only
    /// with its first request.
    pub fn enter(&self, stage: Stage, client: Client) {
        let mut table = self.places.0.lock();
        let may_come = self.may_come.swap(false, Ordering::Relaxed);
        if table.leave(&self.lost) || may_come {
            table.enter(self.taken(stage, client));
        }
    }

    /// Completes when the connection loses its place.
    pub async fn lost(&self) {
        self.lost.notified().await;
    }

    /// Whether the connection ends: it has no place, and its first request has not come in time.
    pub fn is_over(&self) -> bool {
        self.may_come.store(false, Ordering::Relaxed);
        self.places.0.lock().find(&self.lost).is_none()
    }
}

impl Drop for Place {
    fn drop(&mut self) {
        self.places.0.lock().leave(&self.lost);
    }
}

#[cfg(test)]
mod tests {
    use super::*;
    use futures_util::FutureExt;
    use std::net::Ipv4Addr;

    fn take(places: &Places, last: u8) -> Place {
        places.take(Ipv4Addr::new(192, 168, 1, last).into())
    }

    /// A connection whose first request came.
    fn entered(places: &Places, stage: Stage, client: Client) -> Place {
        let place = take(places, 1);
        place.enter(stage, client);
        place
    }

    fn is_open(place: &Place) -> bool {
        place.places.0.lock().find(&place.lost).is_some()
    }

    /// The connections that have a place. The others have been told.
    fn open(connections: &[Place]) -> Vec<usize> {
        let lost = connections.iter().filter(|place| !is_open(place));
        lost.for_each(|place| assert_eq!(place.lost().now_or_never(), Some(())));
        (0..connections.len()).filter(|&number| is_open(&connections[number])).collect()
    }

    #[test]
    fn the_oldest_new_connection_of_the_address_with_the_most_goes() {
        let places = Places::default();
        let phone = take(&places, 1);
        let attack: Vec<_> = (0..200).map(|number| take(&places, 2 + number % 4)).collect();
        assert!(is_open(&phone));
        assert_eq!(open(&attack), (200 - (PLACES - 1)..200).collect::<Vec<_>>());
        drop(attack);
        let alone: Vec<_> = (0..PLACES - 1).map(|_| take(&places, 2)).collect();
        assert_eq!((is_open(&phone), open(&alone).len()), (true, PLACES - 1));
    }

    #[test]
    fn if_each_place_has_another_address_the_oldest_goes_and_the_newest_stays() {
        let places = Places::default();
        let connections: Vec<_> = (0..=PLACES as u8).map(|last| take(&places, last)).collect();
        assert_eq!(open(&connections), (1..=PLACES).collect::<Vec<_>>());
    }

    #[test]
    fn a_stage_takes_no_place_of_another() {
        use Stage::{Asking, Holding, Listening, Opening};
        for stage in [Opening, Asking, Listening, Holding] {
            let places = Places::default();
            let others = [Opening, Asking, Listening, Holding].into_iter().filter(|&other| other != stage);
            let others: Vec<_> = others.map(|other| entered(&places, other, Client::Phone(1))).collect();
            let attack: Vec<_> = (0..200).map(|_| entered(&places, stage, Client::Phone(1))).collect();
            assert_eq!(open(&attack).len(), PLACES, "{stage:?}");
            assert_eq!(open(&others).len(), 3, "{stage:?}");
        }
    }

    #[test]
    fn a_phone_keeps_its_connection_for_any_number_of_others() {
        for stage in [Stage::Asking, Stage::Listening, Stage::Holding] {
            let places = Places::default();
            let phone = entered(&places, stage, Client::Phone(1));
            let attack: Vec<_> = (0..200).map(|_| entered(&places, stage, Client::Phone(2))).collect();
            let later = entered(&places, stage, Client::Phone(1));
            assert!(is_open(&phone) && is_open(&later), "{stage:?}");
            assert_eq!(open(&attack).len(), PLACES - 2, "{stage:?}");
        }
    }

    #[test]
    fn the_stream_that_came_first_stays_and_the_last_gives_way() {
        let places = Places::default();
        let streams: Vec<_> = (0..200).map(|_| entered(&places, Stage::Listening, Client::Here)).collect();
        assert_eq!(open(&streams), (0..PLACES - 1).chain([199]).collect::<Vec<_>>());
    }

    #[test]
    fn the_connection_with_the_oldest_request_gives_way() {
        let places = Places::default();
        let asking = || entered(&places, Stage::Asking, Client::Here);
        let mut connections: Vec<_> = (0..PLACES).map(|_| asking()).collect();
        connections[0].enter(Stage::Asking, Client::Here);
        connections.push(asking());
        assert_eq!(open(&connections), [0].into_iter().chain(2..=PLACES).collect::<Vec<_>>());
    }

    #[test]
    fn a_first_request_that_came_before_the_end_gets_a_place_once() {
        let places = Places::default();
        let connections: Vec<_> = (0..=PLACES as u8).map(|last| take(&places, last)).collect();
        let phone = &connections[0];
        // A request goes through two stages before its connection's end is heard of.
        phone.enter(Stage::Asking, Client::Phone(1));
        phone.enter(Stage::Holding, Client::Phone(1));
        assert!(phone.lost().now_or_never().is_some() && !phone.is_over());
        let attack: Vec<_> = (0..PLACES).map(|_| entered(&places, Stage::Holding, Client::Phone(1))).collect();
        assert!(phone.lost().now_or_never().is_some() && phone.is_over());
        phone.enter(Stage::Holding, Client::Phone(1));
        assert!(phone.is_over());
        assert_eq!(open(&attack).len(), PLACES);
    }

    #[test]
    fn a_place_is_free_again_and_one_that_is_lost_does_not_come_back() {
        let places = Places::default();
        let connections: Vec<_> = (0..=PLACES).map(|_| take(&places, 1)).collect();
        assert!(connections[0].is_over());
        connections[0].enter(Stage::Holding, Client::Phone(1));
        assert!(connections[0].is_over());
        drop(connections);
        assert!(places.0.lock().0.is_empty());
    }
}
