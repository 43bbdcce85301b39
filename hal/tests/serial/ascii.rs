//! Written values: Keyence LK-G by its manual's lines, and the settings of other probes.

use bench_hal::serial::ascii::{Ascii, Settings, Statement, Writing};
use bench_hal::serial::{Decoder, Event, Sample};

use crate::support::{damaged, events, valid};

fn keyence() -> Settings {
    Settings::keyence_lk_g(3e-3)
}

/// Events of `text` behind a first terminator, whose own bytes (damage, nothing was before it) are not counted.
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
fn the_manuals_lines_are_what_the_manual_says() {
    let value = |raw, position_m| Event::Value(Sample { raw, position_m });
    assert_eq!(
        decode(keyence(), "+01.2345\r"),
        [value(12345, 1.2345e-3), Event::AnswerEnd]
    );
    assert_eq!(
        decode(keyence(), "-00.0120\r"),
        [value(-120, -0.0120e-3), Event::AnswerEnd]
    );
    let beyond = |raw, position_m| Event::OutOfRange(Sample { raw, position_m });
    assert_eq!(
        decode(keyence(), "+FFFFFFF\r-FFFFFFF\r")[0],
        beyond(i64::MAX, 3e-3)
    );
    assert_eq!(
        decode(keyence(), "+FFFFFFF\r-FFFFFFF\r")[2],
        beyond(i64::MIN, -3e-3)
    );
    assert_eq!(
        decode(keyence(), "+03.0001\r")[0],
        beyond(30001, 3e-3),
        "a number beyond the range is beyond the range"
    );
}

#[test]
fn invalid_and_errors_have_words() {
    let fault = |text| match decode(keyence(), text)[0] {
        Event::Fault { code, words } => (code, words),
        other => panic!("{text}: {other:?}"),
    };
    assert!(fault("XXXXXXXX\r").1.contains("cannot measure"));
    assert_eq!(
        fault("ER,MA,00\r"),
        (0, "the probe does not know the command")
    );
    assert_eq!(
        fault("ER,M1,88\r"),
        (88, "the probe's controller timed out")
    );
    assert!(fault("ER,M1,77\r").1.contains("its manual"));
}

#[test]
fn what_came_before_the_first_terminator_is_no_value() {
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
fn a_line_that_lost_or_gained_a_character_is_no_value() {
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
fn a_line_without_end_does_not_hide_the_next() {
    let found = decode(keyence(), &format!("{}\r+00.5000\r", "9".repeat(1000)));
    assert_eq!((valid(&found), damaged(&found)), (vec![5000], 1001));
    let tail = decode(
        Settings {
            line: "{value}".into(),
            ..keyence()
        },
        &format!("{}1.25\r", " ".repeat(1000)),
    );
    assert_eq!(valid(&tail), [], "nor does its end pass for a line");
}

#[test]
fn prefix_suffix_unit_and_offset_are_settings() {
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
fn settings_that_make_no_sense_are_refused_with_their_name() {
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
fn the_devices_side_writes_the_manuals_lines() {
    let writing = Writing::new(keyence()).unwrap();
    let line = |statement| String::from_utf8(writing.write(statement)).unwrap();
    assert_eq!(line(Statement::Metres(1.2345e-3)), "+01.2345\r");
    assert_eq!(line(Statement::Metres(-0.012e-3)), "-00.0120\r");
    assert_eq!(line(Statement::Metres(4e-3)), "+FFFFFFF\r");
    assert_eq!(line(Statement::Metres(-4e-3)), "-FFFFFFF\r");
    assert_eq!(line(Statement::Invalid), "XXXXXXXX\r");
}
