//! The table of effects, and the effects that a body carries.
//!
//! [`effects!`](crate::effects) is the only list of effects. It passes the list to a macro, which generates what is
//! needed per effect.

pub mod bend;
pub mod elastic;
pub mod force;
pub mod grab;
pub mod isometric_bend;
pub mod kinds;
pub mod lambdas;
pub mod membrane;
pub mod multipliers;
pub mod neo_hookean;
pub mod plasticity;
pub mod pressure;
pub mod shape_matching;
pub mod stitches;
pub mod strain_limit;
pub mod stretch;
pub mod struts;
pub mod tethers;
pub mod volume;
pub mod weave;

pub use multipliers::Multipliers;

use crate::{ElasticKind, Method, Substep, Topology, WorkEstimate};
use serde::{Deserialize, Serialize};

/// The table of effects, in the order in which they act: calls the macro that it is given with all of them, in
/// groups, each with its type, its name in files, for elastic effects the numbers of particles and of equations of
/// an element, and what it does.
///
/// `Stitches` and `Grab` are outside of the groups: stitches are no part of [`Effects`], as a body can have many, and a
/// grab is no part of a scene.
#[macro_export]
macro_rules! effects {
    ($make:path) => {
        $make! {
            {
                forces {
                    Uniform uniform "Constant acceleration.";
                    Attract attract "Attraction to a point.";
                    Vortex vortex "Air rotating about a vertical axis.";
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
                contacts {
                    Contact contact "Contact with other bodies.";
                    SelfContact self_contact "Contact of the body with itself.";
                    Ground ground "Ground plane with friction and restitution.";
                    StickyGround sticky_ground "Ground plane that holds what touches it.";
                    Collide collide "Contact with rigid colliders.";
                }
                rest_values {
                    Plasticity plasticity "Strain beyond the yield strain becomes permanent.";
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
        /// The effects that a body carries; what is absent costs nothing.
        #[derive(Debug, Clone, Copy, PartialEq, Default, Serialize, Deserialize)]
        pub struct Effects {
            $($(#[doc = $does1] pub $field1: Option<crate::$kind1>,)*)*
            $($(#[doc = $does2] pub $field2: Option<crate::$kind2>,)*)*
            /// The body is held by a spring.
            pub $grabbed: Option<crate::$grab>,
            $($(#[doc = $does3] pub $field3: Option<crate::$kind3>,)*)*
        }
    };
}

effects!(carried_by_a_body);

impl Effects {
    /// Whether it is carried, and sweeps of a method go over its constraints.
    #[must_use]
    pub fn sweeps(&self, kind: ElasticKind, method: Method) -> bool {
        self.has(kind) && !(self.is_direct(method) && kind.is_solved_directly())
    }

    /// Whether the body is solved directly in a world of this method.
    #[must_use]
    pub fn is_direct(&self, method: Method) -> bool {
        self.direct.is_some() && method.has_direct()
    }

    /// Whether passes over ground and colliders have to know what earlier ones have done, in substeps like this one.
    pub(crate) fn keeps_rigid_contacts(&self, step: &Substep) -> bool {
        let is_any = self.ground.is_some() || self.collide.is_some();
        is_any && (self.resists_rolling() || step.contact_passes() > 1)
    }

    /// Whether the ground resists that the body rolls.
    pub(crate) fn resists_rolling(&self) -> bool {
        self.ground
            .is_some_and(|ground| ground.rolling_resistance.get() > 0.0)
    }

    /// Whether the body can touch others or itself.
    #[must_use]
    pub fn can_touch(&self) -> bool {
        self.contact.is_some() || self.self_contact.is_some()
    }

    /// How many constraints a body with these effects has; a filling is one, and so are the regions
    /// whose shapes are matched, all together.
    #[must_use]
    pub fn constraints(&self, topology: &Topology) -> usize {
        let carried = ElasticKind::ALL.into_iter().filter(|&kind| self.has(kind));
        let elastic: usize = carried.map(|kind| kind.elements(topology)).sum();
        let whole = [self.pressure.is_some(), self.shape_matching.is_some()];
        elastic + whole.into_iter().filter(|carried| *carried).count()
    }

    /// Estimated work of a number of iterations: pressure counts its triangles, shape matching its particles, other effects
    /// their constraints.
    #[must_use]
    pub fn load(&self, topology: &Topology, sweeps: usize) -> WorkEstimate {
        let pressure_state = self.pressure.map_or(0, |_| topology.triangles.len());
        let matched = self.shape_matching.map_or(0, |_| topology.particles());
        WorkEstimate {
            projections: (self.constraints(topology) + pressure_state + matched) * sweeps,
            pieces: topology.partitions.count(),
        }
    }
}
