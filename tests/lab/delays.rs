//! Every setting of a latency, a rate or a delay: simulated runs complete, and the response has the delay that is set.
use std::collections::BTreeSet;
use std::f64::consts::{PI, TAU};

use bench_config::{Config, ConfigError, Purpose, Source, load, profiles, schema};
use bench_experiment::{Plan, closed_loop, run};
use bench_hal::{CurrentAmplifier, DisplacementProbe, Tick};
use bench_rig::simulated::SimulatedRig;
use bench_rt::thread::Pace;
use nalgebra::Complex;

const SIMULATED: [&str; 2] = [
    "amplifier.device={ kind = \"simulated\" }",
    "probe.device={ kind = \"simulated\" }",
];

/// The unit of the values of a setting.
#[derive(Clone, Copy, Debug)]
enum Unit {
    /// Ticks of the profile.
    Period,
    /// The rate of the profile.
    Rate,
    One,
}

/// Values of every setting of time or rate between a command and its reading.
const VALUES: [(&str, Unit, &[f64]); 6] = [
    (
        "amplifier.latency_s",
        Unit::Period,
        &[0.0, 0.005, 1.5, 10.0, 50.0],
    ),
    ("loop.computing_delay_periods", Unit::One, &[0.0, 1.0, 8.0]),
    ("loop.rate_hz", Unit::Rate, &[0.16, 0.666_66, 2.0]),
    (
        "probe.latency_s",
        Unit::Period,
        &[0.0, 0.005, 1.5, 10.0, 2000.0],
    ),
    ("probe.rate_hz", Unit::Rate, &[0.001, 0.026, 0.9998, 4.0]),
    ("probe.transport_s", Unit::Period, &[0.0, 0.7, 2.0, 2000.0]),
];

/// Several of them together.
const TOGETHER: [&[(&str, Unit, f64)]; 4] = [
    &[
        ("amplifier.latency_s", Unit::Period, 2.0),
        ("loop.computing_delay_periods", Unit::One, 0.0),
    ],
    &[
        ("amplifier.latency_s", Unit::Period, 2.0),
        ("probe.latency_s", Unit::Period, 1.3),
        ("probe.transport_s", Unit::Period, 1.0),
    ],
    &[
        ("amplifier.latency_s", Unit::Period, 5.5),
        ("probe.rate_hz", Unit::Rate, 0.5),
        ("probe.transport_s", Unit::Period, 0.5),
    ],
    &[
        ("amplifier.latency_s", Unit::Period, 9.0),
        ("loop.computing_delay_periods", Unit::One, 8.0),
        ("loop.stop_ramp_s", Unit::One, 0.0),
    ],
];

/// A value of a setting as text, for a profile with this rate.
fn set(rate_hz: f64, (key, unit, value): (&str, Unit, f64)) -> String {
    let value = match unit {
        Unit::Period => value / rate_hz,
        Unit::Rate => value * rate_hz,
        Unit::One => value,
    };
    format!("{key}={value}")
}

/// Length of a sweep in seconds, and its least ticks in a slow profile, whose stage is computed in thousands of steps per tick.
const SWEEP_S: f64 = 0.6;
const LEAST_TICKS: f64 = 200.0;

/// A sweep with little current, far below half of every rate that is tried.
fn short_sweep(rate_hz: f64) -> Vec<String> {
    let start_hz = 0.002 * rate_hz;
    let duration_s = SWEEP_S.max(LEAST_TICKS / rate_hz);
    vec![
        "excitation.kind=chirp".into(),
        format!("chirp.start_hz={start_hz}"),
        format!("chirp.stop_hz={}", 0.01 * rate_hz),
        format!("chirp.duration_s={duration_s}"),
        format!("chirp.fade_in_s={}", duration_s / 6.0),
        format!("chirp.fade_out_s={}", duration_s / 6.0),
        format!("chirp.quiet_before_s={}", duration_s / 12.0),
        format!("chirp.quiet_after_s={}", duration_s / 12.0),
        format!("chirp.amplitude=[{{ frequency_hz = {start_hz}, current_a = 0.004 }}]"),
    ]
}

/// The rate of a profile in hertz.
fn rate_hz(profile: &str) -> f64 {
    let config = loaded(profile, &[]).expect("a profile");
    config.servo.rate_hz
}

fn loaded(profile: &str, sets: &[&str]) -> Result<Config, ConfigError> {
    load(&Source {
        config: Some(profile.into()),
        sets: sets.iter().map(|set| set.to_string()).collect(),
        purpose: Purpose::Chirp,
        ..Source::default()
    })
}

