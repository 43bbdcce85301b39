//! A tick allocates nothing and makes no system call: proven on the loop itself, whatever it runs and whatever goes wrong.
use std::ops::Range;
use std::sync::Arc;

use assert_no_alloc::{AllocDisabler, assert_no_alloc};
use bench::config::{
    AmplitudePoint, Config, ExcitationKind, ReferenceSettings, Source, Sweep, TravelPoint, load,
};
use bench::control::{ControlDesign, ControllerText};
use bench::excitation::{
    Chirp, FileReference, HoldReference, RampReference, ReferenceContext, SineReference,
    StepReference, SweptReference, ZeroCurrent,
};
use bench::rig::simulated::SimulatedRig;
use bench::rt::clock::{Clock, Realtime, TickTiming, Virtual};
use bench::rt::interlock::Interlocks;
use bench::rt::program::{Control, Decision, Excite, Program, ProgramInput};
use bench::rt::publisher::Publisher;
use bench::rt::record::{EventKind, LoopMessage};
use bench::rt::servo::{Connections, Progress, Request, Servo};
use bench_hal::{Tick, Validity};
use rtrb::{Consumer, Producer, RingBuffer};

use bench_test_support::faulty_rig;
use faulty_rig::{Fault, FaultyRig};

#[global_allocator]
static ALLOCATOR: AllocDisabler = AllocDisabler;

fn stage() -> Config {
    load(&Source::default()).expect("the profile is valid")
}

/// The program that commands nothing.
const NO_CURRENT: &str = "no current";

/// Whatever the loop can run, each with a few seconds of its own.
fn programs(config: &Config) -> Vec<(String, Box<dyn Program>)> {
    let period_s = config.servo.period_s();
    let folder = tempfile::tempdir().expect("a temporary folder");
    let own = folder.path().join("own.toml");
    let text = "title = \"own\"\n[[section]]\nkind = \"integrator\"\ngain_a_per_um = 0.05\n[[section]]\nkind = \"coefficients\"\n\
                numerator = [1.0, 2.0, 90000.0]\ndenominator = [1.0, 400.0, 90000.0]\nprewarp_rad_s = 300.0\n";
    std::fs::write(&own, text).expect("a file");
    let references = [
        ReferenceSettings::Hold(HoldReference {}),
        ReferenceSettings::Step(StepReference {
            amplitude_m: 50e-6,
            at_s: 0.1,
        }),
        ReferenceSettings::Ramp(RampReference {
            amplitude_m: 50e-6,
            speed_m_per_s: 1e-4,
            at_s: 0.1,
        }),
        ReferenceSettings::Sine(SineReference {
            amplitude_m: 20e-6,
            frequency_hz: 3.0,
        }),
        ReferenceSettings::Chirp(SweptReference {
            amplitude: vec![TravelPoint {
                frequency_hz: 1.0,
                amplitude_m: 1e-6,
            }],
            travel_m: 20e-6,
        }),
        ReferenceSettings::File(FileReference {
            path: "points.csv".into(),
        }),
    ];
    let mut programs: Vec<(String, Box<dyn Program>)> = Vec::new();
    for name in ["fast", "slow", own.to_str().expect("text")] {
        let sections = ControllerText::find(name)
            .expect("found")
            .sections(config.servo.rate_hz)
            .expect("valid");
        for settings in &references {
            let points = "time_s,reference_m\n0.0,0.0\n0.2,1e-5\n0.4,2e-5\n";
            let context = ReferenceContext {
                chirp: &config.chirp,
                period_s,
                file: Some(points),
            };
            let reference = settings.design().build(&context).expect("valid");
            let program = Control::new(sections.law(period_s), reference, 500, 4500);
            programs.push((format!("{name}, {settings:?}"), Box::new(program)));
        }
    }
    for sweep in [Sweep::Linear, Sweep::Logarithmic] {
        let mut chirp = config.chirp.clone();
        (
            chirp.sweep,
            chirp.duration_s,
            chirp.quiet_before_s,
            chirp.quiet_after_s,
        ) = (sweep, 0.8, 0.1, 0.1);
        (chirp.fade_in_s, chirp.amplitude) = (
            0.2,
            vec![AmplitudePoint {
                frequency_hz: 1.0,
                current_a: 0.2,
            }],
        );
        programs.push((
            format!("{sweep:?} chirp"),
            Box::new(Excite(Chirp::new(&chirp, period_s))),
        ));
    }
    for &kind in ExcitationKind::ALL {
        programs.push((
            format!("{kind:?} by its settings"),
            Box::new(Excite(short(config, kind).chosen_excitation().build())),
        ));
    }
    let mut campaign = config.campaign.clone();
    (campaign.settle_s, campaign.average_s) = (0.5, 0.5);
    programs.push((
        NO_CURRENT.into(),
        Box::new(Excite(ZeroCurrent::new(
            campaign.settle_s,
            campaign.average_s,
            period_s,
        ))),
    ));
    programs
}

