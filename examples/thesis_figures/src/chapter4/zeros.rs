//! Values at which zeros leave the imaginary axis and return, with the Bode plots at both ends.

use super::super::bode::{Curve, bode};
use super::super::content::signed;
use super::super::model::{Model, even, kinds, response};
use super::super::plane::{Part, changes, locus, places, plane, tracks};
use super::super::{Comparison, Content, FigureError, Runs};
use super::{K, K23, L, W, Y, sr4dof, three_mass};
use bench_plant::zeros::{Crossing, Locus, LocusPlane, undamped_zeros};
use bench_report::colours::{BLUE, Colour, GREEN, GREY, VERMILION};
use bench_report::{Chart, Pen, Symbol};

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
            let points = response(
                &varied.sum(*value)?,
                self.band.0 * self.per,
                self.band.1 * self.per,
            )?;
            let points = points.into_iter().map(|(w, g)| (w / self.per, g)).collect();
            Ok(Curve::new(name, Pen::solid(*colour), points))
        };
        self.cases.iter().map(curve).collect()
    }

    fn bode(&self, heading: &str, band: (f64, f64)) -> Result<(Chart, Chart), FigureError> {
        let parts: Vec<Curve> = self
            .curves()?
            .iter()
            .map(|curve| curve.part(band.0, band.1))
            .collect();
        Ok(bode(heading, self.frequency, "|G| (m/N)", &parts))
    }

    fn locus(&self) -> Result<Locus, FigureError> {
        locus(
            &self.model.varied(self.key)?,
            LocusPlane::Undamped,
            &self.values,
        )
    }

    fn map(&self, heading: &str, locus: &Locus) -> Result<Chart, FigureError> {
        let varied = self.model.varied(self.key)?;
        let mut chart = plane(heading, self.re, self.im);
        chart = changes(
            tracks(
                chart,
                "migration of the zeros",
                Pen::solid(GREY),
                locus,
                Part::Upper,
            ),
            locus,
        );
        for (name, value, colour) in &self.cases {
            let structure = varied.structure(*value)?;
            let poles = varied
                .sum(*value)?
                .terms()
                .iter()
                .map(|term| (0.0, term.omega_rad_s))
                .collect();
            chart = chart
                .points(
                    &format!("zeros, {name}"),
                    *colour,
                    Symbol::Ring,
                    places(&undamped_zeros(&structure)?),
                )
                .points(&format!("poles, {name}"), *colour, Symbol::Cross, poles);
        }
        Ok(chart)
    }
}

/// Values at which zeros leave the imaginary axis and return to it.
fn axis_changes(locus: &Locus) -> Vec<f64> {
    locus
        .changes
        .iter()
        .filter(|change| change.crossing == Crossing::ImaginaryAxis)
        .map(|change| change.value)
        .collect()
}

pub(crate) fn fig_4_6(_: &Runs) -> Result<Content, FigureError> {
    let model = Model::profile("three-mass");
    let study = Study {
        model: &model,
        key: K,
        values: even(0.0, 0.13, 131),
        cases: vec![
            ("k = 0".into(), 0.0, BLUE),
            ("k = 0.02".into(), 0.02, VERMILION),
        ],
        band: (0.1, 2.0),
        per: 1.0,
        frequency: W,
        re: (-0.035, 0.035),
        im: (1.02, 1.12),
    };
    let (a, a_phase) = study.bode("(a) Bode plot", study.band)?;
    let (near, near_phase) = study.bode("(a) the close modes", (1.0, 1.15))?;
    let locus = study.locus()?;
    let map = study.map(
        "(b) Poles and zeros of the close modes, k from 0 to 0.13 N/m",
        &locus,
    )?;
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
        .compare(Comparison::text("zeros at k = 0", "dual MMP", &mmp))
        .compare(Comparison::text("zeros at k = 0.02 N/m", "CMP-CNMP", &kinds(&quartet)))
        .compare(Comparison::unprinted("CNMP zero at k = 0.02 N/m", format!("{} + {}j rad/s", signed(zero.re, 4), signed(zero.im, 4))))
        .compare(Comparison::holds("as k grows further", "the zeros move back onto the imaginary axis", back.len() >= 2, &format!("they leave and come back at k = {} N/m", words.join(", "))))
        .command(three_mass(0.02).command("model modes", ""))
        .command(model.command("model locus", &format!("--vary {K} --from 0 --to 0.13"))))
}

pub(crate) fn fig_4_8(_: &Runs) -> Result<Content, FigureError> {
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
        per: std::f64::consts::TAU,
        frequency: "Frequency (Hz)",
        re: (-12.0, 12.0),
        im: (940.0, 1020.0),
    };
    let (a, a_phase) = study.bode("(a) Bode plot", study.band)?;
    let (b, b_phase) = study.bode("(b) the close modes", (150.0, 162.0))?;
    let locus = study.locus()?;
    let map = study.map(
        "(c) Poles and zeros of the close modes, 1 to 9 % of L",
        &locus,
    )?;
    let at = |ratio: f64| {
        Ok::<_, FigureError>(kinds(&undamped_zeros(
            &model.varied(Y)?.structure(ratio * L)?,
        )?))
    };
    let ends: Vec<String> = axis_changes(&locus)
        .iter()
        .map(|value| signed(100.0 * value / L, 3))
        .collect();
    // The Y mode, which cannot be observed, has its own pair of zeros.
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
        .compare(Comparison::text("zeros of the close modes at 3.3 % of L", "dual MMP", &shown(at(0.033)?)).remark("beside the pair that cancels the hidden Y mode"))
        .compare(Comparison::text("zeros of the close modes at 5 % of L", "CMP-CNMP", &shown(at(0.05)?)))
        .compare(Comparison::text("zeros of the close modes at 8 % of L", "dual MMP", &shown(at(0.08)?)))
        .compare(Comparison::unprinted("they leave the imaginary axis and come back", format!("at {} % of L", ends.join(" and "))))
        .command(model.command("model locus", "--vary plant.operating_point_m --from 1% --to 9%")))
}

pub(crate) fn fig_4_10(_: &Runs) -> Result<Content, FigureError> {
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
    Ok(Content::new(
        "Four masses: Bode plot with three values of k23, and the migration of poles and zeros.",
    )
    .setting("profile four-mass; damping ratio 0.005 in the Bode plot, none in (b)")
    .assumed("values of k23: 20, 100 and 250 N/m")
    .row(230.0, [a, a_phase])
    .row(400.0, [map])
    .compare(
        Comparison::within(
            "zeros leave the imaginary axis",
            50.0,
            0,
            at(0),
            "N/m",
            1e-3,
        )
        .remark("by the reading of section 4.4.3; the figure is missing"),
    )
    .compare(
        Comparison::within(
            "zeros come back to the imaginary axis",
            200.0,
            0,
            at(1),
            "N/m",
            1e-3,
        )
        .remark("likewise"),
    )
    .command(model.command("model locus", &format!("--vary {K23} --from 1 --to 300"))))
}
