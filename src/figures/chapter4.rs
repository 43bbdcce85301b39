//! Chapter 4: veering and CNMP zeros; and the map of Chapter 5.

use super::bode::{Curve, bode};
use super::content::signed;
use super::model::{ModeOf, Model, even, geometric, kinds, response};
use super::plane::{Part, changes, locus, places, plane, tracks};
use super::{Comparison, Content, FigureError, Workshop};
use crate::config::PlantSettings;
use crate::report::colours::{BLUE, Colour, GREEN, GREY, INK, PURPLE, VERMILION};
use crate::report::{Chart, Mark, Pen, Scale, Symbol};
use crate::veering::{Loci, ModesAt};
use crate::zeros::{
    Crossing, Locus, ModalSum, Plane, Sequence, Term, cnmp_map, critical_residues, critical_sums, undamped_zeros,
};

const W: &str = "Frequency (rad/s)";
const TAU: f64 = std::f64::consts::TAU;

/// Loci of two modes over a setting: as points of value and frequency, with their meeting.
struct Pair {
    slow: Vec<(f64, f64)>,
    fast: Vec<(f64, f64)>,
    meeting: &'static str,
    value: f64,
    omega_rad_s: f64,
}

fn pair(model: &Model, key: &str, values: &[f64], modes: Option<[usize; 2]>) -> Result<Pair, FigureError> {
    let varied = model.varied(key)?;
    let mut loci = Loci::follow(values, |value| varied.structure(value))?;
    let modes = modes.or(loci.closest_pair()).unwrap_or([0, 1]);
    let (meeting, at) = loci.meeting(modes)?;
    // Modes are followed by their shape; the picture has them by frequency, as the thesis draws them.
    let sorted = |at: &ModesAt| {
        let (a, b) = (at.omega_rad_s[modes[0]], at.omega_rad_s[modes[1]]);
        (a.min(b), a.max(b))
    };
    Ok(Pair {
        slow: loci.path().iter().map(|at| (at.value, sorted(at).0)).collect(),
        fast: loci.path().iter().map(|at| (at.value, sorted(at).1)).collect(),
        meeting: meeting.name(),
        value: at.value,
        omega_rad_s: 0.5 * (sorted(&at).0 + sorted(&at).1),
    })
}

fn drawn(chart: Chart, name: &str, pen: Pen, pair: &Pair, scale: (f64, f64)) -> Chart {
    let scaled = |points: &[(f64, f64)]| points.iter().map(|(x, y)| (x * scale.0, y * scale.1)).collect::<Vec<_>>();
    chart.line(name, pen, scaled(&pair.slow)).line("", pen, scaled(&pair.fast))
}

fn three_mass(k: f64) -> Model {
    Model::profile("three-mass").set(&format!("plant.springs.k.stiffness_n_per_m={k:?}"))
}

const K: &str = "plant.springs.k.stiffness_n_per_m";

pub(super) fn fig_4_1(_: &Workshop) -> Result<Content, FigureError> {
    let values = even(0.0, 0.03, 121);
    let mut chart = Chart::new(
        "(b) Loci of the modes of mu and mv",
        Scale::linear("Stiffness k between mu and mv (N/m)").within(0.0, 0.03),
        Scale::linear("Frequency (rad/s)"),
    );
    let mut content = Content::new("Loci of the two close modes of three masses over the stiffness that couples them. (a) is a drawing of the model: ground –kb– mb, mb –k1– mu, mb –k2– mv, mu –k– mv.")
        .setting("profile three-mass with mb = 50 kg, k1 = k2 = kb = 1 N/m, mu = 1 kg, mv = 1 + ρ kg")
        .assumed("values of ρ between the printed ends of 0 and 0.01: 0.005");
    for (rho, colour) in [(0.0, INK), (0.005, BLUE), (0.01, VERMILION)] {
        let model = Model::profile("three-mass")
            .set("plant.nodes.b.mass_kg=50.0")
            .set(&format!("plant.nodes.v.mass_kg={:?}", 1.0 + rho));
        let pair = pair(&model, K, &values, Some([1, 2]))?;
        chart = drawn(chart, &format!("ρ = {rho}"), Pen::solid(colour), &pair, (1.0, 1.0));
        let expected = if rho == 0.0 { "crossing" } else { "veering" };
        content = content
            .compare(Comparison::words(&format!("loci at ρ = {rho}"), expected, pair.meeting))
            .command(model.command("model veering", &format!("--vary {K} --from 0 --to 0.03 --modes 2,3")));
        content = content.compare(match rho == 0.01 {
            true => Comparison::number(
                "veering point at ρ = 0.01 (section 4.4.1: close to 0.02)",
                0.02,
                2,
                pair.value,
                "N/m",
            ),
            false => Comparison::unprinted(
                &format!("where, ρ = {rho}"),
                format!("k = {} N/m, {} rad/s", signed(pair.value, 5), signed(pair.omega_rad_s, 4)),
            ),
        });
    }
    Ok(content.row(340.0, [chart]))
}

