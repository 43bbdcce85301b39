//! The loop of a soak with everything around it.

use std::error::Error;
use std::sync::Arc;
use std::thread::JoinHandle;

use bench_config::Config;
use bench_experiment::Plan;
use bench_rig::simulated::SimulatedRig;
use bench_rt::interlock::Interlocks;
use bench_rt::publisher::Publisher;
use bench_rt::request::RequestSender;
use bench_rt::servo::Servo;
use bench_rt::servo_run::{Connections, Progress, ServoRun};
use bench_rt::supervision::{ArmLease, LeaseWatch};
use bench_rt::thread::Pace;
use rtrb::RingBuffer;

use super::faults::Schedule;
use super::programs::Programs;
use super::recorder::{Report, SoakRecorder};
use super::rig::ScheduledRig;
use super::supervisor::Supervisor;

/// Slots of the ring to the recorder: 13 s at 5 kHz.
const RING_SLOTS: usize = 1 << 16;
/// Time for which the readings are judged before the amplifier is enabled, in ticks.
const HEALTHY_TICKS: u64 = 100;

/// A loop that has not begun, its supervisor, and the running recorder.
pub struct SoakLoop {
    pub servo: Servo,
    pub supervisor: Supervisor,
    pub recorder: JoinHandle<Report>,
    pub schedule: Schedule,
    pub lease: Arc<ArmLease>,
    /// Length of a tick in seconds.
    pub tick_s: f64,
}

impl SoakLoop {
    /// A loop around the simulated stage.
    pub fn new(
        config: &Config,
        schedule: Schedule,
        pace: Pace,
    ) -> Result<SoakLoop, Box<dyn Error>> {
        let (publisher, records) = RingBuffer::new(RING_SLOTS);
        let (requests, taken) = RequestSender::ring(16);
        let (ended, retired) = RingBuffer::new(16);
        let connections = Connections {
            requests: taken,
            retired: ended,
            publisher: Publisher::new(publisher),
            progress: Arc::new(Progress::default()),
        };
        let lease = Arc::<ArmLease>::default();
        let watch = lease_watch(config, pace, &lease);
        // A trip ends a run before the next period begins. The loop ends when there is no next period.
        let tail_ticks = (schedule.period_s() * config.servo.rate_hz) as u64;
        let recorder = SoakRecorder::new(config, schedule, pace)?;
        Ok(SoakLoop {
            servo: Servo::new(
                Box::new(ScheduledRig::new(
                    SimulatedRig::new(config)?,
                    schedule,
                    pace,
                )),
                Box::new(
                    servo_run(config, connections)?
                        .with_lease(watch)
                        .with_tail(tail_ticks),
                ),
                config.servo.period_s(),
            ),
            supervisor: Supervisor {
                requests,
                retired,
                programs: Programs::new(config, &schedule)?,
            },
            recorder: std::thread::spawn(move || recorder.run(records)),
            schedule,
            lease,
            tick_s: config.servo.period_s(),
        })
    }
}

fn servo_run(config: &Config, connections: Connections) -> Result<ServoRun, Box<dyn Error>> {
    let interlocks = Interlocks::new(
        &config.interlock,
        &config.amplifier,
        &config.motor,
        &config.servo,
    );
    let ramp_ticks = Plan::quiet(config.clone()).ramp_ticks()?;
    Ok(ServoRun::new(interlocks, connections)
        .with_ramps(ramp_ticks)
        .with_healthy_ticks(HEALTHY_TICKS))
}

/// In virtual pace, ticks do not measure the time of the supervisor.
fn lease_watch(config: &Config, pace: Pace, lease: &Arc<ArmLease>) -> Option<LeaseWatch> {
    match pace {
        Pace::Virtual => None,
        Pace::Realtime => {
            let limit_ticks = config.servo.arm_lease_ticks();
            Some(LeaseWatch::new(Arc::clone(lease), limit_ticks))
        }
    }
}
