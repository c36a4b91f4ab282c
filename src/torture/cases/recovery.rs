//! Bodies that are put out of shape and must come back.

use super::*;
use crate::solver::Deformation;

const fn again(
    name: &'static str,
    title: &'static str,
    about: &'static str,
    family: fn() -> Vec<Member>,
    how: fn(&Member) -> Deformation,
    marks: &'static [Mark],
) -> Case {
    Case {
        name,
        title,
        about,
        seconds: |_| 2.0,
        family,
        start: Start::Deform(how),
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

/// What is soft, or of uneven elements, needs longer.
const SWINGS: Mark = Mark {
    applies: is_solid,
    reason: "soft edges swing on, and 1970 uneven elements are on their way, for longer than the time given; of members that a quick run leaves out",
};

/// A sweep carries a correction one link on.
const SLOW: Mark = Mark {
    applies: |member| member.shape == Shape::Rope(64),
    reason: "a sweep carries what a link lacks to the next: 64 links need longer than the time given, more so if damped",
};

pub const SQUASHED: Case = again(
    "squashed",
    "Squashed flat",
    "All heights are made the same. Within 2 s no element is inside out and the body is its rest shape within 1 % of its size; the edges of cloth and rope are within 1 % of their lengths.",
    all_kinds,
    |_| Deformation::Squash(0.0),
    &[FOLDS],
);

pub const POINT: Case = again(
    "point",
    "Collapsed to a point",
    "All particles are in one place. As squashed.",
    all_kinds,
    |_| Deformation::Scale(0.0),
    &[Mark {
        applies: is_cloth,
        ..FOLDS
    }],
);

pub const LINE: Case = again(
    "line",
    "Collapsed to a line",
    "All particles are on one vertical line. As squashed.",
    all_kinds,
    |_| Deformation::Line,
    &[
        FOLDS,
        Mark {
            applies: |member| !member.quick && is_cloth(member),
            ..FOLDS
        },
    ],
);

pub const SHUFFLED: Case = Case {
    seconds: |_| 5.0,
    judge: |run| Ok(shape_figures(&run.end.bodies[0], 0.02)),
    ..again(
        "shuffled",
        "Every particle anywhere",
        "Every particle is put anywhere in the body's box. Within 5 s as squashed, within 2 %.",
        all_kinds,
        |member| Deformation::Shuffle(member.seed),
        &[
            FOLDS,
            Mark {
                applies: |member| !member.quick && is_solid(member) && member.compliance >= 1e-2,
                ..SWINGS
            },
            Mark {
                applies: |member| {
                    !member.quick && member.shape == Shape::Rope(64) && member.damping > 0.0
                },
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
        |_| Deformation::Mirror,
        &[],
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
        |_| Deformation::Squash(-1.5),
        &[],
    )
};

pub const TENFOLD: Case = Case {
    seconds: |_| 5.0,
    ..again(
        "tenfold",
        "Stretched tenfold and let go",
        "All distances are ten times what they were. It never has more energy than at first, and within 5 s as squashed.",
        all_kinds,
        |_| Deformation::Scale(10.0),
        &[
            Mark {
                applies: |member| {
                    let soft = member.compliance > 0.0 || member.damping > 0.0;
                    !member.quick && is_solid(member) && (soft || member.shape == Shape::Bunny)
                },
                ..SWINGS
            },
            FOLDS,
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
