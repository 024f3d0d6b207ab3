//! Votes averaged along the surface, for labels that may be wrong.

use glam::Vec3;
use rayon::prelude::*;

use super::graph::Node;
use super::queue::DistanceQueue;
use super::{NO_NODE, SurfaceGraph};

/// How fast the weight of an edge falls with the squared difference in colour (channels in 0..=1), with
/// the bend between the normals and with the squared distance in voxels.
const COLOR_FALLOFF: f32 = 150.0;
const BEND_FALLOFF: f32 = 8.0;
const DISTANCE_FALLOFF: f32 = 1.0;
/// No edge weighs less, so that votes reach every node.
const LEAST_WEIGHT: f32 = 1e-6;
/// The residual relative to the votes at which the iteration ends, and the most iterations.
const TOLERANCE: f64 = 1e-3;
const MOST_ITERATIONS: usize = 100;
/// Nodes that are summed together; fixed, so that results do not depend on the number of threads.
const BLOCK: usize = 1024;

/// Solves (W + strength L) p = votes for all classes at once and returns the class probabilities of every
/// node, `[nodes, classes]`; rows of nodes that no vote reaches are zero.
///
/// `votes` are counts `[nodes, classes]`, W is the diagonal of their sums over the classes, and L the
/// Laplacian of the graph with weights exp(-150 |dc|^2 - 8 (1 - n n') - d^2): a random walker with a data
/// term (Grady 2005), solved by conjugate gradients with the diagonal as preconditioner. They begin with the votes of the
/// nearest node that has any: each step of theirs leads one edge further only, and few are needed where votes are dense.
pub(super) fn diffuse(graph: &SurfaceGraph, votes: &[f32], classes: usize, strength: f32) -> Vec<f32> {
    if classes == 0 {
        return Vec::new();
    }
    let system = System::new(graph, votes, classes, strength);
    let mut start = system.preconditioned(votes);
    let nearest = nearest_voted(graph, votes, classes);
    for (node, row) in start.chunks_exact_mut(classes).enumerate() {
        let nearest = nearest[node];
        if nearest != NO_NODE && nearest as usize != node {
            let own = &votes[nearest as usize * classes..][..classes];
            let sum: f32 = own.iter().sum();
            row.iter_mut().zip(own).for_each(|(p, votes)| *p = votes / sum);
        }
    }
    let mut probabilities = system.solve(votes, start);
    for row in probabilities.chunks_exact_mut(classes) {
        row.iter_mut().for_each(|p| *p = p.max(0.0));
        let sum: f32 = row.iter().sum();
        if sum > 0.0 {
            row.iter_mut().for_each(|p| *p /= sum);
        }
    }
    probabilities
}

/// The nearest node with votes of each node, by the costs of the graph; [`NO_NODE`] where none can be reached.
fn nearest_voted(graph: &SurfaceGraph, votes: &[f32], classes: usize) -> Vec<u32> {
    let has_votes = |row: &[f32]| row.iter().any(|&votes| votes > 0.0);
    let voted: Vec<bool> = votes.chunks_exact(classes).map(has_votes).collect();
    let mut nearest = vec![NO_NODE; voted.len()];
    let mut distances = vec![f32::INFINITY; voted.len()];
    let mut queue = DistanceQueue::new();
    for node in (0..voted.len() as u32).filter(|&node| voted[node as usize]) {
        (nearest[node as usize], distances[node as usize]) = (node, 0.0);
        if graph.edges(node).any(|(other, _)| !voted[other as usize]) {
            queue.push(0.0, node);
        }
    }
    while let Some((distance, node)) = queue.pop(graph) {
        if distance > distances[node as usize] {
            continue;
        }
        for (other, cost) in graph.edges(node) {
            let through = distance + cost;
            if through < distances[other as usize] {
                distances[other as usize] = through;
                nearest[other as usize] = nearest[node as usize];
                queue.push(through, other);
            }
        }
    }
    nearest
}

fn weight(a: &Node, b: &Node) -> f32 {
    let color = (a.color - b.color).length_squared();
    // What lies beyond the scene has no normals.
    let is_flat = a.normal == Vec3::ZERO && b.normal == Vec3::ZERO;
    let bend = if is_flat {
        0.0
    } else {
        (1.0 - a.normal.dot(b.normal)).max(0.0)
    };
    let distance = a.position.distance(b.position) / a.voxel.max(b.voxel);
    let exponent = COLOR_FALLOFF * color + BEND_FALLOFF * bend + DISTANCE_FALLOFF * distance * distance;
    (-exponent).exp().max(LEAST_WEIGHT)
}

/// The matrix W + strength L.
struct System {
    classes: usize,
    /// First edge of each node, and the number of edges.
    starts: Vec<usize>,
    /// Other end and negated entry of the matrix.
    edges: Vec<(u32, f32)>,
    diagonal: Vec<f32>,
}

