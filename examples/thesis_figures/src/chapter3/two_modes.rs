//! Figs 3-2 to 3-6 and 3-8: two modes.

use super::super::bode::{Curve, bode, nyquist, origin};
use super::super::content::signed;
use super::super::model::{ModeOf, Model, even, kinds, response};
use super::super::plane::{Part, locus, plane, tracks};
use super::super::{Comparison, Content, FigureError, Runs};
use super::{W, dense, initial, part, sequence, step, step_chart, sum, zero_line};
use bench_plant::zeros::{Locus, LocusPlane, ModalSum, ZeroKind, phase_drop_deg};
use bench_report::colours::{BLUE, Colour, GREEN, INK, PURPLE, VERMILION};
use bench_report::{Chart, Pen, Scale, Symbol};

/// A range of the residue of mode v, with its name and what it is expected to give.
type Segment = (&'static str, f64, f64, Colour, &'static str);

/// Values at equal steps of the arctangent: dense around 0, far at the ends.
fn tangents(from: f64, to: f64) -> Vec<f64> {
    even(from.atan(), to.atan(), 121)
        .into_iter()
        .map(f64::tan)
        .collect()
}

/// Frequency of the zero over the residue.
fn sizes(locus: &Locus) -> Vec<(f64, f64)> {
    let size = |(value, s): (&f64, &Option<nalgebra::Complex<f64>>)| {
        (*value, s.map_or(f64::NAN, |s| s.norm()))
    };
    locus.tracks.first().map_or(Vec::new(), |track| {
        locus.values.iter().zip(track).map(size).collect()
    })
}

/// Zeros of a mode u and a mode v at 10 rad/s as the residue of v varies.
fn migration(omega_u: f64, segments: &[Segment], content: Content) -> Result<Content, FigureError> {
    let model = Model::modes(&[ModeOf("u", omega_u, 1.0, 0.0), ModeOf("v", 10.0, 1.0, 0.0)]);
    let key = "plant.modes.v.residue_per_kg";
    let varied = model.varied(key)?;
    let mut a = plane("(a) Locus of the zeros", (-22.0, 22.0), (-2.0, 24.0));
    let mut b = Chart::new(
        "(b) Frequency of the zeros over the residue",
        Scale::linear("αv (1/kg)").within(-8.0, 4.0),
        Scale::linear("|s| of the zero (rad/s)").within(0.0, 24.0),
    );
    let mut content =
        content.command(model.command("model locus", &format!("--vary {key} --from -8 --to 4")));
    for (name, from, to, colour, expected) in segments {
        let pen = Pen {
            width: 3.0,
            ..Pen::solid(*colour)
        };
        let locus = locus(&varied, LocusPlane::Undamped, &tangents(*from, *to))?;
        a = tracks(a, name, pen, &locus, Part::Upper);
        b = b.line("", pen, sizes(&locus));
        let middle = if *from < -20.0 {
            2.0 * to
        } else if *to > 20.0 {
            1.0
        } else {
            0.5 * (from + to)
        };
        let computed = varied.sum(middle)?.undamped_zeros()?;
        content = content.compare(
            Comparison::text(&format!("zeros in {name}"), expected, &kinds(&computed))
                .remark(&format!("computed at αv = {}", signed(middle, 2))),
        );
    }
    let poles = if omega_u > 0.0 {
        vec![(0.0, omega_u), (0.0, 10.0)]
    } else {
        vec![(0.0, 0.0), (0.0, 10.0)]
    };
    Ok(content.row(360.0, [a.points("poles", INK, Symbol::Cross, poles), b]))
}

pub(in super::super) fn fig_3_2(_: &Runs) -> Result<Content, FigureError> {
    let segments: [Segment; 3] = [
        ("I–III: αv > 0", 1e-4, 500.0, BLUE, "MMP"),
        ("I–II: −αu < αv < 0", -0.9999, -1e-4, GREEN, "MMP"),
        ("II–III: αv < −αu", -500.0, -1.0001, VERMILION, "RMP-RNMP"),
    ];
    let content = Content::new("Migration of the zeros of a double integrator and a mode: on the axes of the plane, and their frequency over the residue of mode v.")
        .setting("Eq. (3-3)")
        .assumed("αu = 1 1/kg, wv = 10 rad/s");
    let content = migration(0.0, &segments, content)?;
    Ok(content.compare(Comparison::unprinted(
        "points",
        "I: αv = 0, the zero at wv; II: αv = −αu, at infinity; III: αv = ±∞, at the origin",
    )))
}

