//! Connections of clients: how many there may be, and how long a client may take for a request.

use std::collections::HashMap;
use std::io;
use std::net::IpAddr;
use std::pin::Pin;
use std::sync::{Arc, Mutex, MutexGuard, PoisonError};
use std::task::{Context, Poll};
use std::time::Duration;

use axum::Router;
use axum::body::Body;
use axum::extract::ConnectInfo;
use axum::serve::Listener;
use hyper::Request;
use hyper::body::Incoming;
use hyper::server::conn::http1::Builder;
use hyper_util::rt::{TokioIo, TokioTimer};
use hyper_util::service::TowerToHyperService;
use nix::sys::socket::{setsockopt, sockopt};
use tokio::io::{AsyncRead, AsyncWrite, ReadBuf};
use tokio::net::{TcpListener, TcpStream, UnixListener};
use tower::ServiceExt;

use super::peer::Peer;

/// Connections of all clients of a listener together.
const MAX_CONNECTIONS: usize = 256;
/// Connections of one address, fewer than all: a client that opens too many cannot keep others from a stop.
const MAX_OF_ADDRESS: usize = 64;
/// Time until the head of a request is complete, from the end of the request before it.
const HEAD_TIME: Duration = Duration::from_secs(15);
/// Time after which a peer that acknowledges nothing is given up, in milliseconds.
const PEER_TIME_MS: u32 = 60_000;
/// Idle time after which a peer is asked whether it is still there, in seconds.
const KEEPALIVE_S: u32 = 30;

/// Serves the clients of a TCP address. Each request carries the address of its client.
pub async fn serve_tcp(mut listener: TcpListener, router: Router) {
    let places = Arc::new(Places::default());
    loop {
        let (stream, client) = Listener::accept(&mut listener).await;
        let Some(place) = places.take(Some(client.ip())) else {
            tracing::warn!(%client, "a connection was refused: {MAX_CONNECTIONS} are open, or {MAX_OF_ADDRESS} from this address");
            continue;
        };
        if let Err(error) = detect_dead_peer(&stream) {
            tracing::debug!(%client, "no time limit for the connection: {error}");
        }
        let connection = Connection {
            stream,
            _place: place,
        };
        let client = ConnectInfo(client);
        tokio::spawn(serve_connection(connection, router.clone(), client));
    }
}

/// Serves the clients of the socket of this machine. Each request carries the user of its client.
pub async fn serve_unix(mut listener: UnixListener, router: Router) {
    let places = Arc::new(Places::default());
    loop {
        let (stream, _) = Listener::accept(&mut listener).await;
        let peer = match Peer::of(&stream) {
            Ok(peer) => peer,
            Err(error) => {
                tracing::warn!(
                    "a connection at the socket was refused: its user is not known: {error}"
                );
                continue;
            }
        };
        let Some(place) = places.take(None) else {
            tracing::warn!("a connection at the socket was refused: {MAX_CONNECTIONS} are open");
            continue;
        };
        let connection = Connection {
            stream,
            _place: place,
        };
        tokio::spawn(serve_connection(connection, router.clone(), peer));
    }
}

/// A peer that has lost its power or its cable does not close its connection.
fn detect_dead_peer(stream: &TcpStream) -> nix::Result<()> {
    setsockopt(stream, sockopt::KeepAlive, &true)?;
    setsockopt(stream, sockopt::TcpKeepIdle, &KEEPALIVE_S)?;
    setsockopt(stream, sockopt::TcpUserTimeout, &PEER_TIME_MS)
}

/// Serves a connection. Each request carries `client` as extension.
async fn serve_connection<S, C>(connection: Connection<S>, router: Router, client: C)
where
    S: AsyncRead + AsyncWrite + Unpin + Send + 'static,
    C: Clone + Send + Sync + 'static,
{
    let service = router.map_request(move |mut request: Request<Incoming>| {
        request.extensions_mut().insert(client.clone());
        request.map(Body::new)
    });
    let served = Builder::new()
        .timer(TokioTimer::new())
        .header_read_timeout(HEAD_TIME)
        .serve_connection(TokioIo::new(connection), TowerToHyperService::new(service))
        .with_upgrades()
        .await;
    if let Err(error) = served {
        tracing::debug!("a connection ended: {error}");
    }
}