impl System {
    fn new(graph: &SurfaceGraph, votes: &[f32], classes: usize, strength: f32) -> Self {
        let nodes = graph.nodes();
        let rows: Vec<Vec<(u32, f32)>> = (0..nodes.len() as u32)
            .into_par_iter()
            .map(|node| {
                let entry = |other: u32| strength * weight(&nodes[node as usize], &nodes[other as usize]);
                graph
                    .edges(node)
                    .map(|(other, _)| (other, entry(other)))
                    .collect()
            })
            .collect();
        let mut starts = Vec::with_capacity(nodes.len() + 1);
        let (mut edges, mut diagonal) = (Vec::new(), Vec::with_capacity(nodes.len()));
        for (row, votes) in rows.iter().zip(votes.chunks_exact(classes)) {
            starts.push(edges.len());
            let leaving: f32 = row.iter().map(|(_, weight)| weight).sum();
            diagonal.push((votes.iter().sum::<f32>() + leaving).max(f32::MIN_POSITIVE));
            edges.extend_from_slice(row);
        }
        starts.push(edges.len());
        Self {
            classes,
            starts,
            edges,
            diagonal,
        }
    }

    /// The matrix times `x`, `[nodes, classes]`.
    fn times(&self, x: &[f32]) -> Vec<f32> {
        let count = self.classes;
        let mut product = vec![0.0; x.len()];
        product
            .par_chunks_exact_mut(count)
            .enumerate()
            .with_min_len(BLOCK)
            .for_each(|(node, row)| {
                let own = &x[node * count..(node + 1) * count];
                for (sum, value) in row.iter_mut().zip(own) {
                    *sum = self.diagonal[node] * value;
                }
                for &(other, weight) in &self.edges[self.starts[node]..self.starts[node + 1]] {
                    let start = other as usize * count;
                    for (sum, value) in row.iter_mut().zip(&x[start..start + count]) {
                        *sum -= weight * value;
                    }
                }
            });
        product
    }

    /// Conjugate gradients from this start, a step length for each class.
    fn solve(&self, votes: &[f32], mut solution: Vec<f32>) -> Vec<f32> {
        let count = self.classes;
        let product = self.times(&solution);
        let mut residual: Vec<f32> = votes.iter().zip(&product).map(|(b, ax)| b - ax).collect();
        let mut scaled = self.preconditioned(&residual);
        let mut direction = scaled.clone();
        let mut gain = self.dots(&residual, &scaled);
        let enough: Vec<f64> = self
            .dots(votes, votes)
            .iter()
            .map(|squared| TOLERANCE * TOLERANCE * squared)
            .collect();
        for _ in 0..MOST_ITERATIONS {
            let left = self.dots(&residual, &residual);
            if left.iter().zip(&enough).all(|(left, enough)| left <= enough) {
                break;
            }
            let product = self.times(&direction);
            let steps = ratios(&gain, &self.dots(&direction, &product));
            add(&mut solution, &direction, &steps, count);
            let back: Vec<f32> = steps.iter().map(|step| -step).collect();
            add(&mut residual, &product, &back, count);
            scaled = self.preconditioned(&residual);
            let next = self.dots(&residual, &scaled);
            let keep = ratios(&next, &gain);
            gain = next;
            direction
                .par_chunks_exact_mut(count)
                .zip(scaled.par_chunks_exact(count))
                .with_min_len(BLOCK)
                .for_each(|(direction, scaled)| {
                    for ((d, z), k) in direction.iter_mut().zip(scaled).zip(&keep) {
                        *d = z + k * *d;
                    }
                });
        }
        solution
    }

    fn preconditioned(&self, values: &[f32]) -> Vec<f32> {
        let rows = values.par_chunks_exact(self.classes).zip(&self.diagonal);
        rows.with_min_len(BLOCK)
            .flat_map_iter(|(row, diagonal)| row.iter().map(move |value| value / diagonal))
            .collect()
    }

    /// Sum of products over the nodes, for each class.
    fn dots(&self, a: &[f32], b: &[f32]) -> Vec<f64> {
        let block = BLOCK * self.classes;
        let parts: Vec<Vec<f64>> = a
            .par_chunks(block)
            .zip(b.par_chunks(block))
            .map(|(a, b)| {
                let mut sums = vec![0.0; self.classes];
                for (a, b) in a.chunks_exact(self.classes).zip(b.chunks_exact(self.classes)) {
                    for ((sum, a), b) in sums.iter_mut().zip(a).zip(b) {
                        *sum += f64::from(*a) * f64::from(*b);
                    }
                }
                sums
            })
            .collect();
        let mut sums = vec![0.0; self.classes];
        for part in parts {
            sums.iter_mut().zip(part).for_each(|(sum, part)| *sum += part);
        }
        sums
    }
}

