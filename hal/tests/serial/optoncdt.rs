//! optoNCDT with the formula of the manual.

use bench_hal::serial::optoncdt::{Cycle, Optoncdt, Settings, message};
use bench_hal::serial::{Decoder, Event, Sample};

use crate::support::{damaged, events, valid};

const RANGE_M: f64 = 10e-3;

fn decode(bytes: &[u8]) -> Vec<Event> {
    events(&mut Optoncdt::new(Settings::new(RANGE_M)).unwrap(), bytes)
}

#[test]
fn message_has_the_bits_of_the_manual() {
    // x = 32760 = 0b0111_111111_111000: L 00 111000, M 01 111111, H 10 00 0111; d = (32760 * 102 / 65520 - 1) / 100 = 50 %
    let bytes = [0b0011_1000, 0b0111_1111, 0b1000_0111];
    assert_eq!(message(32760, true), bytes);
    assert_eq!(
        message(32760, false),
        [0b0011_1000, 0b0111_1111, 0b1100_0111]
    );
    let found = decode(&bytes);
    assert!(
        matches!(found[..], [Event::Value(Sample { raw: 32760, position_m })] if (position_m - 5e-3).abs() < 1e-15),
        "{found:?}"
    );
}

#[test]
fn range_has_the_limits_of_the_manual() {
    let found = decode(&[642, 643, 64877, 64878].map(|x| message(x, true)).concat());
    // 643 is 0.001 % and 64877 is 99.999 % of the range: one count is 0.00156 %
    let Event::Value(Sample {
        position_m: start_m,
        ..
    }) = found[1]
    else {
        panic!("{found:?}")
    };
    let Event::Value(Sample {
        position_m: end_m, ..
    }) = found[2]
    else {
        panic!("{found:?}")
    };
    assert!(
        (0.0..0.16e-6).contains(&start_m) && (0.0..0.16e-6).contains(&(RANGE_M - end_m)),
        "{start_m} {end_m}"
    );
    assert_eq!(
        found[0],
        Event::OutOfRange(Sample {
            raw: 642,
            position_m: 0.0
        })
    );
    assert_eq!(
        found[3],
        Event::OutOfRange(Sample {
            raw: 64878,
            position_m: RANGE_M
        })
    );
}

#[test]
fn value_of_more_than_16_bits_is_an_error_with_a_text() {
    let found = decode(&message(262_076, true));
    assert!(
        matches!(found[..], [Event::Fault { code: 262_076, text }] if text.contains("see its manual")),
        "{found:?}"
    );
    assert!(matches!(
        decode(&message(65_536, true))[..],
        [Event::Fault { code: 65_536, .. }]
    ));
}

#[test]
fn counts_and_metres_are_inverse() {
    let settings = Settings::new(RANGE_M);
    for x in [643, 644, 20_000, 32_760, 64_877] {
        assert_eq!(settings.counts(settings.metres(x)), x);
    }
}

#[test]
fn lost_byte_affects_one_value_only() {
    let whole = [1000, 2000, 3000].map(|x| message(x, true)).concat();
    for lost in 0..whole.len() {
        let mut bytes = whole.clone();
        bytes.remove(lost);
        let mut expected = vec![1000, 2000, 3000];
        expected.remove(lost / 3);
        let mut decoder = Optoncdt::new(Settings::new(RANGE_M)).unwrap();
        let mut found = events(&mut decoder, &bytes);
        decoder.reset(&mut |event| found.push(event));
        assert_eq!(
            (valid(&found), damaged(&found)),
            (expected, 2),
            "without byte {lost}"
        );
    }
}

#[test]
fn finds_the_displacement_by_its_index_in_the_cycle() {
    let cycle = Cycle {
        values: 3,
        displacement: 1,
    };
    let mut decoder = Optoncdt::new(Settings {
        range_m: RANGE_M,
        cycle,
    })
    .unwrap();
    let of_cycle = |x| {
        [
            message(x, true),
            message(x + 1, false),
            message(x + 2, false),
        ]
        .concat()
    };
    assert_eq!(
        valid(&events(
            &mut decoder,
            &[of_cycle(1000), of_cycle(2000)].concat()
        )),
        [1001, 2001]
    );
    // The first value of a cycle is damaged: the index of the further ones is unknown until the next cycle.
    assert_eq!(
        valid(&events(
            &mut decoder,
            &[&of_cycle(3000)[1..], &of_cycle(4000)].concat()
        )),
        [4001]
    );
}

#[test]
fn further_value_without_a_first_one_is_damaged() {
    let found = decode(&[message(1000, false), message(2000, true)].concat());
    assert_eq!((valid(&found), damaged(&found)), (vec![2000], 3));
}
