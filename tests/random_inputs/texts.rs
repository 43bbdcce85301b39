//! Configurations, controllers, calibrations.

use std::time::SystemTime;

use bench_config::{Config, Source, load, whole};
use bench_control::{ControllerText, LawInput};
use bench_rig::calibration::{KnownDevices, load_calibration};

use crate::random_inputs::damage::{check_damaged, check_damaged_text};

const STAGE: &str = include_str!("../../bench-config/stage.toml");

const TF: &str = "title = \"tf\"\n[tf]\ngain_unit = \"A/um\"\nnumerator = [2.5, 300, 4e4]\ndenominator = [1, 800.5, 2e5, 0]\n";
const ZPK: &str = "title = \"zpk\"\n[zpk]\ngain_unit = \"A/m\"\nrate_hz = 5000\nzeros = [[-1, 0]]\npoles = [[0.9, 0.1], [0.9, -0.1], [1, 0]]\ngain = 0.25\n";
const SS: &str = "title = \"ss\"\n[ss]\ngain_unit = \"A/m\"\na = [[-30, 400, 0], [-400, -30, 1], [0, 0, -5]]\nb = [0, 1, 2.5]\nc = [1e3, 0, -1]\nd = 0.5\n";

fn stage() -> Config {
    load(&Source::default()).expect("the profile is valid")
}

/// The limits that protect motor and stage are finite and within the ranges of `docs/`, however a file was damaged.
fn assert_usable(config: &Config) {
    let interlock = &config.interlock;
    assert!((1e-9..=1.0).contains(&interlock.soft_limit_m));
    assert!((1e-6..=10.0).contains(&interlock.probe_stale_s));
    assert!((1e-6..=1000.0).contains(&interlock.current_error_a));
    assert!(config.motor.peak_current_a() > 0.0 && config.motor.peak_current_a().is_finite());
    assert!(config.motor.continuous_current_a() > 0.0);
    assert!(config.motor.continuous_current_a() <= config.motor.peak_current_a());
    assert!(config.servo.rate_hz > 0.0 && config.servo.rate_hz.is_finite());
    assert!(config.motor.thermal_time_constant_s > 0.0);
}

#[test]
fn damaged_configuration_is_refused_or_usable() {
    let complete = toml::to_string(&stage()).expect("a configuration is TOML");
    check_damaged_text("configuration", &[STAGE, &complete], |text| {
        let Ok(config) = whole("random.toml", text) else {
            return false;
        };
        assert_usable(&config);
        let again = toml::to_string(&config).expect("a configuration is TOML");
        assert_eq!(whole("again.toml", &again).ok(), Some(config));
        true
    });
}

#[test]
fn damaged_controller_is_refused_or_gives_finite_current() {
    let files = [
        include_str!("../../bench-config/controllers/fast.toml"),
        include_str!("../../bench-config/controllers/slow.toml"),
        TF,
        ZPK,
        SS,
    ];
    check_damaged_text("controller", &files, |text| {
        let controller = ControllerText {
            name: "random.toml".into(),
            text: text.into(),
        };
        let Ok(design) = controller.design(5000.0) else {
            return false;
        };
        let mut law = design.law(1.0 / 5000.0);
        let input = LawInput {
            reference_m: 1e-6,
            ..LawInput::default()
        };
        assert!(!law.update(&input).is_nan());
        true
    });
}

#[test]
fn damaged_calibration_is_refused_or_within_its_limits() {
    let folder = tempfile::tempdir().expect("a folder");
    let path = folder.path().join("calibration.toml");
    let mut config = stage();
    config.calibration.file = Some(path.display().to_string());
    config.calibration.valid_days = 1e5;
    let valid = include_str!("calibration.toml").as_bytes();
    let devices = KnownDevices {
        amplifier: None,
        probe: None,
    };
    check_damaged("calibration", &[valid], |bytes| {
        std::fs::write(&path, bytes).expect("a file");
        let Ok(Some(loaded)) = load_calibration(&config, devices, SystemTime::now()) else {
            return false;
        };
        let (amplifier, probe) = (&loaded.calibration.amplifier, &loaded.calibration.probe);
        assert!((0.75..=1.25).contains(&amplifier.current_gain));
        assert!((0.75..=1.25).contains(&probe.gain.abs()));
        assert!(amplifier.current_offset_a.abs() <= config.interlock.current_error_a);
        assert!(probe.offset_m.is_finite());
        true
    });
}
