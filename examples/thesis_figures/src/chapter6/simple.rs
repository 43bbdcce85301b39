//! Figs 6-2 to 6-6: plants by their modes, Eqs. (6-1) to (6-5).

use super::super::bode::{Curve, bode, critical, nyquist, origin};
use super::super::content::signed;
use super::super::model::{ModeOf, Model, kinds};
use super::super::plane::{plane, pole_zero};
use super::super::{Comparison, Content, FigureError, Runs};
use super::loops::{closed, closed_loop, open, step};
use nalgebra::Complex;

use bench_control::{ClosedLoop, ControllerText, Margins};
use bench_report::colours::{BLUE, Colour, GREEN, PURPLE, VERMILION};
use bench_report::{Chart, Pen, Scale};
use bench_thesis::sign_sequence;

const W: &str = "Frequency (rad/s)";
const COLOURS: [Colour; 4] = [BLUE, VERMILION, GREEN, PURPLE];

/// Newtons for amperes one to one, so that L is the product of the printed equations.
const UNIT_FORCE: &str = "motor.force_constant_n_per_a=1.0";

const EQ_6_2: &str = "\
# Eq. (6-2): 1/s and a low pass at half of the first resonance. Gains are amperes per micrometre: 1e-6 is 1 A/m.
title = \"Eq. (6-2)\"

[[section]]
kind = \"integrator\"
gain_a_per_um = 1e-6

[[section]]
kind = \"pole_pair\"
omega_rad_s = 5.0
damping_ratio = 0.7
";

/// The lead of Eqs. (6-4) and (6-5) with a gain beside it, (1 + s/1.82)/(1 + s/13.7).
fn lead(title: &str, gain: f64) -> String {
    format!(
        "# Gains are amperes per micrometre: 1e-6 is 1 A/m.\ntitle = \"{title}\"\n\n[[section]]\nkind = \"gain\"\ngain_a_per_um = {:?}\n\n[[section]]\nkind = \"zero_pole\"\nzero_rad_s = 1.82\npole_rad_s = 13.7\n",
        gain * 1e-6 * 13.7 / 1.82
    )
}

fn biquad(zeros: (f64, f64), poles: (f64, f64)) -> String {
    let ((wz, zz), (wp, zp)) = (zeros, poles);
    format!(
        "\n[[section]]\nkind = \"biquad\"\nzeros_rad_s = {wz:?}\nzeros_damping_ratio = {zz:?}\npoles_rad_s = {wp:?}\npoles_damping_ratio = {zp:?}\n"
    )
}

fn notch() -> String {
    biquad((11.0, 0.01), (11.0, 0.4))
}

fn eq_6_4() -> String {
    lead("Eq. (6-4)", 1.0) + &notch()
}

fn eq_6_5(zeta: f64) -> String {
    lead("Eq. (6-5)", 169.0 / 121.0) + &biquad((11.0, zeta), (13.0, zeta))
}

/// Eq. (6-1).
fn eq_6_1(zeta: f64) -> Model {
    Model::modes(&[ModeOf("r", 10.0, 100.0, zeta)]).set(UNIT_FORCE)
}

/// Eq. (6-3) with wu = 10, wv = 12 rad/s: residues of u and v.
fn eq_6_3(au: f64, av: f64, zeta: f64) -> Model {
    let modes = [
        ModeOf("R", 0.0, 7.98, 0.0),
        ModeOf("u", 10.0, au, zeta),
        ModeOf("v", 12.0, av, zeta),
    ];
    Model::modes(&modes).set(UNIT_FORCE)
}

fn margins_command(model: &Model, file: &str) -> String {
    model.command("margins", &format!("--continuous --controller {file}"))
}

/// Moduli as text.
fn listed(values: &[f64], digits: usize) -> String {
    values
        .iter()
        .map(|value| signed(*value, digits))
        .collect::<Vec<_>>()
        .join(", ")
}

fn spread(values: &[f64]) -> f64 {
    let (low, high) = values
        .iter()
        .fold((f64::INFINITY, 0.0f64), |(low, high), x| {
            (low.min(*x), high.max(*x))
        });
    high - low
}

