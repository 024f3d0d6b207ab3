//! Tests of the objects on a surface.

use std::sync::Arc;

use super::*;
use crate::labels::testing::{clicked, label_images, object};
use crate::labels::{History, ImportedMap, Label, LabelImages, LabelSet, Stroke, Trust};
use crate::scene::Scene;
use crate::scene::testing::wall;
use crate::semantics::testing::{node, propagated, truth};
use crate::semantics::{FrameMap, LabelPropagation, Look, Node, SurfaceGraph, SurfaceImport};

/// Squares of 10 x 10 nodes, 5 cm apart, which begin at these places.
fn squares(places: &[f32]) -> Surface {
    let square = |&x: &f32| -> Vec<Node> {
        let place = |k: usize| Vec3::new(x + 0.05 * (k % 10) as f32, 0.05 * (k / 10) as f32, 0.0);
        (0..100).map(|k| node(place(k))).collect()
    };
    let graph = SurfaceGraph::new(places.iter().flat_map(square).collect(), 5);
    Surface {
        look: Arc::new(Look::new(&graph, Vec3::Y)),
        graph,
        voxel: 0.05,
        ..Surface::default()
    }
}

fn posterior(labels: Vec<ClassId>) -> Posterior {
    Posterior {
        labels,
        ..Posterior::default()
    }
}

/// Squares of these classes.
fn of_squares(classes: &[ClassId]) -> Vec<ClassId> {
    classes.iter().flat_map(|&class| [class; 100]).collect()
}

/// The objects of floor, 1, chair, 2, and table, 3, of which these are listed.
fn found(
    surface: &Surface,
    posterior: &Posterior,
    listed: &[Object],
    before: Option<&SurfaceObjects>,
) -> SurfaceObjects {
    let classes = [(1, "floor"), (2, "chair"), (3, "table")].map(|(id, name)| Class::new(id, name));
    SurfaceObjects::new(surface, posterior, (&classes, listed), before)
}

/// Number and name of the objects, and the number of nodes.
fn told(objects: &SurfaceObjects) -> Vec<(u16, &str, usize)> {
    let nodes = |id| objects.of_nodes.iter().filter(|own| **own == Some(id)).count();
    let all = objects.objects.iter();
    all.map(|object| (object.id.number(), object.name.as_str(), nodes(object.id)))
        .collect()
}

const THREE_CHAIRS: [(u16, &str, usize); 3] = [(1, "chair 1", 100), (2, "chair 2", 100), (3, "chair 3", 100)];

#[test]
fn chairs_apart_are_two_a_leg_seen_apart_belongs_to_its_chair_and_stuff_has_no_objects() {
    // The last square is a leg but for its first nodes.
    let surface = squares(&[0.0, 2.0, 2.7]);
    let mut labels = vec![2; 300];
    labels[205..].fill(1);
    let objects = found(&surface, &posterior(labels), &[], None);
    assert_eq!(told(&objects), [(1, "chair 1", 100), (2, "chair 2", 105)]);
    assert_eq!(objects.of_node(204), objects.of_node(150));
    assert_ne!(objects.of_node(0), objects.of_node(150));
    assert_eq!((objects.of_node(299), objects.of_node(300)), (None, None));
}

#[test]
fn an_object_that_a_label_says_leaves_parts_elsewhere_as_they_are_but_for_fragments() {
    // Only the last nodes of the third square are a leg; the others are floor.
    let surface = squares(&[0.0, 2.0, 4.0]);
    let mut labels = vec![2; 300];
    labels[200..295].fill(1);
    let stool = object(7, 2, "stool");
    let nearest = labels.iter().map(|&label| (label == 2).then_some(stool.id));
    let posterior = Posterior {
        objects: nearest.collect(),
        telling: vec![20],
        ..posterior(labels.clone())
    };
    let objects = found(&surface, &posterior, &[stool], None);
    assert_eq!(told(&objects), [(7, "stool", 105), (8, "chair 1", 100)]);
    assert_eq!(objects.of_node(297), objects.of_node(20));
}

