//! Chapter 2: the SR4DoF mechanism, its CNMP zeros and its veering.

use super::bode::{Curve, bode};
use super::content::signed;
use super::model::{Model, even, response};
use super::{Comparison, Content, FigureError, Workshop};
use bench::config::{PlantSettings, Sr4dofSettings};
use bench::model::plant::{self, ModalModel, Mode};
use bench::model::veering::{Loci, ModesAt};
use bench::model::zeros::{LocusPlane, Zero, ZeroKind, phase_drop_deg, undamped_zeros};
use bench::report::colours::{BLUE, Colour, GREEN, GREY, INK, VERMILION};
use bench::report::{Chart, Mark, Pen, Scale};

const TAU: f64 = std::f64::consts::TAU;
const PLANT: &str = "profile chapter2: Table 2-1 with m3 = 18.747 g, which gives Table 2-2";

fn chapter2(point: f64, asymmetry: f64) -> Model {
    Model::profile("chapter2").at(point, asymmetry)
}

fn settings(model: &Model) -> Result<Sr4dofSettings, FigureError> {
    match model.config()?.plant {
        PlantSettings::Sr4dof(settings) => Ok(settings),
        other => Err(FigureError::Run(format!(
            "profile chapter2 is `{}`",
            other.model()
        ))),
    }
}

/// Places of the stages 1 to 5 at rest, in units of a box: 4 and 2 to the left of 1, 3 and 5 to the right. The operating
/// point lifts stage 1, and stages 2 and 3 half as much.
const REST: [(f64, f64); 5] = [(0.0, 1.0), (-2.0, 0.5), (2.0, 0.5), (-4.0, 0.0), (4.0, 0.0)];

fn boxed((x, y): (f64, f64)) -> Vec<(f64, f64)> {
    let (w, h) = (0.6, 0.32);
    vec![
        (x - w, y - h),
        (x + w, y - h),
        (x + w, y + h),
        (x - w, y + h),
        (x - w, y - h),
    ]
}

/// A line with a head at its end.
fn arrow(chart: Chart, from: (f64, f64), to: (f64, f64)) -> Chart {
    let (dx, dy) = (to.0 - from.0, to.1 - from.1);
    let length = dx.hypot(dy);
    if length < 0.05 {
        return chart;
    }
    let (ux, uy) = (0.22 * dx / length, 0.22 * dy / length);
    let back = |side: f64| (to.0 - ux - side * 0.5 * uy, to.1 - uy + side * 0.5 * ux);
    let head = vec![to, back(1.0), back(-1.0)];
    chart
        .line(
            "",
            Pen {
                width: 2.2,
                ..Pen::solid(VERMILION)
            },
            vec![from, to],
        )
        .mark(Mark::Area {
            name: String::new(),
            colour: VERMILION,
            strength: 1.0,
            outline: head,
        })
}

fn shape_chart(heading: &str, mode: &Mode, rows: &[[[f64; 4]; 2]; 5]) -> Chart {
    let along = |row: &[f64; 4]| {
        row.iter()
            .zip(mode.shape.iter())
            .map(|(r, z)| r * z)
            .sum::<f64>()
    };
    let moves: Vec<(f64, f64)> = rows.iter().map(|[x, y]| (along(x), along(y))).collect();
    let largest = moves.iter().map(|m| m.0.hypot(m.1)).fold(0.0, f64::max);
    let mut chart = Chart::new(
        heading,
        Scale::blank("X").within(-5.2, 5.2),
        Scale::blank("Y").within(-1.4, 2.6),
    )
    .equal();
    let beams = [3, 1, 0, 2, 4].map(|k: usize| REST[k]);
    chart = chart.line("", Pen::solid(GREY).thin(), beams.to_vec());
    for (k, (place, motion)) in REST.iter().zip(&moves).enumerate() {
        let to = (
            place.0 + 1.3 * motion.0 / largest,
            place.1 + 1.3 * motion.1 / largest,
        );
        chart = chart
            .mark(Mark::Area {
                name: String::new(),
                colour: Colour(225, 230, 235),
                strength: 1.0,
                outline: boxed(*place),
            })
            .line("", Pen::solid(INK).thin(), boxed(*place))
            .text(
                *place,
                (
                    0.0,
                    if motion.1 < -0.1 * largest {
                        -24.0
                    } else {
                        24.0
                    },
                ),
                &(k + 1).to_string(),
            );
        chart = arrow(chart, *place, to);
    }
    chart
}

