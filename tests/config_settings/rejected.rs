//! Rejected settings: every command names the place, the value, the limit and the remedy.
use crate::config_settings::COMMANDS;
use bench_config::{Source, load, whole};

use crate::config_settings::program::Bench;

/// Asserts that every command rejects the file with all of the words, and creates no file.
fn assert_file_rejected(text: &str, words: &[&str]) {
    for command in COMMANDS {
        let bench = Bench::new();
        bench.write("mine.toml", text);
        bench
            .run(&format!("{command} --config mine.toml --json"))
            .is_refused(words);
        assert_eq!(bench.files(), ["mine.toml"], "bench {command}");
    }
}

/// Asserts that every command rejects the setting with all of the words, and creates no file.
fn assert_set_rejected(set: &str, words: &[&str]) {
    for command in COMMANDS {
        let bench = Bench::new();
        let arguments = command.split(' ').chain(["--set", set, "--json"]);
        bench
            .run_with(arguments)
            .is_refused(&[words, &["--set"]].concat());
        assert_eq!(bench.files(), [""; 0], "bench {command}");
    }
}

#[test]
fn rejects_unknown_key_with_line_and_nearest_name() {
    assert_file_rejected(
        "[plant]\nmass_asymetry = 0.1\n",
        &[
            "mine.toml line 2",
            "`plant.mass_asymetry`",
            "`mass_asymmetry`",
        ],
    );
    assert_file_rejected(
        "\n[interlok]\nsoft_limit_m = 1e-4\n",
        &["mine.toml line 2", "`interlok`", "`interlock`"],
    );
    assert_set_rejected(
        "plant.mass_asymetry=0.1",
        &["`plant.mass_asymetry`", "`mass_asymmetry`"],
    );
    assert_set_rejected(
        "plant.damping.ratoi=0.1",
        &["`plant.damping.ratoi`", "nearest is"],
    );
}

#[test]
fn rejects_names_of_interface_and_port_that_linux_does_not_allow() {
    let bench = Bench::new();
    let check = |set: &str, words: &[&str]| {
        let arguments = ["config", "check", "--config", "lab", "--set", set];
        bench.run_with(arguments).is_refused(words);
    };
    let long = format!("amplifier.device.interface={}", "a".repeat(300));
    let (few, many) = ("has 0 characters", "has 300 characters");
    check("amplifier.device.interface=", &[few, "1 to 15 characters"]);
    check(&long, &["`amplifier.device.interface`", many, "1 to 15"]);
    check("probe.device.line.port=", &[few, "1 to 4095 characters"]);
    bench.json("config check --config lab --set amplifier.device.interface=abcdefghijklmno");
}

#[test]
fn rejects_a_second_line_and_too_many_parts_in_set() {
    let bench = Bench::new();
    let deep = format!("{}rate_hz=1", "loop.".repeat(16_000));
    for (set, words) in [
        (
            "loop.rate_hz=2000\nloop.priority=3",
            ["more than one line", "KEY=VALUE"],
        ),
        (&deep, ["more than 32 parts", "KEY=VALUE"]),
    ] {
        let arguments = ["config", "show", "--set", set];
        bench.run_with(arguments).is_refused(&words);
    }
}

#[test]
fn rejects_a_file_with_a_hundred_thousand_unknown_keys() {
    let bench = Bench::new();
    let keys: String = (0..100_000).map(|k| format!("k{k}=1\n")).collect();
    bench.write("keys.toml", keys);
    bench
        .run("config check --config keys.toml")
        .is_refused(&["50 errors or more", "`k0`"]);
    bench.write("large.toml", "#".repeat((1 << 20) + 1));
    bench
        .run("config check --config large.toml")
        .is_refused(&["large.toml", "limit of 1048576 bytes"]);
}

