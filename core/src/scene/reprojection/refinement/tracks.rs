//! Corners of keyframes, and where other keyframes show them.

use glam::{DVec2, DVec3};
use rayon::prelude::*;

use super::super::corners::{self, Features};
use super::super::pairs;
use super::HELD_OUT;
use crate::scene::{Camera, Frame, Scene};

/// Images are brought down to at most this many pixels along their longer side, so that a thousand frames fit in memory.
const LONGEST: usize = 480;
/// Most partners that are chosen for a keyframe.
const PARTNERS: usize = 8;
/// How far a corner may be from where the poses allow it to be, in lengths of the longer side of the image.
const BAND: f64 = 0.025;
/// Nearest depth at which a corner is looked for, as a share of the typical one.
const NEAREST: f64 = 0.1;
/// Fewest keyframes that show a corner beside its own.
const FEWEST_SIGHTINGS: usize = 2;

/// A place where a keyframe shows a corner of another.
pub struct Sighting {
    /// Place of the keyframe in [`Star::views`].
    pub view: usize,
    /// In pixels of the keyframe.
    pub place: DVec2,
    /// Whether it has no say, because this pair of keyframes is held out.
    pub is_held_out: bool,
}

/// A corner of a keyframe.
pub struct Track {
    /// The ray through it, in camera axes, with z = 1.
    pub ray: DVec3,
    /// Where others show it, one each.
    pub sightings: Vec<Sighting>,
}

/// The corners of a keyframe that others show.
pub struct Star {
    /// Number of the keyframe, and after it those of the others.
    pub views: Vec<usize>,
    pub tracks: Vec<Track>,
}

/// A corner of one keyframe, found in another.
struct Found {
    /// Number of the corner's keyframe, and of the other.
    of: usize,
    there: usize,
    /// Its number among the keyframe's corners.
    corner: usize,
    /// Where the other shows it, in pixels.
    place: DVec2,
}

/// Finds the corners of the keyframes in each other, in parallel; a star for each of them. When `go_on` says `false`, corners
/// are missing, or `None` of them is known yet.
pub fn find(scene: &Scene, keyframes: &[usize], go_on: &(dyn Fn() -> bool + Sync)) -> Option<Vec<Star>> {
    let frames: Vec<&Frame> = keyframes.iter().map(|&frame| &scene.frames[frame]).collect();
    let pairs = pairs::partners(scene, keyframes, PARTNERS);
    let corners_of = |frame: &&Frame| {
        let features = go_on().then(|| Features::of(frame, LONGEST))?;
        let places = features.places();
        Some((features, places))
    };
    let corners = frames.par_iter().map(corners_of);
    let corners: Vec<(Features, Vec<DVec2>)> = corners.collect::<Option<_>>()?;
    let nearest = NEAREST * pairs::assumed_distance(scene);
    let found = pairs.par_iter().filter(|_| go_on()).flat_map_iter(|pair| {
        let [(first, places), (second, others)] = pair.map(|number| &corners[number]);
        let [from, to] = pair.map(|number| frames[number]);
        let segments: Vec<Option<Segment>> = places
            .iter()
            .map(|&place| Segment::of(from, place, to, nearest))
            .collect();
        let band = BAND * f64::from(to.camera.width.max(to.camera.height));
        let matches = corners::matches(first, second, |own, other| {
            let segment = segments[own].as_ref();
            segment.is_some_and(|segment| segment.passes(others[other], band))
        });
        let &[of, there] = pair;
        matches.into_iter().flat_map(move |matched| {
            let [own, other] = matched.corners;
            [
                Found {
                    of,
                    there,
                    corner: own,
                    place: matched.second,
                },
                Found {
                    of: there,
                    there: of,
                    corner: other,
                    place: first.place_of(second, other, own),
                },
            ]
        })
    });
    let mut found: Vec<Found> = found.collect();
    found.sort_by_key(|found| (found.of, found.corner, found.there));
    let star = |number: usize| {
        let start = found.partition_point(|found| found.of < number);
        let end = found.partition_point(|found| found.of <= number);
        Star::new(
            number,
            &frames[number].camera,
            &corners[number].1,
            &found[start..end],
        )
    };
    Some((0..frames.len()).map(star).collect())
}

impl Star {
    /// Of what was found of a keyframe, sorted by corner, with the places of its corners in pixels.
    fn new(number: usize, camera: &Camera, places: &[DVec2], found: &[Found]) -> Self {
        let mut others: Vec<usize> = found.iter().map(|found| found.there).collect();
        others.sort_unstable();
        others.dedup();
        let sighting = |found: &Found| Sighting {
            view: 1 + others.partition_point(|&other| other < found.there),
            place: found.place,
            is_held_out: (found.of + found.there).is_multiple_of(HELD_OUT),
        };
        let tracks = found
            .chunk_by(|a, b| a.corner == b.corner)
            .filter(|found| found.len() >= FEWEST_SIGHTINGS)
            .map(|found| Track {
                ray: direction(camera, places[found[0].corner]),
                sightings: found.iter().map(sighting).collect(),
            })
            .collect();
        Self {
            views: [vec![number], others].concat(),
            tracks,
        }
    }
}

/// Where a frame may show a place of another: from where it is at infinity to where it is near by, in pixels.
struct Segment {
    far: DVec2,
    along: DVec2,
}

impl Segment {
    /// Of a place of `from` in `to`, down to the nearest z-depth, in metres; `None` behind the camera.
    fn of(from: &Frame, place: DVec2, to: &Frame, nearest: f64) -> Option<Self> {
        let back = to.camera_to_world.matrix3.as_dmat3().transpose();
        let ray = back * (from.camera_to_world.matrix3.as_dmat3() * direction(&from.camera, place));
        let shift = back * (from.center() - to.center()).as_dvec3();
        let far = project(&to.camera, ray)?;
        // The largest inverse depth, and one at which the place is still ahead of the other camera.
        let ahead = if shift.z < 0.0 {
            0.9 * ray.z / -shift.z
        } else {
            f64::INFINITY
        };
        let near = project(&to.camera, ray + ahead.min(1.0 / nearest) * shift)?;
        Some(Self {
            far,
            along: near - far,
        })
    }

    /// Whether it passes a place by at most so many pixels.
    fn passes(&self, place: DVec2, most: f64) -> bool {
        let share = (place - self.far).dot(self.along) / self.along.length_squared().max(1e-12);
        let nearest = self.far + share.clamp(0.0, 1.0) * self.along;
        nearest.distance_squared(place) <= most * most
    }
}

/// The direction through an image position, in camera axes, with z = 1.
pub fn direction(camera: &Camera, place: DVec2) -> DVec3 {
    let (focal, center) = camera.intrinsics();
    ((place - center) / focal).extend(1.0)
}

/// Image position of a direction in camera axes; `None` behind the camera.
pub fn project(camera: &Camera, direction: DVec3) -> Option<DVec2> {
    let (focal, center) = camera.intrinsics();
    (direction.z > 1e-6).then(|| focal * (direction.truncate() / direction.z) + center)
}
