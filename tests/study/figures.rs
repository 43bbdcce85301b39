//! Results of a study against closed forms and independent programs.

use serde_json::{Value, json};

use crate::study::program::{Bench, near, number};
use crate::study::truth;

/// Section 2.2.4: all secondary masses of the XY stage within 15 %.
pub const XY: &str = "model study --config xy --vary plant.secondary_mass_deviation.*=+-0.15";

pub fn list<'a>(answer: &'a Value, key: &str) -> &'a [Value] {
    answer[key]
        .as_array()
        .unwrap_or_else(|| panic!("{key} is not a list: {answer}"))
}

/// Probabilities of 0, 1, 2, ... pairs.
fn probabilities(counted: &Value) -> Vec<f64> {
    list(counted, "probabilities")
        .iter()
        .map(|one| number(&one["probability"]))
        .collect()
}

fn share(counted: &Value, key: &str) -> f64 {
    let effect = list(counted, "settings")
        .iter()
        .find(|one| one["key"] == key);
    number(&effect.unwrap_or_else(|| panic!("{key} is missing: {counted}"))["share"])
}

/// Share of an interaction beyond those of its settings; 0 if it is not listed.
fn interaction(counted: &Value, keys: [&str; 2]) -> f64 {
    let found = list(counted, "interactions").iter().find(|one| {
        keys.iter()
            .all(|key| list(one, "keys").contains(&json!(key)))
    });
    found.map_or(0.0, |one| number(&one["share"]))
}

#[test]
fn xy_stage_has_the_reference_probabilities() {
    for seed in [1, 2, 3] {
        let answer = Bench::new().json(&format!("{XY} --draws 20000 --seed {seed}"));
        assert_eq!(
            (&answer["draws"], &answer["not_analysed"]["draws"]),
            (&json!(20_000), &json!(0))
        );
        let counted = &answer["cnmp_pairs"];
        // The sigma of a probability near 0.5 is 0.35 percentage points. The expected values come from 20,000 draws as well, so
        // the sigma of the difference is 0.5 points; the tolerance of 1.2 points is 2.4 sigma.
        let expected = [0.602, 0.388, 0.010, 0.0];
        assert_eq!(probabilities(counted).len(), expected.len());
        for (pairs, expected) in expected.into_iter().enumerate() {
            let one = &list(counted, "probabilities")[pairs];
            near(
                &format!("the probability of {pairs} pairs, seed {seed}"),
                number(&one["probability"]),
                expected,
                0.012,
            );
            let [p, low, high] = ["probability", "low", "high"].map(|key| number(&one[key]));
            // 95 % are +-1.96 sigma: at most +-0.7 percentage points, and 0.02 points if the count is zero.
            assert!(
                low <= p && p <= high && high - low < 0.0145 && high > low,
                "{one}"
            );
        }
        near(
            "the probability of any",
            number(&counted["any"]["probability"]),
            0.398,
            0.012,
        );
    }
}

#[test]
fn pair_counts_of_100_000_draws_agree_with_reference() {
    let bench = Bench::new();
    bench.json(&format!("{XY} --draws 100000 --csv draws.csv"));
    let config = bench.json("config show --config xy");
    // With 60 digits: the 100 draws nearest to a change of the count, and 100 random ones. In double precision by numpy, whose
    // rounding differs: all draws.
    let question = json!({"what": "digits", "config": config, "csv": bench.path("draws.csv"), "hardest": 100, "seed": 1});
    let Some(answers) = truth::ask_of("study.py", &[question]) else {
        return;
    };
    let answer = &answers[0];
    assert_eq!(answer["draws"], 100_000);
    assert_eq!(answer["differ_with_60_digits"], json!([]), "{answer}");
    assert_eq!(answer["differ_in_double"], json!([]), "{answer}");
    // The 100 most ill-conditioned draws: a relative change of the pencil of at most 1e-7 merges two zeros. Rounding of 1e-15
    // still separates them. The sample contains draws with and without pairs.
    let ease = list(answer, "ease_of_the_hardest");
    let (checked, with_pairs) = (number(&answer["checked"]), number(&answer["with_pairs"]));
    assert!(
        number(&ease[0]) < 1e-10 && number(&ease[99]) < 1e-7,
        "{answer}"
    );
    assert!(
        (195.0..=200.0).contains(&checked) && (20.0..180.0).contains(&with_pairs),
        "{answer}"
    );
}

