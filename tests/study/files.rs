//! Study files: joining shards, continuing, and rejecting damaged files.

use crate::study::figures::XY;
use crate::study::program::Bench;

const DRAWS: &str = "--draws 2600";

fn whole(bench: &Bench) -> String {
    let answer = bench.run(&format!("{XY} {DRAWS} --json"));
    assert_eq!(answer.code, 0, "{}", answer.err);
    answer.out
}

fn shard(bench: &Bench, shard: &str, file: &str) -> crate::study::program::Answer {
    bench.run(&format!("{XY} {DRAWS} --shard {shard} --file {file}"))
}

#[test]
fn joined_shards_equal_the_whole_study_bit_for_bit() {
    let bench = Bench::new();
    let whole = whole(&bench);
    for (count, threads) in [(1, 1), (3, 2), (7, 3)] {
        let files: Vec<String> = (1..=count)
            .rev()
            .map(|index| format!("{count}_{index}.study"))
            .collect();
        for (file, index) in files.iter().zip((1..=count).rev()) {
            let answer = bench.run(&format!(
                "{XY} {DRAWS} --shard {index}/{count} --file {file} --threads {threads} --json"
            ));
            assert_eq!(
                (answer.code, answer.json()["shard"].is_null()),
                (0, count == 1),
                "{}",
                answer.err
            );
        }
        let joined = bench.run(&format!("model study --json --join {}", files.join(" ")));
        assert_eq!((joined.code, &joined.out), (0, &whole), "{}", joined.err);
    }
    assert_eq!(
        bench.run(&format!("{XY} {DRAWS} --json --threads 5")).out,
        whole
    );
    assert_eq!(
        bench
            .run(&format!(
                "model study --csv joined.csv --join {}",
                "1_1.study"
            ))
            .code,
        0
    );
    assert_eq!(bench.run(&format!("{XY} {DRAWS} --csv whole.csv")).code, 0);
    assert_eq!(bench.read("joined.csv"), bench.read("whole.csv"));
}

#[test]
fn rejects_incomplete_sets_of_shards() {
    let bench = Bench::new();
    for index in 1..=3 {
        assert_eq!(
            shard(&bench, &format!("{index}/3"), &format!("{index}.study")).code,
            0
        );
    }
    assert_eq!(shard(&bench, "2/4", "of_four.study").code, 0);
    let other = bench.run(&format!(
        "{XY} {DRAWS} --shard 2/3 --file other.study --seed 9 --operating-point 2mm"
    ));
    assert_eq!(other.code, 0, "{}", other.err);
    std::fs::copy(bench.path("2.study"), bench.path("again.study")).expect("a copy");
    let cut = std::fs::read(bench.path("2.study")).expect("a file");
    bench.write("cut.study", &cut[..cut.len() - 10]);
    for (files, code, words) in [
        ("1.study 3.study", 1, &["missing shards: 2 of 3"][..]),
        ("3.study", 1, &["missing shards: 1, 2 of 3"]),
        (
            "1.study 2.study again.study 3.study",
            1,
            &["shard 2/3", "more than once", "2.study, again.study"],
        ),
        (
            "1.study cut.study 3.study",
            1,
            &[
                "cut.study (shard 2/3) lacks",
                "continue it with its own arguments",
            ],
        ),
        (
            "1.study of_four.study 3.study",
            2,
            &["of_four.study", "`shard.count` is 4 there, 3 here"],
        ),
        (
            "1.study other.study 3.study",
            2,
            &[
                "`seed` is 9 there, 1 here",
                "`plant.operating_point_m` is 0.002 there, 0.003 here",
            ],
        ),
        ("1.study nowhere.study", 1, &["cannot open nowhere.study"]),
    ] {
        let answer = bench.run(&format!("model study --json --join {files}"));
        assert_eq!(answer.code, code, "{files}: {}", answer.err);
        let error = &answer.json()["error"]["message"];
        assert!(error.is_string(), "{files}: {error}");
        assert!(
            words.iter().all(|word| answer.err.contains(word)),
            "{files}: {}",
            answer.err
        );
    }
}

#[test]
fn truncated_file_continues_to_the_same_answer() {
    let bench = Bench::new();
    let whole = whole(&bench);
    assert_eq!(bench.run(&format!("{XY} {DRAWS} --file a.study")).code, 0);
    let bytes = std::fs::read(bench.path("a.study")).expect("a file");
    let header = bytes
        .iter()
        .position(|byte| *byte == b'\n')
        .expect("a line")
        + 1;
    let (last, all) = (
        bytes[..bytes.len() - 1]
            .iter()
            .rposition(|byte| *byte == b'\n')
            .expect("lines")
            + 1,
        bytes.len(),
    );
    for length in [
        0,
        1,
        header / 2,
        header - 1,
        header,
        header + 1,
        header + 100,
        last,
        last + 1,
        all - 2,
        all - 1,
        all,
    ] {
        bench.write("cut.study", &bytes[..length]);
        let answer = bench.run(&format!("{XY} {DRAWS} --file cut.study --json"));
        assert_eq!(
            (answer.code, &answer.out),
            (0, &whole),
            "cut at {length} of {all}: {}",
            answer.err
        );
        let damaged = length > header && length != last && length != all;
        assert_eq!(
            answer.err.contains("damaged lines"),
            damaged,
            "cut at {length} of {all}: {}",
            answer.err
        );
        // The file is now complete: no draw is left.
        let again = bench.run(&format!("{XY} {DRAWS} --file cut.study --json"));
        assert!(
            again.out == whole && again.err.contains("2600 of 2600 draws are done already"),
            "{}",
            again.err
        );
    }
}

