//! The quadrants and octants of section 4.2.4 (Fig 4-5): actuator and probe relative to the shapes of the close modes.
//!
//! ```text
//!            phi_v                      b: the actuator projected on the plane of the two shapes, c: the probe
//!      II     |     I
//!             |    c                    au = (b . phi_u)(c . phi_u): positive if b and c are on the same side of
//!   ----------+---------- phi_u         L(phi_u), the line across phi_u; likewise av and L(phi_v)
//!             | \                       au av < 0: b and c in quadrants side by side
//!     III     |  b  IV
//! ```
//!
//! The thesis projects the configuration vectors onto the plane of the shapes with the usual product, in which two shapes
//! are only nearly at right angles. Here the product is that of the mass matrix, in which they are exactly orthogonal: a
//! vector q is M^-1 q, its components are q^T phi for shapes of unit modal mass, the signs are the same, and the product of
//! two components *is* the residue of Eq. (4-15). Lengths are ratios to the whole vector: 1 lies wholly in the plane.
//!
//! The frame is that of the two shapes where they are closest. As the setting varies, phi_u and phi_v turn in it by
//! an angle, and the lines with them; b and c are constant as long as the plane is. The one diagram at the veering
//! point therefore predicts the signs before and after it: au + av = b . c is constant, and the signs alternate where
//!
//! ```text
//!   -sign(aR) cos(2 t - t_b - t_c) > |cos(t_b - t_c)|       t, t_b, t_c: angles of phi_u, b, c
//! ```
//!
//! With mode R as the third axis the quadrants are octants. A probe in the quadrant of [`QuadrantDiagram::avoid`], on its
//! side of the third plane, makes the signs alternate (C4-1), without which there are no CMP-CNMP zeros (P4-1).

use nalgebra::DVector;
use serde::Serialize;

use super::ModesAt;
use super::trajectory::Ports;

/// Samples of the angle by which the shapes turn.
const STEPS: usize = 720;
/// Residues below this ratio of the product of the two lengths are rounding of the angles.
const ROUNDING: f64 = 1e-12;

/// Actuator and probe among the shapes at one value.
#[derive(Clone, Debug, PartialEq)]
pub struct QuadrantDiagram {
    /// The value of the setting.
    pub value: f64,
    /// Directions of phi_u and phi_v in the frame, of unit length.
    pub shapes: [[f64; 2]; 2],
    /// Components of the actuator along phi_u and phi_v, as ratios of its length.
    pub actuator: [f64; 2],
    /// Components of the probe, likewise.
    pub sensor: [f64; 2],
    /// aR, au, av in 1/kg; `None` where the modes cross.
    pub residues_per_kg: Option<[f64; 3]>,
}

impl QuadrantDiagram {
    /// The diagram at `at`, in the frame of the pair's shapes at `frame`.
    pub fn of(at: &ModesAt, frame: &ModesAt, pair: [usize; 2], ports: &Ports) -> QuadrantDiagram {
        let [force, sensor] = ports;
        let [i, j] = pair;
        let ordered = if at.omega_rad_s[i] <= at.omega_rad_s[j] {
            [i, j]
        } else {
            [j, i]
        };
        let direction = |mode| unit(pair.map(|other| at.cosine(mode, frame, other)));
        let modes = at.close_modes(&at.terms(force, sensor), pair);
        QuadrantDiagram {
            value: at.value,
            shapes: ordered.map(direction),
            actuator: components(at, ordered, force),
            sensor: components(at, ordered, sensor),
            residues_per_kg: modes.map(|modes| modes.residues_per_kg()),
        }
    }

    /// The quadrants of actuator and probe, 1 to 4 counter-clockwise from that of positive components; `None` on a line.
    pub fn quadrants(&self) -> [Option<usize>; 2] {
        [self.actuator, self.sensor].map(quadrant)
    }

    /// Signs of aR, au, av: `+`, `-`, or `0` of a mode that cannot be observed. `None` where the modes cross.
    pub fn signs(&self) -> Option<[char; 3]> {
        self.residues_per_kg.map(residue_signs)
    }

