//! The labelled surface itself: a point for each of its voxels, or two where colours differ, or a mesh.

use std::ops::ControlFlow;
use std::path::Path;

use super::layout::{LabelledScene, OutputFile, Written, json_file, void_improbable};
use super::objects::{ExportedObject, Objects};
use super::ply::{self, Vertex};
use super::pngs::{CLASSES, colors_by_id};
use super::{ExportError, Options, Refusal};
use crate::labels::{Class, ClassId, VOID};
use crate::semantics::{ENTROPY_STEPS_PER_NAT, Mesh, MeshVertex, Posterior, Surface};

/// How the surface is written.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub(super) enum Solid {
    /// A point for each voxel.
    Cloud,
    /// Triangles.
    Mesh,
}

impl Solid {
    /// Stem of its files.
    fn name(self) -> &'static str {
        match self {
            Self::Cloud => "cloud",
            Self::Mesh => "mesh",
        }
    }

    /// The vertices and, of a mesh, the triangles between them. What lies on the shell around the scene is no surface.
    fn shape(self, surface: &Surface) -> (Vec<MeshVertex>, Option<Vec<[u32; 3]>>) {
        match self {
            Self::Cloud => {
                let nodes = (0..).zip(surface.graph.nodes());
                let seen = nodes.filter(|(_, node)| !surface.is_on_shell(node));
                let points = seen.map(|(index, node)| MeshVertex {
                    position: node.position,
                    node: index,
                });
                (points.collect(), None)
            }
            Self::Mesh => {
                let mesh = Mesh::of_surface(surface);
                (mesh.vertices, Some(mesh.triangles))
            }
        }
    }
}

/// The surface as it is exported.
pub(super) struct Shape<'a> {
    pub(super) surface: &'a Surface,
    /// In the capture's own coordinates and unit, with the images' colours.
    pub(super) vertices: Vec<Vertex>,
    triangles: Option<Vec<[u32; 3]>>,
    /// The exported classes.
    pub(super) classes: Vec<Class>,
    /// The exported objects; none where nothing is known of objects.
    pub(super) objects: Vec<ExportedObject>,
}

/// The surface of a labelled scene. What a vertex has besides its position is that of its voxel.
///
/// # Errors
/// Maps that follow from no surface.
pub(super) fn shape<'a>(
    solid: Solid,
    labelled: LabelledScene<'a>,
    options: &Options,
) -> Result<Shape<'a>, Refusal> {
    let known = labelled.maps.first().and_then(|map| map.surface());
    let (surface, posterior) =
        known.ok_or("the surface of the scene is not known; wait until it was trained again")?;
    let ids = options.ids_of(labelled.classes);
    let own_labels = labels(posterior, options);
    let objects = Objects::of(labelled, &ids);
    let (places, triangles) = solid.shape(surface);
    let vertex = |&MeshVertex { position, node }: &MeshVertex| {
        let shown = &surface.graph.nodes()[node as usize];
        let label = ids.of(own_labels[node as usize]);
        Vertex {
            position: labelled.scene.to_capture(position),
            normal: shown.normal,
            // A cast saturates.
            color: (255.0 * shown.color)
                .round()
                .to_array()
                .map(|channel| channel as u8),
            label,
            object: objects.as_ref().map_or(0, |objects| objects.of_node(node, label)),
            entropy: f32::from(posterior.entropy[node as usize]) / ENTROPY_STEPS_PER_NAT,
        }
    };
    Ok(Shape {
        surface,
        vertices: places.iter().map(vertex).collect(),
        triangles,
        classes: ids.classes().to_vec(),
        objects: objects.map_or_else(Vec::new, |objects| objects.listed),
    })
}

/// Writes `cloud.ply` or `mesh.ply` with the images' colours, `cloud_classes.ply` or `mesh_classes.ply` with the colours
/// of the classes (black = void), and `classes.json`.
///
/// Positions are in the capture's own coordinates and unit; what each vertex has besides is that of its voxel.
///
/// # Errors
/// [`ExportError::Incomplete`] where the maps follow from no surface; [`ExportError::Cancelled`];
/// [`ExportError::Unwritable`].
pub(super) fn write(
    solid: Solid,
    folder: &Path,
    labelled: LabelledScene<'_>,
    options: &Options,
    progress: &(dyn Fn(usize, usize) -> ControlFlow<()> + Sync),
) -> Result<Written, ExportError> {
    let incomplete = |reason: Refusal| ExportError::incomplete(folder, reason);
    let shape = shape(solid, labelled, options).map_err(incomplete)?;
    let (classes, vertices) = (&shape.classes, &shape.vertices);
    let colors = colors_by_id(classes);
    let colored: Vec<Vertex> = vertices
        .iter()
        .map(|vertex| Vertex {
            color: colors.get(&vertex.label).copied().unwrap_or_default(),
            ..*vertex
        })
        .collect();
    let comments = comments(labelled.scene.unit, classes, &shape.objects);
    let name = solid.name();
    let clouds = [
        (format!("{name}.ply"), vertices),
        (format!("{name}_classes.ply"), &colored),
    ];
    // One after the other: each may take a lot of memory.
    let clouds = clouds.into_iter().map(|(name, vertices)| {
        OutputFile::new(name, ply::encode(&comments, vertices, shape.triangles.as_deref()))
    });
    let files = clouds.chain([json_file(CLASSES, classes).map_err(incomplete)?]);
    Written::at_once(folder, (&[], files), labelled.scene.frames.len(), progress)
}