/// An excitation of nearly a second; the chirp comes twice.
fn short(config: &Config, kind: ExcitationKind) -> Config {
    let mut config = config.clone();
    config.excitation.kind = kind;
    let chirp = &mut config.chirp;
    (
        chirp.start_hz,
        chirp.stop_hz,
        chirp.duration_s,
        chirp.repetitions,
    ) = (50.0, 150.0, 0.4, 2);
    (
        chirp.quiet_before_s,
        chirp.quiet_after_s,
        chirp.fade_in_s,
        chirp.fade_out_s,
    ) = (0.02, 0.02, 0.05, 0.05);
    chirp.amplitude = vec![AmplitudePoint {
        frequency_hz: 1.0,
        current_a: 0.2,
    }];
    let (multisine, prbs, sines) = (
        &mut config.excitations.multisine,
        &mut config.excitations.prbs,
        &mut config.excitations.stepped_sine,
    );
    (multisine.period_s, multisine.periods) = (0.1, 7);
    (
        prbs.order,
        prbs.clock_divider,
        prbs.periods,
        prbs.settle_periods,
    ) = (8, 2, 7, 1);
    (sines.count, sines.settle_s, sines.measure_s) = (3, 0.12, 0.12);
    config
}

/// A loop with its rings, and what comes out of them.
struct Quiet {
    servo: Servo,
    requests: Producer<Request>,
    records: Consumer<LoopMessage>,
    retired: Consumer<Box<dyn Program>>,
    clock: Virtual,
    next: u64,
    trip: Option<&'static str>,
    completed: bool,
    commands: u64,
}

impl Quiet {
    fn new(config: &Config, faults: &[(Range<u64>, Fault)]) -> Quiet {
        let rig = FaultyRig::new(SimulatedRig::new(config).expect("a rig"), faults);
        let (publisher, records) = RingBuffer::new(1024);
        let (requests, taken) = RingBuffer::new(16);
        let (hand_back, retired) = RingBuffer::new(4);
        let connections = Connections {
            requests: taken,
            retired: hand_back,
            publisher: Publisher::new(publisher),
            progress: Arc::new(Progress::default()),
        };
        let interlocks = Interlocks::new(&config.interlock, &config.motor, &config.servo);
        Quiet {
            servo: Servo::new(Box::new(rig), interlocks, connections),
            requests,
            records,
            retired,
            clock: Virtual {
                period_s: config.servo.period_s(),
            },
            next: 0,
            trip: None,
            completed: false,
            commands: 0,
        }
    }

    fn running(
        config: &Config,
        faults: &[(Range<u64>, Fault)],
        program: Box<dyn Program>,
    ) -> Quiet {
        let mut quiet = Quiet::new(config, faults);
        quiet.order(Request::Arm);
        quiet.order(Request::Start(program));
        quiet
    }

    fn order(&mut self, order: Request) {
        assert!(self.requests.push(order).is_ok());
    }

    /// What the loop does in a tick, and nothing else.
    fn bare_tick(&mut self, missed: u32) {
        let moment = self
            .clock
            .wait(self.next + u64::from(missed), self.servo.publisher());
        self.servo
            .tick(&TickTiming { missed, ..moment }, &self.clock);
        self.next = moment.tick.number + 1;
    }

    /// What others do between two ticks; allocates nothing either.
    fn collect(&mut self) {
        while let Ok(published) = self.records.pop() {
            match published {
                LoopMessage::Tick(record) => self.commands += u64::from(record.command_a != 0.0),
                LoopMessage::Event(event) => match event.kind {
                    EventKind::Trip(trip) => self.trip = Some(trip.reason()),
                    EventKind::Completed => self.completed = true,
                    _ => {}
                },
            }
        }
    }

    /// Whether the program came to its end, and commanded what it is there for.
    fn has_done(&self, name: &str) -> bool {
        let commanded = if name == NO_CURRENT {
            self.commands == 0
        } else {
            self.commands > 3500
        };
        self.completed && commanded
    }