/// Modes u and v of the example of section 4.2.2: wu^2 = 1, wv^2 = 2, residues -1 and 1.
fn example() -> (Term, Term) {
    (Term::undamped(1.0, -1.0), Term::undamped(2f64.sqrt(), 1.0))
}

/// N(x) of Eq. (4-3) at x = s^2.
fn parabola(residue_r: f64, x: f64) -> f64 {
    residue_r * (x + 1.0) * (x + 2.0) - x * (x + 2.0) + x * (x + 1.0)
}

pub(super) fn fig_4_2(_: &Workshop) -> Result<Content, FigureError> {
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
    let curve = |residue: f64| even(-3.0, 3.0, 301).into_iter().map(|x| (x, parabola(residue, x))).collect::<Vec<_>>();
    let marked = |chart: Chart| {
        chart.points("", INK, Symbol::Dot, vec![(-1.0, 1.0), (-2.0, 2.0)]).text((-1.0, 1.0), (-14.0, 14.0), "Pu").text(
            (-2.0, 2.0),
            (16.0, -8.0),
            "Pv",
        )
    };
    let mut a = axes("(a) Different values of αR");
    let mut content = Content::new("The numerator N(x) of Eq. (4-3): a parabola through two points Pu, Pv that do not depend on αR. Without a crossing of the horizontal line the zeros are CMP-CNMP.")
        .setting("αu = −1, αv = 1 1/kg, wu² = 1, wv² = 2 rad²/s²")
        .assumed("αR = −1, 0.1, 2 and 10 1/kg in (a); the thesis's values are lost with the figure");
    for (residue, pen) in
        [(-1.0, Pen::dotted(PURPLE)), (0.1, Pen::dashed(BLUE)), (2.0, Pen::solid(VERMILION)), (10.0, Pen::solid(GREEN))]
    {
        a = a.line(&format!("αR = {}", signed(residue, 1)), pen, curve(residue));
        let sum = ModalSum::new(vec![Term::undamped(0.0, residue), u, v], 0.0)?;
        content = content.compare(Comparison::unprinted(
            &format!("zeros, αR = {}", signed(residue, 1)),
            kinds(&sum.undamped_zeros()?),
        ));
    }
    let b = axes("(b) Where zeros meet")
        .line(&format!("αR1 = {}", signed(low, 4)), Pen::dashed(BLUE), curve(low))
        .line(&format!("αR2 = {}", signed(high, 4)), Pen::dashed(VERMILION), curve(high));
    let model =
        Model::modes(&[ModeOf("R", 0.0, 1.0, 0.0), ModeOf("u", 1.0, -1.0, 0.0), ModeOf("v", 2f64.sqrt(), 1.0, 0.0)]);
    let key = "plant.modes.R.residue_per_kg";
    let locus = locus(&model.varied(key)?, Plane::Undamped, &geometric(0.01, 100.0, 121))?;
    let met: Vec<f64> = locus
        .changes
        .iter()
        .filter(|change| matches!(change.crossing, Crossing::ImaginaryAxis | Crossing::RealAxis))
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

pub(super) fn fig_4_4(_: &Workshop) -> Result<Content, FigureError> {
    let mut content = Content::new("Sizes of mode R and of two close modes u and v: as their frequencies approach each other, the two crossings Z1 and Z2 of G with zero move together and vanish.")
        .setting("Eq. (4-1) with alternating signs")
        .assumed("αR = 1, αu = −0.02, αv = 0.02 1/kg, wu = 10 rad/s, wv = 11 (a) and 10.2 rad/s (b); the sum with a damping ratio of 0.0002");
    let (mut gains, mut phases) = (Vec::new(), Vec::new());
    for (heading, fast, printed, expected) in
        [("(a) Dual MMP", 11.0, "[R]-[u]-[R]-[v]", "dual MMP"), ("(b) CMP-CNMP", 10.2, "[R]-[u]-[v]", "CMP-CNMP")]
    {
        let terms = |zeta: f64| {
            vec![
                Term::undamped(0.0, 1.0),
                Term { omega_rad_s: 10.0, damping_ratio: zeta, residue_per_kg: -0.02 },
                Term { omega_rad_s: fast, damping_ratio: zeta, residue_per_kg: 0.02 },
            ]
        };
        let (undamped, damped) = (ModalSum::new(terms(0.0), 0.0)?, ModalSum::new(terms(0.0002), 0.0)?);
        let g = Curve::new("G", Pen::solid(INK), response(&damped, 9.0, 12.0)?);
        let (gain, phase) = bode(heading, W, "Size (m/N)", &[g]);
        let over = geometric(9.0, 12.0, 1500);
        let part = |index: usize| over.iter().map(|w| (*w, undamped.terms()[index].part(*w).abs())).collect::<Vec<_>>();
        let zeros: Vec<(f64, f64)> = undamped
            .undamped_zeros()?
            .iter()
            .filter(|zero| zero.s.re == 0.0 && zero.s.im > 0.0)
            .map(|zero| (zero.s.im, 1.0 / zero.s.im.powi(2)))
            .collect();
        let mut gain = Chart { y: gain.y.clone().within(1e-4, 1.0), ..gain }
            .line("mode R", Pen::dashed(GREEN), part(0))
            .line("mode u", Pen::dashed(BLUE), part(1))
            .line("mode v", Pen::dashed(VERMILION), part(2));
        for (name, at) in ["Z1", "Z2"].iter().zip(&zeros) {
            gain = gain.points("", INK, Symbol::Ring, vec![*at]).text(*at, (0.0, -14.0), name);
        }
        gains.push(gain);
        phases.push(phase);
        let model =
            Model::modes(&[ModeOf("R", 0.0, 1.0, 0.0), ModeOf("u", 10.0, -0.02, 0.0), ModeOf("v", fast, 0.02, 0.0)]);
        content = content
            .compare(Comparison::words(&format!("{heading}: sequence"), printed, &Sequence::of(&undamped)?.to_string()))
            .compare(Comparison::words(&format!("{heading}: zeros"), expected, &kinds(&undamped.undamped_zeros()?)))
            .command(model.command("model sequence", ""));
    }
    Ok(content.row(240.0, gains).row(170.0, phases))
}

/// Bode plots of a plant at some values of a setting, and the migration of its zeros between.
struct Study<'a> {
    model: &'a Model,
    key: &'a str,
    values: Vec<f64>,
    cases: Vec<(String, f64, Colour)>,
    band: (f64, f64),
    per: f64,
    frequency: &'a str,
    re: (f64, f64),
    im: (f64, f64),
}