/// a / b for each class; 0 where a class is solved.
fn ratios(a: &[f64], b: &[f64]) -> Vec<f32> {
    let ratio = |(&a, &b): (&f64, &f64)| if b > 0.0 { (a / b) as f32 } else { 0.0 };
    a.iter().zip(b).map(ratio).collect()
}

/// `to += step * from`, with a step for each class.
fn add(to: &mut [f32], from: &[f32], steps: &[f32], classes: usize) {
    to.par_chunks_exact_mut(classes)
        .zip(from.par_chunks_exact(classes))
        .with_min_len(BLOCK)
        .for_each(|(to, from)| {
            for ((to, from), step) in to.iter_mut().zip(from).zip(steps) {
                *to += step * from;
            }
        });
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::scene::testing::on_threads;
    use crate::semantics::testing::node;
    use rand::{Rng, SeedableRng, rngs::SmallRng};

    /// A floor of 40 x 20 nodes, dark in its left half.
    fn floor() -> SurfaceGraph {
        let at = |k: usize| {
            let (column, row) = (k % 40, k / 40);
            let color = if column < 20 { 0.2 } else { 0.8 };
            Node {
                color: Vec3::splat(color),
                ..node(0.05 * Vec3::new(column as f32, row as f32, 0.0))
            }
        };
        SurfaceGraph::new((0..800).map(at).collect(), 5)
    }

    #[test]
    fn the_solution_solves_the_system() {
        let graph = floor();
        let mut rng = SmallRng::seed_from_u64(5);
        let votes: Vec<f32> = (0..2400).map(|_| rng.random_range(0..4) as f32).collect();
        let system = System::new(&graph, &votes, 3, 20.0);
        let product = system.times(&system.solve(&votes, system.preconditioned(&votes)));
        let gap: f32 = product.iter().zip(&votes).map(|(a, b)| (a - b).powi(2)).sum();
        let size: f32 = votes.iter().map(|b| b * b).sum();
        assert!(gap < 4e-6 * size, "{gap} of {size}");
    }

    #[test]
    fn probabilities_add_up_and_outvote_wrong_votes_on_their_own_side_on_any_number_of_threads() {
        let graph = floor();
        let mut rng = SmallRng::seed_from_u64(6);
        // Of five votes a node two are right on average: by themselves many nodes are wrong.
        let truth = |k: usize| usize::from(k % 40 >= 20);
        let mut votes = vec![0.0; 800 * 3];
        for node in 0..800 {
            for _ in 0..5 {
                let class = if rng.random_bool(0.4) {
                    truth(node)
                } else {
                    rng.random_range(0..3)
                };
                votes[node * 3 + class] += 1.0;
            }
        }
        let wrong = |values: &[f32]| {
            let best = |row: &[f32]| (0..3).max_by(|&a, &b| row[a].total_cmp(&row[b])).unwrap();
            values
                .chunks_exact(3)
                .enumerate()
                .filter(|(node, row)| best(row) != truth(*node))
                .count()
        };
        let on = |threads| on_threads(threads, || diffuse(&graph, &votes, 3, 20.0));
        let probabilities = on(1);
        assert_eq!(probabilities, on(3));
        for row in probabilities.chunks_exact(3) {
            assert!((row.iter().sum::<f32>() - 1.0).abs() < 1e-5);
        }
        assert!(wrong(&votes) > 100, "{}", wrong(&votes));
        assert!(wrong(&probabilities) < 8, "{}", wrong(&probabilities));
    }

    #[test]
    fn dense_votes_reach_nodes_that_are_far_from_all_of_them() {
        let graph = floor();
        let mut votes = vec![0.0; 1600];
        for node in (0..800).filter(|node| node % 40 < 10) {
            votes[2 * node..2 * node + 2].copy_from_slice(&[140.0, 10.0]);
        }
        let probabilities = diffuse(&graph, &votes, 2, 4.0);
        let least = probabilities.chunks_exact(2).map(|row| row[0]).reduce(f32::min);
        assert!(least > Some(0.9), "{least:?}");
    }

    #[test]
    fn without_strength_the_votes_decide_and_without_votes_the_neighbours_do() {
        let graph = floor();
        // Whether the votes of every n-th node for its class win everywhere.
        let diffused = |class: fn(usize) -> usize, every: usize, strength: f32| {
            let mut votes = vec![0.0; 1600];
            for node in (0..800).step_by(every) {
                votes[2 * node + class(node)] = 2.0;
            }
            let probabilities = diffuse(&graph, &votes, 2, strength);
            (0..800).all(|node| probabilities[2 * node + class(node)] > 0.5)
        };
        assert!(diffused(|node| node % 2, 1, 0.0));
        assert!(diffused(|node| usize::from(node % 40 >= 20), 7, 1.0));
    }
}
