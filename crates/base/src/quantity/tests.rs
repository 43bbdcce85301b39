use super::*;

fn si(text: &str, dimension: Dimension) -> Result<f64, String> {
    let quantity: Quantity = text.parse().map_err(|e: QuantityError| e.to_string())?;
    quantity.si(dimension).map_err(|e| e.to_string())
}

#[test]
fn converts_units_to_si_and_takes_bare_numbers_as_si() {
    for (text, dimension, expected) in [
        ("0.1A", Dimension::Current, 0.1),
        ("100mA", Dimension::Current, 100.0 * 1e-3),
        ("20 s", Dimension::Time, 20.0),
        ("10ms", Dimension::Time, 10.0 * 1e-3),
        ("2kHz", Dimension::Frequency, 2000.0),
        (" 50um", Dimension::Length, 50.0 * 1e-6),
        ("50\u{b5}m", Dimension::Length, 50.0 * 1e-6),
        ("50\u{3bc}m", Dimension::Length, 50.0 * 1e-6),
        ("-5e-5m", Dimension::Length, -5e-5),
        ("0.95", Dimension::Length, 0.95),
        ("8 %", Dimension::Ratio, 0.08),
        ("1Hz", Dimension::AngularFrequency, std::f64::consts::TAU),
    ] {
        assert_eq!(si(text, dimension), Ok(expected), "{text}");
    }
}

#[test]
fn displays_very_large_and_small_numbers_with_an_exponent() {
    for (si, text) in [
        (1e308, "1e308 m"),
        (-2.5e-200, "-2.5e-200 m"),
        (0.0, "0 m"),
        (1e9, "1000000000 m"),
    ] {
        assert_eq!(Dimension::Length.display(si), text);
    }
}

#[test]
fn rejects_text_without_number_and_numbers_that_are_not_finite() {
    for text in ["", "mm", "A5", "NaN", "inf%", "-infm", "1e999", "--5s"] {
        let error = si(text, Dimension::Length).unwrap_err();
        assert!(error.contains(&format!("`{text}`")), "{error}");
    }
}

#[test]
fn rejects_unknown_units_and_units_of_another_dimension() {
    let error = si("8 apples", Dimension::Length).unwrap_err();
    assert_eq!(
        error,
        "`8 apples` has the unknown unit `apples`; write for example 0.5, 5Hz or 3.8mm"
    );
    let error = "8%".parse::<Length>().unwrap_err().to_string();
    assert!(
        error.contains("a percentage; give a length in m"),
        "{error}"
    );
    let error = "8mm".parse::<Ratio>().unwrap_err().to_string();
    assert!(
        error.contains("a length in m; give a number without unit"),
        "{error}"
    );
}

#[test]
fn reads_the_dimension_of_a_setting_from_its_key() {
    for (key, dimension) in [
        ("plant.operating_point_m", Dimension::Length),
        ("plant.springs.k.stiffness_n_per_m", Dimension::Stiffness),
        ("amplifier.slew_limit_a_per_s", Dimension::Other("A/s")),
        ("control.reference.speed_m_per_s", Dimension::Speed),
        (
            "plant.damping.first.omega_rad_s",
            Dimension::AngularFrequency,
        ),
        ("chirp.stop_hz", Dimension::Frequency),
        ("plant.mass_asymmetry", Dimension::Ratio),
    ] {
        assert_eq!(Dimension::of_key(key), dimension, "{key}");
    }
}

#[test]
fn percent_of_an_operating_point_is_of_the_beam_length() {
    let share: Quantity = "8%".parse().unwrap();
    assert_eq!(
        share.for_setting("plant.operating_point_m", Some(0.05)),
        Ok(0.004)
    );
    assert_eq!(
        share.for_setting("plant.mass_asymmetry", Some(0.05)),
        Ok(0.08)
    );
    assert!(share.for_setting("plant.operating_point_m", None).is_err());
    assert!(
        share
            .for_setting("interlock.soft_limit_m", Some(0.05))
            .is_err()
    );
}

#[test]
fn an_operating_point_without_unit_is_refused_with_both_ways_to_write_it() {
    let ratio = |text| OperatingPoint::with_unit(text)?.ratio(0.05);
    for (text, expected) in [("8%", 0.08), ("0", 0.0), ("0%", 0.0), ("4mm", 0.004 / 0.05)] {
        assert_eq!(ratio(text), Ok(expected), "{text}");
    }
    // 0.07 * 100 is 7.000000000000001.
    for (text, percent, metres) in [("0.07", "7%", "0.07m"), ("-0.15", "-15%", "-0.15m")] {
        let error = ratio(text).unwrap_err().to_string();
        let words = format!(
            "`{text}` has no unit; write {percent} for a ratio of {text} of the beam length, or {metres} for metres"
        );
        assert_eq!(error, words);
    }
    let error = ratio("5s").unwrap_err().to_string();
    assert!(error.contains("a time in s; give a length in m"), "{error}");
}

#[test]
fn offers_the_units_with_which_a_bare_number_is_allowed() {
    assert_eq!(
        Dimension::Length.other_readings(8.0, &(-0.5..=0.5)),
        ["8mm", "8um", "8nm"]
    );
    assert_eq!(Dimension::Time.other_readings(1e9, &(0.0..=1.0)), [""; 0]);
}
