//! Warnings of the owner's thread, for the operator who ordered the run.

use std::cell::RefCell;
use std::fmt;

use tokio::sync::mpsc::UnboundedSender;
use tracing::field::{Field, Visit};
use tracing::{Event, Level, Subscriber};
use tracing_subscriber::Layer;
use tracing_subscriber::layer::Context;

thread_local! {
    static RECEIVER: RefCell<Option<UnboundedSender<String>>> = const { RefCell::new(None) };
}

/// Copies the warnings of this thread, until it is dropped.
pub struct WarningCopy;

/// Copies the warnings of this thread to `receiver` too.
pub fn copy_warnings(receiver: UnboundedSender<String>) -> WarningCopy {
    RECEIVER.set(Some(receiver));
    WarningCopy
}

impl Drop for WarningCopy {
    fn drop(&mut self) {
        RECEIVER.set(None);
    }
}

/// The layer of the log that makes the copies.
pub struct WarningCopies;

impl<S: Subscriber> Layer<S> for WarningCopies {
    fn on_event(&self, event: &Event<'_>, _context: Context<'_, S>) {
        if *event.metadata().level() != Level::WARN {
            return;
        }
        RECEIVER.with_borrow(|receiver| {
            if let Some(receiver) = receiver {
                let mut message = Message::default();
                event.record(&mut message);
                let _ = receiver.send(message.0); // without a receiver the client is disconnected
            }
        });
    }
}

/// The text of an event.
#[derive(Default)]
struct Message(String);

impl Visit for Message {
    fn record_debug(&mut self, field: &Field, value: &dyn fmt::Debug) {
        if field.name() == "message" {
            self.0 = format!("{value:?}");
        }
    }
}
