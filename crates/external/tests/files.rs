//! Files as other programs write them: the same record in many forms, and times of many kinds.

use std::f64::consts::TAU;
use std::io::Write;
use std::path::PathBuf;

use bench_external::{Columns, ForeignFormat, Record, Sampling, TimeBase, TimeUnit, names, read};

const RATE_HZ: f64 = 500.0;
const SAMPLES: usize = 400;

/// Two sums of sines of at most 0.3 times the rate.
fn signals(time_s: f64) -> [f64; 2] {
    let sine = |hz: f64, phase: f64| (TAU * hz * time_s + phase).sin();
    [
        0.5 * sine(7.3, 0.0) + 0.25 * sine(121.0, 1.0),
        1e-6 * sine(7.3, -0.4) - 2e-7 * sine(149.0, 2.0),
    ]
}

/// A table of the times t, u and y, with a function that writes a time.
fn table(time: impl Fn(usize) -> f64, write: impl Fn(usize) -> String) -> String {
    let row = |k: usize| {
        let [u, y] = signals(time(k));
        format!("{},{u:e},{y:e}\n", write(k))
    };
    (0..SAMPLES).map(row).collect()
}

fn regular(k: usize) -> f64 {
    k as f64 / RATE_HZ
}

/// A file in a folder of its own.
struct File {
    path: PathBuf,
    _folder: tempfile::TempDir,
}

impl File {
    fn new(bytes: impl AsRef<[u8]>) -> File {
        let folder = tempfile::tempdir().expect("a folder");
        let path = folder.path().join("record.csv");
        std::fs::write(&path, bytes).expect("a file");
        File {
            path,
            _folder: folder,
        }
    }
}

fn columns(time: &str, unit: Option<TimeUnit>) -> Columns {
    Columns {
        input: "u".into(),
        output: "y".into(),
        reference: None,
        sampling: Sampling::TimeColumn {
            name: time.into(),
            unit,
        },
    }
}

fn record(bytes: impl AsRef<[u8]>, time: &str) -> Record {
    let file = File::new(bytes);
    read(&file.path, &columns(time, None)).unwrap_or_else(|error| panic!("{error}"))
}

fn refusal(bytes: impl AsRef<[u8]>, columns: &Columns) -> String {
    let file = File::new(bytes);
    let error = read(&file.path, columns).expect_err("a refusal");
    error.to_string()
}

#[test]
fn reference_is_read_and_resampled_with_the_signals() {
    // Irregular times: 0.3 of a period to either side.
    let time = |k: usize| (k as f64 + 0.3 * (k as f64).sin()) / RATE_HZ;
    let row = |k: usize| {
        let [u, y] = signals(time(k));
        format!("{},{u:e},{:e},{y:e}\n", time(k), 2.0 * u)
    };
    let rows: String = (0..SAMPLES).map(row).collect();
    let text = format!("t,u,r,y\n{rows}");
    let with_reference = |name: &str| Columns {
        reference: Some(name.into()),
        ..columns("t", None)
    };
    let file = File::new(&text);
    let found = read(&file.path, &with_reference("r")).expect("a record");
    assert!(matches!(found.times, TimeBase::Resampled { .. }));
    let reference = found.reference.expect("a reference");
    assert_eq!(reference.len(), SAMPLES);
    for (r, u) in reference.iter().zip(&found.signals.input) {
        assert!((r - 2.0 * u).abs() < 1e-12, "{r} {u}");
    }
    assert_eq!(record(&text, "t").reference, None);
    for (name, words) in [
        ("u", "`u` is selected twice"),
        ("t", "`t` is selected twice"),
        ("ref", "no column `ref`; choose one of t, u, r, y"),
    ] {
        let why = refusal(&text, &with_reference(name));
        assert!(why.contains(words), "{why}");
    }
}

