//! The conditions of section 4.2.3, each with its decisive quantity and margin.
//!
//! | condition | quantity | holds | margin |
//! |---|---|---|---|
//! | C4-1 | aR, au, av in a pattern of alternating signs | all three have the signs + - + or - + - | for the better fitting of the two patterns, the ratio of the worst fitting residue to the largest of the three. Above 0: of the smallest residue that would have to change its sign; below 0: of the residue with the wrong sign |
//! | C4-2 | b2-hat in the direction of av, Eqs. (4-11), (4-12) | between the sizes of b21-hat and b22-hat | distance to the nearer of the two over the larger: it fails at -1 where wv^2 - wu^2 is twice too large |
//! | C4-3 | size of b2-hat over that of b22-hat where the modes are closest | below 1, and they veer or cross in the range | 1 minus this ratio |
//! | C4-4 | b2-hat in the direction of av, Eqs. (4-13), (4-14) | above the size of b21-hat | distance over the size of b22-hat |
//! | C4-4y | pairs of MMP zeros between wu and wv | two | the least distance among the two zeros and the two modes, over wv - wu |
//!
//! Where au av >= 0, b21-hat and b22-hat do not exist. The margin of C4-2 and C4-4 is then minus the ratio of the
//! smaller of the residues au and av to the larger: the smaller one would have to change its sign.
//!
//! Interpretation where the thesis leaves room:
//!
//! * *C4-2 implies C4-1.* With au av < 0 both critical residues of Eq. (4-5) have the sign of av, and so has any aR between
//!   them. Both are stated nevertheless: C4-1 names the wrong sign.
//! * *"Sufficiently close" in C4-3* is |b2-hat| < |b22-hat| where the modes are closest: with finite residues b2-hat goes
//!   to 0 with wv - wu (Eq. 4-9), and this is the limit that the proof of Proposition P4-2 requires. Mode crossing is the
//!   case of a gap 0. b22-hat is computed from the residues' sizes, so that C4-3 is a statement on the gap for any signs.
//! * *C4-4y* refers to the plant's own zeros, with all its modes, as a measurement shows them.

use serde::Serialize;

use super::{CloseModes, Meeting};
use bench_plant::zeros::{Zero, ZeroKind};

/// A condition at one value of the setting.
#[derive(Clone, Copy, Debug, PartialEq, Serialize)]
pub struct Condition {
    /// `C4-1` and so on.
    pub name: &'static str,
    /// Whether it holds.
    pub holds: bool,
    /// The decisive quantity; see the module.
    pub figure: f64,
    /// The limits of the quantity; an infinite one is no limit (`null` in JSON).
    pub limits: [f64; 2],
    /// Above 0 where it holds, below 0 where it fails; see the module.
    pub margin: f64,
}

impl Condition {
    fn by_margin(name: &'static str, figure: f64, limits: [f64; 2], margin: f64) -> Condition {
        Condition {
            name,
            holds: margin > 0.0,
            figure,
            limits,
            margin,
        }
    }
}

/// Signs + - + or - + -, the better of the two for the residues aR, au, av: the sign of aR and av in it.
pub fn pattern(residues_per_kg: [f64; 3]) -> f64 {
    let worst = |sign: f64| {
        fit(residues_per_kg, sign)
            .into_iter()
            .fold(f64::INFINITY, f64::min)
    };
    if worst(1.0) >= worst(-1.0) { 1.0 } else { -1.0 }
}

/// Residues R, u, v over the largest, positive where they have the sign of the pattern.
fn fit([r, u, v]: [f64; 3], sign: f64) -> [f64; 3] {
    let largest = r.abs().max(u.abs()).max(v.abs()).max(f64::MIN_POSITIVE);
    [r * sign, -u * sign, v * sign].map(|residue| residue / largest)
}

