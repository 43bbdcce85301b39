//! State, events and samples as they happen.

use std::convert::Infallible;
use std::sync::Arc;
use std::time::Duration;

use aide::NoApi;
use axum::extract::State;
use axum::extract::ws::rejection::WebSocketUpgradeRejection;
use axum::extract::ws::{Message, WebSocket, WebSocketUpgrade};
use axum::http::StatusCode;
use axum::response::sse::{Event, KeepAlive, Sse};
use axum::response::{IntoResponse, Response};
use axum::{Extension, Json};
use futures_util::stream;
use schemars::JsonSchema;
use serde::{Deserialize, Serialize};
use tokio::sync::broadcast::Receiver;
use tokio::sync::broadcast::error::RecvError;
use tokio::time::{Instant, Interval, MissedTickBehavior, interval};

use super::error::ApiError;
use super::extract::InQuery;
use super::views::{StateView, state};
use crate::live::event_text::EventView;
use crate::live::hub::LiveMessage;
use crate::live::response::ResponseView;
use crate::peer::Peer;
use crate::session;
use crate::session_messages::MAX_MESSAGE_BYTES;
use crate::shared::Daemon;
use bench_experiment::ErrorKind;

/// Time between two states.
const STATE: Duration = Duration::from_millis(200);
/// Largest message of a viewer, also of one that has not ended. Nothing is expected of it.
const VIEWER_BYTES: usize = 1 << 10;
/// Shortest time between two messages of a viewer that are read.
const VIEWER_PAUSE: Duration = Duration::from_millis(20);
/// Buffer for what a client sends.
const READ_BYTES: usize = 4 << 10;
/// Largest message to a client that waits until the client takes it. A state with a full queue of long commands is smaller.
const MAX_WAITING_BYTES: usize = 16 << 20;
/// A client that takes no message for this long is disconnected.
const PATIENCE: Duration = Duration::from_secs(20);

/// Everything at one moment.
pub async fn now(State(daemon): State<Arc<Daemon>>) -> Json<StateView> {
    Json(state(&daemon))
}

/// A text message of the WebSocket.
#[derive(Serialize)]
#[serde(tag = "type", rename_all = "snake_case")]
enum TextMessage<'a> {
    State {
        state: Box<StateView>,
    },
    Event {
        #[serde(flatten)]
        event: &'a EventView,
    },
    Response {
        response: &'a ResponseView,
    },
    Lagged {
        frames: u64,
    },
}

/// What a client of the WebSocket asks for.
#[derive(Debug, Deserialize, JsonSchema)]
pub struct LiveQuery {
    /// Whether the samples of the last ten minutes are sent first, in blocks of 64 ticks.
    #[serde(default)]
    history: bool,
}

/// The response of the stage during the last chirp; `null` before the first one.
pub async fn response(State(daemon): State<Arc<Daemon>>) -> Json<Option<ResponseView>> {
    let response = daemon.live.snapshot().response;
    Json(response.map(|response| ResponseView::clone(&response)))
}

/// Upgrades to a WebSocket: states and events as JSON text, samples as binary messages.
pub async fn web_socket(
    State(daemon): State<Arc<Daemon>>,
    InQuery(query): InQuery<LiveQuery>,
    NoApi(upgrade): NoApi<Upgrade>,
) -> Result<Response, ApiError> {
    let upgrade = limited(upgrade.map_err(no_web_socket)?, VIEWER_BYTES);
    Ok(upgrade.on_upgrade(move |socket| serve(daemon, socket, query)))
}

/// The request for a WebSocket, or why it is none.
type Upgrade = Result<WebSocketUpgrade, WebSocketUpgradeRejection>;

/// A WebSocket that closes if its client sends a message, or a part of one, of more than `bytes`.
fn limited(upgrade: WebSocketUpgrade, bytes: usize) -> WebSocketUpgrade {
    upgrade
        .max_message_size(bytes)
        .max_frame_size(bytes)
        .read_buffer_size(READ_BYTES)
        .write_buffer_size(0)
        .max_write_buffer_size(MAX_WAITING_BYTES)
}

fn no_web_socket(rejection: WebSocketUpgradeRejection) -> ApiError {
    let message = format!(
        "this request must open a WebSocket: {}; GET /api/v1/events gives the same without samples",
        rejection.body_text()
    );
    let status = match rejection.status() {
        status if status.is_client_error() => status,
        _ => StatusCode::BAD_REQUEST,
    };
    ApiError::new(status, ErrorKind::Usage, message)
}

