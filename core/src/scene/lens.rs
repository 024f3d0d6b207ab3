//! Lenses that bend straight lines, and the pinhole camera that takes their place.

use super::camera::image_size;
use super::error::CameraError;
use super::{Camera, ColorImage};

/// Steps of Newton's method before a position counts as having no origin.
const MOST_STEPS: usize = 30;
/// Distance from the wanted position at which Newton's method stops, in focal lengths.
const CLOSE: f64 = 1e-9;
/// The pinhole image has at most this many times the size of the lens's own, along each axis.
const MOST_GROWTH: f64 = 2.0;
/// Pixels beyond the image's border up to which the border's colours hold.
const BORDER: f64 = 0.5;
/// Most places along each side of an image at which its border is followed: it is smooth, so that a side of 10,000
/// pixels is still met to a thousandth of a pixel.
const MOST_PLACES: u32 = 1024;
/// Largest width and height of an image, in pixels.
pub(crate) const LARGEST_SIDE: u64 = u16::MAX as u64;

/// Radial and tangential distortion of normalised image coordinates (x / z, y / z), as in OpenCV: with
/// r^2 = x^2 + y^2,
///
/// - x' = x (1 + k1 r^2 + k2 r^4) + 2 p1 x y + p2 (r^2 + 2 x^2)
/// - y' = y (1 + k1 r^2 + k2 r^4) + 2 p2 x y + p1 (r^2 + 2 y^2)
#[derive(Clone, Copy, Debug, Default, PartialEq)]
pub struct Distortion {
    /// Radial, second order.
    pub k1: f64,
    /// Radial, fourth order.
    pub k2: f64,
    /// Tangential, along y.
    pub p1: f64,
    /// Tangential, along x.
    pub p2: f64,
}

impl Distortion {
    /// Whether nothing is bent.
    pub fn is_none(&self) -> bool {
        *self == Self::default()
    }

    /// Where the lens shows the normalised position (x, y); `None` where it would fold the image over:
    /// beyond the radius at which r (1 + k1 r^2 + k2 r^4) grows no more.
    pub fn distort(&self, x: f64, y: f64) -> Option<(f64, f64)> {
        (x * x + y * y < self.fold()).then(|| self.formula(x, y))
    }

    /// The normalised position that the lens shows at (x, y), by Newton's method; `None` where it finds
    /// none.
    pub fn undistort(&self, x: f64, y: f64) -> Option<(f64, f64)> {
        let (mut u, mut v) = (x, y);
        for _ in 0..MOST_STEPS {
            let (shown_x, shown_y) = self.formula(u, v);
            let (gap_x, gap_y) = (shown_x - x, shown_y - y);
            if gap_x.hypot(gap_y) < CLOSE {
                return (u * u + v * v < self.fold()).then_some((u, v));
            }
            let [[a, b], [c, d]] = self.derivative(u, v);
            let determinant = a * d - b * c;
            u -= (d * gap_x - b * gap_y) / determinant;
            v -= (a * gap_y - c * gap_x) / determinant;
        }
        None
    }

    fn formula(&self, x: f64, y: f64) -> (f64, f64) {
        let Self { k1, k2, p1, p2 } = *self;
        let square = x * x + y * y;
        let radial = 1.0 + square * (k1 + square * k2);
        (
            x * radial + 2.0 * p1 * x * y + p2 * (square + 2.0 * x * x),
            y * radial + 2.0 * p2 * x * y + p1 * (square + 2.0 * y * y),
        )
    }

    /// The derivative of the formula: rows x' and y', columns x and y.
    fn derivative(&self, x: f64, y: f64) -> [[f64; 2]; 2] {
        let Self { k1, k2, p1, p2 } = *self;
        let square = x * x + y * y;
        let radial = 1.0 + square * (k1 + square * k2);
        let slope = 2.0 * k1 + 4.0 * k2 * square;
        let mixed = x * y * slope + 2.0 * (p1 * x + p2 * y);
        [
            [radial + x * x * slope + 2.0 * p1 * y + 6.0 * p2 * x, mixed],
            [mixed, radial + y * y * slope + 2.0 * p2 * x + 6.0 * p1 * y],
        ]
    }