#[test]
fn every_form_of_a_record_gives_the_same_signals() {
    let rows = table(regular, |k| regular(k).to_string());
    let plain = format!("t,u,y\n{rows}");
    let expected = record(&plain, "t");
    assert_eq!(expected.times, TimeBase::Regular);
    assert_eq!(expected.signals.len(), SAMPLES);
    let semicolons = plain.replace(',', ";");
    let with_commas = semicolons.replace('.', ",").replace(';', "\",\"");
    let quoted = with_commas.lines().map(|line| format!("\"{line}\"\n"));
    let quoted: String = quoted.collect();
    let mut packed = flate2::write::GzEncoder::new(Vec::new(), flate2::Compression::default());
    packed.write_all(plain.as_bytes()).expect("in memory");
    let utf16 = std::iter::once(0xfeff).chain(plain.encode_utf16());
    let forms: Vec<(&str, Vec<u8>)> = vec![
        ("semicolons", semicolons.clone().into()),
        ("decimal commas", semicolons.replace('.', ",").into()),
        ("tabs", plain.replace(',', "\t").into()),
        ("spaces", plain.replace(',', "   ").into()),
        (
            "numpy.savetxt",
            format!("# t u y\n{}", rows.replace(',', " ")).into(),
        ),
        (
            "comments",
            format!("# Recorder 2, run 7\n# rate 500 Hz\n{plain}").into(),
        ),
        (
            "comment within",
            plain.replacen("\n0.1,", "\n# a remark\n0.1,", 1).into(),
        ),
        (
            "preamble",
            format!("Recorder 2\nSerial number: 17\n\n{plain}").into(),
        ),
        ("units", format!("t,u,y\ns,N,m\n{rows}").into()),
        (
            "units in words",
            format!("t,u,y\nsecond,Volt,Volt\n{rows}").into(),
        ),
        (
            "units and remarks",
            format!("t,u,y\ns,N,m\nrun7,run7b,run7c\n{rows}").into(),
        ),
        ("quoted decimal commas", quoted.into()),
        ("a last separator", plain.replace('\n', ",\n").into()),
        ("CR LF", plain.replace('\n', "\r\n").into()),
        ("CR", plain.replace('\n', "\r").into()),
        ("gzip", packed.finish().expect("in memory")),
        ("UTF-16", utf16.flat_map(u16::to_le_bytes).collect()),
    ];
    for (form, bytes) in forms {
        let found = record(bytes, "t");
        assert_eq!(found.signals, expected.signals, "{form}");
        assert_eq!(found.times, expected.times, "{form}");
        assert_eq!(found.seconds_assumed, !form.starts_with("units"), "{form}");
    }
}

#[test]
fn every_unit_of_time_gives_the_rate() {
    let unit_s = [
        ("h", 3600.0),
        ("days", 86_400.0),
        ("min", 60.0),
        ("ms", 1e-3),
    ];
    for (unit, seconds) in unit_s {
        let rows = table(regular, |k| format!("{:.15e}", regular(k) / seconds));
        let found = record(
            format!("Time [{unit}],u,y\n{rows}"),
            &format!("Time [{unit}]"),
        );
        assert!(
            (found.signals.rate_hz / RATE_HZ - 1.0).abs() < 1e-9,
            "{unit}"
        );
        assert!(!found.seconds_assumed, "{unit}");
    }
    // Days that are not named: 2.3e-8 s are not seconds.
    let rows = table(regular, |k| format!("{:.15}", regular(k) / 86_400.0));
    let text = refusal(format!("t,u,y\n{rows}"), &columns("t", None));
    assert!(
        text.contains("give --time-unit s, ms, us, ns, min, h or d"),
        "{text}"
    );
}

#[test]
fn times_with_a_fixed_number_of_significant_digits_are_regular() {
    // As `%g` of C writes them: six digits, so that the last one grows at 1 s and at 10 s.
    let six_digits = |k: usize| {
        let time = 0.0123 + k as f64 / 37.0;
        let decimals = (5 - time.log10().floor() as i32).max(0) as usize;
        let text = format!("{time:.decimals$}");
        text.trim_end_matches('0').to_string()
    };
    let found = record(format!("t,u,y\n{}", table(regular, six_digits)), "t");
    assert_eq!(found.times, TimeBase::Regular);
    assert!((found.signals.rate_hz / 37.0 - 1.0).abs() < 1e-5);
}