#[test]
fn an_object_that_the_list_lacks_by_now_is_none() {
    let surface = squares(&[0.0, 2.0]);
    let posterior = Posterior {
        objects: vec![ObjectId::new(9); 200],
        telling: vec![20],
        ..posterior(vec![2; 200])
    };
    let objects = found(&surface, &posterior, &[], None);
    assert_eq!(told(&objects), [(1, "chair 1", 100), (2, "chair 2", 100)]);
}

#[test]
fn what_is_labelled_is_an_object_sooner_and_has_the_first_number_and_keeps_its_name() {
    // Of the first square a fifth is a chair.
    let surface = squares(&[0.0, 2.0, 4.0]);
    let mut labels = of_squares(&[2, 2, 1]);
    labels[20..100].fill(1);
    let known = |labels: &[ClassId], labelled: &[usize], before: Option<&SurfaceObjects>| {
        let mut posterior = posterior(labels.to_vec());
        posterior.distances = vec![1.0; 300];
        labelled.iter().for_each(|&node| posterior.distances[node] = 0.0);
        found(&surface, &posterior, &[], before)
    };
    assert_eq!(told(&known(&labels, &[150], None)), [(1, "chair 1", 120)]);
    let both = known(&labels, &[10], None);
    assert_eq!(told(&both), [(1, "chair 1", 20), (2, "chair 2", 100)]);
    // A chair of which only a fifth was right is the same chair, and what was taken for its rest is a new one.
    let one = known(&labels, &[150], None);
    let apart = known(&labels, &[10], Some(&one));
    assert_eq!(apart.of_node(10), one.of_node(150));
    assert_eq!(told(&apart), told(&both));
}

#[test]
fn parts_keep_numbers_and_names_while_labels_change() {
    let surface = squares(&[0.0, 2.0, 4.0]);
    let known = |labels: &[ClassId], objects: &[Object], before: Option<&SurfaceObjects>| {
        let mut posterior = posterior(of_squares(labels));
        if let Some(object) = objects.first() {
            posterior.objects = vec![None; 300];
            posterior.objects[100..200].fill(Some(object.id));
            posterior.telling = vec![150];
        }
        found(&surface, &posterior, objects, before)
    };
    let two = known(&[1, 2, 2], &[], None);
    assert_eq!(told(&two), [(1, "chair 1", 100), (2, "chair 2", 100)]);
    let three = known(&[2, 2, 2], &[], Some(&two));
    assert_eq!(told(&three), THREE_CHAIRS);
    assert_eq!(three.of_node(150), two.of_node(150));
    let last = known(&[2, 1, 2], &[], Some(&three));
    assert_eq!(told(&last), [(2, "chair 2", 100), (3, "chair 3", 100)]);
    // One that a person names takes the number and name that it had.
    let armchair = object(three.of_node(150).unwrap().number(), 2, "armchair");
    let named = known(&[2, 2, 2], &[armchair], Some(&three));
    assert_eq!(
        told(&named),
        [(1, "armchair", 100), (2, "chair 2", 100), (3, "chair 3", 100)]
    );
    assert_eq!(named.told, 1);
}

#[test]
fn parts_that_are_known_from_before_keep_numbers_and_names_on_another_surface_though_other_labels_came() {
    let surface = squares(&[0.0, 2.0, 4.0]);
    let two = found(&surface, &posterior(of_squares(&[1, 2, 2])), &[], None);
    let parts = two.parts(&surface);
    assert_eq!(
        parts.iter().map(|part| part.places.len()).collect::<Vec<_>>(),
        [15; 2]
    );
    // The scene is opened again, its surface begins elsewhere, and what was floor is a chair.
    let again = squares(&[4.01, 2.01, 0.01]);
    let recalled = SurfaceObjects::recalled(&again, &parts);
    let three = found(&again, &posterior(vec![2; 300]), &[], Some(&recalled));
    let number = |node| three.of_node(node).unwrap().number();
    assert_eq!([0, 100, 200].map(number), [2, 1, 3]);
    // A chair that is new gets a new name.
    assert_eq!(told(&three), THREE_CHAIRS);
}

