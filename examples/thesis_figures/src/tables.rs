//! Tables 2-2, 2-3 and 3-1 to 3-4.

use rand_core::Rng;
use rand_pcg::Pcg64;

use super::content::signed;
use super::model::Model;
use super::{Comparison, Content, FigureError, Runs};
use bench_config::{PlantSettings, XySettings};
use bench_plant::zeros::{ModalSum, ModalTerm, ZeroCounts, phase_drop_deg, undamped_zeros};
use bench_thesis::{MmpLocation, Sequence, TABLES, Table, TableRow, table_of};

const TAU: f64 = std::f64::consts::TAU;

/// Table 2-2 as printed: asymmetry, frequencies, and of each mode x1, y1, y2, y3.
const TABLE_2_2: [(f64, [f64; 4], [[f64; 4]; 4]); 2] = [
    (
        0.0,
        [18.2, 27.6, 153.2, 154.3],
        [
            [0.9999, 0.0, 0.0068, -0.0068],
            [0.0, 0.8075, 0.4171, 0.4171],
            [-0.0231, 0.0, -0.7069, 0.7069],
            [0.0, 0.0481, -0.7063, -0.7063],
        ],
    ),
    (
        0.05,
        [18.2, 27.6, 150.1, 153.9],
        [
            [0.9999, 0.0, -0.0068, 0.0068],
            [0.0, 0.8073, 0.4176, 0.4169],
            [-0.0189, 0.0294, -0.9845, 0.1718],
            [-0.0139, -0.0387, 0.1384, 0.9895],
        ],
    ),
];

pub(crate) fn table_2_2(_: &Runs) -> Result<Content, FigureError> {
    let mut content = Content::new("Frequencies and eigenvectors of the SR4DoF at 5 % of L. Eigenvectors have unit length; their sign is free and is the one that fits the printed vector.")
        .setting("profile chapter2: plate modulus E/(1 - nu^2), I = H T^3/12 = 0.5086 mm^4 (the table's 5.09e-4 mm^4 is a slip of unit), m3 = 18.747 g (printed as 18 g), m2 = m3 (1 + D)")
        .setting("an element agrees within 5e-4: half of its last digit, and the table's masses, which are rounded to 0.1 %");
    for (asymmetry, frequencies, shapes) in TABLE_2_2 {
        let model = Model::profile("chapter2").at(0.05, asymmetry);
        let at = format!("D = {} %", 100.0 * asymmetry);
        content = content.command(model.command("model modes", ""));
        for (k, mode) in model.modal()?.modes.iter().enumerate() {
            let hertz = mode.omega_rad_s / TAU;
            content = content.compare(Comparison::number(
                &format!("{at}, f{}", k + 1),
                frequencies[k],
                1,
                hertz,
                "Hz",
            ));
            let side = mode
                .shape
                .iter()
                .zip(shapes[k])
                .map(|(ours, theirs)| ours * theirs)
                .sum::<f64>()
                .signum();
            for (name, (ours, printed)) in ["x1", "y1", "y2", "y3"]
                .iter()
                .zip(mode.shape.iter().zip(shapes[k]))
            {
                let row = Comparison::within(
                    &format!("{at}, mode {}, {name}", k + 1),
                    printed,
                    4,
                    side * ours,
                    "",
                    5e-4,
                );
                let flipped = asymmetry > 0.0 && k == 0 && name.starts_with('y') && *name != "y1";
                content = content.compare(if flipped {
                    row.remark("the printed signs of y2 and y3 are flipped in this column: compare D = 0 %")
                } else {
                    row
                });
            }
        }
    }
    Ok(content)
}

