use std::sync::Mutex;

use proptest::prelude::*;

use super::super::bus::{BusEvent, Condition, Port, SimulatedHost};
use super::super::emulator::{AmplifierTask, DeviceFault, EmulatedAmplifier, EmulatedVesc};
use super::super::frame::{CanFrame, Id};
use super::faults::{BUS_OFF, COMMANDS_STOPPED};
use super::*;

const SETTINGS: VescSettings = VescSettings {
    node: 23,
    current_limit_a: 60.0,
    status_timeout: Duration::from_millis(100),
    command_timeout: Duration::from_millis(20),
};

struct Rig {
    vesc: Vesc,
    world: SimulatedHost,
    device: Arc<Mutex<EmulatedVesc>>,
    _running: TaskHandle,
}

impl Rig {
    fn enable(&mut self) -> Result<(), DeviceError> {
        crate::blocking::enable(&mut self.vesc, |time| self.world.sleep(time))
    }

    fn reset_fault(&mut self) -> Result<(), DeviceError> {
        crate::blocking::reset_fault(&mut self.vesc, |time| self.world.sleep(time))
    }

    /// Commands a current once per millisecond, as a loop at 1 kHz; errors are ignored, as when the VESC has a fault.
    fn drive(&mut self, current_a: f64, milliseconds: u64) {
        for _ in 0..milliseconds {
            let _ = self.vesc.command(current_a);
            self.world.sleep(Duration::from_millis(1));
        }
    }

    fn sleep_ms(&self, milliseconds: u64) {
        self.world.sleep(Duration::from_millis(milliseconds));
    }

    fn current_a(&self) -> f64 {
        self.device.lock().unwrap().current_a()
    }

    fn inject(&self, fault: DeviceFault) {
        self.device.lock().unwrap().inject(fault);
    }
}

fn rig() -> Rig {
    let (world, device) = (
        SimulatedHost::default(),
        Arc::new(Mutex::new(EmulatedVesc::new(23))),
    );
    let running = AmplifierTask::start(&world, Arc::clone(&device)).unwrap();
    let vesc = Vesc::open(SETTINGS, Box::new(world.clone())).unwrap();
    Rig {
        vesc,
        world,
        device,
        _running: running,
    }
}

#[test]
fn fifty_one_amperes_to_node_23_are_the_bytes_of_the_documentation() {
    let frame = set_current(23, 51_000);
    assert_eq!(
        (frame.id(), frame.data()),
        (Id::extended(0x0117), &[0x00, 0x00, 0xC7, 0x38][..])
    );
    assert_eq!(status_id(23), Id::extended(0x0917));
    assert_eq!(status_current(&[0, 0, 0, 0, 0xFF, 0xF6, 0, 0]), Some(-10)); // -1 A
    assert_eq!(status_current(&[0; 7]), None);
}

#[test]
fn a_vesc_follows_commands_and_reports_its_current() {
    let mut rig = rig();
    assert_eq!(
        rig.vesc.command(1.0).unwrap_err().code,
        i64::from(NOT_ARMED)
    );
    rig.enable().unwrap();
    assert_eq!(rig.vesc.status(), AmplifierStatus::Enabled);
    assert_eq!(
        rig.vesc.command(-1.2345),
        Ok(-1.234),
        "whole milliamperes, towards zero"
    );
    assert_eq!(rig.vesc.command(99.0), Ok(60.0), "limited");
    assert_eq!(rig.vesc.command(-1.2345), Ok(-1.234));
    rig.drive(-1.2345, 40);
    assert_eq!(rig.current_a(), -1.234);
    assert!(
        (rig.vesc.actual_current_a().unwrap() + 1.2).abs() < 1e-9,
        "0.1 A is what STATUS tells"
    );
    rig.vesc.disable();
    rig.world.sleep(Duration::from_millis(1));
    assert_eq!(
        (rig.current_a(), rig.vesc.status()),
        (0.0, AmplifierStatus::Disabled)
    );
}

#[test]
fn disable_wins_over_enabling() {
    let mut rig = rig();
    let begun_ns = rig.world.now_ns();
    rig.vesc.begin_enable().unwrap();
    assert!(rig.vesc.poll_enable().is_pending());
    assert_eq!(rig.world.now_ns(), begun_ns);
    rig.vesc.disable();
    rig.world.sleep(Duration::from_millis(200));
    assert_eq!(rig.vesc.poll_enable(), Poll::Ready(Err(error(NOT_ARMED))));
    assert_eq!(rig.vesc.status(), AmplifierStatus::Disabled);
}

