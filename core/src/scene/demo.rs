//! The embedded demo.
use super::Scene;
pub(super) fn scene(_progress: &(dyn Fn(usize, usize) + Sync)) -> Scene {
    unreachable!()
}
