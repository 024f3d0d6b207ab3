//! Images without the bend of their lens.

use glam::DVec2;

use super::Lens;
use crate::scene::{Camera, ColorImage};

/// Pixels of a row whose places in the image on disk are taken to be on a parabola through three of them.
const RUN: usize = 16;
/// Farthest that the places of a run may be from its first, in pixels: there the parabola is off by less than a hundredth
/// of a pixel in images of some hundred pixels or more.
const MOST_APART: f64 = 4.0 * RUN as f64;

impl Lens {
    /// The image as `pinhole` would have taken it, bilinear; black where it does not reach.
    ///
    /// `None` unless `image` has this lens's size, and at least two pixels along each axis.
    pub fn straighten(&self, pinhole: &Camera, image: &ColorImage) -> Option<ColorImage> {
        let (width, height) = (self.image.width, self.image.height);
        if (image.width(), image.height()) != (width, height) || width.min(height) < 2 {
            return None;
        }
        let columns = pinhole.width as usize;
        let mut rgb = vec![0; 3 * pinhole.pixels()];
        let mut beyond = Vec::new();
        for (row, colors) in rgb.chunks_exact_mut(3 * columns).enumerate() {
            let place = |column: usize| {
                let place = self.to_image(pinhole, column as f64 + 0.5, row as f64 + 0.5);
                place.map(DVec2::from)
            };
            let mut start = place(0);
            for (first, run) in (0..).step_by(RUN).zip(colors.chunks_mut(3 * RUN)) {
                let (middle, end) = (place(first + RUN / 2), place(first + RUN));
                let between = on_parabola([start, middle, end]);
                start = end;
                for (k, color) in run.chunks_exact_mut(3).enumerate() {
                    let shown = match &between {
                        Some(between) => Some(between(k as i32)),
                        None => place(first + k).map(fixed_point),
                    };
                    match shown {
                        Some([x, y]) => {
                            color.copy_from_slice(&bilinear(image, beside(x, width), beside(y, height)));
                        }
                        None => beyond.push(row * columns + first + k),
                    }
                }
            }
        }
        let straight = ColorImage::new(pinhole.width, pinhole.height, rgb)?;
        Some(straight.lacking(beyond))
    }
}

/// A place in 4096ths of a pixel: those of the largest images fit.
fn fixed_point(place: DVec2) -> [i32; 2] {
    (4096.0 * place).as_ivec2().to_array()
}

/// Gives the places of a run's pixels, by number and in [fixed point](fixed_point), from those of its first pixel, of its
/// middle, and of the first pixel of the next run. `None` unless the image has them all, near to one another.
fn on_parabola([start, middle, end]: [Option<DVec2>; 3]) -> Option<impl Fn(i32) -> [i32; 2]> {
    let (start, middle, end) = (start?, middle?, end?);
    let length = end - start;
    let bend = 2.0 * (start + end - 2.0 * middle);
    let is_near = length.abs().max(bend.abs()).max_element() < MOST_APART;
    is_near.then(|| {
        let run = RUN as i32;
        let [start, length, bend] = [start, length, bend].map(fixed_point);
        move |k: i32| {
            let at =
                |axis: usize| start[axis] + k * length[axis] / run - k * (run - k) * bend[axis] / (run * run);
            [at(0), at(1)]
        }
    })
}

/// Of a coordinate in [fixed point](fixed_point), along an axis with so many pixels: the first of the two pixels whose
/// centres are around it, and the share of the second in 256ths.
#[inline]
fn beside(v: i32, size: u32) -> [u32; 2] {
    let from_first = ((v - 2048 + 8) >> 4).max(0) as u32;
    let first = (from_first >> 8).min(size - 2);
    [first, (from_first - (first << 8)).min(256)]
}

/// The colour between two columns and two rows of an image, each with the share of the second, as by [`beside`].
#[inline]
fn bilinear(image: &ColorImage, [column, right]: [u32; 2], [row, below]: [u32; 2]) -> [u8; 3] {
    let width = image.width() as usize;
    let start = 3 * (row as usize * width + column as usize);
    let upper = &image.bytes()[start..start + 6];
    let lower = &image.bytes()[start + 3 * width..start + 3 * width + 6];
    let (left, above) = (256 - right, 256 - below);
    let shares = [above * left, above * right, below * left, below * right];
    let mut color = [0; 3];
    for (channel, color) in color.iter_mut().enumerate() {
        let around = [
            upper[channel],
            upper[channel + 3],
            lower[channel],
            lower[channel + 3],
        ];
        let sum: u32 = (0..4).map(|k| shares[k] * u32::from(around[k])).sum();
        *color = ((sum + (1 << 15)) >> 16) as u8;
    }
    color
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::scene::Distortion;

    #[test]
    fn a_straightened_gradient_follows_the_formula() {
        let [width, height] = [250, 190];
        let image = Camera::new([width, height], [190.0, 200.0, 121.0, 100.0]);
        let rgb = (0..height).flat_map(|y| (0..width).flat_map(move |x| [x as u8, y as u8, 9]));
        let bent = ColorImage::new(width, height, rgb.collect()).unwrap();
        for distortion in [
            Distortion::opencv([-0.28, 0.07, 0.001, -0.002]),
            Distortion::fisheye([0.03, -0.01]),
        ] {
            let lens = Lens { image, distortion };
            let pinhole = lens.pinhole().unwrap();
            let seen = lens.straighten(&pinhole, &bent).unwrap();
            let mut beyond = 0;
            for index in 0..pinhole.pixels() {
                let (column, row) = (index as u32 % pinhole.width, index as u32 / pinhole.width);
                let place = lens.to_image(&pinhole, f64::from(column) + 0.5, f64::from(row) + 0.5);
                let Some((x, y)) = place else {
                    beyond += 1;
                    assert!(seen.pixel(index) == [0; 3] && !seen.is_valid(index));
                    continue;
                };
                let [r, g, b] = seen.pixel(index).map(f64::from);
                let expected =
                    [(x, width), (y, height)].map(|(v, size)| (v - 0.5).clamp(0.0, f64::from(size - 1)));
                assert!((r - expected[0]).abs() < 0.51 && (g - expected[1]).abs() < 0.51 && b == 9.0);
            }
            assert!(beyond > 0, "{distortion:?}");
            let other = ColorImage::new(1, 1, vec![0; 3]).unwrap();
            assert!(lens.straighten(&pinhole, &other).is_none());
        }
    }
}
