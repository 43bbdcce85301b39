//! Chapter 5: the map of the stage that was designed and of the one that was built.

use super::model::{Model, even};
use super::{Comparison, Content, FigureError, Runs};
use bench_config::PlantSettings;
use bench_plant::zeros::cnmp_map;
use bench_report::colours::Colour;
use bench_report::{Chart, Mark, Scale};

pub(crate) fn fig_5_2(_: &Runs) -> Result<Content, FigureError> {
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
    for (heading, name) in [
        ("(a) Stage of Chapter 2", "chapter2"),
        ("(b) Stage of Chapter 5", "stage"),
    ] {
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
        let below = map
            .iter()
            .flat_map(|row| row.iter().zip(&asymmetries))
            .all(|(pairs, d)| *d > 0.0 || *pairs == 0);
        let cells = Mark::Cells {
            x: edges(&asymmetries),
            y: edges(&points),
            rows: map
                .iter()
                .map(|row| row.iter().map(|pairs| usize::from(*pairs > 0)).collect())
                .collect(),
            colours: vec![
                ("no CNMP zeros".into(), Colour(222, 235, 247)),
                ("CNMP zeros".into(), Colour(0, 0, 0)),
            ],
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
