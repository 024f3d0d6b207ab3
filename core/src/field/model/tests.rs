use glam::Vec3;

use super::*;
use crate::field::{OccupancyGrid, Ray, Sampling};
use crate::scene::testing::on_threads;

fn field(backend: Backend) -> RadianceField {
    let volume = Volume {
        min: Vec3::splat(-2.0),
        side: 4.0,
    };
    let capacity = Capacity {
        levels: 5,
        coarsest: 4,
        finest: 64,
        table_log2: 11,
        most_log2: 11,
        hidden: 32,
        steps: 100,
        cell: 4.0 / 64.0,
    };
    let field = RadianceField::new(volume, &capacity, 5, backend).unwrap();
    // Features large enough that all parts of the networks are at work.
    let mut rng = SmallRng::seed_from_u64(8);
    let table: Vec<f32> = (0..2 * field.grid.rows())
        .map(|_| rng.random_range(-1.0..1.0))
        .collect();
    let table = Tensor::from_vec(table, field.table.shape(), &Device::Cpu).unwrap();
    field.table.set(&table).unwrap();
    field
}

fn fused() -> RadianceField {
    field(Backend::default())
}

/// Rays of all kinds: of known and unknown length, and one that misses the volume.
fn samples(field: &RadianceField) -> (Arc<Samples>, Vec<f32>) {
    let mut rng = SmallRng::seed_from_u64(9);
    let rays: Vec<Ray> = (0..90)
        .map(|number| {
            let mut random = || rng.random_range(-1.0_f32..1.0);
            Ray {
                origin: if number == 40 {
                    Vec3::splat(50.0)
                } else {
                    Vec3::new(random(), random(), random())
                },
                direction: Vec3::new(random(), random(), random()).normalize(),
                length: (number % 3 == 0).then(|| 1.0 + random().abs()),
            }
        })
        .collect();
    let sampling = Sampling::new(0.06, [4, 6], Some(3));
    let samples = Samples::along(field, &OccupancyGrid::unknown(0.06), &rays, sampling).unwrap();
    let gaps = (0..samples.len()).map(|_| rng.random_range(0.0..1.0)).collect();
    (Arc::new(samples), gaps)
}

/// Loss, gradient of the table and of the weights.
type Descent = (f32, Vec<f32>, Vec<f32>);

fn descend(field: &RadianceField, out: &Tensor) -> Descent {
    let mix = Tensor::new(&[[1.0_f32, -0.7, 0.4, 0.9, 0.3, -0.8, 0.5]], &Device::Cpu).unwrap();
    let mixed = out.broadcast_mul(&mix).unwrap();
    let loss = (mixed.sqr().unwrap().sum_all().unwrap() + mixed.sum_all().unwrap()).unwrap();
    let gradients = loss.backward().unwrap();
    let flat = |gradient: &Tensor| gradient.flatten_all().unwrap().to_vec1().unwrap();
    let table = field.table_gradient(&gradients).unwrap();
    let weights = gradients.get(&field.weights).unwrap();
    (loss.to_scalar().unwrap(), flat(table), flat(weights))
}

fn assert_close(a: &[f32], b: &[f32], tolerance: f32, what: &str) {
    let scale = b.iter().fold(0.0_f32, |scale, v| scale.max(v.abs()));
    assert_eq!(a.len(), b.len());
    for (index, (a, b)) in a.iter().zip(b).enumerate() {
        let is_close = (a - b).abs() <= tolerance * scale;
        assert!(is_close, "{what} {index}: {a} {b} of {scale}");
    }
}

/// What is rendered of these samples, `[rays * 7]`, and what [`descend`] finds.
fn rendered(field: &RadianceField, samples: &(Arc<Samples>, Vec<f32>)) -> (Vec<f32>, Descent) {
    let out = field.render(Arc::clone(&samples.0), samples.1.clone()).unwrap();
    (
        out.flatten_all().unwrap().to_vec1().unwrap(),
        descend(field, &out),
    )
}

#[test]
fn the_fused_kernels_equal_plain_candle_ops_on_every_vector_unit() {
    let plain = field(Backend::Plain);
    let samples = samples(&plain);
    let wanted = Wanted {
        color: true,
        features: true,
    };
    let (expected, (expected_loss, expected_table, expected_weights)) = rendered(&plain, &samples);
    let evaluated = plain.evaluate(&samples.0, wanted).unwrap();
    for dispatch in Dispatch::available() {
        let fused = field(Backend::Fused(dispatch));
        let (out, (loss, table, weights)) = rendered(&fused, &samples);
        let gap = (loss - expected_loss).abs() / expected_loss.abs();
        assert!(gap < 1e-4, "{dispatch}");
        let got = fused.evaluate(&samples.0, wanted).unwrap();
        for (what, got, expected, tolerance) in [
            ("output", &out, &expected, 1e-5),
            ("table", &table, &expected_table, 1e-4),
            ("weights", &weights, &expected_weights, 1e-4),
            ("density", &got.density, &evaluated.density, 1e-5),
            ("color", &got.color, &evaluated.color, 1e-5),
            ("features", &got.features, &evaluated.features, 1e-5),
        ] {
            assert_close(got, expected, tolerance, what);
        }
    }
}

#[test]
fn the_fused_gradient_is_the_same_for_any_number_of_threads() {
    let field = fused();
    let samples = samples(&field);
    let on = |threads| on_threads(threads, || rendered(&field, &samples));
    assert_eq!(on(1), on(3));
}

#[test]
fn rays_without_samples_render_to_nothing() {
    let miss = Ray {
        origin: Vec3::splat(50.0),
        direction: Vec3::X,
        length: None,
    };
    let sampling = Sampling {
        step: 0.06,
        ..Sampling::default()
    };
    let grid = OccupancyGrid::unknown(0.06);
    for field in [fused(), field(Backend::Plain)] {
        let samples = Samples::along(&field, &grid, &[miss; 3], sampling).unwrap();
        let out = field.render(Arc::new(samples), Vec::new()).unwrap();
        assert_eq!(out.to_vec2::<f32>().unwrap(), [[0.0; 7]; 3]);
    }
}