#[test]
fn rejects_measured_damping_ratios_without_positive_damping() {
    let second = "plant.damping.second.omega_rad_s";
    // Two ratios at the same frequency: the equations of the two Rayleigh coefficients have no solution.
    assert_set_rejected(
        &format!("{second}=179"),
        &["plant.damping.second.omega_rad_s", "179 rad/s", "uniform"],
    );
    // Negative damping below z1 w1/w2 = 0.009 x 179/520 or above z1 w2/w1 = 0.009 x 520/179.
    for ratio in ["0.003", "0.03"] {
        assert_set_rejected(
            &format!("plant.damping.second.ratio={ratio}"),
            &["179 rad/s", "520 rad/s", ratio, "3.0981e-3", "2.6145e-2"],
        );
    }
    // At nearly equal frequencies, z2 = 0.004 of the profile is not between z1 w1/w2 and z1 w2/w1, both near 0.009.
    for (omega_rad_s, limit) in [("179.0000001", "9.0000e-3"), ("180", "8.9500e-3")] {
        let set = format!("{second}={omega_rad_s}");
        Bench::new()
            .run_with(["chirp", "--plan", "--json", "--set", &set])
            .is_refused(&["`plant.damping.second.ratio`", "0.004", omega_rad_s, limit]);
    }
}

#[test]
fn rejects_wrong_type_with_value_and_expected_type() {
    assert_file_rejected(
        "[loop]\nrate_hz = true\n",
        &[
            "mine.toml line 2",
            "`loop.rate_hz`",
            "true",
            "give a number",
        ],
    );
    assert_file_rejected(
        "title = 3\n",
        &["mine.toml line 1", "`title`", "is 3", "give a string"],
    );
    assert_set_rejected(
        "loop.computing_delay_periods=1.5",
        &["is 1.5", "give an integer"],
    );
    assert_set_rejected(
        "chirp.amplitude=3",
        &["`chirp.amplitude`", "is 3", "give an array"],
    );
    assert_set_rejected("plant.mass_asymmetry=yes", &["\"yes\"", "give a number"]);
}

#[test]
fn rejects_unit_in_file_and_suggests_si_value() {
    assert_file_rejected(
        "[plant]\noperating_point_m = \"3.8mm\"\n",
        &["mine.toml line 2", "\"3.8mm\"", "SI units", "write 0.0038"],
    );
}

#[test]
fn rejects_unit_of_another_quantity() {
    assert_set_rejected(
        "plant.operating_point_m=4s",
        &["`4s` is a time in s", "50um"],
    );
    assert_set_rejected(
        "interlock.soft_limit_m=4%",
        &["`4%` is a percentage", "a length"],
    );
    assert_set_rejected(
        "loop.rate_hz=5mm",
        &["`loop.rate_hz`", "`5mm` is a length in m"],
    );
}

#[test]
fn rejects_value_out_of_range_with_limits() {
    assert_file_rejected(
        "[loop]\nrate_hz = 0\n",
        &["mine.toml line 2", "`loop.rate_hz` is 0", "1 to 100000"],
    );
    assert_set_rejected(
        "plant.motion_stage_mass_kg=-1",
        &["`plant.motion_stage_mass_kg` is -1", "0.000001 to 1000"],
    );
    assert_set_rejected(
        "plant.mass_asymmetry=nan",
        &["`plant.mass_asymmetry` is NaN", "-0.9 to 9"],
    );
    assert_set_rejected("plant.mass_asymmetry=inf", &["is inf", "-0.9 to 9"]);
    assert_set_rejected("chirp.amplitude=[]", &["has 0 entries", "1 to 64"]);
}

/// Asserts that `chirp` and `config check` reject a setting of the excitation, and that `margins` accepts it.
fn assert_chirp_rejected(set: &str, words: &[&str]) {
    for command in ["chirp", "config check"] {
        let bench = Bench::new();
        bench
            .run_with(command.split(' ').chain(["--set", set, "--json"]))
            .is_refused(words);
        assert_eq!(bench.files(), [""; 0], "bench {command}");
    }
    let answer = Bench::new().run_with(["margins", "--set", set]);
    assert_eq!(
        answer.code, 0,
        "margins do not depend on the chirp: {}",
        answer.err
    );
}

