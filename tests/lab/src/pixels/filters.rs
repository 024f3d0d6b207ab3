//! A bank of filters: what a pixel's surroundings look like, in one image alone.

use inplace_core::scene::Frame;

/// Standard deviations of the Gaussians, in pixels.
const SCALES: [f32; 4] = [1.0, 2.0, 4.0, 8.0];
/// At each scale: colour, gradient magnitude, and the eigenvalues of the Hessian and their sum (the Laplacian).
const PER_SCALE: usize = 7;
/// Responses of a pixel.
pub const RESPONSES: usize = PER_SCALE * SCALES.len();

/// An image, blurred at every scale.
pub struct FilterBank {
    /// Width of the image in pixels.
    pub width: usize,
    /// Height of the image in pixels.
    pub height: usize,
    /// Colour `[height, width]` at each scale.
    blurred: [Vec<[f32; 3]>; SCALES.len()],
}

impl FilterBank {
    /// Blurs a frame's image.
    pub fn of(frame: &Frame) -> Self {
        let (width, height) = (frame.camera.width as usize, frame.camera.height as usize);
        let color = frame.color();
        let of = |pixel| color.color(pixel).to_array();
        let image: Vec<[f32; 3]> = (0..width * height).map(of).collect();
        let blurred = SCALES.map(|sigma| blurred(&image, width, height, sigma));
        Self {
            width,
            height,
            blurred,
        }
    }

    /// The responses at a pixel: derivatives are central differences of the blurred brightness.
    pub fn at(&self, x: usize, y: usize) -> [f32; RESPONSES] {
        let mut features = [0.0; RESPONSES];
        let of_scales = features.chunks_exact_mut(PER_SCALE).zip(&self.blurred);
        for ((own, image), sigma) in of_scales.zip(SCALES) {
            let bright = |dx: isize, dy: isize| {
                let x = x.saturating_add_signed(dx).min(self.width - 1);
                let y = y.saturating_add_signed(dy).min(self.height - 1);
                image[y * self.width + x].iter().sum::<f32>() / 3.0
            };
            own[..3].copy_from_slice(&image[y * self.width + x]);
            let middle = bright(0, 0);
            let across = (bright(1, 0) - bright(-1, 0)) / 2.0;
            let down = (bright(0, 1) - bright(0, -1)) / 2.0;
            let xx = bright(1, 0) + bright(-1, 0) - 2.0 * middle;
            let yy = bright(0, 1) + bright(0, -1) - 2.0 * middle;
            let xy = (bright(1, 1) + bright(-1, -1) - bright(1, -1) - bright(-1, 1)) / 4.0;
            let (mean, spread) = ((xx + yy) / 2.0, ((xx - yy).powi(2) / 4.0 + xy * xy).sqrt());
            own[3] = sigma * across.hypot(down);
            own[4] = sigma * sigma * (mean + spread);
            own[5] = sigma * sigma * (mean - spread);
            own[6] = sigma * sigma * 2.0 * mean;
        }
        features
    }
}

/// A Gaussian blur, first along the rows, then along the columns; the border is repeated.
fn blurred(image: &[[f32; 3]], width: usize, height: usize, sigma: f32) -> Vec<[f32; 3]> {
    let reach = (2.5 * sigma).ceil() as isize;
    let weight = |k: isize| (-((k * k) as f32) / (2.0 * sigma * sigma)).exp();
    let weights: Vec<f32> = (-reach..=reach).map(weight).collect();
    let total: f32 = weights.iter().sum();
    let pass = |from: &[[f32; 3]], at: &dyn Fn(usize, usize, isize) -> usize| -> Vec<[f32; 3]> {
        let pixel = |index: usize| {
            let mut sum = [0.0; 3];
            for (weight, k) in weights.iter().zip(-reach..) {
                let other = from[at(index % width, index / width, k)];
                (0..3).for_each(|channel| sum[channel] += weight / total * other[channel]);
            }
            sum
        };
        (0..width * height).map(pixel).collect()
    };
    let near = |at: usize, k, size: usize| at.saturating_add_signed(k).min(size - 1);
    let rows = pass(image, &|x, y, k| y * width + near(x, k, width));
    pass(&rows, &|x, y, k| near(y, k, height) * width + x)
}
