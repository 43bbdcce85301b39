//! Files as the specification of the format describes them.

use super::*;
use crate::contents::Contents;

fn read(text: &[u8]) -> Result<Contents, ArraysError> {
    Ok(Contents::of(variables(text, &mut Budget::new(1 << 20))?))
}

/// Names, units and numbers of the series.
fn series(text: &[u8]) -> Vec<(String, String, Vec<f64>)> {
    let contents = read(text).unwrap_or_else(|error| panic!("{error}"));
    let series = contents.series.into_iter();
    series
        .map(|series| {
            let numbers = series.numbers.to_real().unwrap_or_default();
            (series.name, series.unit.unwrap_or_default(), numbers)
        })
        .collect()
}

fn expected(series: &[(&str, &str, &[f64])]) -> Vec<(String, String, Vec<f64>)> {
    let series = series.iter();
    series
        .map(|(name, unit, numbers)| (name.to_string(), unit.to_string(), numbers.to_vec()))
        .collect()
}

fn file_header(separator: &str, decimal: &str, columns: &str) -> String {
    let s = match separator {
        "Comma" => ",",
        "Semicolon" => ";",
        _ => "\t",
    };
    format!(
        "LabVIEW Measurement{s}\r\nWriter_Version{s}2\r\nSeparator{s}{separator}\r\nDecimal_Separator{s}{decimal}\r\nMulti_Headings{s}Yes\r\nX_Columns{s}{columns}\r\nTime_Pref{s}Relative\r\n***End_of_Header***{s}\r\n{s}\r\n"
    )
}

/// Two channels of three samples, 0.5 ms apart from 1 s on.
fn measurement(force: [&str; 3]) -> String {
    let [a, b, c] = force;
    format!(
        "Channels\t2\t\t\r\nSamples\t3\t3\t\r\nY_Unit_Label\tN\tm/s^2\t\r\nX_Dimension\tTime\tTime\t\r\nX0\t1.0E+0\t1.0E+0\t\r\nDelta_X\t5.0E-4\t5.0E-4\t\r\n***End_of_Header***\t\t\t\r\nX_Value\tForce\tTable acceleration\tComment\r\n\t{a}\t0.25\tfirst\r\n\t{b}\t-0.5\r\n\t{c}\t1E-3\r\n\r\n"
    )
}

#[test]
fn channels_have_their_names_units_and_times() {
    let text = file_header("Tab", ".", "No") + &measurement(["1.5", "-2", "0"]);
    assert_eq!(
        series(text.as_bytes()),
        expected(&[
            ("time", "s", &[1.0, 1.0005, 1.001]),
            ("Force", "N", &[1.5, -2.0, 0.0]),
            ("Table acceleration", "m/s^2", &[0.25, -0.5, 1e-3]),
        ])
    );
}

#[test]
fn column_of_times_and_decimal_comma_are_read() {
    let text = file_header("Semicolon", ",", "One")
        + "Channels;1\nSamples;2\nX_Dimension;Time\n***End_of_Header***\nX_Value;u;Comment\n0,1;2,5;\n0,2;-1,25E-2;\n";
    assert_eq!(
        series(text.as_bytes()),
        expected(&[("time", "s", &[0.1, 0.2]), ("u", "", &[2.5, -0.0125])])
    );
    let tabs = file_header("Tab", ",", "One")
        + "Channels\t1\n***End_of_Header***\nX_Value\tu\n0\t2,5\n1\t3,5\n";
    assert_eq!(series(tabs.as_bytes())[1].2, [2.5, 3.5]);
}

#[test]
fn channels_with_times_of_their_own_keep_them() {
    let text = file_header("Comma", ".", "Multi")
        + "Channels,2\nSamples,3,2\n***End_of_Header***\nX_Value,u,X_Value,y,Comment\n0,1,0,10\n1,2,2,20\n2,3,,\n";
    assert_eq!(
        series(text.as_bytes()),
        expected(&[
            ("u.time", "s", &[0.0, 1.0, 2.0]),
            ("u", "", &[1.0, 2.0, 3.0]),
            ("y.time", "s", &[0.0, 2.0]),
            ("y", "", &[10.0, 20.0]),
        ])
    );
}

#[test]
fn shorter_channel_has_as_many_of_the_common_times() {
    let text = file_header("Comma", ".", "One")
        + "Channels,2\nSamples,3,2\n***End_of_Header***\nX_Value,u,y,Comment\n0,1,10\n1,2,20\n2,3,\n";
    assert_eq!(
        series(text.as_bytes()),
        expected(&[
            ("u.time", "s", &[0.0, 1.0, 2.0]),
            ("u", "", &[1.0, 2.0, 3.0]),
            ("y.time", "s", &[0.0, 1.0]),
            ("y", "", &[10.0, 20.0]),
        ])
    );
}