    /// The octant of the probe relative to the actuator's: whether it is on the other side of the planes of R, u, v. C4-1
    /// holds for `[false, true, false]` and `[true, false, true]`. `None` where the modes cross.
    pub fn across(&self) -> Option<[bool; 3]> {
        let residues = self.residues_per_kg?;
        Some(residues.map(|residue| residue < 0.0))
    }

    /// The quadrant in which a probe, with its aR unchanged, would make the signs alternate.
    pub fn avoid(&self) -> Option<usize> {
        let remainder = self.residues_per_kg?[0];
        let [along_u, along_v] = self.actuator;
        quadrant([-remainder * along_u, remainder * along_v])
    }

    /// A vector of components along phi_u and phi_v, in the frame.
    pub fn in_frame(&self, [along_u, along_v]: [f64; 2]) -> [f64; 2] {
        let [u, v] = self.shapes;
        [0, 1].map(|axis| along_u * u[axis] + along_v * v[axis])
    }

    /// Angle of phi_u in the frame.
    pub fn turn_rad(&self) -> f64 {
        let [x, y] = self.shapes[0];
        y.atan2(x)
    }

    /// Whether, with actuator, probe and aR as here, the signs alternate anywhere while phi_u turns from one angle to another.
    pub fn alternates_over(&self, from_rad: f64, to_rad: f64) -> bool {
        let remainder = self
            .residues_per_kg
            .map_or(0.0, |[remainder, ..]| remainder);
        let turn = |step: usize| from_rad + (to_rad - from_rad) * step as f64 / STEPS as f64;
        remainder != 0.0 && (0..=STEPS).any(|step| self.alternates_at(turn(step), remainder))
    }

    fn alternates_at(&self, turn_rad: f64, remainder: f64) -> bool {
        let (b, c) = (self.in_frame(self.actuator), self.in_frame(self.sensor));
        let least = ROUNDING * dot(b, b).sqrt() * dot(c, c).sqrt();
        let [u, v] = self.shapes;
        let side = (u[0] * v[1] - u[1] * v[0]).signum();
        let (sine, cosine) = (turn_rad.sin(), turn_rad.cos());
        let residue = |shape| dot(b, shape) * dot(c, shape) * remainder.signum();
        residue([cosine, sine]) < -least && residue([-side * sine, side * cosine]) > least
    }
}

/// `+`, `-` or `0` of each residue.
pub(super) fn residue_signs(residues: [f64; 3]) -> [char; 3] {
    residues.map(|residue| match residue {
        r if r > 0.0 => '+',
        r if r < 0.0 => '-',
        _ => '0',
    })
}

/// Components of a row along two shapes, as ratios of its length over all shapes.
fn components(at: &ModesAt, ordered: [usize; 2], row: &DVector<f64>) -> [f64; 2] {
    let raw: Vec<f64> = (0..at.count()).map(|mode| at.gain(mode, row)).collect();
    let length = raw.iter().map(|gain| gain * gain).sum::<f64>().sqrt();
    let gains = if at.are_equal(ordered) {
        raw
    } else {
        at.gains(row)
    };
    ordered.map(|mode| {
        if length > 0.0 {
            gains[mode] / length
        } else {
            0.0
        }
    })
}

fn quadrant([x, y]: [f64; 2]) -> Option<usize> {
    match (x > 0.0, y > 0.0) {
        _ if x == 0.0 || y == 0.0 => None,
        (true, true) => Some(1),
        (false, true) => Some(2),
        (false, false) => Some(3),
        (true, false) => Some(4),
    }
}

fn dot(a: [f64; 2], b: [f64; 2]) -> f64 {
    a[0] * b[0] + a[1] * b[1]
}

fn unit([x, y]: [f64; 2]) -> [f64; 2] {
    let length = x.hypot(y);
    if length > 0.0 {
        [x / length, y / length]
    } else {
        [1.0, 0.0]
    }
}