#[test]
fn a_silent_vesc_and_bus_off_are_faults_until_cleared() {
    type FaultCase = (u32, fn(&Rig));
    let cases: [FaultCase; 4] = [
        (SILENT, |rig| rig.inject(DeviceFault::Mute)),
        (SILENT, |rig| rig.inject(DeviceFault::ShortFrames)),
        (SILENT, |rig| rig.inject(DeviceFault::Late(200))),
        (BUS_OFF, |rig| {
            rig.world.bus().inject_condition(Condition::BusOff)
        }),
    ];
    for (code, fail) in cases {
        let mut rig = rig();
        rig.enable().unwrap();
        rig.vesc.command(1.0).unwrap();
        fail(&rig);
        rig.drive(1.0, 130);
        assert_eq!(rig.vesc.status(), AmplifierStatus::Fault(code));
        assert_eq!(rig.vesc.command(1.0).unwrap_err().code, i64::from(code));
        rig.world.sleep(Duration::from_millis(1));
        assert_eq!(rig.current_a(), 0.0);
        rig.inject(DeviceFault::None);
        rig.world.sleep(Duration::from_millis(240));
        rig.reset_fault().unwrap();
        assert_eq!(
            rig.vesc.status(),
            AmplifierStatus::Disabled,
            "cleared is not enabled"
        );
        rig.enable().unwrap();
    }
}

#[test]
fn vesc_releases_the_motor_after_loss_of_commands() {
    let mut rig = rig();
    rig.enable().unwrap();
    rig.vesc.command(1.0).unwrap();
    rig.world.sleep(Duration::from_millis(1));
    rig.inject(DeviceFault::Unplugged);
    rig.drive(1.0, 490);
    assert_eq!(
        (rig.current_a(), rig.vesc.status()),
        (1.0, AmplifierStatus::Fault(SILENT))
    );
    rig.world.sleep(Duration::from_millis(20));
    assert_eq!(rig.current_a(), 0.0);
}

#[test]
fn emulated_vesc_releases_the_motor_after_half_a_second_without_command() {
    let rig = rig();
    let mut bus = rig.world.endpoint(&[]).unwrap();
    bus.send(&set_current(23, 2000)).unwrap();
    rig.sleep_ms(490);
    assert_eq!(rig.current_a(), 2.0);
    rig.sleep_ms(20);
    assert_eq!(rig.current_a(), 0.0);
}

#[test]
fn current_ends_20_ms_after_the_last_command_of_a_hung_loop() {
    // One command before the thread of the driver runs, and many.
    for milliseconds in [1, 50] {
        let mut rig = rig();
        rig.enable().unwrap();
        rig.drive(2.0, milliseconds); // the last command is 1 ms old
        rig.sleep_ms(18);
        assert_eq!(
            (rig.current_a(), rig.vesc.status()),
            (2.0, AmplifierStatus::Enabled)
        );
        rig.sleep_ms(3);
        let fault = AmplifierStatus::Fault(COMMANDS_STOPPED);
        assert_eq!((rig.current_a(), rig.vesc.status()), (0.0, fault));
        let refused = rig.vesc.command(2.0).unwrap_err();
        assert_eq!(refused.code, i64::from(COMMANDS_STOPPED));
        rig.sleep_ms(1);
        assert_eq!(rig.current_a(), 0.0);
        rig.reset_fault().unwrap();
        rig.enable().unwrap();
        rig.drive(1.0, 50);
        assert_eq!(
            (rig.current_a(), rig.vesc.status()),
            (1.0, AmplifierStatus::Enabled)
        );
    }
}

#[test]
fn hung_thread_of_the_driver_is_a_fault_after_20_ms() {
    let mut rig = rig();
    rig.enable().unwrap();
    rig.drive(2.0, 50);
    rig.world.set_hung("can-vesc", true);
    rig.drive(2.0, 19);
    assert_eq!(rig.vesc.status(), AmplifierStatus::Enabled);
    rig.sleep_ms(2); // the limit is 20 ms, a step of the bus 0.1 ms
    assert_eq!(rig.vesc.status(), AmplifierStatus::Fault(THREAD_HUNG));
    let refused = rig.vesc.command(2.0).unwrap_err();
    assert_eq!(refused.code, i64::from(THREAD_HUNG));
    rig.sleep_ms(1);
    assert_eq!(rig.current_a(), 0.0, "the refused command disables");
    assert_eq!(rig.reset_fault().unwrap_err().code, i64::from(THREAD_HUNG));
    rig.world.set_hung("can-vesc", false);
    rig.sleep_ms(1);
    rig.reset_fault().unwrap();
    rig.enable().unwrap();
    rig.drive(1.0, 50);
    assert_eq!(rig.current_a(), 1.0);
}

