//! The surface as splats, made ready for the renderer on a thread of its own.

use std::sync::{Arc, Weak};

use bytemuck::{Pod, Zeroable};
use glam::Vec3;
use inplace_core::semantics::{Node, Posterior, Surface};
use inplace_model::space::Ball;
use inplace_model::versioned::Version;
use inplace_model::workspace::LabelledSurface;

use crate::background::{Background, Desk, Gone};
use crate::canvas::SceneObjects;

/// Share of the nodes on each side of each axis that the ball around the surface may leave out.
const OUTLIERS: f32 = 0.005;

/// One splat as the renderer reads it.
#[repr(C)]
#[derive(Clone, Copy, Debug, PartialEq, Pod, Zeroable)]
pub struct Splat {
    /// In metres.
    pub position: [f32; 3],
    /// Side of the voxel, in metres.
    pub voxel: f32,
    /// Colour; the last is not used.
    pub color: [u8; 4],
    /// Unit normal times 127, zero where there is none; the last is not used.
    pub normal: [i8; 4],
}

impl Splat {
    /// Normal of about unit length; zero where there is none.
    pub fn normal(&self) -> Vec3 {
        let [x, y, z, _] = self.normal.map(f32::from);
        Vec3::new(x, y, z) / 127.0
    }
}

/// The splats of a surface, in an order of which every beginning is spread over all of it.
#[derive(Debug)]
pub struct Cloud {
    /// No other cloud has it.
    pub version: Version,
    /// What it was made of.
    pub surface: Arc<Surface>,
    pub splats: Vec<Splat>,
    /// The node of each splat.
    pub nodes: Vec<u32>,
    /// Holds nearly all of them.
    pub ball: Ball,
}

/// What is known of the splats of a cloud.
#[derive(Debug)]
pub struct Values {
    /// No others of this window have it.
    pub version: Version,
    /// Class, or value of the layer of objects, in the lower 16 bits, entropy in the upper ones, as in
    /// [`FrameMap`](inplace_core::session::FrameMap); in the order of the splats.
    pub values: Vec<u32>,
}

/// What is drawn.
#[derive(Clone, Debug)]
pub struct Prepared {
    pub cloud: Arc<Cloud>,
    /// What is known of them.
    pub values: Arc<Values>,
    /// What both were made of.
    pub surface: LabelledSurface,
    /// The objects that the values tell, if they do.
    pub objects: Option<Arc<SceneObjects>>,
}

impl Cloud {
    /// The splats of a surface; what meets nothing, far around it, is left out.
    pub fn new(surface: &Arc<Surface>) -> Self {
        let nodes = surface.graph.nodes();
        let is_near = |&node: &u32| !surface.is_on_shell(&nodes[node as usize]);
        let mut order: Vec<u32> = (0..nodes.len() as u32).filter(is_near).collect();
        order.sort_unstable_by_key(|&node| scrambled(node));
        let splats: Vec<Splat> = order.iter().map(|&node| splat(&nodes[node as usize])).collect();
        Self {
            version: Version::new(),
            surface: Arc::clone(surface),
            ball: ball(&splats),
            splats,
            nodes: order,
        }
    }
}

impl Values {
    /// What a posterior of the cloud's surface says, or the objects on it.
    pub fn new(cloud: &Cloud, posterior: &Posterior, objects: Option<&SceneObjects>) -> Self {
        let value = |&node: &u32| {
            let of = |values: &[u16]| u32::from(values.get(node as usize).copied().unwrap_or(0));
            let label = objects.map_or_else(|| of(&posterior.labels), |objects| objects.value(node).into());
            label | of(&posterior.entropy) << 16
        };
        Self {
            version: Version::new(),
            values: cloud.nodes.iter().map(value).collect(),
        }
    }
}

fn splat(node: &Node) -> Splat {
    let channel = |value: f32| (255.0 * value).round() as u8;
    let component = |value: f32| (127.0 * value).round() as i8;
    let (color, normal) = (node.color, node.normal);
    Splat {
        position: node.position.to_array(),
        voxel: node.voxel,
        color: [channel(color.x), channel(color.y), channel(color.z), 255],
        normal: [component(normal.x), component(normal.y), component(normal.z), 0],
    }
}

/// A bijection that leaves no order (the finaliser of MurmurHash3).
fn scrambled(mut value: u32) -> u32 {
    value = (value ^ value >> 16).wrapping_mul(0x85eb_ca6b);
    value = (value ^ value >> 13).wrapping_mul(0xc2b2_ae35);
    value ^ value >> 16
}

/// A ball around the box of the splats without the outermost along each axis.
fn ball(splats: &[Splat]) -> Ball {
    let mut low = Vec3::ZERO;
    let mut high = Vec3::ZERO;
    let outliers = (OUTLIERS * splats.len() as f32) as usize;
    let mut values: Vec<f32> = Vec::with_capacity(splats.len());
    for axis in 0..3 {
        values.clear();
        values.extend(splats.iter().map(|splat| splat.position[axis]));
        if let Some(last) = values.len().checked_sub(1) {
            low[axis] = *values.select_nth_unstable_by(outliers, f32::total_cmp).1;
            high[axis] = *values.select_nth_unstable_by(last - outliers, f32::total_cmp).1;
        }
    }
    Ball {
        center: 0.5 * (low + high),
        radius: (0.5 * low.distance(high)).max(0.1),
    }
}

/// A surface, and the objects on it where those are to be told apart.
#[derive(Clone, Debug)]
pub struct Question {
    surface: LabelledSurface,
    objects: Option<Arc<SceneObjects>>,
}

impl Question {
    fn is(&self, other: &Self) -> bool {
        let objects = |question: &Self| question.objects.as_ref().map(Arc::as_ptr);
        self.surface.is(&other.surface) && objects(self) == objects(other)
    }
}