#[test]
fn objects_are_found_again_on_another_surface() {
    let (surface, other) = (squares(&[0.0, 2.0]), squares(&[2.01, 0.01, 9.0]));
    let objects = found(&surface, &posterior(vec![2; 200]), &[], None);
    let labels = [vec![2; 150], vec![3; 50], vec![2; 100]].concat();
    let moved = objects.on(&surface, (&other, &posterior(labels)));
    assert_eq!([0, 99].map(|node| moved.of_node(node)), [objects.of_node(150); 2]);
    assert_eq!(moved.of_node(100), objects.of_node(0));
    assert_eq!(
        [150, 250].map(|node| moved.of_node(node)),
        [None; 2],
        "another class, and nothing near"
    );
    assert_eq!(told(&moved), [(1, "chair 1", 50), (2, "chair 2", 100)]);
}

/// The wall with a click on each half, each as an object of one class.
fn halves() -> (Arc<Scene>, LabelSet, LabelPropagation) {
    let scene = Arc::new(wall(5, 64, 48));
    let mut history = clicked(&["panel"], &[]);
    for pixel in [[10, 20], [55, 20]] {
        history.add_object(Stroke::click(0, 1, pixel), &[]).unwrap();
    }
    let labels = history.labels().clone();
    let propagation = propagated(&scene, &labels);
    (scene, labels, propagation)
}

#[test]
fn found_objects_have_their_best_frame_and_the_strokes_on_them() {
    let (scene, mut labels, propagation) = halves();
    let objects = |labels: &LabelSet| {
        let listed = (labels.classes.as_slice(), labels.objects.as_slice());
        SurfaceObjects::new(propagation.surface(), propagation.posterior(), listed, None)
    };
    let strokes: Vec<_> = labels.strokes.keys().copied().collect();
    let listed = objects(&labels);
    let all = listed.found(propagation.surface(), &labels);
    let width = scene.frames[0].camera.width;
    for (found, object) in all.iter().zip(&labels.objects) {
        assert_eq!(&found.object, object);
        let click = found.click.as_ref().unwrap();
        let [x, y] = click.first_point().unwrap();
        let shown = propagation.surface().pixels[click.frame].node((y * width + x) as usize);
        assert_eq!(listed.of_node(shown.unwrap()), Some(object.id));
        assert!(
            found.frames > 1 && found.strokes.is_empty(),
            "its stroke names it"
        );
    }
    let pixels: u64 = all.iter().map(|found| found.pixels).sum();
    assert_eq!(pixels, 5 * 64 * 48);
    // A stroke that names none belongs to what it lies on.
    let stroke = Arc::make_mut(labels.strokes.get_mut(&strokes[1]).unwrap());
    stroke.object = None;
    let of_second = &listed.found(propagation.surface(), &labels)[1];
    assert_eq!(of_second.strokes, strokes[1..]);
}

/// The number of the object in every pixel of a frame.
fn pixels(propagation: &LabelPropagation, labels: &LabelSet, scene: &Arc<Scene>, frame: usize) -> Vec<u16> {
    let listed = (labels.classes.as_slice(), labels.objects.as_slice());
    let objects = SurfaceObjects::new(propagation.surface(), propagation.posterior(), listed, None);
    let map: FrameMap = propagation.map(scene, frame, 1);
    let found = |map: &FrameMap| map.looked_up_with(Some(&objects)).objects().unwrap().to_vec();
    assert_eq!(
        found(&map.looked_up()),
        found(&map),
        "whether it was looked up before or not"
    );
    found(&map)
}

/// Asserts that the halves of the wall have these numbers, but for some of the pixels at its border.
#[track_caller]
fn assert_halves(objects: &[u16], scene: &Scene, frame: usize, numbers: [u16; 2]) {
    let truth = truth(scene, frame).into_iter();
    let own = truth.map(|half| numbers[usize::from(half) - 1]);
    let wrong = own.zip(objects).filter(|(own, object)| own != *object);
    assert!(wrong.count() < objects.len() / 20);
}

