//! `bench model locus`, `bounds`, `step`, `sequence`, `critical-damping`: loci of zeros and the limits that zeros impose.

use serde_json::{Value, json};

use crate::answer::list;
use crate::program::{Bench, near, number};
use crate::truth;

/// The stage of Chapter 2 with the printed m3 and D = 1 %.
const ONE_PER_CENT: &str =
    "--config chapter2 --set plant.secondary_stage_mass_kg=0.018 --asymmetry 1%";

fn over_operating_point(bench: &Bench, count: u32) -> Value {
    bench.json(&format!(
        "model locus {ONE_PER_CENT} --vary plant.operating_point_m --from 1% --to 15% --count {count} --csv tracks.csv"
    ))
}

#[test]
fn zeros_are_complex_from_3_40_to_6_75_percent_of_l() {
    let bench = Bench::new();
    for count in [5, 8, 101] {
        let answer = over_operating_point(&bench, count);
        let changes = list(&answer, "changes");
        assert_eq!(changes.len(), 2, "with {count} values: {answer}");
        // The thesis prints the first and the last operating point with CNMP zeros, in steps of 0.05 %.
        near(
            "the lower end",
            number(&changes[0]["value"]) / 0.0475,
            0.0340,
            5e-4,
        );
        near(
            "the upper end",
            number(&changes[1]["value"]) / 0.0475,
            0.0675,
            5e-4,
        );
        for (change, (before, after)) in changes
            .iter()
            .zip([("MMP", "CMP-CNMP"), ("CMP-CNMP", "MMP")])
        {
            assert_eq!(change["at"], "imaginary axis");
            assert!(
                change["before"].as_str().expect("words").contains(before),
                "{change}"
            );
            assert!(
                change["after"].as_str().expect("words").contains(after),
                "{change}"
            );
        }
    }
}

#[test]
fn ends_of_the_band_agree_with_python() {
    let bench = Bench::new();
    let config = bench.json(&format!("config show {ONE_PER_CENT}"));
    let points: Vec<f64> = (4..=60).map(|i| 0.0025 * f64::from(i)).collect();
    let Some(answers) =
        truth::ask(&[json!({"what": "bands", "config": config, "operating_points": points})])
    else {
        return;
    };
    let answer = over_operating_point(&bench, 30);
    let (ours, theirs) = (list(&answer, "changes"), list(&answers[0], "edges"));
    assert_eq!((ours.len(), theirs.len()), (2, 2));
    for (change, edge) in ours.iter().zip(theirs) {
        // Both programs treat a pair as complex if its real part exceeds 1e-7 of its magnitude, which shifts the end by 1e-14.
        // Rounding of the two matrix pencils adds to it.
        near(
            "an end of the band",
            number(&change["value"]) / 0.0475,
            number(edge),
            1e-9,
        );
    }
}

#[test]
fn residue_of_mode_r_is_critical_at_the_ends_of_the_band() {
    // Eq. (4-5) with shifted frequencies is exact for three modes. The Y mode, which it omits, contributes less than 0.1 % of a peak at
    // 0.1 % damping: 1e-6 of a residue, and 1e-5 of differences of residues.
    for change in list(&over_operating_point(&Bench::new(), 30), "changes") {
        let form = &change["closed_form"];
        let of = |key: &str| number(&form[key]);
        near(
            "aR by Eq. (4-5), shifted",
            of("eq_4_5_shifted") / of("residue_r"),
            1.0,
            1e-5,
        );
        near(
            "b2 by Eq. (4-6), shifted",
            of("eq_4_6_shifted") / of("b2"),
            1.0,
            1e-5,
        );
        // Without the shift mode R is treated as a double integrator, which changes the squares of the frequencies by (18/153)^2 = 1.4 %.
        near(
            "aR by Eq. (4-5)",
            of("eq_4_5") / of("residue_r"),
            1.014,
            2e-3,
        );
    }
}

