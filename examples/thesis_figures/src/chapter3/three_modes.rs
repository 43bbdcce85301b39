//! Figs 3-9 to 3-14: a double integrator (or a slow mode) and two close modes.

use super::super::bode::{Curve, bode, critical, nyquist, origin};
use super::super::content::signed;
use super::super::model::{ModeOf, Model, geometric, kinds, response};
use super::super::plane::{Part, changes, locus, places, plane, tracks};
use super::super::{Comparison, Content, FigureError, Runs};
use super::{W, dense, initial, part, sequence, step, step_chart, sum, zero_line};
use bench_control::{ControllerText, continuous_response};
use bench_plant::zeros::{Crossing, Locus, LocusPlane, ModalSum};
use bench_report::colours::{BLUE, Colour, GREEN, INK, ORANGE, PURPLE, VERMILION};
use bench_report::{Chart, Pen, Scale, Symbol};

const KEY: &str = "plant.modes.R.residue_per_kg";

/// Eq. (3-7) with wu = 0.9 and wv = 1.1 rad/s and given residues of u and v; that of R varies.
fn pair(au: f64, av: f64) -> Model {
    Model::modes(&[
        ModeOf("R", 0.0, 1.0, 0.0),
        ModeOf("u", 0.9, au, 0.0),
        ModeOf("v", 1.1, av, 0.0),
    ])
}

/// The zeros depend on the ratios of the residues only: R from large to small is v from small to large.
fn ratios() -> Vec<f64> {
    geometric(1e4, 1e-4, 401)
}

pub(in super::super) fn fig_3_9(_: &Runs) -> Result<Content, FigureError> {
    let mut content = Content::new("Locus of the zeros as αv grows from 0 with a constant ratio αu/αv: solid for αv > 0 (the root locus of T), dashed for αv < 0 (the complementary root locus). First quadrant; the other three are its mirror images.")
        .setting("Eq. (3-7); αR = 1 and |αv| from 1e-4 to 1e4, which is the same as αv = ±1 and αR from 1e4 to 1e-4")
        .assumed("wu = 0.9, wv = 1.1 rad/s and six ratios αu/αv, one in each range between −∞, −(wv/wu)^2 = −1.49, −1, −(wu/wv)^2 = −0.67, 0 and one more");
    let mut charts = Vec::new();
    let mut is_confined = true;
    for (letter, ratio) in RATIOS_3_9 {
        let name = signed(ratio, 2);
        let heading = format!("({letter}) αu/αv = {name}");
        let mut chart = plane(&heading, (0.0, 2.0), (0.0, 2.0));
        for (sign, legend, pen) in [
            (1.0, "αv > 0", Pen::solid(VERMILION)),
            (-1.0, "αv < 0", Pen::dashed(BLUE)),
        ] {
            let model = pair(ratio * sign, sign);
            let locus = locus(&model.varied(KEY)?, LocusPlane::Undamped, &ratios())?;
            chart = changes(tracks(chart, legend, pen, &locus, Part::Quadrant), &locus);
            if has_complex_zeros(&locus) {
                is_confined &= ratio < 0.0 && sign > 0.0;
                let what = format!("({letter}) zeros meet, αu/αv = {name}");
                let range = format!("--vary {KEY} --from 1e4 --to 1e-4 --count 1001");
                content = content
                    .compare(Comparison::unprinted(&what, meetings(&locus, sign)))
                    .command(model.command("model locus", &range));
            }
        }
        charts.push(chart.points("poles", INK, Symbol::Cross, POLES_3_9.to_vec()));
    }
    let computed = if is_confined {
        "in no other case"
    } else {
        "in other cases too"
    };
    let expected = "only where αu < 0 and αv > 0";
    let second = charts.split_off(3);
    Ok(content
        .row(280.0, charts)
        .row(280.0, second)
        .compare(Comparison::holds(
            "CMP-CNMP zeros",
            expected,
            is_confined,
            computed,
        )))
}

/// Letter and αu/αv of each locus of Fig 3-9.
const RATIOS_3_9: [(&str, f64); 6] = [
    ("a", 2.0),
    ("b", -0.5),
    ("c", -0.85),
    ("d", -1.2),
    ("e", -2.0),
    ("f", 0.5),
];
const POLES_3_9: [(f64, f64); 3] = [(0.0, 0.9), (0.0, 1.1), (0.0, 0.0)];