/// Damping ratios of the plant in Fig 6-2; the second is that of the open loop and the step.
const DAMPINGS_6_2: [f64; 3] = [0.001, 0.01, 0.05];
const FILE_6_2: &str = "6-2.controller.toml";

fn loops_6_2() -> Result<Vec<(Curve, ClosedLoop)>, FigureError> {
    let pens = [
        Pen::dashed(COLOURS[0]),
        Pen::solid(COLOURS[1]),
        Pen::dashed(COLOURS[2]),
    ];
    let cases = DAMPINGS_6_2.into_iter().zip(pens);
    cases
        .map(|(zeta, pen)| {
            let of = closed_loop(&eq_6_1(zeta), FILE_6_2, Some(EQ_6_2))?;
            let curve = Curve::new(&format!("ζ = {zeta}"), pen, open(&of, 0.1, 100.0));
            Ok((curve, of))
        })
        .collect()
}

/// The largest |T| at the resonance in dB.
fn resonance_peak_db(t: &Curve) -> f64 {
    let high = t.points.iter().filter(|(w, _)| *w > 5.0);
    let peak = high.map(|(_, t)| t.norm()).fold(0.0, f64::max);
    20.0 * peak.log10()
}

fn compare_6_2(
    content: Content,
    loops: &[(Curve, ClosedLoop)],
    closed: &[Curve],
) -> Result<Content, FigureError> {
    let margins = loops.iter().map(|(_, of)| of.continuous_margins());
    let margins = margins.collect::<Result<Vec<_>, _>>()?;
    let crossover = margins[1].crossover_rad_s.unwrap_or(f64::NAN) / 10.0;
    let moduli: Vec<f64> = margins.iter().map(|m| m.modulus_margin).collect();
    let peaks: Vec<f64> = closed.iter().map(resonance_peak_db).collect();
    let is_closer = peaks.windows(2).all(|pair| pair[0].abs() < pair[1].abs());
    Ok(content
        .compare(Comparison::within(
            "crossover as a ratio of the first resonance",
            0.1,
            1,
            crossover,
            "",
            0.05,
        ))
        .compare(
            Comparison::holds(
                "modulus margin with damping 0.001, 0.01, 0.05",
                "unchanged regardless of the damping ratio",
                spread(&moduli) < 0.02,
                &listed(&moduli, 3),
            )
            .remark("equal within 0.02: the circle of the resonance grows away from -1"),
        )
        .compare(Comparison::holds(
            "peak of |T| at the resonance with damping 0.001, 0.01, 0.05, in dB",
            "the smaller the damping, the closer to 0 dB",
            is_closer,
            &listed(&peaks, 2),
        )))
}

pub(in super::super) fn fig_6_2(_: &Runs) -> Result<Content, FigureError> {
    let loops = loops_6_2()?;
    let closed = loops
        .iter()
        .map(|(l, _)| Curve::new(&l.name, l.pen, closed(&l.points)));
    let closed: Vec<Curve> = closed.collect();
    let (l, of) = &loops[1];
    let (a, a_phase) = bode("(a) Open loop L = P C", W, "|L|", std::slice::from_ref(l));
    let (c, c_phase) = bode("(c) Closed loop T = L/(1 + L)", W, "|T|", &closed);
    let mut b = critical(nyquist(
        "(b) Nyquist plot of L",
        (-1.6, 3.4),
        (-2.5, 2.5),
        "L",
    ));
    for (l, _) in &loops {
        b = b.directed(&l.name, l.pen, l.polar());
    }
    let d = Chart::new(
        "(d) Step response of T",
        Scale::linear("Time (s)").within(0.0, 12.0),
        Scale::linear("Position/step (1)"),
    )
    .line(&l.name, l.pen, step(of, 12.0));
    let content = Content::new("A controller with a bandwidth below the first resonance: open loop, Nyquist plot with three damping ratios of the plant, closed loop and its step response.")
        .setting("plant of Eq. (6-1), w = 10 rad/s, damping ratio 0.01 unless another is named; controller of Eq. (6-2); continuous time, the step sampled at 5 kHz")
        .assumed("damping ratios of the other two curves: 0.001 and 0.05")
        .row(190.0, [a, c])
        .row(160.0, [a_phase, c_phase])
        .row(400.0, [b, d]);
    Ok(compare_6_2(content, &loops, &closed)?
        .file(FILE_6_2, EQ_6_2)
        .command(margins_command(&eq_6_1(0.01), FILE_6_2)))
}

