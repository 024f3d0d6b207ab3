//! What holds for the demo room.

use std::sync::LazyLock;

use super::*;

static SCENE: LazyLock<Scene> = LazyLock::new(|| Shot::default().scene(&|_, _| {}));
static TRUTH: LazyLock<Vec<Vec<ClassId>>> = LazyLock::new(|| Shot::default().ground_truth());

#[test]
fn every_pixel_has_a_depth_and_a_class_that_is_well_visible_in_three_training_and_three_test_frames() {
    let held_out = Shot::default().held_out();
    assert!(classes().len() >= 14);
    for class in classes() {
        let seen = |test: bool| {
            let frames = TRUTH.iter().enumerate();
            frames
                .filter(|(frame, _)| held_out.contains(frame) == test)
                .filter(|(_, labels)| labels.iter().filter(|&&id| id == class.id).count() >= 100)
                .count()
        };
        assert!(seen(true) >= 3 && seen(false) >= 3, "{}", class.name);
    }
    let ids: Vec<ClassId> = classes().iter().map(|class| class.id).collect();
    assert!(TRUTH.iter().flatten().all(|id| ids.contains(id)));
    assert_eq!(SCENE.frames.len(), TRUTH.len());
    for frame in &SCENE.frames {
        assert_eq!(frame.depth().unwrap().coverage(), 1.0);
    }
}

#[test]
fn cameras_keep_their_distance_from_everything() {
    let coarse = Shot::new(1000, [16, 12]);
    let house = coarse.house();
    for frame in 0..coarse.frames {
        let eye = house.stand(frame, coarse.frames).to_room.translation.as_vec3a();
        assert!(!house.room(0).caster.buried(eye, usize::MAX), "frame {frame}");
        let view = coarse.view(&house, frame);
        let nearest = (0..view.camera.pixels())
            .map(|index| view.hit(index).distance)
            .fold(f32::INFINITY, f32::min);
        assert!(nearest > 0.25, "frame {frame}: {nearest}");
    }
}

/// How many pixels of one frame are seen in another one, how many of those have the same depth there, and how many of
/// these the same class. Frames with their classes.
fn seen_twice((from, classes): (&Frame, &[ClassId]), (to, others): (&Frame, &[ClassId])) -> [usize; 3] {
    let [mut shared, mut same_depth, mut same_class] = [0; 3];
    for index in (0..from.camera.pixels()).step_by(7) {
        let length = from.depth().unwrap().ray_length(index).unwrap();
        let point = from.place(index, length);
        let Some((x, y, length)) = to.project(point) else {
            continue;
        };
        let other = y as usize * to.camera.width as usize + x as usize;
        let there = to.depth().unwrap().ray_length(other).unwrap();
        // Half a pixel of a slanted surface, at most.
        let tolerance = 0.03 * length;
        if there < length - tolerance {
            continue;
        }
        shared += 1;
        if (there - length).abs() < tolerance {
            same_depth += 1;
            same_class += usize::from(classes[index] == others[other]);
        }
    }
    [shared, same_depth, same_class]
}

/// Three rooms, small.
const ROOMS: Shot = Shot {
    rooms: 3,
    ..Shot::new(30, [160, 120])
};

#[test]
fn one_room_is_the_demo_pixel_for_pixel() {
    // FNV-1a of the bytes of frame 7.
    let hash = |bytes: &mut dyn Iterator<Item = u8>| {
        bytes.fold(0xCBF2_9CE4_8422_2325_u64, |hash, byte| {
            (hash ^ u64::from(byte)).wrapping_mul(0x0100_0000_01B3)
        })
    };
    let color = SCENE.frames[7].color();
    assert_eq!(hash(&mut color.bytes().iter().copied()), 0x2163_3853_EBF7_9A66);
    let mut classes = TRUTH[7].iter().map(|&class| class as u8);
    assert_eq!(hash(&mut classes), 0x2EA0_D589_AAE2_773D);
}

#[test]
fn frames_are_shared_evenly_among_rooms_and_taken_inside_them() {
    let house = ROOMS.house();
    for frame in 0..ROOMS.frames {
        let stand = house.stand(frame, ROOMS.frames);
        assert_eq!(stand.room, frame / 10);
        // Rooms of 5 m with 20 cm between them.
        let x = stand.to_world.translation.x - 5.2 * stand.room as f64;
        assert!((1.0..4.0).contains(&x), "frame {frame}: {x}");
        let eye = stand.to_room.translation.as_vec3a();
        assert!(!house.room(stand.room).caster.buried(eye, usize::MAX));
        assert!(super::super::camera::rigid(stand.to_world).is_ok());
    }
}

#[test]
fn every_thing_is_an_object_with_a_number_of_its_own_in_each_room() {
    let shot = Shot { rooms: 2, ..ROOMS };
    let (listed, objects) = shot.objects();
    let of_class = |name: &str| {
        let class = classes().into_iter().find(|class| class.name == name).unwrap();
        listed.values().filter(|&&own| own == class.id).count()
    };
    assert_eq!(
        ["wall", "bed", "chair", "pillow", "cushion", "picture"].map(of_class),
        [1, 2, 4, 4, 6, 8]
    );
    assert!(listed.len() * usize::from(MOST_ROOMS / 2) < usize::from(u16::MAX));
    let things = classes().into_iter().filter(|class| class.thing);
    let things: BTreeSet<ClassId> = things.map(|class| class.id).collect();
    let mut seen = [BTreeSet::new(), BTreeSet::new()];
    for (frame, classes) in shot.ground_truth().iter().enumerate() {
        let shown = objects(frame);
        let own = shown.iter().zip(classes);
        assert!(own.clone().all(|(object, class)| listed[object] == *class));
        let of_things = own.filter(|(_, class)| things.contains(class));
        seen[usize::from(frame >= 15)].extend(of_things.map(|(object, _)| *object));
    }
    assert!(seen.iter().all(|own| own.len() > 20) && seen[0].is_disjoint(&seen[1]));
}

