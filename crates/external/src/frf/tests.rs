//! Tables of other programs give the response that was written, or say what is missing.

use std::f64::consts::{PI, TAU};

use num_complex::Complex;

use super::columns::Columns;
use super::numbers::Numbers;
use super::*;
use crate::table::Table;

/// A mode at 30 Hz with a delay of 0.5 ms, and a scatter of one part in 10 000.
fn stage(hz: f64) -> Complex<f64> {
    let x = hz / 30.0;
    let mode = Complex::from(1e-4) / Complex::new(1.0 - x * x, 0.04 * x);
    let scatter = 1.0 + 1e-4 * libm::sin(1e3 * hz * hz);
    mode * Complex::from_polar(scatter, -TAU * hz * 5e-4)
}

fn grid() -> impl Iterator<Item = f64> {
    (1..=200).map(|k| 0.5 * f64::from(k))
}

fn of(text: String, phase: Option<PhaseUnit>) -> Result<ImportedFrf, FrfTableError> {
    named("frf.csv", text, phase, UnitRule::MetresPerAmpere)
}

fn named(
    name: &str,
    text: String,
    phase: Option<PhaseUnit>,
    rule: UnitRule,
) -> Result<ImportedFrf, FrfTableError> {
    let table = FrfTable::Text(Table::of(Path::new(name), text)?);
    let columns = Columns::of(&table, rule)?;
    points::response(&Numbers::read(&table, &columns)?, columns, phase, rule)
}

/// A table with these lines before it and three numbers in each line.
fn table(heading: &str, separator: &str, row: fn(f64, Complex<f64>) -> [f64; 3]) -> String {
    let rows = grid().map(|hz| {
        let cells = row(hz, stage(hz)).map(|number| format!("{number:e}"));
        format!("{}\n", cells.join(separator))
    });
    format!("{heading}{}", rows.collect::<String>())
}

#[track_caller]
fn is_stage(found: Result<ImportedFrf, FrfTableError>) -> ImportedFrf {
    let found = found.expect("a response");
    for (k, hz) in grid().enumerate() {
        let frequency_hz = found.frf.frequency_hz[k];
        assert!((frequency_hz / hz - 1.0).abs() < 1e-12, "{frequency_hz}");
        // Three conversions of rounded numbers, at phases of up to 3.4 rad.
        let ratio = found.frf.response[k] / stage(hz);
        assert!((ratio - 1.0).norm() < 1e-13, "{hz} Hz: {ratio}");
    }
    assert_eq!(found.sigma, SigmaSource::Estimated);
    found
}

fn db(h: Complex<f64>) -> f64 {
    20.0 * libm::log10(h.norm())
}

/// The three columns of a response at a frequency in hertz.
type RowOf = fn(f64, Complex<f64>) -> [f64; 3];

#[test]
fn units_are_those_of_the_names() {
    let cases: [(&str, RowOf); 12] = [
        ("frequency_hz,magnitude_m_per_a,phase_deg", |hz, h| {
            [hz, h.norm(), h.arg().to_degrees()]
        }),
        ("f (kHz),|G| (dB),phase (rad)", |hz, h| {
            [1e-3 * hz, db(h), h.arg()]
        }),
        ("omega,mag_db,phase_deg", |hz, h| {
            [TAU * hz, db(h), h.arg().to_degrees()]
        }),
        ("Freq [rad/s],magnitude (dB),Phase [°]", |hz, h| {
            [TAU * hz, db(h), h.arg().to_degrees()]
        }),
        ("Hz,dB,deg", |hz, h| [hz, db(h), h.arg().to_degrees()]),
        ("f_hz,real,imag", |hz, h| [hz, h.re, h.im]),
        ("imag,freq_hz,real", |hz, h| [h.im, hz, h.re]),
        ("freq_hz,Re(G) [m/A],Im(G) [m/A]", |hz, h| [hz, h.re, h.im]),
        ("f,gain,phase\nHz,m/A,rad", |hz, h| [hz, h.norm(), h.arg()]),
        ("f [Hz],Magnitude (dB re 1 m/A),Phase [deg]", |hz, h| {
            [hz, db(h), h.arg().to_degrees()]
        }),
        ("f [Hz],|G(f)| [dB],arg G(f) [deg]", |hz, h| {
            [hz, db(h), h.arg().to_degrees()]
        }),
        (
            "Frequency [Hz],Frequency response magnitude (m/A),Frequency response phase (deg)",
            |hz, h| [hz, h.norm(), h.arg().to_degrees()],
        ),
    ];
    for (names, row) in cases {
        let found = is_stage(of(table(&format!("{names}\n"), ",", row), None));
        assert!(
            found.assumptions.is_empty(),
            "{names}: {:?}",
            found.assumptions
        );
    }
}

