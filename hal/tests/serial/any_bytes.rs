//! Arbitrary bytes in arbitrary slices: no panic, the same events for all slices, the same valid values as an independent
//! decoder, and synchronisation after damage.

use bench_hal::serial::ascii::Ascii;
use bench_hal::serial::capancdt::Capancdt;
use bench_hal::serial::optoncdt::{Optoncdt, message};
use bench_hal::serial::{Decoder, Event, ascii, capancdt, optoncdt};
use proptest::collection::vec;
use proptest::prelude::*;
use proptest::sample::Index;

use crate::support::{Noise, damaged, events, naive, valid};

const HALF_RANGE_MM: f64 = 20.0;

fn capa() -> Capancdt {
    Capancdt::new(capancdt::Settings::new(1e-3)).unwrap()
}

fn opto() -> Optoncdt {
    Optoncdt::new(optoncdt::Settings::new(1e-3)).unwrap()
}

fn keyence() -> Ascii {
    Ascii::new(ascii::Settings::keyence_lk_g(HALF_RANGE_MM * 1e-3)).unwrap()
}

/// A capaNCDT answer.
fn answer() -> impl Strategy<Value = Vec<u8>> {
    let settings = capancdt::Settings::new(1e-3);
    (0..=40u16, vec(-2..=0xF0_0002, 0..=20))
        .prop_map(move |(counter, values)| settings.answer(counter, &values))
}

/// Bytes similar to those of the protocols: messages, parts and damaged copies of them, their marking bytes, and noise.
fn line() -> impl Strategy<Value = Vec<u8>> {
    let keyence =
        "(\\+|-)[0-9]{2}\\.[0-9]{4}\r|ER,[A-Z]{2},[0-9]{2}\r|[+X]FFFFFFF\r|[-+.0-9 ]{0,12}\r";
    let whole = prop_oneof![
        answer(),
        Just(capancdt::Settings::new(1e-3).request().to_vec()),
        (0..0x4_0000u32, any::<bool>()).prop_map(|(x, first)| message(x, first).to_vec()),
        proptest::string::string_regex(keyence)
            .unwrap()
            .prop_map(String::into_bytes),
    ];
    let spoilt =
        (whole, any::<Index>(), any::<u8>(), 0..4u8).prop_map(|(mut bytes, at, flip, how)| {
            let at = at.index(bytes.len());
            match how {
                0 => bytes[at] ^= flip,
                1 => bytes.truncate(at),
                2 => drop(bytes.remove(at)),
                _ => {}
            }
            bytes
        });
    let marks = proptest::sample::select(
        b"\x68\x10\x16\x13\x01\x7E\x08\x07\x0B\x0D+-.0123456789XFER,".to_vec(),
    );
    vec(
        prop_oneof![4 => spoilt, 1 => vec(marks, 0..40), 1 => vec(any::<u8>(), 0..60)],
        0..20,
    )
    .prop_map(|parts| parts.concat())
}

/// Feeds `bytes` in slices that end at `cuts`.
fn sliced(decoder: &mut dyn Decoder, bytes: &[u8], cuts: &[Index]) -> Vec<Event> {
    let mut cuts: Vec<usize> = cuts.iter().map(|cut| cut.index(bytes.len() + 1)).collect();
    cuts.extend([0, bytes.len()]);
    cuts.sort_unstable();
    cuts.windows(2)
        .flat_map(|cut| events(decoder, &bytes[cut[0]..cut[1]]))
        .collect()
}

