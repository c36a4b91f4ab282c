//! What a force is.

use crate::topology::Topology;
use glam::DVec3;

/// A particle as a force sees it.
#[derive(Debug, Clone, Copy, PartialEq)]
pub struct Mote {
    /// Position [m].
    pub x: DVec3,
    /// Velocity [m/s].
    pub v: DVec3,
    /// Inverse mass [1/kg]; 0 for what does not move.
    pub w: f64,
}

/// When a force acts.
#[derive(Debug, Clone, Copy, PartialEq)]
pub struct Moment {
    /// Start of the substep [s].
    pub time: f64,
    /// Length of the substep [s].
    pub h: f64,
}

/// A force from outside.
pub trait Force: Copy {
    /// Which one it is.
    const KIND: ForceKind;

    /// Tells `push` by how much it changes the velocities of which particles [m/s], those of the
    /// body being `at(i)`, which shows what it has been told already. Particles that do not move may
    /// be told too.
    fn act(
        &self,
        topology: &Topology,
        moment: Moment,
        at: impl Fn(u32) -> Mote,
        push: impl FnMut(u32, DVec3),
    );
}

/// Something to be done with each force on a body, whatever its type.
pub trait VisitForces {
    /// Does it.
    fn visit<F: Force>(&mut self, force: &F);
}

/// Makes the kinds of forces.
macro_rules! kinds {
    (
        { forces { $($force:ident $field:ident $does:literal;)* } $($others:tt)* }
        $($rest:tt)*
    ) => {
        /// The forces, in the order in which they act.
        #[derive(Debug, Clone, Copy, PartialEq, Eq, PartialOrd, Ord)]
        pub enum ForceKind {
            $(#[doc = concat!("[`", stringify!($force), "`].")] $force,)*
        }

        impl ForceKind {
            /// All of them.
            pub const ALL: [Self; [$(Self::$force),*].len()] = [$(Self::$force),*];
            /// How many there are.
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