#[test]
fn rejects_conflicting_settings_with_both_values() {
    assert_chirp_rejected(
        "chirp.stop_hz=2500",
        &["`chirp.stop_hz`", "2500 Hz", "half the servo rate"],
    );
    assert_chirp_rejected(
        "loop.rate_hz=1000",
        &["`chirp.stop_hz`", "500 Hz", "half the servo rate"],
    );
    assert_chirp_rejected(
        "chirp.stop_hz=0.1",
        &["`chirp.stop_hz` is 0.1 Hz", "starts at 0.1 Hz"],
    );
    assert_set_rejected(
        "interlock.soft_limit_m=0.001",
        &["`interlock.soft_limit_m`", "0.001 m", "inside the stop"],
    );
    assert_file_rejected(
        "[interlock]\nsoft_limit_m = 0.0009\n[probe]\nrange_m = 0.0017\n",
        &[
            "mine.toml line 2: `interlock.soft_limit_m`",
            "0.00085 m",
            "0.0009 m",
            "probe.range_m",
        ],
    );
    assert_set_rejected("motor.continuous_force_n=112", &["112 N", "111 N"]);
    assert_chirp_rejected(
        "chirp.duration_s=5.4",
        &["`chirp.duration_s`", "5.4 s", "5.5 s"],
    );
    assert_set_rejected(
        "plant.operating_point_m=-0.05",
        &["`plant.operating_point_m`", "-0.05 m", "0.0475 m"],
    );
    assert_chirp_rejected(
        "chirp.duration_s=4000",
        &[
            "`chirp.duration_s`",
            "4000 s",
            "20050000",
            "20000000",
            "shorten",
        ],
    );
    assert_set_rejected(
        "interlock.probe_stale_s=1e-4",
        &[
            "`interlock.probe_stale_s`",
            "0.0001 s",
            "a tick of 0.0002 s",
        ],
    );
}

#[test]
fn accepts_settings_just_inside_the_limits() {
    for set in [
        "chirp.stop_hz=2499",
        "interlock.soft_limit_m=0.00099",
        "probe.range_m=0.0018",
        "motor.continuous_force_n=111",
        "chirp.duration_s=5.5",
        "plant.operating_point_m=-0.0475",
        "chirp.duration_s=3990",
        "loop.rate_hz=1001",
        "interlock.probe_stale_s=2e-4",
    ] {
        let answer = Bench::new().run(&format!("config check --set {set}"));
        assert_eq!(answer.code, 0, "{set}: {}", answer.err);
    }
}

#[test]
fn rejects_unknown_kind_and_lists_valid_kinds() {
    assert_file_rejected(
        "[plant]\nmodel = \"sr5dof\"\n",
        &["mine.toml line 2", "`plant.model`", "\"sr5dof\"", "sr4dof"],
    );
    assert_set_rejected(
        "plant.damping.kind=foo",
        &[
            "`plant.damping.kind`",
            "\"foo\"",
            "measured, rayleigh, uniform",
        ],
    );
    assert_set_rejected("chirp.sweep=up", &["`chirp.sweep`", "linear, logarithmic"]);
    assert_set_rejected(
        "control.reference.kind=foo",
        &["hold, step, ramp, sine, square, triangle, s_curve, random, chirp, file"],
    );
    assert_set_rejected("plant=3", &["`plant.model` is missing", "sr4dof"]);
}

#[test]
fn missing_key_is_reported_at_line_of_its_table() {
    let file = "title = \"x\"\n[plant.damping]\nkind = \"uniform\"\n";
    assert_file_rejected(
        file,
        &["mine.toml line 2", "`plant.damping.ratio` is missing"],
    );
    assert_set_rejected(
        "control.reference.kind=ramp",
        &["  --set: `control.reference.speed_m_per_s` is missing"],
    );
    // The list replaces that of the profile, so the key is missing in `--set`.
    assert_set_rejected(
        "sim.unmodelled=[{frequency_hz=200}]",
        &["  --set: `sim.unmodelled.0.damping_ratio` is missing"],
    );
}

#[test]
fn reports_all_errors_together() {
    let text = "[plant]\nmass_asymmetry = \"10%\"\n[loop]\nrate_hz = 0\n[plat]\n";
    assert_file_rejected(
        text,
        &[
            "line 2: `plant.mass_asymmetry`",
            "line 4: `loop.rate_hz`",
            "line 5: `plat`",
        ],
    );
}