pub(crate) fn fig_2_3(_: &Workshop) -> Result<Content, FigureError> {
    let model = chapter2(0.05, 0.0);
    let (modal, rows) = (model.modal()?, settings(&model)?.stage_rows());
    let chart = |k: usize, letter: char| {
        let mode = &modal.modes[k];
        shape_chart(
            &format!(
                "({letter}) mode {}, {} Hz",
                k + 1,
                signed(mode.omega_rad_s / TAU, 1)
            ),
            mode,
            &rows,
        )
    };
    let mut content = Content::new("Mode shapes 2 to 4 of the SR4DoF: each stage in its place at the operating point, arrows in proportion to its motion, the longest arrow of each mode equally long.")
        .setting(format!("{PLANT}; operating point 5 % of L, asymmetry 0"))
        .assumed("the drawing of the stages; the thesis draws the mechanism")
        .row(190.0, [chart(1, 'a'), chart(2, 'b'), chart(3, 'c')])
        .command(model.command("model modes", ""));
    for (k, printed) in [(1, 27.6), (2, 153.2), (3, 154.3)] {
        let computed = modal.modes[k].omega_rad_s / TAU;
        content = content.compare(Comparison::number(
            &format!("mode {}", k + 1),
            printed,
            1,
            computed,
            "Hz",
        ));
    }
    let opposite = modal.modes[2].shape[2] * modal.modes[2].shape[3] < 0.0
        && modal.modes[3].shape[2] * modal.modes[3].shape[3] > 0.0;
    Ok(content.compare(Comparison::holds(
        "stages 2 and 3 in modes 3 and 4",
        "opposite and same directions",
        opposite,
        if opposite {
            "opposite and same"
        } else {
            "not so"
        },
    )))
}

pub(crate) fn fig_2_4(_: &Workshop) -> Result<Content, FigureError> {
    let points = [(0.0, GREEN), (0.025, BLUE), (0.05, VERMILION)];
    let mut content = Content::new("The transfer function G(s) from the force on stage 4 to the displacement of stage 1 at three operating points, without and with mass asymmetry.")
        .setting(format!("{PLANT}; damping ratio 0.001 in all modes"))
        .assumed("operating points between the printed ends of 0 and 5 % of L: 2.5 %");
    let (mut gains, mut phases, mut near, mut near_phases) =
        (Vec::new(), Vec::new(), Vec::new(), Vec::new());
    for (heading, asymmetry, drop) in [("Asymmetry 0 %", 0.0, 0.0), ("Asymmetry 5 %", 0.05, 360.0)]
    {
        let curve = |(point, colour): &(f64, Colour)| {
            let sum = chapter2(*point, asymmetry).sum()?;
            let points = response(&sum, 10.0 * TAU, 250.0 * TAU)?;
            Ok(Curve::new(
                &format!("{} % of L", 100.0 * point),
                Pen::solid(*colour),
                points,
            )
            .in_hertz())
        };
        let curves = points
            .iter()
            .map(curve)
            .collect::<Result<Vec<_>, FigureError>>()?;
        let (gain, phase) = bode(heading, "Frequency (Hz)", "|G| (m/N)", &curves);
        gains.push(gain);
        phases.push(phase);
        let close: Vec<Curve> = curves
            .iter()
            .map(|curve| curve.part(145.0, 160.0))
            .collect();
        let (gain, phase) = bode(
            &format!("{heading}, the close modes"),
            "Frequency (Hz)",
            "|G| (m/N)",
            &close,
        );
        near.push(gain);
        near_phases.push(phase);
        let model = chapter2(0.05, asymmetry);
        let computed = phase_drop_deg(&undamped_zeros(&model.structure()?)?);
        content = content
            .compare(Comparison::number(
                &format!("phase drop at 5 % of L, asymmetry {} %", 100.0 * asymmetry),
                drop,
                0,
                computed,
                "deg",
            ))
            .command(model.command("model modes", ""));
    }
    Ok(content
        .row(220.0, gains)
        .row(160.0, phases)
        .row(220.0, near)
        .row(180.0, near_phases))
}

