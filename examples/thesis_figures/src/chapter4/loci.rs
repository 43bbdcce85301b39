//! Loci of two close modes over a setting: where they cross or veer.

use super::super::content::signed;
use super::super::model::{Model, even};
use super::super::{Comparison, Content, FigureError, Runs};
use super::{K, K23, L, Y, sr4dof};
use bench_report::colours::{BLUE, INK, VERMILION};
use bench_report::{Chart, Pen, Scale};
use bench_thesis::veering::{Loci, ModesAt};

const TAU: f64 = std::f64::consts::TAU;

/// Loci of two modes over a setting: as points of value and frequency, with their meeting.
struct Pair {
    slow: Vec<(f64, f64)>,
    fast: Vec<(f64, f64)>,
    meeting: &'static str,
    value: f64,
    omega_rad_s: f64,
}

fn pair(
    model: &Model,
    key: &str,
    values: &[f64],
    modes: Option<[usize; 2]>,
) -> Result<Pair, FigureError> {
    let varied = model.varied(key)?;
    let mut loci = Loci::follow(values, |value| varied.structure(value))?;
    let modes = modes.or(loci.closest_pair()).unwrap_or([0, 1]);
    let (meeting, at) = loci.meeting(modes)?;
    // Modes are followed by their shape; the picture shows them by frequency, as in the thesis.
    let sorted = |at: &ModesAt| {
        let (a, b) = (at.omega_rad_s[modes[0]], at.omega_rad_s[modes[1]]);
        (a.min(b), a.max(b))
    };
    Ok(Pair {
        slow: loci
            .path()
            .iter()
            .map(|at| (at.value, sorted(at).0))
            .collect(),
        fast: loci
            .path()
            .iter()
            .map(|at| (at.value, sorted(at).1))
            .collect(),
        meeting: meeting.name(),
        value: at.value,
        omega_rad_s: 0.5 * (sorted(&at).0 + sorted(&at).1),
    })
}

fn drawn(chart: Chart, name: &str, pen: Pen, pair: &Pair, scale: (f64, f64)) -> Chart {
    let scaled = |points: &[(f64, f64)]| {
        points
            .iter()
            .map(|(x, y)| (x * scale.0, y * scale.1))
            .collect::<Vec<_>>()
    };
    chart
        .line(name, pen, scaled(&pair.slow))
        .line("", pen, scaled(&pair.fast))
}

/// The veering point, which is printed for ρ = 0.01 alone.
fn compare_place(rho: f64, pair: &Pair) -> Comparison {
    if rho == 0.01 {
        let what = "veering point at ρ = 0.01 (section 4.4.1: close to 0.02)";
        return Comparison::number(what, 0.02, 2, pair.value, "N/m");
    }
    let (value, omega) = (signed(pair.value, 5), signed(pair.omega_rad_s, 4));
    Comparison::unprinted(
        &format!("closest point, ρ = {rho}"),
        format!("k = {value} N/m, {omega} rad/s"),
    )
}

pub(crate) fn fig_4_1(_: &Runs) -> Result<Content, FigureError> {
    let values = even(0.0, 0.03, 121);
    let mut chart = Chart::new(
        "(b) Loci of the modes of mu and mv",
        Scale::linear("Stiffness k between mu and mv (N/m)").within(0.0, 0.03),
        Scale::linear("Frequency (rad/s)"),
    );
    let mut content = Content::new("Loci of the two close modes of three masses over the stiffness that couples them. (a) is a drawing of the model: ground –kb– mb, mb –k1– mu, mb –k2– mv, mu –k– mv.")
        .setting("profile three-mass with mb = 50 kg, k1 = k2 = kb = 1 N/m, mu = 1 kg, mv = 1 + ρ kg")
        .assumed("values of ρ between the printed ends of 0 and 0.01: 0.005");
    for (rho, colour, expected) in [
        (0.0, INK, "crossing"),
        (0.005, BLUE, "veering"),
        (0.01, VERMILION, "veering"),
    ] {
        let model = Model::profile("three-mass")
            .set("plant.nodes.b.mass_kg=50.0")
            .set(&format!("plant.nodes.v.mass_kg={:?}", 1.0 + rho));
        let pair = pair(&model, K, &values, Some([1, 2]))?;
        chart = drawn(
            chart,
            &format!("ρ = {rho}"),
            Pen::solid(colour),
            &pair,
            (1.0, 1.0),
        );
        let range = format!("--vary {K} --from 0 --to 0.03 --modes 2,3");
        content = content
            .compare(Comparison::text(
                &format!("loci at ρ = {rho}"),
                expected,
                pair.meeting,
            ))
            .command(model.command("model veering", &range))
            .compare(compare_place(rho, &pair));
    }
    Ok(content.row(340.0, [chart]))
}

pub(crate) fn fig_4_7(_: &Runs) -> Result<Content, FigureError> {
    let mut chart = Chart::new(
        "(b) Close modes over the operating point",
        Scale::linear("Operating point (% of L)").within(0.0, 12.0),
        Scale::linear("Frequency (Hz)").within(142.0, 162.0),
    );
    let mut content = Content::new("Natural frequencies of the two close modes of the SR4DoF over the operating point. (a) is a drawing of the mechanism.")
        .setting("profile chapter2 with m3 = 18 g, as printed in Table 2-1");
    for (asymmetry, pen, expected) in [
        (0.0, Pen::dashed(INK), "crossing"),
        (0.01, Pen::solid(VERMILION), "veering"),
    ] {
        let model = sr4dof(asymmetry);
        let pair = pair(&model, Y, &even(0.0, 0.12 * L, 121), Some([2, 3]))?;
        let name = format!("asymmetry {} %", signed(100.0 * asymmetry, 0));
        chart = drawn(chart, &name, pen, &pair, (100.0 / L, 1.0 / TAU));
        content = content
            .compare(Comparison::text(&name, expected, pair.meeting))
            .compare(Comparison::unprinted(
                &format!("where, {name}"),
                format!(
                    "{} % of L, {} Hz",
                    signed(100.0 * pair.value / L, 3),
                    signed(pair.omega_rad_s / TAU, 2)
                ),
            ))
            .command(model.command(
                "model veering",
                "--vary plant.operating_point_m --from 0 --to 12%",
            ));
    }
    Ok(content.row(340.0, [chart]))
}

pub(crate) fn fig_4_9(_: &Runs) -> Result<Content, FigureError> {
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
        .compare(Comparison::text("the loci are", "veering", pair.meeting).remark("the printed masses and springs are symmetric (1 with 4, 2 with 3), and the two modes of different symmetry: they cross, the special case of veering of section 4.1"))
        .compare(Comparison::unprinted("veering point", format!("k23 = {} N/m, {} rad/s", signed(pair.value, 2), signed(pair.omega_rad_s, 4))))
        .command(model.command("model veering", &format!("--vary {K23} --from 0 --to 300"))))
}