fn has_complex_zeros(locus: &Locus) -> bool {
    let mut kinds = locus.changes.iter().flat_map(|c| [&c.before, &c.after]);
    kinds.any(|kinds| kinds.contains("CMP-CNMP"))
}

/// The values of αv at which zeros meet, with the zeros.
fn meetings(locus: &Locus, sign: f64) -> String {
    let changes = locus.changes.iter();
    let meetings =
        changes.filter(|c| matches!(c.crossing, Crossing::ImaginaryAxis | Crossing::RealAxis));
    let texts: Vec<String> = meetings
        .map(|c| {
            let (value, size) = (signed(sign / c.value, 4), signed(c.s.norm(), 4));
            format!("αv = {value} at {size}")
        })
        .collect();
    texts.join("; ")
}

pub(in super::super) fn fig_3_10(_: &Runs) -> Result<Content, FigureError> {
    let mut chart = plane("", (0.0, 3.3), (0.0, 2.1)).equal();
    let families: [(&str, Colour, &[f64]); 3] = [
        (
            "αu < 0, αv > 0",
            VERMILION,
            &[
                -0.1, -0.3, -0.5, -0.6, -0.67, -0.75, -0.85, -0.95, -1.05, -1.2, -1.5, -2.0, -3.0,
                -6.0,
            ],
        ),
        ("αu > 0, αv > 0", BLUE, &[0.1, 0.5, 2.0, 10.0]),
        ("αv < 0", GREEN, &[-0.3, -0.8, -1.3, -3.0, 0.5, 2.0]),
    ];
    for (name, colour, family) in families {
        let sign = if name == "αv < 0" { -1.0 } else { 1.0 };
        let mut name = name;
        for ratio in family {
            let locus = locus(
                &pair(ratio * sign, sign).varied(KEY)?,
                LocusPlane::Undamped,
                &geometric(1e5, 1e-5, 321),
            )?;
            chart = tracks(
                chart,
                name,
                Pen {
                    width: 1.1,
                    ..Pen::solid(colour)
                },
                &locus,
                Part::Quadrant,
            );
            name = "";
        }
    }
    let even = locus(
        &pair(-1.0, 1.0).varied(KEY)?,
        LocusPlane::Undamped,
        &geometric(1e5, 1e-5, 321),
    )?;
    chart = tracks(
        chart,
        "αu = −αv",
        Pen {
            width: 2.4,
            ..Pen::solid(INK)
        },
        &even,
        Part::Quadrant,
    );
    let complex = even
        .tracks
        .iter()
        .flatten()
        .flatten()
        .filter(|s| s.re.abs() > 1e-3 && s.im.abs() > 1e-3);
    let (low, high) = complex
        .map(|s| s.norm())
        .fold((f64::INFINITY, 0.0f64), |(low, high), r| {
            (low.min(r), high.max(r))
        });
    let chart = chart.points("poles", INK, Symbol::Cross, vec![(0.0, 0.9), (0.0, 1.1)]);
    Ok(Content::new("The family of the loci over αu/αv. First quadrant; the other three mirror it. Loci leave the axes for αu < 0 < αv only; for αu = −αv the locus is a circle.")
        .setting("Eq. (3-7), as Fig 3-9")
        .assumed("wu = 0.9, wv = 1.1 rad/s; 25 ratios αu/αv from −6 to 10")
        .row(600.0, [chart])
        .compare(Comparison::unprinted("|s| of the complex zeros for αu = −αv", format!("{} to {} rad/s; the root of wu wv is {}", signed(low, 6), signed(high, 6), signed(0.99f64.sqrt(), 6))))
        .command(pair(-1.0, 1.0).command("model locus", &format!("--vary {KEY} --from 1e5 --to 1e-5 --count 1001"))))
}

/// Eq. (3-7) with wu = 10, wv = 11 rad/s, αR = 1, αu = −α0, αv = α0.
fn equal_pair(size: f64) -> Result<ModalSum, FigureError> {
    sum(&[(0.0, 0.0, 1.0), (10.0, 0.0, -size), (11.0, 0.0, size)])
}