impl Study<'_> {
    fn curves(&self) -> Result<Vec<Curve>, FigureError> {
        let varied = self.model.varied(self.key)?;
        let curve = |(name, value, colour): &(String, f64, Colour)| {
            let points = response(&varied.sum(*value)?, self.band.0 * self.per, self.band.1 * self.per)?;
            let points = points.into_iter().map(|(w, g)| (w / self.per, g)).collect();
            Ok(Curve::new(name, Pen::solid(*colour), points))
        };
        self.cases.iter().map(curve).collect()
    }

    fn bode(&self, heading: &str, band: (f64, f64)) -> Result<(Chart, Chart), FigureError> {
        let parts: Vec<Curve> = self.curves()?.iter().map(|curve| curve.part(band.0, band.1)).collect();
        Ok(bode(heading, self.frequency, "|G| (m/N)", &parts))
    }

    fn locus(&self) -> Result<Locus, FigureError> {
        locus(&self.model.varied(self.key)?, Plane::Undamped, &self.values)
    }

    fn map(&self, heading: &str, locus: &Locus) -> Result<Chart, FigureError> {
        let varied = self.model.varied(self.key)?;
        let mut chart = plane(heading, self.re, self.im);
        chart = changes(tracks(chart, "migration of the zeros", Pen::solid(GREY), locus, Part::Upper), locus);
        for (name, value, colour) in &self.cases {
            let structure = varied.structure(*value)?;
            let poles = varied.sum(*value)?.terms().iter().map(|term| (0.0, term.omega_rad_s)).collect();
            chart = chart
                .points(&format!("zeros, {name}"), *colour, Symbol::Ring, places(&undamped_zeros(&structure)?))
                .points(&format!("poles, {name}"), *colour, Symbol::Cross, poles);
        }
        Ok(chart)
    }
}

