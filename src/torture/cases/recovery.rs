//! Bodies that are put out of shape and must come back.

use super::*;
use crate::solver::{Deformation, deform};

const fn again(
    name: &'static str,
    title: &'static str,
    about: &'static str,
    family: fn() -> Vec<Member>,
    start: fn(&Member, &mut World) -> Result<(), TortureError>,
    marks: &'static [Mark],
) -> Case {
    Case {
        name,
        title,
        about,
        seconds: |_| 2.0,
        family,
        start,
        during: nothing,
        judge: |run| Ok(shape_figures(&run.end.bodies[0], 0.01)),
        outside: Outside::Nothing,
        any_body: true,
        marks,
    }
}

fn solids() -> Vec<Member> {
    Axes::all(family::SOLIDS).members()
}

fn all_kinds() -> Vec<Member> {
    family::of(&[
        Axes::all(family::SOLIDS),
        Axes::all(family::CLOTHS),
        Axes::all(family::ROPES),
    ])
}

/// The mesh with elements of all forms.
const UNEVEN: Mark = Mark {
    applies: |member| member.shape == Shape::Bunny,
    reason: "a mesh of 1970 uneven elements is still on its way back after the time given",
};

/// A sweep carries a correction one link on.
const SLOW: Mark = Mark {
    applies: |member| member.shape == Shape::Rope(64),
    reason: "a sweep carries what a link lacks to the next: 64 links need longer than the time given, more so if damped",
};

fn deformed(member: &Member, world: &mut World, how: Deformation) -> Result<(), TortureError> {
    for body in &mut world.bodies {
        stand_up(member, body);
        deform(&mut body.particles, how);
        body.tick_start.clone_from(&body.particles.positions);
    }
    Ok(())
}

pub const SQUASHED: Case = again(
    "squashed",
    "Squashed flat",
    "All heights are made the same. Within 2 s no element is inside out and the body is its rest shape within 1 % of its size; the edges of cloth and rope are within 1 % of their lengths.",
    all_kinds,
    |member, world| deformed(member, world, Deformation::Squash(0.0)),
    &[
        Mark {
            applies: |member| is_solid(member) && member.compliance >= 1e-4,
            ..SWINGS
        },
        UNEVEN,
        FOLDS,
    ],
);

pub const POINT: Case = again(
    "point",
    "Collapsed to a point",
    "All particles are in one place. As squashed.",
    all_kinds,
    |member, world| deformed(member, world, Deformation::Scale(0.0)),
    &[
        BOILS,
        SWINGS,
        Mark {
            applies: is_cloth,
            ..FOLDS
        },
    ],
);

pub const LINE: Case = again(
    "line",
    "Collapsed to a line",
    "All particles are on one vertical line. As squashed.",
    all_kinds,
    |member, world| deformed(member, world, Deformation::Line),
    &[BOILS, SWINGS, FOLDS],
);

pub const SHUFFLED: Case = Case {
    seconds: |_| 5.0,
    judge: |run| Ok(shape_figures(&run.end.bodies[0], 0.02)),
    ..again(
        "shuffled",
        "Every particle anywhere",
        "Every particle is put anywhere in the body's box. Within 5 s as squashed, within 2 %.",
        all_kinds,
        |member, world| deformed(member, world, Deformation::Shuffle(member.seed)),
        &[
            BOILS,
            SWINGS,
            FOLDS,
            Mark {
                applies: |member| member.shape == Shape::Rope(64) && member.damping > 0.0,
                ..SLOW
            },
        ],
    )
};

pub const MIRRORED: Case = Case {
    seconds: |_| 5.0,
    judge: |run| Ok(shape_figures(&run.end.bodies[0], 0.02)),
    ..again(
        "mirrored",
        "Mirrored",
        "Left and right are swapped, so that every element is inside out. Within 5 s as squashed, within 2 %.",
        solids,
        |member, world| deformed(member, world, Deformation::Mirror),
        &[SWINGS],
    )
};

pub const INSIDE_OUT: Case = Case {
    seconds: |_| 5.0,
    judge: |run| Ok(shape_figures(&run.end.bodies[0], 0.02)),
    ..again(
        "inside_out",
        "Turned inside out",
        "Turned upside down through itself to −1.5 times its height, and so its volume. Within 5 s as squashed, within 2 %.",
        solids,
        |member, world| deformed(member, world, Deformation::Squash(-1.5)),
        &[SWINGS],
    )
};

pub const TENFOLD: Case = Case {
    seconds: |_| 5.0,
    ..again(
        "tenfold",
        "Stretched tenfold and let go",
        "All distances are ten times what they were. It never has more energy than at first, and within 5 s as squashed.",
        all_kinds,
        |member, world| deformed(member, world, Deformation::Scale(10.0)),
        &[
            SWINGS,
            UNEVEN,
            Mark {
                applies: can_fold,
                reason: "a large flat cloth that nothing holds gathers speed out of rounding, and explodes where it is rigid, undamped and has 64² particles; a smaller one folds as it shrinks and stays folded",
            },
            SLOW,
            Mark {
                applies: |member| {
                    member.shape == Shape::Rope(16)
                        && member.substeps == 1
                        && member.iterations == 1
                },
                reason: "one sweep a tick leaves 1.3 % where the whirling rope pulls",
            },
        ],
    )
};