/// The places of a listener.
#[derive(Debug, Default)]
struct Places(Mutex<Taken>);

#[derive(Debug, Default)]
struct Taken {
    all: usize,
    of_address: HashMap<IpAddr, usize>,
}

impl Places {
    fn taken(&self) -> MutexGuard<'_, Taken> {
        self.0.lock().unwrap_or_else(PoisonError::into_inner)
    }

    /// A place until it is dropped; `None` if there is none left.
    fn take(self: &Arc<Self>, address: Option<IpAddr>) -> Option<Place> {
        let mut taken = self.taken();
        if taken.all >= MAX_CONNECTIONS {
            return None;
        }
        if let Some(address) = address {
            let of_address = taken.of_address.entry(address).or_default();
            if *of_address >= MAX_OF_ADDRESS {
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

/// The place of a connection.
#[derive(Debug)]
struct Place {
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

/// A connection with its place, also after it became a WebSocket.
struct Connection<S> {
    stream: S,
    _place: Place,
}

impl<S: AsyncRead + Unpin> AsyncRead for Connection<S> {
    fn poll_read(
        mut self: Pin<&mut Self>,
        context: &mut Context<'_>,
        buffer: &mut ReadBuf<'_>,
    ) -> Poll<io::Result<()>> {
        Pin::new(&mut self.stream).poll_read(context, buffer)
    }
}

impl<S: AsyncWrite + Unpin> AsyncWrite for Connection<S> {
    fn poll_write(
        mut self: Pin<&mut Self>,
        context: &mut Context<'_>,
        bytes: &[u8],
    ) -> Poll<io::Result<usize>> {
        Pin::new(&mut self.stream).poll_write(context, bytes)
    }

    fn poll_flush(mut self: Pin<&mut Self>, context: &mut Context<'_>) -> Poll<io::Result<()>> {
        Pin::new(&mut self.stream).poll_flush(context)
    }

    fn poll_shutdown(mut self: Pin<&mut Self>, context: &mut Context<'_>) -> Poll<io::Result<()>> {
        Pin::new(&mut self.stream).poll_shutdown(context)
    }

    fn poll_write_vectored(
        mut self: Pin<&mut Self>,
        context: &mut Context<'_>,
        slices: &[io::IoSlice<'_>],
    ) -> Poll<io::Result<usize>> {
        Pin::new(&mut self.stream).poll_write_vectored(context, slices)
    }

    fn is_write_vectored(&self) -> bool {
        self.stream.is_write_vectored()
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn places_are_limited_for_one_address_and_for_all() {
        let places = Arc::new(Places::default());
        let address = |last: usize| Some(IpAddr::from([10, 0, 0, u8::try_from(last).unwrap()]));
        let mut taken: Vec<Place> = (0..MAX_OF_ADDRESS)
            .filter_map(|_| places.take(address(1)))
            .collect();
        assert_eq!(taken.len(), MAX_OF_ADDRESS);
        assert!(places.take(address(1)).is_none(), "one address");
        let others = MAX_OF_ADDRESS..MAX_CONNECTIONS;
        taken.extend(others.filter_map(|n| places.take(address(2 + n / MAX_OF_ADDRESS))));
        assert_eq!(taken.len(), MAX_CONNECTIONS);
        assert!(places.take(address(9)).is_none(), "all together");
        taken.truncate(MAX_OF_ADDRESS - 1);
        assert!(
            places.take(address(1)).is_some(),
            "a closed connection leaves its place"
        );
        drop(taken);
        let left = places.taken();
        assert_eq!((left.all, left.of_address.len()), (0, 0));
    }
}
