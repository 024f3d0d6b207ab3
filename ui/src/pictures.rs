//! The small pictures of what was opened lately: made and read off the UI thread, kept in the data folder.

use std::collections::HashMap;
use std::fs;
use std::io;
use std::path::{Path, PathBuf};

use image::codecs::png::PngEncoder;
use image::{ExtendedColorType, ImageEncoder};
use inplace_core::export::write_whole;
use inplace_core::project::picture_name;
use inplace_model::preferences::RecentPlace;
use inplace_model::workspace::source::FrameSource;

use crate::canvas::{fitted, pictures, whole};

/// Most pixels along each axis: about twice of what the start page shows in points.
const SIZE: [f32; 2] = [176.0, 132.0];

/// What is known about what was opened lately, once it was looked at.
#[derive(Default)]
pub struct Pictures {
    found: HashMap<RecentPlace, Found>,
}

impl Pictures {
    /// What was found of something opened lately; `None` before it was looked at.
    pub fn of(&self, place: &RecentPlace) -> Option<&Found> {
        self.found.get(place)
    }

    /// All that was found.
    pub fn found(&self) -> impl Iterator<Item = &Found> {
        self.found.values()
    }

    /// A job has looked at what was opened lately.
    pub fn take(&mut self, ctx: &egui::Context, seen: Vec<Seen>) {
        for Seen {
            place,
            there,
            picture,
        } in seen
        {
            let options = egui::TextureOptions::LINEAR;
            let picture = picture.map(|picture| ctx.load_texture("picture", picture, options));
            self.found.insert(place, Found { there, picture });
        }
    }

    /// Something was taken off the list.
    pub fn forget(&mut self, place: &RecentPlace) {
        self.found.remove(place);
    }
}

/// What a look at something opened lately found.
pub struct Found {
    /// Whether it is where it was.
    pub there: bool,
    /// Its picture, if there is one.
    pub picture: Option<egui::TextureHandle>,
}

/// What a job saw of something opened lately.
#[derive(Debug)]
pub struct Seen {
    /// What was looked at.
    pub place: RecentPlace,
    /// Whether it is where it was.
    pub there: bool,
    /// Its picture, if there is one.
    pub picture: Option<egui::ColorImage>,
}

/// Looks at something opened lately and reads its picture from this folder. Touches the disk.
pub fn look_at(place: RecentPlace, folder: &Path) -> Seen {
    Seen {
        there: place.is_there(),
        picture: read(&file_of(&place, folder)),
        place,
    }
}

/// Removes the picture of a place from this folder. Touches the disk.
pub fn remove(place: &RecentPlace, folder: &Path) {
    // Most often there is one; one that cannot be removed only takes space.
    let _ = fs::remove_file(file_of(place, folder));
}

fn file_of(place: &RecentPlace, folder: &Path) -> PathBuf {
    folder.join(picture_name(place.path()))
}

fn read(file: &Path) -> Option<egui::ColorImage> {
    let image = image::open(file).ok()?.into_rgba8();
    let size = [image.width() as usize, image.height() as usize];
    Some(egui::ColorImage::from_rgba_unmultiplied(size, image.as_raw()))
}

/// Writes the picture of a place into a folder, whole or not at all. Touches the disk.
///
/// # Errors
/// Why it cannot be written.
pub fn write(place: &RecentPlace, source: &FrameSource, folder: &Path) -> io::Result<()> {
    let Some(frame) = source.scene.frames.get(source.frame) else {
        return Ok(());
    };
    let part = whole([frame.camera.width, frame.camera.height]);
    let Some([picture]) = pictures(source, [source.look], part, fitted(part, SIZE)) else {
        return Ok(());
    };
    let rgb: Vec<u8> = picture
        .pixels
        .iter()
        .flat_map(|pixel| [pixel.r(), pixel.g(), pixel.b()])
        .collect();
    let [width, height] = picture.size.map(|side| side as u32);
    let mut png = Vec::new();
    PngEncoder::new(&mut png)
        .write_image(&rgb, width, height, ExtendedColorType::Rgb8)
        .map_err(io::Error::other)?;
    fs::create_dir_all(folder)?;
    write_whole(&file_of(place, folder), &png).map(drop)
}
