//! Tables 3-1 to 3-4 with random plants: the kinds of zeros in the table equal the computed ones.
//!
//! The reference is the closed form of the numerator in x = s^2 (as in Eq. 4-3), and Python with 60 digits. The dominant sequence is
//! computed by the library from the matrix pencil and the definitions of section 3.2.1.

use std::collections::BTreeMap;

use bench_plant::zeros::{ModalSum, ModalTerm, ZeroCounts};
use bench_thesis::{MmpLocation, Sequence, StepResponse, TABLES, TableRow, table_of};
use serde_json::{Value, json};

use crate::program::Draw;
use crate::truth;

/// Kinds of zeros and locations of MMP zeros of a plant, by the closed form.
struct Truth {
    kinds: ZeroCounts,
    mmp: Vec<MmpLocation>,
}

/// A random plant of the class of one of the four tables. The residue of the slowest mode may have either sign.
fn random_plant(draw: &mut Draw, class: usize) -> ModalSum {
    let mut residue = || draw.over_decades(1e-3, 1e3) * draw.one_of(&[1.0, -1.0]);
    let (a, b, c) = (residue(), residue(), residue());
    let u = draw.over_decades(0.3, 3.0);
    let v = u * (1.0 + draw.over_decades(1e-3, 10.0));
    let mode = ModalTerm::undamped;
    let (terms, constant) = match class {
        0 => (vec![mode(0.0, a), mode(v, b)], 0.0),
        1 => (vec![mode(u, a), mode(v, b)], 0.0),
        2 => (vec![mode(0.0, a), mode(u, b), mode(v, c)], 0.0),
        _ => (vec![mode(u, a), mode(v, b)], c),
    };
    ModalSum::new(terms, constant).expect("residues that are not zero")
}

/// Kinds of zeros by the quadratic b2 x^2 + b1 x + b0. `None` if the plant is within 1e-9 of a change, where zeros meet or pass through
/// the origin or infinity and rounding decides.
fn truth_of(sum: &ModalSum) -> Option<Truth> {
    let terms = sum.terms();
    let squares: Vec<f64> = terms
        .iter()
        .map(|t| t.omega_rad_s * t.omega_rad_s)
        .collect();
    let mut numerator = [Sum::default(); 4];
    for (i, term) in terms.iter().enumerate() {
        let others: Vec<f64> = (0..terms.len())
            .filter(|j| *j != i)
            .map(|j| squares[j])
            .collect();
        add_product(&mut numerator, term.residue_per_kg, &others);
    }
    add_product(&mut numerator, sum.constant_m_per_n(), &squares);
    let degree = if sum.constant_m_per_n() == 0.0 {
        terms.len() - 1
    } else {
        terms.len()
    };
    let is_well_conditioned =
        numerator[0].is_well_conditioned() && numerator[degree].is_well_conditioned();
    let roots = if degree == 1 {
        vec![-numerator[0].value / numerator[1].value]
    } else {
        real_roots(&numerator)?
    };
    let on_axis = roots.iter().filter(|x| **x < 0.0).map(|x| (-x).sqrt());
    let (wu, wv) = match terms {
        [first, .., last] if sum.is_free() && terms.len() == 2 => {
            (first.omega_rad_s, last.omega_rad_s)
        }
        [.., u, v] => (u.omega_rad_s, v.omega_rad_s),
        _ => return None,
    };
    let place = |w: f64| {
        if w < wu {
            MmpLocation::BelowU
        } else if w < wv {
            MmpLocation::Between
        } else {
            MmpLocation::AboveV
        }
    };
    let mut mmp: Vec<MmpLocation> = on_axis.map(place).collect();
    mmp.sort_by_key(|place| *place as u8);
    let real = roots.iter().filter(|x| **x > 0.0).count();
    let kinds = ZeroCounts {
        mmp: mmp.len(),
        real,
        quartets: usize::from(roots.is_empty()),
    };
    is_well_conditioned.then_some(Truth { kinds, mmp })
}

