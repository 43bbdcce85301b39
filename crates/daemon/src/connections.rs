//! Connections of clients: how many there may be, and how long a client may take for a request. A stop always finds a place.
//!
//! ```text
//!  a client connects --> a place is free -----------> every request
//!                    --> none is free --------------> a reserved place: a stop only, for a short time
//!                    --> no descriptor is left -----> the spare one: a stop only, for a short time
//! ```

use std::io;
use std::net::IpAddr;
use std::pin::Pin;
use std::sync::Arc;
use std::task::{Context, Poll};
use std::time::{Duration, Instant};

use axum::body::Body;
use axum::extract::ConnectInfo;
use axum::{Router, middleware};
use hyper::Request;
use hyper::body::Incoming;
use hyper::server::conn::http1::Builder;
use hyper_util::rt::{TokioIo, TokioTimer};
use hyper_util::service::TowerToHyperService;
use nix::sys::socket::{setsockopt, sockopt};
use tokio::io::{AsyncRead, AsyncWrite, ReadBuf};
use tokio::net::{TcpListener, TcpStream, UnixListener};
use tokio::time::{Sleep, sleep};
use tower::ServiceExt;

use super::api::guard::only_stop;
use super::descriptors::{Capacity, Spare};
use super::peer::Peer;
use super::places::{Place, Places};
use super::reserve::{Reserve, ReservedPlace};

/// Time until the head of a request is complete, from the end of the request before it.
const HEAD_TIME: Duration = Duration::from_secs(15);
/// Life of a connection in a reserved place.
const RESERVED_TIME: Duration = Duration::from_secs(5);
/// Time in which a client takes a part of an answer.
const WRITE_TIME: Duration = Duration::from_secs(20);
/// Largest head of a request, and largest part of an answer that waits for the client, in bytes. The HTTP library permits no less.
const BUFFER_BYTES: usize = 8 << 10;
/// Time after which a peer that acknowledges nothing is given up, in milliseconds.
const PEER_TIME_MS: u32 = 60_000;
/// Idle time after which a peer is asked whether it is still there, in seconds.
const KEEPALIVE_S: u32 = 30;
/// Pause before a connection is accepted again, if no descriptor was left.
const RETRY: Duration = Duration::from_millis(10);
/// Time between two warnings.
const WARNING: Duration = Duration::from_secs(60);

/// Serves the clients of a TCP address. Each request carries the address of its client.
pub async fn serve_tcp(listener: TcpListener, router: Router, capacity: Capacity) {
    let mut admission = Admission::new(capacity, &router);
    loop {
        let (stream, client) = admission.accept(|| listener.accept()).await;
        if let Err(error) = detect_dead_peer(&stream) {
            tracing::debug!(%client, "no time limit for the connection: {error}");
        }
        let admitted = admission.admit(&router, Some(client.ip()));
        tokio::spawn(serve_connection(stream, admitted, ConnectInfo(client)));
        // A client is heard before another one may take its place.
        tokio::task::yield_now().await;
    }
}

/// Serves the clients of the socket of this machine. Each request carries the user of its client.
pub async fn serve_unix(listener: UnixListener, router: Router, capacity: Capacity) {
    let mut admission = Admission::new(capacity, &router);
    loop {
        let (stream, _) = admission.accept(|| listener.accept()).await;
        let peer = match Peer::of(&stream) {
            Ok(peer) => peer,
            Err(error) => {
                admission.warn(&format!(
                    "a connection at the socket was refused: its user is not known: {error}"
                ));
                continue;
            }
        };
        let admitted = admission.admit(&router, None);
        tokio::spawn(serve_connection(stream, admitted, peer));
        tokio::task::yield_now().await;
    }
}

/// A peer that has lost its power or its cable does not close its connection.
fn detect_dead_peer(stream: &TcpStream) -> nix::Result<()> {
    setsockopt(stream, sockopt::KeepAlive, &true)?;
    setsockopt(stream, sockopt::TcpKeepIdle, &KEEPALIVE_S)?;
    setsockopt(stream, sockopt::TcpUserTimeout, &PEER_TIME_MS)
}

/// Decides for each client of a listener what it may ask for.
struct Admission {
    capacity: Capacity,
    places: Arc<Places>,
    reserve: Arc<Reserve>,
    spare: Spare,
    /// The requests of a client without a place.
    stops: Router,
    warned: Option<Instant>,
}

/// What a client may ask for.
enum Admitted {
    /// Everything.
    Any(Router, Place),
    /// A stop.
    Stop(Router, ReservedPlace),
}

