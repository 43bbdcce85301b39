//! The loop of a design with each plant, for plots.

use nalgebra::Complex;

use super::design::{Design, DesignTask};
use super::figures::loop_pairs;
use super::sampled::{SampledPlant, Spacing};

/// Loop and controller over frequency.
#[derive(Clone, Debug)]
pub struct LoopCurve {
    /// Name of the plant.
    pub plant: String,
    /// Rising frequencies in rad/s.
    pub omega_rad_s: Vec<f64>,
    /// L = P C.
    pub open_loop: Vec<Complex<f64>>,
    /// C in A/m.
    pub controller: Vec<Complex<f64>>,
}

/// The loop of a design with each of its plants, without the modes that these lack.
pub fn loop_curves(task: &DesignTask, design: &Design) -> Vec<LoopCurve> {
    let plants = task.plants.iter();
    let sampled = plants.map(|plant| {
        let pairs = loop_pairs(plant, &design.cascade);
        SampledPlant::of(plant, &task.bound, Spacing::Fine, &pairs)
    });
    sampled.map(|plant| LoopCurve::of(plant, design)).collect()
}

impl LoopCurve {
    fn of(plant: SampledPlant, design: &Design) -> LoopCurve {
        let controller = plant.warped.iter().map(|s| design.cascade.response(*s));
        let controller: Vec<Complex<f64>> = controller.collect();
        let products = plant.response.iter().zip(&controller).map(|(p, c)| p * c);
        LoopCurve {
            plant: plant.name,
            omega_rad_s: plant.omega_rad_s,
            open_loop: products.collect(),
            controller,
        }
    }
}
