use proptest::prelude::*;

use super::super::bus::{Port, World};
use super::*;

const SETTINGS: VescSettings =
    VescSettings { node: 23, current_limit_a: 60.0, status_timeout: Duration::from_millis(100) };

/// A VESC as its documentation tells: STATUS every 20 ms, lets go after 0.5 s.
struct Device {
    bus: Box<dyn CanBus>,
    current_ma: Arc<AtomicI32>,
    mute: Arc<AtomicBool>,
    commanded_ns: u64,
    due_ns: u64,
}

impl Task for Device {
    fn step(&mut self, now_ns: &dyn Fn() -> u64, wait: Duration) -> Result<(), BusError> {
        if let Some(BusEvent::Frame(frame)) = self.bus.receive(wait)? {
            self.commanded_ns = now_ns();
            self.current_ma.store(i32::from_be_bytes(frame.data().try_into().unwrap()), Ordering::Release);
        }
        if now_ns() - self.commanded_ns > 500_000_000 {
            self.current_ma.store(0, Ordering::Release);
        }
        if now_ns() >= self.due_ns && !self.mute.load(Ordering::Acquire) {
            self.due_ns = now_ns() + 20_000_000;
            let tenths = (self.current_ma.load(Ordering::Acquire) / 100) as i16;
            let [high, low] = tenths.to_be_bytes();
            self.bus.send(&CanFrame::new(status_id(23), [0, 0, 0, 0, high, low, 0, 0]))?;
        }
        Ok(())
    }
}

struct Rig {
    vesc: Vesc,
    world: World,
    current_ma: Arc<AtomicI32>,
    mute: Arc<AtomicBool>,
    _device: Running,
}

fn rig() -> Rig {
    let (world, current_ma, mute) = (World::default(), Arc::<AtomicI32>::default(), Arc::<AtomicBool>::default());
    let bus = world.endpoint(&[Id::extended(1 << 8 | 23)]).unwrap();
    let device =
        Device { bus, current_ma: Arc::clone(&current_ma), mute: Arc::clone(&mute), commanded_ns: 0, due_ns: 0 };
    let running = world.start("device", Box::new(device)).unwrap();
    let vesc = Vesc::open(SETTINGS, Box::new(world.clone())).unwrap();
    Rig { vesc, world, current_ma, mute, _device: running }
}

#[test]
fn fifty_one_amperes_to_node_23_are_the_bytes_of_the_documentation() {
    let frame = set_current(23, 51_000);
    assert_eq!((frame.id(), frame.data()), (Id::extended(0x0117), &[0x00, 0x00, 0xC7, 0x38][..]));
    assert_eq!(status_id(23), Id::extended(0x0917));
    assert_eq!(status_current(&[0, 0, 0, 0, 0xFF, 0xF6, 0, 0]), Some(-10)); // -1 A
    assert_eq!(status_current(&[0; 7]), None);
}

#[test]
fn a_vesc_follows_and_tells_its_current() {
    let mut rig = rig();
    assert_eq!(rig.vesc.command(1.0).unwrap_err().code, i64::from(NOT_ARMED));
    rig.vesc.enable().unwrap();
    assert_eq!(rig.vesc.status(), AmplifierStatus::Enabled);
    assert_eq!(rig.vesc.command(-1.2345), Ok(-1.234), "whole milliamperes, towards zero");
    assert_eq!(rig.vesc.command(99.0), Ok(60.0), "limited");
    assert_eq!(rig.vesc.command(-1.2345), Ok(-1.234));
    rig.world.sleep(Duration::from_millis(40));
    assert_eq!(rig.current_ma.load(Ordering::Acquire), -1234);
    assert!((rig.vesc.actual_current_a().unwrap() + 1.2).abs() < 1e-9, "0.1 A is what STATUS tells");
    rig.vesc.disable();
    rig.world.sleep(Duration::from_millis(1));
    assert_eq!((rig.current_ma.load(Ordering::Acquire), rig.vesc.status()), (0, AmplifierStatus::Disabled));
}

#[test]
fn a_silent_vesc_and_a_dead_bus_are_faults_until_cleared() {
    for dead_bus in [false, true] {
        let mut rig = rig();
        rig.vesc.enable().unwrap();
        rig.vesc.command(1.0).unwrap();
        rig.mute.store(!dead_bus, Ordering::Release);
        if dead_bus {
            rig.world.bus().tell(Condition::BusOff);
        }
        rig.world.sleep(Duration::from_millis(130));
        let code = if dead_bus { BUS_OFF } else { SILENT };
        assert_eq!(rig.vesc.status(), AmplifierStatus::Fault(code));
        assert_eq!(rig.vesc.command(1.0).unwrap_err().code, i64::from(code));
        rig.world.sleep(Duration::from_millis(1));
        assert_eq!(rig.current_ma.load(Ordering::Acquire), 0);
        rig.mute.store(false, Ordering::Release);
        rig.world.sleep(Duration::from_millis(40));
        rig.vesc.reset_fault().unwrap();
        assert_eq!(rig.vesc.status(), AmplifierStatus::Disabled, "cleared is not enabled");
        rig.vesc.enable().unwrap();
    }
}

#[test]
fn a_loop_that_stands_still_ends_with_no_current() {
    let mut rig = rig();
    rig.vesc.enable().unwrap();
    rig.vesc.command(2.0).unwrap();
    rig.world.sleep(Duration::from_millis(490));
    assert_eq!(rig.current_ma.load(Ordering::Acquire), 2000);
    rig.world.sleep(Duration::from_millis(20));
    assert_eq!(rig.current_ma.load(Ordering::Acquire), 0);
}

proptest! {
    #[test]
    fn no_frame_panics_the_watch(frames in proptest::collection::vec(proptest::collection::vec(any::<u8>(), 0..9), 0..50)) {
        let world = World::default();
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
