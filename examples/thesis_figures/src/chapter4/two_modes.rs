//! Two modes and a remainder: which residues make CNMP zeros.

use super::super::bode::{Curve, bode};
use super::super::content::signed;
use super::super::model::{ModeOf, Model, even, geometric, kinds, response};
use super::super::plane::locus;
use super::super::{Comparison, Content, FigureError, Runs};
use super::W;
use bench_plant::zeros::{Crossing, LocusPlane, ModalSum, ModalTerm};
use bench_report::colours::{BLUE, GREEN, GREY, INK, PURPLE, VERMILION};
use bench_report::{Chart, Pen, Scale, Symbol};
use bench_thesis::{Sequence, critical_residues, critical_sums};

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

/// Axes of N(x) with its zero line.
fn axes(heading: &str) -> Chart {
    Chart::new(
        heading,
        Scale::linear("x = s² (rad²/s²)").within(-3.0, 3.0),
        Scale::linear("N(x)").within(-2.0, 4.0),
    )
    .line("", Pen::solid(GREY).thin(), vec![(-3.0, 0.0), (3.0, 0.0)])
}

fn add_parabola(chart: Chart, name: &str, pen: Pen, residue_r: f64) -> Chart {
    let points = even(-3.0, 3.0, 301).into_iter();
    let points = points.map(|x| (x, parabola(residue_r, x)));
    chart.line(name, pen, points.collect())
}

/// Adds Pu and Pv.
fn add_fixed_points(chart: Chart) -> Chart {
    chart
        .points("", INK, Symbol::Dot, vec![(-1.0, 1.0), (-2.0, 2.0)])
        .text((-1.0, 1.0), (-14.0, 14.0), "Pu")
        .text((-2.0, 2.0), (16.0, -8.0), "Pv")
}

/// Residues of mode R in Fig 4-2 (a).
const RESIDUES_4_2: [(f64, Pen); 4] = [
    (-1.0, Pen::dotted(PURPLE)),
    (0.1, Pen::dashed(BLUE)),
    (2.0, Pen::solid(VERMILION)),
    (10.0, Pen::solid(GREEN)),
];

/// The values of αR at which the zeros of the example meet, by the locus, with the model that has them.
fn meetings_by_locus() -> Result<(Model, Vec<f64>), FigureError> {
    let model = Model::modes(&[
        ModeOf("R", 0.0, 1.0, 0.0),
        ModeOf("u", 1.0, -1.0, 0.0),
        ModeOf("v", 2f64.sqrt(), 1.0, 0.0),
    ]);
    let values = geometric(0.01, 100.0, 121);
    let locus = locus(&model.varied(KEY_R)?, LocusPlane::Undamped, &values)?;
    let meets = |c: Crossing| matches!(c, Crossing::ImaginaryAxis | Crossing::RealAxis);
    let changes = locus.changes.iter().filter(|change| meets(change.crossing));
    Ok((model, changes.map(|change| change.value).collect()))
}

const KEY_R: &str = "plant.modes.R.residue_per_kg";

pub(crate) fn fig_4_2(_: &Runs) -> Result<Content, FigureError> {
    let (u, v) = example();
    let [low, high] = critical_residues(0.0, &u, &v).unwrap_or([f64::NAN; 2]);
    let [b21, b22] = critical_sums(0.0, &u, &v).unwrap_or([f64::NAN; 2]);
    let mut a = axes("(a) Different values of αR");
    let mut content = Content::new("The numerator N(x) of Eq. (4-3): a parabola through two points Pu, Pv that do not depend on αR. Where it does not cross the horizontal line, the zeros are CMP-CNMP.")
        .setting("αu = −1, αv = 1 1/kg, wu² = 1, wv² = 2 rad²/s²")
        .assumed("αR = −1, 0.1, 2 and 10 1/kg in (a); the thesis's values are lost with the figure");
    for (residue, pen) in RESIDUES_4_2 {
        let name = signed(residue, 1);
        a = add_parabola(a, &format!("αR = {name}"), pen, residue);
        let sum = ModalSum::new(vec![ModalTerm::undamped(0.0, residue), u, v], 0.0)?;
        content = content.compare(Comparison::unprinted(
            &format!("zeros, αR = {name}"),
            kinds(&sum.undamped_zeros()?),
        ));
    }
    let mut b = axes("(b) Where zeros meet");
    let (model, met) = meetings_by_locus()?;
    let pens = [Pen::dashed(BLUE), Pen::dashed(VERMILION)];
    for (k, (name, formula)) in [("αR1", low), ("αR2", high)].into_iter().enumerate() {
        b = add_parabola(
            b,
            &format!("{name} = {}", signed(formula, 4)),
            pens[k],
            formula,
        );
        let what = format!("{name} by Eq. (4-5), and by the locus of the zeros");
        let found = met.get(k).copied().unwrap_or(f64::NAN);
        content = content.compare(
            Comparison::within(&what, formula, 6, found, "1/kg", 1e-9 * formula)
                .remark("printed: the equation"),
        );
    }
    Ok(content
        .row(320.0, [add_fixed_points(a), add_fixed_points(b)])
        .compare(Comparison::holds(
            "b2 by Eq. (4-6) = αR + αu + αv",
            "equal",
            (b21 - low).abs() < 1e-12 && (b22 - high).abs() < 1e-12 * high,
            &format!("{} and {}", signed(b21, 6), signed(b22, 6)),
        ))
        .command(model.command(
            "model locus",
            &format!("--vary {KEY_R} --from 0.01 --to 100"),
        )))
}