#[test]
fn several_rooms_agree_with_themselves_and_are_unlike_each_other() {
    let (scene, truth) = (ROOMS.scene(&|_, _| {}), ROOMS.ground_truth());
    for (a, b) in [(0, 1), (10, 11), (16, 17), (20, 21), (29, 20)] {
        let seen = seen_twice((&scene.frames[a], &truth[a]), (&scene.frames[b], &truth[b]));
        let [shared, same_depth, same_class] = seen.map(|count| count as f32);
        assert!(shared > 300.0 && same_depth > 0.97 * shared, "{a} {b}: {seen:?}");
        assert!(same_class > 0.95 * same_depth, "{a} {b}: {seen:?}");
    }
    // The second room is the first one's mirror image, and so are its pictures, but for the colours.
    let width = ROOMS.width as usize;
    let (mut same_class, mut apart, mut pixels) = (0, 0, 0);
    for frame in 0..10 {
        let (first, second) = (scene.frames[frame].color(), scene.frames[10 + frame].color());
        for index in 0..truth[frame].len() {
            let mirrored = index - index % width + (width - 1 - index % width);
            same_class += usize::from(truth[frame][index] == truth[10 + frame][mirrored]);
            for (a, b) in first.pixel(index).into_iter().zip(second.pixel(mirrored)) {
                apart += usize::from(a.abs_diff(b));
            }
            pixels += 1;
        }
    }
    assert!(same_class > pixels * 99 / 100, "{same_class} of {pixels}");
    assert!(apart > 3 * 8 * pixels, "{apart} in {pixels}");
}

#[test]
fn clicks_tell_the_truth_sparingly_and_only_on_training_frames_in_images_of_any_size_and_in_every_room() {
    let clicks = Shot::default().clicks();
    assert_eq!(clicks.classes, classes());
    for class in classes() {
        let strokes = clicks.strokes.values();
        let own = strokes.filter(|stroke| stroke.class == class.id).count();
        assert!((1..=3).contains(&own), "{}: {own}", class.name);
    }
    let large = Shot::new(20, [640, 480]);
    for (shot, least) in [(Shot::default(), 14), (large, 6), (ROOMS, 21)] {
        let (house, mut rooms) = (shot.house(), vec![0; shot.rooms]);
        for stroke in shot.clicks().strokes.values() {
            assert!(stroke.frame < shot.frames && !shot.held_out().contains(&stroke.frame));
            let [x, y] = stroke.first_point().unwrap();
            assert_eq!((stroke.radius, &stroke.lines[..]), (0, &[vec![[x, y]]][..]));
            let hit = shot.view(&house, stroke.frame).hit((y * shot.width + x) as usize);
            let room = house.stand(stroke.frame, shot.frames).room;
            assert_eq!(house.room(room).caster.solids[hit.solid].class, stroke.class);
            rooms[room] += 1;
        }
        assert!(rooms.iter().all(|&clicks| clicks >= least), "{rooms:?}");
    }
}

#[test]
fn depth_goes_on_beyond_glass_and_behind_a_mirror() {
    use super::rooms::{Builder, CEILING, Material, Optics, Pane, Part, Place, Room, SHELL, shell, srgb};

    let shot = Shot::new(60, [160, 120]);
    for (optics, min, max) in [
        (Optics::Mirror, [0.0, 1.4, 0.4], [0.02, 2.6, 2.0]),
        (Optics::Glass, [1.7, 3.5, 0.6], [3.3, 3.508, 1.9]),
    ] {
        let own = CEILING + 1;
        let mut builder = Builder::default();
        shell(&mut builder, [Material::plain(srgb(0xB9_885A)); SHELL]);
        let material = Material::passing(glam::Vec3A::splat(0.9), optics);
        Part(own, material, &Place::new(0.0, 0.0, 0.0)).block(&mut builder, min, max);
        let light = Pane {
            center: glam::Vec3A::new(2.5, 2.0, 2.58),
            across: glam::Vec3A::X,
            up: glam::Vec3A::Y,
            facing: glam::Vec3A::NEG_Z,
            radiance: glam::Vec3A::splat(2.0),
        };
        let house = House::of(Room::new(builder, vec![light], Vec::new()));
        let scene = shot.scene_of(&house);
        let mut pixels = 0;
        for (index, frame) in scene.frames.iter().enumerate() {
            let view = shot.view(&house, index);
            for (pixel, class) in view.labels().into_iter().enumerate() {
                let (length, surface) = (
                    frame.depth().unwrap().ray_length(pixel).unwrap(),
                    view.hit(pixel).distance,
                );
                if class != own {
                    assert!((length - surface).abs() < 0.01, "{optics:?} {length} {surface}");
                    continue;
                }
                pixels += 1;
                assert!(length > surface, "{optics:?} {length} {surface}");
                if optics == Optics::Mirror {
                    // The room behind the wall is that in front of it, mirrored at x = 2 cm.
                    let point = frame.place(pixel, length);
                    assert!((-4.97..0.05).contains(&point.x), "{point}");
                }
            }
        }
        assert!(pixels > 3000, "{optics:?}: {pixels}");
    }
}