#[test]
fn comments_separators_and_decimal_commas_are_read() {
    let polar = |hz: f64, h: Complex<f64>| [hz, h.norm(), h.arg().to_degrees()];
    for separator in [",", ";", "\t", "  "] {
        for heading in ["% Analyser 3\n% run 7\n", "# Analyser 3\n"] {
            let names = "f_hz,mag,phase_deg\n".replace(',', separator);
            is_stage(of(
                table(&format!("{heading}{names}"), separator, polar),
                None,
            ));
        }
    }
    let text = table("f_hz;mag;phase_deg\n", ";", polar).replace('.', ",");
    is_stage(of(text, None));
}

#[test]
fn numbers_decide_where_names_do_not_and_the_assumption_is_stated() {
    let cases: [(&str, RowOf, &[&str]); 5] = [
        (
            "f_hz,mag,phase\n",
            |hz, h| [hz, h.norm(), h.arg().to_degrees()],
            &["degrees"],
        ),
        (
            "f,mag,phase\n",
            |hz, h| [hz, h.norm(), h.arg()],
            &["Hz", "radians"],
        ),
        (
            "",
            |hz, h| [hz, h.norm(), h.arg()],
            &["Hz", "magnitude (m/A)", "radians"],
        ),
        (
            "",
            |hz, h| [hz, db(h), h.arg().to_degrees()],
            &["Hz", "dB", "degrees"],
        ),
        ("", |hz, h| [hz, h.re, h.im], &["Hz", "real"]),
    ];
    for (heading, row, words) in cases {
        let found = is_stage(of(table(heading, ",", row), None));
        assert_eq!(
            found.assumptions.len(),
            words.len(),
            "{:?}",
            found.assumptions
        );
        for (assumption, word) in found.assumptions.iter().zip(words) {
            assert!(assumption.contains(word), "{assumption}");
        }
    }
}

#[test]
fn phases_of_unknown_unit_are_refused_with_the_option_that_decides() {
    // Ten radians, unwrapped, or ten degrees.
    let unwrapped = |hz: f64, h: Complex<f64>| [hz, h.norm(), -0.1 * hz];
    let text = table("f_hz,mag,phase\n", ",", unwrapped);
    let error = of(text.clone(), None).expect_err("unknown").to_string();
    assert!(
        error.contains("--frf-phase") && error.contains("10.0000"),
        "{error}"
    );
    for (unit, rad) in [(PhaseUnit::Rad, 1.0), (PhaseUnit::Deg, PI / 180.0)] {
        let found = of(text.clone(), Some(unit)).expect("given");
        let phase = found.frf.phase_rad(9);
        assert!((phase + 0.5 * rad).abs() < 1e-12, "{phase}");
    }
}

