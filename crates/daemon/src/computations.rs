//! Places of computations that move nothing: plans for operators, and reports, findings and models for anyone.

use std::net::IpAddr;
use std::sync::Arc;
use std::time::Duration;

use tokio::sync::{OwnedSemaphorePermit, Semaphore};

use super::places::{Place, Places};

/// Plans that are computed at the same time. More of them would take the processor from the loop.
const MAX_PLANS: usize = 2;
/// Computations for anyone that wait or go on, and those of one address.
const MAX_VIEWS: usize = 32;
const MAX_VIEWS_OF_ADDRESS: usize = 8;
/// Longest time of waiting for a turn.
const WAIT: Duration = Duration::from_secs(60);

/// Why there is no turn.
#[derive(Clone, Copy, Debug, PartialEq, Eq, thiserror::Error)]
pub enum Busy {
    /// None has ended.
    #[error("other computations go on, and none of them ended within {} s; ask again later", WAIT.as_secs())]
    Others,
    /// Too many wait.
    #[error(
        "{MAX_VIEWS_OF_ADDRESS} reports, findings or models of this address wait already, or {MAX_VIEWS} of all addresses; ask again later"
    )]
    Viewers,
}

/// For whom something is computed.
#[derive(Clone, Copy, Debug)]
pub enum Purpose {
    /// For an operator: the plan of a command.
    Plan,
    /// For anyone, at an address or on this machine.
    View(Option<IpAddr>),
}

/// Places of computations that move nothing. Those for anyone do not take the places of plans.
#[derive(Debug)]
pub struct Computations {
    plans: Arc<Semaphore>,
    /// One at a time.
    views: Arc<Semaphore>,
    /// Those for anyone that wait or go on.
    viewers: Arc<Places>,
}

impl Default for Computations {
    fn default() -> Computations {
        Computations {
            plans: Arc::new(Semaphore::new(MAX_PLANS)),
            views: Arc::new(Semaphore::new(1)),
            viewers: Arc::new(Places::new(MAX_VIEWS, MAX_VIEWS_OF_ADDRESS)),
        }
    }
}

/// The turn of a computation, until it is dropped.
#[derive(Debug)]
pub struct Turn {
    _turn: OwnedSemaphorePermit,
    _viewer: Option<Place>,
}

impl Computations {
    /// A turn.
    ///
    /// # Errors
    /// When others wait or go on.
    pub async fn turn(&self, purpose: Purpose) -> Result<Turn, Busy> {
        let (turns, viewer) = match purpose {
            Purpose::Plan => (&self.plans, None),
            Purpose::View(address) => {
                let viewer = self.viewers.take(address);
                let viewer = viewer.ok_or(Busy::Viewers)?;
                (&self.views, Some(viewer))
            }
        };
        let turn = Arc::clone(turns).acquire_owned();
        match tokio::time::timeout(WAIT, turn).await {
            Ok(Ok(turn)) => Ok(Turn {
                _turn: turn,
                _viewer: viewer,
            }),
            Ok(Err(_)) | Err(_) => Err(Busy::Others),
        }
    }
}

#[cfg(test)]
mod tests {
    use futures_util::FutureExt;

    use super::*;

    #[tokio::test]
    async fn views_leave_the_places_of_plans_and_of_other_addresses() {
        let computations = Arc::new(Computations::default());
        let view = |last: u8| Purpose::View(Some(IpAddr::from([10, 0, 0, last])));
        let _first = computations.turn(view(1)).await.unwrap();
        let waiting: Vec<_> = (1..MAX_VIEWS_OF_ADDRESS)
            .map(|_| {
                let computations = Arc::clone(&computations);
                tokio::spawn(async move { computations.turn(view(1)).await.map(drop) })
            })
            .collect();
        // Each of them takes a place and waits.
        tokio::task::yield_now().await;
        let refused = computations.turn(view(1)).now_or_never();
        assert_eq!(refused.map(|turn| turn.map(drop)), Some(Err(Busy::Viewers)));
        let _plans = [Purpose::Plan; MAX_PLANS].map(|plan| computations.turn(plan));
        for plan in _plans {
            plan.await.unwrap();
        }
        let other = Arc::clone(&computations);
        let other = tokio::spawn(async move { other.turn(view(2)).await.map(drop) });
        tokio::task::yield_now().await;
        assert!(!other.is_finished(), "one at a time");
        drop(_first);
        for waiting in waiting {
            assert_eq!(waiting.await.unwrap(), Ok(()));
        }
        assert_eq!(other.await.unwrap(), Ok(()));
    }
}
