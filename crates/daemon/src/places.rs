//! Places that are limited for all clients together and for each address.

use std::collections::HashMap;
use std::net::{IpAddr, Ipv6Addr};
use std::sync::{Arc, Mutex, MutexGuard, PoisonError};

/// A number of places.
#[derive(Debug)]
pub struct Places {
    all: usize,
    of_address: usize,
    taken: Mutex<Taken>,
}

#[derive(Debug, Default)]
struct Taken {
    all: usize,
    of_address: HashMap<IpAddr, usize>,
}

impl Places {
    /// `all` places, of which one address may take `of_address`.
    pub fn new(all: usize, of_address: usize) -> Places {
        Places {
            all,
            of_address,
            taken: Mutex::default(),
        }
    }

    fn taken(&self) -> MutexGuard<'_, Taken> {
        self.taken.lock().unwrap_or_else(PoisonError::into_inner)
    }

    /// A place until it is dropped; `None` if there is none left. Clients of this machine have no address.
    pub fn take(self: &Arc<Self>, address: Option<IpAddr>) -> Option<Place> {
        let address = address.map(network);
        let mut taken = self.taken();
        if taken.all >= self.all {
            return None;
        }
        if let Some(address) = address {
            let of_address = taken.of_address.entry(address).or_default();
            if *of_address >= self.of_address {
                return None;
            }
            *of_address += 1;
        }
        taken.all += 1;
        Some(Place {
            places: Arc::clone(self),
            address,
        })
    }
}

/// What counts as one address: one host usually has a whole network of 64 bits in IPv6 [RFC 4291, 2.5.4].
pub fn network(address: IpAddr) -> IpAddr {
    match address.to_canonical() {
        IpAddr::V4(address) => address.into(),
        IpAddr::V6(address) => Ipv6Addr::from_bits(address.to_bits() & (u128::MAX << 64)).into(),
    }
}

/// A place that is taken.
#[derive(Debug)]
pub struct Place {
    places: Arc<Places>,
    address: Option<IpAddr>,
}

impl Drop for Place {
    fn drop(&mut self) {
        let mut taken = self.places.taken();
        taken.all -= 1;
        let Some(address) = self.address else { return };
        let left = taken.of_address.get(&address).map_or(0, |count| count - 1);
        match left {
            0 => taken.of_address.remove(&address),
            left => taken.of_address.insert(address, left),
        };
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn places_are_limited_for_one_address_and_for_all() {
        let places = Arc::new(Places::new(256, 64));
        let address = |last: u8| Some(IpAddr::from([10, 0, 0, last]));
        let mut taken: Vec<Place> = (0..64).filter_map(|_| places.take(address(1))).collect();
        assert_eq!(taken.len(), 64);
        assert!(places.take(address(1)).is_none(), "one address");
        taken.extend((64..=255).filter_map(|n: u8| places.take(address(2 + n / 64))));
        assert_eq!(taken.len(), 256);
        assert!(places.take(address(9)).is_none(), "all together");
        taken.truncate(63);
        assert!(
            places.take(address(1)).is_some(),
            "a closed connection leaves its place"
        );
        drop(taken);
        let left = places.taken();
        assert_eq!((left.all, left.of_address.len()), (0, 0));
    }

    #[test]
    fn network_of_ipv6_counts_as_one_address() {
        let places = Arc::new(Places::new(9, 1));
        let address = |text: &str| Some(text.parse().unwrap());
        let _first = places.take(address("2001:db8:0:1::1")).unwrap();
        assert!(places.take(address("2001:db8:0:1:ffff::2")).is_none());
        let _other = places.take(address("2001:db8:0:2::1")).unwrap();
        let _mapped = places.take(address("::ffff:10.0.0.1")).unwrap();
        assert!(places.take(address("10.0.0.1")).is_none(), "IPv4 in IPv6");
    }
}
