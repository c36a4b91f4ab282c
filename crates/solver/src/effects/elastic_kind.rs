//! The elastic effects as a list.

/// Generates the kinds of elastic effects.
macro_rules! kinds {
    (
        {
            forces { $($force:tt)* }
            masks { $($mask:tt)* }
            solvers { $($solver:tt)* }
            elastic { $($effect:ident $field:ident ($corners:literal, $rows:literal) $does:literal;)* }
            $($others:tt)*
        }
        $($rest:tt)*
    ) => {
        /// The elastic effects, in the order in which they act within an iteration; on a body, those
        /// that are damped for longer act before.
        #[derive(Debug, Clone, Copy, PartialEq, Eq, PartialOrd, Ord)]
        pub enum ElasticKind {
            $(#[doc = concat!("[`", stringify!($effect), "`](crate::", stringify!($effect), ").")] $effect,)*
        }

        impl ElasticKind {
            /// All of them.
            pub const ALL: [Self; [$(Self::$effect),*].len()] = [$(Self::$effect),*];
            /// Number of kinds.
            pub const COUNT: usize = Self::ALL.len();

            /// Its name in files and commands.
            #[must_use]
            pub const fn name(self) -> &'static str {
                match self {
                    $(Self::$effect => stringify!($field),)*
                }
            }

            /// Number of particles per element.
            #[must_use]
            pub const fn corners(self) -> usize {
                match self {
                    $(Self::$effect => $corners,)*
                }
            }
        }
    };
}

crate::effects!(kinds);
