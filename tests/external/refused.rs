//! Records that cannot be analysed are rejected with the place of the error; unreliable ones give an undecided verdict.
use bench_identify::Signals;

use crate::external::program::{Answer, Bench};
use crate::external::signals::{csv, multisine, normal};

const IDENTIFY: &str = "identify data.csv --input force_n --output position_m";

/// The answer of `bench identify` for `data.csv`; asserts that a rejection leaves no other file.
fn identify(text: impl AsRef<[u8]>, more: &str) -> Answer {
    let bench = Bench::new();
    bench.write("data.csv", text);
    let answer = bench.run(&format!("{IDENTIFY} {more}"));
    assert!(
        answer.code == 0 || bench.files() == ["data.csv"],
        "{:?}",
        bench.files()
    );
    answer
}

/// A valid file.
fn valid() -> String {
    csv(&multisine(&(5..=200).collect::<Vec<_>>(), 7, 0.0, 1e-8, 1))
}

/// The valid file with one line changed.
fn with_line(number: usize, change: impl Fn(&str) -> String) -> String {
    let line = |(k, line): (usize, &str)| {
        if k + 1 == number {
            change(line)
        } else {
            format!("{line}\n")
        }
    };
    valid().lines().enumerate().map(line).collect()
}

#[test]
fn rejects_decimal_commas_between_commas_with_the_remedy() {
    let header_line = |line: &str| line.starts_with("time");
    let lines = valid();
    let lines = lines.lines().map(|line| {
        if header_line(line) {
            format!("{line}\n")
        } else {
            let cells = line.split(',').map(|cell| {
                if cell.contains('.') {
                    cell.replace('.', ",")
                } else {
                    format!("{cell},0")
                }
            });
            cells.collect::<Vec<_>>().join(",") + "\n"
        }
    });
    let answer = identify(lines.collect::<String>(), "--time time_s");
    assert_eq!(answer.code, 1, "{answer:?}");
    for word in ["line 2", "twice the columns", "decimal point"] {
        assert!(answer.err.contains(word), "{word}: {}", answer.err);
    }
}

#[test]
fn rejects_options_that_do_not_match_the_file() {
    for (more, words) in [
        (
            "",
            &["--time COLUMN", "time_s, force_n, position_m", "--rate"][..],
        ),
        (
            "--time t",
            &["no column `t`", "time_s, force_n, position_m"],
        ),
        ("--time force_n", &["`force_n` is selected twice"]),
        ("--time time_s --rate 1000", &["--rate"]),
        ("--rate 1000 --skip-periods 1", &["--period"]),
        (
            "--rate 1000 --period 2.5",
            &["--period 2.5", "whole number"],
        ),
        (
            "--rate 1000 --period inf",
            &["--period inf", "whole number"],
        ),
        (
            "--rate 1000 --period 0.99995s",
            &["--period 0.99995s", "1000 Hz"],
        ),
        ("--rate 1000 --band 5-200", &["--band 5-200", "11Hz:250Hz"]),
        (
            "--rate 1000 --input-lag -1ms",
            &["--input-lag is", "0 to 10 s"],
        ),
        ("--rate 1000 --hold foh", &["--hold", "zoh"]),
        ("--rate 0", &["--rate is 0 Hz", "0.000001 to 1000000000 Hz"]),
        ("--rate -5", &["--rate is -5 Hz", "0.000001"]),
        ("--rate 1e308", &["--rate is 1e308 Hz", "1000000000 Hz"]),
        (
            "--rate 1000 --band 200:5",
            &["--band 200:5", "lower < upper"],
        ),
        (
            "--rate 1000 --band 5:900",
            &["--band 5:900", "Nyquist frequency of 500 Hz"],
        ),
        (
            "--rate 1000 --period 3",
            &["--period 3: period is 3", "from 8"],
        ),
        (
            "--rate 1000 --period 1000 --skip-periods 999",
            &["--skip-periods 999", "too few periods"],
        ),
    ] {
        identify(valid(), more).is_refused(words);
    }
    let bench = Bench::new();
    bench.write("data.csv", valid());
    bench
        .run("identify data.csv")
        .is_refused(&["give --input COLUMN", "time_s, force_n, position_m"]);
    bench
        .run("identify data.csv --input force_n")
        .is_refused(&["--output"]);
}

