use super::*;
use crate::excitation::Reference;

fn made(settings: &ReferenceSettings) -> Result<Box<dyn Reference>, ReferenceError> {
    let chirp = crate::config::load(&Default::default()).unwrap().chirp;
    let text = settings.design().text()?;
    settings.design().build(&ReferenceContext {
        chirp: &chirp,
        period_s: 1e-3,
        file: text.as_deref(),
    })
}

fn at(settings: ReferenceSettings, tick: u64) -> f64 {
    made(&settings).unwrap().at_m(tick)
}

#[test]
fn each_kind_has_its_analytic_values() {
    let step = ReferenceSettings::Step(StepReference {
        amplitude_m: -5e-5,
        at_s: 0.2,
    });
    assert_eq!((at(step.clone(), 199), at(step, 200)), (0.0, -5e-5));
    for amplitude_m in [4e-6, -4e-6] {
        let ramp = ReferenceSettings::Ramp(RampReference {
            amplitude_m,
            speed_m_per_s: 1e-4,
            at_s: 0.1,
        });
        let side = amplitude_m.signum();
        for (tick, expected) in [
            (0, 0.0),
            (100, 0.0),
            (120, 2e-6 * side),
            (140, 4e-6 * side),
            (1000, 4e-6 * side),
        ] {
            assert!((at(ramp.clone(), tick) - expected).abs() < 1e-18, "{tick}");
        }
    }
    let sine = ReferenceSettings::Sine(SineReference {
        amplitude_m: 1e-6,
        frequency_hz: 10.0,
    });
    assert!((at(sine, 25) - 1e-6).abs() < 1e-18);
    assert_eq!(at(ReferenceSettings::Hold(HoldReference {}), 7), 0.0);
}

#[test]
fn interpolates_linearly_between_the_points_of_a_file() {
    let file = tempfile::NamedTempFile::new().unwrap();
    std::fs::write(
        file.path(),
        "time_s,reference_m\n0,0\n0.01,1e-6\n0.02,1e-6\n",
    )
    .unwrap();
    let settings = ReferenceSettings::File(FileReference {
        path: file.path().display().to_string(),
    });
    for (tick, expected) in [(0, 0.0), (5, 5e-7), (10, 1e-6), (500, 1e-6)] {
        assert!(
            (at(settings.clone(), tick) - expected).abs() < 1e-18,
            "{tick}"
        );
    }
}

#[test]
fn rejects_an_unusable_file_with_its_line() {
    for (text, line) in [
        ("", 1),
        ("time_s,reference_m\n0,0\nx,1\n", 3),
        ("0,0\n0,1\n", 2),
        ("0,NaN\n", 1),
        ("0;1\n", 1),
    ] {
        let file = tempfile::NamedTempFile::new().unwrap();
        std::fs::write(file.path(), text).unwrap();
        let settings = ReferenceSettings::File(FileReference {
            path: file.path().display().to_string(),
        });
        let error = made(&settings).err().unwrap();
        assert!(
            matches!(error, ReferenceError::Line { line: l, .. } if l == line),
            "{text:?}: {error}"
        );
    }
    let missing = ReferenceSettings::File(FileReference {
        path: "/nonexistent".into(),
    });
    assert!(matches!(
        made(&missing),
        Err(ReferenceError::Unreadable { .. })
    ));
}
