//! The arm lease of the daemon: who may start and tune. At most one operator holds it.
//!
//! ```text
//!            take                       expiry while a run goes on that may continue
//!   free ------------> held by a client ----------------------------------------> held by the run
//!    ^                    | release, expiry                                           | end of the run
//!    +--------------------+-----------------------------------------------------------+
//! ```

use std::time::{Duration, Instant};

use super::secret::Secret;

/// Time after the last renewal at which a lease expires.
pub const LEASE: Duration = Duration::from_secs(10);

/// Who keeps a lease valid.
#[derive(Clone, Debug, PartialEq, Eq)]
pub enum Keeper {
    /// A client that renews it until this moment.
    Client {
        /// When it expires without a renewal.
        expires: Instant,
    },
    /// A run, until its end.
    Run(u64),
}

/// A lease.
#[derive(Clone, Debug)]
pub struct Lease {
    /// What the holder sends with its requests.
    pub secret: Secret,
    /// The operator.
    pub operator: String,
    /// Since when, in seconds since 1970.
    pub since_unix_s: f64,
    /// Who keeps it valid.
    pub keeper: Keeper,
    /// Whether a client that has lost it to its run may take it back. One that has released it may not.
    pub may_return: bool,
}

impl Lease {
    /// Whether it has expired.
    pub fn has_expired(&self, now: Instant) -> bool {
        match self.keeper {
            Keeper::Client { expires } => now >= expires,
            Keeper::Run(_) => false,
        }
    }

    /// Whether a client keeps it valid at this moment.
    pub fn is_of_client(&self, now: Instant) -> bool {
        match self.keeper {
            Keeper::Client { expires } => now < expires,
            Keeper::Run(_) => false,
        }
    }

    /// Seconds until it expires without a renewal; `None` for the lease of a run.
    pub fn expires_in_s(&self, now: Instant) -> Option<f64> {
        match self.keeper {
            Keeper::Client { expires } => {
                Some(expires.saturating_duration_since(now).as_secs_f64())
            }
            Keeper::Run(_) => None,
        }
    }

    /// Renews the lease of a client. That of a run needs no renewal; a client that returns takes it back.
    pub fn renew(&mut self, now: Instant) {
        self.keeper = Keeper::Client {
            expires: now + LEASE,
        };
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    const MILLISECOND: Duration = Duration::from_millis(1);

    fn lease(keeper: Keeper) -> Lease {
        Lease {
            secret: Secret::known("0123".into()),
            operator: "A. Operator".into(),
            since_unix_s: 0.0,
            keeper,
            may_return: true,
        }
    }

    #[test]
    fn renewed_lease_expires_after_ten_seconds() {
        let taken = Instant::now();
        let renewed = taken + Duration::from_secs(7);
        let mut lease = lease(Keeper::Client { expires: renewed });
        lease.renew(renewed);
        assert_eq!(lease.expires_in_s(renewed), Some(10.0));
        let end = renewed + Duration::from_secs(10);
        for (now, has_expired) in [
            (renewed, false),
            (end - MILLISECOND, false),
            (end, true),
            (end + MILLISECOND, true),
        ] {
            assert_eq!(lease.has_expired(now), has_expired);
            assert_eq!(lease.is_of_client(now), !has_expired);
        }
        assert_eq!(lease.expires_in_s(end + MILLISECOND), Some(0.0));
    }

    #[test]
    fn lease_of_a_run_does_not_expire() {
        let lease = lease(Keeper::Run(7));
        let later = Instant::now() + Duration::from_secs(86_400);
        assert!(!lease.has_expired(later) && !lease.is_of_client(later));
        assert_eq!(lease.expires_in_s(later), None);
    }

    #[test]
    fn client_that_returns_takes_the_lease_back_for_ten_seconds() {
        let now = Instant::now();
        let mut lease = lease(Keeper::Run(7));
        lease.renew(now);
        assert!(lease.is_of_client(now));
        assert_eq!(lease.expires_in_s(now), Some(10.0));
    }
}