#[test]
fn a_gap_in_rounded_times_is_refused_with_its_line() {
    // 1.5 kHz in milliseconds: steps of 0 and 1 ms. Ten lines are missing after the 200th sample.
    let cells = |k: usize| {
        let sample = if k < 200 { k } else { k + 10 };
        format!("{:.3}", sample as f64 / 1500.0)
    };
    let text = refusal(
        format!("t,u,y\n{}", table(regular, cells)),
        &columns("t", None),
    );
    assert!(text.contains("line 202: 0.00"), "{text}");
}

#[test]
fn names_may_have_separators_and_columns_no_names() {
    let rows = table(regular, |k| regular(k).to_string()).replace(',', ";");
    let file = File::new(format!(
        "Time [s, rel.];Force [N, meas.];\"Pos; m\"\n{rows}"
    ));
    assert_eq!(
        names(&file.path).expect("names"),
        ["Time [s, rel.]", "Force [N, meas.]", "Pos; m"]
    );
    let file = File::new(rows);
    let by_number = Columns {
        input: "2".into(),
        output: "3".into(),
        reference: None,
        sampling: Sampling::TimeColumn {
            name: "1".into(),
            unit: None,
        },
    };
    let found = read(&file.path, &by_number).expect("a record");
    assert_eq!(found.signals.len(), SAMPLES);
    let why = read(&file.path, &columns("t", None)).expect_err("no names");
    assert!(
        why.to_string().contains("by its number, from 1 to 3"),
        "{why}"
    );
}

#[test]
fn times_have_the_unit_that_the_file_states() {
    for (name, per_s) in [
        ("t_ms", 1e3),
        ("t [us]", 1e6),
        ("Time (ns)", 1e9),
        ("t", 1.0),
    ] {
        let write = |k: usize| (regular(k) * per_s).to_string();
        let found = record(format!("{name},u,y\n{}", table(regular, write)), name);
        let error = found.signals.rate_hz / RATE_HZ - 1.0;
        assert!(error.abs() < 1e-9, "{name}: {}", found.signals.rate_hz);
    }
    let rows = table(regular, |k| (2 * k).to_string());
    let found = record(format!("t,u,y\nms,N,m\n{rows}"), "t");
    assert!((found.signals.rate_hz / RATE_HZ - 1.0).abs() < 1e-9);
    // Without a unit, steps of 2 are not seconds.
    let why = refusal(format!("t,u,y\n{rows}"), &columns("t", None));
    for word in ["column `t`", "steps of 2", "--time-unit", "--rate"] {
        assert!(why.contains(word), "{word}: {why}");
    }
    let file = File::new(format!("t,u,y\n{rows}"));
    let found = read(&file.path, &columns("t", Some(TimeUnit::Ms))).expect("a record");
    assert!((found.signals.rate_hz / RATE_HZ - 1.0).abs() < 1e-9);
}

#[test]
fn dates_and_times_since_1970_are_exact() {
    for write in [
        (|k| (1_700_000_000_000_000_000_u64 + 2_000_000 * k as u64).to_string())
            as fn(usize) -> String,
        |k| format!("2026-11-26T12:40:48.{:03}Z", 2 * k),
        |k| format!("2026-11-26 23:59:59.{:06}", 2000 * k),
    ] {
        let found = record(
            format!("stamp_ns,u,y\n{}", table(regular, write)),
            "stamp_ns",
        );
        let error = found.signals.rate_hz / RATE_HZ - 1.0;
        assert!(
            error.abs() < 1e-9,
            "{}: {}",
            write(1),
            found.signals.rate_hz
        );
        assert_eq!(found.times, TimeBase::Regular, "{}", write(1));
    }
}

/// Away from the ends, where the interpolation has no samples beyond.
const ENDS: usize = 30;

