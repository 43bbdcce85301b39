//! Valid inputs with random damage.

use std::panic::{AssertUnwindSafe, catch_unwind};

use rand_core::{Rng, SeedableRng};
use rand_pcg::Pcg64;

const DEFAULT_INPUTS: u64 = 2_000;
const DEFAULT_SEED: u64 = 20_061_009;

/// Texts that parsers treat in a special way.
const WORDS: [&str; 24] = [
    "nan",
    "-inf",
    "1e999",
    "-0.0",
    "1e-400",
    "0",
    "-1",
    "99999999999999999999",
    "true",
    "\"\"",
    "[]",
    "{}",
    "[[a]]",
    "a.b=1",
    "\n",
    "\r\n",
    ",",
    ";",
    "\t",
    "\u{0}",
    "\u{feff}",
    "é",
    "\"",
    "#",
];

fn number(variable: &str) -> Option<u64> {
    std::env::var(variable).ok()?.parse().ok()
}

/// Random numbers for damage.
pub struct Damage {
    random: Pcg64,
}

impl Damage {
    /// A number below `limit`, 0 if there is none.
    fn below(&mut self, limit: usize) -> usize {
        (self.random.next_u64() % (limit.max(1) as u64)) as usize
    }

    /// A copy of a valid input with one to four damages; one of 16 is intact.
    fn damaged(&mut self, valid: &[u8]) -> Vec<u8> {
        let mut bytes = valid.to_vec();
        if self.below(16) > 0 {
            for _ in 0..=self.below(4) {
                self.damage_once(&mut bytes);
            }
        }
        bytes
    }

    fn damage_once(&mut self, bytes: &mut Vec<u8>) {
        let at = self.below(bytes.len());
        let end = (at + 1 + self.below(16)).min(bytes.len());
        match self.below(8) {
            0 if !bytes.is_empty() => bytes[at] ^= 1 << self.below(8),
            1 => bytes.truncate(at),
            2 => drop(bytes.drain(at..end)),
            3 => {
                let part = bytes[at..end].to_vec();
                bytes.splice(at..at, part);
            }
            4 if !bytes.is_empty() => bytes[at] = self.random.next_u64() as u8,
            5 => self.replace_number(bytes, at),
            _ => {
                let word = WORDS[self.below(WORDS.len())];
                bytes.splice(at..at, word.bytes());
            }
        }
    }

    /// Replaces the next number behind `at` by a special word or another number.
    fn replace_number(&mut self, bytes: &mut Vec<u8>, at: usize) {
        let Some(start) = bytes[at..].iter().position(u8::is_ascii_digit) else {
            return;
        };
        let start = at + start;
        let rest = &bytes[start..];
        let length = rest
            .iter()
            .position(|b| !b.is_ascii_digit() && !b"._e+-".contains(b));
        let end = start + length.unwrap_or(rest.len());
        let text = match self.below(3) {
            0 => WORDS[self.below(8)].to_string(),
            1 => format!("{}", self.random.next_u64() as i64),
            _ => format!("{:?}", f64::from_bits(self.random.next_u64())),
        };
        bytes.splice(start..end, text.bytes());
    }
}

/// Gives damaged copies of `valid` to `check`, which must not panic. It returns whether the parser accepted the input; an input
/// without damage must be accepted.
pub fn check_damaged(parser: &str, valid: &[&[u8]], mut check: impl FnMut(&[u8]) -> bool) {
    let inputs = number("BENCH_RANDOM_INPUTS").unwrap_or(DEFAULT_INPUTS);
    let seed = number("BENCH_RANDOM_SEED").unwrap_or(DEFAULT_SEED);
    eprintln!("{parser}: {inputs} inputs with the seed {seed}");
    let mut damage = Damage {
        random: Pcg64::seed_from_u64(seed),
    };
    for index in 0..inputs {
        let original = valid[index as usize % valid.len()];
        let input = damage.damaged(original);
        let accepted = catch_unwind(AssertUnwindSafe(|| check(&input)));
        if !accepted.is_ok_and(|accepted| accepted || input != original) {
            let text = String::from_utf8_lossy(&input);
            panic!(
                "{parser}: input {index} of the seed {seed} failed:
{text}"
            );
        }
    }
}

/// As [`check_damaged`], for a parser of text: bytes that are not UTF-8 are replaced.
pub fn check_damaged_text(parser: &str, valid: &[&str], mut check: impl FnMut(&str) -> bool) {
    let valid: Vec<&[u8]> = valid.iter().map(|text| text.as_bytes()).collect();
    check_damaged(parser, &valid, |bytes| {
        check(&String::from_utf8_lossy(bytes))
    });
}
