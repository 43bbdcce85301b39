//! The amplifier, from its interface to what the device reports. The node is claimed during the examination, so that no
//! running bench is disturbed.

use std::fmt::Display;
use std::time::Duration;

use bench_hal::can::bus::{Host, NodeInUse, SocketPort, SystemHost};
use bench_hal::can::drive::{DriveSettings, inspect};
use bench_hal::can::vesc::VescSettings;

use super::can_nodes::{self, BusTraffic};
use super::finding::{Finding, Severity, Subject};
use super::report::Report;
use super::{bus_load, can_interface, drive, vesc};
use bench_config::{AmplifierDevice, AmplifierSettings, LoopSettings};
use bench_rig::devices::Requirements;
use bench_rig::devices::canopen::drive_settings;
use bench_rig::devices::vesc::driver_settings;

/// How long the bus is listened to.
const LISTEN: Duration = Duration::from_millis(300);

pub(super) fn examine(amplifier: &AmplifierSettings, servo: &LoopSettings, report: &mut Report) {
    let requirements = Requirements::new(amplifier, servo);
    match &amplifier.device {
        AmplifierDevice::Simulated(_) => {}
        AmplifierDevice::Canopen(device) => {
            let settings = drive_settings(device, requirements);
            examine_load(bus_load::of_drive(&settings), report);
            if let Some(host) = open_bus(&device.interface, device.bit_rate, report) {
                examine_canopen_drive(&host, &settings, device.maximum_current_ratio, report);
            }
        }
        AmplifierDevice::Vesc(device) => {
            let settings = driver_settings(device, requirements);
            examine_load(bus_load::of_vesc(servo.rate_hz, device.bit_rate), report);
            if let Some(host) = open_bus(&device.interface, device.bit_rate, report) {
                examine_vesc(&host, &settings, device.bit_rate, report);
            }
        }
    }
}

fn examine_load((load, finding): (bus_load::BusLoad, Finding), report: &mut Report) {
    report.figures.bus_load = Some(load);
    report.extend([finding]);
}

/// The bus behind an interface, if it can be used as it is.
fn open_bus(name: &str, bit_rate: u32, report: &mut Report) -> Option<SystemHost<SocketPort>> {
    let findings = can_interface::findings(&can_interface::gather(name, bit_rate));
    let is_usable = findings.iter().all(|f| f.severity < Severity::Failure);
    report.extend(findings);
    if !is_usable {
        return None;
    }
    match SocketPort::open(name, bit_rate) {
        Ok(port) => Some(SystemHost::new(port)),
        Err(error) => {
            report.extend([Subject::CanInterface.refused(&error)]);
            None
        }
    }
}

/// Examines a CANopen drive on a bus: the nodes on the bus, and what the drive reports. The drive is only read.
pub fn examine_canopen_drive(
    host: &dyn Host,
    settings: &DriveSettings,
    maximum_ratio: f64,
    report: &mut Report,
) {
    let node = settings.node;
    let _claim = match host.claim(node) {
        Ok(claim) => claim,
        Err(holder) => return report.extend([in_use(Subject::Drive, &holder)]),
    };
    let Some(traffic) = listen(host, LISTEN, node, settings.bit_rate, report) else {
        return;
    };
    match inspect(host, node, settings.times.sdo_timeout) {
        Ok(inspection) => {
            report.extend(drive::findings(&inspection, settings, maximum_ratio));
            report.figures.drive = Some(drive::figures(&inspection));
        }
        Err(error) => report.extend([no_answer(node, &traffic, &error)]),
    }
}

/// Examines a VESC on a bus, by listening only.
pub fn examine_vesc(host: &dyn Host, settings: &VescSettings, bit_rate: u32, report: &mut Report) {
    let _claim = match host.claim(settings.node) {
        Ok(claim) => claim,
        Err(holder) => return report.extend([in_use(Subject::Vesc, &holder)]),
    };
    let time = LISTEN.max(3 * settings.status_timeout);
    if let Some(traffic) = listen(host, time, settings.node, bit_rate, report) {
        report.extend(vesc::findings(&traffic, settings));
    }
}

fn listen(
    host: &dyn Host,
    time: Duration,
    node: u8,
    bit_rate: u32,
    report: &mut Report,
) -> Option<BusTraffic> {
    match can_nodes::listen(host, time) {
        Ok(traffic) => {
            report.extend(can_nodes::findings(&traffic, node, bit_rate));
            report.figures.bus = Some(traffic.figures(bit_rate));
            Some(traffic)
        }
        Err(error) => {
            report.extend([Subject::CanNodes.refused(&error)]);
            None
        }
    }
}

fn in_use(subject: Subject, holder: &NodeInUse) -> Finding {
    let node = holder.node;
    let (holder, remedy) = match holder.pid {
        None => ("another process".into(), "end it first".into()),
        Some(pid) => (
            format!("process {pid}"),
            format!("wait for its end, or end it: `kill {pid}` stops a run with zero current"),
        ),
    };
    let what = format!("node {node} is used by {holder}; nothing was sent to it");
    subject.failure(what, remedy)
}

/// A stopped node sends heartbeats, but does not answer to SDO.
fn no_answer(node: u8, traffic: &BusTraffic, error: &impl Display) -> Finding {
    let finding = Subject::Drive.refused(error);
    let Some(state) = traffic.nodes.get(&node) else {
        return finding;
    };
    let state = can_nodes::state_name(*state);
    Subject::Drive.failure(
        format!("{}; its heartbeat reports {state}", finding.what),
        "a stopped node does not answer: switch its supply off and on, or let its NMT master start it",
    )
}
