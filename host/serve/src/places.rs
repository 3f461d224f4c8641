//! How many connections there may be at once, so that nobody takes them all: of all together, and of one address.
//!
//! It is by hand because the limits of `tower` are of requests, and of all addresses together.

use std::collections::HashMap;
use std::net::IpAddr;
use std::sync::{Arc, Mutex, PoisonError};

/// Connections at a door.
const ALL: usize = 64;

/// Places that are taken, by address.
#[derive(Clone)]
pub struct Places {
    most_of_one: usize,
    taken: Arc<Mutex<HashMap<IpAddr, usize>>>,
}

/// A place, which is free again when this is dropped.
pub struct Place {
    address: IpAddr,
    places: Places,
}

impl Places {
    /// Places of which one address may have all.
    pub fn for_one() -> Self {
        Self { most_of_one: ALL, taken: Arc::default() }
    }

    /// Places of which one address may have a quarter: a browser has six.
    pub fn for_many() -> Self {
        Self { most_of_one: ALL / 4, taken: Arc::default() }
    }

    /// A place for a connection from this address, if there is one.
    pub fn take(&self, address: IpAddr) -> Option<Place> {
        let mut taken = self.taken.lock().unwrap_or_else(PoisonError::into_inner);
        let own = taken.get(&address).copied().unwrap_or_default();
        let is_free = own < self.most_of_one && taken.values().sum::<usize>() < ALL;
        is_free.then(|| {
            taken.insert(address, own + 1);
            Place { address, places: self.clone() }
        })
    }
}

impl Drop for Place {
    fn drop(&mut self) {
        let mut taken = self.places.taken.lock().unwrap_or_else(PoisonError::into_inner);
        match taken.get_mut(&self.address) {
            Some(own) if *own > 1 => *own -= 1,
            _ => {
                taken.remove(&self.address);
            }
        }
    }
}

#[cfg(test)]
mod tests {
    use super::*;
    use std::net::Ipv4Addr;

    fn address(last: u8) -> IpAddr {
        Ipv4Addr::new(192, 168, 1, last).into()
    }

    #[test]
    fn one_address_cannot_take_all_places_and_gets_its_own_back() {
        let places = Places::for_many();
        let mut taken: Vec<Place> = (0..ALL / 4).map(|_| places.take(address(1)).unwrap()).collect();
        assert!(places.take(address(1)).is_none());
        assert!(places.take(address(2)).is_some());
        taken.pop();
        assert!(places.take(address(1)).is_some());
        drop(taken);
        assert!(places.taken.lock().unwrap().is_empty());
    }

    #[test]
    fn all_addresses_together_have_so_many_and_no_more() {
        let places = Places::for_many();
        let taken: Vec<Place> = (0..ALL).map(|number| places.take(address(number as u8)).unwrap()).collect();
        assert!(places.take(address(200)).is_none());
        drop(taken);
        assert!(places.take(address(200)).is_some());
    }
}
