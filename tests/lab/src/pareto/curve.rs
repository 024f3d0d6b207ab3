//! Courses over wall time, summed up over the seeds, and which of them are ahead.

use std::collections::BTreeMap;

use serde::Serialize;

use super::ParetoPoint;
use crate::mean_and_deviation;

/// Times of different seeds that differ by less than this factor count as one.
const SAME_TIME: f64 = 1.1;

/// How a quantity of one method on one scene goes with wall time, a course for each seed.
#[derive(Clone, Debug, Default, PartialEq)]
pub struct Curve {
    /// Seconds and values, by seed; the seconds ascend.
    courses: BTreeMap<u64, Vec<(f64, f64)>>,
}

/// The values of all seeds at one time.
#[derive(Clone, Copy, Debug, PartialEq, Serialize)]
pub struct Summary {
    /// Wall seconds.
    pub wall_s: f64,
    /// Mean over the seeds.
    pub mean: f64,
    /// Standard deviation over the seeds.
    pub deviation: f64,
    /// The least value.
    pub low: f64,
    /// The largest.
    pub high: f64,
}

impl Curve {
    /// A quantity of these points, which are of one method on one scene; those where it is not known are left out.
    pub fn of<'a>(
        points: impl IntoIterator<Item = &'a ParetoPoint>,
        value: impl Fn(&ParetoPoint) -> Option<f64>,
    ) -> Self {
        let mut courses: BTreeMap<u64, Vec<(f64, f64)>> = BTreeMap::new();
        for point in points {
            if let Some(value) = value(point) {
                courses.entry(point.seed).or_default().push((point.wall_s, value));
            }
        }
        for course in courses.values_mut() {
            course.sort_by(|a, b| a.0.total_cmp(&b.0));
        }
        Self { courses }
    }

    /// The value of each seed after so many seconds: linear between the measurements, and the last one from then on.
    /// A seed that has none before is left out.
    pub fn at(&self, wall_s: f64) -> BTreeMap<u64, f64> {
        let known = |(&seed, course): (&u64, &Vec<_>)| Some((seed, interpolated(course, wall_s)?));
        self.courses.iter().filter_map(known).collect()
    }

    /// What all seeds come to at each of the times at which any was measured, ascending; times about the same are one.
    pub fn summaries(&self) -> Vec<Summary> {
        let all = self.courses.values().flatten();
        let mut times: Vec<f64> = all.map(|(wall_s, _)| *wall_s).collect();
        times.sort_by(f64::total_cmp);
        // The last of a group, when every seed of it has been measured.
        let is_last = |pair: &[f64]| pair[1] > SAME_TIME * pair[0];
        let lasts = times.windows(2).filter(|pair| is_last(pair)).map(|pair| pair[0]);
        let lasts = lasts.chain(times.last().copied());
        lasts.filter_map(|wall_s| self.summary(wall_s)).collect()
    }

    /// What all seeds come to in the end; `None` without any.
    pub fn last(&self) -> Option<Summary> {
        self.summaries().pop()
    }

    /// What all seeds come to after so many seconds; `None` before all of them have a value.
    pub fn summary(&self, wall_s: f64) -> Option<Summary> {
        let values: Vec<f64> = self.at(wall_s).into_values().collect();
        if values.is_empty() || values.len() < self.courses.len() {
            return None;
        }
        let (mean, deviation) = mean_and_deviation(&values);
        Some(Summary {
            wall_s,
            mean,
            deviation,
            low: values.iter().copied().fold(f64::INFINITY, f64::min),
            high: values.iter().copied().fold(f64::NEG_INFINITY, f64::max),
        })
    }

    /// The first time before `wall_s` at which `other` has a higher mean than this one then, beyond the spread over the
    /// seeds: there, this one is not on the Pareto front.
    pub fn beaten_by(&self, wall_s: f64, other: &Self) -> Option<Summary> {
        let earlier = |summary: &Summary| summary.wall_s < wall_s;
        let own = self.at(wall_s);
        let is_ahead = |summary: &Summary| {
            // Seed by seed.
            let others = other.at(summary.wall_s).into_iter();
            let both = others.filter_map(|(seed, other)| Some(other - own.get(&seed)?));
            let (mean, deviation) = mean_and_deviation(&both.collect::<Vec<f64>>());
            mean > deviation
        };
        other.summaries().into_iter().filter(earlier).find(is_ahead)
    }
}

fn interpolated(course: &[(f64, f64)], wall_s: f64) -> Option<f64> {
    let after = course.partition_point(|(at, _)| *at <= wall_s);
    let (from, value) = *course.get(after.checked_sub(1)?)?;
    Some(match course.get(after) {
        Some(&(to, next)) => value + (next - value) * (wall_s - from) / (to - from),
        None => value,
    })
}

#[cfg(test)]
mod tests {
    use super::*;

    fn curve(courses: &[&[(f64, f64)]]) -> Curve {
        let courses = courses.iter().map(|course| course.to_vec());
        let courses = (0_u64..).zip(courses).collect();
        Curve { courses }
    }

    #[test]
    fn values_are_linear_between_measurements_and_stay_after_the_last() {
        let curve = curve(&[&[(2.0, 0.25), (6.0, 0.75)]]);
        for (wall_s, value) in [
            (1.0, None),
            (2.0, Some(0.25)),
            (4.0, Some(0.5)),
            (100.0, Some(0.75)),
        ] {
            assert_eq!(curve.at(wall_s).get(&0).copied(), value, "after {wall_s} s");
        }
    }

    #[test]
    fn seeds_are_summed_up_at_common_times_once_all_of_them_have_a_value() {
        let curve = curve(&[&[(2.0, 0.2), (5.0, 0.5)], &[(2.1, 0.4), (10.0, 0.8)]]);
        let summaries = curve.summaries();
        let times: Vec<f64> = summaries.iter().map(|summary| summary.wall_s).collect();
        assert_eq!(times, [2.1, 5.0, 10.0]);
        let last = curve.last().unwrap();
        assert!((last.mean - 0.65).abs() < 1e-12);
        assert_eq!((last.low, last.high), (0.5, 0.8));
        assert_eq!(curve.summary(2.05), None);
        assert_eq!(Curve::default().last(), None);
    }

    #[test]
    fn only_what_is_better_in_less_time_beyond_the_spread_takes_one_off_the_front() {
        let own = curve(&[&[(10.0, 0.70)], &[(10.0, 0.80)]]);
        let clearly = curve(&[&[(5.0, 0.75)], &[(5.0, 0.86)]]);
        let beaten = own.beaten_by(10.0, &clearly).unwrap();
        assert_eq!(beaten.wall_s, 5.0);
        // Better with one seed and worse with the other.
        let hardly = curve(&[&[(5.0, 0.78)], &[(5.0, 0.76)]]);
        assert_eq!(own.beaten_by(10.0, &hardly), None);
        let later = curve(&[&[(12.0, 0.9)], &[(12.0, 0.9)]]);
        assert_eq!(own.beaten_by(10.0, &later), None);
        assert_eq!(own.beaten_by(10.0, &own), None);
    }
}