/// Bode plot, poles and zeros, and Nyquist plot of a plant of Eq. (6-3).
struct Plant {
    model: Model,
    bode: (Chart, Chart),
    map: Chart,
    whole: Chart,
    corner: Chart,
    kinds: String,
    signs: String,
}

fn plant(au: f64, av: f64) -> Result<Plant, FigureError> {
    let model = eq_6_3(au, av, 0.001);
    let (sum, modal) = (model.sum()?, model.modal()?);
    let points = super::super::model::response(&sum, 1.0, 100.0)?;
    let curve = Curve::new("G", Pen::solid(BLUE), points);
    let zeros = sum.damped_zeros()?;
    let map = pole_zero(
        plane("(b) Poles and zeros", (-8.0, 8.0), (-1.0, 14.0)),
        ("poles", "zeros"),
        VERMILION,
        &sum,
        &zeros,
    );
    Ok(Plant {
        bode: bode(
            "(a) Bode plot",
            W,
            "|G| (m/N)",
            std::slice::from_ref(&curve),
        ),
        map,
        whole: nyquist(
            "(c) Nyquist plot of G in m/N",
            (-9.0, 9.0),
            (-9.0, 9.0),
            "G",
        )
        .directed("", Pen::solid(BLUE), curve.polar()),
        corner: origin(nyquist(
            "(c) the same near the origin",
            (-0.6, 0.6),
            (-0.6, 0.6),
            "G",
        ))
        .directed("", Pen::solid(BLUE), curve.polar()),
        kinds: kinds(&sum.undamped_zeros()?),
        signs: sign_sequence(&modal),
        model,
    })
}

fn plant_settings(au: f64, av: f64) -> String {
    format!(
        "Eq. (6-3) with residues of R, u, v of 7.98, {}, {} 1/kg, wu = 10 and wv = 12 rad/s, damping ratio 0.001",
        signed(au, 2),
        signed(av, 2)
    )
}

/// L with a compensation drawn over G, both in units of their largest circle.
fn compensated(heading: &str, model: &Model, text: &str, size: f64) -> Result<Chart, FigureError> {
    let of = closed_loop(model, "compensation", Some(text))?;
    let l = Curve::new("", Pen::solid(VERMILION), open(&of, 8.0, 15.0));
    let plain = closed_loop(
        model,
        "none",
        Some("title = \"none\"\n[[section]]\nkind = \"gain\"\ngain_a_per_um = 1e-6\n"),
    )?;
    let g = Curve::new("", Pen::dashed(BLUE), open(&plain, 8.0, 15.0));
    Ok(nyquist(heading, (-size, size), (-size, size), "G C")
        .directed("G", g.pen, g.polar())
        .directed("G with the compensation", l.pen, l.polar()))
}

pub(in super::super) fn fig_6_3(_: &Runs) -> Result<Content, FigureError> {
    let plant = plant(-1.65, 1.52)?;
    let only_notch = format!(
        "title = \"notch\"\n[[section]]\nkind = \"gain\"\ngain_a_per_um = 1e-6\n{}",
        notch()
    );
    let d = compensated(
        "(d) Desired compensation: u turned clockwise, v counter-clockwise",
        &plant.model,
        &only_notch,
        9.0,
    )?;
    Ok(Content::new("A plant with alternating signs: Bode plot, poles and zeros, Nyquist plot, and the compensation that turns both circles away from -1.")
        .setting(plant_settings(-1.65, 1.52))
        .assumed("(d) shows the notch of Eq. (6-4) as the compensation; the thesis draws arrows")
        .row(180.0, [plant.bode.0, plant.map])
        .row(180.0, [plant.bode.1, plant.corner])
        .row(400.0, [plant.whole, d])
        .compare(Comparison::text("signs of the residues", "+-+", &plant.signs))
        .compare(Comparison::text("zeros without damping", "CMP-CNMP", &plant.kinds))
        .command(plant.model.command("model modes", "")))
}

