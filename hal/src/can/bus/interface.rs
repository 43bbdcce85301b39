//! The state of a CAN interface, read from the kernel by netlink.

use socketcan::CanInterface;
use socketcan::nl::{CanState, InterfaceDetails};
use thiserror::Error;

/// State of an interface.
#[derive(Clone, Debug, Default, PartialEq, Eq)]
pub struct Interface {
    /// Whether it is up.
    pub is_up: bool,
    /// Bit rate in bit/s; `None` for a virtual interface, which has none.
    pub bit_rate: Option<u32>,
    /// Name of the state of the controller; `None` for a virtual interface.
    pub state: Option<&'static str>,
    /// Whether the controller takes part in the bus (error active or warning); true for a virtual interface.
    pub is_healthy: bool,
    /// Transmit and receive error counters, if the controller reports them.
    pub error_counters: Option<(u16, u16)>,
    /// Time after which the kernel restarts a controller in bus-off, in milliseconds; 0 is never.
    pub restart_ms: Option<u32>,
}

/// The state of the interface could not be read.
#[derive(Debug, Error)]
#[error(
    "CAN interface {name}: {cause}; choose an interface from the list of `ip link show type can`"
)]
pub struct InterfaceError {
    /// The name of the interface.
    pub name: String,
    /// The message of the system.
    pub cause: String,
}

impl Interface {
    /// Reads the state of interface `name`.
    pub fn read(name: &str) -> Result<Interface, InterfaceError> {
        let details = details(name).map_err(|cause| InterfaceError {
            name: name.to_owned(),
            cause,
        })?;
        let can = details.can;
        Ok(Interface {
            is_up: details.is_up,
            bit_rate: can.bit_timing.map(|timing| timing.bitrate),
            state: can.state.map(state_name),
            is_healthy: can.state.is_none_or(is_healthy),
            error_counters: can.berr_counter.map(|count| (count.txerr, count.rxerr)),
            restart_ms: can.restart_ms,
        })
    }
}

fn details(name: &str) -> Result<InterfaceDetails, String> {
    let interface = CanInterface::open(name).map_err(|error| error.to_string())?;
    if is_can(name) {
        interface.details().map_err(|error| error.to_string())
    } else {
        Err("this is another kind of network interface".into())
    }
}

fn is_healthy(state: CanState) -> bool {
    matches!(state, CanState::ErrorActive | CanState::ErrorWarning)
}

/// Whether the hardware type of the interface is CAN, ARPHRD_CAN of `linux/if_arp.h`.
fn is_can(name: &str) -> bool {
    let kind = std::fs::read_to_string(format!("/sys/class/net/{name}/type"));
    kind.is_ok_and(|kind| kind.trim() == "280")
}

fn state_name(state: CanState) -> &'static str {
    match state {
        CanState::ErrorActive => "error active",
        CanState::ErrorWarning => "error warning",
        CanState::ErrorPassive => "error passive",
        CanState::BusOff => "bus off",
        CanState::Stopped => "stopped",
        CanState::Sleeping => "sleeping",
    }
}
