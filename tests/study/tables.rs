//! Tables as CSV and Parquet.

use crate::study::figures::XY;
use crate::study::program::Bench;

#[test]
fn csv_has_one_row_per_draw() {
    let bench = Bench::new();
    assert_eq!(
        bench
            .run(&format!("{XY} --draws 100 --damped --csv draws.csv"))
            .code,
        0
    );
    let table = bench.read("draws.csv");
    let header: Vec<&str> = table.lines().next().expect("a header").split(',').collect();
    let places = ["sL", "sR", "sT", "sB", "gL", "gR", "gT", "gB"]
        .map(|p| format!("plant.secondary_mass_deviation.{p}"));
    assert_eq!(
        (header.len(), header[0], header[9], header[10]),
        (11, "draw", "cnmp_pairs", "damped_cnmp_pairs")
    );
    assert_eq!(header[1..9], places);
    for (number, line) in table.lines().skip(1).enumerate() {
        let cells: Vec<f64> = line
            .split(',')
            .map(|cell| cell.parse().expect("a number"))
            .collect();
        assert!(
            cells.len() == 11
                && cells[0] == number as f64
                && cells[9..].iter().all(|pairs| (0.0..=4.0).contains(pairs))
        );
        assert!(
            cells[1..9].iter().all(|deviation| deviation.abs() <= 0.15),
            "{line}"
        );
    }
    assert_eq!(table.lines().count(), 101);
}

#[test]
#[cfg(not(feature = "parquet"))]
fn rejects_parquet_without_the_feature() {
    let bench = Bench::new();
    for command in [
        XY,
        "model map",
        "model locus --vary plant.mass_asymmetry --from 0 --to 1%",
    ] {
        bench
            .run(&format!("{command} --parquet t.parquet --csv t.csv"))
            .is_refused(&["--features parquet", "--csv FILE"]);
        assert_eq!(bench.files(), [""; 0]);
    }
}

#[cfg(feature = "parquet")]
mod parquet {
    use super::*;
    use crate::study::program::number;
    use crate::study::truth;
    use serde_json::json;

    #[test]
    fn parquet_equals_csv() {
        let bench = Bench::new();
        // In the second command some draws cannot be analysed: null in the table.
        let beams = "model study --config chapter2 --set plant.beam_length_m=0.02 --set plant.operating_point_m=0.01 --vary plant.beam_length_m=+-10mm --vary plant.operating_point_m=+-9.9mm --draws 300";
        let commands = [
            format!("{XY} --draws 2000 --damped"),
            beams.into(),
            "model map --operating-points 0%:15%:11".into(),
            "model locus --vary plant.operating_point_m --from 0% --to 15%".into(),
            "model veering --config chapter2".into(),
            "model step".into(),
        ];
        for command in commands {
            let answer = bench.run(&format!("{command} --csv t.csv --parquet t.parquet"));
            assert_eq!(answer.code, 0, "{}", answer.err);
            let question = json!({"what": "tables", "csv": bench.path("t.csv"), "parquet": bench.path("t.parquet")});
            let Some(answers) = truth::ask_of("tables.py", &[question]) else {
                return;
            };
            assert_eq!(answers[0]["differences"], json!([]), "{command}");
            assert_eq!(
                number(&answers[0]["rows"]) as usize,
                bench.read("t.csv").lines().count() - 1,
                "{command}"
            );
            assert_eq!(answers[0]["has_nulls"], command == beams, "{command}");
        }
    }
}
