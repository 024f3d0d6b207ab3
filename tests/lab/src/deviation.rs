//! Means over seeds.

/// Mean and standard deviation of a sample; the deviation of a single value is 0, and of none both are not numbers.
pub fn mean_and_deviation(values: &[f64]) -> (f64, f64) {
    let count = values.len() as f64;
    let mean = values.iter().sum::<f64>() / count;
    let squares = values.iter().map(|value| (value - mean).powi(2)).sum::<f64>();
    let variance = if values.is_empty() {
        f64::NAN
    } else {
        squares / (count - 1.0).max(1.0)
    };
    (mean, variance.sqrt())
}

/// The mean alone.
pub fn mean(values: impl IntoIterator<Item = f64>) -> f64 {
    mean_and_deviation(&values.into_iter().collect::<Vec<f64>>()).0
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn the_deviation_is_that_of_a_sample() {
        assert_eq!(mean_and_deviation(&[0.5]), (0.5, 0.0));
        let (mean, deviation) = mean_and_deviation(&[1.0, 2.0, 3.0]);
        assert!((mean - 2.0).abs() < 1e-12 && (deviation - 1.0).abs() < 1e-12);
        assert!(mean_and_deviation(&[]).0.is_nan());
    }
}