#[test]
fn rejects_invalid_toml_with_line_and_column() {
    assert_file_rejected("[plant]\nmodel = [\n", &["mine.toml", "line 2, column 10"]);
    assert_file_rejected("[plant\n", &["mine.toml", "line 1, column 7"]);
    assert_set_rejected("no equals sign", &["no equals sign", "KEY=VALUE"]);
    assert_set_rejected("=3", &["empty part"]);
    assert_set_rejected("plant..model=3", &["plant..model", "empty part"]);
}

#[test]
fn rejects_unknown_configuration_and_lists_names() {
    for command in COMMANDS {
        let bench = Bench::new();
        for name in ["nosuch", "nosuch.toml", "folder/nosuch.toml"] {
            bench
                .run(&format!("{command} --config {name}"))
                .is_refused(&[name, "stage", "chapter2", "path"]);
        }
        bench
            .run(&format!("{command} --config ."))
            .is_refused(&["cannot read .", "directory"]);
        assert_eq!(bench.files(), [""; 0]);
    }
}

/// Checks the profile `lab` with these settings.
fn check_lab(sets: &[&str]) -> crate::config_settings::program::Answer {
    let sets = sets.iter().flat_map(|set| ["--set", *set]);
    Bench::new().run_with(
        ["config", "check", "--config", "lab"]
            .into_iter()
            .chain(sets),
    )
}

/// The gain of the mounting is applied below the interlocks: it has the limits of a calibration.
#[test]
fn rejects_unconfirmed_gain_of_the_mounting_outside_the_limits_of_a_calibration() {
    for gain in [
        "0.02", "0.7499", "1.2501", "-0.7499", "-1.2501", "50", "-1000",
    ] {
        let set = format!("probe.device.mounting.gain={gain}");
        let words = [
            "`probe.device.mounting.gain`",
            gain,
            "0.75 to 1.25",
            "calibration.accepted_by",
        ];
        check_lab(&[&set]).is_refused(&words);
        check_lab(&[&set, "calibration.accepted_by= "])
            .is_refused(&["`calibration.accepted_by` is blank"]);
    }
    for gain in ["0", "0.0009", "-0.0009"] {
        let set = format!("probe.device.mounting.gain={gain}");
        check_lab(&[&set, "calibration.accepted_by=A. Smith"])
            .is_refused(&["`probe.device.mounting.gain`", "-0.001 and 0.001"]);
    }
}

#[test]
fn confirmed_gain_of_the_mounting_is_accepted_with_a_warning_that_names_the_person() {
    let named = "calibration.accepted_by=A. Smith";
    let check = check_lab(&[
        "probe.device.mounting.gain=1.3",
        "probe.device.mounting.offset_m=-0.0013",
        named,
    ]);
    assert_eq!(check.code, 0, "{}", check.err);
    assert!(
        check.err.contains("mounting.gain = 1.3") && check.err.contains("confirmed by A. Smith"),
        "{}",
        check.err
    );
    for (gain, offset) in [("1.25", "-0.00125"), ("0.95", "-0.00095"), ("-1", "0.001")] {
        let sets = [
            format!("probe.device.mounting.gain={gain}"),
            format!("probe.device.mounting.offset_m={offset}"),
        ];
        let check = check_lab(&[&sets[0], &sets[1]]);
        assert_eq!((check.code, check.err.as_str()), (0, ""), "{gain}");
    }
}

/// A range that is smaller than the permitted travel, a centre that is far from position 0: the travel could not be measured.
#[test]
fn rejects_scale_of_a_probe_that_does_not_cover_the_permitted_travel() {
    for (sets, ends) in [
        (
            &["probe.device.sensor_range_m=0.0002"][..],
            "-1.000000 to -0.800000 mm",
        ),
        (
            &[
                "probe.device.sensor_range_m=0.0002",
                "probe.device.mounting.offset_m=-0.0001",
            ],
            "-0.100000 to 0.100000 mm",
        ),
        (
            &["probe.device.mounting.offset_m=0"],
            "0.000000 to 2.000000 mm",
        ),
        (
            &["probe.device.mounting.gain=-1"],
            "-3.000000 to -1.000000 mm",
        ),
        (
            &[
                "interlock.soft_limit_m=0.00095",
                "probe.device.mounting.offset_m=-0.0009",
            ],
            "-0.900000 to 1.100000 mm",
        ),
    ] {
        check_lab(sets).is_refused(&[
            "`probe.device.mounting`",
            ends,
            "permitted travel",
            "interlock.soft_limit_m",
        ]);
    }
}