/// Upgrades to the connection of a command of this machine.
pub async fn command(
    State(daemon): State<Arc<Daemon>>,
    NoApi(Extension(peer)): NoApi<Extension<Peer>>,
    NoApi(upgrade): NoApi<Upgrade>,
) -> Result<Response, ApiError> {
    let upgrade = limited(upgrade.map_err(no_web_socket)?, MAX_MESSAGE_BYTES);
    Ok(upgrade.on_upgrade(move |socket| session::serve(daemon, socket, peer)))
}

async fn serve(daemon: Arc<Daemon>, mut socket: WebSocket, query: LiveQuery) {
    let mut source = Source::new(Arc::clone(&daemon));
    let mut read_at = Instant::now();
    for message in first_messages(&daemon, &query) {
        if send(&mut socket, message).await.is_err() {
            return;
        }
    }
    loop {
        let message = tokio::select! {
            message = source.next() => message,
            received = receive_after(&mut socket, read_at) => match received {
                Some(Ok(Message::Close(_)) | Err(_)) | None => return,
                Some(Ok(_)) => {
                    read_at = Instant::now() + VIEWER_PAUSE;
                    continue; // nothing is expected of a viewer
                }
            },
        };
        let Some(message) = message else { return };
        if send(&mut socket, message).await.is_err() {
            return;
        }
    }
}

/// The next message of a client, not before a time.
async fn receive_after(
    socket: &mut WebSocket,
    time: Instant,
) -> Option<Result<Message, axum::Error>> {
    tokio::time::sleep_until(time).await;
    socket.recv().await
}

/// What a client gets that was sent before it connected. Each message is made when the client has taken the one before.
fn first_messages(daemon: &Daemon, query: &LiveQuery) -> impl Iterator<Item = Message> + use<> {
    let history = if query.history {
        daemon.live.history()
    } else {
        Vec::new()
    };
    let snapshot = daemon.live.snapshot();
    let events = snapshot.events.into_iter();
    let events = events.map(|event| text(&TextMessage::Event { event: &event }));
    let response = snapshot.response.into_iter();
    let response = response.map(|response| {
        text(&TextMessage::Response {
            response: &response,
        })
    });
    let history = history.into_iter().map(Message::Binary);
    history.chain(events).chain(response)
}

/// Fails when the client is gone, or takes nothing for too long.
async fn send(socket: &mut WebSocket, message: Message) -> Result<(), ()> {
    let sent = tokio::time::timeout(PATIENCE, socket.send(message)).await;
    sent.map_err(drop)?.map_err(drop)
}

fn text(message: &TextMessage<'_>) -> Message {
    // Serialising these types does not fail: their keys are texts.
    Message::Text(serde_json::to_string(message).unwrap_or_default().into())
}

/// What one client is sent.
struct Source {
    daemon: Arc<Daemon>,
    messages: Receiver<LiveMessage>,
    states: Interval,
}

impl Source {
    fn new(daemon: Arc<Daemon>) -> Source {
        let mut states = interval(STATE);
        states.set_missed_tick_behavior(MissedTickBehavior::Delay);
        Source {
            messages: daemon.live.messages(),
            daemon,
            states,
        }
    }

    async fn next(&mut self) -> Option<Message> {
        tokio::select! {
            message = self.messages.recv() => match message {
                Ok(LiveMessage::Samples(bytes)) => Some(Message::Binary(bytes)),
                Ok(LiveMessage::Event(event)) => Some(text(&TextMessage::Event { event: &event })),
                Ok(LiveMessage::Response(response)) => Some(text(&TextMessage::Response { response: &response })),
                Err(RecvError::Lagged(frames)) => Some(text(&TextMessage::Lagged { frames })),
                Err(RecvError::Closed) => None,
            },
            _ = self.states.tick() => {
                let state = Box::new(state(&self.daemon));
                Some(text(&TextMessage::State { state }))
            }
        }
    }
}

/// State and events as server-sent events.
pub async fn events(State(daemon): State<Arc<Daemon>>) -> Response {
    let source = Source::new(daemon);
    let events = stream::unfold(source, |mut source| async {
        loop {
            match source.next().await? {
                Message::Text(text) => {
                    let event = Event::default().data(text.as_str());
                    return Some((Ok::<_, Infallible>(event), source));
                }
                Message::Binary(_) | Message::Ping(_) | Message::Pong(_) | Message::Close(_) => {}
            }
        }
    });
    let events = Sse::new(events).keep_alive(KeepAlive::default());
    events.into_response()
}
