//! Metrics in the text format of Prometheus [Prometheus, "Text-based format"]. All values are counted elsewhere; this is their text.

use std::fmt::{Display, Write};
use std::time::Duration;

use super::live::status::EDGES_US;
use super::shared::Daemon;
use bench_recording::free_bytes;
use bench_rig::devices::{CanAmplifier, can_amplifier};
use bench_rt::arming::State;

/// Time in which the folder of the recordings answers.
const FOLDER_TIME: Duration = Duration::from_secs(2);
/// The media type of the text.
pub const MEDIA_TYPE: &str = "text/plain; version=0.0.4; charset=utf-8";

/// All states, for a metric with one series for each.
const STATES: [State; 6] = [
    State::Disarmed,
    State::Enabling,
    State::Armed,
    State::Running,
    State::Settling,
    State::Tripped,
];

/// The text being written.
#[derive(Default)]
struct Exposition(String);

impl Exposition {
    /// Begins a metric.
    fn begin(&mut self, name: &str, kind: &str, help: &str) {
        // Writing to a text does not fail.
        let _ = writeln!(self.0, "# HELP {name} {help}\n# TYPE {name} {kind}");
    }

    fn value(&mut self, name: &str, labels: &str, value: impl Display) {
        let _ = if labels.is_empty() {
            writeln!(self.0, "{name} {value}")
        } else {
            writeln!(self.0, "{name}{{{labels}}} {value}")
        };
    }

    fn counter(&mut self, name: &str, help: &str, value: u64) {
        self.begin(name, "counter", help);
        self.value(name, "", value);
    }

    fn gauge(&mut self, name: &str, help: &str, value: impl Display) {
        self.begin(name, "gauge", help);
        self.value(name, "", value);
    }
}

/// The metrics at this moment.
pub async fn text(daemon: &Daemon) -> String {
    let mut out = Exposition::default();
    let version = format!("version=\"{}\"", env!("CARGO_PKG_VERSION"));
    out.begin("bench_build_info", "gauge", "Version of the daemon.");
    out.value("bench_build_info", &version, 1);
    write_loop(&mut out, daemon);
    write_devices(&mut out, daemon);
    write_runs(&mut out, daemon);
    let is_held = daemon.read(|schedule| schedule.hold().is_some());
    out.gauge(
        "bench_held",
        "1 while nothing begins after a stop or a trip, until an operator resumes.",
        u8::from(is_held),
    );
    let defect = daemon.owner.recording_defect();
    out.gauge(
        "bench_recording_defect",
        "1 if the run in progress, or the last one, cannot be recorded.",
        u8::from(defect.is_some()),
    );
    let folder = daemon.recordings.clone();
    // Without an answer of the folder the metric is left out.
    let free = daemon.files.run(move || free_bytes(&folder));
    if let Ok(Ok(Some(bytes))) = tokio::time::timeout(FOLDER_TIME, free).await {
        let help = "Free space in the folder of the recordings.";
        out.gauge("bench_recording_free_bytes", help, bytes);
    }
    out.0
}

