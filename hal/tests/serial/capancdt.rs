//! capaNCDT 61xx with the examples of the manuals.

use bench_hal::serial::capancdt::{Capancdt, CounterMeaning, Settings};
use bench_hal::serial::{Decoder, Event, Sample};

use crate::support::{damaged, events, valid};

/// The example of the manuals: counter 290, three values, the first 0x3244B1.
const EXAMPLE: [u8; 25] = [
    0x68, 0x13, 0x13, 0x68, 0x01, 0x7E,
    0x08, // SD LE LE SD DA SA FC: 19 bytes from DA to the end of data
    0x22, 0x01, 0x03, 0x00, // counter 0x0122, m, filler
    0xB1, 0x44, 0x32, 0x00, 0xAC, 0x44, 0x32, 0x00, 0xB9, 0x44, 0x32, 0x00, //
    0x25,
    0x16, // 01 + 7E + 08 + 22 + 01 + 03 + B1 + 44 + 32 + AC + 44 + 32 + B9 + 44 + 32 = 0x425
];

fn settings() -> Settings {
    Settings::new(200e-6)
}

fn decoder() -> Capancdt {
    Capancdt::new(settings()).unwrap()
}

fn raws(answers: &[Vec<u8>]) -> Vec<Event> {
    events(&mut decoder(), &answers.concat())
}

#[test]
fn request_equals_that_of_the_manual() {
    assert_eq!(settings().request(), [0x10, 0x7E, 0x01, 0x4C, 0xCB, 0x16]);
    assert_eq!(decoder().request(), Some(&settings().request()[..]));
}

#[test]
fn decodes_the_answer_of_the_manual() {
    let found = events(&mut decoder(), &EXAMPLE);
    assert_eq!(valid(&found), [0x3244B1, 0x3244AC, 0x3244B9]);
    assert_eq!((found.len(), found.last()), (4, Some(&Event::AnswerEnd)));
    let Event::Value(Sample { position_m, .. }) = found[0] else {
        panic!("{found:?}")
    };
    // 0x3244B1 / 0xF00000 = 20.945 %, of 200 um 41.89 um
    assert!(
        (position_m / 200e-6 - 0.20945).abs() < 5e-6 && (position_m - 41.89e-6).abs() < 5e-9,
        "{position_m}"
    );
}

#[test]
fn writes_the_answer_of_the_manual() {
    assert_eq!(
        settings().answer(290, &[0x3244B1, 0x3244AC, 0x3244B9]),
        EXAMPLE
    );
}

#[test]
fn rejects_an_answer_with_one_wrong_byte() {
    for at in 0..EXAMPLE.len() {
        for flip in 1..=255 {
            let mut bytes = EXAMPLE;
            bytes[at] ^= flip;
            assert_eq!(
                valid(&events(&mut decoder(), &bytes)),
                [0i64; 0],
                "byte {at} ^ {flip:#x}"
            );
        }
    }
}

#[test]
fn rejects_an_answer_whose_count_does_not_match_its_length() {
    let mut bytes = EXAMPLE;
    (bytes[9], bytes[23]) = (2, 0x24); // m one less, and the sum with it
    assert_eq!(valid(&events(&mut decoder(), &bytes)), [0i64; 0]);
}

#[test]
fn rejects_the_answer_of_another_address() {
    let other = Settings {
        probe_address: 0x7D,
        ..settings()
    };
    assert_eq!(valid(&raws(&[other.answer(1, &[5])])), [0i64; 0]);
}

#[test]
fn position_outside_the_range_is_the_end_of_the_range() {
    let found = raws(&[settings().answer(4, &[0xF0_0000, 0xF0_0001, 0, -1])]);
    let end = |raw, position_m| Sample { raw, position_m };
    let expected = [
        Event::Value(end(0xF0_0000, 200e-6)),
        Event::OutOfRange(end(0xF0_0001, 200e-6)),
        Event::Value(end(0, 0.0)),
        Event::OutOfRange(end(-1, 0.0)),
        Event::AnswerEnd,
    ];
    assert_eq!(found, expected);
}

#[test]
fn reports_a_gap_when_the_counter_advances_more_than_the_batch() {
    let found = raws(&[
        settings().answer(65534, &[1]),
        settings().answer(3, &[2, 3]),
    ]);
    // 65534 -> 3 is 5 measurements, two of them are here
    assert!(found.contains(&Event::Gap(3)), "{found:?}");
    assert_eq!(valid(&found), [1, 2, 3]);
}

#[test]
fn repeated_values_are_used_once() {
    let found = raws(&[
        settings().answer(7, &[1, 2]),
        settings().answer(7, &[1, 2]),
        settings().answer(8, &[1, 2, 3]),
    ]);
    assert_eq!(valid(&found), [1, 2, 3]);
    assert_eq!(
        found
            .iter()
            .filter(|event| **event == Event::Withheld(2))
            .count(),
        2
    );
}

#[test]
fn withholds_the_first_batch_after_a_restart() {
    let found = raws(&[
        settings().answer(500, &[1]),
        settings().answer(2, &[8, 9]),
        settings().answer(3, &[10]),
    ]);
    assert!(
        found.contains(&Event::Restart) && found.contains(&Event::Withheld(2)),
        "{found:?}"
    );
    assert_eq!(valid(&found), [1, 10]);
}

#[test]
fn follows_a_counter_of_the_oldest_value() {
    let oldest = Settings {
        counter: CounterMeaning::OldestValue,
        ..settings()
    };
    let bytes = [
        oldest.answer(10, &[1, 2, 3]),
        oldest.answer(13, &[4]),
        oldest.answer(16, &[7, 8]),
    ]
    .concat();
    let found = events(&mut Capancdt::new(oldest).unwrap(), &bytes);
    assert_eq!(valid(&found), [1, 2, 3, 4, 7, 8]);
    assert_eq!(
        found
            .iter()
            .filter(|event| matches!(event, Event::Gap(_)))
            .collect::<Vec<_>>(),
        [&Event::Gap(2)]
    );
}

#[test]
fn accepts_an_answer_without_values() {
    assert_eq!(raws(&[settings().answer(1, &[])]), [Event::AnswerEnd]);
}

#[test]
fn recognises_the_echo_of_the_request() {
    let found = raws(&[settings().request().to_vec(), settings().answer(1, &[4])]);
    assert_eq!(
        (found[0], damaged(&found), valid(&found)),
        (Event::Echo, 0, vec![4])
    );
}

#[test]
fn resynchronises_after_truncated_answer() {
    let cut = settings().answer(1, &[1, 2, 3])[..20].to_vec();
    let found = raws(&[cut, settings().answer(2, &[7]), settings().answer(3, &[8])]);
    assert_eq!((valid(&found), damaged(&found)), (vec![7, 8], 20));
}