pub(in super::super) fn fig_3_11(_: &Runs) -> Result<Content, FigureError> {
    let over = dense(7.0, 16.0, &[10.0, 11.0]);
    let range = |chart: Chart| chart.line("mode R", Pen::solid(INK), part(0.0, 1.0, &over));
    let mut chart = range(Chart::new(
        "",
        Scale::logarithmic(W).within(7.0, 16.0),
        Scale::logarithmic("Size of the modes (m/N)").within(1e-4, 10.0),
    ));
    let mut content = Content::new("Sizes of a double integrator R and of two close modes u and v, with residues below and above the break point α01.")
        .setting("Eq. (3-7), αR = 1, αu = −α0, αv = α0")
        .assumed("wu = 10, wv = 11 rad/s (those of Eq. 3-9); α0 = 0.01 and 0.3 1/kg");
    for (size, pen, printed, expected) in [
        (0.01, Pen::dashed(BLUE), "[R]-[u]-[R]-[v]", "dual MMP"),
        (0.3, Pen::solid(VERMILION), "[R]-[u]-[v]", "CMP-CNMP"),
    ] {
        chart = chart
            .line(
                &format!("modes u and v, α0 = {size}"),
                pen,
                part(10.0, size, &over),
            )
            .line("", pen, part(11.0, size, &over));
        let sum = equal_pair(size)?;
        content = content
            .compare(Comparison::text(
                &format!("sequence, α0 = {size}"),
                printed,
                &sequence(&sum)?,
            ))
            .compare(Comparison::text(
                &format!("zeros, α0 = {size}"),
                expected,
                &kinds(&sum.undamped_zeros()?),
            ))
            .command(
                Model::modes(&[
                    ModeOf("R", 0.0, 1.0, 0.0),
                    ModeOf("u", 10.0, -size, 0.0),
                    ModeOf("v", 11.0, size, 0.0),
                ])
                .command("model sequence", ""),
            );
    }
    // Crossings of mode R with u and v in size, 1/w^2 = a/|w^2 - wx^2|.
    let small = [
        ("P1", 10.0 / 1.01f64.sqrt(), (-14.0, -12.0)),
        ("P2", 10.0 / 0.99f64.sqrt(), (14.0, 14.0)),
        ("P3", 11.0 / 1.01f64.sqrt(), (-14.0, 14.0)),
        ("P4", 11.0 / 0.99f64.sqrt(), (16.0, -12.0)),
    ];
    let large = [("P5", 10.0 / 1.3f64.sqrt(), 0.0)];
    for (name, w, aside) in small {
        chart = chart
            .points("", BLUE, Symbol::Dot, vec![(w, 1.0 / (w * w))])
            .text((w, 1.0 / (w * w)), aside, name);
    }
    for (name, w, _) in large {
        chart = chart
            .points("", VERMILION, Symbol::Dot, vec![(w, 1.0 / (w * w))])
            .text((w, 1.0 / (w * w)), (-14.0, -10.0), name);
    }
    let middle = (0.5f64 * (100.0 + 121.0)).sqrt();
    let p6 = (middle, 0.3 / (middle * middle - 100.0));
    let chart = chart
        .points("", VERMILION, Symbol::Dot, vec![p6])
        .text(p6, (0.0, -14.0), "P6");
    Ok(content.row(360.0, [chart]))
}

/// Eq. (3-9): damping ratios 0.0005, 0.001, 0.001.
fn eq_3_9(size: f64) -> Result<ModalSum, FigureError> {
    sum(&[
        (1.0, 0.0005, 1.0),
        (10.0, 0.001, -size),
        (11.0, 0.001, size),
    ])
}

fn model_3_9(size: f64) -> Model {
    Model::modes(&[
        ModeOf("R", 1.0, 1.0, 0.0005),
        ModeOf("u", 10.0, -size, 0.001),
        ModeOf("v", 11.0, size, 0.001),
    ])
}

/// Sizes of the residues in the Bode plot and the step response of Fig 3-12, and the printed zeros.
const CASES_3_12: [(f64, Colour, &str); 3] = [
    (0.01, BLUE, "dual MMP"),
    (5.0, GREEN, "CMP-CNMP"),
    (21.0, VERMILION, "dual RMP-RNMP"),
];
/// Sizes of the residues in the migration of the zeros and the beginning of the step response.
const SIZES_3_12: [(f64, Colour); 5] = [
    (0.5, BLUE),
    (5.0, GREEN),
    (10.0, PURPLE),
    (15.0, ORANGE),
    (21.0, VERMILION),
];