/// A diagram as reported: components, quadrants and signs.
#[derive(Clone, Debug, PartialEq, Serialize)]
pub struct QuadrantSummary {
    /// The value of the setting.
    pub value: f64,
    /// Angle by which phi_u has turned from the veering point, in degrees.
    pub turn_deg: f64,
    /// Components of the actuator along phi_u and phi_v, as ratios of its length.
    pub actuator: [f64; 2],
    /// Components of the probe, likewise.
    pub sensor: [f64; 2],
    /// Quadrant of the actuator, 1 to 4; `null` on the line between two.
    pub actuator_quadrant: Option<usize>,
    /// Quadrant of the probe, likewise.
    pub sensor_quadrant: Option<usize>,
    /// The quadrant in which the probe would make the signs alternate.
    pub avoid_quadrant: Option<usize>,
    /// For each of the planes of R, u, v: whether actuator and probe are on opposite sides of it.
    pub across: Option<[bool; 3]>,
    /// aR, au, av in 1/kg.
    pub residues_per_kg: Option<[f64; 3]>,
    /// Signs of R, u, v.
    pub signs: Option<String>,
}

impl From<&QuadrantDiagram> for QuadrantSummary {
    fn from(diagram: &QuadrantDiagram) -> QuadrantSummary {
        let [actuator_quadrant, sensor_quadrant] = diagram.quadrants();
        QuadrantSummary {
            value: diagram.value,
            turn_deg: diagram.turn_rad().to_degrees(),
            actuator: diagram.actuator,
            sensor: diagram.sensor,
            actuator_quadrant,
            sensor_quadrant,
            avoid_quadrant: diagram.avoid(),
            across: diagram.across(),
            residues_per_kg: diagram.residues_per_kg,
            signs: diagram.signs().map(|signs| signs.iter().collect()),
        }
    }
}

#[cfg(test)]
mod tests {
    use super::*;
    use proptest::prelude::*;
    use std::f64::consts::{PI, TAU};

    fn diagram(b: f64, c: f64, remainder: f64) -> QuadrantDiagram {
        let (actuator, sensor) = ([b.cos(), b.sin()], [c.cos(), c.sin()]);
        let residues = [remainder, actuator[0] * sensor[0], actuator[1] * sensor[1]];
        let shapes = [[1.0, 0.0], [0.0, 1.0]];
        QuadrantDiagram {
            value: 0.0,
            shapes,
            actuator,
            sensor,
            residues_per_kg: Some(residues),
        }
    }

    proptest! {
        #[test]
        fn signs_alternate_on_the_arc_of_the_closed_form(
            b in 0.0..TAU, c in 0.0..TAU, sign in 0..2usize, from in -1.5..1.5f64, to in -1.5..1.5f64,
        ) {
            let remainder = [1.0, -1.0][sign];
            // -sign cos(2 t - b - c) > |cos(b - c)|: an arc about 2 t = b + c + pi (or b + c), of half-width acos |cos(b - c)|.
            let centre = b + c + if remainder > 0.0 { PI } else { 0.0 };
            let half = (b - c).cos().abs().acos();
            let ends = [2.0 * from.min(to), 2.0 * from.max(to)];
            let reach = |k: i32| {
                let middle = centre + TAU * f64::from(k);
                (middle + half - ends[0]).min(ends[1] - middle + half)
            };
            let reach = (-4..=4).map(reach).fold(f64::NEG_INFINITY, f64::max).min(half);
            // The turn is sampled in steps of up to 3/720.
            prop_assume!(reach.abs() > 0.01);
            prop_assert_eq!(diagram(b, c, remainder).alternates_over(from, to), reach > 0.0);
        }

        #[test]
        fn signs_alternate_exactly_in_the_quadrant_to_avoid(
            b in 0.0..TAU, c in 0.0..TAU, sign in 0..2usize,
        ) {
            let diagram = diagram(b, c, [1.0, -1.0][sign]);
            let [_, probe] = diagram.quadrants();
            prop_assume!(diagram.avoid().is_some() && probe.is_some());
            let signs: String = diagram.signs().unwrap().iter().collect();
            let alternate = signs == "+-+" || signs == "-+-";
            prop_assert_eq!(probe == diagram.avoid(), alternate);
            // Section 4.2.4: from octant A to C or F, across the plane of u alone, or across those of R and v.
            let across = diagram.across().unwrap();
            prop_assert_eq!(across == [false, true, false] || across == [true, false, true], alternate);
        }
    }
}