impl Admission {
    fn new(capacity: Capacity, router: &Router) -> Admission {
        Admission {
            capacity,
            places: Arc::new(Places::new(capacity.all, capacity.of_address)),
            reserve: Arc::new(Reserve::new(capacity.reserved)),
            spare: Spare::new(),
            stops: router.clone().layer(middleware::from_fn(only_stop)),
            warned: None,
        }
    }

    /// The next connection, also if no descriptor is left for it.
    async fn accept<T, F: Future<Output = io::Result<T>>>(&mut self, accept: impl Fn() -> F) -> T {
        loop {
            match accept().await {
                Ok(accepted) => return accepted,
                Err(error) if is_of_client(&error) => {}
                Err(error) => self.make_room(&error).await,
            }
        }
    }

    async fn make_room(&mut self, error: &io::Error) {
        self.warn(&format!("a connection cannot be accepted: {error}"));
        if !self.spare.release() {
            self.reserve.close_one();
            sleep(RETRY).await;
        }
    }

    fn admit(&mut self, router: &Router, address: Option<IpAddr>) -> Admitted {
        let place = if self.spare.refill() {
            self.places.take(address)
        } else {
            None
        };
        if let Some(place) = place {
            return Admitted::Any(router.clone(), place);
        }
        let Capacity {
            all, of_address, ..
        } = self.capacity;
        self.warn(&format!(
            "a connection may only stop the bench: {all} are open, or {of_address} from its address, or no file descriptor is left"
        ));
        Admitted::Stop(self.stops.clone(), self.reserve.take(address))
    }

    /// Warns, but not for each of many connections.
    fn warn(&mut self, message: &str) {
        if self.warned.is_none_or(|warned| warned.elapsed() > WARNING) {
            self.warned = Some(Instant::now());
            tracing::warn!("{message}");
        }
    }
}

/// Whether a connection failed because of its client.
fn is_of_client(error: &io::Error) -> bool {
    matches!(
        error.kind(),
        io::ErrorKind::ConnectionAborted
            | io::ErrorKind::ConnectionReset
            | io::ErrorKind::ConnectionRefused
    )
}

/// Serves a connection. Each request carries `client` as extension.
async fn serve_connection<S, C>(stream: S, admitted: Admitted, client: C)
where
    S: AsyncRead + AsyncWrite + Unpin + Send + 'static,
    C: Clone + Send + Sync + 'static,
{
    match admitted {
        Admitted::Any(router, place) => {
            serve_requests(Connection::new(stream, Some(place)), router, client).await;
        }
        Admitted::Stop(router, mut place) => tokio::select! {
            () = serve_requests(Connection::new(stream, None), router, client) => {}
            () = place.closed() => {}
            () = sleep(RESERVED_TIME) => {}
        },
    }
}

async fn serve_requests<S, C>(connection: Connection<S>, router: Router, client: C)
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
        .max_buf_size(BUFFER_BYTES)
        .serve_connection(TokioIo::new(connection), TowerToHyperService::new(service))
        .with_upgrades()
        .await;
    if let Err(error) = served {
        tracing::debug!("a connection ended: {error}");
    }
}

/// A connection with its place, also after it became a WebSocket. It ends if its client takes nothing for too long.
struct Connection<S> {
    stream: S,
    /// Runs while the client takes nothing.
    stalled: Option<Pin<Box<Sleep>>>,
    _place: Option<Place>,
}

impl<S> Connection<S> {
    fn new(stream: S, place: Option<Place>) -> Connection<S> {
        Connection {
            stream,
            stalled: None,
            _place: place,
        }
    }

    /// Limits the time of a write that waits for the client.
    fn limited(
        &mut self,
        written: Poll<io::Result<usize>>,
        context: &mut Context<'_>,
    ) -> Poll<io::Result<usize>> {
        if written.is_ready() {
            self.stalled = None;
            return written;
        }
        let stalled = self
            .stalled
            .get_or_insert_with(|| Box::pin(sleep(WRITE_TIME)));
        match stalled.as_mut().poll(context) {
            Poll::Ready(()) => Poll::Ready(Err(io::ErrorKind::TimedOut.into())),
            Poll::Pending => Poll::Pending,
        }
    }
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
        let written = Pin::new(&mut self.stream).poll_write(context, bytes);
        self.limited(written, context)
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
        let written = Pin::new(&mut self.stream).poll_write_vectored(context, slices);
        self.limited(written, context)
    }

    fn is_write_vectored(&self) -> bool {
        self.stream.is_write_vectored()
    }
}