fn bode_3_12() -> Result<(Chart, Chart), FigureError> {
    let curve = |(size, colour, _): (f64, Colour, &str)| {
        let points = response(&eq_3_9(size)?, 0.3, 50.0)?;
        Ok(Curve::new(
            &format!("α0 = {size}"),
            Pen::solid(colour),
            points,
        ))
    };
    let curves = CASES_3_12.into_iter().map(curve);
    let curves = curves.collect::<Result<Vec<_>, FigureError>>()?;
    Ok(bode("(a) Bode plot", W, "|G| (m/N)", &curves))
}

/// Adds the step responses of Eq. (3-9) for some sizes of the residues.
fn steps_3_9(
    mut chart: Chart,
    sizes: impl IntoIterator<Item = (f64, Colour)>,
    seconds: f64,
    count: usize,
) -> Result<Chart, FigureError> {
    for (size, colour) in sizes {
        let points = step(&eq_3_9(size)?, seconds, count);
        chart = chart.line(&format!("α0 = {size}"), Pen::solid(colour), points);
    }
    Ok(chart)
}

fn migration_3_12(locus: &Locus) -> Result<Chart, FigureError> {
    let heading = "(c) Migration of the zeros, mode R as a double integrator";
    let map = plane(heading, (-34.0, 34.0), (-2.0, 18.0));
    let map = tracks(map, "zeros", Pen::solid(INK), locus, Part::Upper);
    let mut map = changes(map, locus);
    for (size, colour) in SIZES_3_12 {
        let zeros = places(&equal_pair(size)?.undamped_zeros()?);
        map = map.points(&format!("α0 = {size}"), colour, Symbol::Ring, zeros);
    }
    Ok(map)
}

/// Zero crossings and reversals at the beginning of each step response.
fn compare_beginnings(mut content: Content) -> Result<Content, FigureError> {
    for (size, _) in SIZES_3_12 {
        let start = initial(&eq_3_9(size)?);
        let early = start.zero_crossings_s.iter().filter(|t| **t < 0.6).count();
        let reversals = start.reversals_s.len();
        let end = signed(start.initial_s, 2);
        content = content.compare(Comparison::unprinted(
            &format!("beginning, α0 = {size}"),
            format!("{early} zero crossings, {reversals} reversals of direction before {end} s"),
        ));
    }
    Ok(content)
}

/// α01 and α02 of section 3.2.4 by the locus over αR, of which they are the reciprocal.
fn compare_break_points(content: Content, locus: &Locus) -> Content {
    let at = |crossing| {
        let change = locus
            .changes
            .iter()
            .find(|change| change.crossing == crossing);
        change.map_or(f64::NAN, |change| 1.0 / change.value)
    };
    let (imaginary, real) = (at(Crossing::ImaginaryAxis), at(Crossing::RealAxis));
    let a01 = "α01 = (wv − wu)/(wv + wu), at the imaginary axis";
    let a02 = "α02 = (wv + wu)/(wv − wu), at the real axis";
    content
        .compare(
            Comparison::within(a01, 1.0 / 21.0, 6, imaginary, "", 1e-9)
                .remark("the printed sign is wrong; compared: the locus with the formula"),
        )
        .compare(
            Comparison::within(a02, 21.0, 0, real, "", 1e-6)
                .remark("compared: the locus with the formula"),
        )
}

pub(in super::super) fn fig_3_12(_: &Runs) -> Result<Content, FigureError> {
    let mut content = Content::new("A slow mode R and two close modes with growing residues: Bode plot, step response, migration of the zeros, and the beginning of the step response.")
        .setting("Eq. (3-9); αu = −α0, αv = α0 (printed as αu = α0), α0 = 0.01, 5 and 21 1/kg");
    for (size, _, expected) in CASES_3_12 {
        let zeros = kinds(&eq_3_9(size)?.undamped_zeros()?);
        content = content
            .compare(Comparison::text(
                &format!("zeros, α0 = {size}"),
                expected,
                &zeros,
            ))
            .command(model_3_9(size).command("model step", ""));
    }
    let (gain, phase) = bode_3_12()?;
    let cases = CASES_3_12.map(|(size, colour, _)| (size, colour));
    let steps = steps_3_9(step_chart("(b) Step response", 10.0), cases, 10.0, 3001)?;
    let starts = zero_line(step_chart("(d) Beginning of the step response", 0.5));
    let starts = steps_3_9(starts, SIZES_3_12, 0.5, 501)?;
    // α0 over αR = 1, with mode R as a double integrator.
    let model = Model::modes(&[
        ModeOf("R", 0.0, 1.0, 0.0),
        ModeOf("u", 10.0, -1.0, 0.0),
        ModeOf("v", 11.0, 1.0, 0.0),
    ]);
    let residues = geometric(1e3, 1e-3, 141);
    let locus = locus(&model.varied(KEY)?, LocusPlane::Undamped, &residues)?;
    let content = compare_break_points(compare_beginnings(content)?, &locus)
        .row(220.0, [gain, steps])
        .row(190.0, [phase, starts])
        .row(300.0, [migration_3_12(&locus)?]);
    let range = format!("--vary {KEY} --from 1e3 --to 1e-3 --count 1001");
    Ok(content.command(model.command("model locus", &range)))
}