/// A sum and the sum of the magnitudes of its terms.
#[derive(Clone, Copy, Default)]
struct Sum {
    value: f64,
    size: f64,
}

impl Sum {
    fn add(&mut self, x: f64) {
        self.value += x;
        self.size += x.abs();
    }

    fn is_well_conditioned(&self) -> bool {
        self.value.abs() > 1e-9 * self.size
    }
}

/// Adds the coefficients of factor times the product of (x + root) over all roots.
fn add_product(to: &mut [Sum; 4], factor: f64, roots: &[f64]) {
    let mut product = vec![factor];
    for root in roots {
        let mut next = vec![0.0; product.len() + 1];
        for (power, c) in product.iter().enumerate() {
            next[power] += c * root;
            next[power + 1] += c;
        }
        product = next;
    }
    product
        .iter()
        .enumerate()
        .for_each(|(power, c)| to[power].add(*c));
}

/// The real roots; empty if they are complex, `None` if they are nearly equal.
fn real_roots(coefficients: &[Sum; 4]) -> Option<Vec<f64>> {
    let [c, b, a] = [
        coefficients[0].value,
        coefficients[1].value,
        coefficients[2].value,
    ];
    let discriminant = b * b - 4.0 * a * c;
    let size = coefficients[1].size * coefficients[1].size + 4.0 * (a * c).abs();
    if discriminant.abs() < 1e-9 * size {
        return None;
    }
    if discriminant < 0.0 {
        return Some(Vec::new());
    }
    let half = -0.5 * (b + discriminant.sqrt().copysign(b));
    Some(vec![c / half, half / a])
}

/// Whether a sequence matches the printed one literally. `[uv]` matches any sequence of u and v. For a negative first residue the signs
/// of DC and DI are inverted.
fn is_as_printed(row: &TableRow, sequence: &Sequence, is_inverted: bool) -> bool {
    let printed: Vec<&str> = row.printed[1..row.printed.len() - 1].split("]-[").collect();
    let names: Vec<String> = sequence.names();
    let names: Vec<&str> = names
        .iter()
        .map(|name| match name.as_str() {
            "DC" if is_inverted => "-DC",
            "DI" if is_inverted => "-DI",
            "-DC" if is_inverted => "DC",
            "-DI" if is_inverted => "DI",
            name => name,
        })
        .collect();
    matches_literally(&printed, &names)
}

fn matches_literally(printed: &[&str], names: &[&str]) -> bool {
    match (printed.split_first(), names.split_first()) {
        (None, None) => true,
        (Some((piece, rest)), Some((name, others))) if piece == name => {
            matches_literally(rest, others)
        }
        (Some((piece, rest)), Some((name, others))) => {
            let is_any_order = !["DI", "DC", "-DC", "-DI"].contains(piece) && piece.len() > 1;
            is_any_order
                && name.len() == 1
                && piece.contains(name)
                && (matches_literally(rest, others) || matches_literally(printed, others))
        }
        _ => false,
    }
}