pub(in super::super) fn fig_3_8(_: &Runs) -> Result<Content, FigureError> {
    let segments: [Segment; 4] = [
        ("I–IV: αv > 0", 1e-4, 500.0, BLUE, "MMP"),
        ("I–II: −αu < αv < 0", -0.9999, -1e-4, GREEN, "MMP"),
        (
            "II–III: −4 αu < αv < −αu",
            -3.9999,
            -1.0001,
            VERMILION,
            "RMP-RNMP",
        ),
        ("III–IV: αv < −4 αu", -500.0, -4.0001, PURPLE, "MMP"),
    ];
    let content = Content::new("Migration of the zeros of two modes: on the axes of the plane, and their frequency over the residue of mode v.")
        .setting("Eq. (3-5); (wv/wu)^2 = 4")
        .assumed("αu = 1 1/kg, wu = 5 rad/s, wv = 10 rad/s");
    migration(5.0, &segments, content)
}

/// The sizes of a double integrator and of a mode with their sum, and the phase of the sum, with the frequency of the zero.
fn decomposed(heading: &str, residue: f64) -> Result<((Chart, Chart), f64), FigureError> {
    let over = dense(1.0, 100.0, &[10.0]);
    let damped = sum(&[(0.0, 0.0, 1.0), (10.0, 0.001, residue)])?;
    let g = Curve::new("G", Pen::solid(INK), response(&damped, 1.0, 100.0)?);
    let (gain, phase) = bode(heading, W, "Size (m/N)", &[g]);
    let zeros = sum(&[(0.0, 0.0, 1.0), (10.0, 0.0, residue)])?.undamped_zeros()?;
    let mut upper = zeros
        .iter()
        .filter(|zero| zero.kind == ZeroKind::Mmp && zero.s.im > 0.0);
    let zero = upper.next().map_or(f64::NAN, |zero| zero.s.im);
    let y = gain.y.clone().within(1e-6, 1e2);
    let gain = Chart { y, ..gain }
        .line("mode u", Pen::dashed(BLUE), part(0.0, 1.0, &over))
        .line("mode v", Pen::dashed(VERMILION), part(10.0, residue, &over))
        .points("MMP zeros", GREEN, Symbol::Ring, part(0.0, 1.0, &[zero]));
    Ok(((gain, phase), zero))
}

pub(in super::super) fn fig_3_3(_: &Runs) -> Result<Content, FigureError> {
    let mut content = Content::new("A double integrator u and a mode v, in phase and out of phase: sizes of both and of their sum G, and the phase of G. Where both have the same size and opposite signs there is a pair of MMP zeros.")
        .setting("Eq. (3-3)")
        .assumed("αu = 1 1/kg, wv = 10 rad/s, αv = 0.5 (a) and −0.5 1/kg (b); the sum with a damping ratio of 0.001 in mode v");
    let (mut gains, mut phases) = (Vec::new(), Vec::new());
    for (heading, residue, place) in [
        ("(a) In phase", 0.5, "(0, wv)"),
        ("(b) Out of phase", -0.5, "(wv, ∞)"),
    ] {
        let ((gain, phase), zero) = decomposed(heading, residue)?;
        gains.push(gain);
        phases.push(phase);
        let found = if zero < 10.0 { "(0, wv)" } else { "(wv, ∞)" };
        let what = format!("MMP zeros, αv = {}", signed(residue, 1));
        let remark = format!("at {} rad/s", signed(zero, 4));
        let model = Model::modes(&[
            ModeOf("u", 0.0, 1.0, 0.0),
            ModeOf("v", 10.0, residue, 0.001),
        ]);
        content = content
            .compare(Comparison::text(&what, place, found).remark(&remark))
            .command(model.command("model modes", ""));
    }
    Ok(content.row(240.0, gains).row(150.0, phases))
}

