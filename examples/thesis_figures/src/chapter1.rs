//! Chapter 1: limits due to a zero in the right half plane.

use nalgebra::Complex;

use super::bode::circle;
use super::content::signed;
use super::plane::plane;
use super::{Comparison, Content, FigureError, Runs};
use bench_report::colours::{BLUE, GREEN, GREY, INK, VERMILION};
use bench_report::{Chart, Mark, Pen, Symbol};
use bench_thesis::{bandwidth_rad_s, guaranteed_peak, opening_angle};

/// The circle of all zeros at which the band up to w0 subtends an angle Theta: centre w0/tan Theta, radius w0/sin
/// Theta.
fn circle_of(omega_0: f64, angle: f64) -> (f64, f64) {
    (omega_0 / angle.tan(), omega_0 / angle.sin())
}

/// A zero on that circle, at a direction from its centre.
fn on_circle(omega_0: f64, angle: f64, direction_deg: f64) -> Complex<f64> {
    let (centre, radius) = circle_of(omega_0, angle);
    Complex::new(centre, 0.0) + Complex::from_polar(radius, direction_deg.to_radians())
}

fn rays(chart: Chart, zero: Complex<f64>, omega_0: f64, pen: Pen) -> Chart {
    let at = (zero.re, zero.im);
    chart.line("", pen, vec![(0.0, omega_0), at, (0.0, -omega_0)])
}

fn named(chart: Chart, name: &str, zero: Complex<f64>, aside: (f64, f64)) -> Chart {
    let at = (zero.re, zero.im);
    chart
        .points("", VERMILION, Symbol::Ring, vec![at])
        .text(at, aside, name)
}

fn degrees(angle: f64) -> String {
    format!("{} deg", signed(angle.to_degrees(), 4))
}

pub(crate) fn fig_1_3(_: &Runs) -> Result<Content, FigureError> {
    let mut content = Content::new("The angle Θ under which a zero z in the right half plane sees the band from −jω0 to jω0. Every zero on the circle through the three points sees it under the same angle.")
        .setting("Eq. (1-2)")
        .assumed("ω0 = 1 rad/s; (b) Θ = 50 deg; where on the circles z and z2 are");
    let mut charts = Vec::new();
    for (heading, angle_deg, z_deg, z2_deg) in [
        ("(a) Circle about the origin", 90.0f64, 50.0, 15.0),
        ("(b) Circle about a point to the right", 50.0, 70.0, 25.0),
    ] {
        let angle = angle_deg.to_radians();
        let (centre, radius) = circle_of(1.0, angle);
        let (z, z2) = (on_circle(1.0, angle, z_deg), on_circle(1.0, angle, z2_deg));
        let chart = plane(heading, (-0.6, 2.4), (-1.5, 1.5)).equal();
        let chart = chart.line("same Θ", Pen::solid(BLUE), circle((centre, 0.0), radius));
        let chart = rays(
            rays(chart, z, 1.0, Pen::solid(INK)),
            z2,
            1.0,
            Pen::dashed(GREY),
        );
        let chart = named(named(chart, "z", z, (12.0, -8.0)), "z2", z2, (16.0, -6.0));
        let chart = chart.points(
            "",
            INK,
            Symbol::Dot,
            vec![(0.0, 1.0), (0.0, -1.0), (centre, 0.0)],
        );
        charts.push(chart.text((0.0, 1.0), (-16.0, -10.0), "jω0").text(
            (0.0, -1.0),
            (-20.0, 10.0),
            "−jω0",
        ));
        let (ours, other) = (opening_angle(z, 1.0), opening_angle(z2, 1.0));
        content = content.compare(
            Comparison::within(
                &format!("{heading}: Θ of z2 less Θ of z"),
                0.0,
                0,
                (other - ours).to_degrees(),
                "deg",
                1e-9,
            )
            .remark("printed: equal"),
        );
        content = content.compare(if angle_deg == 90.0 {
            Comparison::within("(a) Θ", 90.0, 0, ours.to_degrees(), "deg", 1e-9)
        } else {
            Comparison::holds(
                "(b) Θ",
                "below 90 deg",
                ours.to_degrees() < 90.0,
                &degrees(ours),
            )
        });
    }
    Ok(content
        .row(380.0, charts)
        .command("bench model bounds --bandwidth 100"))
}