/// The discriminant of Eq. (2-8), b3^4 times the product of (ui - uj)^2 over the three zeros u = s^2, and whether two of them
/// are complex: from the zeros of the pencil, without summing a polynomial.
fn discriminant(settings: &Sr4dofSettings) -> Result<(f64, bool), FigureError> {
    let structure = plant::build(&PlantSettings::Sr4dof(settings.clone()))?;
    let zeros = undamped_zeros(&structure)?;
    let b3: f64 = ModalModel::of(&structure)?
        .modes
        .iter()
        .map(Mode::residue_per_kg)
        .sum();
    let one = |zero: &&Zero| match zero.kind {
        ZeroKind::Mmp => zero.s.im > 0.0,
        kind => matches!(kind, ZeroKind::Rnmp | ZeroKind::Cnmp),
    };
    let u: Vec<_> = zeros
        .iter()
        .filter(one)
        .map(|zero| zero.s * zero.s)
        .collect();
    let pairs = (0..u.len()).flat_map(|i| (0..i).map(move |j| (i, j)));
    let product = pairs
        .map(|(i, j)| (u[i] - u[j]) * (u[i] - u[j]))
        .product::<nalgebra::Complex<f64>>();
    Ok((
        b3.powi(4) * product.re,
        zeros.iter().any(|zero| zero.kind == ZeroKind::Cnmp),
    ))
}

/// Light to dark, alike for the colour-blind and in print.
const SHADES: [(&str, Colour); 6] = [
    ("below 0.01", Colour(8, 64, 129)),
    ("0.01 to 0.03", Colour(43, 140, 190)),
    ("0.03 to 0.1", Colour(78, 179, 211)),
    ("0.1 to 0.3", Colour(123, 204, 196)),
    ("0.3 to 1", Colour(186, 228, 188)),
    ("above 1", Colour(240, 249, 220)),
];
const LIMITS: [f64; 5] = [0.01, 0.03, 0.1, 0.3, 1.0];

/// Edges of cells around values at equal distances.
fn edges(values: &[f64]) -> Vec<f64> {
    let half = 0.5 * (values[1] - values[0]);
    values
        .iter()
        .map(|value| value - half)
        .chain([values[values.len() - 1] + half])
        .collect()
}