    fn run(&mut self, ticks: u64) {
        for _ in 0..ticks {
            assert_no_alloc(|| self.bare_tick(0));
            self.collect();
        }
        while self.retired.pop().is_ok() {}
    }
}

struct Says(f64);

impl Program for Says {
    fn decide(&mut self, _input: &ProgramInput) -> Decision {
        Decision {
            reference_m: 0.0,
            requested_a: self.0,
            active: true,
        }
    }
    fn ticks(&self) -> u64 {
        u64::MAX
    }
}

#[test]
fn no_program_allocates_from_its_first_tick_to_its_completion() {
    let config = stage();
    for (name, program) in programs(&config) {
        let mut quiet = Quiet::running(&config, &[], program);
        quiet.run(5100);
        assert!(
            quiet.has_done(&name) && quiet.trip.is_none(),
            "{name}: {} commands",
            quiet.commands
        );
    }
}

/// A trip of every kind: its reason, what goes wrong, and what is commanded.
fn all_trips() -> Vec<(&'static str, Fault, f64)> {
    vec![
        ("travel", Fault::At(0.00095), 0.01),
        ("peak_current", Fault::Offset(0.0), 9.99),
        ("continuous_current", Fault::Offset(0.0), 9.0),
        ("command_not_finite", Fault::Offset(0.0), f64::NAN),
        ("probe_invalid", Fault::Says(Validity::Faulty), 0.01),
        ("probe_stale", Fault::Old(2_000_000), 0.01),
        ("probe_stale", Fault::Frozen, 0.01),
        ("probe_stuck", Fault::Stuck, 0.3),
        ("amplifier", Fault::Faulted(3), 0.01),
        ("amplifier", Fault::Refuses(4), 0.01),
        ("amplifier", Fault::DoesNotEnable(5), 0.01),
        ("amplifier", Fault::Gives(f64::NAN), 0.01),
        ("current_not_followed", Fault::MeasuresBeyond(1.0), 0.01),
    ]
}

/// The stage would run away under a constant current: the motor's force is as good as none here.
fn weak() -> Config {
    let mut config = stage();
    let (peak_a, rated_a) = (
        config.motor.peak_current_a(),
        config.motor.continuous_current_a(),
    );
    config.motor.force_constant_n_per_a = 1e-3;
    (config.motor.peak_force_n, config.motor.continuous_force_n) = (peak_a * 1e-3, rated_a * 1e-3);
    config
}

#[test]
fn no_trip_allocates_nor_what_comes_after_it() {
    for (reason, fault, current_a) in all_trips() {
        let mut quiet = Quiet::running(&weak(), &[(0..10_000, fault)], Box::new(Says(current_a)));
        quiet.run(8000);
        assert_eq!(quiet.trip, Some(reason), "{fault:?}");
        for order in [
            Request::Arm,
            Request::Start(Box::new(Says(0.01))),
            Request::Stop,
            Request::Clear,
            Request::Stop,
        ] {
            quiet.order(order);
        }
        quiet.run(10);
    }
    let mut quiet = Quiet::running(&weak(), &[], Box::new(Says(0.01)));
    for missed in [1, 40, 0, 10, 3] {
        assert_no_alloc(|| quiet.bare_tick(missed));
    }
    quiet.collect();
    assert_eq!(quiet.trip, Some("overruns"));
}

#[test]
fn no_order_allocates_whenever_it_comes_and_programs_are_freed_outside() {
    let config = weak();
    let mut quiet = Quiet::new(&config, &[]);
    for round in 0..20 {
        for order in [
            Request::Start(Box::new(Says(0.01))),
            Request::Arm,
            Request::Arm,
            Request::Start(Box::new(Says(0.01))),
        ] {
            quiet.order(order);
            assert_no_alloc(|| quiet.bare_tick(0));
        }
        quiet.order(Request::Start(Box::new(Says(0.02))));
        quiet.order(if round % 2 == 0 {
            Request::Stop
        } else {
            Request::Clear
        });
        quiet.order(Request::Stop);
        // Nobody collects the programs here: after four the ring is full, and they are kept rather than freed in the tick.
        for _ in 0..3 {
            assert_no_alloc(|| quiet.bare_tick(0));
        }
        quiet.collect();
    }
    assert!(quiet.commands >= 20, "{}", quiet.commands);
}