/// Ten channels of 1000 samples at the same times take 11 columns, not 20.
#[test]
fn common_times_are_kept_once() {
    let line = |cell: &str| format!("\t{cell}").repeat(10);
    let text = file_header("Tab", ".", "No")
        + &format!(
            "Channels\t10\nX0{}\nDelta_X{}\n***End_of_Header***\n",
            line("0"),
            line("1")
        )
        + &format!("X_Value{}\n", line("u"))
        + &format!("{}\n", line("1")).repeat(1000);
    // Room is taken for 4096 samples at a time.
    let limit = 8 * (11 * 4096 + 1000) + 1000;
    let read = variables(text.as_bytes(), &mut Budget::new(limit)).expect("a measurement");
    assert_eq!(read.len(), 11);
}

#[test]
fn several_measurements_are_numbered() {
    let text = file_header("Tab", ".", "No")
        + &measurement(["1", "2", "3"])
        + &measurement(["4", "5", "6"]);
    let found = series(text.as_bytes());
    let names: Vec<&str> = found.iter().map(|(name, _, _)| name.as_str()).collect();
    assert_eq!(
        names,
        [
            "1.time",
            "1.Force",
            "1.Table acceleration",
            "2.time",
            "2.Force",
            "2.Table acceleration"
        ]
    );
    assert_eq!(found[4].2, [4.0, 5.0, 6.0]);
}

#[test]
fn special_blocks_and_latin_1_are_read() {
    let head = file_header("Tab", ".", "No");
    let special = "***Start_Special***\r\nForce\t1\r\nChannels\t7\r\n***End_Special***\r\n";
    let body = measurement(["1", "2", "3"]).replace("m/s^2", "\u{b5}m");
    let text = head + special + &body;
    let latin_1: Vec<u8> = text.chars().map(|c| c as u8).collect();
    for bytes in [text.as_bytes(), &latin_1] {
        assert_eq!(series(bytes)[2].1, "\u{b5}m");
    }
}

#[test]
fn missing_samples_and_words_among_them_are_reported() {
    let head = file_header("Tab", ".", "No");
    let without_time = file_header("Tab", ".", "One")
        + "Channels\t1\n***End_of_Header***\nX_Value\tu\n0\t1\n\t2\n";
    let error = read(without_time.as_bytes()).expect_err("a sample without a time");
    assert!(error.to_string().contains("an abscissa for each sample"));
    for (body, what) in [
        (
            measurement(["1", "2", "3"]).replace("Samples\t3\t3", "Samples\t4\t4"),
            "as many samples as the header states",
        ),
        (
            measurement(["1", "x", "3"]),
            "a line with a number for each channel",
        ),
        // The third sample of the first channel would become its second one.
        (
            measurement(["1", "", "3"]).replace("Samples\t3\t3", "Samples\t2\t3"),
            "a line with a number for each channel",
        ),
        (
            measurement(["1", "2", "3"])
                .replace("Samples\t3\t3", "Samples\t2\t2")
                .replace("\t2\t-0.5\r\n", "\r\n"),
            "a line with a number for each channel",
        ),
        // A line with a sample of the first channel only.
        (
            measurement(["1", "2", "3"])
                .replace("Samples\t3\t3", "Samples\t3\t2")
                .replace("2\t-0.5", "2"),
            "a line with a number for each channel",
        ),
        (
            measurement(["1", "2", "3"]).replace("Channels\t2", "Channels\t200"),
            "a name for each channel",
        ),
        (
            measurement(["1", "2", "3"]).replace("Channels\t2", "Channels\ttwo"),
            "the number of channels",
        ),
    ] {
        let text = head.clone() + &body;
        let error = read(text.as_bytes()).expect_err(what).to_string();
        assert!(error.contains(what), "{error}");
    }
}

/// No panic, and no more memory than the file has numbers.
#[test]
fn file_that_ends_anywhere_is_read_or_refused() {
    let text = file_header("Tab", ".", "No") + &measurement(["1", "2", "3"]);
    let refused = (0..text.len()).filter(|end| read(&text.as_bytes()[..*end]).is_err());
    // Every end before the last sample, but those before the first header is complete, where the file has no measurement.
    assert!(refused.count() > text.len() / 2);
}
