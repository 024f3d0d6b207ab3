//! Rooms that are hard by themselves: each is generated, with its truth, in place of the demo's.

use rand::{Rng, rngs::SmallRng};

use super::trial::Trial;
use super::{Condition, Line, disturbed};
use crate::hard::HardRoom;
use crate::{LabelImage, SceneTruth};
use inplace_core::labels::ClassId;
use inplace_core::scene::demo::Shot;

pub(super) fn conditions() -> Vec<Condition> {
    let tried = |name, what, answer, least, room, without_depth: bool| Condition {
        demo_only: true,
        ..disturbed(name, what, answer, Line::Least(least), move |trial, rng| {
            enter(trial, rng, room);
            if without_depth {
                trial.without_depth();
            }
        })
    };
    let of = |name, what, answer, least, room| tried(name, what, answer, least, room, false);
    vec![
        of(
            "thin",
            "a room of poles, rods, wire chairs and cables, 1 to 2 cm thick",
            "keeps voxels of a few pixels' width, and lets single pixels choose at borders",
            0.5,
            HardRoom::Thin,
        ),
        of(
            "plain",
            "walls, floor, ceiling and blocks of one white, without texture",
            "takes bends of the surface for borders where colours say nothing",
            0.7,
            HardRoom::Plain,
        )
        .limited_by("shallow bends between white and white are no border")
        .in_short(),
        tried(
            "plain-no-depth",
            "the same room, colours alone",
            "continues what little the views match, and believes it as little",
            0.4,
            HardRoom::Plain,
            true,
        )
        .limited_by("white on white has no depth to match: shading is all that there is"),
        of(
            "same-colour",
            "two classes of one material, flush, without a seam; the 20 cm around it are not measured",
            "finds no border where there is none, and shares the surface half way between the labels",
            0.6,
            HardRoom::SameColour,
        ),
        of(
            "same-class-apart",
            "eight blocks of one class in eight colours, far apart; two of them are clicked",
            "knows the blocks without clicks only by what the semantic field has learnt of the clicked ones, and points at them as unsure",
            0.5,
            HardRoom::SameClassApart,
        )
        .limited_by("nothing says that things of a colour that no click has shown belong together: each colour needs a click"),
        of(
            "mirror",
            "a mirror of 1.2 x 1.6 m: its pixels have the colours and the depth of the room that it shows",
            "labels what is seen in it as what it looks like, unless clicked",
            0.4,
            HardRoom::Mirror,
        )
        .limited_by("its pixels have the depth of the room that it shows, so nothing says where it is"),
        of(
            "glass",
            "a glazed cabinet: its panes have the colours, slightly tinted, and the depth of what is behind them",
            "labels what is seen through it by the pixels' own depth",
            0.5,
            HardRoom::Glass,
        ),
    ]
}

/// Goes into another room, with as many frames of the same size, and clicks there.
fn enter(trial: &mut Trial, rng: &mut SmallRng, room: HardRoom) {
    let camera = &trial.scene.frames[0].camera;
    let shot = Shot::new(trial.scene.frames.len(), [camera.width, camera.height]);
    let scene = room.scene(&shot);
    let clickable = truth(&shot, room.clickable(&shot));
    *trial = Trial::new(&scene, &clickable, rng.random());
    trial.truth = truth(&shot, room.ground_truth(&shot));
    trial.labels.classes = room.classes();
}

/// Every second frame is held out, as the demo's.
fn truth(shot: &Shot, labels: Vec<Vec<ClassId>>) -> SceneTruth {
    let image = |labels| LabelImage::new([shot.width, shot.height], labels);
    let images = labels.into_iter().map(image);
    let (test, train) = (0..shot.frames).partition(|frame| frame % 2 == 1);
    SceneTruth {
        images: images.enumerate().collect(),
        train,
        test,
        ..SceneTruth::default()
    }
}