/// Where zeros leave and come back to the imaginary axis.
fn axis_changes(locus: &Locus) -> Vec<f64> {
    locus
        .changes
        .iter()
        .filter(|change| change.crossing == Crossing::ImaginaryAxis)
        .map(|change| change.value)
        .collect()
}

pub(super) fn fig_4_6(_: &Workshop) -> Result<Content, FigureError> {
    let model = Model::profile("three-mass");
    let study = Study {
        model: &model,
        key: K,
        values: even(0.0, 0.13, 131),
        cases: vec![("k = 0".into(), 0.0, BLUE), ("k = 0.02".into(), 0.02, VERMILION)],
        band: (0.1, 2.0),
        per: 1.0,
        frequency: W,
        re: (-0.035, 0.035),
        im: (1.02, 1.12),
    };
    let (a, a_phase) = study.bode("(a) Bode plot", study.band)?;
    let (near, near_phase) = study.bode("(a) the close modes", (1.0, 1.15))?;
    let locus = study.locus()?;
    let map = study.map("(b) Poles and zeros of the close modes, k from 0 to 0.13 N/m", &locus)?;
    let quartet = undamped_zeros(&three_mass(0.02).structure()?)?;
    let zero = quartet
        .iter()
        .find(|zero| zero.s.re > 0.0 && zero.s.im > 0.0)
        .map_or(nalgebra::Complex::new(f64::NAN, f64::NAN), |zero| zero.s);
    let mmp = kinds(&undamped_zeros(&three_mass(0.0).structure()?)?);
    let back = axis_changes(&locus);
    let words: Vec<String> = back.iter().map(|k| signed(*k, 5)).collect();
    Ok(Content::new("Three masses of Fig 4-1a without and with a coupling near the veering point: Bode plot, and the migration of poles and zeros.")
        .setting("profile three-mass: mb = 10 kg, mv = 1.01 kg, β as printed in section 4.4.1; damping ratio 0.001 in the Bode plot, none in (b)")
        .assumed("the migration is followed on to k = 0.13 N/m")
        .row(200.0, [a, near])
        .row(160.0, [a_phase, near_phase])
        .row(380.0, [map])
        .compare(Comparison::words("zeros at k = 0", "dual MMP", &mmp))
        .compare(Comparison::words("zeros at k = 0.02 N/m", "CMP-CNMP", &kinds(&quartet)))
        .compare(Comparison::unprinted("CNMP zero at k = 0.02 N/m", format!("{} + {}j rad/s", signed(zero.re, 4), signed(zero.im, 4))))
        .compare(Comparison::holds("as k grows further", "the zeros move back onto the imaginary axis", back.len() >= 2, &format!("they leave and come back at k = {} N/m", words.join(", "))))
        .command(three_mass(0.02).command("model modes", ""))
        .command(model.command("model locus", &format!("--vary {K} --from 0 --to 0.13"))))
}

fn sr4dof(asymmetry: f64) -> Model {
    Model::profile("chapter2")
        .set("plant.secondary_stage_mass_kg=0.018")
        .set(&format!("plant.mass_asymmetry={asymmetry:?}"))
}

const Y: &str = "plant.operating_point_m";
const L: f64 = 0.0475;

pub(super) fn fig_4_7(_: &Workshop) -> Result<Content, FigureError> {
    let mut chart = Chart::new(
        "(b) Close modes over the operating point",
        Scale::linear("Operating point (% of L)").within(0.0, 12.0),
        Scale::linear("Frequency (Hz)").within(142.0, 162.0),
    );
    let mut content = Content::new("Natural frequencies of the two close modes of the SR4DoF over the operating point. (a) is a drawing of the mechanism.")
        .setting("profile chapter2 with m3 = 18 g, as printed in Table 2-1");
    for (asymmetry, pen, expected) in [(0.0, Pen::dashed(INK), "crossing"), (0.01, Pen::solid(VERMILION), "veering")] {
        let model = sr4dof(asymmetry);
        let pair = pair(&model, Y, &even(0.0, 0.12 * L, 121), Some([2, 3]))?;
        let name = format!("asymmetry {} %", signed(100.0 * asymmetry, 0));
        chart = drawn(chart, &name, pen, &pair, (100.0 / L, 1.0 / TAU));
        content = content
            .compare(Comparison::words(&name, expected, pair.meeting))
            .compare(Comparison::unprinted(
                &format!("where, {name}"),
                format!("{} % of L, {} Hz", signed(100.0 * pair.value / L, 3), signed(pair.omega_rad_s / TAU, 2)),
            ))
            .command(model.command("model veering", "--vary plant.operating_point_m --from 0 --to 12%"));
    }
    Ok(content.row(340.0, [chart]))
}

