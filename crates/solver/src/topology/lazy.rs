//! Parts that are computed when they are needed.

use std::sync::OnceLock;

/// A derived part, computed on first use; ignored in comparisons of topologies.
#[derive(Debug, Clone)]
pub(super) struct Lazy<T>(pub(super) OnceLock<T>);

impl<T> Default for Lazy<T> {
    fn default() -> Self {
        Self(OnceLock::new())
    }
}

impl<T> PartialEq for Lazy<T> {
    fn eq(&self, _: &Self) -> bool {
        true
    }
}
