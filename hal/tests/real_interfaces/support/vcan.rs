//! A virtual CAN interface for one test.

use std::sync::atomic::{AtomicU32, Ordering};

use bench_hal::can::drive::DriveSettings;
use socketcan::CanInterface;

use super::{Rig, host, settings};

static COUNT: AtomicU32 = AtomicU32::new(0);

/// An interface with a unique name, deleted on drop.
pub struct Vcan {
    pub name: String,
    interface: Option<CanInterface>,
}

impl Vcan {
    /// A new interface that is down.
    pub fn down() -> Vcan {
        Vcan::named(format!("vcan{}", COUNT.fetch_add(1, Ordering::Relaxed)))
    }

    pub fn up() -> Vcan {
        let vcan = Vcan::down();
        vcan.set_up(true);
        vcan
    }

    fn named(name: String) -> Vcan {
        let interface = CanInterface::create_vcan(&name, None)
            .expect("root, and a kernel with vcan: use .ci/vm/check");
        Vcan {
            name,
            interface: Some(interface),
        }
    }

    /// `ip link set IFACE up`, or down.
    pub fn set_up(&self, is_up: bool) {
        let interface = self.interface.as_ref().unwrap();
        if is_up {
            interface.bring_up()
        } else {
            interface.bring_down()
        }
        .unwrap();
    }

    /// `ip link del`: the adapter is pulled out.
    pub fn unplug(&mut self) {
        self.interface
            .take()
            .unwrap()
            .delete()
            .map_err(|(_, error)| error)
            .unwrap();
    }

    /// The adapter is plugged in again and has the same name.
    pub fn plug_in(&mut self) {
        *self = Vcan::named(self.name.clone());
        self.set_up(true);
    }

    /// Driver and simulated drive on this interface, disabled.
    pub fn rig(&self, settings: DriveSettings) -> Rig {
        Rig::new(&self.name, &host(&self.name), settings)
    }

    /// Driver and simulated drive, enabled at 1 A.
    pub fn running(&self) -> Rig {
        self.rig(settings()).enabled()
    }
}

impl Drop for Vcan {
    fn drop(&mut self) {
        if let Some(interface) = self.interface.take() {
            let _ = interface.delete();
        }
    }
}
