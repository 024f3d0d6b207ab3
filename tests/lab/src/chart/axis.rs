//! Ranges, ticks and the text of numbers.

use super::Scale;

/// An axis over the range of its data, on `length` pixels.
#[derive(Clone, Debug)]
pub(super) struct Range {
    logarithmic: bool,
    /// Ends, as logarithms (base 10) on a logarithmic axis.
    low: f64,
    high: f64,
    pub(super) ticks: Vec<f64>,
}

impl Range {
    /// The range of the drawable ones among `values`, with ticks at least `spacing` pixels apart; `None`
    /// where there are none.
    pub(super) fn of(
        scale: Scale,
        values: impl IntoIterator<Item = f64>,
        length: f64,
        spacing: f64,
    ) -> Option<Self> {
        let logarithmic = scale == Scale::Logarithmic;
        let drawable = values.into_iter().filter(|&value| is_drawable(scale, value));
        let placed = drawable.map(|value| if logarithmic { value.log10() } else { value });
        let nothing = (f64::INFINITY, f64::NEG_INFINITY);
        let (mut low, mut high) = placed.fold(nothing, |(low, high), at| (low.min(at), high.max(at)));
        if low > high {
            return None;
        }
        if scale == Scale::FromZero {
            (low, high) = (low.min(0.0), high.max(0.0));
        }
        if high - low < 1e-9 * high.abs().max(1e-9) {
            // One value: room on both sides.
            let room = if logarithmic {
                0.3
            } else {
                (0.5 * high.abs()).max(0.5)
            };
            (low, high) = (low - room, high + room);
        }
        let margin = 0.05 * (high - low);
        if scale != Scale::FromZero || low < 0.0 {
            low -= margin;
        }
        high += margin;
        let most = (length / spacing).floor().max(2.0) as usize;
        let ticks = if logarithmic {
            logarithmic_ticks(10.0_f64.powf(low), 10.0_f64.powf(high), most)
        } else {
            linear_ticks(low, high, most)
        };
        Some(Self {
            logarithmic,
            low,
            high,
            ticks,
        })
    }

    /// Place of a value, 0 at the low end and 1 at the high end.
    pub(super) fn place(&self, value: f64) -> f64 {
        let value = if self.logarithmic { value.log10() } else { value };
        (value - self.low) / (self.high - self.low)
    }
}

/// Whether a value has a place on an axis.
pub(super) fn is_drawable(scale: Scale, value: f64) -> bool {
    value.is_finite() && (scale != Scale::Logarithmic || value > 0.0)
}

/// Multiples of 1, 2 or 5 times a power of ten within a range, at most `most` of them.
pub(super) fn linear_ticks(low: f64, high: f64, most: usize) -> Vec<f64> {
    let span = high - low;
    if !span.is_finite() || span <= 0.0 {
        return Vec::new();
    }
    let smallest = 10.0_f64.powi((span / most.max(1) as f64).log10().floor() as i32);
    let count = |step: f64| (high / step).floor() - (low / step).ceil() + 1.0;
    let steps = [1.0, 2.0, 5.0, 10.0, 20.0, 50.0, 100.0].map(|factor| factor * smallest);
    let step = steps.into_iter().find(|&step| count(step) <= most as f64);
    let step = step.unwrap_or(span);
    let first = (low / step).ceil();
    let numbers = 0..count(step).max(0.0) as usize;
    numbers.map(|k| (first + k as f64) * step).collect()
}

/// Round values within a range of positive numbers, at most about `most` of them: whole powers of ten, or
/// some of their multiples; evenly spaced ones where the range is too narrow for those.
pub(super) fn logarithmic_ticks(low: f64, high: f64, most: usize) -> Vec<f64> {
    const MULTIPLES: [&[f64]; 4] = [&[1.0, 2.0, 3.0, 5.0, 7.0], &[1.0, 2.0, 5.0], &[1.0, 3.0], &[1.0]];
    let decades = low.log10().floor() as i32..=high.log10().ceil() as i32;
    let within = |value: &f64| (low..=high).contains(value);
    let choices = MULTIPLES.map(|multiples| -> Vec<f64> {
        let all = decades.clone().flat_map(|decade| {
            let power = 10.0_f64.powi(decade);
            multiples.iter().map(move |multiple| multiple * power)
        });
        all.filter(within).collect()
    });
    if high / low < 3.0 {
        return linear_ticks(low, high, most);
    }
    // Five to a decade are only for less than one.
    let wide = high / low >= 8.0;
    let fits = |ticks: &&Vec<f64>| ticks.len() <= most;
    match choices.iter().skip(usize::from(wide)).find(fits) {
        Some(ticks) if ticks.len() >= 3 => ticks.clone(),
        _ if high / low < 30.0 => linear_ticks(low, high, most),
        _ => {
            let powers = &choices[3];
            let stride = powers.len().div_ceil(most.max(1));
            powers.iter().copied().step_by(stride.max(1)).collect()
        }
    }
}

/// A number with three significant digits, in thousands from ten thousand on.
pub(super) fn number(value: f64) -> String {
    if value == 0.0 {
        return "0".to_owned();
    }
    let (scaled, suffix) = match value.abs() >= 9999.5 {
        true => (value / 1e3, "k"),
        false => (value, ""),
    };
    let before_point = scaled.abs().log10().floor() as i32;
    let decimals = (2 - before_point).max(0) as usize;
    let text = format!("{scaled:.decimals$}");
    let text = match text.contains('.') {
        true => text.trim_end_matches('0').trim_end_matches('.'),
        false => &text,
    };
    format!("{}{suffix}", text.replace('-', "\u{2212}"))
}

/// The text of ticks, with as many decimals as all of them need.
pub(super) fn tick_texts(ticks: &[f64]) -> Vec<String> {
    let largest = ticks.iter().copied().map(f64::abs).fold(0.0, f64::max);
    let gaps = ticks.windows(2).map(|pair| pair[1] - pair[0]);
    let gap = gaps.fold(f64::INFINITY, f64::min);
    // Three digits tell neighbours apart unless they differ by less than a hundredth of their size.
    if gap >= 0.01 * largest || !(1e-3..1e4).contains(&largest) {
        return ticks.iter().map(|&tick| number(tick)).collect();
    }
    let decimals = (-gap.log10().floor()).clamp(0.0, 6.0) as usize;
    let text = |tick: &f64| format!("{tick:.decimals$}").replace('-', "\u{2212}");
    ticks.iter().map(text).collect()
}