#[test]
fn sigma_of_the_file_is_used_and_one_that_no_measurement_has_is_refused() {
    let with = |sigma: fn(usize) -> &'static str| {
        let rows = grid().enumerate().map(|(k, hz)| {
            let h = stage(hz);
            format!("{hz},{},{},{}\n", h.re, h.im, sigma(k))
        });
        format!(
            "f_hz,real,imag,magnitude_sigma\n{}",
            rows.collect::<String>()
        )
    };
    let given = of(with(|_| "2e-8"), None).expect("given");
    assert_eq!(given.sigma, SigmaSource::Given);
    assert!((given.frf.magnitude_sigma[7] / 2e-8 - 1.0).abs() < 1e-12);
    let partly = of(with(|k| if k == 7 { "" } else { "2e-8" }), None).expect("one without");
    assert_eq!(partly.sigma, SigmaSource::Estimated);
    assert!((partly.frf.magnitude_sigma[6] / 2e-8 - 1.0).abs() < 1e-12);
    let other = partly.frf.magnitude_sigma[7];
    assert!(other > 0.0 && (other / 2e-8 - 1.0).abs() > 1e-3, "{other}");
    for (text, words) in [
        (
            with(|k| if k == 7 { "0" } else { "2e-8" }),
            "0 is the standard deviation of an exact value",
        ),
        (
            with(|k| if k == 7 { "-1e-8" } else { "2e-8" }),
            "is negative",
        ),
        (
            with(|k| if k == 7 { "inf" } else { "2e-8" }),
            "not a finite number",
        ),
    ] {
        let error = of(text, None).expect_err(words).to_string();
        for word in ["line 9", "magnitude_sigma", words] {
            assert!(error.contains(word), "`{word}` is not in {error}");
        }
    }
}

#[test]
fn defects_are_refused_with_their_place() {
    let cases = [
        ("a,b,c\n1,2,3\n2,3,4\n", "no column of the frequency"),
        ("f,b,c\n1,2,3\n2,3,4\n", "no column of the magnitude"),
        ("f_hz,mag_um_per_a,phase_deg\n1,2,3\n2,3,4\n", "not in m/A"),
        ("f_hz,Mag (m/s/A),phase_deg\n1,2,3\n2,3,4\n", "not in m/A"),
        ("f_hz,Mag (m/s^2/A),phase_deg\n1,2,3\n2,3,4\n", "not in m/A"),
        ("f_hz,Mag (rad/A),phase_deg\n1,2,3\n2,3,4\n", "not in m/A"),
        (
            "f_hz,magnitude_angle_rad_per_current_a,phase_deg\n1,2,3\n2,3,4\n",
            "not in m/A",
        ),
        (
            "f_hz,mag,phase_deg,Mag std (dB)\n1,2,3,1\n2,3,4,1\n",
            "`Mag std (dB)` is not in m/A",
        ),
        (
            "f_hz,mag,phase_deg,sigma (%)\n1,2,3,1\n2,3,4,1\n",
            "`sigma (%)` is not in m/A",
        ),
        (
            "f_hz,magnitude_a_per_m,phase_deg\n1,2,3\n2,3,4\n",
            "not in m/A",
        ),
        (
            "f_hz,mag,abs,phase_deg\n1,2,3,4\n2,3,4,5\n",
            "`mag` and `abs`",
        ),
        ("f_hz,mag,phase_deg\n1,2,3\n1,3,4\n", "line 3: 1"),
        (
            "f_hz,mag,phase_deg\n1,2,3\n2,-3,4\n",
            "line 3, column `mag`: -3 is negative",
        ),
        (
            "f_hz,mag,phase_deg,coherence\n1,2,3,1\n2,3,4,1.7\n",
            "1.7 is not a coherence",
        ),
        ("f_hz,mag,phase_deg\n1,2,3\n2,3,4\n", "2 frequencies"),
        ("1,2,-300\n2,-3,4\n", "no line with the names"),
    ];
    for (text, words) in cases {
        let error = of(text.into(), None).expect_err(words).to_string();
        assert!(error.contains(words) && error.contains("; "), "{error}");
    }
}

#[test]
fn line_at_zero_hertz_is_left_out() {
    // Also one with the logarithm of 0.
    for line in ["0,1,0", "0,-inf,nan"] {
        let heading = format!("f_hz,real,imag\n{line}\n");
        let text = table(&heading, ",", |hz, h| [hz, h.re, h.im]);
        let found = is_stage(of(text, None));
        assert_eq!(found.assumptions, ["the line at 0 Hz is left out"]);
    }
}