pub(in super::super) fn fig_3_13(_: &Runs) -> Result<Content, FigureError> {
    let zeta = 0.004;
    let mut charts = Vec::new();
    let mut content = Content::new("Nyquist plots of a double integrator and two close modes with alternating signs: the corner between the two resonance circles lies left of the origin where mode R takes back over (dual MMP), right of it where it does not (CMP-CNMP).")
        .setting("Eq. (3-7), αR = 1, αu = −α0, αv = α0, positive frequencies")
        .assumed("wu = 10, wv = 11 rad/s, α0 = 0.02 (dual MMP) and 0.15 1/kg (CMP-CNMP); damping ratio 0.004 of u and v");
    for (name, size, colour, expected, drop) in [
        ("Dual MMP", 0.02, BLUE, "left", 0.0),
        ("CMP-CNMP", 0.15, VERMILION, "right", 360.0),
    ] {
        let sum = sum(&[(0.0, 0.0, 1.0), (10.0, zeta, -size), (11.0, zeta, size)])?;
        let curve = Curve::new("", Pen::solid(colour), response(&sum, 5.0, 100.0)?);
        let largest = size / (2.0 * zeta * 100.0);
        charts.push(
            origin(nyquist(
                &format!("{name}, α0 = {size}"),
                (-largest, largest),
                (-1.1 * largest, 1.1 * largest),
                "G (m/N)",
            ))
            .directed("", curve.pen, curve.polar()),
        );
        charts.push(
            origin(nyquist(
                &format!("{name}, near the origin"),
                (-0.03, 0.03),
                (-0.03, 0.03),
                "G (m/N)",
            ))
            .directed("", curve.pen, curve.polar()),
        );
        // Between the resonances, where both modes add: the corner.
        let corner = sum.response(nalgebra::Complex::new(0.0, 10.5)).re;
        content = content
            .compare(Comparison::text(
                &format!("corner beside the origin, {name}"),
                expected,
                if corner < 0.0 { "left" } else { "right" },
            ))
            .compare(Comparison::number(
                &format!("phase drop, {name}"),
                drop,
                0,
                bench_plant::zeros::phase_drop_deg(&equal_pair(size)?.undamped_zeros()?),
                "deg",
            ))
            .command(
                Model::modes(&[
                    ModeOf("R", 0.0, 1.0, 0.0),
                    ModeOf("u", 10.0, -size, zeta),
                    ModeOf("v", 11.0, size, zeta),
                ])
                .command("model modes", ""),
            );
    }
    let second = charts.split_off(2);
    Ok(content.row(330.0, charts).row(330.0, second))
}

/// The lead of Eqs. (6-4) and (6-5), with a gain, and an additional pair of zeros and poles or none.
fn controller(gain: f64, pair: Option<(f64, f64, f64)>) -> String {
    let biquad = pair.map_or(String::new(), |(zeros, poles, zeta)| {
        format!("\n[[section]]\nkind = \"biquad\"\nzeros_rad_s = {zeros:?}\nzeros_damping_ratio = {zeta:?}\npoles_rad_s = {poles:?}\npoles_damping_ratio = {zeta:?}\n")
    });
    format!(
        "# Gains are amperes per micrometre: 1e-6 is 1 A/m.\ntitle = \"lead\"\n\n[[section]]\nkind = \"gain\"\ngain_a_per_um = {:?}\n\n[[section]]\nkind = \"zero_pole\"\nzero_rad_s = 1.82\npole_rad_s = 13.7\n{biquad}",
        gain * 1e-6
    )
}

/// A loop of Fig 3-14.
struct Loop {
    name: &'static str,
    /// File of the controller.
    file: &'static str,
    /// Size of the residues of u and v in 1/kg.
    size: f64,
    /// Additional zeros, poles and their damping ratio.
    pair: Option<(f64, f64, f64)>,
    colour: Colour,
}

