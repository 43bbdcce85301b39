//! Settings: three layers of TOML, one schema, and messages that say where, what, the limit and the remedy.

use bench_test_support::program;

use std::path::{Path, PathBuf};
use std::process::{Command, Stdio};

use program::{Bench, number};
use serde_json::{Value, json};

/// Everything that `bench` is told to do with a setting before it uses it.
const COMMANDS: [&str; 5] = ["config check", "model modes", "margins", "chirp", "control"];

fn bench_config() -> PathBuf {
    Path::new(env!("CARGO_MANIFEST_DIR")).join("bench-config")
}

/// The TOML files of a folder.
fn toml_files(folder: &Path) -> Vec<PathBuf> {
    let entries = std::fs::read_dir(folder)
        .expect("the folder")
        .map(|entry| entry.expect("an entry").path());
    let mut files: Vec<PathBuf> = entries
        .filter(|path| path.extension().is_some_and(|e| e == "toml"))
        .collect();
    files.sort();
    files
}

/// Every command refuses the file, with all of the words, and leaves nothing behind.
fn refused_file(text: &str, words: &[&str]) {
    for command in COMMANDS {
        let bench = Bench::new();
        bench.write("mine.toml", text);
        bench
            .run(&format!("{command} --config mine.toml --json"))
            .is_refused(words);
        assert_eq!(bench.files(), ["mine.toml"], "bench {command}");
    }
}