#[test]
fn ignores_a_changed_block() {
    let bench = Bench::new();
    let whole = whole(&bench);
    assert_eq!(bench.run(&format!("{XY} {DRAWS} --file a.study")).code, 0);
    let text = bench.read("a.study");
    // A count in the second block, its checksum, its first draw; and the same block of another study.
    let line = text.lines().nth(2).expect("a block").to_string();
    let digit = line.rfind("0,").expect("a count");
    let changed = [
        format!("{}1{}", &line[..digit], &line[digit + 1..]),
        format!(
            "{}{}",
            if line.starts_with('0') { '1' } else { '0' },
            &line[1..]
        ),
        line.replacen("\"first\":", "\"first\":1", 1),
        String::new(),
        "null".to_string(),
    ];
    assert_eq!(
        bench
            .run(&format!("{XY} {DRAWS} --seed 2 --file other.study"))
            .code,
        0
    );
    let other_study = bench
        .read("other.study")
        .lines()
        .nth(2)
        .expect("a block")
        .to_string();
    for wrong in changed.into_iter().chain([other_study]) {
        bench.write("a.study", text.replace(&line, &wrong));
        let joined = bench.run("model study --json --join a.study");
        assert!(
            joined.code == 1 && joined.err.contains("lacks 500 draws"),
            "{wrong}: {}",
            joined.err
        );
        let answer = bench.run(&format!("{XY} {DRAWS} --file a.study --json"));
        assert!(
            answer.err.contains("1 damaged lines are ignored"),
            "{wrong}: {}",
            answer.err
        );
        assert_eq!((answer.code, &answer.out), (0, &whole), "{wrong}");
    }
}

#[test]
fn rejects_and_keeps_a_file_of_other_settings() {
    let bench = Bench::new();
    assert_eq!(shard(&bench, "1/2", "a.study").code, 0);
    let before = bench.read("a.study");
    for (arguments, words) in [
        ("--shard 2/2", &["`shard.index` is 1 there, 2 here"][..]),
        ("--shard 1/3", &["`shard.count` is 2 there, 3 here"]),
        ("--shard 1/2 --seed 8", &["`seed` is 1 there, 8 here"]),
        (
            "--shard 1/2 --damped",
            &["`damped` is false there, true here"],
        ),
        (
            "--shard 1/2 --set plant.layout=mirror_away",
            &["`plant.layout` is \"pinwheel\" there, \"mirror_away\" here"],
        ),
        (
            "--shard 1/2 --vary plant.beam_length_m=+-1%",
            &["`varied.8` is null there", "plant.beam_length_m"],
        ),
    ] {
        let answer = bench.run(&format!("{XY} {DRAWS} --file a.study {arguments}"));
        answer.is_refused(&[words, &["a.study", "different settings"]].concat());
    }
    let answer = bench.run(&format!("{XY} --draws 2601 --shard 1/2 --file a.study"));
    answer.is_refused(&["`draws` is 2600 there, 2601 here"]);
    assert_eq!(bench.read("a.study"), before);
}

#[test]
fn rejects_and_keeps_a_file_of_another_kind() {
    let bench = Bench::new();
    for content in [
        "hello",
        "\n",
        "{\"format\":\"bench study 1\"}\n",
        "00000000 {}\n",
        "\u{0}\u{1}",
        "a,b\n1,2\n",
    ] {
        bench.write("a.study", content);
        for arguments in [
            format!("{XY} --file a.study"),
            "model study --join a.study".into(),
        ] {
            bench
                .run(&arguments)
                .is_refused(&["a.study is not a study", "left unchanged"]);
            assert_eq!(bench.read("a.study"), content);
        }
    }
    bench.write("latin.study", [0xff, 0xfe, b'\n']);
    bench
        .run(&format!("{XY} --file latin.study"))
        .is_refused(&["is not a study"]);
    for (file, why) in [("nowhere/a.study", "No such file"), (".", "directory")] {
        let answer = bench.run(&format!("{XY} --file {file}"));
        assert!(
            answer.code == 1 && answer.err.contains(why) && answer.err.contains(file),
            "{answer:?}"
        );
    }
}
