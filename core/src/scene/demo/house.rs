//! Rooms in a row along x: which frame is taken in which of them, and from where.

use glam::{DAffine3, DMat3, DVec3};
use rayon::prelude::*;

use super::light::LightMap;
use super::path;
use super::room::{self, Room, SIZE};

/// Metres between the inner faces of neighbouring rooms: both have walls.
const BETWEEN: f64 = 0.2;

/// Closed rooms beside each other.
pub(super) struct House {
    rooms: Vec<Placed>,
}

/// A room and where it stands.
struct Placed {
    room: Room,
    /// From the room's axes to the world's; of every second room a mirror image.
    to_world: DAffine3,
}

/// A camera in one of the rooms.
#[derive(Clone, Copy, Debug)]
pub(super) struct Stand {
    /// Number of the room.
    pub room: usize,
    /// Camera-to-world.
    pub to_world: DAffine3,
    /// Camera to the room's axes; a mirror image where the room is one.
    pub to_room: DAffine3,
}

impl House {
    /// The furnished room, so many times: turned and mirrored in turn, each in colours of its own.
    pub fn furnished(rooms: usize) -> Self {
        let rooms = (0..rooms.max(1)).into_par_iter().map(|number| Placed {
            room: room::room(number),
            to_world: place(number),
        });
        Self {
            rooms: rooms.collect(),
        }
    }

    /// The light of each room.
    pub fn light(&self) -> Vec<LightMap> {
        let rooms = self.rooms.iter();
        rooms
            .map(|Placed { room, .. }| LightMap::new(&room.caster, &room.panes, &room.bulbs))
            .collect()
    }

    /// A room.
    pub fn room(&self, number: usize) -> &Room {
        &self.rooms[number].room
    }

    /// Number of rooms.
    pub fn count(&self) -> usize {
        self.rooms.len()
    }

    /// Where frame `frame` of `frames` is taken. One room is gone through round after round; several are gone
    /// through one after the other, each with its share of the frames in one round.
    pub fn stand(&self, frame: usize, frames: usize) -> Stand {
        let count = self.rooms.len();
        if count == 1 {
            return self.stand_in(0, frame as f64);
        }
        let room = (0..count)
            .rev()
            .find(|&room| first_of(room, count, frames) <= frame);
        let room = room.unwrap_or(0);
        let (first, end) = (first_of(room, count, frames), first_of(room + 1, count, frames));
        let share = (frame - first) as f64 / (end - first).max(1) as f64;
        self.stand_in(room, share * path::FRAMES as f64)
    }

    fn stand_in(&self, room: usize, time: f64) -> Stand {
        let placed = &self.rooms[room];
        let to_world = path::pose(time, &placed.to_world);
        Stand {
            room,
            to_world,
            to_room: placed.to_world.inverse() * to_world,
        }
    }
}

/// The first frame of a room; frames are shared evenly.
pub(super) fn first_of(room: usize, rooms: usize, frames: usize) -> usize {
    (room * frames).div_ceil(rooms)
}

/// From the axes of the room with this number to the world's: as it is, mirrored along x, turned by 180 degrees,
/// mirrored along y, and so on. The first room is the demo's, at its place.
fn place(number: usize) -> DAffine3 {
    let signs = match number % 4 {
        0 => DVec3::ONE,
        1 => DVec3::new(-1.0, 1.0, 1.0),
        2 => DVec3::new(-1.0, -1.0, 1.0),
        _ => DVec3::new(1.0, -1.0, 1.0),
    };
    let size = SIZE.as_dvec3();
    let mut corner = DVec3::select(signs.cmplt(DVec3::ZERO), size, DVec3::ZERO);
    corner.x += number as f64 * (size.x + BETWEEN);
    DAffine3::from_mat3_translation(DMat3::from_diagonal(signs), corner)
}