#[test]
fn rejects_invalid_data_with_line_and_column() {
    let gap = with_line(40, |_| String::new());
    let lines: Vec<String> = valid().lines().map(String::from).collect();
    let constant = |u: &str, y: &str| {
        let row = |n: usize| {
            format!(
                "{},{},{}\n",
                n as f64 * 1e-3,
                u.replace('n', &(n * n % 7).to_string()),
                y.replace('n', &(n % 5).to_string())
            )
        };
        format!("{}\n{}", lines[0], (0..1000).map(row).collect::<String>())
    };
    for (text, words) in [
        (
            with_line(17, |_| "0.015,banana,1\n".into()),
            &["line 17", "\"banana\"", "`force_n`", "not a finite number"][..],
        ),
        (
            with_line(18, |_| "0.016,1,\n".into()),
            &["line 18", "\"\"", "`position_m`"],
        ),
        (
            with_line(19, |_| "0.017,nan,1\n".into()),
            &["line 19", "\"nan\""],
        ),
        (
            with_line(20, |_| "0.018,1\n".into()),
            &["line 20", "2 in place of 3 columns"],
        ),
        (
            gap,
            &["line 40", "0.002000000 s after", "usual step", "--rate"],
        ),
        (
            with_line(50, |line| format!("{line}\n{line}\n")),
            &["line 51", "not after", "sort the lines"],
        ),
        (
            with_line(60, |_| "-1,1,1\n".into()),
            &["line 60", "-1 s", "not after"],
        ),
        (
            lines[..2].join("\n"),
            &["fewer than two lines of samples (1)"],
        ),
        (
            lines[..1].join("\n"),
            &["no lines with numbers", "one sample per line"],
        ),
        (
            lines[..20].join("\n"),
            &["19 samples are too few", "at least 64"],
        ),
        (constant("1", "n"), &["input is 1", "nothing was excited"]),
        (constant("n", "1"), &["output is 1", "does not measure"]),
    ] {
        let answer = identify(text, "--time time_s");
        assert_eq!(answer.code, 1, "{answer:?}");
        words.iter().for_each(|word| {
            assert!(
                answer.err.contains(word),
                "`{word}` is not in {}",
                answer.err
            )
        });
    }
    for bytes in [
        &b""[..],
        b"\xff\xfe\x00\x01",
        b"\n\n\n",
        b"force_n,position_m,time_s\n\xff,1,2\n",
        b"force_n,force_n\n1,2\n",
    ] {
        let answer = identify(bytes, "--time time_s");
        assert!(
            [1, 2].contains(&answer.code) && answer.err.contains("data.csv"),
            "{answer:?}"
        );
    }
}

#[test]
fn accepts_a_latin_1_header_and_a_byte_order_mark() {
    let latin_1 = valid().replacen("time_s", "temperatur_\u{b0}C,time_s", 1);
    let rows = latin_1.lines().enumerate();
    let with_unused: String = rows
        .map(|(k, row)| {
            if k == 0 {
                format!("{row}\n")
            } else {
                format!("20,{row}\n")
            }
        })
        .collect();
    // Every character up to U+00FF is one byte in Latin-1.
    let latin_1: Vec<u8> = with_unused.chars().map(|c| c as u8).collect();
    let marked = [&b"\xef\xbb\xbf"[..], valid().as_bytes()].concat();
    for text in [latin_1, marked] {
        let answer = identify(text, "--time time_s --period 1000 --band 5:200");
        assert_eq!(answer.code, 0, "{answer:?}");
    }
}

#[test]
fn accepts_other_separators_and_a_rate_instead_of_times() {
    for separator in [";", "\t"] {
        let bench = Bench::new();
        bench.write("data.csv", valid().replace(',', separator));
        let answer = bench.json(&format!(
            "{IDENTIFY} --rate 1000 --period 1s --band 5:200 --out results"
        ));
        assert_eq!(answer["periods"], 6);
        assert_eq!(
            answer["modes"].as_array().map(Vec::len),
            Some(2),
            "{answer}"
        );
        assert_eq!(answer["cnmp"], "excluded", "{answer}");
        assert_eq!(bench.files(), ["data.csv", "results"]);
    }
}

#[test]
fn swapped_channels_give_an_undecided_verdict_and_exchanging_them_decides() {
    let bench = Bench::new();
    bench.write("data.csv", valid());
    let swapped = "identify data.csv --input position_m --output force_n --time time_s --period 1000 --band 5:200";
    let answer = bench.json(swapped);
    assert_eq!(answer["cnmp"], "undecided", "{answer}");
    assert!(
        answer["why"]
            .as_str()
            .is_some_and(|why| why.contains("exchange --input and --output")),
        "{answer}"
    );
    let exchanged = "identify data.csv --input force_n --output position_m --time time_s --period 1000 --band 5:200";
    let answer = bench.json(exchanged);
    assert_eq!(answer["cnmp"], "excluded", "{answer}");
}

#[test]
fn unrelated_output_gives_an_undecided_verdict_with_the_reason() {
    let mut normal = normal(9);
    let noise = |normal: &mut dyn FnMut() -> f64| (0..8000).map(|_| normal()).collect();
    let signals = Signals {
        rate_hz: 1000.0,
        input: noise(&mut normal),
        output: noise(&mut normal),
    };
    let bench = Bench::new();
    bench.write("data.csv", csv(&signals));
    let answer = bench.json(&format!("{IDENTIFY} --time time_s --band 5:200"));
    assert_eq!(answer["cnmp"], "undecided", "{answer}");
    assert!(
        answer["why"]
            .as_str()
            .is_some_and(|why| why.contains("explains")),
        "{answer}"
    );
}
