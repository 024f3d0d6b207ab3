//! Where the pixels of images on disk lie in their frames.

use std::sync::{Arc, Mutex, PoisonError};

use super::{Camera, Frame, Lens};

/// For each pixel of an image on disk, row-major, the pixel of its frame at the same place; [`BEYOND`] the frame.
type Places = Arc<Vec<u32>>;

/// No pixel of any frame.
const BEYOND: u32 = u32::MAX;

/// The places of the pixels of images on disk, worked out once for frames in turn that were taken with the same lens: each
/// pixel takes Newton's method.
#[derive(Default)]
pub struct ImagePixels {
    last: Mutex<Option<(Camera, Lens, Places)>>,
}

impl ImagePixels {
    /// Those of the image of a frame; `None` where the image is the frame's own.
    pub(crate) fn of(&self, frame: &Frame) -> Option<Places> {
        let lens = frame.lens?;
        // What is there is whole, so a panic in another thread does not spoil it.
        let last = || self.last.lock().unwrap_or_else(PoisonError::into_inner);
        if let Some((camera, own, places)) = &*last()
            && (*camera, *own) == (frame.camera, lens)
        {
            return Some(Arc::clone(places));
        }
        let width = lens.image.width;
        let place = |index: usize| {
            let place = frame.of_image([index as u32 % width, index as u32 / width]);
            place.map_or(BEYOND, |[x, y]| y * frame.camera.width + x)
        };
        let places: Places = Arc::new((0..lens.image.pixels()).map(place).collect());
        *last() = Some((frame.camera, lens, Arc::clone(&places)));
        Some(places)
    }
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::scene::Distortion;
    use crate::scene::testing::wall;

    #[test]
    fn places_are_those_of_each_frame_also_where_the_lens_changes() {
        let mut frames = wall(3, 24, 18).frames;
        for (frame, bent) in frames.iter_mut().zip([-0.2, -0.1, -0.2]) {
            let lens = Lens {
                image: frame.camera,
                distortion: Distortion::opencv([bent]),
            };
            frame.camera = lens.pinhole().unwrap();
            frame.lens = Some(lens);
        }
        let places = ImagePixels::default();
        for frame in &frames {
            let known = places.of(frame).unwrap();
            assert_eq!(known.len(), 24 * 18);
            for (index, place) in (0..).zip(known.iter()) {
                let expected = frame.of_image([index % 24, index / 24]);
                assert_eq!(
                    *place,
                    expected.map_or(BEYOND, |[x, y]| y * frame.camera.width + x)
                );
            }
            // The next frame with this lens shares them.
            assert!(Arc::ptr_eq(&known, &places.of(frame).unwrap()));
        }
        frames[0].lens = None;
        assert!(places.of(&frames[0]).is_none());
    }
}
