//! The surface of a scene outside of a session.

use std::sync::Arc;
use std::thread;
use std::time::{Duration, Instant};

use rayon::{ThreadPool, ThreadPoolBuilder};

use super::{Failure, unusable_scene};
use inplace_core::field::Trainer;
use inplace_core::labels::{Class, ClassId, ImportedLabels, LabelSet, VOID};
use inplace_core::scene::Scene;
use inplace_core::scene::reprojection::refine;
use inplace_core::semantics::{LabelPropagation, Surface, SurfaceImport};
use inplace_core::session::{Client, Command, Event, Measured, Session, SessionOptions, SurfaceRefiner};

const NO_SURFACE: &str = "no surface was found; train for longer";

/// Learns the geometry, for so long at most; then its surface is final.
pub(super) fn learn(client: &mut Client, limit: Option<Duration>) -> Result<(), Failure> {
    settle(client, 0, limit)
}

/// Trains for so long at most, and waits for the last surface and the last maps of these labels.
pub(super) fn settle(client: &mut Client, generation: u64, limit: Option<Duration>) -> Result<(), Failure> {
    let deadline = limit.map(|limit| Instant::now() + limit);
    if !client.settled(generation, deadline)? {
        client.send(Command::Settle);
        client.settled(generation, None)?;
    }
    Ok(())
}

/// Waits until there is a surface to spread labels over.
pub(super) fn wait_for_surface(client: &mut Client) -> Result<(), Failure> {
    let is_there = |event: &Event| matches!(event, Event::Status(status) if status.surface_nodes > 0);
    client.wait_until(None, is_there)?;
    Ok(())
}

/// Waits until a frame has the map of these labels.
pub(super) fn wait_for_map(client: &mut Client, view: usize, labels: u64) -> Result<(), Failure> {
    client.wait_until(None, |event| match event {
        Event::Map { frame, generation } => (*frame, *generation) == (view, labels),
        _ => false,
    })?;
    Ok(())
}

/// The surface that a session has found.
pub(super) fn surface_of(client: &Client, scene: &Scene) -> Result<Arc<Surface>, Failure> {
    client.surface().ok_or_else(|| unusable_scene(scene, NO_SURFACE))
}

/// So many threads, at least one, to compute with.
pub(super) fn pool(threads: usize) -> Result<ThreadPool, Failure> {
    Ok(ThreadPoolBuilder::new().num_threads(threads.max(1)).build()?)
}

/// The surface that a session finds: from measured depth at once; where that has holes or there is none, when the geometry is
/// learnt, after so long at most.
pub(super) fn session_surface(
    scene: &Arc<Scene>,
    options: &SessionOptions,
    limit: Duration,
) -> Result<Arc<Surface>, Failure> {
    let is_complete = Measured::of(scene) == Measured::All;
    let session = Session::on(Arc::clone(scene), options.clone(), || {});
    let mut client = Client::observing(session, |_| {});
    learn(
        &mut client,
        Some(if is_complete { Duration::ZERO } else { limit }),
    )?;
    surface_of(&client, scene)
}

/// Moves the cameras as a session without measured depth does, where that helps.
pub(super) fn refine_poses(scene: &mut Scene) {
    if let Ok(refined) = refine(scene, &|| true) {
        refined.apply(scene);
    }
}

/// The surface that this field completes, with so many times the voxels that are chosen for the scene.
pub(super) fn surface(scene: &Arc<Scene>, trainer: &Trainer, size: f32) -> Result<Arc<Surface>, Failure> {
    let mut refiner = SurfaceRefiner::new(scene, trainer, size, rayon::current_num_threads());
    refiner.finish(trainer);
    while refiner.is_rendering() {
        refiner.advance(trainer, &LabelSet::default())?;
    }
    loop {
        if let Some(spread) = refiner.ready()? {
            return Ok(Arc::clone(spread.surface()));
        }
        if refiner.is_done() {
            return Err(unusable_scene(scene, NO_SURFACE));
        }
        thread::sleep(Duration::from_millis(5));
    }
}

/// Label images with these classes, spread over a surface as a session does that.
pub(super) fn spread(
    scene: &Scene,
    surface: &Arc<Surface>,
    classes: &[ClassId],
    images: ImportedLabels,
) -> LabelPropagation {
    let class = |&id: &ClassId| Class::new(id, id.to_string());
    let labels = LabelSet {
        classes: classes.iter().map(class).collect(),
        imported: Some(Arc::new(images)),
        ..LabelSet::default()
    };
    let mut propagation = LabelPropagation::new(Arc::clone(surface));
    propagation.set_labels(scene, &labels);
    if let Some(import) = SurfaceImport::new(surface, &labels) {
        propagation.set_import(import);
    }
    propagation
}

/// The class of every node of a surface, by whatever method.
#[derive(Clone, Debug, PartialEq, Eq)]
pub(super) struct NodeLabels(pub(super) Vec<ClassId>);

impl NodeLabels {
    /// The class of every pixel of a frame, row-major; void where it shows no node.
    pub(super) fn of_frame(&self, surface: &Surface, frame: usize) -> Vec<ClassId> {
        let nodes = surface.nodes_of(frame).unpack();
        // No surface has as many nodes as `NO_NODE`.
        let class = |&node: &u32| self.0.get(node as usize).copied().unwrap_or(VOID);
        nodes.iter().map(class).collect()
    }
}