#[test]
fn shares_of_the_xy_stage_agree_with_pick_and_freeze() {
    let bench = Bench::new();
    let answer = bench.json(&format!("{XY} --draws 40000"));
    let groups = [
        &["sL"][..],
        &["sR"],
        &["gL"],
        &["sT"],
        &["sL", "sR"],
        &["sL", "sT"],
        &["gL", "gR"],
    ];
    let config = bench.json("config show --config xy");
    let question = json!({"what": "shares", "config": config, "limit": 0.15, "draws": 60_000, "seed": 5, "groups": groups});
    let Some(answers) = truth::ask_of("study.py", &[question]) else {
        return;
    };
    let counted = &answer["cnmp_pairs"];
    near(
        "the probability of any",
        number(&counted["any"]["probability"]),
        number(&answers[0]["probability"]),
        0.015,
    );
    let key = |place: &str| format!("plant.secondary_mass_deviation.{place}");
    for (group, truth) in groups.iter().zip(list(&answers[0], "shares")) {
        let alone: f64 = group.iter().map(|place| share(counted, &key(place))).sum();
        let together = match group {
            [one, other] => alone + interaction(counted, [&key(one), &key(other)]),
            _ => alone,
        };
        // Both values are estimates with a sigma of 0.004. Binning a pair of settings loses up to 1/28 of the variance.
        let lost = if group.len() > 1 {
            1.0 / 28.0
        } else {
            1.0 / 18.0f64.powi(2)
        };
        let difference = together - number(&truth["share"]);
        assert!(
            (-0.025 - lost..=0.025).contains(&difference),
            "{group:?}: {together}, and {truth}"
        );
    }
    // The largest share is that of sL, with positive direction; the largest interaction includes sR.
    let first = &list(counted, "settings")[0];
    assert_eq!(
        (&first["key"], &first["direction"]),
        (&json!(key("sL")), &json!("+"))
    );
    assert!(
        list(&list(counted, "interactions")[0], "keys").contains(&json!(key("sR"))),
        "{counted}"
    );
}

/// Whether R (x + 100)(x + 121) + u x (x + 121) + v x (x + 100) with R = 1 has complex roots.
fn complex(u: f64, v: f64) -> bool {
    let (a, b, c) = (1.0 + u + v, 221.0 + 121.0 * u + 100.0 * v, 12_100.0);
    b * b < 4.0 * a * c
}

#[test]
fn two_residues_match_the_closed_form() {
    let bench = Bench::new();
    bench.write(
        "modes.toml",
        "[plant]\nmodel = \"modal\"\n[plant.modes]\nR = { omega_rad_s = 0.0, residue_per_kg = 1.0 }\nu = { omega_rad_s = 10.0, residue_per_kg = -1.0 }\nv = { omega_rad_s = 11.0, residue_per_kg = 1.0 }\n",
    );
    // Midpoint rule: about 1000 of the 1000 x 1000 points are at the border.
    let at = |k: usize, nominal: f64| nominal + 0.95 * ((k as f64 + 0.5) / 500.0 - 1.0);
    let yes = |i: usize, j: usize| f64::from(complex(at(i, -1.0), at(j, 1.0)));
    let n = 1000;
    let rows: Vec<f64> = (0..n)
        .map(|i| (0..n).map(|j| yes(i, j)).sum::<f64>() / n as f64)
        .collect();
    let columns: Vec<f64> = (0..n)
        .map(|j| (0..n).map(|i| yes(i, j)).sum::<f64>() / n as f64)
        .collect();
    let p = rows.iter().sum::<f64>() / n as f64;
    let index = |means: &[f64]| {
        means.iter().map(|m| (m - p).powi(2)).sum::<f64>() / n as f64 / (p * (1.0 - p))
    };
    let (of_u, of_v) = (index(&rows), index(&columns));
    assert!(
        (0.1..0.9).contains(&p) && of_u > 0.02 && of_v > 0.02,
        "the case is not informative: {p} {of_u} {of_v}"
    );

    let [u, v] = ["u", "v"].map(|name| format!("plant.modes.{name}.residue_per_kg"));
    for seed in [1, 2, 3] {
        let answer = bench.json(&format!(
            "model study --config modes.toml --vary {u}=uniform:-0.95:0.95 --vary {v}=+-95% --draws 40000 --seed {seed}"
        ));
        let counted = &answer["cnmp_pairs"];
        // Five sigma of 40,000 draws.
        near(
            "the probability",
            number(&counted["any"]["probability"]),
            p,
            5.0 * 0.5 / 200.0,
        );
        // The sigma of a share S is below 2 sqrt(S/N) with N = 40,000 draws. Binning into 18 classes reduces a linear effect by
        // 1/18^2.
        near("the share of u", share(counted, &u), of_u, 0.03);
        near("the share of v", share(counted, &v), of_v, 0.03);
        // The interaction explains the rest, less the 1/28 that binning loses at each of at most two borders.
        let rest = 1.0 - of_u - of_v - interaction(counted, [&u, &v]);
        assert!((-0.03..2.0 / 28.0 + 0.03).contains(&rest), "{rest}");
        let unexplained =
            1.0 - number(&counted["share_alone"]) - number(&counted["share_of_interactions"]);
        assert!(
            (-0.03..2.0 / 28.0 + 0.03).contains(&unexplained),
            "{unexplained}"
        );
    }
}