    /// Squared radius at which the radial part stops growing: the smallest positive root u of
    /// 1 + 3 k1 u + 5 k2 u^2, infinite where there is none.
    fn fold(&self) -> f64 {
        let (a, b) = (5.0 * self.k2, 3.0 * self.k1);
        let root = (b * b - 4.0 * a).sqrt();
        // The form without a difference of like numbers, which also holds for a = 0.
        [2.0 / (-b - root), 2.0 / (-b + root)]
            .into_iter()
            .filter(|&u| u > 0.0)
            .fold(f64::INFINITY, f64::min)
    }
}

/// How the image of a frame on disk was taken.
///
/// A [`Frame`](super::Frame) is a pinhole image; this is the way back to the image that it was made from.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct Lens {
    /// Size and intrinsics of the image on disk.
    pub image: Camera,
    /// What the lens does to normalised coordinates.
    pub distortion: Distortion,
}

impl Lens {
    /// A lens of images of this width and height, with its intrinsics fx, fy, cx, cy in pixels; and the
    /// pinhole camera that takes its place.
    ///
    /// # Errors
    /// What is wrong with these values.
    pub(super) fn checked(
        [width, height]: [u64; 2],
        intrinsics: [f64; 4],
        distortion: Distortion,
    ) -> Result<(Self, Camera), CameraError> {
        let size =
            image_size([width, height].map(|side| side as f64)).ok_or(CameraError::Size(width, height))?;
        let image = Camera::checked(size, intrinsics)?;
        let Distortion { k1, k2, p1, p2 } = distortion;
        if [k1, k2, p1, p2].iter().any(|value| !value.is_finite()) {
            return Err(CameraError::Distortion);
        }
        let lens = Self { image, distortion };
        if distortion.is_none() {
            return Ok((lens, image));
        }
        lens.pinhole()
            .filter(|pinhole| pinhole.problem().is_none())
            .map(|pinhole| (lens, pinhole))
            .ok_or(CameraError::Bent)
    }

    /// The pinhole camera that shows all of the image at the same focal length, as far as it has at most
    /// twice the image's size.
    ///
    /// `None` where the distortion is so strong that no part of the image's border can be undone.
    pub fn pinhole(&self) -> Option<Camera> {
        let image = &self.image;
        let (w, h) = (f64::from(image.width), f64::from(image.height));
        let places = |size: u32| {
            let count = size.clamp(1, MOST_PLACES);
            (0..=count).map(move |place| f64::from(place) * f64::from(size) / f64::from(count))
        };
        let along_x = places(image.width).flat_map(|x| [(x, 0.0), (x, h)]);
        let along_y = places(image.height).flat_map(|y| [(0.0, y), (w, y)]);
        let mut low = [f64::INFINITY; 2];
        let mut high = [f64::NEG_INFINITY; 2];
        for (x, y) in along_x.chain(along_y) {
            let Some((u, v)) = self.normalised(x, y) else {
                continue;
            };
            let place: [f64; 2] = in_pixels(image, u, v).into();
            for axis in 0..2 {
                low[axis] = low[axis].min(place[axis]);
                high[axis] = high[axis].max(place[axis]);
            }
        }
        let margin = 0.5 * (MOST_GROWTH - 1.0);
        // A hair's breadth of rounding must not cost a row of pixels.
        let [left, top] = [(low[0], w), (low[1], h)].map(|(v, size)| (v + 1e-3).floor().max(-margin * size));
        let [right, bottom] =
            [(high[0], w), (high[1], h)].map(|(v, size)| (v - 1e-3).ceil().min((1.0 + margin) * size));
        (right - left >= 1.0 && bottom - top >= 1.0).then_some(Camera {
            width: (right - left) as u32,
            height: (bottom - top) as u32,
            cx: image.cx - left as f32,
            cy: image.cy - top as f32,
            ..*image
        })
    }

    /// Where the image on disk shows a normalised position, in pixels; `None` beyond the lens's reach.
    pub fn place(&self, x: f64, y: f64) -> Option<(f64, f64)> {
        let (x, y) = self.distortion.distort(x, y)?;
        Some(in_pixels(&self.image, x, y))
    }

    /// The normalised position that the image on disk shows at (x, y), in pixels.
    fn normalised(&self, x: f64, y: f64) -> Option<(f64, f64)> {
        let (x, y) = normalised(&self.image, x, y);
        self.distortion.undistort(x, y)
    }