pub(in super::super) fn fig_6_5(_: &Runs) -> Result<Content, FigureError> {
    let plant = plant(1.65, -1.52)?;
    let pair = format!(
        "title = \"pair\"\n[[section]]\nkind = \"gain\"\ngain_a_per_um = {:?}\n{}",
        169.0 / 121.0 * 1e-6,
        biquad((11.0, 0.001), (13.0, 0.001))
    );
    let d = compensated(
        "(d) With the additional pole-zero pair of Eq. (6-5), damping 0.001",
        &plant.model,
        &pair,
        14.0,
    )?;
    Ok(Content::new("A plant with non-alternating signs: Bode plot, poles and zeros, Nyquist plot, and the additional pair that turns both circles into one direction.")
        .setting(plant_settings(1.65, -1.52))
        .row(180.0, [plant.bode.0, plant.map])
        .row(180.0, [plant.bode.1, plant.corner])
        .row(400.0, [plant.whole, d])
        .compare(Comparison::text("signs of the residues", "++-", &plant.signs))
        .compare(Comparison::holds("zeros without damping", "no CMP-CNMP zeros", !plant.kinds.contains("CMP-CNMP"), &plant.kinds))
        .command(plant.model.command("model modes", "")))
}

fn bode_of_notch() -> Result<(Chart, Chart), FigureError> {
    let notch = ControllerText {
        name: "notch".into(),
        text: format!("title = \"notch\"\n{}", notch()),
    };
    let notch = notch.sections(5000.0)?;
    let frequencies = bench_control::grid(1.0, 100.0, &[(11.0, 0.01), (11.0, 0.4)]).into_iter();
    let points = frequencies.map(|w| (w, notch[0].response(Complex::new(0.0, w))));
    let curve = Curve::new("", Pen::solid(BLUE), points.collect());
    Ok(bode("(a) Notch of Eq. (6-4)", W, "Magnitude (1)", &[curve]))
}

fn compare_6_4(content: Content, margins: &[Margins]) -> Content {
    let moduli: Vec<f64> = margins.iter().map(|m| m.modulus_margin).collect();
    let crossover = margins[1].crossover_rad_s.unwrap_or(f64::NAN);
    let is_stable = margins.iter().all(|m| m.stable);
    let stability = if is_stable {
        "stable with all four"
    } else {
        "unstable"
    };
    content
        .compare(Comparison::within("crossover (printed: around 4)", 4.0, 0, crossover, "rad/s", 0.5))
        .compare(Comparison::within("modulus margin (printed: around 0.5)", 0.5, 1, moduli[1], "", 0.05).remark("with Eq. (6-4) exactly as printed; the thesis gives crossover and margin as round figures"))
        .compare(Comparison::holds("modulus margin with damping 0.0005, 0.001, 0.002, 0.01", "unchanged", spread(&moduli) < 0.02, &listed(&moduli, 3)).remark("equal within 0.02"))
        .compare(Comparison::holds("closed loop", "stable", is_stable, stability))
}

pub(in super::super) fn fig_6_4(_: &Runs) -> Result<Content, FigureError> {
    let (file, text) = ("6-4.controller.toml", eq_6_4());
    let heading = "(b) Nyquist plot of L, with four damping ratios of the plant";
    let mut wide = critical(nyquist(heading, (-14.0, 14.0), (-14.0, 14.0), "L"));
    let mut near = critical(nyquist(
        "(b) the same near −1",
        (-2.2, 1.2),
        (-1.7, 1.7),
        "L",
    ));
    let mut margins = Vec::new();
    for (zeta, colour) in [0.0005, 0.001, 0.002, 0.01].into_iter().zip(COLOURS) {
        let of = closed_loop(&eq_6_3(-1.65, 1.52, zeta), file, Some(&text))?;
        let l = Curve::new(
            &format!("ζ = {zeta}"),
            Pen::solid(colour),
            open(&of, 1.0, 200.0),
        );
        wide = wide.directed(&l.name, l.pen, l.polar());
        near = near.directed("", l.pen, l.polar());
        margins.push(of.continuous_margins()?);
    }
    let (gain, phase) = bode_of_notch()?;
    let content = Content::new("The notch between the two modes, and the open loop with the controller of Eq. (6-4): the circles grow away from -1, however light the damping.")
        .setting(format!("{}; controller of Eq. (6-4)", plant_settings(-1.65, 1.52)))
        .assumed("damping ratios of the plant: 0.0005, 0.001, 0.002, 0.01")
        .row(150.0, [gain, phase])
        .row(430.0, [wide, near]);
    Ok(compare_6_4(content, &margins)
        .file(file, &text)
        .command(margins_command(&eq_6_3(-1.65, 1.52, 0.001), file)))
}