pub(in super::super) fn fig_3_4(_: &Runs) -> Result<Content, FigureError> {
    let over = dense(1.0, 100.0, &[10.0]);
    let mut chart = Chart::new(
        "",
        Scale::logarithmic(W).within(1.0, 100.0),
        Scale::logarithmic("Size of the modes (m/N)").within(1e-5, 1e2),
    )
    .line("mode u", Pen::solid(INK), part(0.0, 1.0, &over))
    .line("mode v, MMP", Pen::dashed(BLUE), part(10.0, -0.5, &over))
    .line(
        "mode v, RMP-RNMP",
        Pen::solid(VERMILION),
        part(10.0, -5.0, &over),
    );
    // Equal sizes: 1/w^2 = |r|/|w^2 - wv^2|.
    let (p1, p2, p3) = (
        10.0 / 1.5f64.sqrt(),
        10.0 / 0.5f64.sqrt(),
        10.0 / 6.0f64.sqrt(),
    );
    for (name, w, aside) in [
        ("P1", p1, (-14.0, 12.0)),
        ("P2", p2, (14.0, -10.0)),
        ("P3", p3, (-14.0, 12.0)),
    ] {
        let at = (w, 1.0 / (w * w));
        chart = chart
            .points("", INK, Symbol::Dot, vec![at])
            .text(at, aside, name);
    }
    let mut content = Content::new("Sizes of a double integrator u and of a mode v with a small and a large residue. P1 and P3: mode v takes over in the same direction; P2: mode u takes back over in the opposite direction, where MMP zeros are.")
        .setting("Eq. (3-3); mode u is negative at all frequencies, mode v negative below and positive above its resonance turned by its residue")
        .assumed("αu = 1 1/kg, wv = 10 rad/s, αv = −0.5 (MMP) and −5 1/kg (RMP-RNMP), those of Eq. (3-4)")
        .row(340.0, [chart]);
    for (residue, printed, expected) in
        [(-0.5, "[u]-[v]-[u]", "MMP"), (-5.0, "[u]-[v]", "RMP-RNMP")]
    {
        let sum = sum(&[(0.0, 0.0, 1.0), (10.0, 0.0, residue)])?;
        content = content
            .compare(Comparison::text(
                &format!("sequence, αv = {}", signed(residue, 1)),
                printed,
                &sequence(&sum)?,
            ))
            .compare(Comparison::text(
                &format!("zeros, αv = {}", signed(residue, 1)),
                expected,
                &kinds(&sum.undamped_zeros()?),
            ))
            .command(
                Model::modes(&[ModeOf("u", 0.0, 1.0, 0.0), ModeOf("v", 10.0, residue, 0.0)])
                    .command("model sequence", ""),
            );
    }
    Ok(content)
}

/// Eq. (3-4): damping ratios of 0.001.
fn eq_3_4(residue: f64) -> Result<ModalSum, FigureError> {
    sum(&[(1.0, 0.001, 1.0), (10.0, 0.001, residue)])
}

/// One column of Fig 3-5.
struct Column {
    /// Letters of the Bode plot and of the step response.
    letters: [char; 2],
    residue: f64,
    colour: Colour,
    /// Printed phase lag at high frequency in degrees.
    lag_deg: f64,
    /// Printed: whether there is initial undershoot.
    undershoot: &'static str,
}

const COLUMNS_3_5: [Column; 2] = [
    Column {
        letters: ['a', 'c'],
        residue: -0.5,
        colour: BLUE,
        lag_deg: 180.0,
        undershoot: "no",
    },
    Column {
        letters: ['b', 'd'],
        residue: -5.0,
        colour: VERMILION,
        lag_deg: 360.0,
        undershoot: "yes",
    },
];

impl Column {
    fn name(&self) -> String {
        format!("αv = {}", signed(self.residue, 1))
    }

    fn curve(&self) -> Result<Curve, FigureError> {
        let points = response(&eq_3_4(self.residue)?, 0.1, 100.0)?;
        Ok(Curve::new("G", Pen::solid(self.colour), points))
    }

    /// Gain, phase, step response, and its beginning.
    fn charts(&self) -> Result<[Chart; 4], FigureError> {
        let (sum, pen, name) = (eq_3_4(self.residue)?, Pen::solid(self.colour), self.name());
        let [first, second] = self.letters;
        let (gain, phase) = bode(
            &format!("({first}) {name}"),
            W,
            "|G| (m/N)",
            &[self.curve()?],
        );
        let whole = step_chart(&format!("({second}) Step response, {name}"), 10.0);
        let start = zero_line(step_chart(&format!("({second}) its beginning"), 0.6));
        Ok([
            gain,
            phase,
            whole.line("", pen, step(&sum, 10.0, 2001)),
            start.line("", pen, step(&sum, 0.6, 601)),
        ])
    }

