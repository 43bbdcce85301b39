//! Text protocol: Keyence LK-G with the lines of its manual, and the settings of other probes.

use bench_hal::serial::ascii::{Ascii, LineFormat, Output, Settings};
use bench_hal::serial::{Decoder, Event, Sample};

use crate::support::{damaged, events, valid};

fn keyence() -> Settings {
    Settings::keyence_lk_g(3e-3)
}

/// Events of `text` after a first terminator. The bytes of that terminator, reported as damaged, are not counted.
fn decode(settings: Settings, text: &str) -> Vec<Event> {
    let terminator = settings
        .terminator
        .replace("\\r", "\r")
        .replace("\\n", "\n");
    let mut decoder = Ascii::new(settings).unwrap();
    events(&mut decoder, terminator.as_bytes());
    let mut found = events(&mut decoder, text.as_bytes());
    decoder.reset(&mut |event| found.push(event));
    let first = found
        .iter()
        .position(|event| matches!(event, Event::Damaged(_)))
        .unwrap();
    let Event::Damaged(bytes) = &mut found[first] else {
        unreachable!()
    };
    *bytes -= terminator.len() as u32;
    found.retain(|event| *event != Event::Damaged(0));
    found
}

#[test]
fn decodes_the_lines_of_the_manual() {
    let value = |raw, position_m| Event::Value(Sample { raw, position_m });
    assert_eq!(
        decode(keyence(), "+01.2345\r"),
        [value(12345, 1.2345e-3), Event::AnswerEnd]
    );
    assert_eq!(
        decode(keyence(), "-00.0120\r"),
        [value(-120, -0.0120e-3), Event::AnswerEnd]
    );
    let outside = |raw, position_m| Event::OutOfRange(Sample { raw, position_m });
    assert_eq!(
        decode(keyence(), "+FFFFFFF\r-FFFFFFF\r")[0],
        outside(i64::MAX, 3e-3)
    );
    assert_eq!(
        decode(keyence(), "+FFFFFFF\r-FFFFFFF\r")[2],
        outside(i64::MIN, -3e-3)
    );
    assert_eq!(
        decode(keyence(), "+03.0001\r")[0],
        outside(30001, 3e-3),
        "a number outside the range"
    );
}

#[test]
fn invalid_values_and_errors_have_a_text() {
    let fault = |text| match decode(keyence(), text)[0] {
        Event::Fault { code, text } => (code, text),
        other => panic!("{text}: {other:?}"),
    };
    assert!(fault("XXXXXXXX\r").1.contains("cannot measure"));
    assert_eq!(
        fault("ER,MA,00\r"),
        (0, "the probe does not know the command")
    );
    assert_eq!(
        fault("ER,M1,88\r"),
        (88, "the controller of the probe timed out")
    );
    assert!(fault("ER,M1,77\r").1.contains("its manual"));
}

#[test]
fn ignores_bytes_before_the_first_terminator() {
    let mut decoder = Ascii::new(Settings {
        line: "{value}".into(),
        ..keyence()
    })
    .unwrap();
    // "+01.2345" cut to "1.2345" would be a number, too
    let found = events(&mut decoder, b"1.2345\r+01.2346\r");
    assert_eq!((valid(&found), damaged(&found)), (vec![12346], 7));
}

#[test]
fn rejects_lines_with_a_missing_or_additional_character() {
    for line in [
        "+01.234\r",
        "+1.2345\r",
        "+012345\r",
        "+01.23456\r",
        "+01.2345+01.2345\r",
        "+001.234\r",
        "\r",
        "+01.2345 \r",
    ] {
        let found = decode(keyence(), &format!("{line}+00.5000\r"));
        assert_eq!(
            (valid(&found), damaged(&found)),
            (vec![5000], line.len() as u64),
            "{line:?}"
        );
    }
}

#[test]
fn resynchronises_after_an_endless_line() {
    let found = decode(keyence(), &format!("{}\r+00.5000\r", "9".repeat(1000)));
    assert_eq!((valid(&found), damaged(&found)), (vec![5000], 1001));
    let tail = decode(
        Settings {
            line: "{value}".into(),
            ..keyence()
        },
        &format!("{}1.25\r", " ".repeat(1000)),
    );
    assert_eq!(
        valid(&tail),
        [0i64; 0],
        "the end of the endless line is not a line"
    );
}

#[test]
fn applies_prefix_suffix_unit_and_offset() {
    let settings = Settings {
        line: "D={value}um;{skip}".into(),
        terminator: "\\r\\n".into(),
        unit_m: 1e-6,
        offset_m: -50e-6,
        lower_m: -50e-6,
        upper_m: 50e-6,
        ..keyence()
    };
    let found = decode(settings, "D= 62.5um;ok\r\nD= 62.5mm;ok\r\n");
    assert_eq!(valid(&found), [625]);
    assert!(
        matches!(found[0], Event::Value(Sample { position_m, .. }) if (position_m - 12.5e-6).abs() < 1e-18),
        "{found:?}"
    );
}

#[test]
fn rejects_invalid_settings_by_name() {
    let refused = |settings: Settings| Ascii::new(settings).unwrap_err().to_string();
    assert!(
        refused(Settings {
            line: "{skip}".into(),
            ..keyence()
        })
        .contains("setting line = \"{skip}\"")
    );
    assert!(
        refused(Settings {
            error: Some("ER".into()),
            ..keyence()
        })
        .contains("{code} exactly once")
    );
    assert!(
        refused(Settings {
            terminator: "".into(),
            ..keyence()
        })
        .contains("terminator")
    );
    assert!(
        refused(Settings {
            unit_m: 0.0,
            ..keyence()
        })
        .contains("unit_m")
    );
    assert!(
        refused(Settings {
            upper_m: f64::NAN,
            ..keyence()
        })
        .contains("upper_m")
    );
    assert!(
        refused(Settings {
            offset_m: f64::INFINITY,
            ..keyence()
        })
        .contains("offset_m")
    );
}

#[test]
fn writes_the_lines_of_the_manual() {
    let format = LineFormat::new(keyence()).unwrap();
    let line = |output| String::from_utf8(format.write(output)).unwrap();
    assert_eq!(line(Output::Position(1.2345e-3)), "+01.2345\r");
    assert_eq!(line(Output::Position(-0.012e-3)), "-00.0120\r");
    assert_eq!(line(Output::Position(4e-3)), "+FFFFFFF\r");
    assert_eq!(line(Output::Position(-4e-3)), "-FFFFFFF\r");
    assert_eq!(line(Output::Invalid), "XXXXXXXX\r");
}