/// Table 2-3: phase drop in degrees, operating point as a ratio of L, deviations of the masses a to h in per cent.
const TABLE_2_3: [(f64, f64, [f64; 8]); 3] = [
    (0.0, 0.0, [0.0; 8]),
    (
        360.0,
        0.0488,
        [-8.16, 13.10, 8.57, -13.21, -13.24, 0.66, -4.80, -13.12],
    ),
    (
        720.0,
        0.0954,
        [8.47, 12.08, -14.19, -12.78, 6.59, -2.42, 14.97, 5.14],
    ),
];
const PLACES: [&str; 8] = ["sL", "sR", "sT", "sB", "gL", "gR", "gT", "gB"];

/// The XY stage with the masses of a row at the places that a labelling gives them.
fn labelled(base: &XySettings, row: usize, labels: &[usize; 8]) -> XySettings {
    let (_, point, deviations) = TABLE_2_3[row];
    let mut settings = XySettings {
        operating_point_m: point * base.beam_length_m,
        ..base.clone()
    };
    let at = &mut settings.secondary_mass_deviation;
    let slots = [
        &mut at.sL, &mut at.sR, &mut at.sT, &mut at.sB, &mut at.gL, &mut at.gR, &mut at.gT,
        &mut at.gB,
    ];
    for (slot, label) in slots.into_iter().zip(labels) {
        *slot = deviations[*label] / 100.0;
    }
    settings
}

fn drop_deg(settings: XySettings) -> Result<f64, FigureError> {
    Ok(phase_drop_deg(&undamped_zeros(&bench_plant::build(
        &PlantSettings::Xy(settings),
    )?)?))
}

/// The next permutation of eight indices in lexicographic order; `false` after the last.
fn next_order(order: &mut [usize; 8]) -> bool {
    let Some(from) = (0..7).rev().find(|&k| order[k] < order[k + 1]) else {
        return false;
    };
    let to = (from + 1..8)
        .rev()
        .find(|&k| order[k] > order[from])
        .unwrap_or(from + 1);
    order.swap(from, to);
    order[from + 1..].reverse();
    true
}

/// The first labelling, in lexicographic order, with which all rows have their phase drops.
fn labelling(base: &XySettings) -> Result<[usize; 8], FigureError> {
    let mut labels = [0, 1, 2, 3, 4, 5, 6, 7];
    loop {
        let fits = |row: usize| {
            Ok::<bool, FigureError>(drop_deg(labelled(base, row, &labels))? == TABLE_2_3[row].0)
        };
        if fits(2)? && fits(1)? {
            return Ok(labels);
        }
        if !next_order(&mut labels) {
            return Ok([0, 1, 2, 3, 4, 5, 6, 7]);
        }
    }
}

pub(crate) fn table_2_3(_: &Runs) -> Result<Content, FigureError> {
    let PlantSettings::Xy(base) = Model::profile("xy").config()?.plant else {
        return Err(FigureError::Run("profile xy is another model".into()));
    };
    let labels = labelling(&base)?;
    let words: Vec<String> = PLACES
        .iter()
        .zip(labels)
        .map(|(place, k)| format!("{} at {place}", char::from(b'a' + k as u8)))
        .collect();
    let mut content = Content::new("Phase drop of the XY stage with the printed deviations of its eight secondary masses.")
        .setting("profile xy: pinwheel, no geometric stiffness, no damping")
        .assumed(format!("the places of the labels a to h, which only Fig 1-2a would tell: {}, the first in alphabetical order of the 145 out of 40320 labellings that give all three rows in the pinwheel", words.join(", ")));
    for (row, (printed, point, _)) in TABLE_2_3.iter().enumerate() {
        let settings = labelled(&base, row, &labels);
        let masses = serde_json::to_value(settings.secondary_mass_deviation).unwrap_or_default();
        let mut model = Model::profile("xy").set(&format!(
            "plant.operating_point_m={:?}",
            settings.operating_point_m
        ));
        for place in PLACES {
            let deviation = masses
                .get(place)
                .and_then(serde_json::Value::as_f64)
                .unwrap_or_default();
            model = model.set(&format!(
                "plant.secondary_mass_deviation.{place}={deviation:?}"
            ));
        }
        let computed = drop_deg(settings)?;
        content = content
            .compare(Comparison::number(
                &format!("phase drop at {} % of L", signed(100.0 * point, 2)),
                *printed,
                0,
                computed,
                "deg",
            ))
            .command(model.command("model modes", ""));
    }
    Ok(content)
}

