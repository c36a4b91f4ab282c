//! The built-in problems, compiled into the program, so that an installed binary needs no data
//! folder.

/// A built-in problem.
#[derive(Debug, Clone, Copy, PartialEq, Eq)]
#[non_exhaustive]
pub struct BuiltinProblem {
    /// Its name in commands.
    pub name: &'static str,
    /// The text of its file.
    pub text: &'static str,
}

macro_rules! problems {
    ($($name:literal),* $(,)?) => {
        &[$(BuiltinProblem {
            name: $name,
            text: include_str!(concat!("../../assets/study/", $name, ".ron")),
        }),*]
    };
}

/// All of them, in the order of the report.
pub const PROBLEMS: &[BuiltinProblem] = problems![
    "hanging_mass",
    "spring_period",
    "spring_energy",
    "spring_period_bdf2",
    "spring_energy_bdf2",
    "shape_period",
    "pendulum_period",
    "pendulum_energy",
    "chain_0",
    "chain_1e-5",
    "chain_1e-4",
    "chain_1e-3",
    "chain_1e-2",
    "hanging_bar",
    "hanging_strip",
    "hanging_weave",
    "uniaxial_pull",
    "uniaxial_narrowing",
    "catenary",
    "clamped_strip",
    "rod_elastica",
    "buckled_column",
    "helix_spring",
    "rod_l_beam",
    "rod_torsion",
    "twisted_ring",
    "plectoneme",
    "cantilever_4",
    "cantilever_8",
    "cantilever_16",
    "fem_beam",
    "twisted_bar",
    "bulk_block",
    "rubber_hanging",
    "rubber_narrowing",
    "rubber_block",
    "flight_momentum",
    "flight_spin",
    "flight_spin_kept",
    "jelly_cube",
    "sliding_block",
    "capstan",
    "rigid_stack",
    "jelly_pair",
    "torn_strip",
];

/// A problem by its name.
#[must_use]
pub fn find(name: &str) -> Option<&'static BuiltinProblem> {
    PROBLEMS.iter().find(|problem| problem.name == name)
}

/// All names, for messages.
#[must_use]
pub fn names() -> String {
    let names: Vec<_> = PROBLEMS.iter().map(|problem| problem.name).collect();
    names.join(", ")
}