#[test]
fn a_full_ring_to_the_recorder_allocates_nothing_and_holds_nothing_up() {
    let mut quiet = Quiet::running(&weak(), &[], Box::new(Says(0.01)));
    for number in 0..5000u64 {
        let tick = Tick {
            number,
            scheduled_ns: number * 200_000,
        };
        let moment = TickTiming {
            tick,
            woke_ns: tick.scheduled_ns,
            missed: 0,
        };
        assert_no_alloc(|| quiet.servo.tick(&moment, &quiet.clock));
    }
    // 1024 slots: four events and 1020 records.
    assert_eq!(quiet.servo.publisher().lost(), 5000 - 1020);
}

/// What became of a child.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
enum Ended {
    Exit(i32),
    Signal(i32),
}

/// Runs `work` in a child of one thread and waits for its end; 0 is the exit code of a child that came to it.
fn in_a_child(work: impl FnOnce()) -> Ended {
    // SAFETY: the child has this thread alone. What it does before `_exit` takes no lock that another thread may hold: the
    // loop is made before the fork, and the ticks are here to be shown to need none.
    let child = unsafe { libc::fork() };
    assert!(
        child >= 0,
        "cannot fork: {}",
        std::io::Error::last_os_error()
    );
    if child == 0 {
        work();
        // SAFETY: ends the child at once, without running anything of the parent's.
        unsafe { libc::_exit(0) };
    }
    let mut status = 0;
    // SAFETY: `status` outlives the call; `child` is a child of this process that nobody else waits for.
    let waited = unsafe { libc::waitpid(child, &raw mut status, 0) };
    assert_eq!(waited, child, "{}", std::io::Error::last_os_error());
    if libc::WIFSIGNALED(status) {
        Ended::Signal(libc::WTERMSIG(status))
    } else {
        Ended::Exit(libc::WEXITSTATUS(status))
    }
}

/// From here on the kernel kills the process at any system call but those named (and the ends of a process).
fn allow_only(calls: &[libc::c_long]) {
    const LOAD_WORD: u16 = (libc::BPF_LD | libc::BPF_W | libc::BPF_ABS) as u16;
    const JUMP_IF_EQUAL: u16 = (libc::BPF_JMP | libc::BPF_JEQ | libc::BPF_K) as u16;
    const RETURN: u16 = (libc::BPF_RET | libc::BPF_K) as u16;
    let line = |code, jt, jf, k| libc::sock_filter { code, jt, jf, k };
    let mut filter = [line(RETURN, 0, 0, libc::SECCOMP_RET_KILL_PROCESS); 16];
    let always = [libc::SYS_exit, libc::SYS_exit_group, libc::SYS_rt_sigreturn];
    // The system call's number stands first in what a filter sees.
    filter[0] = line(LOAD_WORD, 0, 0, 0);
    let mut next = 1;
    for call in always.iter().chain(calls) {
        filter[next] = line(JUMP_IF_EQUAL, 0, 1, *call as u32);
        filter[next + 1] = line(RETURN, 0, 0, libc::SECCOMP_RET_ALLOW);
        next += 2;
    }
    let program = libc::sock_fprog {
        len: filter.len() as u16,
        filter: filter.as_mut_ptr(),
    };
    // SAFETY: the kernel copies the program, which outlives the call; both calls concern this thread alone.
    let refused = unsafe {
        libc::prctl(libc::PR_SET_NO_NEW_PRIVS, 1, 0, 0, 0) != 0
            || libc::prctl(
                libc::PR_SET_SECCOMP,
                libc::SECCOMP_MODE_FILTER,
                &raw const program,
            ) != 0
    };
    if refused {
        // SAFETY: ends the child; 99 tells the parent that the kernel has no filters.
        unsafe { libc::_exit(99) };
    }
}

const TICKS: u64 = 20_000;

/// Other chains than the default: a drive that measures its current, delays of several ticks, a probe of its own clock with
/// its queue, and the stage with its quadratic geometry.
fn chains() -> Vec<(&'static str, Config)> {
    let with = |config: Option<&str>, sets: &[&str]| {
        let sets = sets.iter().map(|set| set.to_string()).collect();
        load(&Source {
            config: config.map(str::to_string),
            sets,
            ..Source::default()
        })
        .expect("the profile is valid")
    };
    vec![
        (
            "lab",
            with(
                Some("lab"),
                &["amplifier.latency_s=0.0043", "probe.latency_s=0.0027"],
            ),
        ),
        ("quadratic", with(None, &["sim.geometry=\"quadratic\""])),
    ]
}

