//! Chapter 2: the SR4DoF mechanism, its CNMP zeros and its veering.

use super::bode::{Curve, bode};
use super::content::signed;
use super::model::{Model, even, response};
use super::{Comparison, Content, FigureError, Runs};
use bench_config::{PlantSettings, Sr4dofSettings};
use bench_plant::zeros::{LocusPlane, Zero, ZeroKind, phase_drop_deg, undamped_zeros};
use bench_plant::{ModalModel, Mode};
use bench_report::colours::{BLUE, Colour, GREEN, GREY, INK, VERMILION};
use bench_report::{Chart, Mark, Pen, Scale};
use bench_thesis::veering::{Loci, ModesAt};

const TAU: f64 = std::f64::consts::TAU;
/// Length of a beam of the stage in metres.
const L: f64 = 0.0475;
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

const STAGE: Colour = Colour(225, 230, 235);
/// Motions shorter than this have no arrow.
const SHORTEST_ARROW: f64 = 0.05;

/// An arrow that shows the motion of a stage.
fn motion_arrow(chart: Chart, from: (f64, f64), motion: (f64, f64)) -> Chart {
    if motion.0.hypot(motion.1) < SHORTEST_ARROW {
        return chart;
    }
    let to = (from.0 + motion.0, from.1 + motion.1);
    chart.arrow("", Pen::solid(VERMILION).width(2.2), from, to)
}

fn shape_chart(heading: &str, mode: &Mode, rows: &[[[f64; 4]; 2]; 5]) -> Chart {
    let x = Scale::blank("X").within(-5.2, 5.2);
    let y = Scale::blank("Y").within(-1.4, 2.6);
    let beams = [3, 1, 0, 2, 4].map(|stage: usize| REST[stage]);
    let chart = Chart::new(heading, x, y).equal();
    let mut chart = chart.line("", Pen::solid(GREY).thin(), beams.to_vec());
    let motions = rows.map(|[x, y]| (dot(&x, mode), dot(&y, mode)));
    let largest = motions.iter().map(|m| m.0.hypot(m.1)).fold(0.0, f64::max);
    for (number, (place, motion)) in (1..).zip(REST.iter().zip(motions)) {
        let motion = (1.3 * motion.0 / largest, 1.3 * motion.1 / largest);
        let number_offset = if motion.1 < -0.13 { -24.0 } else { 24.0 };
        chart = chart
            .area("", STAGE, 1.0, boxed(*place))
            .line("", Pen::solid(INK).thin(), boxed(*place))
            .text(*place, (0.0, number_offset), &format!("{number}"));
        chart = motion_arrow(chart, *place, motion);
    }
    chart
}

fn dot(row: &[f64; 4], mode: &Mode) -> f64 {
    row.iter().zip(mode.shape.iter()).map(|(r, z)| r * z).sum()
}

