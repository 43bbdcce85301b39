//! Tables 3-1 to 3-4: from the signs and the sequence of dominant modes to the kinds of the zeros, without computing one.
//!
//! Signs are those of the modes along frequency (Assumption A3-6: the slowest is positive; a plant whose slowest mode
//! is negative is read with all signs reversed). A pattern contains all sequences that a printed row stands for. In
//! these rows it is wider than printed; the kinds are the printed ones in all cases:
//!
//! | row | printed | also | reason |
//! |---|---|---|---|
//! | 3-3, 5 | `[R]-[u]-[v]-[u]-[DI]` | `[R]` at the end | where aR > \|au\| mode R dominates alone: it is a double integrator |
//! | 3-3, 7 | `[Ru]-[v]-[DI]` | `[R]`, `[u]` at the end | where one of them outweighs v alone, definition (2b) names it |
//! | 3-3, 8 and 9 | `[R]-[uv]...` | `[R]` between u and v | the zero between u and v is R's where R outweighs v there |
//! | 3-4, 4 | `[DC]-[v]-[u]-[v]-[R]` | `[R]` at the start | where R > \|av\|/wv^2 the constant alone holds the sign |
//! | 3-4, 7 | `[-DC]-[u]-[v]-[R]` | `[R]`, `[v]` at the start | where one of them outweighs u at low frequency |
//!
//! A misprint: in Table 3-2 the places of the MMP zeros are one row too low (cyclically). `[v]-[u]-[v]` has them below wu,
//! `[u]-[v]` none, `[u]-[v]-[u]` above wv.

use serde::Serialize;

use crate::{Sequence, sign_sequence};
use bench_plant::zeros::{ModalSum, ZeroCounts};
use bench_plant::{ModalModel, PlantError};

/// The resonances between which a pair of MMP zeros lies.
#[derive(Clone, Copy, Debug, PartialEq, Eq, Hash)]
pub enum MmpLocation {
    /// (0, wu).
    BelowU,
    /// (wu, wv).
    Between,
    /// (wv, infinity).
    AboveV,
}

/// One row of a table.
#[derive(Clone, Copy, Debug, PartialEq, Serialize)]
pub struct TableRow {
    /// `3-1` to `3-4`.
    pub table: &'static str,
    /// Row of the table, from 1.
    #[serde(rename = "row")]
    pub number: usize,
    /// Signs of the modes by frequency.
    #[serde(skip)]
    pub signs: &'static str,
    /// The sequence as printed.
    pub printed: &'static str,
    /// The kinds of the zeros as printed; one of these.
    pub kinds: &'static [ZeroCounts],
    /// The places of the MMP zeros.
    #[serde(skip)]
    pub mmp: &'static [MmpLocation],
    #[serde(skip)]
    pattern: &'static [Piece],
}

/// A piece of a pattern: exactly one of these names, or one or more of them.
#[derive(Clone, Copy, Debug, PartialEq)]
enum Piece {
    One(&'static [&'static str]),
    Some(&'static [&'static str]),
}

impl TableRow {
    /// Whether a sequence belongs to this row.
    pub fn fits(&self, signs: &str, names: &[String]) -> bool {
        let names: Vec<&str> = names.iter().map(String::as_str).collect();
        self.signs == signs && fits(self.pattern, &names)
    }
}

fn fits(pattern: &[Piece], names: &[&str]) -> bool {
    match (pattern, names) {
        ([], []) => true,
        ([Piece::One(of), rest @ ..], [name, names @ ..]) => of.contains(name) && fits(rest, names),
        ([Piece::Some(of), rest @ ..], [name, names @ ..]) => {
            of.contains(name) && (fits(rest, names) || fits(pattern, names))
        }
        _ => false,
    }
}

/// A table: the rows of one class of plants.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct Table {
    /// `3-1` to `3-4`.
    pub name: &'static str,
    /// The rows as printed.
    pub rows: &'static [TableRow],
}

impl Table {
    /// The row of a plant, by its signs and its sequence; `None` where no row has that sequence.
    pub fn row(&self, sum: &ModalSum, sequence: &Sequence) -> Option<&'static TableRow> {
        let (signs, names) = (signs(sum), reversed_names(sum, sequence));
        self.rows.iter().find(|row| row.fits(&signs, &names))
    }
}

/// The table of a plant's class: a double integrator and a mode, two modes, a slow mode (or double integrator) and two
/// modes, two modes and a constant. `None` for any other.
pub fn table_of(sum: &ModalSum) -> Option<&'static Table> {
    let index = match (sum.terms().len(), sum.has_constant(), sum.is_free()) {
        (2, false, true) => 0,
        (2, false, false) => 1,
        (3, false, _) => 2,
        (2, true, false) => 3,
        _ => return None,
    };
    Some(&TABLES[index])
}

