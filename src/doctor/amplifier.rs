//! The amplifier, from the interface to what the device says. The node is claimed first, so that no running bench is
//! disturbed, and free again afterwards.

use std::time::Duration;

use bench_hal::can::bus::{Host, NodeInUse, SocketPort, SystemHost};
use bench_hal::can::drive::{DriveSettings, inspect};
use bench_hal::can::vesc::VescSettings;

use super::can_interface;
use super::can_nodes::{self, Heard};
use super::finding::{Finding, Severity};
use super::report::Report;
use super::{bus_load, drive, vesc};
use crate::config::{AmplifierDevice, Config};
use crate::rig::devices::amplifier::{drive_settings, vesc_settings};

/// How long the bus is listened to.
const LISTEN: Duration = Duration::from_millis(300);

pub(super) fn examine(config: &Config, report: &mut Report) {
    match &config.amplifier.device {
        AmplifierDevice::Simulated(_) => {}
        AmplifierDevice::Canopen(device) => {
            let settings = drive_settings(device, config);
            let (load, finding) = bus_load::of_drive(&settings);
            report.figures.bus_load = Some(load);
            report.find([finding]);
            let Some(host) = interface(&device.interface, device.bit_rate, report) else {
                return;
            };
            examine_canopen_drive(&host, &settings, device.maximum_current_ratio, report);
        }
        AmplifierDevice::Vesc(device) => {
            let (load, finding) = bus_load::of_vesc(config.servo.rate_hz, device.bit_rate);
            report.figures.bus_load = Some(load);
            report.find([finding]);
            let Some(host) = interface(&device.interface, device.bit_rate, report) else {
                return;
            };
            watch(
                &host,
                &vesc_settings(device, config),
                device.bit_rate,
                report,
            );
        }
    }
}

/// The bus behind an interface, if it can be used as it is.
fn interface(name: &str, bit_rate: u32, report: &mut Report) -> Option<SystemHost<SocketPort>> {
    let found = can_interface::findings(&can_interface::gather(name, bit_rate));
    let is_usable = found
        .iter()
        .all(|finding| finding.verdict < Severity::Failure);
    report.find(found);
    if !is_usable {
        return None;
    }
    let opened = SocketPort::open(name, bit_rate);
    opened
        .map(SystemHost::new)
        .map_err(|error| report.find([Finding::refused("CAN interface", &error)]))
        .ok()
}

/// A CANopen drive on a bus: who is there, and what the drive says of itself. Read only.
pub fn examine_canopen_drive(
    host: &dyn Host,
    settings: &DriveSettings,
    maximum_ratio: f64,
    report: &mut Report,
) {
    let node = settings.node;
    let _claim = match host.claim(node) {
        Ok(claim) => claim,
        Err(other) => return report.find([held("drive", other)]),
    };
    let Some(heard) = listen(host, LISTEN, node, settings.bit_rate, report) else {
        return;
    };
    match inspect(host, node, settings.sdo_timeout) {
        Ok(seen) => {
            report.find(drive::findings(&seen, settings, maximum_ratio));
            report.figures.drive = Some(drive::figures(&seen));
        }
        Err(error) => report.find([silent(node, &heard, &error)]),
    }
}

/// A VESC on a bus: listening only.
pub fn watch(host: &dyn Host, settings: &VescSettings, bit_rate: u32, report: &mut Report) {
    let _claim = match host.claim(settings.node) {
        Ok(claim) => claim,
        Err(other) => return report.find([held("VESC", other)]),
    };
    let time = LISTEN.max(3 * settings.status_timeout);
    let Some(heard) = listen(host, time, settings.node, bit_rate, report) else {
        return;
    };
    report.find(vesc::findings(&heard, settings));
}

fn listen(
    host: &dyn Host,
    time: Duration,
    node: u8,
    bit_rate: u32,
    report: &mut Report,
) -> Option<Heard> {
    match can_nodes::listen(host, time) {
        Ok(heard) => {
            report.find(can_nodes::findings(&heard, node, bit_rate));
            report.figures.bus = Some(heard.figures(bit_rate));
            Some(heard)
        }
        Err(error) => {
            report.find([Finding::refused("CAN nodes", &error)]);
            None
        }
    }
}

fn held(subject: &'static str, NodeInUse { node, pid }: NodeInUse) -> Finding {
    let (who, remedy) = match pid {
        None => ("another process".into(), "end it first".into()),
        Some(pid) => (
            format!("process {pid}"),
            format!("wait for its end, or end it: a run stops with zero current on `kill {pid}`"),
        ),
    };
    Finding::failure(
        subject,
        format!("node {node} is held by {who}; it was not asked anything"),
        remedy,
    )
}

/// A node that is heard and does not answer may be stopped: then it serves no SDO.
fn silent(node: u8, heard: &Heard, error: &impl std::fmt::Display) -> Finding {
    let finding = Finding::refused("drive", error);
    match heard.nodes.get(&node) {
        Some(state) => {
            let what = format!(
                "{}; its heartbeat says {}",
                finding.what,
                can_nodes::words(*state)
            );
            let remedy = "a stopped node answers nothing: switch its supply off and on, or let its NMT master start it";
            Finding::failure("drive", what, remedy)
        }
        None => finding,
    }
}
