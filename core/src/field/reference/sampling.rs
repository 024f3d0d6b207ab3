//! Where a ray is sampled: stratified for the coarse network, by its weights for the fine one.

/// `count` distances between `near` and `far`, ascending: evenly spaced with both ends, and with `offset`
/// (numbers in 0..1) each moved at random between the middles of its neighbours.
pub fn stratified(near: f32, far: f32, count: usize, offset: Option<&mut dyn FnMut() -> f32>) -> Vec<f32> {
    let last = count.saturating_sub(1).max(1) as f32;
    let even = |k: usize| near + (far - near) * k as f32 / last;
    let Some(offset) = offset else {
        return (0..count).map(even).collect();
    };
    (0..count)
        .map(|k| {
            let middle = |other: usize| 0.5 * (even(k) + even(other));
            let (lower, upper) = (middle(k.saturating_sub(1)), middle((k + 1).min(count - 1)));
            lower + (upper - lower) * offset()
        })
        .collect()
}

/// Distances drawn from a histogram by inverting its cumulative distribution at `quantiles` (0..=1): bin k
/// lies between `edges[k]` and `edges[k + 1]` and has `weights[k]`, plus a little so that none is empty.
pub fn inverse_cdf(edges: &[f32], weights: &[f32], quantiles: impl Iterator<Item = f32>) -> Vec<f32> {
    const FLOOR: f32 = 1e-5;
    let total: f32 = weights.iter().map(|weight| weight + FLOOR).sum();
    let mut cumulative = Vec::with_capacity(edges.len());
    let mut sum = 0.0;
    cumulative.push(0.0);
    for weight in weights {
        sum += (weight + FLOOR) / total;
        cumulative.push(sum);
    }
    quantiles
        .map(|quantile| {
            let above = cumulative.partition_point(|&c| c <= quantile);
            let (below, above) = (above.saturating_sub(1), above.min(cumulative.len() - 1));
            let width = cumulative[above] - cumulative[below];
            let share = (quantile - cumulative[below]) / if width < FLOOR { 1.0 } else { width };
            edges[below] + share * (edges[above] - edges[below])
        })
        .collect()
}

/// The distances of the fine network, ascending: those of the coarse one, and `quantiles` of the histogram of
/// its weights, whose bins lie between the middles of its samples.
pub(super) fn refined(t: &[f32], weights: &[f32], quantiles: impl Iterator<Item = f32>) -> Vec<f32> {
    let middles: Vec<f32> = t.windows(2).map(|pair| 0.5 * (pair[0] + pair[1])).collect();
    let mut all = inverse_cdf(&middles, &weights[1..weights.len() - 1], quantiles);
    all.extend_from_slice(t);
    all.sort_by(f32::total_cmp);
    all
}

/// Distance of every sample to the next one of its ray; that of the last is as good as infinite.
pub(super) fn deltas(t: &[f32]) -> Vec<f32> {
    const INFINITE: f32 = 1e10;
    let mut deltas: Vec<f32> = t.windows(2).map(|pair| pair[1] - pair[0]).collect();
    deltas.push(INFINITE);
    deltas
}
