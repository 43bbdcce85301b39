//! Creates the recording of a run, with everything that is known before its first tick.

use std::collections::BTreeMap;
use std::path::Path;
use std::time::SystemTime;

use super::file_name;
use crate::errors::RunError;
use crate::plan::{KIND, MOTOR_KNOWN_FROM, MOTOR_THERMAL, OVERRIDE, Plan};
use bench_base::timestamp;
use bench_recording::{
    Header, MIN_FREE_BYTES, Recorder, RecordingError, lacks_space, predicted_bytes,
};
use bench_rt::thread::{Pace, Scheduling};

/// Creates the recording, with everything that is known before the first tick.
pub(super) fn create_recording(
    plan: &Plan,
    metadata: BTreeMap<String, String>,
    folder: &Path,
) -> Result<Recorder, RunError> {
    let header = Header {
        config_toml: plan.config_toml()?,
        period_s: plan.config.servo.period_s(),
        started_ns: timestamp::unix_ns(SystemTime::now()),
        metadata,
    };
    create_folder(folder)?;
    let mut recorder = create_under_free_name(folder, &plan.label(), &header)?;
    for (name, media_type, text) in plan.attachments()? {
        let attached = recorder.attach(name, media_type, text.as_bytes());
        attached.map_err(RunError::Create)?;
    }
    if let Some(reason) = &plan.override_reason {
        let noted = recorder.note_override(&reason.to_string());
        noted.map_err(RunError::Create)?;
    }
    Ok(recorder)
}

/// Another process may take a free name before this one does: then the next free name is used.
fn create_under_free_name(
    folder: &Path,
    label: &str,
    header: &Header,
) -> Result<Recorder, RunError> {
    let now = SystemTime::now();
    loop {
        let path = file_name::recording(folder, label, now);
        match Recorder::create(&path, header) {
            Err(RecordingError::Exists { .. }) if path.exists() => {}
            created => return created.map_err(RunError::Create),
        }
    }
}

fn create_folder(folder: &Path) -> Result<(), RunError> {
    std::fs::create_dir_all(folder).map_err(|e| RunError::Folder {
        folder: folder.into(),
        why: e.to_string(),
    })
}

pub(super) fn metadata(
    plan: &Plan,
    pace: Pace,
    scheduling: &Scheduling,
) -> BTreeMap<String, String> {
    let pairs = [
        (KIND, plan.kind.name().to_string()),
        ("program", format!("bench {}", env!("CARGO_PKG_VERSION"))),
        ("started", timestamp::milliseconds(SystemTime::now())),
        ("host", kernel_parameter("hostname")),
        ("kernel", kernel_parameter("osrelease")),
        ("pace", pace.name().into()),
        (MOTOR_THERMAL, plan.motor.thermal_a2.to_string()),
        (MOTOR_KNOWN_FROM, plan.motor.known_from.clone()),
    ];
    let devices = plan.devices.iter().cloned();
    let reason = plan.override_reason.as_ref();
    let reason = reason.map(|reason| (OVERRIDE, reason.to_string()));
    let devices = devices.chain(reason);
    let pairs = pairs.into_iter().chain(of_scheduling(scheduling));
    let pairs = pairs.chain(devices);
    let pairs = pairs.map(|(key, value)| (key.to_string(), value));
    pairs.chain(plan.description.metadata()).collect()
}

fn of_scheduling(scheduling: &Scheduling) -> [(&'static str, String); 5] {
    let cpu = scheduling.cpu.map_or("any".into(), |cpu| cpu.to_string());
    [
        ("policy", scheduling.policy.clone()),
        ("memory_locked", scheduling.memory_locked.to_string()),
        ("idle_states_off", scheduling.idle_states_off.to_string()),
        ("cpu", cpu),
        ("refused", scheduling.refused.join("\n")),
    ]
}

fn kernel_parameter(name: &str) -> String {
    let text = std::fs::read_to_string(Path::new("/proc/sys/kernel").join(name));
    text.map_or("unknown".into(), |text| text.trim().to_string())
}

/// Refuses a run whose recording might fill the disk.
pub(super) fn require_space(folder: &Path, bytes: u64, free: Option<u64>) -> Result<(), RunError> {
    if !lacks_space(free, bytes.saturating_add(MIN_FREE_BYTES)) {
        return Ok(());
    }
    Err(RunError::Space {
        folder: folder.into(),
        free_bytes: free.unwrap_or_default(),
        needed_bytes: bytes,
    })
}

/// Upper limit of the size of the recording: the program, both ramps at its end, and the ticks after it.
pub(super) fn recording_bytes(program_ticks: u64, ramp_ticks: u64, tail_ticks: u64) -> u64 {
    let after_ticks = ramp_ticks.saturating_mul(2).saturating_add(tail_ticks);
    predicted_bytes(program_ticks.saturating_add(after_ticks))
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn refuses_a_run_that_leaves_less_than_100_megabytes_free() {
        let folder = Path::new("somewhere");
        let free = |free_bytes| require_space(folder, 72_000_000, free_bytes);
        assert!(free(Some(172_000_000)).is_ok());
        assert!(free(None).is_ok(), "unknown");
        let refused = free(Some(171_999_999)).unwrap_err().to_string();
        for part in ["somewhere", "172.0 MB", "72.0 MB", "100 MB", "--out"] {
            assert!(refused.contains(part), "{part}: {refused}");
        }
        assert!(require_space(folder, u64::MAX, Some(u64::MAX - 1)).is_err());
    }
}
