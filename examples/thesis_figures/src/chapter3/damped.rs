//! Figs 3-15 and 3-16: zeros with damping.

use super::super::content::signed;
use super::super::model::{ModeOf, Model, even, geometric};
use super::super::plane::{Part, changes, locus, plane, tracks};
use super::super::{Comparison, Content, FigureError, Runs};
use bench_plant::zeros::{Crossing, Locus, LocusPlane, ModalTerm};
use bench_report::colours::{BLUE, Colour, GREEN, INK, ORANGE, PURPLE, VERMILION};
use bench_report::{Chart, Pen, Symbol};
use bench_thesis::{critical_damping, touching_damping, two_mode_break_points};

const KEY_V: &str = "plant.modes.v.residue_per_kg";
const KEY_R: &str = "plant.modes.R.residue_per_kg";

/// Two damped modes out of phase with the axes of their plane.
struct Pair {
    heading: &'static str,
    /// Damping ratios of u and v.
    damping: [f64; 2],
    re: (f64, f64),
    /// Largest imaginary part.
    im: f64,
}

const PAIRS_3_15: [Pair; 2] = [
    Pair {
        heading: "(a) Same damping ratios, 0.3",
        damping: [0.3, 0.3],
        re: (-18.0, 3.0),
        im: 9.0,
    },
    Pair {
        heading: "(b) Different ones: u 0.3, v 0.05",
        damping: [0.3, 0.05],
        re: (-2.5, 5.5),
        im: 3.4,
    },
];
/// Frequencies of u and v in Fig 3-15.
const OMEGAS_3_15: [f64; 2] = [1.0, 1.2];

impl Pair {
    fn model(&self) -> Model {
        let [zu, zv] = self.damping;
        Model::modes(&[ModeOf("u", 1.0, 1.0, zu), ModeOf("v", 1.2, -0.5, zv)])
    }

    fn locus(&self) -> Result<Locus, FigureError> {
        let angles = even(-0.001f64.atan(), -60.0f64.atan(), 601).into_iter();
        let residues: Vec<f64> = angles.map(f64::tan).collect();
        locus(&self.model().varied(KEY_V)?, LocusPlane::Damped, &residues)
    }

    fn chart(&self, locus: &Locus) -> Chart {
        let chart = plane(self.heading, self.re, (-self.im, self.im));
        let chart = tracks(chart, "zeros", Pen::solid(VERMILION), locus, Part::Damped);
        let poles = [1.0, -1.0].map(|side| [0, 1].map(|mode| self.pole(mode, side)));
        changes(chart, locus).points("poles", INK, Symbol::Cross, poles.concat())
    }

    /// The pole of a mode on one side of the real axis.
    fn pole(&self, mode: usize, side: f64) -> (f64, f64) {
        let (w, zeta) = (OMEGAS_3_15[mode], self.damping[mode]);
        (-zeta * w, side * w * (1.0 - zeta * zeta).sqrt())
    }

    /// The break points by Eq. (3-14).
    fn break_points(&self) -> [f64; 2] {
        let term = |mode: usize, residue_per_kg: f64| ModalTerm {
            omega_rad_s: OMEGAS_3_15[mode],
            damping_ratio: self.damping[mode],
            residue_per_kg,
        };
        two_mode_break_points(&term(0, 1.0), &term(1, -1.0)).unwrap_or([f64::NAN; 2])
    }

    fn compare(&self, mut content: Content, locus: &Locus) -> Content {
        let real = locus
            .changes
            .iter()
            .filter(|c| c.crossing == Crossing::RealAxis);
        let mut met: Vec<f64> = real.map(|change| change.s.re).collect();
        met.sort_by(|a, b| a.abs().total_cmp(&b.abs()));
        for (k, formula) in self.break_points().into_iter().enumerate() {
            let what = format!(
                "{}: Z{} by Eq. (3-14), and by the locus",
                self.heading,
                k + 1
            );
            let found = met.get(k).copied().unwrap_or(f64::NAN);
            let tolerance = 1e-4 * formula.abs();
            content = content.compare(
                Comparison::within(&what, formula, 4, found, "rad/s", tolerance)
                    .remark("printed: the equation. Compared to 1e-4, as rounding separates two zeros that meet by its square root"),
            );
        }
        let range = format!("--damped --vary {KEY_V} --from -0.001 --to -60 --count 1001");
        content.command(self.model().command("model locus", &range))
    }
}