pub(crate) fn fig_2_5(_: &Workshop) -> Result<Content, FigureError> {
    let base = settings(&chapter2(0.0, 0.0))?;
    let there = |point: f64, asymmetry: f64| Sr4dofSettings {
        operating_point_m: point * base.beam_length_m,
        mass_asymmetry: asymmetry,
        ..base.clone()
    };
    let (points, asymmetries) = (even(-0.15, 0.15, 121), even(-0.10, 0.10, 121));
    let scale = discriminant(&there(0.0, 0.10))?.0;
    let cell = |point: f64, asymmetry: f64| {
        let (value, cnmp) = discriminant(&there(point, asymmetry))?;
        let level = LIMITS
            .iter()
            .filter(|limit| value / scale > **limit)
            .count();
        Ok(if cnmp { SHADES.len() } else { level })
    };
    let row = |point: &f64| {
        asymmetries
            .iter()
            .map(|d| cell(*point, *d))
            .collect::<Result<Vec<usize>, FigureError>>()
    };
    let rows = points.iter().map(row).collect::<Result<Vec<_>, _>>()?;
    let below = rows
        .iter()
        .flat_map(|row| row.iter().zip(&asymmetries))
        .all(|(level, d)| *d > 0.0 || *level < SHADES.len());
    let cells = Mark::Cells {
        x: edges(&asymmetries).iter().map(|d| 100.0 * d).collect(),
        y: edges(&points).iter().map(|point| 100.0 * point).collect(),
        rows,
        colours: SHADES
            .iter()
            .map(|(name, c)| (name.to_string(), *c))
            .chain([("CNMP zeros: Δ < 0".into(), Colour(0, 0, 0))])
            .collect(),
    };
    let top = Chart::new(
        "(a) Δ over its value at Y1o = 0, asymmetry 10 %",
        Scale::linear("Mass asymmetry (%)").within(-10.0, 10.0),
        Scale::linear("Operating point (% of L)").within(-15.0, 15.0),
    )
    .mark(cells);
    let mut cuts = Chart::new(
        "(b) Cuts through Δ, in place of the 3D view",
        Scale::linear("Operating point (% of L)").within(0.0, 15.0),
        Scale::linear("Δ/Δ(5 %, 0 % of L)").within(-0.75, 2.6),
    )
    .line("", Pen::solid(GREY).thin(), vec![(0.0, 0.0), (15.0, 0.0)]);
    let five = discriminant(&there(0.0, 0.05))?.0;
    for (asymmetry, pen) in [
        (-0.05, Pen::dashed(BLUE)),
        (0.0, Pen::dotted(INK)),
        (0.01, Pen::solid(GREEN)),
        (0.05, Pen::solid(VERMILION)),
    ] {
        let at = |point: &f64| {
            Ok((
                100.0 * point,
                discriminant(&there(*point, asymmetry))?.0 / five,
            ))
        };
        let points = even(0.0, 0.15, 301)
            .iter()
            .map(at)
            .collect::<Result<Vec<_>, FigureError>>()?;
        cuts = cuts.line(
            &format!("asymmetry {} %", signed(100.0 * asymmetry, 0)),
            pen,
            points,
        );
    }
    let band = Model::profile("chapter2")
        .set("plant.secondary_stage_mass_kg=0.018")
        .set("plant.mass_asymmetry=0.01");
    let locus = super::plane::locus(
        &band.varied("plant.operating_point_m")?,
        LocusPlane::Undamped,
        &even(0.000475, 0.007125, 41),
    )?;
    let ends: Vec<String> = locus
        .changes
        .iter()
        .map(|change| signed(change.value / 0.000475, 3))
        .collect();
    let any = locus.changes.len() == 2;
    Ok(Content::new(
        "The discriminant Δ of Eq. (2-8) over mass asymmetry and operating point. Black: Δ < 0, there are CNMP zeros.",
    )
    .setting(format!("{PLANT}; no damping; 121 × 121 points"))
    .assumed("ranges of both axes: ±10 % of asymmetry, ±15 % of L")
    .row(400.0, [top])
    .row(280.0, [cuts])
    .compare(Comparison::holds(
        "asymmetry of 0 and below",
        "the entire operating range is free of CNMP zeros",
        below,
        if below { "none in this map" } else { "some" },
    ))
    .compare(Comparison::holds(
        "asymmetry of 1 %, m3 = 18 g",
        "CNMP zeros in a range of operating points",
        any,
        &format!("from {} % of L", ends.join(" to ")),
    ))
    .command("bench model map --config chapter2 --operating-points -15%:15%:121 --asymmetries -10%:10%:121")
    .command(band.command("model locus", "--vary plant.operating_point_m --from 1% --to 15%")))
}

/// The modes at a value, by frequency.
fn by_frequency(at: &ModesAt) -> Vec<usize> {
    let mut order: Vec<usize> = (0..at.omega_rad_s.len()).collect();
    order.sort_by(|&i, &j| at.omega_rad_s[i].total_cmp(&at.omega_rad_s[j]));
    order
}

