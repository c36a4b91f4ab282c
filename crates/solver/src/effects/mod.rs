//! The table of effects, and the effects of a body.
//!
//! [`effects!`](crate::effects) is the only list of effects. It passes the list to a macro, which
//! generates what is needed per effect.

pub mod bend;
pub(crate) mod body_effect;
pub mod body_emitter;
pub mod body_kinds;
pub mod elastic;
pub mod emitter;
pub mod force;
pub mod grab;
pub mod grains;
pub mod isometric_bend;
pub mod kinds;
pub mod membrane;
pub mod multipliers;
pub mod neo_hookean;
pub mod plasticity;
pub mod pressure;
pub mod rod;
pub mod shape_matching;
pub mod sink;
pub mod states;
pub mod stitches;
pub mod strain_limit;
pub mod stretch;
pub mod struts;
pub mod tear;
pub mod tethers;
pub mod volume;
pub mod weave;

/// The types of effects under their own names; those of forces and of contacts are in [`force`] and
/// [`contact`](crate::contact).
pub mod all {
    pub use super::{
        bend::Bend,
        body_emitter::BodyEmitter,
        emitter::{Emission, Emitter, Flow},
        grab::{Glide, Grab, GrabState, Hold, SurfacePoint},
        grains::{Grains, GrainsState},
        isometric_bend::IsometricBend,
        membrane::Membrane,
        neo_hookean::NeoHookean,
        plasticity::Plasticity,
        pressure::Pressure,
        rod::{MAX_MEETING_EDGES, MAX_RINGS, NotARod, Rod, RodShape, RodState, SegmentState},
        shape_matching::{ShapeMatching, ShapeMatchingState},
        sink::Sink,
        stitches::{Stitch, StitchEnd, StitchError, Stitches},
        strain_limit::StrainLimit,
        stretch::Stretch,
        struts::Struts,
        tear::{Cut, Tear, TearState},
        tethers::{TetherTargets, Tethers},
        volume::Volume,
        weave::Weave,
    };
}

pub use body_effect::BodyPhase;
pub use multipliers::Multipliers;

use crate::{ElasticKind, Ground, Method, ShapeMatching, Topology, WorkEstimate};
use serde::{Deserialize, Serialize};

/// The table of effects, in the order in which they act. Calls the given macro with all of them, in
/// groups, each with its type, its name in files, for elastic effects the numbers of particles and
/// of equations per element, and a description.
///
/// `Stitches` and `Grab` are outside of the groups: stitches are not part of [`Effects`], as a body
/// can have many, and a grab is not part of a scene.
#[macro_export]
macro_rules! effects {
    ($make:path) => {
        $make! {
            {
                forces {
                    Uniform uniform "Constant acceleration.";
                    Attract attract "Attraction to a point.";
                    Vortex vortex "Air rotating about a vertical axis.";
                    Axis axis "Air flowing along, around and towards an axis.";
                    Stream stream "Air flowing along a curve.";
                    Turbulence turbulence "Air in random motion.";
                    Wind wind "Drag and lift on the triangles of the surface.";
                    Drag drag "Drag of a resting medium.";
                }
                solvers {
                    Direct direct "Sparse direct solver instead of Gauss–Seidel.";
                }
                elastic {
                    Stretch stretch (2, 1) "Edges resist changes of length.";
                    Bend bend (4, 1) "Bending stiffness by dihedral angles.";
                    IsometricBend isometric_bend (4, 1)
                        "Bending stiffness by a quadratic energy, for nearly inextensible cloth.";
                    Volume volume (4, 1) "Tetrahedra resist changes of volume.";
                    NeoHookean neo_hookean (4, 2) "Neo-Hookean elasticity of tetrahedra.";
                    Membrane membrane (3, 3)
                        "Isotropic in-plane elasticity of the triangles of the surface.";
                    Weave weave (3, 3)
                        "In-plane elasticity along warp, weft and bias.";
                    Struts struts (2, 1) "Springs between opposite points of the surface.";
                    StrainLimit strain_limit (2, 1) "Upper limit on the strain of edges.";
                }
                shapes {
                    ShapeMatching shape_matching
                        "Particles are pulled towards the fitted rest shape.";
                    Pressure pressure "Gas or liquid inside the closed surface.";
                }
            }
            Stitches stitches
            {
                pins {
                    Tethers tethers "Limit on the distance of particles from their nearest pin.";
                }
            }
            Grab grab
            {
                chains {
                    Rod rod "Edges resist stretching, shear, bending and twist.";
                }
                between {
                    Contact contact "Contact with other bodies.";
                    SelfContact self_contact "Contact of the body with itself.";
                }
                surfaces {
                    Grains grains "Contact of grains with each other.";
                    Ground ground "Ground plane with friction and restitution.";
                    StickyGround sticky_ground "Ground plane that holds what touches it.";
                    Collide collide "Contact with rigid colliders.";
                }
                changes {
                    Plasticity plasticity "Strain beyond the yield strain becomes permanent.";
                    Tear tear "Elements that carry too much break.";
                    Emitter emitter "Grains flow out of an opening.";
                    BodyEmitter body_emitter "Emits copies of the body from a round opening.";
                    Sink sink "Removes grains and whole bodies in a box.";
                }
            }
        }
    };
}