/// The class of every node under the project's ids; void where it is less probable than is asked for.
fn labels(posterior: &Posterior, options: &Options) -> Vec<ClassId> {
    let mut labels = posterior.labels.clone();
    if let Some(least) = options.least_probability {
        void_improbable(&mut labels, &posterior.confidence, least);
    }
    labels
}

/// What the header says of coordinates and classes.
fn comments(unit: f64, classes: &[Class], objects: &[ExportedObject]) -> Vec<String> {
    let mut comments = vec![
        "x y z in the coordinates of the capture's poses".to_owned(),
        format!("{unit} of their units are a metre"),
        "normals towards the cameras; zero where unknown".to_owned(),
        format!("label {VOID} is void, object 0 none; entropy in nats"),
    ];
    let class = |class: &Class| format!("class {} {}", class.id, class.name);
    comments.extend(classes.iter().map(class));
    let object = |object: &ExportedObject| format!("object {} {}", object.id, object.name);
    comments.extend(objects.iter().map(object));
    comments
}

#[cfg(test)]
mod tests {
    use std::fs;
    use std::sync::Arc;

    use glam::{DVec3, Vec3};

    use super::*;
    use crate::export::testing::{self, export_all, labelled_scene};
    use crate::export::tests::distant_wall;
    use crate::export::{Format, IdMap};
    use crate::scene::Scene;
    use crate::session::FrameMap;

    /// The comments and the vertices of a PLY file without faces; nothing else may be in it.
    fn read(path: &Path) -> (Vec<String>, Vec<Vertex>) {
        let file = fs::read(path).unwrap();
        let end = file.windows(11).position(|window| window == b"end_header\n");
        let (header, body) = file.split_at(end.unwrap());
        let header = std::str::from_utf8(header).unwrap();
        assert!(header.is_ascii() && header.starts_with("ply\nformat binary_little_endian 1.0\n"));
        let (mut comments, mut properties, mut count) = (Vec::new(), Vec::new(), 0);
        for line in header.lines().skip(2) {
            match line.splitn(3, ' ').collect::<Vec<_>>()[..] {
                ["comment", ..] => comments.push(line["comment ".len()..].to_owned()),
                ["element", "vertex", vertices] => count = vertices.parse().unwrap(),
                ["property", kind, name] => properties.push((kind, name)),
                _ => panic!("{line}"),
            }
        }
        assert_eq!(properties, ply::VERTEX);
        let records = body[11..].chunks_exact(ply::VERTEX_BYTES);
        assert_eq!((records.len(), records.remainder().len()), (count, 0));
        let vertex = |record: &[u8]| {
            let double = |at: usize| f64::from_le_bytes(record[at..at + 8].try_into().unwrap());
            let float = |at: usize| f32::from_le_bytes(record[at..at + 4].try_into().unwrap());
            Vertex {
                position: DVec3::from_array([0, 8, 16].map(double)),
                normal: Vec3::from_array([24, 28, 32].map(float)),
                color: [36, 37, 38].map(|at| record[at]),
                label: u16::from_le_bytes([record[39], record[40]]),
                entropy: float(41),
                object: u16::from_le_bytes([record[45], record[46]]),
            }
        };
        (comments, records.map(vertex).collect())
    }

    /// The distant wall with its maps.
    struct Labelled {
        scene: Arc<Scene>,
        maps: Vec<Arc<FrameMap>>,
        classes: Vec<Class>,
    }

    fn labelled() -> Labelled {
        let classes = vec![Class::new(3, "dark wall"), Class::new(500, "Wänd\n")];
        let (scene, propagation) = distant_wall(5, &classes);
        let map = |frame| Arc::new(propagation.map(&scene, frame, 1));
        let maps = (0..5).map(map).collect();
        Labelled { scene, maps, classes }
    }

