//! What holds of every capture that can be opened.

use std::path::Path;

use inplace_core::scene::{Frame, OpenOptions, Scene, SceneSource};

use super::assert_sentence;

/// Opens a capture as the program would, and asserts what holds of whatever comes of it.
pub(super) fn check(folder: &Path) {
    let source = SceneSource::Folder(folder.to_path_buf());
    let scene = match Scene::open(&source, OpenOptions::default(), &|_, _| {}) {
        Ok(scene) => scene,
        Err(error) => return assert_sentence(&error.to_string()),
    };
    assert!(!scene.frames.is_empty(), "an opened scene has frames");
    assert!(scene.origin.is_finite(), "{}", scene.origin);
    assert!(scene.unit.is_finite() && scene.unit > 0.0, "{}", scene.unit);
    for sentence in scene.warnings.iter().chain(&scene.notes) {
        assert_sentence(sentence);
    }
    let inside = folder.canonicalize().expect("the folder is there");
    for frame in &scene.frames {
        check_frame(frame);
        let path = frame.path.canonicalize().expect("the image was read");
        assert!(path.starts_with(&inside), "{} is outside", path.display());
    }
    let bounds = scene.bounds();
    assert!(bounds.min.is_finite() && bounds.max.is_finite(), "{bounds:?}");
}

fn check_frame(frame: &Frame) {
    // Results are written under this name.
    let name = Path::new(&frame.stem);
    assert_eq!(name.file_name(), Some(name.as_os_str()), "{:?}", frame.stem);
    assert!(!frame.stem.contains('\0'), "{:?}", frame.stem);
    let camera = &frame.camera;
    assert_eq!(camera.problem(), None);
    let pixels = frame.pixels().expect("the files are as they were");
    assert_eq!(pixels.color.width(), camera.width);
    assert_eq!(pixels.color.height(), camera.height);
    let pose = &frame.camera_to_world;
    assert!(pose.is_finite(), "{pose:?}");
    let corners = [0, camera.pixels() - 1];
    for pixel in corners {
        let length = frame.ray_direction(pixel).length();
        assert!((length - 1.0).abs() < 1e-3, "{length} of {camera:?}");
        let on_disk = frame.to_image([pixel as u32 % camera.width, pixel as u32 / camera.width]);
        let image = frame.image();
        assert!(on_disk.is_none_or(|[x, y]| x < image.width && y < image.height));
    }
    if let Some(depth) = &pixels.depth {
        assert_eq!((depth.len(), depth.width()), (camera.pixels(), camera.width));
        let lengths = (0..depth.len()).filter_map(|pixel| depth.ray_length(pixel));
        lengths.for_each(|length| assert!(length.is_finite() && length > 0.0, "{length}"));
    }
    for point in &frame.points {
        assert!((point.pixel as usize) < camera.pixels(), "{point:?}");
        assert!(point.length.is_finite() && point.length > 0.0, "{point:?}");
        assert!(point.error.is_finite(), "{point:?}");
    }
}
