//! The table of effects, and the effects of a body.
//!
//! [`effects!`](crate::effects) is the only list of effects. It passes the list to a macro, which
//! generates what is needed per effect.

pub(crate) mod bend;
pub(crate) mod body_effect;
pub(crate) mod body_emitter;
pub(crate) mod body_kinds;
pub(crate) mod carried;
pub(crate) mod contact;
pub(crate) mod controls;
pub(crate) mod direct;
pub mod elastic;
pub(crate) mod elastic_kind;
pub(crate) mod emitter;
pub(crate) mod external;
pub mod force;
pub(crate) mod free;
pub(crate) mod grab;
pub(crate) mod grabs;
pub(crate) mod grains;
pub(crate) mod isometric_bend;
pub(crate) mod kinds;
pub(crate) mod membrane;
pub(crate) mod neo_hookean;
pub(crate) mod pin_targets;
pub(crate) mod plasticity;
pub(crate) mod pressure;
pub(crate) mod rigid;
pub(crate) mod rod;
pub(crate) mod shape_matching;
pub(crate) mod sink;
pub(crate) mod states;
pub(crate) mod stitches;
pub(crate) mod strain_limit;
pub(crate) mod stretch;
pub(crate) mod struts;
pub(crate) mod tear;
pub(crate) mod tethers;
pub(crate) mod volume;
pub(crate) mod weave;
pub(crate) mod workspace;

/// The types of effects under their own names; those of forces are in `force`.
pub(crate) mod all {
    pub use super::{
        bend::Bend,
        body_emitter::BodyEmitter,
        contact::{Contact, SelfContact},
        direct::Direct,
        emitter::Emitter,
        grab::{Glide, Grab, GrabState, Hold},
        grains::{Grains, GrainsState},
        isometric_bend::IsometricBend,
        membrane::Membrane,
        neo_hookean::NeoHookean,
        plasticity::Plasticity,
        pressure::{Pressure, PressureState},
        rigid::{
            collide::Collide,
            ground::{Ground, StickyGround},
            multiplier::ContactMultiplier,
        },
        rod::{MAX_MEETING_EDGES, MAX_RINGS, NotARod, Rod, RodLink, RodShape, RodState},
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

pub use crate::kernel::geometry::volume_and_gradients;
pub use crate::kernel::multipliers::Multipliers;
pub use body_effect::BodyPhase;
pub use neo_hookean::strains;
pub use shape_matching::{MatchedParticle, MatchingPass};

/// The table of effects, in the order in which they act. Calls the given macro with all of them, in
/// groups, each with its type, its name in files, for elastic effects the numbers of particles and
/// of equations per element, and a description.
///
/// `Stitches` and `Grab` are outside of the groups: stitches are not part of [`Effects`](crate::Effects), as a body
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
                masks {
                    ForceMask force_mask "The part of the body on which its force fields act.";
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
                    Tear tear "Splits the body where a limit is exceeded.";
                    Emitter emitter "Grains flow out of an opening.";
                    BodyEmitter body_emitter "Emits copies of the body from a round opening.";
                    Sink sink "Removes grains and whole bodies in a box.";
                }
            }
        }
    };
}