    fn written(folder: &Path, labelled: &Labelled, format: Format, options: &Options) -> Written {
        let Labelled { scene, maps, classes } = labelled;
        export_all(folder, scene, classes, maps, (format, options)).unwrap()
    }

    #[test]
    fn the_points_of_a_cloud_lie_where_the_capture_has_them_and_face_its_cameras() {
        let root = tempfile::tempdir().unwrap();
        let labelled = labelled();
        let count = written(root.path(), &labelled, Format::PointCloud, &Options::default());
        assert_eq!((count.files, count.unchanged), (3, 0));
        let (comments, cloud) = read(&root.path().join("cloud.ply"));
        let unit = "3.28 of their units are a metre".to_owned();
        assert!(comments.contains(&unit), "{comments:?}");
        assert_eq!(comments[4..6], ["class 3 dark wall", "class 500 W\\u{e4}nd\\n"]);
        assert_eq!(comments[6..], ["object 1 W\\u{e4}nd\\n 1", "object 2 dark wall"]);
        let (surface, _) = labelled.maps[0].surface().unwrap();
        assert_eq!(cloud.len(), surface.graph.len());
        for (vertex, node) in cloud.iter().zip(surface.graph.nodes()) {
            let gap = vertex.position.distance(labelled.scene.to_capture(node.position));
            assert!(gap < 1e-6, "{gap}");
            assert_eq!(vertex.object, if vertex.label == 500 { 1 } else { 2 });
        }
        let towards_cameras = cloud.iter().filter(|vertex| vertex.normal.z < -0.99);
        assert!(towards_cameras.count() > cloud.len() * 9 / 10);
    }

    #[test]
    fn the_same_labels_give_the_same_bytes_and_classes_take_other_ids() {
        let root = tempfile::tempdir().unwrap();
        let labelled = labelled();
        for format in [Format::PointCloud, Format::Mesh] {
            written(root.path(), &labelled, format, &Options::default());
            let again = written(root.path(), &self::labelled(), format, &Options::default());
            assert_eq!((again.files, again.unchanged), (0, 3));
        }
        let report = root.path().join("report.json");
        fs::write(&report, "{}").unwrap();
        written(root.path(), &labelled, Format::Mesh, &Options::default());
        assert!(report.exists(), "its label images have these classes");
        let list = root.path().join("ids.json");
        fs::write(&list, r#"[{"id": 8, "name": "Dark Wall", "color": [1, 2, 3]}]"#).unwrap();
        let options = Options {
            ids: Some(IdMap::named(list.to_str().unwrap()).unwrap()),
            ..Options::default()
        };
        written(root.path(), &labelled, Format::PointCloud, &options);
        assert!(!report.exists());
        let (comments, cloud) = read(&root.path().join("cloud.ply"));
        assert_eq!(comments[4..], ["class 8 Dark Wall", "object 2 Dark Wall"]);
        let (_, posterior) = labelled.maps[0].surface().unwrap();
        for (vertex, &own) in cloud.iter().zip(&posterior.labels) {
            assert_eq!(vertex.label, if own == 3 { 8 } else { 0 });
        }
        assert!(posterior.labels.contains(&3) && posterior.labels.contains(&500));
    }

    #[test]
    fn what_is_less_probable_than_asked_for_is_void() {
        let posterior = Posterior {
            labels: vec![3, 500, 3, VOID],
            confidence: vec![32_767, 32_768, u16::MAX, 0],
            ..Posterior::default()
        };
        let options = Options {
            least_probability: Some(0.5),
            ids: None,
        };
        assert_eq!(labels(&posterior, &options), [VOID, 500, 3, VOID]);
        assert_eq!(labels(&posterior, &Options::default()), posterior.labels);
    }

    #[test]
    fn nothing_is_written_without_a_surface_or_when_it_is_cancelled() {
        let root = tempfile::tempdir().unwrap();
        let (labelled, out) = (labelled(), root.path().join("out"));
        let listed = testing::maps([64, 48], &[vec![3; 64 * 48]]);
        let [go_on, stop] = [ControlFlow::Continue(()), ControlFlow::Break(())];
        for (maps, answer, reason) in [
            (&listed, go_on, "surface of the scene is not known"),
            (&labelled.maps, stop, "cancelled after 0 of 5"),
        ] {
            let scene = labelled_scene(&labelled.scene, &labelled.classes, maps);
            for solid in [Solid::Cloud, Solid::Mesh] {
                let error = write(solid, &out, scene, &Options::default(), &|_, _| answer).unwrap_err();
                assert!(error.to_string().contains(reason), "{error}");
                assert!(!out.exists());
            }
        }
    }
}
