//! Lenses that bend straight lines, and the pinhole camera that takes their place.

mod straightening;

use glam::DVec2;

use super::Camera;
use super::camera::image_size;

/// Steps of Newton's method before a position counts as having no origin.
const MOST_STEPS: usize = 30;
/// Distance from the wanted position at which Newton's method stops, in focal lengths.
const CLOSE: f64 = 1e-9;
/// Squared radius below which a fisheye lens is computed by its series: the difference there is below rounding.
const NEAR_AXIS: f64 = 1e-9;
/// Angles to the axis at which it is looked for where a lens folds the image over, and the halvings of the interval
/// between two of them.
const FOLD_ANGLES: u16 = 1024;
const FOLD_HALVINGS: usize = 50;
/// The pinhole image has at most this many times the size of the lens's own, along each axis.
const MOST_GROWTH: f64 = 2.0;
/// Pixels beyond the image's border up to which the border's colours hold.
const BORDER: f64 = 0.5;
/// Most places along each side of an image at which its border is followed: it is smooth, so that a side of 10,000
/// pixels is still met to a thousandth of a pixel.
const MOST_PLACES: u32 = 1024;
/// Places along each axis of an image by which it is told how much of it a pinhole camera shows.
const SHARE_PLACES: u32 = 16;
/// Largest width and height of an image, in pixels.
pub(crate) const LARGEST_SIDE: u64 = u16::MAX as u64;

/// How a lens bends normalised image coordinates (x / z, y / z), with OpenCV's formulas and coefficients. With
/// r^2 = x^2 + y^2,
///
/// - x' = x R + 2 p1 x y + p2 (r^2 + 2 x^2)
/// - y' = y R + 2 p2 x y + p1 (r^2 + 2 y^2)
///
/// where R = (1 + k1 r^2 + k2 r^4 + k3 r^6) / (1 + k4 r^2 + k5 r^4 + k6 r^6), or for a fisheye lens, with a = atan(r),
/// R = a (1 + k1 a^2 + k2 a^4 + k3 a^6 + k4 a^8) / r.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct Distortion {
    radial: [f64; 6],
    tangential: [f64; 2],
    is_fisheye: bool,
    /// Squared radius at which r R stops growing; infinite where it always grows.
    fold: f64,
}

impl Default for Distortion {
    fn default() -> Self {
        Self::opencv([])
    }
}

impl Distortion {
    /// That of a perspective lens, by up to eight coefficients in OpenCV's order: k1, k2, p1, p2, k3, k4, k5, k6. Those
    /// that are not given are 0.
    pub fn opencv<const N: usize>(given: [f64; N]) -> Self {
        let [k1, k2, p1, p2, k3, k4, k5, k6] = filled(given);
        Self::with_fold([k1, k2, k3, k4, k5, k6], [p1, p2], false)
    }

    /// That of a fisheye lens, by up to four coefficients in OpenCV's order: k1, k2, k3, k4. Those that are not given
    /// are 0.
    pub fn fisheye<const N: usize>(given: [f64; N]) -> Self {
        Self::with_fold(filled(given), [0.0; 2], true)
    }

    fn with_fold(radial: [f64; 6], tangential: [f64; 2], is_fisheye: bool) -> Self {
        let mut distortion = Self {
            radial,
            tangential,
            is_fisheye,
            fold: f64::INFINITY,
        };
        distortion.fold = distortion.first_fold();
        distortion
    }

    /// Whether nothing is bent.
    pub fn is_none(&self) -> bool {
        !self.is_fisheye && self.radial == [0.0; 6] && self.tangential == [0.0; 2]
    }

    fn is_finite(&self) -> bool {
        self.radial
            .iter()
            .chain(&self.tangential)
            .all(|value| value.is_finite())
    }

    /// Where the lens shows the normalised position (x, y); `None` where it would fold the image over: beyond the radius
    /// at which r R grows no more.
    pub fn distort(&self, x: f64, y: f64) -> Option<(f64, f64)> {
        (x * x + y * y < self.fold).then(|| self.formula(x, y))
    }

    /// The normalised position that the lens shows at (x, y), by Newton's method; `None` where it finds
    /// none.
    pub fn undistort(&self, x: f64, y: f64) -> Option<(f64, f64)> {
        let (mut u, mut v) = (x, y);
        for _ in 0..MOST_STEPS {
            let (shown_x, shown_y) = self.formula(u, v);
            let (gap_x, gap_y) = (shown_x - x, shown_y - y);
            if gap_x * gap_x + gap_y * gap_y < CLOSE * CLOSE {
                return (u * u + v * v < self.fold).then_some((u, v));
            }
            let [[a, b], [c, d]] = self.derivative(u, v);
            let determinant = a * d - b * c;
            u -= (d * gap_x - b * gap_y) / determinant;
            v -= (a * gap_y - c * gap_x) / determinant;
        }
        None
    }