fn write_loop(out: &mut Exposition, daemon: &Daemon) {
    let live = daemon.live.snapshot();
    let servo = &live.servo;
    out.begin(
        "bench_loop_state",
        "gauge",
        "1 for the present state of the loop.",
    );
    for state in STATES {
        let label = format!("state=\"{}\"", state.name());
        out.value(
            "bench_loop_state",
            &label,
            u8::from(state.name() == servo.state),
        );
    }
    out.counter("bench_ticks_total", "Ticks of the loop.", servo.ticks);
    out.counter(
        "bench_overruns_total",
        "Ticks that were not served.",
        servo.overruns,
    );
    out.counter(
        "bench_lost_records_total",
        "Records that did not fit into the ring to the recorder.",
        servo.lost_records,
    );
    out.counter(
        "bench_live_dropped_total",
        "Messages that the live view did not take; recordings have them.",
        servo.live_dropped,
    );
    out.begin(
        "bench_tick_lateness_seconds",
        "histogram",
        "Start of each tick after its scheduled time.",
    );
    let mut below = 0;
    for (edge_us, count) in EDGES_US.iter().zip(live.lateness.counts) {
        below += count;
        let label = format!("le=\"{}\"", edge_us * 1e-6);
        out.value("bench_tick_lateness_seconds_bucket", &label, below);
    }
    out.value(
        "bench_tick_lateness_seconds_bucket",
        "le=\"+Inf\"",
        servo.ticks,
    );
    out.value(
        "bench_tick_lateness_seconds_sum",
        "",
        live.lateness.sum_ns as f64 * 1e-9,
    );
    out.value("bench_tick_lateness_seconds_count", "", servo.ticks);
    out.begin("bench_trips_total", "counter", "Trips of the interlocks.");
    for (reason, count) in &live.trips {
        out.value("bench_trips_total", &format!("reason=\"{reason}\""), count);
    }
    for (share, name, help) in [
        (
            "motor_heat",
            "bench_motor_heat_ratio",
            "Heating current of the motor as a share of its interlock.",
        ),
        (
            "travel",
            "bench_travel_ratio",
            "Travel as a share of its interlock.",
        ),
    ] {
        let found = live.shares.iter().find(|other| other.name == share);
        out.gauge(name, help, found.map_or(0.0, |found| found.share));
    }
}

/// Errors of the connections to the devices; nothing on a simulated stage.
fn write_devices(out: &mut Exposition, daemon: &Daemon) {
    let amplifier = &daemon.configuration().config.amplifier.device;
    let address = can_amplifier(amplifier).map(CanAmplifier::address);
    if let Some(errors) = address.and_then(|can| interface_errors(can.interface)) {
        let help = "Errors of the CAN interface, received and sent, as the kernel counts them.";
        out.counter("bench_bus_errors_total", help, errors);
    }
    if let Some(serial) = daemon.owner.status().serial {
        let counts = serial.statistics();
        let errors = counts.damaged_bytes + counts.timeouts + counts.faults + counts.restarts;
        let help = "Damaged bytes, missing answers, faults and restarts of the probe.";
        out.counter("bench_serial_errors_total", help, errors);
    }
}

/// Errors that the kernel has counted [Linux, Documentation/ABI/testing/sysfs-class-net-statistics]; `None` without the interface.
fn interface_errors(interface: &str) -> Option<u64> {
    if interface.contains('/') {
        return None;
    }
    let count = |name: &str| -> Option<u64> {
        let path = format!("/sys/class/net/{interface}/statistics/{name}");
        std::fs::read_to_string(path).ok()?.trim().parse().ok()
    };
    Some(count("rx_errors")? + count("tx_errors")?)
}

fn write_runs(out: &mut Exposition, daemon: &Daemon) {
    out.begin("bench_runs_total", "counter", "Commands that have ended.");
    for ((command, outcome), count) in daemon.read(|schedule| schedule.ended().clone()) {
        let labels = format!(
            "command=\"{}\",outcome=\"{}\"",
            command.name(),
            outcome.name()
        );
        out.value("bench_runs_total", &labels, count);
    }
    out.begin(
        "bench_frf_verdicts_total",
        "counter",
        "Verdicts about CNMP zeros.",
    );
    for (verdict, count) in daemon.verdicts() {
        out.value(
            "bench_frf_verdicts_total",
            &format!("verdict=\"{verdict}\""),
            count,
        );
    }
}

#[cfg(test)]
mod tests {
    use super::interface_errors;

    #[test]
    fn an_interface_has_errors_and_an_absent_one_has_none() {
        assert!(interface_errors("lo").is_some());
        assert_eq!(interface_errors("none0"), None);
        assert_eq!(interface_errors("../../lo"), None);
    }
}
