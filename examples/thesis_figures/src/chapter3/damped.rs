//! Figs 3-15 and 3-16: zeros with damping.

use super::super::content::signed;
use super::super::model::{ModeOf, Model, even, geometric};
use super::super::plane::{Part, changes, locus, plane, tracks};
use super::super::{Comparison, Content, FigureError, Runs};
use bench::model::zeros::{
    Crossing, LocusPlane, ModalTerm, critical_damping, touching_damping, two_mode_break_points,
};
use bench::report::Pen;
use bench::report::Symbol;
use bench::report::colours::{BLUE, GREEN, INK, ORANGE, PURPLE, VERMILION};

pub(in super::super) fn fig_3_15(_: &Runs) -> Result<Content, FigureError> {
    let key = "plant.modes.v.residue_per_kg";
    let cases = [
        ("(a) Same damping ratios, 0.3", 0.3, 0.3, (-18.0, 3.0), 9.0),
        (
            "(b) Different ones: u 0.3, v 0.05",
            0.3,
            0.05,
            (-2.5, 5.5),
            3.4,
        ),
    ];
    let mut content = Content::new("Migration of the zeros of two damped modes out of phase, as αv goes from 0 to −60 with αu = 1. With more damping in the slower mode the circle bends into the right half plane.")
        .setting("Eq. (3-12)")
        .assumed("wu = 1, wv = 1.2 rad/s; damping ratios 0.3 and 0.3, 0.3 and 0.05");
    let mut charts = Vec::new();
    for (heading, zu, zv, re, im) in cases {
        let model = Model::modes(&[ModeOf("u", 1.0, 1.0, zu), ModeOf("v", 1.2, -0.5, zv)]);
        let values = even(-0.001f64.atan(), -60.0f64.atan(), 601)
            .into_iter()
            .map(f64::tan)
            .collect::<Vec<_>>();
        let locus = locus(&model.varied(key)?, LocusPlane::Damped, &values)?;
        let chart = plane(heading, re, (-im, im));
        let chart = changes(
            tracks(chart, "zeros", Pen::solid(VERMILION), &locus, Part::Damped),
            &locus,
        );
        let pole =
            |w: f64, zeta: f64, side: f64| (-zeta * w, side * w * (1.0 - zeta * zeta).sqrt());
        charts.push(chart.points(
            "poles",
            INK,
            Symbol::Cross,
            vec![
                pole(1.0, zu, 1.0),
                pole(1.2, zv, 1.0),
                pole(1.0, zu, -1.0),
                pole(1.2, zv, -1.0),
            ],
        ));
        let points = two_mode_break_points(
            &ModalTerm {
                omega_rad_s: 1.0,
                damping_ratio: zu,
                residue_per_kg: 1.0,
            },
            &ModalTerm {
                omega_rad_s: 1.2,
                damping_ratio: zv,
                residue_per_kg: -1.0,
            },
        );
        let mut met: Vec<f64> = locus
            .changes
            .iter()
            .filter(|change| change.crossing == Crossing::RealAxis)
            .map(|change| change.s.re)
            .collect();
        met.sort_by(|a, b| a.abs().total_cmp(&b.abs()));
        for (name, formula, locus) in ["Z1", "Z2"]
            .iter()
            .zip(points.unwrap_or([f64::NAN; 2]))
            .zip(met.iter().copied().chain([f64::NAN; 2]))
            .map(|((name, formula), met)| (name, formula, met))
        {
            content = content.compare(Comparison::within(&format!("{heading}: {name} by Eq. (3-14), and by the locus"), formula, 4, locus, "rad/s", 1e-4 * formula.abs()).remark("printed: the equation; to 1e-4 of it, as two zeros that meet come apart by the root of the rounding"));
        }
        content = content.command(model.command(
            "model locus",
            &format!("--damped --vary {key} --from -0.001 --to -60 --count 1001"),
        ));
    }
    Ok(content.row(400.0, charts))
}

pub(in super::super) fn fig_3_16(_: &Runs) -> Result<Content, FigureError> {
    let key = "plant.modes.R.residue_per_kg";
    let critical = critical_damping(0.9 / 1.1, 2.0).unwrap_or(f64::NAN);
    let touching = touching_damping(0.9 / 1.1, 2.0).unwrap_or(f64::NAN);
    let mut chart = plane("", (-2.4, 2.4), (0.0, 2.2));
    let dampings = [
        (0.0, INK),
        (0.05, BLUE),
        (0.1, GREEN),
        (0.15, PURPLE),
        (0.2240, VERMILION),
        (0.3, ORANGE),
    ];
    let mut content = Content::new("Migration of the zeros with different damping ratios of the two close modes. With growing damping all loci move to the left.")
        .setting("Eq. (3-15), wu = 0.9, wv = 1.1 rad/s, αu/αv = 2 in size with αu < 0 < αv; αR = 1 over αv from 1e-5 to 1e5")
        .assumed("damping ratios 0, 0.05, 0.1, 0.15, 0.2240, 0.3");
    let mut largest = Vec::new();
    for (zeta, colour) in dampings {
        let model = Model::modes(&[
            ModeOf("R", 0.0, 1.0, 0.0),
            ModeOf("u", 0.9, -2.0, zeta),
            ModeOf("v", 1.1, 1.0, zeta),
        ]);
        let plane_of = if zeta == 0.0 {
            LocusPlane::Undamped
        } else {
            LocusPlane::Damped
        };
        let part = if zeta == 0.0 {
            Part::Upper
        } else {
            Part::Damped
        };
        let locus = locus(&model.varied(key)?, plane_of, &geometric(1e5, 1e-5, 401))?;
        chart = tracks(
            chart,
            &format!("ζ = {zeta}"),
            Pen::solid(colour),
            &locus,
            part,
        );
        let complex = locus
            .tracks
            .iter()
            .flatten()
            .flatten()
            .filter(|s| s.im.abs() > 1e-3 * s.norm());
        let ratio = complex
            .map(|s| s.re.abs().copysign(if zeta == 0.0 { 1.0 } else { s.re }) / s.norm())
            .fold(f64::NEG_INFINITY, f64::max);
        largest.push(ratio);
        content = content.command(model.command(
            "model locus",
            &format!(
                "{}--vary {key} --from 1e5 --to 1e-5 --count 1001",
                if zeta == 0.0 { "" } else { "--damped " }
            ),
        ));
    }
    let falling = largest.windows(2).all(|pair| pair[1] < pair[0]);
    let words: Vec<String> = largest.iter().map(|ratio| signed(*ratio, 4)).collect();
    Ok(content
        .row(
            420.0,
            [chart.points(
                "poles without damping",
                INK,
                Symbol::Cross,
                vec![(0.0, 0.9), (0.0, 1.1)],
            )],
        )
        .compare(Comparison::holds(
            "largest Re s/|s| of the complex zeros, ζ = 0 to 0.3",
            "moves to the left as the damping grows",
            falling,
            &words.join(", "),
        ))
        .compare(
            Comparison::number(
                "critical damping ratio, Eq. (3-16)",
                0.2240,
                4,
                critical,
                "",
            )
            .remark("the value which Eq. (3-16) gives for the printed parameters"),
        )
        .compare(
            Comparison::unprinted(
                "damping ratio at which the locus just touches the imaginary axis",
                signed(touching, 6),
            )
            .remark(
                "at that of Eq. (3-16) the locus still passes the axis by 0.05 % of its frequency",
            ),
        )
        .command("bench model critical-damping"))
}