    fn compare(&self, content: Content) -> Result<Content, FigureError> {
        let (sum, name) = (eq_3_4(self.residue)?, self.name());
        let last = self
            .curve()?
            .phase_deg()
            .last()
            .map_or(f64::NAN, |point| point.1);
        let has_undershoot = initial(&sum).has_undershoot();
        let found = if has_undershoot { "yes" } else { "no" };
        let (phase, undershoot) = (
            format!("phase at high frequency, {name}"),
            format!("initial undershoot, {name}"),
        );
        let model = Model::modes(&[
            ModeOf("u", 1.0, 1.0, 0.001),
            ModeOf("v", 10.0, self.residue, 0.001),
        ]);
        Ok(content
            .compare(
                Comparison::within(&phase, -self.lag_deg, 0, last, "deg", 1.0)
                    .remark("at 100 rad/s, with damping"),
            )
            .compare(Comparison::text(&undershoot, self.undershoot, found))
            .compare(Comparison::unprinted(
                &format!("zeros, {name}"),
                kinds(&sum.undamped_zeros()?),
            ))
            .command(model.command("model step", "")))
    }
}

pub(in super::super) fn fig_3_5(_: &Runs) -> Result<Content, FigureError> {
    let mut content = Content::new(
        "The MMP and the RMP-RNMP case: Bode plots, step responses, and their beginning.",
    )
    .setting("Eq. (3-4) with αv = −0.5 and −5 1/kg, damping ratio 0.001");
    let mut rows: [Vec<Chart>; 4] = Default::default();
    for column in &COLUMNS_3_5 {
        for (row, chart) in rows.iter_mut().zip(column.charts()?) {
            row.push(chart);
        }
        content = column.compare(content)?;
    }
    let heights = [200.0, 140.0, 180.0, 160.0];
    Ok(heights
        .into_iter()
        .zip(rows)
        .fold(content, |content, (height, row)| content.row(height, row)))
}

pub(in super::super) fn fig_3_6(_: &Runs) -> Result<Content, FigureError> {
    let chart = |heading: &str, residue: f64, colour: Colour, size: f64| {
        let sum = sum(&[(0.0, 0.0, 1.0), (10.0, 0.1, residue)])?;
        let curve = Curve::new("", Pen::solid(colour), response(&sum, 3.0, 300.0)?);
        let last = curve.points.last().map_or(f64::NAN, |point| point.1.re);
        let chart = origin(nyquist(
            heading,
            (-1.35 * size, 0.65 * size),
            (-0.5 * size, 1.5 * size),
            "G (m/N)",
        ))
        .directed("", curve.pen, curve.polar());
        Ok::<_, FigureError>((chart, last))
    };
    let (a, end_a) = chart("MMP case, [u]-[v]-[u]", -0.5, BLUE, 0.035)?;
    let (b, end_b) = chart("RMP-RNMP case, [u]-[v]", -5.0, VERMILION, 0.26)?;
    let side = |end: f64| if end < 0.0 { "left" } else { "right" };
    let zeros = |residue: f64| {
        sum(&[(0.0, 0.0, 1.0), (10.0, 0.0, residue)])?
            .undamped_zeros()
            .map_err(FigureError::from)
    };
    Ok(Content::new("Nyquist plots of a double integrator and a mode, positive frequencies only, with rising frequency along the arrows.")
        .setting("Eq. (3-3)")
        .assumed("αu = 1 1/kg, wv = 10 rad/s, αv = −0.5 and −5 1/kg; damping ratio 0.1 of mode v, so that circle and offset are seen at one scale")
        .row(400.0, [a, b])
        .compare(Comparison::text("the circle ends beside the origin, MMP", "left", side(end_a)))
        .compare(Comparison::text("the circle ends beside the origin, RMP-RNMP", "right", side(end_b)))
        .compare(Comparison::number("phase drop, MMP", 0.0, 0, phase_drop_deg(&zeros(-0.5)?), "deg"))
        .compare(Comparison::number("phase drop, RMP-RNMP", 180.0, 0, phase_drop_deg(&zeros(-5.0)?), "deg"))
        .command(Model::modes(&[ModeOf("u", 0.0, 1.0, 0.0), ModeOf("v", 10.0, -0.5, 0.1)]).command("model modes", ""))
        .command(Model::modes(&[ModeOf("u", 0.0, 1.0, 0.0), ModeOf("v", 10.0, -5.0, 0.1)]).command("model modes", "")))
}