/// The loop of Fig 6-6 with one damping ratio of the additional pair.
struct PairLoop {
    file: &'static str,
    text: String,
    of: ClosedLoop,
    l: Curve,
}

impl PairLoop {
    fn new(
        model: &Model,
        zeta: f64,
        file: &'static str,
        colour: Colour,
    ) -> Result<PairLoop, FigureError> {
        let text = eq_6_5(zeta);
        let of = closed_loop(model, file, Some(&text))?;
        let name = format!("L, ζ = {zeta}");
        let l = Curve::new(&name, Pen::solid(colour), open(&of, 1.0, 100.0));
        Ok(PairLoop { file, text, of, l })
    }

    fn bode(&self, heading: &str) -> (Chart, Chart) {
        bode(heading, W, "|L|", std::slice::from_ref(&self.l))
    }

    fn near(&self, heading: &str) -> Chart {
        let chart = critical(nyquist(heading, (-2.6, 1.4), (-2.0, 2.0), "L"));
        chart.directed("", self.l.pen, self.l.polar())
    }

    /// Phase in degrees, from -360 to 0, between the first mode and the resonances.
    fn phase_between_deg(&self) -> f64 {
        let l = self.of.continuous_loop(9.0).map_or(f64::NAN, |l| l.arg());
        -360.0 + l.to_degrees().rem_euclid(360.0)
    }
}

pub(in super::super) fn fig_6_6(_: &Runs) -> Result<Content, FigureError> {
    let model = eq_6_3(1.65, -1.52, 0.001);
    let light = PairLoop::new(&model, 0.001, "6-6a.controller.toml", BLUE)?;
    let damped = PairLoop::new(&model, 0.01, "6-6c.controller.toml", VERMILION)?;
    let (a, c) = (
        light.bode("(a) Bode plot of L"),
        damped.bode("(c) Bode plot of L"),
    );
    let b = light.near("(b) Nyquist plot near −1, ζ = 0.001");
    let d = damped.near("(d) Nyquist plot near −1, ζ = 0.01");
    let mut content = Content::new("The loop with non-alternating signs and an additional pole-zero pair: as lightly damped as the plant's modes (a, b), and with ten times the damping (c, d).")
        .setting(format!("{}; controller of Eq. (6-5)", plant_settings(1.65, -1.52)));
    for one in [&light, &damped] {
        content = content
            .file(one.file, &one.text)
            .command(margins_command(&model, one.file));
    }
    let content = content
        .row(190.0, [a.0, c.0])
        .row(170.0, [a.1, c.1])
        .row(420.0, [b, d]);
    compare_6_6(content, &light, &damped)
}

fn compare_6_6(
    content: Content,
    light: &PairLoop,
    damped: &PairLoop,
) -> Result<Content, FigureError> {
    let (safe, near) = (
        light.of.continuous_margins()?,
        damped.of.continuous_margins()?,
    );
    let is_problem = !near.stable || near.modulus_margin < 0.5 * safe.modulus_margin;
    let phase =
        "phase at which the resonances start and end, ζ = 0.001 (at 9 rad/s; printed: about)";
    Ok(content
        .compare(Comparison::within(phase, -135.0, 0, light.phase_between_deg(), "deg", 5.0))
        .compare(Comparison::holds("ζ = 0.001", "all circles grow away from -1", safe.stable, &verdict(&safe)))
        .compare(Comparison::holds("ζ = 0.01", "a stability problem: the circle of mode v cannot be turned to a safe place", is_problem, &verdict(&near))
            .remark("with the printed numbers the loop stays stable, but the circle of mode v has turned towards -1 and the modulus margin falls")))
}

fn verdict(margins: &Margins) -> String {
    let stable = if margins.stable { "stable" } else { "unstable" };
    format!(
        "{stable}, modulus margin {}",
        signed(margins.modulus_margin, 3)
    )
}