    /// Position in the image on disk of position (x, y) in the image of `pinhole`, both in pixels; `None`
    /// where that image does not reach.
    pub fn to_image(&self, pinhole: &Camera, x: f64, y: f64) -> Option<(f64, f64)> {
        let (u, v) = normalised(pinhole, x, y);
        let (width, height) = (f64::from(self.image.width), f64::from(self.image.height));
        self.place(u, v)
            .filter(|&(x, y)| x >= -BORDER && y >= -BORDER && x <= width + BORDER && y <= height + BORDER)
    }

    /// Position in the image of `pinhole` of position (x, y) in the image on disk, both in pixels; `None`
    /// where that image does not reach.
    pub fn to_pinhole(&self, pinhole: &Camera, x: f64, y: f64) -> Option<(f64, f64)> {
        let (u, v) = self.normalised(x, y)?;
        let (x, y) = in_pixels(pinhole, u, v);
        let inside = x >= 0.0 && y >= 0.0 && x < f64::from(pinhole.width) && y < f64::from(pinhole.height);
        inside.then_some((x, y))
    }

    /// The image as `pinhole` would have taken it, bilinear; black where it does not reach.
    ///
    /// `None` unless `image` has this lens's size.
    pub fn resample(&self, pinhole: &Camera, image: &ColorImage) -> Option<ColorImage> {
        let (width, height) = (self.image.width, self.image.height);
        if (image.width(), image.height()) != (width, height) || width == 0 || height == 0 {
            return None;
        }
        let mut rgb = Vec::with_capacity(3 * pinhole.pixels());
        for row in 0..pinhole.height {
            for column in 0..pinhole.width {
                let place = self.to_image(pinhole, f64::from(column) + 0.5, f64::from(row) + 0.5);
                rgb.extend(place.map_or([0; 3], |(x, y)| bilinear(image, x, y)));
            }
        }
        ColorImage::new(pinhole.width, pinhole.height, rgb)
    }
}

/// Where a pinhole camera shows the normalised position (x, y), in pixels.
fn in_pixels(camera: &Camera, x: f64, y: f64) -> (f64, f64) {
    (
        f64::from(camera.fx) * x + f64::from(camera.cx),
        f64::from(camera.fy) * y + f64::from(camera.cy),
    )
}

/// The normalised position that a pinhole camera shows at (x, y), in pixels.
fn normalised(camera: &Camera, x: f64, y: f64) -> (f64, f64) {
    (
        (x - f64::from(camera.cx)) / f64::from(camera.fx),
        (y - f64::from(camera.cy)) / f64::from(camera.fy),
    )
}

/// Colour at an image position, in pixels, from the four pixel centres around it.
fn bilinear(image: &ColorImage, x: f64, y: f64) -> [u8; 3] {
    let across = |v: f64, size: u32| {
        let v = (v - 0.5).clamp(0.0, f64::from(size - 1));
        let low = v.floor() as u32;
        (low, (low + 1).min(size - 1), (v - v.floor()) as f32)
    };
    let (left, right, share_x) = across(x, image.width());
    let (top, bottom, share_y) = across(y, image.height());
    let at = |column: u32, row: u32| {
        let [r, g, b] = image.pixel(row as usize * image.width() as usize + column as usize);
        glam::Vec3::new(f32::from(r), f32::from(g), f32::from(b))
    };
    let upper = at(left, top).lerp(at(right, top), share_x);
    let lower = at(left, bottom).lerp(at(right, bottom), share_x);
    upper.lerp(lower, share_y).to_array().map(|v| v.round() as u8)
}

#[cfg(test)]
mod tests {
    use super::*;

    const OPENCV: Distortion = Distortion {
        k1: -0.28,
        k2: 0.07,
        p1: 0.001,
        p2: -0.002,
    };

    fn lens(distortion: Distortion) -> Lens {
        Lens {
            image: Camera::new([64, 48], [50.0, 52.0, 31.0, 25.0]),
            distortion,
        }
    }

    #[test]
    fn the_formula_is_opencvs() {
        // x = 0.5, y = -0.25: r^2 = 0.3125, radial = 1 - 0.0875 + 0.0068359375 = 0.9193359375.
        // x' = 0.45966796875 + 2 * 0.001 * -0.125 - 0.002 * (0.3125 + 0.5)   = 0.45779296875
        // y' = -0.229833984375 + 2 * -0.002 * -0.125 + 0.001 * (0.3125 + 0.125) = -0.228896484375
        let (x, y) = OPENCV.distort(0.5, -0.25).unwrap();
        assert!((x - 0.457_792_968_75).abs() < 1e-12, "{x}");
        assert!((y + 0.228_896_484_375).abs() < 1e-12, "{y}");
    }