proptest! {
    #![proptest_config(ProptestConfig::with_cases(1000))]

    #[test]
    fn events_do_not_depend_on_the_slices(bytes in line(), cuts in vec(any::<Index>(), 0..30)) {
        prop_assert_eq!(sliced(&mut capa(), &bytes, &cuts), events(&mut capa(), &bytes));
        prop_assert_eq!(sliced(&mut opto(), &bytes, &cuts), events(&mut opto(), &bytes));
        prop_assert_eq!(sliced(&mut keyence(), &bytes, &cuts), events(&mut keyence(), &bytes));
    }

    #[test]
    fn valid_values_equal_those_of_an_independent_decoder(bytes in line()) {
        // The decoder waits for the rest of a possible answer: 93 other bytes complete or refute it.
        let settled = [&bytes[..], &[0xFF; 93]].concat();
        prop_assert_eq!(valid(&events(&mut capa(), &settled)), naive::capancdt(&settled));
        prop_assert_eq!(valid(&events(&mut opto(), &bytes)), naive::optoncdt(&bytes));
        prop_assert_eq!(valid(&events(&mut keyence(), &bytes)), naive::keyence(&bytes, HALF_RANGE_MM));
    }

    #[test]
    fn every_byte_belongs_to_a_message_or_is_damaged(bytes in vec(any::<u8>(), 0..2000)) {
        let mut decoder = opto();
        let mut found = events(&mut decoder, &bytes);
        decoder.reset(&mut |event| found.push(event));
        let messages = found.iter().filter(|event| !matches!(event, Event::Damaged(_))).count() as u64;
        prop_assert_eq!(damaged(&found) + 3 * messages, bytes.len() as u64);
    }

    #[test]
    fn capancdt_synchronises_within_93_bytes_after_damage(bytes in line()) {
        // Damaged bytes can look like an answer of at most 93 bytes; the answers here have 17 bytes: six of them.
        let settings = capancdt::Settings::new(1e-3);
        let mut decoder = capa();
        events(&mut decoder, &bytes);
        let values: Vec<i32> = (0..20).map(|index| 1_000_000 + index).collect();
        let good = (0..).zip(&values).flat_map(|(counter, value)| settings.answer(1000 + counter, &[*value]));
        let found = valid(&events(&mut decoder, &good.collect::<Vec<_>>()));
        let last: Vec<i64> = values[6..].iter().map(|value| i64::from(*value)).collect();
        prop_assert!(found.ends_with(&last), "{:?}", found);
    }

    #[test]
    fn optoncdt_loses_no_message_after_damage(bytes in line()) {
        let mut decoder = opto();
        events(&mut decoder, &bytes);
        prop_assert_eq!(valid(&events(&mut decoder, &[message(1000, true), message(2000, true)].concat())), [1000, 2000]);
    }

    #[test]
    fn keyence_loses_at_most_one_line_after_damage(bytes in line()) {
        let mut decoder = keyence();
        events(&mut decoder, &bytes);
        let found = valid(&events(&mut decoder, b"+00.0001\r+00.0002\r+00.0003\r"));
        prop_assert!(found.ends_with(&[2, 3]), "{:?}", found);
    }
}

const TEN_MILLION: usize = 10_000_000;

/// Whether a count of rare events is within five standard deviations (Poisson distribution) of the expected count.
fn is_expected(count: usize, expected: f64) -> bool {
    (count as f64 - expected).abs() < 5.0 * expected.sqrt().max(1.0)
}

#[test]
fn ten_million_random_bytes_contain_no_capancdt_value() {
    // 10 bytes of an answer are fixed by the rules: one in 256^10 / 21 places would pass.
    let noise = Noise(1).bytes(TEN_MILLION);
    let found = events(&mut capa(), &noise);
    assert_eq!((valid(&found), naive::capancdt(&noise)), (vec![], vec![]));
    assert!(
        damaged(&found) > noise.len() as u64 - 200,
        "all bytes are damaged except those that may begin an answer"
    );
}

#[test]
fn ten_million_random_bytes_contain_the_expected_number_of_optoncdt_values() {
    // L, M, H with F = 0: 1/64; no error bits: 1/4; in range: 64235 of 65536.
    let expected = TEN_MILLION as f64 / 64.0 / 4.0 * 64235.0 / 65536.0;
    let noise = Noise(2).bytes(TEN_MILLION);
    let found = valid(&events(&mut opto(), &noise));
    println!(
        "optoNCDT: {} valid values in {TEN_MILLION} random bytes, {expected:.0} expected",
        found.len()
    );
    assert!(
        is_expected(found.len(), expected),
        "{} instead of {expected}",
        found.len()
    );
    assert_eq!(found, naive::optoncdt(&noise));
}

#[test]
fn ten_million_random_bytes_contain_no_keyence_value() {
    let noise = Noise(3).bytes(TEN_MILLION);
    assert_eq!(valid(&events(&mut keyence(), &noise)), [0i64; 0]);
}

#[test]
fn ten_million_random_characters_contain_the_expected_number_of_keyence_values() {
    let noise: Vec<u8> = Noise(4)
        .bytes(TEN_MILLION)
        .iter()
        .map(|byte| b"0123456789+-.XF\r"[usize::from(byte >> 4)])
        .collect();
    // CR before and after, a sign or digit, two digits, the point, four digits: in 16 characters each. All below 1 m.
    let expected =
        TEN_MILLION as f64 * (1.0 / 16.0f64).powi(3) * (12.0 / 16.0) * (10.0 / 16.0f64).powi(6);
    let settings = ascii::Settings::keyence_lk_g(1.0);
    let found = valid(&events(&mut Ascii::new(settings).unwrap(), &noise));
    println!(
        "Keyence: {} valid values in {TEN_MILLION} random characters, {expected:.0} expected",
        found.len()
    );
    assert!(
        is_expected(found.len(), expected),
        "{} instead of {expected}",
        found.len()
    );
    assert_eq!(found, naive::keyence(&noise, 1000.0));
}
