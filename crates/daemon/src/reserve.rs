//! Places that are kept for stops.
//!
//! A connection always gets one of them. When all are taken, the oldest connection of the address that has most of them is closed: clients
//! that hold these places without a request keep nobody out, and the clients of one address take the places of that address only.

use std::net::IpAddr;
use std::sync::{Arc, Mutex, MutexGuard, PoisonError};

use tokio::sync::oneshot;

use super::places::network;

/// The places.
#[derive(Debug)]
pub struct Reserve {
    places: usize,
    held: Mutex<Held>,
}

#[derive(Debug, Default)]
struct Held {
    next: u64,
    /// Oldest first.
    connections: Vec<HeldPlace>,
}

#[derive(Debug)]
struct HeldPlace {
    id: u64,
    address: Option<IpAddr>,
    /// Dropped when the connection is to be closed.
    _keep: oneshot::Sender<()>,
}

impl Held {
    /// Forgets the oldest connection of the address with most places.
    fn close_one(&mut self) {
        let of_address = |address| {
            let connections = self.connections.iter();
            connections.filter(|held| held.address == address).count()
        };
        // `max_by_key` returns the last of several: the order is reversed.
        let fullest = (0..self.connections.len())
            .rev()
            .max_by_key(|index| of_address(self.connections[*index].address));
        if let Some(oldest) = fullest {
            self.connections.remove(oldest);
        }
    }
}

impl Reserve {
    /// A number of places, at least one.
    pub fn new(places: usize) -> Reserve {
        Reserve {
            places: places.max(1),
            held: Mutex::default(),
        }
    }

    fn held(&self) -> MutexGuard<'_, Held> {
        self.held.lock().unwrap_or_else(PoisonError::into_inner)
    }

    /// A place; another connection is closed for it if necessary.
    pub fn take(self: &Arc<Self>, address: Option<IpAddr>) -> ReservedPlace {
        let mut held = self.held();
        while held.connections.len() >= self.places {
            held.close_one();
        }
        let (keep, closed) = oneshot::channel();
        let id = held.next;
        held.next += 1;
        held.connections.push(HeldPlace {
            id,
            address: address.map(network),
            _keep: keep,
        });
        ReservedPlace {
            reserve: Arc::clone(self),
            id,
            closed,
        }
    }

    /// Closes the connection that would be the next to be closed.
    pub fn close_one(&self) {
        self.held().close_one();
    }
}

/// A place that is taken.
#[derive(Debug)]
pub struct ReservedPlace {
    reserve: Arc<Reserve>,
    id: u64,
    closed: oneshot::Receiver<()>,
}

impl ReservedPlace {
    /// Waits until another connection gets the place.
    pub async fn closed(&mut self) {
        let _ = (&mut self.closed).await; // nothing is sent
    }
}

impl Drop for ReservedPlace {
    fn drop(&mut self) {
        let mut held = self.reserve.held();
        held.connections.retain(|held| held.id != self.id);
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    fn is_closed(place: &mut ReservedPlace) -> bool {
        place.closed.try_recv() == Err(oneshot::error::TryRecvError::Closed)
    }

    fn address(last: u8) -> Option<IpAddr> {
        Some(IpAddr::from([10, 0, 0, last]))
    }

    #[test]
    fn closes_the_oldest_connection_of_the_fullest_address() {
        let reserve = Arc::new(Reserve::new(4));
        let mut stop = reserve.take(address(1));
        let mut idle: Vec<_> = (0..3).map(|_| reserve.take(address(2))).collect();
        let mut newer: Vec<_> = (0..5).map(|_| reserve.take(address(2))).collect();
        assert!(!is_closed(&mut stop), "the other address keeps its place");
        assert!(idle.iter_mut().all(is_closed));
        let closed: Vec<bool> = newer.iter_mut().map(is_closed).collect();
        assert_eq!(closed, [true, true, false, false, false]);
    }

    #[test]
    fn places_are_free_after_the_end_of_their_connections() {
        let reserve = Arc::new(Reserve::new(2));
        drop([reserve.take(None), reserve.take(None)]);
        let mut two = [reserve.take(None), reserve.take(None)];
        assert!(!two.iter_mut().any(is_closed));
        let mut third = reserve.take(None);
        assert_eq!(two.each_mut().map(is_closed), [true, false]);
        assert!(!is_closed(&mut third));
    }
}
