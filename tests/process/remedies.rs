//! Refused commands with `--json`: each states what is wrong and what to do.
use bench_test_support::program::{Answer, Bench};

/// Every remedy is an instruction: it begins with one of these words.
const VERBS: [&str; 25] = [
    "add", "check", "choose", "complete", "connect", "correct", "examine", "free", "give", "leave",
    "lower", "narrow", "raise", "read", "record", "repair", "repeat", "save", "see", "set",
    "shorten", "sort", "start", "use", "write",
];

/// Each command with a word of its remedy.
const REFUSED: [(&str, &str); 70] = [
    // Measurements
    ("chirp --amplitude 5s", "100mA"),
    ("chirp --amplitude 5V", "100mA"),
    ("chirp --amplitude 12A", "chirp.amplitude"),
    ("chirp --amplitude 0.5A --shape flat.csv", "--help"),
    ("chirp --duration 1e5", "shorten"),
    ("chirp --duration 1ms", "shorten the fades"),
    ("chirp --stop 5kHz", "loop.rate_hz"),
    ("chirp --start 20Hz --stop 20Hz", "two frequencies"),
    ("chirp --excitation noise", "--help"),
    ("chirp --shape missing.csv", "--shape model"),
    ("chirp --shape data.csv", "--shape model"),
    ("chirp --config nosuch", "stage"),
    ("chirp --config broken.toml", "line 1"),
    ("chirp --set nonsense", "KEY=VALUE"),
    ("chirp --set chirp.duration_s=yes", "a number"),
    ("chirp --set chirp.duration_z=1", "`duration_s`"),
    (
        "chirp --set loop.rate_hz=0 --set chirp.duration_s=0",
        "each",
    ),
    (
        "chirp --excitation prbs --set prbs.clock_divider=9",
        "chirp.stop_hz",
    ),
    ("chirp --set sim.asymmetry_offset=-2", "from"),
    ("chirp --set amplifier.device={kind=\"vesc\"}", "add it"),
    ("linearity --scales 1", "0.5,1,2"),
    (
        "linearity --amplitude 0.5A --scales 0.5,1,4",
        "chirp.amplitude",
    ),
    ("calibrate --amplitude 20A", "calibrate.amplitude_a"),
    (
        "calibrate --config lab --pace virtual --set amplifier.device.interface=no-such-can --set probe.device.line.port=/dev/ttyNONE9",
        "--simulate",
    ),
    // Closed loop
    ("control --frequency 5Hz", "such a reference"),
    ("control --reference circle", "step, hold"),
    ("control --reference sine --amplitude 10mm", "lower it"),
    ("control --reference sine --frequency 3kHz", "loop.rate_hz"),
    (
        "control --fast --reference chirp --asymmetry -10%",
        "`bench margins`",
    ),
    ("control --controller nosuch", "fast, slow"),
    (
        "control --fast --config lab --simulate",
        "--controller FILE",
    ),
    ("control --reference far.csv", "time_s,reference_m"),
    ("margins --set loop.rate_hz=0", "from 1 to 100000"),
    ("margins --controller improper.toml", "a pole"),
    ("margins --config lab --set loop.rate_hz=20000", "the rate"),
    // Campaign
    (
        "campaign --config lab --set amplifier.device.interface=no-such-can --set probe.device.line.port=/dev/ttyNONE9",
        "--simulate",
    ),
    ("campaign --config xy", "sr4dof"),
    ("campaign --asymmetry 2%", "`bench chirp`"),
    (
        "campaign --operating-points 0%:8%:2000 --asymmetries 0%:9%:10",
        "fewer values",
    ),
    ("campaign --operating-points 0%:200%:3", "lower it"),
    ("campaign --asymmetry-tolerance 0", "0.004"),
    // Recordings and files
    ("identify nosuch.mcap", "recordings/"),
    ("identify text.mcap", "*.mcap"),
    ("identify data.csv", "--input COLUMN"),
    ("identify data.csv --input x --output y", "--rate HZ"),
    (
        "identify data.csv --input x --output z --rate 1kHz",
        "choose one of",
    ),
    (
        "identify data.csv --input x --output y --rate 1kHz",
        "for longer",
    ),
    (
        "identify words.csv --input x --output y --rate 1kHz",
        "the cell",
    ),
    ("replay nosuch.mcap", "recordings/"),
    ("recover text.mcap", "*.mcap"),
    ("export nosuch.mcap --format csv", "recordings/"),
    ("export text.mcap --format mat", "*.mcap"),
    ("export text.mcap --format csv --out data.csv", "--out"),
    ("export text.mcap --format xls", "--help"),
    ("config check --config nosuch", "stage"),
    ("config init --out data.csv", "--out"),
    ("man --out data.csv", "--help"),
    ("completions tcsh", "--help"),
    ("frobnicate", "--help"),
    ("doctor --set loop.rate=1", "`rate_hz`"),
    ("doctor --frobnicate", "--help"),
    // Emulation
    ("emulate probe", "--config lab"),
    ("emulate amplifier --config lab --pty probe", "add `probe`"),
    (
        "emulate probe --config lab --fault probe.no@1s",
        "probe.silence",
    ),
    // Model
    ("model modes --operating-point 8", "did you mean 8% or 8mm?"),
    (
        "model locus --vary plant.mass_asymmetry --from 1 --to 1",
        "two different values",
    ),
    ("model veering --modes 3,3", "from 1 to 4"),
    ("model placement --sensor x9", "did you mean x"),
    ("model map --config xy", "sr4dof"),
    (
        "model study --config xy --vary plant.zz=+-1",
        "the spelling",
    ),
];

#[test]
fn every_refused_command_gives_a_remedy() {
    let bench = Bench::new();
    bench.write("broken.toml", "[plant\n");
    bench.write("data.csv", "x,y\n1,2\n2,1\n");
    bench.write("words.csv", "x,y\n1,2\n2,2\n3,2\ntwo,1\n");
    bench.write("far.csv", "time_s,reference_m\n0,0\n0,1e-6\n");
    bench.write("text.mcap", "not a recording");
    bench.write(
        "improper.toml",
        "title = \"x\"\n[[section]]\nkind = \"coefficients\"\nnumerator = [1, 0, 0]\ndenominator = [1, 1]\n",
    );
    let files = bench.files();
    for (arguments, word) in REFUSED {
        let answer = bench.run(&format!("{arguments} --json"));
        check(arguments, word, &answer);
    }
    assert_eq!(bench.files(), files);
}

fn check(arguments: &str, word: &str, answer: &Answer) {
    assert!([1, 2].contains(&answer.code), "{arguments}: {answer:?}");
    let error = &answer.json()["error"];
    let text = |key: &str| {
        let text = error[key].as_str();
        text.unwrap_or_else(|| panic!("{arguments}: no {key}: {error}"))
    };
    let (message, remedy) = (text("message"), text("remedy"));
    let what = message.strip_suffix(&format!("; {remedy}"));
    assert!(
        what.is_some_and(|what| !what.is_empty() && !what.contains("; ")),
        "{arguments}: {error}"
    );
    let verb = remedy.split(' ').next().unwrap_or_default();
    assert!(VERBS.contains(&verb), "{arguments}: {error}");
    assert!(remedy.contains(word), "{arguments}: {word}: {error}");
}
