//! Evaluation of the semantic prior, what the semantic field knows of appearance, on the whole surface.

use candle_core::Result;
use glam::Vec3;
use rayon::prelude::*;

use super::{LabelPropagation, SemanticField, SemanticPart, SurfaceGraph};
use crate::field::RadianceField;

/// Nodes evaluated at a time.
const PORTION: usize = 8192;
/// Lower bound on the prior's probabilities.
const LEAST_PROBABILITY: f32 = 1e-3;
/// How often the prior's probabilities are averaged over neighbours, and how fast a neighbour's weight
/// falls with the cost of the edge to it.
const SMOOTHING_ROUNDS: usize = 6;
const SMOOTHING_FALLOFF: f32 = 0.3;
/// Exponent of the prior's probabilities in the product with the graph's.
const PRIOR_EXPONENT: f32 = 0.4;

/// An evaluation of the prior at every node of a surface, in steps of some tens of milliseconds.
#[derive(Clone, Debug, Default)]
pub struct PriorEvaluation {
    /// Logarithms of the probabilities found so far, `[nodes, classes]`.
    logs: Vec<f32>,
    rounds: usize,
}

impl PriorEvaluation {
    /// Takes one step; the last one returns positive weights `[nodes, classes]` for [`LabelPropagation::set_prior`].
    ///
    /// The logarithms of the probabilities are averaged over close neighbours in the graph, so that they follow
    /// surfaces and not single voxels; then the probabilities are raised to the power 0.4. The surface and the classes
    /// must not change between the steps.
    ///
    /// # Errors
    /// None on the CPU.
    pub fn advance(
        &mut self,
        propagation: &LabelPropagation,
        semantics: &SemanticField,
        field: &RadianceField,
    ) -> Result<Option<Vec<f32>>> {
        let graph = &propagation.surface().graph;
        let count = semantics.classes().len().max(1);
        let known = self.logs.len() / count;
        if known < graph.len() {
            let portion = &graph.nodes()[known..graph.len().min(known + PORTION)];
            let positions: Vec<Vec3> = portion.iter().map(|node| node.position).collect();
            let probabilities = semantics.at_points(SemanticPart::Appearance, field, &positions)?;
            self.logs
                .extend(probabilities.iter().map(|p| p.max(LEAST_PROBABILITY).ln()));
        } else if self.rounds < SMOOTHING_ROUNDS {
            self.logs = averaged(graph, &self.logs, count);
            self.rounds += 1;
        } else {
            let weights = self.logs.par_iter().map(|log| (PRIOR_EXPONENT * log).exp());
            return Ok(Some(weights.collect()));
        }
        Ok(None)
    }
}

/// Each node's values `[nodes, count]` averaged with those of its neighbours.
fn averaged(graph: &SurfaceGraph, values: &[f32], count: usize) -> Vec<f32> {
    let mut averages = values.to_vec();
    averages
        .par_chunks_exact_mut(count)
        .enumerate()
        .with_min_len(256)
        .for_each(|(node, average)| {
            let mut total = 1.0;
            for (neighbour, cost) in graph.edges(node as u32) {
                let weight = (-cost * SMOOTHING_FALLOFF).exp();
                total += weight;
                let start = neighbour as usize * count;
                for (sum, value) in average.iter_mut().zip(&values[start..start + count]) {
                    *sum += weight * value;
                }
            }
            average.iter_mut().for_each(|sum| *sum /= total);
        });
    averages
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::semantics::testing::joined;

    #[test]
    fn averaging_stays_on_one_side_of_a_costly_edge() {
        let graph = joined(4, &[(0, 1, 0.01), (1, 2, 50.0), (2, 3, 0.01)]);
        let averages = averaged(&graph, &[0.0, 2.0, 10.0, 12.0], 1);
        assert!((averages[1] - 1.0).abs() < 0.01 && (averages[2] - 11.0).abs() < 0.01);
    }
}