    #[test]
    fn there_and_back_is_the_same_place() {
        for distortion in [
            Distortion::default(),
            OPENCV,
            Distortion {
                k1: 0.3,
                k2: 0.1,
                ..OPENCV
            },
            Distortion {
                k1: -0.1,
                ..Distortion::default()
            },
        ] {
            let lens = lens(distortion);
            let pinhole = lens.pinhole().unwrap();
            for row in 0..48 {
                for column in 0..64 {
                    let (x, y) = (f64::from(column) + 0.5, f64::from(row) + 0.5);
                    let (u, v) = lens.to_pinhole(&pinhole, x, y).unwrap();
                    let (back_x, back_y) = lens.to_image(&pinhole, u, v).unwrap();
                    assert!((back_x - x).hypot(back_y - y) < 1e-4, "{distortion:?} {x} {y}");
                }
            }
        }
    }

    #[test]
    fn beyond_the_fold_nothing_is_shown() {
        // r (1 - r^2 / 3) grows up to r = 1, where it is 2/3.
        let barrel = Distortion {
            k1: -1.0 / 3.0,
            ..Distortion::default()
        };
        assert!((barrel.fold() - 1.0).abs() < 1e-12);
        assert_eq!(barrel.distort(1.01, 0.0), None);
        assert!(barrel.distort(0.99, 0.0).is_some());
        assert!(barrel.undistort(0.66, 0.0).is_some());
        assert_eq!(barrel.undistort(0.67, 0.0), None);
        assert_eq!(Distortion::default().fold(), f64::INFINITY);
        assert_eq!(OPENCV.undistort(f64::NAN, 0.0), None);
    }

    #[test]
    fn a_straight_lens_keeps_the_camera_and_a_barrel_needs_a_larger_one() {
        let straight = lens(Distortion::default());
        assert_eq!(straight.pinhole(), Some(straight.image));
        let larger = lens(OPENCV).pinhole().unwrap();
        assert!(larger.width > 64 && larger.height > 48, "{larger:?}");
        let extreme = lens(Distortion {
            k1: -0.6,
            ..Distortion::default()
        });
        let bounded = extreme.pinhole().unwrap();
        assert!(bounded.width <= 128 && bounded.height <= 96, "{bounded:?}");
    }

    #[test]
    fn the_pinhole_image_of_a_large_one_shows_all_of_its_border() {
        let scale = 100;
        let small = lens(OPENCV);
        let image = small
            .image
            .stretched(scale * small.image.width, scale * small.image.height);
        let large = Lens { image, ..small };
        let pinhole = large.pinhole().unwrap();
        for x in 0..large.image.width {
            for y in [0, large.image.height - 1] {
                let place = large.to_pinhole(&pinhole, f64::from(x) + 0.5, f64::from(y) + 0.5);
                assert!(place.is_some(), "{x} {y} {pinhole:?}");
            }
        }
    }

    #[test]
    fn a_resampled_gradient_follows_the_formula() {
        let lens = lens(OPENCV);
        let pinhole = lens.pinhole().unwrap();
        let rgb = (0..48)
            .flat_map(|y| (0..64).flat_map(move |x| [4 * x as u8, 5 * y as u8, 9]))
            .collect();
        let image = ColorImage::new(64, 48, rgb).unwrap();
        let seen = lens.resample(&pinhole, &image).unwrap();
        let mut black = 0;
        for index in 0..pinhole.pixels() {
            let (column, row) = (index as u32 % pinhole.width, index as u32 / pinhole.width);
            match lens.to_image(&pinhole, f64::from(column) + 0.5, f64::from(row) + 0.5) {
                None => {
                    black += 1;
                    assert_eq!(seen.pixel(index), [0; 3]);
                }
                Some((x, y)) => {
                    let [r, g, b] = seen.pixel(index).map(f64::from);
                    let expected = [4.0 * (x - 0.5).clamp(0.0, 63.0), 5.0 * (y - 0.5).clamp(0.0, 47.0)];
                    assert!((r - expected[0]).abs() < 0.51 && (g - expected[1]).abs() < 0.51 && b == 9.0);
                }
            }
        }
        assert!(black > 0);
        let other = ColorImage::new(1, 1, vec![0; 3]).unwrap();
        assert!(lens.resample(&pinhole, &other).is_none());
    }
}
