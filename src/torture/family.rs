//! Families of members: each parameter varied on its own from the default, and random mixtures of
//! all.

use super::{Member, Shape};
use crate::solver::deform::Random;

/// Values of each parameter. The first is the default.
#[derive(Debug, Clone, Copy)]
pub struct Axes {
    /// Shapes.
    pub shapes: &'static [Shape],
    /// Lengths [m].
    pub scales: &'static [f32],
    /// Compliances [m/N at 1 m] with dampings [s].
    pub materials: &'static [(f32, f32)],
    /// Substeps and iterations.
    pub steps: &'static [(u32, u32)],
    /// Seeds.
    pub seeds: &'static [u32],
    /// Number of random mixtures.
    pub mixtures: u32,
}

/// From a millimeter to a kilometer.
pub const SCALES: &[f32] = &[1.0, 1e-3, 1e-2, 0.1, 10.0, 100.0, 1e3];

/// From 1 to 32 substeps.
pub const STEPS: &[(u32, u32)] = &[
    (10, 1),
    (1, 1),
    (2, 1),
    (4, 1),
    (8, 1),
    (16, 1),
    (32, 1),
    (4, 4),
    (1, 16),
];

/// Rigid, and of increasing compliance; soft materials are damped, otherwise they would keep
/// vibrating.
pub const MATERIALS: &[(f32, f32)] = &[
    (0.0, 0.0),
    (0.0, 0.02),
    (1e-6, 0.02),
    (1e-5, 0.02),
    (1e-4, 0.02),
    (1e-3, 0.05),
    (1e-2, 0.1),
];

/// Solids from small to large.
pub const SOLIDS: &[Shape] = &[
    Shape::Cube(3),
    Shape::Tetrahedron,
    Shape::Cube(1),
    Shape::Cube(2),
    Shape::Cube(5),
    Shape::Ball(4),
    Shape::Ball(6),
    Shape::Ring(4),
    Shape::Bar(8),
    Shape::Cube(8),
    Shape::Bunny,
];

/// Cloths from small to large.
pub const CLOTHS: &[Shape] = &[
    Shape::Cloth(10),
    Shape::Cloth(1),
    Shape::Cloth(3),
    Shape::Cloth(20),
    Shape::Cloth(40),
    Shape::Cloth(63),
];

/// Ropes from short to long.
pub const ROPES: &[Shape] = &[
    Shape::Rope(16),
    Shape::Rope(1),
    Shape::Rope(2),
    Shape::Rope(4),
    Shape::Rope(64),
];

impl Axes {
    /// The full ranges, for these shapes.
    #[must_use]
    pub const fn all(shapes: &'static [Shape]) -> Self {
        Self {
            shapes,
            scales: SCALES,
            materials: MATERIALS,
            steps: STEPS,
            seeds: &[1, 2, 3, 4],
            mixtures: 40,
        }
    }

    /// The members that differ from the default in one parameter, then `times` as many mixtures. A
    /// quick run includes the members that are not large, and every fourth mixture.
    #[must_use]
    pub fn members(&self, times: u32) -> Vec<Member> {
        let ordinary = self.pick(0, 0, 0, 0, 0);
        let mut members = Vec::new();
        let mut add = |member: Member| {
            let known = |other: &Member| {
                Member {
                    quick: member.quick,
                    ..*other
                } == member
            };
            if !members.iter().any(known) {
                members.push(member);
            }
        };
        add(ordinary);
        for i in 0..self.shapes.len() {
            add(self.pick(i, 0, 0, 0, 0));
        }
        for i in 0..self.scales.len() {
            add(self.pick(0, i, 0, 0, 0));
        }
        for i in 0..self.materials.len() {
            add(self.pick(0, 0, i, 0, 0));
        }
        for i in 0..self.steps.len() {
            add(self.pick(0, 0, 0, i, 0));
        }
        for i in 0..self.seeds.len() {
            add(self.pick(0, 0, 0, 0, i));
        }
        let mut random = Random::new(self.mixtures);
        let mut any = |count: usize| (random.next() * count as f32) as usize;
        for index in 0..self.mixtures * times {
            let mut member = self.pick(
                any(self.shapes.len()),
                any(self.scales.len()),
                any(self.materials.len()),
                any(self.steps.len()),
                any(self.seeds.len()),
            );
            member.quick &= index % 4 == 0;
            add(member);
        }
        members
    }

    fn pick(
        &self,
        shape: usize,
        scale: usize,
        material: usize,
        step: usize,
        seed: usize,
    ) -> Member {
        let shape = self.shapes[shape];
        let (compliance, damping) = self.materials[material];
        let (substeps, iterations) = self.steps[step];
        Member {
            scale: self.scales[scale],
            compliance,
            damping,
            substeps,
            iterations,
            seed: self.seeds[seed],
            quick: !shape.is_large(),
            ..Member::of(shape)
        }
    }
}

/// Concatenates the members of several families.
#[must_use]
pub fn of(times: u32, axes: &[Axes]) -> Vec<Member> {
    axes.iter().flat_map(|it| it.members(times)).collect()
}

/// Every member with each of the variants.
#[must_use]
pub fn variants(members: &[Member], variants: &[&'static str]) -> Vec<Member> {
    let with = |member: &Member| {
        let member = *member;
        variants
            .iter()
            .map(move |variant| Member { variant, ..member })
    };
    members.iter().flat_map(with).collect()
}

/// Every member with each of the values.
#[must_use]
pub fn values(members: &[Member], values: &[f64]) -> Vec<Member> {
    let with = |member: &Member| {
        let member = *member;
        values.iter().map(move |&value| Member { value, ..member })
    };
    members.iter().flat_map(with).collect()
}
