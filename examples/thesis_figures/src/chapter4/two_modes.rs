//! Two modes and a remainder: which residues make CNMP zeros.

use super::super::bode::{Curve, bode};
use super::super::content::signed;
use super::super::model::{ModeOf, Model, even, geometric, kinds, response};
use super::super::plane::locus;
use super::super::{Comparison, Content, FigureError, Runs};
use super::W;
use bench::model::zeros::{
    Crossing, LocusPlane, ModalSum, ModalTerm, Sequence, critical_residues, critical_sums,
};
use bench::report::colours::{BLUE, GREEN, GREY, INK, PURPLE, VERMILION};
use bench::report::{Chart, Pen, Scale, Symbol};

/// Modes u and v of the example of section 4.2.2: wu^2 = 1, wv^2 = 2, residues -1 and 1.
fn example() -> (ModalTerm, ModalTerm) {
    (
        ModalTerm::undamped(1.0, -1.0),
        ModalTerm::undamped(2f64.sqrt(), 1.0),
    )
}

/// N(x) of Eq. (4-3) at x = s^2.
fn parabola(residue_r: f64, x: f64) -> f64 {
    residue_r * (x + 1.0) * (x + 2.0) - x * (x + 2.0) + x * (x + 1.0)
}

pub(crate) fn fig_4_2(_: &Runs) -> Result<Content, FigureError> {
    let (u, v) = example();
    let [low, high] = critical_residues(0.0, &u, &v).unwrap_or([f64::NAN; 2]);
    let [b21, b22] = critical_sums(0.0, &u, &v).unwrap_or([f64::NAN; 2]);
    let axes = |heading: &str| {
        Chart::new(
            heading,
            Scale::linear("x = s² (rad²/s²)").within(-3.0, 3.0),
            Scale::linear("N(x)").within(-2.0, 4.0),
        )
        .line("", Pen::solid(GREY).thin(), vec![(-3.0, 0.0), (3.0, 0.0)])
    };
    let curve = |residue: f64| {
        even(-3.0, 3.0, 301)
            .into_iter()
            .map(|x| (x, parabola(residue, x)))
            .collect::<Vec<_>>()
    };
    let marked = |chart: Chart| {
        chart
            .points("", INK, Symbol::Dot, vec![(-1.0, 1.0), (-2.0, 2.0)])
            .text((-1.0, 1.0), (-14.0, 14.0), "Pu")
            .text((-2.0, 2.0), (16.0, -8.0), "Pv")
    };
    let mut a = axes("(a) Different values of αR");
    let mut content = Content::new("The numerator N(x) of Eq. (4-3): a parabola through two points Pu, Pv that do not depend on αR. Without a crossing of the horizontal line the zeros are CMP-CNMP.")
        .setting("αu = −1, αv = 1 1/kg, wu² = 1, wv² = 2 rad²/s²")
        .assumed("αR = −1, 0.1, 2 and 10 1/kg in (a); the thesis's values are lost with the figure");
    for (residue, pen) in [
        (-1.0, Pen::dotted(PURPLE)),
        (0.1, Pen::dashed(BLUE)),
        (2.0, Pen::solid(VERMILION)),
        (10.0, Pen::solid(GREEN)),
    ] {
        a = a.line(&format!("αR = {}", signed(residue, 1)), pen, curve(residue));
        let sum = ModalSum::new(vec![ModalTerm::undamped(0.0, residue), u, v], 0.0)?;
        content = content.compare(Comparison::unprinted(
            &format!("zeros, αR = {}", signed(residue, 1)),
            kinds(&sum.undamped_zeros()?),
        ));
    }
    let b = axes("(b) Where zeros meet")
        .line(
            &format!("αR1 = {}", signed(low, 4)),
            Pen::dashed(BLUE),
            curve(low),
        )
        .line(
            &format!("αR2 = {}", signed(high, 4)),
            Pen::dashed(VERMILION),
            curve(high),
        );
    let model = Model::modes(&[
        ModeOf("R", 0.0, 1.0, 0.0),
        ModeOf("u", 1.0, -1.0, 0.0),
        ModeOf("v", 2f64.sqrt(), 1.0, 0.0),
    ]);
    let key = "plant.modes.R.residue_per_kg";
    let locus = locus(
        &model.varied(key)?,
        LocusPlane::Undamped,
        &geometric(0.01, 100.0, 121),
    )?;
    let met: Vec<f64> = locus
        .changes
        .iter()
        .filter(|change| {
            matches!(
                change.crossing,
                Crossing::ImaginaryAxis | Crossing::RealAxis
            )
        })
        .map(|change| change.value)
        .collect();
    for (name, formula, found) in [("αR1", low, met.first()), ("αR2", high, met.get(1))] {
        let found = found.copied().unwrap_or(f64::NAN);
        content = content.compare(
            Comparison::within(
                &format!("{name} by Eq. (4-5), and by the locus of the zeros"),
                formula,
                6,
                found,
                "1/kg",
                1e-9 * formula,
            )
            .remark("printed: the equation"),
        );
    }
    let sums = format!("{} and {}", signed(b21, 6), signed(b22, 6));
    Ok(content
        .row(320.0, [marked(a), marked(b)])
        .compare(Comparison::holds(
            "b2 by Eq. (4-6) = αR + αu + αv",
            "equal",
            (b21 - low).abs() < 1e-12 && (b22 - high).abs() < 1e-12 * high,
            &sums,
        ))
        .command(model.command("model locus", &format!("--vary {key} --from 0.01 --to 100"))))
}

