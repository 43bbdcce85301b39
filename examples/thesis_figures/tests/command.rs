//! The command line of the thesis figures.

use bench_test_support::program::Bench;

fn figures() -> Bench {
    Bench::of(env!("CARGO_BIN_EXE_thesis-figures"))
}

#[test]
fn writes_selected_figures_and_a_page() {
    let bench = figures();
    let answer = bench.json("--only 4-2,table-2-2 --out pictures");
    let numbers: Vec<&str> = answer["figures"]
        .as_array()
        .expect("a list")
        .iter()
        .map(|f| f["number"].as_str().expect("a number"))
        .collect();
    assert_eq!(numbers, ["table-2-2", "4-2"]);
    assert_eq!(answer["page"], "pictures/index.html");
    let mut names: Vec<String> = std::fs::read_dir(bench.path("pictures"))
        .expect("a folder")
        .map(|e| {
            e.expect("an entry")
                .file_name()
                .to_string_lossy()
                .into_owned()
        })
        .collect();
    names.sort();
    assert_eq!(names, ["fig-4-2.svg", "index.html"]);
    assert!(bench.read("pictures/index.html").contains("Table 2-2"));
}

#[test]
fn rejects_an_unknown_number_before_writing() {
    let bench = figures();
    bench
        .run("--only 9-1")
        .is_refused(&["`9-1`", "2-5", "6-13", "table-3-4"]);
    assert!(bench.files().is_empty());
}

#[test]
fn names_a_folder_that_cannot_be_created() {
    let bench = figures();
    bench.write("figures", "a file");
    let answer = bench.run("--only 4-2");
    assert_eq!(answer.code, 1, "{answer:?}");
    assert!(
        answer.err.contains("figures") && answer.err.contains("--out"),
        "{}",
        answer.err
    );
}