/// Plants drawn for each of Tables 3-1 to 3-4.
const DRAWS: usize = 4000;

/// Random plants of the classes of the tables: residues over six decades with either sign, frequencies over one.
struct Draw(Pcg64);

impl Draw {
    fn unit(&mut self) -> f64 {
        (self.0.next_u64() >> 11) as f64 / (1u64 << 53) as f64
    }

    fn decades(&mut self, low: f64, high: f64) -> f64 {
        low * (high / low).powf(self.unit())
    }

    fn residue(&mut self) -> f64 {
        let size = self.decades(1e-2, 1e2);
        if self.unit() < 0.5 { size } else { -size }
    }

    /// The slowest mode is positive (Assumption A3-6).
    fn plant(&mut self, class: usize) -> Result<ModalSum, FigureError> {
        let (a, b, c) = (self.decades(1e-2, 1e2), self.residue(), self.residue());
        let u = self.decades(0.3, 3.0);
        let v = u * (1.0 + self.decades(0.01, 10.0));
        let mode = ModalTerm::undamped;
        let (terms, constant) = match class {
            0 => (vec![mode(0.0, a), mode(v, b)], 0.0),
            1 => (vec![mode(u, a), mode(v, b)], 0.0),
            2 => (vec![mode(0.0, a), mode(u, b), mode(v, c)], 0.0),
            _ => (vec![mode(u, a), mode(v, b)], c),
        };
        Ok(ModalSum::new(terms, constant)?)
    }
}

/// What was drawn of a row.
#[derive(Clone, Debug, Default)]
struct Drawn {
    count: usize,
    as_printed: usize,
    example: Option<(ModalSum, String, ZeroCounts)>,
}

/// Where the MMP zeros lie between the last two resonances.
fn mmp_places(sum: &ModalSum) -> Result<Vec<MmpLocation>, FigureError> {
    let omegas: Vec<f64> = sum.terms().iter().map(|term| term.omega_rad_s).collect();
    let v = omegas[omegas.len() - 1];
    let u = omegas[omegas.len() - 2];
    let place = |w: f64| match (w < u, w < v) {
        (true, _) => MmpLocation::BelowU,
        (false, true) => MmpLocation::Between,
        _ => MmpLocation::AboveV,
    };
    let zeros = sum.undamped_zeros()?;
    let mmp = zeros
        .iter()
        .filter(|zero| zero.kind == bench_plant::zeros::ZeroKind::Mmp && zero.s.im > 0.0);
    Ok(mmp.map(|zero| place(zero.s.im)).collect())
}

fn drawn(index: usize) -> Result<(Vec<Drawn>, usize), FigureError> {
    let table: &Table = &TABLES[index];
    let mut rows = vec![Drawn::default(); table.rows.len()];
    let mut draw = Draw(Pcg64::new(2017, index as u128));
    let mut outside = 0;
    for _ in 0..DRAWS {
        let sum = draw.plant(index)?;
        let sequence = Sequence::of(&sum)?;
        let Some(row) = table_of(&sum).and_then(|table| table.row(&sum, &sequence)) else {
            outside += 1;
            continue;
        };
        let kinds = ZeroCounts::of(&sum.undamped_zeros()?);
        let slot = &mut rows[row.number - 1];
        slot.count += 1;
        slot.as_printed += usize::from(row.kinds.contains(&kinds) && mmp_places(&sum)? == row.mmp);
        slot.example
            .get_or_insert((sum, sequence.to_string(), kinds));
    }
    Ok((rows, outside))
}

