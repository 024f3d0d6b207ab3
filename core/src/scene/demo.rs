//! The embedded demo: a furnished room, or several in a row, ray-cast when it is asked for, with exact depth and
//! labels.
//!
//! World axes: x along the rooms (5 m each), y across them (4 m), z up; metres. Nothing here depends on the clock or
//! on chance: every call gives the same room, pictures and clicks.

mod build;
mod cast;
mod click;
mod furniture;
mod house;
mod light;
mod material;
mod path;
mod render;
mod room;
pub mod rooms;
mod solid;

use std::collections::{BTreeMap, BTreeSet};
use std::path::PathBuf;
use std::sync::atomic::{AtomicUsize, Ordering};
use std::sync::{Arc, LazyLock};

use rayon::prelude::*;

use super::camera::sampled;
use super::images::Turn;
use super::pixels::{FirstRead, OnDisk, Unread};
use super::{Cache, Camera, ColorImage, DepthMap, Frame, FramePixels, Pixels, Scene, SceneSource};
use crate::labels::{Class, ClassId, LabelSet, Stroke, VOID, parse_class_list};
use house::House;
use light::LightMap;
use render::View;
use rooms::Room;

/// Horizontal field of view of the demo's camera, in degrees.
const FIELD_OF_VIEW: f32 = 78.0;

/// Most rooms of a shot, as their objects have numbers of 16 bits.
pub const MOST_ROOMS: u16 = 1000;

/// The light of the rooms, made when it is first wanted.
type Lit = LazyLock<Vec<LightMap>, Box<dyn FnOnce() -> Vec<LightMap> + Send>>;

/// How the demo is photographed. Longer shots of one room begin with the frames of shorter ones.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub struct Shot {
    /// Rooms in a row, 1 to [`MOST_ROOMS`]: furnished as the demo's, mirrored or turned, in colours of their own. The
    /// frames go through them one after the other, shared evenly.
    pub rooms: usize,
    /// Number of frames, of all rooms together.
    pub frames: usize,
    /// Width of the images in pixels.
    pub width: u32,
    /// Height of the images in pixels.
    pub height: u32,
}

impl Default for Shot {
    /// The demo: 60 frames of 320 x 240 in one room.
    fn default() -> Self {
        Self::new(path::FRAMES, [320, 240])
    }
}

impl Shot {
    /// So many frames of this width and height, of one room.
    pub const fn new(frames: usize, [width, height]: [u32; 2]) -> Self {
        Self {
            rooms: 1,
            frames,
            width,
            height,
        }
    }

    fn camera(&self) -> Camera {
        Camera::with_horizontal_fov(self.width, self.height, FIELD_OF_VIEW)
    }

    fn house(&self) -> House {
        House::furnished(self.rooms)
    }

