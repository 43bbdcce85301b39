use super::*;

const ID: Id = Id::standard(0x123);
const FRAME: CanFrame = CanFrame::new(ID, [1, 2]);

#[test]
fn endpoints_receive_the_frames_of_others_only() {
    let bus = MemoryBus::default();
    let (mut a, mut b, mut deaf) = (
        bus.connect(&[]),
        bus.connect(&[ID]),
        bus.connect(&[Id::standard(0x124)]),
    );
    a.send(&FRAME).unwrap();
    assert_eq!(b.receive(Duration::ZERO), Ok(Some(BusEvent::Frame(FRAME))));
    assert_eq!(a.receive(Duration::ZERO), Ok(None));
    assert_eq!(deaf.receive(Duration::ZERO), Ok(None));
    bus.inject_condition(Condition::BusOff);
    assert_eq!(
        deaf.receive(Duration::ZERO),
        Ok(Some(BusEvent::Condition(Condition::BusOff))),
        "conditions pass filters"
    );
    bus.set_down(true);
    assert_eq!(a.send(&FRAME), Err(BusError::Down));
    assert_eq!(b.receive(Duration::ZERO), Err(BusError::Down));
}

/// Answers each frame, and reports the time once.
struct Echo(Box<dyn CanBus>);

impl Task for Echo {
    fn step(&mut self, _now_ns: &dyn Fn() -> u64, wait: Duration) -> Result<(), BusError> {
        if let Some(BusEvent::Frame(frame)) = self.0.receive(wait)? {
            self.0
                .send(&CanFrame::from_slice(Id::standard(0x222), frame.data()).unwrap())?;
        }
        Ok(())
    }
}

fn echoes(host: &dyn Host) {
    let running = host
        .start("echo", Box::new(Echo(host.endpoint(&[ID]).unwrap())))
        .unwrap();
    let mut endpoint = host.endpoint(&[Id::standard(0x222)]).unwrap();
    endpoint.send(&FRAME).unwrap();
    let answer = endpoint.receive(Duration::from_secs(60)).unwrap();
    assert_eq!(
        answer,
        Some(BusEvent::Frame(CanFrame::new(Id::standard(0x222), [1, 2])))
    );
    drop(running);
    endpoint.send(&FRAME).unwrap();
    assert_eq!(
        endpoint.receive(Duration::from_millis(20)),
        Ok(None),
        "a dropped task has ended"
    );
}

#[test]
fn a_task_answers_on_a_thread() {
    echoes(&SystemHost::new(MemoryBus::default()));
}

#[test]
fn a_task_answers_in_simulated_time() {
    let world = SimulatedHost::default();
    echoes(&world);
    // One step of 100 us until the answer, then 20 ms without a frame.
    assert_eq!(world.now_ns(), 20_100_000);
    world.sleep(Duration::from_secs(3600));
    assert_eq!(world.now_ns(), 3_600_020_100_000);
}