#[test]
fn any_unit_is_read_and_stated() {
    let row: RowOf = |hz, h| [hz, 1e6 * h.norm(), h.arg().to_degrees()];
    for (names, unit) in [
        ("frequency_hz,magnitude_um_per_n,phase_deg", Some("um/N")),
        ("Freq (Hz),|G| [um/N],phase (deg)", Some("um/N")),
        ("f,gain,phase\nHz,um/V,deg", Some("um/V")),
        ("f_hz,mag,phase_deg", None),
    ] {
        let text = table(&format!("{names}\n"), ",", row);
        let found = named("frf.csv", text, None, UnitRule::Any).expect(names);
        let stated = found.unit.as_ref().map(ToString::to_string);
        assert_eq!(stated.as_deref(), unit, "{names}");
        assert!(!found.has_coherence);
        let ratio = found.frf.response[9] / (1e6 * stage(5.0));
        assert!((ratio - 1.0).norm() < 1e-13, "{names}: {ratio}");
    }
}

#[test]
fn three_columns_of_a_frd_file_are_decibels_and_degrees() {
    // 140 dB above that of m/A: positive and negative ones.
    let row: RowOf = |hz, h| [hz, db(h) + 90.0, h.arg().to_degrees()];
    let text = table("", "\t", row);
    let found = named("door.FRD", text.clone(), None, UnitRule::Any).expect("a FRD file");
    let ratio = found.frf.response[59] / stage(30.0) / libm::pow(10.0, 4.5);
    assert!((ratio - 1.0).norm() < 1e-12, "{ratio}");
    assert!(
        found
            .assumptions
            .iter()
            .any(|text| text.contains("degrees"))
    );
    let error = named("door.txt", text, None, UnitRule::Any).expect_err("unknown");
    assert!(error.to_string().contains("frequency_hz,real,imag"));
}

#[test]
fn positive_numbers_without_names_are_a_magnitude_only_with_the_range_of_one() {
    // Over 1 to 100 Hz the magnitudes have a range of 25/0.1 = 250; with 100 times that of the first line they exceed 1000.
    let rows: RowOf = |hz, h| [hz, 1e6 * h.norm(), h.arg().to_degrees()];
    let narrow = table("", ",", rows);
    assert!(named("a.csv", narrow.clone(), None, UnitRule::MetresPerAmpere).is_ok());
    assert!(matches!(
        named("a.csv", narrow.clone(), None, UnitRule::Any),
        Err(FrfTableError::Unnamed { .. })
    ));
    let wide = format!("{narrow}101,1e-3,-180\n");
    assert!(named("a.csv", wide, None, UnitRule::Any).is_ok());
}

#[test]
fn units_that_contradict_each_other_and_derivatives_are_refused() {
    for (names, words) in [
        ("f_hz,Re (um/N),Im (mm/N)", "both in one unit"),
        ("f_hz,mag_m_per_s_per_n,phase_deg", "velocity"),
        ("f_hz,Mag accelerance (g/N),phase_deg", "acceleration"),
        ("f_hz,Mag (m/s^2/N),phase_deg", "acceleration"),
        ("f_hz,Mag [m/s\u{b2}/N],phase_deg", "acceleration"),
    ] {
        let columns = names.matches(',').count();
        let row = "1".to_string() + &",1".repeat(columns);
        let error = named("a.csv", format!("{names}\n{row}\n"), None, UnitRule::Any);
        let error = error.expect_err(names).to_string();
        assert!(error.contains(words) && error.contains("; "), "{error}");
    }
    for sigma in ["sigma (%)", "Mag std (dB)", "magnitude_sigma (m/A)"] {
        let text = format!("f_hz,Mag (um/A),phase_deg,{sigma}\n1,2,3,1\n");
        let error = named("a.csv", text, None, UnitRule::Any).expect_err(sigma);
        assert!(matches!(error, FrfTableError::SigmaUnit { .. }), "{error}");
    }
}