    fn formula(&self, x: f64, y: f64) -> (f64, f64) {
        let [p1, p2] = self.tangential;
        let square = x * x + y * y;
        let (radial, _) = self.radial(square);
        (
            x * radial + 2.0 * p1 * x * y + p2 * (square + 2.0 * x * x),
            y * radial + 2.0 * p2 * x * y + p1 * (square + 2.0 * y * y),
        )
    }

    /// The derivative of the formula: rows x' and y', columns x and y.
    fn derivative(&self, x: f64, y: f64) -> [[f64; 2]; 2] {
        let [p1, p2] = self.tangential;
        let (radial, change) = self.radial(x * x + y * y);
        let slope = 2.0 * change;
        let mixed = x * y * slope + 2.0 * (p1 * x + p2 * y);
        [
            [radial + x * x * slope + 2.0 * p1 * y + 6.0 * p2 * x, mixed],
            [mixed, radial + y * y * slope + 2.0 * p2 * x + 6.0 * p1 * y],
        ]
    }

    /// R at a squared radius, and its derivative by the squared radius.
    fn radial(&self, square: f64) -> (f64, f64) {
        let [k1, k2, k3, k4, k5, k6] = self.radial;
        if !self.is_fisheye {
            let (above, above_change) = polynomial(square, [k1, k2, k3, 0.0]);
            let (below, below_change) = polynomial(square, [k4, k5, k6, 0.0]);
            let change = (above_change * below - above * below_change) / (below * below);
            return (above / below, change);
        }
        if square < NEAR_AXIS {
            // The first terms of the series.
            let change = k1 - 1.0 / 3.0;
            return (1.0 + change * square, change);
        }
        let r = square.sqrt();
        let angle = r.atan();
        let (factor, factor_change) = polynomial(angle * angle, [k1, k2, k3, k4]);
        let bent = angle * factor;
        // By the angle, and then by the radius.
        let bent_change = (factor + 2.0 * angle * angle * factor_change) / (1.0 + square);
        (bent / r, (bent_change - bent / r) / (2.0 * square))
    }

    /// Squared radius at which r R first stops growing, looked for at even angles to the axis; infinite where it is not
    /// found.
    fn first_fold(&self) -> f64 {
        let square = |angle: f64| angle.tan().powi(2);
        let grows = |angle: f64| {
            let (radial, change) = self.radial(square(angle));
            radial > 0.0 && radial + 2.0 * square(angle) * change > 0.0
        };
        let step = std::f64::consts::FRAC_PI_2 / f64::from(FOLD_ANGLES);
        let angles = (1..FOLD_ANGLES).map(|number| f64::from(number) * step);
        let Some(first) = angles.into_iter().find(|&angle| !grows(angle)) else {
            return f64::INFINITY;
        };
        let (mut low, mut high) = (first - step, first);
        for _ in 0..FOLD_HALVINGS {
            let middle = 0.5 * (low + high);
            if grows(middle) {
                low = middle;
            } else {
                high = middle;
            }
        }
        square(low)
    }
}

/// 1 + u (k1 + u (k2 + u (k3 + u k4))), and its derivative by u.
fn polynomial(u: f64, [k1, k2, k3, k4]: [f64; 4]) -> (f64, f64) {
    (
        1.0 + u * (k1 + u * (k2 + u * (k3 + u * k4))),
        k1 + u * (2.0 * k2 + u * (3.0 * k3 + u * 4.0 * k4)),
    )
}

/// The given numbers, and then zeros.
fn filled<const N: usize, const M: usize>(given: [f64; N]) -> [f64; M] {
    std::array::from_fn(|index| given.get(index).copied().unwrap_or(0.0))
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
    ) -> Result<(Self, Camera), String> {
        let Some(size) = image_size([width, height].map(|side| side as f64)) else {
            return Err(format!("{width} x {height} is not an image size in pixels"));
        };
        let image = Camera::checked(size, intrinsics)?;
        if !distortion.is_finite() {
            return Err("its distortion is not finite".to_owned());
        }
        let lens = Self { image, distortion };
        if distortion.is_none() {
            return Ok((lens, image));
        }
        lens.pinhole()
            .filter(|pinhole| pinhole.problem().is_none())
            .map(|pinhole| (lens, pinhole))
            .ok_or_else(|| "its distortion cannot be undone".to_owned())
    }

    /// The pinhole camera that shows all of the image at the same focal length, as far as it has at most
    /// twice the image's size.
    ///
    /// `None` where the distortion is so strong that neither a part of the image's border nor what is half as far out can be
    /// undone.
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
        // All of the border may lie behind the camera, as that of a fisheye's full circle does.
        if low[0] > high[0] && self.normalised(0.25 * w, 0.5 * h).is_some() {
            (low, high) = (
                [-margin * w, -margin * h],
                [(1.0 + margin) * w, (1.0 + margin) * h],
            );
        }
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

    /// Share of the image on disk, 0..=1, that the image of `pinhole` does not show.
    pub(super) fn share_beyond(&self, pinhole: &Camera) -> f32 {
        let middle =
            |place: u32, size: u32| (f64::from(place) + 0.5) * f64::from(size) / f64::from(SHARE_PLACES);
        let places = (0..SHARE_PLACES * SHARE_PLACES).map(|index| {
            let (column, row) = (index % SHARE_PLACES, index / SHARE_PLACES);
            (middle(column, self.image.width), middle(row, self.image.height))
        });
        let beyond = places.filter(|&(x, y)| self.to_pinhole(pinhole, x, y).is_none());
        beyond.count() as f32 / (SHARE_PLACES * SHARE_PLACES) as f32
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
}