#[test]
fn tracks_are_continuous_and_equal_the_zeros_of_modes() {
    let bench = Bench::new();
    let answer = over_operating_point(&bench, 101);
    let (values, tracks) = (list(&answer, "values"), list(&answer, "tracks"));
    let at =
        |track: &Value, k: usize| (number(&track["re_rad_s"][k]), number(&track["im_rad_s"][k]));
    for k in [0, 30, 60, 100] {
        let modes = bench.json(&format!(
            "model modes {ONE_PER_CENT} --operating-point {}",
            values[k]
        ));
        for track in tracks {
            let (re, im) = at(track, k);
            let distance = |zero: &Value| {
                (number(&zero["re_rad_s"]) - re).hypot(number(&zero["im_rad_s"]) - im)
            };
            let nearest = list(&modes, "zeros")
                .iter()
                .map(distance)
                .fold(f64::MAX, f64::min);
            near("the distance to a zero", nearest, 0.0, 1e-6);
        }
    }
    // Where zeros meet, they move with the square root of the distance in the varied setting: at most some 3 % in a step of 1 % of the range.
    for track in tracks {
        for k in 1..values.len() {
            let ((re, im), (next_re, next_im)) = (at(track, k - 1), at(track, k));
            assert!(
                (next_re - re).hypot(next_im - im) < 0.05 * re.hypot(im),
                "{re} {im:+}j to {next_re} {next_im:+}j at {k}"
            );
        }
    }
    let csv = bench.read("tracks.csv");
    assert!(
        csv.starts_with("plant.operating_point_m,zero_1_re_rad_s,zero_1_im_rad_s,zero_2_re_rad_s")
    );
    assert_eq!(csv.lines().count(), 102);
}

#[test]
fn damping_delays_the_change_to_cnmp_zeros() {
    // Damping moves zeros to the left: the damped locus crosses the axis after the point where the undamped zeros meet, and returns
    // before the point where they meet again.
    let bench = Bench::new();
    let locus = |damped: &str| {
        let answer = bench.json(&format!(
            "model locus {ONE_PER_CENT} --vary plant.operating_point_m --from 1% --to 15% --count 60 {damped}"
        ));
        list(&answer, "changes")
            .iter()
            .map(|change| (change["at"].clone(), number(&change["value"])))
            .collect::<Vec<_>>()
    };
    let (undamped, damped) = (locus(""), locus("--damped"));
    assert_eq!(
        (undamped.len(), damped.len()),
        (2, 2),
        "{undamped:?} {damped:?}"
    );
    assert!(
        damped.iter().all(|(at, _)| at == "imaginary axis"),
        "{damped:?}"
    );
    assert!(
        damped[0].1 > undamped[0].1 && damped[1].1 < undamped[1].1,
        "{undamped:?} {damped:?}"
    );
}

#[test]
fn critical_damping_is_0_2240() {
    let answer = Bench::new().json("model critical-damping");
    near("Eq. (3-16)", number(&answer["eq_3_16"]), 0.2240, 5e-5);
    // The double root of the crossing condition, computed with scipy: 0.22438943.
    near(
        "the damping at which the locus touches the axis",
        number(&answer["touching"]),
        0.224_389_43,
        1e-8,
    );
}

#[test]
fn opening_angle_is_the_integral_of_eq_1_2() {
    let bench = Bench::new();
    let bands = [10.0, 300.0, 520.0, 530.2, 545.0, 3000.0];
    let bound = |band: f64| {
        let answer = bench.json(&format!("model bounds --alpha 0.3 --bandwidth {band}"));
        list(&answer, "zeros")[0].clone()
    };
    let bounds: Vec<Value> = bands.iter().map(|band| bound(*band)).collect();
    let zero = [
        number(&bounds[0]["re_rad_s"]),
        number(&bounds[0]["im_rad_s"]),
    ];
    near("the zero", zero[0], 12.8, 0.05);
    let questions: Vec<Value> = bands
        .iter()
        .map(|band| json!({"what": "angle", "zeros": [[zero[0], zero[1], band]]}))
        .collect();
    let Some(answers) = truth::ask(&questions) else {
        return;
    };
    for (bound, answer) in bounds.iter().zip(&answers) {
        let angle = number(&answer[0]);
        near(
            "Theta",
            number(&bound["opening_angle_deg"]).to_radians(),
            angle,
            1e-10,
        );
        let peak = (1.0f64 / 0.3).powf(angle / (std::f64::consts::PI - angle));
        near(
            "the peak",
            number(&bound["sensitivity_peak"]) / peak,
            1.0,
            1e-8,
        );
    }
}

