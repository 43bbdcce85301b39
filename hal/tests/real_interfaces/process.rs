//! The process is killed while current flows.

use std::process::{Child, Command, Stdio};
use std::time::Duration;

use bench_hal::CurrentAmplifier;
use bench_hal::blocking;
use bench_hal::can::bus::{BusEvent, CanBus, Port};
use bench_hal::can::cia402::State;
use bench_hal::can::emcy;
use std::thread::sleep;

use crate::support::vcan::Vcan;
use crate::support::{FarEnd, Rig, host, open, refusal, settings, wait_for};

/// Interface of the child process. If it is set, the test below is the process to be killed.
const INTERFACE: &str = "BENCH_HAL_TO_BE_KILLED_ON";

#[test]
fn drive_stops_and_node_is_released_after_the_process_is_killed() {
    if let Ok(interface) = std::env::var(INTERFACE) {
        command_until_killed(&interface);
    }
    let vcan = Vcan::up();
    let far_end = FarEnd::new(&vcan.name, &host(&vcan.name));
    let mut emergencies = host(&vcan.name).endpoint(&[emcy::cob_id(5)]).unwrap();
    let mut child = start_child_process(&vcan.name);
    wait_for("the other process drives 1 A", || {
        far_end.current_a() == 1.0
    });

    let refused = refusal(&vcan.name, settings());
    let holder = format!(
        "node 5 is already in use by process {}; end that process",
        child.id()
    );
    assert!(refused.starts_with(&holder), "{refused}");
    assert_eq!(
        far_end.current_a(),
        1.0,
        "the refused opening must not change the current"
    );

    child.kill().unwrap(); // SIGKILL
    child.wait().unwrap();
    far_end.wait_until_off();
    assert_eq!(far_end.device().power_state(), State::SwitchOnDisabled);
    assert_eq!(
        first_emergency(emergencies.as_mut()),
        0x8130,
        "the heartbeat consumer of the drive reports the loss"
    );

    let drive =
        open(&vcan.name, settings()).unwrap_or_else(|error| panic!("the node is free: {error}"));
    Rig { drive, far_end }.enabled();
}

fn start_child_process(interface: &str) -> Child {
    let name = "process::drive_stops_and_node_is_released_after_the_process_is_killed";
    let mut command = Command::new(std::env::current_exe().unwrap());
    command
        .args(["--exact", name, "--nocapture"])
        .env(INTERFACE, interface)
        .stdout(Stdio::null());
    command.spawn().unwrap()
}

/// Commands a current until the process is killed. The kernel also kills it when its parent ends.
fn command_until_killed(interface: &str) -> ! {
    // SAFETY: the arguments are integers.
    unsafe { libc::prctl(libc::PR_SET_PDEATHSIG, libc::SIGKILL) };
    let mut drive = open(interface, settings()).unwrap();
    blocking::enable(&mut drive, sleep).unwrap();
    loop {
        drive.command(1.0).unwrap();
        std::thread::sleep(Duration::from_millis(2));
    }
}

/// The code of the first received emergency message.
fn first_emergency(bus: &mut dyn CanBus) -> u16 {
    let event = bus.receive(Duration::from_secs(10)).unwrap();
    let Some(BusEvent::Frame(frame)) = event else {
        panic!("{event:?}")
    };
    emcy::Emergency::decode(frame.data()).unwrap().code
}