fn slowest_is_negative(sum: &ModalSum) -> bool {
    let slowest = sum.terms().first();
    slowest.is_some_and(|term| term.residue_per_kg < 0.0)
}

/// The signs along frequency, reversed where the first is negative.
fn signs(sum: &ModalSum) -> String {
    let reversed = slowest_is_negative(sum);
    let constant = sum.has_constant().then_some(sum.constant_m_per_n());
    let residues = sum.terms().iter().map(|term| term.residue_per_kg);
    let is_positive = |part: f64| part != 0.0 && (part > 0.0) != reversed;
    let parts = residues.chain(constant);
    parts
        .map(|part| if is_positive(part) { '+' } else { '-' })
        .collect()
}

/// The names of a sequence, reversed with the signs.
fn reversed_names(sum: &ModalSum, sequence: &Sequence) -> Vec<String> {
    let names = sequence.names();
    if slowest_is_negative(sum) {
        names.into_iter().map(reversed_name).collect()
    } else {
        names
    }
}

fn reversed_name(name: String) -> String {
    match name.as_str() {
        "DC" | "DI" => format!("-{name}"),
        "-DC" | "-DI" => name[1..].to_string(),
        _ => name,
    }
}

/// The kinds that the tables read from the sequence of dominant modes, beside the computed ones.
#[derive(Clone, Debug, PartialEq, Serialize)]
pub struct SequenceReport {
    /// The signs of the modes that can be observed.
    pub sign_sequence: String,
    /// The dominant modes along frequency.
    pub dominant_sequence: String,
    /// The row with these signs and this sequence; `None` for other numbers of modes or where no row has the sequence.
    pub table: Option<&'static TableRow>,
    /// The kinds of the zeros of these modes.
    pub computed: ZeroCounts,
    /// Whether the row has the computed kinds.
    pub agree: Option<bool>,
}

impl SequenceReport {
    /// The report of a plant's modes.
    pub fn of(modal: &ModalModel) -> Result<SequenceReport, PlantError> {
        let sum = ModalSum::visible(modal)?;
        let sequence = Sequence::of(&sum)?;
        let table = table_of(&sum).and_then(|table| table.row(&sum, &sequence));
        let computed = ZeroCounts::of(&sum.undamped_zeros()?);
        Ok(SequenceReport {
            sign_sequence: sign_sequence(modal),
            dominant_sequence: sequence.to_string(),
            table,
            computed,
            agree: table.map(|row| row.kinds.contains(&computed)),
        })
    }
}

const fn counts(mmp: usize, real: usize, quartets: usize) -> ZeroCounts {
    ZeroCounts {
        mmp,
        real,
        quartets,
    }
}

const MMP: &[ZeroCounts] = &[counts(1, 0, 0)];
const REAL: &[ZeroCounts] = &[counts(0, 1, 0)];
const DUAL_MMP: &[ZeroCounts] = &[counts(2, 0, 0)];
const MMP_AND_REAL: &[ZeroCounts] = &[counts(1, 1, 0)];
const QUARTET_OR_DUAL_REAL: &[ZeroCounts] = &[counts(0, 0, 1), counts(0, 2, 0)];

const R: Piece = Piece::One(&["R"]);
const U: Piece = Piece::One(&["u"]);
const V: Piece = Piece::One(&["v"]);
const UV: Piece = Piece::Some(&["u", "v"]);
const RU: Piece = Piece::Some(&["R", "u"]);
const RUV: Piece = Piece::Some(&["R", "u", "v"]);

