//! Figs 3-9 to 3-14: a double integrator (or a slow mode) and two close modes.

use super::super::bode::{Curve, bode, critical, nyquist, origin};
use super::super::content::signed;
use super::super::model::{ModeOf, Model, geometric, kinds, response};
use super::super::plane::{Part, changes, locus, plane, tracks};
use super::super::{Comparison, Content, FigureError, Runs};
use super::{W, dense, initial, part, sequence, step, step_chart, sum, zero_line};
use bench::control::{self, ControllerText, continuous_response};
use bench::model::zeros::{Crossing, LocusPlane, ModalSum};
use bench::report::colours::{BLUE, Colour, GREEN, INK, ORANGE, PURPLE, VERMILION};
use bench::report::{Chart, Pen, Scale, Symbol};

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
    let cases = [
        ("a", 2.0),
        ("b", -0.5),
        ("c", -0.85),
        ("d", -1.2),
        ("e", -2.0),
        ("f", 0.5),
    ];
    let mut content = Content::new("Locus of the zeros as αv grows from 0, with a constant ratio αu/αv: solid for αv > 0 (the root locus of T), dashed for αv < 0 (the complementary one). First quadrant; the other three mirror it.")
        .setting("Eq. (3-7); αR = 1 and |αv| from 1e-4 to 1e4, which is the same as αv = ±1 and αR from 1e4 to 1e-4")
        .assumed("wu = 0.9, wv = 1.1 rad/s and six ratios αu/αv, one in each range between −∞, −(wv/wu)^2 = −1.49, −1, −(wu/wv)^2 = −0.67, 0 and one more");
    let mut charts = Vec::new();
    let mut meetings = 0;
    for (letter, ratio) in cases {
        let mut chart = plane(
            &format!("({letter}) αu/αv = {}", signed(ratio, 2)),
            (0.0, 2.0),
            (0.0, 2.0),
        );
        for (sign, name, pen) in [
            (1.0, "αv > 0", Pen::solid(VERMILION)),
            (-1.0, "αv < 0", Pen::dashed(BLUE)),
        ] {
            let model = pair(ratio * sign, sign);
            let locus = locus(&model.varied(KEY)?, LocusPlane::Undamped, &ratios())?;
            let complex = locus.changes.iter().any(|change| {
                change.after.contains("CMP-CNMP") || change.before.contains("CMP-CNMP")
            });
            meetings += usize::from(complex && !(sign * ratio < 0.0 && sign > 0.0));
            chart = changes(tracks(chart, name, pen, &locus, Part::Quadrant), &locus);
            if complex {
                let text: Vec<String> = locus
                    .changes
                    .iter()
                    .filter(|c| matches!(c.crossing, Crossing::ImaginaryAxis | Crossing::RealAxis))
                    .map(|c| {
                        format!(
                            "αv = {} at {}",
                            signed(sign / c.value, 4),
                            signed(c.s.norm(), 4)
                        )
                    })
                    .collect();
                content = content.compare(Comparison::unprinted(
                    &format!("({letter}) zeros meet, αu/αv = {}", signed(ratio, 2)),
                    text.join("; "),
                ));
                content = content.command(model.command(
                    "model locus",
                    &format!("--vary {KEY} --from 1e4 --to 1e-4 --count 1001"),
                ));
            }
        }
        charts.push(chart.points(
            "poles",
            INK,
            Symbol::Cross,
            vec![(0.0, 0.9), (0.0, 1.1), (0.0, 0.0)],
        ));
    }
    let rest = charts.split_off(3);
    Ok(content
        .row(280.0, charts)
        .row(280.0, rest)
        .compare(Comparison::holds(
            "CMP-CNMP zeros",
            "only where αu < 0 and αv > 0",
            meetings == 0,
            if meetings == 0 {
                "in no other case"
            } else {
                "in others too"
            },
        )))
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
            .compare(Comparison::words(
                &format!("sequence, α0 = {size}"),
                printed,
                &sequence(&sum)?,
            ))
            .compare(Comparison::words(
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

pub(in super::super) fn fig_3_12(_: &Runs) -> Result<Content, FigureError> {
    let cases = [
        (0.01, BLUE, "dual MMP"),
        (5.0, GREEN, "CMP-CNMP"),
        (21.0, VERMILION, "dual RMP-RNMP"),
    ];
    let mut content = Content::new("A slow mode R and two close modes with growing residues: Bode plot, step response, migration of the zeros, and the beginning of the step response.")
        .setting("Eq. (3-9); αu = −α0, αv = α0 (printed as αu = α0), α0 = 0.01, 5 and 21 1/kg");
    let mut curves = Vec::new();
    let mut steps = step_chart("(b) Step response", 10.0);
    for (size, colour, expected) in cases {
        let sum = eq_3_9(size)?;
        curves.push(Curve::new(
            &format!("α0 = {size}"),
            Pen::solid(colour),
            response(&sum, 0.3, 50.0)?,
        ));
        steps = steps.line(
            &format!("α0 = {size}"),
            Pen::solid(colour),
            step(&sum, 10.0, 3001),
        );
        content = content
            .compare(Comparison::words(
                &format!("zeros, α0 = {size}"),
                expected,
                &kinds(&sum.undamped_zeros()?),
            ))
            .command(model_3_9(size).command("model step", ""));
    }
    let (gain, phase) = bode("(a) Bode plot", W, "|G| (m/N)", &curves);
    // α0 over αR = 1, with mode R as a double integrator: α01 and α02 of section 3.2.4.
    let model = Model::modes(&[
        ModeOf("R", 0.0, 1.0, 0.0),
        ModeOf("u", 10.0, -1.0, 0.0),
        ModeOf("v", 11.0, 1.0, 0.0),
    ]);
    let locus_of = locus(
        &model.varied(KEY)?,
        LocusPlane::Undamped,
        &geometric(1e3, 1e-3, 141),
    )?;
    let places = |size: f64| {
        Ok::<_, FigureError>(super::super::plane::places(
            &equal_pair(size)?.undamped_zeros()?,
        ))
    };
    let mut map = plane(
        "(c) Migration of the zeros, mode R as a double integrator",
        (-34.0, 34.0),
        (-2.0, 18.0),
    );
    map = changes(
        tracks(map, "zeros", Pen::solid(INK), &locus_of, Part::Upper),
        &locus_of,
    );
    let sizes = [
        (0.5, BLUE),
        (5.0, GREEN),
        (10.0, PURPLE),
        (15.0, ORANGE),
        (21.0, VERMILION),
    ];
    let mut starts = zero_line(step_chart("(d) Beginning of the step response", 0.5));
    for (size, colour) in sizes {
        map = map.points(&format!("α0 = {size}"), colour, Symbol::Ring, places(size)?);
        let sum = eq_3_9(size)?;
        starts = starts.line(
            &format!("α0 = {size}"),
            Pen::solid(colour),
            step(&sum, 0.5, 501),
        );
        let start = initial(&sum);
        let early = start.zero_crossings_s.iter().filter(|t| **t < 0.6).count();
        content = content.compare(Comparison::unprinted(
            &format!("beginning, α0 = {size}"),
            format!(
                "{early} zero crossings, {} reversals of direction before {} s",
                start.reversals_s.len(),
                signed(start.initial_s, 2)
            ),
        ));
    }
    let breaks = |crossing| {
        locus_of
            .changes
            .iter()
            .find(|change| change.crossing == crossing)
            .map_or(f64::NAN, |change| 1.0 / change.value)
    };
    Ok(content
        .row(220.0, [gain, steps])
        .row(190.0, [phase, starts])
        .row(300.0, [map])
        .compare(
            Comparison::within(
                "α01 = (wv − wu)/(wv + wu), at the imaginary axis",
                1.0 / 21.0,
                6,
                breaks(Crossing::ImaginaryAxis),
                "",
                1e-9,
            )
            .remark("the printed sign is flipped; the locus against the formula"),
        )
        .compare(
            Comparison::within(
                "α02 = (wv + wu)/(wv − wu), at the real axis",
                21.0,
                0,
                breaks(Crossing::RealAxis),
                "",
                1e-6,
            )
            .remark("the locus against the formula"),
        )
        .command(model.command(
            "model locus",
            &format!("--vary {KEY} --from 1e3 --to 1e-3 --count 1001"),
        )))
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
            .compare(Comparison::words(
                &format!("corner beside the origin, {name}"),
                expected,
                if corner < 0.0 { "left" } else { "right" },
            ))
            .compare(Comparison::number(
                &format!("phase drop, {name}"),
                drop,
                0,
                bench::model::zeros::phase_drop_deg(&equal_pair(size)?.undamped_zeros()?),
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

/// Name, file of the controller, size of the residues, additional zeros and poles, colour.
type Case = (
    &'static str,
    &'static str,
    f64,
    Option<(f64, f64, f64)>,
    Colour,
);

pub(in super::super) fn fig_3_14(_: &Runs) -> Result<Content, FigureError> {
    let zeta = 0.01;
    let cases: [Case; 3] = [
        ("Dual MMP", "3-14a.controller.toml", 0.3, None, BLUE),
        ("CMP-CNMP", "3-14b.controller.toml", 1.65, None, VERMILION),
        (
            "Dual MMP, with an additional pole-zero pair",
            "3-14c.controller.toml",
            0.3,
            Some((11.0, 13.0, zeta)),
            GREEN,
        ),
    ];
    let mut content = Content::new("Nyquist plots of open loops, plant and lead: with two circles of opposite directions one grows towards −1; an additional pair of zeros and poles turns them into one direction.")
        .setting("plant of Eq. (6-3)")
        .assumed("the controllers, which the thesis does not print: the lead of Eq. (6-4) with a crossover near 4 rad/s; αR = 7.98, αv = −αu = 0.3 (dual MMP) and 1.65 1/kg (CMP-CNMP), wu = 10, wv = 12 rad/s, damping ratio 0.01; additional zeros at 11, poles at 13 rad/s");
    let mut charts = Vec::new();
    for (name, file, size, pair, colour) in cases {
        let text = controller(13.7 / 1.82, pair);
        let model = Model::modes(&[
            ModeOf("R", 0.0, 7.98, 0.0),
            ModeOf("u", 10.0, -size, zeta),
            ModeOf("v", 12.0, size, zeta),
        ])
        .set("motor.force_constant_n_per_a=1.0");
        let sum = model.sum()?;
        let sections = ControllerText {
            name: file.into(),
            text: text.clone(),
        }
        .sections(5000.0)?;
        let features = [(10.0, zeta), (12.0, zeta), (11.0, zeta), (13.0, zeta)];
        let at = |w: f64| {
            let s = nalgebra::Complex::new(0.0, w);
            (w, sum.response(s) * continuous_response(&sections, s))
        };
        let curve = Curve::new(
            "L",
            Pen::solid(colour),
            control::grid(1.5, 200.0, &features)
                .into_iter()
                .map(at)
                .collect(),
        );
        let size = curve
            .points
            .iter()
            .filter(|(w, _)| *w > 8.0)
            .map(|(_, l)| l.norm())
            .fold(1.4, f64::max);
        let polar = |heading: &str, size: f64| {
            critical(nyquist(
                heading,
                (-size, size),
                (-1.05 * size, 1.05 * size),
                "L",
            ))
            .directed("", curve.pen, curve.polar())
        };
        charts.push(polar(name, size));
        if pair.is_some() {
            charts.push(polar("the same near −1", 1.5));
        }
        content = content
            .compare(Comparison::unprinted(
                name,
                format!(
                    "{}; least |1 + L| {}",
                    kinds(&sum.undamped_zeros()?),
                    signed(
                        curve
                            .points
                            .iter()
                            .map(|(_, l)| (l + 1.0).norm())
                            .fold(f64::INFINITY, f64::min),
                        3
                    )
                ),
            ))
            .file(file, &text)
            .command(model.command("margins", &format!("--continuous --controller {file}")));
    }
    let second = charts.split_off(2);
    Ok(content.row(380.0, charts).row(380.0, second))
}