pub(in super::super) fn fig_3_15(_: &Runs) -> Result<Content, FigureError> {
    let mut content = Content::new("Migration of the zeros of two damped modes out of phase, as αv goes from 0 to −60 with αu = 1. With more damping in the slower mode the circle bends into the right half plane.")
        .setting("Eq. (3-12)")
        .assumed("wu = 1, wv = 1.2 rad/s; damping ratios 0.3 and 0.3, 0.3 and 0.05");
    let mut charts = Vec::new();
    for pair in &PAIRS_3_15 {
        let locus = pair.locus()?;
        charts.push(pair.chart(&locus));
        content = pair.compare(content, &locus);
    }
    Ok(content.row(400.0, charts))
}

const DAMPINGS_3_16: [(f64, Colour); 6] = [
    (0.0, INK),
    (0.05, BLUE),
    (0.1, GREEN),
    (0.15, PURPLE),
    (0.2240, VERMILION),
    (0.3, ORANGE),
];

/// Eq. (3-15) with the same damping ratio of u and v.
fn eq_3_15(zeta: f64) -> Model {
    Model::modes(&[
        ModeOf("R", 0.0, 1.0, 0.0),
        ModeOf("u", 0.9, -2.0, zeta),
        ModeOf("v", 1.1, 1.0, zeta),
    ])
}

/// The largest Re s/|s| of the complex zeros. Without damping they are symmetric: |Re s|/|s|.
fn furthest_right(locus: &Locus, is_damped: bool) -> f64 {
    let zeros = locus.tracks.iter().flatten().flatten();
    let complex = zeros.filter(|s| s.im.abs() > 1e-3 * s.norm());
    let ratios = complex.map(|s| {
        if is_damped {
            s.re / s.norm()
        } else {
            s.re.abs() / s.norm()
        }
    });
    ratios.fold(f64::NEG_INFINITY, f64::max)
}

pub(in super::super) fn fig_3_16(_: &Runs) -> Result<Content, FigureError> {
    let mut chart = plane("", (-2.4, 2.4), (0.0, 2.2));
    let mut content = Content::new("Migration of the zeros with different damping ratios of the two close modes. With growing damping all loci move to the left.")
        .setting("Eq. (3-15), wu = 0.9, wv = 1.1 rad/s, |αu/αv| = 2 with αu < 0 < αv; αR = 1 over αv from 1e-5 to 1e5")
        .assumed("damping ratios 0, 0.05, 0.1, 0.15, 0.2240, 0.3");
    let mut largest = Vec::new();
    for (zeta, colour) in DAMPINGS_3_16 {
        let (plane, part, option) = if zeta == 0.0 {
            (LocusPlane::Undamped, Part::Upper, "")
        } else {
            (LocusPlane::Damped, Part::Damped, "--damped ")
        };
        let model = eq_3_15(zeta);
        let locus = locus(&model.varied(KEY_R)?, plane, &geometric(1e5, 1e-5, 401))?;
        chart = tracks(
            chart,
            &format!("ζ = {zeta}"),
            Pen::solid(colour),
            &locus,
            part,
        );
        largest.push(furthest_right(&locus, zeta > 0.0));
        let range = format!("{option}--vary {KEY_R} --from 1e5 --to 1e-5 --count 1001");
        content = content.command(model.command("model locus", &range));
    }
    let falling = largest.windows(2).all(|pair| pair[1] < pair[0]);
    let words: Vec<String> = largest.iter().map(|ratio| signed(*ratio, 4)).collect();
    let poles = vec![(0.0, 0.9), (0.0, 1.1)];
    let chart = chart.points("poles without damping", INK, Symbol::Cross, poles);
    let content = content.row(420.0, [chart]).compare(Comparison::holds(
        "largest Re s/|s| of the complex zeros, ζ = 0 to 0.3",
        "moves to the left as the damping grows",
        falling,
        &words.join(", "),
    ));
    Ok(compare_critical_damping(content).command("bench model critical-damping"))
}

fn compare_critical_damping(content: Content) -> Content {
    let (eta, kappa) = (0.9 / 1.1, 2.0);
    let critical = critical_damping(eta, kappa).unwrap_or(f64::NAN);
    let touching = touching_damping(eta, kappa).unwrap_or(f64::NAN);
    let what = "damping ratio at which the locus just touches the imaginary axis";
    content
        .compare(
            Comparison::number("critical damping ratio, Eq. (3-16)", 0.2240, 4, critical, "")
                .remark("the value of Eq. (3-16) for the printed parameters"),
        )
        .compare(Comparison::unprinted(what, signed(touching, 6)).remark(
            "at the damping of Eq. (3-16) the locus still crosses the axis, by 0.05 % of its frequency",
        ))
}
