//! `inplace-lab bench stereo`: depth from colours alone, beside measured depth.

use inplace_core::scene::{OpenOptions, Scene, SceneSource};
use inplace_core::session::Progress;
use inplace_core::{cores, export};

use super::{Failure, begin};
use crate::arguments::StereoArguments;
use crate::page::{Page, known};
use crate::table::csv;
use crate::{StereoPoint, stereo_depth};

/// The columns of `stereo.csv`.
const COLUMNS: &str =
    "scene size stage seconds:2 complete:4 error:5 within_1:4 within_5:4 within_10:4 edge_error:5";

/// Measures every scene, writes `stereo.csv`, and prints.
pub fn run(arguments: &StereoArguments) -> Result<(), Failure> {
    let out = &arguments.output.out;
    begin(out, &arguments.scenes)?;
    let threads = arguments.threads.map_or_else(cores, usize::from);
    let pool = rayon::ThreadPoolBuilder::new().num_threads(threads).build()?;
    let mut points = Vec::new();
    for argument in &arguments.scenes {
        let source = SceneSource::from_argument(argument);
        let options = OpenOptions {
            outside_files: arguments.outside_files,
            ..OpenOptions::default()
        };
        let scene = Scene::open(&source, options, &|_, _| {})?;
        let progress = Progress::default();
        let told = |share: f32| progress.show_share(argument.display().to_string(), share);
        points.extend(pool.install(|| stereo_depth(&scene, &told))?);
    }
    export::write(&out.join("stereo.csv"), csv(&points, COLUMNS)?.as_bytes())?;
    page(threads, &points).publish(&arguments.output, "stereo", &points)
}

fn page(threads: usize, points: &[StereoPoint]) -> Page {
    let mut page = Page::default();
    page.paragraph(&format!(
        "Depth from colours alone, {threads} threads: per cent of the pixels that have depth, relative errors of the \
         median pixel and of that near edges of the measured depth, and per cent of the pixels within 1, 5 and 10%."
    ));
    let rows = points.iter().map(|point| {
        let of = |values: &[f64]| {
            values
                .iter()
                .map(|value| known(100.0 * value, 1))
                .collect::<Vec<_>>()
        };
        let mut row = vec![point.scene.clone(), format!("{} {}", point.size, point.stage)];
        row.push(format!("{:.1}", point.seconds));
        row.extend(of(&[point.complete]));
        row.extend([point.error, point.edge_error].map(|error| known(100.0 * error, 2)));
        row.extend(of(&[point.within_1, point.within_5, point.within_10]));
        row
    });
    let header = "scene | stage | seconds | complete | median | at edges | 1% | 5% | 10%";
    page.table(header, &rows.collect::<Vec<_>>());
    page
}
