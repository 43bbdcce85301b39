//! Why a drive could not be opened.

use thiserror::Error;

use super::super::budget::BudgetError;
use super::super::bus::{BusError, NodeInUse};
use super::super::sdo::{Address, SdoError};

/// Why a drive could not be opened: value, limit and next step.
#[derive(Debug, Error)]
pub enum OpenError {
    /// A setting that cannot be.
    #[error("{name} = {value} cannot be: {limit}")]
    Setting {
        /// The setting.
        name: &'static str,
        /// Its value.
        value: String,
        /// What could be.
        limit: &'static str,
    },
    /// The bus cannot carry the configuration.
    #[error(transparent)]
    Budget(#[from] BudgetError),
    /// Another process drives this node.
    #[error(transparent)]
    NodeInUse(#[from] NodeInUse),
    /// The interface failed.
    #[error(transparent)]
    Bus(#[from] BusError),
    /// A transfer failed.
    #[error(transparent)]
    Sdo(#[from] SdoError),
    /// Another drive than configured.
    #[error(
        "{field} of node {node} is 0x{have:08X}, the configuration says 0x{want:08X}: this is another drive, or the configuration is another's"
    )]
    Identity {
        /// The node.
        node: u8,
        /// Vendor, product, revision or serial number.
        field: &'static str,
        /// What the drive says.
        have: u32,
        /// What is configured.
        want: u32,
    },
    /// Another rated current than configured: every ampere would be wrong.
    #[error(
        "the rated current of node {node} (0x6075) is {have_a} A, the configuration says {want_a} A; correct whichever is wrong"
    )]
    RatedCurrent {
        /// The node.
        node: u8,
        /// What the drive says, in amperes.
        have_a: f64,
        /// What is configured, in amperes.
        want_a: f64,
    },
    /// The drive missing_objects the mode.
    #[error(
        "node {node} has none of the configured modes of operation (0x6502 = 0x{supported:08X}; bit 9 is cyclic synchronous torque, bit 3 profile torque)"
    )]
    Modes {
        /// The node.
        node: u8,
        /// Its supported modes.
        supported: u32,
    },
    /// The drive does not take the mode.
    #[error(
        "node {node} shows mode of operation {have} (0x6061) after {want} was set (0x6060); check that the drive's motor is configured"
    )]
    ModeDisplay {
        /// The node.
        node: u8,
        /// What it shows.
        have: i8,
        /// What was set.
        want: i8,
    },
    /// The drive did not keep what was written.
    #[error(
        "node {node} keeps 0x{have:X} in {address} after 0x{want:X} was written; its firmware does not allow this configuration"
    )]
    Verification {
        /// The node.
        node: u8,
        /// Where.
        address: Address,
        /// What it has.
        have: u32,
        /// What was written.
        want: u32,
    },
    /// The drive missing_objects an object without which it would not stop when this program dies.
    #[error(
        "node {node} cannot be told to stop when it no longer hears us: {cause}; with abort_connection unset its own reaction is trusted: prove it by unplugging the bus"
    )]
    NoStop {
        /// The node.
        node: u8,
        /// What the drive said.
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
    /// The drive cannot pace its status frames by itself.
    #[error(
        "node {node} has no inhibit time or event timer for its status frames, which an asynchronous exchange needs: {cause}; choose the synchronous exchange, in which the drive answers SYNC"
    )]
    NoTimer {
        /// The node.
        node: u8,
        /// What the drive said.
        cause: SdoError,
    },
    /// The service thread could not be started.
    #[error("the thread that watches the drive could not be started: {0}")]
    Thread(std::io::Error),
}