pub(crate) fn fig_2_3(_: &Runs) -> Result<Content, FigureError> {
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

pub(crate) fn fig_2_4(_: &Runs) -> Result<Content, FigureError> {
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
    let structure = bench_plant::build(&PlantSettings::Sr4dof(settings.clone()))?;
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

/// Δ of the stage over operating point (ratio of L) and mass asymmetry.
struct Discriminant(Sr4dofSettings);

impl Discriminant {
    /// Δ, and whether there are CNMP zeros.
    fn at(&self, point: f64, asymmetry: f64) -> Result<(f64, bool), FigureError> {
        discriminant(&Sr4dofSettings {
            operating_point_m: point * self.0.beam_length_m,
            mass_asymmetry: asymmetry,
            ..self.0.clone()
        })
    }

    /// Indices of the shades over points and asymmetries, with Δ relative to that at point 0 and asymmetry 10 %.
    fn levels(&self, points: &[f64], asymmetries: &[f64]) -> Result<Vec<Vec<usize>>, FigureError> {
        let scale = self.at(0.0, 0.10)?.0;
        let row = |point: &f64| {
            let levels = asymmetries.iter().map(|d| self.level(*point, *d, scale));
            levels.collect::<Result<Vec<usize>, FigureError>>()
        };
        points.iter().map(row).collect()
    }

    fn level(&self, point: f64, asymmetry: f64, scale: f64) -> Result<usize, FigureError> {
        let (value, cnmp) = self.at(point, asymmetry)?;
        let exceeded = LIMITS.iter().filter(|limit| value / scale > **limit);
        Ok(if cnmp { SHADES.len() } else { exceeded.count() })
    }

    /// Δ over the operating point in per cent of L, relative to `scale`.
    fn cut(&self, asymmetry: f64, scale: f64) -> Result<Vec<(f64, f64)>, FigureError> {
        let value = |point: f64| Ok((100.0 * point, self.at(point, asymmetry)?.0 / scale));
        even(0.0, 0.15, 301).into_iter().map(value).collect()
    }
}

fn map_of_discriminant(points: &[f64], asymmetries: &[f64], rows: Vec<Vec<usize>>) -> Chart {
    let percent = |values: &[f64]| edges(values).iter().map(|value| 100.0 * value).collect();
    let shades = SHADES
        .iter()
        .map(|(name, colour)| (name.to_string(), *colour));
    let cnmp = ("CNMP zeros: Δ < 0".to_string(), Colour(0, 0, 0));
    Chart::new(
        "(a) Δ over its value at Y1o = 0, asymmetry 10 %",
        Scale::linear("Mass asymmetry (%)").within(-10.0, 10.0),
        Scale::linear("Operating point (% of L)").within(-15.0, 15.0),
    )
    .mark(Mark::Cells {
        x: percent(asymmetries),
        y: percent(points),
        rows,
        colours: shades.chain([cnmp]).collect(),
    })
}

fn cuts_through_discriminant(of: &Discriminant) -> Result<Chart, FigureError> {
    let scale = of.at(0.0, 0.05)?.0;
    let mut chart = Chart::new(
        "(b) Cuts through Δ, in place of the 3D view",
        Scale::linear("Operating point (% of L)").within(0.0, 15.0),
        Scale::linear("Δ/Δ(5 %, 0 % of L)").within(-0.75, 2.6),
    )
    .line("", Pen::solid(GREY).thin(), vec![(0.0, 0.0), (15.0, 0.0)]);
    for (asymmetry, pen) in [
        (-0.05, Pen::dashed(BLUE)),
        (0.0, Pen::dotted(INK)),
        (0.01, Pen::solid(GREEN)),
        (0.05, Pen::solid(VERMILION)),
    ] {
        let name = format!("asymmetry {} %", signed(100.0 * asymmetry, 0));
        chart = chart.line(&name, pen, of.cut(asymmetry, scale)?);
    }
    Ok(chart)
}

/// The stage with m3 = 18 g and 1 % of asymmetry, and the operating points in per cent of L where its zeros change kind.
fn range_of_cnmp_zeros() -> Result<(Model, Vec<String>), FigureError> {
    let model = Model::profile("chapter2")
        .set("plant.secondary_stage_mass_kg=0.018")
        .set("plant.mass_asymmetry=0.01");
    let varied = model.varied("plant.operating_point_m")?;
    let values = even(0.01 * L, 0.15 * L, 41);
    let locus = super::plane::locus(&varied, LocusPlane::Undamped, &values)?;
    let ends = locus
        .changes
        .iter()
        .map(|change| signed(100.0 * change.value / L, 3));
    Ok((model, ends.collect()))
}

pub(crate) fn fig_2_5(_: &Runs) -> Result<Content, FigureError> {
    let discriminant = Discriminant(settings(&chapter2(0.0, 0.0))?);
    let (points, asymmetries) = (even(-0.15, 0.15, 121), even(-0.10, 0.10, 121));
    let rows = discriminant.levels(&points, &asymmetries)?;
    let mut cells = rows.iter().flat_map(|row| row.iter().zip(&asymmetries));
    let none_below = cells.all(|(level, asymmetry)| *asymmetry > 0.0 || *level < SHADES.len());
    let (range, ends) = range_of_cnmp_zeros()?;
    let map = map_of_discriminant(&points, &asymmetries, rows);
    Ok(Content::new(
        "The discriminant Δ of Eq. (2-8) over mass asymmetry and operating point. Black: Δ < 0, there are CNMP zeros.",
    )
    .setting(format!("{PLANT}; no damping; 121 × 121 points"))
    .assumed("ranges of both axes: ±10 % of asymmetry, ±15 % of L")
    .row(400.0, [map])
    .row(280.0, [cuts_through_discriminant(&discriminant)?])
    .compare(Comparison::holds(
        "asymmetry of 0 and below",
        "the entire operating range is free of CNMP zeros",
        none_below,
        if none_below { "none in this map" } else { "some" },
    ))
    .compare(Comparison::holds(
        "asymmetry of 1 %, m3 = 18 g",
        "CNMP zeros in a range of operating points",
        ends.len() == 2,
        &format!("from {} % of L", ends.join(" to ")),
    ))
    .command("bench model map --config chapter2 --operating-points -15%:15%:121 --asymmetries -10%:10%:121")
    .command(range.command("model locus", "--vary plant.operating_point_m --from 1% --to 15%")))
}

/// The modes at a value, by frequency.
fn by_frequency(at: &ModesAt) -> Vec<usize> {
    let mut order: Vec<usize> = (0..at.omega_rad_s.len()).collect();
    order.sort_by(|&i, &j| at.omega_rad_s[i].total_cmp(&at.omega_rad_s[j]));
    order
}

/// Loci of modes 3 and 4 of the stage over the operating point, at an asymmetry.
struct CloseLoci {
    model: Model,
    name: String,
    colour: Colour,
    path: Vec<ModesAt>,
    /// The kind of meeting, and where it is.
    meeting: (&'static str, ModesAt),
}

impl CloseLoci {
    fn new(asymmetry: f64, colour: Colour) -> Result<CloseLoci, FigureError> {
        let model = Model::profile("chapter2").set(&format!("plant.mass_asymmetry={asymmetry:?}"));
        let varied = model.varied("plant.operating_point_m")?;
        let values = even(0.0, 0.15 * L, 151);
        let mut loci = Loci::follow(&values, |value| varied.structure(value))?;
        let path = loci.path().to_vec();
        let (kind, at) = loci.meeting([2, 3])?;
        Ok(CloseLoci {
            model,
            name: format!("asymmetry {} %", signed(100.0 * asymmetry, 0)),
            colour,
            path,
            meeting: (kind.name(), at),
        })
    }

    /// A value of each point of the loci over the operating point in per cent of L.
    fn over_point(&self, value: impl Fn(&ModesAt) -> f64) -> Vec<(f64, f64)> {
        let points = self.path.iter();
        points.map(|at| (100.0 * at.value / L, value(at))).collect()
    }

    /// Frequency in hertz of a mode, counted from 0 by frequency.
    fn frequencies(&self, mode: usize) -> Vec<(f64, f64)> {
        self.over_point(|at| at.omega_rad_s[by_frequency(at)[mode]] / TAU)
    }

    /// An element of the shape of mode 2 or 3, with the sign that makes y2 or y3 positive.
    fn element(&self, mode: usize, element: usize) -> Vec<(f64, f64)> {
        self.over_point(|at| {
            let shape = at.shape(by_frequency(at)[mode]);
            shape[element] * shape[mode].signum()
        })
    }

    /// Operating point in per cent of L and mean frequency in hertz of the meeting.
    fn place(&self) -> (f64, f64) {
        let at = &self.meeting.1;
        let sum = at.omega_rad_s[2] + at.omega_rad_s[3];
        (100.0 * at.value / L, 0.5 * sum / TAU)
    }
}

fn loci_chart(all: &[CloseLoci]) -> Chart {
    let mut chart = Chart::new(
        "(a) Frequencies of modes 3 and 4",
        Scale::linear("Operating point (% of L)").within(0.0, 12.0),
        Scale::linear("Frequency (Hz)").within(140.0, 162.0),
    );
    for loci in all {
        let pen = Pen::solid(loci.colour);
        chart = chart.line(&loci.name, pen, loci.frequencies(2));
        chart = chart.line("", pen, loci.frequencies(3));
    }
    chart
}

/// y2 (solid) and y3 (dashed) of a mode; only the first loci have an entry in the legend.
fn elements_chart(heading: &str, mode: usize, all: &[CloseLoci]) -> Chart {
    let mut chart = Chart::new(
        heading,
        Scale::linear("Operating point (% of L)").within(0.0, 12.0),
        Scale::linear("Element of the shape (1)").within(-1.1, 1.1),
    );
    for (k, loci) in all.iter().enumerate() {
        let name = |name: &'static str| if k == 0 { name } else { "" };
        chart = chart.line(name("y2"), Pen::solid(loci.colour), loci.element(mode, 2));
        chart = chart.line(name("y3"), Pen::dashed(loci.colour), loci.element(mode, 3));
    }
    chart
}

fn compare_crossing(content: Content, loci: &CloseLoci) -> Content {
    let (percent, hertz) = loci.place();
    content
        .compare(Comparison::text("at asymmetry 0 the loci are", "crossing", loci.meeting.0))
        .compare(Comparison::number("crossing", 6.6, 1, percent, "% of L"))
        .compare(Comparison::number("its frequency", 153.0, 0, hertz, "Hz").remark("0.58 Hz below the printed round figure, with the masses that give all eight frequencies of Table 2-2"))
}

fn compare_veering(content: Content, loci: &CloseLoci) -> Content {
    let (percent, hertz) = loci.place();
    let name = &loci.name;
    let place = format!("{} % of L, {} Hz", signed(percent, 3), signed(hertz, 2));
    content
        .compare(Comparison::text(
            &format!("at {name} the loci are"),
            "veering",
            loci.meeting.0,
        ))
        .compare(Comparison::unprinted(
            &format!("veering point at {name}"),
            place,
        ))
}

/// At the veering point mode 3 is localised in stage 2.
fn compare_localisation(content: Content, at: &ModesAt) -> Content {
    let shape = at.shape(by_frequency(at)[2]);
    let y2 = "|y2| in mode 3 at the veering point, asymmetry 5 %";
    content
        .compare(
            Comparison::within(y2, 1.0, 0, shape[2].abs(), "", 0.05)
                .remark("localised: printed as 1"),
        )
        .compare(
            Comparison::within("|y3| in mode 3 there", 0.0, 0, shape[3].abs(), "", 0.05)
                .remark("printed as 0"),
        )
}

pub(crate) fn fig_2_6(_: &Runs) -> Result<Content, FigureError> {
    let all = [
        CloseLoci::new(0.0, INK)?,
        CloseLoci::new(0.01, BLUE)?,
        CloseLoci::new(0.05, VERMILION)?,
    ];
    let mut content = Content::new("Loci of the two close modes over the operating point, and the elements y2 (solid) and y3 (dashed) of their shapes, modes by frequency. The sign of an element is its phase.")
        .setting(PLANT)
        .assumed("asymmetries of 0, 1 and 5 %; signs so that y2 is positive in mode 3 and y3 in mode 4")
        .row(300.0, [loci_chart(&all)])
        .row(240.0, [elements_chart("(b) Mode 3", 2, &all), elements_chart("(c) Mode 4", 3, &all)]);
    content = all.iter().fold(content, |content, loci| {
        content.command(loci.model.command("model veering", ""))
    });
    let [crossing, slight, strong] = &all;
    content = compare_crossing(content, crossing);
    content = compare_veering(compare_veering(content, slight), strong);
    Ok(compare_localisation(content, &strong.meeting.1))
}