/// Recordings of earlier versions may have such a gain.
#[test]
fn recorded_gain_of_the_mounting_is_read() {
    let lab = Source {
        config: Some("lab".into()),
        ..Source::default()
    };
    let text = toml::to_string(&load(&lab).expect("valid")).expect("TOML");
    let recorded = text.replace("gain = 1.0", "gain = 0.02");
    assert_ne!(text, recorded);
    whole("recorded.toml", &recorded).expect("readable");
}

/// The monitor of the residuals must trip within a quarter of the travel limit L. With a permitted residual of a L + b |y_p|, a
/// position that stays at rest trips at a/(1 - b), and an oscillation about a modelled motion of L/4 at (a + 0.4 b/4)/0.8.
#[test]
fn rejects_ineffective_monitor_of_the_residuals_without_a_reason() {
    for (ratio, share, setting) in [
        ("1", "2", "model_error_share"),
        ("0.02", "1", "model_error_share"),
        ("0.02", "0.93", "model_error_share"),
        ("1e-6", "2", "model_error_share"),
        ("1", "0.05", "model_error_ratio"),
        ("0.126", "0.5", "model_error_ratio"),
        ("0.1951", "0.05", "model_error_ratio"),
        ("0.063", "0.75", "model_error_ratio"),
    ] {
        let ratio = format!("interlock.model_error_ratio={ratio}");
        let share = format!("interlock.model_error_share={share}");
        let path = format!("`interlock.{setting}`");
        check_lab(&[&ratio, &share]).is_refused(&[
            &path,
            "ineffective",
            "25 %",
            "interlock.model_error_off",
        ]);
        let reason = "interlock.model_error_off=first chirp";
        let check = check_lab(&[&ratio, &share, reason]);
        assert_eq!(check.code, 0, "{}", check.err);
        assert!(
            check
                .err
                .contains("not compared with the model (first chirp)"),
            "{}",
            check.err
        );
    }
    for (ratio, share) in [
        ("0.125", "0.5"),
        ("0.1949", "0.05"),
        ("0.0625", "0.75"),
        ("0.02", "0.91"),
    ] {
        let ratio = format!("interlock.model_error_ratio={ratio}");
        let share = format!("interlock.model_error_share={share}");
        assert_eq!(check_lab(&[&ratio, &share]).code, 0, "{ratio} {share}");
    }
}

#[test]
fn warns_of_limits_of_current_that_never_trip() {
    for (set, words) in [
        (
            "interlock.current_error_a=2",
            "current_error_a = 2 A never trips",
        ),
        (
            "interlock.probe_stuck_current_a=4",
            "probe_stuck_current_a = 4 A never trips",
        ),
    ] {
        let check = check_lab(&[set]);
        assert_eq!(check.code, 0, "{}", check.err);
        assert!(check.err.contains(words), "{}", check.err);
    }
}

/// A dummy mode of 0.06 rad/s with a negligible residue would make the low-pass of the monitor slower than the run.
#[test]
fn rejects_run_whose_model_makes_the_monitor_slow() {
    let modal = |dummy_rad_s: f64| {
        format!(
            "[plant]\nmodel = \"modal\"\n[plant.modes]\n\
             dummy = {{ omega_rad_s = {dummy_rad_s}, residue_per_kg = 1e-9, damping_ratio = 0.01 }}\n\
             first = {{ omega_rad_s = 180.0, residue_per_kg = 1.0, damping_ratio = 0.01 }}\n"
        )
    };
    let bench = Bench::new();
    bench.write("slow.toml", modal(0.06));
    bench.write("fast.toml", modal(20.0));
    let check = |arguments: &str| bench.run(&format!("config check --config {arguments}"));
    check("slow.toml").is_refused(&[
        "`plant`",
        "6.000e-2 rad/s",
        "1.800e2 rad/s",
        "interlock.model_error_off",
    ]);
    assert_eq!(
        check("slow.toml --set interlock.model_error_off=known").code,
        0
    );
    let fast = check("fast.toml");
    assert_eq!(fast.code, 0, "{}", fast.err);
}
