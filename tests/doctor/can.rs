//! Drives on a bus in memory: the findings, and that only uploads are sent.

use std::sync::{Arc, Mutex};
use std::time::Duration;

use bench::doctor::{Finding, Report, Severity, examine_canopen_drive, examine_vesc};
use bench_hal::can::bus::{
    BusError, BusEvent, CanBus, Claim, Host, NodeInUse, Port, SimulatedHost, Task, TaskHandle,
};
use bench_hal::can::cia402::State;
use bench_hal::can::drive::{CanopenDrive, DriveSettings};
use bench_hal::can::emulator::{
    AmplifierTask, DeviceFault, EmulatedAmplifier, EmulatedDrive, EmulatedDriveSettings,
};
use bench_hal::can::frame::{CanFrame, Id};
use bench_hal::can::vesc::{VescSettings, status_id};
use bench_hal::can::{nmt, sdo};

/// A host with a drive that has just started.
fn rig(settings: EmulatedDriveSettings) -> (SimulatedHost, Arc<Mutex<EmulatedDrive>>, TaskHandle) {
    let host = SimulatedHost::default();
    let device = Arc::new(Mutex::new(EmulatedDrive::new(settings)));
    let running = AmplifierTask::start(&host, Arc::clone(&device)).unwrap();
    host.sleep(Duration::from_millis(5));
    (host, device, running)
}

fn examine(host: &dyn Host) -> Report {
    let mut report = Report::default();
    examine_canopen_drive(host, &DriveSettings::default(), 1.5, &mut report);
    report
}

fn problems(report: &Report) -> Vec<&Finding> {
    report
        .findings
        .iter()
        .filter(|finding| finding.severity > Severity::Note)
        .collect()
}

/// All frames on the bus, received at an endpoint opened beforehand.
fn received_frames(listener: &mut dyn CanBus) -> Vec<CanFrame> {
    let next = || listener.receive(Duration::ZERO).unwrap();
    let frames = std::iter::from_fn(next).map(|event| match event {
        BusEvent::Frame(frame) => Some(frame),
        BusEvent::Condition(_) => None,
    });
    frames.flatten().collect()
}

#[test]
fn healthy_drive_is_ok_and_examined_by_uploads_only() {
    let (host, device, _running) = rig(EmulatedDriveSettings::default());
    let mut listener = host.bus().connect(&[]);
    let objects = format!("{:?}", device.lock().unwrap().objects());
    let report = examine(&host);
    assert!(problems(&report).is_empty(), "{:?}", report.findings);
    assert_eq!(
        report.figures.drive.as_ref().unwrap().rated_current_a,
        Some(4.0)
    );
    let device = device.lock().unwrap();
    assert_eq!(
        format!("{:?}", device.objects()),
        objects,
        "an object was written"
    );
    assert_eq!(
        (device.power_state(), device.nmt_state()),
        (State::SwitchOnDisabled, nmt::State::PreOperational)
    );
    for frame in received_frames(&mut listener) {
        // CiA 301: 2 initiates an upload, 3 asks for its next segment.
        let is_upload =
            frame.id() == sdo::request_id(5) && [2, 3].contains(&(frame.data()[0] >> 5));
        assert!(is_upload || frame.id() == sdo::answer_id(5), "{frame:?}");
    }
}

#[test]
fn running_drive_is_not_changed() {
    let (host, device, _running) = rig(EmulatedDriveSettings::default());
    let mut drive = CanopenDrive::open(DriveSettings::default(), Box::new(host.clone())).unwrap();
    bench_hal::blocking::enable(&mut drive, |time| host.sleep(time)).unwrap();
    bench_hal::CurrentAmplifier::command(&mut drive, 0.0).unwrap();
    let mut report = Report::default();
    // A bus in memory has no claims, so this drive looks like one of another program without a claim.
    examine_canopen_drive(&host, &DriveSettings::default(), 1.5, &mut report);
    assert!(
        report
            .findings
            .iter()
            .all(|finding| finding.severity < Severity::Failure),
        "{:?}",
        report.findings
    );
    assert_eq!(device.lock().unwrap().nmt_state(), nmt::State::Operational);
}

#[test]
fn drive_fault_is_a_failure_with_the_emergency_text() {
    let (host, device, _running) = rig(EmulatedDriveSettings::default());
    device.lock().unwrap().inject(DeviceFault::Drive(0x4210));
    let report = examine(&host);
    let words: Vec<&str> = problems(&report)
        .iter()
        .map(|finding| finding.what.as_str())
        .collect();
    assert_eq!(words.len(), 2, "{words:?}");
    assert_eq!(words[0], "node 5 sent emergency 0x4210: drive too hot");
    assert!(
        words[1].starts_with("state FAULT (statusword 0x"),
        "{words:?}"
    );
    assert_eq!(problems(&report)[1].severity, Severity::Failure);
    assert_eq!(
        device.lock().unwrap().power_state(),
        State::Fault,
        "the examination must not clear the fault"
    );
}

#[test]
fn rejects_drive_with_unexpected_rated_current() {
    let (host, _device, _running) = rig(EmulatedDriveSettings {
        rated_current_ma: 2000,
        ..EmulatedDriveSettings::default()
    });
    let report = examine(&host);
    assert_eq!(problems(&report).len(), 1);
    assert!(
        problems(&report)[0]
            .what
            .contains("is 2 A, but 4 A is configured"),
        "{report:?}"
    );
}