/// Damping ratio of modes u and v and of the additional pair.
const ZETA_3_14: f64 = 0.01;

const LOOPS_3_14: [Loop; 3] = [
    Loop {
        name: "Dual MMP",
        file: "3-14a.controller.toml",
        size: 0.3,
        pair: None,
        colour: BLUE,
    },
    Loop {
        name: "CMP-CNMP",
        file: "3-14b.controller.toml",
        size: 1.65,
        pair: None,
        colour: VERMILION,
    },
    Loop {
        name: "Dual MMP, with an additional pole-zero pair",
        file: "3-14c.controller.toml",
        size: 0.3,
        pair: Some((11.0, 13.0, ZETA_3_14)),
        colour: GREEN,
    },
];

impl Loop {
    fn model(&self) -> Model {
        Model::modes(&[
            ModeOf("R", 0.0, 7.98, 0.0),
            ModeOf("u", 10.0, -self.size, ZETA_3_14),
            ModeOf("v", 12.0, self.size, ZETA_3_14),
        ])
        .set("motor.force_constant_n_per_a=1.0")
    }

    fn controller(&self) -> String {
        controller(13.7 / 1.82, self.pair)
    }

    /// L.
    fn curve(&self) -> Result<Curve, FigureError> {
        let (sum, text) = (self.model().sum()?, self.controller());
        let name = self.file.into();
        let sections = ControllerText { name, text }.sections(5000.0)?;
        let features = [10.0, 12.0, 11.0, 13.0].map(|w| (w, ZETA_3_14));
        let frequencies = bench_control::grid(1.5, 200.0, &features).into_iter();
        let points = frequencies.map(|w| {
            let s = nalgebra::Complex::new(0.0, w);
            (w, sum.response(s) * continuous_response(&sections, s))
        });
        Ok(Curve::new("L", Pen::solid(self.colour), points.collect()))
    }

    /// The Nyquist plot; for the additional pair also its part near -1.
    fn charts(&self, curve: &Curve) -> Vec<Chart> {
        let high = curve.points.iter().filter(|(w, _)| *w > 8.0);
        let size = high.map(|(_, l)| l.norm()).fold(1.4, f64::max);
        let near = self.pair.map(|_| polar("the same near −1", curve, 1.5));
        let whole = polar(self.name, curve, size);
        std::iter::once(whole).chain(near).collect()
    }

    fn compare(&self, content: Content, curve: &Curve) -> Result<Content, FigureError> {
        let model = self.model();
        let distances = curve.points.iter().map(|(_, l)| (l + 1.0).norm());
        let least = signed(distances.fold(f64::INFINITY, f64::min), 3);
        let zeros = kinds(&model.sum()?.undamped_zeros()?);
        let options = format!("--continuous --controller {}", self.file);
        Ok(content
            .compare(Comparison::unprinted(
                self.name,
                format!("{zeros}; least |1 + L| {least}"),
            ))
            .file(self.file, &self.controller())
            .command(model.command("margins", &options)))
    }
}

fn polar(heading: &str, curve: &Curve, size: f64) -> Chart {
    let (re, im) = ((-size, size), (-1.05 * size, 1.05 * size));
    critical(nyquist(heading, re, im, "L")).directed("", curve.pen, curve.polar())
}

pub(in super::super) fn fig_3_14(_: &Runs) -> Result<Content, FigureError> {
    let mut content = Content::new("Nyquist plots of open loops, plant and lead. With two circles in opposite directions one of them grows towards −1; an additional pair of zeros and poles turns both into the same direction.")
        .setting("plant of Eq. (6-3)")
        .assumed("the controllers, which the thesis does not print: the lead of Eq. (6-4) with a crossover near 4 rad/s; αR = 7.98, αv = −αu = 0.3 (dual MMP) and 1.65 1/kg (CMP-CNMP), wu = 10, wv = 12 rad/s, damping ratio 0.01; additional zeros at 11, poles at 13 rad/s");
    let mut charts = Vec::new();
    for one in &LOOPS_3_14 {
        let curve = one.curve()?;
        charts.extend(one.charts(&curve));
        content = one.compare(content, &curve)?;
    }
    let second = charts.split_off(2);
    Ok(content.row(380.0, charts).row(380.0, second))
}
