//! `bench model map`: CNMP zeros over operating point and mass asymmetry (section 2.2.3).

use serde_json::Value;

use crate::answer::list;
use crate::program::{Bench, near, number};

const PRINTED: &str = "--config chapter2 --set plant.secondary_stage_mass_kg=0.018";

/// The operating points with a CNMP pair at the asymmetry with this index.
fn band(answer: &Value, column: usize) -> Vec<f64> {
    let rows = list(answer, "operating_points")
        .iter()
        .zip(list(answer, "cnmp_pairs"));
    rows.filter(|(_, row)| row[column] == 1)
        .map(|(point, _)| number(point))
        .collect()
}

#[test]
fn map_at_1_percent_has_the_band_of_the_locus() {
    // The points are 0.002 % apart: the first and the last with CNMP zeros are at most that far inside the ends.
    let answer = Bench::new().json(&format!(
        "model map {PRINTED} --operating-points 0%:15%:7501 --asymmetries 0%:1%:2"
    ));
    let band = band(&answer, 1);
    near("its lower end", band[0], 0.03399, 2.5e-5);
    near("its upper end", band[band.len() - 1], 0.06765, 2.5e-5);
    // The band is 3.366 % of L wide, without a gap, in steps of 0.002 %.
    near("its points", band.len() as f64, 1683.0, 2.0);
}

#[test]
fn map_has_no_cnmp_zeros_without_excess_mass() {
    for profile in ["stage", "chapter2"] {
        let answer = Bench::new().json(&format!(
            "model map --config {profile} --operating-points -15%:15%:301 --asymmetries -20%:0%:81"
        ));
        for row in list(&answer, "cnmp_pairs") {
            assert!(
                row.as_array()
                    .expect("a row")
                    .iter()
                    .all(|pairs| *pairs == 0),
                "{profile}: {row}"
            );
        }
    }
}

#[test]
fn csv_and_text_contain_the_map() {
    let bench = Bench::new();
    let answer = bench.run(&format!(
        "model map {PRINTED} --operating-points 3%:7%:5 --asymmetries -0.01:0.01:3 --csv map.csv"
    ));
    assert_eq!(answer.code, 0, "{}", answer.err);
    // Expected from the band above: at D = +1 %, CNMP zeros at 4, 5 and 6 % of L.
    assert_eq!(answer.out.matches("..1").count(), 3, "{}", answer.out);
    assert_eq!(answer.out.matches("...\n").count(), 2, "{}", answer.out);
    let csv = bench.read("map.csv");
    assert_eq!(
        (csv.lines().count(), csv.lines().next()),
        (16, Some("operating_point,mass_asymmetry,cnmp_pairs"))
    );
    assert_eq!(
        csv.lines().filter(|line| line.ends_with(",1")).count(),
        3,
        "{csv}"
    );
}

#[test]
fn rejects_plants_and_options_without_a_map() {
    let bench = Bench::new();
    for (arguments, remedy) in [
        ("--config xy", "sr4dof"),
        ("--config three-mass", "sr4dof"),
        ("--operating-points 0:0.1", "FROM:TO:COUNT"),
        ("--operating-points 1s:2s:5", "a length in m"),
        (
            "--operating-points 0:0.07:5",
            "`0.07` has no unit; write 7% for a ratio of 0.07 of the beam length, or 0.07m for metres",
        ),
        ("--asymmetries 0:0.1:1", "from 2 to"),
        ("--asymmetries 0.1:10%:5", "two different values"),
        (
            "--operating-points 0%:200%:5",
            "--operating-points is 0.095 m",
        ),
        ("--asymmetries -2:0:5", "--asymmetries is -2"),
        ("--asymmetry 5%", "leave them out"),
    ] {
        let answer = bench.run(&format!("model map {arguments}"));
        assert!(
            answer.code == 2 && answer.err.contains(remedy),
            "{arguments}: {} {}",
            answer.code,
            answer.err
        );
    }
}