macro_rules! carried_by_a_body {
    (
        { $($first:ident { $($kind1:ident $field1:ident $(($($numbers:tt)*))? $does1:literal;)* })* }
        $stitches:ident $stitched:ident
        { $($second:ident { $($kind2:ident $field2:ident $does2:literal;)* })* }
        $grab:ident $grabbed:ident
        { $($third:ident { $($kind3:ident $field3:ident $does3:literal;)* })* }
    ) => {
        /// The effects of a body; absent effects cost nothing.
        #[derive(Debug, Clone, Copy, PartialEq, Default, Serialize, Deserialize)]
        pub struct Effects {
            $($(#[doc = $does1] pub $field1: Option<crate::$kind1>,)*)*
            $($(#[doc = $does2] pub $field2: Option<crate::$kind2>,)*)*
            /// Grab of the body by a spring.
            pub $grabbed: Option<crate::$grab>,
            $($(#[doc = $does3] pub $field3: Option<crate::$kind3>,)*)*
        }
    };
}

effects!(carried_by_a_body);

impl Effects {
    /// Whether it is present, and iterations of this method project its constraints.
    #[must_use]
    pub fn iterates(&self, kind: ElasticKind, method: Method) -> bool {
        self.has(kind) && !(self.is_direct(method) && kind.is_solved_directly())
    }

    /// Whether the body is solved directly in a world of this method: not where it carries
    /// [`Direct`](crate::Direct) with a tolerance that Gauss–Seidel meets.
    #[must_use]
    pub fn is_direct(&self, method: Method) -> bool {
        self.direct.is_some_and(|direct| !direct.yields) && method.has_direct()
    }

    /// The ground, if it has rolling resistance.
    pub(crate) fn rolling_ground(&self) -> Option<Ground> {
        self.ground
            .filter(|ground| ground.rolling_resistance.get() > 0.0)
    }

    /// Whether the body has contact with other bodies or itself.
    #[must_use]
    pub fn can_touch(&self) -> bool {
        self.contact.is_some() || self.self_contact.is_some()
    }

    /// Whether the body is rigid where it touches others, the ground and colliders: with contact,
    /// and with shape matching of its whole shape at the frequency ∞.
    #[must_use]
    pub fn is_rigid(&self) -> bool {
        let is_whole = |it: ShapeMatching| {
            it.frequency.get() == f32::INFINITY && it.region.get() == f32::INFINITY
        };
        self.contact.is_some() && self.shape_matching.is_some_and(is_whole)
    }

    /// Whether the surface of the body touches other surfaces, in a world with or without colliders
    /// that are meshes.
    #[must_use]
    pub fn touches_surfaces(&self, has_meshes: bool) -> bool {
        self.can_touch() || has_meshes && self.collide.is_some()
    }

    /// Number of constraints of a body with these effects; pressure counts as one, and so do all
    /// regions of shape matching together.
    #[must_use]
    pub fn constraints(&self, topology: &Topology) -> usize {
        self.elements(topology) + self.body_constraints(topology)
    }

    /// Number of elements of its elastic effects.
    fn elements(&self, topology: &Topology) -> usize {
        let carried = ElasticKind::ALL.into_iter().filter(|&kind| self.has(kind));
        carried.map(|kind| kind.elements(topology)).sum()
    }

    /// Work estimate of a number of iterations: pressure counts its triangles, shape matching its
    /// particles, other effects their constraints.
    #[must_use]
    pub fn load(&self, topology: &Topology, iterations: usize) -> WorkEstimate {
        let pass = self.elements(topology) + self.body_load(topology);
        WorkEstimate {
            projections: pass * iterations,
            pieces: topology.partitions.count(),
        }
    }
}
