//! Interface of external forces.

use crate::Topology;
use glam::DVec3;

/// A particle on which a force acts.
#[derive(Debug, Clone, Copy, PartialEq)]
pub struct Mote {
    /// Position [m].
    pub x: DVec3,
    /// Velocity [m/s].
    pub v: DVec3,
    /// Inverse mass [1/kg]; 0 for fixed particles.
    pub w: f64,
}

/// Time of a force evaluation.
#[derive(Debug, Clone, Copy, PartialEq)]
pub struct Moment {
    /// Start of the substep [s].
    pub time: f64,
    /// Length of the substep [s].
    pub h: f64,
    /// Gravity [m/s²], which the first stage adds to velocities after the forces.
    pub gravity: DVec3,
}

impl Moment {
    /// Velocity that a particle with the velocity `v` would have at the end of the substep without the
    /// force [m/s]. A force that depends on the velocity is implicit in that, so that it balances
    /// gravity exactly at terminal speed, however long the substep is.
    pub(super) fn coasting(&self, v: DVec3) -> DVec3 {
        v + self.gravity * self.h
    }
}

/// What acts on a particle from several elements.
#[derive(Debug, Clone, Copy, Default, PartialEq)]
pub struct Load {
    /// Force [N].
    pub force: DVec3,
    /// By how much it decreases with the velocity [N·s/m].
    pub stiffness: f64,
}

/// Fraction of the difference u − v to the velocity of the air that a particle takes in a substep of
/// dv/dt = c (u − v): implicit, so that it is stable for any coupling c [1/s].
pub(super) fn approach(coupling: f64, moment: Moment) -> f64 {
    let way = coupling * moment.h;
    way / (1.0 + way)
}

/// An external force.
pub trait Force: Copy {
    /// Kind of the force.
    const KIND: ForceKind;

    /// Calls `push` with the velocity changes of particles [m/s]. `at(i)` is the state of a
    /// particle of the body, including earlier calls. Fixed particles may be included. `loads` is
    /// memory for a force on elements, from call to call.
    fn act(
        &self,
        topology: &Topology,
        moment: Moment,
        at: impl Fn(u32) -> Mote,
        loads: &mut Vec<Load>,
        push: impl FnMut(u32, DVec3),
    );
}

/// A visitor of the forces on a body, generic over their types.
pub trait VisitForces {
    /// Visits one force.
    fn visit<F: Force>(&mut self, force: &F);
}

/// Generates the kinds of forces.
macro_rules! kinds {
    (
        { forces { $($force:ident $field:ident $does:literal;)* } $($others:tt)* }
        $($rest:tt)*
    ) => {
        /// The forces, in the order in which they act.
        #[derive(Debug, Clone, Copy, PartialEq, Eq, PartialOrd, Ord)]
        pub enum ForceKind {
            $(#[doc = concat!("[`", stringify!($force), "`](crate::", stringify!($force), ").")] $force,)*
        }

        impl ForceKind {
            /// All of them.
            pub const ALL: [Self; [$(Self::$force),*].len()] = [$(Self::$force),*];
            /// Number of kinds.
            pub const COUNT: usize = Self::ALL.len();

            /// Its name in files and commands.
            #[must_use]
            pub const fn name(self) -> &'static str {
                match self {
                    $(Self::$force => stringify!($field),)*
                }
            }
        }
    };
}

crate::effects!(kinds);
