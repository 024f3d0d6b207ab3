//! `inplace-lab bench audit`: what finds wrong labels.

use inplace_core::export;
use inplace_core::scene::SceneSource;
use inplace_core::session::Progress;

use super::{Failure, begin};
use crate::arguments::AuditArguments;
use crate::page::{Page, known};
use crate::table::csv;
use crate::{AuditPoint, audits};

/// The columns of `audit.csv`.
const COLUMNS: &str = "scene clicks seed accuracy:4 frames places audits within_3:4 error:4 covered:4 half_width:4 \
                       planted listed listed_right missed";

/// Measures every scene, writes `audit.csv`, and prints.
pub fn run(arguments: &AuditArguments) -> Result<(), Failure> {
    let out = &arguments.on.output.out;
    begin(out, &arguments.on.scenes)?;
    let mut points = Vec::new();
    let progress = Progress::default();
    for argument in &arguments.on.scenes {
        for &clicks in &arguments.clicks {
            for number in 0..arguments.seeds {
                let source = SceneSource::from_argument(argument);
                let mut options = arguments.on.training.session_options(source);
                options.seed += number;
                progress.show(format!(
                    "{}: {clicks} clicks, seed {}",
                    argument.display(),
                    options.seed
                ));
                let share = arguments.share / 100.0;
                points.push(audits(&options, clicks.into(), share, arguments.audits.into())?);
            }
        }
    }
    export::write(&out.join("audit.csv"), csv(&points, COLUMNS)?.as_bytes())?;
    page(&points).publish(&arguments.on.output, "audit", &points)
}

fn page(points: &[AuditPoint]) -> Page {
    let mut page = Page::default();
    page.paragraph(
        "Audits of the maps after random clicks of every class: the true accuracy, per cent of the audits within 3 points \
         of it, their root mean squared error in points, per cent whose 95% interval holds it, and half of its mean width \
         in points. Then one stroke in ten gets a wrong class: how many of those are listed as contradicted, and of the \
         others.",
    );
    let rows = points.iter().map(|point| {
        let of = |value: f64, decimals| known(100.0 * value, decimals);
        vec![
            point.scene.clone(),
            point.clicks.to_string(),
            point.seed.to_string(),
            of(point.accuracy, 1),
            point.frames.to_string(),
            point.places.to_string(),
            of(point.within_3, 0),
            of(point.error, 2),
            of(point.covered, 0),
            of(point.half_width, 1),
            format!("{} of {}", point.listed, point.planted),
            point.listed_right.to_string(),
        ]
    });
    let header = "scene | clicks | seed | accuracy | frames | places | within 3 | error | covered | half width | \
                  planted, listed | others";
    page.table(header, &rows.collect::<Vec<_>>());
    page
}