/// Prepares surfaces on a thread; the newest wins.
pub struct Preparer {
    thread: Background<Question, Prepared>,
    asked: Option<Question>,
    newest: Option<Prepared>,
}

impl Preparer {
    pub fn new(ctx: egui::Context) -> Self {
        Self {
            thread: Background::new(ctx, "cloud", prepare),
            asked: None,
            newest: None,
        }
    }

    /// The newest that is ready; asks for this surface if it has not been asked for. With objects it is the surface that
    /// they were found on.
    pub fn get(
        &mut self,
        surface: Option<&LabelledSurface>,
        objects: Option<&Arc<SceneObjects>>,
    ) -> Option<&Prepared> {
        let surface = surface?;
        self.newest = self.thread.newest().or(self.newest.take());
        let own = |objects: &Arc<SceneObjects>| LabelledSurface {
            surface: Arc::clone(&objects.surface),
            posterior: Arc::clone(&objects.posterior),
        };
        let question = Question {
            surface: objects.map_or_else(|| surface.clone(), own),
            objects: objects.cloned(),
        };
        if !self.asked.as_ref().is_some_and(|asked| asked.is(&question)) {
            self.asked = Some(question.clone());
            self.thread.ask(question);
        }
        self.newest.as_ref()
    }
}

fn prepare(desk: &Desk<Question, Prepared>) -> Result<(), Gone> {
    // Only the window holds it: a scene that is closed takes no memory.
    let mut last: Weak<Cloud> = Weak::new();
    loop {
        let Question { surface, objects } = desk.newest()?;
        let cloud = match last.upgrade() {
            Some(cloud) if Arc::ptr_eq(&cloud.surface, &surface.surface) => cloud,
            _ => Arc::new(Cloud::new(&surface.surface)),
        };
        last = Arc::downgrade(&cloud);
        desk.tell(Prepared {
            values: Arc::new(Values::new(&cloud, &surface.posterior, objects.as_deref())),
            cloud,
            surface,
            objects,
        })?;
    }
}

#[cfg(test)]
pub(super) mod tests {
    use super::*;
    use inplace_core::semantics::SurfaceGraph;

    /// A floor of side x side nodes, 0.1 m apart, that faces up (y is down), with one node on the shell around it.
    pub fn floor(side: u32) -> Arc<Surface> {
        let mut nodes: Vec<Node> = (0..side * side)
            .map(|index| Node {
                position: Vec3::new(0.1 * (index % side) as f32, 0.0, 0.1 * (index / side) as f32),
                color: Vec3::new(1.0, 0.5, 0.0),
                normal: Vec3::NEG_Y,
                pixels: 1.0,
                voxel: 0.1,
            })
            .collect();
        nodes.push(Node {
            position: Vec3::new(0.0, 0.0, 300.0),
            voxel: 5.0,
            normal: Vec3::ZERO,
            ..nodes[0]
        });
        Arc::new(Surface {
            graph: SurfaceGraph::new(nodes, 5),
            pixels: Vec::new(),
            voxel: 0.1,
            ..Surface::default()
        })
    }

    #[test]
    fn every_beginning_of_the_splats_is_spread_over_the_surface() {
        let cloud = Cloud::new(&floor(40));
        assert_eq!(cloud.splats.len(), 1600, "the shell is left out");
        let begun = &cloud.splats[..160];
        for quarter in [[false, false], [false, true], [true, false], [true, true]] {
            let inside = |splat: &&Splat| [0, 2].map(|axis| splat.position[axis] > 1.95) == quarter;
            let count = begun.iter().filter(inside).count();
            assert!((20..=60).contains(&count), "{count} of 160 in a quarter");
        }
        let radius = 0.5 * (2.0 * 3.9_f32.powi(2)).sqrt();
        assert!((cloud.ball.radius - radius).abs() < 0.1);
    }

    #[test]
    fn values_stand_beside_their_splats() {
        let cloud = Cloud::new(&floor(3));
        let posterior = Posterior {
            labels: (0..10).collect(),
            entropy: (0..10).map(|node| 100 * node).collect(),
            ..Posterior::default()
        };
        let values = Values::new(&cloud, &posterior, None);
        for (value, &node) in values.values.iter().zip(&cloud.nodes) {
            assert_eq!((value & 0xffff, value >> 16), (node, 100 * node));
        }
    }

    #[test]
    fn the_newest_surface_is_prepared_and_an_older_surface_is_not_made_again() {
        let mut preparer = Preparer::new(egui::Context::default());
        let surface = floor(5);
        let labelled = |class: u16| LabelledSurface {
            surface: Arc::clone(&surface),
            posterior: Arc::new(Posterior {
                labels: vec![class; 26],
                entropy: vec![0; 26],
                ..Posterior::default()
            }),
        };
        let until_ready = |preparer: &mut Preparer, wanted: &LabelledSurface| {
            let start = std::time::Instant::now();
            loop {
                let ready = preparer.get(Some(wanted), None);
                if let Some(ready) = ready.filter(|ready| ready.surface.is(wanted)) {
                    return ready.clone();
                }
                assert!(start.elapsed().as_secs() < 20, "nothing was prepared");
                std::thread::sleep(std::time::Duration::from_millis(1));
            }
        };
        let first = until_ready(&mut preparer, &labelled(1));
        let (second, third) = (labelled(2), labelled(3));
        preparer.get(Some(&second), None);
        let last = until_ready(&mut preparer, &third);
        assert!(Arc::ptr_eq(&first.cloud, &last.cloud));
        assert_eq!(last.values.values, [3; 25]);
        assert_ne!(first.values.version, last.values.version);
        assert!(preparer.get(None, None).is_none());
    }
}