#[test]
fn whatever_the_chain_a_tick_allocates_nothing_and_makes_no_system_call() {
    for (name, config) in chains() {
        let running = || {
            Quiet::running(
                &config,
                &[(0..TICKS, Fault::MeasuresBeyond(0.0))],
                Box::new(Says(0.05)),
            )
        };
        let mut quiet = running();
        quiet.run(TICKS);
        assert!(
            quiet.commands > TICKS - 10 && quiet.trip.is_none(),
            "{name}: {:?}",
            quiet.trip
        );
        let mut quiet = running();
        let ended = in_a_child(|| {
            allow_only(&[]);
            for _ in 0..TICKS {
                quiet.bare_tick(0);
                quiet.collect();
            }
        });
        assert_eq!(
            ended,
            Ended::Exit(0),
            "{name}: a signal is a system call in a tick"
        );
    }
}

#[test]
fn twenty_thousand_ticks_make_no_system_call() {
    let config = stage();
    for (name, program) in programs(&config) {
        let mut quiet = Quiet::running(&config, &[(6000..6001, Fault::At(0.00095))], program);
        let ended = in_a_child(|| {
            allow_only(&[]);
            for _ in 0..TICKS {
                quiet.bare_tick(0);
                quiet.collect();
            }
            // SAFETY: as in the parent; 1 says that the program did not run.
            unsafe { libc::_exit(if quiet.has_done(&name) { 0 } else { 1 }) };
        });
        assert_eq!(
            ended,
            Ended::Exit(0),
            "{name}: a signal is a system call in a tick"
        );
    }
}

#[test]
fn trips_orders_and_late_ticks_make_no_system_call() {
    for (reason, fault, current_a) in all_trips() {
        let config = weak();
        let mut quiet = Quiet::running(&config, &[(0..8000, fault)], Box::new(Says(current_a)));
        let mut others = [
            Some(Request::Clear),
            Some(Request::Arm),
            Some(Request::Start(Box::new(Says(0.01)))),
            Some(Request::Stop),
        ];
        let ended = in_a_child(|| {
            allow_only(&[]);
            for _ in 0..8000 {
                quiet.bare_tick(0);
                quiet.collect();
            }
            for other in &mut others {
                if let Some(order) = other.take() {
                    let _ = quiet.requests.push(order);
                }
                quiet.bare_tick(2);
                quiet.collect();
            }
            // SAFETY: as above; 1 says that there was no such trip.
            unsafe { libc::_exit(if quiet.trip == Some(reason) { 0 } else { 1 }) };
        });
        assert_eq!(ended, Ended::Exit(0), "{reason}, {fault:?}");
    }
}

#[test]
fn in_real_time_the_clock_is_all_that_the_loop_asks_of_the_system() {
    let config = weak();
    let mut quiet = Quiet::running(&config, &[], Box::new(Says(0.01)));
    let mut clock = Realtime::new(0.002);
    let ended = in_a_child(|| {
        allow_only(&[libc::SYS_clock_nanosleep, libc::SYS_clock_gettime]);
        for number in 0..50 {
            let moment = clock.wait(number, quiet.servo.publisher());
            quiet.servo.tick(
                &TickTiming {
                    missed: 0,
                    ..moment
                },
                &clock,
            );
            quiet.collect();
        }
    });
    assert_eq!(ended, Ended::Exit(0));
    assert_eq!(quiet.commands, 0, "the child ran its own copy");
}

#[test]
fn a_system_call_or_an_allocation_in_a_tick_would_be_seen() {
    let config = weak();
    let killed = Ended::Signal(libc::SIGSYS);
    let mut quiet = Quiet::running(&config, &[], Box::new(Says(0.01)));
    let prints = in_a_child(|| {
        allow_only(&[]);
        quiet.bare_tick(0);
        // SAFETY: an empty text; the call itself is what the filter must see.
        unsafe { libc::write(2, std::ptr::null(), 0) };
    });
    assert_eq!(prints, killed, "a print is one system call");
    let maps = in_a_child(|| {
        allow_only(&[]);
        // 64 MiB come from the system, never from what the process already has.
        let memory = vec![1u8; 64 << 20];
        std::hint::black_box(&memory);
    });
    assert_eq!(maps, killed, "so is a large allocation");
    let waits = in_a_child(|| {
        allow_only(&[]);
        std::thread::sleep(std::time::Duration::from_millis(1));
    });
    assert_eq!(waits, killed, "so is a sleep");
    let allocates = in_a_child(|| {
        assert_no_alloc(|| std::hint::black_box(Box::new(1u8)));
    });
    assert_eq!(
        allocates,
        Ended::Signal(libc::SIGABRT),
        "and a single byte from the heap is an abort"
    );
    assert_eq!(in_a_child(|| ()), Ended::Exit(0));
}