#[test]
fn tables_give_the_kinds_of_zeros_of_random_plants() {
    let mut draw = Draw(1_618);
    let mut visits: BTreeMap<(&str, usize), [u32; 2]> = BTreeMap::new();
    let mut skipped = 0;
    for index in 0..120_000 {
        let sum = random_plant(&mut draw, index % 4);
        let Some(truth) = truth_of(&sum) else {
            skipped += 1;
            continue;
        };
        let sequence = Sequence::of(&sum).expect("a sequence");
        let table = table_of(&sum).expect("a table");
        assert_eq!(table.name, TABLES[index % 4].name);
        let row = table
            .row(&sum, &sequence)
            .unwrap_or_else(|| panic!("no row for {sequence}: {sum:?}"));
        assert!(
            row.kinds.contains(&truth.kinds),
            "{row:?}: {} computed for {sequence}: {sum:?}",
            truth.kinds
        );
        assert_eq!(row.mmp, truth.mmp, "{row:?}: {sequence}: {sum:?}");
        let is_inverted = sum.terms()[0].residue_per_kg < 0.0;
        let count = visits.entry((row.table, row.number)).or_default();
        count[usize::from(!is_as_printed(row, &sequence, is_inverted))] += 1;
    }
    for ((table, row), [printed, other]) in &visits {
        eprintln!(
            "Table {table}, row {row}: {printed} as printed, {other} by the wider interpretation"
        );
    }
    assert!(skipped < 100, "{skipped} plants too close to a change");
    let rows: usize = TABLES.iter().map(|table| table.rows.len()).sum();
    assert_eq!(
        (rows, visits.len()),
        (27, 27),
        "rows that were never visited"
    );
    let often = |[printed, other]: &[u32; 2]| *printed >= 10 && printed + other >= 300;
    assert!(
        visits.values().all(often),
        "a row visited too rarely: {visits:?}"
    );
    // Rows whose printed sequence does not cover all plants. In all other rows the printed sequence is literally correct.
    let wider: Vec<(&str, usize)> = visits
        .iter()
        .filter(|(_, count)| count[1] > 0)
        .map(|(row, _)| *row)
        .collect();
    assert_eq!(
        wider,
        [
            ("3-3", 5),
            ("3-3", 7),
            ("3-3", 8),
            ("3-3", 9),
            ("3-4", 4),
            ("3-4", 7)
        ]
    );
}

#[test]
fn table_of_a_double_integrator_applies_to_a_slow_mode() {
    // Assumption A3-7 requires that mode R is far from u and v. If a row contains the sequence, its kinds of zeros are correct even without
    // this assumption.
    let (mut draw, mut with_row, mut without_row) = (Draw(2_236), 0, 0);
    for _ in 0..20_000 {
        let free = random_plant(&mut draw, 2);
        let mut terms = free.terms().to_vec();
        terms[0].omega_rad_s = terms[1].omega_rad_s * draw.over_decades(1e-2, 0.99);
        let sum = ModalSum::new(terms, 0.0).expect("residues that are not zero");
        let Some(truth) = truth_of(&sum) else {
            continue;
        };
        let sequence = Sequence::of(&sum).expect("a sequence");
        match table_of(&sum).and_then(|table| table.row(&sum, &sequence)) {
            Some(row) => {
                with_row += 1;
                assert!(
                    row.kinds.contains(&truth.kinds),
                    "{row:?}: {} for {sequence}: {sum:?}",
                    truth.kinds
                );
            }
            // A zero is below mode R, so that the sequence does not begin with R.
            None => {
                without_row += 1;
                assert_ne!(sequence.names()[0], "R", "{sequence}: {sum:?}");
            }
        }
    }
    assert!(
        with_row > 10_000 && without_row > 100,
        "{with_row} {without_row}"
    );
}

#[test]
fn kinds_in_every_row_agree_with_60_digits() {
    let mut draw = Draw(577);
    let mut plants: Vec<(&TableRow, ModalSum)> = Vec::new();
    let mut visits: BTreeMap<(&str, usize), u32> = BTreeMap::new();
    for index in 0..60_000 {
        let sum = random_plant(&mut draw, index % 4);
        let row = table_of(&sum)
            .and_then(|table| table.row(&sum, &Sequence::of(&sum).expect("a sequence")));
        let row = row.unwrap_or_else(|| panic!("no row: {sum:?}"));
        let count = visits.entry((row.table, row.number)).or_default();
        *count += 1;
        if *count <= 20 {
            plants.push((row, sum));
        }
    }
    assert!(plants.len() >= 27 * 20, "{visits:?}");
    let questions: Vec<Value> = plants.iter().map(|(_, sum)| question(sum)).collect();
    let Some(answers) = truth::ask(&questions) else {
        return;
    };
    for ((row, sum), answer) in plants.iter().zip(&answers) {
        let count = |key: &str| answer[key].as_u64().expect("a count") as usize;
        let kinds = ZeroCounts {
            mmp: count("mmp"),
            real: count("real"),
            quartets: count("quartets"),
        };
        assert_eq!(
            kinds,
            ZeroCounts::of(&sum.undamped_zeros().expect("zeros")),
            "{sum:?}"
        );
        assert!(row.kinds.contains(&kinds), "{row:?}: {kinds}, {sum:?}");
    }
}

