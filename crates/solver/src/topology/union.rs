//! Sets that are joined: a union–find structure over indices.

/// Root of the set of an element, by the parents of all; roots are their own parents. Shortens the
/// path to it.
pub(crate) fn root(parents: &mut [u32], mut element: u32) -> u32 {
    while parents[element as usize] != element {
        let parent = parents[element as usize];
        parents[element as usize] = parents[parent as usize];
        element = parent;
    }
    element
}