#[test]
fn irregular_times_are_true_and_both_columns_are_resampled() {
    // The rate falls by 1 %; it changes by 7 % in the middle; times scatter by 8 % of a period, or by 35 %, so that steps differ by 65 %.
    let drift = |k: usize| regular(k) * (1.0 + 0.005 * k as f64 / SAMPLES as f64);
    let change = |k: usize| regular(k) + 0.07 * regular(k.saturating_sub(SAMPLES / 2));
    let scattered =
        |k: usize, ratio: f64| regular(k) + ratio / RATE_HZ * ((7 * k * k) as f64).sin();
    let jitter = |k: usize| scattered(k, 0.08);
    let large_jitter = |k: usize| scattered(k, 0.35);
    for (what, time) in [
        ("drift", &drift as &dyn Fn(usize) -> f64),
        ("change", &change),
        ("jitter", &jitter),
        ("large jitter", &large_jitter),
    ] {
        let rows = table(time, |k| format!("{:.9}", time(k)));
        let found = record(format!("t,u,y\n{rows}"), "t");
        assert!(
            matches!(found.times, TimeBase::Resampled { .. }),
            "{what}: {:?}",
            found.times
        );
        let signals_of = &found.signals;
        for k in ENDS..SAMPLES - ENDS {
            let [u, y] = signals(time(0) + k as f64 / signals_of.rate_hz);
            // The interpolation leaves less than 1e-3 of a signal below 0.3 times the rate; a mean rate would leave 1.
            assert!(
                (signals_of.input[k] - u).abs() < 1e-3,
                "{what}, {k}: {} {u}",
                signals_of.input[k]
            );
            assert!(
                (signals_of.output[k] - y).abs() < 1e-9,
                "{what}, {k}: {} {y}",
                signals_of.output[k]
            );
        }
    }
}

#[test]
fn rounded_times_are_regular_with_the_true_rate() {
    let rate_hz = 1500.0;
    let time = |k: usize| k as f64 / rate_hz;
    let found = record(
        format!("t,u,y\n{}", table(time, |k| format!("{:.3}", time(k)))),
        "t",
    );
    assert_eq!(found.times, TimeBase::Regular);
    // 3 sigma of the slope through 400 times with uniform errors of 1 ms: 1 ms/400^1.5, times the rate.
    let limit = 3.0 * 1e-3 / 400_f64.powf(1.5) * rate_hz;
    assert!(
        (found.signals.rate_hz / rate_hz - 1.0).abs() < limit,
        "{}",
        found.signals.rate_hz
    );
}

#[test]
fn other_formats_are_named_and_never_printed() {
    for (bytes, name) in [
        (&b"MATLAB 7.3 MAT-file, \x1b[31m"[..], "an HDF5 file"),
        (b"\x89HDF\r\n\x1a\n\0\0", "an HDF5 file"),
        (b"PAR1\x15\x04\x1b[31m", "a Parquet file"),
        (b"PK\x03\x04\x14\0", "a zip archive"),
        (b"\0\x01\x1b[31m", "not a text file"),
    ] {
        let why = refusal(bytes, &columns("t", None));
        assert!(why.contains(name) && !why.contains('\u{1b}'), "{why:?}");
    }
    assert_eq!(ForeignFormat::Mcap.name(), "a recording (MCAP)");
    let why = refusal("t,\x1b[31mu,y\n0,1,2\n1,2,3\n2,3,4\n", &columns("t", None));
    assert!(!why.contains('\u{1b}'), "{why:?}");
}

/// Times of 0.4 ms with four decimals, as of a recorder at 2.5 kHz: a rate of 2500.0000000000005 Hz would be no line of a period of 1 s.
#[test]
fn rate_has_no_rounding_of_the_times() {
    for rate_hz in [2500.0, 500.0, 48_000.0, 1024.0] {
        let rows = table(
            |k| k as f64 / rate_hz,
            |k| format!("{:.9}", k as f64 / rate_hz),
        );
        let record = record(format!("t,u,y\n{rows}"), "t");
        assert_eq!(record.signals.rate_hz, rate_hz);
    }
}