    fn view<'a>(&self, house: &'a House, frame: usize) -> View<'a> {
        let stand = house.stand(frame, self.frames);
        View {
            caster: &house.room(stand.room).caster,
            camera: self.camera(),
            camera_to_room: stand.to_room,
        }
    }

    /// Renders the scene, depth included; `progress` is called with (frames done, frames in all), from any
    /// thread.
    pub fn scene(&self, progress: &(dyn Fn(usize, usize) + Sync)) -> Scene {
        self.read(true, &|_| {}, progress)
    }

    /// The same, with depth or without. `listed` gets the scene before its frames are rendered: each is as soon as
    /// somebody wants its pixels.
    pub(super) fn read(
        &self,
        depth: bool,
        listed: &dyn Fn(Scene),
        progress: &(dyn Fn(usize, usize) + Sync),
    ) -> Scene {
        progress(0, self.frames);
        let house = Arc::new(self.house());
        let own = Arc::clone(&house);
        let lit: Lit = LazyLock::new(Box::new(move || own.light()));
        let light = Arc::new(lit);
        let unread = (0..self.frames).map(|index| {
            let (shot, house, light) = (*self, Arc::clone(&house), Arc::clone(&light));
            let render = move || FirstRead {
                pixels: shot.pixels(&house, &light, index, depth),
                turn: Turn::None,
                depth_problem: None,
            };
            Arc::new(Unread::new(PathBuf::new(), move || Ok(render())))
        });
        let unread: Vec<Arc<Unread>> = unread.collect();
        listed(self.frames_of(&house, |index| {
            FramePixels::unread(Arc::clone(&unread[index]), depth)
        }));
        // Here: it is made by all threads, and one that waits for it must not render a frame meanwhile, which needs it.
        LazyLock::force(&light);
        let done = AtomicUsize::new(0);
        self.frames_of(&house, |index| {
            let pixels = unread[index].pixels(unread[index].shared());
            progress(1 + done.fetch_add(1, Ordering::Relaxed), self.frames);
            // There is no file to fail.
            pixels.unwrap_or_else(|_| unreachable!()).into()
        })
    }

    fn scene_of(&self, house: &House) -> Scene {
        let light = house.light();
        self.frames_of(house, |index| self.pixels(house, &light, index, true).into())
    }

    fn frames_of(&self, house: &House, pixels: impl Fn(usize) -> FramePixels + Sync) -> Scene {
        let frame = |index| Frame {
            stem: format!("rgb_{index}"),
            path: PathBuf::new(),
            camera: self.camera(),
            camera_to_world: house.stand(index, self.frames).to_world.as_affine3a(),
            pixels: pixels(index),
            points: Vec::new(),
            lens: None,
        };
        let frames = (0..self.frames).into_par_iter().map(frame).collect();
        Scene::new(SceneSource::Demo, "demo", frames)
    }

    /// Renders another room in place of the demo's, with its depth; of the shot all but the number of rooms counts.
    pub fn scene_in(&self, room: Room) -> Scene {
        self.scene_of(&House::of(room))
    }

    /// The same scene whose frames are rendered when somebody asks for their pixels: for writing more of them than
    /// fit in memory.
    pub fn unrendered(&self) -> Scene {
        let house = Arc::new(self.house());
        let light: Arc<[LightMap]> = house.light().into();
        let cache = Arc::new(Cache::new(0));
        self.frames_of(&house, |index| {
            let (shot, own, light) = (*self, Arc::clone(&house), Arc::clone(&light));
            let pixels = OnDisk {
                number: index,
                sharpness: 0.0,
                decode: Box::new(move || Ok(shot.pixels(&own, &light, index, true))),
                cache: Arc::clone(&cache),
            };
            FramePixels::on_disk(Some(1.0), 0, pixels)
        })
    }

    fn pixels(&self, house: &House, light: &[LightMap], index: usize, depth: bool) -> Pixels {
        let room = house.stand(index, self.frames).room;
        let (rgb, lengths) = self.view(house, index).render(&light[room]);
        // `render` gives three bytes for each pixel of the camera: the image always exists.
        let color = ColorImage::new(self.width, self.height, rgb).unwrap_or_else(|| unreachable!());
        let depth = depth.then(|| DepthMap::from_ray_lengths(self.width, &lengths));
        Pixels::new(color, depth)
    }

    /// True classes of every frame, row-major `[height, width]` each, at the pixel centres.
    pub fn ground_truth(&self) -> Vec<Vec<ClassId>> {
        self.truth_of(&self.house())
    }

    fn truth_of(&self, house: &House) -> Vec<Vec<ClassId>> {
        let frames = (0..self.frames).into_par_iter();
        frames.map(|frame| self.view(house, frame).labels()).collect()
    }

    /// True classes of every frame of [`scene_in`](Self::scene_in), row-major `[height, width]` each, at the pixel centres.
    pub fn ground_truth_in(&self, room: Room) -> Vec<Vec<ClassId>> {
        self.truth_of(&House::of(room))
    }

    /// Finds out the true classes of a frame, row-major `[height, width]`, at the pixel centres.
    pub fn labels(&self) -> impl Fn(usize) -> Vec<ClassId> + Send + Sync + use<> {
        let (shot, house) = (*self, self.house());
        move |frame| shot.view(&house, frame).labels()
    }

    /// The numbers of all objects with their classes, and what finds out the true ones of a frame, row-major
    /// `[height, width]`, at the pixel centres, 0 = void. All of a class that is stuff is one object.
    pub fn objects(
        &self,
    ) -> (
        BTreeMap<u16, ClassId>,
        impl Fn(usize) -> Vec<u16> + Send + Sync + use<>,
    ) {
        let (shot, house) = (*self, self.house());
        let stuff = classes().into_iter().filter(|class| !class.thing);
        let mut number_of: BTreeMap<(ClassId, usize, u16), u16> =
            stuff.map(|class| (class.id, 0, 0)).zip(1..).collect();
        let is_stuff: BTreeSet<ClassId> = number_of.keys().map(|&(class, ..)| class).collect();
        let key = move |class: ClassId, room: usize, object: u16| match is_stuff.contains(&class) {
            true => (class, 0, 0),
            false => (class, room, object),
        };
        for room in 0..house.count() {
            for solid in &house.room(room).caster.solids {
                let next = number_of.len() as u16 + 1;
                let own = key(solid.class, room, solid.object);
                number_of.entry(own).or_insert(next);
            }
        }
        let listed = number_of.iter().map(|(&(class, ..), &number)| (number, class));
        let listed = listed.collect();
        let of_frame = move |frame: usize| {
            let room = house.stand(frame, shot.frames).room;
            let shown = shot.view(&house, frame).objects().into_iter();
            let number = |(class, object)| number_of.get(&key(class, room, object)).copied();
            shown.map(|shown| number(shown).unwrap_or(VOID)).collect()
        };
        (listed, of_frame)
    }

    /// Frames kept for testing: every second one. [`clicks`](Self::clicks) are on the others.
    pub fn held_out(&self) -> Vec<usize> {
        (0..self.frames).filter(|frame| frame % 2 == 1).collect()
    }

    /// Clicks that a sensible person would make: up to three pixels for each class in each room, well inside it and far
    /// apart. Of one room they are the demo's, at the same places of the images; those on frames that this shot lacks
    /// are left out.
    pub fn clicks(&self) -> LabelSet {
        let demo = Self::default();
        let rooms = self.rooms;
        let frames = if rooms == 1 { demo.frames } else { self.frames };
        let small = Self {
            rooms,
            frames,
            ..demo
        };
        let mut labels = click::clicks(&small.house(), &small);
        labels.strokes.retain(|_, stroke| stroke.frame < self.frames);
        for stroke in labels.strokes.values_mut() {
            let [x, y] = stroke.first_point().unwrap_or_default();
            let point = [
                sampled(x, demo.width, self.width),
                sampled(y, demo.height, self.height),
            ];
            *stroke = Arc::new(Stroke::click(stroke.frame, stroke.class, point));
        }
        labels
    }
}

/// The demo's classes, ids from 1.
pub fn classes() -> Vec<Class> {
    // Compiled in, and in order.
    parse_class_list(include_str!("demo/classes.json")).unwrap_or_default()
}

#[cfg(test)]
mod tests;