const fn row(
    (table, number): (&'static str, usize),
    signs: &'static str,
    printed: &'static str,
    pattern: &'static [Piece],
    kinds: &'static [ZeroCounts],
    mmp: &'static [MmpLocation],
) -> TableRow {
    TableRow {
        table,
        number,
        signs,
        printed,
        kinds,
        mmp,
        pattern,
    }
}

use MmpLocation::{AboveV, BelowU, Between};

/// Tables 3-1 to 3-4, in their order.
pub const TABLES: &[Table] = &[
    // A double integrator u and a mode v, Eq. (3-3).
    Table {
        name: "3-1",
        rows: &[
            row(("3-1", 1), "++", "[uv]", &[UV], MMP, &[Between]),
            row(("3-1", 2), "+-", "[u]-[v]", &[U, V], REAL, &[]),
            row(("3-1", 3), "+-", "[u]-[v]-[u]", &[U, V, U], MMP, &[AboveV]),
        ],
    },
    // Two modes, Eq. (3-5).
    Table {
        name: "3-2",
        rows: &[
            row(("3-2", 1), "++", "[uv]", &[UV], MMP, &[Between]),
            row(("3-2", 2), "+-", "[v]-[u]-[v]", &[V, U, V], MMP, &[BelowU]),
            row(("3-2", 3), "+-", "[u]-[v]", &[U, V], REAL, &[]),
            row(("3-2", 4), "+-", "[u]-[v]-[u]", &[U, V, U], MMP, &[AboveV]),
        ],
    },
    // A double integrator R and two modes, Eq. (3-7).
    Table {
        name: "3-3",
        rows: &[
            row(
                ("3-3", 1),
                "+-+",
                "[R]-[u]-[v]",
                &[R, U, V],
                QUARTET_OR_DUAL_REAL,
                &[],
            ),
            row(
                ("3-3", 2),
                "+-+",
                "[R]-[u]-[R]-[v]",
                &[R, U, R, V],
                DUAL_MMP,
                &[Between, Between],
            ),
            row(
                ("3-3", 3),
                "+-+",
                "[R]-[u]-[v]-[u]",
                &[R, U, V, U],
                MMP_AND_REAL,
                &[AboveV],
            ),
            row(
                ("3-3", 4),
                "+-+",
                "[R]-[v]-[u]-[v]",
                &[R, V, U, V],
                DUAL_MMP,
                &[BelowU, BelowU],
            ),
            row(
                ("3-3", 5),
                "+-+",
                "[R]-[u]-[v]-[u]-[DI]",
                &[R, U, V, U, Piece::One(&["DI", "R"])],
                DUAL_MMP,
                &[AboveV, AboveV],
            ),
            row(
                ("3-3", 6),
                "++-",
                "[Ru]-[v]",
                &[RU, V],
                MMP_AND_REAL,
                &[BelowU],
            ),
            row(
                ("3-3", 7),
                "++-",
                "[Ru]-[v]-[DI]",
                &[RU, V, Piece::One(&["DI", "R", "u"])],
                DUAL_MMP,
                &[BelowU, AboveV],
            ),
            row(
                ("3-3", 8),
                "+--",
                "[R]-[uv]-[R]",
                &[R, RUV, R],
                DUAL_MMP,
                &[Between, AboveV],
            ),
            row(
                ("3-3", 9),
                "+--",
                "[R]-[uv]",
                &[R, RU, V],
                MMP_AND_REAL,
                &[Between],
            ),
            row(
                ("3-3", 10),
                "+++",
                "[Ruv]",
                &[RUV],
                DUAL_MMP,
                &[BelowU, Between],
            ),
        ],
    },
    // Two modes and a constant R, Eq. (3-10).
    Table {
        name: "3-4",
        rows: &[
            row(
                ("3-4", 1),
                "+-+",
                "[u]-[v]-[R]",
                &[U, V, R],
                QUARTET_OR_DUAL_REAL,
                &[],
            ),
            row(
                ("3-4", 2),
                "+-+",
                "[u]-[R]-[v]-[R]",
                &[U, R, V, R],
                DUAL_MMP,
                &[Between, Between],
            ),
            row(
                ("3-4", 3),
                "+-+",
                "[v]-[u]-[v]-[R]",
                &[V, U, V, R],
                MMP_AND_REAL,
                &[BelowU],
            ),
            row(
                ("3-4", 4),
                "+-+",
                "[DC]-[v]-[u]-[v]-[R]",
                &[Piece::One(&["DC", "R"]), V, U, V, R],
                DUAL_MMP,
                &[BelowU, BelowU],
            ),
            row(
                ("3-4", 5),
                "+-+",
                "[u]-[v]-[u]-[R]",
                &[U, V, U, R],
                DUAL_MMP,
                &[AboveV, AboveV],
            ),
            row(
                ("3-4", 6),
                "+--",
                "[u]-[v]-[R]",
                &[U, V, R],
                MMP_AND_REAL,
                &[AboveV],
            ),
            row(
                ("3-4", 7),
                "+--",
                "[-DC]-[u]-[v]-[R]",
                &[Piece::One(&["-DC", "R", "v"]), U, V, R],
                DUAL_MMP,
                &[BelowU, AboveV],
            ),
            row(
                ("3-4", 8),
                "++-",
                "[R]-[uv]-[R]",
                &[R, UV, R],
                DUAL_MMP,
                &[BelowU, Between],
            ),
            row(
                ("3-4", 9),
                "++-",
                "[uv]-[R]",
                &[UV, R],
                MMP_AND_REAL,
                &[Between],
            ),
            row(
                ("3-4", 10),
                "+++",
                "[uvR]",
                &[RUV],
                DUAL_MMP,
                &[Between, AboveV],
            ),
        ],
    },
];
