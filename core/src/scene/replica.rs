//! The Replica / Semantic-NeRF layout.
use super::{OpenOptions, Scene, SceneError};
use std::path::Path;
pub(super) const EXPECTED: &str = "";
pub(super) fn recognise(_folder: &Path) -> bool {
    false
}
pub(super) fn read(
    _folder: &Path,
    _options: OpenOptions,
    _progress: &(dyn Fn(usize, usize) + Sync),
) -> Result<Scene, SceneError> {
    unreachable!()
}
/// Writes.
pub fn write(_scene: &Scene, _folder: &Path) -> Result<(), SceneError> {
    unreachable!()
}