/// Every command refuses the setting, with all of the words, and leaves nothing behind.
fn refused_set(set: &str, words: &[&str]) {
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
fn an_unknown_key_is_refused_with_its_line_and_the_nearest_name() {
    refused_file(
        "[plant]\nmass_asymetry = 0.1\n",
        &[
            "mine.toml line 2",
            "`plant.mass_asymetry`",
            "`mass_asymmetry`",
        ],
    );
    refused_file(
        "\n[interlok]\nsoft_limit_m = 1e-4\n",
        &["mine.toml line 2", "`interlok`", "`interlock`"],
    );
    refused_set(
        "plant.mass_asymetry=0.1",
        &["`plant.mass_asymetry`", "`mass_asymmetry`"],
    );
    refused_set(
        "plant.damping.ratoi=0.1",
        &["`plant.damping.ratoi`", "nearest is"],
    );
}

#[test]
fn measured_damping_ratios_without_positive_damping_are_refused() {
    let second = "plant.damping.second.omega_rad_s";
    // Two ratios at one frequency: the equations of the two Rayleigh coefficients have no solution.
    refused_set(
        &format!("{second}=179"),
        &["plant.damping.second.omega_rad_s", "179 rad/s", "uniform"],
    );
    // Negative damping below z1 w1/w2 = 0.009 x 179/520 or above z1 w2/w1 = 0.009 x 520/179.
    for ratio in ["0.003", "0.03"] {
        refused_set(
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
fn a_wrong_type_is_refused_with_what_is_there_and_what_belongs_there() {
    refused_file(
        "[loop]\nrate_hz = true\n",
        &[
            "mine.toml line 2",
            "`loop.rate_hz`",
            "true",
            "a number is expected",
        ],
    );
    refused_file(
        "title = 3\n",
        &[
            "mine.toml line 1",
            "`title`",
            "is 3",
            "a string is expected",
        ],
    );
    refused_set(
        "loop.computing_delay_periods=1.5",
        &["is 1.5", "an integer is expected"],
    );
    refused_set(
        "chirp.amplitude=3",
        &["`chirp.amplitude`", "is 3", "an array is expected"],
    );
    refused_set(
        "plant.mass_asymmetry=yes",
        &["\"yes\"", "a number is expected"],
    );
}

#[test]
fn a_unit_in_a_file_is_refused_with_the_number_in_si_units() {
    refused_file(
        "[plant]\noperating_point_m = \"3.8mm\"\n",
        &["mine.toml line 2", "\"3.8mm\"", "SI units", "write 0.0038"],
    );
}

#[test]
fn a_unit_in_a_set_value_is_converted() {
    let bench = Bench::new();
    for (set, pointer, expected) in [
        (
            "plant.operating_point_m=4%",
            "/plant/operating_point_m",
            0.04 * 0.0475,
        ),
        (
            "plant.operating_point_m=3.8mm",
            "/plant/operating_point_m",
            3.8 * 1e-3,
        ),
        ("plant.mass_asymmetry=10%", "/plant/mass_asymmetry", 0.1),
        ("loop.rate_hz=2kHz", "/loop/rate_hz", 2000.0),
        (
            "interlock.current_error_s=50ms",
            "/interlock/current_error_s",
            50.0 * 1e-3,
        ),
        (
            "motor.force_constant_n_per_a=11",
            "/motor/force_constant_n_per_a",
            11.0,
        ),
    ] {
        let shown = bench.json(&format!("config show --set {set}"));
        let value = number(shown.pointer(pointer).expect("a setting"));
        assert_eq!(value, expected, "{set}");
    }
}

#[test]
fn rejects_a_unit_that_does_not_belong_to_the_setting() {
    refused_set(
        "plant.operating_point_m=4s",
        &["`4s` is a time in s", "50um"],
    );
    refused_set(
        "interlock.soft_limit_m=4%",
        &["`4%` is a percentage", "a length"],
    );
    refused_set(
        "loop.rate_hz=5mm",
        &["`loop.rate_hz`", "`5mm` is a length in m"],
    );
}

#[test]
fn a_value_out_of_range_is_refused_with_the_limits() {
    refused_file(
        "[loop]\nrate_hz = 0\n",
        &["mine.toml line 2", "`loop.rate_hz` is 0", "1 to 100000"],
    );
    refused_set(
        "plant.motion_stage_mass_kg=-1",
        &["`plant.motion_stage_mass_kg` is -1", "0.000001 to 1000"],
    );
    refused_set(
        "plant.mass_asymmetry=nan",
        &["`plant.mass_asymmetry` is NaN", "-0.9 to 9"],
    );
    refused_set("plant.mass_asymmetry=inf", &["is inf", "-0.9 to 9"]);
    refused_set("chirp.amplitude=[]", &["has 0 entries", "1 to 64"]);
}

/// What concerns the excitation alone stands in the way of a chirp and of a full check, and of nothing else.
fn refused_chirp(set: &str, words: &[&str]) {
    for command in ["chirp", "config check"] {
        let bench = Bench::new();
        bench
            .run_with(command.split(' ').chain(["--set", set, "--json"]))
            .is_refused(words);
        assert_eq!(bench.files(), [""; 0], "bench {command}");
    }
    let answer = Bench::new().run_with(["margins", "--set", set]);
    assert_eq!(answer.code, 0, "margins know no chirp: {}", answer.err);
}

#[test]
fn settings_that_contradict_each_other_are_refused_with_both_figures() {
    refused_chirp(
        "chirp.stop_hz=2500",
        &["`chirp.stop_hz`", "2500 Hz", "half the servo rate"],
    );
    refused_chirp(
        "loop.rate_hz=1000",
        &["`chirp.stop_hz`", "500 Hz", "half the servo rate"],
    );
    refused_chirp(
        "chirp.stop_hz=0.1",
        &["`chirp.stop_hz` is 0.1 Hz", "starts at 0.1 Hz"],
    );
    refused_set(
        "interlock.soft_limit_m=0.001",
        &["`interlock.soft_limit_m`", "0.001 m", "inside the stop"],
    );
    refused_file(
        "[interlock]\nsoft_limit_m = 0.0009\n[probe]\nrange_m = 0.0017\n",
        &[
            "mine.toml line 2: `interlock.soft_limit_m`",
            "0.00085 m",
            "0.0009 m",
            "probe.range_m",
        ],
    );
    refused_set("motor.continuous_force_n=112", &["112 N", "111 N"]);
    refused_chirp(
        "chirp.duration_s=5.4",
        &["`chirp.duration_s`", "5.4 s", "5.5 s"],
    );
    refused_set(
        "plant.operating_point_m=-0.05",
        &["`plant.operating_point_m`", "-0.05 m", "0.0475 m"],
    );
    refused_chirp(
        "chirp.duration_s=4000",
        &[
            "`chirp.duration_s`",
            "4000 s",
            "20050000",
            "20000000",
            "shorten",
        ],
    );
    refused_set(
        "interlock.probe_stale_s=1e-4",
        &[
            "`interlock.probe_stale_s`",
            "0.0001 s",
            "a tick of 0.0002 s",
        ],
    );
}

#[test]
fn settings_just_inside_the_limits_are_taken() {
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
fn an_unknown_kind_is_refused_with_the_kinds_there_are() {
    refused_file(
        "[plant]\nmodel = \"sr5dof\"\n",
        &["mine.toml line 2", "`plant.model`", "\"sr5dof\"", "sr4dof"],
    );
    refused_set(
        "plant.damping.kind=foo",
        &[
            "`plant.damping.kind`",
            "\"foo\"",
            "measured, rayleigh, uniform",
        ],
    );
    refused_set("chirp.sweep=up", &["`chirp.sweep`", "linear, logarithmic"]);
    refused_set(
        "control.reference.kind=foo",
        &["hold, step, ramp, sine, chirp, file"],
    );
    refused_set("plant=3", &["`plant.model` is missing", "sr4dof"]);
}

#[test]
fn a_key_that_is_missing_is_looked_for_where_its_table_stands() {
    let file = "title = \"x\"\n[plant.damping]\nkind = \"uniform\"\n";
    refused_file(
        file,
        &["mine.toml line 2", "`plant.damping.ratio` is missing"],
    );
    refused_set(
        "control.reference.kind=ramp",
        &["  --set: `control.reference.speed_m_per_s` is missing"],
    );
    // The list takes the place of the profile's: it is the one that lacks the key.
    refused_set(
        "sim.unmodelled=[{frequency_hz=200}]",
        &["  --set: `sim.unmodelled.0.damping_ratio` is missing"],
    );
}

#[test]
fn all_that_is_wrong_is_told_at_once() {
    let text = "[plant]\nmass_asymmetry = \"10%\"\n[loop]\nrate_hz = 0\n[plat]\n";
    refused_file(
        text,
        &[
            "line 2: `plant.mass_asymmetry`",
            "line 4: `loop.rate_hz`",
            "line 5: `plat`",
        ],
    );
}

#[test]
fn text_that_is_not_toml_is_refused_with_line_and_column() {
    refused_file("[plant]\nmodel = [\n", &["mine.toml", "line 2, column 10"]);
    refused_file("[plant\n", &["mine.toml", "line 1, column 7"]);
    refused_set("no equals sign", &["no equals sign", "KEY=VALUE"]);
    refused_set("=3", &["empty part"]);
    refused_set("plant..model=3", &["plant..model", "empty part"]);
}

#[test]
fn a_configuration_that_is_not_there_is_refused_with_the_names_there_are() {
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

#[test]
fn a_controller_file_is_checked_like_a_configuration() {
    let section = |body: &str| format!("title = \"x\"\n[[section]]\n{body}\n");
    let cases: &[(String, &[&str])] = &[
        (
            section("kind = \"gain\"\ngain_a_per_umm = 1"),
            &["line 4", "`section.0.gain_a_per_umm`", "`gain_a_per_um`"],
        ),
        (
            section("kind = \"gian\"\ngain_a_per_um = 1"),
            &["line 3", "\"gian\"", "gain, integrator"],
        ),
        (
            section("kind = \"gain\""),
            &["line 2", "`section.0.gain_a_per_um` is missing"],
        ),
        (
            section("kind = \"gain\"\ngain_a_per_um = true"),
            &["line 4", "true", "a number is expected"],
        ),
        (
            section("kind = \"gain\"\ngain_a_per_um = nan"),
            &["line 4", "NaN", "1000000000000"],
        ),
        (
            section("kind = \"pole\"\npole_rad_s = -5"),
            &["section 1", "unstable", "5.0000"],
        ),
        (
            section("kind = \"pole_pair\"\nomega_rad_s = 5\ndamping_ratio = 0"),
            &["section 1", "unstable", "5.0000j"],
        ),
        (
            section("kind = \"coefficients\"\nnumerator = [1, 0, 0]\ndenominator = [1, 1]"),
            &["section 1", "improper", "order 2", "add a pole"],
        ),
        (
            section("kind = \"coefficients\"\nnumerator = [1]\ndenominator = [0]"),
            &["section 1", "denominator of zeros"],
        ),
        (
            section("kind = \"coefficients\"\nnumerator = [1,2,3,4]\ndenominator = [1]"),
            &["has 4 entries", "1 to 3"],
        ),
        (
            section(
                "kind = \"biquad\"\nzeros_rad_s = 1\nzeros_damping_ratio = 1\npoles_rad_s = 1\npoles_damping_ratio = 1\nprewarp_rad_s = 20000",
            ),
            &["section 1", "20000 rad/s", "15708.0 rad/s"],
        ),
        (
            "title = \"x\"\nsection = []\n".into(),
            &["line 2", "`section` has 0 entries", "1 to 32"],
        ),
        (
            "title = \"x\"\n".into(),
            &["own.toml: `section` is missing"],
        ),
        (
            String::new(),
            &["own.toml: `title` is missing", "`section` is missing"],
        ),
        ("title = [\n".into(), &["own.toml", "line 1, column 10"]),
    ];
    for (text, words) in cases {
        let bench = Bench::new();
        bench.write("own.toml", text);
        for command in ["margins", "control"] {
            bench
                .run(&format!("{command} --controller own.toml --json"))
                .is_refused(&[words, &["own.toml"][..]].concat());
        }
        assert_eq!(bench.files(), ["own.toml"], "{text}");
    }
    Bench::new()
        .run("margins --controller nosuch")
        .is_refused(&["nosuch", "fast, slow"]);
}

#[test]
fn the_schema_file_is_current() {
    // To renew it: cargo run -- config schema > bench-config/schema.json
    let file = std::fs::read_to_string(bench_config().join("schema.json"))
        .expect("bench-config/schema.json");
    let answer = Bench::new().run("config schema");
    assert!(answer.json()["properties"]["plant"].is_object());
    assert!(
        answer.out == file,
        "bench-config/schema.json is out of date; the command above this line renews it"
    );
}

#[test]
fn what_is_shown_is_the_same_configuration_when_it_is_read_back() {
    let bench = Bench::new();
    let others = [
        "--config chapter2 --operating-point 3.3% --seed 17",
        "--set loop.cpu=1 --set sim.floor=[] --set chirp.sweep=linear --set control.reference.kind=hold",
        "--set plant.damping={kind=\"rayleigh\",mass_per_s=3.0,stiffness_s=1e-6} --asymmetry -0.123456789012345678",
    ];
    for options in std::iter::once("").chain(others) {
        let shown = bench.run(&format!("config show {options}"));
        assert_eq!(shown.code, 0, "{options}: {}", shown.err);
        bench.write("shown.toml", &shown.out);
        let again = bench.run("config show --config shown.toml");
        assert_eq!(again.out, shown.out, "{options}: {}", again.err);
        let json = |options: &str| bench.json(&format!("config show {options}"));
        assert_eq!(json("--config shown.toml"), json(options), "{options}");
    }
}

#[test]
fn every_profile_and_controller_passes_and_is_found_by_its_name() {
    let bench = Bench::new();
    let profiles = toml_files(&bench_config());
    assert!(profiles.len() >= 2, "{profiles:?}");
    for path in &profiles {
        let name = path.file_stem().expect("a name").to_str().expect("UTF-8");
        let by_path = bench.json(&format!("config show --config {}", path.display()));
        assert_eq!(
            bench.json(&format!("config check --config {name}"))["valid"],
            true,
            "{name}"
        );
        assert_eq!(
            bench.json(&format!("config show --config {name}")),
            by_path,
            "{name}"
        );
    }
    for path in &toml_files(&bench_config().join("controllers")) {
        let name = path.file_stem().expect("a name").to_str().expect("UTF-8");
        let margins = |controller: &str| bench.json(&format!("margins --controller {controller}"));
        assert_eq!(
            margins(name),
            margins(path.to_str().expect("UTF-8")),
            "{name}"
        );
    }
}

#[test]
fn the_later_layer_wins_and_says_only_what_differs() {
    let bench = Bench::new();
    bench.write(
        "mine.toml",
        "[plant]\nmass_asymmetry = 0.03\n[loop]\nrate_hz = 4000\n",
    );
    let show = |options: &str| bench.json(&format!("config show {options}"));
    let (stage, mine) = (show(""), show("--config mine.toml"));
    assert_eq!(
        (&mine["plant"]["mass_asymmetry"], &mine["loop"]["rate_hz"]),
        (&json!(0.03), &json!(4000.0))
    );
    assert_eq!(
        mine["plant"]["beam_length_m"],
        stage["plant"]["beam_length_m"]
    );
    let set =
        show("--config mine.toml --set plant.mass_asymmetry=0.04 --set plant.mass_asymmetry=0.05");
    assert_eq!(set["plant"]["mass_asymmetry"], 0.05);
    assert_eq!(
        show("--set plant.mass_asymmetry=0.04 --asymmetry 6%")["plant"]["mass_asymmetry"],
        0.06
    );
}

#[test]
fn an_operating_point_may_be_typed_in_per_cent_of_l_in_millimetres_or_in_metres() {
    let bench = Bench::new();
    let metres = |options: &str| {
        number(&bench.json(&format!("config show {options}"))["plant"]["operating_point_m"])
    };
    for text in ["8%", "3.8mm", "3800um", "0.0038", "0.0038m"] {
        program::near(
            text,
            metres(&format!("--operating-point {text}")),
            0.0038,
            1e-17,
        );
    }
    program::near("-8%", metres("--operating-point -8%"), -0.0038, 1e-17);
    // Per cent of the length of this bench's beams, wherever the length comes from.
    program::near(
        "of 60 mm",
        metres("--operating-point 5% --set plant.beam_length_m=0.06"),
        0.003,
        1e-17,
    );
}

#[test]
fn with_json_there_is_one_object_on_standard_output_and_nothing_else() {
    let bench = Bench::new();
    let run = |arguments: &str| {
        bench.json(arguments)["recording"]
            .as_str()
            .map(str::to_string)
    };
    for arguments in [
        "config show",
        "config check",
        "model modes",
        "margins --fast",
        "margins --slow --continuous",
    ] {
        run(arguments);
    }
    let control = run("control --slow --duration 0.3").expect("a recording");
    let chirp = run("chirp --start 5 --stop 200 --duration 8").expect("a recording");
    run(&format!("identify {chirp}"));
    run(&format!("replay {control}"));
    run(&format!("recover {control}"));
    // Of a run that trips as well.
    let tripped = bench.run("control --fast --asymmetry -10% --json");
    assert_eq!(
        (tripped.code, &tripped.json()["outcome"]),
        (1, &json!("tripped"))
    );
}

#[test]
fn jsonschema_takes_every_profile_and_refuses_what_bench_refuses() {
    let bench = Bench::new();
    let show = |options: &str| bench.json(&format!("config show {options}"));
    let mut documents: Vec<Value> = toml_files(&bench_config())
        .iter()
        .map(|path| show(&format!("--config {}", path.display())))
        .collect();
    let good = documents.len();
    for (pointer, value) in [
        ("/loop/rate_hz", json!(0)),
        ("/plant/mass_asymmetry", json!("10%")),
        ("/plant/damping/kind", json!("foo")),
        ("/plant/model", json!("sr5dof")),
        ("/chirp/amplitude", json!([])),
        ("/loop/computing_delay_periods", json!(1.5)),
        (
            "/control/reference",
            json!({"kind": "step", "amplitude_m": 1e-5}),
        ),
    ] {
        let mut wrong = documents[0].clone();
        *wrong.pointer_mut(pointer).expect("a setting") = value;
        documents.push(wrong);
    }
    let mut unknown = documents[0].clone();
    unknown["plant"]["mass_asymetry"] = json!(0.1);
    documents.push(unknown);
    let Some(findings) = validated(&bench.run("config schema").json(), &documents) else {
        return;
    };
    for (index, found) in findings.iter().enumerate() {
        assert_eq!(
            found.as_array().expect("a list").is_empty(),
            index < good,
            "document {index}: {found}"
        );
    }
}

/// What Python's `jsonschema` finds in each document; `None`, and why on standard error, where it is not there.
fn validated(schema: &Value, documents: &[Value]) -> Option<Vec<Value>> {
    let python = std::env::var("BENCH_PYTHON").unwrap_or("python3".into());
    let probe = Command::new(&python)
        .args(["-c", "import jsonschema"])
        .output();
    if !probe.as_ref().is_ok_and(|output| output.status.success()) {
        assert!(
            std::env::var("BENCH_REQUIRE_PYTHON").as_deref() != Ok("1"),
            "Python is required here: {probe:?}"
        );
        eprintln!("not tested: {probe:?}\npip install jsonschema, or set BENCH_PYTHON");
        return None;
    }
    let script = Path::new(env!("CARGO_MANIFEST_DIR")).join("tests/python/validate.py");
    let mut child = Command::new(&python)
        .arg(script)
        .stdin(Stdio::piped())
        .stdout(Stdio::piped())
        .spawn()
        .expect("has just run");
    let request = json!({"schema": schema, "documents": documents});
    serde_json::to_writer(child.stdin.take().expect("piped"), &request).expect("an open pipe");
    let output = child.wait_with_output().expect("an answer");
    assert!(output.status.success());
    Some(serde_json::from_slice(&output.stdout).expect("a JSON array"))
}
