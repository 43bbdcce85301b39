//! CSV files: frequency responses, external records, references.

use std::path::Path;

use bench_external::{Columns, Record, Sampling};
use bench_identify::frf_csv;

use crate::random_inputs::damage::{check_damaged, check_damaged_text};

const FRF: &str = "frequency_hz,magnitude_m_per_a,phase_deg,coherence,magnitude_sigma,phase_sigma_deg,resolution_hz\n\
1.0,1e-4,-10.0,0.99,1e-7,0.1,0.5\n2.0,2e-4,-20.0,0.98,1e-7,0.1,0.5\n3.5,1e-3,-90.0,0.97,1e-7,0.1,0.5\n";

#[test]
fn damaged_frequency_response_is_refused_or_finite_with_rising_frequencies() {
    let valid = FRF.replacen(FRF.lines().next().unwrap_or_default(), frf_csv::HEADER, 1);
    check_damaged_text("frequency response", &[&valid], |text| {
        let Ok(frf) = frf_csv::from_str(text) else {
            return false;
        };
        assert!(frf.frequency_hz.is_sorted_by(|a, b| a < b));
        assert!(frf.frequency_hz.iter().all(|x| x.is_finite()));
        assert!(
            frf.response
                .iter()
                .all(|x| x.re.is_finite() && x.im.is_finite())
        );
        assert!(frf.coherence.iter().all(|x| x.is_finite()));
        assert!(frf.len() < text.lines().count());
        true
    });
}

/// The rows of a table as another reader sees them: numbers separated by commas.
fn naive_rows(text: &str) -> usize {
    text.lines()
        .skip(1)
        .filter(|line| !line.trim().is_empty())
        .count()
}

fn external(path: &Path, bytes: &[u8], columns: &Columns) -> bool {
    std::fs::write(path, bytes).expect("a file");
    let Ok(Record { signals, .. }) = bench_external::read(path, columns) else {
        return false;
    };
    assert!(signals.rate_hz > 0.0 && signals.rate_hz.is_finite());
    assert_eq!(signals.input.len(), signals.output.len());
    let values = signals.input.iter().chain(&signals.output);
    assert!(values.clone().all(|x| x.is_finite()));
    assert!(signals.input.len() <= naive_rows(&String::from_utf8_lossy(bytes).replace('\r', "\n")));
    true
}

#[test]
fn damaged_external_record_is_refused_or_finite() {
    let folder = tempfile::tempdir().expect("a folder");
    let path = folder.path().join("record.csv");
    let valid = "t,x,y\n0.0,1.0,2.0\n0.001,1.5,2.5\n0.002,-1.0,1e-3\n0.003,0.25,-4\n";
    let columns = |sampling| Columns {
        input: "x".into(),
        output: "y".into(),
        reference: None,
        sampling,
    };
    let timed = columns(Sampling::TimeColumn {
        name: "t".into(),
        unit: None,
    });
    let at_rate = columns(Sampling::RateHz(1000.0));
    check_damaged("external record", &[valid.as_bytes()], |bytes| {
        let is_timed = external(&path, bytes, &timed);
        external(&path, bytes, &at_rate) || is_timed
    });
}

/// The measurement files of LabVIEW are text as well: no more samples than lines.
#[test]
fn damaged_measurement_file_of_labview_is_refused_or_finite() {
    let folder = tempfile::tempdir().expect("a folder");
    let path = folder.path().join("record.lvm");
    let of_file = "LabVIEW Measurement\nSeparator\tTab\nDecimal_Separator\t.\nX_Columns\t";
    let keys = "Channels\t2\nSamples\t4\t4\nX_Dimension\tTime\tTime\nX0\t0.0\t0.0\nDelta_X\t0.001\t0.001\n***End_of_Header***\n";
    let without_times = format!(
        "{of_file}No\n***End_of_Header***\n\n{keys}X_Value\tx\ty\tComment\n\t1.0\t2.0\tfirst\n\t1.5\t2.5\n\t-1.0\t1e-3\n\t0.25\t-4\n"
    );
    let with_times = format!(
        "{of_file}One\n***End_of_Header***\n\n{keys}X_Value\tx\ty\n0.0\t1.0\t2.0\n0.001\t1.5\t2.5\n0.002\t-1.0\t1e-3\n0.003\t0.25\t-4\n"
    );
    let columns = Columns {
        input: "x".into(),
        output: "y".into(),
        reference: None,
        sampling: Sampling::TimeColumn {
            name: "time".into(),
            unit: None,
        },
    };
    let valid = [without_times.as_bytes(), with_times.as_bytes()];
    check_damaged("LabVIEW", &valid, |bytes| external(&path, bytes, &columns));
}