pub(crate) fn fig_4_4(_: &Runs) -> Result<Content, FigureError> {
    let mut content = Content::new("Sizes of mode R and of two close modes u and v: as their frequencies approach each other, the two crossings Z1 and Z2 of G with zero move together and vanish.")
        .setting("Eq. (4-1) with alternating signs")
        .assumed("αR = 1, αu = −0.02, αv = 0.02 1/kg, wu = 10 rad/s, wv = 11 (a) and 10.2 rad/s (b); the sum with a damping ratio of 0.0002");
    let (mut gains, mut phases) = (Vec::new(), Vec::new());
    for (heading, fast, printed, expected) in [
        ("(a) Dual MMP", 11.0, "[R]-[u]-[R]-[v]", "dual MMP"),
        ("(b) CMP-CNMP", 10.2, "[R]-[u]-[v]", "CMP-CNMP"),
    ] {
        let terms = |zeta: f64| {
            vec![
                ModalTerm::undamped(0.0, 1.0),
                ModalTerm {
                    omega_rad_s: 10.0,
                    damping_ratio: zeta,
                    residue_per_kg: -0.02,
                },
                ModalTerm {
                    omega_rad_s: fast,
                    damping_ratio: zeta,
                    residue_per_kg: 0.02,
                },
            ]
        };
        let (undamped, damped) = (
            ModalSum::new(terms(0.0), 0.0)?,
            ModalSum::new(terms(0.0002), 0.0)?,
        );
        let g = Curve::new("G", Pen::solid(INK), response(&damped, 9.0, 12.0)?);
        let (gain, phase) = bode(heading, W, "Size (m/N)", &[g]);
        let over = geometric(9.0, 12.0, 1500);
        let part = |index: usize| {
            over.iter()
                .map(|w| (*w, undamped.terms()[index].part(*w).abs()))
                .collect::<Vec<_>>()
        };
        let zeros: Vec<(f64, f64)> = undamped
            .undamped_zeros()?
            .iter()
            .filter(|zero| zero.s.re == 0.0 && zero.s.im > 0.0)
            .map(|zero| (zero.s.im, 1.0 / zero.s.im.powi(2)))
            .collect();
        let mut gain = Chart {
            y: gain.y.clone().within(1e-4, 1.0),
            ..gain
        }
        .line("mode R", Pen::dashed(GREEN), part(0))
        .line("mode u", Pen::dashed(BLUE), part(1))
        .line("mode v", Pen::dashed(VERMILION), part(2));
        for (name, at) in ["Z1", "Z2"].iter().zip(&zeros) {
            gain = gain
                .points("", INK, Symbol::Ring, vec![*at])
                .text(*at, (0.0, -14.0), name);
        }
        gains.push(gain);
        phases.push(phase);
        let model = Model::modes(&[
            ModeOf("R", 0.0, 1.0, 0.0),
            ModeOf("u", 10.0, -0.02, 0.0),
            ModeOf("v", fast, 0.02, 0.0),
        ]);
        content = content
            .compare(Comparison::words(
                &format!("{heading}: sequence"),
                printed,
                &Sequence::of(&undamped)?.to_string(),
            ))
            .compare(Comparison::words(
                &format!("{heading}: zeros"),
                expected,
                &kinds(&undamped.undamped_zeros()?),
            ))
            .command(model.command("model sequence", ""));
    }
    Ok(content.row(240.0, gains).row(170.0, phases))
}