pub(crate) fn fig_2_6(_: &Workshop) -> Result<Content, FigureError> {
    let values = even(0.0, 0.15 * 0.0475, 151);
    let mut loci_chart = Chart::new(
        "(a) Frequencies of modes 3 and 4",
        Scale::linear("Operating point (% of L)").within(0.0, 12.0),
        Scale::linear("Frequency (Hz)").within(140.0, 162.0),
    );
    let axes = |heading: &str| {
        Chart::new(
            heading,
            Scale::linear("Operating point (% of L)").within(0.0, 12.0),
            Scale::linear("Element of the shape (1)").within(-1.1, 1.1),
        )
    };
    let mut shapes = [axes("(b) Mode 3"), axes("(c) Mode 4")];
    let mut content = Content::new("Loci of the two close modes over the operating point, and the elements y2 (solid) and y3 (dashed) of their shapes, modes by frequency. The sign of an element is its phase.")
        .setting(PLANT)
        .assumed("asymmetries of 0, 1 and 5 %; signs so that y2 is positive in mode 3 and y3 in mode 4");
    for (asymmetry, colour) in [(0.0, INK), (0.01, BLUE), (0.05, VERMILION)] {
        let model = Model::profile("chapter2").set(&format!("plant.mass_asymmetry={asymmetry:?}"));
        let varied = model.varied("plant.operating_point_m")?;
        let mut loci = Loci::follow(&values, |value| varied.structure(value))?;
        let name = format!("asymmetry {} %", signed(100.0 * asymmetry, 0));
        for (index, place) in [2, 3].into_iter().enumerate() {
            let frequency = |at: &ModesAt| {
                (
                    at.value / 0.000475,
                    at.omega_rad_s[by_frequency(at)[place]] / TAU,
                )
            };
            loci_chart = loci_chart.line(
                if index == 0 { &name } else { "" },
                Pen::solid(colour),
                loci.path().iter().map(frequency).collect(),
            );
            for (element, pen) in [(2, Pen::solid(colour)), (3, Pen::dashed(colour))] {
                let shape = |at: &ModesAt| {
                    let shape = at.shape(by_frequency(at)[place]);
                    (
                        at.value / 0.000475,
                        shape[element] * shape[2 + index].signum(),
                    )
                };
                let legend = if asymmetry == 0.0 {
                    ["y2", "y3"][element - 2]
                } else {
                    ""
                };
                shapes[index] = shapes[index].clone().line(
                    legend,
                    pen,
                    loci.path().iter().map(shape).collect(),
                );
            }
        }
        content = content.command(model.command("model veering", ""));
        let (meeting, at) = loci.meeting([2, 3])?;
        let (percent, hertz) = (
            at.value / 0.000475,
            0.5 * (at.omega_rad_s[2] + at.omega_rad_s[3]) / TAU,
        );
        if asymmetry == 0.0 {
            content = content
                .compare(Comparison::words("at asymmetry 0 the loci are", "crossing", meeting.name()))
                .compare(Comparison::number("crossing", 6.6, 1, percent, "% of L"))
                .compare(Comparison::number("its frequency", 153.0, 0, hertz, "Hz").remark("0.58 Hz below the printed round figure, with the masses that give all eight frequencies of Table 2-2"));
        } else {
            content = content
                .compare(Comparison::words(
                    &format!("at {name} the loci are"),
                    "veering",
                    meeting.name(),
                ))
                .compare(Comparison::unprinted(
                    &format!("veering point at {name}"),
                    format!("{} % of L, {} Hz", signed(percent, 3), signed(hertz, 2)),
                ));
        }
        if asymmetry == 0.05 {
            let order = by_frequency(&at);
            content = content
                .compare(
                    Comparison::within(
                        "|y2| in mode 3 at the veering point, asymmetry 5 %",
                        1.0,
                        0,
                        at.shape(order[2])[2].abs(),
                        "",
                        0.05,
                    )
                    .remark("localised: printed as 1"),
                )
                .compare(
                    Comparison::within(
                        "|y3| in mode 3 there",
                        0.0,
                        0,
                        at.shape(order[2])[3].abs(),
                        "",
                        0.05,
                    )
                    .remark("printed as 0"),
                );
        }
    }
    let [b, c] = shapes;
    Ok(content.row(300.0, [loci_chart]).row(240.0, [b, c]))
}