/// Which of R, u, v (0 to 2) is decisive for Condition C4-1: the one that would have to change its sign, or whose sign
/// changes first.
pub fn deciding_residue(residues_per_kg: [f64; 3]) -> usize {
    let fit = fit(residues_per_kg, pattern(residues_per_kg));
    (1..3).fold(0, |least, which| {
        if fit[which] < fit[least] {
            which
        } else {
            least
        }
    })
}

/// C4-1: aR, au, av form a sequence of alternating signs.
pub fn c4_1(modes: &CloseModes) -> Condition {
    let residues = modes.residues_per_kg();
    let margin = fit(residues, pattern(residues))[deciding_residue(residues)];
    Condition::by_margin("C4-1", margin, [0.0, f64::INFINITY], margin)
}

/// C4-2: b2-hat between b21-hat and b22-hat. Figure and limits in 1/kg.
pub fn c4_2(modes: &CloseModes) -> Condition {
    let (figure, [low, high]) = (modes.signed_b2_per_kg(), modes.critical_b2_per_kg());
    let margin = opposed_margin(modes, (figure - low).min(high - figure) / high);
    Condition::by_margin("C4-2", figure, [low, high], margin)
}

/// C4-4 at one value: b2-hat above b21-hat. Figure and limit in 1/kg.
pub fn c4_4(modes: &CloseModes) -> Condition {
    let (figure, [low, high]) = (modes.signed_b2_per_kg(), modes.critical_b2_per_kg());
    let margin = opposed_margin(modes, (figure - low) / high);
    Condition::by_margin("C4-4", figure, [low, f64::INFINITY], margin)
}

/// The margin of a condition that needs au av < 0. Where it is not so, minus the smaller of au and av over the larger: the
/// one that would have to change its sign.
fn opposed_margin(modes: &CloseModes, margin: f64) -> f64 {
    if modes.are_opposed() {
        return margin;
    }
    let (u, v) = (modes.u.residue_per_kg.abs(), modes.v.residue_per_kg.abs());
    -u.min(v) / u.max(v).max(f64::MIN_POSITIVE)
}

/// C4-3, from the two modes where they are closest (`None` at a crossing, where the gap is 0) and the behaviour of their
/// loci there.
pub fn c4_3(meeting: Meeting, closest: Option<&CloseModes>) -> Condition {
    let ratio = |modes: &CloseModes| {
        modes.b2_per_kg().abs() / modes.critical_b2_per_kg()[1].max(f64::MIN_POSITIVE)
    };
    let figure = closest.map_or(0.0, ratio);
    let holds = figure < 1.0 && meeting != Meeting::AtTheEnd;
    Condition {
        name: "C4-3",
        holds,
        figure,
        limits: [0.0, 1.0],
        margin: 1.0 - figure,
    }
}

/// C4-4y at one value: two pairs of MMP zeros of the plant between the two modes. Its margin is -1 or more; without two
/// pairs of MMP zeros anywhere it is -1.
pub fn c4_4y(modes: &CloseModes, zeros: &[Zero]) -> Condition {
    let (wu, wv) = (modes.u.omega_rad_s, modes.v.omega_rad_s);
    let depth = |w: f64| (w - wu).min(wv - w) / (wv - wu);
    let zeros = zeros
        .iter()
        .filter(|zero| zero.kind == ZeroKind::Mmp && zero.s.im > 0.0);
    let mut places: Vec<(f64, f64)> = zeros.map(|zero| (depth(zero.s.im), zero.s.im)).collect();
    places.sort_by(|a, b| b.0.total_cmp(&a.0));
    let inside = places.iter().filter(|(depth, _)| *depth > 0.0).count();
    Condition {
        name: "C4-4y",
        holds: inside == 2,
        figure: inside as f64,
        limits: [2.0, 2.0],
        margin: match places.as_slice() {
            [(_, first), (depth, second), ..] if inside >= 2 => {
                depth.min((first - second).abs() / (wv - wu))
            }
            [_, (depth, _), ..] => depth.max(-1.0),
            _ => -1.0,
        },
    }
}