fn kinds_of(row: &TableRow) -> String {
    row.kinds
        .iter()
        .map(ZeroCounts::to_string)
        .collect::<Vec<_>>()
        .join(" or ")
}

fn places_of(row: &TableRow) -> String {
    let word = |place: &MmpLocation| match place {
        MmpLocation::BelowU => "(0, wu)",
        MmpLocation::Between => "(wu, wv)",
        MmpLocation::AboveV => "(wv, ∞)",
    };
    let mut words: Vec<&str> = row.mmp.iter().map(word).collect();
    words.dedup();
    if words.is_empty() {
        String::new()
    } else {
        format!(", MMP in {}", words.join(" and "))
    }
}

fn example_words(sum: &ModalSum) -> String {
    let term = |term: &ModalTerm| {
        format!(
            "{} at {} rad/s",
            signed(term.residue_per_kg, 4),
            signed(term.omega_rad_s, 4)
        )
    };
    let terms: Vec<String> = sum.terms().iter().map(term).collect();
    let constant = if sum.constant_m_per_n() == 0.0 {
        String::new()
    } else {
        format!(", R = {}", signed(sum.constant_m_per_n(), 4))
    };
    format!("first drawn: residues {}{constant}", terms.join(", "))
}

fn table_of_chapter_3(index: usize, class: &str) -> Result<Content, FigureError> {
    let (rows, outside) = drawn(index)?;
    let mut content = Content::new(&format!("The table as a property: {DRAWS} random plants ({class}) are sorted into its rows by signs and sequence of dominant modes, and the kinds and places of their zeros computed. A row agrees if all of its plants have the printed ones."))
        .setting("residues from 0.01 to 100 1/kg of either sign (the slowest mode positive), wu from 0.3 to 3 rad/s, wv beyond it by 1 % to 1000 % of wu; no damping; seed 2017")
        .compare(Comparison::holds("plants whose sequence is in no row", "none", outside == 0, &outside.to_string()));
    for (row, drawn) in TABLES[index].rows.iter().zip(rows) {
        let what = format!("{} {}", row.signs, row.printed);
        let printed = format!("{}{}", kinds_of(row), places_of(row));
        let Some((sum, sequence, kinds)) = drawn.example else {
            content = content
                .compare(Comparison::unprinted(&what, "no plant drawn").remark("rare: draw more"));
            continue;
        };
        let computed = format!(
            "{} of {} plants; {sequence}: {kinds}",
            drawn.as_printed, drawn.count
        );
        content = content.compare(
            Comparison::holds(&what, &printed, drawn.as_printed == drawn.count, &computed)
                .remark(&example_words(&sum)),
        );
        if sum.constant_m_per_n() == 0.0 {
            let names = ["a", "b", "c"];
            let modes: Vec<super::model::ModeOf> = sum
                .terms()
                .iter()
                .zip(names)
                .map(|(t, name)| super::model::ModeOf(name, t.omega_rad_s, t.residue_per_kg, 0.0))
                .collect();
            content = content.command(Model::modes(&modes).command("model sequence", ""));
        }
    }
    Ok(content)
}

pub(crate) fn table_3_1(_: &Runs) -> Result<Content, FigureError> {
    table_of_chapter_3(0, "a double integrator and a mode, Eq. 3-3")
}

pub(crate) fn table_3_2(_: &Runs) -> Result<Content, FigureError> {
    Ok(table_of_chapter_3(1, "two modes, Eq. 3-5")?
        .setting("places of the MMP zeros as corrected: the printed column stands one row too low"))
}

pub(crate) fn table_3_3(_: &Runs) -> Result<Content, FigureError> {
    table_of_chapter_3(2, "a double integrator and two modes, Eq. 3-7")
}

pub(crate) fn table_3_4(_: &Runs) -> Result<Content, FigureError> {
    table_of_chapter_3(3, "two modes and a constant, Eq. 3-10")
}
