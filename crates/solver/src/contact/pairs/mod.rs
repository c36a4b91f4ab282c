//! Contact between surfaces: see [`contact`](super).

mod bounds;
mod closed_mesh;
pub(crate) mod closest;
mod common;
pub(crate) mod contacts;
mod crossing;
pub(crate) mod crossings;
mod detect;
mod intersect;
mod manifold;
mod near;
pub(crate) mod params;
mod rigid;
mod rigid_contacts;
pub(crate) mod row;
mod self_untangle;
mod stitched;
pub(crate) mod sums;
mod surfaces;
mod tangible;
mod tangle;
mod truncate;
mod untangle;
mod within;

pub(crate) use contacts::Between;
pub(crate) use row::ContactPart;
pub(crate) use tangible::Tangible;