fn question(sum: &ModalSum) -> Value {
    let terms: Vec<[f64; 3]> = sum
        .terms()
        .iter()
        .map(|t| [t.omega_rad_s, t.damping_ratio, t.residue_per_kg])
        .collect();
    json!({"what": "modal", "terms": terms, "constant": sum.constant_m_per_n()})
}

/// Two to nine damped modes, in a third of the plants with a constant.
fn random_damped_plant(draw: &mut Draw) -> ModalSum {
    let count = *draw.one_of(&[2, 3, 4, 6, 9]);
    let constant = *draw.one_of(&[0.0, 0.0, 1.0]) * draw.over_decades(1e-3, 1e3);
    let term = |_| ModalTerm {
        omega_rad_s: draw.over_decades(0.1, 10.0),
        damping_ratio: draw.over_decades(1e-4, 0.1),
        residue_per_kg: draw.over_decades(1e-2, 1e2) * draw.one_of(&[1.0, -1.0]),
    };
    ModalSum::new((0..count).map(term).collect(), constant).expect("residues that are not zero")
}

#[test]
fn zeros_of_modal_plants_agree_with_60_digits() {
    let mut draw = Draw(141);
    let plants: Vec<ModalSum> = (0..150).map(|_| random_damped_plant(&mut draw)).collect();
    let Some(answers) = truth::ask(&plants.iter().map(question).collect::<Vec<_>>()) else {
        return;
    };
    for (sum, answer) in plants.iter().zip(&answers) {
        for (key, zeros) in [
            ("zeros", sum.undamped_zeros()),
            ("damped_zeros", sum.damped_zeros()),
        ] {
            let zeros = zeros.expect("zeros");
            let truth = answer[key].as_array().expect("a list");
            assert_eq!(zeros.len(), truth.len(), "{key} of {sum:?}");
            for z in truth {
                let (re, im) = (
                    z[0].as_f64().expect("a number"),
                    z[1].as_f64().expect("a number"),
                );
                let nearest = zeros
                    .iter()
                    .map(|zero| (zero.s.re - re).hypot(zero.s.im - im))
                    .fold(f64::MAX, f64::min);
                // The frequencies span two decades: rounding of 1e-16 of the largest square is 1e-12 of the smallest one, and close zeros
                // have errors of the square root of it.
                assert!(
                    nearest < 1e-7 * re.hypot(im),
                    "{key}: {re}{im:+}j of {sum:?}: {zeros:?}"
                );
            }
        }
    }
}

#[test]
fn undershoot_occurs_exactly_with_an_odd_number_of_rnmp_zeros() {
    let mut draw = Draw(299);
    let (mut counts, mut more) = ([0; 2], 0);
    for index in 0..8000 {
        let sum = random_plant(&mut draw, index % 3);
        let Some(truth) = truth_of(&sum) else {
            continue;
        };
        let initial = StepResponse::new(&sum).initial();
        assert_eq!(
            initial.has_undershoot(),
            truth.kinds.real % 2 == 1,
            "{sum:?}: {initial:?}"
        );
        counts[usize::from(initial.has_undershoot())] += 1;
        if sum.is_free() {
            // The time window contains all zero crossings. Each real zero s = x makes the integral of y exp(-x t) zero.
            let crossings = initial.zero_crossings_s.len();
            assert!(crossings >= truth.kinds.real, "{sum:?}: {initial:?}");
            assert_eq!(crossings % 2, truth.kinds.real % 2, "{sum:?}: {initial:?}");
            more += usize::from(crossings > truth.kinds.in_right_half_plane());
        }
    }
    assert!(counts[0] > 1000 && counts[1] > 1000, "{counts:?}");
    // There can be more crossings than RNMP zeros, unlike in the example of section 3.2.4: fast modes with large residues cause many
    // crossings before a weak double integrator dominates.
    assert!(more > 100, "{more}");
}
