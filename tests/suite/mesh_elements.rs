//! Edges, boundary and pieces: derived from indices alone.

use glam::DVec3;
use pliant::mesh::{
    boundary_triangles, component_of_each, edges, largest_component, surface_volume,
    tetrahedra_volume,
};

/// ```text
///    3       two tetrahedra on the triangle 0 1 2,
///   /|\      one above (3), one below (4)
///  0-+-2
///   \1/
///    4
/// ```
const TWO: [[u32; 4]; 2] = [[0, 1, 2, 3], [0, 2, 1, 4]];

fn vertices() -> Vec<DVec3> {
    vec![DVec3::ZERO, DVec3::X, DVec3::Y, DVec3::Z, DVec3::NEG_Z]
}

#[test]
fn each_edge_comes_once_with_the_smaller_index_first() {
    let all = [
        [0, 1],
        [0, 2],
        [0, 3],
        [0, 4],
        [1, 2],
        [1, 3],
        [1, 4],
        [2, 3],
        [2, 4],
    ];
    assert_eq!(edges(&TWO, &[]), all);
    assert_eq!(
        edges(&[], &[[2, 1, 0], [0, 1, 3]]),
        [[0, 1], [0, 2], [0, 3], [1, 2], [1, 3]]
    );
    assert_eq!(edges(&TWO, &[[0, 1, 2]]), all);
}

#[test]
fn the_boundary_leaves_out_the_shared_face_and_faces_outwards() {
    let boundary = boundary_triangles(&TWO);
    assert_eq!(boundary.len(), 6);
    assert!(boundary.iter().all(|t| t.contains(&3) || t.contains(&4)));
    let inside = tetrahedra_volume(&vertices(), &TWO);
    // 1/6 each; and the same from the surface, if each triangle faces outwards.
    assert!((inside - 1.0 / 3.0).abs() < 1e-15);
    assert!((surface_volume(&vertices(), &boundary) - inside).abs() < 1e-15);
}

#[test]
fn elements_that_share_a_vertex_are_one_piece() {
    let elements = [[5, 6, 7], [0, 1, 2], [2, 3, 4], [7, 8, 9], [0, 3, 1]];
    assert_eq!(component_of_each(10, &elements), [0, 1, 1, 0, 1]);
    assert_eq!(
        largest_component(10, &elements),
        [[0, 1, 2], [2, 3, 4], [0, 3, 1]]
    );
    assert!(largest_component::<3>(0, &[]).is_empty());
}
