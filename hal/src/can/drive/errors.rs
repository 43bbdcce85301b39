//! Errors while a drive is being opened.

use thiserror::Error;

use super::super::budget::BudgetError;
use super::super::bus::{BusError, NodeInUse};
use super::super::sdo::{Address, SdoError};

/// Why a drive could not be opened. The messages contain value, limit and remedy.
#[derive(Debug, Error)]
#[non_exhaustive]
pub enum OpenError {
    /// An invalid setting.
    #[error("{name} = {value} is invalid; set it to {limit}")]
    Setting {
        /// The setting.
        name: &'static str,
        /// Its value.
        value: String,
        /// The valid values.
        limit: &'static str,
    },
    /// The bus cannot carry the configuration.
    #[error(transparent)]
    Budget(#[from] BudgetError),
    /// Another process uses this node.
    #[error(transparent)]
    NodeInUse(#[from] NodeInUse),
    /// The interface failed.
    #[error(transparent)]
    Bus(#[from] BusError),
    /// A transfer failed.
    #[error(transparent)]
    Sdo(#[from] SdoError),
    /// The drive is not the configured one.
    #[error(
        "{field} of node {node} is 0x{have:08X}, \
         but 0x{want:08X} is configured; connect the configured drive, or correct the configuration"
    )]
    Identity {
        /// The node.
        node: u8,
        /// Vendor, product, revision or serial number.
        field: &'static str,
        /// Value of the drive.
        have: u32,
        /// Configured value.
        want: u32,
    },
    /// The rated current differs from the configuration; all currents would be wrong.
    #[error(
        "the rated current of node {node} (0x6075) is {have_a} A, \
         but {want_a} A is configured; correct the one that is wrong"
    )]
    RatedCurrent {
        /// The node.
        node: u8,
        /// Value of the drive, in amperes.
        have_a: f64,
        /// Configured value, in amperes.
        want_a: f64,
    },
    /// The drive has none of the configured modes.
    #[error(
        "node {node} has none of the configured modes of operation (0x6502 = 0x{supported:08X}, where bit 9 is cyclic synchronous torque, bit 3 profile torque); choose another mode in the configuration, or another drive"
    )]
    Modes {
        /// The node.
        node: u8,
        /// Its supported modes.
        supported: u32,
    },
    /// The drive did not accept the mode.
    #[error(
        "node {node} shows mode of operation {have} (0x6061) after {want} was set (0x6060); check that the motor is configured in the drive"
    )]
    ModeDisplay {
        /// The node.
        node: u8,
        /// The active mode.
        have: i8,
        /// The requested mode.
        want: i8,
    },
    /// The drive did not accept a value.
    #[error(
        "node {node}: object {address} reads back 0x{have:X} after 0x{want:X} was written, so the drive rejects the value; \
         change the setting, or update the firmware of the drive"
    )]
    Verification {
        /// The node.
        node: u8,
        /// The object.
        address: Address,
        /// Value of the drive.
        have: u32,
        /// Written value.
        want: u32,
    },
    /// The drive lacks an object without which it would not stop when this program ends.
    #[error(
        "node {node} cannot be configured to stop when the heartbeat of this program is lost: {}; disconnect the bus to check whether the drive stops without this setting, and if it does, set amplifier.device.on_communication_loss = \"own_reaction\"",
        what(cause)
    )]
    NoStop {
        /// The node.
        node: u8,
        /// Answer of the drive.
        cause: SdoError,
    },
    /// The drive does not become operational.
    #[error(
        "node {node} did not become operational within {timeout_ms} ms after NMT start; check its error register 0x1001"
    )]
    NotOperational {
        /// The node.
        node: u8,
        /// The limit, in milliseconds.
        timeout_ms: u128,
    },
    /// The drive has no timer for its status frames.
    #[error(
        "node {node} has no inhibit time or event timer for its status frames, which an asynchronous exchange needs: {}; choose the synchronous exchange, in which the drive answers SYNC",
        what(cause)
    )]
    NoTimer {
        /// The node.
        node: u8,
        /// Answer of the drive.
        cause: SdoError,
    },
    /// The service thread could not be started.
    #[error(
        "the thread that monitors the drive could not be started: {0}; raise the limit of processes (ulimit -u)"
    )]
    Thread(std::io::Error),
}

/// The text of an error without its remedy, for an error with another one.
fn what(error: &SdoError) -> String {
    let text = error.to_string();
    text.split("; ").next().unwrap_or_default().into()
}