#[test]
fn silent_drive_is_a_failure_with_remedy() {
    let report = examine(&SimulatedHost::default());
    let [finding] = problems(&report)[..] else {
        panic!("{report:?}")
    };
    assert_eq!(finding.severity, Severity::Failure);
    assert!(
        finding
            .what
            .starts_with("node 5 did not answer to 0x1000:00 within 500 ms"),
        "{}",
        finding.what
    );
    assert!(
        finding
            .remedy
            .as_deref()
            .unwrap()
            .contains("power, node number, bit rate and the bus termination")
    );
}

#[test]
fn stopped_node_is_recognised_by_its_heartbeat() {
    let (host, device, _running) = rig(EmulatedDriveSettings::default());
    let mut master = host.bus().connect(&[]);
    let write = [0x2B, 0x17, 0x10, 0, 50, 0, 0, 0]; // 0x1017 = 50 ms
    master
        .send(&CanFrame::new(sdo::request_id(5), write))
        .unwrap();
    master.send(&nmt::Command::Stop.frame(5)).unwrap();
    host.sleep(Duration::from_millis(10));
    let report = examine(&host);
    let finding = problems(&report)[0];
    assert!(
        finding.what.ends_with("its heartbeat reports stopped"),
        "{}",
        finding.what
    );
    assert_eq!(report.figures.bus.as_ref().unwrap().nodes, [5]);
    assert_eq!(
        device.lock().unwrap().nmt_state(),
        nmt::State::Stopped,
        "the examination must not change the NMT state"
    );
}

/// A bus in memory with the claims of an interface of this name.
struct ClaimingHost {
    inner: SimulatedHost,
    interface: String,
}

impl ClaimingHost {
    /// A host whose claims are independent of those of other tests.
    fn new(inner: SimulatedHost, test: &str) -> ClaimingHost {
        let interface = format!("{test}-{}", std::process::id());
        ClaimingHost { inner, interface }
    }
}

impl Port for ClaimingHost {
    fn endpoint(&self, ids: &[Id]) -> Result<Box<dyn CanBus>, BusError> {
        self.inner.endpoint(ids)
    }

    fn claim(&self, node: u8) -> Result<Claim, NodeInUse> {
        Claim::new(&self.interface, node)
    }
}

impl Host for ClaimingHost {
    fn now_ns(&self) -> u64 {
        self.inner.now_ns()
    }

    fn sleep(&self, time: Duration) {
        self.inner.sleep(time);
    }

    fn start(&self, name: &str, task: Box<dyn Task>) -> std::io::Result<TaskHandle> {
        self.inner.start(name, task)
    }
}

#[test]
fn node_in_use_by_another_process_receives_no_frame() {
    let (host, _device, _running) = rig(EmulatedDriveSettings::default());
    let mut listener = host.bus().connect(&[]);
    let host = ClaimingHost::new(host, "in-use");
    let _claim = host.claim(5).unwrap();
    let report = examine(&host);
    let [finding] = &report.findings[..] else {
        panic!("{report:?}")
    };
    assert_eq!(finding.severity, Severity::Failure);
    assert_eq!(
        finding.what,
        format!(
            "node 5 is used by process {}; nothing was sent to it",
            std::process::id()
        )
    );
    assert_eq!(received_frames(&mut listener), []);
}

#[test]
fn node_is_released_after_the_examination() {
    let (host, _device, _running) = rig(EmulatedDriveSettings::default());
    let host = ClaimingHost::new(host, "released");
    assert!(problems(&examine(&host)).is_empty());
    assert!(host.claim(5).is_ok());
}

/// Sends STATUS of VESC 23 every 20 ms.
struct Vesc(Box<dyn CanBus>, u64);

impl Task for Vesc {
    fn step(&mut self, now_ns: &dyn Fn() -> u64, _wait: Duration) -> Result<(), BusError> {
        if now_ns() >= self.1 {
            self.1 = now_ns() + 20_000_000;
            self.0.send(&CanFrame::new(status_id(23), [0; 8]))?;
        }
        Ok(())
    }
}

#[test]
fn vesc_is_examined_by_listening_only() {
    let host = SimulatedHost::default();
    let _running = host
        .start("vesc", Box::new(Vesc(host.endpoint(&[]).unwrap(), 0)))
        .unwrap();
    let mut listener = host.bus().connect(&[]);
    let find = |node| {
        let settings = VescSettings {
            node,
            current_limit_a: 1.0,
            status_timeout: Duration::from_millis(100),
            command_timeout: Duration::from_millis(20),
        };
        let mut report = Report::default();
        examine_vesc(&host, &settings, 500_000, &mut report);
        report.findings.iter().map(|finding| finding.severity).max()
    };
    assert_eq!(
        (find(23), find(24)),
        (Some(Severity::Ok), Some(Severity::Failure))
    );
    assert!(
        received_frames(&mut listener)
            .iter()
            .all(|frame| frame.id() == status_id(23))
    );
}

#[test]
fn bus_down_is_a_failure() {
    let host = SimulatedHost::default();
    host.bus().set_down(true);
    let report = examine(&host);
    assert_eq!(problems(&report)[0].what, "the CAN interface is down");
}
