//! Segmentation of a graph: of an image's pixels, or of a surface's voxels.

use super::DisjointSets;

/// The segment of each of so many vertices, counted from 0 in the order of their first vertices, by `edges` (cost, vertex,
/// vertex) (Felzenszwalb and Huttenlocher 2004).
///
/// Two segments become one where an edge costs at most `scale` over their number of vertices more than the most
/// expensive one inside, for both of them. What then has less than `fewest` vertices joins what its cheapest edge leads to.
pub(super) fn segments(
    vertices: usize,
    mut edges: Vec<(f32, u32, u32)>,
    scale: f32,
    fewest: u32,
) -> Vec<u32> {
    // Equal ones stay as they are given. It takes half the time of two threads that compare.
    radsort::sort_by_key(&mut edges, |&(cost, ..)| cost);
    let mut sets = DisjointSets::new(vertices);
    // Of each set by its root: the number of vertices, and what an edge may cost that it grows across.
    let mut sizes = vec![1_u32; vertices];
    let mut limits = vec![scale; vertices];
    let mut join_if = |may_join: &dyn Fn(f32, [(f32, u32); 2]) -> bool| {
        for &(cost, a, b) in &edges {
            let (a, b) = (sets.root(a) as usize, sets.root(b) as usize);
            if a != b && may_join(cost, [(limits[a], sizes[a]), (limits[b], sizes[b])]) {
                sets.join(a as u32, b as u32);
                let root = a.min(b);
                sizes[root] = sizes[a] + sizes[b];
                limits[root] = cost + scale / sizes[root] as f32;
            }
        }
    };
    join_if(&|cost, both| both.iter().all(|(limit, _)| cost <= *limit));
    join_if(&|_, both| both.iter().any(|(_, size)| *size < fewest));
    let mut count = 0;
    let mut numbers = vec![0; vertices];
    for vertex in 0..vertices {
        // The root of a set is its first vertex.
        let root = sets.root(vertex as u32) as usize;
        if root == vertex {
            numbers[vertex] = count;
            count += 1;
        } else {
            numbers[vertex] = numbers[root];
        }
    }
    numbers
}