#[test]
fn normal_tolerance_has_normal_tails() {
    let bench = Bench::new();
    // SR4DoF has CNMP zeros between two asymmetries, which `bench model locus` finds by bisection.
    let stage = "--config chapter2 --set plant.secondary_stage_mass_kg=0.018 --operating-point 5%";
    let locus = bench.json(&format!(
        "model locus {stage} --vary plant.mass_asymmetry --from -10% --to 20%"
    ));
    let [low, high] = list(&locus, "changes") else {
        panic!("{}", locus["changes"])
    };
    let (low, width) = (
        number(&low["value"]),
        number(&high["value"]) - number(&low["value"]),
    );
    // Nominal value and sigma, and the part of the distribution between the two: Phi(1) - Phi(-1), Phi(1) - 1/2, Phi(2) - 1/2.
    for (nominal, sigma, between) in [
        (low + width / 2.0, width / 2.0, 0.682_689),
        (low, width, 0.341_345),
        (low, width / 2.0, 0.477_250),
    ] {
        let answer = bench.json(&format!(
            "model study {stage} --asymmetry {nominal:?} --vary plant.mass_asymmetry=normal:{sigma:?} --draws 20000"
        ));
        let bound = 5.0 * f64::sqrt(between * (1.0 - between) / 20_000.0);
        near(
            "the part between",
            number(&answer["cnmp_pairs"]["any"]["probability"]),
            between,
            bound,
        );
        // One setting explains everything except the classes that contain the two borders.
        assert!(
            (0.85..=1.001).contains(&share(&answer["cnmp_pairs"], "plant.mass_asymmetry")),
            "{answer}"
        );
    }
}

#[test]
fn damped_zeros_are_counted() {
    let bench = Bench::new();
    // With strong damping all zeros of the XY stage are in the left half plane.
    let answer = bench.json(&format!(
        "{XY} --draws 1000 --damped --set plant.damping.ratio=0.3"
    ));
    let [without, with] =
        ["cnmp_pairs", "damped_cnmp_pairs"].map(|key| number(&answer[key]["any"]["probability"]));
    assert!(
        (0.32..0.48).contains(&without) && with < 0.01,
        "{without} {with}"
    );
    // With weak damping the count equals that without damping, except for draws near the border.
    let answer = bench.json(&format!(
        "{XY} --draws 1000 --damped --set plant.damping.ratio=1e-6"
    ));
    let [without, with] =
        ["cnmp_pairs", "damped_cnmp_pairs"].map(|key| number(&answer[key]["any"]["probability"]));
    near("the probability with little damping", with, without, 0.005);
    assert!(bench.json(&format!("{XY} --draws 10"))["damped_cnmp_pairs"].is_null());
}

#[test]
fn draws_depend_on_the_seed_alone() {
    let bench = Bench::new();
    let table = |options: &str| {
        assert_eq!(
            bench.run(&format!("{XY} {options} --csv draws.csv")).code,
            0
        );
        bench.read("draws.csv")
    };
    let first = table("--draws 700 --seed 4 --threads 1");
    assert_eq!(first, table("--draws 700 --seed 4 --threads 3"));
    assert_eq!(
        first.lines().take(501).collect::<Vec<_>>(),
        table("--draws 500 --seed 4").lines().collect::<Vec<_>>()
    );
    assert_ne!(first, table("--draws 700 --seed 5"));
}

#[test]
fn text_reports_tolerances_probabilities_and_shares() {
    let answer = Bench::new().run(&format!("{XY} --draws 2000 --damped"));
    assert_eq!(answer.code, 0, "{}", answer.err);
    for words in [
        "2000 draws, seed 1",
        "-0.15 to +0.15, uniform",
        "95 % by Wilson",
        "share %",
        "with damping",
        "second-order interactions",
    ] {
        assert!(
            answer.out.contains(words),
            "`{words}` is not in\n{}",
            answer.out
        );
    }
}
