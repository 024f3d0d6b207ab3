//! Other ways to make maps of the same clicks, to compare with.

mod joint;
mod pixels;

use std::time::Duration;

use clap::ValueEnum;
use glam::Vec3;

use super::Click;
use crate::Failure;
use crate::learnt::NodeLabels;
use inplace_core::labels::{ClassId, VOID};
use inplace_core::scene::Scene;
use inplace_core::semantics::Surface;

/// How long the joint network trains on each batch of clicks.
const JOINT_TRAINING: Duration = Duration::from_secs(20);

/// A way to make maps.
#[derive(Clone, Copy, Debug, PartialEq, Eq, ValueEnum)]
pub enum Baseline {
    /// Each place of the surface has the class of the click that is nearest in a straight line.
    Nearest,
    /// One network of positions for distance to the surface, colour and class, in the way of iLabel (Zhi et al.,
    /// arXiv 2111.14637): 4 layers of 256 on a positional encoding, a linear head each. It is told the surface,
    /// where iLabel learns it from rays.
    JointMlp,
    /// A random forest on filter responses of the image alone, in the way of ilastik (Berg et al. 2019).
    Pixels,
}

/// What maps are made of.
pub(crate) struct Task<'a> {
    pub scene: &'a Scene,
    pub surface: &'a Surface,
    pub clicks: &'a [Click],
    /// Frames whose maps are wanted.
    pub frames: &'a [usize],
    /// Seed of whatever is random.
    pub seed: u64,
}

impl Baseline {
    /// Its name in the results.
    pub fn name(self) -> &'static str {
        match self {
            Self::Nearest => "nearest",
            Self::JointMlp => "joint-mlp",
            Self::Pixels => "pixels",
        }
    }

    /// Makes the maps of a task's frames: the class of every pixel of each, in their order. Void clicks say nothing. It
    /// takes the threads that it is run in.
    ///
    /// # Errors
    /// None on the CPU.
    pub(crate) fn maps(self, task: &Task<'_>) -> Result<Vec<Vec<ClassId>>, Failure> {
        let &Task {
            scene,
            surface,
            frames,
            seed,
            ..
        } = task;
        let with_class = |click: &Click| click.class != VOID;
        let clicks: Vec<Click> = task.clicks.iter().copied().filter(with_class).collect();
        let placed = || placed(scene, surface, &clicks);
        Ok(match self {
            Self::Nearest => on_surface(surface, frames, nearest(surface, &placed())),
            Self::JointMlp => {
                let classes = joint::classes(surface, &placed(), JOINT_TRAINING, seed)?;
                on_surface(surface, frames, classes)
            }
            Self::Pixels => pixels::maps(scene, &clicks, frames, seed),
        })
    }
}

/// The clicks as places of the surface with a class; those on pixels that show none are left out.
fn placed(scene: &Scene, surface: &Surface, clicks: &[Click]) -> Vec<(Vec3, ClassId)> {
    let place = |click: &Click| {
        let [x, y] = click.pixel;
        let index = (y * scene.frames[click.frame].camera.width + x) as usize;
        let node = surface.nodes_of(click.frame).node(index)?;
        Some((surface.graph.nodes()[node as usize].position, click.class))
    };
    clicks.iter().filter_map(place).collect()
}

/// The class of the nearest click, for every node.
fn nearest(surface: &Surface, clicks: &[(Vec3, ClassId)]) -> NodeLabels {
    let of = |place: Vec3| {
        let distance = |click: &&(Vec3, ClassId)| click.0.distance_squared(place);
        let nearest = clicks.iter().min_by(|a, b| distance(a).total_cmp(&distance(b)));
        nearest.map_or(VOID, |click| click.1)
    };
    let nodes = surface.graph.nodes().iter();
    NodeLabels(nodes.map(|node| of(node.position)).collect())
}

/// Maps of frames whose pixels have the classes of their nodes.
fn on_surface(surface: &Surface, frames: &[usize], classes: NodeLabels) -> Vec<Vec<ClassId>> {
    let map = |&frame: &usize| classes.of_frame(surface, frame);
    frames.iter().map(map).collect()
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::testing::wall;

    fn right(scene: &Scene, frame: usize, labels: &[ClassId]) -> f32 {
        let color = scene.frames[frame].color();
        let same = |pixel: &usize| (labels[*pixel] == 2) == (color.pixel(*pixel)[0] > 128);
        (0..labels.len()).filter(same).count() as f32 / labels.len() as f32
    }

    fn clicks() -> [Click; 2] {
        let click = |x, class| Click {
            frame: 0,
            pixel: [x, 24],
            class,
        };
        // The middle of frame 0 is at x = -0.2 m; the straight line between the clicks is halved at x = 0.
        [click(16, 1), click(54, 2)]
    }

    #[test]
    fn the_nearest_click_halves_the_straight_line_and_a_forest_tells_dark_from_bright() {
        let scene = wall(3, 64, 48);
        let surface = Surface::build(&scene, &[], 5.0).unwrap();
        let task = Task {
            scene: &scene,
            surface: &surface,
            clicks: &clicks(),
            frames: &[2],
            seed: 0,
        };
        for (baseline, least) in [(Baseline::Nearest, 0.93), (Baseline::Pixels, 0.9)] {
            let share = right(&scene, 2, &baseline.maps(&task).unwrap()[0]);
            assert!(share > least, "{baseline:?}: {share}");
        }
    }

    #[test]
    fn the_joint_network_learns_its_clicks() {
        let scene = wall(3, 64, 48);
        let surface = Surface::build(&scene, &[], 5.0).unwrap();
        let placed = placed(&scene, &surface, &clicks());
        let classes = joint::classes(&surface, &placed, Duration::from_secs(1), 1).unwrap();
        let made = on_surface(&surface, &[0], classes);
        assert_eq!([made[0][24 * 64 + 16], made[0][24 * 64 + 54]], [1, 2]);
    }
}