pub(super) fn fig_4_8(_: &Workshop) -> Result<Content, FigureError> {
    let model = sr4dof(0.01);
    let study = Study {
        model: &model,
        key: Y,
        values: even(0.01 * L, 0.09 * L, 121),
        cases: vec![
            ("3.3 % of L".into(), 0.033 * L, BLUE),
            ("5 % of L".into(), 0.05 * L, GREEN),
            ("6.5 % of L".into(), 0.065 * L, VERMILION),
        ],
        band: (10.0, 300.0),
        per: TAU,
        frequency: "Frequency (Hz)",
        re: (-12.0, 12.0),
        im: (940.0, 1020.0),
    };
    let (a, a_phase) = study.bode("(a) Bode plot", study.band)?;
    let (b, b_phase) = study.bode("(b) the close modes", (150.0, 162.0))?;
    let locus = study.locus()?;
    let map = study.map("(c) Poles and zeros of the close modes, 1 to 9 % of L", &locus)?;
    let at = |ratio: f64| Ok::<_, FigureError>(kinds(&undamped_zeros(&model.varied(Y)?.structure(ratio * L)?)?));
    let ends: Vec<String> = axis_changes(&locus).iter().map(|value| signed(100.0 * value / L, 3)).collect();
    // The Y mode, which does not show, has a pair of zeros of its own.
    let shown = |kinds: String| match kinds.as_str() {
        "3 x MMP" => "dual MMP".to_string(),
        other => other.replace("MMP + ", ""),
    };
    Ok(Content::new("The SR4DoF with 1 % of mass asymmetry: Bode plot, the close modes, and the migration of poles and zeros with the operating point.")
        .setting("profile chapter2 with m3 = 18 g, asymmetry 1 %; damping ratio 0.001 in the Bode plots, none in (c)")
        .assumed("operating points beside the printed 3.3 %: 5 and 6.5 % of L")
        .row(210.0, [a, b])
        .row(170.0, [a_phase, b_phase])
        .row(380.0, [map])
        .compare(Comparison::words("zeros of the close modes at 3.3 % of L", "dual MMP", &shown(at(0.033)?)).remark("beside the pair that cancels the hidden Y mode"))
        .compare(Comparison::words("zeros of the close modes at 5 % of L", "CMP-CNMP", &shown(at(0.05)?)))
        .compare(Comparison::words("zeros of the close modes at 8 % of L", "dual MMP", &shown(at(0.08)?)))
        .compare(Comparison::unprinted("they leave the imaginary axis and come back", format!("at {} % of L", ends.join(" and "))))
        .command(model.command("model locus", "--vary plant.operating_point_m --from 1% --to 9%")))
}

const K23: &str = "plant.springs.k23.stiffness_n_per_m";

pub(super) fn fig_4_9(_: &Workshop) -> Result<Content, FigureError> {
    let model = Model::profile("four-mass");
    let pair = pair(&model, K23, &even(0.0, 300.0, 151), None)?;
    let chart = Chart::new(
        "(b) The two modes of interest",
        Scale::linear("Stiffness k23 (N/m)").within(0.0, 300.0),
        Scale::linear("Frequency (rad/s)"),
    );
    Ok(Content::new("Natural frequencies of the two close modes of four masses over k23. (a) is a drawing of the model; its masses and springs stand in the profile.")
        .setting("profile four-mass")
        .assumed("k23 from 0 to 300 N/m")
        .row(340.0, [drawn(chart, "modes of m2 and m3", Pen::solid(VERMILION), &pair, (1.0, 1.0))])
        .compare(Comparison::words("the loci are", "veering", pair.meeting).remark("the printed masses and springs are symmetric (1 with 4, 2 with 3), and the two modes of different symmetry: they cross, the special case of veering of section 4.1"))
        .compare(Comparison::unprinted("veering point", format!("k23 = {} N/m, {} rad/s", signed(pair.value, 2), signed(pair.omega_rad_s, 4))))
        .command(model.command("model veering", &format!("--vary {K23} --from 0 --to 300"))))
}

