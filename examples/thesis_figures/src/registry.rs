//! All figures and tables: one line each, in the order of the thesis.

use super::chapter1::*;
use super::chapter2::*;
use super::chapter3::*;
use super::chapter4::*;
use super::chapter5::*;
use super::chapter6::*;
use super::tables::*;
use super::{Content, FigureError, Runs};

/// A figure or table of the thesis.
#[derive(Clone, Copy, Debug)]
pub struct Entry {
    /// `2-5`, or `table-2-2`.
    pub number: &'static str,
    /// As its caption.
    pub title: &'static str,
    /// How it is made, or why not.
    pub make: Make,
}

/// How a figure is made.
#[derive(Clone, Copy, Debug)]
pub enum Make {
    /// By this function.
    Draw(fn(&Runs) -> Result<Content, FigureError>),
    /// It cannot be computed, for this reason.
    Not(&'static str),
}

impl Entry {
    /// `Fig 2-5`, `Table 2-2`.
    pub fn name(&self) -> String {
        match self.number.strip_prefix("table-") {
            Some(number) => format!("Table {number}"),
            None => format!("Fig {}", self.number),
        }
    }

    /// Name and title.
    pub fn heading(&self) -> String {
        format!("{}. {}", self.name(), self.title)
    }

    /// Its anchor on the page.
    pub fn id(&self) -> String {
        if self.number.starts_with("table-") {
            self.number.into()
        } else {
            format!("fig-{}", self.number)
        }
    }

    /// The name of its SVG.
    pub fn file(&self) -> String {
        format!("{}.svg", self.id())
    }

    /// `2`.
    pub fn chapter(&self) -> &'static str {
        let number = self.number.trim_start_matches("table-");
        number.split('-').next().unwrap_or(number)
    }
}

const fn draw(
    number: &'static str,
    title: &'static str,
    make: fn(&Runs) -> Result<Content, FigureError>,
) -> Entry {
    Entry {
        number,
        title,
        make: Make::Draw(make),
    }
}

const fn not(number: &'static str, title: &'static str, why: &'static str) -> Entry {
    Entry {
        number,
        title,
        make: Make::Not(why),
    }
}