pub(crate) fn fig_1_4(_: &Runs) -> Result<Content, FigureError> {
    let angle = 30f64.to_radians();
    let z = Complex::new(2.0, 3.0);
    let omega_0 = bandwidth_rad_s(z, angle);
    let (centre, radius) = circle_of(omega_0, angle);
    let z2 = Complex::new(1.4, 1.4);
    let smaller = bandwidth_rad_s(z2, angle);
    let (centre_2, radius_2) = circle_of(smaller, angle);
    let outside = vec![(-99.0, -99.0), (99.0, -99.0), (99.0, 99.0), (-99.0, 99.0)];
    let chart = plane("", (-3.0, 9.0), (-4.5, 4.5)).equal();
    let chart = chart
        .mark(Mark::Area {
            name: "zeros here cost less".into(),
            colour: BLUE,
            strength: 0.12,
            outline: outside,
        })
        .mark(Mark::Area {
            name: String::new(),
            colour: bench_report::colours::PAPER,
            strength: 1.0,
            outline: circle((centre, 0.0), radius),
        })
        .line(
            "Θ = 30 deg at ω0",
            Pen::solid(BLUE),
            circle((centre, 0.0), radius),
        )
        .line(
            "Θ = 30 deg at the smaller ω0 of z2",
            Pen::dashed(GREEN),
            circle((centre_2, 0.0), radius_2),
        );
    let chart = rays(
        rays(chart, z, omega_0, Pen::solid(INK)),
        z2,
        smaller,
        Pen::dashed(GREY),
    );
    let chart = named(named(chart, "z", z, (12.0, -8.0)), "z2", z2, (14.0, -8.0));
    let chart = chart.text((0.0, omega_0), (-18.0, -6.0), "jω0").text(
        (0.0, -omega_0),
        (-22.0, 8.0),
        "−jω0",
    );
    let size = z.norm();
    let bands = [
        Complex::new(size, 0.0),
        z,
        Complex::from_polar(size, 85f64.to_radians()),
    ]
    .map(|zero| bandwidth_rad_s(zero, angle));
    let rising = bands[0] < bands[1] && bands[1] < bands[2];
    let seen = (
        opening_angle(Complex::new(4.0, 4.0), omega_0),
        opening_angle(z2, omega_0),
    );
    Ok(Content::new("The band ω0 that a zero z leaves if it may see it under 30 deg. A zero outside of the circle (shaded) leaves more, one inside (z2) less.")
        .setting("Eqs. (1-2), (1-3), α = 0.5, Θ = 30 deg")
        .assumed("z = 2 + 3j, z2 = 1.4 + 1.4j rad/s")
        .row(430.0, [chart])
        .compare(Comparison::within("Λ = Θ/(π − Θ) at Θ = 90 deg, as log2 of the peak at α = 0.5", 1.0, 0, guaranteed_peak(0.5, 90f64.to_radians()).log2(), "", 1e-12))
        .compare(Comparison::unprinted("peak of |S| guaranteed by α = 0.5, Θ = 30 deg", signed(guaranteed_peak(0.5, angle), 4)))
        .compare(Comparison::unprinted("ω0 of z and of z2", format!("{} and {} rad/s", signed(omega_0, 4), signed(smaller, 4))))
        .compare(Comparison::holds("Θ at ω0 of a zero outside (4 + 4j) and inside (z2)", "smaller than 30 deg and larger", seen.0 < angle && seen.1 > angle, &format!("{} and {}", degrees(seen.0), degrees(seen.1))))
        .compare(Comparison::holds("ω0 of zeros of one magnitude: real, z, close to the imaginary axis", "smallest on the real axis, largest close to the imaginary one", rising, &bands.map(|band| signed(band, 4)).join(", ")))
        .command("bench model bounds --alpha 0.5 --peak 1.1487"))
}