#[test]
fn two_objects_of_a_class_divide_it_along_its_borders_with_one_number_in_all_frames() {
    let (scene, labels, mut propagation) = halves();
    for frame in 0..5 {
        let objects = pixels(&propagation, &labels, &scene, frame);
        assert_halves(&objects, &scene, frame, [1, 2]);
    }
    // Updates are exact: as if the labels had come at once.
    let mut changed = History::new(labels.clone());
    changed
        .merge_object(
            &labels.objects[1].clone().into(),
            &labels.objects[0].clone().into(),
        )
        .unwrap();
    propagation.set_labels(&scene, changed.labels());
    let anew = propagated(&scene, changed.labels());
    assert_eq!(propagation.posterior(), anew.posterior());
    assert!(
        pixels(&propagation, changed.labels(), &scene, 3)
            .iter()
            .all(|&object| object == 1)
    );
    changed.undo().unwrap();
    propagation.set_labels(&scene, changed.labels());
    assert_eq!(propagation.posterior(), propagated(&scene, &labels).posterior());
}

#[test]
fn imported_objects_have_what_images_say_in_all_frames_until_strokes_say_otherwise() {
    let scene = Arc::new(wall(5, 64, 48));
    for trust in [Trust::VOTES, Trust::RIGHT] {
        let map = |frame| {
            let halves = truth(&scene, frame);
            let label = |number| Label::new(1, ObjectId::new(10 * number));
            ImportedMap::with_objects(frame, &halves.into_iter().map(label).collect::<Vec<_>>())
        };
        let mut history = History::default();
        history.import(LabelImages {
            classes: vec![Class::new(1, "panel")],
            objects: vec![object(10, 1, "panel 10"), object(20, 1, "panel 20")],
            ..label_images((0..3).map(map).collect(), trust)
        });
        let mut propagation = propagated(&scene, history.labels());
        let mut follow = |history: &History| {
            propagation.set_labels(&scene, history.labels());
            if !propagation.has_import_of(history.labels()) {
                let import = SurfaceImport::new(propagation.surface(), history.labels());
                propagation.set_import(import.unwrap());
            }
            [3, 4].map(|frame| pixels(&propagation, history.labels(), &scene, frame))
        };
        let imported = follow(&history);
        for (frame, objects) in [3, 4].into_iter().zip(&imported) {
            assert_halves(objects, &scene, frame, [10, 20]);
        }
        // A stroke of the class alone leaves the objects as they are; one of a new object has what is near.
        history.add_stroke(Stroke::click(3, 1, [10, 24]));
        assert!(follow(&history) == imported, "{trust:?}");
        let (new, _) = history.add_object(Stroke::click(3, 1, [12, 24]), &[]).unwrap();
        let place = 24 * 64 + 12;
        let [divided, _] = follow(&history);
        assert_eq!((divided[place], imported[0][place]), (new.number(), 10));
        assert_eq!(divided[24 * 64 + 60], 20, "beyond the edge");
        history.undo().unwrap();
        assert!(follow(&history) == imported, "{trust:?}");
        let mut class = history.labels().classes[0].clone();
        class.thing = false;
        history.change_class(class).unwrap();
        assert!(follow(&history).iter().flatten().all(|&object| object == 0));
    }
}

#[test]
fn objects_change_nothing_of_the_classes_and_stuff_has_none() {
    let (scene, mut labels, propagation) = halves();
    let of_objects = propagation.posterior().clone();
    assert_eq!(of_objects.objects.len(), propagation.surface().graph.len());
    labels.classes[0].thing = false;
    let of_classes = propagated(&scene, &labels);
    let without = Posterior {
        objects: Vec::new(),
        telling: Vec::new(),
        ..of_objects
    };
    assert_eq!(*of_classes.posterior(), without);
}