/// Where a pinhole camera shows the normalised position (x, y), in pixels.
fn in_pixels(camera: &Camera, x: f64, y: f64) -> (f64, f64) {
    let (focal, center) = camera.intrinsics();
    (focal * DVec2::new(x, y) + center).into()
}

/// The normalised position that a pinhole camera shows at (x, y), in pixels.
fn normalised(camera: &Camera, x: f64, y: f64) -> (f64, f64) {
    let (focal, center) = camera.intrinsics();
    ((DVec2::new(x, y) - center) / focal).into()
}

#[cfg(test)]
mod tests {
    use super::*;

    const OPENCV: [f64; 4] = [-0.28, 0.07, 0.001, -0.002];

    fn opencv() -> Distortion {
        Distortion::opencv(OPENCV)
    }

    fn lens(distortion: Distortion) -> Lens {
        Lens {
            image: Camera::new([64, 48], [50.0, 52.0, 31.0, 25.0]),
            distortion,
        }
    }

    #[test]
    fn every_lens_shows_a_place_where_colmap_does() {
        // (1.2, 0.9) by `img_from_cam` of pycolmap 4.2.1, with the focal lengths 500 and 510 (300 and 305 for fisheye
        // lenses) and the principal point (320, 240).
        let full = Distortion::opencv([0.4, 0.05, 0.001, -0.002, 0.01, 0.5, 0.1, 0.02]);
        let fisheye = Distortion::fisheye([0.03, -0.01, 0.002, -0.0005]);
        for (distortion, [fx, fy], shown) in [
            (opencv(), [500.0, 510.0], [750.575, 572.258_625]),
            (
                full,
                [500.0, 510.0],
                [791.706_913_323_860_4, 603.724_538_692_753_2],
            ),
            (
                fisheye,
                [300.0, 305.0],
                [560.827_128_213_799_8, 423.630_685_263_022_4],
            ),
            (
                Distortion::fisheye([-0.02]),
                [300.0; 2],
                [551.314_025_210_077_6, 413.485_518_907_558_2],
            ),
        ] {
            // Beyond the fold nothing is shown, which COLMAP does not tell.
            let (x, y) = distortion.formula(1.2, 0.9);
            let gap = (fx * x + 320.0 - shown[0]).hypot(fy * y + 240.0 - shown[1]);
            assert!(gap < 1e-9, "{distortion:?}: {gap}");
        }
    }

    #[test]
    fn a_full_circle_whose_border_lies_behind_the_camera_is_shown_as_far_as_it_may_grow() {
        let lens = Lens {
            image: Camera::new([1280, 960], [300.0, 300.0, 640.0, 480.0]),
            distortion: Distortion::fisheye([0.0]),
        };
        let pinhole = lens.pinhole().unwrap();
        assert_eq!((pinhole.width, pinhole.height), (2560, 1920));
        assert_eq!((pinhole.cx, pinhole.cy), (1280.0, 960.0));
    }

    #[test]
    fn there_and_back_is_the_same_place() {
        for distortion in [
            Distortion::default(),
            opencv(),
            Distortion::opencv([0.3, 0.1, 0.001, -0.002]),
            Distortion::opencv([-0.1]),
            Distortion::opencv([0.4, 0.05, 0.001, -0.002, 0.01, 0.5, 0.1, 0.02]),
            Distortion::fisheye([0.03, -0.01, 0.002, -0.0005]),
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
        let barrel = Distortion::opencv([-1.0 / 3.0]);
        assert!((barrel.fold - 1.0).abs() < 1e-12);
        assert_eq!(barrel.distort(1.01, 0.0), None);
        assert!(barrel.distort(0.99, 0.0).is_some());
        assert!(barrel.undistort(0.66, 0.0).is_some());
        assert_eq!(barrel.undistort(0.67, 0.0), None);
        assert_eq!(Distortion::default().fold, f64::INFINITY);
        assert_eq!(opencv().undistort(f64::NAN, 0.0), None);
    }

    #[test]
    fn a_straight_lens_keeps_the_camera_and_a_barrel_needs_a_larger_one() {
        let straight = lens(Distortion::default());
        assert_eq!(straight.pinhole(), Some(straight.image));
        let larger = lens(opencv()).pinhole().unwrap();
        assert!(larger.width > 64 && larger.height > 48, "{larger:?}");
        let extreme = lens(Distortion::opencv([-0.6]));
        let bounded = extreme.pinhole().unwrap();
        assert!(bounded.width <= 128 && bounded.height <= 96, "{bounded:?}");
    }

    #[test]
    fn the_pinhole_image_of_a_large_one_shows_all_of_its_border() {
        let scale = 100;
        let small = lens(opencv());
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
}
