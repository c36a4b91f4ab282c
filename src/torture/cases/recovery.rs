//! Deformed bodies that must recover their rest shape.

use super::common::*;
use crate::solver::deform::Deformation;
use std::f64::consts::PI;

const fn again(
    name: &'static str,
    title: &'static str,
    about: &'static str,
    family: fn(u32) -> Vec<Member>,
    how: fn(&Member) -> Deformation,
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
    }
}

fn solids(times: u32) -> Vec<Member> {
    Axes::all(family::SOLIDS).members(times)
}

fn all_kinds(times: u32) -> Vec<Member> {
    family::of(
        times,
        &[
            Axes::all(family::SOLIDS),
            Axes::all(family::CLOTHS),
            Axes::all(family::ROPES),
        ],
    )
}

pub const SQUASHED: Case = again(
    "squashed",
    "Squashed flat",
    "All heights are made equal. Within 2 s no element is inverted and the body has its rest shape within 1 % of its size; the edges of cloth and rope are within 1 % of their rest lengths.",
    all_kinds,
    |_| Deformation::Squash(0.0),
);

pub const POINT: Case = again(
    "point",
    "Collapsed to a point",
    "All particles are moved to one point. Same limits as “Squashed flat”.",
    all_kinds,
    |_| Deformation::Scale(0.0),
);

pub const LINE: Case = again(
    "line",
    "Collapsed to a line",
    "All particles are moved to one vertical line. Same limits as “Squashed flat”.",
    all_kinds,
    |_| Deformation::Line,
);

pub const SHUFFLED: Case = Case {
    seconds: patience,
    judge: |run| Ok(shape_figures(&run.end.bodies[0], 0.02)),
    ..again(
        "shuffled",
        "Scrambled",
        "Every particle is moved to a random position in the bounding box of the body. Same limits as “Squashed flat”, but 2 % within 5 s, or longer for soft solids and for many links with few iterations.",
        all_kinds,
        |member| Deformation::Shuffle(member.seed),
    )
};

pub const MIRRORED: Case = Case {
    seconds: |_| 5.0,
    judge: |run| Ok(shape_figures(&run.end.bodies[0], 0.02)),
    ..again(
        "mirrored",
        "Mirrored",
        "Left and right are swapped, which inverts every element. Same limits as “Squashed flat”, but 2 % within 5 s.",
        solids,
        |_| Deformation::Mirror,
    )
};

pub const INSIDE_OUT: Case = Case {
    seconds: |_| 5.0,
    judge: |run| Ok(shape_figures(&run.end.bodies[0], 0.02)),
    ..again(
        "inside_out",
        "Turned inside out",
        "All heights are multiplied by −1.5, and so are the volumes. Same limits as “Squashed flat”, but 2 % within 5 s.",
        solids,
        |_| Deformation::Squash(-1.5),
    )
};

/// Time to recover [s]: 5, but longer where
///
/// - a solid has a compliance of 10 mm/N or more: its softest motion, 1000 kg on the four corners
///   of a cube with a damping of τ = 0.1 s, loses a factor e of its speed in 2mα/τ = 50 s;
/// - the error of n links propagates by one link per iteration. Gauss–Seidel leaves 1 − π²/n² of
///   it, so that seven factors e, from ten times the length to 1 %, take 7n²/π² iterations.
fn patience(member: &Member) -> f64 {
    let iterations = 60.0 * f64::from(member.substeps * member.iterations);
    let slow = match member.shape {
        Shape::Rope(links) | Shape::Cloth(links) => {
            7.0 * f64::from(links * links) / (PI * PI) / iterations
        }
        _ if is_solid(member) && member.compliance >= 1e-2 => 60.0,
        _ => 0.0,
    };
    slow.max(5.0)
}

/// Linear drag that stops the rotation of bodies after fast expansion [1/s].
const MEDIUM: f32 = 1.0;

pub const TENFOLD: Case = Case {
    seconds: patience,
    during: |_, world| medium(world, MEDIUM),
    ..again(
        "tenfold",
        "Stretched tenfold",
        "All distances are multiplied by ten, with linear drag of 1/s. The energy never exceeds the initial energy. Same limits as “Squashed flat” within 5 s, or longer as for “Scrambled”. (Without drag the body may keep rotating, which stretches it.)",
        all_kinds,
        |_| Deformation::Scale(10.0),
    )
};