/// Runs `plan` on the simulated stage. It must not trip.
fn completes(plan: &Plan, what: &str) {
    let folder = tempfile::tempdir().expect("a temporary folder");
    let rig = SimulatedRig::new(&plan.config).expect("a rig");
    let ended = run(
        plan,
        Box::new(rig),
        Pace::Virtual,
        folder.path(),
        &mut |_, _| {},
    );
    let trip = ended.expect("a run").end.servo.trip;
    assert_eq!(trip, None, "{what}");
}

/// A short sweep with these settings and values completes, or the configuration is refused with the name of `setting`.
fn completes_or_is_refused(profile: &str, values: &[(&str, Unit, f64)], setting: &str) -> bool {
    let rate_hz = rate_hz(profile);
    let mut sets: Vec<String> = SIMULATED.map(String::from).into();
    sets.extend(short_sweep(rate_hz));
    sets.extend(values.iter().map(|value| set(rate_hz, *value)));
    let sets: Vec<&str> = sets.iter().map(String::as_str).collect();
    match loaded(profile, &sets) {
        Ok(config) => completes(&Plan::chirp(config), &format!("{profile}: {values:?}")),
        Err(error) => {
            let text = error.to_string();
            assert!(text.contains(setting), "{profile}, {values:?}: {text}");
            return false;
        }
    }
    true
}

#[test]
fn chirp_completes_or_is_refused_by_name_with_every_delay_and_rate() {
    for profile in profiles::PROFILES {
        for (setting, unit, values) in VALUES {
            let completed = values.iter().filter(|value| {
                completes_or_is_refused(profile.name, &[(setting, unit, **value)], setting)
            });
            let least = if setting.starts_with("probe.rate") {
                1
            } else {
                2
            };
            assert!(completed.count() >= least, "{}: {setting}", profile.name);
        }
        for values in TOGETHER {
            completes_or_is_refused(profile.name, values, "interlock.probe_stale_s");
        }
    }
}

/// With a limit of the age that permits them, the longest delays are accepted and complete. Readings from before the first tick are those of
/// the stage at rest.
#[test]
fn chirp_completes_with_delays_of_a_second() {
    for setting in [
        "amplifier.latency_s",
        "probe.latency_s",
        "probe.transport_s",
    ] {
        let values = [
            (setting, Unit::One, 1.0),
            ("interlock.probe_stale_s", Unit::One, 10.0),
        ];
        assert!(completes_or_is_refused("stage", &values, ""), "{setting}");
    }
}

/// The limit of the age counts the largest age in normal operation, a clock of the probe that is slow by 0.1 % included.
#[test]
fn limit_of_the_age_within_the_tolerance_of_the_clock_of_the_probe_is_refused() {
    for (stale_s, is_accepted) in [(0.002_000_1, false), (0.002_001, false), (0.002_1, true)] {
        let values = [
            ("probe.rate_hz", Unit::One, 500.0),
            ("interlock.probe_stale_s", Unit::One, stale_s),
        ];
        let completed = completes_or_is_refused("stage", &values, "interlock.probe_stale_s");
        assert_eq!(completed, is_accepted, "{stale_s} s");
    }
}

#[test]
fn stable_loop_completes_with_every_delay() {
    let sets = [
        "control.controller=slow",
        "control.reference.amplitude_m=20um",
        "control.settle_s=0.1",
        "control.duration_s=0.6",
    ];
    let delays = [
        "amplifier.latency_s=0.0001",
        "amplifier.latency_s=0.0003",
        "amplifier.latency_s=0.001",
        "loop.computing_delay_periods=0",
        "loop.computing_delay_periods=4",
        "probe.latency_s=0.0003",
        "probe.transport_s=0.0005",
        "probe.rate_hz=2000",
    ];
    for delay in delays {
        let config = loaded("stage", &[&sets[..], &[delay]].concat()).expect("accepted");
        let model = closed_loop(&config).expect("a loop");
        assert!(model.is_stable(), "{delay}: chosen so");
        completes(&Plan::control(config).expect("a plan"), delay);
    }
}

/// Keys of numbers whose name is that of a time or rate of the signal path, in the tables of loop, amplifier, probe and simulation.
fn settings_of_delays() -> BTreeSet<String> {
    let schema = schema();
    let mut found = BTreeSet::new();
    for table in ["loop", "amplifier", "probe", "sim"] {
        let reference = schema["properties"][table]["$ref"]
            .as_str()
            .expect("a type");
        let definition = schema.pointer(&reference[1..]).expect("a definition");
        let keys = definition["properties"]
            .as_object()
            .expect("a table")
            .keys();
        let is_delay = |key: &&String| {
            let parts = ["latency", "transport", "delay", "rate_hz", "jitter", "age"];
            parts.iter().any(|part| key.contains(part))
        };
        found.extend(keys.filter(is_delay).map(|key| format!("{table}.{key}")));
    }
    found
}

