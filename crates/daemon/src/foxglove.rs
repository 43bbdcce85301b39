//! A server for Foxglove and Lichtblick: the channels of the recordings, as the loop goes on. Viewers cannot change anything.

use std::net::SocketAddr;
use std::sync::Arc;

use foxglove::{
    ChannelBuilder, Context, PartialMetadata, RawChannel, Schema, WebSocketServerHandle,
};
use tokio::runtime::Handle;

use super::live::hub::Viewer;
use bench_recording::{EncodedMessage, Topic, descriptor_set};

/// Messages that a slow viewer may be behind; then the oldest ones are left out for it. 3 s at 5 kHz.
const BACKLOG: usize = 16_384;

/// The server. It serves until it is dropped.
pub struct FoxgloveServer {
    // Channels belong to the context as long as it exists.
    _context: Arc<Context>,
    channels: [Arc<RawChannel>; Topic::ALL.len()],
    server: Option<WebSocketServerHandle>,
    address: SocketAddr,
}

/// A server that cannot start.
#[derive(Debug, thiserror::Error)]
#[error(transparent)]
pub struct FoxgloveError(#[from] foxglove::FoxgloveError);

impl FoxgloveServer {
    /// Listens at an address; with port 0 at a free one.
    ///
    /// # Errors
    /// When the address cannot be used.
    pub async fn start(address: SocketAddr) -> Result<FoxgloveServer, FoxgloveError> {
        let context = Context::new();
        let [first, second, third] = Topic::ALL.map(|topic| channel(&context, topic));
        let channels = [first?, second?, third?];
        let server = context
            .websocket_server()
            .name("bench")
            .bind(address.ip().to_string(), address.port())
            .message_backlog_size(BACKLOG)
            .tokio_runtime(&Handle::current())
            .start()
            .await?;
        let address = SocketAddr::new(address.ip(), server.port());
        Ok(FoxgloveServer {
            _context: context,
            channels,
            server: Some(server),
            address,
        })
    }

    /// Where it listens.
    pub fn address(&self) -> SocketAddr {
        self.address
    }
}

/// The channel of a topic, as in a recording.
fn channel(context: &Arc<Context>, topic: Topic) -> Result<Arc<RawChannel>, FoxgloveError> {
    let schema = Schema::new(topic.schema_name(), "protobuf", descriptor_set());
    let channel = ChannelBuilder::new(topic.name())
        .context(context)
        .message_encoding("protobuf")
        .schema(schema)
        .build_raw()?;
    Ok(channel)
}

impl Viewer for FoxgloveServer {
    fn show(&self, message: &EncodedMessage) {
        let time = PartialMetadata {
            log_time: Some(message.log_ns),
        };
        self.channels[message.topic as usize].log_with_meta(&message.bytes, time);
    }
}

impl Drop for FoxgloveServer {
    fn drop(&mut self) {
        if let Some(server) = self.server.take() {
            let _ = server.stop(); // its clients are not waited for
        }
    }
}