pub(super) fn fig_4_10(_: &Workshop) -> Result<Content, FigureError> {
    let model = Model::profile("four-mass");
    let study = Study {
        model: &model,
        key: K23,
        values: even(1.0, 300.0, 151),
        cases: vec![
            ("k23 = 20".into(), 20.0, BLUE),
            ("k23 = 100".into(), 100.0, VERMILION),
            ("k23 = 250".into(), 250.0, GREEN),
        ],
        band: (2.0, 60.0),
        per: 1.0,
        frequency: W,
        re: (-4.0, 4.0),
        im: (14.0, 32.0),
    };
    let (a, a_phase) = study.bode("(a) Bode plot", study.band)?;
    let locus = study.locus()?;
    let map = study.map("(b) Poles and zeros, k23 from 1 to 300 N/m", &locus)?;
    let found = axis_changes(&locus);
    let at = |index: usize| found.get(index).copied().unwrap_or(f64::NAN);
    Ok(Content::new("Four masses: Bode plot with three values of k23, and the migration of poles and zeros.")
        .setting("profile four-mass; damping ratio 0.005 in the Bode plot, none in (b)")
        .assumed("values of k23: 20, 100 and 250 N/m")
        .row(230.0, [a, a_phase])
        .row(400.0, [map])
        .compare(
            Comparison::within("zeros leave the imaginary axis", 50.0, 0, at(0), "N/m", 1e-3)
                .remark("by the reading of section 4.4.3; the figure is missing"),
        )
        .compare(
            Comparison::within("zeros come back to the imaginary axis", 200.0, 0, at(1), "N/m", 1e-3)
                .remark("likewise"),
        )
        .command(model.command("model locus", &format!("--vary {K23} --from 1 --to 300"))))
}

pub(super) fn fig_5_2(_: &Workshop) -> Result<Content, FigureError> {
    let (points, asymmetries) = (even(-0.15, 0.15, 201), even(-0.10, 0.10, 201));
    let threads = std::thread::available_parallelism().map_or(1, usize::from);
    let mut charts = Vec::new();
    let mut content = Content::new(
        "Map of the CNMP zeros over mass asymmetry and operating point: black where there are any.",
    )
    .setting(
        "no damping; 201 × 201 points; (a) profile chapter2, (b) profile stage, the one that was built and measured",
    )
    .assumed("ranges of both axes; the 3D view is Fig 2-5 (b)");
    for (heading, name) in [("(a) Stage of Chapter 2", "chapter2"), ("(b) Stage of Chapter 5", "stage")] {
        let PlantSettings::Sr4dof(settings) = Model::profile(name).config()?.plant else {
            return Err(FigureError::Run(format!("profile {name} is another model")));
        };
        let map = cnmp_map(&settings, &points, &asymmetries, threads)?;
        let edges = |values: &[f64]| {
            let half = 0.5 * (values[1] - values[0]);
            values
                .iter()
                .map(|value| 100.0 * (value - half))
                .chain([100.0 * (values[values.len() - 1] + half)])
                .collect::<Vec<f64>>()
        };
        let mirrored = map.iter().zip(map.iter().rev()).all(|(a, b)| a == b);
        let below = map.iter().flat_map(|row| row.iter().zip(&asymmetries)).all(|(pairs, d)| *d > 0.0 || *pairs == 0);
        let cells = Mark::Cells {
            x: edges(&asymmetries),
            y: edges(&points),
            rows: map.iter().map(|row| row.iter().map(|pairs| usize::from(*pairs > 0)).collect()).collect(),
            colours: vec![("no CNMP zeros".into(), Colour(222, 235, 247)), ("CNMP zeros".into(), Colour(0, 0, 0))],
        };
        charts.push(
            Chart::new(
                heading,
                Scale::linear("Mass asymmetry (%)").within(-10.0, 10.0),
                Scale::linear("Operating point (% of L)").within(-15.0, 15.0),
            )
            .mark(cells),
        );
        content = content
            .compare(Comparison::holds(
                &format!("{heading}: operating points of either sign"),
                "symmetric",
                mirrored,
                if mirrored { "every row equals its mirror image" } else { "not so" },
            ))
            .compare(Comparison::holds(
                &format!("{heading}: asymmetry of 0 and below"),
                "no CMP-CNMP zeros",
                below,
                if below { "none" } else { "some" },
            ))
            .command(format!(
                "bench model map --config {name} --operating-points -15%:15%:201 --asymmetries -10%:10%:201"
            ));
    }
    Ok(content.row(400.0, charts))
}