/// All entries.
pub const FIGURES: &[Entry] = &[
    not(
        "1-1",
        "A comparison between different mechanisms",
        "drawings and photographs",
    ),
    not(
        "1-2",
        "The XY flexure mechanism and its system identification",
        "a drawing, and a measurement whose data are not printed; Table 2-3 has the phase drops of its model",
    ),
    draw(
        "1-3",
        "Geometric illustration of the opening angle",
        fig_1_3,
    ),
    draw(
        "1-4",
        "Geometric illustration of NMP zeros' limitation",
        fig_1_4,
    ),
    not(
        "1-5",
        "Illustration of research framework and related tasks",
        "a diagram of chapters",
    ),
    not(
        "2-1",
        "Double parallelogram flexure module (DPFM)",
        "a drawing of the mechanism without figures",
    ),
    not(
        "2-2",
        "Simple representative flexure mechanism",
        "a drawing of the mechanism; its stages stand in Fig 2-3",
    ),
    draw("2-3", "Mode shapes of the SR4DoF", fig_2_3),
    draw(
        "2-4",
        "G(s) for different operating points and mass asymmetry",
        fig_2_4,
    ),
    draw("2-5", "Contour map of the Δ function", fig_2_5),
    draw(
        "2-6",
        "Eigenvalue loci and eigenvector elements of the 3rd and 4th modes",
        fig_2_6,
    ),
    draw(
        "table-2-2",
        "Eigenvectors of the SR4DoF mechanism at 5 % of L",
        table_2_2,
    ),
    draw(
        "table-2-3",
        "Deviations of masses that cause different phase drops",
        table_2_3,
    ),
    not(
        "3-1",
        "Definition of all types of zeros",
        "a drawing of names; `bench model modes` prints the kind of each zero",
    ),
    draw(
        "3-2",
        "Migration of zeros (double integrator + single mode)",
        fig_3_2,
    ),
    draw(
        "3-3",
        "Bode plot of G(s) in decomposed modes showing MMP zeros",
        fig_3_3,
    ),
    draw(
        "3-4",
        "Decomposed modes under different modal residues (double integrator + single mode)",
        fig_3_4,
    ),
    draw(
        "3-5",
        "Numerical comparison: MMP case and RMP-RNMP case",
        fig_3_5,
    ),
    draw(
        "3-6",
        "Nyquist plot of G(s): MMP case and RMP-RNMP case",
        fig_3_6,
    ),
    not(
        "3-7",
        "Example of second order modes in the negative direction",
        "a drawing of a cart without parameters, and a Nyquist plot of a loop without controller; Fig 3-14 shows such loops",
    ),
    draw(
        "3-8",
        "Migration of zeros (two second order modes)",
        fig_3_8,
    ),
    draw(
        "3-9",
        "The locus of zeros under different values of αu/αv",
        fig_3_9,
    ),
    draw("3-10", "The family of the zero locus of G(s)", fig_3_10),
    draw(
        "3-11",
        "Decomposed modes under different modal residues (double integrator + two modes)",
        fig_3_11,
    ),
    draw(
        "3-12",
        "Numerical example of a system with CNMP zeros, under different α0",
        fig_3_12,
    ),
    draw(
        "3-13",
        "Nyquist plot of G(s) showing the phase change",
        fig_3_13,
    ),
    draw(
        "3-14",
        "Nyquist plot of open loop transfer functions under different situations",
        fig_3_14,
    ),
    draw(
        "3-15",
        "Migration of zeros with non-zero damping ratios (two modes)",
        fig_3_15,
    ),
    draw(
        "3-16",
        "Migration of zeros under different damping ratios (two modes with a remainder)",
        fig_3_16,
    ),
    draw(
        "table-3-1",
        "Sequences of dominant modes and zero types (double integrator + mode)",
        table_3_1,
    ),
    draw(
        "table-3-2",
        "Sequences of dominant modes and zero types (two modes)",
        table_3_2,
    ),
    draw(
        "table-3-3",
        "Sequences of dominant modes and zero types (double integrator + two modes)",
        table_3_3,
    ),
    draw(
        "table-3-4",
        "Sequences of dominant modes and zero types (two modes + constant)",
        table_3_4,
    ),
    draw("4-1", "3 DoF spring mass model", fig_4_1),
    draw("4-2", "The parabola of CMP-CNMP zeros", fig_4_2),
    not(
        "4-3",
        "Spring-mass system with lever arms",
        "a drawing of a system without parameters",
    ),
    draw(
        "4-4",
        "Change of sequence of the dominant mode due to curve veering",
        fig_4_4,
    ),
    not(
        "4-5",
        "The spaces divided by the eigenvectors",
        "drawn by `bench model placement`, for the sensor and actuator vectors of any profile; the thesis prints none",
    ),
    draw(
        "4-6",
        "Dynamic properties with different values of k",
        fig_4_6,
    ),
    draw(
        "4-7",
        "Lumped parameter flexure model: the close modes",
        fig_4_7,
    ),
    draw(
        "4-8",
        "Dynamic properties of the SR4DoF flexure mechanism",
        fig_4_8,
    ),
    draw(
        "4-9",
        "Four DoF mass-spring model: the two modes of interest",
        fig_4_9,
    ),
    draw("4-10", "Dynamic properties of the 4 DoF model", fig_4_10),
    not(
        "5-1",
        "Simple representative 4 DoF model",
        "a drawing, as Fig 2-2",
    ),
    draw("5-2", "Complex non-minimum phase zero map", fig_5_2),
    not(
        "5-3",
        "Illustration of geometric evolution",
        "drawings of designs",
    ),
    not(
        "5-4",
        "Examples of un-modeled modes in Design-2",
        "shapes by finite elements of a part that is not printed",
    ),
    not(
        "5-5",
        "Examples of un-modeled modes in Design-4",
        "shapes by finite elements of a part that is not printed",
    ),
    not(
        "5-6",
        "Mode shapes of Design-4x",
        "shapes by finite elements of a part that is not printed",
    ),
    not("5-7", "Virtual pulley with long cable", "a drawing"),
    not("5-8", "Experimental setup hardware", "a photograph"),
    not(
        "5-9",
        "Experimental frequency response, asymmetry 10 %, operating point 8 %",
        "a measurement whose data are not printed; Fig 6-7 has the same conditions on the simulated rig",
    ),
    not(
        "5-10",
        "Simulation and experimental results of the CNMP map",
        "150 measurements whose data are not printed, over the map of Fig 5-2",
    ),
    not(
        "5-11",
        "Experimental frequency response, asymmetry 0 %, operating point 8 %",
        "a measurement whose data are not printed; `bench chirp --asymmetry -2%` makes it on the simulated rig, with the estimated initial asymmetry",
    ),
    not(
        "table-5-1",
        "FEA results of each design",
        "frequencies by finite elements of parts that are not printed; the unmodelled modes of Design-4x stand in the profile stage",
    ),
    not(
        "6-1",
        "Classic control loop with unity feedback",
        "a block diagram without figures",
    ),
    draw(
        "6-2",
        "Characteristics of a controller with a bandwidth below the first resonance",
        fig_6_2,
    ),
    draw(
        "6-3",
        "Properties of the numerical set 7.98, −1.65, 1.52",
        fig_6_3,
    ),
    draw(
        "6-4",
        "Compensator and open loop transfer function",
        fig_6_4,
    ),
    draw(
        "6-5",
        "Properties of the numerical set 7.98, 1.65, −1.52",
        fig_6_5,
    ),
    draw("6-6", "Controllers with different damping ratios", fig_6_6),
    draw(
        "6-7",
        "Frequency response of SR4DoF, model and measurement",
        fig_6_7,
    ),
    draw(
        "6-8",
        "First controller (slow), open loop transfer function",
        fig_6_8,
    ),
    draw(
        "6-9",
        "The close modes under an increasing operating point",
        fig_6_9,
    ),
    draw(
        "6-10",
        "Second controller (fast), open loop transfer function",
        fig_6_10,
    ),
    draw(
        "6-11",
        "Comparison between fast and slow controller",
        fig_6_11,
    ),
    draw(
        "6-12",
        "Comparison between fast and slow controller, with the measured plant",
        fig_6_12,
    ),
    draw("6-13", "Fast and slow control, measured", fig_6_13),
];

/// The entries of these numbers, in the order of the thesis; all of them for no number.
pub fn selected(numbers: &[String]) -> Result<Vec<&'static Entry>, FigureError> {
    let known = |number: &String| FIGURES.iter().any(|entry| entry.number == number.trim());
    if let Some(unknown) = numbers.iter().find(|number| !known(number)) {
        let known = FIGURES
            .iter()
            .map(|entry| entry.number)
            .collect::<Vec<_>>()
            .join(", ");
        return Err(FigureError::Unknown {
            unknown: format!("`{}`", unknown.trim()),
            known,
        });
    }
    let wanted = |entry: &&Entry| {
        numbers.is_empty() || numbers.iter().any(|number| number.trim() == entry.number)
    };
    Ok(FIGURES.iter().filter(wanted).collect())
}