#[test]
fn fast_loop_respects_the_bound_of_its_zeros() {
    // Eq. (1-3) applies to a stable loop with a stable plant, as the fast one. By definition |S| < 1/sqrt(2) up to the bandwidth of
    // the sensitivity.
    let bench = Bench::new();
    let margins = bench.json("margins --fast --continuous");
    assert_eq!(margins["stable"], true);
    let band = number(&margins["sensitivity_bandwidth_rad_s"]);
    let answer = bench.json(&format!(
        "model bounds --alpha 0.70710678 --bandwidth {band}"
    ));
    let bounds = list(&answer, "damped_zeros");
    assert_eq!(bounds.len(), 1, "one CNMP pair: {answer}");
    let peak = 10f64.powf(number(&margins["sensitivity_peak_db"]) / 20.0);
    let bound = number(&bounds[0]["sensitivity_peak"]);
    assert!(
        1.0 < bound && bound < peak,
        "lower bound {bound}, actual peak {peak}"
    );
    // The inverse: the bandwidth for a given peak, and the peak of that bandwidth.
    let answer = bench.json("model bounds --alpha 0.4 --peak 2.5");
    near(
        "the peak of the band",
        number(&list(&answer, "damped_zeros")[0]["sensitivity_peak"]),
        2.5,
        1e-9,
    );
}

#[test]
fn model_modes_reports_the_sensitivity_bound() {
    let bench = Bench::new();
    let (modes, bounds) = (bench.json("model modes"), bench.json("model bounds"));
    assert_eq!(modes["bounds"], bounds["zeros"]);
    let zero = &list(&bounds, "zeros")[0];
    // (1/0.5)^(Theta/(pi - Theta)) = 2 for Theta = 90 degrees: the zero is on the circle with the diameter from -j w0 to j w0.
    let magnitude = number(&zero["re_rad_s"]).hypot(number(&zero["im_rad_s"]));
    near(
        "the bandwidth",
        number(&zero["bandwidth_rad_s"]),
        magnitude,
        1e-9 * magnitude,
    );
    let text = bench.run("model modes").out;
    let bound = format!("at most {magnitude:.1} rad/s for |S| < 0.5 with a peak below 2");
    assert!(text.contains(&bound), "`{bound}` is not in {text}");
}

#[test]
fn locus_reports_a_setting_without_effect() {
    let answer =
        Bench::new().run("model locus --vary sim.probe_noise_rms_m --from 0 --to 1e-9 --count 3");
    assert!(
        answer
            .out
            .contains("the zeros do not depend on sim.probe_noise_rms_m"),
        "{answer:?}"
    );
}

#[test]
fn minimum_phase_stage_has_no_bound() {
    let answer = Bench::new().json("model bounds --asymmetry -10%");
    assert!(
        list(&answer, "zeros").is_empty() && list(&answer, "damped_zeros").is_empty(),
        "{answer}"
    );
}

#[test]
fn stage_as_built_is_in_table_3_3() {
    let bench = Bench::new();
    for (asymmetry, signs, row) in [("10%", "+-+", 1), ("-10%", "++-", 7)] {
        let answer = bench.json(&format!("model sequence --asymmetry {asymmetry}"));
        assert_eq!(answer["sign_sequence"], signs);
        assert_eq!(answer["table"]["table"], "3-3", "{answer}");
        assert_eq!(answer["table"]["row"], row, "{answer}");
        assert_eq!(answer["agree"], true);
    }
    // At Y1o = 0 only one mode is observed, which no table covers.
    let answer = bench.json("model sequence --operating-point 0%");
    assert_eq!(
        (&answer["dominant_sequence"], &answer["table"]),
        (&json!("[R]"), &Value::Null)
    );
}

#[test]
fn step_of_the_stage_agrees_with_the_prediction_of_its_zeros() {
    let bench = Bench::new();
    for asymmetry in ["10%", "2%", "-10%"] {
        let answer = bench.json(&format!(
            "model step --asymmetry {asymmetry} --csv step.csv --count 500"
        ));
        assert_eq!(answer["predicted"]["agrees"], true, "{answer}");
        assert_eq!(answer["initial_undershoot"], false);
        // The static stiffness is k4 + k5 = 72 kN/m.
        near(
            "the final value",
            number(&answer["end_m_per_n"]) * 72e3,
            1.0,
            1e-2,
        );
        let csv = bench.read("step.csv");
        assert!(csv.starts_with(
            "time_s,displacement_m_per_n,mode_1_m_per_n,mode_2_m_per_n,mode_3_m_per_n\n0e0,0e0,"
        ));
        assert_eq!(csv.lines().count(), 501);
        for line in csv.lines().skip(1) {
            let cells: Vec<f64> = line
                .split(',')
                .map(|cell| cell.parse().expect("a number"))
                .collect();
            near(
                "the sum of the modes",
                cells[1],
                cells[2..].iter().sum(),
                1e-15,
            );
        }
    }
}