#[test]
fn enabled_vesc_waits_for_its_first_command() {
    let mut rig = rig();
    rig.enable().unwrap();
    rig.sleep_ms(1000);
    assert_eq!(rig.vesc.status(), AmplifierStatus::Enabled);
}

#[test]
fn lost_zero_is_repeated_until_the_current_is_gone() {
    // The zero of the disable is lost, and those of the next 45 ms.
    let mut rig = rig();
    rig.enable().unwrap();
    rig.drive(2.0, 30);
    rig.inject(DeviceFault::SetPointsIgnored);
    rig.vesc.disable();
    rig.sleep_ms(45);
    assert_eq!(rig.current_a(), 2.0);
    rig.inject(DeviceFault::None);
    rig.sleep_ms(11); // the period of the repeats
    assert_eq!(rig.current_a(), 0.0);
}

#[test]
fn zero_is_repeated_until_two_status_frames_confirm_it_and_at_most_for_a_second() {
    // Ten milliseconds between repeats. The second STATUS is at most 40 ms away; without STATUS, a second has 101 repeats. A VESC that
    // receives none of them releases the motor after 500 ms, and the next STATUS shows it.
    for (fault, repeats) in [
        (DeviceFault::None, 2..=6),
        (DeviceFault::Mute, 100..=102),
        (DeviceFault::SetPointsIgnored, 50..=54),
    ] {
        let mut rig = rig();
        rig.enable().unwrap();
        rig.drive(2.0, 3);
        let mut listener = rig.world.endpoint(&[set_current(23, 0).id()]).unwrap();
        rig.inject(fault);
        rig.vesc.disable();
        rig.sleep_ms(3000);
        let frames = std::iter::from_fn(|| listener.receive(Duration::ZERO).unwrap());
        let count = frames.inspect(|frame| assert_eq!(*frame, BusEvent::Frame(set_current(23, 0))));
        let count = count.count();
        assert!(repeats.contains(&count), "{fault:?}: {count}");
    }
}

#[test]
fn use_of_one_command_is_ended_by_repeated_zero() {
    // Enabled, commanded and disabled within one step of the thread of the driver.
    let mut rig = rig();
    rig.enable().unwrap();
    rig.vesc.command(2.0).unwrap();
    rig.vesc.disable();
    rig.sleep_ms(1);
    rig.device
        .lock()
        .unwrap()
        .handle(&set_current(23, 2000), 0, &mut Vec::new());
    assert_eq!(rig.current_a(), 2.0, "as if the zero had been lost");
    rig.sleep_ms(11);
    assert_eq!(rig.current_a(), 0.0);
}

#[test]
fn closing_waits_until_the_current_is_gone() {
    let mut rig = rig();
    rig.enable().unwrap();
    rig.drive(2.0, 3);
    let begun_ns = rig.world.now_ns();
    drop(rig.vesc);
    // Two STATUS at a period of 20 ms.
    let closed_ms = (rig.world.now_ns() - begun_ns) / 1_000_000;
    assert!((20..=45).contains(&closed_ms), "{closed_ms}");
    assert_eq!(rig.device.lock().unwrap().current_a(), 0.0);
}

proptest! {
    #[test]
    fn random_frames_do_not_panic(frames in proptest::collection::vec(proptest::collection::vec(any::<u8>(), 0..9), 0..50)) {
        let world = SimulatedHost::default();
        let vesc = Vesc::open(SETTINGS, Box::new(world.clone())).unwrap();
        let mut bus = world.endpoint(&[]).unwrap();
        for bytes in frames {
            bus.send(&CanFrame::from_slice(status_id(23), &bytes).unwrap()).unwrap();
            world.sleep(Duration::from_micros(200));
            let heard = bytes.len() == 8;
            prop_assert!(heard || vesc.status() == AmplifierStatus::Disabled);
        }
    }
}
