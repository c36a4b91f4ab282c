//! Isolation: what happens to one body must not affect another.

use super::common::*;
use glam::Vec3;

fn members(times: u32) -> Vec<Member> {
    let members = |shapes| Axes {
        scales: &[1.0, 1e-3, 1e3],
        materials: &[(0.0, 0.0), (1e-5, 0.02)],
        steps: &[(10, 1), (1, 1), (32, 1), (4, 4)],
        seeds: &[1],
        mixtures: 0,
        ..Axes::all(shapes)
    };
    family::of(
        times,
        &[
            members(&[Shape::Cube(3), Shape::Tetrahedron]),
            members(&[Shape::Cloth(10)]),
            members(&[Shape::Rope(16)]),
        ],
    )
}

/// The body that is simulated alone and with others: released at 0.8 of its height.
fn first(member: &Member, world: &mut World) {
    let body = &mut world.bodies[0];
    stand_up(member, body);
    place(body, |x| Vec4::new(x.x, 0.8 * x.y, x.z, x.w));
}

/// How many of its numbers differ from those of the same body simulated alone.
fn disturbed(run: &Run) -> Result<Figure, TortureError> {
    let mut alone = run.member.world()?;
    first(run.member, &mut alone);
    catch_up(&mut alone, &run.end);
    let differ = different_bits(&alone.bodies[0], &run.end.bodies[0]);
    Ok(Figure::none(
        "particles of another disturbed",
        differ,
        "particles",
    ))
}

/// Tick at which it is made non-finite.
const POISONED: u64 = 10;

pub const NOT_FINITE: Case = Case {
    name: "not_finite",
    title: "NaN and infinity",
    about: "A position, a velocity or a mass of one body becomes NaN or ∞. The body is quarantined and the vertex is named; another body stays bit-identical to a run on its own.",
    seconds: |_| 0.5,
    family: |times| {
        let bad = [
            "nan_position",
            "infinite_position",
            "nan_velocity",
            "infinite_velocity",
            "nan_mass",
            "infinite_mass",
        ];
        family::variants(&members(times), &bad)
    },
    start: Start::Make(|member, world| {
        first(member, world);
        add_copy(world, Vec3::X * 2.0);
        Ok(())
    }),
    during: |member, world| {
        if world.tick != POISONED {
            return Ok(());
        }
        let particles = &mut world.bodies[1].particles;
        let number = if member.variant.starts_with("nan") {
            f32::NAN
        } else {
            f32::INFINITY
        };
        let last = particles.len() - 1;
        match member.variant.split_once('_') {
            Some((_, "position")) => particles.positions[last].y = number,
            Some((_, "velocity")) => particles.set_velocity(last, Vec3::Y * number),
            _ => particles.positions[last].w = number,
        }
        Ok(())
    },
    judge: |run| {
        let body = &run.end.bodies[1];
        let last = body.topology.vertex(body.particles.len() - 1);
        let named = body
            .quarantine
            .as_ref()
            .is_some_and(|quarantine| quarantine.vertex == last);
        let finite = body.particles.first_not_finite().is_none();
        Ok(vec![
            Figure::none(
                "bodies not caught",
                usize::from(!(named && finite)),
                "bodies",
            ),
            disturbed(run)?,
        ])
    },
    outside: Outside::Poison,
    any_body: false,
};

pub const CROWD: Case = Case {
    name: "crowd",
    title: "Adding and removing bodies",
    about: "Bodies are added and removed while another moves. That one stays bit-identical to a run on its own.",
    seconds: |_| 1.0,
    family: members,
    start: Start::Make(|member, world| {
        first(member, world);
        Ok(())
    }),
    during: |_, world| {
        match world.tick {
            5 | 8 | 20 => add_copy(world, Vec3::X * world.tick as f32),
            12 | 30 => drop(world.bodies.remove(1)),
            _ => {}
        }
        Ok(())
    },
    judge: |run| Ok(vec![disturbed(run)?]),
    outside: Outside::Work,
    any_body: false,
};