/// Mode R and two close modes, v at `fast` rad/s.
fn close_modes(fast: f64, damping_ratio: f64) -> Result<ModalSum, FigureError> {
    let mode = |omega_rad_s, residue_per_kg| ModalTerm {
        omega_rad_s,
        damping_ratio,
        residue_per_kg,
    };
    let terms = vec![
        ModalTerm::undamped(0.0, 1.0),
        mode(10.0, -0.02),
        mode(fast, 0.02),
    ];
    Ok(ModalSum::new(terms, 0.0)?)
}

/// Bode plot of the sum with the sizes of its modes and the crossings of zero, Z1 and Z2.
fn decomposed(heading: &str, fast: f64) -> Result<(Chart, Chart), FigureError> {
    let (undamped, damped) = (close_modes(fast, 0.0)?, close_modes(fast, 0.0002)?);
    let g = Curve::new("G", Pen::solid(INK), response(&damped, 9.0, 12.0)?);
    let (gain, phase) = bode(heading, W, "Size (m/N)", &[g]);
    let over = geometric(9.0, 12.0, 1500);
    let part = |index: usize| {
        let size = |w: &f64| (*w, undamped.terms()[index].part(*w).abs());
        over.iter().map(size).collect::<Vec<_>>()
    };
    let y = gain.y.clone().within(1e-4, 1.0);
    let mut gain = Chart { y, ..gain }
        .line("mode R", Pen::dashed(GREEN), part(0))
        .line("mode u", Pen::dashed(BLUE), part(1))
        .line("mode v", Pen::dashed(VERMILION), part(2));
    let zeros = undamped.undamped_zeros()?;
    let on_axis = zeros
        .iter()
        .filter(|zero| zero.s.re == 0.0 && zero.s.im > 0.0);
    for (name, zero) in ["Z1", "Z2"].iter().zip(on_axis) {
        let at = (zero.s.im, 1.0 / zero.s.im.powi(2));
        gain = gain
            .points("", INK, Symbol::Ring, vec![at])
            .text(at, (0.0, -14.0), name);
    }
    Ok((gain, phase))
}

pub(crate) fn fig_4_4(_: &Runs) -> Result<Content, FigureError> {
    let mut content = Content::new("Sizes of mode R and of two close modes u and v: as their frequencies approach each other, the two frequencies Z1 and Z2 at which G is zero move together and vanish.")
        .setting("Eq. (4-1) with alternating signs")
        .assumed("αR = 1, αu = −0.02, αv = 0.02 1/kg, wu = 10 rad/s, wv = 11 (a) and 10.2 rad/s (b); the sum with a damping ratio of 0.0002");
    let (mut gains, mut phases) = (Vec::new(), Vec::new());
    for (heading, fast, printed, expected) in [
        ("(a) Dual MMP", 11.0, "[R]-[u]-[R]-[v]", "dual MMP"),
        ("(b) CMP-CNMP", 10.2, "[R]-[u]-[v]", "CMP-CNMP"),
    ] {
        let (gain, phase) = decomposed(heading, fast)?;
        gains.push(gain);
        phases.push(phase);
        let sum = close_modes(fast, 0.0)?;
        let (sequence, zeros) = (
            Sequence::of(&sum)?.to_string(),
            kinds(&sum.undamped_zeros()?),
        );
        let model = Model::modes(&[
            ModeOf("R", 0.0, 1.0, 0.0),
            ModeOf("u", 10.0, -0.02, 0.0),
            ModeOf("v", fast, 0.02, 0.0),
        ]);
        content = content
            .compare(Comparison::text(
                &format!("{heading}: sequence"),
                printed,
                &sequence,
            ))
            .compare(Comparison::text(
                &format!("{heading}: zeros"),
                expected,
                &zeros,
            ))
            .command(model.command("model sequence", ""));
    }
    Ok(content.row(240.0, gains).row(170.0, phases))
}
