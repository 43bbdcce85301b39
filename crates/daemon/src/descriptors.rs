//! File descriptors: as many connections as the system allows, and one that is kept for the next stop.

use std::fs::File;

use nix::sys::resource::{Resource, getrlimit, setrlimit};

/// Most open files that are asked for.
const WANTED: u64 = 4096;
/// Descriptors of the daemon besides its connections: devices, recording, processes, sockets.
const OWN: u64 = 40;
/// Most connections of a listener.
const MAX_CONNECTIONS: u64 = 256;
/// Most places of a listener that are kept for stops.
const MAX_RESERVED: u64 = 32;

/// Connections of one listener.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub struct Capacity {
    /// All together.
    pub all: usize,
    /// Those of one address, fewer than all.
    pub of_address: usize,
    /// Those in which only a stop is served, besides the others.
    pub reserved: usize,
}

impl Capacity {
    /// What fits into a limit of open files. Each of the two listeners gets a half; a connection may need a second descriptor, for the
    /// file that it reads.
    pub fn of_limit(limit: u64) -> Capacity {
        let of_listener = limit.saturating_sub(OWN) / 2;
        let reserved = (of_listener / 4).clamp(1, MAX_RESERVED);
        let all = (of_listener.saturating_sub(reserved) / 2).clamp(1, MAX_CONNECTIONS);
        let of_address = (all / 4).max(all.min(4));
        // At most `MAX_CONNECTIONS`.
        let [all, of_address, reserved] = [all, of_address, reserved].map(|number| number as usize);
        Capacity {
            all,
            of_address,
            reserved,
        }
    }

    /// What fits into the limit of this process, which is raised as far as the system allows.
    pub fn of_process() -> Capacity {
        Capacity::of_limit(raised_limit())
    }
}

/// The limit of open files, after it has been raised. A limit that cannot be read is taken as the smallest usual one.
fn raised_limit() -> u64 {
    const USUAL: u64 = 256;
    let Ok((soft, hard)) = getrlimit(Resource::RLIMIT_NOFILE) else {
        return USUAL;
    };
    let wanted = WANTED.min(hard);
    if soft >= wanted {
        return soft;
    }
    match setrlimit(Resource::RLIMIT_NOFILE, wanted, hard) {
        Ok(()) => wanted,
        Err(_) => soft,
    }
}

/// A descriptor that is open until no other is left.
#[derive(Debug)]
pub struct Spare(Option<File>);

impl Spare {
    /// A new one.
    pub fn new() -> Spare {
        let mut spare = Spare(None);
        spare.refill();
        spare
    }

    /// Opens it again, if it was released; returns whether it is open.
    pub fn refill(&mut self) -> bool {
        if self.0.is_none() {
            self.0 = File::open("/dev/null").ok();
        }
        self.0.is_some()
    }

    /// Closes it; returns whether it was open.
    pub fn release(&mut self) -> bool {
        self.0.take().is_some()
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn connections_fit_into_the_limit() {
        for limit in [0, 40, 48, 64, 100, 256, 1024, 4096, 1 << 40] {
            let capacity = Capacity::of_limit(limit);
            assert!(capacity.of_address <= capacity.all && capacity.reserved >= 1);
            let needed = 2 * (2 * capacity.all + capacity.reserved) as u64;
            assert!(limit < 48 || needed + OWN <= limit, "{limit}: {capacity:?}");
        }
        let usual = Capacity {
            all: 256,
            of_address: 64,
            reserved: 32,
        };
        assert_eq!(Capacity::of_limit(4096), usual);
    }

    #[test]
    fn spare_is_released_once() {
        let mut spare = Spare::new();
        assert_eq!([spare.release(), spare.release()], [true, false]);
        assert!(spare.refill() && spare.release());
    }
}