#[test]
fn every_delay_and_rate_of_the_schema_is_tried() {
    let tried: BTreeSet<String> = VALUES.iter().map(|(key, ..)| key.to_string()).collect();
    assert_eq!(settings_of_delays(), tried);
}

/// Time constants pass, 0.11 s each, until the response to a pulse of 50 ms has decayed by 1e-7.
const RESPONSE_S: f64 = 1.9;
/// The frequency at which the phase is compared. Delays below half its period are unambiguous.
const PHASE_HZ: f64 = 4.0;

/// The quiet stage with 5 % damping.
fn quiet(sets: &[&str]) -> Config {
    let quiet = [
        "plant.damping={ kind = \"uniform\", ratio = 0.05 }",
        "sim.unmodelled=[]",
        "sim.floor=[]",
        "sim.probe_noise_rms_m=0",
        "sim.probe_quantisation_m=0",
        "interlock.probe_stale_s=1",
        "chirp.stop_hz=200",
    ];
    loaded("stage", &[&quiet[..], sets].concat()).expect("accepted")
}

/// The Fourier transform of the readings after half a sine of current of 50 ms, at [`PHASE_HZ`].
fn transformed(config: &Config) -> Complex<f64> {
    let mut rig = SimulatedRig::new(config).expect("a rig");
    rig.begin_enable().expect("simulated");
    let ticks = (RESPONSE_S * config.servo.rate_hz) as u64;
    let mut sum = Complex::default();
    for number in 0..ticks {
        let time_s = number as f64 * config.servo.period_s();
        let scheduled_ns = (time_s * 1e9) as u64;
        let reading = rig.latest(Tick {
            number,
            scheduled_ns,
        });
        let current_a = if time_s < 0.05 {
            0.1 * (PI * time_s / 0.05).sin()
        } else {
            0.0
        };
        rig.command(current_a).expect("enabled");
        sum += Complex::from_polar(reading.position_m, -TAU * PHASE_HZ * time_s);
    }
    sum
}

/// The delay of the response in seconds beyond that of the stage without delays.
fn measured_delay_s(sets: &[&str]) -> f64 {
    let direct = transformed(&quiet(&["loop.computing_delay_periods=0"]));
    let ratio = transformed(&quiet(sets)) / direct;
    -ratio.arg() / (TAU * PHASE_HZ)
}

/// Delays of the path, without the hold of a probe with its own clock, add up exactly. The rest of the response after the last
/// tick, 1e-7 of it, gives a phase of 1e-6 rad at most, which is 4e-8 s at 4 Hz; between its ticks the stage is computed in
/// steps of 20 us and interpolated, with the current as its mean over a step: 1e-6 s.
#[test]
fn measured_delay_is_the_sum_of_the_settings() {
    for (sets, expected_s) in [
        (&["loop.computing_delay_periods=1"][..], 2e-4),
        (&["loop.computing_delay_periods=8"], 1.6e-3),
        (
            &[
                "loop.computing_delay_periods=0",
                "amplifier.latency_s=0.0003",
            ],
            3e-4,
        ),
        (
            &["loop.computing_delay_periods=1", "amplifier.latency_s=0.01"],
            1.02e-2,
        ),
        (
            &["loop.computing_delay_periods=0", "probe.latency_s=0.00047"],
            4.7e-4,
        ),
        (
            &["loop.computing_delay_periods=0", "probe.transport_s=0.0123"],
            1.23e-2,
        ),
        (
            &[
                "loop.computing_delay_periods=2",
                "amplifier.latency_s=0.00033",
                "probe.latency_s=0.00021",
                "probe.transport_s=0.00051",
            ],
            4e-4 + 3.3e-4 + 2.1e-4 + 5.1e-4,
        ),
    ] {
        let measured_s = measured_delay_s(sets);
        assert!(
            (measured_s - expected_s).abs() < 1e-6,
            "{sets:?}: {measured_s} s"
        );
    }
}

/// A probe with its own clock adds half its period on average: its readings have all ages up to a period. With 5000/650 = 100/13 and
/// 5000/1900 = 50/19 ticks per period, the ages have 13 and 19 evenly spread values while the stage moves, whose mean is within half a step of
/// half the period: 1/26 and 1/38, below 5 % of the period.
#[test]
fn probe_with_its_own_clock_adds_half_its_period() {
    for (rate, rate_hz) in [("probe.rate_hz=650", 650.0), ("probe.rate_hz=1900", 1900.0)] {
        let sets = [
            "loop.computing_delay_periods=0",
            "amplifier.latency_s=0.0004",
            rate,
        ];
        let (measured_s, expected_s) = (measured_delay_s(&sets), 4e-4 + 0.5 / rate_hz);
        assert!(
            (measured_s - expected_s).abs() < 0.05 / rate_hz,
            "{rate}: {measured_s} s, {expected_s} s"
        );
    }
}
