//! The quadrants and octants of section 4.2.4 (Fig 4-5): where actuator and probe are among the shapes of the close modes.
//!
//! ```text
//!            phi_v                      b: what the actuator does to the plane of the two shapes, c: what the probe sees of it
//!      II     |     I
//!             |    c                    au = (b . phi_u)(c . phi_u): the sign says whether b and c are on the same side of
//!   ----------+---------- phi_u         L(phi_u), the line across phi_u; likewise av and L(phi_v)
//!             | \                       au av < 0: b and c in quadrants side by side
//!     III     |  b  IV
//! ```
//!
//! The thesis projects the configuration vectors onto the plane of the shapes with the usual product, in which two shapes
//! are only nearly at right angles. Here the product is that of the mass matrix, in which they are exactly so: a vector q
//! is M^-1 q, its components are q^T phi for shapes of unit modal mass, the signs are the same, and the product of two components
//! *is* the residue of Eq. (4-15). Lengths are parts of the whole vector: 1 lies wholly in the plane.
//!
//! The frame is that of the two shapes where they are closest. As the setting varies, phi_u and phi_v turn in it by an
//! angle, and the lines with them; b and c stay, as far as the plane stays. So the one picture at the veering point
//! foretells the signs before and after it: au + av = b . c stays, and the signs alternate where
//!
//! ```text
//!   -sign(aR) cos(2 t - t_b - t_c) > |cos(t_b - t_c)|       t, t_b, t_c: angles of phi_u, b, c
//! ```
//!
//! With mode R as the third axis the quadrants are octants. A probe in the quadrant that [`QuadrantDiagram::avoid`] names, on its side
//! of the third plane, makes the signs alternate (C4-1), without which there are no CMP-CNMP zeros (P4-1).

use nalgebra::DVector;

use super::{CloseModes, ModesAt};

/// Steps in which the turn of the shapes is gone through.
const STEPS: usize = 720;
/// Residues below this ratio of what the plane carries are rounding of the angles.
const ROUNDING: f64 = 1e-12;

/// Actuator and probe among the shapes at one value.
#[derive(Clone, Debug, PartialEq)]
pub struct QuadrantDiagram {
    /// The setting.
    pub value: f64,
    /// Directions of phi_u and phi_v in the frame, of unit length.
    pub shapes: [[f64; 2]; 2],
    /// Components of the actuator along phi_u and phi_v, parts of its length.
    pub actuator: [f64; 2],
    /// Components of the probe, likewise.
    pub sensor: [f64; 2],
    /// aR, au, av in 1/kg; `None` where the modes cross.
    pub residues_per_kg: Option<[f64; 3]>,
}

impl QuadrantDiagram {
    /// At `at`, in the frame of the pair's shapes at `frame`.
    pub fn of(
        at: &ModesAt,
        frame: &ModesAt,
        pair: [usize; 2],
        [force, sensor]: &[DVector<f64>; 2],
    ) -> QuadrantDiagram {
        let [i, j] = pair;
        let ordered = if at.omega_rad_s[i] <= at.omega_rad_s[j] {
            [i, j]
        } else {
            [j, i]
        };
        let direction = |mode| unit(pair.map(|other| at.cosine(mode, frame, other)));
        let crossing = at.are_equal(pair);
        let components = |row: &DVector<f64>| {
            let raw: Vec<f64> = (0..at.omega_rad_s.len())
                .map(|mode| at.gain(mode, row))
                .collect();
            let length = raw.iter().map(|gain| gain * gain).sum::<f64>().sqrt();
            let gains = if crossing { raw } else { at.gains(row) };
            ordered.map(|mode| {
                if length > 0.0 {
                    gains[mode] / length
                } else {
                    0.0
                }
            })
        };
        let modes = if crossing {
            None
        } else {
            CloseModes::of(&at.terms(force, sensor), pair)
        };
        QuadrantDiagram {
            value: at.value,
            shapes: ordered.map(direction),
            actuator: components(force),
            sensor: components(sensor),
            residues_per_kg: modes.map(|modes| modes.residues_per_kg()),
        }
    }

    /// The quadrants of actuator and probe, 1 to 4 against the clock from that of positive components; `None` on a line.
    pub fn quadrants(&self) -> [Option<usize>; 2] {
        [self.actuator, self.sensor].map(quadrant)
    }

    /// Signs of aR, au, av: `+`, `-`, or `0` of a mode that does not show. `None` where the modes cross.
    pub fn signs(&self) -> Option<[char; 3]> {
        let sign = |residue: f64| match residue {
            r if r > 0.0 => '+',
            r if r < 0.0 => '-',
            _ => '0',
        };
        self.residues_per_kg.map(|residues| residues.map(sign))
    }

    /// The octant of the probe beside the actuator's: whether it is on the other side of the planes of R, u, v. C4-1 holds for
    /// `[false, true, false]` and `[true, false, true]`. `None` where the modes cross.
    pub fn across(&self) -> Option<[bool; 3]> {
        self.residues_per_kg
            .map(|residues| residues.map(|residue| residue < 0.0))
    }

    /// The quadrant in which a probe, with its aR as it is, would make the signs alternate.
    pub fn avoid(&self) -> Option<usize> {
        let remainder = self.residues_per_kg?[0];
        quadrant([-remainder * self.actuator[0], remainder * self.actuator[1]])
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
        let Some([remainder, ..]) = self.residues_per_kg else {
            return false;
        };
        let (b, c) = (self.in_frame(self.actuator), self.in_frame(self.sensor));
        let least = ROUNDING * dot(b, b).sqrt() * dot(c, c).sqrt();
        let side = (self.shapes[0][0] * self.shapes[1][1] - self.shapes[0][1] * self.shapes[1][0])
            .signum();
        let at = |step: usize| from_rad + (to_rad - from_rad) * step as f64 / STEPS as f64;
        (0..=STEPS).map(at).any(|turn| {
            let (u, v) = (
                [turn.cos(), turn.sin()],
                [-side * turn.sin(), side * turn.cos()],
            );
            let residue = |shape| dot(b, shape) * dot(c, shape) * remainder.signum();
            remainder != 0.0 && residue(u) < -least && residue(v) > least
        })
    }
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

#[cfg(test)]
mod tests {
    use super::*;
    use proptest::prelude::*;
    use std::f64::consts::{PI, TAU};

    fn picture(b: f64, c: f64, remainder: f64) -> QuadrantDiagram {
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
            // The turn is gone through in steps of up to 3/720.
            prop_assume!(reach.abs() > 0.01);
            prop_assert_eq!(picture(b, c, remainder).alternates_over(from, to), reach > 0.0);
        }

        #[test]
        fn a_probe_in_the_quadrant_to_avoid_has_alternating_signs_and_no_other(
            b in 0.0..TAU, c in 0.0..TAU, sign in 0..2usize,
        ) {
            let picture = picture(b, c, [1.0, -1.0][sign]);
            let [_, probe] = picture.quadrants();
            prop_assume!(picture.avoid().is_some() && probe.is_some());
            let signs: String = picture.signs().unwrap().iter().collect();
            let alternate = signs == "+-+" || signs == "-+-";
            prop_assert_eq!(probe == picture.avoid(), alternate);
            // Section 4.2.4: from octant A to C or F, across the plane of u alone, or across those of R and v.
            let across = picture.across().unwrap();
            prop_assert_eq!(across == [false, true, false] || across == [true, false, true], alternate);
        }
    }
}
